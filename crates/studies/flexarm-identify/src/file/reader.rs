//! State of reading a file of measurements, with the errors at `path:line:column`.
//!
//! The other modules of this folder add one kind of entry each, as `impl Reader`. A [`Site`] is an
//! entry of the file itself or a row of one of its tables.

use std::ops::Range;
use std::path::Path;

use flexarm_files::NumberTable;
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

/// Place of a value, for messages.
#[derive(Clone, Debug)]
pub(crate) enum Site<'a> {
    /// Bytes of the file of measurements.
    Entry(Range<usize>),
    /// Row of a table, from 0.
    Row(&'a NumberTable, usize),
}

impl<T> From<&Spanned<T>> for Site<'_> {
    fn from(value: &Spanned<T>) -> Self {
        Self::Entry(value.span())
    }
}

/// Returns a value of the file of measurements with its place.
pub(crate) fn located<T: Clone>(value: &Option<Spanned<T>>) -> Option<(T, Site<'static>)> {
    value.as_ref().map(|value| (value.get_ref().clone(), value.into()))
}

impl<'a> From<&Site<'a>> for Site<'a> {
    fn from(site: &Self) -> Self {
        site.clone()
    }
}

/// State of the reader.
pub(crate) struct Reader<'a> {
    pub(crate) cell: &'a Cell<'a>,
    pub(crate) source: &'a Source,
    pub(crate) folder: &'a Path,
    pub(crate) units: Units,
    pub(super) targets: Vec<String>,
    pub(crate) measurements: Measurements,
    /// Number of rows of tables of places without a reading.
    pub(super) empty_rows: usize,
}

impl Reader<'_> {
    /// Creates an error with file, line and column.
    pub(crate) fn error<'a>(&self, site: impl Into<Site<'a>>, message: impl Into<String>) -> Error {
        match site.into() {
            Site::Entry(span) => self.source.error(span, message).into(),
            Site::Row(table, row) => table.error(Some(row), message).into(),
        }
    }

    /// Returns the frame of a moving link of the flexible arm.
    pub(crate) fn moving_link(&self, link: &Spanned<String>) -> Result<Frame, Error> {
        let model = &self.cell.arm.model;
        model.frame(link.get_ref()).filter(|frame| frame.body > 0).cloned().ok_or_else(|| {
            let known: Vec<&str> = flexarm_run::applied_load::moving_links(model);
            self.error(link, format!("the robot has no moving link {:?}; it has {known:?}", link.get_ref()))
        })
    }
}
