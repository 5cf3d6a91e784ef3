//! Interpretation of column names: joint or time, position or rate, and the unit.
//!
//! Start at [`name_and_unit`], then [`meaning`]. A unit is a factor to SI units, with the number of
//! times that it is per second. Not here: which columns are used (`layout`).

use std::f64::consts::PI;

/// Quantity that a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Time,
    Angle,
    Length,
}

/// A unit: quantity, number of divisions by s, and factor to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    pub(super) measure: Measure,
    pub(super) per_s: usize,
    pub(super) scale: f64,
}

const UNITS: [(&[&str], Measure, f64); 10] = [
    (&["s", "sec", "secs", "second", "seconds"], Measure::Time, 1.0),
    (&["ms", "msec", "millisecond", "milliseconds"], Measure::Time, 1e-3),
    (&["us", "µs", "μs", "usec", "microseconds"], Measure::Time, 1e-6),
    (&["ns", "nsec", "nanoseconds"], Measure::Time, 1e-9),
    (&["min"], Measure::Time, 60.0),
    (&["rad", "radian", "radians"], Measure::Angle, 1.0),
    (&["mrad"], Measure::Angle, 1e-3),
    (&["deg", "degree", "degrees", "°", "grad_deg"], Measure::Angle, PI / 180.0),
    (&["m", "meter", "metre", "meters", "metres"], Measure::Length, 1.0),
    (&["mm", "millimeter", "millimetre"], Measure::Length, 1e-3),
];
/// Units that may follow an underscore.
const SUFFIXES: [&str; 9] = ["s", "sec", "ms", "us", "ns", "rad", "deg", "m", "mm"];
const TIMES: [&str; 9] = ["time", "t", "timestamp", "time_stamp", "%time", "__time", "zeit", "elapsed", "elapsed_time"];
const RATES: [(&str, usize); 8] = [
    ("velocity", 1),
    ("vel", 1),
    ("speed", 1),
    ("acceleration", 2),
    ("accel", 2),
    ("acc", 2),
    ("position", 0),
    ("pos", 0),
];
/// Words in the names of columns that are not part of the motion.
const OTHERS: [&str; 6] = ["effort", "torque", "current", "eff", "temperature", "force"];

/// The unit of a word such as `deg`, `rad/s` or `deg/s^2`.
pub(super) fn unit(word: &str) -> Option<Unit> {
    let word = word.trim().trim_matches(['[', ']', '(', ')']).trim();
    let ends = [
        ("/s^2", 2),
        ("/s2", 2),
        ("/s²", 2),
        ("/s**2", 2),
        ("_s2", 2),
        ("/sec", 1),
        ("/s", 1),
        ("_s", 1),
        (" s^-1", 1),
    ];
    let (base, per_s) = ends.iter().find_map(|(end, n)| Some((word.strip_suffix(end)?, *n))).unwrap_or((word, 0));
    let base = base.trim();
    let known =
        |(words, ..): &&(&[&str], Measure, f64)| words.iter().any(|w| *w == base || *w == base.to_ascii_lowercase());
    let (_, measure, scale) = UNITS.iter().find(known)?;
    let is_sound = per_s == 0 || *measure != Measure::Time;
    is_sound.then_some(Unit { measure: *measure, per_s, scale: *scale })
}

/// Splits a column name into name and unit: `A1[deg]`, `joint_1 (rad)`, `q1_deg`, `t / s`. A
/// bracket without a known unit stays part of the name, and its content is returned third.
pub(super) fn name_and_unit(column: &str) -> (String, Option<Unit>, Option<String>) {
    let column = column.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let Some(rest) = column.strip_suffix(close)
            && let Some((name, inside)) = rest.rsplit_once(open)
        {
            // `q[0]` is an index, not a unit.
            if inside.trim().parse::<u32>().is_ok() {
                return (column.to_owned(), None, None);
            }
            return match unit(inside) {
                Some(unit) => (name.trim_end_matches(['_', ' ', '.']).trim().to_owned(), Some(unit), None),
                None => (column.to_owned(), None, Some(inside.to_owned())),
            };
        }
    }
    if let Some((name, word)) = column.rsplit_once(" / ").or_else(|| column.rsplit_once(" in "))
        && let Some(unit) = unit(word)
    {
        return (name.trim().to_owned(), Some(unit), None);
    }
    // `vel_deg_s` is matched before `_s`.
    for word in ["rad_s2", "deg_s2", "rad_s", "deg_s", "m_s2", "m_s", "mm_s"] {
        if let Some(name) = column.strip_suffix(word).and_then(|name| name.strip_suffix('_')) {
            return (name.to_owned(), unit(word), None);
        }
    }
    for word in SUFFIXES {
        let ended =
            column.to_ascii_lowercase().strip_suffix(word).is_some_and(|name| name.ends_with('_') && name.len() > 1);
        if ended {
            return (column[..column.len() - word.len() - 1].to_owned(), unit(word), None);
        }
    }
    (column.to_owned(), None, None)
}

/// Meaning of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    Time,
    /// Value of a joint and its order of differentiation.
    Joint(String, usize),
    Other,
}

/// Meaning of a column according to its name without the unit.
pub(super) fn meaning(name: &str, unit: Option<Unit>) -> Meaning {
    let lower = name.to_ascii_lowercase();
    if TIMES.contains(&lower.as_str()) || unit.is_some_and(|unit| unit.measure == Measure::Time) {
        return Meaning::Time;
    }
    let ends_with = |word: &str| {
        let rest = lower.strip_suffix(word)?;
        let cut = rest.strip_suffix(['.', '_', '/', ' '])?;
        (!cut.is_empty()).then_some(cut.len())
    };
    if OTHERS.iter().any(|word| ends_with(word).is_some() || lower == *word) {
        return Meaning::Other;
    }
    let rate = RATES.iter().find_map(|(word, order)| Some((ends_with(word)?, *order)));
    let (base, order) = rate.map_or((name, None), |(length, order)| (&name[..length], Some(order)));
    // The path of a topic ends with the joint: `/joint_states/joint_1/position`.
    let base = if rate.is_some() { base.rsplit('/').next().unwrap_or(base) } else { base };
    let order = order.unwrap_or(0).max(unit.map_or(0, |unit| unit.per_s));
    Meaning::Joint(base.to_owned(), order)
}
