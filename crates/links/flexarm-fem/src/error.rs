//! What can be wrong with a beam or with a reduced matrix, with measured and allowed values.
//!
//! Errors in the text of a file are [`FlexFileError`](crate::FlexFileError), which carries one of
//! these as its source where the text is well formed but the link in it cannot be.

use std::fmt;

use nalgebra::Vector3;

/// Names of the six components at an interface, in the order used everywhere.
pub const COMPONENTS: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

/// Why a beam or a reduced link was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// A dimension, a modulus, a mass, ... outside its range.
    #[error("{what} is {found}, allowed is {allowed}")]
    OutOfRange {
        /// The quantity.
        what: String,
        /// Its value.
        found: f64,
        /// The range it must lie in.
        allowed: String,
    },
    /// A quantity that the chosen method needs was not given.
    #[error("{what} is missing: {help}")]
    Missing {
        /// The quantity.
        what: &'static str,
        /// How to mend it.
        help: &'static str,
    },
    /// A name that is not in a table of names.
    #[error("{what} {found:?} is not known; known are {known}")]
    UnknownName {
        /// What was looked up.
        what: &'static str,
        /// The name that was asked for.
        found: String,
        /// All names of the table.
        known: String,
    },
    /// A matrix with a NaN or an infinity in it.
    #[error("{what} has a NaN or infinite entry at row {row}, column {column} (counted from 0)")]
    NotFinite {
        /// The matrix.
        what: &'static str,
        /// Row of the entry, from 0.
        row: usize,
        /// Column of the entry, from 0.
        column: usize,
    },
    /// A stiffness that is not symmetric.
    #[error(
        "{what} is not symmetric: relative asymmetry {asymmetry:.1e} at ({row}, {column}), allowed \
         {allowed:.1e}; was a row or column lost or two of them swapped, or are these printed with \
         too few digits?"
    )]
    NotSymmetric {
        /// The matrix.
        what: &'static str,
        /// `max |k_ij - k_ji| / sqrt(k_ii k_jj)`.
        asymmetry: f64,
        /// The bound on it.
        allowed: f64,
        /// Row of the worst pair, from 0.
        row: usize,
        /// Column of the worst pair, from 0.
        column: usize,
    },
    /// A 12×12 stiffness that resists a motion of both interfaces as one rigid body.
    #[error(
        "the 12x12 stiffness moves under rigid motion: a {motion} of both interfaces gives a \
         relative force {residual:.1e} in {row}, allowed {allowed:.1e}; the interface frames say \
         p_AB = {}{}; is a support left in the model, or do units, axes or the order of the rows differ?",
        place(p_AB),
        implied(implied_p_AB)
    )]
    MovesUnderRigidMotion {
        /// Largest force over the size of the terms that should cancel in it.
        residual: f64,
        /// The bound on it.
        allowed: f64,
        /// The worst rigid motion, such as "rotation about y".
        motion: &'static str,
        /// The row in which the force appears, such as "A uz".
        row: String,
        /// From A to B according to the interface frames, link axes, m.
        p_AB: Vector3<f64>,
        /// From A to B according to the matrix itself, where it says something.
        implied_p_AB: Option<Vector3<f64>>,
    },
    /// A stiffness without resistance, or with negative resistance, in some direction.
    #[error(
        "{what} is singular or not positive definite: smallest eigenvalue {min_eigenvalue:.2e} \
         (scaled to a unit diagonal, at least {allowed:.0e} is needed) in the direction {direction}; \
         a mechanism is left, usually an untied or half-tied interface"
    )]
    NotPositiveDefinite {
        /// The matrix.
        what: &'static str,
        /// Smallest eigenvalue of the matrix scaled to a unit diagonal.
        min_eigenvalue: f64,
        /// The bound on it.
        allowed: f64,
        /// The displacement that meets no resistance.
        direction: Direction,
    },
    /// `K_AA` or `K_AB` of a 12×12 do not follow from its `K_BB`.
    #[error(
        "the blocks of the 12x12 stiffness contradict each other: K_AA and K_AB differ from what \
         K_BB says by {residual:.1e}, allowed {allowed:.1e}"
    )]
    BlocksDisagree {
        /// Largest difference over the size of the terms in it.
        residual: f64,
        /// The bound on it.
        allowed: f64,
    },
    /// An inertia tensor that no rigid body has.
    #[error(
        "the inertia of {part} is impossible: principal moments {:.6e}, {:.6e}, {:.6e} kg m2; {rule}",
        principal[0], principal[1], principal[2]
    )]
    ImpossibleInertia {
        /// The part.
        part: String,
        /// Principal moments about the centre of mass, ascending, kg·m².
        principal: [f64; 3],
        /// The rule that is broken.
        rule: &'static str,
    },
}

/// A displacement in the components of one or two interfaces, largest component ±1.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction(pub Vec<f64>);

impl Direction {
    /// Scales `components` to a largest component of one.
    pub(crate) fn new(components: impl IntoIterator<Item = f64>) -> Self {
        let raw: Vec<f64> = components.into_iter().collect();
        let peak = raw.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()));
        let scale = if peak > 0.0 && peak.is_finite() { 1.0 / peak } else { 1.0 };
        Self(raw.into_iter().map(|x| x * scale).collect())
    }
}

impl fmt::Display for Direction {
    /// Names the components above one per cent of the largest: `uy 1.000, rz -0.667`.
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

/// Refuses anything but a positive finite number.
pub(crate) fn positive(what: impl Into<String>, found: f64) -> Result<f64, FemError> {
    if found > 0.0 && found.is_finite() {
        return Ok(found);
    }
    Err(FemError::OutOfRange { what: what.into(), found, allowed: "a positive finite number".into() })
}

fn place(p: &Vector3<f64>) -> String {
    // Rounded first, so that no -0.000000 is printed.
    let round = |x: f64| (x * 1e6).round() / 1e6 + 0.0;
    format!("({:.6}, {:.6}, {:.6}) m", round(p.x), round(p.y), round(p.z))
}

fn implied(p: &Option<Vector3<f64>>) -> String {
    p.as_ref().map(|p| format!(", the matrix itself {}", place(p))).unwrap_or_default()
}
