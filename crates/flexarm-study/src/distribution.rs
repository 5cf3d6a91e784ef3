//! Distributions by their quantiles: where a number between 0 and 1 falls.

/// How a parameter is spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// As likely everywhere between both.
    Uniform {
        /// Least value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// Its logarithm is uniform; both positive.
    LogUniform {
        /// Least value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// Gauss.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
    },
    /// Its logarithm is normal.
    LogNormal {
        /// Half of the values lie below.
        median: f64,
        /// Standard deviation of the natural logarithm.
        sigma: f64,
    },
    /// Straight up to the mode and down from there.
    Triangular {
        /// Least value.
        low: f64,
        /// Likeliest value.
        mode: f64,
        /// Largest value.
        high: f64,
    },
}

impl Distribution {
    /// The value below which lies the part `u` of all, 0 < u < 1.
    pub fn quantile(&self, u: f64) -> f64 {
        match *self {
            Self::Uniform { low, high } => low + (high - low) * u,
            Self::LogUniform { low, high } => (low.ln() + (high / low).ln() * u).exp(),
            Self::Normal { mean, std } => mean + std * normal_quantile(u),
            Self::LogNormal { median, sigma } => median * (sigma * normal_quantile(u)).exp(),
            Self::Triangular { low, mode, high } => {
                let (rise, all) = (mode - low, high - low);
                match u * all < rise {
                    true => low + (u * all * rise).sqrt(),
                    false => high - ((1.0 - u) * all * (high - mode)).sqrt(),
                }
            }
        }
    }

    /// Least and largest value, if it has them.
    pub fn bounds(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Uniform { low, high } | Self::LogUniform { low, high } | Self::Triangular { low, high, .. } => {
                Some((low, high))
            }
            Self::Normal { .. } | Self::LogNormal { .. } => None,
        }
    }
}

/// Numerators and denominators, lowest power first, of the three rational functions of the source; relative error 1e-16.
const MIDDLE: [[f64; 8]; 2] = [
    [
        3.387_132_872_796_366_5,
        133.141_667_891_784_38,
        1_971.590_950_306_551_3,
        13_731.693_765_509_46,
        45_921.953_931_549_87,
        67_265.770_927_008_7,
        33_430.575_583_588_13,
        2_509.080_928_730_122_7,
    ],
    [
        1.0,
        42.313_330_701_600_91,
        687.187_007_492_057_9,
        5_394.196_021_424_751,
        21_213.794_301_586_597,
        39_307.895_800_092_71,
        28_729.085_735_721_943,
        5_226.495_278_852_854,
    ],
];
const OUTER: [[f64; 8]; 2] = [
    [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        0.241_780_725_177_450_6,
        0.022_723_844_989_269_184,
        7.745_450_142_783_414e-4,
    ],
    [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        0.689_767_334_985_1,
        0.148_103_976_427_480_08,
        0.015_198_666_563_616_457,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ],
];
const TAIL: [[f64; 8]; 2] = [
    [
        6.657_904_643_501_103,
        5.463_784_911_164_114,
        1.784_826_539_917_291_3,
        0.296_560_571_828_504_87,
        0.026_532_189_526_576_124,
        1.242_660_947_388_078_4e-3,
        2.711_555_568_743_487_6e-5,
        2.010_334_399_292_288_1e-7,
    ],
    [
        1.0,
        0.599_832_206_555_888,
        0.136_929_880_922_735_8,
        0.014_875_361_290_850_615,
        7.868_691_311_456_133e-4,
        1.846_318_317_510_054_7e-5,
        1.421_511_758_316_446e-7,
        2.044_263_103_389_939_8e-15,
    ],
];

/// Quantile of the standard normal distribution.
///
/// # Source
/// [Wichura 1988], algorithm AS 241, PPND16.
pub fn normal_quantile(u: f64) -> f64 {
    let ratio = |[numerator, denominator]: &[[f64; 8]; 2], r: f64| {
        let polynomial = |c: &[f64; 8]| c.iter().rev().fold(0.0, |sum, c| sum * r + c);
        polynomial(numerator) / polynomial(denominator)
    };
    let q = u - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(&MIDDLE, 0.425 * 0.425 - q * q);
    }
    let r = (-u.min(1.0 - u).ln()).sqrt();
    let size = if r <= 5.0 { ratio(&OUTER, r - 1.6) } else { ratio(&TAIL, r - 5.0) };
    size.copysign(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: tabulated quantiles (mpmath, 60 digits).
    #[test]
    fn normal_quantiles_are_those_of_the_tables() {
        for (u, z) in NORMAL_TABLE {
            // measured 4e-16
            assert!((normal_quantile(u) - z).abs() <= 2e-15 * z.abs().max(1.0), "{u}: {} {z}", normal_quantile(u));
        }
        assert_eq!(normal_quantile(0.5), 0.0);
    }

    /// Truth: means and variances in closed form; the quantile over an even sample of u is the midpoint rule.
    #[test]
    fn means_and_variances_are_those_of_the_formulas() {
        let (a, m, b): (f64, f64, f64) = (1.0, 2.5, 7.0);
        let sigma: f64 = 0.3;
        let cases = [
            (Distribution::Uniform { low: a, high: b }, 0.5 * (a + b), (b - a).powi(2) / 12.0),
            (
                Distribution::Triangular { low: a, mode: m, high: b },
                (a + m + b) / 3.0,
                (a * a + m * m + b * b - a * m - a * b - m * b) / 18.0,
            ),
            (Distribution::Normal { mean: 3.0, std: 0.5 }, 3.0, 0.25),
            (
                Distribution::LogNormal { median: 2.0, sigma },
                2.0 * (0.5 * sigma * sigma).exp(),
                4.0 * (sigma * sigma).exp() * ((sigma * sigma).exp() - 1.0),
            ),
            (
                Distribution::LogUniform { low: a, high: b },
                (b - a) / (b / a).ln(),
                (b * b - a * a) / (2.0 * (b / a).ln()) - ((b - a) / (b / a).ln()).powi(2),
            ),
        ];
        for (distribution, mean, variance) in cases {
            let n = 1_000_000;
            let x: Vec<f64> = (0..n).map(|k| distribution.quantile((f64::from(k) + 0.5) / f64::from(n))).collect();
            let found = x.iter().sum::<f64>() / f64::from(n);
            let spread = x.iter().map(|x| (x - found).powi(2)).sum::<f64>() / f64::from(n);
            // measured 3e-8 and 3e-5 (the tails of the normal distribution)
            assert!((found / mean - 1.0).abs() < 1e-6, "{distribution:?}: {found} {mean}");
            assert!((spread / variance - 1.0).abs() < 3e-4, "{distribution:?}: {spread} {variance}");
            if let Some((low, high)) = distribution.bounds() {
                assert!(x.iter().all(|x| low <= *x && *x <= high));
            }
        }
    }

    const NORMAL_TABLE: [(f64, f64); 13] = [
        (1e-300, -37.0470962993612),
        (1e-20, -9.262340089798407),
        (1e-09, -5.9978070150076865),
        (0.001, -3.0902323061678136),
        (0.025, -1.9599639845400543),
        (0.07, -1.4757910281791706),
        (0.0751, -1.43882539275254),
        (0.2, -0.8416212335729142),
        (0.4, -0.2533471031357997),
        (0.6, 0.2533471031357997),
        (0.9, 1.2815515655446006),
        (0.975, 1.9599639845400538),
        (0.999999, 4.753424308817087),
    ];
}
