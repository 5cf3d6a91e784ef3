//! Contents of a mesh for the choice of interfaces: sets, regions, sizes.
//!
//! Start at [`MeshListing`]. Lengths are in the unit of the mesh, so that they can be typed again;
//! M is the frame of the mesh. Not here: the selection of nodes (`interfaces.rs`).

use std::collections::BTreeMap;
use std::path::Path;

use flexarm_fe_io::mesh::MeshFile;
use flexarm_fem::Mesh;
use flexarm_fem::mesh::connected_parts;
use nalgebra::Vector3;
use serde::Serialize;

use super::interfaces::MeshFrame;
use super::summary::MaterialFigures;

/// Result of `flexarm reduce --list`. Lengths are in the unit of the mesh file; sets are in the
/// link frame, which is the frame of the mesh unless the job sets another.
#[derive(Clone, Debug, Serialize)]
pub struct MeshListing {
    /// Mesh file.
    pub mesh: String,
    /// Format of the file.
    pub format: &'static str,
    /// Declared units; null if none are declared.
    pub units: Option<String>,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// Number of elements of each kind.
    pub element_kinds: BTreeMap<&'static str, usize>,
    /// Minimum coordinates of the nodes of elements, frame of the mesh.
    pub min: [f64; 3],
    /// Maximum coordinates.
    pub max: [f64; 3],
    /// Maximum dimension (m); null without units.
    pub size_m: Option<f64>,
    /// Number of connected parts; a link must have one.
    pub parts: usize,
    /// Element regions.
    pub regions: Vec<RegionListing>,
    /// Node sets.
    pub sets: Vec<SetListing>,
    /// Interfaces of the job.
    pub interfaces: Vec<SetListing>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// A region of the mesh.
#[derive(Clone, Debug, Serialize)]
pub struct RegionListing {
    /// Name.
    pub name: String,
    /// Number of elements.
    pub elements: usize,
    /// Material of the region in the file, SI; null if it has none or the units are not declared.
    pub material: Option<MaterialFigures>,
    /// Whether the file has a material for the region.
    pub has_material: bool,
}

/// A node set of the mesh.
#[derive(Clone, Debug, Serialize)]
pub struct SetListing {
    /// Name.
    pub name: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Mean of the node positions.
    pub centroid: [f64; 3],
    /// Extent along the axes.
    pub extent: [f64; 3],
    /// Centroid as text to type.
    pub at: String,
}

impl MeshListing {
    pub(super) fn new(path: &Path, file: &MeshFile, units: Option<String>, place: &MeshFrame<'_>) -> Self {
        // Elements by kind, regions with the materials of the file.
        let mesh: &Mesh = &file.mesh;
        let mut element_kinds = BTreeMap::new();
        for block in &mesh.blocks {
            *element_kinds.entry(block.kind.name()).or_insert(0) += block.len();
        }
        let (low, high) = mesh.bounding_box().unwrap_or_default();
        let region = |(index, region): (usize, &flexarm_fem::mesh::Region)| RegionListing {
            name: region.name.clone(),
            elements: mesh.blocks.iter().filter(|b| b.region == index).map(flexarm_fem::ElementBlock::len).sum(),
            material: region.material.as_ref().filter(|_| units.is_some()).map(MaterialFigures::new),
            has_material: region.material.is_some(),
        };
        // A link is one connected body.
        let parts = connected_parts(mesh).len();
        let mut warnings = file.warnings.clone();
        if parts > 1 {
            warnings
                .push(format!("the mesh has {parts} parts that share no node; a link must be a single connected part"));
        }
        let typed = |v: Vector3<f64>| -> [f64; 3] { (v / place.unit).into() };
        Self {
            mesh: path.display().to_string(),
            format: file.format,
            nodes: mesh.nodes.len(),
            elements: mesh.element_count(),
            element_kinds,
            min: typed(low),
            max: typed(high),
            size_m: units.is_some().then(|| (high - low).amax()),
            parts,
            regions: mesh.regions.iter().enumerate().map(region).collect(),
            sets: mesh.node_sets.iter().map(|(name, nodes)| SetListing::new(name, nodes, place)).collect(),
            interfaces: Vec::new(),
            units,
            warnings,
        }
    }
}

impl SetListing {
    pub(super) fn new(name: &str, nodes: &[u32], place: &MeshFrame<'_>) -> Self {
        let (centroid, extent) = place.middle_and_extent(nodes);
        Self {
            name: name.to_owned(),
            nodes: nodes.len(),
            centroid: (centroid / place.unit).into(),
            extent: (extent / place.unit).into(),
            at: place.typed(&centroid),
        }
    }
}
