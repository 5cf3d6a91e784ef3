//! Inverse kinematics of redundant arms: a rule selects one of the family of solutions.
//!
//! ```text
//! minimise ½ (q - r)ᵀ W (q - r)    subject to  X_WT(q) = X,  lower <= q <= upper
//! ```
//! [`inverse_kinematics`] reaches the pose. Steps in the null space of the Jacobian, each followed
//! by a return to the pose, then reduce the measure: `d = -N (Nᵀ W N)⁻¹ Nᵀ W (q - r)` with N a
//! basis of the null space [Liégeois 1977]. Joints at a limit that a step would exceed stay there.
//! The result is a local minimum near the start. Start at [`inverse_kinematics_with_rule`].

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, DVector, Matrix6xX};

use crate::data::Data;
use crate::inverse_kinematics::{IkError, IkOptions, inverse_kinematics};
use crate::kinematics::{forward_kinematics, frame_jacobian};
use crate::many_starts::coordinates_of;
use crate::model::{Frame, Model};

/// Rule for the use of the redundant freedom.
#[derive(Clone, Debug, PartialEq)]
pub enum NullSpaceRule {
    /// Stay near this posture (nv long, rad or m): W = 1.
    NearestTo(DVector<f64>),
    /// Stay near the middle of the joint ranges, relative to half of each range; joints without
    /// limits have no weight.
    AwayFromLimits,
}

/// Solution under a rule.
#[derive(Clone, Debug, PartialEq)]
pub struct RuledSolution {
    /// All coordinates, nv long.
    pub q: DVector<f64>,
    /// `½ (q - r)ᵀ W (q - r)`.
    pub measure: f64,
    /// Number of null-space steps.
    pub steps: usize,
    /// Whether it converged: the last step was below 1e-8 (rad or m) or no step reduced the measure
    /// any more. False if the number of steps ran out.
    pub settled: bool,
}

/// Finds joint values that bring `frame` to `X_WT` and locally minimise the measure of the rule.
///
/// Coordinates that do not move the frame stay as in `q_start` (nv long). If the pose leaves no
/// freedom, the result is that of [`inverse_kinematics`].
///
/// # Errors
/// [`IkError`] if the target is not reached within tolerance.
///
/// # Panics
/// If `q_start` or the posture of the rule is not nv long.
pub fn inverse_kinematics_with_rule(
    model: &Model,
    data: &mut Data,
    frame: &Frame,
    X_WT: &Pose,
    q_start: &DVector<f64>,
    options: &IkOptions,
    rule: &NullSpaceRule,
) -> Result<RuledSolution, IkError> {
    let coordinates: Vec<usize> = coordinates_of(model, frame).into_iter().map(|(k, _)| k).collect();
    let rule = Measure::new(model, rule, &coordinates);
    let mut q = inverse_kinematics(model, data, frame, X_WT, q_start, options)?;
    let mut measure = rule.at(&q);
    for steps in 0..options.max_iterations {
        let step = rule.step(model, data, frame, &q, options.characteristic_length_m);
        if step.amax() < 1e-8 {
            return Ok(RuledSolution { q, measure, steps, settled: true });
        }
        let mut part = rule.largest_part(&q, &step).min(0.5 / step.amax()).min(1.0);
        let mut next = None;
        while next.is_none() && part * step.amax() > 1e-9 {
            let trial = inverse_kinematics(model, data, frame, X_WT, &(&q + &step * part), options);
            next = trial.ok().filter(|trial| rule.at(trial) < measure);
            part *= 0.5;
        }
        // At rounding level no step improves the measure.
        let Some(next) = next else { return Ok(RuledSolution { q, measure, steps, settled: true }) };
        q = next;
        measure = rule.at(&q);
    }
    Ok(RuledSolution { q, measure, steps: options.max_iterations, settled: false })
}

/// `½ (q - r)ᵀ W (q - r)` over the coordinates that move the frame.
struct Measure {
    items: Vec<WeightedCoordinate>,
}

struct WeightedCoordinate {
    /// Coordinate.
    k: usize,
    /// Entry of r and of the diagonal of W.
    middle: f64,
    weight: f64,
    lower: f64,
    upper: f64,
}

impl Measure {
    fn new(model: &Model, rule: &NullSpaceRule, coordinates: &[usize]) -> Self {
        if let NullSpaceRule::NearestTo(rest) = rule {
            assert_eq!(rest.len(), model.nv(), "the posture needs one value per coordinate");
        }
        let item = |&k: &usize| {
            let limits = model.coordinates()[k].limits;
            let half = 0.5 * (limits.upper - limits.lower);
            let (middle, weight) = match rule {
                NullSpaceRule::NearestTo(rest) => (rest[k], 1.0),
                NullSpaceRule::AwayFromLimits if half.is_finite() && half > 0.0 => (limits.lower + half, half.powi(-2)),
                NullSpaceRule::AwayFromLimits => (0.0, 0.0),
            };
            WeightedCoordinate { k, middle, weight, lower: limits.lower, upper: limits.upper }
        };
        Self { items: coordinates.iter().map(item).collect() }
    }

    fn at(&self, q: &DVector<f64>) -> f64 {
        self.items.iter().map(|i| 0.5 * i.weight * (q[i.k] - i.middle).powi(2)).sum()
    }

    /// Null-space step, nv long; joints that it would push beyond their limits stay there.
    fn step(&self, model: &Model, data: &mut Data, frame: &Frame, q: &DVector<f64>, length: f64) -> DVector<f64> {
        forward_kinematics(model, data, q);
        let mut J = Matrix6xX::zeros(model.nv());
        frame_jacobian(model, data, frame, &mut J);
        let mut free: Vec<&WeightedCoordinate> = self.items.iter().collect();
        loop {
            let n = free.len();
            let Jf = DMatrix::from_fn(6, n, |r, c| J[(r, free[c].k)] / if r < 3 { length } else { 1.0 });
            let step = null_space_step(&Jf, &free, q);
            let pushed = |(i, d): (&&WeightedCoordinate, &f64)| {
                (q[i.k] <= i.lower && *d < 0.0) || (q[i.k] >= i.upper && *d > 0.0)
            };
            let Some(out) = free.iter().zip(step.iter()).position(pushed) else {
                let mut all = DVector::zeros(model.nv());
                for (i, d) in free.iter().zip(step.iter()) {
                    all[i.k] = *d;
                }
                return all;
            };
            free.remove(out);
        }
    }

    /// Fraction of the step up to the first limit.
    fn largest_part(&self, q: &DVector<f64>, step: &DVector<f64>) -> f64 {
        let part = |i: &WeightedCoordinate| match step[i.k] {
            d if d > 0.0 => (i.upper - q[i.k]) / d,
            d if d < 0.0 => (i.lower - q[i.k]) / d,
            _ => f64::INFINITY,
        };
        self.items.iter().map(part).fold(f64::INFINITY, f64::min)
    }
}

/// `-N (Nᵀ W N)⁺ Nᵀ W (q - r)`.
fn null_space_step(J: &DMatrix<f64>, free: &[&WeightedCoordinate], q: &DVector<f64>) -> DVector<f64> {
    let n = free.len();
    if n == 0 {
        return DVector::zeros(0);
    }
    // N: eigenvectors of JᵀJ with zero eigenvalue.
    let eigen = J.tr_mul(J).symmetric_eigen();
    let floor = 1e-12 * eigen.eigenvalues.max();
    let null: Vec<usize> = (0..n).filter(|&i| eigen.eigenvalues[i] <= floor).collect();
    if null.is_empty() {
        return DVector::zeros(n);
    }
    // Gradient and Hessian of the measure in the null space.
    let N = DMatrix::from_fn(n, null.len(), |r, c| eigen.eigenvectors[(r, null[c])]);
    let WN = DMatrix::from_fn(n, null.len(), |r, c| free[r].weight * N[(r, c)]);
    let gradient = WN.tr_mul(&DVector::from_fn(n, |i, _| q[free[i].k] - free[i].middle));
    let A = N.tr_mul(&WN);
    let cutoff = 1e-10 * A.amax();
    let inverse = A.pseudo_inverse(cutoff).unwrap_or_else(|_| DMatrix::zeros(null.len(), null.len()));
    -(N * (inverse * gradient))
}
