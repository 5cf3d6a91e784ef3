//! Values of parameters.

use std::fmt;

/// Value of a parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// Floating-point number.
    Number(f64),
    /// Integer, written without a decimal point.
    Whole(i64),
    /// Word or file name.
    Text(String),
    /// Boolean.
    Truth(bool),
}

impl ParameterValue {
    /// Returns the value as a number; `None` if it is not one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(x) => Some(*x),
            Self::Whole(n) => Some(*n as f64),
            Self::Text(_) | Self::Truth(_) => None,
        }
    }

    /// Converts a value of a file; `None` for a list, a table, a date, or a number that is not
    /// finite.
    pub(super) fn of(value: &toml::Value) -> Option<Self> {
        match value {
            toml::Value::Float(x) if x.is_finite() => Some(Self::Number(*x)),
            toml::Value::Integer(n) => Some(Self::Whole(*n)),
            toml::Value::String(text) => Some(Self::Text(text.clone())),
            toml::Value::Boolean(truth) => Some(Self::Truth(*truth)),
            _ => None,
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x}"),
            Self::Whole(n) => write!(f, "{n}"),
            Self::Text(text) => f.write_str(text),
            Self::Truth(truth) => write!(f, "{truth}"),
        }
    }
}
