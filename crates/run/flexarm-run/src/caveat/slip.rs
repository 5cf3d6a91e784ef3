//! Unit errors and similar mistakes that explain a value wrong by a known factor.
//!
//! A table of factors holds the mistakes of one quantity, the most frequent first; [`slip`] names the
//! first one whose correction makes a value plausible. Not here: which values are plausible.

use std::ops::RangeInclusive;

use super::{Finding, FindingKind};

/// Factor by which a value is too large (below 1: too small), and the mistake that causes it.
pub type Factor = (f64, &'static str);

/// Degrees instead of radians.
pub const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Factors for lengths in m.
pub const LENGTH: &[Factor] = &[(1e3, "millimetres"), (1e2, "centimetres"), (1.0 / 0.0254, "inches")];
/// Factors for angles in rad.
pub const ANGLE: &[Factor] = &[(DEGREES, "degrees"), (60.0 * DEGREES, "arc minutes")];
/// Factors for masses in kg.
pub(crate) const MASS: &[Factor] = &[(1e3, "grams"), (1e-3, "tonnes")];
/// Factors for densities in kg/m³.
pub const DENSITY: &[Factor] = &[(1e-3, "g/cm3"), (1e-12, "t/mm3"), (1e-9, "kg/mm3")];
/// Factors for moduli in Pa.
pub const MODULUS: &[Factor] = &[(1e-6, "MPa"), (1e-9, "GPa")];
/// Factors for torques in N m and forces in N.
pub(crate) const EFFORT: &[Factor] = &[(1e3, "N mm or mN"), (1e-3, "kN m or kN")];
/// Factors for rotational stiffness in N m/rad.
pub(crate) const TURNING: &[Factor] =
    &[(1.0 / DEGREES, "N m/deg"), (1e-3, "kN m/rad"), (1.0 / (60.0 * DEGREES), "N m/arcmin"), (1e3, "N mm/rad")];
/// Factors for moments of inertia in kg m².
pub const INERTIA: &[Factor] = &[(1e4, "kg cm2"), (1e6, "kg mm2"), (1e9, "g mm2"), (1e7, "g cm2")];

/// Returns the first mistake whose correction brings the value into the range; empty if there is
/// none.
///
/// `power`: exponent with which the value depends on the input, such as 0.5 for a radius of
/// gyration and its inertia.
pub fn slip(value: f64, plausible: &RangeInclusive<f64>, factors: &[Factor], power: f64) -> String {
    let mends = |(factor, _): &&Factor| plausible.contains(&(value / factor.powf(power)));
    factors.iter().find(mends).map(|(factor, words)| slip_text(*factor, words)).unwrap_or_default()
}

/// Returns the caveat of a value outside its range: its yardstick is the nearer end.
///
/// `power`: as for [`slip`].
pub fn outside(
    kind: &FindingKind,
    name: impl Into<String>,
    value: f64,
    range: &RangeInclusive<f64>,
    factors: &[Factor],
    power: f64,
) -> Option<Finding> {
    let end = if value < *range.start() { *range.start() } else { *range.end() };
    (!range.contains(&value)).then(|| kind.found(name, value, end).likely(slip(value, range, factors, power)))
}

/// Formats a mistake, such as "about 57 times: degrees?".
fn slip_text(factor: f64, words: &str) -> String {
    let times = if factor >= 1.0 { factor } else { 1.0 / factor };
    let digits = if times < 1e4 { format!("{times:.0}") } else { format!("{times:.0e}") };
    let way = if factor >= 1.0 { "times" } else { "times too small" };
    format!("about {digits} {way}: {words}?")
}
