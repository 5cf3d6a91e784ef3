//! How much too stiff elements of first order make a link: the same mesh, solved in second order.
//!
//! A tetrahedron or wedge with corner nodes alone has (nearly) constant strain and cannot bend; a
//! link of two layers of them is several times too stiff, and no residual shows it. Here every edge
//! gets a node in its middle and the unit loads at B are solved again in that larger space:
//!
//! ```text
//! u = Σ N_i u_i + Σ b_e d_e          d_e: how far the middle of edge e leaves the mean of its ends
//! C₂ = C₁ + Fᵀ(u₂ - u₁)              compliance of B, A held; F: unit wrenches at B
//! ```
//! Conjugate gradients with the factor of the mesh itself and the 3×3 blocks of the edges as
//! preconditioner: a hierarchical basis, whose condition does not grow with the mesh, so a few
//! dozen products suffice and nothing is factorised. Edges on a rigidly tied face stay straight.
//!
//! Start at [`check_order`]. Not here: elements of second order, whose own error stays unknown.
//!
//! Source: [Zienkiewicz, Gago & Kelly 1983].

use std::collections::HashSet;

use nalgebra::{DMatrix, Matrix3};
use serde::{Deserialize, Serialize};

use crate::doubt::Doubt;
use crate::element::Quadrature;
use crate::mesh::{Mesh, added_nodes, promoted, skin};
use crate::model::{AssemblyError, AssemblyOptions, FeModel};
use crate::reduction::{Condensation, Interface, Tie};
use crate::sparse::{SparseSymmetric, gram};

/// Nodes of the larger space above which it is not solved: its stiffness would take gigabytes.
const MOST_NODES: usize = 600_000;
/// Steps after which the answer is a lower bound.
const MOST_STEPS: usize = 80;
/// Energy of a step over the energy of the solution at which it is done.
const DONE: f64 = 1e-4;

/// The same mesh in first and second order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrderCheck {
    /// Compliance of B (x y z rx ry rz, A held) in second order over that of the mesh.
    pub compliance_ratio: [f64; 6],
    /// Steps of the solver.
    pub steps: usize,
}

impl OrderCheck {
    /// Ratio beyond which the mesh is called too stiff; its inverse, too soft.
    pub const LARGEST_RATIO: f64 = 1.1;

    /// The ratio that is farthest from one.
    pub fn worst(&self) -> f64 {
        let off = |ratio: &f64| if *ratio > 0.0 { ratio.ln().abs() } else { f64::INFINITY };
        self.compliance_ratio.into_iter().max_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1.0)
    }

    /// What is said where it is far from one.
    pub fn doubt(&self) -> Option<Doubt> {
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
            if self.steps >= MOST_STEPS { "at least " } else { "" },
            Self::LARGEST_RATIO,
            list.join(", "),
            100.0 * (worst - 1.0)
        );
        Some(Doubt::found("first-order", worst, Self::LARGEST_RATIO, said))
    }
}

/// Solves the unit loads again in second order; `None` where no solid is of first order, or there
/// are too many.
///
/// * `U`: displacements of all DoF under six unit wrenches at B, A held.
///
/// # Errors
/// [`AssemblyError`], where the elements of second order cannot be made.
pub fn check_order(
    mesh: &Mesh,
    options: &AssemblyOptions,
    interfaces: &[Interface],
    condensation: &Condensation<'_>,
    U: &DMatrix<f64>,
) -> Result<Option<OrderCheck>, AssemblyError> {
    let added = added_nodes(mesh);
    if added == 0 || added + mesh.nodes.len() > MOST_NODES {
        return Ok(None);
    }
    let finer = promoted(mesh);
    let options = AssemblyOptions { quadrature: Quadrature::Exact, ..*options };
    let model = FeModel::assemble(&finer.mesh, &options)?;
    let space = Hierarchy::new(mesh, interfaces, &model, finer.ends);

    // f - K₂ u₁ in the larger space; on the corners f is what the mesh itself balances.
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

/// The larger space: DoF of the mesh, then three per new node, relative to the mean of the edge's
/// ends.
struct Hierarchy<'m> {
    K: &'m SparseSymmetric,
    edges: Vec<Edge>,
}

/// A new node.
struct Edge {
    /// Its first DoF.
    dof: usize,
    /// Those of the ends.
    ends: [usize; 2],
    /// Inverse of its block of the stiffness; zero where it follows a rigid tie.
    inverse: Matrix3<f64>,
}

impl<'m> Hierarchy<'m> {
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

    /// `Sᵀ K S X`, S from relative to absolute displacements.
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

    /// The mesh's own solution on the corners, each edge by itself beside it.
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

    /// Conjugate gradients on each column by itself, until a step brings less than [`DONE`] of
    /// `energy` to all.
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
        for step in 0..MOST_STEPS {
            if rho.iter().zip(energy).all(|(rho, energy)| !(rho.abs() > DONE * energy)) {
                return (x, step);
            }
            let q = self.product(&p);
            let curvature = dots(&p, &q);
            for k in 0..x.ncols() {
                let alpha = if curvature[k] > 0.0 { rho[k] / curvature[k] } else { 0.0 };
                x.column_mut(k).axpy(alpha, &p.column(k), 1.0);
                residual.column_mut(k).axpy(-alpha, &q.column(k), 1.0);
            }
            z = self.precondition(condensation, &residual);
            let next = dots(&residual, &z);
            for k in 0..x.ncols() {
                let beta = if rho[k] > 0.0 { next[k] / rho[k] } else { 0.0 };
                p.column_mut(k).axpy(1.0, &z.column(k), beta);
            }
            rho = next;
        }
        (x, MOST_STEPS)
    }
}

/// Edges of faces of the surface all of whose corners are tied rigidly to one interface.
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
