//! Mass of a model: one number per node pair for solids, a general sparse part for beams.
//!
//! Rows are DoF, kg, kg·m, kg·m². Start at [`MassMatrix::product`].
//!
//! Not here: masses of elements ([`crate::element`], [`crate::beam`]), mass properties of a body
//! ([`cut`](crate::cut())).

use flexarm_spatial::Real;
use nalgebra::DMatrix;

use super::DofMap;
use super::scatter::NodeGraph;
use crate::sparse::{Block, Row, SparseSymmetric, WIDTH, Wide, Work, quickly};

/// Consistent mass. For solids it is the same in x, y and z, so a ninth of the entries is stored.
#[derive(Debug, Clone)]
pub struct MassMatrix {
    size: usize,
    /// Entries over nodes, applied to each of the three translations, and first DoF of each node.
    nodal: Option<(SparseSymmetric, Vec<u32>)>,
    /// Entries over DoF.
    general: Option<SparseSymmetric>,
}

impl MassMatrix {
    /// Zero matrix with room for the solids of a mesh.
    pub(super) fn zeros(graph: &NodeGraph, dofs: &DofMap) -> Self {
        let first = (0..dofs.nodes()).map(|node| dofs.of(node).start as u32).collect();
        let nodal = Some((SparseSymmetric::zeros(graph.node_pattern()), first));
        Self { size: dofs.size(), nodal, general: None }
    }

    /// Mass given over all DoF, as exported by FE programs.
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

    /// Computes the product `M X`.
    ///
    /// # Panics
    /// If `X` does not have [`Self::size`] rows.
    pub fn product(&self, X: &DMatrix<f64>) -> DMatrix<f64> {
        let mut Y = DMatrix::zeros(X.nrows(), X.ncols());
        self.product_into(X, &mut Y);
        Y
    }

    /// Computes `Y = M X`.
    ///
    /// # Panics
    /// If `X` does not have [`Self::size`] rows, or `Y` another shape.
    pub(crate) fn product_into(&self, X: &DMatrix<f64>, Y: &mut DMatrix<f64>) {
        assert!(X.nrows() == self.size && Y.shape() == X.shape(), "mass of {} rows times {:?}", self.size, X.shape());
        by_blocks(X, Y, |x, y| self.block_product(x, y));
    }

    /// Computes `Y = M X`.
    ///
    /// # Panics
    /// If the numbers of rows do not match.
    pub(crate) fn block_product(&self, X: &Block, Y: &mut Block) {
        assert!(X.rows.len() == self.size && Y.rows.len() == self.size, "mass of {} rows times another", self.size);
        Y.rows.fill(Row::ZERO);
        Y.width = X.width;
        if let Some(general) = &self.general {
            general.add_block_product(X, Y);
        }
        self.add_nodal_product(X, Y);
    }

    /// Share of solids in `M X`: `Σ_j m_ij x_j` at node i, component by component.
    pub(crate) fn solid_product(&self, X: &DMatrix<f64>) -> DMatrix<f64> {
        let mut Y = DMatrix::zeros(X.nrows(), X.ncols());
        by_blocks(X, &mut Y, |x, y| self.add_nodal_product(x, y));
        Y
    }

    fn add_nodal_product(&self, X: &Block, Y: &mut Block) {
        if let Some((nodal, first)) = &self.nodal {
            quickly(NodalProduct { nodal, first, X: &X.rows, Y: &mut Y.rows });
        }
    }
}

/// Applies `product` to the columns of X, eight at a time, and stores the results in Y.
fn by_blocks(X: &DMatrix<f64>, Y: &mut DMatrix<f64>, product: impl Fn(&Block, &mut Block)) {
    for at in (0..X.ncols()).step_by(WIDTH) {
        let x = Block::of_columns(X, at, WIDTH.min(X.ncols() - at));
        let mut y = Block::zeros(X.nrows(), x.width);
        product(&x, &mut y);
        y.put_columns(Y, at);
    }
}

/// `Y += M X` of the mass over nodes, applied to the three translations of each node at once.
struct NodalProduct<'a> {
    nodal: &'a SparseSymmetric,
    first: &'a [u32],
    X: &'a [Row],
    Y: &'a mut [Row],
}

impl Work for NodalProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<T: Real, const P: usize>(self) {
        // Column j of the lower triangle serves as row j too: sums into j, products of j below it.
        let pattern = self.nodal.pattern();
        for j in 0..self.nodal.size() {
            let entries = pattern.column(j);
            if entries.is_empty() {
                continue;
            }
            let at = self.first[j] as usize;
            let [x, y, z] = [&self.X[at], &self.X[at + 1], &self.X[at + 2]];
            let own = [Wide::<T, P>::load(x), Wide::<T, P>::load(y), Wide::<T, P>::load(z)];
            let mut sum = [Wide::<T, P>::zero(); 3];
            for (row, value) in pattern.rows[entries.clone()].iter().zip(&self.nodal.values[entries]) {
                let to = self.first[*row as usize] as usize;
                let x = &self.X[to..to + 3];
                for k in 0..3 {
                    sum[k].add(*value, Wide::<T, P>::load(&x[k]));
                }
                if *row as usize != j {
                    add_to(&mut self.Y[to..to + 3], *value, &own);
                }
            }
            add_to(&mut self.Y[at..at + 3], 1.0, &sum);
        }
    }
}

#[inline(always)]
fn add_to<T: Real, const P: usize>(Y: &mut [Row], factor: f64, x: &[Wide<T, P>; 3]) {
    for k in 0..3 {
        let mut y = Wide::<T, P>::load(&Y[k]);
        y.add(factor, x[k]);
        y.store(&mut Y[k]);
    }
}
