//! Moves through via points: the smoothest curve from rest to rest through all of them.
//!
//! Between the points each joint follows a quintic; velocity, acceleration, jerk and snap are
//! continuous at the points, velocity and acceleration vanish at both ends. Of all curves through
//! the points this one has the smallest integral of the squared jerk [Flash and Hogan 1985].
//! Without a via point it is the quintic `u³ (10 - 15 u + 6 u²)`; so it is with via points on the
//! straight line, because the times are chosen as follows:
//!
//! ```text
//! chord     d_i = max over joints of |Δq_j| / w_j,      w_j a velocity limit or 1
//! fraction  s_i = (d_1 + ... + d_i) / (d_1 + ... + d_n)
//! time      u_i = s⁻¹(s_i),                             s the quintic
//! ```

use crate::polynomial::Piece;

/// Returns the times `0 = u_0 < u_1 < ... < u_n = 1` at which the points are passed.
///
/// * `points`: start, via points, goal; each with one value per joint.
/// * `weights`: unit of travel of each joint.
///
/// # Errors
///
/// The index of a point that equals the previous one.
pub fn passing_times(points: &[&[f64]], weights: &[f64]) -> Result<Vec<f64>, usize> {
    let mut ways = vec![0.0];
    let mut total = 0.0;
    for (i, pair) in points.windows(2).enumerate() {
        let steps = pair[0].iter().zip(pair[1]).zip(weights).map(|((a, b), w)| (b - a).abs() / w);
        let chord = steps.fold(0.0, f64::max);
        total += chord;
        ways.push(total);
        // A chord below the rounding of the total travel would not advance the time.
        if total <= ways[i] {
            return Err(i + 1);
        }
    }
    let times: Vec<f64> = ways.iter().map(|way| time_of_fraction(way / total)).collect();
    match times.windows(2).position(|pair| pair[1] - pair[0] < 1e-9) {
        Some(i) => Err(i + 1),
        None => Ok(times),
    }
}

/// Inverse of `s(u) = u³ (10 - 15 u + 6 u²)` by bisection.
fn time_of_fraction(s: f64) -> f64 {
    if s <= 0.0 || s >= 1.0 {
        return s.clamp(0.0, 1.0);
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let u: f64 = 0.5 * (low + high);
        if u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u) < s {
            low = u;
        } else {
            high = u;
        }
    }
    0.5 * (low + high)
}

/// Returns the quintic spline through `q` at the times `u`, at rest at both ends; one piece per
/// interval.
///
/// The unknowns are velocity and acceleration at the inner knots. Continuity of jerk and snap
/// there,
///
/// ```text
/// jerk(0) =   60 Δ/h³ - (36 v0 + 24 v1)/h² - ( 9 a0 -  3 a1)/h
/// jerk(h) =   60 Δ/h³ - (24 v0 + 36 v1)/h² - ( 3 a0 -  9 a1)/h
/// snap(0) = -360 Δ/h⁴ + (192 v0 + 168 v1)/h³ + (36 a0 - 24 a1)/h²
/// snap(h) =  360 Δ/h⁴ - (168 v0 + 192 v1)/h³ - (24 a0 - 36 a1)/h²
/// ```
/// is a block-tridiagonal system with 2×2 blocks, solved by elimination from left to right.
pub fn rest_to_rest_spline(u: &[f64], q: &[f64]) -> Vec<Piece> {
    let n = u.len() - 1;
    let width: Vec<f64> = u.windows(2).map(|pair| pair[1] - pair[0]).collect();

    // Row of knot i: lower x[i-1] + diagonal x[i] + upper x[i+1] = rhs with x = (v, a). After
    // elimination x[i] = g[i] - E[i] x[i+1]; at the ends x = 0.
    let mut eliminated: Vec<([[f64; 2]; 2], [f64; 2])> = vec![([[0.0; 2]; 2], [0.0; 2])];
    for i in 1..n {
        let (h, k) = (width[i - 1], width[i]);
        let (left, right) = (q[i] - q[i - 1], q[i + 1] - q[i]);
        let lower = [[-24.0 / (h * h), -3.0 / h], [-168.0 / h.powi(3), -24.0 / (h * h)]];
        let diagonal = [
            [-36.0 / (h * h) + 36.0 / (k * k), 9.0 / h + 9.0 / k],
            [-192.0 / h.powi(3) - 192.0 / k.powi(3), 36.0 / (h * h) - 36.0 / (k * k)],
        ];
        let upper = [[24.0 / (k * k), -3.0 / k], [-168.0 / k.powi(3), 24.0 / (k * k)]];
        let rhs = [60.0 * (right / k.powi(3) - left / h.powi(3)), -360.0 * (right / k.powi(4) + left / h.powi(4))];

        let (previous_e, previous_g) = eliminated[i - 1];
        let lower_e = multiply(&lower, &previous_e);
        let pivot: [[f64; 2]; 2] = std::array::from_fn(|r| std::array::from_fn(|c| diagonal[r][c] - lower_e[r][c]));
        let carried = apply(&lower, &previous_g);
        let inverse = invert(&pivot);
        let g = apply(&inverse, &[rhs[0] - carried[0], rhs[1] - carried[1]]);
        eliminated.push((multiply(&inverse, &upper), g));
    }

    let mut ends = vec![[0.0; 2]; n + 1];
    for i in (1..n).rev() {
        let (e, g) = eliminated[i];
        let next = apply(&e, &ends[i + 1]);
        ends[i] = [g[0] - next[0], g[1] - next[1]];
    }
    let knot = |i: usize| [q[i], ends[i][0], ends[i][1]];
    (0..n).map(|i| Piece::hermite(width[i], knot(i), knot(i + 1))).collect()
}

fn multiply(a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
    std::array::from_fn(|r| std::array::from_fn(|c| a[r][0] * b[0][c] + a[r][1] * b[1][c]))
}

fn apply(a: &[[f64; 2]; 2], x: &[f64; 2]) -> [f64; 2] {
    std::array::from_fn(|r| a[r][0] * x[0] + a[r][1] * x[1])
}

fn invert(a: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [[a[1][1] / determinant, -a[0][1] / determinant], [-a[1][0] / determinant, a[0][0] / determinant]]
}
