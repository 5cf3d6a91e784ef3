//! Gear deflection in a simulation along the recorded motor positions, compared with motor minus
//! link encoder.

use std::sync::Arc;

use flexarm::{DriveModel, LinkModel, Modelling, Motion, Robot};
use flexarm_stepping::{Held, Observation, Plant, Start, new_stepper};

use super::recording::{AXES, Recording, STEP_S, WITH_ENCODER};
use crate::Error;
use crate::bench::{ALPHA, step_error};
use flexarm_analysis::signal::{LowPass, delayed, least_squares, rest, rms};

/// Delay of the recorded link encoder positions relative to those of the motor (s).
pub(super) const LATE_S: f64 = 3.0e-3;
/// Upper limit of the compared frequency band (Hz).
pub(super) const COMPARED_HZ: f64 = 12.0;
/// Periods of the link encoder ripple per turn, axes 1 to 3, and offsets of the side lines caused
/// by the mounting of the encoder.
pub(super) const RIPPLE: [f64; WITH_ENCODER] = [1010.0, 826.0, 678.0];
const LINES: [f64; 7] = [-12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 12.0];
/// Elastic gears, with the motors following the motion.
const ELASTIC: Modelling =
    Modelling { links: LinkModel::AsFiled, segments: None, modes: None, drives: DriveModel::Elastic };
/// Simulation steps per sample.
const STEPS: usize = 4;

/// Residual of the measured deflection of one axis, RMS over all runs (rad).
#[derive(Clone, Copy)]
pub(super) struct Rest {
    /// Rigid gear, with a free offset per run.
    pub(super) rigid: f64,
    /// With the simulated deflection subtracted.
    pub(super) spring: f64,
    /// Then with the encoder ripple free as well.
    pub(super) ripple: f64,
    /// Then with one term of encoder eccentricity per turn free as well.
    pub(super) eccentricity: f64,
}

pub(super) struct Gears {
    pub(super) rests: Vec<Rest>,
    /// Stiffness of the springs (N m/rad).
    pub(super) stiffness: Vec<f64>,
    /// Axes 2 and 3 in run 2: time (s), measured and simulated deflection without their means,
    /// encoder errors removed (rad).
    pub(super) time_s: Vec<f64>,
    pub(super) measured: Vec<Vec<f64>>,
    pub(super) simulated: Vec<Vec<f64>>,
}

/// Run shown in the picture.
pub(super) const SHOWN: usize = 2;

impl Gears {
    pub(super) fn new(robot: &Robot, runs: &[Recording]) -> Result<Self, Error> {
        let bends: Vec<Vec<Vec<f64>>> = runs.iter().map(|run| simulated(robot, run)).collect::<Result<_, _>>()?;
        let mut gears = Self {
            rests: Vec::new(),
            stiffness: stiffness(robot)?,
            time_s: runs[SHOWN - 1].compared().map(|i| runs[SHOWN - 1].time_s[i]).collect(),
            measured: Vec::new(),
            simulated: Vec::new(),
        };
        for axis in 0..WITH_ENCODER {
            let stack = Stack::new(runs, &bends, axis);
            gears.rests.push(stack.rests());
            let (measured, simulated) = stack.shown();
            gears.measured.push(measured);
            gears.simulated.push(simulated);
        }
        Ok(gears)
    }
}

/// Stiffness about the axis, for the gears with a link encoder (N m/rad).
fn stiffness(robot: &Robot) -> Result<Vec<f64>, Error> {
    let plant = robot.model(&ELASTIC)?.plant(Arc::new(Held(vec![0.0; AXES]))).map_err(step_error)?;
    Ok(plant.elements.iter().map(|element| element.K[(0, 0)]).take(WITH_ENCODER).collect())
}

/// The arm with elastic gears, its motors following the smoothed recorded positions.
pub(super) fn arm_along(robot: &Robot, run: &Recording) -> Result<Plant, Error> {
    let rows: Vec<f64> = (0..run.time_s.len()).flat_map(|i| run.at(&run.q, i)).collect();
    let motion = Motion::from_samples(&run.time_s, &rows, robot)?;
    robot.model(&ELASTIC)?.plant(motion.prescribed()).map_err(step_error)
}

/// Motor minus link position of each gear with an encoder, at every sample (rad).
fn simulated(robot: &Robot, run: &Recording) -> Result<Vec<Vec<f64>>, Error> {
    let plant = arm_along(robot, run)?;
    let first = plant.model.n_actuated();
    let mut observed = Observation::new(&plant);
    let mut stepper = new_stepper(ALPHA, plant, STEP_S / STEPS as f64, Start::Equilibrium).map_err(step_error)?;
    let mut bends = vec![Vec::new(); WITH_ENCODER];
    for sample in 0..run.time_s.len() {
        if sample > 0 {
            for _ in 0..STEPS {
                stepper.step().map_err(step_error)?;
            }
        }
        stepper.observe(&mut observed);
        // The spring coordinate is link minus motor.
        bends.iter_mut().enumerate().for_each(|(axis, bends)| bends.push(-observed.q[first + axis]));
    }
    Ok(bends)
}

/// Compared samples of one axis, all runs concatenated.
struct Stack {
    measured: Vec<f64>,
    simulated: Vec<f64>,
    /// One column per run: 1 in that run, 0 in the others.
    offsets: Vec<Vec<f64>>,
    ripple: Vec<Vec<f64>>,
    eccentricity: Vec<Vec<f64>>,
    /// Range of samples of the run that is shown.
    shown: std::ops::Range<usize>,
}

impl Stack {
    fn new(runs: &[Recording], bends: &[Vec<Vec<f64>>], axis: usize) -> Self {
        let low = LowPass::new(COMPARED_HZ, 1.0 / STEP_S);
        let stacked = |of: &dyn Fn(&Recording, usize) -> Vec<f64>| -> Vec<f64> {
            let part = |(k, run): (usize, &Recording)| low.of(&of(run, k))[run.compared()].to_vec();
            runs.iter().enumerate().flat_map(part).collect()
        };
        let counts: Vec<usize> = runs.iter().map(|run| run.compared().len()).collect();
        let offset = |own: usize| {
            let part = |(k, n): (usize, &usize)| vec![f64::from(u8::from(k == own)); *n];
            counts.iter().enumerate().flat_map(part).collect()
        };
        let wave = |of: fn(f64) -> f64, times: f64| {
            stacked(&|run: &Recording, _| run.link[axis].iter().map(|q| of(times * q)).collect())
        };
        let lines = LINES.iter().flat_map(|line| [(f64::sin as fn(f64) -> f64, *line), (f64::cos, *line)]);
        let before: usize = counts[..SHOWN - 1].iter().sum();
        Self {
            measured: stacked(&|run: &Recording, _| {
                let motor = delayed(&run.motor[axis], LATE_S, STEP_S);
                motor.iter().zip(&run.link[axis]).map(|(motor, link)| motor - link).collect()
            }),
            simulated: stacked(&|_: &Recording, k| delayed(&bends[k][axis], LATE_S, STEP_S)),
            offsets: (0..runs.len()).map(offset).collect(),
            ripple: lines.map(|(of, line)| wave(of, RIPPLE[axis] + line)).collect(),
            eccentricity: vec![wave(f64::sin, 1.0), wave(f64::cos, 1.0)],
            shown: before..before + counts[SHOWN - 1],
        }
    }

    /// Residual of measured minus simulated deflection after a least-squares fit of these columns.
    fn left(&self, columns: &[Vec<f64>]) -> Vec<f64> {
        let less: Vec<f64> = self.measured.iter().zip(&self.simulated).map(|(a, b)| a - b).collect();
        let factors = least_squares(columns, &less).unwrap_or_else(|| vec![f64::NAN; columns.len()]);
        rest(columns, &factors, &less)
    }

    fn rests(&self) -> Rest {
        let with = |more: &[&[Vec<f64>]]| [&self.offsets[..], &more.concat()].concat();
        let free = least_squares(&self.offsets, &self.measured).unwrap_or_default();
        Rest {
            rigid: rms(rest(&self.offsets, &free, &self.measured).into_iter()),
            spring: rms(self.left(&self.offsets).into_iter()),
            ripple: rms(self.left(&with(&[&self.ripple])).into_iter()),
            eccentricity: rms(self.left(&with(&[&self.ripple, &self.eccentricity])).into_iter()),
        }
    }

    /// Measured deflection with encoder errors removed, and simulated deflection, both without
    /// their means.
    fn shown(&self) -> (Vec<f64>, Vec<f64>) {
        let columns = [&self.offsets[..], &self.ripple, &self.eccentricity].concat();
        let left = self.left(&columns);
        let centred = |x: Vec<f64>| {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            x.into_iter().map(|x| x - mean).collect::<Vec<f64>>()
        };
        let simulated = self.simulated[self.shown.clone()].to_vec();
        let measured = simulated.iter().zip(&left[self.shown.clone()]).map(|(bend, left)| bend + left).collect();
        (centred(measured), centred(simulated))
    }
}
