//! Errors that stop a simulation, with time, step and what to change.
//!
//! Texts name settings by [`Setting`], so that each face shows its own word. Not here: errors of files.

use flexarm_kinematics::{Data, Model};
use flexarm_settings::Setting;

/// Transmission angle (rad) below which a failed step is attributed to a dead point: there the
/// dependent joints turn about a hundred times as fast as the driving joints.
pub(crate) const DEAD_POINT_RAD: f64 = 0.01;

/// Failure of a step, a start or a set-up, with the data needed to understand it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The state left the plausible range.
    #[error(
        "the simulation diverged at t = {t:.6} s (step {h:e} s): {what}; try a smaller {}; a motion too fast for the links has the same effect",
        Setting::Step
    )]
    Diverged {
        /// Time (s).
        t: f64,
        /// Step (s).
        h: f64,
        /// Quantity that left its range, with the value.
        what: String,
    },
    /// The iteration of an implicit step did not converge.
    #[error(
        "the step to t = {t:.6} s (step {h:e} s) did not converge in {iterations} iterations; last relative correction {correction:.1e}: try a smaller {}",
        Setting::Step
    )]
    NotConverged {
        /// Time (s).
        t: f64,
        /// Step (s).
        h: f64,
        /// Iterations done.
        iterations: usize,
        /// Size of the last correction relative to the acceleration.
        correction: f64,
    },
    /// The iteration of a step did not converge while links deflected beyond their model.
    #[error(
        "the step to t = {t:.6} s did not converge, and a smaller step does not help: the model has ended there, because {finding}"
    )]
    BeyondModel {
        /// Time (s).
        t: f64,
        /// Finding about the link.
        finding: String,
    },
    /// A matrix that must be positive definite is not.
    #[error("the {matrix} at t = {t:.6} s is not positive definite: check masses and stiffnesses")]
    Singular {
        /// Name of the matrix.
        matrix: &'static str,
        /// Time (s).
        t: f64,
    },
    /// No static equilibrium was found.
    #[error(
        "no static equilibrium at t = {t:.6} s: after {iterations} Newton iterations the forces are out of balance by {residual:.1e} (relative); is the structure too soft for its weight? {} undeformed starts without it",
        Setting::Start
    )]
    NoEquilibrium {
        /// Time (s).
        t: f64,
        /// Iterations done.
        iterations: usize,
        /// Unbalanced force relative to the applied force.
        residual: f64,
    },
    /// A closed loop is at a dead point, or its links do not reach each other.
    #[error(
        "loop {name:?} does not close beyond t = {t:.6} s: its links are collinear there, or do not reach each other; keep the driving joints \
         away from this dead point, or check the lengths of its links"
    )]
    OpenLoop {
        /// Time (s).
        t: f64,
        /// Name of the loop.
        name: String,
    },
    /// The tubes of a telescopic joint do not overlap, or its guide has no stiffness there.
    #[error(
        "guide {name:?}: at this position its tubes overlap by {overlap:.4} m and tilt by {compliance:.2e} rad per N m; both must be above 0: keep \
         the joint within its tubes, or correct outer_end, inner_end and compliance"
    )]
    Apart {
        /// Name of the spring.
        name: String,
        /// Overlap (m).
        overlap: f64,
        /// Compliance (rad/(N m)).
        compliance: f64,
    },
    /// The solver with error control found no step size that meets the tolerance.
    #[error(
        "the reference stepper gave up at t = {t:.6} s (step {h:e} s): {what}; try a larger {} or another {}",
        Setting::Tolerance,
        Setting::ReferenceMethod
    )]
    SolverGaveUp {
        /// Time (s).
        t: f64,
        /// Step of the solver (s).
        h: f64,
        /// Message of the solver.
        what: String,
    },
    /// The step size is too large for an explicit stepper.
    #[error(
        "{stepper} with step {h:e} s is unstable here: the highest frequency is {highest_hz:.1} Hz, which needs a step below {:.2e} s; use {} or {} generalized-alpha",
        // 0.995 keeps the value rounded to three digits below the limit.
        0.995 * largest_s,
        Setting::Step,
        Setting::Stepper
    )]
    UnstableStep {
        /// Name of the stepper.
        stepper: &'static str,
        /// Step (s).
        h: f64,
        /// Highest natural frequency (Hz).
        highest_hz: f64,
        /// Maximum stable step (s).
        largest_s: f64,
    },
    /// The arm is no ordinary differential equation in its coordinates.
    #[error(
        "an arm with hysteresis is no differential equation in its coordinates, because its springs depend on the past: leave hysteresis out"
    )]
    NoEquations,
    /// A solver outside has set a state beyond what an arm can do.
    #[error(
        "the state is out of the range of the arm: the solver has become unstable; a stiff arm needs an implicit solver or small steps"
    )]
    OutOfRange,
    /// The parts of the arm do not fit together.
    #[error("{0}")]
    Setup(String),
    /// A stepper in maximal coordinates was given an arm with a feature that it does not support.
    #[error("spook works in maximal coordinates and does not support {0}: use generalized-alpha")]
    NotInMaximal(&'static str),
    /// A stepper in maximal coordinates was given links with modal coordinates.
    #[error(
        "spook works in maximal coordinates and does not support modal links ({} lumped would do): use generalized-alpha",
        Setting::Links
    )]
    ModalLinks,
}

impl StepError {
    /// Returns the error for the loop that was at its dead point when a step failed, if any.
    pub(crate) fn dead_point(model: &Model, data: &Data, t: f64) -> Option<Self> {
        let dead = data.transmission_angles().iter().position(|angle| angle.is_nan() || *angle < DEAD_POINT_RAD);
        let k = data.open_loop().or(dead)?;
        Some(Self::OpenLoop { t, name: model.loops()[k].name.clone() })
    }

    /// Returns the error for the first loop that does not close at the last coordinates in `data`,
    /// if any.
    pub(crate) fn open_loop(model: &Model, data: &Data, t: f64) -> Option<Self> {
        data.open_loop().map(|k| Self::OpenLoop { t, name: model.loops()[k].name.clone() })
    }

    /// Returns the settings whose change may help; empty if the cause is the model or the motion.
    pub fn settings(&self) -> &'static [Setting] {
        match self {
            Self::Diverged { .. } | Self::NotConverged { .. } => &[Setting::Step],
            Self::NoEquilibrium { .. } => &[Setting::Start],
            Self::SolverGaveUp { .. } => &[Setting::Tolerance, Setting::ReferenceMethod],
            Self::UnstableStep { .. } => &[Setting::Step, Setting::Stepper],
            Self::NotInMaximal(_) => &[Setting::Stepper],
            Self::ModalLinks => &[Setting::Links, Setting::Stepper],
            Self::Singular { .. }
            | Self::Setup(_)
            | Self::OpenLoop { .. }
            | Self::NoEquations
            | Self::OutOfRange
            | Self::Apart { .. }
            | Self::BeyondModel { .. } => &[],
        }
    }
}
