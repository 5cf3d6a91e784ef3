//! State of reading a file of measurements.

use std::ops::Range;
use std::path::Path;

use flexarm_kinematics::Frame;
use flexarm_run::robot_file::Source;
use flexarm_run::{Arm, Error};
use toml::Spanned;

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
    /// Number of rows of tables of places without a reading.
    pub(super) empty_rows: usize,
}

impl Reader<'_> {
    pub(crate) fn error(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        self.source.error(span, message).into()
    }

    /// Returns the frame of a moving link of the flexible arm.
    pub(crate) fn moving_link(&self, link: &Spanned<String>) -> Result<Frame, Error> {
        let model = &self.cell.arm.model;
        model.frame(link.get_ref()).filter(|frame| frame.body > 0).cloned().ok_or_else(|| {
            let known: Vec<&str> = flexarm_run::applied_load::moving_links(model);
            self.error(link.span(), format!("the robot has no moving link {:?}; it has {known:?}", link.get_ref()))
        })
    }
}
