//! Gears from recorded positions of motors and links: torques of the rigid robot along the motion, filters, the fit's reading.

use flexarm_analysis::signal::{LowPass, derivative};
use flexarm_identify::{GearRun, Reading, ReadingKind, gear_stiffness};
use flexarm_kinematics::{Data, Mechanism, Model, State, inverse_dynamics};
use nalgebra::DVector;
use serde::Serialize;

use super::file::{EncoderRecording, MeasurementInput};
use super::parameters::{Candidate, Written};
use crate::arm::Arm;
use crate::error::Error;
use crate::robot_file::RobotFileError;

/// What recordings tell of a gear. SI units.
#[derive(Clone, Debug, Serialize)]
pub struct EncoderFigures {
    /// Joint.
    pub joint: String,
    /// Stiffness (N m/rad, N/m).
    pub stiffness: f64,
    /// Its standard deviation, by leaving out seconds of the recordings.
    pub std: f64,
    /// By how much the link's encoder is late (s).
    pub delay_s: f64,
    /// Share of the deflection, without offsets and delay, that the torque explains.
    pub r2: f64,
    /// The same of each run by the others (of each half, with one run).
    pub unseen_r2: Vec<f64>,
    /// Stiffness without each run.
    pub without_each: Vec<f64>,
    /// RMS of the deflection without offsets and delay (rad, m).
    pub deflection_rms: f64,
    /// RMS of what is left of it.
    pub rest_rms: f64,
    /// Whether the recordings tell the gear: most of an unseen run follows, and no run decides alone.
    pub told: bool,
    /// The parameter that it is.
    #[serde(skip)]
    parameter: String,
    /// Its first guess.
    #[serde(skip)]
    initial: f64,
}

impl EncoderFigures {
    /// The reading for the fit, if the recordings tell the gear.
    pub(super) fn reading(&self) -> Option<Reading> {
        let kind = ReadingKind::Known {
            parameter: self.parameter.clone(),
            value: (self.stiffness / self.initial).ln(),
            std: self.std / self.stiffness,
        };
        self.told.then(|| Reading { name: format!("encoders of {}", self.joint), q: Vec::new(), kind })
    }
}

/// Each gear with an encoder behind it.
pub(super) fn told(arm: &Arm, input: &MeasurementInput, chosen: &[Candidate]) -> Result<Vec<EncoderFigures>, Error> {
    let Some(first) = input.recordings.first() else { return Ok(Vec::new()) };
    let model =
        link_side(&arm.robot().rigid).map_err(|source| Error::Model { path: arm.robot().urdf_path.clone(), source })?;
    let joints: Vec<String> = arm.joints().map(str::to_owned).collect();
    let runs =
        input.recordings.iter().map(|recording| Smooth::of(recording, &model)).collect::<Result<Vec<_>, Error>>()?;
    let mut found = Vec::new();
    for (k, joint) in joints.iter().enumerate() {
        let own: Vec<GearRun> =
            runs.iter().zip(&input.recordings).filter_map(|(run, recording)| run.gear(recording, k)).collect();
        if own.is_empty() {
            continue;
        }
        let written = Written::Gearbox { joint: joint.clone(), entry: None };
        let Some(parameter) = chosen.iter().find(|c| c.written == written).map(|c| &c.parameter) else {
            let text = format!("joint {joint:?} has an encoder, but no gearbox with one stiffness that is to be found");
            return Err(RobotFileError { message: text, ..first.place.clone() }.into());
        };
        let Some(gear) = gear_stiffness(&own) else {
            let text =
                format!("joint {joint:?}: the recordings are too short (2 s at least), or its torque does not change");
            return Err(RobotFileError { message: text, ..first.place.clone() }.into());
        };
        found.push(EncoderFigures {
            joint: joint.clone(),
            stiffness: gear.stiffness,
            std: gear.std_ln * gear.stiffness.abs(),
            delay_s: gear.delay_s,
            r2: gear.r2,
            told: gear.is_told(),
            unseen_r2: gear.unseen_r2,
            without_each: gear.without_each,
            deflection_rms: gear.deflection_rms,
            rest_rms: gear.rest_rms,
            parameter: parameter.name.clone(),
            initial: parameter.initial,
        });
    }
    Ok(found)
}

/// The rigid robot without its rotors: what goes through the gears.
fn link_side(robot: &Mechanism) -> Result<Model, flexarm_kinematics::ModelError> {
    let mut mechanism = robot.clone();
    mechanism.joints.iter_mut().for_each(|joint| joint.armature = 0.0);
    Model::new(&mechanism)
}

/// A recording without what is fast, with the torques through the gears.
struct Smooth {
    motor: Vec<Vec<f64>>,
    rate: Vec<Vec<f64>>,
    torque: Vec<Vec<f64>>,
    low: LowPass,
    seen: std::ops::Range<usize>,
}

impl Smooth {
    fn of(recording: &EncoderRecording, model: &Model) -> Result<Self, Error> {
        let EncoderRecording { step_s, below_hz, edge_s, .. } = *recording;
        let n = recording.motor[0].len();
        let edge = (edge_s / step_s).round() as usize;
        if below_hz <= 0.0 || below_hz >= 0.4 / step_s || n < 2 * edge + 3 {
            let text = format!(
                "{n} samples of {step_s} s: below = {below_hz} Hz must lie under two fifths of the sampling rate, and something must be \
                 left between the edges of {edge_s} s"
            );
            return Err(RobotFileError { message: text, ..recording.place.clone() }.into());
        }
        let low = LowPass::new(below_hz, 1.0 / step_s);
        let motor: Vec<Vec<f64>> = recording.motor.iter().map(|q| low.of(q)).collect();
        let rate: Vec<Vec<f64>> = motor.iter().map(|q| derivative(q, step_s)).collect();
        let acceleration: Vec<Vec<f64>> = rate.iter().map(|v| derivative(v, step_s)).collect();
        let m = motor.len();
        let (mut data, mut state, mut qddot) = (Data::new(model), State::zeros(model), DVector::zeros(m));
        let mut torque = vec![Vec::with_capacity(n); m];
        for i in 0..n {
            for k in 0..m {
                state.q[k] = motor[k][i];
                state.qdot[k] = rate[k][i];
                qddot[k] = acceleration[k][i];
            }
            inverse_dynamics(model, &mut data, &state, &qddot);
            (0..m).for_each(|k| torque[k].push(data.tau[k]));
        }
        let torque = torque.iter().map(|tau| low.of(tau)).collect();
        Ok(Self { motor, rate, torque, low, seen: edge..n - edge - 1 })
    }

    fn gear(&self, recording: &EncoderRecording, joint: usize) -> Option<GearRun> {
        let link = self.low.of(recording.link[joint].as_ref()?);
        let cut = |x: &[f64]| x[self.seen.clone()].to_vec();
        let deflection: Vec<f64> = self.motor[joint].iter().zip(&link).map(|(motor, link)| motor - link).collect();
        Some(GearRun { deflection: cut(&deflection), torque: cut(&self.torque[joint]), rate: cut(&self.rate[joint]) })
    }
}
