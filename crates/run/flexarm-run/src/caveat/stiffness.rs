//! Caveats about the stiffness of links: values in a robot file compared with the beam or `.flex`
//! file that they replace, and with the mass.
//!
//! Stiffnesses are 6×6 at the split in S axes, linear first. Start at [`of_stiffness`]. Not here:
//! matrices that are no stiffness, which are errors (`flexarm_flexlink::spring_stiffness`).

use flexarm_linkmaker::yardsticks::{SOUND, sound_speed};
use nalgebra::{Matrix6, Vector6};

use super::slip::{self, slip};
use super::{Finding, kinds};
use crate::robot::robot_link::RobotLink;

/// Maximum stiffness ratio, or inverse ratio, of measured links to their beam or mesh in any
/// direction.
const MEASURED: f64 = 3.0;
/// Coupling term relative to the geometric mean of its diagonal terms below which it is negligible.
const COUPLED: f64 = 0.1;
/// Relative difference below which two matrices count as equal.
const SAME: f64 = 0.02;
/// Minimum speed of sound along a robot link by its stiffness and mass (m/s); castings with drives
/// on them have 300.
const SLOWEST: f64 = 50.0;
/// Factors of matrices in other units.
const UNITS: &[slip::Factor] = &[(1e3, "N mm or m N"), (1e-3, "kN or N/mm"), (1e6, "mN"), (1e-6, "MN")];

/// Returns all of these caveats about a link with two interfaces.
pub(crate) fn of_stiffness(name: &str, link: &RobotLink) -> Vec<Finding> {
    let mut caveats: Vec<Finding> = given(name, link).into_iter().collect();
    caveats.extend(sound(name, link));
    caveats
}

/// Compares the two-part stiffness with that of the source.
fn given(name: &str, link: &RobotLink) -> Option<Finding> {
    let source = link.flexible.reduced.split.K_S;
    let own = link.scaled(&source);
    let [least, most] = ratios(&own, &source)?;
    let worst = if most * least >= 1.0 { most } else { least };
    if most > MEASURED || least < 1.0 / MEASURED {
        let caveat = kinds::LINK_STIFFNESS.found(name, worst, MEASURED);
        return Some(caveat.likely(copied(link).unwrap_or_else(|| slip(worst, &(0.5..=2.0), UNITS, 1.0))));
    }
    let coupling = coupling(&source);
    let bare = link.stiffness.is_some_and(|K| self::coupling(&K) == 0.0);
    (bare && coupling > COUPLED)
        .then(|| kinds::LINK_COUPLING.found(name, coupling, COUPLED).likely("its diagonal alone?"))
}

/// Returns the name of the matrix that the given one copies, if there is one.
fn copied(link: &RobotLink) -> Option<String> {
    let given = link.stiffness?;
    let reduced = &link.flexible.reduced;
    let diagonal = |K: &Matrix6<f64>| Matrix6::from_diagonal(&K.diagonal());
    let sources = [
        (reduced.K_BB, "the 6x6 of the .flex file, which is that at the far end"),
        (diagonal(&reduced.K_BB), "the diagonal of the 6x6 of the .flex file, which is that at the far end"),
        (reduced.split.K_S, "the spring's own 6x6"),
        (diagonal(&reduced.split.K_S), "the diagonal of the spring's own 6x6"),
    ];
    let factors = [(1.0, ""), (1e3, " times 1000"), (1e-3, " over 1000")];
    let explanation = |(K, words): &(Matrix6<f64>, &str)| {
        let same = |(factor, _): &&(f64, &str)| (given - K * *factor).norm() < SAME * (K * *factor).norm();
        factors.iter().find(same).map(|(_, times)| format!("{words}{times}?"))
    };
    sources.iter().find_map(explanation)
}

/// Returns the minimum and maximum ratio of a stiffness to another over all directions: the eigenvalues
/// of `L⁻¹ K L⁻ᵀ`, where `L Lᵀ` is the other. `None` if either is not positive definite.
fn ratios(K: &Matrix6<f64>, other: &Matrix6<f64>) -> Option<[f64; 2]> {
    let L = other.cholesky()?.l();
    let half = L.solve_lower_triangular(K)?;
    let whole = L.solve_lower_triangular(&half.transpose())?;
    let values = ((whole + whole.transpose()) * 0.5).symmetric_eigenvalues();
    let both = [values.min(), values.max()];
    both.iter().all(|x| x.is_finite() && *x > 0.0).then_some(both)
}

/// Returns the maximum coupling term relative to the geometric mean of its diagonal terms.
fn coupling(K: &Matrix6<f64>) -> f64 {
    let root: Vector6<f64> = K.diagonal().map(f64::sqrt);
    let scaled = Matrix6::from_fn(|i, j| if i == j { 0.0 } else { K[(i, j)] / (root[i] * root[j]) });
    scaled.amax()
}

/// Checks the speed of sound along the link by its stiffness and mass.
fn sound(name: &str, link: &RobotLink) -> Option<Finding> {
    let reduced = &link.flexible.reduced;
    let apart = (reduced.X_LB.translation.vector - reduced.X_LA.translation.vector).norm();
    // The interfaces of a beam are joint frames, which may coincide.
    let length = link.beam.as_ref().map_or(apart, |beam| beam.length);
    let mass = reduced.proximal.mass + reduced.distal.mass;
    let speed = sound_speed(&link.scaled(&reduced.split.K_S), length, mass).filter(|speed| *speed > 0.0)?;
    let (least, most) = (SLOWEST, *SOUND.end());
    let caveat = || kinds::LINK_SOUND.found(name, speed, if speed < least { least } else { most });
    let words = &[(1e-3, "stiffness in kN/m, or mass in g"), (1e3, "stiffness in mN/m, or mass in t")];
    let likely = || slip(speed, &(300.0..=6000.0), words, 0.5);
    (!(least..=most).contains(&speed)).then(|| caveat().likely(likely()))
}
