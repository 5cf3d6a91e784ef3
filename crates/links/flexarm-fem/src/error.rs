//! Errors of beams and reduced matrices, with measured and allowed values.
//!
//! Errors in the text of a file are [`FlexFileError`](crate::FlexFileError). It carries one of
//! these errors as its source if the text is well formed but the link in it is impossible.

use std::fmt;

use nalgebra::Vector3;

/// Names of the six components at an interface, in the order used throughout.
pub const COMPONENTS: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

/// Errors of beams and reduced links.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// A dimension, modulus, mass or similar is out of range.
    #[error("{what} is {found}, allowed is {allowed}")]
    OutOfRange {
        /// Name of the quantity.
        what: String,
        /// Value found.
        found: f64,
        /// Allowed range.
        allowed: String,
    },
    /// A quantity that the chosen method needs was not given.
    #[error("{what} is missing: {help}")]
    Missing {
        /// Name of the quantity.
        what: &'static str,
        /// Hint for a correction.
        help: &'static str,
    },
    /// The elements of a beam could not be assembled, condensed or solved.
    #[error("the {step} of the beam elements failed: {cause}; is the section possible at this length?")]
    BeamElements {
        /// Step that failed.
        step: &'static str,
        /// Its error.
        cause: String,
    },
    /// A name is not in a table of names.
    #[error("{what} {found:?} is not known; known are {known}")]
    UnknownName {
        /// Kind of name.
        what: &'static str,
        /// Name that was looked up.
        found: String,
        /// All names of the table.
        known: String,
    },
    /// A matrix has a NaN or infinite entry.
    #[error("{what} has a NaN or infinite entry at row {row}, column {column} (counted from 0)")]
    NotFinite {
        /// Name of the matrix.
        what: &'static str,
        /// Row of the entry, from 0.
        row: usize,
        /// Column of the entry, from 0.
        column: usize,
    },
    /// A stiffness matrix is not symmetric.
    #[error(
        "{what} is not symmetric: relative asymmetry {asymmetry:.1e} at ({row}, {column}), allowed \
         {allowed:.1e}; was a row or column lost or two of them swapped, or are these printed with \
         too few digits?"
    )]
    NotSymmetric {
        /// Name of the matrix.
        what: &'static str,
        /// `max |k_ij - k_ji| / sqrt(k_ii k_jj)`.
        asymmetry: f64,
        /// Allowed asymmetry.
        allowed: f64,
        /// Row of the pair with the largest asymmetry, from 0.
        row: usize,
        /// Column of the pair with the largest asymmetry, from 0.
        column: usize,
    },
    /// A 12×12 stiffness resists a rigid motion of both interfaces.
    #[error(
        "the 12x12 stiffness moves under rigid motion: a {motion} of both interfaces gives a \
         relative force {residual:.1e} in {row}, allowed {allowed:.1e}; the interface frames say \
         p_AB = {}{}; is a support left in the model, or do units, axes or the order of the rows differ?",
        place(p_AB),
        implied(implied_p_AB)
    )]
    MovesUnderRigidMotion {
        /// Maximum force relative to the size of the terms that should cancel in it.
        residual: f64,
        /// Allowed residual.
        allowed: f64,
        /// Rigid motion with the largest residual, such as "rotation about y".
        motion: &'static str,
        /// Row of the largest residual, such as "A uz".
        row: String,
        /// Vector from A to B according to the interface frames, link axes, m.
        p_AB: Vector3<f64>,
        /// Vector from A to B implied by the matrix itself, if it implies one.
        implied_p_AB: Option<Vector3<f64>>,
    },
    /// A stiffness is zero or negative in some direction.
    #[error(
        "{what} is singular or not positive definite: smallest eigenvalue {min_eigenvalue:.2e} \
         (scaled to a unit diagonal, at least {allowed:.0e} is needed) in the direction {direction}; \
         a mechanism is left, usually an untied or half-tied interface"
    )]
    NotPositiveDefinite {
        /// Name of the matrix.
        what: &'static str,
        /// Minimum eigenvalue of the matrix scaled to a unit diagonal.
        min_eigenvalue: f64,
        /// Minimum allowed eigenvalue.
        allowed: f64,
        /// Displacement without resistance.
        direction: Direction,
    },
    /// `K_AA` or `K_AB` of a 12×12 do not follow from its `K_BB`.
    #[error(
        "the blocks of the 12x12 stiffness contradict each other: K_AA and K_AB differ from what \
         K_BB says by {residual:.1e}, allowed {allowed:.1e}"
    )]
    BlocksDisagree {
        /// Maximum difference relative to the size of its terms.
        residual: f64,
        /// Allowed residual.
        allowed: f64,
    },
    /// An inertia tensor is impossible for a rigid body.
    #[error(
        "the inertia of {part} is impossible: principal moments {:.6e}, {:.6e}, {:.6e} kg m2; {rule}",
        principal[0], principal[1], principal[2]
    )]
    ImpossibleInertia {
        /// Name of the part.
        part: String,
        /// Principal moments about the centre of mass, ascending, kg·m².
        principal: [f64; 3],
        /// Violated rule.
        rule: &'static str,
    },
}

/// Displacement in the components of one or two interfaces, scaled to a largest component of ±1.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction(pub Vec<f64>);

impl Direction {
    /// Scales `components` so that the largest has magnitude 1.
    pub(crate) fn new(components: impl IntoIterator<Item = f64>) -> Self {
        let raw: Vec<f64> = components.into_iter().collect();
        let peak = raw.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()));
        let scale = if peak > 0.0 && peak.is_finite() { 1.0 / peak } else { 1.0 };
        Self(raw.into_iter().map(|x| x * scale).collect())
    }
}

impl fmt::Display for Direction {
    /// Lists the components above one per cent of the largest: `uy 1.000, rz -0.667`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (i, x) in self.0.iter().enumerate().filter(|(_, x)| x.abs() > 0.01) {
            let side = match (self.0.len(), i) {
                (12, 0..6) => "A ",
                (12, _) => "B ",
                _ => "",
            };
            write!(f, "{separator}{side}{} {x:.3}", COMPONENTS[i % 6])?;
            separator = ", ";
        }
        Ok(())
    }
}

/// Returns `found`, or an error unless it is positive and finite.
pub(crate) fn positive(what: impl Into<String>, found: f64) -> Result<f64, FemError> {
    if found > 0.0 && found.is_finite() {
        return Ok(found);
    }
    Err(FemError::OutOfRange { what: what.into(), found, allowed: "a positive finite number".into() })
}

fn place(p: &Vector3<f64>) -> String {
    // Rounded first, so that -0.000000 is never printed.
    let round = |x: f64| (x * 1e6).round() / 1e6 + 0.0;
    format!("({:.6}, {:.6}, {:.6}) m", round(p.x), round(p.y), round(p.z))
}

fn implied(p: &Option<Vector3<f64>>) -> String {
    p.as_ref().map(|p| format!(", the matrix itself {}", place(p))).unwrap_or_default()
}
