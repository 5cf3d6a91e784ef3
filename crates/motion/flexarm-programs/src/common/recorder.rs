//! Recorder of a running program: its moves, its notes, and the resulting position of the robot.
//!
//! Languages call [`Recorder::add`] and [`Recorder::dwell`] for motion and [`Recorder::note`] for
//! what they assume or leave out; [`Recorder::pose`] gives the pose of the tool for targets that
//! are not complete. Frames as in [`flexarm_path::program`]. Not here: the interpreter (`machine`).

use flexarm_path::program::{Blend, Item, Move, MoveKind, Program, Target};
use flexarm_settings::{Finding, Place};
use flexarm_spatial::Pose;

use super::{Fail, Result, Span, Text, fail};
use crate::ReadOptions;

/// Collects the moves and notes of a program.
pub(crate) struct Recorder<'a> {
    pub(crate) options: &'a ReadOptions<'a>,
    pub(crate) texts: Vec<Text>,
    pub(crate) items: Vec<Item>,
    /// Spans of the literals of each item's target and auxiliary point.
    sources: Vec<Sources>,
    /// The same for the next move.
    pub(crate) next: Sources,
    notes: Vec<RepeatedNote>,
    moves: usize,
    /// Values of external axes, and the places where they were first given.
    external: [Option<(f64, Place)>; 6],
    place: RobotPosition,
}

/// Spans of the literals of a move's target and of the auxiliary point of its circle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sources {
    pub(crate) target: Option<Span>,
    pub(crate) via: Option<Span>,
}

/// A program with the places of its targets, by item.
pub(crate) struct Recorded {
    pub(crate) program: Program,
    pub(crate) sources: Vec<Sources>,
}

/// A note that is given once, with all its places.
struct RepeatedNote {
    text: String,
    file: usize,
    /// Byte offsets of the statements; empty for a note about the program as a whole.
    starts: Vec<usize>,
}

/// Maximum number of further places that a note names.
const MAX_PLACES: usize = 3;

/// Position of the robot after the moves so far.
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
enum RobotPosition {
    /// No move was made, or its end is known only from kinematics.
    Unknown,
    Joints(Vec<f64>),
    Tool {
        X_WB: Pose,
        X_FT: Option<Pose>,
        X_BT: Pose,
    },
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(options: &'a ReadOptions<'a>, texts: Vec<Text>) -> Self {
        let place = options.start.as_ref().map_or(RobotPosition::Unknown, |start| RobotPosition::Joints(start.clone()));
        Self {
            options,
            texts,
            items: Vec::new(),
            sources: Vec::new(),
            next: Sources::default(),
            notes: Vec::new(),
            moves: 0,
            external: Default::default(),
            place,
        }
    }

    pub(crate) fn place(&self, span: Span) -> Place {
        self.texts[span.file].place(span.start)
    }

    pub(crate) fn excerpt(&self, span: Span) -> String {
        self.texts[span.file].excerpt(span)
    }

    /// Adds a note for the user; repeated notes only add their place.
    pub(crate) fn note(&mut self, text: &str, span: Span) {
        match self.notes.iter_mut().find(|note| note.text == text && note.file == span.file) {
            Some(note) if note.starts.contains(&span.start) => {}
            Some(note) => note.starts.push(span.start),
            None => {
                self.notes.push(RepeatedNote { text: text.to_owned(), file: span.file, starts: vec![span.start] });
            }
        }
    }

    /// Adds a note about the program as a whole.
    pub(crate) fn note_all(&mut self, text: &str) {
        if !self.notes.iter().any(|note| note.text == text) {
            self.notes.push(RepeatedNote { text: text.to_owned(), file: 0, starts: Vec::new() });
        }
    }

    /// Notes which files were read in addition to the program; the last text holds the given
    /// values.
    pub(crate) fn note_files(&mut self) {
        let files = &self.texts[1..self.texts.len().max(2) - 1];
        if !files.is_empty() {
            let names: Vec<String> = files.iter().map(|text| text.path.display().to_string()).collect();
            self.note_all(&format!("read beside the program: {}", names.join(", ")));
        }
    }

    /// Adds a dwell.
    pub(crate) fn dwell(&mut self, seconds: f64, span: Span) -> Result<()> {
        let item = Item::Dwell { place: self.place(span), seconds };
        item.check().or_else(|error| fail(span, error.to_string()))?;
        if seconds > 0.0 {
            self.count(span)?;
            self.items.push(item);
            self.sources.push(Sources::default());
            self.stop();
        }
        Ok(())
    }

    /// Makes the last move stop at its end.
    pub(crate) fn stop(&mut self) {
        for item in self.items.iter_mut().rev() {
            if let Item::Move(last) = item {
                last.blend = Blend::Stop;
                return;
            }
        }
    }

    fn count(&mut self, span: Span) -> Result<()> {
        self.moves += 1;
        let most = self.options.most_moves;
        if self.moves > most {
            return fail(span, format!("more than {most} moves: if no loop runs away, allow more (`most_moves`)"));
        }
        Ok(())
    }

    /// Adds a move, whose `place` and `statement` are set from its span.
    pub(crate) fn add(&mut self, mut step: Move, span: Span) -> Result<()> {
        self.count(span)?;
        step.check().or_else(|error| fail(span, error.to_string()))?;
        let first = !self.items.iter().any(|item| matches!(item, Item::Move(_)));
        if first && !matches!(step.kind, MoveKind::Joint) && self.options.start.is_none() {
            return fail(
                span,
                "the first move must be a joint move, since nothing says where the robot is before: begin with one, \
                 or tell the joint values at the start (`start`)",
            );
        }
        step.place = self.place(span);
        step.statement = self.excerpt(span);
        self.place = match (&step.to, &step.kind) {
            (_, MoveKind::Arc { angle: Some(_), .. }) => RobotPosition::Unknown,
            (Target::Joints(joints), _) => RobotPosition::Joints(joints.clone()),
            (Target::Pose { X_BT, .. }, _) => RobotPosition::Tool { X_WB: step.X_WB, X_FT: step.X_FT, X_BT: *X_BT },
        };
        self.items.push(Item::Move(step));
        self.sources.push(std::mem::take(&mut self.next));
        Ok(())
    }

    /// Sets the position to `X_BT`, regardless of the last target.
    pub(crate) fn now_at(&mut self, X_WB: Pose, X_FT: Option<Pose>, X_BT: Pose) {
        self.place = RobotPosition::Tool { X_WB, X_FT, X_BT };
    }

    /// Checks the external axes of a target (`None`: not given); they must not move.
    pub(crate) fn external_axes(&mut self, values: [Option<f64>; 6], span: Span) -> Result<()> {
        let place = self.place(span);
        for (k, (value, before)) in values.iter().zip(&mut self.external).enumerate() {
            match (value, &before) {
                (Some(value), Some((old, since))) if (old - value).abs() > 1e-6 => {
                    return fail(
                        span,
                        format!(
                            "external axis {} moves, from {old} ({since}) to {value}; only the axes of the arm are moved here: leave \
                             it at one value",
                            k + 1
                        ),
                    );
                }
                (Some(value), None) => *before = Some((*value, place.clone())),
                _ => {}
            }
        }
        if values.iter().flatten().any(|value| *value != 0.0) {
            self.note(
                "external axes stay at the values that the targets give; the base frame is not moved by them",
                span,
            );
        }
        Ok(())
    }

    /// Joint values at the end of the last move, if its target was given in joint values.
    pub(crate) fn joints(&self) -> Option<&[f64]> {
        match &self.place {
            RobotPosition::Joints(joints) => Some(joints),
            _ => None,
        }
    }

    /// Pose `X_BT` of a tool in a base at the end of the last move.
    pub(crate) fn pose(&self, X_WB: &Pose, X_FT: &Option<Pose>, span: Span) -> Result<Pose> {
        let unknown = |why: &str| Fail {
            span,
            message: format!(
                "coordinates that are not given stay, but {why}: write all coordinates of the target, or move to a full pose before"
            ),
        };
        match &self.place {
            RobotPosition::Unknown => Err(unknown("where the robot is before this move is not known")),
            RobotPosition::Joints(joints) => {
                let forward = self.options.forward.and_then(|forward| forward(joints));
                let Some(X_WF) = forward else {
                    return Err(unknown(
                        "the position before was given in joint values, and the robot's kinematics were not given",
                    ));
                };
                Ok(X_WB.inverse()
                    * X_WF
                    * self.tool(X_FT).ok_or_else(|| unknown("the tool of the robot is not known"))?)
            }
            RobotPosition::Tool { X_WB: X_WB0, X_FT: X_FT0, X_BT: X_B0T0 } => {
                if X_FT0 == X_FT {
                    // The frames are unchanged, which avoids rounding.
                    return Ok(if X_WB0 == X_WB { *X_B0T0 } else { X_WB.inverse() * X_WB0 * X_B0T0 });
                }
                let tools = self.tool(X_FT0).zip(self.tool(X_FT));
                let (X_FT0, X_FT) =
                    tools.ok_or_else(|| unknown("the tool changed and the robot's own tool is not known"))?;
                Ok(X_WB.inverse() * X_WB0 * X_B0T0 * X_FT0.inverse() * X_FT)
            }
        }
    }

    /// Tool on the flange; the robot's own tool if the program gives none.
    fn tool(&self, X_FT: &Option<Pose>) -> Option<Pose> {
        X_FT.or(self.options.own_tool)
    }

    /// Tool pose for joint values, if the robot's kinematics are given.
    pub(crate) fn forward(&self, joints: &[f64], X_FT: &Option<Pose>) -> Option<Pose> {
        let forward = self.options.forward?;
        Some(forward(joints)? * self.tool(X_FT)?)
    }

    /// Returns the recorded program.
    pub(crate) fn finish(mut self, name: &str) -> Recorded {
        self.notes.sort_by_key(|note| (note.file, note.starts.first().copied()));
        let texts = &self.texts;
        let notes = self.notes.iter().map(|note| note.as_note(texts)).collect();
        Recorded { program: Program { name: name.to_owned(), items: self.items, notes }, sources: self.sources }
    }
}

impl RepeatedNote {
    /// The note at its first place, with further places in its text.
    fn as_note(&self, texts: &[Text]) -> Finding {
        let text = &texts[self.file];
        let Some((first, others)) = self.starts.split_first() else {
            return Finding::warning("program", text.file.to_string(), self.text.clone(), "").as_note();
        };
        let named: Vec<String> = others.iter().take(MAX_PLACES).map(|start| text.place(*start).to_string()).collect();
        let also = match others.len() - named.len() {
            0 if named.is_empty() => String::new(),
            0 => format!(" (also at {})", named.join(", ")),
            more => format!(" (also at {} and {more} more)", named.join(", ")),
        };
        Finding::warning("program", text.place(*first).to_string(), format!("{}{also}", self.text), "").as_note()
    }
}
