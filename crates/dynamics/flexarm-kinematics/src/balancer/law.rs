//! Force laws: tension, rate and energy as functions of length.
//!
//! `T = dU/dx` and `k = dT/dx` hold for every law; a new law needs an arm in the three functions of
//! [`BalancerLaw`]. Not here: the points between which it acts (`placed`).

use crate::balancer::curve::BalancerCurve;

/// Force law: tension as a function of length, with energy and rate.
///
/// x is the length of a line (m) or the value of a joint (rad or m), T the tension (N, or N m about
/// a rotating joint). Positive tension pulls the ends together, or the joint to lower values.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerLaw {
    /// `T = preload + rate (x - free)`.
    Linear {
        /// Spring rate (N/m, N m/rad or N/m).
        rate: f64,
        /// Length, angle or position at which the tension equals the preload (m, rad or m).
        free: f64,
        /// Preload (N or N m).
        preload: f64,
    },
    /// Gas spring.
    Gas(GasLaw),
    /// `T = -amplitude sin(x - zero)`, which balances a weight on one joint.
    Sine {
        /// Maximum torque (N m).
        amplitude: f64,
        /// Angle of zero torque (rad).
        zero: f64,
    },
    /// Interpolated curve.
    Curve(BalancerCurve),
}

/// Gas under a piston, `p V^n` constant.
///
/// ```text
/// pulls:   T =   force v^-n - opposing,     v = 1 - slope (x - at)    volume decreases with length
/// pushes:  T = -(force v^-n - opposing),    v = 1 + slope (x - at)    volume increases with length
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GasLaw {
    /// Pressure times area of the piston at the length `at` (N).
    pub force: f64,
    /// Force on the other side of the piston, such as from ambient pressure (N).
    pub opposing: f64,
    /// Reference length (m).
    pub at: f64,
    /// Piston area over gas volume at the reference length (1/m).
    pub slope: f64,
    /// Polytropic exponent n: 1 for isothermal, 1.4 for adiabatic nitrogen.
    pub exponent: f64,
    /// Whether it pulls its ends together; otherwise it pushes them apart.
    pub pulls: bool,
}

impl GasLaw {
    /// Gas volume relative to that at the length `at`, at length `x` (m); negative beyond [`Self::end`].
    pub fn volume_ratio(&self, x: f64) -> f64 {
        let stretch = self.slope * (x - self.at);
        if self.pulls { 1.0 - stretch } else { 1.0 + stretch }
    }

    /// Length at which the gas volume vanishes (m); infinite, with either sign, if `slope` is zero.
    pub fn end(&self) -> f64 {
        let reach = if self.slope > 0.0 { 1.0 / self.slope } else { f64::INFINITY };
        if self.pulls { self.at + reach } else { self.at - reach }
    }

    fn sign(&self) -> f64 {
        if self.pulls { 1.0 } else { -1.0 }
    }

    /// `v^-n`; NaN for a non-positive volume.
    fn rise(&self, x: f64) -> f64 {
        let v = self.volume_ratio(x);
        if v > 0.0 { v.powf(-self.exponent) } else { f64::NAN }
    }

    fn energy(&self, x: f64) -> f64 {
        let (way, n) = (self.sign() * (x - self.at), self.exponent);
        if self.slope == 0.0 {
            return (self.force - self.opposing) * way;
        }
        let v = self.volume_ratio(x);
        let log = if v > 0.0 { v.ln() } else { f64::NAN };
        // ∫ v^-n, regular at n = 1.
        let work = if n == 1.0 { -log } else { ((1.0 - n) * log).exp_m1() / (n - 1.0) };
        self.force / self.slope * work - self.opposing * way
    }
}

impl BalancerLaw {
    /// Tension T at x (N, N m); NaN beyond the end of a gas spring.
    pub fn tension(&self, x: f64) -> f64 {
        match self {
            Self::Linear { rate, free, preload } => preload + rate * (x - free),
            Self::Gas(gas) => gas.sign() * (gas.force * gas.rise(x) - gas.opposing),
            Self::Sine { amplitude, zero } => -amplitude * (x - zero).sin(),
            Self::Curve(curve) => curve.at(x)[0],
        }
    }

    /// Rate dT/dx (N/m, N m/rad).
    pub fn rate(&self, x: f64) -> f64 {
        match self {
            Self::Linear { rate, .. } => *rate,
            Self::Gas(gas) => gas.force * gas.exponent * gas.slope * gas.rise(x) / gas.volume_ratio(x),
            Self::Sine { amplitude, zero } => -amplitude * (x - zero).cos(),
            Self::Curve(curve) => curve.at(x)[1],
        }
    }

    /// Energy U (J), the integral of T from a reference point of the law.
    pub fn energy(&self, x: f64) -> f64 {
        match self {
            Self::Linear { rate, free, preload } => (preload + 0.5 * rate * (x - free)) * (x - free),
            Self::Gas(gas) => gas.energy(x),
            // Relative to the balanced position: amplitude (cos - 1) without cancellation.
            Self::Sine { amplitude, zero } => -2.0 * amplitude * (0.5 * (x - zero)).sin().powi(2),
            Self::Curve(curve) => curve.at(x)[2],
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        match self {
            Self::Linear { rate, free, preload } => [rate, free, preload].iter().all(|x| x.is_finite()),
            Self::Gas(gas) => {
                [gas.force, gas.opposing, gas.at, gas.slope, gas.exponent].iter().all(|x| x.is_finite())
                    && gas.slope >= 0.0
            }
            Self::Sine { amplitude, zero } => amplitude.is_finite() && zero.is_finite(),
            Self::Curve(_) => true,
        }
    }
}
