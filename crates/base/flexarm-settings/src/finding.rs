//! Findings: errors and likely mistakes in an input, and limits to the validity of a result.
//!
//! An error prevents a result. Warnings and notes, called caveats, come with one; a caveat often
//! compares a value with a physical reference. A [`FindingKind`] is a constant of the crate that
//! finds it; its message is formatted in one place ([`FindingKind::found`]), so that the same
//! finding always has the same wording.
//!
//! Not here: the kinds and their references.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Setting;

/// Severity of a finding, worst first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The input cannot be used.
    Error,
    /// The input is probably wrong, or the result is not reliable.
    #[default]
    Warning,
    /// Unusual but possible: a reader of the result should know about it.
    Note,
}

impl Severity {
    /// `error`, `warning` or `note`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// Kind of a finding about a number: an entry of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FindingKind {
    /// Short, stable identifier for programs.
    pub code: &'static str,
    /// Default severity.
    pub severity: Severity,
    /// Message template with `{where}`, `{value}`, `{yardstick}` and `{unit}`, and settings by
    /// their keys, such as `{step_s}`.
    pub says: &'static str,
    /// Unit of value and reference; empty for dimensionless numbers.
    pub unit: &'static str,
    /// Advice on what to check or how to fix it.
    pub help: &'static str,
}

/// Something found in an input or in a result. SI units.
///
/// `Display` gives `where: message`, and the remedy on a line of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Finding {
    /// Severity.
    pub severity: Severity,
    /// Short, stable identifier of its kind.
    pub code: String,
    /// Place in a file, as `path:line:column`, or the subject: a link, a joint, the payload, a file.
    #[serde(rename = "where")]
    pub location: String,
    /// Complete message in one sentence.
    pub message: String,
    /// Value found.
    pub value: Option<f64>,
    /// Reference with which the value is compared.
    pub yardstick: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// Likely mistake that explains the value, such as "about 1000 times: millimetres?"; empty if
    /// there is none.
    pub likely: String,
    /// Advice on what to check or how to fix it.
    pub help: String,
    /// Settings of the call whose change may resolve it.
    #[serde(skip)]
    pub settings: Vec<Setting>,
    /// Whether it concerns the robot description (URDF), which is the same in every run.
    #[serde(skip)]
    pub of_description: bool,
}

impl FindingKind {
    /// Creates a kind with severity `Warning`.
    pub const fn warning(code: &'static str, says: &'static str, unit: &'static str, help: &'static str) -> Self {
        Self { code, severity: Severity::Warning, says, unit, help }
    }

    /// Creates a kind with severity `Note`.
    pub const fn note(code: &'static str, says: &'static str, unit: &'static str, help: &'static str) -> Self {
        Self { code, severity: Severity::Note, says, unit, help }
    }

    /// Returns the kind for values of another unit.
    pub const fn with_unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Creates the caveat for a subject with its value and reference.
    pub fn found(&self, location: impl Into<String>, value: f64, yardstick: f64) -> Finding {
        let location = location.into();
        let settings = self.settings();
        // Replace setting names first: a location may contain braces.
        let named = |text: String, setting: &Setting| text.replace(&placeholder(*setting), &setting.to_string());
        let message = (settings.iter().fold(self.says.to_owned(), named))
            .replace("{where}", &location)
            .replace("{value}", &figure(value))
            .replace("{yardstick}", &figure(yardstick))
            .replace("{unit}", self.unit);
        Finding {
            severity: self.severity,
            code: self.code.into(),
            location,
            message,
            unit: self.unit.into(),
            help: self.help.into(),
            settings,
            ..Finding::default()
        }
        .measured(value, yardstick)
    }

    /// Settings whose change may resolve the caveat.
    pub fn settings(&self) -> Vec<Setting> {
        Setting::ALL.iter().copied().filter(|setting| self.says.contains(&placeholder(*setting))).collect()
    }
}

impl Finding {
    /// Creates an error: what was found, what was expected, and the remedy.
    pub fn error(code: &str, location: impl Into<String>, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { severity: Severity::Error, ..Self::warning(code, location, message, help) }
    }

    /// Creates a warning; `message` is a complete sentence.
    pub fn warning(
        code: &str,
        location: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self {
            code: code.into(),
            location: location.into(),
            message: message.into(),
            help: help.into(),
            ..Self::default()
        }
    }

    /// Adds a value with its reference, at which the finding starts.
    #[must_use]
    pub fn measured(self, value: f64, yardstick: f64) -> Self {
        let [value, yardstick] = [value, yardstick].map(|x| Some(x).filter(|x| x.is_finite()));
        Self { value, yardstick, ..self }
    }

    /// Adds settings whose change may resolve it.
    #[must_use]
    pub fn mended_by(mut self, settings: &[Setting]) -> Self {
        self.settings.extend(settings);
        self
    }

    /// Adds the likely mistake that explains the value.
    #[must_use]
    pub fn likely(mut self, slip: impl Into<String>) -> Self {
        self.likely = slip.into();
        if !self.likely.is_empty() {
            self.message += &format!(" ({})", self.likely);
        }
        self
    }

    /// Lowers the severity to `Note`.
    #[must_use]
    pub fn as_note(mut self) -> Self {
        self.severity = Severity::Note;
        self
    }

    /// Whether it is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// Whether it is a warning.
    pub fn warns(&self) -> bool {
        self.severity == Severity::Warning
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.location.is_empty() {
            write!(f, "{}: ", self.location)?;
        }
        f.write_str(&self.message)?;
        if self.help.is_empty() { Ok(()) } else { write!(f, "\n  help: {}", self.help) }
    }
}

impl std::error::Error for Finding {}

/// Placeholder of a setting in the message template of a kind.
fn placeholder(setting: Setting) -> String {
    format!("{{{}}}", setting.key())
}

/// Messages of the caveats that are warnings.
pub fn warnings(caveats: &[Finding]) -> Vec<String> {
    caveats.iter().filter(|caveat| caveat.warns()).map(|caveat| caveat.message.clone()).collect()
}

/// Removes duplicates: of caveats with the same code and subject, the last one is kept, at the
/// position of the first.
pub fn once_each(caveats: Vec<Finding>) -> Vec<Finding> {
    let mut kept: Vec<Finding> = Vec::with_capacity(caveats.len());
    for caveat in caveats {
        let same = |k: &Finding| k.value.is_some() && k.code == caveat.code && k.location == caveat.location;
        match kept.iter().position(same) {
            Some(earlier) => kept[earlier] = caveat,
            None if kept.contains(&caveat) => {}
            None => kept.push(caveat),
        }
    }
    kept
}

/// Formats a number with three or four significant digits.
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
