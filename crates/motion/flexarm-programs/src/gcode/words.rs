//! Splits lines of G-code into words: letters with numbers, which may be expressions with
//! parameters.
//!
//! Start at [`Parameters::line`]. Values are as written, without units. Parameters are numbered
//! (`#1`) or named (`#<name>`); assignments of a line take effect after its words are read, as the
//! standard says.
//!
//! Not here: what a word does (`modes`, `moves`, `frames`).

use std::collections::HashMap;

use crate::common::{Result, Span, fail};

/// A letter and its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Word {
    pub(super) letter: char,
    pub(super) value: f64,
    pub(super) span: Span,
}

/// Parameters (`#1`, `#<name>`).
#[derive(Debug, Default)]
pub(super) struct Parameters {
    values: HashMap<String, f64>,
}

/// A line as its words, without comments and line number.
#[derive(Debug, Default)]
pub(super) struct Line {
    pub(super) words: Vec<Word>,
    /// Whether the line begins with `/`.
    pub(super) is_optional: bool,
}

/// Maximum nesting depth of brackets.
const DEEPEST: usize = 32;

impl Parameters {
    pub(super) fn set(&mut self, name: &str, value: f64) {
        self.values.insert(name.to_lowercase(), value);
    }

    /// Returns the words of a line; parameters set in it take effect after the line.
    pub(super) fn line(&mut self, text: &str, file: usize, start: usize) -> Result<Line> {
        let mut reader = Reader { text: text.as_bytes(), at: 0, file, start, parameters: &self.values, depth: 0 };
        let (line, set) = reader.line()?;
        for (name, value) in set {
            self.values.insert(name, value);
        }
        Ok(line)
    }
}

struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    file: usize,
    start: usize,
    parameters: &'a HashMap<String, f64>,
    depth: usize,
}

impl Reader<'_> {
    fn span(&self, from: usize) -> Span {
        Span { file: self.file, start: self.start + from, end: self.start + self.at.max(from) }
    }

    /// Skips blanks and comments.
    fn pass(&mut self) -> Result<()> {
        while let Some(byte) = self.text.get(self.at) {
            match byte {
                b'(' => {
                    let from = self.at;
                    let Some(length) = comment_length(&self.text[self.at..]) else {
                        self.at = self.text.len();
                        return fail(self.span(from), "this comment does not end on its line: `)` is missing");
                    };
                    self.at += length;
                }
                b';' => self.at = self.text.len(),
                byte if byte.is_ascii_whitespace() || *byte == 0x1a => self.at += 1,
                0xEF | 0xBB | 0xBF => self.at += 1, // a byte order mark
                _ => return Ok(()),
            }
        }
        Ok(())
    }

    /// Parses the words of a line and the parameters that it sets.
    fn line(&mut self) -> Result<(Line, Vec<(String, f64)>)> {
        let mut line = Line::default();
        let mut set = Vec::new();
        self.pass()?;
        if self.text.get(self.at) == Some(&b'/') {
            line.is_optional = true;
            self.at += 1;
        }
        loop {
            self.pass()?;
            let from = self.at;
            let Some(&byte) = self.text.get(self.at) else { break };
            // `#1 = 2`, a program number, or a word.
            if byte == b'#' {
                self.at += 1;
                let name = self.parameter_name()?;
                self.pass()?;
                if self.text.get(self.at) != Some(&b'=') {
                    return fail(self.span(from), "`=` is expected behind a parameter that stands alone");
                }
                self.at += 1;
                set.push((name, self.value()?));
                continue;
            }
            if !byte.is_ascii_alphabetic() {
                self.at = self.text.len();
                return fail(self.span(from), "a word such as G1 or X10.5 is expected here");
            }
            self.at += 1;
            let letter = char::from(byte.to_ascii_uppercase());
            if letter == 'O' {
                self.at = self.text.len();
                return match is_program_number(&self.text[from + 1..]) {
                    true => Ok((line, set)),
                    false => fail(
                        self.span(from),
                        "subroutines and loops (O words) are not read: write the moves out, as CAM programs do",
                    ),
                };
            }
            let value = self.value()?;
            line.words.push(Word { letter, value, span: self.span(from) });
        }
        // Line numbers have no effect.
        line.words.retain(|word| word.letter != 'N');
        Ok((line, set))
    }

    /// Parses the name after `#`: a number, `<name>` or `[expression]`.
    fn parameter_name(&mut self) -> Result<String> {
        self.pass()?;
        let from = self.at;
        if self.text.get(self.at) == Some(&b'<') {
            let Some(length) = self.text[self.at..].iter().position(|b| *b == b'>') else {
                return fail(self.span(from), "the name of the parameter does not end: `>` is missing");
            };
            self.at += length + 1;
            let name = &self.text[from + 1..self.at - 1];
            return Ok(String::from_utf8_lossy(name).to_lowercase().replace(' ', ""));
        }
        let value = self.value()?;
        Ok(format!("{}", value.round() as i64))
    }

    /// Parses a number, a parameter, an expression in brackets or a function.
    fn value(&mut self) -> Result<f64> {
        if self.depth >= DEEPEST {
            return fail(
                self.span(self.at),
                format!("more than {DEEPEST} brackets are inside of each other: write it flatter"),
            );
        }
        self.depth += 1;
        let value = self.inner_value();
        self.depth -= 1;
        value
    }

    fn inner_value(&mut self) -> Result<f64> {
        self.pass()?;
        let from = self.at;
        // An expression in brackets, a parameter, a negated one of these, a function, or a number.
        match self.text.get(self.at) {
            // An expression in brackets.
            Some(b'[') => {
                self.at += 1;
                let value = self.sum()?;
                self.pass()?;
                if self.text.get(self.at) != Some(&b']') {
                    return fail(self.span(from), "`]` is missing");
                }
                self.at += 1;
                Ok(value)
            }
            // A parameter.
            Some(b'#') => {
                self.at += 1;
                let name = self.parameter_name()?;
                match self.parameters.get(&name) {
                    Some(value) => Ok(*value),
                    None => fail(
                        self.span(from),
                        format!(
                            "the parameter #{name} has no value: set it before, or give it as an option (`given`, #{name})"
                        ),
                    ),
                }
            }
            // The negative of either.
            Some(b'-') if self.text.get(self.at + 1).is_some_and(|next| matches!(next, b'#' | b'[')) => {
                self.at += 1;
                Ok(-self.value()?)
            }
            // A function with its argument, or a number.
            Some(byte) if byte.is_ascii_alphabetic() => self.function(),
            _ => self.number(),
        }
    }

    fn number(&mut self) -> Result<f64> {
        let from = self.at;
        let mut digits = String::new();
        while let Some(&byte) = self.text.get(self.at) {
            match byte {
                b'+' | b'-' if digits.is_empty() => digits.push(char::from(byte)),
                b'0'..=b'9' | b'.' => digits.push(char::from(byte)),
                b' ' | b'\t' if digits.len() < 2 && digits.parse::<f64>().is_err() => {} // `X - 5`
                _ => break,
            }
            self.at += 1;
        }
        match digits.parse::<f64>() {
            Ok(value) => Ok(value),
            Err(_) => {
                self.at = (self.at + 1).min(self.text.len());
                fail(
                    self.span(from.saturating_sub(1)),
                    format!("a number is expected behind the letter, found `{digits}`"),
                )
            }
        }
    }

    fn function(&mut self) -> Result<f64> {
        let from = self.at;
        while self.text.get(self.at).is_some_and(u8::is_ascii_alphabetic) {
            self.at += 1;
        }
        let name = String::from_utf8_lossy(&self.text[from..self.at]).to_uppercase();
        self.pass()?;
        if self.text.get(self.at) != Some(&b'[') {
            return fail(self.span(from), format!("a number is expected behind the letter, found `{name}`"));
        }
        let x = self.value()?;
        Ok(match name.as_str() {
            "ABS" => x.abs(),
            "SIN" => x.to_radians().sin(),
            "COS" => x.to_radians().cos(),
            "TAN" => x.to_radians().tan(),
            "ASIN" => x.asin().to_degrees(),
            "ACOS" => x.acos().to_degrees(),
            "SQRT" => x.sqrt(),
            "EXP" => x.exp(),
            "LN" => x.ln(),
            "ROUND" => x.round(),
            "FIX" => x.floor(),
            "FUP" => x.ceil(),
            _ => return fail(self.span(from), format!("the function {name} is not known")),
        })
    }

    fn sum(&mut self) -> Result<f64> {
        let mut value = self.product()?;
        loop {
            self.pass()?;
            match self.text.get(self.at) {
                Some(b'+') => {
                    self.at += 1;
                    value += self.product()?;
                }
                Some(b'-') => {
                    self.at += 1;
                    value -= self.product()?;
                }
                _ => return Ok(value),
            }
        }
    }

    fn product(&mut self) -> Result<f64> {
        let mut value = self.power()?;
        loop {
            self.pass()?;
            match self.text.get(self.at) {
                Some(b'*') => {
                    self.at += 1;
                    value *= self.power()?;
                }
                Some(b'/') => {
                    let from = self.at;
                    self.at += 1;
                    let divisor = self.power()?;
                    if divisor == 0.0 {
                        return fail(self.span(from), "a division by 0");
                    }
                    value /= divisor;
                }
                Some(b'M' | b'm') if self.text[self.at..].to_ascii_uppercase().starts_with(b"MOD") => {
                    self.at += 3;
                    value = value.rem_euclid(self.power()?);
                }
                _ => return Ok(value),
            }
        }
    }

    fn power(&mut self) -> Result<f64> {
        let mut value = self.value()?;
        loop {
            self.pass()?;
            if !self.text[self.at.min(self.text.len())..].starts_with(b"**") {
                return Ok(value);
            }
            self.at += 2;
            value = value.powf(self.value()?);
        }
    }
}

/// Length in bytes of a comment with its brackets, which may be nested.
fn comment_length(text: &[u8]) -> Option<usize> {
    let mut depth = 0;
    for (at, byte) in text.iter().enumerate() {
        match byte {
            b'(' => depth += 1,
            b')' if depth == 1 => return Some(at + 1),
            b')' => depth -= 1,
            _ => {}
        }
    }
    text.iter().position(|byte| *byte == b')').map(|at| at + 1)
}

/// Whether an O word is the program name (`O0001`) and not control flow (`O100 sub` etc.).
fn is_program_number(rest: &[u8]) -> bool {
    let text = String::from_utf8_lossy(rest);
    let outside = text.split(['(', ';']).next().unwrap_or_default().trim();
    !outside.is_empty() && outside.bytes().all(|byte| byte.is_ascii_digit())
}
