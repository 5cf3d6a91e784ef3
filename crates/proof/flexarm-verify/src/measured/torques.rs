//! Inverse dynamics along the recorded motor positions compared with the recorded torques.
//!
//! Torques at the joints (N m). Not here: smoothing of the recordings (`recording.rs`).

use flexarm::Robot;
use flexarm_kinematics::{Data, Model, State, inverse_dynamics};
use nalgebra::DVector;

use super::recording::{AXES, Recording, SMOOTH_HZ, STEP_S};
use crate::Error;
use flexarm_analysis::signal::{LowPass, least_squares, rms};

/// Speed scale of the smoothed sign of friction (rad/s).
pub(super) const SIGN_WIDTH: f64 = 0.004;

/// Model variants with one element left out.
pub(super) const VARIANTS: [(&str, Without); 3] = [
    ("whole model", Without { balancer: false, rotors: false }),
    ("without the counterbalance", Without { balancer: true, rotors: false }),
    ("without the rotors", Without { balancer: false, rotors: true }),
];

#[derive(Clone, Copy)]
pub(super) struct Without {
    balancer: bool,
    rotors: bool,
}

/// Friction of one axis: offset (N m), viscous (N m s/rad), Coulomb (N m).
pub(super) type Friction = [f64; 3];

/// Findings on the torques.
pub(super) struct Torques {
    /// Identified from run 1 with the whole model; the other variants use the same.
    pub(super) friction: Vec<Friction>,
    /// By variant and run: RMS of the difference over RMS of the torque per axis, while the axis
    /// moves.
    pub(super) errors: Vec<Vec<[f64; AXES]>>,
    /// Run 3: time (s), measured and computed torques of axes 1 to 3, smoothed (N m).
    pub(super) shown: TorqueCurves,
}

pub(super) struct TorqueCurves {
    pub(super) time_s: Vec<f64>,
    pub(super) measured: Vec<Vec<f64>>,
    pub(super) computed: Vec<Vec<f64>>,
}

impl Torques {
    pub(super) fn new(robot: &Robot, runs: &[Recording]) -> Result<Self, Error> {
        let (mut friction, mut errors, mut shown) = (Vec::new(), Vec::new(), None);
        for (k, (_, without)) in VARIANTS.into_iter().enumerate() {
            let model = model(robot, without)?;
            let bare: Vec<Vec<Vec<f64>>> = runs.iter().map(|run| torques(&model, run)).collect();
            if k == 0 {
                friction = fit(&runs[0], &bare[0]);
            }
            let full = runs.iter().zip(&bare).map(|(run, bare)| with_friction(run, bare, &friction));
            let full: Vec<Vec<Vec<f64>>> = full.collect();
            errors.push(runs.iter().zip(&full).map(|(run, full)| relative(run, full)).collect());
            if k == 0 {
                shown = runs.last().zip(full.last()).map(|(run, full)| shown_of(run, full));
            }
        }
        let shown = shown.unwrap_or(TorqueCurves { time_s: Vec::new(), measured: Vec::new(), computed: Vec::new() });
        Ok(Self { friction, errors, shown })
    }
}

/// The rigid robot with its payload.
fn model(robot: &Robot, without: Without) -> Result<Model, Error> {
    let mut robot = robot.clone();
    if without.balancer {
        robot.rigid.balancers.clear();
    }
    if without.rotors {
        robot.rigid.joints.iter_mut().for_each(|joint| joint.armature = 0.0);
    }
    Ok((*robot.rigid_model()?).clone())
}

/// Joint torques without friction, per axis (N m).
pub(super) fn torques(model: &Model, run: &Recording) -> Vec<Vec<f64>> {
    let (mut data, mut state) = (Data::new(model), State::zeros(model));
    let mut torques = vec![Vec::new(); AXES];
    for i in 0..run.time_s.len() {
        state.q.copy_from_slice(&run.at(&run.q, i));
        state.qdot.copy_from_slice(&run.at(&run.v, i));
        let a = DVector::from_vec(run.at(&run.a, i));
        let tau = inverse_dynamics(model, &mut data, &state, &a);
        torques.iter_mut().zip(tau.iter()).for_each(|(to, tau)| to.push(*tau));
    }
    torques
}

/// Columns of the friction fit: 1, velocity, smoothed sign of the velocity.
fn friction_columns(run: &Recording, axis: usize) -> [Vec<f64>; 3] {
    let sign: Vec<f64> = run.v[axis].iter().map(|v| (v / SIGN_WIDTH).tanh()).collect();
    [vec![1.0; sign.len()], run.v[axis].clone(), LowPass::new(SMOOTH_HZ, 1.0 / STEP_S).of(&sign)]
}

/// Fits the friction of every axis to the samples of one run in which it moves.
fn fit(run: &Recording, bare: &[Vec<f64>]) -> Vec<Friction> {
    let axis = |axis: usize| {
        let all = friction_columns(run, axis);
        let picked = |x: &[f64]| run.moving(axis).map(|i| x[i]).collect::<Vec<f64>>();
        let columns = all.map(|column| picked(&column));
        let left: Vec<f64> = run.smooth_torque[axis].iter().zip(&bare[axis]).map(|(tau, bare)| tau - bare).collect();
        let found = least_squares(&columns, &picked(&left)).unwrap_or_default();
        std::array::from_fn(|k| found.get(k).copied().unwrap_or(f64::NAN))
    };
    (0..AXES).map(axis).collect()
}

fn with_friction(run: &Recording, bare: &[Vec<f64>], friction: &[Friction]) -> Vec<Vec<f64>> {
    let axis = |axis: usize| {
        let [one, v, sign] = friction_columns(run, axis);
        let [offset, viscous, coulomb] = friction[axis];
        let sum = |i: usize| bare[axis][i] + offset * one[i] + viscous * v[i] + coulomb * sign[i];
        (0..bare[axis].len()).map(sum).collect()
    };
    (0..AXES).map(axis).collect()
}

/// RMS of the difference over RMS of the torque, while the axis moves.
fn relative(run: &Recording, computed: &[Vec<f64>]) -> [f64; AXES] {
    std::array::from_fn(|axis| {
        let (measured, computed) = (&run.smooth_torque[axis], &computed[axis]);
        rms(run.moving(axis).map(|i| measured[i] - computed[i])) / rms(run.moving(axis).map(|i| measured[i]))
    })
}

fn shown_of(run: &Recording, computed: &[Vec<f64>]) -> TorqueCurves {
    let compared = |x: &[f64]| x[run.compared()].to_vec();
    TorqueCurves {
        time_s: compared(&run.time_s),
        measured: run.smooth_torque.iter().take(3).map(|x| compared(x)).collect(),
        computed: computed.iter().take(3).map(|x| compared(x)).collect(),
    }
}
