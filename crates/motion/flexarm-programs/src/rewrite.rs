//! Rewrites a program with other targets: the numbers of their literals are replaced, everything
//! else is kept.
//!
//! Start at [`read_program_text`]. A target can be replaced if it is a literal (`{X 1000, ...}`,
//! `[[1000, ...], ...]`), in the statement or assigned to a variable that it names; a computed,
//! relative or indexed target has no literal of its own. Numbers are written in mm and degrees with
//! the digits of [`DIGITS`]. Not here: computation of the targets.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use flexarm_path::program::{Configuration, Program, Selection};
use flexarm_spatial::Pose;
use nalgebra::Vector3;

use crate::common::expressions::{Parser, Syntax};
use crate::common::frames::{mm_deg_zyx, quaternion};
use crate::common::lexer::tokens;
use crate::common::recorder::Sources;
use crate::common::tree::{Expr, Kind};
use crate::common::value::Value;
use crate::common::{Span, Text};
use crate::{Language, ProgramError, ReadOptions, krl, rapid, read_recorded};

/// Decimals of mm, degrees and quaternion components; the rounding is below what a controller
/// resolves.
const DIGITS: [usize; 3] = [4, 6, 9];
/// Maximum difference of values for one literal from several moves that count as equal, in units of
/// the last digit.
const SAME: f64 = 2.5;
/// The controller's own file, which other programs use as well.
const CONFIGURATION: &str = "$config.dat";

/// New target of a move.
#[derive(Clone, Debug, PartialEq)]
pub enum NewTarget {
    /// Values of the controller's axes (rad or m).
    Joints(Vec<f64>),
    /// Pose `X_BT` with the branch of the inverse kinematics; only those parts of the branch are
    /// written that the old target gives.
    Pose {
        /// `X_BT`.
        X_BT: Pose,
        /// Branch of the inverse kinematics.
        configuration: Configuration,
    },
}

/// A program with its texts.
pub struct ProgramText {
    /// Moves of the program.
    pub program: Program,
    /// Language of the program.
    pub language: Language,
    texts: Vec<Text>,
    sources: Vec<Sources>,
    /// Bytes of the program's own file, to keep its encoding.
    main: Vec<u8>,
}

/// Files of a program with other targets.
pub struct Rewritten {
    /// Changed files, with the program's own first: original names, and bytes.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// Indices of the items whose targets were replaced.
    pub replaced: Vec<usize>,
    /// Indices of the moves whose targets are unchanged, with the reason.
    pub left: Vec<(usize, &'static str)>,
}

/// Reads a program like [`crate::read_program`], and keeps the places of its targets.
///
/// # Errors
/// As [`crate::read_program`].
pub fn read_program_text(path: &Path, bytes: &[u8], options: &ReadOptions<'_>) -> Result<ProgramText, ProgramError> {
    let (recorded, language, texts) = read_recorded(path, bytes, options)?;
    let (program, sources) = (recorded.program, recorded.sources);
    Ok(ProgramText { program, language, texts, sources, main: bytes.to_vec() })
}

/// A number in a text and its replacement.
#[derive(Clone, Debug)]
struct Edit {
    value: f64,
    digits: usize,
    /// Text inserted before the number: empty, or the name of a coordinate that was omitted.
    before: String,
}

type Edits = BTreeMap<(usize, usize, usize), Edit>;

impl ProgramText {
    /// Returns the files with other targets; the lines are not moved.
    ///
    /// * `targets`: for some items (by index among those of the program) the new target, and the
    ///   auxiliary point of a circle, in the base B (m).
    /// * `comment`: one line of plain letters for the head of each changed file.
    ///
    /// A literal used by several moves is replaced only if all of them agree.
    pub fn rewritten(&self, targets: &[(usize, NewTarget, Option<Vector3<f64>>)], comment: &str) -> Rewritten {
        let mut edits = Edits::new();
        let (mut replaced, mut left) = (Vec::new(), Vec::new());
        let mut torn: Vec<Span> = Vec::new();
        let mut wanted = Vec::new();
        for (item, target, via) in targets {
            match self.edits_of(*item, target, via.as_ref()) {
                Ok(own) => wanted.push((*item, own)),
                Err(why) => left.push((*item, why)),
            }
        }
        // Conflicting replacements of a literal are dropped for all its moves.
        for (item, own) in &wanted {
            let differs = own.iter().any(|(place, edit)| {
                edits.get(place).is_some_and(|old: &Edit| {
                    (old.value - edit.value).abs() > SAME * 0.1f64.powi(edit.digits as i32) || old.before != edit.before
                })
            });
            if differs {
                torn.extend(self.sources[*item].target);
            }
            edits.extend(own.iter().map(|(place, edit)| (*place, edit.clone())));
        }
        edits
            .retain(|(file, start, _), _| !torn.iter().any(|s| s.file == *file && s.start <= *start && *start < s.end));
        for (item, _) in &wanted {
            match self.sources[*item].target.is_some_and(|source| torn.contains(&source)) {
                true => left.push((*item, "moves with different corrections share the target")),
                false => replaced.push(*item),
            }
        }
        left.sort_unstable();
        Rewritten { files: self.files(&edits, comment), replaced, left }
    }

    fn edits_of(&self, item: usize, target: &NewTarget, via: Option<&Vector3<f64>>) -> Result<Edits, &'static str> {
        let sources = self.sources.get(item).ok_or("there is no such move")?;
        let source = sources
            .target
            .ok_or("its target is computed, relative or the end of an arc given by its angle, not a literal")?;
        let mut edits = self.literal(source, target)?;
        if let Some(via) = via {
            let source = sources.via.ok_or("its auxiliary point is not a literal")?;
            edits.extend(self.point(source, via)?);
        }
        Ok(edits)
    }

    /// Parses the literal at a place; spans are relative to its file.
    fn parsed(&self, source: Span) -> Result<Expr, &'static str> {
        let text = self.texts.get(source.file).ok_or("its target is in no file")?;
        let name = text.path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        // The last text holds the given values.
        if source.file + 1 == self.texts.len() && self.texts.len() > 1 {
            return Err("its target was given beside the files");
        }
        if name == CONFIGURATION {
            return Err("its target is in the controller's own data");
        }
        let (syntax, spelling) = match self.language {
            Language::Krl => (Syntax::Krl, &krl::SPELLING),
            _ => (Syntax::Rapid, &rapid::SPELLING),
        };
        let literal = text.text.get(source.start..source.end).ok_or("its target is in no file")?;
        let mut lexemes = tokens(literal, source.file, spelling).map_err(|_| "its target is not a literal")?;
        for lexeme in &mut lexemes {
            lexeme.span.start += source.start;
            lexeme.span.end += source.start;
        }
        Parser::new(syntax, lexemes).expression().map_err(|_| "its target is not a literal")
    }

    fn literal(&self, source: Span, target: &NewTarget) -> Result<Edits, &'static str> {
        // KRL has records of named numbers, RAPID lists of lists: place, orientation,
        // configuration.
        let literal = self.parsed(source)?;
        let mut edits = Edits::new();
        match (&literal.kind, target) {
            (Kind::Record(_, fields), NewTarget::Joints(values)) => {
                for (k, value) in values.iter().enumerate().take(6) {
                    put_field(
                        &mut edits,
                        &literal,
                        fields,
                        &format!("a{}", k + 1),
                        value.to_degrees(),
                        DIGITS[1],
                        true,
                    )?;
                }
            }
            (Kind::Record(_, fields), NewTarget::Pose { X_BT, configuration }) => {
                let names = ["x", "y", "z", "a", "b", "c"];
                for (k, (name, value)) in names.iter().zip(mm_deg_zyx(X_BT)).enumerate() {
                    put_field(&mut edits, &literal, fields, name, value, DIGITS[usize::from(k > 2)], true)?;
                }
                if let Configuration::Selected(Selection::Kuka { status, turn }) = configuration {
                    for (name, bits) in [("s", status), ("t", turn)] {
                        if let Some(bits) = bits {
                            put_field(&mut edits, &literal, fields, name, f64::from(*bits), 0, false)?;
                        }
                    }
                }
            }
            (Kind::List(parts), NewTarget::Joints(values)) => {
                put_list(
                    &mut edits,
                    parts.first(),
                    &values.iter().map(|v| v.to_degrees()).collect::<Vec<_>>(),
                    DIGITS[1],
                )?;
            }
            (Kind::List(parts), NewTarget::Pose { X_BT, configuration }) => {
                let place = X_BT.translation.vector * 1e3;
                put_list(&mut edits, parts.first(), place.as_slice(), DIGITS[0])?;
                put_list(&mut edits, parts.get(1), &quaternion(&X_BT.rotation), DIGITS[2])?;
                if let Configuration::Selected(Selection::Abb { quadrants: [a, b, c], cfx }) = configuration {
                    put_list(&mut edits, parts.get(2), &[*a, *b, *c, *cfx].map(f64::from), 0)?;
                }
            }
            _ => return Err("its target is not a literal"),
        }
        Ok(edits)
    }

    /// Edits of an auxiliary point.
    fn point(&self, source: Span, p_B: &Vector3<f64>) -> Result<Edits, &'static str> {
        let literal = self.parsed(source)?;
        let (mut edits, p) = (Edits::new(), p_B * 1e3);
        match &literal.kind {
            Kind::Record(_, fields) => {
                for (name, value) in ["x", "y", "z"].iter().zip(p.iter()) {
                    put_field(&mut edits, &literal, fields, name, *value, DIGITS[0], true)?;
                }
            }
            Kind::List(parts) => put_list(&mut edits, parts.first(), p.as_slice(), DIGITS[0])?,
            _ => return Err("its auxiliary point is not a literal"),
        }
        Ok(edits)
    }

    /// Returns the changed files, always including the program's own.
    fn files(&self, edits: &Edits, comment: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let changed = |k: usize| k == 0 || edits.keys().any(|(file, ..)| *file == k);
        let texts = self.texts.iter().enumerate().filter(|(k, _)| changed(*k));
        texts
            .map(|(k, text)| {
                let mut new = String::with_capacity(text.text.len() + 64);
                let mut at = 0;
                for ((_, start, end), edit) in edits.range((k, 0, 0)..(k + 1, 0, 0)) {
                    new += &text.text[at..*start];
                    new += &edit.before;
                    new += &number(edit.value, edit.digits);
                    at = *end;
                }
                new += &text.text[at..];
                (text.path.clone(), self.encoded(k, &self.with_comment(new, comment)))
            })
            .collect()
    }

    /// Inserts the comment after the first line of the program's text, so that no line moves.
    fn with_comment(&self, text: String, comment: &str) -> String {
        let (words, mark): (&[&str], _) = match self.language {
            Language::Krl => (&["def ", "deffct ", "defdat ", "global def"], ';'),
            _ => (&["module "], '!'),
        };
        let begins = |line: &str| words.iter().any(|word| line.trim_start().to_lowercase().starts_with(word));
        let head = text.split_inclusive('\n').scan(0, |at, line| {
            let start = *at;
            *at += line.len();
            Some((start, line))
        });
        let plain = |line: &str| !(line.trim().is_empty() || line.starts_with('&') || line.starts_with("%%%"));
        let lines: Vec<(usize, &str)> = head.collect();
        let line = lines.iter().find(|(_, line)| begins(line)).or(lines.iter().rfind(|(_, line)| plain(line)));
        let Some((start, line)) = line else { return text };
        let end = start + line.trim_end().len();
        format!("{} {mark} {comment}{}", &text[..end], &text[end..])
    }

    /// Encodes the text as the file was encoded.
    fn encoded(&self, file: usize, text: &str) -> Vec<u8> {
        let old = if file == 0 { self.main.clone() } else { std::fs::read(&self.texts[file].path).unwrap_or_default() };
        match std::str::from_utf8(&old) {
            Ok(old) if old.starts_with('\u{feff}') => format!("\u{feff}{text}").into_bytes(),
            Ok(_) => text.as_bytes().to_vec(),
            Err(_) => text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect(),
        }
    }
}

/// Replaces a field of a record; a missing one is added if `add` is set.
fn put_field(
    edits: &mut Edits,
    record: &Expr,
    fields: &[(std::rc::Rc<str>, Expr)],
    name: &str,
    value: f64,
    digits: usize,
    add: bool,
) -> Result<(), &'static str> {
    match fields.iter().find(|(field, _)| &**field == name) {
        Some((_, old)) => put(edits, old, value, digits),
        None if !add => Ok(()),
        None => {
            let end = record.span.end - 1;
            let comma = if fields.is_empty() { "" } else { ", " };
            let before = format!("{comma}{} ", name.to_uppercase());
            // Several fields added at one place follow each other.
            match edits.get_mut(&(record.span.file, end, end)) {
                Some(edit) => {
                    edit.before += &format!("{}{before}", number(edit.value, edit.digits));
                    (edit.value, edit.digits) = (value, digits);
                }
                None => {
                    edits.insert((record.span.file, end, end), Edit { value, digits, before });
                }
            }
            Ok(())
        }
    }
}

fn put_list(edits: &mut Edits, list: Option<&Expr>, values: &[f64], digits: usize) -> Result<(), &'static str> {
    let Some(Expr { kind: Kind::List(old), .. }) = list else { return Err("a part of its target is not a literal") };
    if old.len() < values.len() {
        return Err("its target has too few numbers");
    }
    old.iter().zip(values).try_for_each(|(old, value)| put(edits, old, *value, digits))
}

fn put(edits: &mut Edits, old: &Expr, value: f64, digits: usize) -> Result<(), &'static str> {
    if !matches!(old.kind, Kind::Literal(Value::Number(_) | Value::Whole(_))) {
        return Err("a number of its target is computed");
    }
    edits.insert((old.span.file, old.span.start, old.span.end), Edit { value, digits, before: String::new() });
    Ok(())
}

/// Formats a number with at most `digits` decimals, without trailing zeros; at least one decimal is
/// kept unless `digits` is 0.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if digits == 0 {
        return text;
    }
    let text = text.trim_end_matches('0');
    let text = if text.ends_with('.') { format!("{text}0") } else { text.to_owned() };
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0.0".to_owned() } else { text }
}
