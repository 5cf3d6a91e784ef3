//! A problem in a table and its place in the file.

use crate::problem::Problem;

/// A problem and its place in the file.
pub(super) struct Located {
    pub(super) line: Option<usize>,
    pub(super) column: Option<usize>,
    pub(super) problem: Box<Problem>,
    /// Other lines that are wrong.
    pub(super) more_lines: Vec<usize>,
}

pub(super) fn at(line: usize, problem: Problem) -> Located {
    Located { line: Some(line), column: None, problem: Box::new(problem), more_lines: Vec::new() }
}

pub(super) fn at_field(line: usize, column: usize, problem: Problem) -> Located {
    Located { column: Some(column + 1), ..at(line, problem) }
}

pub(super) fn nowhere(problem: Problem) -> Located {
    Located { line: None, column: None, problem: Box::new(problem), more_lines: Vec::new() }
}
