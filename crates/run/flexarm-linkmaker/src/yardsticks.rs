//! Stiffness and mass of a link against each other and against materials: slips of units, and
//! matrices that are something else.

use flexarm_fem::{Doubt, ReducedLink, RigidPart};
use nalgebra::{Matrix3, Matrix6};

/// Speed of sound along a link by its stiffness and mass (m/s): steel and aluminium have 5,100,
/// polymers 1,500, beryllium 12,900; what rides on the link makes it less.
pub const SOUND: std::ops::RangeInclusive<f64> = 300.0..=13_000.0;
/// Density of osmium (kg/m³): nothing is heavier.
pub const OSMIUM: f64 = 22_600.0;
/// Part of the distance of the interfaces over which one of them spreads along the link, and part
/// of the nodes that it has, where it is no seat: bores and flanges of the shipped links spread
/// over 0.43 with 0.02 of the nodes.
const SPREAD: f64 = 0.25;
const SHARE: f64 = 0.1;

/// Speed of sound along a link by its stiffness in the stiffest of three directions, `l √(k/m)`
/// (m/s).
///
/// * `K`: between its ends, translations first (N/m, N, N m/rad), at any point of it.
/// * `length`: between its interfaces (m). `mass`: kg.
pub fn sound_speed(K: &Matrix6<f64>, length: f64, mass: f64) -> Option<f64> {
    let C = K.cholesky()?.inverse();
    let stiffest = (0..3).map(|i| 1.0 / C[(i, i)]).fold(0.0, f64::max);
    let speed = length * (stiffest / mass).sqrt();
    speed.is_finite().then_some(speed)
}

/// Density that a body of this mass (kg) and inertia about its centre (kg m²) has at least (kg/m³):
/// of all bodies of one volume the ball has the least moments, `tr(I) / 2 = 3/5 m R²`.
pub fn least_density(mass: f64, inertia: &Matrix3<f64>) -> f64 {
    let squared = inertia.trace() / (2.0 * mass) * 5.0 / 3.0;
    mass / (4.0 / 3.0 * std::f64::consts::PI * squared.max(0.0).powf(1.5))
}

/// What is doubtful of the stiffness and the mass of a link that was made from files.
pub(crate) fn of_link(link: &ReducedLink, whole: &RigidPart) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let length = (link.X_LB.translation.vector - link.X_LA.translation.vector).norm();
    let speed = sound_speed(&link.split.K_S, length, whole.mass).filter(|_| whole.mass > 0.0 && length > 0.0);
    if let Some(speed) = speed.filter(|speed| !SOUND.contains(speed)) {
        let [end, likely] = match speed {
            speed if speed > *SOUND.end() => ["at most 13000", "stiffness 1000 times too large, or mass in t?"],
            speed if speed < 1e-2 => ["at least 300", "a flexibility (compliance) for a stiffness?"],
            _ => ["at least 300", "stiffness in N/mm or kN/m, or mass in g?"],
        };
        let yardstick = if speed > *SOUND.end() { *SOUND.end() } else { *SOUND.start() };
        let said = format!(
            "by stiffness and mass sound runs along the link with {speed:.3e} m/s, along links {end} ({likely})"
        );
        doubts.push(Doubt::found("link-sound", speed, yardstick, said));
    }
    let density = least_density(whole.mass, &whole.inertia);
    if density.is_finite() && density > OSMIUM {
        let said = format!(
            "by mass and inertia the link has at least {density:.3e} kg/m3, osmium has {OSMIUM} (mass in g, or lengths in m for mm?)"
        );
        doubts.push(Doubt::found("link-density", density, OSMIUM, said));
    }
    doubts
}

/// An interface that is a part of the link, not a seat on it: its nodes are tied together, so that
/// the link does not bend there.
///
/// * `spread`: between the first and the last of its nodes, along the line of the interfaces, over
///   the length of that line.
/// * `share`: its nodes over those of the mesh.
pub(crate) fn of_interface(name: &str, spread: f64, share: f64) -> Option<Doubt> {
    (spread > SPREAD && share > SHARE).then(|| {
        let said = format!(
            "interface {name:?} takes {:.0} % of the nodes and {:.0} % of the length between the interfaces, on which the link does not \
             bend: choose the nodes of the seat alone (told above {:.0} and {:.0} %)",
            100.0 * share,
            100.0 * spread,
            100.0 * SHARE,
            100.0 * SPREAD
        );
        Doubt::found("interface-size", share, SHARE, said)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a bar of steel, `EA/l` along it and `12 EI/l³` across: `√(E/rho)`.
    #[test]
    fn sound_runs_along_a_bar_as_in_its_material() {
        let (E, rho, l, a) = (210e9f64, 7850.0f64, 0.8f64, 0.05f64);
        let (EA, EI) = (E * a * a, E * a.powi(4) / 12.0);
        let across = 12.0 * EI / l.powi(3);
        let K = Matrix6::from_diagonal(&[EA / l, across, across, EI / l, EI / l, EI / l].into());
        let found = sound_speed(&K, l, rho * a * a * l).unwrap();
        let truth = f64::sqrt(E / rho);
        assert!((found / truth - 1.0).abs() < 1e-12, "{found} {truth}");
        assert!(SOUND.contains(&found));
        let thousandth = sound_speed(&(K * 1e-3), l, rho * a * a * l).unwrap();
        assert!(!SOUND.contains(&thousandth), "{thousandth}");
    }

    /// Truth: a ball of steel, and a rod of the same mass, which only looks lighter.
    #[test]
    fn no_body_is_lighter_than_the_ball_of_its_inertia() {
        let (density, radius) = (7850.0, 0.1f64);
        let mass = density * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let found = least_density(mass, &(Matrix3::identity() * (0.4 * mass * radius * radius)));
        assert!((found / density - 1.0).abs() < 1e-12, "{found}");
        let rod = mass / 12.0;
        let rod = Matrix3::from_diagonal(&[0.01 * rod, rod, rod].into());
        assert!(least_density(mass, &rod) < 0.1 * density);
    }

    #[test]
    fn an_interface_that_takes_half_of_the_link_is_told() {
        // A bore, and the end face of a bar of two bricks.
        assert!(of_interface("A", 0.43, 0.02).is_none());
        assert!(of_interface("A", 0.0, 0.33).is_none());
        assert_eq!(of_interface("A", 0.5, 0.5).unwrap().value, Some(0.5));
    }
}
