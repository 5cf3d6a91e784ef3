//! Values of parameters.

use std::fmt;

/// A value of a parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// A number.
    Number(f64),
    /// A number that was written without a point.
    Whole(i64),
    /// A word or a file.
    Text(String),
    /// Yes or no.
    Truth(bool),
}

impl ParameterValue {
    /// The number that it is.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(x) => Some(*x),
            Self::Whole(n) => Some(*n as f64),
            Self::Text(_) | Self::Truth(_) => None,
        }
    }

    /// From a value of a file; none of a list, a table or a date, and of what is no finite number.
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
