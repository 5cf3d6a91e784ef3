//! Assembled finite element model: degrees of freedom, sparse stiffness and mass of a whole mesh.
//!
//! Nodes of solid elements have three DoF, nodes of beams six; nodes without an element have none.
//! DoF are numbered node by node, `ux uy uz (rx ry rz)`, in mesh axes.
//!
//! Start at [`FeModel::assemble`]. Not here: ties, boundaries, reduction ([`crate::reduction`]).

mod mass;
mod scatter;

use flexarm_spatial::Matrix12;
use nalgebra::{DMatrix, Vector3};

use crate::beam::Beam;
use crate::element::{ElementWorkspace, Quadrature, check_solid_material};
use crate::error::FemError;
use crate::material::Material;
use crate::mesh::{ElementBlock, Mesh, Region};
use crate::sparse::SparseSymmetric;

pub use mass::MassMatrix;
use scatter::NodeGraph;

/// Errors of assembling a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AssemblyError {
    /// Elements have a Jacobian that is not positive.
    #[error(
        "{count} element(s) of {total} are inverted or folded, the Jacobian there is not positive: {list}; \
         mend the mesh (for curved tetrahedra: straight sides, Mesh.SecondOrderLinear = 1 in Gmsh, or \
         Mesh.HighOrderOptimize = 2)"
    )]
    InvertedElements {
        /// Number of such elements.
        count: usize,
        /// Number of all elements.
        total: usize,
        /// First such elements, with kind, number in the file, place and value.
        list: String,
    },
    /// A region has no material.
    #[error("region {region:?} has no material: give one for it, or one for all")]
    NoMaterial {
        /// Name of the region.
        region: String,
    },
    /// A region has beams but no section.
    #[error("region {region:?} has beam elements but no section: the mesh file must have one, or give it")]
    NoSection {
        /// Name of the region.
        region: String,
    },
    /// A material or a beam is invalid.
    #[error("region {region:?}: {source}")]
    Property {
        /// Name of the region.
        region: String,
        /// Cause.
        source: Box<FemError>,
    },
    /// The mesh has no elements.
    #[error("the mesh has no element that carries stiffness")]
    Empty,
}

/// Map from nodes to DoF.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DofMap {
    /// First DoF of each node; one more entry than there are nodes.
    first: Vec<u32>,
}

impl DofMap {
    /// Assigns three DoF to the nodes of solids, six to those of beams, none to unused ones.
    pub fn new(mesh: &Mesh) -> Self {
        let mut count = vec![0_u8; mesh.nodes.len()];
        for block in &mesh.blocks {
            let dofs = if block.kind.is_beam() { 6 } else { 3 };
            for node in &block.connectivity {
                let here = &mut count[*node as usize];
                *here = dofs.max(*here);
            }
        }
        let mut first = Vec::with_capacity(count.len() + 1);
        first.push(0);
        first.extend(count.iter().scan(0_u32, |sum, c| {
            *sum += u32::from(*c);
            Some(*sum)
        }));
        Self { first }
    }

    /// Number of DoF.
    pub fn size(&self) -> usize {
        *self.first.last().unwrap_or(&0) as usize
    }

    /// Number of nodes, used or not.
    pub fn nodes(&self) -> usize {
        self.first.len() - 1
    }

    /// DoF of a node: none, three or six.
    pub fn of(&self, node: usize) -> std::ops::Range<usize> {
        self.first[node] as usize..self.first[node + 1] as usize
    }

    /// Node of a DoF, and its component from 0 (`ux`) to 5 (`rz`).
    pub fn node_of(&self, dof: usize) -> (usize, usize) {
        let node = self.first.partition_point(|first| *first as usize <= dof) - 1;
        (node, dof - self.first[node] as usize)
    }
}

/// Options of the assembly.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AssemblyOptions {
    /// Quadrature of solid elements.
    pub quadrature: Quadrature,
    /// Material of regions without their own.
    pub material: Option<Material>,
}

/// Stiffness and mass of a mesh, SI, mesh axes.
#[derive(Debug, Clone)]
pub struct FeModel {
    /// Map from nodes to DoF.
    pub dofs: DofMap,
    /// Positions of all nodes, m.
    pub nodes: Vec<Vector3<f64>>,
    /// Stiffness.
    pub K: SparseSymmetric,
    /// Consistent mass.
    pub M: MassMatrix,
}

/// Returns the checked material of each region: its own, or the common one of the options.
///
/// # Errors
/// [`AssemblyError::NoMaterial`] and [`AssemblyError::Property`].
pub fn materials(mesh: &Mesh, options: &AssemblyOptions) -> Result<Vec<Material>, AssemblyError> {
    let one = |(index, region): (usize, &Region)| {
        let used = mesh.blocks.iter().any(|block| block.region == index && !block.is_empty());
        let material = region.material.or(options.material).or((!used).then_some(Material::STEEL));
        let material = material.ok_or_else(|| AssemblyError::NoMaterial { region: region.name.clone() })?;
        let property = |source| AssemblyError::Property { region: region.name.clone(), source: Box::new(source) };
        material.check().map_err(property)?;
        let solid = |block: &ElementBlock| block.region == index && !block.kind.is_beam() && !block.is_empty();
        if mesh.blocks.iter().any(solid) {
            check_solid_material(&material).map_err(property)?;
        }
        if material.nu > 0.4999 && mesh.blocks.iter().any(|b| b.region == index && !b.kind.is_beam()) {
            return Err(property(FemError::OutOfRange {
                what: "Poisson's ratio nu of solid elements".into(),
                found: material.nu,
                allowed: "up to 0.4999: incompressible solids are not covered".into(),
            }));
        }
        Ok(material)
    };
    mesh.regions.iter().enumerate().map(one).collect()
}

impl FeModel {
    /// Assembles stiffness and mass of a mesh.
    ///
    /// ```text
    /// K = Σ_e K_e,   M = Σ_e M_e (consistent)
    /// ```
    /// * `mesh`: SI; its axes are those of the DoF.
    ///
    /// Returns the unsupported model: K has the six rigid motions as null space.
    ///
    /// # Errors
    /// [`AssemblyError`].
    pub fn assemble(mesh: &Mesh, options: &AssemblyOptions) -> Result<Self, AssemblyError> {
        let materials = materials(mesh, options)?;
        let dofs = DofMap::new(mesh);
        if dofs.size() == 0 {
            return Err(AssemblyError::Empty);
        }
        // The pattern is known before the values, so element matrices are added in place.
        let graph = NodeGraph::new(mesh, &dofs);
        let mut K = SparseSymmetric::zeros(graph.dof_pattern(&dofs));
        let mut M = MassMatrix::zeros(&graph, &dofs);
        let mut beams = Vec::new();
        let mut inverted = Inverted::default();
        let mut workspace = ElementWorkspace::new();
        for block in &mesh.blocks {
            if block.kind.is_beam() {
                add_beams(mesh, block, &materials, &dofs, &graph, &mut K, &mut beams)?;
                continue;
            }
            let mut x = vec![Vector3::zeros(); block.kind.nodes()];
            for (id, nodes) in block.ids.iter().zip(block.elements()) {
                for (x, node) in x.iter_mut().zip(nodes) {
                    *x = mesh.nodes[*node as usize];
                }
                let material = &materials[block.region];
                // K_e goes to the rows of its DoF; M_e, the same along x, y and z, to those of its
                // nodes.
                match workspace.stiffness_and_mass(block.kind, &x, material, options.quadrature) {
                    Ok(()) => {
                        graph.add_blocks(&dofs, nodes, 3, workspace.stiffness(), &mut K.values);
                        M.add_nodal(&graph, nodes, workspace.mass());
                    }
                    Err(error) => inverted.add(block, *id, &error),
                }
            }
        }
        inverted.check(mesh.element_count())?;
        M.add_general(dofs.size(), &beams);
        Ok(Self { dofs, nodes: mesh.nodes.clone(), K, M })
    }

    /// Model with matrices from another source; it has rows, but no node positions.
    ///
    /// * `K`, `M`: stiffness and mass over the same DoF, SI. [`Self::rigid_modes`] has no meaning
    ///   for such a model.
    pub fn from_matrices(K: SparseSymmetric, M: SparseSymmetric) -> Self {
        let dofs = DofMap { first: (0..=K.size() as u32).collect() };
        Self { nodes: vec![Vector3::zeros(); K.size()], dofs, K, M: MassMatrix::from_general(M) }
    }

    /// Model of solids with matrices from another source: three DoF per node, node by node.
    ///
    /// * `nodes`: positions, m; `K`, `M`: SI, axes of the nodes.
    ///
    /// # Panics
    /// If the matrices do not have three rows per node.
    pub fn from_nodal_matrices(nodes: Vec<Vector3<f64>>, K: SparseSymmetric, M: SparseSymmetric) -> Self {
        assert_eq!((K.size(), M.size()), (3 * nodes.len(), 3 * nodes.len()), "three rows per node");
        let dofs = DofMap { first: (0..=nodes.len() as u32).map(|node| 3 * node).collect() };
        Self { nodes, dofs, K, M: MassMatrix::from_general(M) }
    }

    /// Number of DoF.
    pub fn size(&self) -> usize {
        self.dofs.size()
    }

    /// The six rigid motions of the nodes about a point.
    ///
    /// ```text
    /// u_node = v + w × (p_node - point),   θ_node = w      columns: v, then w
    /// ```
    /// * `point`: mesh axes, m.
    ///
    /// Returns one row per DoF (m, rad) and six columns.
    pub fn rigid_modes(&self, point: &Vector3<f64>) -> DMatrix<f64> {
        let mut R = DMatrix::zeros(self.size(), 6);
        for (node, p) in self.nodes.iter().enumerate() {
            let dofs = self.dofs.of(node);
            if dofs.is_empty() {
                continue;
            }
            let turn = -(p - point).cross_matrix();
            for i in 0..3 {
                R[(dofs.start + i, i)] = 1.0;
                for j in 0..3 {
                    R[(dofs.start + i, 3 + j)] = turn[(i, j)];
                }
            }
            for (j, dof) in dofs.skip(3).enumerate() {
                R[(dof, 3 + j)] = 1.0;
            }
        }
        R
    }
}

/// Count of inverted elements, with descriptions of the first ten.
#[derive(Default)]
struct Inverted {
    count: usize,
    list: Vec<String>,
}

impl Inverted {
    fn add(&mut self, block: &ElementBlock, id: u64, error: &crate::element::InvertedElement) {
        self.count += 1;
        if self.list.len() < 10 {
            self.list.push(format!("{} {id} ({error})", block.kind.name()));
        }
    }

    fn check(self, total: usize) -> Result<(), AssemblyError> {
        if self.count == 0 {
            return Ok(());
        }
        let more = if self.count > self.list.len() { ", ..." } else { "" };
        let list = self.list.join(", ") + more;
        Err(AssemblyError::InvertedElements { count: self.count, total, list })
    }
}

/// Beam element between its nodes, and `Q = blkdiag(R_ME, ...)`, 12×12, from its axes E to mesh
/// axes M: `K_M = Q K_E Qᵀ`.
pub(crate) fn beam_of(
    mesh: &Mesh,
    region: usize,
    nodes: &[u32],
    material: &Material,
) -> Result<(Beam, Matrix12), AssemblyError> {
    let region = &mesh.regions[region];
    let name = || region.name.clone();
    let properties = region.beam.as_ref().ok_or_else(|| AssemblyError::NoSection { region: name() })?;
    let property = |source| AssemblyError::Property { region: name(), source: Box::new(source) };
    let bar = properties.section.bar(material).map_err(property)?;
    let along = mesh.nodes[nodes[1] as usize] - mesh.nodes[nodes[0] as usize];
    let beam = Beam::new(bar, properties.theory, along.norm()).map_err(property)?;
    let R = beam_axes(&along, &properties.y_axis).map_err(property)?;
    let mut Q = Matrix12::zeros();
    for corner in [0, 3, 6, 9] {
        Q.fixed_view_mut::<3, 3>(corner, corner).copy_from(&R);
    }
    Ok((beam, Q))
}

/// Stiffness of one beam element, 12×12, both nodes, mesh axes; `None` for an invalid beam.
pub(crate) fn beam_stiffness(mesh: &Mesh, region: usize, nodes: &[u32], material: &Material) -> Option<DMatrix<f64>> {
    let (beam, Q) = beam_of(mesh, region, nodes, material).ok()?;
    let K = Q * beam.stiffness12() * Q.transpose();
    Some(DMatrix::from_column_slice(12, 12, K.as_slice()))
}

/// Adds the beams of a block: stiffness to K, mass as triplets (row, column, value) of its lower
/// triangle.
fn add_beams(
    mesh: &Mesh,
    block: &ElementBlock,
    materials: &[Material],
    dofs: &DofMap,
    graph: &NodeGraph,
    K: &mut SparseSymmetric,
    masses: &mut Vec<(u32, u32, f64)>,
) -> Result<(), AssemblyError> {
    for nodes in block.elements() {
        let (beam, Q) = beam_of(mesh, block.region, nodes, &materials[block.region])?;
        // Beam axes to mesh axes: K = Q K_beam Qᵀ, M likewise.
        let stiffness = Q * beam.stiffness12() * Q.transpose();
        graph.add_blocks(dofs, nodes, 6, stiffness.as_slice(), &mut K.values);
        let mass = Q * beam.mass12() * Q.transpose();
        let place = |k: usize| dofs.of(nodes[k / 6] as usize).start + k % 6;
        for i in 0..12 {
            for j in 0..12 {
                let (row, column) = (place(i), place(j));
                if row >= column {
                    masses.push((row as u32, column as u32, mass[(i, j)]));
                }
            }
        }
    }
    Ok(())
}

/// Rotation `R_ME` of the beam axes E in mesh axes M: x along the beam, y as close to `y_axis` as
/// possible.
///
/// * `along`, `y_axis`: mesh axes, any length.
pub(crate) fn beam_axes(along: &Vector3<f64>, y_axis: &Vector3<f64>) -> Result<nalgebra::Matrix3<f64>, FemError> {
    let x = along.normalize();
    let y = y_axis - x * x.dot(y_axis);
    if !(y.norm() > 1e-6 * y_axis.norm()) {
        return Err(FemError::OutOfRange {
            what: "angle between a beam and the y axis of its section (rad)".into(),
            found: 0.0,
            allowed: "above zero: give a direction across the beam".into(),
        });
    }
    let y = y.normalize();
    Ok(nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]))
}
