//! Checks of every reduction of a mesh, with numbers; written into the link file and the report.
//!
//! Start at [`MeshGate`]; [`MeshGate::findings`] turns numbers above their limits into warnings.
//!
//! Not here: the computation of the checks (`mesh_link::checks`), limits of a 6×6 or 12×12
//! stiffness ([`crate::gate`]).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::element::{edges, jacobian_range};
use crate::mesh::{ElementKind, Mesh};
use crate::order_check::OrderCheck;
use flexarm_settings::Finding;

/// One mode with A clamped and B free, frequencies of the mesh and of the reduced models, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModeCheck {
    /// Frequency of the whole mesh.
    pub mesh_hz: f64,
    /// Frequency of the superelement with its modes (Craig-Bampton; Guyan if it has none).
    pub reduced_hz: Option<f64>,
    /// Frequency of the superelement without modes.
    pub guyan_hz: Option<f64>,
    /// Frequency of the two rigid parts with their elastic joint.
    pub lumped_hz: Option<f64>,
}

impl ModeCheck {
    /// Relative frequency error `f_reduced/f_mesh - 1` of the reduced model; `None` without such a
    /// mode.
    pub fn reduced_error(&self) -> Option<f64> {
        self.reduced_hz.map(|hz| hz / self.mesh_hz - 1.0)
    }
}

/// Shape quality of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ElementQuality {
    /// Number of elements.
    pub elements: usize,
    /// Minimum Jacobian at an integration point, relative to the mean of its element.
    pub smallest_at_points: f64,
    /// Minimum Jacobian at a node, relative to the mean of its element.
    pub smallest_at_nodes: f64,
    /// Number in the file of the element with the minimum Jacobian at a node.
    pub worst_element: u64,
    /// Minimum volume of an element, relative to the ideal shape of its kind with the same edge
    /// lengths; 1 is ideal.
    #[serde(default = "one")]
    pub smallest_fullness: f64,
    /// Number in the file of the element with the minimum fullness.
    #[serde(default)]
    pub flattest_element: u64,
    /// Number of elements below a fullness of 0.01.
    #[serde(default)]
    pub flat_elements: usize,
    /// Maximum distance of a mid-side node from the middle of its edge, relative to the edge
    /// length.
    #[serde(default)]
    pub largest_offset: f64,
    /// Number in the file of the element with the maximum offset.
    #[serde(default)]
    pub bent_element: u64,
}

fn one() -> f64 {
    1.0
}

impl ElementQuality {
    /// Measures every solid element of a mesh; beams only count.
    ///
    /// Returns extremes with the numbers of their elements; 1 for a mesh without solids.
    pub fn of(mesh: &Mesh) -> Self {
        let mut quality =
            Self { smallest_at_points: 1.0, smallest_at_nodes: 1.0, smallest_fullness: 1.0, ..Self::default() };
        let mut x = Vec::new();
        for block in mesh.blocks.iter() {
            quality.elements += block.len();
            if block.kind.is_beam() {
                continue;
            }
            for (id, nodes) in block.ids.iter().zip(block.elements()) {
                x.clear();
                x.extend(nodes.iter().map(|node| mesh.nodes[*node as usize]));
                let range = jacobian_range(block.kind, &x);
                quality.smallest_at_points = quality.smallest_at_points.min(range.min_gauss);
                // Larger integers cannot be represented in TOML.
                let id = (*id).min(i64::MAX as u64);
                if range.min_node < quality.smallest_at_nodes {
                    (quality.smallest_at_nodes, quality.worst_element) = (range.min_node, id);
                }
                let fullness = fullness(block.kind, &x, range.mean);
                quality.flat_elements += usize::from(fullness < MeshGate::SMALLEST_FULLNESS);
                if fullness < quality.smallest_fullness {
                    (quality.smallest_fullness, quality.flattest_element) = (fullness, id);
                }
                let offset = largest_offset(block.kind, &x);
                if offset > quality.largest_offset {
                    (quality.largest_offset, quality.bent_element) = (offset, id);
                }
            }
        }
        quality
    }
}

/// Volume relative to the ideal shape whose edges have the same mean square length along each
/// direction of the element.
///
/// The ideal tetrahedron is the regular one (a sliver has long edges and no volume). The ideal
/// brick or wedge, which may well be flat, is the right-angled one with the element's own three
/// edge lengths.
///
/// * `det`: mean of the determinant of the Jacobian, m³.
fn fullness(kind: ElementKind, x: &[Vector3<f64>], det: f64) -> f64 {
    let length2 = |a: usize, b: usize| (x[a] - x[b]).norm_squared();
    let mean = |pairs: &[[usize; 2]]| pairs.iter().map(|[a, b]| length2(*a, *b)).sum::<f64>() / pairs.len() as f64;
    // det J of the ideal shape: its volume V over that of the reference element, which is 6 V for
    // the regular tetrahedron, V for the wedge and V/8 for the brick.
    let best = match kind {
        ElementKind::Tet4 | ElementKind::Tet10 => mean(&edges(kind)[..6]).powf(1.5) / 2f64.sqrt(),
        ElementKind::Wedge6 | ElementKind::Wedge15 => {
            mean(&edges(kind)[..6]) * (0.75f64).sqrt() * mean(&edges(kind)[6..9]).sqrt() / 2.0
        }
        ElementKind::Hex8 | ElementKind::Hex20 => {
            let e = edges(kind);
            let along = [[e[0], e[2], e[4], e[6]], [e[1], e[3], e[5], e[7]], [e[8], e[9], e[10], e[11]]];
            along.iter().map(|pairs| mean(pairs).sqrt()).product::<f64>() / 8.0
        }
        ElementKind::Beam2 => return 1.0,
    };
    if best > 0.0 { det / best } else { 0.0 }
}

/// Maximum distance of a mid-side node from the middle of its edge, relative to the edge length.
fn largest_offset(kind: ElementKind, x: &[Vector3<f64>]) -> f64 {
    let corners = match kind {
        ElementKind::Tet10 => 4,
        ElementKind::Wedge15 => 6,
        ElementKind::Hex20 => 8,
        _ => return 0.0,
    };
    let one = |([a, b], middle): (&[usize; 2], &Vector3<f64>)| {
        (middle - (x[*a] + x[*b]) * 0.5).norm() / (x[*a] - x[*b]).norm()
    };
    edges(kind).iter().zip(&x[corners..]).map(one).fold(0.0, f64::max)
}

/// Results of the checks of a reduction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshGate {
    /// Number of DoF of the mesh.
    pub dofs: usize,
    /// `max |k_ij - k_ji| / sqrt(k_ii k_jj)` of the condensed stiffness before symmetrisation.
    pub asymmetry: f64,
    /// Maximum relative force under rigid motion of all interfaces.
    pub rigid_body_residual: f64,
    /// Difference of `K_AA`, `K_AB` from the values implied by `K_BB`.
    pub block_identity: f64,
    /// Number of modes of the free reduced link with zero frequency; should be six.
    pub zero_modes: usize,
    /// Relative difference between the mass of the reduced matrix and of the mesh.
    pub mass_error: f64,
    /// Difference between the centres of mass, m.
    pub com_error_m: f64,
    /// Relative difference between the inertias about the link origin.
    pub inertia_error: f64,
    /// Estimated condition number of `K_ii`.
    pub condition: f64,
    /// Maximum residual `‖K φ - ω² M φ‖ / ‖ω² M φ‖` of the fixed-interface modes and of the modes
    /// with A clamped.
    pub mode_residual: f64,
    /// Frequencies of the fixed-interface modes, Hz.
    pub fixed_frequencies_hz: Vec<f64>,
    /// Modes with A clamped.
    pub modes: Vec<ModeCheck>,
    /// Shape quality of the elements.
    pub quality: ElementQuality,
    /// Excess stiffness due to first-order elements; none if there are no such elements, or too
    /// many to check.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<OrderCheck>,
}

impl MeshGate {
    /// Relative force under rigid motion above which [`Self::findings`] warns.
    pub const RIGID_BODY_RESIDUAL: f64 = 1e-7;
    /// Relative difference of mass and inertia above which [`Self::findings`] warns.
    pub const MASS_ERROR: f64 = 1e-6;
    /// Residual of a mode above which [`Self::findings`] warns. The relative error of the squared
    /// frequency is below the residual; in thin plates rounding alone gives 1e-6.
    pub const MODE_RESIDUAL: f64 = 1e-5;
    /// Jacobian at a node, relative to the mean of its element, below which [`Self::findings`]
    /// warns.
    pub const SMALLEST_JACOBIAN: f64 = 0.05;
    /// Volume of an element, relative to the ideal shape, below which the element counts as flat.
    pub(crate) const SMALLEST_FULLNESS: f64 = 0.01;
    /// Fraction of flat elements above which [`Self::findings`] warns.
    pub(crate) const FEW_FLAT: f64 = 1e-3;
    /// Offset of a mid-side node, relative to its edge length, above which [`Self::findings`]
    /// warns: an arc of 140 degrees.
    pub(crate) const LARGEST_OFFSET: f64 = 0.35;

    /// Returns one warning per measure beyond its limit: results that pass but are suspicious.
    pub fn findings(&self) -> Vec<Finding> {
        let mut findings = Vec::new();
        let mut see = |code: &'static str, value: f64, usual: f64, bad: bool, sentence: String| {
            if bad {
                findings.push(Finding::warning(code, "", sentence, "").measured(value, usual));
            }
        };
        let (residual, usual) = (self.rigid_body_residual, Self::RIGID_BODY_RESIDUAL);
        let said = format!("rigid motion of the interfaces meets a relative force of {residual:.1e}; usual is 1e-11");
        see("rigid-motion", residual, usual, !(residual < usual), said);
        let said = format!("{} zero modes instead of six", self.zero_modes);
        see("zero-modes", self.zero_modes as f64, 6.0, self.zero_modes != 6, said);
        let (mass, inertia, usual) = (self.mass_error, self.inertia_error, Self::MASS_ERROR);
        let said =
            format!("the reduced mass differs from the mesh: mass by {mass:.1e}, inertia by {inertia:.1e} (relative)");
        see("mass", mass.max(inertia), usual, !(mass < usual && inertia < usual), said);
        let (residual, usual) = (self.mode_residual, Self::MODE_RESIDUAL);
        see("mode-residual", residual, usual, !(residual < usual), format!("a mode has a residual of {residual:.1e}"));
        findings.extend(self.quality.findings());
        findings.extend(self.order.as_ref().and_then(OrderCheck::warning));
        findings
    }
}

impl ElementQuality {
    /// Warnings about folded, flat or bent elements.
    fn findings(&self) -> Vec<Finding> {
        let mut findings = Vec::new();
        let (value, usual) = (self.smallest_at_nodes, MeshGate::SMALLEST_JACOBIAN);
        if value < usual {
            let said = format!(
                "element {} is nearly folded: its Jacobian at a node is {value:.3} of its mean, usual is above {usual}",
                self.worst_element
            );
            findings.push(Finding::warning("folded-element", "", said, "").measured(value, usual));
        }
        let (value, usual) = (self.smallest_fullness, MeshGate::SMALLEST_FULLNESS);
        // One sliver among thousands of elements stiffens only its neighbourhood.
        if self.flat_elements as f64 > MeshGate::FEW_FLAT * self.elements as f64 {
            let said = format!(
                "{} element(s) are nearly without volume, the flattest is {}: its volume is {value:.1e} of that of the best \
                 shape with such edges, usual is above {usual}; such slivers are far too stiff: mesh anew, or optimise the mesh",
                self.flat_elements, self.flattest_element
            );
            findings.push(Finding::warning("sliver", "", said, "").measured(value, usual));
        }
        let (value, usual) = (self.largest_offset, MeshGate::LARGEST_OFFSET);
        if value > usual {
            let said = format!(
                "a mid-side node of element {} is off the middle of its edge by {value:.2} of the edge's length, usually below {usual}: is it in the wrong place, or the mesh too coarse for the curve?",
                self.bent_element
            );
            findings.push(Finding::warning("mid-side-node", "", said, "").measured(value, usual));
        }
        findings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::promoted;
    use crate::test_mesh::{Noise, SOLIDS, cube, positions};

    fn quality(mesh: &Mesh) -> ElementQuality {
        ElementQuality::of(mesh)
    }

    /// Truth: right-angled bricks and wedges over an equilateral triangle have fullness 1, Kuhn's
    /// tetrahedra 0.61.
    #[test]
    fn the_best_shape_of_a_kind_is_full_also_where_it_is_flat() {
        for (kind, fullness) in [(ElementKind::Hex8, 1.0), (ElementKind::Hex20, 1.0), (ElementKind::Wedge6, 0.866)] {
            let flat = cube(kind, [2, 2, 2], false, |u| Vector3::new(u.x, u.y, 1e-3 * u.z));
            let found = quality(&flat).smallest_fullness;
            assert!((found / fullness - 1.0).abs() < 1e-3, "{kind:?}: {found}");
        }
        let regular = [
            Vector3::new(0.0, 0.0, 0.0),
            Vector3::new(1.0, 0.0, 0.0),
            Vector3::new(0.5, 0.75f64.sqrt(), 0.0),
            Vector3::new(0.5, 0.75f64.sqrt() / 3.0, (2.0f64 / 3.0).sqrt()),
        ];
        let det = jacobian_range(ElementKind::Tet4, &regular).mean;
        assert!((fullness(ElementKind::Tet4, &regular, det) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_sliver_is_named_and_distorted_elements_are_not() {
        let mut noise = Noise(3);
        for kind in SOLIDS {
            let mesh = cube(kind, [3, 3, 3], false, |u| u + noise.vector() * 0.04);
            let found = quality(&mesh);
            assert!(found.flat_elements == 0 && found.smallest_fullness > 0.2, "{kind:?}: {found:?}");
        }
        // The last corner of one tetrahedron is moved close to the plane of the others.
        let mut mesh = cube(ElementKind::Tet4, [1, 1, 1], false, |u| u);
        let element = mesh.blocks[0].elements().next().unwrap().to_vec();
        let x = positions(&mesh, &element);
        mesh.blocks[0] =
            crate::mesh::ElementBlock { ids: vec![7], connectivity: element.clone(), ..mesh.blocks[0].clone() };
        let normal = (x[1] - x[0]).cross(&(x[2] - x[0])).normalize();
        mesh.nodes[element[3] as usize] -= normal * ((x[3] - x[0]).dot(&normal) * (1.0 - 1e-3));
        let found = quality(&mesh);
        assert_eq!((found.flat_elements, found.flattest_element), (1, 7), "{found:?}");
    }

    #[test]
    fn a_mid_side_node_far_off_is_named() {
        let mut mesh = promoted(&cube(ElementKind::Tet4, [1, 1, 1], false, |u| u)).mesh;
        assert!(quality(&mesh).largest_offset < 1e-15);
        let middle = mesh.blocks[0].connectivity[10 + 6] as usize;
        mesh.nodes[middle] += Vector3::new(0.0, 0.0, 0.5);
        let found = quality(&mesh);
        assert!(found.largest_offset > MeshGate::LARGEST_OFFSET && found.bent_element > 0, "{found:?}");
    }
}
