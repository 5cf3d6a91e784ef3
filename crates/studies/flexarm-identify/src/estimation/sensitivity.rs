//! Derivatives of the tool pose and the natural frequencies of an arm at rest with respect to its
//! parameters.
//!
//! ```text
//! K e + p(e) = 0:     V_T = -J (K + dp/de)^-1 dr/dx          dω²/dx = φᵀ (dK/dx - ω² dM/dx) φ
//! ```
//! with r the unbalanced forces. One factorisation at an operating point serves all parameters. The
//! explicit parts of dK/dx and dM/dx are exact; the parts due to the change of the equilibrium are
//! central differences of fourth order of the analytic tangents along de/dx.
//!
//! Start at [`tool_slopes`] for forces and poses, at [`linearised`] for matrices and modes. Not here:
//! damping and frequency responses ([`super::response`]).

use std::f64::consts::TAU;
use std::sync::Arc;

use flexarm_kinematics::{Frame, SpatialInertia, Twist, Wrench, rotation_vector};
use flexarm_stepping::{Guide, GuideTerm, OperatingPoint, Plant, SpringCurve, StepError, Tangents, modes_of};
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector3, Vector6};

use crate::estimation::parameter::{Effect, NominalArm, Parameter, SpringPart, displacement, entry_slope, slope_of};

/// Step of the central differences over displacements of joint frames (m, rad): the error is of the
/// order of its square.
pub(crate) const FRAME_STEP: f64 = 1e-4;
/// Step of the central differences of a guide's slope, as a fraction of the number's scale.
const GUIDE_STEP: f64 = 1e-4;
/// Step of the central differences: maximum change of an elastic coordinate per step (m, rad).
const DIFFERENCE: f64 = 1e-3;

/// Computes `dr/dx`, the derivative of the unbalanced forces on the elastic coordinates with
/// respect to each parameter, n×p.
fn force_slopes(at: &mut OperatingPoint, parameters: &[Parameter]) -> DMatrix<f64> {
    let tool = at.tool().clone();
    slopes_at_rest(at, parameters, &tool).0
}

/// Computes `dr/dx`, n×p, and the twists of a frame with all coordinates held (world axes, at its
/// origin), 6×p.
pub(crate) fn slopes_at_rest(
    at: &mut OperatingPoint,
    parameters: &[Parameter],
    frame: &Frame,
) -> (DMatrix<f64>, Matrix6xX<f64>) {
    // Columns of moved joint frames, then those of the other parameters.
    let (mut slopes, rigid) = frame_slopes(at, parameters, frame);
    for (k, parameter) in parameters.iter().enumerate() {
        match &parameter.effect {
            Effect::Stiffness(places) => {
                for (i, f) in places.iter().flat_map(|place| stiffness_forces(at, place)) {
                    slopes[(i, k)] += f;
                }
            }
            Effect::Entry { spring, row, column, factor, .. } => {
                let plant = at.plant();
                let (first, e) = (plant.offset(&plant.elements[*spring]), at.deflections());
                slopes[(first + row, k)] += factor * e[first + column];
                if row != column {
                    slopes[(first + column, k)] += factor * e[first + row];
                }
            }
            // Damping exerts no force at rest; for a moved tool the caller accounts for payload and
            // load.
            Effect::Damping(_) | Effect::Damper { .. } | Effect::Tool(_) => {}
            Effect::Guide { springs, term, .. } => {
                let (plant, q) = (at.plant(), at.coordinates().as_slice());
                for element in springs.iter().map(|spring| &plant.elements[*spring]) {
                    if let Some(guide) = element.curve.as_ref().and_then(SpringCurve::guide) {
                        let slope = guide.torque_slope(*term, q[element.coordinate], q);
                        slopes[(plant.offset(element), k)] += slope * per_unit(guide, *term);
                    }
                }
            }
            Effect::Frame { .. } => {}
            effect @ (Effect::Mass(_) | Effect::Link { .. }) => {
                for (body, rate) in effect.inertia_rates(1.0, &Vector3::zeros()) {
                    at.add_weight(body, &rate, slopes.column_mut(k).as_mut_slice());
                }
            }
        }
    }
    (slopes, rigid)
}

/// Returns the forces of a spring per relative change of its stiffness, with their elastic
/// coordinates.
fn stiffness_forces(at: &OperatingPoint, place: &SpringPart) -> Vec<(usize, f64)> {
    let (plant, e, q) = (at.plant(), at.deflections(), at.coordinates().as_slice());
    if let Some((places, dK)) = plant.coupled_stiffness_slope(place.spring) {
        let f = dK * DVector::from_iterator(places.len(), places.iter().map(|i| e[*i]));
        return places.iter().copied().zip(f.iter().copied()).collect();
    }
    let element = &plant.elements[place.spring];
    let first = plant.offset(element);
    // The deflection of a single-coordinate spring includes its transmission error.
    let turned = plant.deflection(place.spring, e[first], q);
    let e = if element.size == 1 { &[turned] } else { &e[first..first + element.size] };
    let f = match &element.curve {
        Some(curve) => DVector::from_element(1, curve.torque(e[0], q)),
        None => slope_of(&element.K, place.coordinate) * DVector::from_column_slice(e),
    };
    f.iter().enumerate().map(|(i, f)| (first + i, *f)).collect()
}

/// Returns the change of a guide's number per unit of its search coordinate.
fn per_unit(guide: &Guide, term: GuideTerm) -> f64 {
    if term.is_positive() { guide.number(term) } else { 1.0 }
}

/// Computes the derivatives of the tool pose as twists (world axes, at the tool's origin; m, rad)
/// per unit of each parameter's coordinate, 6×p, at a solved pose.
///
/// ```text
/// V_T = V_rigid - J (K + dp/de)^-1 dr/dx
/// ```
/// Cost: one solution with the factor of the operating point, whatever the number of parameters.
///
/// For [`Effect::Tool`] this is only the part due to deflection, which is zero here: loads stay in
/// place, and the motion of the frame itself is not included. [`crate::estimation::MeasuredArm`]
/// includes both.
pub fn tool_slopes(at: &mut OperatingPoint, parameters: &[Parameter]) -> Matrix6xX<f64> {
    let tool = at.tool().clone();
    let (forces, rigid) = slopes_at_rest(at, parameters, &tool);
    with_deflection(at, &tool, &forces, rigid)
}

/// Adds the part due to deflection to the twists of a frame with all coordinates held.
pub(crate) fn with_deflection(
    at: &mut OperatingPoint,
    frame: &Frame,
    forces: &DMatrix<f64>,
    mut twists: Matrix6xX<f64>,
) -> Matrix6xX<f64> {
    let moved = at.yielding_of(frame).tr_mul(forces);
    twists.iter_mut().zip(moved.iter()).for_each(|(twist, moved)| *twist -= moved);
    twists
}

/// Computes the derivatives with respect to displacements of joint frames; other columns are zero.
fn frame_slopes(at: &mut OperatingPoint, parameters: &[Parameter], frame: &Frame) -> (DMatrix<f64>, Matrix6xX<f64>) {
    let n = at.deflections().len();
    let (mut forces, mut twists) = (DMatrix::zeros(n, parameters.len()), Matrix6xX::zeros(parameters.len()));
    let mut others = Vec::new();
    for (k, parameter) in parameters.iter().enumerate() {
        let Effect::Frame { body, twist, .. } = &parameter.effect else { continue };
        let part = |first: usize| Vector3::new(twist[first], twist[first + 1], twist[first + 2]);
        let moved = Twist::new(part(0), part(3));
        match at.moved_subtree(*body, &moved, frame, forces.column_mut(k).as_mut_slice()) {
            Some(Twist { linear, angular }) => {
                twists.set_column(k, &Vector6::from_iterator(linear.iter().chain(&angular).copied()));
            }
            None => others.push(k),
        }
    }
    if !others.is_empty() {
        frame_differences(at, parameters, frame, &others, (&mut forces, &mut twists));
    }
    (forces, twists)
}

/// Computes the derivatives of [`frame_slopes`] for arms with balancers or load-dependent stiffness by
/// central differences.
fn frame_differences(
    at: &mut OperatingPoint,
    parameters: &[Parameter],
    frame: &Frame,
    some: &[usize],
    (forces, twists): (&mut DMatrix<f64>, &mut Matrix6xX<f64>),
) {
    let plant = at.plant().clone();
    let mut r = DVector::zeros(at.deflections().len());
    for &k in some {
        let Effect::Frame { body, twist, .. } = &parameters[k].effect else { continue };
        // Unbalanced forces and pose of the frame on both sides, at unchanged coordinates.
        let [(r_ahead, ahead), (r_behind, behind)] = frames_beside(&plant, *body, twist).map(|plant| {
            at.forces_of(&plant, &mut r);
            (r.clone(), at.pose_of(frame))
        });
        forces.set_column(k, &((r_ahead - r_behind) / (2.0 * FRAME_STEP)));
        let turn = rotation_vector((ahead.rotation * behind.rotation.inverse()).matrix());
        let shift = ahead.translation.vector - behind.translation.vector;
        let twist = shift.iter().chain(&turn).map(|x| x / (2.0 * FRAME_STEP));
        twists.set_column(k, &Vector6::from_iterator(twist));
    }
    // The poses of the operating point are those of its arm again.
    at.forces_of(&plant, &mut r);
}

/// Returns the arm with the joint frame of a body displaced by [`FRAME_STEP`] along a twist and
/// against it.
pub(crate) fn frames_beside(plant: &Plant, body: usize, twist: &Vector6<f64>) -> [Plant; 2] {
    [FRAME_STEP, -FRAME_STEP].map(|step| {
        let mut plant = plant.clone();
        let X_PJ = plant.model.bodies()[body].X_PJ * displacement(&(twist * step));
        Arc::make_mut(&mut plant.model).set_joint_frame(body, X_PJ);
        plant
    })
}

/// Natural frequencies of an arm with locked drives, and their derivatives.
#[derive(Clone, Debug)]
pub struct FrequencySlopes {
    /// Frequencies, ascending (Hz).
    pub hz: Vec<f64>,
    /// Derivatives per unit of each parameter's coordinate (Hz): a row per frequency, a column per
    /// parameter.
    pub slopes: DMatrix<f64>,
}

/// Computes the natural frequencies at a pose without a wrench, and their derivatives with respect
/// to the parameters.
///
/// * `nominal`: arm with the present parameters.
/// * `q`: actuated joints (rad or m).
///
/// Where two frequencies coincide, their mode shapes and their individual derivatives are not
/// determined.
///
/// # Errors
/// As [`OperatingPoint::solve`]; [`StepError::Singular`] if a coordinate has no mass.
pub fn frequency_slopes(
    nominal: &NominalArm,
    parameters: &[Parameter],
    q: &[f64],
) -> Result<FrequencySlopes, StepError> {
    let plant = nominal.at_rest(q)?;
    let Linearised { omega2, shapes, slopes: changes, .. } =
        linearised(nominal, &plant, parameters, q, |_| Vec::new())?;
    let mut slopes = DMatrix::zeros(omega2.len(), parameters.len());
    for (k, change) in changes.iter().enumerate() {
        for (i, w2) in omega2.iter().enumerate() {
            let phi = shapes.column(i);
            let slope = phi.dot(&(&change[0] * phi)) - w2 * phi.dot(&(&change[1] * phi));
            slopes[(i, k)] = slope / (2.0 * w2.sqrt() * TAU);
        }
    }
    Ok(FrequencySlopes { hz: omega2.iter().map(|w2| w2.sqrt() / TAU).collect(), slopes })
}

/// An arm with locked drives at its equilibrium under gravity, and its total derivatives.
pub(crate) struct Linearised {
    /// All coordinates at the equilibrium.
    pub(crate) q: DVector<f64>,
    /// Stiffness, mass and Jacobian there.
    pub(crate) here: Tangents,
    /// Squares of the natural frequencies, ascending (rad²/s²).
    pub(crate) omega2: Vec<f64>,
    /// Mode shapes with `φᵀ M φ = 1`, one column each.
    pub(crate) shapes: DMatrix<f64>,
    /// Per parameter: derivatives of K, of M, and of the further matrices along the equilibrium.
    pub(crate) slopes: Vec<Vec<DMatrix<f64>>>,
}

/// Solves the equilibrium at a pose, and computes modes and total derivatives there.
///
/// ```text
/// de/dx = -K^-1 dr/dx,   dK/dx = ∂K/∂x + ∂K/∂e de/dx,   dM/dx likewise
/// ```
/// * `more`: further matrices of the coordinates, differentiated along `de/dx`.
///
/// # Errors
/// As [`frequency_slopes`].
pub(crate) fn linearised(
    nominal: &NominalArm,
    plant: &Plant,
    parameters: &[Parameter],
    q: &[f64],
    more: impl Fn(&DVector<f64>) -> Vec<DMatrix<f64>>,
) -> Result<Linearised, StepError> {
    let (tool, none) = (&nominal.tool, Wrench::zeros());
    let mut at = OperatingPoint::new(plant.clone(), tool.clone());
    at.solve(q, &none)?;
    // Forces, tangents and modes at the equilibrium.
    let forces = force_slopes(&mut at, parameters);
    let q = at.coordinates().clone();
    let here = Tangents::at(plant, tool, &none, &q);
    let (omega2, shapes) = eigen(&here)?;
    let symmetric = (&here.K + here.K.transpose()) * 0.5;
    let singular = || StepError::Singular { matrix: "static stiffness (with the effect of weight)", t: 0.0 };
    let factor = symmetric.cholesky().ok_or_else(singular)?;
    // Per parameter: change along the equilibrium, then the explicit part of K and M.
    let slopes = parameters.iter().enumerate().map(|(k, parameter)| {
        let de = -factor.solve(&forces.column(k));
        let mut change = along(plant, &q, &de, |q| {
            let at = Tangents::at(plant, tool, &none, q);
            [at.K, at.M].into_iter().chain(more(q)).collect()
        });
        let (dK, dM) = explicit(plant, tool, &none, &parameter.effect, &q, &here);
        change[0] += dK;
        change[1] += dM;
        change
    });
    let slopes = slopes.collect();
    Ok(Linearised { q, here, omega2, shapes, slopes })
}

/// Squares of the natural frequencies, ascending, and mode shapes with `φᵀ M φ = 1`.
fn eigen(at: &Tangents) -> Result<(Vec<f64>, DMatrix<f64>), StepError> {
    let modes = modes_of(&((&at.K + at.K.transpose()) * 0.5), &at.M, 0.0)?;
    Ok((modes.omega.iter().map(|omega| omega * omega).collect(), modes.shapes))
}

/// Computes the derivative of matrices that depend on the coordinates, as the elastic coordinates
/// move by `de` per unit: central differences of fourth order.
fn along(
    plant: &Plant,
    q: &DVector<f64>,
    de: &DVector<f64>,
    matrices: impl Fn(&DVector<f64>) -> Vec<DMatrix<f64>>,
) -> Vec<DMatrix<f64>> {
    let mut dq = DVector::zeros(q.len());
    dq.rows_mut(plant.model.n_actuated(), de.len()).copy_from(de);
    let size = dq.amax();
    if size == 0.0 {
        return matrices(q).into_iter().map(|here| here * 0.0).collect();
    }
    let h = DIFFERENCE / size;
    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|steps: f64| matrices(&(q + &dq * (steps * h))));
    (0..a.len()).map(|k| ((&c[k] - &b[k]) * 8.0 - (&d[k] - &a[k])) / (12.0 * h)).collect()
}

/// Computes the derivatives of the Cartesian compliance of the tool with locked drives at a solved
/// pose: one 6×6 per parameter, per unit of its coordinate (m/N, rad/N; m/(N m), rad/(N m)).
///
/// * `F_T_W`: wrench of the solved operating point.
///
/// # Errors
/// [`StepError::Singular`] if a motion has no stiffness.
pub fn compliance_slopes(
    at: &mut OperatingPoint,
    F_T_W: &Wrench,
    parameters: &[Parameter],
) -> Result<Vec<Matrix6<f64>>, StepError> {
    let forces = force_slopes(at, parameters);
    let (plant, tool, q) = (at.plant().clone(), at.tool().clone(), at.coordinates().clone());
    let here = Tangents::at(&plant, &tool, F_T_W, &q);
    let singular = || StepError::Singular { matrix: "static stiffness (with the effect of weight and load)", t: 0.0 };
    let solve = |K: &DMatrix<f64>, B: &DMatrix<f64>| K.clone().lu().solve(B).ok_or_else(singular);
    // U = K^-1 Jᵀ, Y = K^-T Jᵀ
    let J = DMatrix::from_fn(6, here.J.ncols(), |i, j| here.J[(i, j)]);
    let (U, Y) = (solve(&here.K, &J.transpose())?, solve(&here.K.transpose(), &J.transpose())?);
    let matrices = |q: &DVector<f64>| {
        let at = Tangents::at(&plant, &tool, F_T_W, q);
        vec![DMatrix::from_fn(6, at.J.ncols(), |i, j| at.J[(i, j)]), at.K]
    };
    let mut found = Vec::with_capacity(parameters.len());
    for (k, parameter) in parameters.iter().enumerate() {
        // de/dx; J and K change along it, and K with the parameter itself.
        let moved = -solve(&here.K, &forces.columns(k, 1).into_owned())?.column(0);
        let change = along(&plant, &q, &moved, matrices);
        let (eK, _) = explicit(&plant, &tool, F_T_W, &parameter.effect, &q, &here);
        // dC = dJ K^-1 Jᵀ + J K^-1 dJᵀ - J K^-1 dK K^-1 Jᵀ
        let dC = &change[0] * &U + Y.tr_mul(&change[0].transpose()) - Y.tr_mul(&((&change[1] + eK) * &U));
        found.push(Matrix6::from_fn(|i, j| dC[(i, j)]));
    }
    Ok(found)
}

/// Computes the explicit derivatives of stiffness and mass with respect to the parameter.
fn explicit(
    plant: &Plant,
    tool: &Frame,
    F_T_W: &Wrench,
    effect: &Effect,
    q: &DVector<f64>,
    here: &Tangents,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = here.K.nrows();
    match effect {
        Effect::Stiffness(places) => (stiffness_slope(plant, places, q.as_slice(), n), DMatrix::zeros(n, n)),
        Effect::Entry { spring, row, column, factor, .. } => {
            let element = &plant.elements[*spring];
            let (first, size) = (plant.offset(element), element.size);
            let mut dK = DMatrix::zeros(n, n);
            dK.view_mut((first, first), (size, size)).copy_from(&entry_slope(size, *row, *column, *factor));
            (dK, DMatrix::zeros(n, n))
        }
        Effect::Damping(_) | Effect::Damper { .. } | Effect::Tool(_) => (DMatrix::zeros(n, n), DMatrix::zeros(n, n)),
        Effect::Guide { springs, term, size } => {
            let mut dK = DMatrix::zeros(n, n);
            for element in springs.iter().map(|spring| &plant.elements[*spring]) {
                let Some(guide) = element.curve.as_ref().and_then(SpringCurve::guide) else { continue };
                let (k, h, q) = (plant.offset(element), GUIDE_STEP * size, q.as_slice());
                let slope = |change: f64| guide.with(*term, change).slope(q[element.coordinate], q);
                dK[(k, k)] += (slope(h) - slope(-h)) / (2.0 * h) * per_unit(guide, *term);
            }
            (dK, DMatrix::zeros(n, n))
        }
        Effect::Frame { body, twist, .. } => {
            let [ahead, behind] = frames_beside(plant, *body, twist).map(|plant| Tangents::at(&plant, tool, F_T_W, q));
            ((ahead.K - behind.K) / (2.0 * FRAME_STEP), (ahead.M - behind.M) / (2.0 * FRAME_STEP))
        }
        Effect::Mass(_) | Effect::Link { .. } => {
            // Linear in the inertias: a difference of any size is exact.
            let add = |plant: Plant, (body, rate): (usize, SpatialInertia)| {
                let mut inertia = plant.model.bodies()[body].inertia;
                inertia += rate;
                plant.with_inertia(body, inertia)
            };
            let heavier = effect.inertia_rates(1.0, &Vector3::zeros()).into_iter().fold(plant.clone(), add);
            let heavier = Tangents::at(&heavier, tool, F_T_W, q);
            (heavier.K - &here.K, heavier.M - &here.M)
        }
    }
}

/// Computes the derivative, n×n, of the stiffness with respect to the logarithm of a factor on the
/// given coordinates of springs.
fn stiffness_slope(plant: &Plant, places: &[SpringPart], q: &[f64], n: usize) -> DMatrix<f64> {
    let mut dK = DMatrix::zeros(n, n);
    for place in places {
        if let Some((places, coupled)) = plant.coupled_stiffness_slope(place.spring) {
            for (a, i) in places.iter().enumerate() {
                places.iter().enumerate().for_each(|(b, j)| dK[(*i, *j)] += coupled[(a, b)]);
            }
            continue;
        }
        let element = &plant.elements[place.spring];
        let (first, size) = (plant.offset(element), element.size);
        let mut block = dK.view_mut((first, first), (size, size));
        match plant.vibration_slope(place.spring, q) {
            Some(slope) => block[(0, 0)] += slope,
            None => block += slope_of(&element.K, place.coordinate),
        }
    }
    dK
}
