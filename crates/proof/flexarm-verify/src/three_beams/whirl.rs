//! Ringing during rotation: modal links, whose velocity terms are integrals over shapes, compared
//! with chains of rigid bodies.

use std::sync::Arc;

use flexarm::steppers::Start;
use flexarm::{LinkModel, Modelling, Robot};
use flexarm_stepping::MotionFn;

use crate::Error;
use crate::bench::{farthest, in_modes, in_parts, parts, tool_path};

/// Angular velocities of the joint (rad/s).
const SPEEDS: [f64; 2] = [7.5, 15.0];
/// Number of parts of each beam in the chain that serves as truth.
pub(super) const TRUE_PARTS: usize = 9;
/// Step size (s) and number of steps.
pub(super) const STEP_S: f64 = 1e-3;
pub(super) const STEPS: usize = 500;

/// A link model.
pub(super) struct Model {
    pub(super) name: String,
    modelling: Modelling,
    /// Whether loads change the stiffness of its links.
    pub(super) stiffening: bool,
}

/// Results at one speed.
pub(super) struct Turn {
    pub(super) speed_rad_s: f64,
    /// Maximum deflection of the chain that serves as truth (m).
    pub(super) peak_m: f64,
    /// Maximum distance of the tip from that of the chain, over the peak, one per model.
    pub(super) errors: Vec<f64>,
}

/// Results at all speeds.
pub(super) struct Whirl {
    pub(super) models: Vec<Model>,
    pub(super) turns: Vec<Turn>,
}

impl Whirl {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let linear = [in_parts(2), in_parts(3), in_parts(5), in_modes(6)];
        let linear = linear.into_iter().map(|(name, modelling)| Model { name, modelling, stiffening: false });
        let mut models: Vec<Model> = linear.collect();
        let (name, modelling) = in_modes(6);
        models.push(Model { name: format!("{name}, stiffness by load"), modelling, stiffening: true });
        let turns = SPEEDS.iter().map(|speed| Turn::new(robot, &models, *speed)).collect::<Result<_, Error>>()?;
        Ok(Self { models, turns })
    }
}

impl Turn {
    fn new(robot: &Robot, models: &[Model], speed_rad_s: f64) -> Result<Self, Error> {
        let turn = move |t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
            (q[0], qdot[0], qddot[0]) = (speed_rad_s * t, speed_rad_s, 0.0);
        };
        let path = |modelling: &Modelling, stiffening: bool| {
            tool_path(robot, modelling, stiffening, Arc::new(MotionFn(turn)), Start::Undeformed, (STEP_S, STEPS))
        };
        let truth = path(&parts(TRUE_PARTS), false)?;
        let rigid = path(&Modelling { links: LinkModel::Rigid, ..Modelling::default() }, false)?;
        let peak_m = farthest(&rigid, &truth);
        let error = |model: &Model| Ok(farthest(&path(&model.modelling, model.stiffening)?, &truth) / peak_m);
        let errors = models.iter().map(error).collect::<Result<_, Error>>()?;
        Ok(Self { speed_rad_s, peak_m, errors })
    }
}
