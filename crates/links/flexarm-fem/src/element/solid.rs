//! Stiffness and mass of one solid element.
//!
//! ```text
//! K_ij = ∫ λ a_i a_jᵀ + μ (a_j a_iᵀ + a_i·a_j 1) dV,   a_i = ∇N_i         m_ij = ∫ ρ N_i N_j dV
//! ```
//! Start at [`ElementWorkspace::stiffness_and_mass`]. Matrices are square, both triangles filled;
//! rows `ux uy uz` node by node, mesh axes, N/m and kg.
//!
//! Not here: rules and points (`rules`), the Jacobian (`geometry`), assembly ([`crate::model`]).

use nalgebra::{SMatrix, Vector3};

use super::elasticity::lame;
use super::geometry::{Geometry, InvertedElement, Jacobian, Nodes, check_nodes};
use super::rules::{Quadrature, Table, tables};
use super::shape::{MAX_NODES, no_beam};
use crate::material::Material;
use crate::mesh::ElementKind;

/// Maximum number of DoF of an element.
const MAX_DOF: usize = 3 * MAX_NODES;

/// Maximum number of node pairs `i <= j`.
const MAX_PAIRS: usize = MAX_NODES * (MAX_NODES + 1) / 2;

/// Buffers for the matrices of one element; nothing is allocated after [`Self::new`].
#[derive(Debug, Clone)]
pub(crate) struct ElementWorkspace {
    n: usize,
    /// `∫ dN_i/dx_a dN_j/dx_b`, component by component: row `a n + i`, column `b n + j`.
    products: Vec<f64>,
    stiffness: Vec<f64>,
    mass: Vec<f64>,
}

impl ElementWorkspace {
    /// Allocates room for the largest element.
    pub(crate) fn new() -> Self {
        let zeros = || vec![0.0; MAX_DOF * MAX_DOF];
        Self { n: 0, products: zeros(), stiffness: zeros(), mass: vec![0.0; MAX_NODES * MAX_NODES] }
    }

    /// Computes stiffness and mass of one element; read them with [`Self::stiffness`] and
    /// [`Self::mass`].
    ///
    /// ```text
    /// K_ij = ∫ λ a bᵀ + μ (b aᵀ + (a·b) 1) dV,   a = ∇N_i, b = ∇N_j      M_ij = ∫ ρ N_i N_j dV
    /// ```
    /// HEX8 with [`Quadrature::Exact`] or [`Quadrature::CalculixModes`] has nine incompatible
    /// modes, `1 - r²`, `1 - s²` and `1 - t²` in each direction, which are condensed statically:
    /// the element bends without locking. Their gradients use the Jacobian at the centre,
    /// `(det J_0 / det J) J_0⁻ᵀ`, so that they do no work under constant stress and the patch test
    /// holds for any shape. They carry no mass.
    ///
    /// * `x`: positions of the nodes, m.
    /// * `material`: `E`, `nu` and `rho` are used; `G` is not. Call
    ///   [`check_solid_material`](super::check_solid_material) first.
    ///
    /// # Errors
    /// [`InvertedElement`] at a Gauss point; with [`Quadrature::Exact`] also at a node.
    ///
    /// # Panics
    /// For a beam, and for a wrong number of nodes.
    ///
    /// # Source
    /// Modes: Taylor, Beresford & Wilson (1976), *Int. J. Numer. Meth. Eng.* 10.
    pub(crate) fn stiffness_and_mass(
        &mut self,
        kind: ElementKind,
        x: &[Vector3<f64>],
        material: &Material,
        rule: Quadrature,
    ) -> Result<(), InvertedElement> {
        let nodes = Nodes::new(kind, x);
        self.n = nodes.n;
        match (kind, rule) {
            (ElementKind::Tet4, _) => self.compute::<4, 12>(kind, &nodes, material, rule),
            (ElementKind::Tet10, _) => self.compute::<10, 30>(kind, &nodes, material, rule),
            (ElementKind::Hex8, Quadrature::Calculix) => self.compute::<8, 24>(kind, &nodes, material, rule),
            (ElementKind::Hex8, Quadrature::Exact | Quadrature::CalculixModes) => {
                self.compute::<8, 33>(kind, &nodes, material, rule)?;
                condense(&mut self.stiffness, 33, 24);
                Ok(())
            }
            (ElementKind::Hex20, _) => self.compute::<20, 60>(kind, &nodes, material, rule),
            (ElementKind::Wedge6, _) => self.compute::<6, 18>(kind, &nodes, material, rule),
            (ElementKind::Wedge15, _) => self.compute::<15, 45>(kind, &nodes, material, rule),
            (ElementKind::Beam2, _) => no_beam(),
        }
    }

    /// Returns the amplitudes of the incompatible modes of a HEX8 per nodal displacement: three
    /// components of the mode `1 - r²`, then of `1 - s²` and `1 - t²`. Stiffness and mass are not
    /// valid afterwards.
    ///
    /// # Errors
    /// [`InvertedElement`] at a Gauss point.
    pub(crate) fn mode_amplitudes(
        &mut self,
        x: &[Vector3<f64>],
        material: &Material,
        rule: Quadrature,
    ) -> Result<SMatrix<f64, 9, 24>, InvertedElement> {
        let nodes = Nodes::new(ElementKind::Hex8, x);
        self.n = nodes.n;
        self.compute::<8, 33>(ElementKind::Hex8, &nodes, material, rule)?;
        let entry = |i: usize, j: usize| self.stiffness[i * 33 + j];
        let own = SMatrix::<f64, 9, 9>::from_fn(|i, j| entry(24 + i, 24 + j));
        let across = SMatrix::<f64, 9, 24>::from_fn(|i, j| -entry(24 + i, j));
        Ok(own.cholesky().map_or_else(SMatrix::zeros, |factor| factor.solve(&across)))
    }

    /// Stiffness, 3n × 3n by rows, N/m; DoF `ux uy uz` of the first node, then of the second, ...
    ///
    /// Exactly symmetric, bit for bit.
    pub(crate) fn stiffness(&self) -> &[f64] {
        &self.stiffness[..9 * self.n * self.n]
    }

    /// Consistent mass, n × n by rows, kg; the 3n × 3n mass is each entry times the 3 × 3 identity.
    pub(crate) fn mass(&self) -> &[f64] {
        &self.mass[..self.n * self.n]
    }

    /// Computes both matrices for N nodes; D = 3 × (nodes and incompatible modes).
    fn compute<const N: usize, const D: usize>(
        &mut self,
        kind: ElementKind,
        nodes: &Nodes,
        material: &Material,
        rule: Quadrature,
    ) -> Result<(), InvertedElement> {
        let all = tables(kind);
        // Stiffness from the products of the shape functions' gradients and Hooke's law.
        let affine = rule == Quadrature::Exact && nodes.geometry == Geometry::Affine;
        let products = self.products.as_chunks_mut::<D>().0;
        let largest_det =
            gradient_products::<N, D>(kind, all.stiffness_for(rule, nodes.geometry), nodes, affine, products)?;
        hooke::<D>(products, lame(material), &mut self.stiffness);

        // Mass ρ ∫ N_i N_j dV: with constant J that of the reference element times ρ det J.
        let mut pairs = [0.0; MAX_PAIRS];
        let pairs = &mut pairs[..N * (N + 1) / 2];
        if affine {
            for (m, reference) in pairs.iter_mut().zip(&all.reference_mass) {
                *m = material.rho * largest_det * reference;
            }
        } else {
            if rule == Quadrature::Exact {
                check_nodes(kind, nodes, largest_det)?;
            }
            shape_products::<N>(kind, all.mass_for(rule, nodes.geometry), nodes, material.rho, pairs)?;
        }
        unpack(N, pairs, &mut self.mass);
        Ok(())
    }
}

/// Upper triangle of `∫ g gᵀ` for `g[a m + i] = dN_i/dx_a`; returns the maximum `det J`.
fn gradient_products<const N: usize, const D: usize>(
    kind: ElementKind,
    table: &Table,
    nodes: &Nodes,
    affine: bool,
    products: &mut [[f64; D]],
) -> Result<f64, InvertedElement> {
    let m = D / 3;
    products[..D].fill([0.0; D]);
    let centre = if m > N { Some(centre_of_brick(kind, N, nodes)?) } else { None };

    // Four points at a time, so that each entry of the result is read and written once per four
    // points.
    let (mut g, mut weight, mut filled) = ([[0.0; D]; 4], [0.0; 4], 0);
    let mut jacobian = Jacobian::checked(kind, N, table, 0, &nodes.x)?;
    let mut largest_det = jacobian.det;
    for p in 0..table.len() {
        if !affine && p > 0 {
            jacobian = Jacobian::checked(kind, N, table, p, &nodes.x)?;
            largest_det = largest_det.max(jacobian.det);
        }
        jacobian.gradients(N, table.dN(p), m, &mut g[filled]);
        if let Some(centre) = &centre {
            mode_gradients(centre, jacobian.det, table.xi[p], m, &mut g[filled]);
        }
        weight[filled] = table.weight[p] * jacobian.det;
        filled += 1;
        if filled == 4 {
            add_outer_products(&g, weight, products);
            filled = 0;
        }
    }
    if filled > 0 {
        weight[filled..].fill(0.0);
        add_outer_products(&g, weight, products);
    }
    Ok(largest_det)
}

/// Jacobian at the centre of a brick, where the gradients of its n = 8 shape functions are `ξ_i/8`.
fn centre_of_brick(kind: ElementKind, n: usize, nodes: &Nodes) -> Result<Jacobian, InvertedElement> {
    let mut dN = [0.0; 3 * 8];
    for (i, node) in super::shape::reference_nodes(kind).iter().enumerate() {
        for c in 0..3 {
            dN[c * n + i] = node[c] / 8.0;
        }
    }
    let centre = Jacobian::new(n, &dN, &nodes.x);
    if centre.det > 0.0 {
        return Ok(centre);
    }
    // The determinant at the centre is close to the mean of eight positive ones, so only NaN or a
    // badly folded element gets here.
    Err(InvertedElement { kind, det: centre.det, place: super::geometry::InversionPoint::GaussPoint(0) })
}

/// Gradients of the modes `1 - xi_c²`, mapped by the Jacobian at the centre.
fn mode_gradients(centre: &Jacobian, det: f64, xi: [f64; 3], m: usize, g: &mut [f64]) {
    let scale = -2.0 * centre.det / det;
    for a in 0..3 {
        for c in 0..3 {
            g[a * m + m - 3 + c] = scale * xi[c] * centre.inverse[c][a];
        }
    }
}

/// Returns the gradients of the three incompatible modes of a HEX8 at `xi`.
pub(crate) fn mode_gradients_at(x: &[Vector3<f64>], xi: [f64; 3]) -> [Vector3<f64>; 3] {
    let nodes = Nodes::new(ElementKind::Hex8, x);
    let table = Table::new(ElementKind::Hex8, &[(xi, 0.0)]);
    let det = Jacobian::new(8, table.dN(0), &nodes.x).det;
    let mut g = [0.0; 9];
    if let Ok(centre) = centre_of_brick(ElementKind::Hex8, 8, &nodes) {
        mode_gradients(&centre, det, xi, 3, &mut g);
    }
    std::array::from_fn(|c| Vector3::new(g[c], g[3 + c], g[6 + c]))
}

/// Adds `Σ_p w_p g_p g_pᵀ` to the upper triangle (and to a few entries of the lower one).
fn add_outer_products<const D: usize>(g: &[[f64; D]; 4], weight: [f64; 4], products: &mut [[f64; D]]) {
    for (row, products) in products[..D].iter_mut().enumerate() {
        let w = [0, 1, 2, 3].map(|p| weight[p] * g[p][row]);
        for column in row & !3..D {
            products[column] +=
                (w[0] * g[0][column] + w[1] * g[1][column]) + (w[2] * g[2][column] + w[3] * g[3][column]);
        }
    }
}

/// Computes `K_ij = λ H_ij + μ (H_ijᵀ + tr(H_ij) 1)` from `H_ij = ∫ a bᵀ` per node pair, both
/// triangles.
fn hooke<const D: usize>(H: &[[f64; D]], (lambda, mu): (f64, f64), K: &mut [f64]) {
    let m = D / 3;
    for i in 0..m {
        for j in i..m {
            let mut block = [[0.0; 3]; 3];
            let diagonal = [0, 1, 2].map(|a| H[a * m + i][a * m + j]);
            let trace = mu * (diagonal[0] + diagonal[1] + diagonal[2]);
            for a in 0..3 {
                block[a][a] = (lambda + mu) * diagonal[a] + trace;
            }
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                let (H_ab, H_ba) = (H[a * m + i][b * m + j], H[a * m + j][b * m + i]);
                block[a][b] = lambda * H_ab + mu * H_ba;
                block[b][a] = lambda * H_ba + mu * H_ab;
            }
            for a in 0..3 {
                for b in 0..3 {
                    K[(3 * i + a) * D + 3 * j + b] = block[a][b];
                    K[(3 * j + b) * D + 3 * i + a] = block[a][b];
                }
            }
        }
    }
}

/// Condenses the last DoF of a symmetric positive matrix statically and closes up the rows.
fn condense(K: &mut [f64], dof: usize, kept: usize) {
    for pivot in (kept..dof).rev() {
        for i in 0..pivot {
            let factor = K[i * dof + pivot] / K[pivot * dof + pivot];
            for j in i..pivot {
                K[i * dof + j] -= factor * K[pivot * dof + j];
                K[j * dof + i] = K[i * dof + j];
            }
        }
    }
    for row in 1..kept {
        K.copy_within(row * dof..row * dof + kept, row * kept);
    }
}

/// Adds `Σ ρ w det N Nᵀ` to the upper triangle by rows.
fn shape_products<const N: usize>(
    kind: ElementKind,
    table: &Table,
    nodes: &Nodes,
    rho: f64,
    pairs: &mut [f64],
) -> Result<(), InvertedElement> {
    for p in 0..table.len() {
        let weight = table.weight[p] * Jacobian::checked(kind, N, table, p, &nodes.x)?.det;
        for (m, NN) in pairs.iter_mut().zip(table.NN(p)) {
            *m += rho * weight * NN;
        }
    }
    Ok(())
}

/// Expands the upper triangle to both.
fn unpack(n: usize, pairs: &[f64], matrix: &mut [f64]) {
    let mut pairs = pairs.iter();
    for i in 0..n {
        for (j, m) in (i..n).zip(pairs.by_ref()) {
            matrix[i * n + j] = *m;
            matrix[j * n + i] = *m;
        }
    }
}
