//! Division of a link's own mass properties among parts that together are exactly the link.
//!
//! For a link whose inertia is known (from its URDF) but not its distribution: the centres of mass
//! are placed at the middles of the pieces of the line A-B, the masses follow from the link's
//! centre of mass, and the remaining inertia is shared in proportion to mass. For a uniform bar cut
//! in the middle this is exact ([`cut_inertia`], [`cut_chain`]). A link that is heavy at one end,
//! or more compact than its beam, has no such parts: only a share of its mass then lies along the
//! beam, and the rest is fixed to the two ends ([`share_inertia`]).

use flexarm_fem::RigidPart;
use flexarm_kinematics::{LinkInertia, skew};
use nalgebra::{Matrix3, Vector3};

/// Minimum and maximum share of the beam in the link's mass.
const SHARES: [f64; 2] = [0.01, 0.99];

/// A link's inertia leaves no mass for the beam.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "its moments of inertia about the centre of mass leave {:.2} % of its {mass:.3} kg for the beam, at least {:.0} % are \
     needed: correct them in the URDF, or replace its body by a uniform beam with parts = \"uniform\"",
    100.0 * .share,
    100.0 * SHARES[0]
)]
pub struct CutError {
    /// Maximum share of the beam in the mass of the link.
    pub share: f64,
    /// Mass of the link (kg).
    pub mass: f64,
}

/// Divides a link at the fraction `split` of the line from `p_LA` to `p_LB` (link axes, m); returns
/// the proximal and the distal part, or `None` if no two such bodies make up the link.
pub fn cut_inertia(link: &LinkInertia, p_LA: &Vector3<f64>, p_LB: &Vector3<f64>, split: f64) -> Option<[RigidPart; 2]> {
    let line = p_LB - p_LA;
    let found = (link.com - p_LA).dot(&line) / line.norm_squared();
    let (low, high) = (0.5 * split, 0.5 * (1.0 + split));
    if !(found > low && found < high) {
        return None;
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
    if rest.symmetric_eigenvalues().min() <= 0.0 {
        return None;
    }
    let part = |k: usize| RigidPart { mass: masses[k], com: coms[k], inertia: rest * (masses[k] / link.mass) };
    Some([part(0), part(1)])
}

/// Distributes the link's own mass properties over the parts of a chain, as [`cut_inertia`] does
/// for two.
///
/// Masses are those of the chain, weighted linearly along A-B so that the centre of mass is that of
/// the link. All parts have the link's offset from the line, and the remaining inertia is shared in
/// proportion to mass. Returns `None` if no such bodies make up the link.
pub fn cut_chain(
    link: &LinkInertia,
    p_LA: &Vector3<f64>,
    p_LB: &Vector3<f64>,
    chain: &[RigidPart],
) -> Option<Vec<RigidPart>> {
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
        return None;
    }
    let coms: Vec<Vector3<f64>> = places.iter().map(|x| link.com + line * (x - found)).collect();
    // Inertia left after the point masses, by the parallel axis theorem.
    let mut rest = link.inertia_com;
    for (mass, com) in masses.iter().zip(&coms) {
        let c = skew(&(com - link.com));
        rest += c * c * *mass;
    }
    if rest.symmetric_eigenvalues().min() <= 0.0 {
        return None;
    }
    let parts = masses.iter().zip(&coms);
    Some(parts.map(|(&mass, &com)| RigidPart { mass, com, inertia: rest * (mass / link.mass) }).collect())
}

/// A link as a beam with bodies fixed to its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedInertia {
    /// Share of the beam in the mass of the link.
    pub share: f64,
    /// Bodies at the proximal and the distal end, link axes.
    pub ends: [RigidPart; 2],
}

/// Divides a link into a beam with as much of its mass as possible and the rest, which is fixed to
/// the two ends; together they are exactly the link.
///
/// ```text
/// c_r = (c - s c_b)/(1 - s)      I_r = I - s I_b - m s/(1 - s) (|d|² 1 - d dᵀ),   d = c_b - c
/// ```
///
/// The share s is the largest up to 99 % for which the rest is a body: its moments of inertia `I_r` obey the
/// triangle inequality, or are positive if those of the link do not obey it. The ends share the
/// rest by the lever of its centre of mass `c_r` on the axis of the beam.
///
/// * `halves`: proximal and distal part of the uniform beam, with the mass of the link.
///
/// # Errors
/// [`CutError`] if the share is below 1 %.
pub fn share_inertia(link: &LinkInertia, halves: [&RigidPart; 2]) -> Result<SharedInertia, CutError> {
    let (mass, beam) = (link.mass, halves[0].merged(halves[1]));
    let d = skew(&(beam.com - link.com));
    let rest = |s: f64| link.inertia_com - beam.inertia * s + d * d * (mass * s / (1.0 - s));
    let least = |I: &Matrix3<f64>| I.symmetric_eigenvalues().min();
    // Second moments of mass, which are positive if the triangle inequality holds.
    let second = |I: &Matrix3<f64>| Matrix3::from_diagonal_element(0.5 * I.trace()) - I;
    let obeys = least(&second(&link.inertia_com)) > 0.0;
    let is_body = |s: f64| least(&if obeys { second(&rest(s)) } else { rest(s) }) >= 0.0;
    let (mut share, mut high) = (0.0, SHARES[1]);
    for _ in 0..60 {
        let middle = 0.5 * (share + high);
        if is_body(middle) { share = middle } else { high = middle }
    }
    if share < SHARES[0] {
        return Err(CutError { share, mass });
    }
    let com = (link.com - beam.com * share) / (1.0 - share);
    // The centres of the two parts are half of the beam apart.
    let apart = halves[1].com - halves[0].com;
    let along = (com - halves[0].com).dot(&apart) / apart.norm_squared();
    let lever = (0.5 * (halves[0].mass / beam.mass + along)).clamp(0.0, 1.0);
    let end = |part: f64| RigidPart { mass: (1.0 - share) * part * mass, com, inertia: rest(share) * part };
    Ok(SharedInertia { share, ends: [end(1.0 - lever), end(lever)] })
}
