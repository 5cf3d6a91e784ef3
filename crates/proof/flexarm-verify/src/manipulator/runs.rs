//! Runs of the manipulator, and the results kept of each.
//!
//! A [`Run`] keeps TCP and deflection over time (m, world axes) and the figures that a page prints;
//! [`Runs`] makes them and reports progress. Not here: which runs are compared (`methods.rs`,
//! `drives.rs`).

use std::ops::ControlFlow;

use flexarm::recordings::Trace;
use flexarm::{Keep, Modelling, Motion, Robot, RunOptions, RunRequest, Scenario, StepperKind, Summary};
use nalgebra::Vector3;

use crate::bench::larger;
use crate::page::plain;
use crate::{Error, Pace};

/// Sampling rate of the TCP (1/s).
const SAMPLE_HZ: f64 = 500.0;
/// Sampling interval (ms).
pub(super) const SAMPLE_MS: f64 = 1e3 / SAMPLE_HZ;

/// Results kept of a run.
pub(super) struct Run {
    pub(super) times_s: Vec<f64>,
    /// TCP of the flexible arm, world axes (m).
    pub(super) tool_m: Vec<Vector3<f64>>,
    /// Flexible minus rigid TCP (m).
    pub(super) deflection_m: Vec<Vector3<f64>>,
    /// Root mean square of the deflection, and static deflection at the start (m).
    pub(super) rms_m: f64,
    pub(super) sag_m: f64,
    /// Natural frequencies at the start (Hz).
    pub(super) frequencies_hz: Vec<f64>,
    pub(super) duration_s: f64,
}

impl Run {
    fn new(summary: Summary, trace: &Trace) -> Self {
        let tcp = summary.tcp.as_ref();
        let rows = || trace.rows.iter();
        Self {
            times_s: rows().map(|row| row.time_s).collect(),
            tool_m: rows().map(|row| Vector3::from(row.flexible_m)).collect(),
            deflection_m: rows().map(|row| Vector3::from(row.flexible_m) - Vector3::from(row.rigid_m)).collect(),
            rms_m: tcp.map_or(f64::NAN, |tcp| tcp.rms_m),
            sag_m: tcp.map_or(f64::NAN, |tcp| tcp.static_sag_m),
            frequencies_hz: summary.frequencies_hz,
            duration_s: summary.duration_s,
        }
    }

    /// Maximum deflection (m).
    pub(super) fn peaks(&self) -> Sizes {
        Sizes::largest(self.deflection_m.iter().copied())
    }

    /// Maximum distance between the TCPs of two runs (m).
    pub(super) fn apart(&self, other: &Self) -> Sizes {
        if self.tool_m.len() != other.tool_m.len() {
            return Sizes { all: f64::NAN, axes: [f64::NAN; 3] };
        }
        Sizes::largest(self.tool_m.iter().zip(&other.tool_m).map(|(a, b)| a - b))
    }
}

/// Maximum norm of some vectors, and maximum component along x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    pub(super) all: f64,
    pub(super) axes: [f64; 3],
}

impl Sizes {
    fn largest(vectors: impl Iterator<Item = Vector3<f64>>) -> Self {
        let sizes = |v: Vector3<f64>| [v.norm(), v.x.abs(), v.y.abs(), v.z.abs()];
        let most = vectors.map(sizes).reduce(|a, b| std::array::from_fn(|i| larger(a[i], b[i])));
        let [all, x, y, z] = most.unwrap_or([f64::NAN; 4]);
        Self { all, axes: [x, y, z] }
    }

    /// Divides by a length.
    pub(super) fn over(self, length: f64) -> Self {
        Self { all: self.all / length, axes: self.axes.map(|x| x / length) }
    }

    /// Returns x, y, z, then the total.
    pub(super) fn listed(self) -> [f64; 4] {
        let [x, y, z] = self.axes;
        [x, y, z, self.all]
    }
}

/// A run by one method.
pub(super) struct MethodRun {
    /// Name of the link model, and of the stepper with its step size.
    pub(super) links: String,
    pub(super) stepper: String,
    pub(super) run: Run,
    /// Maximum distance of the TCP from that of the truth, over the peak of the truth.
    pub(super) error: Sizes,
}

impl MethodRun {
    /// Returns the names of link model and stepper.
    pub(super) fn name(&self) -> String {
        format!("{}, {}", self.links, self.stepper)
    }
}

/// Name of a stepper with its step size, as printed on the page.
pub(super) fn stepper_name(stepper: &str, step_s: f64) -> String {
    format!("{stepper}, {} ms", plain(1e3 * step_s))
}

/// Performs runs and reports progress.
pub(super) struct Runs<'a, 'p> {
    pace: &'a mut Pace<'p>,
    done: f64,
    all: f64,
}

impl<'a, 'p> Runs<'a, 'p> {
    /// * `all`: cost of all runs together, in runs by generalised-alpha.
    pub(super) fn new(pace: &'a mut Pace<'p>, all: f64) -> Self {
        Self { pace, done: 0.0, all }
    }

    /// Runs a motion with default options.
    pub(super) fn make(
        &mut self,
        robot: &Robot,
        motion: &Motion,
        modelling: Modelling,
        stepper: StepperKind,
        step_s: f64,
    ) -> Result<Run, Error> {
        self.make_with(robot, &motion.into(), &modelling, &RunOptions { stepper, step_s, ..RunOptions::default() })
    }

    /// Runs a scenario with its own options.
    pub(super) fn make_with(
        &mut self,
        robot: &Robot,
        scenario: &Scenario,
        modelling: &Modelling,
        options: &RunOptions,
    ) -> Result<Run, Error> {
        let options = RunOptions { log_rate_hz: SAMPLE_HZ, ..options.clone() };
        let weight = weight(options.stepper, options.step_s);
        let mut progress = |t: f64, total: f64| {
            self.pace.at((self.done + weight * t / total) / self.all);
            ControlFlow::Continue(())
        };
        let request = RunRequest { progress: Some(&mut progress), ..RunRequest::keeping(Keep::Curves) };
        let flexarm::Run { summary, trace, .. } = robot.model(modelling)?.simulate_with(scenario, &options, request)?;
        self.done += weight;
        Ok(Run::new(summary, &trace))
    }
}

/// Approximate cost of a run, in runs by generalised-alpha.
fn weight(stepper: StepperKind, step_s: f64) -> f64 {
    match stepper {
        StepperKind::Reference(_) => 20.0,
        StepperKind::Spook(_) => 2e-3 / step_s,
        _ => 1e-3 / step_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(tool: &[[f64; 3]]) -> Run {
        Run {
            times_s: (0..tool.len()).map(|k| k as f64).collect(),
            tool_m: tool.iter().map(|p| Vector3::from(*p)).collect(),
            deflection_m: tool.iter().map(|p| Vector3::from(*p)).collect(),
            rms_m: 0.0,
            sag_m: 0.0,
            frequencies_hz: Vec::new(),
            duration_s: 1.0,
        }
    }

    /// Truth by hand: (3, 4, 0) has the largest norm, (0, 0, -4.5) the largest z; components peak
    /// at different instants.
    #[test]
    fn each_direction_peaks_at_its_own_instant() {
        let peaks = run(&[[3.0, 4.0, 0.0], [0.0, 0.0, -4.5]]).peaks();
        assert_eq!(peaks.listed(), [3.0, 4.0, 4.5, 5.0]);
        assert_eq!(peaks.over(2.0), Sizes { all: 2.5, axes: [1.5, 2.0, 2.25] });
    }

    #[test]
    fn runs_that_are_not_seen_alike_are_not_compared() {
        let (short, long) = (run(&[[0.0; 3]]), run(&[[0.0; 3], [1.0; 3]]));
        assert!(short.apart(&long).listed().iter().all(|x| x.is_nan()));
        assert_eq!(long.apart(&long).listed(), [0.0; 4]);
        assert!(run(&[]).peaks().all.is_nan());
    }

    #[test]
    fn a_stepper_is_named_with_its_step() {
        assert_eq!(stepper_name("spring-damper", 1e-3), "spring-damper, 1 ms");
        assert_eq!(stepper_name("explicit", 1e-4), "explicit, 0.1 ms");
    }
}
