//! Division of a link's own mass properties among parts that together are exactly the link.
//!
//! For a link whose inertia is known (from its URDF) but not its distribution: the centres of mass
//! are placed at the middles of the pieces of the line A-B, the masses follow from the link's
//! centre of mass, and the remaining inertia is shared in proportion to mass. For a uniform bar cut
//! in the middle this is exact ([`cut_inertia`], [`cut_chain`]). A link that is heavy at one end,
//! or more compact than its beam, has no such parts: only a share of its mass then lies along the
//! beam, and the rest is fixed to the two ends ([`share_inertia`]).
//!
//! All vectors and inertias are in link axes, points from the link's origin (m); positions `x`
//! along the line are fractions of A-B. Inertias are about centres of mass. Not here: parts cut
//! from a mesh (`flexarm_fem::chain`).

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

/// Position of a point along the line A-B, 0 at A and 1 at B.
fn fraction(p_LP: &Vector3<f64>, p_LA: &Vector3<f64>, p_AB: &Vector3<f64>) -> f64 {
    (p_LP - p_LA).dot(p_AB) / p_AB.norm_squared()
}

/// Divides a link at one point of the line A-B into a proximal and a distal part.
///
/// ```text
/// x_1 = s/2,  x_2 = (1 + s)/2        m_2 = m (x_c - x_1)/(x_2 - x_1),  m_1 = m - m_2
/// ```
/// with the split s, the middles `x_k` of the two pieces and the centre of mass `x_c` of the link.
/// Both parts have the link's offset from the line.
///
/// * `p_LA`, `p_LB`: ends of the line, from the link's origin, link axes (m).
/// * `split`: fraction of A-B, between 0 and 1.
///
/// Returns the two parts in link axes, or `None` if the link's centre of mass is not between the
/// middles of the pieces, or its inertia is less than that of the two masses.
pub fn cut_inertia(link: &LinkInertia, p_LA: &Vector3<f64>, p_LB: &Vector3<f64>, split: f64) -> Option<[RigidPart; 2]> {
    let p_AB = p_LB - p_LA;
    let x_c = fraction(&link.com, p_LA, &p_AB);
    let (x_1, x_2) = (0.5 * split, 0.5 * (1.0 + split));
    if !(x_c > x_1 && x_c < x_2) {
        return None;
    }
    let distal_mass = link.mass * (x_c - x_1) / (x_2 - x_1);
    let masses = [link.mass - distal_mass, distal_mass];
    let coms = [x_1, x_2].map(|x| link.com + p_AB * (x - x_c));
    bodies(link, &masses, &coms)?.try_into().ok()
}

/// Distributes the link's own mass properties over the parts of a chain, as [`cut_inertia`] does
/// for two.
///
/// ```text
/// m_k = m μ_k/μ (1 + (x_c - x̄)/σ² (x_k - x̄))
/// ```
/// The masses `μ_k` of the chain, with mean position x̄ and variance σ² along A-B, get a weight that
/// is linear along the line, so that their centre of mass is `x_c`, that of the link.
///
/// * `p_LA`, `p_LB`: ends of the line, from the link's origin, link axes (m).
/// * `chain`: at least two parts at different positions along A-B, link axes.
///
/// Returns one body per part in link axes, or `None` if a mass would not be positive, or the link's
/// inertia is less than that of the masses.
pub fn cut_chain(
    link: &LinkInertia,
    p_LA: &Vector3<f64>,
    p_LB: &Vector3<f64>,
    chain: &[RigidPart],
) -> Option<Vec<RigidPart>> {
    // Distribution of the chain's mass along A-B: total, mean and variance of the position.
    let p_AB = p_LB - p_LA;
    let mu: f64 = chain.iter().map(|p| p.mass).sum();
    let x: Vec<f64> = chain.iter().map(|p| fraction(&p.com, p_LA, &p_AB)).collect();
    let mean = chain.iter().zip(&x).map(|(p, x)| p.mass * x).sum::<f64>() / mu;
    let variance = chain.iter().zip(&x).map(|(p, x)| p.mass * (x - mean).powi(2)).sum::<f64>() / mu;

    let x_c = fraction(&link.com, p_LA, &p_AB);
    let tilt = (x_c - mean) / variance;
    let masses: Vec<f64> =
        chain.iter().zip(&x).map(|(p, x)| p.mass * link.mass / mu * (1.0 + tilt * (x - mean))).collect();
    if masses.iter().any(|m| *m <= 0.0) {
        return None;
    }
    let coms: Vec<Vector3<f64>> = x.iter().map(|x| link.com + p_AB * (x - x_c)).collect();
    bodies(link, &masses, &coms)
}

/// Returns bodies with these masses and centres of mass that together are the link; `None` if the
/// inertia left by the point masses is not positive definite.
///
/// ```text
/// I_k = m_k/m (I - Σ m_j (|d_j|² 1 - d_j d_jᵀ)),    d_j = c_j - c        (parallel axes)
/// ```
fn bodies(link: &LinkInertia, masses: &[f64], coms: &[Vector3<f64>]) -> Option<Vec<RigidPart>> {
    let mut rest = link.inertia_com;
    for (mass, com) in masses.iter().zip(coms) {
        let d = skew(&(com - link.com));
        rest += d * d * *mass;
    }
    if rest.symmetric_eigenvalues().min() <= 0.0 {
        return None;
    }
    let body = |(&mass, &com): (&f64, &Vector3<f64>)| RigidPart { mass, com, inertia: rest * (mass / link.mass) };
    Some(masses.iter().zip(coms).map(body).collect())
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

    // Maximum share by bisection, to the last bit.
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
