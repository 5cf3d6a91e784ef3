//! Reading of text files: regular files only, up to a size limit. Errors in them are reported with
//! line and column.

use std::io::Read;
use std::path::{Path, PathBuf};

use flexarm_settings::Place;

use crate::FileError;

/// Maximum size of a file (bytes).
const LARGEST: u64 = 256 << 20;

/// Returns the path of the file that the entry `key` of a file in `folder` names.
///
/// # Errors
/// Message for that entry: there is no such file.
pub fn named_file(key: &str, file: &Path, folder: &Path) -> Result<PathBuf, String> {
    let path = folder.join(file);
    match path.is_file() {
        true => Ok(path),
        false => Err(format!(
            "{key} = {file:?}: there is no file {}: correct the path, which is relative to the folder of this file",
            path.display()
        )),
    }
}

/// Reads a file of at most `largest` bytes: a regular one, since devices may be endless, and pipes
/// may block.
///
/// # Errors
/// The error of the operating system; `Other` if the path is not a regular file, `FileTooLarge` if
/// it has more bytes.
pub fn read_file(path: &Path, largest: u64) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("this is not a file; give the path of a regular one"));
    }
    let mut bytes = Vec::new();
    // One byte more than allowed, to detect a larger file.
    std::fs::File::open(path)?.take(largest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest {
        let what = format!("more than {largest} bytes, the limit");
        return Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

/// Reads the text of a file.
///
/// # Errors
/// [`FileError::Unusable`] for a path that cannot be read, is not a regular file, is too large or
/// is not UTF-8 text.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let fail = |what: String| FileError::Unusable { path: path.to_owned(), what };
    let bytes = read_file(path, LARGEST).map_err(|error| match error.kind() {
        std::io::ErrorKind::FileTooLarge => fail(format!("has more than {LARGEST} bytes, the limit")),
        _ => fail(format!("cannot be read: {error}")),
    })?;
    let not_text = "cannot be read: it is not text in UTF-8; save it as that, or is it another file?";
    String::from_utf8(bytes).map_err(|_| fail(not_text.into()))
}

/// Error in a text file, with its position.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {message}", self.place())]
pub struct TextFileError {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// Message: what was found, what was expected, and the remedy.
    pub message: String,
    /// Documentation page that describes the format: `robot`, `loads`, `measurements`, ...
    pub page: &'static str,
}

impl TextFileError {
    /// Returns its place in the file.
    pub fn place(&self) -> Place {
        Place::of_file(self.path.display()).at(self.line, self.column)
    }
}

/// Text of a file with its path, for error positions.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    text: String,
    page: &'static str,
}

impl Source {
    /// Creates the source for the file at `path`, whose format is described on `page` of the
    /// documentation.
    pub fn new(path: &Path, text: &str, page: &'static str) -> Self {
        Self { path: path.to_owned(), text: text.to_owned(), page }
    }

    /// Text of the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Creates an error at a byte range of the text.
    pub fn error(&self, span: std::ops::Range<usize>, message: impl Into<String>) -> TextFileError {
        let before = self.text.get(..span.start).unwrap_or(&self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        TextFileError { path: self.path.clone(), line, column, message: message.into(), page: self.page }
    }

    /// Creates an error from a message of the TOML parser, in terms of the file format instead of
    /// Rust types.
    pub fn unread(&self, span: Option<std::ops::Range<usize>>, message: &str) -> TextFileError {
        self.error(span.unwrap_or(0..0), flexarm_settings::without_types(message))
    }
}
