//! The three recorded runs, smoothed for the comparison.
//!
//! Positions in rad, velocities and accelerations by differentiation of the smoothed positions,
//! torques in N m.

use flexarm::Robot;
use flexarm_fe_io::unpack_gzip;
use flexarm_files::NumberTable;

use crate::Error;
use crate::bench::Bench;
use flexarm_analysis::signal::{LowPass, derivative};

/// Number of axes, and number of axes with an encoder behind the gear.
pub(super) const AXES: usize = 6;
pub(super) const WITH_ENCODER: usize = 3;
/// Number of runs.
pub(super) const RUNS: usize = 3;
/// Time between samples (s).
pub(super) const STEP_S: f64 = 0.004;
/// Cut-off frequency of the smoothing of positions and torques (Hz).
pub(super) const SMOOTH_HZ: f64 = 10.0;
/// Time left out at the start and the end because of the smoothing (s).
pub(super) const EDGE_S: f64 = 0.4;
/// Speed below which an axis counts as at rest (rad/s): one degree per second.
pub(super) const MOVING: f64 = std::f64::consts::PI / 180.0;

/// One run: one vector per axis, one entry per sample.
pub(super) struct Recording {
    pub(super) time_s: Vec<f64>,
    pub(super) reference: Vec<Vec<f64>>,
    /// Motor position over the gear ratio (rad).
    pub(super) motor: Vec<Vec<f64>>,
    /// Position behind the gear, axes 1 to 3 (rad).
    pub(super) link: Vec<Vec<f64>>,
    /// Motor positions low-passed at [`SMOOTH_HZ`], their velocity and acceleration (rad, s).
    pub(super) q: Vec<Vec<f64>>,
    pub(super) v: Vec<Vec<f64>>,
    pub(super) a: Vec<Vec<f64>>,
    /// Torques on the joint side, low-passed likewise (N m).
    pub(super) smooth_torque: Vec<Vec<f64>>,
}

/// Path of a recording, relative to the root.
pub(super) fn path(number: usize) -> String {
    format!("tests/verification/kr300/kr300_run_{number}.csv.gz")
}

impl Recording {
    pub(super) fn new(bench: &Bench, robot: &Robot, number: usize) -> Result<Self, Error> {
        let path = bench.file(&path(number));
        let fail = |what: String| Error::from(flexarm::Error::File { path: path.clone(), what });
        let packed = std::fs::read(&path).map_err(|e| fail(format!("the recording cannot be read: {e}")))?;
        let bytes = unpack_gzip(&packed).map_err(|e| fail(e.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|e| fail(format!("is no text: {e}")))?;
        let table = NumberTable::of_text(&path, &text)?;
        let column = |name: &str| -> Result<Vec<f64>, Error> {
            let column = table.column(name).ok_or_else(|| fail(format!("has no column {name:?}")))?;
            Ok(table.rows.iter().map(|row| row[column]).collect())
        };
        let all = |name: fn(usize) -> String, count: usize| -> Result<Vec<Vec<f64>>, Error> {
            (1..=count).map(|axis| column(&name(axis))).collect()
        };
        // Torques on the joint side; positions and torques smoothed alike, then differentiated.
        let motor = all(|k| format!("q_motor_{k}_rad"), AXES)?;
        let low = LowPass::new(SMOOTH_HZ, 1.0 / STEP_S);
        let ratio = |axis: usize| robot.drives.get(axis).map_or(f64::NAN, |drive| drive.ratio);
        let mut torque = all(|k| format!("tau_motor_{k}_N_m"), AXES)?;
        for (axis, torque) in torque.iter_mut().enumerate() {
            torque.iter_mut().for_each(|torque| *torque *= ratio(axis));
        }
        let smooth = |all: &[Vec<f64>]| all.iter().map(|x| low.of(x)).collect::<Vec<_>>();
        let slopes = |all: &[Vec<f64>]| all.iter().map(|x| derivative(x, STEP_S)).collect::<Vec<_>>();
        let q = smooth(&motor);
        let v = slopes(&q);
        Ok(Self {
            time_s: column("time_s")?,
            reference: all(|k| format!("q_ref_{k}_rad"), AXES)?,
            link: all(|k| format!("q_link_{k}_rad"), WITH_ENCODER)?,
            smooth_torque: smooth(&torque),
            a: slopes(&v),
            v,
            q,
            motor,
        })
    }

    /// Range of samples that are compared.
    pub(super) fn compared(&self) -> std::ops::Range<usize> {
        let edge = (EDGE_S / STEP_S).round() as usize;
        edge..self.time_s.len().saturating_sub(edge + 1)
    }

    /// Compared samples in which an axis moves.
    pub(super) fn moving(&self, axis: usize) -> impl Iterator<Item = usize> + '_ {
        self.compared().filter(move |i| self.v[axis][*i].abs() > MOVING)
    }

    /// Values of all joints at one sample.
    pub(super) fn at(&self, of: &[Vec<f64>], sample: usize) -> Vec<f64> {
        of.iter().map(|axis| axis[sample]).collect()
    }
}
