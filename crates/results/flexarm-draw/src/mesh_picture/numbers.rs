//! Readable numbers with units.
//!
//! Arguments are SI (m, rad, m²); texts name their unit. Vectors below `noise`
//! are written as zero. Not here: numbers of tables and files (`flexarm-settings`).

use nalgebra::Vector3;

/// Formats a number with `digits` significant digits, without exponent.
pub(super) fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.decimals$}")
}

/// Returns a readable unit of a length, and its size in m.
fn length_unit(size: f64) -> (&'static str, f64) {
    match size.abs() {
        x if x >= 10.0 => ("m", 1.0),
        x if x >= 1e-4 => ("mm", 1e-3),
        x if x >= 1e-7 || x == 0.0 => ("µm", 1e-6),
        _ => ("nm", 1e-9),
    }
}

/// Formats a displacement, m, in a suitable unit.
pub fn displacement(value: f64) -> String {
    let (unit, size) = length_unit(value);
    format!("{} {unit}", significant(value / size, 3))
}

/// Formats a displacement vector, m, in the unit of its largest component; zero if that is below
/// `noise`.
pub fn displacements(u: &Vector3<f64>, noise: f64) -> String {
    if u.amax() <= noise {
        return "0".into();
    }
    let (unit, size) = length_unit(u.amax());
    format!("{} {unit}", triple(&(u / size), u.amax() / size))
}

/// Formats a small rotation, rad, in mrad or µrad; zero if it is below `noise`.
pub fn rotations(theta: &Vector3<f64>, noise: f64) -> String {
    if theta.amax() <= noise {
        return "0".into();
    }
    let (unit, size) = if theta.amax() >= 1e-4 { ("mrad", 1e-3) } else { ("µrad", 1e-6) };
    format!("{} {unit}", triple(&(theta / size), theta.amax() / size))
}

/// Formats three numbers with the number of decimals suited to the largest.
fn triple(v: &Vector3<f64>, largest: f64) -> String {
    let decimals = if largest > 0.0 { (2 - largest.log10().floor() as i32).clamp(0, 6) as usize } else { 0 };
    let [x, y, z] = [v.x, v.y, v.z].map(|x| {
        let text = format!("{x:.decimals$}");
        // Print values that round to zero without a sign.
        if text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.')) { text.replace('-', "") } else { text }
    });
    format!("({x}, {y}, {z})")
}

/// Formats a position, m, in mm.
pub fn position(p: &Vector3<f64>) -> String {
    let [x, y, z] = [p.x, p.y, p.z].map(|x| (x * 1e4).round() / 10.0 + 0.0);
    format!("({x}, {y}, {z}) mm")
}

/// Formats a distance, m, to 0.1 mm.
pub(super) fn offset(value: f64) -> String {
    format!("{:.1} mm", value * 1e3)
}

/// Formats an area, m², in cm².
pub(super) fn area(value: f64) -> String {
    format!("{} cm²", significant(value * 1e4, 3))
}

/// Returns the largest of 1, 2, 5, 10, ... that does not exceed `limit`. In the unit of the limit,
/// which is positive.
pub fn round_below(limit: f64) -> f64 {
    let decade = 10_f64.powi(limit.log10().floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|k| k * decade).find(|x| *x <= limit * (1.0 + 1e-12)).unwrap_or(decade)
}
