//! Whether a metric is better if it is higher or if it is lower.
//!
//! In this order: what the study says, what the numbers of the run in its expression are (a
//! frequency should be high, an error low, and one over a sag should be high), what its name says.

use exmex::{Express, FlatEx};
use serde::Serialize;

/// What is better of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// Less: errors, sag, mass.
    Lower,
    /// More: frequencies, stiffness, life.
    Higher,
}

impl Better {
    /// From a word of a study.
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

    /// `lower` or `higher`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Lower => "lower",
            Self::Higher => "higher",
        }
    }

    /// `least` or `highest`.
    pub fn most(self) -> &'static str {
        match self {
            Self::Lower => "least",
            Self::Higher => "highest",
        }
    }

    /// The value with the sign by which less is better.
    pub(super) fn as_cost(self, value: f64) -> f64 {
        match self {
            Self::Lower => value,
            Self::Higher => -value,
        }
    }
}

/// Numbers of a run that say nothing by being high or low.
const NEUTRAL: [&str; 4] = ["t_peak_s", "t_dynamic_peak_s", "dominant_hz", "visits"];
/// Parts of a run that should be small: errors, deflections, torques.
const LOW: [&str; 6] = ["tcp", "path", "links", "elastic_drives", "drives", "motors"];

/// Of a number of the run by its place.
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

/// Words of names.
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

/// Of a metric or a parameter by the words of its name; none if it has none that tells, or two that
/// disagree.
pub(super) fn of_name(name: &str) -> Option<Better> {
    let name = name.to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).collect();
    let has = |known: &[&str]| words.iter().any(|word| known.contains(word));
    // A payload is what an arm is for, whatever of it is told.
    match (has(&["payload"]), has(&HIGHER), has(&LOWER)) {
        (true, ..) | (_, true, false) => Some(Better::Higher),
        (_, false, true) => Some(Better::Lower),
        _ => None,
    }
}

/// Sizes of numbers at which an expression is looked at.
const SIZES: [f64; 7] = [1e-5, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e5];
/// By how much they are changed.
const CHANGE: f64 = 1.01;

/// Of an expression of variables of which some have a direction: all of them must agree.
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

/// Whether an expression rises with a variable; none if it sometimes does and sometimes falls.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_what_is_better_where_they_have_a_word_for_it() {
        for (name, better) in [
            ("f1_hz", Some(Better::Higher)),
            ("bearing life (h)", Some(Better::Higher)),
            ("payload.mass", Some(Better::Higher)),
            ("drive.joint_2.gearbox.stiffness", Some(Better::Higher)),
            ("peak-error", Some(Better::Lower)),
            ("mass_kg", Some(Better::Lower)),
            ("life_error", None),
            ("massive", None),
            ("k", None),
        ] {
            assert_eq!(of_name(name), better, "{name}");
        }
    }

    #[test]
    fn an_expression_turns_the_direction_over_where_it_falls() {
        let better = |text: &str, variables: &[Option<Better>]| of_expression(&exmex::parse(text).unwrap(), variables);
        let low = Some(Better::Lower);
        assert_eq!(better("1000 * {a}", &[low]), low);
        assert_eq!(better("0.006 - {a}", &[low]), Some(Better::Higher));
        assert_eq!(better("9.81 * {b} / {a}", &[low, Some(Better::Higher)]), Some(Better::Higher));
        assert_eq!(better("{a} + {b}", &[low, None]), low);
        assert_eq!(better("{a} + {b}", &[low, Some(Better::Higher)]), None);
        assert_eq!(better("abs({a} - 2)", &[low]), None);
        assert_eq!(better("{a}", &[None]), None);
    }
}
