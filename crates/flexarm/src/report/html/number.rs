//! Numbers as people read them.

/// A number with so many significant digits, without needless zeros.
pub(super) fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let x: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    // Nothing is gained by -0.
    let x = if x == 0.0 { 0.0 } else { x };
    let (plain, scientific) = (format!("{x}"), format!("{x:e}"));
    if x == 0.0 || (1e-3..1e7).contains(&x.abs()) { plain } else { scientific }
}

/// A number that keeps its digits, so that a row of tiles looks even.
pub(super) fn fixed(x: f64) -> String {
    let digits = match x.abs() {
        a if a >= 100.0 => 1,
        a if a >= 10.0 => 2,
        a if a >= 0.0995 || a == 0.0 => 3,
        _ => 4,
    };
    format!("{x:.digits$}")
}

/// The shorter form of a number with so many significant digits; null if it is none.
pub(super) fn short(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "null".into();
    }
    let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    let rounded = if rounded == 0.0 { 0.0 } else { rounded };
    let (plain, scientific) = (format!("{rounded}"), format!("{rounded:e}"));
    if scientific.len() < plain.len() { scientific } else { plain }
}
