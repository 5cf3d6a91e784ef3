//! Energies, momentum and centre of mass, from poses and twists of the bodies.
//!
//! Functions with `_of` read what the last algorithm left in [`Data`]. W world, B a body; `V` is
//! `V_WB_B`.

use flexarm_spatial::{Pose, SpatialInertia, Wrench};
use nalgebra::Vector3;

use crate::balancer;
use crate::data::{Data, State};
use crate::kinematics::{forward_kinematics, forward_kinematics_velocity};
use crate::model::Model;

/// Computes the kinetic energy `½ Σ V_WBᵀ M_BBo V_WB` (J), rotors included; fills
/// `data.{X_PB, X_WB, V}`.
///
/// # Panics
/// If a vector is not nv long, or `data` is of another model.
pub fn kinetic_energy(model: &Model, data: &mut Data, state: &State) -> f64 {
    forward_kinematics_velocity(model, data, state);
    kinetic_energy_of(model, data)
}

/// Returns the kinetic energy (J) including rotors, for the twists left in `data.V` by another algorithm.
pub fn kinetic_energy_of(model: &Model, data: &Data) -> f64 {
    let bodies = model.bodies.iter().zip(&data.V).skip(1);
    let rigid: f64 = bodies.map(|(body, V)| 0.5 * V.power(&body.inertia.mul_twist(V))).sum();
    let modal = model.modal.iter().zip(&data.modal);
    data.rotor_energy
        + rigid
        + modal.map(|(entry, modal)| modal.kinetic_energy(&entry.tables, &data.V[entry.body])).sum::<f64>()
}

/// Returns the momentum of all moving bodies about the world origin, world axes (kg m/s; kg m²/s), for the
/// poses and twists left in `data.X_WB` and `data.V` by another algorithm.
pub fn momentum_of(model: &Model, data: &Data) -> Wrench {
    let bodies = model.bodies.iter().zip(&data.V).zip(&data.X_WB).skip(1);
    let rigid = bodies.map(|((body, V), X)| body.inertia.mul_twist(V).at_parent(X));
    let modal = model.modal.iter().zip(&data.modal);
    let modal = modal
        .map(|(entry, modal)| modal.momentum(&entry.tables, &data.V[entry.body]).at_parent(&data.X_WB[entry.body]));
    rigid.chain(modal).fold(Wrench::zeros(), |sum, p| sum + p)
}

/// Computes the potential energy (J) of gravity, zero at the world origin, and of the balancers;
/// fills `data.{X_PB, X_WB}`.
///
/// # Panics
/// If `q` is not nv long, or `data` is of another model.
pub fn potential_energy(model: &Model, data: &mut Data, q: &nalgebra::DVector<f64>) -> f64 {
    forward_kinematics(model, data, q);
    potential_energy_of(model, data)
}

/// Returns the potential energy (J) of gravity for the poses in `data.X_WB`, and of the balancers at their
/// lengths in the last call of [`crate::forward_kinematics`], [`crate::inverse_dynamics`] or
/// [`crate::hybrid_dynamics`].
pub fn potential_energy_of(model: &Model, data: &Data) -> f64 {
    balancer::energy(model, data) - model.gravity.dot(&first_moment(model, data))
}

/// Returns `p_WoCcm_W`, the centre of mass of all moving bodies in the world (m), for the poses in `data.X_WB`.
pub fn center_of_mass(model: &Model, data: &Data) -> Vector3<f64> {
    first_moment(model, data) / model.moving_mass()
}

/// `Σ m p_WoBcm_W` over all moving bodies (kg m).
fn first_moment(model: &Model, data: &Data) -> Vector3<f64> {
    let bodies = model.bodies.iter().zip(&data.X_WB).skip(1);
    let in_world =
        |inertia: &SpatialInertia, X: &Pose| X.rotation * inertia.first_moment + X.translation.vector * inertia.mass;
    let rigid = bodies.map(|(body, X)| in_world(&body.inertia, X));
    let modal = model.modal.iter().zip(&data.modal).map(|(entry, m)| in_world(&m.inertia, &data.X_WB[entry.body]));
    rigid.chain(modal).fold(Vector3::zeros(), |sum, h| sum + h)
}
