//! Placement of unknown instruments: fits of rigid motions and rotations to measured points.
//!
//! Start at [`placed`], which gives the search a start; the fit itself moves the instruments further.

use flexarm_kinematics::Pose;
use nalgebra::{DVector, Matrix3, Rotation3, Translation3, Vector3};

use crate::estimation::identified::IdentifyError;
use crate::estimation::measurement::MeasuredArm;
use crate::estimation::parameter::NominalArm;
use crate::estimation::reading::{Component, Instrument, Measurements, Reading, ReadingKind};

/// Returns the measurements with each unknown instrument at its best fit to the arm with its
/// initial values; those with prior knowledge stay where it says.
///
/// # Errors
/// [`IdentifyError::Readings`] for too few or collinear points, [`IdentifyError::Model`] without an
/// equilibrium.
pub(crate) fn placed(nominal: &NominalArm, measurements: &Measurements) -> Result<Measurements, IdentifyError> {
    let mut placed = measurements.clone();
    for number in 0..measurements.instruments.len() {
        // A pose given with its deviations is its own initial value.
        let is_prior = |reading: &Reading| matches!(reading.kind, ReadingKind::InstrumentAt { instrument, .. } if instrument == number);
        if measurements.readings.iter().any(is_prior) {
            continue;
        }
        let refused = |needed: String| {
            IdentifyError::Readings(format!("instrument {}: {needed}", measurements.instrument_name(number)))
        };
        placed.instruments[number] = match measurements.instruments[number] {
            known @ Instrument::Known(_) => known,
            // X_IW from the measured places: the rigid transform from the points of the nominal arm.
            Instrument::Unknown(_) => {
                let of_it = |reading: &Reading| {
                    let own = matches!(reading.kind, ReadingKind::Place { instrument, .. } if instrument == number);
                    own && reading.position().is_some()
                };
                let [world, own] = both_points(nominal, measurements, of_it)?;
                Instrument::Unknown(rigid_fit(&world, &own).ok_or_else(|| {
                    refused(format!(
                        "its pose requires at least three measured places that are not on one line, found {}",
                        world.len()
                    ))
                })?)
            }
            // R_IW from complete displacements: they are vectors, so the origin is irrelevant.
            Instrument::Axes(_) => {
                let of_it = |reading: &Reading| has_all_components(&reading.kind, number);
                let [world, own] = both_points(nominal, measurements, of_it)?;
                Instrument::Axes(rotation_fit(&world, &own).ok_or_else(|| {
                    refused(format!(
                        "its axes require displacements with all three components along at least two directions, found \
                         {}; add such readings, or give its orientation",
                        world.len()
                    ))
                })?)
            }
        };
    }
    Ok(placed)
}

/// Whether a reading consists of exactly the three components of a displacement in the axes of an
/// instrument.
fn has_all_components(kind: &ReadingKind, instrument: usize) -> bool {
    let ReadingKind::Displacement { rows, .. } = kind else { return false };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let component = |direction| Component { direction, instrument: Some(instrument), rotation: false };
    rows.len() == 3 && rows.iter().zip(axes).all(|(row, axis)| row.of == component(axis))
}

/// Returns the vectors of some readings, predicted in world axes by the arm with its initial
/// values, and as observed.
fn both_points(
    nominal: &NominalArm,
    measurements: &Measurements,
    some: impl Fn(&Reading) -> bool,
) -> Result<[Vec<Vector3<f64>>; 2], IdentifyError> {
    let some = measurements.in_world(|k| some(&measurements.readings[k]));
    let arm = MeasuredArm { nominal, parameters: &[], measurements: &some };
    Ok([points(&arm.predicted(&DVector::zeros(0))?), points(&arm.observed())])
}

/// Returns consecutive triples as vectors.
pub(crate) fn points(values: &[f64]) -> Vec<Vector3<f64>> {
    values.chunks_exact(3).map(Vector3::from_column_slice).collect()
}

/// Returns the rigid motion X that minimises `Σ |X p_k - q_k|²` for points p, q in two frames
/// (Arun, Huang and Blostein 1987).
///
/// Returns `None` with fewer than three points, with collinear points, and with points that are not
/// finite.
///
/// # Panics
/// Panics if the numbers of points differ.
pub fn rigid_fit(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Pose> {
    assert_eq!(from.len(), to.len(), "a rigid fit maps each point onto one");
    let n = from.len();
    if n < 3 {
        return None;
    }
    // The rotation maps the points about their means; the translation maps the means.
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / n as f64;
    let (a, b) = (mean(from), mean(to));
    let centred = |points: &[Vector3<f64>], mean| points.iter().map(|p| p - mean).collect::<Vec<_>>();
    let R = rotation_fit(&centred(from, a), &centred(to, b))?;
    Some(Pose::from_parts(Translation3::from(b - R * a), R))
}

/// Returns the rotation R that minimises `Σ |R p_k - q_k|²`; `None` if all vectors are collinear.
///
/// ```text
/// Σ p qᵀ = U S Vᵀ,   R = V D Uᵀ,   D = diag(1, 1, ±1), smallest singular value last, so that det R = 1
/// ```
pub(crate) fn rotation_fit(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Rotation3<f64>> {
    let H: Matrix3<f64> = from.iter().zip(to).map(|(p, q)| p * q.transpose()).sum();
    if !H.norm_squared().is_finite() {
        return None;
    }
    let svd = H.svd(true, true);
    let (U, Vt) = (svd.u?, svd.v_t?);
    let mut sizes: Vec<f64> = svd.singular_values.iter().copied().collect();
    sizes.sort_by(|x, y| y.total_cmp(x));
    // Collinear vectors leave the rotation about their line undetermined.
    if sizes[1] <= 1e-9 * sizes[0] {
        return None;
    }
    let mut turn = Matrix3::identity();
    let smallest = svd.singular_values.imin();
    turn[(smallest, smallest)] = (Vt.transpose() * U.transpose()).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(Vt.transpose() * turn * U.transpose()))
}
