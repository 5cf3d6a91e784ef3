//! State of reading a file of measurements.

use std::ops::Range;
use std::path::Path;

use flexarm_run::robot_file::Source;
use flexarm_run::{Arm, Error};

use crate::estimation::Measurements;

/// Factors from the units of a file to SI units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    pub(crate) length: f64,
    pub(crate) angle: f64,
    pub(crate) force: f64,
}

/// Robot data needed to read its measurements.
pub(crate) struct Cell<'a> {
    /// Actuated joints in coordinate order, and whether they slide.
    pub(crate) joints: &'a [(String, bool)],
    /// Measured arm.
    pub(crate) arm: &'a Arm,
}

/// State of the reader.
pub(crate) struct Reader<'a> {
    pub(crate) cell: &'a Cell<'a>,
    pub(super) source: &'a Source,
    pub(crate) folder: &'a Path,
    pub(crate) units: Units,
    pub(super) instruments: Vec<String>,
    pub(super) targets: Vec<String>,
    pub(crate) measurements: Measurements,
    /// For each reading: kind of quantity, whether a standard deviation is given, and its place in
    /// the file.
    pub(crate) given: Vec<(&'static str, bool, Range<usize>)>,
}

impl Reader<'_> {
    pub(crate) fn error(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        self.source.error(span, message).into()
    }
}
