//! What was accepted in a mesh or in matrices, but looks like a mistake.

use std::fmt;

/// A sentence for people, with its number for programs.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubt {
    /// Short, stable name of its kind, such as `first-order`.
    pub code: &'static str,
    /// All of it in one sentence.
    pub message: String,
    /// What was found, if it is a number.
    pub value: Option<f64>,
    /// What it is compared with.
    pub yardstick: Option<f64>,
}

impl Doubt {
    /// A doubt without a number.
    pub fn said(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), value: None, yardstick: None }
    }

    /// A doubt about a number; yardstick: where it begins.
    pub fn found(code: &'static str, value: f64, yardstick: f64, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), value: Some(value), yardstick: Some(yardstick) }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}
