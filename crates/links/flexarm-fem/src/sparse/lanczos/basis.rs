//! Lanczos basis, built block by block, and the projected operator.
//!
//! Letters as in the module above: blocks `V_j`, M-orthonormal; `A_j`, `R_j` blocks of H; W the newest
//! product. [`Basis::advance`] is one step of the recurrence.

use flexarm_spatial::symmetric_part;
use nalgebra::{DMatrix, SymmetricEigen};

use super::{Modes, ModesError, Pencil, Ritz};
use crate::sparse::block::{Block, WIDTH, combine, grams, subtract_products};
use crate::sparse::dense::symmetric_eigen;

/// Remainder of a direction after orthogonalisation, relative to the largest θ, that is rounding.
const NOISE: f64 = 1e-13;
/// Ratio of the size of `K⁻¹ M x` to that of x, relative to the largest in the first block, below
/// which the result is rounding: uniform acceleration causes no motion in some directions.
const VANISHED: f64 = 1e-10;
/// Eigenvalue of the scaled Gram matrix of a block below which a direction is dropped.
const DEPENDENT: f64 = 1e-10;
/// Eigenvalue of the scaled Gram matrix below which the block is orthogonalised again: normalising
/// a nearly dependent block amplifies the remaining errors.
const NEAR_DEPENDENT: f64 = 1e-4;

/// M-orthonormal blocks `V_1 V_2 ...` with `H = Vᵀ M K⁻¹ M V`.
pub(super) struct Basis {
    blocks: Vec<Block>,
    /// Newest block, not yet multiplied; no columns if the space is exhausted.
    newest: Block,
    /// M times the newest block.
    mass_newest: Block,
    /// `H`, extended block by block.
    projected: DMatrix<f64>,
    /// `R_{j+1}`: coefficients of the newest block in the last product.
    coupling: DMatrix<f64>,
    /// Dimension of the space.
    dimension: usize,
    solves: usize,
    /// Length of the basis at which the projected operator is solved next.
    next_check: usize,
}

impl Basis {
    /// First block: `K⁻¹ M` times pseudo-random vectors, the same on every run.
    pub(super) fn start(pencil: &mut Pencil<'_>) -> Result<Self, ModesError> {
        let mut X = Block::zeros(pencil.rows, WIDTH.min(pencil.dimension));
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        for row in &mut X.rows {
            for x in &mut row.0[..X.width] {
                // xorshift64*, Vigna (2016); the upper bits as a number in (-1, 1).
                state ^= state >> 12;
                state ^= state << 25;
                state ^= state >> 27;
                *x = (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
            }
        }
        let mut W = Block::zeros(pencil.rows, X.width);
        (pencil.mass)(&X, &mut W);
        let sizes2 = X.gram(&W).diagonal();
        (pencil.solve)(&mut W);
        let empty = Block::zeros(pencil.rows, 0);
        let mut basis = Self {
            blocks: Vec::new(),
            newest: empty.clone(),
            mass_newest: empty,
            projected: DMatrix::zeros(0, 0),
            coupling: DMatrix::zeros(0, 0),
            dimension: pencil.dimension,
            solves: W.width,
            next_check: 0,
        };
        basis.append(W, X, pencil, sizes2.as_slice())?;
        if basis.is_exhausted() {
            // No vector has mass.
            return Err(ModesError::NotFinite);
        }
        Ok(basis)
    }

    pub(super) fn len(&self) -> usize {
        self.projected.nrows()
    }

    /// Whether the basis spans the whole space.
    pub(super) fn is_exhausted(&self) -> bool {
        self.newest.width == 0
    }

    /// Performs one step of the recurrence.
    pub(super) fn advance(&mut self, pencil: &mut Pencil<'_>) -> Result<(), ModesError> {
        let empty = || Block::zeros(0, 0);
        let V = std::mem::replace(&mut self.newest, empty());
        let MV = std::mem::replace(&mut self.mass_newest, empty());
        let width = V.width;
        // Recurrence: W = K⁻¹ M V_j - V_{j-1} R_jᵀ - V_j A_j.
        let mut W = MV.clone();
        (pencil.solve)(&mut W);
        self.solves += width;
        if let Some(previous) = self.blocks.last() {
            W.subtract_product(previous, &self.coupling.transpose());
        }
        let mut A = MV.gram(&W);
        W.subtract_product(&V, &A);
        self.blocks.push(V);
        // The recurrence alone loses the modes already found; one reorthogonalisation keeps the
        // basis orthonormal to rounding.
        let mut MW = MV;
        (pencil.mass)(&W, &mut MW);
        let C = grams(&self.blocks, &MW);
        subtract_products(&mut W, &self.blocks, &C);
        let old = self.len();
        A += C.rows(old, width);

        // Append A_j to the diagonal of H and R_j beside it.
        let mut H = DMatrix::zeros(old + width, old + width);
        H.view_mut((0, 0), (old, old)).copy_from(&self.projected);
        H.view_mut((old, old), (width, width)).copy_from(&symmetric_part(&A));
        if old > 0 {
            let (now, before) = self.coupling.shape();
            H.view_mut((old, old - before), (now, before)).copy_from(&self.coupling);
            H.view_mut((old - before, old), (before, now)).copy_from(&self.coupling.transpose());
        }
        self.projected = H;
        self.append(W, MW, pencil, &[])
    }

    /// Makes `W` M-orthonormal and stores it as the newest block; vanishing directions are dropped.
    ///
    /// ```text
    /// G = Wᵀ M W,   V = W B with Bᵀ G B = 1,   R = Vᵀ M W = Bᵀ G
    /// ```
    /// * `MW`: workspace for M W.
    /// * `sizes2`: at the start, `xᵀ M x` of the columns x with W = `K⁻¹ M x`.
    fn append(
        &mut self,
        mut W: Block,
        mut MW: Block,
        pencil: &mut Pencil<'_>,
        sizes2: &[f64],
    ) -> Result<(), ModesError> {
        (pencil.mass)(&W, &mut MW);
        let mut G = W.gram(&MW);
        if G.iter().any(|x| !x.is_finite()) {
            return Err(ModesError::NotFinite);
        }
        // At the start: drop directions that K⁻¹ M maps to rounding.
        let most = sizes2.iter().enumerate().map(|(k, size2)| G[(k, k)] / size2).fold(0.0, f64::max);
        for (k, size2) in sizes2.iter().enumerate() {
            if G[(k, k)] <= VANISHED.powi(2) * most * size2 {
                G.row_mut(k).fill(0.0);
                G.column_mut(k).fill(0.0);
            }
        }
        // The remainder after orthogonalisation must be above the rounding of the operator.
        let reference = self.projected.diagonal().iter().fold(0.0, |peak: f64, h| peak.max(h.abs()));
        let (Q, smallest) = orthonormalising(&G, NOISE * reference);
        if Q.ncols() == 0 || self.len() >= self.dimension {
            self.coupling = DMatrix::zeros(0, W.width);
            self.newest = Block::zeros(W.rows.len(), 0);
            self.mass_newest = self.newest.clone();
            return Ok(());
        }
        // First pass: W Q. Then, for a nearly dependent block, reorthogonalise against the basis.
        let near_dependent = (smallest < NEAR_DEPENDENT).then(|| MW.clone());
        W.multiply(&Q);
        MW.multiply(&Q);
        if near_dependent.is_some() {
            (pencil.mass)(&W, &mut MW);
            let C = grams(&self.blocks, &MW);
            subtract_products(&mut W, &self.blocks, &C);
            (pencil.mass)(&W, &mut MW);
        }
        // Second pass (Cholesky) for orthonormality to rounding; R follows from both factors.
        let second = W.gram(&MW);
        let Some(L) = symmetric_part(&second).cholesky() else {
            return Err(ModesError::NotFinite);
        };
        let inverse = L.l().transpose().try_inverse().ok_or(ModesError::NotFinite)?;
        W.multiply(&inverse);
        MW.multiply(&inverse);
        self.coupling = match near_dependent {
            Some(product) => W.gram(&product),
            None => (Q * inverse).transpose() * (&G + G.transpose()) * 0.5,
        };
        (self.newest, self.mass_newest) = (W, MW);
        Ok(())
    }

    /// Whether the projected operator should be solved now; `count`: number of requested modes.
    pub(super) fn is_check_due(&mut self, count: usize, limit: usize) -> bool {
        // The cost of the small eigenproblem grows with the cube of the basis, so a larger one is
        // solved less often.
        if self.len() < self.next_check.max(2 * count + WIDTH) && !self.is_full(limit) {
            return false;
        }
        self.next_check = self.len() + (self.len() / 12).max(1);
        true
    }

    /// Whether the basis has reached its size limit.
    pub(super) fn is_full(&self, limit: usize) -> bool {
        self.len() >= limit || self.is_exhausted()
    }

    /// Eigenpairs of H with positive θ, largest first, and `‖R_{j+1} s_last‖ / θ` of each; `None` if
    /// not finite.
    pub(super) fn ritz(&self) -> Option<Ritz> {
        let (eigenvalues, eigenvectors) = symmetric_eigen(&self.projected)?;
        let positive: Vec<usize> = (0..eigenvalues.len()).rev().filter(|k| eigenvalues[*k] > 0.0).collect();
        let theta: Vec<f64> = positive.iter().map(|k| eigenvalues[*k]).collect();
        let vectors = eigenvectors.select_columns(&positive);
        // The coupling of an exhausted basis has no rows, so its residuals are zero.
        let last = self.coupling.ncols();
        let remainders = &self.coupling * vectors.rows(self.len() - last, last);
        let residuals = remainders.column_iter().zip(&theta).map(|(r, theta)| r.norm() / theta).collect();
        Some(Ritz { theta, vectors, residuals })
    }

    /// Computes the shapes `φ = V s` of the first `count` Ritz pairs.
    ///
    /// The shapes overwrite the basis, because storing both would double the memory.
    pub(super) fn into_modes(self, ritz: &Ritz, count: usize) -> Modes {
        let rows = self.newest.rows.len();
        let Self { mut blocks, newest, mass_newest, solves, .. } = self;
        drop((newest, mass_newest));
        let firsts = || (0..count).step_by(WIDTH);
        let S: Vec<_> =
            firsts().map(|first| ritz.vectors.columns(first, WIDTH.min(count - first)).into_owned()).collect();
        combine(&mut blocks, &S);
        let mut shapes = DMatrix::zeros(rows, count);
        for (first, block) in firsts().zip(blocks) {
            block.put_columns(&mut shapes, first);
        }
        for mut shape in shapes.column_iter_mut() {
            // Sign: the largest entry is positive.
            let larger = |peak: f64, x: &f64| if x.abs() > peak.abs() * (1.0 + 1e-9) { *x } else { peak };
            if shape.iter().fold(0.0, larger) < 0.0 {
                shape.neg_mut();
            }
        }
        let omega2 = ritz.theta[..count].iter().map(|theta| 1.0 / theta).collect();
        Modes { omega2, shapes, residuals: ritz.residuals[..count].to_vec(), solves }
    }
}

/// `Q` with `Qᵀ G Q = 1` for a positive semidefinite G whose rows may have different units, and the
/// smallest retained eigenvalue of the scaled G. Directions that are dependent on others, or
/// shorter than `noise`, are dropped.
pub(crate) fn orthonormalising(G: &DMatrix<f64>, noise: f64) -> (DMatrix<f64>, f64) {
    let n = G.nrows();
    let scale: Vec<f64> = G.diagonal().iter().map(|g| if *g > 0.0 { 1.0 / g.sqrt() } else { 0.0 }).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| 0.5 * (G[(i, j)] + G[(j, i)]) * scale[i] * scale[j]);
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(scaled);
    let keep: Vec<usize> = (0..n)
        .filter(|k| {
            let vector = eigenvectors.column(*k);
            let size = (0..n).map(|i| (vector[i] / scale[i].max(1e-300)).powi(2)).sum::<f64>().sqrt();
            eigenvalues[*k] > DEPENDENT
                && eigenvalues[*k].sqrt() * size.min(1e300) > noise
                && scale.iter().any(|s| *s > 0.0)
        })
        .collect();
    let smallest = keep.iter().map(|k| eigenvalues[*k]).fold(f64::INFINITY, f64::min);
    let entry = |i: usize, k: usize| scale[i] * eigenvectors[(i, keep[k])] / eigenvalues[keep[k]].sqrt();
    (DMatrix::from_fn(n, keep.len(), entry), smallest)
}
