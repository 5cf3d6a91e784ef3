//! Everything about a run that can be told before its first step.

use flexarm_stepping::{FlexibleArm, Load, StepError, StepRule, Stepper, new_stepper};

use crate::caveat::size::Size;
use crate::caveat::{self, Caveat, kinds};
use crate::compare::tool_frame;
use crate::disturbance::{Disturbances, EXPRESSION_PERIOD};
use crate::error::Error;
use crate::flexible::FlexibleRobot;
use crate::magnification::Expected;
use crate::motion::Motion;
use crate::options::RunOptions;
use crate::robot::Robot;

/// A run whose input makes sense.
pub(crate) struct Checked {
    pub(crate) flexible: FlexibleRobot,
    pub(crate) arm: FlexibleArm,
    pub(crate) stepper: Box<dyn Stepper>,
    pub(crate) load_caveats: Vec<Caveat>,
}

impl Checked {
    /// Deflections that the run will have, roughly.
    pub(crate) fn expected(&self, motion: &Motion, options: &RunOptions) -> Expected {
        Expected::of(&self.arm, &tool_frame(&self.arm), motion.trajectory.duration(), options.start)
    }
}

/// Everything about the input of a run that can be told before the first step. `prepared`: the robot as the options model it.
pub(crate) fn checked(
    robot: &Robot,
    motion: &Motion,
    options: &RunOptions,
    prepared: Option<FlexibleRobot>,
) -> Result<Checked, Error> {
    if !motion.violations.is_empty() && !options.ignore_limits {
        let mut violations: Vec<String> = motion.violations.iter().map(ToString::to_string).collect();
        if let Some(first) = violations.first_mut().filter(|_| !motion.likely.is_empty()) {
            *first += &format!(" ({})", motion.likely);
        }
        return Err(Error::Limits { path: motion.path.clone(), violations });
    }
    check_options(motion, options)?;
    let failed = |source: StepError| Error::Step { source, partial: false };
    let flexible = prepared.map_or_else(|| robot.modelled(&options.modelling), Ok)?;
    let mut arm = flexible.arm(motion.prescribed()).map_err(|error| flexible.explained(error))?;
    let mut load_caveats = Vec::new();
    if options.loads.is_some() || !options.applied.is_empty() {
        let duration = motion.trajectory.duration();
        let read = options.loads.as_ref().map(|path| Disturbances::load(path, robot, &arm.model, duration));
        let mut disturbances = read.transpose()?.unwrap_or_default();
        for load in &options.applied {
            disturbances.loads.push(load.on(&arm.model, duration)?);
        }
        load_caveats = disturbances.caveats;
        load_caveats.extend(caveat::motion::of_loads(&disturbances.loads, duration, &Size::of(&robot.rigid)));
        if options.stepper.entry().steps != StepRule::ByErrorControl {
            load_caveats.extend(short_loads(&disturbances.loads, options.step_s));
        }
        arm = arm.with_inertia_changes(disturbances.changes).map_err(failed)?;
        arm = arm.with_timed_loads(disturbances.loads).map_err(failed)?;
    }
    if options.log_rate_hz * options.step_s > 1.0 + 1e-9 && options.log_rate_hz != RunOptions::default().log_rate_hz {
        load_caveats.push(kinds::LOG_RATE.found("run", options.log_rate_hz, 1.0 / options.step_s));
    }
    let stepper = new_stepper(options.stepper, arm.clone(), options.step_s, options.start)
        .map_err(|error| flexible.explained(error))?;
    Ok(Checked { flexible, arm, stepper, load_caveats })
}

/// Most steps of a run: some hours.
const MOST_STEPS: f64 = 1e9;
/// Factors by which deflections can be shown.
const MAGNIFICATIONS: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// Numbers must make sense, and step and duration make a run that comes to an end.
fn check_options(motion: &Motion, options: &RunOptions) -> Result<(), Error> {
    let positive = |what: &str, x: f64, unit: &str| {
        let message = || Error::Usage(format!("the {what} must be positive, found {x} {unit}"));
        if x.is_finite() && x > 0.0 { Ok(()) } else { Err(message()) }
    };
    positive("step", options.step_s, "s")?;
    positive("log rate", options.log_rate_hz, "Hz")?;
    positive("settling band", options.settling_band_m, "m")?;
    positive("factor of deflections (--magnify)", options.magnification.unwrap_or(1.0), "times")?;
    if let Some(factor) = options.magnification.filter(|factor| !MAGNIFICATIONS.contains(factor)) {
        let (least, most) = (MAGNIFICATIONS.start(), MAGNIFICATIONS.end());
        let message = format!(
            "the factor of deflections (--magnify) is {factor:e}: expected one from {least} to {most}, 1 shows them as they are"
        );
        return Err(Error::Usage(message));
    }
    let duration = motion.trajectory.duration();
    if options.step_s > duration {
        let message = format!("the step (--step {} s) is longer than the motion ({duration} s)", options.step_s);
        return Err(Error::Usage(message));
    }
    if duration / options.step_s > MOST_STEPS {
        return Err(Error::Usage(format!(
            "{duration} s in steps of {:e} s make {:.1e} steps, at most {MOST_STEPS:.0e} are taken: raise --step or cut the \
             trajectory",
            options.step_s,
            duration / options.step_s
        )));
    }
    Ok(())
}

/// Steps that a load, or a period of it, must last to be met well.
const STEPS_PER_LOAD: f64 = 8.0;

/// Loads that last so few steps that they do not act as the file says.
fn short_loads(loads: &[Load], h: f64) -> Vec<Caveat> {
    let brief = |load: &Load| {
        let (first, last) = load.jumps.iter().fold((f64::INFINITY, 0.0f64), |(a, b), t| (a.min(*t), b.max(*t)));
        let steps = (last - first) / h;
        (last > first && steps < STEPS_PER_LOAD).then(|| {
            format!(
                "a load from {first} s to {last} s lasts {steps:.1} steps: its impulse is not met well; lower --step"
            )
        })
    };
    let fast = |load: &Load| {
        let steps = load.period / h;
        (load.period != EXPRESSION_PERIOD && steps < STEPS_PER_LOAD).then(|| {
            let hz = 1.0 / load.period;
            format!("a load of {hz:.1} Hz has {steps:.1} steps per period: it does not act as written; lower --step")
        })
    };
    let told = |text: String| Caveat::said("short-load", "loads", text, "lower the step");
    loads.iter().filter_map(|load| brief(load).or_else(|| fast(load)).map(told)).collect()
}
