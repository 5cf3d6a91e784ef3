//! Stepper settings in a summary: keys and values as given by the stepper's registry entry, so that
//! the summary does not depend on any stepper. Not here: the steppers and their options
//! (`flexarm-stepping`).

use std::collections::BTreeMap;
use std::fmt;

use flexarm_stepping::{STEPPERS, StepperKind, StepperOptions, StepperSetting};
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Settings by key, in the order of the registry. In JSON they are keys of the enclosing object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepperSettings(pub Vec<(String, SettingValue)>);

/// Value of a setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SettingValue {
    /// Boolean.
    Flag(bool),
    /// Number.
    Number(f64),
    /// One of several names.
    Word(String),
}

impl fmt::Display for SettingValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(on) => on.fmt(f),
            Self::Number(x) => x.fmt(f),
            Self::Word(word) => word.fmt(f),
        }
    }
}

impl StepperSettings {
    /// Returns the settings of a stepper.
    pub fn of(stepper: &StepperKind) -> Self {
        let value = |setting| match setting {
            StepperSetting::Flag(on) => SettingValue::Flag(on),
            StepperSetting::Number(x) => SettingValue::Number(x),
            StepperSetting::Word(word) => SettingValue::Word(word.to_owned()),
        };
        Self(stepper.settings().into_iter().map(|(key, setting)| (key.to_owned(), value(setting))).collect())
    }

    /// Returns the settings whose texts are known by their keys.
    pub fn from_texts<'t>(text: impl Fn(&str) -> Option<&'t str>) -> Self {
        let value = |text: &str| match (text.parse(), text.parse()) {
            (Ok(on), _) => SettingValue::Flag(on),
            (_, Ok(number)) => SettingValue::Number(number),
            _ => SettingValue::Word(text.to_owned()),
        };
        let known = known_keys().into_iter().filter_map(|key| Some((key, text(key).filter(|text| !text.is_empty())?)));
        let mut settings: Vec<(String, SettingValue)> = Vec::new();
        for (key, text) in known {
            if settings.iter().all(|(own, _)| own != key) {
                settings.push((key.to_owned(), value(text)));
            }
        }
        Self(settings)
    }

    /// Returns the setting with this key, if the stepper has it.
    pub fn get(&self, key: &str) -> Option<&SettingValue> {
        self.0.iter().find(|(own, _)| own == key).map(|(_, value)| value)
    }
}

/// Returns the keys of all steppers, each in the order of its stepper.
fn known_keys() -> Vec<&'static str> {
    let options = StepperOptions::default();
    STEPPERS.iter().flat_map(|entry| (entry.with)(&options).settings()).map(|(key, _)| key).collect()
}

impl Serialize for StepperSettings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

impl<'de> Deserialize<'de> for StepperSettings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Values of other types come from files of other versions.
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum MaybeValue {
            Value(SettingValue),
            Other(IgnoredAny),
        }
        let own = |(key, value)| match value {
            MaybeValue::Value(value) => Some((key, value)),
            MaybeValue::Other(_) => None,
        };
        let all = BTreeMap::<String, MaybeValue>::deserialize(deserializer)?;
        let mut settings: Vec<(String, SettingValue)> = all.into_iter().filter_map(own).collect();
        // A map has lost the order of the registry.
        let order = known_keys();
        settings.sort_by_key(|(key, _)| order.iter().position(|known| known == key).unwrap_or(order.len()));
        Ok(Self(settings))
    }
}
