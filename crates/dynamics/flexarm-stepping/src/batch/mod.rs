//! Many runs of one tree that differ in payload, motion, stiffness, damping and duration.
//!
//! Four or eight runs are computed in parallel in SIMD lanes if the processor has them; results are
//! bitwise those of the same run by itself ([`Batch::run_alone`]). Runs with features that lanes do
//! not support (different trees, servos, loads, payload changes, nonlinear springs, velocity
//! jumps), and runs whose steps must be subdivided or do not converge, are computed individually.
//! The result of a run is the deflection of the tool relative to the rigid arm. Start at
//! [`Batch::run`]; threads are left to the caller. Not here: recordings, settling figures, drives.

mod lane_alpha;
mod lane_arm;

use flexarm_kinematics::lanes::{LaneTree, forward_kinematics, rigid_and_flexible};
use flexarm_kinematics::products::{dot, sub};
use flexarm_kinematics::{Data, Frame, Real};
use nalgebra::Vector3;

use crate::arm::FlexibleArm;
use crate::error::StepError;
use crate::observation::Observation;
use crate::stepper::Start;
use crate::steppers::{StepperKind, new_stepper};
use lane_alpha::LaneAlpha;

/// Common settings of the runs of a batch.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Step size (s).
    pub step_s: f64,
    /// Stepper; only generalised-alpha computes runs in parallel lanes.
    pub stepper: StepperKind,
    /// Initial state of the runs.
    pub start: Start,
    /// Frame whose deflection is computed.
    pub tool: Frame,
    /// Whether to keep the deflection after every step.
    pub keep_samples: bool,
}

/// One run.
#[derive(Clone)]
pub struct BatchRun {
    /// Tree, springs, damping and motion.
    pub arm: FlexibleArm,
    /// Duration (s); the last step may end after it.
    pub duration_s: f64,
}

/// Deflection of the tool of a run relative to the rigid arm on the same motion, at the start and
/// after every step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToolDeflection {
    /// Steps taken.
    pub steps: u64,
    /// Maximum distance (m).
    pub peak_m: f64,
    /// Time of the first maximum (s).
    pub t_peak_s: f64,
    /// Root mean square distance (m).
    pub rms_m: f64,
    /// Flexible minus rigid position at the end, world axes (m).
    pub end_m: [f64; 3],
    /// Deflection at the start and after every step, if the batch keeps samples.
    pub samples_m: Vec<[f64; 3]>,
}

impl ToolDeflection {
    #[doc(hidden)]
    pub fn include(&mut self, t: f64, deflection: Vector3<f64>, keep: bool) {
        let square = dot(&deflection, &deflection);
        // Sum of squares until `finished`.
        self.rms_m += square;
        if square.sqrt() > self.peak_m {
            (self.peak_m, self.t_peak_s) = (square.sqrt(), t);
        }
        self.end_m = deflection.into();
        if keep {
            self.samples_m.push(self.end_m);
        }
    }

    fn finished(mut self, steps: u64) -> Self {
        self.steps = steps;
        self.rms_m = (self.rms_m / (steps + 1) as f64).sqrt();
        self
    }
}

impl Batch {
    /// Computes the runs, in groups of [`Batch::most_side_by_side`] where possible. Groups of runs
    /// with equal duration waste the least time.
    ///
    /// # Errors
    /// Per run: [`StepError`] as returned by a stepper.
    pub fn run(&self, runs: &[BatchRun]) -> Vec<Result<ToolDeflection, StepError>> {
        let mut all = Vec::with_capacity(runs.len());
        for group in runs.chunks(Self::most_side_by_side()) {
            match self.side_by_side(group) {
                Some(results) => {
                    let pairs = results.into_iter().zip(group);
                    all.extend(pairs.map(|(result, run)| result.map_or_else(|| self.run_alone(run), Ok)));
                }
                None => all.extend(group.iter().map(|run| self.run_alone(run))),
            }
        }
        all
    }

    /// Returns the number of runs that this processor computes in parallel: eight with AVX-512,
    /// four with AVX2.
    #[cfg(target_arch = "x86_64")]
    pub fn most_side_by_side() -> usize {
        flexarm_kinematics::most_lanes()
    }

    /// Returns the number of runs that this processor computes in parallel.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn most_side_by_side() -> usize {
        1
    }

    /// Computes one run by itself.
    ///
    /// # Errors
    /// [`StepError`] as returned by a stepper.
    pub fn run_alone(&self, run: &BatchRun) -> Result<ToolDeflection, StepError> {
        let mut stepper = new_stepper(self.stepper, run.arm.clone(), self.step_s, self.start)?;
        let mut seen = Observation::new(&run.arm);
        let mut tool = None;
        let mut result = ToolDeflection::default();
        let steps = self.steps(run);
        for step in 0..=steps {
            if step > 0 {
                stepper.step()?;
            }
            stepper.observe(&mut seen);
            // The model changes with the payload.
            let same = |tree: &LaneTree<f64>| std::ptr::eq(tree.model(), std::sync::Arc::as_ptr(&seen.model));
            if !tool.as_ref().is_some_and(|(tree, _)| same(tree)) {
                tool = LaneTree::new(std::slice::from_ref(&seen.model)).map(|tree| (tree, Data::new(&seen.model)));
            }
            if let Some((tree, data)) = &mut tool {
                let q = seen.q.as_slice();
                forward_kinematics(tree, data, q);
                let [rigid, flexible] = rigid_and_flexible(tree, data, &self.tool, q);
                result.include(seen.t, sub(&flexible, &rigid), self.keep_samples);
            }
        }
        Ok(result.finished(steps))
    }

    /// Returns the number of steps of a run; the last one may end after the duration.
    fn steps(&self, run: &BatchRun) -> u64 {
        (run.duration_s / self.step_s - 1e-9).ceil().max(0.0) as u64
    }

    /// Computes a group in lanes. `None` if the group, inner `None` if one run has to be computed
    /// individually.
    #[cfg(target_arch = "x86_64")]
    fn side_by_side(&self, runs: &[BatchRun]) -> Option<Vec<Option<ToolDeflection>>> {
        use flexarm_kinematics::{OverLanes, with_lanes};

        struct Group<'a>(&'a Batch, &'a [BatchRun]);
        impl OverLanes for Group<'_> {
            type Output = Option<Vec<Option<ToolDeflection>>>;

            #[inline(always)]
            fn run<T: Real>(self) -> Self::Output {
                self.0.in_lanes::<T>(self.1)
            }
        }
        with_lanes(runs.len(), Group(self, runs))?
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn side_by_side(&self, _runs: &[BatchRun]) -> Option<Vec<Option<ToolDeflection>>> {
        None
    }

    /// Computes as many runs as there are lanes, or fewer.
    #[inline(always)]
    fn in_lanes<T: Real>(&self, runs: &[BatchRun]) -> Option<Vec<Option<ToolDeflection>>> {
        // Errors of invalid settings are reported by the individual run.
        let StepperKind::GeneralizedAlpha(settings) = self.stepper else { return None };
        if !(0.0..=1.0).contains(&settings.rho) || self.step_s.is_nan() || self.step_s <= 0.0 {
            return None;
        }
        let arms: Vec<&FlexibleArm> = runs.iter().map(|run| &run.arm).collect();
        // Unused lanes repeat the last run.
        let mut filled = arms.clone();
        filled.resize(T::LANES, arms.last()?);
        let mut lanes = LaneAlpha::<T>::new(&filled, settings, self.step_s, self.start)?.ok()?;
        let steps: Vec<u64> = runs.iter().map(|run| self.steps(run)).collect();
        let mut results = vec![ToolDeflection::default(); runs.len()];
        for step in 0..=steps.iter().copied().max()? {
            if step > 0 {
                lanes.step();
            }
            if (0..runs.len()).all(|lane| lanes.left_behind(lane)) {
                return None;
            }
            let deflection = lanes.deflection(&self.tool);
            for (lane, result) in results.iter_mut().enumerate() {
                if step <= steps[lane] {
                    let own = deflection.map(|x| x.lane(lane));
                    result.include(lanes.grid.time(), own, self.keep_samples);
                }
            }
        }
        let finished = results.into_iter().zip(&steps).enumerate();
        let finished = finished.map(|(k, (result, steps))| (!lanes.left_behind(k)).then(|| result.finished(*steps)));
        Some(finished.collect())
    }
}
