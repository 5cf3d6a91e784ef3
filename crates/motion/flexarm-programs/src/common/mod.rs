//! Parts shared by the languages: tokens, expressions, statements, the interpreter, frames, and the
//! recorder of moves and notes.

pub(crate) mod expressions;
pub(crate) mod frames;
pub(crate) mod lexer;
pub(crate) mod machine;
pub(crate) mod recorder;
pub(crate) mod tree;
pub(crate) mod value;

use std::rc::Rc;

use flexarm_settings::Place;

/// Byte range in one of the files of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Span {
    pub(crate) file: usize,
    pub(crate) start: usize,
    pub(crate) end: usize,
}

impl Span {
    /// Span from the start of this one to the end of the other.
    pub(crate) fn to(self, other: Self) -> Self {
        Self { end: other.end.max(self.end), ..self }
    }
}

/// An error and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fail {
    pub(crate) span: Span,
    pub(crate) message: String,
}

pub(crate) type Result<T> = std::result::Result<T, Fail>;

/// Returns an error at a place.
pub(crate) fn fail<T>(span: Span, message: impl Into<String>) -> Result<T> {
    Err(Fail { span, message: message.into() })
}

/// One file of a program in memory.
#[derive(Debug, Clone)]
pub(crate) struct Text {
    pub(crate) path: std::path::PathBuf,
    /// The file as a whole.
    pub(crate) file: Place,
    pub(crate) text: Rc<str>,
    /// Start of each line.
    lines: Vec<usize>,
}

impl Text {
    pub(crate) fn new(path: &std::path::Path, text: &str) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { path: path.to_owned(), file: Place::of_file(path.display()), text: text.into(), lines }
    }

    /// Place of a byte offset.
    pub(crate) fn place(&self, at: usize) -> Place {
        let line = self.lines.partition_point(|&start| start <= at);
        let before = self.text.get(self.lines[line - 1]..at).unwrap_or_default();
        self.file.at(line, before.chars().count() + 1)
    }

    /// Text of a span, on one line and shortened for messages.
    pub(crate) fn excerpt(&self, span: Span) -> String {
        let text = self.text.get(span.start..span.end).unwrap_or_default();
        let mut words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        if words.chars().count() > LONGEST_EXCERPT {
            words = words.chars().take(LONGEST_EXCERPT - 3).collect::<String>() + "...";
        }
        words
    }
}

/// Maximum number of characters of a statement in a message or a move.
const LONGEST_EXCERPT: usize = 100;

/// Returns the text with blanks in place of the lines that begin with `first`, which are not of the
/// language (`&ACCESS RVP`, `$ 3 "MoveJ"`); positions do not change.
pub(crate) fn without_lines(text: &str, first: char) -> String {
    let line = |line: &str| if line.trim_start().starts_with(first) { blank(line) } else { line.to_owned() };
    text.split_inclusive('\n').map(line).collect()
}

/// Returns blanks of the same length and number of lines.
pub(crate) fn blank(text: &str) -> String {
    text.chars().map(|c| if c == '\n' { "\n".to_owned() } else { " ".repeat(c.len_utf8()) }).collect()
}

/// Whether a name is one of the words of a text, which blanks separate.
pub(crate) fn is_among(name: &str, words: &str) -> bool {
    words.split(' ').any(|word| word == name)
}
