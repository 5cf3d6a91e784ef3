//! Placement of unknown instruments: fits of rigid motions and rotations to measured points.

use flexarm_kinematics::Pose;
use nalgebra::{DVector, Matrix3, Rotation3, Translation3, Vector3};

use crate::estimation::identified::IdentifyError;
use crate::estimation::measurement::MeasuredArm;
use crate::estimation::parameter::NominalArm;
use crate::estimation::reading::{Component, Instrument, Measurements, Reading, ReadingKind};

/// Returns the measurements with each unknown instrument at its best fit to the arm with its
/// initial values.
pub(crate) fn placed(nominal: &NominalArm, measurements: &Measurements) -> Result<Measurements, IdentifyError> {
    let mut placed = measurements.clone();
    for number in 0..measurements.instruments.len() {
        let of_it = |kind: &ReadingKind| match kind {
            ReadingKind::InstrumentAt { instrument, .. } => *instrument == number,
            _ => false,
        };
        let said = measurements.readings.iter().any(|reading| of_it(&reading.kind));
        match measurements.instruments[number] {
            Instrument::Unknown(_) if !said => {
                let seen = |reading: &Reading| {
                    let own = matches!(reading.kind, ReadingKind::Place { instrument, .. } if instrument == number);
                    own && reading.position().is_some()
                };
                let [world, own] = both_points(nominal, measurements, seen)?;
                let too_few = || {
                    IdentifyError::Readings(format!(
                        "instrument {number}: its pose requires at least three measured places that are not on one \
                         line, found {}",
                        world.len()
                    ))
                };
                placed.instruments[number] = Instrument::Unknown(rigid_fit(&world, &own).ok_or_else(too_few)?);
            }
            Instrument::Axes(_) if !said => {
                let seen = |reading: &Reading| seen_in_axes(&reading.kind, number);
                let [world, own] = both_points(nominal, measurements, seen)?;
                let too_few = || {
                    IdentifyError::Readings(format!(
                        "instrument {number}: its axes require displacements with all three components along at least \
                         two directions, found {}; add such readings, or give its orientation",
                        world.len()
                    ))
                };
                placed.instruments[number] = Instrument::Axes(rotation_fit(&world, &own).ok_or_else(too_few)?);
            }
            _ => {}
        }
    }
    Ok(placed)
}

/// Whether a reading consists of exactly the three components of a displacement in the axes of an
/// instrument.
fn seen_in_axes(kind: &ReadingKind, instrument: usize) -> bool {
    let ReadingKind::Displacement { rows, .. } = kind else { return false };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    rows.len() == 3 && rows.iter().zip(axes).all(|(row, axis)| row.of == Component::AlongSeen(instrument, axis))
}

/// Returns the vectors of some readings, predicted in world axes by the arm with its initial
/// values, and as observed.
fn both_points(
    nominal: &NominalArm,
    measurements: &Measurements,
    some: impl Fn(&Reading) -> bool,
) -> Result<[Vec<Vector3<f64>>; 2], IdentifyError> {
    let seen = measurements.in_world(|k| some(&measurements.readings[k]));
    let arm = MeasuredArm { nominal, parameters: &[], measurements: &seen };
    Ok([points(&arm.predicted(&DVector::zeros(0))?), points(&arm.observed())])
}

pub(crate) fn points(values: &[f64]) -> Vec<Vector3<f64>> {
    values.chunks_exact(3).map(Vector3::from_column_slice).collect()
}

/// Returns the rotation and translation that map points onto others with the least sum of squares
/// (Arun, Huang and Blostein 1987).
pub fn rigid_fit(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Pose> {
    let n = from.len();
    if n < 3 {
        return None;
    }
    let middle = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / n as f64;
    let (a, b) = (middle(from), middle(to));
    let less = |points: &[Vector3<f64>], middle| points.iter().map(|p| p - middle).collect::<Vec<_>>();
    let R = rotation_fit(&less(from, a), &less(to, b))?;
    Some(Pose::from_parts(Translation3::from(b - R * a), R))
}

/// Returns the rotation that maps vectors onto others with the least sum of squares; `None` if all
/// are collinear.
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
