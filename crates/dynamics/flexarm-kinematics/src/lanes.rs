//! Recursions over several poses of one tree at once, in the lanes of a SIMD scalar type.
//!
//! Poses differ between lanes; the rest is that of one [`Model`]. Every lane gives bitwise the result
//! of the `f64` function of the same name, for trees without balancers and closed loops. Functions are
//! inlined into their callers, so that the SIMD instructions are available
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
///
/// # Panics
/// If `q` is not nv long.
#[inline(always)]
pub fn forward_kinematics<T: Real>(model: &Model, data: &mut Data<T>, q: &[T]) {
    model.check_size("q", q.len());
    place_bodies(model, data, q);
}

/// [`crate::gravity_forces_at_poses`] without balancers; the generalised forces are in `data.tau`.
#[inline(always)]
pub fn gravity_forces_at_poses<T: Real>(model: &Model, data: &mut Data<T>) {
    at_rest(model, data);
}

/// [`crate::frame_jacobian`], column by column in `J` (6×nv).
///
/// # Panics
/// If `J` does not have nv columns.
#[inline(always)]
pub fn frame_jacobian<T: Real>(model: &Model, data: &Data<T>, frame: &Frame, J: &mut [T]) {
    assert_eq!(J.len(), 6 * model.nv(), "the Jacobian needs one column per coordinate");
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
///
/// # Panics
/// If the size of `G` does not match, or `q` is not nv long.
#[inline(always)]
pub fn static_tangent<T: Real>(
    tangent: &mut StaticTangent<T>,
    model: &Model,
    data: &Data<T>,
    q: &[T],
    load: PointLoad,
    G: &mut [T],
) {
    model.check_size("q", q.len());
    let n = tangent.size(model);
    assert_eq!(G.len(), n * n, "a row and a column per coordinate");
    tangent.under_load(model, data, q, &load, G);
}
