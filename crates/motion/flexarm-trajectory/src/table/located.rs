//! A problem in a table and its place in the file.

use crate::problem::Problem;

/// A problem and its place in the file.
pub(super) struct Located {
    pub(super) line: Option<usize>,
    /// Index of the field in the line.
    pub(super) field: Option<usize>,
    pub(super) problem: Problem,
    /// Other lines that are wrong.
    pub(super) more_lines: Vec<usize>,
}

pub(super) fn at(line: usize, problem: Problem) -> Located {
    Located { line: Some(line), field: None, problem, more_lines: Vec::new() }
}

pub(super) fn at_field(line: usize, field: usize, problem: Problem) -> Located {
    Located { field: Some(field), ..at(line, problem) }
}

pub(super) fn nowhere(problem: Problem) -> Located {
    Located { line: None, field: None, problem, more_lines: Vec::new() }
}
