//! Force laws: tension, rate and energy as functions of length.

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
    /// Gas volume relative to that at the length `at`.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn laws() -> Vec<(BalancerLaw, Vec<f64>)> {
        let gas = |pulls, exponent, slope| {
            BalancerLaw::Gas(GasLaw { force: 27e3, opposing: 170.0, at: 0.6, slope, exponent, pulls })
        };
        let points = [[-1.0, 30.0], [-0.2, 80.0], [0.1, 80.0], [0.5, -20.0], [1.5, -60.0]];
        vec![
            (BalancerLaw::Linear { rate: 4e4, free: 0.5, preload: 700.0 }, vec![0.2, 0.5, 0.9]),
            (gas(true, 1.0, 1.7), vec![0.5, 0.6, 0.9]),
            (gas(true, 1.4, 1.7), vec![0.5, 0.6, 0.9]),
            (gas(false, 1.3, 1.7), vec![0.3, 0.6, 0.9]),
            (gas(false, 1.0, 0.0), vec![0.3, 0.6, 0.9]),
            (BalancerLaw::Sine { amplitude: 9e3, zero: -1.4 }, vec![-2.0, -1.4, 0.3]),
            (BalancerLaw::Curve(BalancerCurve::new(&points).unwrap()), vec![-1.5, -0.6, 0.0, 0.3, 1.1, 2.0]),
        ]
    }

    /// T = dU/dx and k = dT/dx by central differences of every law; measured below 2e-9 relative.
    #[test]
    fn tension_and_rate_are_the_derivatives_of_the_energy() {
        let h = 1e-5;
        for (law, places) in laws() {
            for x in places {
                let T = (law.energy(x + h) - law.energy(x - h)) / (2.0 * h);
                let k = (law.tension(x + h) - law.tension(x - h)) / (2.0 * h);
                assert!((T - law.tension(x)).abs() < 1e-7 * (1.0 + T.abs()), "{law:?} at {x}: {T}");
                assert!((k - law.rate(x)).abs() < 1e-6 * (1.0 + k.abs()), "{law:?} at {x}: {k}");
            }
        }
    }

    /// Truth: Boyle's law, p V constant, and Poisson's, p V^n constant.
    #[test]
    fn a_gas_at_half_its_volume_presses_twice_as_hard_and_more_if_it_cannot_cool() {
        let at_half = |exponent| {
            let gas = GasLaw { force: 1000.0, opposing: 0.0, at: 0.5, slope: 2.0, exponent, pulls: false };
            BalancerLaw::Gas(gas).tension(0.25)
        };
        assert!((at_half(1.0) + 2000.0).abs() < 1e-9);
        assert!((at_half(1.4) + 1000.0 * 2f64.powf(1.4)).abs() < 1e-9);
        let gas = GasLaw { force: 1.0, opposing: 0.0, at: 0.5, slope: 2.0, exponent: 1.0, pulls: true };
        assert_eq!(gas.end(), 1.0);
        assert!(BalancerLaw::Gas(gas).tension(1.01).is_nan());
    }
}
