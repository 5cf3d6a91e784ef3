//! Checks the input of a run before its first step.
//!
//! Start at [`Arm::at_start`]. SI units. Not here: checks of robot file and motion file, which are
//! made when they are read; caveats before a run (`before`).

use std::sync::Arc;

use flexarm_settings::Setting;
use flexarm_stepping::{Load, Plant, StepError, StepRule, Stepper, new_stepper};

use crate::arm::Arm;
use crate::arm::options::RunOptions;
use crate::caveat::size::Size;
use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::motions::loads_file::EXPRESSION_PERIOD;
use crate::motions::motion::Motion;
use crate::motions::scenario::Scenario;
use crate::robot::Robot;
use crate::robot::balancer;
use crate::robot::loops;
use crate::run::magnification::Expected;

/// A run whose input has been checked.
pub(crate) struct Checked {
    pub(crate) plant: Arc<Plant>,
    pub(crate) stepper: Box<dyn Stepper>,
    pub(crate) load_caveats: Vec<Finding>,
}

impl Arm {
    /// Returns the arm at the start of a scenario, with its loads and payloads, and the caveats
    /// about the loads.
    ///
    /// # Errors
    /// All errors in the input that can be found before a stepper is built.
    pub fn at_start(&self, scenario: &Scenario, options: &RunOptions) -> Result<(Plant, Vec<Finding>), Error> {
        let motion = &scenario.motion;
        runnable(motion, options)?;
        loops::along_motion(&self.rigid, &motion.trajectory)?;
        balancer::check_motion(&self.rigid, &motion.trajectory)?;
        let plant = self.plant(motion.prescribed()).map_err(|error| self.explained(error))?;
        loaded(self.robot(), scenario, options, plant)
    }

    /// Checks the whole input of a run and builds its stepper.
    pub(crate) fn checked(&self, scenario: &Scenario, options: &RunOptions) -> Result<Checked, Error> {
        let (plant, load_caveats) = self.at_start(scenario, options)?;
        let plant = Arc::new(plant);
        let stepper = new_stepper(options.stepper, plant.clone(), options.step_s, scenario.start)
            .map_err(|error| self.explained(error))?;
        Ok(Checked { plant, stepper, load_caveats })
    }

    /// Returns an estimate of the deflections of a run.
    ///
    /// # Errors
    /// As [`Arm::simulate`], as far as errors are found before the first step.
    pub fn expected(&self, scenario: &Scenario, options: &RunOptions) -> Result<Expected, Error> {
        let plant = self.checked(scenario, options)?.plant;
        Ok(Expected::of(&plant, &self.tcp, scenario.duration_s(), scenario.start))
    }
}

/// Checks that a motion respects the joint limits, and that the options are valid for it.
///
/// # Errors
/// [`Error::Limits`] with all violations, unless the options ignore them; [`Error::Value`] for the
/// first invalid option.
pub fn runnable(motion: &Motion, options: &RunOptions) -> Result<(), Error> {
    if !motion.violations.is_empty() && !options.ignore_limits {
        let mut violations: Vec<String> = motion.violations.iter().map(|v| v.warning().message).collect();
        if let Some(first) = violations.first_mut().filter(|_| !motion.likely.is_empty()) {
            *first += &format!(" ({})", motion.likely);
        }
        return Err(Error::Limits { path: motion.path.clone(), violations });
    }
    check_options(motion, options)
}

/// Returns the arm with the loads and payloads of a scenario, and the caveats about them.
///
/// * `plant`: the same arm without them.
///
/// # Errors
/// As [`Scenario::acting_on`]; [`Error::Step`] if an inertia with its payload is not valid.
pub fn loaded(
    robot: &Robot,
    scenario: &Scenario,
    options: &RunOptions,
    mut plant: Plant,
) -> Result<(Plant, Vec<Finding>), Error> {
    let failed = |source: StepError| Error::Step { source, partial: false };
    let mut load_caveats = Vec::new();
    if !scenario.loads.is_empty() || !scenario.payloads.is_empty() {
        let duration = scenario.duration_s();
        let mut acting = scenario.acting_on(robot, &plant.model)?;
        load_caveats = acting.caveats;
        load_caveats.extend(caveat::motion::of_loads(&acting.loads, duration, &Size::of(&robot.rigid)));
        if options.stepper.entry().steps != StepRule::ByErrorControl {
            acting.loads.iter_mut().for_each(|load| stop_within(load, options.step_s));
            load_caveats.extend(fast_loads(&acting.loads, options.step_s));
        }
        plant = plant.with_inertia_changes(acting.changes).map_err(failed)?;
        plant = plant.with_timed_loads(acting.loads).map_err(failed)?;
    }
    Ok((plant, load_caveats))
}

/// Maximum number of steps of a run (some hours).
const MAX_STEPS: f64 = 1e9;
/// Range of the magnification of deflections.
const MAGNIFICATIONS: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// Checks that the options are valid, and that step size and duration give a finite run.
fn check_options(motion: &Motion, options: &RunOptions) -> Result<(), Error> {
    // Each number on its own.
    for (setting, what, x, unit) in [
        (Setting::Step, "step", options.step_s, "s"),
        (Setting::LogRate, "log rate", options.log_rate_hz, "Hz"),
        (Setting::SettlingBand, "settling band", options.settling_band_m, "m"),
        (Setting::Magnification, "factor of deflections", options.magnification.unwrap_or(1.0), "times"),
    ] {
        if !(x.is_finite() && x > 0.0) {
            return Err(Error::Value(format!("{setting}: the {what} must be positive, found {x} {unit}")));
        }
    }
    if let Some(factor) = options.magnification.filter(|factor| !MAGNIFICATIONS.contains(factor)) {
        let (least, most) = (*MAGNIFICATIONS.start(), *MAGNIFICATIONS.end());
        let message = format!(
            "the factor of deflections ({}) is {factor:e}: expected one from {least} to {most}, 1 shows them as they \
             are",
            Setting::Magnification
        );
        return Err(Error::Value(message));
    }

    // The step against the duration.
    let (step_s, duration_s) = (options.step_s, motion.trajectory.duration());
    if step_s > duration_s {
        return Err(Error::Value(format!(
            "the step ({} {step_s} s) is longer than the motion ({duration_s} s)",
            Setting::Step
        )));
    }
    if duration_s / step_s > MAX_STEPS {
        let message = format!(
            "{duration_s} s in steps of {step_s:e} s make {:.1e} steps, at most {MAX_STEPS:.0e} are taken: raise {} \
             or cut the trajectory",
            duration_s / step_s,
            Setting::Step
        );
        return Err(Error::Value(message));
    }
    Ok(())
}

/// Minimum number of steps per period of a load for sufficient accuracy.
const STEPS_PER_LOAD: f64 = 8.0;

/// Number of steps within a short load: the trapezoidal rule integrates half a sine to 0.14 %.
const STEPS_OF_SHORT_LOAD: u32 = 24;

/// Maximum number of kinks at which steps end; a table can have one per row.
const MAX_KINKS: usize = 100;

/// Adds stops within a load that is too short for the step size to resolve.
fn stop_within(load: &mut Load, h: f64) {
    let (first, last) = load.wrench.jumps.iter().fold((f64::INFINITY, 0.0f64), |(a, b), t| (a.min(*t), b.max(*t)));
    let lasts = last - first;
    if lasts > 0.0 && lasts < f64::from(STEPS_OF_SHORT_LOAD) * h {
        let inner = (0..=STEPS_OF_SHORT_LOAD).map(|k| first + lasts * f64::from(k) / f64::from(STEPS_OF_SHORT_LOAD));
        let kinks = load.wrench.jumps.iter().copied().take(MAX_KINKS);
        load.wrench.stops = inner.chain(kinks).collect();
    }
}

/// Caveats about loads whose period the step size does not resolve.
fn fast_loads(loads: &[Load], h: f64) -> Vec<Finding> {
    let fast = |load: &Load| {
        let period = load.wrench.period;
        let steps = period / h;
        (period != EXPRESSION_PERIOD && steps < STEPS_PER_LOAD).then(|| {
            let hz = 1.0 / period;
            let step = Setting::Step;
            format!("a load of {hz:.1} Hz has {steps:.1} steps per period: it does not act as written; lower {step}")
        })
    };
    let caveat =
        |text: String| Finding::warning("short-load", "loads", text, "lower the step").mended_by(&[Setting::Step]);
    loads.iter().filter_map(|load| fast(load).map(caveat)).collect()
}
