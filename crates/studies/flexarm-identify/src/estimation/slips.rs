//! Detection of mistakes in a file of measurements that no stiffness explains: permuted joints, a
//! joint with another sign or zero, displacements in other axes, mirrored positions.
//!
//! Displacements are nearly linear in the compliances of the springs,
//!
//! ```text
//! d ≈ -Σ a_k ∂d/∂(ln k_k),     a_k ≥ 0: compliance over its initial value
//! ```
//! Each order of joints and each rotation of the axes therefore leaves a residual that no
//! compliances explain, whatever the initial stiffnesses are. A mistake is reported if the residual
//! is large and another order or other axes reduce it to almost nothing.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use crate::estimation::least_squares::Residuals;
use crate::estimation::measurement::MeasuredArm;
use crate::estimation::parameter::{Effect, NominalArm, Parameter};
use crate::estimation::placement::{points, rigid_fit, rotation_fit};
use crate::estimation::reading::{Component, Measurements, Reading, ReadingKind};

/// Mistake that explains readings which the arm does not.
#[derive(Clone, Debug, PartialEq)]
pub enum Slip {
    /// For each joint, the position in the list at which its value is given.
    Order(Vec<usize>),
    /// Rotation from the axes of the measured displacements to world axes.
    Axes(Rotation3<f64>),
    /// A joint that turns the other way.
    Sign(usize),
    /// A joint whose zero is off by an angle (rad).
    Zero(usize, f64),
    /// Positions along an axis of the instrument have the other sign: left-handed axes.
    Mirrored,
}

/// A mistake, and the relative residuals with and without it.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSlip {
    /// Mistake.
    pub slip: Slip,
    /// Residual over readings (RMS) as given.
    pub rest: f64,
    /// Residual over readings (RMS) with the mistake corrected.
    pub rest_mended: f64,
}

/// Minimum relative residual for a search: of displacements over themselves, of positions over
/// their spread.
const REST: [f64; 2] = [0.25, 0.1];
/// Maximum residual with the mistake corrected: as a fraction of that before, and relative to the
/// displacements and the spread of positions.
const MENDED: f64 = 1.0 / 3.0;
const LEFT: [f64; 2] = [0.15, 0.05];
/// Maximum number of readings used.
const MAX_READINGS: usize = 16;
/// Number of alternating fits of compliances and rotation.
const ROUNDS: usize = 15;

/// Returns the mistake that explains readings which the arm does not; `None` if the arm explains
/// them or no simple mistake does.
///
/// * `slides`: whether each joint slides; values of sliding and rotating joints are not exchanged.
pub fn likely_slip(
    nominal: &NominalArm,
    parameters: &[Parameter],
    measurements: &Measurements,
    slides: &[bool],
) -> Option<FoundSlip> {
    let is_spring = |p: &&Parameter| matches!(p.effect, Effect::Stiffness(_));
    let springs: Vec<Parameter> = parameters.iter().filter(is_spring).cloned().collect();
    let moved = some_of(measurements, |reading| match &reading.kind {
        ReadingKind::Displacement { rows, .. } => rows.iter().all(|row| row.of == Component::along(row.of.direction)),
        _ => false,
    });
    let found = (!springs.is_empty() && moved.rows() >= 3 * springs.len()).then(|| {
        let rest = |order: &[usize]| Some(Displacements::of(nominal, &springs, &ordered(&moved, order))?.rest());
        let whole = moved.readings.iter().all(|reading| reading.rows() == 3);
        let axes = || Displacements::of(nominal, &springs, &moved).filter(|_| whole)?.turned();
        among(rest, &|| axes().map(|(R, rest)| (Slip::Axes(R), rest)), slides, 0)
    });
    let placed = some_of(measurements, |reading| reading.position().is_some());
    // Places judge the rigid robot: initial stiffnesses may be far off.
    let rigid: Vec<f64> = springs.iter().map(|spring| spring.search(spring.unknown(true).start).0).collect();
    let stiff = &nominal.with(&springs, &rigid);
    let rest = |order: &[usize]| place_rest(stiff, &ordered(&placed, order));
    found.flatten().or_else(|| among(rest, &|| one_joint(stiff, &placed, slides), slides, 1))
}

/// Returns the change of one joint, or of the handedness of the positions, with the smallest
/// residual.
fn one_joint(nominal: &NominalArm, placed: &Measurements, slides: &[bool]) -> Option<(Slip, f64)> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let turns = |joint: &usize| !slides[*joint];
    let zeros = (0..slides.len()).filter(turns).flat_map(|j| [1.0, -1.0, 2.0].map(|k| Slip::Zero(j, k * quarter)));
    let all = (0..slides.len()).map(Slip::Sign).chain(zeros).chain([Slip::Mirrored]);
    let scored = all.filter_map(|slip| {
        let mut other = placed.clone();
        for reading in &mut other.readings {
            match (&slip, &mut reading.kind) {
                (Slip::Sign(joint), _) => reading.q[*joint] *= -1.0,
                (Slip::Zero(joint, by), _) => reading.q[*joint] += by,
                (_, ReadingKind::Place { rows, .. }) => rows[0].value *= -1.0,
                _ => {}
            }
        }
        Some((slip, place_rest(nominal, &other)?))
    });
    scored.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Selects some readings at equal intervals, in world axes.
fn some_of(measurements: &Measurements, some: impl Fn(&Reading) -> bool) -> Measurements {
    let all: Vec<usize> = (0..measurements.readings.len()).filter(|k| some(&measurements.readings[*k])).collect();
    let every = all.len().div_ceil(MAX_READINGS).max(1);
    let kept: Vec<usize> = all.into_iter().step_by(every).collect();
    measurements.in_world(|k| kept.contains(&k))
}

/// Returns the readings with permuted joint values.
fn ordered(measurements: &Measurements, order: &[usize]) -> Measurements {
    let mut other = measurements.clone();
    other.readings.iter_mut().for_each(|reading| reading.q = order.iter().map(|k| reading.q[*k]).collect());
    other
}

/// Returns the mistake with the smallest residual if the readings call for one and it explains
/// them; `kind`: 0 for displacements, 1 for positions.
fn among(
    rest: impl Fn(&[usize]) -> Option<f64>,
    others: &dyn Fn() -> Option<(Slip, f64)>,
    slides: &[bool],
    kind: usize,
) -> Option<FoundSlip> {
    let as_said: Vec<usize> = (0..slides.len()).collect();
    let before = rest(&as_said).filter(|rest| *rest > REST[kind])?;
    let order = best_order(&rest, as_said, before, slides);
    let found = [Some((Slip::Order(order.0), order.1)), others()].into_iter().flatten();
    let (slip, rest_mended) = found.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (rest_mended < (MENDED * before).min(LEFT[kind])).then_some(FoundSlip { slip, rest: before, rest_mended })
}

/// Searches for the order of joints with the smallest residual: from the given order, the reverse
/// and the cyclic shifts, by pairwise exchanges as long as they reduce the residual.
fn best_order(
    rest: &impl Fn(&[usize]) -> Option<f64>,
    as_said: Vec<usize>,
    before: f64,
    slides: &[bool],
) -> (Vec<usize>, f64) {
    let n = as_said.len();
    // Only joints of one kind can be exchanged.
    let alike = |order: &[usize]| order.iter().enumerate().all(|(k, from)| slides[k] == slides[*from]);
    let scored = |order: Vec<usize>| alike(&order).then(|| rest(&order).map(|rest| (order, rest))).flatten();
    let others = (1..n).map(|by| (0..n).map(|k| (k + by) % n).collect()).chain([(0..n).rev().collect()]);
    let begins = others.filter_map(scored).chain([(as_said, before)]);
    let least = |a: &(Vec<usize>, f64), b: &(Vec<usize>, f64)| a.1.total_cmp(&b.1);
    // From each start, make the best exchange until none reduces the residual.
    let climbed = begins.map(|mut best| {
        loop {
            let exchanged = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).filter_map(|(i, j)| {
                let mut order = best.0.clone();
                order.swap(i, j);
                scored(order)
            });
            match exchanged.min_by(least) {
                Some(better) if better.1 < best.1 * (1.0 - 1e-6) => best = better,
                _ => return best,
            }
        }
    });
    climbed.min_by(least).unwrap_or((Vec::new(), f64::INFINITY))
}

/// Displacements, and their derivatives with respect to each compliance.
struct Displacements {
    A: DMatrix<f64>,
    b: DVector<f64>,
}

impl Displacements {
    fn of(nominal: &NominalArm, springs: &[Parameter], measurements: &Measurements) -> Option<Self> {
        let arm = MeasuredArm { nominal, parameters: springs, measurements };
        let mut J = DMatrix::zeros(0, 0);
        arm.evaluate(&DVector::zeros(springs.len()), Some(&mut J)).ok()?;
        Some(Self { A: -J, b: DVector::from_vec(arm.observed()) })
    }

    /// Returns the part of `b` that the springs explain with non-negative compliances: the most
    /// negative compliance is removed until none is negative.
    fn explained(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut kept: Vec<usize> = (0..self.A.ncols()).collect();
        while !kept.is_empty() {
            let A = self.A.select_columns(&kept);
            let svd = A.clone().svd(true, true);
            let small = 1e-9 * svd.singular_values.max();
            let Ok(a) = svd.solve(b, small) else { break };
            let worst = a.imin();
            if a[worst] >= 0.0 {
                return A * a;
            }
            kept.remove(worst);
        }
        DVector::zeros(b.len())
    }

    fn rest(&self) -> f64 {
        (&self.b - self.explained(&self.b)).norm() / self.b.norm()
    }

    /// Returns the rotation into world axes with the smallest residual, and this residual. Fits
    /// compliances and rotation alternately, starting from all 24 axis-aligned rotations.
    fn turned(&self) -> Option<(Rotation3<f64>, f64)> {
        let measured = points(self.b.as_slice());
        let upright = [Vector3::x(), Vector3::y(), Vector3::z()];
        let signed: Vec<Vector3<f64>> = upright.iter().flat_map(|v| [*v, -v]).collect();
        let begins = signed.iter().flat_map(|x| signed.iter().filter(|y| x.dot(y) == 0.0).map(move |y| (*x, *y)));
        let found = begins.filter_map(|(x, y)| {
            let mut R = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]));
            let mut rest = f64::INFINITY;
            for _ in 0..ROUNDS {
                let world: Vec<f64> =
                    measured.iter().flat_map(|v| (R * v).iter().copied().collect::<Vec<_>>()).collect();
                let world = DVector::from_vec(world);
                let explained = self.explained(&world);
                rest = (&world - &explained).norm() / world.norm();
                R = rotation_fit(&measured, &points(explained.as_slice()))?;
            }
            Some((R, rest))
        });
        found.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Returns the residual of the positions over their spread, with each instrument at its best fit.
fn place_rest(nominal: &NominalArm, measurements: &Measurements) -> Option<f64> {
    let arm = MeasuredArm { nominal, parameters: &[], measurements };
    let (predicted, measured) = (points(&arm.predicted(&DVector::zeros(0)).ok()?), points(&arm.observed()));
    let (mut rest, mut spread) = (0.0, 0.0);
    for number in 0..measurements.instruments.len() {
        let own: Vec<usize> = (0..measured.len())
            .filter(|k| {
                matches!(measurements.readings[*k].kind, ReadingKind::Place { instrument, .. } if instrument == number)
            })
            .collect();
        let chosen = |all: &[Vector3<f64>]| own.iter().map(|k| all[*k]).collect::<Vec<_>>();
        let (p, q) = (chosen(&predicted), chosen(&measured));
        if q.len() < 5 {
            continue;
        }
        // Pose of the instrument that fits its readings best.
        let X = rigid_fit(&p, &q)?;
        let mean = q.iter().sum::<Vector3<f64>>() / q.len() as f64;
        for (p, q) in p.iter().zip(&q) {
            rest += (X.rotation * p + X.translation.vector - q).norm_squared();
            spread += (q - mean).norm_squared();
        }
    }
    (spread > 0.0).then(|| (rest / spread).sqrt())
}
