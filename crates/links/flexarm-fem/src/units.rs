//! Coherent unit systems of meshes and matrices, which FE programs use without declaring them.
//!
//! Mesh and matrix files do not contain units. The user names the system, such as `mm-t-s` (forces
//! in N, stresses in MPa), and every reader uses it to convert to SI.

use crate::error::FemError;

/// Units of length, mass and time; units of force, stress and density are derived.
///
/// ```
/// use flexarm_fem::UnitSystem;
/// let units: UnitSystem = "mm-t-s".parse()?;
/// assert_eq!(units.length, 1e-3);
/// assert!((units.force() - 1.0).abs() < 1e-15); // t mm/s² = N
/// # Ok::<(), flexarm_fem::FemError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSystem {
    /// Unit of length, m.
    pub length: f64,
    /// Unit of mass, kg.
    pub mass: f64,
    /// Unit of time, s.
    pub time: f64,
}

/// Names of the units and their values in SI.
const LENGTHS: [(&str, f64); 5] = [("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048)];
const MASSES: [(&str, f64); 6] = [
    ("kg", 1.0),
    ("t", 1e3),
    ("g", 1e-3),
    ("lb", 0.453_592_37),
    ("slug", 14.593_902_937_206_36),
    ("slinch", 175.126_835_246_476_35),
];
const TIMES: [(&str, f64); 2] = [("s", 1.0), ("ms", 1e-3)];

impl UnitSystem {
    /// m, kg, s, N, Pa.
    pub const SI: Self = Self { length: 1.0, mass: 1.0, time: 1.0 };

    /// Unit of force, N.
    pub fn force(&self) -> f64 {
        self.mass * self.length / (self.time * self.time)
    }

    /// Unit of stress, Pa.
    pub fn stress(&self) -> f64 {
        self.force() / (self.length * self.length)
    }

    /// Unit of density, kg/m³.
    pub fn density(&self) -> f64 {
        self.mass / self.length.powi(3)
    }

    /// Name of the system, such as `mm-t-s`.
    pub fn name(&self) -> String {
        fn word(table: &[(&'static str, f64)], value: f64) -> String {
            let known = table.iter().find(|(_, factor)| *factor == value);
            known.map_or_else(|| format!("{value}"), |(word, _)| (*word).to_owned())
        }
        format!("{}-{}-{}", word(&LENGTHS, self.length), word(&MASSES, self.mass), word(&TIMES, self.time))
    }
}

impl std::fmt::Display for UnitSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name())
    }
}

impl std::str::FromStr for UnitSystem {
    type Err = FemError;

    /// Parses `length-mass-time`: `m-kg-s` (or `SI`), `mm-t-s`, `mm-kg-ms`, `cm-g-s`,
    /// `in-slinch-s`, `ft-slug-s`, ...
    fn from_str(text: &str) -> Result<Self, FemError> {
        if text.eq_ignore_ascii_case("si") {
            return Ok(Self::SI);
        }
        let find = |table: &[(&str, f64)], word: Option<&str>| {
            table.iter().find(|(known, _)| Some(*known) == word).map(|(_, factor)| *factor)
        };
        let mut words = text.split('-');
        let (length, mass, time) =
            (find(&LENGTHS, words.next()), find(&MASSES, words.next()), find(&TIMES, words.next()));
        match (length, mass, time, words.next()) {
            (Some(length), Some(mass), Some(time), None) => Ok(Self { length, mass, time }),
            _ => Err(FemError::UnknownName {
                what: "system of units",
                found: text.to_owned(),
                known: "length-mass-time with m, mm, cm, in, ft; kg, t, g, lb, slug, slinch; s, ms: \
                        m-kg-s (N, Pa), mm-t-s (N, MPa), mm-kg-ms (kN, GPa), in-slinch-s (lbf, psi), ..."
                    .into(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_common_system_is_coherent() {
        for (name, force, stress, density) in [
            ("m-kg-s", 1.0, 1.0, 1.0),
            ("mm-t-s", 1.0, 1e6, 1e12),
            ("mm-kg-ms", 1e3, 1e9, 1e9),
            ("in-slinch-s", 4.448_221_615_260_5, 6_894.757_293_168_4, 10_686_895.0),
        ] {
            let units: UnitSystem = name.parse().unwrap();
            assert_eq!(units.name(), name);
            assert!((units.force() / force - 1.0).abs() < 1e-12, "{name}");
            assert!((units.stress() / stress - 1.0).abs() < 1e-12, "{name}");
            assert!((units.density() / density - 1.0).abs() < 1e-6, "{name}");
        }
    }

    #[test]
    fn an_unknown_system_is_answered_with_the_known_ones() {
        let message = "mm-N-s".parse::<UnitSystem>().unwrap_err().to_string();
        assert!(message.contains("mm-N-s") && message.contains("mm-t-s"), "{message}");
    }
}
