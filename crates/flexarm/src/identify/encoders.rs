//! Gears from recorded positions of motors and links: torques of the rigid robot along the motion, filters, the fit's reading.

use flexarm_analysis::signal::{LowPass, derivative};
use flexarm_identify::{
    CoupledOutput, GearEstimate, GearRun, Parameter, Reading, ReadingKind, coupled_gear_stiffness, gear_stiffness,
};
use flexarm_kinematics::{Data, Mechanism, Model, State, inverse_dynamics};
use nalgebra::DVector;
use serde::Serialize;

use super::file::{EncoderRecording, MeasurementInput};
use super::parameters::{Candidate, Written, candidates};
use crate::arm::Arm;
use crate::error::Error;
use crate::gear_entry::RobotCoupling;
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
    fn of(joint: &str, gear: GearEstimate, parameter: &Parameter) -> Self {
        Self {
            joint: joint.to_owned(),
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
        }
    }

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
    let coupling = arm.robot().coupling();
    let is_coupled = |joint: &String| coupling.is_some_and(|coupling| coupling.joints.contains(joint));
    let mut found = Vec::new();
    for (k, joint) in joints.iter().enumerate() {
        if is_coupled(joint) {
            continue;
        }
        let own: Vec<GearRun> =
            runs.iter().zip(&input.recordings).filter_map(|(run, recording)| run.gear(recording, k)).collect();
        if own.is_empty() {
            continue;
        }
        let Some(parameter) = gearbox_of(chosen, joint) else {
            let text = format!("joint {joint:?} has an encoder, but no gearbox with one stiffness that is to be found");
            return Err(RobotFileError { message: text, ..first.place.clone() }.into());
        };
        let Some(gear) = gear_stiffness(&own) else {
            let text =
                format!("joint {joint:?}: the recordings are too short (2 s at least), or its torque does not change");
            return Err(RobotFileError { message: text, ..first.place.clone() }.into());
        };
        found.push(EncoderFigures::of(joint, gear, parameter));
    }
    if let Some(coupling) = coupling {
        let recorded = Recorded { runs: &runs, recordings: &input.recordings, joints: &joints };
        let all = candidates(arm.robot(), arm.flexible());
        let fail = |message: String| RobotFileError { message, ..first.place.clone() };
        found.extend(told_of_coupled(&recorded, coupling, chosen, &all).map_err(fail)?);
    }
    Ok(found)
}

/// The one stiffness of a joint's gearbox.
fn gearbox_of<'a>(of: &'a [Candidate], joint: &str) -> Option<&'a Parameter> {
    let is_it = |c: &&Candidate| matches!(&c.written, Written::Gearbox { joint: own, entry: None } if own == joint);
    of.iter().find(is_it).map(|c| &c.parameter)
}

/// Recordings in the robot's order of joints.
struct Recorded<'a> {
    runs: &'a [Smooth],
    recordings: &'a [EncoderRecording],
    joints: &'a [String],
}

/// Springs of motors that move several joints. Those that are not to be found have the stiffness of the robot file.
fn told_of_coupled(
    recorded: &Recorded<'_>,
    coupling: &RobotCoupling,
    chosen: &[Candidate],
    all: &[Candidate],
) -> Result<Vec<EncoderFigures>, String> {
    let Recorded { runs, recordings, joints } = recorded;
    let place = |joint: &String| joints.iter().position(|own| own == joint);
    let places: Vec<usize> = coupling.joints.iter().filter_map(place).collect();
    let has = |recording: &EncoderRecording, k: usize| recording.link[places[k]].is_some();
    let seen: Vec<usize> = (0..places.len()).filter(|k| recordings.iter().any(|r| has(r, *k))).collect();
    if seen.is_empty() {
        return Ok(Vec::new());
    }
    if let Some(k) = seen.iter().find(|k| !recordings.iter().all(|r| has(r, **k))) {
        let joint = &coupling.joints[*k];
        return Err(format!(
            "joint {joint:?} has coupled gears and an encoder in some recordings only: give it in all of them"
        ));
    }
    let shown = |motor: &usize| seen.iter().any(|i| coupling.C[(*i, *motor)] != 0.0);
    let unknown: Vec<(usize, &Parameter)> = (0..places.len())
        .filter(shown)
        .filter_map(|motor| Some((motor, gearbox_of(chosen, &coupling.joints[motor])?)))
        .collect();
    if unknown.is_empty() {
        let names: Vec<&String> = seen.iter().map(|k| &coupling.joints[*k]).collect();
        return Err(format!("joints {names:?} have encoders, but none of the gearboxes that they show is to be found"));
    }
    let is_unknown = |motor: usize| unknown.iter().any(|(own, _)| *own == motor);
    let outputs = |(run, recording): (&Smooth, &EncoderRecording)| -> Option<Vec<CoupledOutput>> {
        let one = |i: &usize| {
            let mut gear = run.gear(recording, places[*i])?;
            let part = |motor: usize| -> Vec<f64> {
                let of = |s: usize| {
                    places.iter().enumerate().map(|(j, k)| coupling.C[(j, motor)] * run.torque[*k][s]).sum::<f64>()
                };
                run.seen.clone().map(|s| coupling.C[(*i, motor)] * of(s)).collect()
            };
            for motor in (0..places.len()).filter(|motor| !is_unknown(*motor)) {
                // A gear that is kept deflects by what the robot file says; a rigid one does not.
                let Some(known) = gearbox_of(all, &coupling.joints[motor]) else { continue };
                gear.deflection.iter_mut().zip(part(motor)).for_each(|(d, torque)| *d -= torque / known.initial);
            }
            let torques = unknown.iter().map(|(motor, _)| part(*motor)).collect();
            Some(CoupledOutput { deflection: gear.deflection, rate: gear.rate, torques })
        };
        seen.iter().map(one).collect()
    };
    let all_runs: Vec<Vec<CoupledOutput>> = runs.iter().zip(*recordings).filter_map(outputs).collect();
    let names = || unknown.iter().map(|(motor, _)| &coupling.joints[*motor]).collect::<Vec<_>>();
    let gears = coupled_gear_stiffness(&all_runs).ok_or_else(|| {
        format!(
            "the recordings do not tell the coupled gears of {:?} apart: too short (2 s at least), torques that do not change or go together; \
             record more encoders, or keep some of these stiffnesses",
            names()
        )
    })?;
    let figures = unknown.iter().zip(gears);
    Ok(figures
        .map(|((motor, parameter), gear)| EncoderFigures::of(&coupling.joints[*motor], gear, parameter))
        .collect())
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
