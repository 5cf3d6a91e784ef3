//! Preferred direction of a metric: lower or higher values.
//!
//! The direction is taken, in this order, from the study, from the numbers of the run in the
//! metric's expression (a frequency should be high, an error low, and the inverse of a sag high),
//! and from its name.

use exmex::{Express, FlatEx};
use serde::Serialize;

/// Preferred direction of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// Lower values: errors, sag, mass.
    Lower,
    /// Higher values: frequencies, stiffness, life.
    Higher,
}

impl Better {
    /// Parses a word of a study.
    pub(super) fn from_word(word: &str) -> Option<Self> {
        match word {
            "lower" => Some(Self::Lower),
            "higher" => Some(Self::Higher),
            _ => None,
        }
    }

    fn other(self) -> Self {
        match self {
            Self::Lower => Self::Higher,
            Self::Higher => Self::Lower,
        }
    }

    /// Returns `lower` or `higher`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Lower => "lower",
            Self::Higher => "higher",
        }
    }

    /// Returns `least` or `highest`.
    pub fn most(self) -> &'static str {
        match self {
            Self::Lower => "lowest",
            Self::Higher => "highest",
        }
    }

    /// Returns the value with the sign for minimisation.
    pub(super) fn as_cost(self, value: f64) -> f64 {
        match self {
            Self::Lower => value,
            Self::Higher => -value,
        }
    }
}

/// Numbers of a run without a preferred direction.
const NEUTRAL: [&str; 4] = ["t_peak_s", "t_dynamic_peak_s", "dominant_hz", "visits"];
/// Sections of a summary with values that should be low: errors, deflections, torques.
const LOW: [&str; 7] = ["tcp", "path", "links", "stress", "elastic_drives", "drives", "motors"];

/// Returns the preferred direction of a number of the run, by its path.
pub(super) fn of_fact(path: &[String]) -> Option<Better> {
    let words: Vec<&str> = path.iter().map(String::as_str).collect();
    match words[..] {
        [.., last] if NEUTRAL.contains(&last) => None,
        ["frequencies_hz", ..] => Some(Better::Higher),
        ["robot", "mass_kg"] | ["duration_s"] | ["energy", "imbalance"] => Some(Better::Lower),
        [first, ..] if LOW.contains(&first) => Some(Better::Lower),
        _ => None,
    }
}

/// Words in names.
const HIGHER: [&str; 8] = ["frequency", "frequencies", "freq", "hz", "stiffness", "life", "lifetime", "margin"];
const LOWER: [&str; 12] = [
    "error",
    "errors",
    "sag",
    "mass",
    "weight",
    "peak",
    "rms",
    "deflection",
    "deviation",
    "strain",
    "overshoot",
    "cost",
];

/// Returns the preferred direction by the words of a name; `None` without a known word, or with
/// contradictory ones.
pub(super) fn of_name(name: &str) -> Option<Better> {
    let name = name.to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).collect();
    let has = |known: &[&str]| words.iter().any(|word| known.contains(word));
    // Higher values of any property of a payload are preferred, because the arm is there to carry
    // it.
    match (has(&["payload"]), has(&HIGHER), has(&LOWER)) {
        (true, ..) | (_, true, false) => Some(Better::Higher),
        (_, false, true) => Some(Better::Lower),
        _ => None,
    }
}

/// Values of the variables at which the slope of an expression is tested.
const SIZES: [f64; 7] = [1e-5, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e5];
/// Factor of the change of a variable.
const CHANGE: f64 = 1.01;

/// Returns the preferred direction of an expression of variables with and without directions;
/// `None` if they contradict each other.
pub(super) fn of_expression(expression: &FlatEx<f64>, variables: &[Option<Better>]) -> Option<Better> {
    let mut found = None;
    for (place, own) in variables.iter().enumerate() {
        let Some(own) = own else { continue };
        let better = match rises(expression, variables.len(), place)? {
            true => *own,
            false => own.other(),
        };
        if found.is_some_and(|found| found != better) {
            return None;
        }
        found = Some(better);
    }
    found
}

/// Whether an expression increases with a variable; `None` if it is not monotonic.
fn rises(expression: &FlatEx<f64>, count: usize, place: usize) -> Option<bool> {
    let (mut up, mut down) = (false, false);
    for size in SIZES {
        let mut at: Vec<f64> = (0..count).map(|k| size * (1.0 + 0.1 * k as f64)).collect();
        let before = expression.eval(&at).unwrap_or(f64::NAN);
        at[place] *= CHANGE;
        let change = expression.eval(&at).unwrap_or(f64::NAN) - before;
        up |= change > 0.0;
        down |= change < 0.0;
    }
    (up != down).then_some(up)
}
