//! What a program did so far: its moves, its notes, and where the robot is by them.

use flexarm_path::program::{Blend, Item, Move, MoveKind, Note, Program, Target};
use flexarm_spatial::Pose;

use super::{Fail, Result, Span, Text, fail};
use crate::ReadOptions;

/// Collects what a program does.
pub(crate) struct Recorder<'a> {
    pub(crate) options: &'a ReadOptions<'a>,
    pub(crate) texts: Vec<Text>,
    pub(crate) items: Vec<Item>,
    /// Of each item, where the literals of its target and of the auxiliary point of its circle
    /// stand.
    sources: Vec<Sources>,
    /// The same of the next move.
    pub(crate) next: Sources,
    notes: Vec<Told>,
    moves: usize,
    /// Values of external axes, and where they were told first.
    external: [Option<(f64, usize)>; 6],
    place: Place,
}

/// Where the literals stand that a move has its target and the auxiliary point of its circle from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sources {
    pub(crate) target: Option<Span>,
    pub(crate) via: Option<Span>,
}

/// A program with the places of its targets, item by item.
pub(crate) struct Recorded {
    pub(crate) program: Program,
    pub(crate) sources: Vec<Sources>,
}

/// A note that is told once, with all its lines.
struct Told {
    text: String,
    file: usize,
    lines: Vec<usize>,
    times: usize,
}

/// Lines that a note names.
const LINES_OF_A_NOTE: usize = 8;

/// Where the robot is by the moves so far.
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
enum Place {
    /// A move ended where only kinematics knows, or none was made.
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
        let place = options.start.as_ref().map_or(Place::Unknown, |start| Place::Joints(start.clone()));
        Self {
            options,
            texts,
            items: Vec::new(),
            sources: Vec::new(),
            next: Sources::default(),
            notes: Vec::new(),
            moves: 0,
            external: [None; 6],
            place,
        }
    }

    pub(crate) fn line(&self, span: Span) -> usize {
        self.texts[span.file].line(span.start)
    }

    pub(crate) fn excerpt(&self, span: Span) -> String {
        self.texts[span.file].excerpt(span)
    }

    /// Something that the user should know, told once with its lines.
    pub(crate) fn note(&mut self, text: &str, span: Span) {
        let line = self.line(span);
        match self.notes.iter_mut().find(|told| told.text == text && told.file == span.file) {
            Some(told) => {
                if !told.lines.contains(&line) {
                    told.times += 1;
                    if told.lines.len() < LINES_OF_A_NOTE {
                        told.lines.push(line);
                    }
                }
            }
            None => self.notes.push(Told { text: text.to_owned(), file: span.file, lines: vec![line], times: 1 }),
        }
    }

    /// Something that is true of the program as a whole.
    pub(crate) fn note_all(&mut self, text: &str) {
        if !self.notes.iter().any(|told| told.text == text) {
            self.notes.push(Told { text: text.to_owned(), file: 0, lines: Vec::new(), times: 0 });
        }
    }

    /// Tells which files were read beside the program; the last text is what was given.
    pub(crate) fn note_files(&mut self) {
        let files = &self.texts[1..self.texts.len().max(2) - 1];
        if !files.is_empty() {
            let names: Vec<String> = files.iter().map(|text| text.path.display().to_string()).collect();
            self.note_all(&format!("read beside the program: {}", names.join(", ")));
        }
    }

    /// The robot stands still.
    pub(crate) fn dwell(&mut self, seconds: f64, span: Span) -> Result<()> {
        let item = Item::Dwell { line: self.line(span), seconds };
        item.check().or_else(|error| fail(span, error.to_string()))?;
        if seconds > 0.0 {
            self.count(span)?;
            self.items.push(item);
            self.sources.push(Sources::default());
            self.stop();
        }
        Ok(())
    }

    /// The last move stops at its end.
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

    /// A move, whose `line` and `statement` are set from its place.
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
        step.line = self.line(span);
        step.statement = self.excerpt(span);
        self.place = match (&step.to, &step.kind) {
            (_, MoveKind::Arc { angle: Some(_), .. }) => Place::Unknown,
            (Target::Joints(joints), _) => Place::Joints(joints.clone()),
            (Target::Pose { X_BT, .. }, _) => Place::Tool { X_WB: step.X_WB, X_FT: step.X_FT, X_BT: *X_BT },
        };
        self.items.push(Item::Move(step));
        self.sources.push(std::mem::take(&mut self.next));
        Ok(())
    }

    /// The robot ended where `X_BT` says, whatever its last target was.
    pub(crate) fn now_at(&mut self, X_WB: Pose, X_FT: Option<Pose>, X_BT: Pose) {
        self.place = Place::Tool { X_WB, X_FT, X_BT };
    }

    /// External axes as a target tells them (`None`: not told); they must stay.
    pub(crate) fn external_axes(&mut self, values: [Option<f64>; 6], span: Span) -> Result<()> {
        let line = self.line(span);
        for (k, (value, before)) in values.iter().zip(&mut self.external).enumerate() {
            match (value, &before) {
                (Some(value), Some((old, since))) if (old - value).abs() > 1e-6 => {
                    return fail(
                        span,
                        format!(
                            "external axis {} moves, from {old} (line {since}) to {value}; only the axes of the arm are moved here: leave \
                             it at one value",
                            k + 1
                        ),
                    );
                }
                (Some(value), None) => *before = Some((*value, line)),
                _ => {}
            }
        }
        if values.iter().flatten().any(|value| *value != 0.0) {
            self.note(
                "external axes stand still at the values that the targets tell; the base frame is not moved by them",
                span,
            );
        }
        Ok(())
    }

    /// Joint values where the last move ended, if it was told in joint values.
    pub(crate) fn joints(&self) -> Option<&[f64]> {
        match &self.place {
            Place::Joints(joints) => Some(joints),
            _ => None,
        }
    }

    /// Pose `X_BT` of a tool in a base where the last move ended.
    pub(crate) fn pose(&self, X_WB: &Pose, X_FT: &Option<Pose>, span: Span) -> Result<Pose> {
        let unknown = |why: &str| Fail {
            span,
            message: format!(
                "what is not told stays, but {why}: write all coordinates of the target, or move to a full pose before"
            ),
        };
        match &self.place {
            Place::Unknown => Err(unknown("where the robot is before this move is not known")),
            Place::Joints(joints) => {
                let forward = self.options.forward.and_then(|forward| forward(joints));
                let Some(X_WF) = forward else {
                    return Err(unknown(
                        "the position before was told in joint values, and the robot's kinematics were not given",
                    ));
                };
                Ok(X_WB.inverse()
                    * X_WF
                    * self.tool(X_FT).ok_or_else(|| unknown("the tool of the robot is not known"))?)
            }
            Place::Tool { X_WB: X_WB0, X_FT: X_FT0, X_BT: X_B0T0 } => {
                if X_FT0 == X_FT {
                    // The same frames: no rounding.
                    return Ok(if X_WB0 == X_WB { *X_B0T0 } else { X_WB.inverse() * X_WB0 * X_B0T0 });
                }
                let tools = self.tool(X_FT0).zip(self.tool(X_FT));
                let (X_FT0, X_FT) =
                    tools.ok_or_else(|| unknown("the tool changed and the robot's own tool is not known"))?;
                Ok(X_WB.inverse() * X_WB0 * X_B0T0 * X_FT0.inverse() * X_FT)
            }
        }
    }

    /// Tool on the flange; the robot's own where the program tells none.
    fn tool(&self, X_FT: &Option<Pose>) -> Option<Pose> {
        X_FT.or(self.options.own_tool)
    }

    /// Pose of the tool for joint values, if the robot's kinematics were given.
    pub(crate) fn forward(&self, joints: &[f64], X_FT: &Option<Pose>) -> Option<Pose> {
        let forward = self.options.forward?;
        Some(forward(joints)? * self.tool(X_FT)?)
    }

    /// The program.
    pub(crate) fn finish(mut self, name: &str) -> Recorded {
        self.notes.sort_by_key(|told| (told.file, told.lines.first().copied().unwrap_or(0)));
        let texts = &self.texts;
        let notes = self.notes.iter().map(|told| told.as_note(texts)).collect();
        Recorded { program: Program { name: name.to_owned(), items: self.items, notes }, sources: self.sources }
    }
}

impl Told {
    fn as_note(&self, texts: &[Text]) -> Note {
        if self.lines.is_empty() {
            return Note { line: None, text: self.text.clone() };
        }
        let lines: Vec<String> = self.lines.iter().map(usize::to_string).collect();
        let word = if lines.len() == 1 { "line" } else { "lines" };
        let more = match self.times - lines.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let file = match self.file {
            0 => String::new(),
            file => {
                texts[file].path.file_name().map(|name| format!(" of {}", name.to_string_lossy())).unwrap_or_default()
            }
        };
        let line = (self.file == 0).then(|| self.lines[0]);
        Note { line, text: format!("{} ({word} {}{more}{file})", self.text, lines.join(", ")) }
    }
}
