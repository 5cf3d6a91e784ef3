//! Plausibility checks of stiffness against mass, and of the density of a link: detect unit errors
//! and wrong matrices.
//!
//! Start at `of_link`. SI units, link axes. Not here: checks of the matrices themselves
//! (`flexarm_fem::gate`), caveats about robots.

use flexarm_fem::{ReducedLink, RigidPart};
use flexarm_settings::Finding;
use nalgebra::{Matrix3, Matrix6};

/// Plausible speed of sound along a link, from stiffness and mass (m/s): steel and aluminium have
/// 5,100, polymers 1,500, beryllium 12,900; attached mass lowers it.
pub const SOUND: std::ops::RangeInclusive<f64> = 300.0..=13_000.0;
/// Density of osmium (kg/m³), the densest material.
pub const OSMIUM: f64 = 22_600.0;
/// Limits above which an interface is too large for a seat: its extent along the link relative to
/// the distance of the interfaces, and its share of the nodes. Bores and flanges of the shipped
/// links reach 0.43 with 0.02 of the nodes.
const SPREAD: f64 = 0.25;
const SHARE: f64 = 0.1;
/// Maximum distance of the centre of mass from the origin, and radius of gyration, over the distance
/// of the interfaces from the origin or from each other.
const BEYOND: f64 = 5.0;
/// Maximum distance of an interface's point from the centroid of its nodes, over their extent.
const BESIDE: f64 = 2.0;

/// Returns the speed of sound along a link according to its stiffness in the stiffest of three
/// directions, `l √(k/m)` (m/s); `None` if `K` is not positive definite or the result is not
/// finite.
///
/// * `K`: stiffness between the ends, translations first (N/m, N, N m/rad), at any point of the
///   link.
/// * `length`: distance between the interfaces (m). `mass`: kg.
pub fn sound_speed(K: &Matrix6<f64>, length: f64, mass: f64) -> Option<f64> {
    let C = K.cholesky()?.inverse();
    let stiffest = (0..3).map(|i| 1.0 / C[(i, i)]).fold(0.0, f64::max);
    let speed = length * (stiffest / mass).sqrt();
    speed.is_finite().then_some(speed)
}

/// Returns the minimum density (kg/m³) of a body with this mass (kg) and inertia about its centre
/// of mass (kg m²): among all bodies of equal volume the ball has the smallest moments,
/// `tr(I) / 2 = 3/5 m R²`.
pub fn least_density(mass: f64, inertia: &Matrix3<f64>) -> f64 {
    let squared = inertia.trace() / (2.0 * mass) * 5.0 / 3.0;
    mass / (4.0 / 3.0 * std::f64::consts::PI * squared.max(0.0).powf(1.5))
}

/// Returns warnings about implausible stiffness or mass of a link made from files.
pub(crate) fn of_link(link: &ReducedLink, whole: &RigidPart) -> Vec<Finding> {
    // Speed of sound along the link: stiffness and mass in matching units.
    let mut caveats = Vec::new();
    let length = (link.X_LB.translation.vector - link.X_LA.translation.vector).norm();
    let speed = sound_speed(&link.split.K_S, length, whole.mass).filter(|_| whole.mass > 0.0 && length > 0.0);
    if let Some(speed) = speed.filter(|speed| !SOUND.contains(speed)) {
        let [end, likely] = match speed {
            speed if speed > *SOUND.end() => ["at most 13000", "stiffness 1000 times too large, or mass in t?"],
            speed if speed < 1e-2 => ["at least 300", "compliance instead of stiffness?"],
            _ => ["at least 300", "stiffness in N/mm or kN/m, or mass in g?"],
        };
        let yardstick = if speed > *SOUND.end() { *SOUND.end() } else { *SOUND.start() };
        let said = format!(
            "from its stiffness and mass, the speed of sound along the link is {speed:.3e} m/s, expected {end} \
             ({likely})"
        );
        caveats.push(Finding::warning("link-sound", "", said, "").measured(speed, yardstick));
    }
    // Centre of mass and radius of gyration against the place of the interfaces.
    let (com, gyration) = (whole.com.norm(), (whole.inertia.symmetric_eigenvalues().max() / whole.mass).sqrt());
    let size = [link.X_LA, link.X_LB].map(|X| X.translation.vector.norm()).into_iter().fold(length, f64::max);
    for (code, what, value) in
        [("link-com", "its centre of mass is", com), ("link-gyration", "its radius of gyration is", gyration)]
    {
        if whole.mass > 0.0 && size > 0.0 && value > BEYOND * size {
            let said = format!(
                "{what} {value:.3e} m, with interfaces within {size:.3e} m: expected at most {BEYOND} times that (lengths in mm, \
                 or inertia in kg mm2?)"
            );
            caveats.push(Finding::warning(code, "", said, "").measured(value, BEYOND * size));
        }
    }
    // Density.
    let density = least_density(whole.mass, &whole.inertia);
    if density.is_finite() && density > OSMIUM {
        let said = format!(
            "from its mass and inertia, the density of the link is at least {density:.3e} kg/m3, above that of \
             osmium, {OSMIUM} (mass in g, or lengths in m instead of mm?)"
        );
        caveats.push(Finding::warning("link-density", "", said, "").measured(density, OSMIUM));
    }
    caveats
}

/// Returns a warning about an interface whose point is far from its nodes.
///
/// * `off`: distance from their centroid (m). `extent`: diagonal of their box (m).
pub(crate) fn of_point(name: &str, off: f64, extent: f64) -> Option<Finding> {
    (extent > 0.0 && off > BESIDE * extent).then(|| {
        let said = format!(
            "the point of interface {name:?} is {off:.3e} m from the centroid of its nodes, which extend over {extent:.3e} m: \
             expected at most {BESIDE} times that (another unit or another interface?)"
        );
        Finding::warning("interface-point", "", said, "").measured(off, BESIDE * extent)
    })
}

/// Returns a warning about an interface that is a section of the link rather than a seat: its nodes
/// are tied together, so that the link does not bend there.
///
/// * `spread`: extent of its nodes along the line of the interfaces, relative to the length of that
///   line.
/// * `share`: number of its nodes relative to that of the mesh.
#[doc(hidden)]
pub fn of_interface(name: &str, spread: f64, share: f64) -> Option<Finding> {
    (spread > SPREAD && share > SHARE).then(|| {
        let said = format!(
            "interface {name:?} covers {:.0} % of the nodes and {:.0} % of the length between the interfaces, \
             where the link cannot deform: select only the nodes of the seat (limits of this warning: {:.0} and \
             {:.0} %)",
            100.0 * share,
            100.0 * spread,
            100.0 * SHARE,
            100.0 * SPREAD
        );
        Finding::warning("interface-size", "", said, "").measured(share, SHARE)
    })
}
