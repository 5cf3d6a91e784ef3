//! Nastran bulk data: joins physical lines in small, large or free field into entries.
//!
//! Start at [`cards`]: `$` begins a comment; `*`, `+` or a blank keyword a continuation. Lines count from 1, fields
//! from 0. Not here: the meaning of the fields (`dmig.rs`).

use super::position::ErrorPosition;
use super::text::Text;
use crate::FeFileError;
use crate::number::shown;

/// Entry with all its continuation lines.
#[derive(Debug)]
pub(super) struct Card<'a> {
    /// Place of the first line.
    pub(super) place: ErrorPosition<'a>,
    /// Keyword without `*`, upper case.
    pub(super) keyword: String,
    /// Data fields after the keyword with their line numbers: eight per line, four in large field.
    pub(super) fields: Vec<(&'a str, usize)>,
}

impl<'a> Card<'a> {
    /// Data field `i`, from 0; empty if absent.
    pub(super) fn field(&self, i: usize) -> &'a str {
        self.fields.get(i).map_or("", |(text, _)| text)
    }

    /// Place of field `i`.
    pub(super) fn place_of(&self, i: usize) -> ErrorPosition<'a> {
        let line = self.fields.get(i).map(|(_, line)| *line).or(self.place.line);
        ErrorPosition { line, ..self.place }
    }
}

/// Entries with one of these keywords, in file order.
pub(super) fn cards<'a>(text: Text<'a>, keywords: &[&str]) -> Result<Vec<Card<'a>>, FeFileError> {
    let mut cards: Vec<Card<'_>> = Vec::new();
    let mut skipping = true;
    for (place, line) in text.lines() {
        let line = line.split('$').next().unwrap_or("").trim_end();
        if line.is_empty() {
            continue;
        }
        // A line that begins with a blank, * or + continues the card above.
        let (head, fields, beyond) = fields(line);
        let number = place.line.unwrap_or(0);
        let fields = fields.into_iter().map(|field| (field, number));
        let is_continuation = head.is_empty() || head.starts_with(['*', '+']);
        if !is_continuation {
            let keyword = head.trim_end_matches('*').trim().to_ascii_uppercase();
            skipping = !keywords.contains(&keyword.as_str());
            if !skipping {
                cards.push(Card { place, keyword, fields: Vec::new() });
            }
        }
        let Some(card) = cards.last_mut().filter(|_| !skipping) else { continue };
        if let Some(beyond) = beyond {
            let (found, help) = (shown(beyond), "put the rest on a line of its own that begins with a comma");
            return Err(place.fail("free field", found, "ten fields in a line", help));
        }
        card.fields.extend(fields);
    }
    Ok(cards)
}

/// First field and data fields of a line, padded to eight (small) or four (large field), and the
/// first excess field.
fn fields(line: &str) -> (&str, Vec<&str>, Option<&str>) {
    const SMALL: usize = 8;
    const LARGE: usize = 4;
    let (head, mut data, count) = if line.contains(',') {
        let mut parts = line.split(',').map(str::trim);
        let head = parts.next().unwrap_or("");
        let count = if head.contains('*') { LARGE } else { SMALL };
        (head, parts.collect::<Vec<_>>(), count)
    } else {
        let head = columns(line, 0, 8);
        let count = if head.contains('*') { LARGE } else { SMALL };
        let width = 64 / count;
        let data = (0..count).map(|i| columns(line, 8 + i * width, width)).collect();
        (head, data, count)
    };
    // One additional field is the name of the continuation.
    let beyond = data.iter().skip(count + 1).find(|field| !field.is_empty()).copied();
    data.resize(count, "");
    (head, data, beyond)
}

/// Columns of a line, trimmed; empty if beyond its end or not ASCII.
fn columns(line: &str, first: usize, width: usize) -> &str {
    let end = (first + width).min(line.len());
    line.get(first..end).unwrap_or("").trim()
}
