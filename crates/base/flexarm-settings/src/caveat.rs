//! Caveats: what is probably wrong with an input, or limits the worth of a result, as values.
//!
//! A caveat compares a value with a physical yardstick. A [`CaveatKind`] is a constant of the crate
//! that finds it; its sentence is made in one place ([`CaveatKind::found`]), so that all that find
//! the same say the same.
//!
//! Not here: the kinds, their yardsticks, and what makes a model impossible, which is an error.

use serde::{Deserialize, Serialize};

use crate::Setting;

/// How much a caveat weighs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The input probably does not say what was meant, or the result is not to be trusted.
    #[default]
    Warning,
    /// Unusual, and possible: something that the reader of a result should know.
    Note,
}

impl Severity {
    /// `warning` or `note`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// A kind of caveat: its place in the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CaveatKind {
    /// Short, stable name for programs.
    pub code: &'static str,
    /// How much it weighs, unless the finder says otherwise.
    pub severity: Severity,
    /// One sentence with `{where}`, `{value}` and `{yardstick}` in it, and settings by their keys,
    /// such as `{step_s}`.
    pub says: &'static str,
    /// Unit of value and yardstick; empty for plain numbers.
    pub unit: &'static str,
    /// What to look at, or how to mend it.
    pub help: &'static str,
}

/// One caveat. SI units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Caveat {
    /// How much it weighs.
    pub severity: Severity,
    /// Short, stable name of its kind.
    pub code: String,
    /// What it is about: a link, a joint, the payload, a file.
    #[serde(rename = "where")]
    pub location: String,
    /// All of it in one sentence.
    pub message: String,
    /// What was found.
    pub value: Option<f64>,
    /// What it is compared with.
    pub yardstick: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// The slip that would explain it, such as "about 1000 times: millimetres?"; empty if none
    /// does.
    pub likely: String,
    /// What to look at, or how to mend it.
    pub help: String,
    /// Settings of the call whose change may mend it, as far as it is one of them.
    #[serde(skip)]
    pub settings: Vec<Setting>,
    /// Whether it is about the robot's description (URDF), which is the same in every run.
    #[serde(skip)]
    pub of_description: bool,
}

impl CaveatKind {
    /// A kind that warns.
    pub const fn warning(code: &'static str, says: &'static str, unit: &'static str, help: &'static str) -> Self {
        Self { code, severity: Severity::Warning, says, unit, help }
    }

    /// A kind that only tells.
    pub const fn note(code: &'static str, says: &'static str, unit: &'static str, help: &'static str) -> Self {
        Self { code, severity: Severity::Note, says, unit, help }
    }

    /// The caveat about a thing with its value and yardstick, in words.
    pub fn found(&self, location: impl Into<String>, value: f64, yardstick: f64) -> Caveat {
        let location = location.into();
        let settings = self.settings();
        // The names of the settings come first: a location may hold braces.
        let named = |text: String, setting: &Setting| text.replace(&placeholder(*setting), &setting.to_string());
        let message = (settings.iter().fold(self.says.to_owned(), named))
            .replace("{where}", &location)
            .replace("{value}", &figure(value))
            .replace("{yardstick}", &figure(yardstick));
        Caveat {
            severity: self.severity,
            code: self.code.into(),
            location,
            message,
            value: Some(value).filter(|x| x.is_finite()),
            yardstick: Some(yardstick).filter(|x| x.is_finite()),
            unit: self.unit.into(),
            likely: String::new(),
            help: self.help.into(),
            settings,
            of_description: false,
        }
    }

    /// Settings whose change may mend what it tells.
    pub fn settings(&self) -> Vec<Setting> {
        Setting::ALL.into_iter().filter(|setting| self.says.contains(&placeholder(*setting))).collect()
    }
}

impl Caveat {
    /// A caveat without a number: the sentence is given.
    pub fn said(code: &str, location: impl Into<String>, message: impl Into<String>, help: &str) -> Self {
        Self {
            code: code.into(),
            location: location.into(),
            message: message.into(),
            help: help.into(),
            ..Self::default()
        }
    }

    /// With settings whose change may mend it.
    #[must_use]
    pub fn mended_by(mut self, settings: &[Setting]) -> Self {
        self.settings.extend(settings);
        self
    }

    /// With the slip that would explain it.
    #[must_use]
    pub fn likely(mut self, slip: impl Into<String>) -> Self {
        self.likely = slip.into();
        if !self.likely.is_empty() {
            self.message += &format!(" ({})", self.likely);
        }
        self
    }

    /// As something that only tells.
    #[must_use]
    pub fn as_note(mut self) -> Self {
        self.severity = Severity::Note;
        self
    }

    /// Whether it warns.
    pub fn warns(&self) -> bool {
        self.severity == Severity::Warning
    }
}

/// How the sentence of a kind names a setting.
fn placeholder(setting: Setting) -> String {
    format!("{{{}}}", setting.key())
}

/// The sentences of the caveats that warn.
pub fn warnings(caveats: &[Caveat]) -> Vec<String> {
    caveats.iter().filter(|caveat| caveat.warns()).map(|caveat| caveat.message.clone()).collect()
}

/// Each caveat once: of those with the same code about the same thing the last, at the place of the
/// first.
pub fn once_each(caveats: Vec<Caveat>) -> Vec<Caveat> {
    let mut kept: Vec<Caveat> = Vec::with_capacity(caveats.len());
    for caveat in caveats {
        let same = |k: &Caveat| k.value.is_some() && k.code == caveat.code && k.location == caveat.location;
        match kept.iter().position(same) {
            Some(earlier) => kept[earlier] = caveat,
            None if kept.contains(&caveat) => {}
            None => kept.push(caveat),
        }
    }
    kept
}

/// A number with three or four digits that count.
pub fn figure(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if !(1e-3..1e6).contains(&x.abs()) {
        return format!("{x:.2e}");
    }
    let digits = (3 - x.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{x:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caveat_says_where_what_and_against_what() {
        let kind = CaveatKind::warning("far", "{where} is {value} m away, the arm reaches {yardstick} m", "m", "");
        let caveat = kind.found("the TCP", 350.0, 2.9).likely("about 1000 times: millimetres?");
        let message = "the TCP is 350 m away, the arm reaches 2.9 m (about 1000 times: millimetres?)";
        assert_eq!(caveat.message, message);
        assert_eq!((caveat.value, caveat.yardstick, caveat.warns()), (Some(350.0), Some(2.9), true));
        let json = serde_json::to_value(&caveat).unwrap();
        for key in ["severity", "code", "where", "message", "value", "yardstick", "unit", "likely"] {
            assert!(json.get(key).is_some(), "{key}: {json}");
        }
        assert_eq!(serde_json::from_value::<Caveat>(json).unwrap(), caveat);
        assert_eq!(warnings(&[caveat.clone(), caveat.as_note()]), [message]);
    }

    #[test]
    fn the_same_caveat_is_told_once_with_its_last_value() {
        let kind = CaveatKind::warning("bend", "{where} {value} {yardstick}", "rad", "");
        let found = |link: &str, x: f64| kind.found(link, x, 0.05);
        let kept = once_each(vec![found("a", 0.1), found("b", 0.2), found("a", 0.3)]);
        assert_eq!(kept, [found("a", 0.3), found("b", 0.2)]);
        // Sentences without a value are apart unless they are equal.
        let said = |text: &str| Caveat::said("file", "x", text, "");
        assert_eq!(once_each(vec![said("one"), said("two"), said("one")]), [said("one"), said("two")]);
    }

    #[test]
    fn numbers_have_the_digits_that_count() {
        let found = [350.0, 0.05, 1.2345678, 20.0, 123_456.7, 7e9, 2e-4, 0.0, -9.81].map(figure);
        assert_eq!(found, ["350", "0.05", "1.235", "20", "123457", "7.00e9", "2.00e-4", "0", "-9.81"]);
    }
}
