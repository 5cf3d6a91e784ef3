//! File of measurements (`docs/identify.md`): single readings or tables, units, and the unknown
//! parameters.
//!
//! Start at [`read`]. Each kind of reading has a module with its entry and its method of [`Reader`];
//! responses and mode shapes are in [`crate::response_file`]. Values leave in SI units.

mod common;
mod displacement;
mod frame;
mod frequency;
mod place;
mod reader;
mod recording;

use std::collections::BTreeMap;
use std::path::Path;

use flexarm_files::read_text;
use flexarm_run::robot_file::Source;
use flexarm_run::toml_file::{parsed, word};
use flexarm_run::{Error, RobotFileError};
use serde::Deserialize;
use toml::Spanned;

use self::displacement::DisplacementEntry;
use self::frame::{InstrumentEntry, TargetEntry};
use self::frequency::FrequencyEntry;
use self::place::PlaceEntry;
use self::reader::Units;
use self::recording::EncodersEntry;
use super::response_file::{NodeEntry, ResponseEntry, ShapeEntry};
use crate::estimation::{Loss, Measurements};

pub(super) use self::common::{Joints, LoadEntry};
pub(super) use self::reader::{Cell, Reader, Site, located};
pub(super) use self::recording::EncoderRecording;

/// Contents of the file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasurementFile {
    format: Spanned<i64>,
    length: Option<Spanned<String>>,
    angle: Option<Spanned<String>>,
    force: Option<Spanned<String>>,
    loss: Option<Spanned<String>>,
    #[serde(default)]
    fit: Vec<Spanned<String>>,
    #[serde(default)]
    keep: Vec<Spanned<String>>,
    #[serde(default)]
    tie: Vec<Spanned<String>>,
    uncertainty: Option<Spanned<f64>>,
    #[serde(default)]
    parameter: Vec<ParameterEntry>,
    #[serde(default)]
    instrument: BTreeMap<String, Spanned<InstrumentEntry>>,
    #[serde(default)]
    target: BTreeMap<String, Spanned<TargetEntry>>,
    #[serde(default)]
    displacement: Vec<Spanned<DisplacementEntry>>,
    #[serde(default)]
    place: Vec<Spanned<PlaceEntry>>,
    #[serde(default)]
    frequency: Vec<Spanned<FrequencyEntry>>,
    #[serde(default)]
    encoders: Vec<Spanned<EncodersEntry>>,
    /// Excited and measured points of the arm.
    #[serde(default)]
    node: BTreeMap<String, Spanned<NodeEntry>>,
    #[serde(default)]
    response: Vec<Spanned<ResponseEntry>>,
    #[serde(default)]
    shape: Vec<Spanned<ShapeEntry>>,
}

/// Prior knowledge of one parameter.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterEntry {
    name: Spanned<String>,
    uncertainty: Spanned<f64>,
}

/// Contents of the file in SI units.
#[derive(Debug, Default)]
pub(super) struct MeasurementInput {
    pub(super) measurements: Measurements,
    pub(super) recordings: Vec<EncoderRecording>,
    pub(super) targets: Vec<String>,
    /// Name patterns of the unknown parameters, with their places in the file; empty for all
    /// stiffnesses.
    pub(super) fit: Vec<(String, RobotFileError)>,
    pub(super) keep: Vec<(String, RobotFileError)>,
    /// Patterns of parameters that have one value.
    pub(super) tie: Vec<(String, RobotFileError)>,
    pub(super) uncertainty: Option<f64>,
    /// Name, uncertainty, and place in the file.
    pub(super) known: Vec<(String, f64, RobotFileError)>,
    pub(super) loss: Loss,
    /// Number of rows of tables of places without a reading.
    pub(super) empty_rows: usize,
    /// Name of the unit of length, for messages.
    pub(super) length: &'static str,
    pub(super) length_m: f64,
    pub(super) angle_rad: f64,
}

const LENGTHS: [(&str, f64); 3] = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6)];
const ANGLES: [(&str, f64); 3] = [("rad", 1.0), ("deg", std::f64::consts::PI / 180.0), ("mrad", 1e-3)];
const FORCES: [(&str, f64); 2] = [("N", 1.0), ("kN", 1e3)];
const LOSSES: [(&str, Loss); 3] =
    [("huber", Loss::Huber(2.5)), ("square", Loss::Square), ("cauchy", Loss::Cauchy(2.5))];

/// Reads a file of measurements.
///
/// # Errors
/// [`Error`] with the file and place, the value found and the values expected.
pub(super) fn read(path: &Path, cell: &Cell<'_>) -> Result<MeasurementInput, Error> {
    let text = read_text(path)?;
    let source = Source::new(path, &text, "measurements");
    let file: MeasurementFile = parsed(&text, &source, &[], |file: &MeasurementFile| &file.format)?;
    let &(length, length_m) = word(&source, "length", &file.length, &LENGTHS)?;
    let units = Units {
        length: length_m,
        angle: word(&source, "angle", &file.angle, &ANGLES)?.1,
        force: word(&source, "force", &file.force, &FORCES)?.1,
    };
    // Readings refer to instruments, targets and nodes; recordings are estimated later.
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut reader = Reader {
        cell,
        source: &source,
        folder,
        units,
        targets: Vec::new(),
        measurements: Measurements::default(),
        empty_rows: 0,
    };
    reader.readings(&file)?;
    let recordings = file.encoders.iter().map(|entry| reader.encoders(entry)).collect::<Result<Vec<_>, Error>>()?;
    if reader.measurements.readings.is_empty() && recordings.is_empty() {
        let text = "there is no reading: add [[displacement]], [[place]], [[frequency]], [[response]], [[shape]] or \
                    [[encoders]]";
        return Err(source.error(0..0, text).into());
    }
    // Patterns and uncertainties keep their places: they are checked against the robot later.
    let given =
        |list: &[Spanned<String>]| list.iter().map(|p| (p.get_ref().clone(), source.error(p.span(), ""))).collect();
    let known = file.parameter.iter().map(|entry| {
        let place = source.error(entry.name.span(), "");
        Ok((entry.name.get_ref().clone(), uncertainty(&entry.uncertainty, 0.0, &source)?, place))
    });
    Ok(MeasurementInput {
        targets: reader.targets,
        measurements: reader.measurements,
        recordings,
        fit: given(&file.fit),
        keep: given(&file.keep),
        tie: given(&file.tie),
        uncertainty: file.uncertainty.as_ref().map(|value| uncertainty(value, 1.0, &source)).transpose()?,
        known: known.collect::<Result<_, RobotFileError>>()?,
        loss: word(&source, "loss", &file.loss, &LOSSES)?.1,
        empty_rows: reader.empty_rows,
        length,
        length_m,
        angle_rad: units.angle,
    })
}

/// Returns an uncertainty above a minimum.
fn uncertainty(value: &Spanned<f64>, above: f64, source: &Source) -> Result<f64, RobotFileError> {
    match *value.get_ref() {
        x if x.is_finite() && x > above => Ok(x),
        x => Err(source.error(value.span(), format!("uncertainty is {x}, expected a number above {above}"))),
    }
}

impl Reader<'_> {
    /// Adds all readings of the file, with their instruments and targets.
    fn readings(&mut self, file: &MeasurementFile) -> Result<(), Error> {
        self.frames(&file.instrument, &file.target)?;
        for (k, entry) in file.displacement.iter().enumerate() {
            self.displacement(k, entry)?;
        }
        for (k, entry) in file.place.iter().enumerate() {
            self.place(k, entry)?;
        }
        for (k, entry) in file.frequency.iter().enumerate() {
            self.frequency(k, entry)?;
        }
        for entry in &file.response {
            self.response(&file.node, entry)?;
        }
        for (k, entry) in file.shape.iter().enumerate() {
            self.shape(&file.node, k, entry)?;
        }
        self.choose_unknown_frames(&file.instrument, &file.target)
    }
}
