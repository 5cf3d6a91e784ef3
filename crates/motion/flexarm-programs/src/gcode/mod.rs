//! G-code of milling machines (RS274/NGC) for a robot that carries the tool.
//!
//! [`words`] splits lines into words, and this module keeps the modal state and executes the
//! blocks in the order of the standard: [`modes`], then codes that act once, among them those of
//! [`frames`], then [`moves`] with [`arcs`].
//!
//! Frames: B is the work frame (G54 etc.), T the tool. The tool's orientation is fixed, or rotated
//! by A, B, C ([`crate::Rotary`]).

mod arcs;
mod frames;
mod modes;
mod moves;
mod words;

use std::collections::HashMap;

use flexarm_path::program::Blend;
use nalgebra::Vector3;

use crate::ReadOptions;
use crate::common::recorder::{Recorded, Recorder};
use crate::common::{Result, Span, Text, fail};

use modes::check_groups;
use words::{Line, Parameters, Word};

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
    // Line by line; a second `%` ends the program, unless there was no move before it.
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
            at: [None; 3],
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
        let given = &self.recorder.options.gcode.offsets;
        if given.is_empty() {
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
        // Codes, coordinates, and words that do not move the tool.
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
        // In the order of the standard: modes, feed, codes that act once, motion.
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

    /// Executes non-modal codes; returns `false` if they consume the coordinates of the line.
    fn other_codes(&mut self, codes: &[(i32, Span)], values: &HashMap<char, (f64, Span)>, span: Span) -> Result<bool> {
        // G4 dwell, G43 length, G28 and G30 reference, G10 frame, G92 offset; codes in tenths.
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
                self.recorder.note("P of G4 is in seconds (RS274)", span);
                *value
            }
            (None, Some((value, _))) => *value,
            (None, None) => return fail(span, "G4 needs its time: P in seconds"),
        };
        self.recorder.dwell(seconds, span)
    }
}
