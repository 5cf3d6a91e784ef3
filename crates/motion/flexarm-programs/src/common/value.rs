//! Values of variables and expressions.
//!
//! A value has the type that its language gives it ([`Value::kind`] names it for messages);
//! [`Value::Outside`] stands for a value that only the controller knows.

use std::rc::Rc;

use super::{Result, Span, fail};

/// A value of a language.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// KRL's INT, with integer division.
    Whole(i64),
    Number(f64),
    Flag(bool),
    Text(Rc<str>),
    /// Enumeration value (`#BASE`) or keyword (`\Off`).
    Word(Rc<str>),
    /// Elements; unset ones are [`Value::Nothing`].
    List(Rc<Vec<Value>>),
    Record(Rc<Record>),
    /// `p[x, y, z, rx, ry, rz]`, m and rad.
    Pose([f64; 6]),
    /// Joint values of a pose (`get_inverse_kin`): the pose and the joint values near which they
    /// are.
    Inverse(Box<([f64; 6], Option<Vec<f64>>)>),
    /// Value known only to the controller, or computed from one.
    Outside(Rc<str>),
    /// No value yet.
    Nothing,
}

/// Named values.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Record {
    /// Type name in the language; empty if not given.
    pub(crate) kind: Rc<str>,
    pub(crate) fields: Vec<(Rc<str>, Value)>,
}

impl Record {
    pub(crate) fn new(kind: &str, fields: Vec<(&str, Value)>) -> Self {
        Self { kind: kind.into(), fields: fields.into_iter().map(|(name, value)| (name.into(), value)).collect() }
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Value> {
        self.fields.iter().find(|(field, _)| &**field == name).map(|(_, value)| value)
    }

    pub(crate) fn set(&mut self, name: &str, value: Value) {
        match self.fields.iter_mut().find(|(field, _)| &**field == name) {
            Some((_, old)) => *old = value,
            None => self.fields.push((name.into(), value)),
        }
    }
}

impl Value {
    pub(crate) fn text(text: &str) -> Self {
        Self::Text(text.into())
    }

    pub(crate) fn list(values: Vec<Value>) -> Self {
        Self::List(Rc::new(values))
    }

    pub(crate) fn record(kind: &str, fields: Vec<(&str, Value)>) -> Self {
        Self::Record(Rc::new(Record::new(kind, fields)))
    }

    /// Description of the kind of value, for messages.
    pub(crate) fn kind(&self) -> &str {
        match self {
            Self::Whole(_) | Self::Number(_) => "a number",
            Self::Flag(_) => "a truth value",
            Self::Text(_) => "a text",
            Self::Word(_) => "a word",
            Self::List(_) => "a list",
            Self::Record(record) if record.kind.is_empty() => "an aggregate",
            Self::Record(record) => &record.kind,
            Self::Pose(_) => "a pose",
            Self::Inverse(_) => "the joint values of a pose",
            Self::Outside(_) => "a value that only the controller knows",
            Self::Nothing => "no value",
        }
    }

    /// Returns the value, or an error if only the controller knows it or it was never set.
    pub(crate) fn known(self, span: Span) -> Result<Self> {
        match self {
            Self::Outside(what) => fail(span, depends(&what)),
            Self::Nothing => {
                fail(span, "has no value here: it is used before it is set; set it, or give its value as an option")
            }
            known => Ok(known),
        }
    }

    pub(crate) fn number(&self, span: Span) -> Result<f64> {
        match self {
            Self::Number(number) => Ok(*number),
            Self::Whole(whole) => Ok(*whole as f64),
            other => {
                let other = other.clone().known(span)?;
                fail(span, format!("a number is expected, this is {}", other.kind()))
            }
        }
    }

    /// An integer value.
    pub(crate) fn count(&self, span: Span) -> Result<i64> {
        let number = self.number(span)?;
        if number.fract() != 0.0 || number.abs() > 1e9 {
            return fail(span, format!("a whole number is expected, found {number}"));
        }
        Ok(number as i64)
    }

    pub(crate) fn flag(&self, span: Span) -> Result<bool> {
        match self {
            Self::Flag(flag) => Ok(*flag),
            other => {
                let other = other.clone().known(span)?;
                fail(span, format!("a truth value is expected, this is {}", other.kind()))
            }
        }
    }

    /// Numbers of a list or pose.
    pub(crate) fn numbers(&self, span: Span) -> Result<Vec<f64>> {
        match self {
            Self::List(values) => values.iter().map(|value| value.number(span)).collect(),
            Self::Pose(pose) => Ok(pose.to_vec()),
            other => {
                let other = other.clone().known(span)?;
                fail(span, format!("a list of numbers is expected, this is {}", other.kind()))
            }
        }
    }

    /// Number of values contained; limited so that a program cannot exhaust the memory.
    pub(crate) fn size(&self) -> usize {
        match self {
            Self::List(values) => values.iter().map(Self::size).fold(1, usize::saturating_add),
            Self::Record(record) => record.fields.iter().map(|(_, value)| value.size()).fold(1, usize::saturating_add),
            Self::Text(text) => 1 + text.len() / 16,
            _ => 1,
        }
    }
}

/// Message for a required value that only the controller knows.
pub(crate) fn depends(what: &str) -> String {
    format!(
        "depends on {what}, which only the controller knows: write a value in its place, or give it as an option (`given`)"
    )
}
