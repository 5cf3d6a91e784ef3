//! Places in files.

use std::fmt;
use std::sync::Arc;

/// Place in a file. `Display` gives `path:line:column`, as far as they are known.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Place {
    /// Path of the file, as the user named it.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Column, from 1, in characters.
    pub column: Option<usize>,
}

impl Place {
    /// Creates the place of a file as a whole.
    pub fn of_file(file: impl fmt::Display) -> Self {
        Self { file: file.to_string().into(), line: None, column: None }
    }

    /// Returns the place of a line, from 1, in the same file.
    #[must_use]
    pub fn line(&self, line: usize) -> Self {
        Self { file: self.file.clone(), line: Some(line), column: None }
    }

    /// Returns the place of a line and a column, from 1, in the same file.
    #[must_use]
    pub fn at(&self, line: usize, column: usize) -> Self {
        Self { column: Some(column), ..self.line(line) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        self.line.iter().chain(&self.column).try_for_each(|number| write!(f, ":{number}"))
    }
}
