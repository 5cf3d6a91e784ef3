//! Warnings: input of a mesh or matrices that was accepted but looks like a mistake.

use std::fmt;

/// Warning: a sentence for the user, with its number for programs.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    /// Short, stable name of the kind of warning, such as `first-order`.
    pub code: &'static str,
    /// Complete message, one sentence.
    pub message: String,
    /// Measured value, if the warning is about a number.
    pub value: Option<f64>,
    /// Reference value for comparison.
    pub yardstick: Option<f64>,
}

impl Doubt {
    /// Creates a warning without a number.
    pub fn from_message(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), value: None, yardstick: None }
    }

    /// Creates a warning about a number; `yardstick` is the value at which the warning starts.
    pub fn found(code: &'static str, value: f64, yardstick: f64, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), value: Some(value), yardstick: Some(yardstick) }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}
