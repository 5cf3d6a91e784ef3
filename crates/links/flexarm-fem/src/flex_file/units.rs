//! Units of a reduced-link file: the only place of this crate with numbers that are not SI.

use nalgebra::{Matrix6, Vector6};

use super::document::Table;
use super::error::{FlexErrorKind, FlexFileError};

/// Declared units, in SI.
#[derive(Debug, Clone)]
pub(super) struct Units {
    pub(super) length: f64,
    force: f64,
    pub(super) mass: f64,
    /// Names as declared, for the provenance.
    pub(super) names: String,
}

impl Units {
    /// Reads `[units]`; every unit except that of angles must be declared.
    pub(super) fn read(table: &Table<'_, '_>) -> Result<Self, FlexFileError> {
        table.only(&["length", "force", "mass", "angle"])?;
        let one = |key: &str, known: &[(&'static str, f64)]| {
            let help = "units are never guessed; write what the numbers of this file are in";
            let node = table.require(key, help)?;
            let name = node.text()?;
            known.iter().find(|(word, _)| *word == name).copied().ok_or_else(|| {
                let words: Vec<_> = known.iter().map(|(word, _)| format!("{word:?}")).collect();
                let help = "convert the numbers, or declare the unit that they are in";
                node.fail(FlexErrorKind::Unit, format!("{name:?}"), words.join(" or "), help)
            })
        };
        let (length_name, length) = one("length", &[("m", 1.0), ("mm", 1e-3)])?;
        let (force_name, force) = one("force", &[("N", 1.0), ("kN", 1e3)])?;
        let (mass_name, mass) = one("mass", &[("kg", 1.0), ("t", 1e3)])?;
        if table.get("angle").is_some() {
            one("angle", &[("rad", 1.0)])?;
        }
        let names = format!("{length_name}, {force_name}, {mass_name}, rad");
        Ok(Self { length, force, mass, names })
    }

    /// Converts a 6×6 stiffness block to SI: force/length, force per rad, force·length per rad.
    pub(super) fn stiffness(&self, K: &Matrix6<f64>) -> Matrix6<f64> {
        // Length factors of the conjugate components: displacements in `length`, rotations in rad.
        let l = self.length;
        let s = Vector6::new(1.0, 1.0, 1.0, l, l, l);
        Matrix6::from_fn(|i, j| K[(i, j)] * (s[i] * s[j] * (self.force / l)))
    }

    pub(super) fn is_si(&self) -> bool {
        self.length == 1.0 && self.force == 1.0 && self.mass == 1.0
    }

    /// Unit of inertia, kg·m².
    pub(super) fn inertia(&self) -> f64 {
        self.mass * self.length * self.length
    }
}
