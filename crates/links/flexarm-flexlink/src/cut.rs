//! Division of a link's own mass properties among parts that together are exactly the link.
//!
//! For a link whose inertia is known (from its URDF) but not its distribution: the two centres of
//! mass are placed at the middles of the two pieces of the line A-B, the masses follow from the
//! link's centre of mass, and the remaining inertia is shared in proportion to mass. For a uniform
//! bar cut in the middle this is exact.

use flexarm_fem::RigidPart;
use flexarm_kinematics::{LinkInertia, skew};
use nalgebra::Vector3;

/// Reason why a link's inertia cannot be divided this way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CutError {
    /// The centre of mass is too close to one end.
    #[error(
        "its centre of mass lies at {found:.3} of the line from A to B; cut at {split:.3} the two parts get positive masses \
         only between {low:.3} and {high:.3}: move the split or give the parts in a .flex file"
    )]
    CentreOfMass {
        /// Fraction of A-B at which the centre of mass is.
        found: f64,
        /// Fraction at which the link is cut.
        split: f64,
        /// Lower bound of the admissible fraction.
        low: f64,
        /// Upper bound of the admissible fraction.
        high: f64,
    },
    /// The remaining inertia is not that of a body.
    #[error(
        "after the masses are placed, {remaining:.3} kg m² remain as smallest principal moment of its inertia, \
         which must stay positive: use parts = \"uniform\" or give the parts in a .flex file"
    )]
    Inertia {
        /// Remaining minimum principal moment of inertia (kg m²).
        remaining: f64,
    },
    /// No body with this mass, centre of mass and inertia has these mode shapes.
    #[error(
        "no body with its centre of mass and inertia bends in the shapes of the beam (the smallest eigenvalue of the mass \
         matrix, with the diagonal scaled to one, is {smallest:.1e}, which must be positive): use parts = \"uniform\" or give \
         the parts in a .flex file"
    )]
    Modes {
        /// Minimum eigenvalue of the mass matrix scaled to a unit diagonal.
        smallest: f64,
    },
}

/// Divides a link at the fraction `split` of the line from `p_LA` to `p_LB` (link axes, m); returns
/// the proximal and the distal part.
///
/// # Errors
/// [`CutError`] if no two such bodies make up the link.
pub fn cut_inertia(
    link: &LinkInertia,
    p_LA: &Vector3<f64>,
    p_LB: &Vector3<f64>,
    split: f64,
) -> Result<[RigidPart; 2], CutError> {
    let line = p_LB - p_LA;
    let found = (link.com - p_LA).dot(&line) / line.norm_squared();
    let (low, high) = (0.5 * split, 0.5 * (1.0 + split));
    if !(found > low && found < high) {
        return Err(CutError::CentreOfMass { found, split, low, high });
    }
    let distal_mass = link.mass * (found - low) / (high - low);
    let masses = [link.mass - distal_mass, distal_mass];
    // Both parts have the same offset from the line as the link.
    let coms = [low, high].map(|fraction| link.com + line * (fraction - found));

    // Inertia left after the point masses, by the parallel axis theorem.
    let mut rest = link.inertia_com;
    for (mass, com) in masses.iter().zip(&coms) {
        let c = skew(&(com - link.com));
        rest += c * c * *mass;
    }
    let remaining = rest.symmetric_eigenvalues().min();
    if remaining <= 0.0 {
        return Err(CutError::Inertia { remaining });
    }
    let part = |k: usize| RigidPart { mass: masses[k], com: coms[k], inertia: rest * (masses[k] / link.mass) };
    Ok([part(0), part(1)])
}

/// Distributes the link's own mass properties over the parts of a chain, as [`cut_inertia`] does
/// for two.
///
/// Masses are those of the chain, weighted linearly along A-B so that the centre of mass is that of
/// the link. All parts have the link's offset from the line, and the remaining inertia is shared in
/// proportion to mass.
///
/// # Errors
/// [`CutError`] if no such bodies make up the link.
pub fn cut_chain(
    link: &LinkInertia,
    p_LA: &Vector3<f64>,
    p_LB: &Vector3<f64>,
    chain: &[RigidPart],
) -> Result<Vec<RigidPart>, CutError> {
    // Distribution of the chain's mass along A-B: total, mean and variance of the position.
    let line = p_LB - p_LA;
    let fraction = |p: &Vector3<f64>| (p - p_LA).dot(&line) / line.norm_squared();
    let whole: f64 = chain.iter().map(|p| p.mass).sum();
    let places: Vec<f64> = chain.iter().map(|p| fraction(&p.com)).collect();
    let mean = chain.iter().zip(&places).map(|(p, x)| p.mass * x).sum::<f64>() / whole;
    let spread = chain.iter().zip(&places).map(|(p, x)| p.mass * (x - mean).powi(2)).sum::<f64>() / whole;
    let found = fraction(&link.com);
    let tilt = (found - mean) / spread;
    let masses: Vec<f64> =
        chain.iter().zip(&places).map(|(p, x)| p.mass * link.mass / whole * (1.0 + tilt * (x - mean))).collect();
    if masses.iter().any(|m| *m <= 0.0) {
        // Limits at which the lighter end has zero mass.
        let (first, last) = (places[0], places[places.len() - 1]);
        let (low, high) = (mean - spread / (last - mean), mean + spread / (mean - first));
        return Err(CutError::CentreOfMass { found, split: mean, low, high });
    }
    let coms: Vec<Vector3<f64>> = places.iter().map(|x| link.com + line * (x - found)).collect();
    // Inertia left after the point masses, by the parallel axis theorem.
    let mut rest = link.inertia_com;
    for (mass, com) in masses.iter().zip(&coms) {
        let c = skew(&(com - link.com));
        rest += c * c * *mass;
    }
    let remaining = rest.symmetric_eigenvalues().min();
    if remaining <= 0.0 {
        return Err(CutError::Inertia { remaining });
    }
    let parts = masses.iter().zip(&coms);
    Ok(parts.map(|(&mass, &com)| RigidPart { mass, com, inertia: rest * (mass / link.mass) }).collect())
}
