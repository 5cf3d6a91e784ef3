//! Waypoint file as written, key by key; nothing is converted or checked here.
//!
//! Every value keeps its place in the text for later error messages.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use toml::Spanned;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileToml {
    pub(crate) format: Spanned<i64>,
    pub(crate) unit: Spanned<String>,
    #[serde(default)]
    pub(crate) metres: Vec<Spanned<String>>,
    pub(crate) joints: Spanned<Vec<Spanned<String>>>,
    pub(crate) start: Spanned<Values>,
    pub(crate) law: Option<LawToml>,
    pub(crate) profile: Option<ProfileToml>,
    pub(crate) synchronised: Option<bool>,
    pub(crate) speed: Option<Spanned<f64>>,
    pub(crate) acceleration: Option<Spanned<Values>>,
    pub(crate) jerk: Option<Spanned<Values>>,
    pub(crate) rounding: Option<Spanned<f64>>,
    #[serde(default)]
    pub(crate) limits: BTreeMap<Spanned<String>, LimitsToml>,
    #[serde(rename = "move")]
    pub(crate) moves: Vec<Spanned<MoveToml>>,
}

/// One `[[move]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MoveToml {
    pub(crate) to: Spanned<Values>,
    #[serde(default)]
    pub(crate) via: Vec<Spanned<Values>>,
    pub(crate) duration: Option<Spanned<f64>>,
    pub(crate) hold: Option<Spanned<f64>>,
    pub(crate) law: Option<LawToml>,
    pub(crate) profile: Option<ProfileToml>,
    pub(crate) synchronised: Option<bool>,
    pub(crate) speed: Option<Spanned<f64>>,
    pub(crate) acceleration: Option<Spanned<Values>>,
    pub(crate) jerk: Option<Spanned<Values>>,
    pub(crate) rounding: Option<Spanned<f64>>,
}

/// One line of `[limits]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LimitsToml {
    pub(crate) velocity: Option<Spanned<f64>>,
    pub(crate) acceleration: Option<Spanned<f64>>,
    pub(crate) jerk: Option<Spanned<f64>>,
}

/// Name of a law, used instead of a profile.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LawToml {
    Optimal,
}

/// Name of a profile.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ProfileToml {
    Quintic,
    Trapezoid,
    SCurve,
}

/// One number for all joints, a list with one per joint, or a table with some of them.
#[derive(Debug)]
pub(crate) enum Values {
    One(f64),
    List(Vec<f64>),
    Table(BTreeMap<Spanned<String>, f64>),
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValuesVisitor)
    }
}

/// Hand-written visitor, because serde's untagged enums do not report what they expected.
struct ValuesVisitor;

impl<'de> Visitor<'de> for ValuesVisitor {
    type Value = Values;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a list of numbers (one per joint) or a table { joint = number }")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Values, E> {
        Ok(Values::One(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Values, E> {
        Ok(Values::One(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Values, A::Error> {
        Deserialize::deserialize(SeqAccessDeserializer::new(seq)).map(Values::List)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Values, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(map)).map(Values::Table)
    }
}
