//! Work frames, offsets and the reference point of G-code.
//!
//! A work frame B is known by its code in tenths (540 for G54); its pose in the world of the
//! controller comes from the options or from G10. The offset of G92 shifts all frames. Lengths are
//! in m.

use std::collections::HashMap;

use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Translation3, Vector3};

use super::{Gcode, Motion};
use crate::common::{Result, Span, fail};

/// Work frames, by their code times 10.
pub(super) const WORK_FRAMES: [i32; 9] = [540, 550, 560, 570, 580, 590, 591, 592, 593];

impl Gcode<'_> {
    /// Changes the work frame; the tool does not move.
    pub(super) fn change_frame(&mut self, code: i32, span: Span) -> Result<()> {
        if code == self.work_frame {
            return Ok(());
        }
        let before = self.frame(self.work_frame);
        self.work_frame = code;
        let now = self.frame(code);
        if !self.has_moved {
            if self.recorder.options.start.is_some() {
                self.at = [None; 3]; // set again in the new frame by `place_at_start`
            }
            return Ok(());
        }
        if let [Some(x), Some(y), Some(z)] = self.at {
            let p = now.inverse() * (before * nalgebra::Point3::new(x, y, z));
            self.at = [Some(p.x), Some(p.y), Some(p.z)];
        } else if before != now {
            return fail(span, "the work frame changes before the position is known: give X, Y and Z first");
        }
        Ok(())
    }

    pub(super) fn frame(&self, code: i32) -> Pose {
        let name = if code % 10 == 0 { format!("G{}", code / 10) } else { format!("G{}.{}", code / 10, code % 10) };
        let given = self.recorder.options.gcode.offsets.iter().find(|(given, _)| given.eq_ignore_ascii_case(&name));
        let moved = self.moved_frames.get(&code).copied().unwrap_or_else(Vector3::zeros);
        given.map_or_else(Pose::identity, |(_, X)| *X)
            * Pose::from_parts(Translation3::from(moved), Rotation3::identity())
    }

    /// G92: defines the coordinates of the current position.
    pub(super) fn set_offset(&mut self, values: &HashMap<char, (f64, Span)>, span: Span) -> Result<()> {
        let mut offset = self.offset;
        for (k, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            let Some((value, _)) = values.get(&letter) else { continue };
            match self.at[k] {
                Some(at) => offset[k] += at - value * self.unit,
                None if !self.has_moved => self.at[k] = Some(value * self.unit),
                None => return fail(span, "G92 sets a coordinate that is not known before: move there first"),
            }
        }
        self.shift(offset);
        Ok(())
    }

    /// Changes the G92 offsets; the tool does not move.
    pub(super) fn shift(&mut self, offset: Vector3<f64>) {
        for (k, at) in self.at.iter_mut().enumerate() {
            *at = at.map(|at| at + self.offset[k] - offset[k]);
        }
        self.offset = offset;
    }

    /// G10 L2 Pn: sets a work frame.
    pub(super) fn set_frame(&mut self, values: &HashMap<char, (f64, Span)>, span: Span) -> Result<()> {
        let number = |letter: char| values.get(&letter).map(|(value, _)| *value);
        let frame = number('P').and_then(|p| match p.round() as i32 {
            0 => Some(self.work_frame),
            n => usize::try_from(n - 1).ok().and_then(|n| WORK_FRAMES.get(n).copied()),
        });
        let (Some(2), Some(frame), None) = (number('L').map(|l| l.round() as i32), frame, number('R')) else {
            return fail(
                span,
                "of G10 only L2 with P1 to P9 and X, Y, Z is read: give the work frames as options (`offsets`)",
            );
        };
        if self.has_moved {
            return fail(
                span,
                "a work frame changes while the program runs, which is not read: set it before the first move",
            );
        }
        let mut moved = self.moved_frames.get(&frame).copied().unwrap_or_else(Vector3::zeros);
        for (k, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(value) = number(letter) {
                moved[k] = value * self.unit;
            }
        }
        self.moved_frames.insert(frame, moved);
        Ok(())
    }

    /// G28 and G30: moves via the point in the line to the reference point.
    pub(super) fn reference(&mut self, values: &HashMap<char, (f64, Span)>, code: Span, span: Span) -> Result<()> {
        let Some(reference) = self.recorder.options.gcode.reference_mm else {
            return fail(
                code,
                "the machine's reference point is not known to the robot: give one (`reference_mm`), or take the line out",
            );
        };
        let given: Vec<usize> = (0..3).filter(|k| values.contains_key(&['X', 'Y', 'Z'][*k])).collect();
        let before = self.motion;
        self.motion = Some(Motion::Rapid);
        if !given.is_empty() {
            let goal = self.goal(values, false)?;
            self.step_to(goal, span)?;
        }
        let X = self.frame(self.work_frame).inverse() * self.recorder.options.gcode.machine;
        let home = X * nalgebra::Point3::from(Vector3::from(reference) * 1e-3);
        let mut goal = self.at;
        for k in 0..3 {
            if given.is_empty() || given.contains(&k) {
                goal[k] = Some(home[k] - self.offset[k]);
            }
        }
        self.step_to(goal, span)?;
        self.motion = before;
        Ok(())
    }

    /// Sets the coordinates before the first move from the joint values at the start, if the
    /// robot's kinematics are known.
    pub(super) fn place_at_start(&mut self, span: Span) {
        if self.has_moved || self.recorder.options.start.is_none() {
            return;
        }
        if let Ok(X_BT) = self.recorder.pose(&self.frame(self.work_frame), &None, span) {
            let place = X_BT.translation.vector - self.offset;
            for (at, value) in self.at.iter_mut().zip(place.iter()) {
                *at = at.or(Some(*value));
            }
        }
    }
}
