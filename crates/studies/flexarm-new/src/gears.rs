//! Torsional stiffness of reducers by rated torque: data of two catalogues, for a first estimate.
//! The manufacturer's data sheet of the actual gear takes precedence.
//!
//! Stiffness grows almost proportionally to rated torque: both series twist by about 1e-3 rad under
//! it. Sources: Nabtesco RV and Harmonic Drive CSG in `docs/references.md`.

use serde::Serialize;

/// Conversion from N m per arc minute to N m/rad.
const ARC_MINUTE: f64 = 60.0 * 180.0 / std::f64::consts::PI;

/// Cycloidal reducers, series RV-E of Nabtesco (rating table, pages 12 and 13): size, rated torque
/// (N m), torsional rigidity (N m per minute of arc).
const CYCLOIDAL: [(f64, f64, f64); 8] = [
    (6.0, 58.0, 20.0),
    (20.0, 167.0, 49.0),
    (40.0, 412.0, 108.0),
    (80.0, 784.0, 196.0),
    (110.0, 1078.0, 294.0),
    (160.0, 1568.0, 392.0),
    (320.0, 3136.0, 980.0),
    (450.0, 4410.0, 1176.0),
];

/// Strain-wave gears, series CSG of Harmonic Drive at ratios from 80 (rating table, page 10;
/// torsional stiffness, page 48): size, rated torque (N m), stiffness at small torque (K1) and at
/// large torque (K3) (N m/rad).
const STRAIN_WAVE: [(f64, f64, f64, f64); 8] = [
    (14.0, 10.0, 4.7e3, 7.1e3),
    (17.0, 31.0, 1.0e4, 1.6e4),
    (20.0, 52.0, 1.6e4, 2.9e4),
    (25.0, 87.0, 3.1e4, 5.7e4),
    (32.0, 178.0, 6.7e4, 1.2e5),
    (40.0, 345.0, 1.3e5, 2.3e5),
    (50.0, 611.0, 2.5e5, 4.4e5),
    (65.0, 1236.0, 5.4e5, 9.8e5),
];

/// Kind of reducer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reducer {
    /// Cycloidal reducer, as in the main axes of industrial arms.
    Cycloidal,
    /// Strain-wave gear, as in light and collaborative arms.
    StrainWave,
}

impl Reducer {
    /// Kind that arms usually have at a rated torque (N m).
    pub fn usual(rated: f64) -> Self {
        if rated >= 200.0 { Self::Cycloidal } else { Self::StrainWave }
    }
}

/// Approximate ratio of acceleration torque to rated torque, for both series.
pub const PEAK_OVER_RATED: f64 = 2.5;
/// Range of the ratio of identified stiffness to the table's value: main axes of the shipped KR
/// 210, KR 300 and KR 500.
pub(crate) const IDENTIFIED: [f64; 2] = [0.45, 1.9];

/// Stiffness of a reducer for a rated torque.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GearClass {
    /// Typical stiffness of the class (N m/rad).
    pub stiffness: f64,
    /// Minimum and maximum of the class (N m/rad).
    pub low: f64,
    pub high: f64,
    /// Series, sizes and origin of the range.
    pub source: String,
    /// Whether the torque is outside the table.
    pub is_beyond: bool,
}

/// Returns the class of a kind of reducer with a rated torque (N m, above 0): power-law
/// interpolation between two sizes, proportional beyond the table.
pub fn class(reducer: Reducer, rated: f64) -> GearClass {
    if reducer == Reducer::Cycloidal {
        let rows: Vec<_> =
            CYCLOIDAL.iter().map(|&(size, torque, rigidity)| (size, torque, rigidity * ARC_MINUTE)).collect();
        let (stiffness, sizes, is_beyond) = between(&rows, rated, "RV-", "E");
        let [low, high] = IDENTIFIED.map(|factor| factor * stiffness);
        let source = format!(
            "cycloidal reducers, data of Nabtesco's RV-E series, {sizes} (compare with the manufacturer's data \
             sheet); low and high: identified stiffness of main axes relative to these data (KR 210, KR 300 and KR \
             500 in robots/)"
        );
        return GearClass { stiffness, low, high, source, is_beyond };
    }
    // Strain wave: geometric mean of the stiffness at small and at large torque.
    let rows = |which: fn(&(f64, f64, f64, f64)) -> f64| -> Vec<_> {
        STRAIN_WAVE.iter().map(|row| (row.0, row.1, which(row))).collect()
    };
    let (low, sizes, is_beyond) = between(&rows(|row| row.2), rated, "CSG-", "");
    let (high, ..) = between(&rows(|row| row.3), rated, "CSG-", "");
    let source = format!(
        "strain-wave gears, data of Harmonic Drive's CSG series, ratio 80 and above, {sizes} (compare with the \
         manufacturer's data sheet); low: K1 at small torque, high: K3 at large torque"
    );
    GearClass { stiffness: (low * high).sqrt(), low, high, source, is_beyond }
}

/// Interpolates by a power law; also returns the neighbouring sizes as text, and whether the torque
/// is outside the table.
fn between(rows: &[(f64, f64, f64)], rated: f64, before: &str, after: &str) -> (f64, String, bool) {
    let name = |row: &(f64, f64, f64)| format!("{before}{:.0}{after}", row.0);
    let above = rows.iter().position(|row| row.1 >= rated);
    match above {
        Some(0) => {
            (rows[0].2 * rated / rows[0].1, format!("scaled in proportion below {}", name(&rows[0])), rated < rows[0].1)
        }
        None => {
            let last = rows[rows.len() - 1];
            (last.2 * rated / last.1, format!("scaled in proportion above {}", name(&last)), true)
        }
        Some(k) => {
            let (a, b) = (rows[k - 1], rows[k]);
            let exponent = (b.2 / a.2).ln() / (b.1 / a.1).ln();
            (a.2 * (rated / a.1).powf(exponent), format!("between {} and {}", name(&a), name(&b)), false)
        }
    }
}

/// Rounds a number to three significant digits.
pub(crate) fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
