//! Equilibrium, compliance and frequencies at any number of poses, on all cores.
//!
//! Start at [`Arm::operating_points`]. Results are arrays of numbers, pose by pose; world axes at the
//! TCP, linear first. Not here: the solution at a pose (`flexarm_stepping::OperatingPoint`), one pose
//! with its shapes ([`Arm::statics`], [`Arm::modes`]).

use flexarm_kinematics::Wrench;
use flexarm_stepping::{OperatingPoint, PoseOutputs, StepError};
use rayon::prelude::*;

use crate::arm::Arm;
use crate::error::Error;

/// Number of poses per workspace.
const CHUNK: usize = 256;

/// Results at m poses, each quantity a contiguous array, pose by pose; world axes at the TCP,
/// linear first. Poses without an equilibrium contain NaN.
#[derive(Clone, Debug, Default)]
pub struct OperatingPoints {
    /// TCP position, m×3 (m).
    pub tcp_m: Vec<f64>,
    /// TCP position minus that of the rigid twin, m×3 (m).
    pub deflection_m: Vec<f64>,
    /// Compliance of the TCP with the drives locked, m×6×6 (m/N, rad/N; m/(N m), rad/(N m)).
    pub compliance: Vec<f64>,
    /// Natural frequencies, ascending, m×n with the n elastic coordinates of the arm (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Poses without a solution, and the cause.
    pub failures: Vec<(usize, StepError)>,
    /// Number n of elastic coordinates.
    elastic: usize,
}

impl OperatingPoints {
    /// Returns the number of poses.
    pub fn len(&self) -> usize {
        self.tcp_m.len() / 3
    }

    /// Whether there are no poses.
    pub fn is_empty(&self) -> bool {
        self.tcp_m.is_empty()
    }

    /// Returns the number of frequencies per pose.
    pub fn frequencies(&self) -> usize {
        self.elastic
    }

    fn with_capacity(poses: usize, elastic: usize) -> Self {
        let holes = |n: usize| vec![f64::NAN; n * poses];
        Self {
            tcp_m: holes(3),
            deflection_m: holes(3),
            compliance: holes(36),
            frequencies_hz: holes(elastic),
            failures: Vec::new(),
            elastic,
        }
    }
}

/// Results for a chunk of poses.
struct Rows<'a> {
    first: usize,
    poses: &'a [f64],
    tcp_m: &'a mut [f64],
    deflection_m: &'a mut [f64],
    compliance: &'a mut [f64],
    frequencies_hz: &'a mut [f64],
}

impl Arm {
    /// Computes static equilibrium, compliance and frequencies at each pose under gravity and a
    /// wrench at the TCP, on all cores.
    ///
    /// * `poses`: m×n, the n actuated joints in coordinate order, pose by pose (rad or m).
    /// * `wrench`: force and moment at the TCP, world axes (N, N m).
    ///
    /// Cost: about 4.9 µs of one core per pose with twelve elastic coordinates, where four poses
    /// are processed together. Uses the thread pool of `rayon`.
    ///
    /// # Errors
    /// [`Error::Step`] with [`StepError::Setup`] if the number of values is not a multiple of the
    /// number of joints, and as [`Arm::operating_point`]. A pose without equilibrium is not an
    /// error, see [`OperatingPoints::failures`].
    pub fn operating_points(&self, poses: &[f64], wrench: &Wrench) -> Result<OperatingPoints, Error> {
        self.operating_points_until(poses, wrench, &|| false)
    }

    /// As [`Arm::operating_points`]; starts no further work once `stop` returns true.
    ///
    /// # Errors
    /// As [`Arm::operating_points`]; [`Error::Interrupted`].
    pub fn operating_points_until(
        &self,
        poses: &[f64],
        wrench: &Wrench,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<OperatingPoints, Error> {
        let joints = self.joints().count();
        if joints == 0 || !poses.len().is_multiple_of(joints) {
            let text = format!("{} joint values are given, expected a multiple of the {joints} joints", poses.len());
            return Err(Error::Step { source: StepError::Setup(text), partial: false });
        }
        let start = self.operating_point()?;
        let elastic = self.model.n_elastic();
        // Empty chunks would end the iteration: a rigid arm gets one column, dropped later.
        let mut found = OperatingPoints::with_capacity(poses.len() / joints, elastic.max(1));
        let rows = found
            .tcp_m
            .par_chunks_mut(3 * CHUNK)
            .zip(found.deflection_m.par_chunks_mut(3 * CHUNK))
            .zip(found.compliance.par_chunks_mut(36 * CHUNK))
            .zip(found.frequencies_hz.par_chunks_mut(elastic.max(1) * CHUNK))
            .zip(poses.par_chunks(joints * CHUNK))
            .enumerate();
        let rows = rows.map(|(chunk, ((((tcp_m, deflection_m), compliance), frequencies_hz), poses))| Rows {
            first: chunk * CHUNK,
            poses,
            tcp_m,
            deflection_m,
            compliance,
            frequencies_hz,
        });
        let answered = rows.map_with(start, |at, rows| match stop() {
            true => Err(Error::Interrupted { t: 0.0, partial: false }),
            false => Ok(answer(at, rows, elastic, wrench)),
        });
        let failures = answered.collect::<Result<Vec<_>, Error>>()?;
        found.failures = failures.into_iter().flatten().collect();
        found.elastic = elastic;
        found.frequencies_hz.truncate(found.len() * elastic);
        Ok(found)
    }
}

/// Fills in the results of a chunk; returns the failures.
fn answer(at: &mut OperatingPoint, rows: Rows<'_>, elastic: usize, wrench: &Wrench) -> Vec<(usize, StepError)> {
    let mut failures = Vec::new();
    let asked = PoseOutputs { compliance: true, frequencies: true, ..PoseOutputs::default() };
    at.solve_each(rows.poses, wrench, asked, |k, answer| match answer {
        Err(error) => failures.push((rows.first + k, error)),
        Ok(found) => {
            let tool = found.tcp_pose.translation.vector;
            let moved = tool - found.rigid_tcp_pose.translation.vector;
            rows.tcp_m[3 * k..][..3].copy_from_slice(tool.as_slice());
            rows.deflection_m[3 * k..][..3].copy_from_slice(moved.as_slice());
            // Row-major; the compliance is symmetric except under constant moments.
            rows.compliance[36 * k..][..36].copy_from_slice(found.compliance.transpose().as_slice());
            rows.frequencies_hz[elastic * k..][..elastic].copy_from_slice(&found.frequencies_hz);
        }
    });
    failures
}
