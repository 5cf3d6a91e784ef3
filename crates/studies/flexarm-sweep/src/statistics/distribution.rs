//! Probability distributions, given by their quantile functions.
//!
//! Not here: the points of the unit interval (`sample.rs`), units and bounds of parameters.

use std::f64::consts::SQRT_2;

use statrs::function::erf::erfc_inv;

/// Distribution of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Uniform distribution.
    Uniform {
        /// Minimum.
        low: f64,
        /// Maximum.
        high: f64,
    },
    /// Uniform distribution of the logarithm; both bounds positive.
    LogUniform {
        /// Minimum.
        low: f64,
        /// Maximum.
        high: f64,
    },
    /// Normal distribution.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
    },
    /// Normal distribution of the logarithm.
    LogNormal {
        /// Median.
        median: f64,
        /// Standard deviation of the natural logarithm.
        sigma: f64,
    },
    /// Triangular distribution.
    Triangular {
        /// Minimum.
        low: f64,
        /// Mode.
        mode: f64,
        /// Maximum.
        high: f64,
    },
}

impl Distribution {
    /// Returns the quantile for probability `u`, 0 < u < 1.
    pub fn quantile(&self, u: f64) -> f64 {
        match *self {
            Self::Uniform { low, high } => low + (high - low) * u,
            Self::LogUniform { low, high } => (low.ln() + (high / low).ln() * u).exp(),
            Self::Normal { mean, std } => mean + std * normal_quantile(u),
            Self::LogNormal { median, sigma } => median * (sigma * normal_quantile(u)).exp(),
            // The distribution function is a parabola on each side of the mode.
            Self::Triangular { low, mode, high } => {
                let (rise, all) = (mode - low, high - low);
                match u * all < rise {
                    true => low + (u * all * rise).sqrt(),
                    false => high - ((1.0 - u) * all * (high - mode)).sqrt(),
                }
            }
        }
    }
}

/// Returns the quantile of the standard normal distribution.
pub(crate) fn normal_quantile(u: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * u)
}
