//! Finite element mesh in SI units: nodes, blocks of elements, regions with materials, named sets.
//!
//! Plain data. Readers (`flexarm-fe-io`) fill it and convert node order and units; here positions
//! are in m, in the mesh frame, and the nodes of an element are in the order of CalculiX and Abaqus
//! ([`ElementKind`]).
//!
//! Start at [`Mesh`], [`select`](select()) for the nodes of an interface, [`skin`] for a picture,
//! [`connected_parts`] to check that the mesh is in one piece.
//!
//! Not here: shape functions and matrices of elements ([`crate::element`]), ties, reduction.

mod coincident;
mod faces;
mod fit;
mod hinges;
mod orientation;
mod parts;
mod promote;
mod select;
mod selector;
mod surface;
mod surface_nodes;

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::beam::BeamTheory;
use crate::material::Material;
use crate::section::Section;

pub use coincident::{Coincident, coincident};
pub use faces::{corner_count, face_nodes};
pub use fit::{Misfit, misfits};
pub use hinges::{Bodies, Hinge, bodies};
pub use orientation::turn_reversed;
pub use parts::{Part, connected_parts};
pub use promote::second_order;
pub(crate) use promote::{added_nodes, promoted};
pub use select::{SelectError, select};
pub use selector::{NodeSelector, SelectorSyntaxError};
pub use surface::{Skin, SkinFace, skin};
pub use surface_nodes::{Surface, SurfaceNodes};

/// Kind of an element; node order of CalculiX and Abaqus, given for each variant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ElementKind {
    /// Four-node tetrahedron, C3D4.
    Tet4,
    /// Ten-node tetrahedron, C3D10: corners 1 to 4, then edges 12, 23, 31, 14, 24, 34.
    Tet10,
    /// Eight-node brick, C3D8: bottom face 1 to 4 counter-clockwise seen from the top face 5 to 8.
    Hex8,
    /// Twenty-node brick, C3D20: corners, edges 12 23 34 41, edges 56 67 78 85, edges 15 26 37 48.
    Hex20,
    /// Six-node wedge, C3D6: bottom triangle 1 to 3, top 4 to 6.
    Wedge6,
    /// Fifteen-node wedge, C3D15: corners, edges 12 23 31, edges 45 56 64, edges 14 25 36.
    Wedge15,
    /// Two-node beam with six DoF per node, B31 or B33: straight, with the section of its region.
    Beam2,
}

impl ElementKind {
    /// Number of nodes of one element.
    pub const fn nodes(self) -> usize {
        match self {
            Self::Beam2 => 2,
            Self::Tet4 => 4,
            Self::Wedge6 => 6,
            Self::Hex8 => 8,
            Self::Tet10 => 10,
            Self::Wedge15 => 15,
            Self::Hex20 => 20,
        }
    }

    /// Name in messages and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tet4 => "TET4",
            Self::Tet10 => "TET10",
            Self::Hex8 => "HEX8",
            Self::Hex20 => "HEX20",
            Self::Wedge6 => "WEDGE6",
            Self::Wedge15 => "WEDGE15",
            Self::Beam2 => "BEAM2",
        }
    }

    /// Whether the nodes have rotational DoF.
    pub const fn is_beam(self) -> bool {
        matches!(self, Self::Beam2)
    }
}

/// Section of the beam elements of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamProperties {
    /// Cross section, m.
    pub section: Section,
    /// Direction of the section's y axis, mesh axes; need not be unit or orthogonal to the beam.
    pub y_axis: Vector3<f64>,
    /// Beam theory, with or without shear deformation.
    pub theory: BeamTheory,
}

/// Named part of the mesh with one material: a physical volume, or an element set with a section.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Name in the file.
    pub name: String,
    /// Material, if the file has one; SI.
    pub material: Option<Material>,
    /// Section of the beam elements, if the file gives one.
    pub beam: Option<BeamProperties>,
}

/// Elements of one kind in one region.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementBlock {
    /// Kind of the elements.
    pub kind: ElementKind,
    /// Index into [`Mesh::regions`].
    pub region: usize,
    /// Numbers of the elements in the file, for messages.
    pub ids: Vec<u64>,
    /// Node indices, `kind.nodes()` per element.
    pub connectivity: Vec<u32>,
}

impl ElementBlock {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether the block has no elements.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Iterates over the node indices of each element.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.connectivity.chunks_exact(self.kind.nodes())
    }
}

/// Mesh in SI units, checked by its reader: every index is in range, every set is sorted and
/// without duplicates.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions of the nodes, m.
    pub nodes: Vec<Vector3<f64>>,
    /// Numbers of the nodes in the file, for messages.
    pub node_ids: Vec<u64>,
    /// Elements that carry stiffness and mass.
    pub blocks: Vec<ElementBlock>,
    /// Regions of the elements.
    pub regions: Vec<Region>,
    /// Node indices by name: node sets, physical points and curves, and nodes of physical surfaces.
    pub node_sets: BTreeMap<String, Vec<u32>>,
}

impl Mesh {
    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.blocks.iter().map(ElementBlock::len).sum()
    }

    /// Transforms the mesh from frame M into frame L: `p_L = X_LM p_M`; the y axes of beam sections
    /// rotate with the nodes.
    ///
    /// * `X_LM`: pose of the mesh frame in L, m.
    pub fn transformed(mut self, X_LM: &flexarm_spatial::Pose) -> Self {
        for p in &mut self.nodes {
            *p = X_LM.rotation * *p + X_LM.translation.vector;
        }
        for beam in self.regions.iter_mut().filter_map(|region| region.beam.as_mut()) {
            beam.y_axis = X_LM.rotation * beam.y_axis;
        }
        self
    }

    /// Flags the nodes that belong to an element.
    pub fn used_nodes(&self) -> Vec<bool> {
        let mut used = vec![false; self.nodes.len()];
        for node in self.blocks.iter().flat_map(|block| &block.connectivity) {
            used[*node as usize] = true;
        }
        used
    }

    /// Bounding box of the nodes that elements use, `(min, max)`, m, mesh axes; `None` without
    /// elements.
    pub fn bounding_box(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let used = self.used_nodes();
        let mut points = self.nodes.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p);
        let first = points.next()?;
        Some(points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p))))
    }
}
