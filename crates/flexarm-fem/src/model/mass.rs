//! Mass of a model: one number per pair of nodes for solids, a general sparse part for beams.

use nalgebra::DMatrix;

use super::DofMap;
use super::scatter::NodeGraph;
use crate::sparse::SparseSymmetric;

/// Consistent mass. Solids act alike in x, y and z, so a ninth of the entries is enough for them.
#[derive(Debug, Clone)]
pub struct MassMatrix {
    size: usize,
    /// Over nodes; multiplies each of the three translations.
    nodal: Option<(SparseSymmetric, Vec<u32>)>,
    /// Over DoF.
    general: Option<SparseSymmetric>,
}

impl MassMatrix {
    /// Zeros with room for the solids of a mesh.
    pub(super) fn zeros(graph: &NodeGraph, dofs: &DofMap) -> Self {
        let first = (0..dofs.nodes()).map(|node| dofs.of(node).start as u32).collect();
        let nodal = Some((SparseSymmetric::zeros(graph.node_pattern()), first));
        Self { size: dofs.size(), nodal, general: None }
    }

    /// Mass given over all DoF, as FE programs export it.
    pub fn from_general(general: SparseSymmetric) -> Self {
        Self { size: general.size(), nodal: None, general: Some(general) }
    }

    pub(super) fn add_nodal(&mut self, graph: &NodeGraph, nodes: &[u32], local: &[f64]) {
        let Some((matrix, _)) = &mut self.nodal else { return };
        for (q, b) in nodes.iter().enumerate() {
            for (p, a) in nodes.iter().enumerate().filter(|(_, a)| *a >= b) {
                matrix.values[graph.find(*a, *b)] += local[q * nodes.len() + p];
            }
        }
    }

    pub(super) fn add_general(&mut self, size: usize, triplets: &[(u32, u32, f64)]) {
        if !triplets.is_empty() {
            self.general = Some(SparseSymmetric::from_triplets(size, triplets));
        }
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The product `M X`.
    ///
    /// # Panics
    /// If `X` has another number of rows.
    pub fn product(&self, X: &DMatrix<f64>) -> DMatrix<f64> {
        let mut Y = DMatrix::zeros(X.nrows(), X.ncols());
        self.product_into(X, &mut Y);
        Y
    }

    /// `Y = M X` without allocation.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn product_into(&self, X: &DMatrix<f64>, Y: &mut DMatrix<f64>) {
        assert!(X.nrows() == self.size && Y.shape() == X.shape(), "mass of {} rows times {:?}", self.size, X.shape());
        match &self.general {
            Some(general) => general.product_into(X, Y),
            None => Y.fill(0.0),
        }
        self.add_nodal_product(X, Y);
    }

    /// The part of `M X` that belongs to solids: on node i `Σ_j m_ij x_j`, component by component.
    pub(crate) fn solid_product(&self, X: &DMatrix<f64>) -> DMatrix<f64> {
        let mut Y = DMatrix::zeros(X.nrows(), X.ncols());
        self.add_nodal_product(X, &mut Y);
        Y
    }

    fn add_nodal_product(&self, X: &DMatrix<f64>, Y: &mut DMatrix<f64>) {
        let Some((nodal, first)) = &self.nodal else { return };
        let pattern = nodal.pattern();
        for (x, y) in X.as_slice().chunks_exact(self.size).zip(Y.as_mut_slice().chunks_exact_mut(self.size)) {
            for j in 0..nodal.size() {
                let entries = pattern.column(j);
                if entries.is_empty() {
                    continue;
                }
                let at = first[j] as usize;
                let own = [x[at], x[at + 1], x[at + 2]];
                let mut sum = [0.0; 3];
                for (row, value) in pattern.rows[entries.clone()].iter().zip(&nodal.values[entries]) {
                    let to = first[*row as usize] as usize;
                    let diagonal = *row as usize == j;
                    for k in 0..3 {
                        sum[k] += value * x[to + k];
                        if !diagonal {
                            y[to + k] += value * own[k];
                        }
                    }
                }
                for k in 0..3 {
                    y[at + k] += sum[k];
                }
            }
        }
    }
}
