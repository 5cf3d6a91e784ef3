//! Servo commands for a required motor motion, linear about a motion.
//!
//! ```text
//! τ = C(s) (u - q) + F(s) u            C(s) = k_v s + p + i/s,   p = k_v k_p + k_i,   i = k_i k_p
//! (C + F) (u - q) = τ - F q
//! ```
//! with the commands u, the motors q, the torques τ that their motion needs and the feed-forward F.
//! The lead `u - q` obeys the equation of the servo on a rigid arm: it is stable if the servo is,
//! and needs no look-ahead. It is integrated by backward differences of second order, which also
//! work without feed-forward. Start at `NodeServo::leads`. Not here: the torques that the motion
//! needs (`inversion`).

use nalgebra::{Complex, DMatrix, DVector};

/// Linear controllers of d joints at an instant of a motion; m commands.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeServo {
    /// Index of the command that each controller follows.
    pub axes: Vec<usize>,
    /// `k_v k_p + k_i` of each controller (N m/rad or N/m).
    pub stiffness: DVector<f64>,
    /// `k_v` (N m s/rad or N s/m).
    pub damping: DVector<f64>,
    /// `k_i k_p` (N m/(rad s) or N/(m s)).
    pub integral: DVector<f64>,
    /// Feed-forward torques per command, its velocity and its acceleration, d×m.
    pub ahead: [DMatrix<f64>; 3],
}

impl NodeServo {
    /// Interpolates the controllers between nodes, by weights.
    pub(crate) fn between(all: &[Self], nodes: [(usize, f64); 4]) -> Self {
        let first = &all[nodes[0].0];
        let sum = |k: usize| {
            let zero = DMatrix::zeros(first.ahead[k].nrows(), first.ahead[k].ncols());
            nodes.iter().fold(zero, |sum, (node, weight)| sum + &all[*node].ahead[k] * *weight)
        };
        Self { ahead: std::array::from_fn(sum), ..first.clone() }
    }

    /// Adds the controllers to the dynamic stiffness of the free coordinates, the first of which
    /// are the motors, and to the forces per command.
    pub(crate) fn close(&self, s: Complex<f64>, Z: &mut DMatrix<Complex<f64>>, N: &mut DMatrix<Complex<f64>>) {
        let F = self.feed_forward(s);
        for (i, axis) in self.axes.iter().enumerate() {
            let C = s * self.damping[i] + self.stiffness[i] + self.integral[i] / s;
            Z[(i, i)] += C;
            N[(i, *axis)] -= C;
            let mut row = N.row_mut(i);
            row -= F.row(i);
        }
    }

    /// Returns `C + F` at `s` (1/s), d×d (N m/rad).
    #[doc(hidden)]
    pub fn references(&self, s: Complex<f64>) -> DMatrix<Complex<f64>> {
        let mut all = self.feed_forward(s).select_columns(&self.axes);
        for i in 0..self.axes.len() {
            all[(i, i)] += s * self.damping[i] + self.stiffness[i] + self.integral[i] / s;
        }
        all
    }

    /// Returns the feed-forward `F(s)`, d×m.
    fn feed_forward(&self, s: Complex<f64>) -> DMatrix<Complex<f64>> {
        let part = |k: usize, power: Complex<f64>| self.ahead[k].map(|x| power * x);
        part(0, Complex::new(1.0, 0.0)) + part(1, s) + part(2, s * s)
    }

    /// Computes the lead of the commands over their motors for torques in addition to the
    /// feed-forward, from rest.
    ///
    /// * `at`: the controllers at each column; `torques`: d×N, `step_s` apart.
    ///
    /// Returns d×N.
    #[doc(hidden)]
    pub fn leads(at: impl Fn(usize) -> Self, torques: &DMatrix<f64>, step_s: f64) -> DMatrix<f64> {
        let (d, N) = torques.shape();
        let mut leads = DMatrix::zeros(d, N);
        if N == 0 {
            return leads;
        }
        // Before the first column the arm rests under the first torques.
        let (sum, lead) = at(0).at_rest(&torques.column(0).into_owned());
        // Integral, lead and its rate at the last two instants.
        let mut before = [[sum.clone(), lead.clone(), DVector::zeros(d)], [sum, lead, DVector::zeros(d)]];
        let b = 1.5 / step_s;
        for column in 0..N {
            let servo = at(column);
            let [K, D, M] = servo.equation();
            // x = b X + x_0 for each X and its derivative x (BDF2).
            let past = |k: usize| (&before[1][k] * 0.5 - &before[0][k] * 2.0) / step_s;
            let (lead_0, rate_0, acceleration_0) = (past(0), past(1), past(2));
            let integral = DMatrix::from_diagonal(&servo.integral);
            let left = &M * (b * b) + &D * b + &K + &integral / b;
            let known = &M * (&rate_0 * b + &acceleration_0) + &D * &rate_0 - &integral * &lead_0 / b;
            let right = torques.column(column) - known;
            let lead = left.lu().solve(&right).unwrap_or_else(|| DVector::zeros(d));
            // Integral, lead and rate at this instant, from the same rule.
            let now = [(&lead - &lead_0) / b, lead.clone(), &lead * b + &rate_0];
            let [last, _] = before;
            before = [now, last];
            leads.set_column(column, &lead);
        }
        leads
    }

    /// Coefficients of lead, rate and acceleration, d×d.
    fn equation(&self) -> [DMatrix<f64>; 3] {
        let [K, D, M] = [0, 1, 2].map(|k| self.ahead[k].select_columns(&self.axes));
        [K + DMatrix::from_diagonal(&self.stiffness), D + DMatrix::from_diagonal(&self.damping), M]
    }

    /// Integral of the lead, and lead, under constant torques.
    fn at_rest(&self, torques: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let [K, _, _] = self.equation();
        let (mut left, mut right) = (K.clone(), torques.clone());
        for i in (0..self.axes.len()).filter(|i| self.integral[*i] > 0.0) {
            // With an integrator the lead is zero at rest.
            left.row_mut(i).fill(0.0);
            left[(i, i)] = 1.0;
            right[i] = 0.0;
        }
        let lead = left.lu().solve(&right).unwrap_or_else(|| DVector::zeros(torques.len()));
        let rest = torques - K * &lead;
        let sum =
            DVector::from_fn(rest.len(), |i, _| if self.integral[i] > 0.0 { rest[i] / self.integral[i] } else { 0.0 });
        (sum, lead)
    }
}
