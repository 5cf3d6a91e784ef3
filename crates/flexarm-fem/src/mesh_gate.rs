//! What is checked on every reduction of a mesh, with numbers; written into the link file and the report.

use serde::{Deserialize, Serialize};

use crate::element::jacobian_range;
use crate::mesh::Mesh;

/// One mode with A held and B free, as the mesh and the reduced models have it, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModeCheck {
    /// Of the whole mesh.
    pub mesh_hz: f64,
    /// Of the superelement with its modes (Craig-Bampton; Guyan without any).
    pub reduced_hz: Option<f64>,
    /// Of the superelement without modes.
    pub guyan_hz: Option<f64>,
    /// Of the two rigid parts with their elastic joint.
    pub lumped_hz: Option<f64>,
}

impl ModeCheck {
    /// Relative error of the reduced model.
    pub fn reduced_error(&self) -> Option<f64> {
        self.reduced_hz.map(|hz| hz / self.mesh_hz - 1.0)
    }
}

/// Shape of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ElementQuality {
    /// Elements.
    pub elements: usize,
    /// Smallest Jacobian at an integration point over the mean of its element.
    pub smallest_at_points: f64,
    /// Smallest Jacobian at a node over the mean of its element.
    pub smallest_at_nodes: f64,
    /// Number in the file of the element with the smallest one at a node.
    pub worst_element: u64,
}

impl ElementQuality {
    /// Looks at every solid element of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let mut quality = Self { smallest_at_points: 1.0, smallest_at_nodes: 1.0, ..Self::default() };
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
                if range.min_node < quality.smallest_at_nodes {
                    quality.smallest_at_nodes = range.min_node;
                    // TOML has no larger integers.
                    quality.worst_element = (*id).min(i64::MAX as u64);
                }
            }
        }
        quality
    }
}

/// The checks of a reduction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshGate {
    /// DoF of the mesh.
    pub dofs: usize,
    /// `max |k_ij - k_ji| / sqrt(k_ii k_jj)` of the condensed stiffness, before it is made symmetric.
    pub asymmetry: f64,
    /// Largest relative force under rigid motion of all interfaces.
    pub rigid_body_residual: f64,
    /// Disagreement of `K_AA`, `K_AB` with `K_BB`.
    pub block_identity: f64,
    /// Modes of the free reduced link without frequency; six are right.
    pub zero_modes: usize,
    /// Relative difference of the mass in the reduced matrix from that of the mesh.
    pub mass_error: f64,
    /// The same of the centre of mass, m.
    pub com_error_m: f64,
    /// The same of the inertia about the link origin, relative.
    pub inertia_error: f64,
    /// Condition number of `K_ii`, estimated.
    pub condition: f64,
    /// Largest residual `‖K φ - ω² M φ‖ / ‖ω² M φ‖` of the fixed-interface modes and of those with A held.
    pub mode_residual: f64,
    /// Frequencies of the fixed-interface modes, Hz.
    pub fixed_frequencies_hz: Vec<f64>,
    /// Modes with A held.
    pub modes: Vec<ModeCheck>,
    /// Shape of the elements.
    pub quality: ElementQuality,
}

impl MeshGate {
    /// Relative force under rigid motion above which [`Self::warnings`] speaks.
    pub const RIGID_BODY_RESIDUAL: f64 = 1e-7;
    /// The same for the relative difference of mass and inertia.
    pub const MASS_ERROR: f64 = 1e-6;
    /// The same for the residual of a mode.
    pub const MODE_RESIDUAL: f64 = 1e-6;
    /// Jacobian at a node, over the mean of its element, below which it speaks.
    pub const SMALLEST_JACOBIAN: f64 = 0.05;

    /// Sentences about what passes, but is worth a look.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut see = |bad: bool, sentence: String| {
            if bad {
                warnings.push(sentence);
            }
        };
        see(
            !(self.rigid_body_residual < Self::RIGID_BODY_RESIDUAL),
            format!(
                "rigid motion of the interfaces meets a relative force of {:.1e}; usual is 1e-11",
                self.rigid_body_residual
            ),
        );
        see(self.zero_modes != 6, format!("{} zero modes instead of six", self.zero_modes));
        see(
            !(self.mass_error < Self::MASS_ERROR && self.inertia_error < Self::MASS_ERROR),
            format!(
                "the reduced mass differs from the mesh: mass by {:.1e}, inertia by {:.1e} (relative)",
                self.mass_error, self.inertia_error
            ),
        );
        see(
            !(self.mode_residual < Self::MODE_RESIDUAL),
            format!("a mode has a residual of {:.1e}", self.mode_residual),
        );
        see(
            self.quality.smallest_at_nodes < Self::SMALLEST_JACOBIAN,
            format!(
                "element {} is nearly folded: its Jacobian at a node is {:.3} of its mean",
                self.quality.worst_element, self.quality.smallest_at_nodes
            ),
        );
        warnings
    }
}
