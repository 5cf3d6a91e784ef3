//! Stepper settings in a summary: keys and values as given by the stepper's registry entry, so that
//! the summary does not depend on any stepper.

use std::fmt;

use flexarm_stepping::{STEPPERS, StepperKind, StepperOptions, StepperSetting};
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde::ser::SerializeMap;
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
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (key, value) in &self.0 {
            map.serialize_entry(key, value)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for StepperSettings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Settings;

        /// Values of other types come from files of other versions.
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum MaybeValue {
            Value(SettingValue),
            Other(IgnoredAny),
        }

        impl<'de> Visitor<'de> for Settings {
            type Value = StepperSettings;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("settings of a stepper")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<StepperSettings, A::Error> {
                let mut settings = Vec::new();
                while let Some((key, value)) = map.next_entry::<String, MaybeValue>()? {
                    if let MaybeValue::Value(value) = value {
                        settings.push((key, value));
                    }
                }
                // A JSON reader may return the keys in another order.
                let order = known_keys();
                settings.sort_by_key(|(key, _)| order.iter().position(|known| known == key).unwrap_or(order.len()));
                Ok(StepperSettings(settings))
            }
        }
        deserializer.deserialize_map(Settings)
    }
}
