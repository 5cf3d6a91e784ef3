//! Checks of a finished reduction against the mesh, and of the size of the link.
//!
//! Start at [`gate`]. Link axes, SI. Not here: limits and messages ([`crate::mesh_gate`]).

use flexarm_spatial::symmetric_part;
use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::chain::Chain;
use crate::mesh::Mesh;
use crate::mesh_gate::{ElementQuality, MeshGate, ModeCheck};
use crate::reduced::ReducedLink;
use crate::reduction::{Condensation, Superelement, worst};
use crate::rigid_part::RigidPart;
use crate::sparse::Modes;
use flexarm_settings::Finding;

/// Computes the checks of a finished reduction.
pub(super) fn gate(
    condensation: &Condensation<'_>,
    element: &Superelement,
    link: &ReducedLink,
    whole: &RigidPart,
    fixed: &Modes,
    held: &Modes,
    quality: ElementQuality,
) -> MeshGate {
    // Scales of the mass errors: the moment of inertia, at least 1e-6 m l².
    let from_matrix = condensed_body(element);
    let size = link.p_AB().norm().max(f64::MIN_POSITIVE);
    let inertia = |part: &RigidPart| part.spatial_inertia().fixed_view::<3, 3>(3, 3).into_owned();
    let scale = inertia(whole).diagonal().amax();

    // Frequencies with A held: mesh, reduced model, condensation, two parts.
    let full = held.frequencies_hz();
    let reduced = element.frequencies_hz(&[0]);
    let guyan = element.guyan().frequencies_hz(&[0]);
    let lumped = Chain { joints: vec![link.split.clone()], parts: vec![link.proximal.clone(), link.distal.clone()] };
    let lumped = lumped.held_frequencies_hz();
    let rows = full.iter().enumerate().map(|(k, hz)| ModeCheck {
        mesh_hz: *hz,
        reduced_hz: reduced.get(k).copied(),
        guyan_hz: guyan.get(k).copied(),
        lumped_hz: lumped.get(k).copied(),
    });
    // A free body has six modes without frequency.
    let free = element.frequencies_hz(&[]);
    let first_elastic = free.get(6).copied().unwrap_or(0.0);
    MeshGate {
        dofs: condensation.figures().dofs,
        asymmetry: condensation.asymmetry(),
        rigid_body_residual: worst([link.checks.rigid_body_residual.unwrap_or(0.0), rigid_residual(element)]),
        block_identity: link.checks.block_identity.unwrap_or(0.0),
        zero_modes: free.iter().take_while(|hz| **hz < 1e-3 * first_elastic).count(),
        mass_error: (from_matrix.mass / whole.mass - 1.0).abs(),
        com_error_m: (from_matrix.com - whole.com).norm(),
        inertia_error: (inertia(&from_matrix) - inertia(whole)).amax() / scale.max(whole.mass * size * size * 1e-6),
        condition: condensation.condition_estimate(),
        mode_residual: worst(condensation.mode_residuals(fixed).into_iter().chain(condensation.mode_residuals(held))),
        fixed_frequencies_hz: fixed.frequencies_hz(),
        modes: rows.collect(),
        quality,
        order: None,
    }
}

/// Maximum relative force under the six rigid motions of all interfaces.
fn rigid_residual(element: &Superelement) -> f64 {
    let n = element.boundary();
    let R = rigid_motions(element);
    let s = element.K.diagonal().map(|k| k.max(0.0).sqrt());
    let mut largest = 0.0_f64;
    for m in 0..6 {
        let size: f64 = (0..n).map(|k| s[k] * R[(k, m)].abs()).sum();
        for i in 0..n {
            let force: f64 = (0..n).map(|k| element.K[(i, k)] * R[(k, m)]).sum();
            largest = worst([largest, force.abs() / (s[i] * size)]);
        }
    }
    largest
}

/// Rigid motions of the interfaces about the midpoint of the first two.
fn rigid_motions(element: &Superelement) -> DMatrix<f64> {
    let p = |k: usize| element.interfaces[k].X_LI.translation.vector;
    rigid_motions_about(element, &((p(0) + p(1)) / 2.0))
}

/// Rigid motions of the interfaces: three translations, three rotations about a point.
///
/// ```text
/// u_I = v + w × (p_LI - point),   θ_I = w
/// ```
/// * `point`: link axes, m.
///
/// Returns six rows per interface (m, rad; at Io, link axes) and six columns `[v; w]`.
pub(crate) fn rigid_motions_about(element: &Superelement, point: &Vector3<f64>) -> DMatrix<f64> {
    let mut R = DMatrix::zeros(element.boundary(), 6);
    for (k, interface) in element.interfaces.iter().enumerate() {
        let turn = -(interface.X_LI.translation.vector - point).cross_matrix();
        R.view_mut((6 * k, 0), (3, 3)).copy_from(&Matrix3::identity());
        R.view_mut((6 * k, 3), (3, 3)).copy_from(&turn);
        R.view_mut((6 * k + 3, 3), (3, 3)).copy_from(&Matrix3::identity());
    }
    R
}

/// Mass properties that the reduced mass matrix implies.
///
/// ```text
/// Rᵀ M R = [  m 1     -m [c]x ]      R: rigid motions of the interfaces about Lo
///          [ m [c]x     I_Lo  ]
/// ```
/// * `element`: link axes, SI. A rigid motion has no modal part, so the modes do not count.
///
/// Returns mass (kg), centre of mass from Lo (m) and inertia about it (kg·m²), link axes; not
/// checked.
pub fn condensed_body(element: &Superelement) -> RigidPart {
    let n = element.boundary();
    let R = rigid_motions_about(element, &Vector3::zeros());
    let M = R.transpose() * element.M.view((0, 0), (n, n)) * &R;
    let mass = (M[(0, 0)] + M[(1, 1)] + M[(2, 2)]) / 3.0;
    // The coupling block is -m[c]x.
    let com = Vector3::new(M[(1, 5)] - M[(2, 4)], M[(2, 3)] - M[(0, 5)], M[(0, 4)] - M[(1, 3)]) / (2.0 * mass);
    let c = com.cross_matrix();
    let inertia = M.fixed_view::<3, 3>(3, 3) + c * c * mass;
    RigidPart { mass, com, inertia: symmetric_part(&inertia) }
}

/// Warnings about a size, mass or frequency that is implausible for a robot link, usually wrong
/// units.
pub(super) fn implausible(mesh: &Mesh, whole: &RigidPart, held: &Modes) -> Vec<Finding> {
    let size = mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).amax());
    let first = held.frequencies_hz().first().copied();
    let mut findings = Vec::new();
    // A value outside its range gives one warning; `slip` names the wrong unit that would explain
    // it.
    let mut see = |what: &str, value: f64, unit: &str, low: f64, high: f64, slip: &str| {
        if !(low..=high).contains(&value) {
            let said = format!(
                "{what} is {value:.3e} {unit}; links of robots lie between {low:.0e} and {high:.0e}: are the units those declared?{slip}"
            );
            findings.push(Finding::warning("size", "", said, "").measured(value, if value < low { low } else { high }));
        }
    };
    let of_length = if (1e-2..=2e1).contains(&(size * 1e-3)) {
        " With mm for m it would be a thousandth."
    } else if (1e-2..=2e1).contains(&(size * 1e3)) {
        " With m for mm it would be a thousand times as large."
    } else {
        ""
    };
    see("the largest dimension", size, "m", 1e-2, 2e1, of_length);
    see("the mass", whole.mass, "kg", 1e-3, 1e4, "");
    let volume_density = whole.mass / size.powi(3).max(f64::MIN_POSITIVE);
    see("the mass over the cube of the largest dimension", volume_density, "kg/m3", 1e-1, 2.5e4, "");
    if let Some(first) = first {
        see("the first frequency with A held", first, "Hz", 1e0, 5e4, "");
    }
    findings
}
