//! Stress of a link under unit loads and in unit modes, at the nodes of its surface.
//!
//! Start at [`StressFields`], which states the superposition. Link axes, Pa.
//!
//! Not here: stress of one set of displacements ([`super::StressRecovery`]), superposition over a
//! motion ([`super::StressMap`]), the file (`file`).

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, Vector3};

use super::recovery::{NodalPlace, StressRecovery};
use crate::material::Material;
use crate::mesh::skin;
use crate::modal::ModalSource;

/// Number of inertia loads: three of linear acceleration, three of angular acceleration, six of
/// products of angular velocities in the order xx yy zz xy xz yz.
pub const INERTIA_LOADS: usize = 12;

/// Node of the surface with its material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StressSite {
    /// Number of the node in the mesh file.
    pub node: u64,
    /// Position, link axes, m.
    pub position: Vector3<f64>,
    /// Index into [`StressFields::materials`].
    pub material: usize,
    /// Distance to the nearest node that is tied to an interface, m.
    pub from_tie: f64,
}

/// Section forces of a beam per unit load, at planes across it.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionForces {
    /// Positions of the planes along the beam, m from its end E.
    pub x: Vec<f64>,
    /// Six components `N V_y V_z T M_y M_z` of the first plane, beam axes about the axis of the
    /// beam (N, N m), then of the second, ...; columns as of [`StressFields::stress`]. Tension and
    /// moments are those of the far side on the near side.
    pub forces: DMatrix<f32>,
}

/// Stress of a link at the nodes of its surface, per unit load and per unit amplitude of a mode.
///
/// ```text
/// σ = Σ S_w w + Σ S_a a + Σ S_m δη
/// ```
/// with the wrenches w on the interfaces after the first, the inertia loads a of the motion of the
/// link frame, all with interface A clamped and the link in static equilibrium, and the amplitudes
/// δη of fixed-interface modes beyond their static response to w and a.
#[derive(Debug, Clone, PartialEq)]
pub struct StressFields {
    /// Name of the link.
    pub link: String,
    /// Names of the interfaces, the clamped one first.
    pub interfaces: Vec<String>,
    /// Poses of the interfaces in the link frame.
    pub poses: Vec<Pose>,
    /// Displacement of each interface after the first under unit wrenches on them, link axes; shows
    /// to which link the fields belong.
    pub compliance: DMatrix<f64>,
    /// Natural frequencies of the fixed-interface modes, Hz.
    pub frequencies_hz: Vec<f64>,
    /// Materials of the sites.
    pub materials: Vec<Material>,
    /// Nodes of the surface; a node with several materials occurs once for each.
    pub sites: Vec<StressSite>,
    /// Triangles of the surface, as indices into the sites.
    pub triangles: Vec<[u32; 3]>,
    /// Stress, Pa per unit (N, N m, m/s², rad/s², rad²/s², modal amplitude): six components
    /// `xx yy zz xy yz zx` of the first site, then of the second, ...; one column per wrench
    /// component, inertia load and mode.
    pub stress: DMatrix<f32>,
    /// Section forces; `None` for a mesh.
    pub section_forces: Option<SectionForces>,
}

impl ModalSource<'_> {
    /// Returns the stress at the nodes of the surface under unit loads and in unit modes.
    ///
    /// * `link`: name of the link.
    ///
    /// Returns Pa per unit, link axes. Cost: twelve sparse solves and one pass over the elements.
    pub fn stress_fields(&self, link: impl Into<String>) -> StressFields {
        let model = self.condensation.model();
        let (materials, quadrature) = (self.materials, self.quadrature);
        let recovery = StressRecovery { mesh: self.mesh, model, materials, quadrature };
        let (surface, U) = (skin(self.mesh), self.displacements());
        let places = recovery.places(&surface.nodes());
        let stress = recovery.at_nodes(&U, &places);
        let columns = U.ncols();
        let stress = |row: usize, j: usize| stress[row / 6 * columns + j][row % 6] as f32;
        // A triangle has the sites of the first material at its nodes.
        let mut site_of = vec![u32::MAX; self.mesh.nodes.len()];
        for (k, place) in places.iter().enumerate().rev() {
            site_of[place.node as usize] = k as u32;
        }
        let triangles = surface.triangles().into_iter().map(|corners| corners.map(|node| site_of[node as usize]));
        StressFields {
            link: link.into(),
            interfaces: self.interfaces.iter().map(|interface| interface.name.clone()).collect(),
            poses: self.interfaces.iter().map(|interface| interface.X_LI).collect(),
            compliance: self.condensation.tip().clone(),
            frequencies_hz: self
                .fixed_modes
                .omega2
                .iter()
                .map(|omega2| omega2.sqrt() / std::f64::consts::TAU)
                .collect(),
            materials: recovery.distinct_materials(),
            sites: self.sites(&places),
            triangles: triangles.collect(),
            stress: DMatrix::from_fn(6 * places.len(), columns, stress),
            section_forces: None,
        }
    }

    /// Nodes of the surface with their distance to the nearest tied node.
    fn sites(&self, places: &[NodalPlace]) -> Vec<StressSite> {
        let tied = self.interfaces.iter().flat_map(|interface| &interface.nodes);
        let tied: Vec<_> = tied.map(|node| self.mesh.nodes[*node as usize]).collect();
        let site = |place: &NodalPlace| {
            let position = self.mesh.nodes[place.node as usize];
            let squared = tied.iter().map(|tied| (position - tied).norm_squared()).fold(f64::INFINITY, f64::min);
            let node = self.mesh.node_ids[place.node as usize];
            StressSite { node, position, material: place.material as usize, from_tie: squared.sqrt() }
        };
        places.iter().map(site).collect()
    }
}
