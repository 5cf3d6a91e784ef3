//! Change of the joint commands that compensates a TCP error over time.
//!
//! ```text
//! M ẍ + D ẋ + K x + M_a ü + D_a u̇ + K_a u = 0        J x + J_a u = y
//! H(s) = J_a - J (M s² + D s + K)^-1 (M_a s² + D_a s + K_a)
//! u = A_0 y + A_1 ẏ + ... + A_4 y⁗                     A(s) = H(s)^-1 + O(s⁵)
//! ```
//! with the error -y of the TCP, the change u of the commands and x of the free coordinates, all
//! about the arm linearised along its motion. The inverse is approximated by its series at low
//! frequencies: static, damping, inertia, and higher-order terms. It is valid up to the first
//! natural frequency of the arm with its TCP held, which is well above the first frequency of the
//! arm itself; it needs no time integration, and looks ahead only by derivatives. Each application
//! leaves `1 - H A` of the error. Where that is more than half, the commands are low-pass filtered
//! without phase, so that the iteration converges and noise does not grow. If the numbers of joints
//! and of components differ, A_0 is the pseudo-inverse; near singular poses it is damped.
//!
//! Joints under servos: the series is that of the arm with prescribed motors. It gives the motion
//! of the motors and the torques that they need in addition to the feed-forward; the servo commands
//! for these follow from a small differential equation (`servo`), which is as stable as the servos
//! themselves.
//!
//! Not here: matrices of the arm, which the caller linearises; input shaping (`shaping.rs`).

use nalgebra::{Complex, DMatrix};

use crate::servo::NodeServo;
use crate::signal::LowPass;

/// The arm linearised at an instant of its motion; world axes at the TCP, only the selected
/// components.
///
/// As `Linear` of `flexarm-stepping`: n free coordinates, m commands, k TCP components. Joints
/// under servos are the first of the free coordinates, without drive forces; the columns of their
/// commands are zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Mass, n×n.
    pub M: DMatrix<f64>,
    /// Damping, n×n.
    pub D: DMatrix<f64>,
    /// Tangent stiffness, n×n.
    pub K: DMatrix<f64>,
    /// Forces per command acceleration, n×m.
    pub M_a: DMatrix<f64>,
    /// Forces per command velocity, n×m.
    pub D_a: DMatrix<f64>,
    /// Forces per command, n×m.
    pub K_a: DMatrix<f64>,
    /// TCP Jacobian with respect to the free coordinates, k×n.
    pub J: DMatrix<f64>,
    /// TCP Jacobian with respect to the commands, k×m.
    pub J_a: DMatrix<f64>,
    /// Controllers of the joints that are free coordinates.
    pub servo: Option<NodeServo>,
}

/// Equations of a node with prescribed motors, for its series.
#[derive(Clone, Debug)]
struct Prescribed {
    /// Stiffness, damping, mass of the elastic coordinates, e×e.
    own: [DMatrix<f64>; 3],
    /// The same per command, e×m.
    by_commands: [DMatrix<f64>; 3],
    /// Motor torques per elastic coordinate, d×e.
    motors: [DMatrix<f64>; 3],
    /// Motor torques per command, d×m, without the feed-forward.
    motors_by_commands: [DMatrix<f64>; 3],
    J: DMatrix<f64>,
    J_a: DMatrix<f64>,
}

impl Node {
    fn prescribed(&self) -> Prescribed {
        let axes: &[usize] = self.servo.as_ref().map_or(&[], |servo| &servo.axes);
        let (n, d) = (self.K.nrows(), axes.len());
        let parts = [&self.K, &self.D, &self.M];
        // The column of a motor becomes the column of its command.
        let moved = |by_commands: &DMatrix<f64>, free: &DMatrix<f64>| {
            let mut all = by_commands.clone();
            axes.iter().enumerate().for_each(|(i, k)| all.set_column(*k, &free.column(i)));
            all
        };
        let commands = [moved(&self.K_a, &self.K), moved(&self.D_a, &self.D), moved(&self.M_a, &self.M)];
        let ahead = |k: usize| self.servo.as_ref().map(|servo| &servo.ahead[k]);
        let below = |A: &DMatrix<f64>| A.rows(d, n - d).into_owned();
        let motors = |k: usize| {
            let needed = commands[k].rows(0, d).into_owned();
            ahead(k).map_or_else(|| needed.clone(), |ahead| &needed - ahead)
        };
        Prescribed {
            own: parts.map(|A| A.view((d, d), (n - d, n - d)).into_owned()),
            motors: parts.map(|A| A.view((0, d), (d, n - d)).into_owned()),
            motors_by_commands: [motors(0), motors(1), motors(2)],
            by_commands: [below(&commands[0]), below(&commands[1]), below(&commands[2])],
            J: self.J.columns(d, n - d).into_owned(),
            J_a: moved(&self.J_a, &self.J),
        }
    }
}

/// Reason why an error cannot be compensated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InversionError {
    /// At some instant the joints cannot move the TCP in any of the selected directions.
    #[error("at {t_s:.3} s the joints cannot move the tool in any requested direction")]
    Singular {
        /// Time (s).
        t_s: f64,
    },
    /// The arm has no stiffness in some direction.
    #[error("at {t_s:.3} s the arm has no stiffness in some direction")]
    Slack {
        /// Time (s).
        t_s: f64,
    },
}

/// Fraction of the largest singular value below which the joints move the TCP too little in a
/// direction for a full correction in one step.
const WEAK: f64 = 0.02;
/// Fraction of the error that one application may leave at the highest corrected frequency.
const LEFT: f64 = 0.5;
/// Time in which an error comes to rest at the end of a motion, in time constants of the slowest
/// term of the series.
const COMES_TO_REST: f64 = 3.0;
/// Number of terms of the series.
const ORDER: usize = 5;
/// Frequencies searched for the cutoff (Hz): lowest, highest, ratio of successive ones.
const SEARCH: (f64, f64, f64) = (0.5, 200.0, 1.1);

/// The series of the inverse at a node, m×k each.
#[derive(Clone, Debug)]
struct Series {
    A: [DMatrix<f64>; ORDER],
    /// Torques that the motors of joints under servos need in addition to the feed-forward, d×k
    /// each.
    torques: [DMatrix<f64>; ORDER],
    /// TCP directions that the joints move well, k×r, orthonormal.
    moved: DMatrix<f64>,
}

/// Approximate inverse of the arm along its motion.
#[derive(Clone, Debug)]
pub struct Inversion {
    series: Vec<Series>,
    /// Controllers at the nodes; empty if there are none.
    servos: Vec<NodeServo>,
    spacing_s: f64,
    cutoff_hz: f64,
}

impl Inversion {
    /// Creates the inverse from nodes at uniform times from 0, `spacing_s` apart.
    ///
    /// # Errors
    /// [`InversionError`].
    pub fn new(nodes: &[Node], spacing_s: f64) -> Result<Self, InversionError> {
        let mut cutoff_hz = f64::INFINITY;
        let mut series = Vec::with_capacity(nodes.len());
        for (k, node) in nodes.iter().enumerate() {
            let found = Series::of(node, k as f64 * spacing_s)?;
            cutoff_hz = cutoff_hz.min(found.accurate_up_to_hz(node, cutoff_hz));
            series.push(found);
        }
        let servos = nodes.iter().filter_map(|node| node.servo.clone()).collect();
        Ok(Self { series, servos, spacing_s, cutoff_hz })
    }

    /// Limits the corrected frequencies to this one (Hz).
    #[must_use]
    pub fn below(self, hz: f64) -> Self {
        Self { cutoff_hz: self.cutoff_hz.min(hz), ..self }
    }

    /// Returns the time at which the joints move the TCP in the smallest number of directions (s),
    /// and that number; the other selected directions are not corrected there.
    pub fn fewest_directions(&self) -> Option<(f64, usize)> {
        let each = self.series.iter().enumerate().map(|(k, series)| (k as f64 * self.spacing_s, series.moved.ncols()));
        each.min_by_key(|(_, directions)| *directions)
    }

    /// Returns the highest corrected frequency (Hz).
    pub fn cutoff_hz(&self) -> f64 {
        self.cutoff_hz
    }

    /// Returns the part of an error (k×N, `step_s` (s) apart) above the cutoff.
    pub fn quicker_than_cutoff(&self, y: &DMatrix<f64>, step_s: f64) -> DMatrix<f64> {
        if y.ncols() == 0 {
            return y.clone();
        }
        let (slow, pad) = filtered(y, step_s, self.cutoff_hz);
        y - slow.columns(pad, y.ncols())
    }

    /// Computes the change of the commands that moves the TCP by `y`, below the cutoff.
    ///
    /// * `y`: k×N, a column per time from 0, `step_s` apart. It is continued as constant before the
    ///   start and after the end; over [`Inversion::edge_s`] before the end it is blended into that
    ///   constant.
    ///
    /// Returns m×N.
    pub fn commands(&self, y: &DMatrix<f64>, step_s: f64) -> DMatrix<f64> {
        let m = self.series.first().map_or(0, |series| series.A[0].nrows());
        let N = y.ncols();
        if N == 0 || self.series.is_empty() {
            return DMatrix::zeros(m, N);
        }
        // Derivatives are taken of the curve continued beyond its ends, so that none is one-sided.
        let (smooth, pad) = filtered(&ending_at_rest(y, step_s, self.rest_s()), step_s, self.cutoff_hz);
        let mut derivatives = vec![smooth];
        for order in 1..ORDER {
            derivatives.push(derivative(&derivatives[order - 1], step_s));
        }
        // Σ A_i y⁽ⁱ⁾ of the series `terms`, for `count` columns from `first`.
        let applied = |terms: fn(&Series) -> &[DMatrix<f64>; ORDER], rows: usize, first: usize, count: usize| {
            let mut sum = DMatrix::zeros(rows, count);
            for column in 0..count {
                let time = (first + column) as f64 - pad as f64;
                for (node, weight) in self.nodes_at(time * step_s) {
                    for (A, y) in terms(&self.series[node]).iter().zip(&derivatives) {
                        sum.column_mut(column).gemv(weight, A, &y.column(first + column), 1.0);
                    }
                }
            }
            sum
        };
        let mut u = applied(|series| &series.A, m, pad, N);
        if let Some(servo) = self.servos.first() {
            // Starts before the motion begins, so that it is reached at rest.
            let torques = applied(|series| &series.torques, servo.axes.len(), 0, pad + N);
            let at =
                |column: usize| NodeServo::between(&self.servos, self.nodes_at((column as f64 - pad as f64) * step_s));
            let ahead = NodeServo::leads(at, &torques, step_s);
            for (i, axis) in servo.axes.iter().enumerate() {
                let mut row = u.row_mut(*axis);
                row += ahead.view((i, pad), (1, N));
            }
        }
        u
    }

    /// Returns the time over which an error is modified at its end so that it ends at rest (s). If
    /// the error is known for this much longer than the commands are needed, the commands are not
    /// affected.
    pub fn edge_s(&self) -> f64 {
        self.rest_s() + 1.0 / self.cutoff_hz
    }

    /// Time in which an error comes to rest at the end: slow enough that no term of the series
    /// requires more than the error itself.
    fn rest_s(&self) -> f64 {
        let Some(end) = self.series.last() else { return 0.0 };
        let size = end.A[0].norm();
        let time = |(order, A): (i32, &DMatrix<f64>)| (A.norm() / size).powf(1.0 / f64::from(order));
        let slowest = (1..).zip(&end.A[1..]).map(time).filter(|time| time.is_finite()).fold(0.0, f64::max);
        (COMES_TO_REST * slowest).max(1.0 / self.cutoff_hz)
    }

    /// Indices of the nodes around a time with their weights, those of a cubic B-spline:
    /// interpolated quantities have no kink at a node, so commands have no velocity jump there. At
    /// the ends it is even.
    fn nodes_at(&self, t: f64) -> [(usize, f64); 4] {
        let last = self.series.len() as i64 - 1;
        let at = (t / self.spacing_s).clamp(0.0, last as f64);
        let k = (at as i64).min((last - 1).max(0));
        let u = at - k as f64;
        let inner = |u: f64| (u * u * (3.0 * u - 6.0) + 4.0) / 6.0;
        let weights = [(1.0 - u).powi(3) / 6.0, inner(u), inner(1.0 - u), u.powi(3) / 6.0];
        // Reflected at both ends.
        let number = |i: i64| if i > last { 2 * last - i } else { i.abs() }.clamp(0, last) as usize;
        std::array::from_fn(|i| (number(k - 1 + i as i64), weights[i]))
    }
}

impl Series {
    fn of(node: &Node, t_s: f64) -> Result<Self, InversionError> {
        let arm = node.prescribed();
        // x = X_0 u + X_1 u̇ + X_2 ü + ..., then TCP motion and torques from it.
        // K X_k = -(K_a, D_a, M_a)_k - D X_(k-1) - M X_(k-2), power by power of s.
        let lu = arm.own[0].clone().lu();
        let solve = |F: DMatrix<f64>| lu.solve(&F).map(|x| -x).ok_or(InversionError::Slack { t_s });
        let by = |parts: &[DMatrix<f64>; 3], direct: &[DMatrix<f64>; 3], X: &[DMatrix<f64>], order: usize| {
            let zero = DMatrix::zeros(direct[0].nrows(), direct[0].ncols());
            let sum = direct.get(order).cloned().unwrap_or(zero);
            (0..3).filter(|k| *k <= order && order - k < X.len()).fold(sum, |sum, k| sum + &parts[k] * &X[order - k])
        };
        let mut X: Vec<DMatrix<f64>> = Vec::with_capacity(ORDER);
        for order in 0..ORDER {
            X.push(solve(by(&arm.own, &arm.by_commands, &X, order))?);
        }
        let H: Vec<DMatrix<f64>> = X.iter().map(|X| &arm.J * X).collect();
        let H_0 = &arm.J_a + &H[0];
        let (A_0, moved) = damped_inverse(&H_0).ok_or(InversionError::Singular { t_s })?;
        // H(s) A(s) = 1, power by power.
        let mut A = vec![A_0];
        for order in 1..ORDER {
            let sum = (1..=order).fold(DMatrix::zeros(H_0.nrows(), H_0.nrows()), |sum, k| sum + &H[k] * &A[order - k]);
            A.push(-(&A[0] * sum));
        }
        let T: Vec<DMatrix<f64>> = (0..ORDER).map(|k| by(&arm.motors, &arm.motors_by_commands, &X, k)).collect();
        let torques = std::array::from_fn(|order| {
            let zero = DMatrix::zeros(T[0].nrows(), H_0.nrows());
            (0..=order).fold(zero, |sum, k| sum + &T[k] * &A[order - k])
        });
        let A = A.try_into().unwrap_or_else(|_| unreachable!("as many terms as the order"));
        Ok(Self { A, torques, moved })
    }

    /// Returns the highest frequency below `most` up to which one application leaves less than
    /// [`LEFT`] (Hz).
    fn accurate_up_to_hz(&self, node: &Node, most: f64) -> f64 {
        let (lowest, highest, factor) = SEARCH;
        let mut hz = lowest;
        while hz <= highest.min(most) {
            if !self.leaves(node, hz).is_some_and(|left| left <= LEFT) {
                return hz / factor;
            }
            hz *= factor;
        }
        highest.min(most)
    }

    /// Maximum fraction of an error that one application leaves at a frequency, each TCP component
    /// in its own unit.
    fn leaves(&self, node: &Node, hz: f64) -> Option<f64> {
        let s = Complex::new(0.0, std::f64::consts::TAU * hz);
        let poly =
            |a: &DMatrix<f64>, b: &DMatrix<f64>, c: &DMatrix<f64>| complex(a) + complex(b) * s + complex(c) * (s * s);
        let (mut Z, mut N) = (poly(&node.K, &node.D, &node.M), poly(&node.K_a, &node.D_a, &node.M_a));
        if let Some(servo) = &node.servo {
            servo.close(s, &mut Z, &mut N);
        }
        let H = complex(&node.J_a) - complex(&node.J) * Z.lu().solve(&N)?;
        let sum = |terms: &[DMatrix<f64>; ORDER]| {
            let zero = DMatrix::from_element(terms[0].nrows(), terms[0].ncols(), Complex::new(0.0, 0.0));
            terms.iter().fold((zero, Complex::new(1.0, 0.0)), |(sum, power), A| (sum + complex(A) * power, power * s)).0
        };
        let mut A = sum(&self.A);
        if let Some(servo) = &node.servo {
            let ahead = servo.references(s).lu().solve(&sum(&self.torques))?;
            for (i, axis) in servo.axes.iter().enumerate() {
                let mut row = A.row_mut(*axis);
                row += ahead.row(i);
            }
        }
        let mut left = -(H * A);
        for k in 0..left.nrows() {
            left[(k, k)] += Complex::new(1.0, 0.0);
        }
        // In the directions in which the joints can move the TCP; a radian counts as a metre.
        let moved = complex(&self.moved);
        let left = moved.tr_mul(&left) * moved;
        Some(left.map(|z| z.norm()).singular_values().amax())
    }
}

fn complex(A: &DMatrix<f64>) -> DMatrix<Complex<f64>> {
    A.map(|x| Complex::new(x, 0.0))
}

/// Returns the damped pseudo-inverse, and an orthonormal basis of the undamped directions; `None`
/// for a matrix without any.
///
/// Near a singular pose the joints would have to move far for a small correction. Singular values
/// below [`WEAK`] of the largest are damped, more strongly the smaller they are [Nakamura &
/// Hanafusa 1986]; the remaining error is left to further iterations, or not corrected.
fn damped_inverse(H: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    if !H.norm_squared().is_finite() {
        return None;
    }
    let svd = H.clone().svd(true, true);
    let (U, Vt) = (svd.u?, svd.v_t?);
    let values = svd.singular_values;
    let largest = values.amax();
    if largest.is_nan() || largest <= 0.0 {
        return None;
    }
    let weak = WEAK * largest;
    let smallest = values.amin();
    let damping = if smallest < weak { weak * weak * (1.0 - (smallest / weak).powi(2)) } else { 0.0 };
    let gains = values.map(|s| if s < weak { s / (s * s + damping) } else { 1.0 / s });
    let inverse = Vt.transpose() * DMatrix::from_diagonal(&gains) * U.transpose();
    let strong: Vec<usize> = (0..values.len()).filter(|k| values[*k] >= weak).collect();
    Some((inverse, U.select_columns(&strong)))
}

/// Rates by central differences of fourth order, with constant continuation at the ends.
fn derivative(y: &DMatrix<f64>, h: f64) -> DMatrix<f64> {
    let last = y.ncols() as i64 - 1;
    DMatrix::from_fn(y.nrows(), y.ncols(), |i, k| {
        let at = |offset: i64| y[(i, (k as i64 + offset).clamp(0, last) as usize)];
        (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * h)
    })
}

/// Returns the error blended into its final value within `within_s` before the end. A residual
/// oscillation at the end of a motion would be a kink where the error is continued as constant, and
/// the derivatives of a kink would give command peaks there.
fn ending_at_rest(y: &DMatrix<f64>, step_s: f64, within_s: f64) -> DMatrix<f64> {
    let last = y.ncols() - 1;
    let length = (within_s / step_s).ceil().clamp(ORDER as f64, (0.5 * last as f64).max(ORDER as f64));
    // From 0 to 1 with the first four derivatives zero at both ends.
    let rise = |s: f64| s.powi(5) * (126.0 + s * (-420.0 + s * (540.0 + s * (-315.0 + s * 70.0))));
    DMatrix::from_fn(y.nrows(), y.ncols(), |i, k| {
        let part = (last - k) as f64 / length;
        if part >= 1.0 { y[(i, k)] } else { y[(i, last)] + (y[(i, k)] - y[(i, last)]) * rise(part) }
    })
}

/// Low-pass filters each row without phase: Butterworth of fourth order, forwards and backwards.
/// The ends are continued as constant by a number of columns on either side, which is also
/// returned.
fn filtered(y: &DMatrix<f64>, step_s: f64, cutoff_hz: f64) -> (DMatrix<f64>, usize) {
    // More than three periods at each end.
    let pad = (3.0 / (cutoff_hz * step_s)).ceil() as usize + 2 * ORDER;
    let last = y.ncols() - 1;
    let mut out = DMatrix::from_fn(y.nrows(), y.ncols() + 2 * pad, |i, k| y[(i, k.saturating_sub(pad).min(last))]);
    if cutoff_hz >= 0.45 * 0.5 / step_s {
        return (out, pad);
    }
    let low = LowPass::new(cutoff_hz, 1.0 / step_s);
    for mut row in out.row_iter_mut() {
        let curve: Vec<f64> = row.iter().copied().collect();
        row.iter_mut().zip(low.of(&curve)).for_each(|(to, x)| *to = x);
    }
    (out, pad)
}
