//! Lines of a deck: cards `*NAME, KEY=VALUE, FLAG` and their data lines.
//!
//! Start at [`Lines::card`] and [`Lines::data`]. Names are compared in upper case without blanks
//! ([`squeezed`]). Not here: the meaning of the cards ([`super::deck`]).

use crate::FeFileError;
use crate::mesh::source::Source;
use crate::number::{real, shown, unsigned};

/// Lines that are neither blank nor comments.
pub(super) struct Lines<'a> {
    pub(super) src: Source<'a>,
    pos: usize,
}

/// Line with its offset.
pub(super) type Line<'a> = (usize, &'a [u8]);

/// Keyword line.
pub(super) struct Card {
    /// Name in upper case, without blanks: `SOLIDSECTION`.
    pub(super) name: String,
    /// First words as in the file, for messages.
    pub(super) title: String,
    /// Offset of the line.
    pub(super) at: usize,
    parameters: Vec<(String, String)>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(src: Source<'a>) -> Self {
        let pos = if src.bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { src, pos }
    }

    /// Returns the next line and the start of the one after it, without advancing.
    fn peek(&mut self) -> Option<(Line<'a>, usize)> {
        let bytes = self.src.bytes;
        while self.pos < bytes.len() {
            let rest = &bytes[self.pos..];
            let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
            let next = self.pos + (length + 1).min(rest.len());
            let line = rest[..length].trim_ascii();
            if !line.is_empty() && !line.starts_with(b"**") {
                return Some(((self.pos, line), next));
            }
            self.pos = next;
        }
        None
    }

    /// Returns the next data line of the current card.
    pub(super) fn data(&mut self) -> Option<Line<'a>> {
        let (line, next) = self.peek()?;
        if line.1.starts_with(b"*") {
            return None;
        }
        self.pos = next;
        Some(line)
    }

    /// Returns the next card, skipping data lines before it.
    pub(super) fn card(&mut self) -> Option<Card> {
        loop {
            let ((at, line), next) = self.peek()?;
            self.pos = next;
            if line.starts_with(b"*") {
                let mut text = line[1..].to_vec();
                // A comma at the end continues the card in the next line.
                while text.trim_ascii_end().ends_with(b",") {
                    let Some(((_, more), next)) = self.peek() else { break };
                    if more.starts_with(b"*") || !more.contains(&b'=') {
                        break;
                    }
                    text.extend_from_slice(more);
                    self.pos = next;
                }
                return Some(Card::new(at, &text));
            }
        }
    }
}

impl Card {
    fn new(at: usize, text: &[u8]) -> Self {
        let text = String::from_utf8_lossy(text);
        let mut words = split_outside_quotes(&text);
        let first = words.next().unwrap_or("").trim();
        let parameters = words.map(|word| {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            (squeezed(key), unquoted(value).to_owned())
        });
        let parameters = parameters.collect();
        Self { name: squeezed(first), title: format!("*{}", first.to_uppercase()), at, parameters }
    }

    /// Value of a parameter, empty for a flag.
    pub(super) fn get(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// Whether a parameter is given.
    pub(super) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Value of a required parameter.
    pub(super) fn need(&self, src: &Source, key: &str) -> Result<&str, FeFileError> {
        self.get(key)
            .filter(|value| !value.is_empty())
            .ok_or_else(|| src.error(self.at, self.title.as_str(), format!("no {key}="), format!("{key}=name")))
    }

    /// Creates an error at the card.
    pub(super) fn refuse(&self, src: &Source, found: impl Into<Box<str>>, expected: &str) -> FeFileError {
        src.error(self.at, self.title.as_str(), found, expected)
    }
}

/// Comma-separated fields of a data line, trimmed; a comma at the end adds no field.
pub(super) fn fields(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let line = line.trim_ascii_end();
    line.strip_suffix(b",").unwrap_or(line).split(|byte| *byte == b',').map(<[u8]>::trim_ascii)
}

/// Parses all fields of a data line as numbers; an empty field is zero.
pub(super) fn numbers(src: &Source, card: &Card, (at, line): Line) -> Result<Vec<f64>, FeFileError> {
    let number = |field: &[u8]| {
        let value = if field.is_empty() { Some(0.0) } else { std::str::from_utf8(field).ok().and_then(real) };
        match value {
            Some(value) if value.is_finite() => Ok(value),
            Some(_) => Err(src.error(at, card.title.as_str(), shown(field), "a finite number")),
            None => Err(src.error(at, card.title.as_str(), shown(field), "a number")),
        }
    };
    fields(line).map(number).collect()
}

/// Parses a field as the number of a node or an element.
pub(super) fn id(src: &Source, at: usize, what: &str, field: &[u8]) -> Result<u64, FeFileError> {
    unsigned(field).ok_or_else(|| src.error(at, what, shown(field), "a number without sign or point"))
}

/// Converts to upper case and removes blanks.
pub(super) fn squeezed(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace()).flat_map(char::to_uppercase).collect()
}

/// Trims blanks and surrounding quotes.
pub(super) fn unquoted(text: &str) -> &str {
    let text = text.trim();
    text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text)
}

fn split_outside_quotes(text: &str) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    text.split(move |c| {
        quoted ^= c == '"';
        c == ',' && !quoted
    })
}
