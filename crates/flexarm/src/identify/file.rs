//! The file of measurements (`docs/identify.md`): readings one by one or as tables, units, what is unknown.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use flexarm_files::{NumberTable, read_text};
use flexarm_identify::{Component, Instrument, LoadCase, Loss, Measurements, Reading, ReadingKind, Row, Target};
use flexarm_kinematics::{Pose, SpatialInertia, Wrench};
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::response_file::{NodeEntry, ResponseEntry, ShapeEntry};
use crate::arm::Arm;
use crate::error::Error;
use crate::robot_file::{RobotFileError, Source};
use crate::toml_file::parsed;

/// The file as written.
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
    /// Points of the arm that are hit or watched.
    #[serde(default)]
    node: BTreeMap<String, Spanned<NodeEntry>>,
    #[serde(default)]
    response: Vec<Spanned<ResponseEntry>>,
    #[serde(default)]
    shape: Vec<Spanned<ShapeEntry>>,
}

/// Positions of motors and links over time.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EncodersEntry {
    file: Spanned<PathBuf>,
    /// Column of the time (s).
    time: Spanned<String>,
    /// Columns of the motors, over their ratios, of all joints.
    motor: Spanned<BTreeMap<String, String>>,
    /// Columns of the encoders behind the gears, of some joints.
    link: Spanned<BTreeMap<String, String>>,
    below: Option<Spanned<f64>>,
    edge: Option<Spanned<f64>>,
}

/// A recording of motors and links, in SI units and the robot's order.
#[derive(Debug)]
pub(super) struct EncoderRecording {
    pub(super) place: RobotFileError,
    pub(super) step_s: f64,
    /// One list per joint (rad or m).
    pub(super) motor: Vec<Vec<f64>>,
    /// Of the joints that have one.
    pub(super) link: Vec<Option<Vec<f64>>>,
    /// Both are compared up to here (Hz).
    pub(super) below_hz: f64,
    /// Left out at both ends (s).
    pub(super) edge_s: f64,
}

/// What is faster than this is left out of recordings unless they say otherwise (Hz).
const BELOW_HZ: f64 = 12.0;
/// So much is left out at both ends of a recording (s).
const EDGE_S: f64 = 0.4;
/// Times may be off an even step by this part of it.
const UNEVEN: f64 = 0.01;

/// What is known of one parameter before.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterEntry {
    name: Spanned<String>,
    uncertainty: Spanned<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct InstrumentEntry {
    xyz: Option<[f64; 3]>,
    #[serde(default)]
    rpy: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetEntry {
    xyz: [f64; 3],
    #[serde(default)]
    unknown: bool,
}

/// Values of the joints: all in order, or by name.
#[derive(Debug, Deserialize, Clone)]
#[serde(untagged, expecting = "expected a list of joint values, or a table { joint = value }")]
pub(super) enum Joints {
    List(Vec<f64>),
    Named(BTreeMap<String, f64>),
}

#[derive(Debug, Default, Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
pub(super) struct LoadEntry {
    #[serde(default)]
    force: [f64; 3],
    #[serde(default)]
    torque: [f64; 3],
    #[serde(default)]
    at: [f64; 3],
    #[serde(default)]
    mass: f64,
    #[serde(default)]
    com: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DisplacementEntry {
    file: Option<Spanned<PathBuf>>,
    joints: Option<Spanned<Joints>>,
    #[serde(default)]
    load: LoadEntry,
    #[serde(default)]
    before: LoadEntry,
    #[serde(default)]
    point: [f64; 3],
    direction: Option<Spanned<[f64; 3]>>,
    value: Option<Spanned<Value>>,
    rotation: Option<[f64; 3]>,
    std: Option<Spanned<f64>>,
    std_rotation: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize, Clone, Copy)]
#[serde(untagged, expecting = "expected a number along direction, or a list of three")]
enum Value {
    One(f64),
    Three([f64; 3]),
}

impl Value {
    fn read(self) -> Measured {
        match self {
            Self::One(d) => Measured::One(d),
            Self::Three(d) => Measured::Three(d.map(Some)),
        }
    }
}

/// A displacement as it was read: along a direction, or the components that were.
#[derive(Debug, Clone, Copy)]
enum Measured {
    One(f64),
    Three([Option<f64>; 3]),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceEntry {
    file: Option<Spanned<PathBuf>>,
    joints: Option<Spanned<Joints>>,
    instrument: Option<Spanned<String>>,
    target: Option<Spanned<String>>,
    #[serde(default)]
    load: LoadEntry,
    value: Option<[f64; 3]>,
    std: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrequencyEntry {
    joints: Spanned<Joints>,
    #[serde(default)]
    load: LoadEntry,
    hz: Spanned<Vec<f64>>,
    modes: Option<Spanned<Vec<usize>>>,
    std: Option<Spanned<f64>>,
}

/// What the file says, in SI units.
#[derive(Debug)]
pub(super) struct MeasurementInput {
    pub(super) measurements: Measurements,
    pub(super) recordings: Vec<EncoderRecording>,
    pub(super) instruments: Vec<String>,
    pub(super) targets: Vec<String>,
    /// Patterns of names of what is unknown, with their places; empty: all stiffnesses.
    pub(super) fit: Vec<(String, RobotFileError)>,
    pub(super) keep: Vec<(String, RobotFileError)>,
    pub(super) uncertainty: Option<f64>,
    /// Name, uncertainty, place.
    pub(super) known: Vec<(String, f64, RobotFileError)>,
    pub(super) loss: Loss,
    /// Whether deviations are given.
    pub(super) deviations_known: bool,
    /// Name of the unit of length, for words about it.
    pub(super) length: &'static str,
    pub(super) length_m: f64,
}

/// Factors of the units of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Units {
    pub(super) length: f64,
    pub(super) angle: f64,
    force: f64,
}

const LENGTHS: [(&str, f64); 3] = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6)];
const ANGLES: [(&str, f64); 3] = [("rad", 1.0), ("deg", std::f64::consts::PI / 180.0), ("mrad", 1e-3)];
const FORCES: [(&str, f64); 2] = [("N", 1.0), ("kN", 1e3)];

/// What the robot is asked while its measurements are read.
pub(super) struct Cell<'a> {
    /// Actuated joints in coordinate order, and whether they slide.
    pub(super) joints: &'a [(String, bool)],
    /// The arm that is measured.
    pub(super) arm: &'a Arm,
}

/// Reads a file.
///
/// # Errors
/// [`Error`] with file, place, what was found and what was expected.
pub(super) fn read(path: &Path, cell: &Cell<'_>) -> Result<MeasurementInput, Error> {
    let text = read_text(path)?;
    let source = Source::new(path, &text);
    let file: MeasurementFile = parsed(&text, &source, |file: &MeasurementFile| &file.format)?;
    let (length, length_m) = unit("length", &file.length, &LENGTHS, &source)?;
    let units = Units {
        length: length_m,
        angle: unit("angle", &file.angle, &ANGLES, &source)?.1,
        force: unit("force", &file.force, &FORCES, &source)?.1,
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut reader = Reader {
        cell,
        source: &source,
        folder,
        units,
        instruments: Vec::new(),
        targets: Vec::new(),
        measurements: Measurements::default(),
        given: Vec::new(),
    };
    reader.frames(&file)?;
    for (k, entry) in file.displacement.iter().enumerate() {
        reader.displacement(k, entry)?;
    }
    for (k, entry) in file.place.iter().enumerate() {
        reader.place(k, entry)?;
    }
    for (k, entry) in file.frequency.iter().enumerate() {
        reader.frequency(k, entry)?;
    }
    for entry in &file.response {
        reader.response(&file.node, entry)?;
    }
    for (k, entry) in file.shape.iter().enumerate() {
        reader.shape(&file.node, k, entry)?;
    }
    reader.drop_unused();
    let recordings = file.encoders.iter().map(|entry| reader.encoders(entry)).collect::<Result<Vec<_>, Error>>()?;
    let deviations_known = reader.deviations(!recordings.is_empty())?;
    let told =
        |list: &[Spanned<String>]| list.iter().map(|p| (p.get_ref().clone(), source.error(p.span(), ""))).collect();
    let positive = |value: &Spanned<f64>, least: f64| match *value.get_ref() {
        x if x.is_finite() && x > least => Ok(x),
        x => Err(source.error(value.span(), format!("uncertainty is {x}, expected a number above {least}"))),
    };
    let known = file.parameter.iter().map(|entry| {
        let place = source.error(entry.name.span(), "");
        Ok((entry.name.get_ref().clone(), positive(&entry.uncertainty, 0.0)?, place))
    });
    Ok(MeasurementInput {
        instruments: reader.instruments,
        targets: reader.targets,
        measurements: reader.measurements,
        recordings,
        fit: told(&file.fit),
        keep: told(&file.keep),
        uncertainty: file.uncertainty.as_ref().map(|value| positive(value, 1.0)).transpose()?,
        known: known.collect::<Result<_, RobotFileError>>()?,
        loss: loss(&file.loss, &source)?,
        deviations_known,
        length,
        length_m,
    })
}

fn unit(
    key: &str,
    given: &Option<Spanned<String>>,
    known: &[(&'static str, f64)],
    source: &Source,
) -> Result<(&'static str, f64), RobotFileError> {
    let Some(word) = given else { return Ok(known[0]) };
    known.iter().find(|(name, _)| name == word.get_ref()).copied().ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        source.error(word.span(), format!("{key} = {:?} is not known; use one of {names:?}", word.get_ref()))
    })
}

fn loss(given: &Option<Spanned<String>>, source: &Source) -> Result<Loss, RobotFileError> {
    match given.as_ref().map(|word| word.get_ref().as_str()) {
        None | Some("huber") => Ok(Loss::Huber(2.5)),
        Some("square") => Ok(Loss::Square),
        Some("cauchy") => Ok(Loss::Cauchy(2.5)),
        Some(other) => {
            let span = given.as_ref().map_or(0..0, Spanned::span);
            Err(source.error(span, format!("loss = {other:?} is not known; use \"huber\", \"square\" or \"cauchy\"")))
        }
    }
}

/// Readings being collected.
pub(super) struct Reader<'a> {
    pub(super) cell: &'a Cell<'a>,
    source: &'a Source,
    pub(super) folder: &'a Path,
    pub(super) units: Units,
    instruments: Vec<String>,
    targets: Vec<String>,
    pub(super) measurements: Measurements,
    /// Of each reading: what was measured in, whether a deviation is given, where.
    pub(super) given: Vec<(&'static str, bool, Range<usize>)>,
}

/// A row of a table, by the names of its columns.
struct TableRow<'a> {
    table: &'a NumberTable,
    row: usize,
}

impl TableRow<'_> {
    fn get(&self, name: &str) -> Option<f64> {
        let value = self.table.rows[self.row][self.table.column(name)?];
        (!value.is_nan()).then_some(value)
    }

    /// Three components, those without a column zero.
    ///
    /// # Errors
    /// The name of a column that is there and has no value in this row.
    fn three(&self, names: [&str; 3]) -> Result<Option<[f64; 3]>, String> {
        if names.iter().all(|name| self.table.column(name).is_none()) {
            return Ok(None);
        }
        let value = |name: &str| match self.table.column(name) {
            None => Ok(0.0),
            Some(_) => self.get(name).ok_or_else(|| name.to_owned()),
        };
        let [x, y, z] = names.map(value);
        Ok(Some([x?, y?, z?]))
    }

    /// Three components, those that are filled in.
    fn filled(&self, names: [&str; 3]) -> Option<[Option<f64>; 3]> {
        let values = names.map(|name| self.get(name));
        values.iter().any(Option::is_some).then_some(values)
    }
}

const DISPLACEMENT_COLUMNS: [&str; 25] = [
    "fx",
    "fy",
    "fz",
    "mx",
    "my",
    "mz",
    "ax",
    "ay",
    "az",
    "px",
    "py",
    "pz",
    "mass",
    "dx",
    "dy",
    "dz",
    "rx",
    "ry",
    "rz",
    "d",
    "ux",
    "uy",
    "uz",
    "std",
    "std_rotation",
];
const PLACE_COLUMNS: [&str; 14] = ["fx", "fy", "fz", "mx", "my", "mz", "ax", "ay", "az", "mass", "x", "y", "z", "std"];

impl Reader<'_> {
    pub(super) fn error(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        self.source.error(span, message).into()
    }

    fn frames(&mut self, file: &MeasurementFile) -> Result<(), Error> {
        let finite = |values: &[f64], span: Range<usize>| match values.iter().find(|x| !x.is_finite()) {
            Some(bad) => Err(self.source.error(span, format!("found {bad}, expected finite numbers"))),
            None => Ok(()),
        };
        let (mut instruments, mut targets) = (Vec::new(), Vec::new());
        for (name, entry) in &file.instrument {
            let InstrumentEntry { xyz, rpy } = entry.get_ref();
            let all: Vec<f64> = xyz.iter().flatten().chain(rpy).copied().collect();
            finite(&all, entry.span())?;
            let instrument = match xyz {
                None => Instrument::Unknown(Pose::identity()),
                Some(xyz) => {
                    let [r, p, y] = rpy.map(|angle| angle * self.units.angle);
                    let at = Vector3::from(*xyz) * self.units.length;
                    let X_WI = Pose::from_parts(Translation3::from(at), Rotation3::from_euler_angles(r, p, y));
                    Instrument::Known(X_WI.inverse())
                }
            };
            instruments.push((name.clone(), instrument));
        }
        for (name, entry) in &file.target {
            let TargetEntry { xyz, unknown } = entry.get_ref();
            finite(xyz, entry.span())?;
            let p = Vector3::from(*xyz) * self.units.length;
            targets.push((name.clone(), if *unknown { Target::Unknown(p) } else { Target::Known(p) }));
        }
        (self.instruments, self.measurements.instruments) = instruments.into_iter().unzip();
        (self.targets, self.measurements.targets) = targets.into_iter().unzip();
        Ok(())
    }

    /// Joint values of a reading in SI units.
    pub(super) fn joints(&self, joints: &Spanned<Joints>) -> Result<Vec<f64>, Error> {
        let known = self.cell.joints;
        let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
        let values: Vec<f64> = match joints.get_ref() {
            Joints::List(list) if list.len() == known.len() => list.clone(),
            Joints::List(list) => {
                let message = format!("{} joint values, the robot has {}: {names:?}", list.len(), known.len());
                return Err(self.error(joints.span(), message));
            }
            Joints::Named(map) => {
                if let Some(stray) = map.keys().find(|name| !names.contains(&name.as_str())) {
                    let message = format!("the robot has no joint {stray:?}; its joints are {names:?}");
                    return Err(self.error(joints.span(), message));
                }
                let value = |name: &&str| {
                    map.get(*name).copied().ok_or_else(|| {
                        self.error(joints.span(), format!("joint {name:?} has no value: all of {names:?} are needed"))
                    })
                };
                names.iter().map(value).collect::<Result<_, _>>()?
            }
        };
        self.scaled(values, joints.span())
    }

    fn scaled(&self, values: Vec<f64>, span: Range<usize>) -> Result<Vec<f64>, Error> {
        let scaled = values.iter().zip(self.cell.joints).map(|(value, (name, slides))| {
            let factor = if *slides { self.units.length } else { self.units.angle };
            let q = value * factor;
            // More than ten turns are degrees that were taken for rad.
            let most = if *slides { 1e3 } else { 20.0 * std::f64::consts::PI };
            match q.is_finite() && q.abs() <= most {
                true => Ok(q),
                false => {
                    let help = if *slides { "length = \"mm\"" } else { "angle = \"deg\"" };
                    let message = format!("joint {name:?} at {value}: more than any joint does; is {help} missing?");
                    Err(self.error(span.clone(), message))
                }
            }
        });
        scaled.collect()
    }

    /// A load in SI units.
    pub(super) fn load(&self, load: &LoadEntry, span: &Range<usize>) -> Result<LoadCase, Error> {
        let LoadEntry { force, torque, at, mass, com } = *load;
        let all = [&force[..], &torque, &at, &[mass], &com].concat();
        if let Some(bad) = all.iter().find(|x| !x.is_finite()) {
            return Err(self.error(span.clone(), format!("a load has the entry {bad}, expected finite numbers")));
        }
        if mass < 0.0 {
            return Err(self.error(span.clone(), format!("a load has a mass of {mass} kg, expected 0 or more")));
        }
        let Units { length, force: newton, .. } = self.units;
        // Moments in the units of force and length.
        let wrench = Wrench::new(Vector3::from(force) * newton, Vector3::from(torque) * newton * length);
        let carried = SpatialInertia::from_com(mass, &(Vector3::from(com) * length), &Matrix3::zeros());
        Ok(LoadCase { wrench, at: Vector3::from(at) * length, carried })
    }

    /// A standard deviation in SI units; 1 where none is given.
    pub(super) fn std(&self, given: Option<&Spanned<f64>>, factor: f64) -> Result<f64, Error> {
        match given {
            None => Ok(1.0),
            Some(std) if std.get_ref().is_finite() && *std.get_ref() > 0.0 => Ok(std.get_ref() * factor),
            Some(std) => Err(self.error(std.span(), format!("std is {}, expected a positive number", std.get_ref()))),
        }
    }

    fn table(&self, file: &Spanned<PathBuf>, columns: &[&str]) -> Result<NumberTable, Error> {
        let path = self.folder.join(file.get_ref());
        if !path.is_file() {
            let message = format!("file = {:?}: there is no file {}", file.get_ref(), path.display());
            return Err(self.error(file.span(), message));
        }
        let table = NumberTable::read(&path)?;
        let joints: Vec<&str> = self.cell.joints.iter().map(|(name, _)| name.as_str()).collect();
        let fail = |what: String| Error::File { path: path.clone(), what };
        if let Some(stray) =
            table.names.iter().find(|n| !columns.contains(&n.as_str()) && !joints.contains(&n.as_str()))
        {
            return Err(fail(format!(
                "column {stray:?} is not known; expected the joints {joints:?} and some of {columns:?}"
            )));
        }
        if let Some(missing) = joints.iter().find(|joint| table.column(joint).is_none()) {
            return Err(fail(format!("there is no column for joint {missing:?}")));
        }
        if table.rows.is_empty() {
            return Err(fail("the table has no rows".into()));
        }
        Ok(table)
    }

    fn table_joints(&self, row: &TableRow<'_>, span: Range<usize>) -> Result<Vec<f64>, Error> {
        let value = |(name, _): &(String, bool)| {
            row.get(name).ok_or_else(|| {
                let line = row.table.lines[row.row];
                self.error(span.clone(), format!("line {line} of the table has no value for joint {name:?}"))
            })
        };
        let values = self.cell.joints.iter().map(value).collect::<Result<Vec<f64>, Error>>()?;
        self.scaled(values, span)
    }

    /// An empty cell of a row whose number is needed.
    fn empty(&self, row: &TableRow<'_>, file: &Spanned<PathBuf>, name: &str) -> Error {
        let line = row.table.lines[row.row];
        let text = format!("{} line {line}: {name} is empty: a number is needed", file.get_ref().display());
        self.error(file.span(), text)
    }

    /// A load with what a row of a table says of it.
    fn with_columns(&self, load: LoadEntry, row: &TableRow<'_>, file: &Spanned<PathBuf>) -> Result<LoadEntry, Error> {
        let empty = |name: String| self.empty(row, file, &name);
        let mass = match row.table.column("mass") {
            None => load.mass,
            Some(_) => row.get("mass").ok_or_else(|| empty("mass".into()))?,
        };
        let force = row.three(["fx", "fy", "fz"]).map_err(empty)?.unwrap_or(load.force);
        let torque = row.three(["mx", "my", "mz"]).map_err(empty)?.unwrap_or(load.torque);
        let at = row.three(["ax", "ay", "az"]).map_err(empty)?.unwrap_or(load.at);
        Ok(LoadEntry { force, torque, at, mass, ..load })
    }

    /// The direction of the gauge of a row that has one read.
    fn table_direction(&self, row: &TableRow<'_>, file: &Spanned<PathBuf>) -> Result<Option<Spanned<[f64; 3]>>, Error> {
        if row.get("d").is_none() {
            return Ok(None);
        }
        let empty = |name: String| self.empty(row, file, &name);
        let direction = row.three(["ux", "uy", "uz"]).map_err(empty)?;
        Ok(direction.map(|direction| Spanned::new(file.span(), direction)))
    }

    fn displacement(&mut self, number: usize, entry: &Spanned<DisplacementEntry>) -> Result<(), Error> {
        let e = entry.get_ref();
        match (&e.file, &e.joints) {
            (Some(file), None) => {
                let table = self.table(file, &DISPLACEMENT_COLUMNS)?;
                for row in 0..table.rows.len() {
                    let at = TableRow { table: &table, row };
                    let name = format!("{} line {}", file.get_ref().display(), table.lines[row]);
                    let load = self.with_columns(e.load, &at, file)?;
                    let value = match (at.get("d"), at.filled(["dx", "dy", "dz"])) {
                        (Some(d), None) => Some(Measured::One(d)),
                        (None, three) => three.map(Measured::Three),
                        (Some(_), Some(_)) => {
                            let text = "a row has d and dx, dy, dz: keep one of them";
                            return Err(self.error(file.span(), text));
                        }
                    };
                    let spanned = |x: f64| Spanned::new(file.span(), x);
                    let std = at.get("std").map(spanned).or_else(|| e.std.clone());
                    let std_rotation = at.get("std_rotation").map(spanned).or_else(|| e.std_rotation.clone());
                    let q = self.table_joints(&at, file.span())?;
                    let rotation = at.filled(["rx", "ry", "rz"]);
                    let direction = self.table_direction(&at, file)?.or_else(|| e.direction.clone());
                    let point =
                        at.three(["px", "py", "pz"]).map_err(|name| self.empty(&at, file, &name))?.unwrap_or(e.point);
                    let said = Said { name, q, load, point, value, direction, rotation, std, std_rotation };
                    self.moved(entry, said)?;
                }
                Ok(())
            }
            (None, Some(joints)) => {
                let said = Said {
                    name: format!("displacement {}", number + 1),
                    q: self.joints(joints)?,
                    load: e.load,
                    point: e.point,
                    value: e.value.as_ref().map(|value| value.get_ref().read()),
                    direction: e.direction.clone(),
                    rotation: e.rotation.map(|turn| turn.map(Some)),
                    std: e.std.clone(),
                    std_rotation: e.std_rotation.clone(),
                };
                self.moved(entry, said)
            }
            _ => {
                Err(self.error(entry.span(), "a displacement needs joints = [...] and value, or file = \"table.csv\""))
            }
        }
    }

    /// One displacement.
    fn moved(&mut self, entry: &Spanned<DisplacementEntry>, said: Said) -> Result<(), Error> {
        let (e, span) = (entry.get_ref(), entry.span());
        let Said { name, q, load, point, value, direction, rotation, std, std_rotation } = said;
        let mut rows = Vec::new();
        let sigma = self.std(std.as_ref(), self.units.length)?;
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        match (value, &direction) {
            (Some(Measured::One(d)), Some(direction)) => {
                let along = Vector3::from(*direction.get_ref());
                let along = along.try_normalize(1e-9).filter(|v| v.iter().all(|x| x.is_finite()));
                let along = along.ok_or_else(|| self.error(direction.span(), "direction has no length"))?;
                rows.push(Row { of: Component::Along(along), value: d * self.units.length, std: sigma });
            }
            (Some(Measured::One(_)), None) => {
                let text = "one number is measured along a direction: add direction = [x, y, z] in world axes";
                return Err(self.error(span, text));
            }
            (Some(Measured::Three(_)), Some(direction)) => {
                let text = "three numbers are along x, y and z: leave direction out";
                return Err(self.error(direction.span(), text));
            }
            (Some(Measured::Three(d)), None) => rows.extend(axes.iter().zip(d).filter_map(|(axis, d)| {
                Some(Row { of: Component::Along(*axis), value: d? * self.units.length, std: sigma })
            })),
            (None, _) if rotation.is_some() => {}
            (None, _) => {
                return Err(self.error(span, format!("{name}: nothing was measured: add value = [dx, dy, dz]")));
            }
        }
        if let Some(turn) = rotation {
            let given = std_rotation.is_some();
            if given != std.is_some() && value.is_some() {
                let text = "displacements and rotations have units of their own: give std and std_rotation";
                return Err(self.error(span, text));
            }
            let sigma = self.std(std_rotation.as_ref(), self.units.angle)?;
            rows.extend(axes.iter().zip(turn).filter_map(|(axis, d)| {
                Some(Row { of: Component::About(*axis), value: d? * self.units.angle, std: sigma })
            }));
        }
        if let Some(bad) = rows.iter().find(|row| !row.value.is_finite()) {
            return Err(self.error(span, format!("{name}: found {}, expected a finite number", bad.value)));
        }
        let (before, after) = (self.load(&e.before, &span)?, self.load(&load, &span)?);
        if before == after {
            return Err(self.error(span, format!("{name}: the loads before and after are the same: nothing moves")));
        }
        let point = Vector3::from(point) * self.units.length;
        let kind = ReadingKind::Displacement { before, after, point, rows };
        let what = if rotation.is_some() { "displacement and rotation" } else { "displacement" };
        self.given.push((what, std.is_some() || (value.is_none() && std_rotation.is_some()), span));
        self.measurements.readings.push(Reading { name, q, kind });
        Ok(())
    }

    fn place(&mut self, number: usize, entry: &Spanned<PlaceEntry>) -> Result<(), Error> {
        let (e, span) = (entry.get_ref(), entry.span());
        let instrument = self.chosen("instrument", e.instrument.as_ref(), &self.instruments, &span)?;
        let target = self.chosen("target", e.target.as_ref(), &self.targets, &span)?;
        let one = |reader: &mut Self, name, q, load: LoadEntry, value: [f64; 3], std: Option<Spanned<f64>>| {
            if let Some(bad) = value.iter().find(|x| !x.is_finite()) {
                return Err(reader.error(span.clone(), format!("{name}: found {bad}, expected finite numbers")));
            }
            let kind = ReadingKind::Place {
                load: reader.load(&load, &span)?,
                target,
                instrument,
                value: Vector3::from(value) * reader.units.length,
                std: Vector3::repeat(reader.std(std.as_ref(), reader.units.length)?),
            };
            reader.given.push(("place", std.is_some(), span.clone()));
            reader.measurements.readings.push(Reading { name, q, kind });
            Ok(())
        };
        match (&e.file, &e.joints, e.value) {
            (Some(file), None, None) => {
                let table = self.table(file, &PLACE_COLUMNS)?;
                for row in 0..table.rows.len() {
                    let at = TableRow { table: &table, row };
                    let name = format!("{} line {}", file.get_ref().display(), table.lines[row]);
                    let value =
                        at.filled(["x", "y", "z"]).and_then(|[x, y, z]| Some([x?, y?, z?])).ok_or_else(|| {
                            self.error(file.span(), format!("{name}: a place needs x, y and z in every row"))
                        })?;
                    let std = at.get("std").map(|x| Spanned::new(file.span(), x)).or_else(|| e.std.clone());
                    let q = self.table_joints(&at, file.span())?;
                    let load = self.with_columns(e.load, &at, file)?;
                    one(self, name, q, load, value, std)?;
                }
                Ok(())
            }
            (None, Some(joints), Some(value)) => {
                let q = self.joints(joints)?;
                one(self, format!("place {}", number + 1), q, e.load, value, e.std.clone())
            }
            _ => Err(self.error(span, "a place needs joints = [...] and value = [x, y, z], or file = \"table.csv\"")),
        }
    }

    /// Number of a named instrument or target; the only one without a name.
    fn chosen(
        &self,
        what: &str,
        given: Option<&Spanned<String>>,
        known: &[String],
        span: &Range<usize>,
    ) -> Result<usize, Error> {
        match given {
            Some(name) => known.iter().position(|k| k == name.get_ref()).ok_or_else(|| {
                let message = format!("there is no [{what}.{}]; there are {known:?}", name.get_ref());
                self.error(name.span(), message)
            }),
            None if known.len() == 1 => Ok(0),
            None => {
                let help =
                    if known.is_empty() { format!("add [{what}.NAME]") } else { format!("choose one of {known:?}") };
                Err(self
                    .error(span.clone(), format!("a place needs an {what}: {help}").replace("an target", "a target")))
            }
        }
    }

    fn encoders(&self, entry: &Spanned<EncodersEntry>) -> Result<EncoderRecording, Error> {
        let e = entry.get_ref();
        let path = self.folder.join(e.file.get_ref());
        if !path.is_file() {
            let message = format!("file = {:?}: there is no file {}", e.file.get_ref(), path.display());
            return Err(self.error(e.file.span(), message));
        }
        let table = NumberTable::read(&path)?;
        let column = |name: &str, span: Range<usize>| -> Result<Vec<f64>, Error> {
            let k = table.column(name).ok_or_else(|| {
                self.error(span.clone(), format!("{} has no column {name:?}; it has {:?}", path.display(), table.names))
            })?;
            let values: Vec<f64> = table.rows.iter().map(|row| row[k]).collect();
            match values.iter().position(|x| !x.is_finite()) {
                Some(row) => {
                    let line = table.lines[row];
                    Err(self.error(span, format!("{} line {line}: column {name:?} is empty", path.display())))
                }
                None => Ok(values),
            }
        };
        let time = column(e.time.get_ref(), e.time.span())?;
        let step_s = even_step(&time).ok_or_else(|| {
            self.error(
                e.time.span(),
                format!("the times of {} are not evenly spaced, or fewer than three", path.display()),
            )
        })?;
        let of = |map: &Spanned<BTreeMap<String, String>>, needed: bool| -> Result<Vec<Option<Vec<f64>>>, Error> {
            let names: Vec<&str> = self.cell.joints.iter().map(|(name, _)| name.as_str()).collect();
            if let Some(stray) = map.get_ref().keys().find(|name| !names.contains(&name.as_str())) {
                return Err(
                    self.error(map.span(), format!("the robot has no joint {stray:?}; its joints are {names:?}"))
                );
            }
            let one = |(name, slides): &(String, bool)| match map.get_ref().get(name) {
                Some(own) => {
                    let factor = if *slides { self.units.length } else { self.units.angle };
                    Ok(Some(column(own, map.span())?.into_iter().map(|x| x * factor).collect()))
                }
                None if needed => {
                    Err(self.error(map.span(), format!("joint {name:?} has no column: the torques need all joints")))
                }
                None => Ok(None),
            };
            self.cell.joints.iter().map(one).collect()
        };
        let positive = |value: &Option<Spanned<f64>>, what: &str, default: f64| match value {
            None => Ok(default),
            Some(x) if x.get_ref().is_finite() && *x.get_ref() >= 0.0 => Ok(*x.get_ref()),
            Some(x) => Err(self.error(x.span(), format!("{what} is {}, expected a number of 0 or above", x.get_ref()))),
        };
        let link = of(&e.link, false)?;
        if link.iter().all(Option::is_none) {
            return Err(self.error(e.link.span(), "no joint has an encoder behind its gear"));
        }
        Ok(EncoderRecording {
            place: self.source.error(entry.span(), ""),
            step_s,
            motor: of(&e.motor, true)?.into_iter().flatten().collect(),
            link,
            below_hz: positive(&e.below, "below", BELOW_HZ)?,
            edge_s: positive(&e.edge, "edge", EDGE_S)?,
        })
    }

    fn frequency(&mut self, number: usize, entry: &Spanned<FrequencyEntry>) -> Result<(), Error> {
        let (e, span) = (entry.get_ref(), entry.span());
        let hz = e.hz.get_ref();
        let modes: Vec<usize> = e.modes.as_ref().map_or_else(|| (1..=hz.len()).collect(), |m| m.get_ref().clone());
        if modes.len() != hz.len() || modes.contains(&0) {
            let at = e.modes.as_ref().map_or(span, Spanned::span);
            let message = format!("modes = {modes:?} for {} frequencies: one number each, 1 is the lowest", hz.len());
            return Err(self.error(at, message));
        }
        if hz.is_empty() || hz.iter().any(|f| !(f.is_finite() && *f > 0.0)) {
            return Err(self.error(e.hz.span(), "hz takes positive frequencies"));
        }
        let std = self.std(e.std.as_ref(), 1.0)?;
        let rows = hz.iter().zip(modes).map(|(f, mode)| Row { of: mode - 1, value: *f, std }).collect();
        let kind = ReadingKind::Frequencies { load: self.load(&e.load, &span)?, rows };
        let q = self.joints(&e.joints)?;
        self.given.push(("frequency", e.std.is_some(), span));
        self.measurements.readings.push(Reading { name: format!("frequency {}", number + 1), q, kind });
        Ok(())
    }

    /// Instruments and targets that no place names are no unknowns.
    fn drop_unused(&mut self) {
        let (mut seen, mut hit) = (Vec::new(), Vec::new());
        for reading in &self.measurements.readings {
            if let ReadingKind::Place { instrument, target, .. } = &reading.kind {
                seen.push(*instrument);
                hit.push(*target);
            }
        }
        for (k, instrument) in self.measurements.instruments.iter_mut().enumerate() {
            if !seen.contains(&k) {
                *instrument = Instrument::Known(Pose::identity());
            }
        }
        for (k, target) in self.measurements.targets.iter_mut().enumerate() {
            if let (false, Target::Unknown(p)) = (hit.contains(&k), *target) {
                *target = Target::Known(p);
            }
        }
    }

    /// Whether deviations are given: by all readings or by none, and by all where kinds are mixed.
    fn deviations(&self, recordings: bool) -> Result<bool, Error> {
        let Some(first) = self.given.first() else {
            if recordings {
                return Ok(true);
            }
            let text = "there is no reading: add [[displacement]], [[place]], [[frequency]], [[response]], [[shape]] or [[encoders]]";
            return Err(self.error(0..0, text));
        };
        if self.given.iter().all(|(_, given, _)| *given) {
            return Ok(true);
        }
        let mixed = self.given.iter().find(|(kind, given, _)| *kind != first.0 || *given != first.1);
        match mixed {
            // Beside recordings, which have deviations of their own.
            None if recordings => {
                Err(self.error(first.2.clone(), "std is missing: readings beside [[encoders]] need one"))
            }
            None if first.0 == "displacement and rotation" => {
                Err(self.error(first.2.clone(), "displacements and rotations together need std and std_rotation"))
            }
            None => Ok(false),
            Some((_, _, span)) => {
                let text = "std is missing: readings of several kinds, or some with a std, all need one";
                Err(self.error(span.clone(), text))
            }
        }
    }
}

/// The step of evenly spaced times (s).
fn even_step(time: &[f64]) -> Option<f64> {
    let n = time.len();
    if n < 3 {
        return None;
    }
    let step = (time[n - 1] - time[0]) / (n - 1) as f64;
    let even = time.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= UNEVEN * step);
    (step > 0.0 && even).then_some(step)
}

/// A displacement before its units.
struct Said {
    name: String,
    q: Vec<f64>,
    load: LoadEntry,
    point: [f64; 3],
    value: Option<Measured>,
    direction: Option<Spanned<[f64; 3]>>,
    rotation: Option<[Option<f64>; 3]>,
    std: Option<Spanned<f64>>,
    std_rotation: Option<Spanned<f64>>,
}
