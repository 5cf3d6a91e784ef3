//! Observable quantities of a stepper: state, poses, forces, energies, powers.
//!
//! Poses are in the world; forces and powers have the sign of what acts on the arm, dissipation is
//! positive. Steppers in reduced coordinates share [`observe_reduced`]. Not here: the TCP error
//! (`flexarm-run`).

use std::sync::Arc;

use flexarm_kinematics::{Model, Pose};
use nalgebra::{DVector, Vector6};

use crate::dense::dot;
use crate::plant::Plant;
use crate::reduced::ReducedArm;

/// Observable quantities of a stepper at its current time.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Time (s).
    pub t: f64,
    /// Model, with the inertias of this time.
    pub model: Arc<Model>,
    /// All coordinates, actuated then elastic.
    pub q: DVector<f64>,
    /// Their velocities.
    pub qdot: DVector<f64>,
    /// Their accelerations; NaN if the stepper has none.
    pub qddot: DVector<f64>,
    /// Poses of all bodies in the world.
    pub X_WB: Vec<Pose>,
    /// Torques or forces of the drives, per actuated coordinate.
    pub drive: DVector<f64>,
    /// Generalised elastic load per element: force of spring and damper on the distal part. For
    /// modal bodies the first six coordinates, for single springs the first component.
    pub load: Vec<Vector6<f64>>,
    /// Kinetic, gravitational and elastic energy (J).
    pub energy: [f64; 3],
    /// Power of the drives, power of the external loads, and power dissipated by dampers and
    /// friction (W).
    pub power: [f64; 3],
    /// Work done so far by the drives at velocity jumps of the motion (J); not in their power,
    /// which contains no impulses.
    pub impulse_work: f64,
    /// Energy dissipated so far by hysteresis of gears (J); not in the power, because it is
    /// rate-independent.
    pub hysteresis_work: f64,
}

impl Observation {
    /// Allocates an observation for the arm.
    pub fn new(plant: &Plant) -> Self {
        let model = &plant.model;
        Self {
            t: 0.0,
            model: model.clone(),
            q: DVector::zeros(model.nv()),
            qdot: DVector::zeros(model.nv()),
            qddot: DVector::zeros(model.nv()),
            X_WB: vec![Pose::identity(); model.bodies().len()],
            drive: DVector::zeros(model.n_actuated()),
            load: vec![Vector6::zeros(); plant.elements.len()],
            energy: [0.0; 3],
            power: [0.0; 3],
            impulse_work: 0.0,
            hysteresis_work: 0.0,
        }
    }
}

/// Fills an observation from the reduced arm.
pub(crate) fn observe_reduced(
    system: &mut ReducedArm,
    t: f64,
    x: &DVector<f64>,
    v: &DVector<f64>,
    a: &DVector<f64>,
    out: &mut Observation,
) {
    let [kinetic, potential] = system.observe(t, x, v, a, &mut out.X_WB);
    let (plant, data, state) = (&*system.plant, &system.data, &system.state);
    let (n, driven) = (plant.model.n_actuated(), &plant.torque_driven);
    let (e, rates) = (&x.as_slice()[driven.len()..], &v.as_slice()[driven.len()..]);
    out.t = t;
    out.model.clone_from(&plant.model);
    out.q.copy_from(&state.q);
    out.qdot.copy_from(&state.qdot);
    out.qddot.copy_from(&system.qddot);

    // Drives: inverse dynamics of prescribed joints, torques of the controller for the others.
    out.drive.copy_from(&data.tau.rows(0, n));
    for (&k, torque) in driven.iter().zip(system.servo_torques()) {
        out.drive[k] = *torque;
    }

    // Springs, dampers and friction.
    let gears = system.gears.as_ref();
    let [mut damping, elastic] = match gears {
        Some(gears) => [gears.loads(plant, &mut out.load), gears.energy(plant)],
        None => {
            let workspaces = [system.shifted.as_mut_slice(), system.forces.as_mut_slice()];
            element_loads(plant, e, rates, workspaces, &mut out.load)
        }
    };
    for k in 0..n {
        let rate = state.qdot[k];
        damping += gears.map_or_else(|| plant.friction_torque(k, rate), |gears| gears.friction[k]) * rate;
    }
    out.hysteresis_work = gears.map_or(0.0, |gears| gears.lost);

    // Powers and energies.
    let loads = plant.loads.iter().map(|load| {
        let F = load.on_body(system.events.side(t), &data.X_WB[load.body]);
        data.V[load.body].power(&F)
    });
    out.power = [out.drive.dot(&out.qdot.rows(0, n)), loads.sum(), damping];
    out.impulse_work = system.impulse_work;
    out.energy = [kinetic, potential, elastic];
}

/// Writes the loads `-(K e + D ė)` of the elements (first six components). Returns the power
/// dissipated by the dampers, `ėᵀ D ė` (W), and the elastic energy (J).
///
/// * `workspaces`: scratch, at least one number per elastic coordinate each.
fn element_loads(
    plant: &Plant,
    e: &[f64],
    rates: &[f64],
    workspaces: [&mut [f64]; 2],
    loads: &mut [Vector6<f64>],
) -> [f64; 2] {
    if rates.is_empty() {
        return [0.0; 2];
    }
    let [dampers, springs] = workspaces.map(|workspace| &mut workspace[..rates.len()]);
    dampers.fill(0.0);
    springs.fill(0.0);
    // D ė, then per element K e, its energy and -(K e + D ė).
    plant.add_damping(rates, dampers);
    let mut energy = 0.0;
    for (load, element) in loads.iter_mut().zip(&plant.elements) {
        let range = plant.offset(element)..plant.offset(element) + element.size;
        let (own, spring) = (&e[range.clone()], &mut springs[range.clone()]);
        element.add_spring_force(own, &[], spring);
        energy += match &element.curve {
            Some(curve) => curve.energy(own[0], &[]),
            None => 0.5 * dot(own, spring),
        };
        load.fill(0.0);
        let forces = spring.iter().zip(&dampers[range]);
        load.iter_mut().zip(forces).for_each(|(load, (spring, damper))| *load = -(spring + damper));
    }
    let crossed = plant.cross_stiffness.iter().map(|&(i, j, k)| k * e[i] * e[j]);
    [dot(dampers, rates), energy + crossed.sum::<f64>()]
}
