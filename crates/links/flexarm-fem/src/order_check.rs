//! Measures the excess stiffness of first-order elements by solving the same mesh in second order.
//!
//! A tetrahedron or wedge with corner nodes only has (nearly) constant strain and cannot bend; a
//! link with two layers of them is several times too stiff, and no residual shows it. Here every
//! edge gets a mid-edge node and the unit loads at B are solved again in that larger space:
//!
//! ```text
//! u = Σ N_i u_i + Σ b_e d_e          d_e: offset of the middle of edge e from the mean of its ends
//! C₂ = C₁ + Fᵀ(u₂ - u₁)              compliance of B, A held; F: unit wrenches at B
//! ```
//! Conjugate gradients, preconditioned by the factor of the original mesh and the 3×3 blocks of the
//! edges. In this hierarchical basis the condition number does not grow with the mesh size, so a
//! few dozen products are enough and no new factorisation is needed. Edges on a rigidly tied face
//! stay straight.
//!
//! Start at `check_order`. Not here: the discretisation error of second-order elements.
//!
//! Source: [Zienkiewicz, Gago & Kelly 1983].

use std::collections::HashSet;

use nalgebra::{DMatrix, Matrix3};
use serde::{Deserialize, Serialize};

use crate::element::Quadrature;
use crate::mesh::{Mesh, added_nodes, promoted, skin};
use crate::model::{AssemblyError, AssemblyOptions, FeModel};
use crate::reduction::{Condensation, Interface, Tie};
use crate::sparse::{SparseSymmetric, gram};
use flexarm_settings::Finding;

/// Maximum number of nodes of the larger space; above it the stiffness would take gigabytes.
const MAX_NODES: usize = 600_000;
/// Maximum number of steps; the result is then a lower bound.
const MAX_STEPS: usize = 80;
/// Tolerance: energy of a step relative to the energy of the solution.
const DONE: f64 = 1e-4;

/// Comparison of a mesh in first and second order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrderCheck {
    /// Compliance of B (x y z rx ry rz, A clamped) in second order divided by that of the mesh.
    pub compliance_ratio: [f64; 6],
    /// Number of steps of the solver.
    pub steps: usize,
}

impl OrderCheck {
    /// Ratio above which the mesh is reported as too stiff, and below its inverse as too soft.
    pub const LARGEST_RATIO: f64 = 1.1;

    /// Compliance ratio, second order to mesh, with the largest `|ln ratio|`; 1 if both agree.
    pub fn worst(&self) -> f64 {
        let off = |ratio: &f64| if *ratio > 0.0 { ratio.ln().abs() } else { f64::INFINITY };
        self.compliance_ratio.into_iter().max_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1.0)
    }

    /// Warning if the worst ratio is out of bounds.
    pub fn warning(&self) -> Option<Finding> {
        let worst = self.worst();
        if worst < Self::LARGEST_RATIO && worst > 1.0 / Self::LARGEST_RATIO {
            return None;
        }
        let names = ["x", "y", "z", "rx", "ry", "rz"];
        let list: Vec<String> =
            names.iter().zip(self.compliance_ratio).map(|(name, ratio)| format!("{name} {ratio:.2}")).collect();
        let said = format!(
            "the elements of first order make the link too {}: with elements of second order on the same mesh a load at B moves \
             it {}{worst:.2} times as far, usual is below {} (by component: {}), so its stiffness is off by {:+.0} %; mesh with \
             elements of second order (quadratic; TET10 instead of TET4), or with more layers through the thickness",
            if worst > 1.0 { "stiff" } else { "soft" },
            if self.steps >= MAX_STEPS { "at least " } else { "" },
            Self::LARGEST_RATIO,
            list.join(", "),
            100.0 * (worst - 1.0)
        );
        Some(Finding::warning("first-order", "", said, "").measured(worst, Self::LARGEST_RATIO))
    }
}

/// Solves the unit loads again in second order; `None` if the mesh has no first-order solid or
/// would have too many nodes.
///
/// * `U`: displacements of all DoF under six unit wrenches at B, A clamped.
///
/// # Errors
/// [`AssemblyError`] if the second-order model cannot be assembled.
pub(crate) fn check_order(
    mesh: &Mesh,
    options: &AssemblyOptions,
    interfaces: &[Interface],
    condensation: &Condensation<'_>,
    U: &DMatrix<f64>,
) -> Result<Option<OrderCheck>, AssemblyError> {
    let added = added_nodes(mesh);
    if added == 0 || added + mesh.nodes.len() > MAX_NODES {
        return Ok(None);
    }
    let finer = promoted(mesh);
    let options = AssemblyOptions { quadrature: Quadrature::Exact, ..*options };
    let model = FeModel::assemble(&finer.mesh, &options)?;
    let space = Hierarchy::new(mesh, interfaces, &model, finer.ends);

    // f - K₂ u₁ in the larger space; at the corner nodes f is K₁ u₁ of the original mesh.
    let (rows, n) = (model.size(), U.nrows());
    let forces = condensation.model().K.product(U);
    let mut start = DMatrix::zeros(rows, 6);
    start.rows_mut(0, n).copy_from(U);
    let mut residual = -space.product(&start);
    let mut corners = residual.rows_mut(0, n);
    corners += &forces;

    let C = gram(U, &forces);
    let energy = C.diagonal();
    let (correction, steps) = space.solve(condensation, residual, energy.as_slice());
    let gain = gram(&correction.rows(0, n).into_owned(), &forces);
    let compliance_ratio = std::array::from_fn(|i| 1.0 + gain[(i, i)] / C[(i, i)]);
    let is_finite = compliance_ratio.iter().all(|ratio: &f64| ratio.is_finite());
    Ok(is_finite.then_some(OrderCheck { compliance_ratio, steps }))
}

/// Larger space: DoF of the mesh, then three per new node, relative to the mean of the edge's ends.
struct Hierarchy<'m> {
    K: &'m SparseSymmetric,
    edges: Vec<Edge>,
}

/// New node in the middle of an edge.
struct Edge {
    /// First DoF of the node.
    dof: usize,
    /// First DoF of the end nodes.
    ends: [usize; 2],
    /// Inverse of its diagonal block of the stiffness; zero if it follows a rigid tie.
    inverse: Matrix3<f64>,
}

impl<'m> Hierarchy<'m> {
    /// Finds the new nodes and inverts their diagonal blocks.
    ///
    /// * `model`: of second order; `ends`: nodes of each edge, in the order of the new nodes.
    fn new(mesh: &Mesh, interfaces: &[Interface], model: &'m FeModel, ends: Vec<[u32; 2]>) -> Self {
        let tied = tied_edges(mesh, interfaces);
        let first = |node: u32| model.dofs.of(node as usize).start;
        let edge = |(ends, node): ([u32; 2], usize)| {
            let dof = model.dofs.of(node).start;
            let block = || {
                let entry = |i: usize, j: usize| {
                    let at = model.K.pattern().find(dof + i.max(j), dof + i.min(j));
                    at.map_or(0.0, |at| model.K.values[at])
                };
                Matrix3::from_fn(entry).try_inverse().unwrap_or_else(Matrix3::zeros)
            };
            let inverse = if tied.contains(&ends) { Matrix3::zeros() } else { block() };
            Edge { dof, ends: ends.map(first), inverse }
        };
        Self { K: &model.K, edges: ends.into_iter().zip(mesh.nodes.len()..).map(edge).collect() }
    }

    /// `Sᵀ K S X` with S from relative to absolute displacements.
    fn product(&self, X: &DMatrix<f64>) -> DMatrix<f64> {
        let mut absolute = X.clone();
        for mut x in absolute.column_iter_mut() {
            for Edge { dof, ends: [a, b], .. } in &self.edges {
                for c in 0..3 {
                    x[dof + c] += 0.5 * (x[a + c] + x[b + c]);
                }
            }
        }
        let mut forces = self.K.product(&absolute);
        for mut f in forces.column_iter_mut() {
            for Edge { dof, ends: [a, b], .. } in &self.edges {
                for c in 0..3 {
                    let half = 0.5 * f[dof + c];
                    f[a + c] += half;
                    f[b + c] += half;
                }
            }
        }
        forces
    }

    /// Block preconditioner: solution of the original mesh for the corners, and each edge on its
    /// own.
    fn precondition(&self, condensation: &Condensation<'_>, residual: &DMatrix<f64>) -> DMatrix<f64> {
        let n = condensation.model().size();
        let mut corners = residual.rows(0, n).into_owned();
        condensation.solve_held(&mut corners);
        let mut z = DMatrix::zeros(residual.nrows(), residual.ncols());
        z.rows_mut(0, n).copy_from(&corners);
        for Edge { dof, inverse, .. } in &self.edges {
            let moved = inverse * residual.fixed_rows::<3>(*dof);
            z.fixed_rows_mut::<3>(*dof).copy_from(&moved);
        }
        z
    }

    /// Conjugate gradients on each column separately, until a step adds less than [`DONE`] of
    /// `energy` to every column.
    fn solve(
        &self,
        condensation: &Condensation<'_>,
        mut residual: DMatrix<f64>,
        energy: &[f64],
    ) -> (DMatrix<f64>, usize) {
        let dots = |A: &DMatrix<f64>, B: &DMatrix<f64>| -> Vec<f64> {
            A.column_iter().zip(B.column_iter()).map(|(a, b)| a.dot(&b)).collect()
        };
        let mut x = DMatrix::zeros(residual.nrows(), residual.ncols());
        let mut z = self.precondition(condensation, &residual);
        let mut p = z.clone();
        let mut rho = dots(&residual, &z);
        for step in 0..MAX_STEPS {
            if rho.iter().zip(energy).all(|(rho, energy)| !(rho.abs() > DONE * energy)) {
                return (x, step);
            }
            // Step length α = rᵀz / pᵀAp for each column.
            let q = self.product(&p);
            let curvature = dots(&p, &q);
            for k in 0..x.ncols() {
                let alpha = if curvature[k] > 0.0 { rho[k] / curvature[k] } else { 0.0 };
                x.column_mut(k).axpy(alpha, &p.column(k), 1.0);
                residual.column_mut(k).axpy(-alpha, &q.column(k), 1.0);
            }
            // New direction p = z + β p.
            z = self.precondition(condensation, &residual);
            let next = dots(&residual, &z);
            for k in 0..x.ncols() {
                let beta = if rho[k] > 0.0 { next[k] / rho[k] } else { 0.0 };
                p.column_mut(k).axpy(1.0, &z.column(k), beta);
            }
            rho = next;
        }
        (x, MAX_STEPS)
    }
}

/// Edges of surface faces whose corners are all tied rigidly to one interface.
fn tied_edges(mesh: &Mesh, interfaces: &[Interface]) -> HashSet<[u32; 2]> {
    let mut owner = vec![u32::MAX; mesh.nodes.len()];
    for (k, interface) in (0..).zip(interfaces).filter(|(_, interface)| interface.tie == Tie::Rigid) {
        interface.nodes.iter().for_each(|node| owner[*node as usize] = k);
    }
    let mut edges = HashSet::new();
    for face in skin(mesh).faces() {
        let first = owner[face.corners[0] as usize];
        if first == u32::MAX || face.corners.iter().any(|node| owner[*node as usize] != first) {
            continue;
        }
        let next = face.corners.iter().cycle().skip(1);
        edges.extend(face.corners.iter().zip(next).map(|(a, b)| [*a.min(b), *a.max(b)]));
    }
    edges
}
