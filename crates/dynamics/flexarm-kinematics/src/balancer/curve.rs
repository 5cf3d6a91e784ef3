//! Force law interpolated between points: cubics for the tension T(x), quartics for the energy U(x).
//!
//! Start at [`BalancerCurve::new`]; x is the length or angle of the balancer (m, rad), T in N or N m,
//! U in J with `T = dU/dx`. Not here: gas and linear springs (`law.rs`), the length x (`lengths.rs`).

/// Interpolated tension: piecewise cubics with continuous slope and no overshoot between data
/// points [Fritsch & Butland 1984]; linear extrapolation beyond the first and last point.
#[derive(Clone, Debug, PartialEq)]
pub struct BalancerCurve {
    x: Vec<f64>,
    T: Vec<f64>,
    slope: Vec<f64>,
    /// Energy at the data points, relative to the first.
    U: Vec<f64>,
}

/// Reason why points do not define a curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BalancerCurveError {
    /// Fewer than two points.
    #[error("a curve needs at least two points, found {found}")]
    TooFew {
        /// Number of points.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("point {number} of the curve has the entry {value}, expected finite numbers")]
    NotFinite {
        /// Number of the point, from 1.
        number: usize,
        /// The value.
        value: f64,
    },
    /// The x values do not increase.
    #[error("after {before} comes {after}: the first numbers of the points must rise")]
    Order {
        /// x of a point.
        before: f64,
        /// x of the next point.
        after: f64,
    },
}

impl BalancerCurve {
    /// Builds the curve through points (x, T): length (m) and tension (N), or joint value (rad, m)
    /// and its force (N m, N).
    ///
    /// # Errors
    /// [`BalancerCurveError`] for fewer than two points, non-finite values, or x values that are
    /// not strictly increasing.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, BalancerCurveError> {
        if points.len() < 2 {
            return Err(BalancerCurveError::TooFew { found: points.len() });
        }
        for (k, point) in points.iter().enumerate() {
            if let Some(value) = point.iter().find(|x| !x.is_finite()) {
                return Err(BalancerCurveError::NotFinite { number: k + 1, value: *value });
            }
        }
        if let Some(pair) = points.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return Err(BalancerCurveError::Order { before: pair[0][0], after: pair[1][0] });
        }
        let (x, T): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p[0], p[1])).unzip();
        let slope = monotone_slopes(&x, &T);
        let mut U = vec![0.0];
        for k in 1..x.len() {
            let h = x[k] - x[k - 1];
            U.push(U[k - 1] + 0.5 * h * (T[k - 1] + T[k]) + h * h * (slope[k - 1] - slope[k]) / 12.0);
        }
        Ok(Self { x, T, slope, U })
    }

    /// First and last x of the data points (m or rad).
    pub fn range(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Tension, slope, and energy relative to the first point.
    pub(super) fn at(&self, x: f64) -> [f64; 3] {
        let last = self.x.len() - 1;
        let straight = |k: usize| {
            let d = x - self.x[k];
            [self.T[k] + self.slope[k] * d, self.slope[k], self.U[k] + (self.T[k] + 0.5 * self.slope[k] * d) * d]
        };
        let k = match self.x.partition_point(|p| *p <= x) {
            0 => return straight(0),
            k if k > last => return straight(last),
            k => k - 1,
        };
        // T = T0 + m0 s + a s² + b s³
        let (h, s) = (self.x[k + 1] - self.x[k], x - self.x[k]);
        let (m0, m1, secant) = (self.slope[k], self.slope[k + 1], (self.T[k + 1] - self.T[k]) / h);
        let a = (3.0 * secant - 2.0 * m0 - m1) / h;
        let b = (m0 + m1 - 2.0 * secant) / (h * h);
        [
            self.T[k] + s * (m0 + s * (a + s * b)),
            m0 + s * (2.0 * a + s * 3.0 * b),
            self.U[k] + s * (self.T[k] + s * (0.5 * m0 + s * (a / 3.0 + s * 0.25 * b))),
        ]
    }
}

/// Slopes at the data points: weighted harmonic means of the secants, zero at extrema [Fritsch &
/// Butland 1984].
fn monotone_slopes(x: &[f64], T: &[f64]) -> Vec<f64> {
    let secants: Vec<f64> = (1..x.len()).map(|k| (T[k] - T[k - 1]) / (x[k] - x[k - 1])).collect();
    let inner = |k: usize| {
        let (a, b) = (secants[k - 1], secants[k]);
        let (before, after) = (x[k] - x[k - 1], x[k + 1] - x[k]);
        if a * b <= 0.0 {
            return 0.0;
        }
        3.0 * (before + after) / ((2.0 * after + before) / a + (after + 2.0 * before) / b)
    };
    let last = x.len() - 1;
    (0..=last)
        .map(|k| match k {
            0 => secants[0],
            k if k == last => secants[last - 1],
            k => inner(k),
        })
        .collect()
}
