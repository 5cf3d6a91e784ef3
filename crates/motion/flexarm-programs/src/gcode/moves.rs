//! Moves of G-code: from the coordinates of a line to rapids, lines and arcs.
//!
//! Start at [`Gcode::motion_of_line`]. Coordinates are of the tool in the work frame B, in m, after
//! the unit of the program (G20, G21). Not here: arcs (`arcs`), feed and planes (`modes`).

use std::collections::HashMap;

use flexarm_path::program::{Blend, Configuration, Move, MoveKind, Speed, Target};
use flexarm_settings::Place;
use flexarm_spatial::Pose;
use nalgebra::{Translation3, Vector3};

use super::{FeedMode, Gcode, Motion};
use crate::Rotary;
use crate::common::frames::rotation_zyx;
use crate::common::{Result, Span, fail};

impl Gcode<'_> {
    /// Coordinates at the end of the line, in the work frame without offsets (m).
    pub(super) fn goal(&self, values: &HashMap<char, (f64, Span)>, absolute: bool) -> Result<[Option<f64>; 3]> {
        let mut goal = self.at;
        for (k, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            let Some((value, span)) = values.get(&letter) else { continue };
            goal[k] = match (self.relative && !absolute, goal[k]) {
                (false, _) => Some(value * self.unit),
                (true, Some(at)) => Some(at + value * self.unit),
                (true, None) if !self.has_moved => Some(value * self.unit),
                (true, None) => {
                    return fail(*span, "a relative move needs a position before it: move to X, Y and Z first");
                }
            };
        }
        Ok(goal)
    }

    fn rotary_words(&mut self, values: &HashMap<char, (f64, Span)>) -> Result<()> {
        for (k, letter) in ['A', 'B', 'C'].into_iter().enumerate() {
            let Some((value, span)) = values.get(&letter) else { continue };
            if self.recorder.options.gcode.rotary == Rotary::Refused {
                if *value == 0.0 {
                    continue;
                }
                return fail(
                    *span,
                    "rotary axes are not read as they are: if A, B and C tilt the tool, say so (`rotary`)",
                );
            }
            let angle = value.to_radians();
            self.rotary[k] = if self.relative { self.rotary[k] + angle } else { angle };
        }
        Ok(())
    }

    /// Adds the move of a line, if it has coordinates.
    pub(super) fn motion_of_line(
        &mut self,
        codes: &[(i32, Span)],
        values: &HashMap<char, (f64, Span)>,
        span: Span,
    ) -> Result<()> {
        if !['X', 'Y', 'Z', 'A', 'B', 'C', 'I', 'J', 'K', 'R'].iter().any(|letter| values.contains_key(letter)) {
            return Ok(());
        }
        // G53 (code 530): machine coordinates, for absolute lines only.
        let in_machine = codes.iter().any(|(code, _)| *code == 530);
        let Some(motion) = self.motion else {
            return fail(span, "coordinates without G0, G1, G2 or G3 in force: put one before them");
        };
        // An arc must leave the rotary axes unchanged.
        let before = self.rotary;
        self.rotary_words(values)?;
        let is_arc = matches!(motion, Motion::Clockwise | Motion::Counterclockwise);
        if in_machine && (is_arc || self.relative) {
            return fail(span, "G53 goes with G0 and G1 and with G90 only");
        }
        let feed = self.feed_of(values, motion, span)?;
        if in_machine {
            return self.machine_move(values, feed, span);
        }
        // Arcs keep the orientation of the tool; all other moves are lines.
        let goal = self.goal(values, false)?;
        if is_arc {
            if before != self.rotary {
                return fail(span, "an arc that tilts the tool (A, B, C) is not read: write it as lines");
            }
            return self.arc(motion, goal, values, feed, span);
        }
        self.step_with(goal, feed, span)
    }

    fn feed_of(&mut self, values: &HashMap<char, (f64, Span)>, motion: Motion, span: Span) -> Result<Speed> {
        if motion == Motion::Rapid {
            return Ok(Speed { linear_m_s: self.recorder.options.gcode.rapid_m_s, ..Speed::default() });
        }
        match (self.feed_mode, values.get(&'F')) {
            (FeedMode::InverseTime, Some((feed, _))) => Ok(Speed { duration_s: Some(60.0 / feed), ..Speed::default() }),
            (FeedMode::InverseTime, None) => fail(span, "each line needs its own F where G93 is in force"),
            (FeedMode::PerMinute, _) if self.feed.is_some() => Ok(Speed { linear_m_s: self.feed, ..Speed::default() }),
            _ => fail(span, "no feed is set: put an F word into this line or before it"),
        }
    }

    /// G53: one line in machine coordinates.
    fn machine_move(&mut self, values: &HashMap<char, (f64, Span)>, feed: Speed, span: Span) -> Result<()> {
        let X_MB = self.recorder.options.gcode.machine.inverse() * self.frame(self.work_frame);
        let mut place = match self.at {
            [Some(x), Some(y), Some(z)] => X_MB * nalgebra::Point3::from(Vector3::new(x, y, z) + self.offset),
            _ if ['X', 'Y', 'Z'].iter().all(|letter| values.contains_key(letter)) => nalgebra::Point3::origin(),
            _ => {
                return fail(
                    span,
                    "G53 moves some axes while the position of the others is not known: move to X, Y and Z first",
                );
            }
        };
        for (k, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some((value, _)) = values.get(&letter) {
                place[k] = value * self.unit;
            }
        }
        let p = (X_MB.inverse() * place).coords - self.offset;
        self.step_with([Some(p.x), Some(p.y), Some(p.z)], feed, span)
    }

    pub(super) fn step_to(&mut self, goal: [Option<f64>; 3], span: Span) -> Result<()> {
        let speed = Speed { linear_m_s: self.recorder.options.gcode.rapid_m_s, ..Speed::default() };
        self.step_with(goal, speed, span)
    }

    /// Adds a rapid or a line.
    fn step_with(&mut self, goal: [Option<f64>; 3], speed: Speed, span: Span) -> Result<()> {
        let is_rapid = self.motion == Some(Motion::Rapid);
        let to = self.settled(goal, span);
        let kind = match (is_rapid, self.recorder.options.gcode.rapid_m_s) {
            // Without joint values at the start, the start of the first move is unknown.
            (true, Some(_)) if self.has_moved || self.recorder.options.start.is_some() => MoveKind::Line,
            (true, _) => MoveKind::Joint,
            _ => MoveKind::Line,
        };
        let speed = if kind == MoveKind::Joint { Speed::default() } else { speed };
        let blend = if is_rapid { Blend::Stop } else { self.blend };
        self.add(kind, to, speed, blend, span)
    }

    /// Sets unknown coordinates to 0, with a note.
    pub(super) fn settled(&mut self, goal: [Option<f64>; 3], span: Span) -> Vector3<f64> {
        for (value, text) in goal.iter().zip([
            "X is not given before this move: 0 of the work frame is taken",
            "Y is not given before this move: 0 of the work frame is taken",
            "Z is not given before this move: 0 of the work frame is taken",
        ]) {
            if value.is_none() {
                self.recorder.note(text, span);
            }
        }
        let goal = goal.map(|value| value.unwrap_or(0.0));
        self.at = goal.map(Some);
        Vector3::from(goal)
    }

    /// Adds a move to a position in the work frame without offsets.
    pub(super) fn add(
        &mut self,
        kind: MoveKind,
        to: Vector3<f64>,
        speed: Speed,
        blend: Blend,
        span: Span,
    ) -> Result<()> {
        let [a, b, c] = self.rotary;
        let R_BT = rotation_zyx(c, b, a) * self.recorder.options.gcode.R_BT;
        let X_BT = Pose::from_parts(Translation3::from(to + self.offset), R_BT);
        let to = Target::Pose { X_BT, configuration: Configuration::NEAREST };
        let X_WB = self.frame(self.work_frame);
        self.recorder.add(
            Move { place: Place::default(), statement: String::new(), kind, to, X_WB, X_FT: None, speed, blend },
            span,
        )?;
        self.has_moved = true;
        Ok(())
    }
}
