//! Interfaces of a link and their ties to the mesh.
//!
//! ```text
//! rigid:         u_node = u_I + θ_I × (x_node - x_I)                           rows of B
//! distributing:  θ_I = J⁻¹ Σ r × u,  u_I = mean u + θ_I × (x_I - c),  r = x - c     rows of G
//! ```
//! with c the mean of the nodes and `J = Σ (r² 1 - r rᵀ)`. Start at [`Boundary::tie`]. Mesh axes;
//! the six columns of an interface are `ux uy uz rx ry rz` of its origin.
//!
//! Not here: the selection of the nodes ([`crate::mesh::select`](crate::mesh::select())), the
//! solution ([`super::Condensation`]).

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

use crate::model::FeModel;

/// Relation between the six DoF of an interface and the nodes of its surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tie {
    /// RBE2: every node follows the interface as one rigid body; stiffens the joint seat.
    #[default]
    Rigid,
    /// RBE3: the interface follows the mean motion of the nodes, with equal weights; adds no
    /// stiffness.
    Distributing,
}

impl Tie {
    /// Name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::Distributing => "distributing",
        }
    }
}

/// Interface: a frame and the nodes tied to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Name, such as `A`.
    pub name: String,
    /// Frame in the mesh frame, m. The six DoF are those of its origin, in mesh axes.
    pub X_LI: Pose,
    /// Indices of the tied nodes.
    pub nodes: Vec<u32>,
    /// Kind of tie.
    pub tie: Tie,
}

/// Errors of tying interfaces.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TieError {
    /// There are fewer than two interfaces.
    #[error("{found} interface(s) given; a link needs at least two, a proximal one first")]
    TooFew {
        /// Number of interfaces.
        found: usize,
    },
    /// An interface has no nodes with DoF.
    #[error("interface {interface:?} has no node that belongs to an element")]
    Empty {
        /// Name of the interface.
        interface: String,
    },
    /// The nodes of an interface cannot restrain all three rotations.
    #[error(
        "interface {interface:?}: its {count} node(s) {shape}, so a rotation stays free; \
         an interface on solid elements needs three nodes that are not on a line"
    )]
    Degenerate {
        /// Name of the interface.
        interface: String,
        /// Number of nodes.
        count: usize,
        /// "are one point" or "lie on a line".
        shape: &'static str,
    },
    /// A node belongs to two interfaces.
    #[error("interfaces {first:?} and {second:?} overlap: {count} node(s) are in both, such as index {node}")]
    Overlap {
        /// Name of the first interface.
        first: String,
        /// Name of the second interface.
        second: String,
        /// Number of shared nodes.
        count: usize,
        /// Mesh index of one of them.
        node: u32,
    },
    /// Two interfaces have the same name.
    #[error("two interfaces are called {name:?}")]
    SameName {
        /// Name of the interfaces.
        name: String,
    },
    /// All nodes of the mesh are tied rigidly.
    #[error("all nodes are tied rigidly; nothing is left that could bend")]
    NothingFree,
}

/// Boundary of a model: free DoF, and the relation of the others to the interfaces.
#[derive(Debug, Clone)]
pub struct Boundary {
    /// Rows of B: (DoF, boundary column, factor).
    rigid: Vec<(u32, u32, f64)>,
    /// Rows of G: for each constrained boundary DoF its column and the (DoF, weight) pairs of its
    /// weighted mean.
    means: Vec<(usize, Vec<(u32, f64)>)>,
    /// DoF that do not follow an interface and are not boundary DoF, ascending.
    free: Vec<u32>,
    columns: usize,
    size: usize,
}

impl Boundary {
    /// Ties interfaces to a model: rows of B for rigid ties, of G for distributing ones.
    ///
    /// * `interfaces`: proximal first, two or more; poses in mesh axes, m.
    ///
    /// # Errors
    /// [`TieError`].
    pub fn tie(model: &FeModel, interfaces: &[Interface]) -> Result<Self, TieError> {
        // Nodes without an element have no DoF and are dropped; duplicates are removed.
        let used = |interface: &Interface| {
            let has_dofs = |node: &u32| !model.dofs.of(*node as usize).is_empty();
            let mut nodes: Vec<u32> = interface.nodes.iter().copied().filter(has_dofs).collect();
            nodes.sort_unstable();
            nodes.dedup();
            Interface { nodes, ..interface.clone() }
        };
        let interfaces: &[Interface] = &interfaces.iter().map(used).collect::<Vec<_>>();
        check(model, interfaces)?;
        let (mut rigid, mut means) = (Vec::new(), Vec::new());
        let mut is_free = vec![true; model.size()];
        for (index, interface) in interfaces.iter().enumerate() {
            let origin = interface.X_LI.translation.vector;
            match interface.tie {
                Tie::Rigid => {
                    for node in &interface.nodes {
                        let dofs = model.dofs.of(*node as usize);
                        // u_node = u_I + θ_I × (x_node - x_I); rotations are those of the
                        // interface.
                        let turn = -(model.nodes[*node as usize] - origin).cross_matrix();
                        is_free[dofs.clone()].fill(false);
                        for (i, dof) in dofs.enumerate() {
                            let dof = dof as u32;
                            let column = |k: usize| (6 * index + k) as u32;
                            rigid.push((dof, column(i), 1.0));
                            if i < 3 {
                                rigid.extend((0..3).filter(|j| *j != i).map(|j| (dof, column(3 + j), turn[(i, j)])));
                            }
                        }
                    }
                }
                Tie::Distributing => means.extend(mean_rows(model, interface, 6 * index)),
            }
        }
        let free: Vec<u32> = (0..model.size() as u32).filter(|dof| is_free[*dof as usize]).collect();
        if free.is_empty() {
            return Err(TieError::NothingFree);
        }
        Ok(Self { rigid, means, free, columns: 6 * interfaces.len(), size: model.size() })
    }

    /// Boundary of some DoF of the model itself: the reference nodes of an imported model.
    ///
    /// * `size`: number of DoF of the model.
    /// * `dofs`: retained DoF, in the order of the boundary columns.
    pub fn retained(size: usize, dofs: &[u32]) -> Self {
        let rigid: Vec<_> = dofs.iter().enumerate().map(|(column, dof)| (*dof, column as u32, 1.0)).collect();
        let free = (0..size as u32).filter(|dof| !dofs.contains(dof)).collect();
        Self { rigid, means: Vec::new(), free, columns: dofs.len(), size }
    }

    /// Number of boundary coordinates, six per interface.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// DoF of the solution, ascending.
    pub fn free(&self) -> &[u32] {
        &self.free
    }

    /// Rows of G.
    pub(super) fn means(&self) -> &[(usize, Vec<(u32, f64)>)] {
        &self.means
    }

    /// Whether fixing the boundary DoF supports the model by itself.
    pub(super) fn supports(&self) -> bool {
        !self.rigid.is_empty()
    }

    /// B: displacements of the DoF that follow an interface rigidly, per unit of each boundary DoF;
    /// mesh axes, one row per DoF of the model.
    pub(super) fn rigid_part(&self) -> DMatrix<f64> {
        let mut B = DMatrix::zeros(self.size, self.columns);
        for (dof, column, factor) in &self.rigid {
            B[(*dof as usize, *column as usize)] = *factor;
        }
        B
    }
}

/// Checks number, names and nodes of the interfaces.
fn check(model: &FeModel, interfaces: &[Interface]) -> Result<(), TieError> {
    if interfaces.len() < 2 {
        return Err(TieError::TooFew { found: interfaces.len() });
    }
    let mut owner = vec![u32::MAX; model.nodes.len()];
    for (index, interface) in interfaces.iter().enumerate() {
        if interfaces[..index].iter().any(|other| other.name == interface.name) {
            return Err(TieError::SameName { name: interface.name.clone() });
        }
        if interface.nodes.is_empty() {
            return Err(TieError::Empty { interface: interface.name.clone() });
        }
        // A node belongs to one interface.
        for node in &interface.nodes {
            let before = owner[*node as usize];
            if before != u32::MAX {
                let shared = interface.nodes.iter().filter(|n| owner[**n as usize] == before);
                let first = interfaces[before as usize].name.clone();
                let second = interface.name.clone();
                return Err(TieError::Overlap { first, second, count: shared.count(), node: *node });
            }
        }
        for node in &interface.nodes {
            owner[*node as usize] = index as u32;
        }
        // Nodes without rotations must not lie on a line, or the interface could turn about it.
        let turns = interface.nodes.iter().any(|node| model.dofs.of(*node as usize).len() == 6);
        if !(turns && interface.tie == Tie::Rigid) {
            spread(model, interface)?;
        }
    }
    Ok(())
}

/// Mean position c (m) and second moments `J = Σ (r² 1 - r rᵀ)` (m²) of the nodes, mesh axes; an
/// error if a rotation is unrestrained.
fn spread(model: &FeModel, interface: &Interface) -> Result<(Vector3<f64>, Matrix3<f64>), TieError> {
    let points: Vec<_> = interface.nodes.iter().map(|node| model.nodes[*node as usize]).collect();
    let count = points.len();
    let centre = points.iter().sum::<Vector3<f64>>() / count as f64;
    let moments = points.iter().fold(Matrix3::zeros(), |sum, p| {
        let r = p - centre;
        sum + Matrix3::identity() * r.norm_squared() - r * r.transpose()
    });
    let degenerate = |shape| TieError::Degenerate { interface: interface.name.clone(), count, shape };
    let mut principal: Vec<f64> = SymmetricEigen::new(moments).eigenvalues.iter().copied().collect();
    principal.sort_by(f64::total_cmp);
    if !(principal[2] > 1e-24 * centre.norm_squared().max(1e-12)) {
        return Err(degenerate("are one point"));
    }
    if !(principal[0] > 1e-9 * principal[2]) {
        return Err(degenerate("lie on a line"));
    }
    Ok((centre, moments))
}

/// Rows of G of one distributing interface with equal weights; see the module.
///
/// * `column`: boundary column of its first component.
fn mean_rows(model: &FeModel, interface: &Interface, column: usize) -> Vec<(usize, Vec<(u32, f64)>)> {
    let Ok((centre, moments)) = spread(model, interface) else { return Vec::new() };
    let Some(inverse) = moments.try_inverse() else { return Vec::new() };
    let weight = 1.0 / interface.nodes.len() as f64;
    // u_I = mean u + θ_I × a = mean u - [a]x θ_I with a = x_I - c.
    let carry = -(interface.X_LI.translation.vector - centre).cross_matrix();
    let mut rows = vec![Vec::new(); 6];
    for node in &interface.nodes {
        let dofs = model.dofs.of(*node as usize);
        // Share of this node in θ_I, and in u_I.
        let turn = inverse * (model.nodes[*node as usize] - centre).cross_matrix();
        let shift = Matrix3::identity() * weight + carry * turn;
        for j in 0..3 {
            let dof = (dofs.start + j) as u32;
            for i in 0..3 {
                rows[i].push((dof, shift[(i, j)]));
                rows[3 + i].push((dof, turn[(i, j)]));
            }
        }
    }
    rows.into_iter().enumerate().map(|(i, row)| (column + i, row)).collect()
}
