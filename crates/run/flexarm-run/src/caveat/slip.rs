//! Slips that explain a number that is off by a known factor: units, mostly.

use std::ops::RangeInclusive;

/// A factor by which a number is too large (below 1: too small), and the slip that makes it so.
pub type Factor = (f64, &'static str);

/// Degrees for radians.
pub(crate) const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Lengths in m.
pub const LENGTH: &[Factor] = &[(1e3, "millimetres"), (1e2, "centimetres"), (1.0 / 0.0254, "inches")];
/// Angles in rad.
pub(crate) const ANGLE: &[Factor] = &[(DEGREES, "degrees"), (60.0 * DEGREES, "arc minutes")];
/// Masses in kg.
pub(crate) const MASS: &[Factor] = &[(1e3, "grams"), (1e-3, "tonnes")];
/// Densities in kg/m³.
pub(crate) const DENSITY: &[Factor] = &[(1e-3, "g/cm3"), (1e-12, "t/mm3"), (1e-9, "kg/mm3")];
/// Moduli in Pa.
pub(crate) const MODULUS: &[Factor] = &[(1e-6, "MPa"), (1e-9, "GPa")];
/// Torques in N m, forces in N.
pub(crate) const EFFORT: &[Factor] = &[(1e3, "N mm or mN"), (1e-3, "kN m or kN")];
/// Rotational stiffness in N m/rad.
pub(crate) const TURNING: &[Factor] =
    &[(1.0 / DEGREES, "N m/deg"), (1e-3, "kN m/rad"), (1.0 / (60.0 * DEGREES), "N m/arcmin"), (1e3, "N mm/rad")];
/// Moments of inertia in kg m².
pub(crate) const INERTIA: &[Factor] = &[(1e4, "kg cm2"), (1e6, "kg mm2"), (1e9, "g mm2"), (1e7, "g cm2")];

/// The first slip without which the value would lie in the range; empty if there is none.
///
/// `power`: with which power of the number the value goes, such as 0.5 for a radius of gyration and
/// its inertia.
pub fn slip(value: f64, plausible: &RangeInclusive<f64>, factors: &[Factor], power: f64) -> String {
    let mends = |(factor, _): &&Factor| plausible.contains(&(value / factor.powf(power)));
    factors.iter().find(mends).map(|(factor, words)| told(*factor, words)).unwrap_or_default()
}

/// "about 57 times: degrees?"
fn told(factor: f64, words: &str) -> String {
    let times = if factor >= 1.0 { factor } else { 1.0 / factor };
    let digits = if times < 1e4 { format!("{times:.0}") } else { format!("{times:.0e}") };
    let way = if factor >= 1.0 { "times" } else { "times too small" };
    format!("about {digits} {way}: {words}?")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_what_brings_a_number_back_into_its_range() {
        assert_eq!(slip(350.0, &(0.0..=6.0), LENGTH, 1.0), "about 1000 times: millimetres?");
        assert_eq!(slip(35.0, &(0.0..=0.1), LENGTH, 1.0), "about 1000 times: millimetres?");
        assert_eq!(slip(0.5, &(0.0..=0.02), ANGLE, 1.0), "about 57 times: degrees?");
        assert_eq!(slip(70e3, &(1e8..=1.3e12), MODULUS, 1.0), "about 1e6 times too small: MPa?");
        assert_eq!(slip(2.7e-9, &(50.0..=23e3), DENSITY, 1.0), "about 1e12 times too small: t/mm3?");
        // A radius of gyration goes with the root of the inertia.
        assert_eq!(slip(300.0, &(0.01..=0.5), INERTIA, 0.5), "about 1e6 times: kg mm2?");
        assert_eq!(slip(17.0, &(0.0..=1e-3), LENGTH, 1.0), "");
    }
}
