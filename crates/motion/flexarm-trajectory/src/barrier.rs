//! Interior-point method for the convex programs of [`crate::jerk_law`]: minimises the travel time
//! of a cubic spline within its bounds.
//!
//! ```text
//! minimise  T(c) = Σ w_g y(θ_g)^(-1/2)      y(θ) = Σ c_i B_i(θ)      w_g: Gauss weights, s     (1)
//! within    f c < 1                         linear bounds                                     (2)
//!           |f c| < y^(-1/2)                bounds of the jerk, e c = y                        (3)
//! ```
//! For falling `mu`, Newton's method minimises `T - mu Σ ln(slack)`; four neighbouring coefficients
//! occur in each term, so that the Hessian has three superdiagonals and a step costs O(n).
//!
//! Start at [`improved`]. Not here: what the bounds mean ([`crate::jerk_law`]).
#![allow(non_snake_case, reason = "letters of the formulas")]

use crate::jerk_law::{PathBounds, QuinticLaw};
use crate::time_law::Progress;

/// Factor by which the weight of the barrier decreases.
const FALL: f64 = 0.1;
/// Maximum number of Newton steps for one weight.
const STEPS: usize = 40;
/// Maximum number of halvings of a step.
const HALVINGS: usize = 40;
/// Newton's method ends for a weight when the decrement is below this fraction of the weight.
const CENTRED: f64 = 0.05;
/// The search starts at this fraction of the tightest bound.
const INSIDE: f64 = 0.95;
/// Places within an interval at which the bounds are enforced, as fractions of the interval.
const PARTS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Three-point Gauss quadrature on 0 to 1: points and weights.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Times, speeds and accelerations at the nodes of the improved law; see [`QuinticLaw::improved`].
pub(crate) fn improved(
    law: &QuinticLaw,
    gap: [f64; 2],
    place: &mut dyn FnMut(usize, f64) -> PathBounds,
) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let problem = Problem::new(law, place);
    let n = law.t.len();
    let mut c = problem.inside(n + 2);
    problem.minimise(&mut c, gap);
    let (mut t, mut v, mut a) = (vec![0.0], Vec::new(), Vec::new());
    for k in 0..n {
        let interval = k.min(n - 2);
        let [y, u, _] = problem.spline.at(interval, law.t[k]).map(|f| dot(&f, &c[interval..]));
        if k > 0 {
            let times = &problem.times[GAUSS.len() * (k - 1)..GAUSS.len() * k];
            t.push(t[k - 1] + times.iter().map(|time| time.at(&c)).sum::<f64>());
        }
        v.push(law.v[k] * y.sqrt());
        a.push(law.a[k] * y + law.v[k] * u);
    }
    (t, v, a)
}

/// `f c < 1` for the four coefficients `c` from index `i` on.
struct Linear {
    i: usize,
    f: [f64; 4],
}

/// `|f c| < (e c)^(-1/2)` for the four coefficients `c` from index `i` on.
struct Third {
    i: usize,
    f: [f64; 4],
    e: [f64; 4],
}

/// `weight (e c)^(-1/2)`, s.
struct Time {
    i: usize,
    e: [f64; 4],
    weight: f64,
}

impl Time {
    fn at(&self, c: &[f64]) -> f64 {
        self.weight / dot(&self.e, &c[self.i..]).sqrt()
    }
}

fn dot(f: &[f64; 4], c: &[f64]) -> f64 {
    f[0] * c[0] + f[1] * c[1] + f[2] * c[2] + f[3] * c[3]
}

/// Cubic B-splines on a sequence of nodes.
struct Spline {
    /// Knots: the nodes, with the first and the last repeated four times.
    knots: Vec<f64>,
}

impl Spline {
    fn new(nodes: &[f64]) -> Self {
        let mut knots = vec![nodes[0]; 3];
        knots.extend_from_slice(nodes);
        knots.extend([nodes[nodes.len() - 1]; 3]);
        Self { knots }
    }

    /// Values, half the first and half the second derivatives at `theta` of the four B-splines that
    /// are not zero on interval `k` [de Boor 1978].
    fn at(&self, k: usize, theta: f64) -> [[f64; 4]; 3] {
        let (K, m) = (&self.knots, k + 3);
        // Length of the support of spline i of degree p.
        let length = |i: usize, p: usize| K[i + p + 1] - K[i];
        // B[p][1 + j] is spline m - p + j of degree p; zero padding on both sides.
        let mut B = [[0.0; 5]; 4];
        B[0][1] = 1.0;
        for p in 1..4 {
            for j in 0..=p {
                let i = m - p + j;
                let left = if j > 0 { (theta - K[i]) / length(i, p - 1) * B[p - 1][j] } else { 0.0 };
                let right = if j < p { (K[i + p + 1] - theta) / length(i + 1, p - 1) * B[p - 1][j + 1] } else { 0.0 };
                B[p][1 + j] = left + right;
            }
        }
        // Derivatives of the splines of degree p from the values (or derivatives) of those of
        // degree p - 1.
        let derive = |p: usize, lower: &[f64; 5]| {
            let mut D = [0.0; 5];
            for j in 0..=p {
                let i = m - p + j;
                let left = if j > 0 { lower[j] / length(i, p - 1) } else { 0.0 };
                let right = if j < p { lower[j + 1] / length(i + 1, p - 1) } else { 0.0 };
                D[1 + j] = p as f64 * (left - right);
            }
            D
        };
        let (first, second) = (derive(3, &B[2]), derive(3, &derive(2, &B[1])));
        let four = |B: &[f64; 5], part: f64| [1, 2, 3, 4].map(|j| part * B[j]);
        [four(&B[3], 1.0), four(&first, 0.5), four(&second, 0.5)]
    }
}

/// All bounds and the duration as functions of the spline coefficients.
struct Problem {
    spline: Spline,
    linear: Vec<Linear>,
    third: Vec<Third>,
    times: Vec<Time>,
}

/// Symmetric matrix with three superdiagonals; each row holds the diagonal entry and those right of
/// it.
type Banded = Vec<[f64; 4]>;

impl Problem {
    fn new(law: &QuinticLaw, place: &mut dyn FnMut(usize, f64) -> PathBounds) -> Self {
        let spline = Spline::new(&law.t);
        let mut problem = Self { spline, linear: Vec::new(), third: Vec::new(), times: Vec::new() };
        for k in 0..law.t.len() - 1 {
            let h = law.t[k + 1] - law.t[k];
            for part in PARTS {
                let at = law.within(k, part * h);
                problem.keep(k, law.t[k] + part * h, &at, &place(k, at.s).pruned());
            }
            for (part, weight) in GAUSS {
                let [e, ..] = problem.spline.at(k, law.t[k] + part * h);
                problem.times.push(Time { i: k, e, weight: weight * h });
            }
        }
        problem
    }

    /// Adds the bounds at one place of interval `i`.
    fn keep(&mut self, i: usize, theta: f64, at: &Progress, place: &PathBounds) {
        let [y, u, w] = self.spline.at(i, theta);
        let (v, x) = (at.v, at.v * at.v);
        let form = |on_w: f64, on_u: f64, on_y: f64| [0, 1, 2, 3].map(|n| on_w * w[n] + on_u * u[n] + on_y * y[n]);
        if place.x_max.is_finite() {
            self.below(i, form(0.0, 0.0, x), place.x_max);
        }
        for bound in &place.bounds {
            let f = form(0.0, bound.a * v, bound.a * at.a + bound.b * x);
            self.below(i, f, bound.high);
            self.below(i, f, bound.low);
        }
        for bound in &place.jerks {
            let on_y = bound.c * v * x + bound.b * v * at.a + bound.a * at.j;
            let f = form(bound.a * v, bound.b * x + 3.0 * bound.a * at.a, on_y).map(|f| f / bound.most);
            if f != [0.0; 4] {
                self.third.push(Third { i, f, e: y });
            }
        }
    }

    /// Adds `f c <= most` for positive `most`, `f c >= most` for negative `most`.
    fn below(&mut self, i: usize, f: [f64; 4], most: f64) {
        if most.is_finite() && f != [0.0; 4] {
            self.linear.push(Linear { i, f: f.map(|f| f / most) });
        }
    }

    /// Coefficients of the given law, slowed uniformly until it is strictly inside all bounds.
    fn inside(&self, n: usize) -> Vec<f64> {
        let ones = [1.0; 4];
        let linear = self.linear.iter().map(|bound| dot(&bound.f, &ones)).fold(0.0, f64::max);
        let third = self.third.iter().map(|bound| dot(&bound.f, &ones).abs()).fold(0.0, f64::max);
        let most = linear.max(third.powf(2.0 / 3.0));
        vec![if most > 0.0 { INSIDE / most } else { 1.0 }; n]
    }

    fn duration(&self, c: &[f64]) -> f64 {
        self.times.iter().map(|time| time.at(c)).sum()
    }

    /// Barrier function: duration minus `mu` times the sum of the logarithms of all slacks;
    /// infinite outside.
    fn value(&self, c: &[f64], mu: f64) -> f64 {
        let mut logs = Logs { product: 1.0, sum: 0.0 };
        for bound in &self.linear {
            logs.add(1.0 - dot(&bound.f, &c[bound.i..]));
        }
        for bound in &self.third {
            let ratio = dot(&bound.f, &c[bound.i..]) * dot(&bound.e, &c[bound.i..]).sqrt();
            logs.add(1.0 - ratio);
            logs.add(1.0 + ratio);
        }
        let value = self.duration(c) - mu * logs.total();
        if value.is_nan() { f64::INFINITY } else { value }
    }

    /// Gradient and Hessian of the barrier function; the Hessian omits the non-convex part of the
    /// jerk bounds.
    fn derivatives(&self, c: &[f64], mu: f64, g: &mut [f64], H: &mut Banded) {
        g.fill(0.0);
        H.fill([0.0; 4]);
        let mut add = |i: usize, f: &[f64; 4], first: f64, second: f64| {
            for j in 0..4 {
                g[i + j] += first * f[j];
                for l in j..4 {
                    H[i + j][l - j] += second * f[j] * f[l];
                }
            }
        };
        // (1): dT = -T/(2 y) e, d²T = 3 T/(4 y²) e eᵀ.
        for time in &self.times {
            let (t, y) = (time.at(c), dot(&time.e, &c[time.i..]));
            add(time.i, &time.e, -0.5 * t / y, 0.75 * t / (y * y));
        }
        // (2) and (3): -mu ln(slack), both signs of (3).
        for bound in &self.linear {
            let slack = 1.0 - dot(&bound.f, &c[bound.i..]);
            add(bound.i, &bound.f, mu / slack, mu / (slack * slack));
        }
        for bound in &self.third {
            let (y, value) = (dot(&bound.e, &c[bound.i..]), dot(&bound.f, &c[bound.i..]));
            let most = 1.0 / y.sqrt();
            for sign in [1.0, -1.0] {
                let slack = most - sign * value;
                let d = [0, 1, 2, 3].map(|j| -0.5 * most / y * bound.e[j] - sign * bound.f[j]);
                add(bound.i, &d, -mu / slack, mu / (slack * slack));
            }
        }
    }

    /// Replaces coefficients inside all bounds by those of the shortest duration.
    fn minimise(&self, c: &mut Vec<f64>, gap: [f64; 2]) {
        let n = c.len();
        let (mut g, mut H, mut trial) = (vec![0.0; n], vec![[0.0; 4]; n], vec![0.0; n]);
        let count = (self.linear.len() + 2 * self.third.len()) as f64;
        let mut mu = gap[0] * self.duration(c) / count.max(1.0);
        loop {
            let mut value = self.value(c, mu);
            for _ in 0..STEPS {
                self.derivatives(c, mu, &mut g, &mut H);
                let Some(step) = solve(&mut H, &g) else { break };
                // Newton decrement: the fall of the barrier function to first order.
                let gain: f64 = g.iter().zip(&step).map(|(g, d)| g * d).sum();
                if gain < CENTRED * mu {
                    break;
                }
                // Longest step among 1, 1/2, 1/4, ... that decreases the function enough.
                let found = (0..HALVINGS).find_map(|k| {
                    let part = 0.5f64.powi(k as i32);
                    trial.iter_mut().zip(c.iter().zip(&step)).for_each(|(trial, (c, d))| *trial = c - part * d);
                    let there = self.value(&trial, mu);
                    (there <= value - 0.1 * part * gain).then_some(there)
                });
                let Some(there) = found else { break };
                value = there;
                std::mem::swap(c, &mut trial);
            }
            // Duality gap: each bound contributes `mu`.
            if mu * count < gap[1] * self.duration(c) {
                return;
            }
            mu *= FALL;
        }
    }
}

/// Sum of logarithms, accumulated as logarithms of products that neither overflow nor underflow.
struct Logs {
    product: f64,
    sum: f64,
}

impl Logs {
    fn add(&mut self, slack: f64) {
        if slack > 0.0 {
            self.product *= slack;
        } else {
            (self.product, self.sum) = (1.0, f64::NEG_INFINITY);
        }
        if !(1e-200..1e200).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }

    fn total(&self) -> f64 {
        self.sum + self.product.ln()
    }
}

/// Solves a positive definite system and replaces the matrix by its factors; `None` if it is not
/// positive definite.
fn solve(H: &mut Banded, g: &[f64]) -> Option<Vec<f64>> {
    // H = Lᵀ D L, with row k of L right of the diagonal; forward substitution goes along.
    let n = g.len();
    let mut x = g.to_vec();
    for k in 0..n {
        let d = H[k][0];
        if !(d > 0.0 && d.is_finite()) {
            return None;
        }
        let row = [1, 2, 3].map(|i| H[k][i] / d);
        for i in 1..4.min(n - k) {
            for l in i..4.min(n - k) {
                H[k + i][l - i] -= row[i - 1] * row[l - 1] * d;
            }
            x[k + i] -= row[i - 1] * x[k];
        }
        H[k] = [d, row[0], row[1], row[2]];
    }
    // Division by D and back substitution.
    for k in (0..n).rev() {
        x[k] /= H[k][0];
        for i in 1..4.min(n - k) {
            x[k] -= H[k][i] * x[k + i];
        }
    }
    Some(x)
}
