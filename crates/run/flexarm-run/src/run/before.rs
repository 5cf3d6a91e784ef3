//! Caveats before the first step, for single runs and for studies.
//!
//! Not here: errors in the input (`prepare`), caveats about the result (`figures`), thresholds
//! (`caveat`).

use flexarm_kinematics::State;
use flexarm_stepping::{Plant, StepRule, StepperKind};
use nalgebra::DVector;

use super::steps_per_sample;
use crate::arm::Arm;
use crate::arm::options::RunOptions;
use crate::caveat::pose::ArmAtRest;
use crate::caveat::{Finding, kinds, of_use, validity};
use crate::motions::motion::Motion;
use crate::poses::posed::{set_equilibrium, strains, undeformed};

/// Minimum number of steps per period of a gear's ripple, for which a second-order stepper has an
/// amplitude error of a few per cent.
const RIPPLE_STEPS: f64 = 12.0;

/// A run that is ready to start.
pub struct BeforeRun<'a> {
    /// Robot with its links and drives modelled.
    pub arm: &'a Arm,
    /// Arm at the start, with its loads.
    pub plant: &'a Plant,
    /// Motion.
    pub motion: &'a Motion,
    /// Stepper and step size.
    pub options: &'a RunOptions,
}

impl BeforeRun<'_> {
    /// Returns caveats about the models of the links, the motion, the arm at rest at the start, the
    /// step size and the stepper.
    ///
    /// * `sag_m`: static TCP deflection (m).
    pub(crate) fn caveats(&self, sag_m: f64) -> Vec<Finding> {
        let Self { arm, plant, motion, options } = *self;
        let mut caveats = arm.link_caveats();
        caveats.extend(of_use::of_motion(motion, &arm.rigid));
        let elastic = plant.modes.equilibrium.as_slice();
        caveats.extend(ArmAtRest { arm, plant, elastic, sag_m }.caveats());
        if let Some(first) = plant.modes.frequencies_hz().first() {
            let logged_hz = 1.0 / (steps_per_sample(options) as f64 * options.step_s);
            caveats.extend(validity::sampling(*first, logged_hz));
        }
        caveats.extend(self.of_steps());
        if options.log_rate_hz * options.step_s > 1.0 + 1e-9 && options.log_rate_hz != RunOptions::default().log_rate_hz
        {
            caveats.push(kinds::LOG_RATE.found("run", options.log_rate_hz, 1.0 / options.step_s));
        }
        if motion.trajectory.initial_speed() > 1e-6 {
            let message = "the motion starts at speed: the first ringing is an artefact of the sudden start";
            caveats.push(Finding::warning("starts-moving", "run", message, ""));
        }
        caveats
    }

    /// Returns the caveats about the step size and the stepper.
    pub fn of_steps(&self) -> Vec<Finding> {
        let Self { plant, motion, options, .. } = *self;
        let first = plant.modes.frequencies_hz().first().copied();
        let coarse = |first| validity::step(options.stepper, options.step_s, first, plant.first_damping_ratio());
        let moves = motion.trajectory.moves();
        let long = validity::long_step(options.step_s, moves.iter().map(|m| m.end - m.start));
        first.and_then(coarse).into_iter().chain(long).chain(self.spook()).chain(self.ripple()).collect()
    }

    /// As `caveats`, for a study that keeps no samples: also checks the links at rest.
    pub fn caveats_of_study(&self, sag_m: f64) -> Vec<Finding> {
        self.caveats(sag_m).into_iter().chain(self.links_at_rest()).collect()
    }

    /// Checks for links that deflect too far at rest.
    fn links_at_rest(&self) -> Vec<Finding> {
        let plant = self.plant;
        let (_, mut state) = undeformed(plant);
        set_equilibrium(plant, &mut state);
        let links = self.arm.spans.iter().zip(strains(self.arm, plant, &state.q));
        links.flat_map(|(span, (strain, rotation))| validity::link(&span.link, rotation, strain)).collect()
    }

    /// Returns a caveat about damping that the stepper must approximate.
    fn spook(&self) -> Option<Finding> {
        let changes = matches!(self.options.stepper, StepperKind::Spook(_)) && !self.plant.proportional;
        changes.then(|| {
            let betas: Vec<String> = self.plant.tau.iter().map(|b| format!("{b:.2e}")).collect();
            let message = format!(
                "spook damps each spring in proportion to its stiffness: modal damping became D = beta K with beta = {} s, \
                 exact for the first mode",
                betas.join(", ")
            );
            Finding::warning("spook-damping", "run", message, "")
        })
    }

    /// Checks whether the steps resolve the ripple of gears, at the maximum speed over a thousand
    /// points of the motion.
    fn ripple(&self) -> Option<Finding> {
        let (plant, model, duration) = (self.plant, &self.plant.model, self.motion.trajectory.duration());
        if plant.transmission.is_empty() || self.options.stepper.entry().steps == StepRule::ByErrorControl {
            return None;
        }
        // Highest speed of each motor, then the ripple with the most cycles per second.
        let mut state = State::zeros(model);
        let mut fastest = vec![0.0f64; model.n_actuated()];
        for k in 0..=1000 {
            plant.prescribed_state(duration * f64::from(k) * 1e-3, &mut state, &mut DVector::zeros(model.nv()));
            fastest.iter_mut().zip(state.qdot.iter()).for_each(|(most, rate)| *most = most.max(rate.abs()));
        }
        let harmonics =
            plant.transmission.iter().flat_map(|error| error.harmonics.iter().map(move |h| (error.motor, h.cycles)));
        let rates = harmonics.map(|(motor, cycles)| (motor, cycles * fastest[motor]));
        let (motor, rate) = rates.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let steps = std::f64::consts::TAU / (rate * self.options.step_s);
        let joint = format!("joint {:?}", model.coordinates()[motor].joint);
        (steps < RIPPLE_STEPS).then(|| kinds::RIPPLE_STEP.found(joint, steps, RIPPLE_STEPS))
    }
}
