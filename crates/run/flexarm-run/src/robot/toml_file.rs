//! Reading of flexarm's own TOML files: each begins with `format = 1`, and errors name their
//! location.
//!
//! Start at [`parsed`]; [`word`] reads keys with a choice of words, such as units.

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_settings::exact;
use serde::de::DeserializeOwned;
use toml::Spanned;

use crate::ranges::{Ranges, not_finite, outside};

/// Maximum length of a value that a message repeats (bytes).
const MAX_FOUND: usize = 60;

/// Reads the content of a file.
///
/// * `ranges`: of its numbers.
/// * `format`: accessor of the format version.
///
/// # Errors
/// [`RobotFileError`] with line and column for anything that does not follow the format.
pub fn parsed<T: DeserializeOwned>(
    text: &str,
    source: &Source,
    ranges: Ranges,
    format: impl Fn(&T) -> &Spanned<i64>,
) -> Result<T, RobotFileError> {
    let file: T = toml::Deserializer::parse(text).and_then(exact).map_err(|error| {
        let hint = match error.message().contains("missing field `format`") {
            true => ": add format = 1 as the first line",
            false if error.message().contains("missing field `kind`") => {
                ": kind = \"...\" says what the entry is; `flexarm format` lists the kinds"
            }
            false => "",
        };
        // A key with several forms says what it expects, but not what it got.
        let message = error.message().trim();
        let value = error.span().filter(|_| message.starts_with("expected ")).and_then(|span| text.get(span));
        let found = value.filter(|value| value.len() <= MAX_FOUND && !value.contains('\n'));
        let found = found.map(|value| format!(", found {value}")).unwrap_or_default();
        source.unread(error.span(), &format!("{message}{found}{hint}"))
    })?;
    let version = format(&file);
    if *version.get_ref() != 1 {
        let found = version.get_ref();
        let message = format!("format is {found}, this program reads format 1: change it or update flexarm");
        return Err(source.error(version.span(), message));
    }
    // Readers of files with ranges reject non-finite numbers key by key; for others it is done
    // here.
    let unknown = if ranges.is_empty() { not_finite(text) } else { None };
    match outside(text, ranges).or(unknown) {
        Some((span, message)) => Err(source.error(span, message)),
        None => Ok(file),
    }
}

/// Returns the entry of a table of words for the value of a key; the first entry without a value.
///
/// # Errors
/// [`RobotFileError`] at the value, with the words of the table.
///
/// # Panics
/// Panics if the table is empty.
pub fn word<'a, T>(
    source: &Source,
    key: &str,
    given: &Option<Spanned<String>>,
    known: &'a [(&'static str, T)],
) -> Result<&'a (&'static str, T), RobotFileError> {
    let Some(given) = given else { return Ok(&known[0]) };
    known.iter().find(|(word, _)| word == given.get_ref()).ok_or_else(|| {
        let words: Vec<&str> = known.iter().map(|(word, _)| *word).collect();
        source.error(given.span(), format!("{key} = {:?} is not known; use one of {words:?}", given.get_ref()))
    })
}
