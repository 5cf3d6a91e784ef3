//! Parts of a drive: nonlinear springs, friction, and one axis of a sampled controller.
//!
//! Start at [`ServoAxis`], [`Friction`] and [`SpringCurve`]. All quantities are on the joint side
//! of the gear; `q` are all coordinates of the arm. Not here: rotors (in the tree) and linear
//! gearbox springs (elements of the arm).

use crate::guide::Guide;

/// Piecewise linear torque of a spring over its deflection, odd or not; the end pieces are
/// extrapolated.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueCurve {
    /// Deflections (rad or m), ascending.
    x: Vec<f64>,
    /// Torques (N m or N), non-decreasing.
    y: Vec<f64>,
}

/// Law of a nonlinear spring with one coordinate e (rad or m).
#[derive(Clone, Debug, PartialEq)]
pub enum SpringCurve {
    /// Torque over deflection.
    Torque(TorqueCurve),
    /// Guide of a telescopic joint, which depends on the position of the joint as well.
    Guide(Guide),
}

impl SpringCurve {
    /// Returns the torque (N m or N) at deflection `e` with the joints at `q`.
    pub fn torque(&self, e: f64, q: &[f64]) -> f64 {
        match self {
            Self::Torque(curve) => curve.torque(e),
            Self::Guide(guide) => guide.torque(e, q),
        }
    }

    /// Returns the slope (N m/rad or N/m) at deflection `e` with the joints at `q`; 0 within
    /// backlash.
    pub fn slope(&self, e: f64, q: &[f64]) -> f64 {
        match self {
            Self::Torque(curve) => curve.slope(e),
            Self::Guide(guide) => guide.slope(e, q),
        }
    }

    /// Returns the slope at deflection `e`, and within backlash the steepest slope.
    pub(crate) fn slope_beyond_play(&self, e: f64, q: &[f64]) -> f64 {
        match self {
            Self::Torque(curve) if curve.slope(e) <= 0.0 => curve.stiffest(),
            _ => self.slope(e, q),
        }
    }

    /// Returns the work from zero torque to deflection `e` (J) with the joints at `q`.
    pub fn energy(&self, e: f64, q: &[f64]) -> f64 {
        match self {
            Self::Torque(curve) => curve.energy(e),
            Self::Guide(guide) => guide.energy(e, q),
        }
    }

    /// Returns the law of a spring stiffer by `factor`; clearances stay.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Torque(curve) => Self::Torque(curve.scaled(factor)),
            Self::Guide(guide) => Self::Guide(guide.scaled(factor)),
        }
    }

    /// Returns the distance to the next rising piece; see [`TorqueCurve::way_out`].
    pub(crate) fn way_out(&self, e: f64, direction: f64) -> Option<f64> {
        match self {
            Self::Torque(curve) => curve.way_out(e, direction),
            Self::Guide(_) => None,
        }
    }

    /// Returns the law of a telescopic guide.
    pub fn guide(&self) -> Option<&Guide> {
        if let Self::Guide(guide) = self { Some(guide) } else { None }
    }
}

impl From<TorqueCurve> for SpringCurve {
    fn from(curve: TorqueCurve) -> Self {
        Self::Torque(curve)
    }
}

/// Reason why points are rejected as a torque curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct CurveError(String);

impl TorqueCurve {
    /// Creates a curve from points (deflection in rad, torque in N m; of a slide m and N).
    ///
    /// # Errors
    /// [`CurveError`] for fewer than two points, values that are not finite, deflections that do
    /// not increase, torques that decrease, or flat end pieces.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, CurveError> {
        let fail = |text: String| Err(CurveError(text));
        if points.len() < 2 {
            return fail(format!("a torque curve needs at least two points, found {}", points.len()));
        }
        if let Some(bad) = points.iter().flatten().find(|x| !x.is_finite()) {
            return fail(format!("a torque curve has the entry {bad}"));
        }
        for pair in points.windows(2) {
            if pair[1][0] <= pair[0][0] || pair[1][1] < pair[0][1] {
                return fail(format!(
                    "a torque curve must rise: after ({}, {}) comes ({}, {})",
                    pair[0][0], pair[0][1], pair[1][0], pair[1][1]
                ));
            }
        }
        // The end pieces are continued, so they must rise.
        let n = points.len();
        let slope = |a: [f64; 2], b: [f64; 2]| (b[1] - a[1]) / (b[0] - a[0]);
        if slope(points[0], points[1]) <= 0.0 || slope(points[n - 2], points[n - 1]) <= 0.0 {
            return fail("a torque curve must rise at both ends: nothing else holds the joint".into());
        }
        Ok(Self { x: points.iter().map(|p| p[0]).collect(), y: points.iter().map(|p| p[1]).collect() })
    }

    /// Creates a linear spring with backlash: no torque within `± half` (rad), slope `stiffness`
    /// beyond.
    pub fn backlash(stiffness: f64, half: f64) -> Self {
        let reach = half + 1.0;
        Self { x: vec![-reach, -half, half, reach], y: vec![-stiffness, 0.0, 0.0, stiffness] }
    }

    /// Creates a linear spring with a stiffness in N m/rad, of a slide N/m.
    pub fn straight(stiffness: f64) -> Self {
        Self { x: vec![-1.0, 0.0, 1.0], y: vec![-stiffness, 0.0, stiffness] }
    }

    /// Returns the sum with a spring of stiffness `stiffness` whose torque saturates beyond
    /// `± reach`.
    #[must_use]
    pub(crate) fn with_slider(&self, stiffness: f64, reach: f64) -> Self {
        let mut x = self.x.clone();
        // The point at 0 makes the torque exactly zero at zero deflection.
        x.extend([-reach, 0.0, reach]);
        // Outer points: the end pieces have the slope without the slider.
        let end = self.x.iter().fold(reach, |end, x| end.max(x.abs())) + 1.0;
        x.extend([-end, end]);
        x.sort_by(f64::total_cmp);
        x.dedup();
        let y = x.iter().map(|x| self.torque(*x) + stiffness * x.clamp(-reach, reach)).collect();
        Self { x, y }
    }

    /// Returns the curve with its torques scaled by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { x: self.x.clone(), y: self.y.iter().map(|y| factor * y).collect() }
    }

    /// Returns the number of the piece that contains `e`, from 0.
    fn piece(&self, e: f64) -> usize {
        let inner = &self.x[1..self.x.len() - 1];
        inner.iter().take_while(|x| e >= **x).count()
    }

    /// Returns the torque (N m or N) at deflection `e` (rad or m).
    pub fn torque(&self, e: f64) -> f64 {
        // Measured from the inner end of the first piece, which may be long: avoids round-off next
        // to backlash.
        let k = self.piece(e).max(1);
        self.y[k] + self.slope(e) * (e - self.x[k])
    }

    /// Returns the slope (N m/rad or N/m) at deflection `e` (rad or m).
    pub fn slope(&self, e: f64) -> f64 {
        let k = self.piece(e);
        (self.y[k + 1] - self.y[k]) / (self.x[k + 1] - self.x[k])
    }

    /// Returns the distance from a deflection in a flat piece to the next rising piece in
    /// `direction`; `None` if the curve rises at `e`.
    pub(crate) fn way_out(&self, e: f64, direction: f64) -> Option<f64> {
        let rises = |k: usize| self.y[k + 1] > self.y[k];
        let here = self.piece(e);
        if rises(here) {
            return None;
        }
        if direction > 0.0 {
            (here + 1..self.x.len() - 1).find(|k| rises(*k)).map(|k| self.x[k] - e)
        } else {
            (0..here).rev().find(|k| rises(*k)).map(|k| e - self.x[k + 1])
        }
    }

    /// Returns the steepest slope: the stiffness for linear analyses (N m/rad, N/m).
    pub fn stiffest(&self) -> f64 {
        (0..self.x.len() - 1).map(|k| (self.y[k + 1] - self.y[k]) / (self.x[k + 1] - self.x[k])).fold(0.0, f64::max)
    }

    /// Returns the work from zero deflection to `e` (J).
    pub fn energy(&self, e: f64) -> f64 {
        let (low, high, sign) = if e < 0.0 { (e, 0.0, -1.0) } else { (0.0, e, 1.0) };
        let mut places: Vec<f64> = self.x.iter().copied().filter(|x| *x > low && *x < high).collect();
        places.insert(0, low);
        places.push(high);
        let area: f64 = places.windows(2).map(|w| 0.5 * (w[1] - w[0]) * (self.torque(w[0]) + self.torque(w[1]))).sum();
        sign * area
    }
}

/// Friction of a drive: viscous, regularised Coulomb, and Stribeck effect.
///
/// ```text
/// τ = viscous q̇ + (coulomb + stribeck exp(-(q̇/v_s)²)) tanh(q̇/v_0)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Viscous coefficient (N m s/rad).
    pub viscous: f64,
    /// Coulomb friction (N m).
    pub coulomb: f64,
    /// Excess of static friction over Coulomb friction (N m).
    pub stribeck: f64,
    /// Speed at which this excess has decayed to 1/e (rad/s).
    pub stribeck_velocity: f64,
    /// Regularisation speed `v_0` of the sign change (rad/s): below it the joint creeps instead of
    /// sticking.
    pub regularisation: f64,
}

impl Friction {
    /// No friction.
    pub const NONE: Friction =
        Friction { viscous: 0.0, coulomb: 0.0, stribeck: 0.0, stribeck_velocity: 1.0, regularisation: 1.0 };

    /// Returns the torque against the motion (N m) at a speed (rad/s).
    pub fn torque(&self, rate: f64) -> f64 {
        let rise = self.stribeck * (-(rate / self.stribeck_velocity).powi(2)).exp();
        self.viscous * rate + (self.coulomb + rise) * (rate / self.regularisation).tanh()
    }

    /// Returns the derivative of the torque with respect to the speed (N m s/rad).
    pub fn slope(&self, rate: f64) -> f64 {
        let (s, t) = (rate / self.stribeck_velocity, (rate / self.regularisation).tanh());
        let rise = self.stribeck * (-s * s).exp();
        self.viscous + (self.coulomb + rise) * (1.0 - t * t) / self.regularisation
            - rise * 2.0 * s / self.stribeck_velocity * t
    }
}

/// One axis of the controller: sampled position loop around a velocity loop, with feed-forward and
/// torque limit.
///
/// ```text
/// v_c = q̇_ref + position_gain (q_ref - q)
/// τ   = velocity_gain (v_c - q̇) + integral_gain ∫ (v_c - q̇) dt + feed_forward τ_ff,   |τ| ≤ limit
/// ```
/// q is the motor angle on the joint side. τ is constant until the next sample. τ_ff is the torque of
/// the rigid robot on the reference motion, including rotor and friction. The integral stops while
/// the torque is at its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoAxis {
    /// Coordinate of the joint.
    pub coordinate: usize,
    /// Position loop gain (1/s).
    pub position_gain: f64,
    /// Velocity loop gain (N m s/rad).
    pub velocity_gain: f64,
    /// Integral gain of the velocity loop (N m/rad).
    pub integral_gain: f64,
    /// Factor on τ_ff: 1, or 0 without feed-forward.
    pub feed_forward: f64,
    /// Torque limit (N m); infinite for none.
    pub limit: f64,
}
