//! Slips in a file of measurements that no stiffness explains: joints in another order,
//! displacements in other axes.
//!
//! Displacements are nearly linear in the compliances of the springs,
//!
//! ```text
//! d ≈ -Σ a_k ∂d/∂(ln k_k),     a_k ≥ 0: compliance over that of the arm as it is
//! ```
//! so that each order of joints and each rotation of the axes leaves a rest that no compliances
//! explain, whatever the first guess of the stiffnesses is. A slip is told if the rest is large and
//! another order or other axes leave almost nothing.

use flexarm_kinematics::Pose;
use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use crate::estimation::identify::{points, rigid_fit, rotation_fit};
use crate::estimation::least_squares::Residuals;
use crate::estimation::measurement::MeasuredArm;
use crate::estimation::parameter::{Effect, Parameter, Plant};
use crate::estimation::reading::{Component, Instrument, Measurements, ReadingKind, Target};

/// What explains readings that the arm does not.
#[derive(Clone, Debug, PartialEq)]
pub enum Slip {
    /// Of each joint the place at which its value stands.
    Order(Vec<usize>),
    /// Rotation that brings the measured displacements into world axes.
    Axes(Rotation3<f64>),
}

/// A slip, and the parts of the readings that are left without a cause.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSlip {
    /// Which.
    pub slip: Slip,
    /// Rest over readings (RMS) as they are.
    pub rest: f64,
    /// The same with the slip mended.
    pub rest_mended: f64,
}

/// Smallest rest, over the displacements, that calls for a slip; of places over their spread.
const REST: [f64; 2] = [0.25, 0.1];
/// A mended slip leaves this part of the rest at most, and so much of the displacements, of the
/// places' spread.
const MENDED: f64 = 1.0 / 3.0;
const LEFT: [f64; 2] = [0.15, 0.05];
/// Readings that are looked at.
const MOST_READINGS: usize = 16;
/// Rounds of compliances and rotation.
const ROUNDS: usize = 15;

/// Returns the slip that explains what the arm cannot; none if the arm can, or nothing simple
/// explains it.
///
/// * `slides`: of each joint whether it slides; values of both kinds are not exchanged.
pub fn likely_slip(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    slides: &[bool],
) -> Option<FoundSlip> {
    let is_spring = |p: &&Parameter| matches!(p.effect, Effect::Stiffness(_));
    let springs: Vec<Parameter> = parameters.iter().filter(is_spring).cloned().collect();
    let moved = some_of(measurements, |kind| match kind {
        ReadingKind::Displacement { rows, .. } => rows.iter().all(|row| matches!(row.of, Component::Along(_))),
        _ => false,
    });
    let found = (!springs.is_empty() && moved.rows() >= 3 * springs.len()).then(|| {
        let rest = |order: &[usize]| Some(Moved::of(plant, &springs, &ordered(&moved, order))?.rest());
        let whole = moved.readings.iter().all(|reading| reading.rows() == 3);
        let axes = || Moved::of(plant, &springs, &moved).filter(|_| whole)?.turned();
        among(rest, axes, slides, 0)
    });
    let placed = some_of(measurements, |kind| matches!(kind, ReadingKind::Place { .. }));
    let rest = |order: &[usize]| place_rest(plant, &ordered(&placed, order));
    found.flatten().or_else(|| among(rest, || None, slides, 1))
}

/// Some readings, evenly from all of them; instruments at the world's origin, targets where they
/// are guessed.
fn some_of(measurements: &Measurements, some: impl Fn(&ReadingKind) -> bool) -> Measurements {
    let all: Vec<usize> = (0..measurements.readings.len()).filter(|k| some(&measurements.readings[*k].kind)).collect();
    let every = all.len().div_ceil(MOST_READINGS).max(1);
    let kept: Vec<usize> = all.into_iter().step_by(every).collect();
    let mut few = measurements.of_readings(|k| kept.contains(&k));
    few.instruments.iter_mut().for_each(|i| *i = Instrument::Known(Pose::identity()));
    few.targets.iter_mut().for_each(|t| {
        if let Target::Unknown(guess) = t {
            *t = Target::Known(*guess);
        }
    });
    few
}

/// The readings with each joint's value from another place.
fn ordered(measurements: &Measurements, order: &[usize]) -> Measurements {
    let mut other = measurements.clone();
    other.readings.iter_mut().for_each(|reading| reading.q = order.iter().map(|k| reading.q[*k]).collect());
    other
}

/// The best slip of those that leave little of a rest which calls for one; `kind`: 0 for
/// displacements, 1 for places.
fn among(
    rest: impl Fn(&[usize]) -> Option<f64>,
    axes: impl Fn() -> Option<(Rotation3<f64>, f64)>,
    slides: &[bool],
    kind: usize,
) -> Option<FoundSlip> {
    let as_said: Vec<usize> = (0..slides.len()).collect();
    let before = rest(&as_said).filter(|rest| *rest > REST[kind])?;
    let order = best_order(&rest, as_said, before, slides);
    let axes = axes().map(|(R, rest)| (Slip::Axes(R), rest));
    let found = [Some((Slip::Order(order.0), order.1)), axes].into_iter().flatten();
    let (slip, rest_mended) = found.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (rest_mended < (MENDED * before).min(LEFT[kind])).then_some(FoundSlip { slip, rest: before, rest_mended })
}

/// The order of joints that leaves least: from the order as it is, the reverse and the shifts by
/// exchanges as long as one pays.
fn best_order(
    rest: &impl Fn(&[usize]) -> Option<f64>,
    as_said: Vec<usize>,
    before: f64,
    slides: &[bool],
) -> (Vec<usize>, f64) {
    let n = as_said.len();
    let alike = |order: &[usize]| order.iter().enumerate().all(|(k, from)| slides[k] == slides[*from]);
    let scored = |order: Vec<usize>| alike(&order).then(|| rest(&order).map(|rest| (order, rest))).flatten();
    let others = (1..n).map(|by| (0..n).map(|k| (k + by) % n).collect()).chain([(0..n).rev().collect()]);
    let begins = others.filter_map(scored).chain([(as_said, before)]);
    let least = |a: &(Vec<usize>, f64), b: &(Vec<usize>, f64)| a.1.total_cmp(&b.1);
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

/// Displacements, and those of each spring alone, over their deviations.
struct Moved {
    A: DMatrix<f64>,
    b: DVector<f64>,
}

impl Moved {
    fn of(plant: &Plant, springs: &[Parameter], measurements: &Measurements) -> Option<Self> {
        let arm = MeasuredArm { plant, parameters: springs, measurements };
        let mut J = DMatrix::zeros(0, 0);
        arm.evaluate(&DVector::zeros(springs.len()), Some(&mut J)).ok()?;
        let deviations = measurements.readings.iter().flat_map(crate::estimation::reading::Reading::deviations);
        let b = arm.observed().iter().zip(deviations).map(|(value, std)| value / std).collect::<Vec<_>>();
        Some(Self { A: -J, b: DVector::from_vec(b) })
    }

    /// What the springs explain with compliances of 0 or above: the most negative one is left out
    /// until none is.
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

    /// The rotation into world axes that leaves least, and what it leaves: in turn the best
    /// compliances and the best rotation, from all axes that stand on those of the world.
    fn turned(&self) -> Option<(Rotation3<f64>, f64)> {
        let seen = points(self.b.as_slice());
        let upright = [Vector3::x(), Vector3::y(), Vector3::z()];
        let signed: Vec<Vector3<f64>> = upright.iter().flat_map(|v| [*v, -v]).collect();
        let begins = signed.iter().flat_map(|x| signed.iter().filter(|y| x.dot(y) == 0.0).map(move |y| (*x, *y)));
        let found = begins.filter_map(|(x, y)| {
            let mut R = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]));
            let mut rest = f64::INFINITY;
            for _ in 0..ROUNDS {
                let world: Vec<f64> = seen.iter().flat_map(|v| (R * v).iter().copied().collect::<Vec<_>>()).collect();
                let world = DVector::from_vec(world);
                let explained = self.explained(&world);
                rest = (&world - &explained).norm() / world.norm();
                R = rotation_fit(&seen, &points(explained.as_slice()))?;
            }
            Some((R, rest))
        });
        found.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// What the best placement of each instrument leaves of the places, over their spread.
fn place_rest(plant: &Plant, measurements: &Measurements) -> Option<f64> {
    let arm = MeasuredArm { plant, parameters: &[], measurements };
    let (world, seen) = (points(&arm.predicted(&DVector::zeros(0)).ok()?), points(&arm.observed()));
    let (mut rest, mut spread) = (0.0, 0.0);
    for number in 0..measurements.instruments.len() {
        let own: Vec<usize> = (0..seen.len())
            .filter(|k| {
                matches!(measurements.readings[*k].kind, ReadingKind::Place { instrument, .. } if instrument == number)
            })
            .collect();
        let of = |all: &[Vector3<f64>]| own.iter().map(|k| all[*k]).collect::<Vec<_>>();
        let (world, seen) = (of(&world), of(&seen));
        if seen.len() < 5 {
            continue;
        }
        let X = rigid_fit(&world, &seen)?;
        let middle = seen.iter().sum::<Vector3<f64>>() / seen.len() as f64;
        for (p, q) in world.iter().zip(&seen) {
            rest += (X.rotation * p + X.translation.vector - q).norm_squared();
            spread += (q - middle).norm_squared();
        }
    }
    (spread > 0.0).then(|| (rest / spread).sqrt())
}
