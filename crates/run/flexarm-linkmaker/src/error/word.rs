//! Errors of values in several notations, as users write them.

use flexarm_fe_io::FeFileError;
use flexarm_fem::FemError;

use crate::reduce::{MATERIAL_FORMS, SPLIT_FORMS};

/// A text or number that is not the value of a setting.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WordError {
    /// A word in a list of numbers is not one.
    #[error("{word:?} in {text:?} is not a finite number")]
    NotFinite {
        /// The word.
        word: String,
        /// The list.
        text: String,
    },
    /// The text has another form.
    #[error("{text:?}: expected {expected}")]
    Form {
        /// The text.
        text: String,
        /// Expected form.
        expected: &'static str,
    },
    /// A split of an import that is none.
    #[error("split {text:?}: expected {expected}")]
    ImportSplit {
        /// The text.
        text: String,
        /// Expected form.
        expected: &'static str,
    },
    /// A split of a reduction that is none.
    #[error("split {text:?} is not known; expected {}", SPLIT_FORMS)]
    Split {
        /// The text.
        text: String,
    },
    /// The split is outside the link.
    #[error("split is {found}; expected {}", SPLIT_FORMS)]
    Fraction {
        /// The fraction found.
        found: f64,
    },
    /// There is no such material.
    #[error("material {name:?} is not known; expected {}", MATERIAL_FORMS)]
    Material {
        /// The text.
        name: String,
    },
    /// There is no preset of this name, but one of a similar name.
    #[error("material {name:?} is not known; expected {}; did you mean {meant:?}?", MATERIAL_FORMS)]
    MisspeltMaterial {
        /// The text.
        name: String,
        /// Name of the preset.
        meant: &'static str,
    },
    /// Impossible constants of a material.
    #[error(transparent)]
    Constants(#[from] FemError),
    /// The normal of a plane is zero.
    #[error("{text:?}: the normal of the plane is zero")]
    NoNormal {
        /// The entry of the map.
        text: String,
    },
    /// Two interfaces of a map have the same name.
    #[error("the name {name:?} is used twice in the map")]
    NameTwice {
        /// The name.
        name: String,
    },
    /// An invalid map of rows.
    #[error(transparent)]
    Rows(Box<FeFileError>),
}

impl WordError {
    pub(crate) fn form(text: &str, expected: &'static str) -> Self {
        Self::Form { text: text.to_owned(), expected }
    }
}
