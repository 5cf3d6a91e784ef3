//! A material in a file: the name of a preset, or constants.

use serde::Deserialize;

/// Name of a preset, or constants.
#[derive(Clone, Debug)]
pub enum MaterialEntry {
    /// One of steel, aluminium, cast_iron, ductile_iron.
    Named(String),
    /// Elastic constants and density.
    Given(MaterialConstants),
}

impl<'de> Deserialize<'de> for MaterialEntry {
    /// Implemented by hand: an untagged enum would not report which constant is missing.
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> serde::de::Visitor<'de> for Either {
            type Value = MaterialEntry;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a material or { E = ..., nu = ..., rho = ... }")
            }
            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<MaterialEntry, E> {
                Ok(MaterialEntry::Named(name.to_owned()))
            }
            fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<MaterialEntry, A::Error> {
                let constants = MaterialConstants::deserialize(serde::de::value::MapAccessDeserializer::new(map))?;
                Ok(MaterialEntry::Given(constants))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Isotropic material.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialConstants {
    /// Young's modulus (Pa).
    #[serde(rename = "E")]
    pub young: f64,
    /// Poisson's ratio.
    pub nu: f64,
    /// Density (kg/m³).
    pub rho: f64,
}
