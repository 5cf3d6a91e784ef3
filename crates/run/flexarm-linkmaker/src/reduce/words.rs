//! Values of a reduction job with several notations: text on a command line, TOML in a job file.
//!
//! Each type has [`FromStr`] for the one and serde for the other, with the same messages. Not here:
//! the job ([`super::ReduceJob`]), values that only an import has (`import/words.rs`).

use std::fmt;
use std::str::FromStr;

use flexarm_fem::{Material, SplitAt};
use flexarm_settings::Words;
use nalgebra::Vector3;
use serde::de::{Error as _, SeqAccess, Visitor, value::SeqAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{MaterialEntry, WordError};

/// A material, by the name of a preset or by its constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialChoice {
    /// Name of the preset, if any.
    pub name: Option<&'static str>,
    /// Constants, SI.
    pub material: Material,
}

/// Notations of a material, for messages.
pub(super) const MATERIAL_FORMS: &str =
    "steel, aluminium, cast_iron, ductile_iron, or E,nu,rho in SI such as 70e9,0.33,2700 (Pa, -, kg/m3)";

impl MaterialChoice {
    fn named(name: &str) -> Result<Self, WordError> {
        let (name, material) = Material::preset(name).ok_or_else(|| Self::unknown(name))?;
        Ok(Self { name: Some(name), material })
    }

    fn unknown(name: &str) -> WordError {
        let meant = Material::suggestion(name).map_or_else(String::new, |meant| format!("; did you mean {meant:?}?"));
        WordError(format!("material {name:?} is not known; expected {MATERIAL_FORMS}{meant}"))
    }

    fn given([young, nu, rho]: [f64; 3]) -> Result<Self, WordError> {
        let material = Material::isotropic(young, nu, rho);
        material.check()?;
        Ok(Self { name: None, material })
    }
}

impl FromStr for MaterialChoice {
    type Err = WordError;

    fn from_str(text: &str) -> Result<Self, WordError> {
        if !text.contains(',') {
            return Self::named(text.trim());
        }
        match numbers(text)?[..] {
            [young, nu, rho] => Self::given([young, nu, rho]),
            _ => Err(Self::unknown(text)),
        }
    }
}

impl fmt::Display for MaterialChoice {
    /// Writes name and constants.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&described(&self.material))
    }
}

/// Describes a material: the preset that it equals, if any, and its constants.
pub(super) fn described(material: &Material) -> String {
    let name = Material::PRESETS.iter().find(|(_, preset)| preset == material).map_or("", |(name, _)| *name);
    let Material { E, nu, rho, .. } = material;
    let constants = format!("E {} GPa, nu {nu}, rho {rho} kg/m3", (E * 1e-3).round() * 1e-6);
    if name.is_empty() { constants } else { format!("{name} ({constants})") }
}

impl Serialize for MaterialChoice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.name {
            Some(name) => serializer.serialize_str(name),
            None => {
                #[derive(Serialize)]
                struct Constants {
                    #[serde(rename = "E")]
                    young: f64,
                    nu: f64,
                    rho: f64,
                }
                let Material { E, nu, rho, .. } = self.material;
                Constants { young: E, nu, rho }.serialize(serializer)
            }
        }
    }
}

impl<'de> Deserialize<'de> for MaterialChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let choice = match MaterialEntry::deserialize(deserializer)? {
            MaterialEntry::Named(name) => Self::named(&name),
            MaterialEntry::Given(m) => Self::given([m.young, m.nu, m.rho]),
        };
        choice.map_err(D::Error::custom)
    }
}

/// Position of the elastic joint of the two-part link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SplitChoice {
    /// At the centre of compliance.
    #[default]
    ElasticCentre,
    /// Midway between A and B.
    Mid,
    /// At a fraction of the distance from A to B.
    Fraction(f64),
    /// At a point of the link frame, in the unit of the file.
    Point([f64; 3]),
}

/// Notations of a split, for messages.
const SPLIT_FORMS: &str = "elastic-centre, mid, a fraction of the distance from A to B (0 to 1), or a point x,y,z";

impl SplitChoice {
    /// Converts from a unit of length in metres.
    pub(crate) fn at(self, unit_m: f64) -> SplitAt {
        match self {
            Self::ElasticCentre => SplitAt::ElasticCentre,
            Self::Mid => SplitAt::MidLength,
            Self::Fraction(fraction) => SplitAt::Fraction(fraction),
            Self::Point(point) => SplitAt::Point(Vector3::from(point) * unit_m),
        }
    }

    fn fraction(x: f64) -> Result<Self, WordError> {
        let inside = x.is_finite() && (0.0..=1.0).contains(&x);
        inside.then_some(Self::Fraction(x)).ok_or_else(|| WordError(format!("split is {x}; expected {SPLIT_FORMS}")))
    }
}

impl FromStr for SplitChoice {
    type Err = WordError;

    fn from_str(text: &str) -> Result<Self, WordError> {
        let wrong = || WordError(format!("split {text:?} is not known; expected {SPLIT_FORMS}"));
        match text.trim() {
            "elastic-centre" | "elastic-center" => Ok(Self::ElasticCentre),
            "mid" => Ok(Self::Mid),
            other => match numbers(other).as_deref() {
                Ok([x]) => Self::fraction(*x),
                Ok([x, y, z]) => Ok(Self::Point([*x, *y, *z])),
                _ => Err(wrong()),
            },
        }
    }
}

impl Serialize for SplitChoice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::ElasticCentre => serializer.serialize_str("elastic-centre"),
            Self::Mid => serializer.serialize_str("mid"),
            Self::Fraction(x) => serializer.serialize_f64(*x),
            Self::Point(p) => p.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for SplitChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Forms;
        impl<'de> Visitor<'de> for Forms {
            type Value = SplitChoice;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"elastic-centre\", \"mid\", a fraction such as 0.5, or a point [x, y, z]")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<SplitChoice, E> {
                text.parse().map_err(E::custom)
            }

            fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<SplitChoice, E> {
                SplitChoice::fraction(x).map_err(E::custom)
            }

            fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<SplitChoice, E> {
                self.visit_f64(x as f64)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<SplitChoice, A::Error> {
                <[f64; 3]>::deserialize(SeqAccessDeserializer::new(seq)).map(SplitChoice::Point)
            }
        }
        deserializer.deserialize_any(Forms)
    }
}

/// Quadrature rule of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum QuadratureChoice {
    /// Enough points for exact stiffness and mass.
    #[default]
    Exact,
    /// The points of CalculiX, for comparison with it.
    Calculix,
}

impl Words for QuadratureChoice {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("exact", Self::Exact, "Sufficient points for stiffness and mass [default]"),
        ("calculix", Self::Calculix, "The points of CalculiX, for comparison with it"),
    ];
}

/// Elimination ordering of the unknowns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderingChoice {
    /// Chosen by the size of the mesh.
    #[default]
    Auto,
    /// Approximate minimum degree.
    Amd,
    /// Nested dissection.
    Nested,
}

impl Words for OrderingChoice {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("auto", Self::Auto, "By size [default]"),
        ("amd", Self::Amd, "Approximate minimum degree"),
        ("nested", Self::Nested, "Nested dissection"),
    ];
}

/// A position derived from the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum At {
    /// The mean of the selected nodes.
    Centroid,
}

/// Parses finite numbers separated by commas.
///
/// # Errors
/// [`WordError`].
pub fn numbers(text: &str) -> Result<Vec<f64>, WordError> {
    let number = |word: &str| {
        let value = word.parse().ok().filter(|x: &f64| x.is_finite());
        value.ok_or_else(|| WordError(format!("{word:?} in {text:?} is not a finite number")))
    };
    text.split(',').map(str::trim).map(number).collect()
}

/// (De)serialisation of an optional value through its text form.
pub(super) mod text {
    use std::fmt::Display;
    use std::str::FromStr;

    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(crate) fn serialize<T: Display, S: Serializer>(value: &Option<T>, serializer: S) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => serializer.collect_str(value),
            None => serializer.serialize_none(),
        }
    }

    pub(crate) fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<T>, D::Error> {
        String::deserialize(deserializer)?.parse().map(Some).map_err(D::Error::custom)
    }
}
