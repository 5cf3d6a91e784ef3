//! Gear stiffness from recorded positions of motors and links: torques of the rigid robot along the
//! motion of its links, filters, and the reading for the fit.
//!
//! Start at [`encoder_figures`]: gears that share motors are estimated together ([`Gears`]), each
//! recording is filtered once ([`Smooth`]). Not here: the regression ([`crate::gear_stiffness`]).

use flexarm_analysis::signal::LowPass;
use flexarm_kinematics::{Data, Mechanism, Model, State, inverse_dynamics};
use flexarm_run::{Arm, Error};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::error::at_place;
use super::file::{EncoderRecording, MeasurementInput};
use super::parameters::{Candidate, ParameterLocation, candidates};
use crate::estimation::{GearEstimate, GearOutput, Parameter, Reading, ReadingKind, gear_stiffness};

/// Result for one gear from recordings. SI units.
#[derive(Clone, Debug, Serialize)]
pub struct EncoderFigures {
    /// Name of the joint.
    pub joint: String,
    /// Stiffness (N m/rad, N/m).
    pub stiffness: f64,
    /// Standard deviation of the stiffness: by leaving out seconds of the recordings, and of what the
    /// torque does not explain beyond the noise.
    pub std: f64,
    /// Delay of the link's encoder (s).
    pub delay_s: f64,
    /// Share of the deflection, without offsets and delay, that the torque explains (R²).
    pub r2: f64,
    /// R² of each run predicted from the others (of each half if there is one run).
    pub unseen_r2: Vec<f64>,
    /// Stiffness estimated without each run.
    pub without_each: Vec<f64>,
    /// RMS of the deflection without offsets and delay (rad, m).
    pub deflection_rms: f64,
    /// RMS of the unexplained deflection (rad, m).
    pub rest_rms: f64,
    /// RMS of the noise of both encoders below the cut-off frequency, extrapolated from the noise
    /// at higher frequencies (rad, m).
    pub noise_rms: f64,
    /// Sampling interval of each run, or of each half of a single run (s).
    #[serde(skip)]
    pub steps_s: Vec<f64>,
    /// Deflection of each run without offset and delay, and the deflection that the torque predicts
    /// (rad, m).
    #[serde(skip)]
    pub curves: Vec<[Vec<f64>; 2]>,
    /// Whether the recordings determine the stiffness ([`GearEstimate::is_determined`]).
    pub told: bool,
    /// Name of the parameter.
    #[serde(skip)]
    parameter: String,
    /// Initial value of the parameter.
    #[serde(skip)]
    initial: f64,
}

impl EncoderFigures {
    fn of(joint: &str, gear: GearEstimate, parameter: &Parameter, noise_rms: f64, steps_s: &[f64]) -> Self {
        Self {
            noise_rms,
            // A single run is split into two halves.
            steps_s: if steps_s.len() == 1 { vec![steps_s[0]; gear.curves.len()] } else { steps_s.to_vec() },
            joint: joint.to_owned(),
            stiffness: gear.stiffness,
            std: gear.std_ln.hypot(unexplained(&gear, noise_rms)) * gear.stiffness.abs(),
            delay_s: gear.delay_s,
            r2: gear.r2,
            told: gear.is_determined(),
            curves: gear.curves,
            unseen_r2: gear.unseen_r2,
            without_each: gear.without_each,
            deflection_rms: gear.deflection_rms,
            rest_rms: gear.rest_rms,
            parameter: parameter.name.clone(),
            initial: parameter.initial,
        }
    }

    /// Returns the reading for the fit if the recordings determine the stiffness.
    pub(super) fn reading(&self) -> Option<Reading> {
        let kind = ReadingKind::Known {
            parameter: self.parameter.clone(),
            value: (self.stiffness / self.initial).ln(),
            std: self.std / self.stiffness,
        };
        self.told.then(|| Reading { name: format!("encoders of {}", self.joint), q: Vec::new(), kind })
    }
}

/// Returns the relative standard deviation of a compliance due to the deflection that neither torque
/// nor noise explains: its correlation with the torque is unknown, evenly spread within ±1.
fn unexplained(gear: &GearEstimate, noise_rms: f64) -> f64 {
    let rest = (gear.rest_rms.powi(2) - noise_rms.powi(2)).max(0.0).sqrt();
    if gear.deflection_rms > 0.0 { rest / (gear.deflection_rms * 3f64.sqrt()) } else { 0.0 }
}

/// Estimates the stiffness of each gear with an encoder on its link side.
pub(super) fn encoder_figures(
    arm: &Arm,
    input: &MeasurementInput,
    chosen: &[Candidate],
) -> Result<Vec<EncoderFigures>, Error> {
    if input.recordings.is_empty() {
        return Ok(Vec::new());
    }
    let model = link_side(&arm.robot().rigid)
        .map_err(|source| Error::Model { path: arm.robot().urdf_path.clone(), source: Box::new(source) })?;
    let joints: Vec<String> = arm.joints().map(str::to_owned).collect();
    let coupling = arm.robot().coupling.as_ref();
    let is_coupled = |joint: &String| coupling.is_some_and(|coupling| coupling.joints.contains(joint));
    let all = candidates(arm.robot(), arm);
    // Joints without an encoder deflect with the stiffness of the robot file.
    let filed = |joint: &String| gearbox_of(&all, joint).filter(|_| !is_coupled(joint)).map(|p| p.initial);
    let filed: Vec<Option<f64>> = joints.iter().map(filed).collect();
    let runs = input.recordings.iter().map(|recording| Smooth::of(recording, &model, &filed));
    let runs = runs.collect::<Result<Vec<_>, Error>>()?;
    // One fit per gear; coupled gears are fitted together.
    let single = joints.iter().filter(|joint| !is_coupled(joint)).map(|joint| {
        let C = DMatrix::from_element(1, 1, 1.0);
        Gears::of(&runs, &joints, (std::slice::from_ref(joint), C), chosen, &all)
    });
    let coupled = coupling.map(|own| Gears::of(&runs, &joints, (&own.joints, own.C.clone()), chosen, &all));
    let mut found = Vec::new();
    for gears in single.chain(coupled) {
        if let Some(gears) = gears? {
            found.extend(gears.figures()?);
        }
    }
    Ok(found)
}

/// Returns the sampling intervals of the recordings that have an encoder on the link side of a
/// joint (s).
fn steps(runs: &[Smooth<'_>], joint: usize) -> Vec<f64> {
    runs.iter().filter(|run| run.recording.link[joint].is_some()).map(|run| run.recording.step_s).collect()
}

/// Returns the RMS of the noise of a gear's encoders in the passband.
fn noise(runs: &[Smooth<'_>], joint: usize) -> f64 {
    let squares: Vec<f64> = runs.iter().filter_map(|run| run.noise_square(joint)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Returns the parameter for a gearbox with one stiffness.
fn gearbox_of<'a>(of: &'a [Candidate], joint: &str) -> Option<&'a Parameter> {
    let is_it =
        |c: &&Candidate| matches!(&c.written, ParameterLocation::Gearbox { joint: own, entry: None } if own == joint);
    of.iter().find(is_it).map(|c| &c.parameter)
}

/// Recordings of gears whose motors move joints together; of one gear where they do not.
struct Gears<'a> {
    runs: &'a [Smooth<'a>],
    joints: &'a [String],
    /// Joint per motor angle behind the gears.
    C: DMatrix<f64>,
    /// Parameters of all springs, with the stiffness of the robot file.
    all: &'a [Candidate],
    /// These joints in the robot's order of joints.
    places: Vec<usize>,
    /// Joints with an encoder on the link side.
    outputs: Vec<usize>,
    /// Motors whose springs are to be identified.
    unknown: Vec<(usize, &'a Parameter)>,
}

impl<'a> Gears<'a> {
    /// Returns what the recordings show of some gears; `None` without an encoder on their link sides.
    fn of(
        runs: &'a [Smooth<'a>],
        of_robot: &[String],
        (joints, C): (&'a [String], DMatrix<f64>),
        chosen: &'a [Candidate],
        all: &'a [Candidate],
    ) -> Result<Option<Self>, Error> {
        // Gears with an encoder on the link side; coupled ones need it in all recordings.
        let place = |joint: &String| of_robot.iter().position(|own| own == joint);
        let places: Vec<usize> = joints.iter().filter_map(place).collect();
        let has = |run: &Smooth<'_>, k: usize| run.recording.link[places[k]].is_some();
        let outputs: Vec<usize> = (0..places.len()).filter(|k| runs.iter().any(|r| has(r, *k))).collect();
        if outputs.is_empty() {
            return Ok(None);
        }
        let file = &runs[0].recording.place;
        let missing = |k: &&usize| joints.len() > 1 && !runs.iter().all(|r| has(r, **k));
        if let Some(k) = outputs.iter().find(missing) {
            let text = format!(
                "joint {:?} has coupled gears, and only some recordings contain its encoder: give it in all of them",
                joints[*k]
            );
            return Err(at_place(file, text));
        }
        // Motors whose springs deflect one of these encoders.
        let shown = |motor: &usize| outputs.iter().any(|i| C[(*i, *motor)] != 0.0);
        let unknown: Vec<(usize, &Parameter)> = (0..places.len())
            .filter(shown)
            .filter_map(|motor| Some((motor, gearbox_of(chosen, &joints[motor])?)))
            .collect();
        if unknown.is_empty() {
            let names: Vec<&String> = outputs.iter().map(|k| &joints[*k]).collect();
            let text = format!("{names:?} have encoders, but no gearbox with a single stiffness to fit");
            return Err(at_place(file, text));
        }
        Ok(Some(Self { runs, joints, C, all, places, outputs, unknown }))
    }

    /// Returns the deflection of a joint per compliance of a motor's spring, `C_im Σ_j C_jm τ_j`,
    /// over time.
    fn per_compliance(&self, run: &Smooth<'_>, torque: &[Vec<f64>], i: usize, motor: usize) -> Vec<f64> {
        let C = &self.C;
        let motor_torque =
            |s: usize| self.places.iter().enumerate().map(|(j, k)| C[(j, motor)] * torque[*k][s]).sum::<f64>();
        run.kept.clone().map(|s| C[(i, motor)] * motor_torque(s)).collect()
    }

    /// Returns the deflection of a joint that the springs to be identified cause. Springs that are
    /// not to be identified keep the stiffness of the robot file; rigid gears do not deflect.
    fn output(&self, run: &Smooth<'_>, i: usize) -> Option<GearOutput> {
        let mut gear = run.gear(self.places[i])?;
        let is_unknown = |motor: usize| self.unknown.iter().any(|(own, _)| *own == motor);
        for motor in (0..self.places.len()).filter(|motor| !is_unknown(*motor)) {
            let Some(known) = gearbox_of(self.all, &self.joints[motor]) else { continue };
            let part = self.per_compliance(run, &run.torque, i, motor);
            gear.deflection.iter_mut().zip(part).for_each(|(d, torque)| *d -= torque / known.initial);
        }
        let parts = |torque: &[Vec<f64>]| {
            self.unknown.iter().map(|(motor, _)| self.per_compliance(run, torque, i, *motor)).collect()
        };
        Some(GearOutput { torques: parts(&run.torque), instruments: parts(&run.instrument), ..gear })
    }

    /// Estimates the springs of the motors.
    fn figures(&self) -> Result<Vec<EncoderFigures>, Error> {
        let of_run = |run: &Smooth<'_>| self.outputs.iter().map(|i| self.output(run, *i)).collect();
        let all_runs: Vec<Vec<GearOutput>> = self.runs.iter().filter_map(of_run).collect();
        let name = |motor: usize| &self.joints[motor];
        let gears = gear_stiffness(&all_runs).ok_or_else(|| {
            let names: Vec<&String> = self.unknown.iter().map(|(motor, _)| name(*motor)).collect();
            let text = format!(
                "the recordings do not determine the gears of {names:?}: they are too short (minimum 2 s), or the \
                 torques are constant or proportional; record more encoders, or keep some of these stiffnesses"
            );
            at_place(&self.runs[0].recording.place, text)
        })?;
        let squares = self.outputs.iter().map(|k| noise(self.runs, self.places[*k]).powi(2));
        let noise = (squares.sum::<f64>() / self.outputs.len() as f64).sqrt();
        let steps = steps(self.runs, self.places[self.outputs[0]]);
        let figure = |((motor, parameter), gear): (&(usize, &Parameter), GearEstimate)| {
            EncoderFigures::of(name(*motor), gear, parameter, noise, &steps)
        };
        Ok(self.unknown.iter().zip(gears).map(figure).collect())
    }
}

/// Returns the rigid robot without its rotors; its inverse dynamics give the torques through the
/// gears.
fn link_side(robot: &Mechanism) -> Result<Model, flexarm_kinematics::ModelError> {
    let mut mechanism = robot.clone();
    mechanism.joints.iter_mut().for_each(|joint| joint.armature = 0.0);
    Model::new(&mechanism)
}

/// Low-pass filtered recording with the torques through the gears. Compared signals pass the filter
/// twice: the torque of a filtered motion is filtered again, because its products of velocities
/// contain higher frequencies.
struct Smooth<'a> {
    recording: &'a EncoderRecording,
    rate: Vec<Vec<f64>>,
    torque: Vec<Vec<f64>>,
    /// Measured torque, or the torque computed from the motion of the motors, which is independent
    /// of the noise of the links' encoders.
    instrument: Vec<Vec<f64>>,
    low: LowPass,
    /// Samples between the edges.
    kept: std::ops::Range<usize>,
}

impl<'a> Smooth<'a> {
    /// Filters a recording, and computes its torques.
    ///
    /// * `filed`: stiffness of each joint's gearbox in the robot file.
    fn of(recording: &'a EncoderRecording, model: &Model, filed: &[Option<f64>]) -> Result<Self, Error> {
        // The filter needs a cut-off below the sampling rate, and samples between both edges.
        let EncoderRecording { step_s, below_hz, edge_s, .. } = *recording;
        let n = recording.motor[0].len();
        let edge = (edge_s / step_s).round() as usize;
        if below_hz <= 0.0 || below_hz >= 0.4 / step_s || n < 2 * edge + 3 {
            let text = format!(
                "{n} samples of {step_s} s: below = {below_hz} Hz must be less than 0.4 times the sampling rate, and \
                 the recording must be longer than two edges of {edge_s} s"
            );
            return Err(at_place(&recording.place, text));
        }
        let low = LowPass::new(below_hz, 1.0 / step_s);
        let motor: Vec<Vec<f64>> = recording.motor.iter().map(|q| low.of(q)).collect();
        // Link positions by their encoders, without the offset between the two encoders.
        let link = motor.iter().zip(&recording.link).map(|(motor, link)| {
            let Some(link) = link else { return motor.clone() };
            let link = low.of(link);
            let offset = motor.iter().zip(&link).map(|(motor, link)| motor - link).sum::<f64>() / n as f64;
            link.iter().map(|link| link + offset).collect()
        });
        let mut link: Vec<Vec<f64>> = link.collect();
        // A gear without an encoder deflects with the stiffness of the robot file.
        let rough = torques(model, &link, step_s);
        for (k, stiffness) in filed.iter().enumerate() {
            if let (Some(stiffness), None) = (stiffness, &recording.link[k]) {
                let twist = low.of(&rough[k]);
                link[k].iter_mut().zip(twist).for_each(|(link, torque)| *link -= torque / stiffness);
            }
        }
        // Torques along the motion of the links, and along that of the motors as instruments.
        let smoothed = |torque: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            let measured = |(computed, own): (Vec<f64>, &Option<Vec<f64>>)| match own {
                Some(own) => low.of(&low.of(own)),
                None => low.of(&computed),
            };
            torque.into_iter().zip(&recording.torque).map(measured).collect()
        };
        let [torque, instrument] = [&link, &motor].map(|motion| smoothed(torques(model, motion, step_s)));
        let rate = motor.iter().map(|q| low.of(&derivatives(q, step_s)[0])).collect();
        Ok(Self { recording, rate, torque, instrument, low, kept: edge..n - edge - 1 })
    }

    /// Returns deflection and velocity of a joint with an encoder on its link side, without torques.
    fn gear(&self, joint: usize) -> Option<GearOutput> {
        let link = self.recording.link[joint].as_ref()?;
        let cut = |x: &[f64]| x[self.kept.clone()].to_vec();
        let deflection: Vec<f64> =
            self.recording.motor[joint].iter().zip(link).map(|(motor, link)| motor - link).collect();
        let deflection = self.low.of(&self.low.of(&deflection));
        Some(GearOutput {
            deflection_rate: cut(&derivatives(&deflection, self.recording.step_s)[0]),
            deflection: cut(&deflection),
            rate: cut(&self.rate[joint]),
            torques: Vec::new(),
            instruments: Vec::new(),
        })
    }

    /// Returns the mean square of the white noise of both encoders in the passband, estimated from
    /// fifth differences, which suppress the slow motion and the vibration of the arm.
    fn noise_square(&self, joint: usize) -> Option<f64> {
        let link = self.recording.link[joint].as_ref()?;
        let mut x: Vec<f64> = self.recording.motor[joint].iter().zip(link).map(|(motor, link)| motor - link).collect();
        for _ in 0..5 {
            x = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        }
        // 252 is the sum of the squared binomial coefficients.
        let white = x.iter().map(|x| x * x).sum::<f64>() / (252.0 * x.len().max(1) as f64);
        Some(white * (2.0 * self.recording.below_hz * self.recording.step_s).min(1.0))
    }
}

/// Computes the torques of the rigid robot along a motion (N m or N), one list per joint.
///
/// * `motion`: joint positions (rad or m), one list per joint; `step_s`: their sampling interval.
fn torques(model: &Model, motion: &[Vec<f64>], step_s: f64) -> Vec<Vec<f64>> {
    let (m, n) = (motion.len(), motion[0].len());
    let rates: Vec<[Vec<f64>; 2]> = motion.iter().map(|q| derivatives(q, step_s)).collect();
    let (mut data, mut state, mut qddot) = (Data::new(model), State::zeros(model), DVector::zeros(m));
    let mut torque = vec![Vec::with_capacity(n); m];
    for i in 0..n {
        for k in 0..m {
            state.q[k] = motion[k][i];
            state.qdot[k] = rates[k][0][i];
            qddot[k] = rates[k][1][i];
        }
        inverse_dynamics(model, &mut data, &state, &qddot);
        (0..m).for_each(|k| torque[k].push(data.tau[k]));
    }
    torque
}

/// Computes first and second derivatives by central differences of fourth order. Beyond its ends
/// the signal is constant.
fn derivatives(x: &[f64], step_s: f64) -> [Vec<f64>; 2] {
    let at = |i: usize, by: isize| x[i.saturating_add_signed(by).min(x.len() - 1)];
    let n = 0..x.len();
    let first = |i| (8.0 * (at(i, 1) - at(i, -1)) - (at(i, 2) - at(i, -2))) / (12.0 * step_s);
    let second =
        |i| (16.0 * (at(i, 1) + at(i, -1)) - (at(i, 2) + at(i, -2)) - 30.0 * at(i, 0)) / (12.0 * step_s * step_s);
    [n.clone().map(first).collect(), n.map(second).collect()]
}
