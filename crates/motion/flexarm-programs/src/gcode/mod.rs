//! G-code of milling machines (RS274/NGC) for a robot that carries the tool.
//!
//! [`words`] splits lines into words, [`arcs`] converts G2 and G3, and this module keeps the modal
//! state and executes the blocks in the order of the standard.
//!
//! Frames: B is the work frame (G54 etc.), T the tool. The tool's orientation is fixed, or rotated
//! by A, B, C ([`crate::Rotary`]).

mod arcs;
mod words;

use std::collections::HashMap;

use flexarm_path::program::{Blend, Configuration, Move, MoveKind, Speed, Target};
use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Translation3, Vector3};

use crate::common::frames::rotation_zyx;
use crate::common::recorder::{Recorded, Recorder};
use crate::common::{Result, Span, Text, fail};
use crate::{ReadOptions, Rotary};

use words::{Line, Parameters, Word};

/// Work frames, by their code times 10.
const WORK_FRAMES: [i32; 9] = [540, 550, 560, 570, 580, 590, 591, 592, 593];

/// Maximum number after a letter, in the unit of the program.
const LARGEST: f64 = 1e9;

/// Motion mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Motion {
    Rapid,
    Line,
    Clockwise,
    Counterclockwise,
}

/// Meaning of F words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FeedMode {
    PerMinute,
    InverseTime,
}

/// Modal state.
struct Gcode<'a> {
    recorder: Recorder<'a>,
    motion: Option<Motion>,
    plane: arcs::Plane,
    /// Length of one program unit (m).
    unit: f64,
    unit_is_told: bool,
    relative: bool,
    absolute_centres: bool,
    feed_mode: FeedMode,
    /// Feed rate (m/s).
    feed: Option<f64>,
    work_frame: i32,
    blend: Blend,
    blend_is_told: bool,
    /// Position in the work frame without offsets (m); `None`: unknown.
    at: [Option<f64>; 3],
    /// A, B, C in rad.
    rotary: [f64; 3],
    /// G92 offsets (m).
    offset: Vector3<f64>,
    /// Work frames set by G10, by their code.
    moved_frames: HashMap<i32, Vector3<f64>>,
    has_moved: bool,
}

pub(crate) fn read(texts: &mut [Text], options: &ReadOptions<'_>) -> Result<Recorded> {
    let text = texts[0].text.clone();
    let path = texts[0].path.clone();
    let mut parameters = Parameters::default();
    for (name, value) in &options.given {
        match value.trim().parse() {
            Ok(number) => parameters.set(name.trim_start_matches('#'), number),
            Err(_) => {
                return fail(
                    Span::default(),
                    format!("the option `given` has {name} = {value}, which is not a number"),
                );
            }
        }
    }
    let mut program = Gcode::new(Recorder::new(options, texts.to_vec()));
    let (mut start, mut percents, mut is_over) = (0, 0, false);
    for line in text.split_inclusive('\n') {
        let place = start;
        start += line.len();
        let trimmed = line.trim();
        if trimmed.starts_with('%') {
            percents += 1;
            if percents == 2 && program.recorder.items.is_empty() {
                percents = 1;
            }
            if percents == 2 {
                break;
            }
            continue;
        }
        let words = parameters.line(line, 0, place)?;
        let Some((first, last)) = words.words.first().zip(words.words.last()) else { continue };
        let span = first.span.to(last.span);
        if words.is_optional {
            program.recorder.note("lines that begin with / (block skip) are run", span);
        }
        if program.block(&words, span)? {
            is_over = true;
            break;
        }
    }
    if !is_over {
        program.recorder.note_all("the program ends without M2 or M30");
    }
    program.last_notes();
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(program.recorder.finish(&name))
}

impl<'a> Gcode<'a> {
    fn new(recorder: Recorder<'a>) -> Self {
        let start = recorder.options.gcode.start_mm;
        Self {
            recorder,
            motion: None,
            plane: arcs::Plane::XY,
            unit: 1e-3,
            unit_is_told: false,
            relative: false,
            absolute_centres: false,
            feed_mode: FeedMode::PerMinute,
            feed: None,
            work_frame: 540,
            blend: Blend::Pass,
            blend_is_told: false,
            at: start.map_or([None; 3], |start| start.map(|value| Some(value * 1e-3))),
            rotary: [0.0; 3],
            offset: Vector3::zeros(),
            moved_frames: HashMap::new(),
            has_moved: false,
        }
    }

    fn last_notes(&mut self) {
        if self.recorder.items.is_empty() {
            return;
        }
        if !self.unit_is_told {
            self.recorder.note_all("neither G20 nor G21 is there: lengths are in mm");
        }
        if !self.blend_is_told {
            self.recorder.note_all("neither G61 nor G64 is there: the path is kept exactly (G61)");
        }
        let told = &self.recorder.options.gcode.offsets;
        if told.is_empty() {
            self.recorder
                .note_all("no place of the work frame (G54) was given: its zero is where the controller's world is");
        }
        self.recorder.note_all(
            "the tool's orientation comes from the options; by default its axis points against the work frame's z",
        );
    }

    /// Executes one line; returns `true` at the end of the program.
    fn block(&mut self, line: &Line, span: Span) -> Result<bool> {
        let mut codes: Vec<(i32, Span)> = Vec::new();
        let mut values: HashMap<char, (f64, Span)> = HashMap::new();
        let mut is_over = false;
        let mut comes_to_stop = false;
        for Word { letter, value, span } in &line.words {
            match letter {
                'G' => codes.push(((value * 10.0).round() as i32, *span)),
                'M' => self.machine_word(*value, *span, &mut is_over, &mut comes_to_stop)?,
                'S' | 'T' | 'D' | 'H' => {
                    let text = match letter {
                        'S' => "spindle speeds (S) do not move the robot",
                        'T' => "tools (T) are not changed: the robot keeps its own",
                        _ => "numbers of tool data (D, H) are not used",
                    };
                    self.recorder.note(text, *span);
                }
                'E' => self.recorder.note("extrusion (E) does not move the robot", *span),
                'U' | 'V' | 'W' => {
                    return fail(*span, format!("the axis {letter} is not read: the tool has X, Y, Z and A, B, C"));
                }
                _ => {
                    if value.is_nan() || value.abs() > LARGEST {
                        return fail(*span, format!("{letter} is {value:e}, expected -{LARGEST:e} to {LARGEST:e}"));
                    }
                    if values.insert(*letter, (*value, *span)).is_some() {
                        return fail(*span, format!("the letter {letter} occurs twice in this line"));
                    }
                }
            }
        }
        check_groups(&codes)?;
        if comes_to_stop {
            self.recorder.stop();
        }
        self.modes(&codes, &values)?;
        self.place_at_start(span);
        if let Some((feed, at)) = values.get(&'F').copied() {
            self.set_feed(feed, at)?;
        }
        let moves = self.other_codes(&codes, &values, span)?;
        if moves {
            self.motion_of_line(&codes, &values, span)?;
        }
        Ok(is_over)
    }

    fn machine_word(&mut self, value: f64, span: Span, is_over: &mut bool, stops: &mut bool) -> Result<()> {
        let code = (value * 10.0).round() as i32;
        match code {
            20 | 300 => *is_over = true,
            0 | 10 | 600 => {
                *stops = true;
                self.recorder.note("stops for the operator (M0, M1) are ignored", span);
            }
            60 => {
                *stops = true;
                self.recorder.note("tools (T) are not changed: the robot keeps its own", span);
            }
            980 | 990 => {
                return fail(span, "subroutines (M98, M99) are not read: write the moves out, as CAM programs do");
            }
            _ => self.recorder.note("M words switch what does not move the robot", span),
        }
        Ok(())
    }

    /// Sets the modes, in the order of the standard, before any motion.
    fn modes(&mut self, codes: &[(i32, Span)], values: &HashMap<char, (f64, Span)>) -> Result<()> {
        for &(code, span) in codes {
            match code {
                0 => self.motion = Some(Motion::Rapid),
                10 => self.motion = Some(Motion::Line),
                20 => self.motion = Some(Motion::Clockwise),
                30 => self.motion = Some(Motion::Counterclockwise),
                170 => self.plane = arcs::Plane::XY,
                180 => self.plane = arcs::Plane::ZX,
                190 => self.plane = arcs::Plane::YZ,
                200 | 210 => {
                    self.unit = if code == 200 { 0.0254 } else { 1e-3 };
                    self.unit_is_told = true;
                }
                900 => self.relative = false,
                910 => self.relative = true,
                901 => self.absolute_centres = true,
                911 => self.absolute_centres = false,
                930 => self.feed_mode = FeedMode::InverseTime,
                940 => self.feed_mode = FeedMode::PerMinute,
                800 => self.motion = None,
                610 | 611 | 640 => {
                    self.blend_is_told = true;
                    self.blend = match (code, values.get(&'P')) {
                        (610, _) => Blend::Pass,
                        (611, _) => Blend::Stop,
                        (_, Some((tolerance, at))) => {
                            if *tolerance < 0.0 {
                                return fail(*at, "the tolerance of G64 is 0 or more");
                            }
                            Blend::Distance(tolerance * self.unit)
                        }
                        _ => {
                            self.recorder.note("G64 without P leaves the path without a bound: it is kept exactly; give a tolerance with P", span);
                            Blend::Pass
                        }
                    };
                }
                code if WORK_FRAMES.contains(&code) => self.change_frame(code, span)?,
                400 | 490 | 530 | 40 | 280 | 300 | 920 | 921 | 922 | 923 | 100 | 430 | 980 | 990 | 970 | 500 | 690
                | 150 => {}
                _ => return fail(span, refused(code)),
            }
        }
        Ok(())
    }

    /// Changes the work frame; the tool does not move.
    fn change_frame(&mut self, code: i32, span: Span) -> Result<()> {
        if code == self.work_frame {
            return Ok(());
        }
        let before = self.frame(self.work_frame);
        self.work_frame = code;
        let now = self.frame(code);
        if !self.has_moved && self.recorder.options.gcode.start_mm.is_none() {
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

    fn frame(&self, code: i32) -> Pose {
        let name = if code % 10 == 0 { format!("G{}", code / 10) } else { format!("G{}.{}", code / 10, code % 10) };
        let told = self.recorder.options.gcode.offsets.iter().find(|(given, _)| given.eq_ignore_ascii_case(&name));
        let moved = self.moved_frames.get(&code).copied().unwrap_or_else(Vector3::zeros);
        told.map_or_else(Pose::identity, |(_, X)| *X)
            * Pose::from_parts(Translation3::from(moved), Rotation3::identity())
    }

    fn set_feed(&mut self, feed: f64, span: Span) -> Result<()> {
        if feed.is_nan() || feed <= 0.0 {
            return fail(span, format!("the feed is {feed}: it must be above 0"));
        }
        self.feed = match self.feed_mode {
            FeedMode::PerMinute => Some(feed * self.unit / 60.0),
            FeedMode::InverseTime => self.feed,
        };
        Ok(())
    }

    /// Executes non-modal codes; returns `false` if they consume the coordinates of the line.
    fn other_codes(&mut self, codes: &[(i32, Span)], values: &HashMap<char, (f64, Span)>, span: Span) -> Result<bool> {
        let mut moves = true;
        for &(code, at) in codes {
            match code {
                40 => {
                    self.dwell(values, at)?;
                    moves = false;
                }
                430 if !self.recorder.options.gcode.tip_is_known => {
                    return fail(
                        at,
                        "tool length compensation (G43) is not computed: if the robot's tool centre point is the tip of the tool, say so \
                         (`tip_is_known`) and G43 changes nothing; else write a program without it",
                    );
                }
                430 => {
                    self.recorder.note("G43 changes nothing: the robot's tool centre point is the tip of the tool", at)
                }
                280 | 300 => {
                    self.reference(values, at, span)?;
                    moves = false;
                }
                100 => {
                    self.set_frame(values, at)?;
                    moves = false;
                }
                920 => {
                    self.set_offset(values, at)?;
                    moves = false;
                }
                921 | 922 => self.shift(Vector3::zeros()),
                923 => return fail(at, "G92.3 restores offsets of an earlier run, which are not known"),
                _ => {}
            }
        }
        Ok(moves)
    }

    fn dwell(&mut self, values: &HashMap<char, (f64, Span)>, span: Span) -> Result<()> {
        let seconds = match (values.get(&'P'), values.get(&'S').or(values.get(&'X')).or(values.get(&'U'))) {
            (Some((value, _)), _) => {
                let in_ms = self.recorder.options.gcode.dwell_in_ms;
                self.recorder
                    .note(if in_ms { "P of G4 is in milliseconds" } else { "P of G4 is in seconds (RS274)" }, span);
                if in_ms { value * 1e-3 } else { *value }
            }
            (None, Some((value, _))) => *value,
            (None, None) => return fail(span, "G4 needs its time: P in seconds"),
        };
        self.recorder.dwell(seconds, span)
    }

    /// G92: defines the coordinates of the current position.
    fn set_offset(&mut self, values: &HashMap<char, (f64, Span)>, span: Span) -> Result<()> {
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
    fn shift(&mut self, offset: Vector3<f64>) {
        for (k, at) in self.at.iter_mut().enumerate() {
            *at = at.map(|at| at + self.offset[k] - offset[k]);
        }
        self.offset = offset;
    }

    /// G10 L2 Pn: sets a work frame.
    fn set_frame(&mut self, values: &HashMap<char, (f64, Span)>, span: Span) -> Result<()> {
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
    fn reference(&mut self, values: &HashMap<char, (f64, Span)>, code: Span, span: Span) -> Result<()> {
        let Some(reference) = self.recorder.options.gcode.reference_mm else {
            return fail(
                code,
                "the machine's reference point is not known to the robot: give one (`reference_mm`), or take the line out",
            );
        };
        let told: Vec<usize> = (0..3).filter(|k| values.contains_key(&['X', 'Y', 'Z'][*k])).collect();
        let before = self.motion;
        self.motion = Some(Motion::Rapid);
        if !told.is_empty() {
            let goal = self.goal(values, false)?;
            self.step_to(goal, span)?;
        }
        let X = self.frame(self.work_frame).inverse() * self.recorder.options.gcode.machine;
        let home = X * nalgebra::Point3::from(Vector3::from(reference) * 1e-3);
        let mut goal = self.at;
        for k in 0..3 {
            if told.is_empty() || told.contains(&k) {
                goal[k] = Some(home[k] - self.offset[k]);
            }
        }
        self.step_to(goal, span)?;
        self.motion = before;
        Ok(())
    }

    /// Sets the coordinates before the first move from the joint values at the start, if the
    /// robot's kinematics are known.
    fn place_at_start(&mut self, span: Span) {
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

    /// Coordinates at the end of the line, in the work frame without offsets (m).
    fn goal(&self, values: &HashMap<char, (f64, Span)>, absolute: bool) -> Result<[Option<f64>; 3]> {
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
    fn motion_of_line(&mut self, codes: &[(i32, Span)], values: &HashMap<char, (f64, Span)>, span: Span) -> Result<()> {
        if !['X', 'Y', 'Z', 'A', 'B', 'C', 'I', 'J', 'K', 'R'].iter().any(|letter| values.contains_key(letter)) {
            return Ok(());
        }
        let in_machine = codes.iter().any(|(code, _)| *code == 530);
        let Some(motion) = self.motion else {
            return fail(span, "coordinates without G0, G1, G2 or G3 in force: put one before them");
        };
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

    fn step_to(&mut self, goal: [Option<f64>; 3], span: Span) -> Result<()> {
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
    fn settled(&mut self, goal: [Option<f64>; 3], span: Span) -> Vector3<f64> {
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
    fn add(&mut self, kind: MoveKind, to: Vector3<f64>, speed: Speed, blend: Blend, span: Span) -> Result<()> {
        let [a, b, c] = self.rotary;
        let R_BT = rotation_zyx(c, b, a) * self.recorder.options.gcode.R_BT;
        let X_BT = Pose::from_parts(Translation3::from(to + self.offset), R_BT);
        let to = Target::Pose { X_BT, configuration: Configuration::Nearest };
        let X_WB = self.frame(self.work_frame);
        self.recorder
            .add(Move { line: 0, statement: String::new(), kind, to, X_WB, X_FT: None, speed, blend }, span)?;
        self.has_moved = true;
        Ok(())
    }
}

/// Rejects two codes of one modal group in a line.
fn check_groups(codes: &[(i32, Span)]) -> Result<()> {
    const GROUPS: [&[i32]; 8] = [
        &[0, 10, 20, 30, 800],
        &[170, 180, 190],
        &[200, 210],
        &[900, 910],
        &[930, 940],
        &[610, 611, 640],
        &[540, 550, 560, 570, 580, 590, 591, 592, 593],
        &[901, 911],
    ];
    for group in GROUPS {
        let mut of_group = codes.iter().filter(|(code, _)| group.contains(code));
        if let (Some((first, _)), Some((second, span))) = (of_group.next(), of_group.next())
            && first != second
            && *first != 800
            && *second != 800
        {
            return fail(*span, "two codes of one line contradict each other: write them in two lines");
        }
    }
    Ok(())
}

/// Error message for an unsupported code.
fn refused(code: i32) -> String {
    match code {
        410 | 420 | 411 | 421 => {
            "cutter radius compensation is not computed: let the CAM program write the path of the tool's centre"
        }
        431 | 432 | 433 | 434 | 440 => {
            "this tool length compensation is not computed: write the path of the tool's tip"
        }
        730 | 740 | 760 | 810 | 820 | 821 | 830 | 840 | 850 | 860 | 870 | 880 | 890 => {
            "drilling cycles are not read: let the CAM program write them as G0 and G1"
        }
        950 => "feed per turn of the spindle is not read: write mm per minute (G94)",
        50..=53 => "splines (G5) are not read: write lines or arcs",
        160 => "polar coordinates are not read: write X and Y",
        520 => "the local offset G52 is not read: use G92 or a work frame",
        510 | 511 | 680 => {
            "scaling, mirroring and turning of the program are not read: let the CAM program write the path so"
        }
        380..=385 => "probing depends on what the tool touches: take the line out",
        330 | 331 | 320 => "threads that follow the spindle are not read",
        70 | 80 => "lathe modes (G7, G8) are not read",
        _ => "this code is unknown, and so is its effect on the motion: remove it",
    }
    .into()
}
