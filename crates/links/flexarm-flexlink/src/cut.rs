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

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Matrix3, vector};

    fn bar() -> LinkInertia {
        // m l²/12 with m = 12 kg, l = 0.8 m
        let I = 0.64;
        LinkInertia {
            mass: 12.0,
            com: vector![0.4, 0.1, 0.0],
            inertia_com: Matrix3::from_diagonal(&vector![0.02, I, I]),
        }
    }

    /// Truth: two half bars, I = m l²/12 each; measured 1e-16.
    #[test]
    fn a_uniform_bar_cut_in_the_middle_gives_two_half_bars() {
        let [a, b] = cut_inertia(&bar(), &Vector3::zeros(), &vector![0.8, 0.0, 0.0], 0.5).unwrap();
        for (part, x) in [(a, 0.2), (b, 0.6)] {
            assert_relative_eq!(part.mass, 6.0, epsilon = 1e-14);
            assert_relative_eq!(part.com, vector![x, 0.1, 0.0], epsilon = 1e-15);
            assert_relative_eq!(part.inertia[(1, 1)], 6.0 * 0.16 / 12.0, epsilon = 1e-14);
        }
    }

    /// Mass, centre of mass and inertia of both parts together equal those of the link; measured
    /// 4e-16.
    #[test]
    fn both_parts_together_are_exactly_the_link() {
        let link = bar();
        for split in [0.3, 0.5, 0.62] {
            let [a, b] = cut_inertia(&link, &vector![-0.05, 0.0, 0.0], &vector![0.8, 0.0, 0.0], split).unwrap();
            let whole = a.merged(&b);
            assert_relative_eq!(whole.mass, link.mass, epsilon = 1e-13);
            assert_relative_eq!(whole.com, link.com, epsilon = 1e-14);
            assert_relative_eq!(whole.inertia, link.inertia_com, epsilon = 1e-13);
        }
    }

    /// Same for chains; for two parts it equals the closed form. Measured 6e-16.
    #[test]
    fn parts_of_a_chain_together_are_exactly_the_link() {
        // Larger inertia than the bar, which does not extend over the whole line.
        let link = LinkInertia { inertia_com: Matrix3::from_diagonal(&vector![0.02, 0.9, 0.9]), ..bar() };
        let (p_LA, p_LB) = (vector![-0.05, 0.0, 0.0], vector![0.8, 0.0, 0.0]);
        for n in [2, 3, 7] {
            let ends: Vec<f64> = (0..=n).map(|k| -0.05 + 0.85 * k as f64 / n as f64).collect();
            let middle = |k: usize| 0.5 * (ends[k] + ends[k + 1]);
            let chain: Vec<RigidPart> = (0..n)
                .map(|k| RigidPart { mass: 1.0, com: vector![middle(k), 0.0, 0.0], inertia: Matrix3::zeros() })
                .collect();
            let parts = cut_chain(&link, &p_LA, &p_LB, &chain).unwrap();
            let whole = parts[1..].iter().fold(parts[0].clone(), |sum, p| sum.merged(p));
            assert_relative_eq!(whole.mass, link.mass, epsilon = 1e-13);
            assert_relative_eq!(whole.com, link.com, epsilon = 1e-14);
            assert_relative_eq!(whole.inertia, link.inertia_com, epsilon = 1e-13);
            if n == 2 {
                let halves = cut_inertia(&link, &p_LA, &p_LB, 0.5).unwrap();
                assert_relative_eq!(halves[0].mass, parts[0].mass, epsilon = 1e-13);
                assert_relative_eq!(halves[1].com, parts[1].com, epsilon = 1e-13);
            }
        }
    }

    #[test]
    fn a_link_that_is_heavy_at_one_end_is_refused_with_the_workable_range() {
        let mut link = bar();
        link.com.x = 0.1;
        let error = cut_inertia(&link, &Vector3::zeros(), &vector![0.8, 0.0, 0.0], 0.5).unwrap_err();
        assert!(error.to_string().contains("between 0.250 and 0.750"), "{error}");
        let mut light = bar();
        light.inertia_com *= 0.1;
        let error = cut_inertia(&light, &Vector3::zeros(), &vector![0.8, 0.0, 0.0], 0.5).unwrap_err();
        assert!(matches!(error, CutError::Inertia { .. }));
    }
}
