//! Quantiles, means and variances of distributions.

use flexarm_sweep::statistics::Distribution;

fn normal_quantile(u: f64) -> f64 {
    Distribution::Normal { mean: 0.0, std: 1.0 }.quantile(u)
}

/// Truth: tabulated quantiles (mpmath, 60 digits).
#[test]
fn normal_quantiles_are_those_of_the_tables() {
    for (u, z) in NORMAL_TABLE {
        // measured: 4e-16
        assert!((normal_quantile(u) - z).abs() <= 2e-15 * z.abs().max(1.0), "{u}: {} {z}", normal_quantile(u));
    }
    assert_eq!(normal_quantile(0.5), 0.0);
}

/// Truth: means and variances in closed form; averaging quantiles over equally spaced u is the
/// midpoint rule.
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
        // measured: 3e-8 and 3e-5 (due to the tails of the normal distribution)
        assert!((found / mean - 1.0).abs() < 1e-6, "{distribution:?}: {found} {mean}");
        assert!((spread / variance - 1.0).abs() < 3e-4, "{distribution:?}: {spread} {variance}");
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
