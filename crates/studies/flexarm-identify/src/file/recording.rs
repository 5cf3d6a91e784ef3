//! Recordings of motor and link positions over time: columns of a table that the entry names.
//!
//! Not here: filters, torques and the estimate of the stiffness ([`crate::encoders`]).

use std::collections::BTreeMap;
use std::path::PathBuf;

use flexarm_files::{NumberTable, named_file};
use flexarm_run::toml_file::word;
use flexarm_run::{Error, RobotFileError};
use serde::Deserialize;
use toml::Spanned;

use super::reader::{Reader, Site, Units};

/// Entry of a recording of motor and link positions.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EncodersEntry {
    file: Spanned<PathBuf>,
    /// Column of the time (s).
    time: Spanned<String>,
    /// Columns of motor positions, over the gear ratios, of all joints.
    motor: Spanned<BTreeMap<String, String>>,
    /// Columns of link-side encoders, of some joints.
    link: Spanned<BTreeMap<String, String>>,
    /// Columns of torques through the gears, on the link side, of some joints.
    torque: Option<Spanned<BTreeMap<String, String>>>,
    /// For coupled gears: whether the motor columns are positions of the motors over their gear
    /// ratios, or joint positions computed by the controller.
    positions: Option<Spanned<String>>,
    below: Option<Spanned<f64>>,
    edge: Option<Spanned<f64>>,
}

/// Recording of motor and link positions, in SI units and the robot's order of joints.
#[derive(Debug)]
pub(crate) struct EncoderRecording {
    pub(crate) place: RobotFileError,
    pub(crate) step_s: f64,
    /// Joint positions according to the motors, one list per joint (rad or m).
    pub(crate) motor: Vec<Vec<f64>>,
    /// Joint positions according to the link-side encoders, if any.
    pub(crate) link: Vec<Option<Vec<f64>>>,
    /// Measured torques through the gears, if any (N m or N).
    pub(crate) torque: Vec<Option<Vec<f64>>>,
    /// Cut-off frequency of the low-pass filter on both signals (Hz).
    pub(crate) below_hz: f64,
    /// Time discarded at both ends (s).
    pub(crate) edge_s: f64,
}

/// Default cut-off frequency of recordings (Hz).
const BELOW_HZ: f64 = 12.0;
/// Default time discarded at both ends of a recording (s).
const EDGE_S: f64 = 0.4;
/// Maximum relative deviation of a time step from the mean.
const UNEVEN: f64 = 0.01;

/// Returns the step of evenly spaced times (s); `None` if they are not even.
fn even_step(time: &[f64]) -> Option<f64> {
    let n = time.len();
    if n < 3 {
        return None;
    }
    let step = (time[n - 1] - time[0]) / (n - 1) as f64;
    let even = time.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= UNEVEN * step);
    (step > 0.0 && even).then_some(step)
}

/// Table of a recording.
struct RecordingTable<'a> {
    reader: &'a Reader<'a>,
    path: PathBuf,
    table: NumberTable,
}

impl RecordingTable<'_> {
    /// Returns a column, all of whose cells must have a value.
    fn column(&self, name: &str, site: Site<'_>) -> Result<Vec<f64>, Error> {
        let Self { reader, path, table } = self;
        let k = table.column(name).ok_or_else(|| {
            reader.error(site, format!("{} has no column {name:?}; it has {:?}", path.display(), table.names))
        })?;
        let values: Vec<f64> = table.rows.iter().map(|row| row[k]).collect();
        match values.iter().position(|x| !x.is_finite()) {
            Some(row) => Err(table.error(Some(row), format!("column {name:?} is empty, expected a number")).into()),
            None => Ok(values),
        }
    }

    /// Returns the columns of the joints in SI units.
    ///
    /// * `needed`: whether each joint must have a column.
    /// * `units`: units for joints that turn and for joints that slide.
    fn joints(
        &self,
        map: &Spanned<BTreeMap<String, String>>,
        needed: bool,
        units: [f64; 2],
    ) -> Result<Vec<Option<Vec<f64>>>, Error> {
        let joints = self.reader.cell.joints;
        let fault = |message: String| self.reader.error(map, message);
        let names: Vec<&str> = joints.iter().map(|(name, _)| name.as_str()).collect();
        if let Some(stray) = map.get_ref().keys().find(|name| !names.contains(&name.as_str())) {
            return Err(fault(format!("the robot has no joint {stray:?}; its joints are {names:?}")));
        }
        let one = |(name, slides): &(String, bool)| match map.get_ref().get(name) {
            Some(own) => {
                let factor = units[usize::from(*slides)];
                Ok(Some(self.column(own, map.into())?.into_iter().map(|x| x * factor).collect()))
            }
            None if needed => Err(fault(format!("joint {name:?} has no column: the torques need all joints"))),
            None => Ok(None),
        };
        joints.iter().map(one).collect()
    }
}

impl Reader<'_> {
    /// Reads a recording, and converts the motors of coupled gears to joint positions.
    pub(super) fn encoders(&self, entry: &Spanned<EncodersEntry>) -> Result<EncoderRecording, Error> {
        let e = entry.get_ref();
        // The table, at equal intervals of time.
        let path = named_file("file", e.file.get_ref(), self.folder).map_err(|message| self.error(&e.file, message))?;
        let table = RecordingTable { reader: self, table: NumberTable::read(&path)?, path };
        let time = table.column(e.time.get_ref(), Site::from(&e.time))?;
        let step_s = even_step(&time).ok_or_else(|| {
            let path = table.path.display();
            let text = format!("the times of {path} are not evenly spaced, or there are fewer than three");
            self.error(&e.time, text)
        })?;
        // Encoders on both sides of the gears, and torques.
        let Units { length, angle, force } = self.units;
        let link = table.joints(&e.link, false, [angle, length])?;
        if link.iter().all(Option::is_none) {
            return Err(self.error(&e.link, "no joint has an encoder on the link side of its gear"));
        }
        let mut motor: Vec<Vec<f64>> = table.joints(&e.motor, true, [angle, length])?.into_iter().flatten().collect();
        self.behind_coupling(e, &mut motor)?;
        let torque = match &e.torque {
            Some(torque) => table.joints(torque, false, [force * length, force])?,
            None => vec![None; motor.len()],
        };
        Ok(EncoderRecording {
            place: self.source.error(entry.span(), ""),
            step_s,
            motor,
            link,
            torque,
            below_hz: self.non_negative(&e.below, "below", BELOW_HZ)?,
            edge_s: self.non_negative(&e.edge, "edge", EDGE_S)?,
        })
    }

    fn non_negative(&self, value: &Option<Spanned<f64>>, what: &str, default: f64) -> Result<f64, Error> {
        match value {
            None => Ok(default),
            Some(x) if x.get_ref().is_finite() && *x.get_ref() >= 0.0 => Ok(*x.get_ref()),
            Some(x) => Err(self.error(x, format!("{what} is {}, expected a non-negative number", x.get_ref()))),
        }
    }

    /// Computes joint positions from motors that move several joints, `q = C q_m`; joint positions
    /// from the controller are left unchanged.
    fn behind_coupling(&self, e: &EncodersEntry, motor: &mut [Vec<f64>]) -> Result<(), Error> {
        let Some(coupling) = self.cell.arm.robot().coupling.as_ref() else { return Ok(()) };
        if e.positions.is_none() {
            let text = format!(
                "the gears of {:?} are coupled: state whether motor contains the motor positions after their \
                 gears (positions = \"motors\") or the joint positions that the controller computes from them \
                 (positions = \"joints\")",
                coupling.joints
            );
            return Err(self.error(&e.motor, text));
        }
        if word(self.source, "positions", &e.positions, &[("motors", false), ("joints", true)])?.1 {
            return Ok(());
        }
        let place = |joint: &String| self.cell.joints.iter().position(|(name, _)| name == joint);
        let places: Vec<usize> = coupling.joints.iter().filter_map(place).collect();
        let before: Vec<Vec<f64>> = places.iter().map(|k| motor[*k].clone()).collect();
        for (i, joint) in places.iter().enumerate() {
            for (sample, to) in motor[*joint].iter_mut().enumerate() {
                *to = before.iter().enumerate().map(|(k, q)| coupling.C[(i, k)] * q[sample]).sum();
            }
        }
        Ok(())
    }
}
