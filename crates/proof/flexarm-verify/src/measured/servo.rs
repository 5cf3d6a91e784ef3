//! Simulations with servos along the recorded references: order of magnitude of the tracking error
//! of motors and links.

use std::sync::Arc;

use flexarm::{DriveModel, Modelling, Motion, Robot};
use flexarm_stepping::{Observation, Servo, ServoAxis, Start, new_stepper};

use super::recording::{AXES, Recording, STEP_S, WITH_ENCODER};
use crate::Error;
use crate::bench::{ALPHA, step_error};
use flexarm_analysis::signal::rms;

/// Simulation steps per sample.
const STEPS: usize = 4;

/// RMS of reference minus position per axis (rad): position behind the gear if there is an encoder,
/// of the motor otherwise.
pub(super) type Tracking = [f64; AXES];

pub(super) struct Servos {
    pub(super) measured: Tracking,
    /// With and without feed-forward of the torques of the rigid robot along the reference.
    pub(super) fed_forward: Tracking,
    pub(super) alone: Tracking,
}

impl Servos {
    pub(super) fn new(robot: &Robot, run: &Recording) -> Result<Self, Error> {
        Ok(Self {
            measured: tracking(run, |axis, i| if axis < WITH_ENCODER { run.link[axis][i] } else { run.motor[axis][i] }),
            fed_forward: simulated(robot, run, 1.0)?,
            alone: simulated(robot, run, 0.0)?,
        })
    }
}

fn tracking(run: &Recording, position: impl Fn(usize, usize) -> f64) -> Tracking {
    std::array::from_fn(|axis| rms(run.compared().map(|i| run.reference[axis][i] - position(axis, i))))
}

/// Simulates all axes under torque control with the default gains of robot files.
fn simulated(robot: &Robot, run: &Recording, feed_forward: f64) -> Result<Tracking, Error> {
    let rows: Vec<f64> = (0..run.time_s.len()).flat_map(|i| run.at(&run.reference, i)).collect();
    let motion = Motion::from_samples(&run.time_s, &rows, robot)?;
    let modelling = Modelling { drives: DriveModel::Servo, ..Modelling::default() };
    let mut plant = robot.model(&modelling)?.plant(motion.prescribed()).map_err(step_error)?;
    if let Some(servo) = &plant.servo {
        let axes = servo.axes.iter().map(|axis| ServoAxis { feed_forward, ..*axis }).collect();
        plant.servo = Some(Arc::new(Servo { axes, ..(**servo).clone() }));
    }
    let first = plant.model.n_actuated();
    let mut observed = Observation::new(&plant);
    let mut stepper = new_stepper(ALPHA, plant, STEP_S / STEPS as f64, Start::Equilibrium).map_err(step_error)?;
    let mut positions = vec![Vec::new(); AXES];
    for sample in 0..run.time_s.len() {
        if sample > 0 {
            for _ in 0..STEPS {
                stepper.step().map_err(step_error)?;
            }
        }
        stepper.observe(&mut observed);
        for (axis, to) in positions.iter_mut().enumerate() {
            let spring = if axis < WITH_ENCODER { observed.q[first + axis] } else { 0.0 };
            to.push(observed.q[axis] + spring);
        }
    }
    Ok(tracking(run, |axis, i| positions[axis][i]))
}
