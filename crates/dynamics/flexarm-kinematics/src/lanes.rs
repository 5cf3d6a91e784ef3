//! Recursions over several poses of one tree at once, in the lanes of a SIMD scalar type.
//!
//! Poses differ between lanes; the rest is that of one [`Model`]. Every lane gives bitwise the result of the `f64` function of the
//! same name. Functions are inlined into their callers, so that the SIMD instructions are available
//! ([`flexarm_spatial::lanes::with_lanes`]).

use flexarm_spatial::Real;

use crate::crba::composite_bodies;
use crate::data::Data;
use crate::kinematics::{place_bodies, tree_jacobian};
use crate::model::{Frame, Model};
use crate::rnea::at_rest;
use crate::static_tangent::{PointLoad, StaticTangent};

/// [`crate::mass_matrix_at_poses`]; the mass matrix is in `data.M`.
#[inline(always)]
pub fn mass_matrix_at_poses<T: Real>(model: &Model, data: &mut Data<T>) {
    composite_bodies(model, data);
}

/// [`crate::forward_kinematics`]; the poses are in `data.X_WB`.
#[inline(always)]
pub fn forward_kinematics<T: Real>(model: &Model, data: &mut Data<T>, q: &[T]) {
    place_bodies(model, data, q);
}

/// [`crate::gravity_forces_at_poses`] without balancers; the generalised forces are in `data.tau`.
#[inline(always)]
pub fn gravity_forces_at_poses<T: Real>(model: &Model, data: &mut Data<T>) {
    at_rest(model, data);
}

/// [`crate::frame_jacobian`], column by column in `J` (6×nv).
#[inline(always)]
pub fn frame_jacobian<T: Real>(model: &Model, data: &Data<T>, frame: &Frame, J: &mut [T]) {
    tree_jacobian(
        model,
        data,
        frame,
        J,
        #[inline(always)]
        |_, _, _| (),
    );
}

/// [`StaticTangent::compute`] without balancers, under one load, column by column in `G`.
#[inline(always)]
pub fn static_tangent<T: Real>(
    tangent: &mut StaticTangent<T>,
    model: &Model,
    data: &Data<T>,
    q: &[T],
    load: PointLoad,
    G: &mut [T],
) {
    tangent.of_bodies(model, data, q, std::iter::once(load), G);
}
