//! Lanczos basis, built block by block, and the projected operator.
//!
//! Start at [`Basis::start`] and [`Basis::advance`]; V, H, T and K⁻¹ M are those of the parent
//! module. Vectors have one row per DoF and eight columns per block. Not here: the loop and its
//! stopping rule (the parent), the pencil with a support released (`released.rs`).

use nalgebra::{DMatrix, SymmetricEigen};

use super::{Modes, ModesError, Pencil, Released, Ritz};
use crate::sparse::block::{Block, WIDTH, combine, grams, subtract_products};

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
    pub(super) blocks: Vec<Block>,
    /// Newest block, not yet multiplied; no columns if the space is exhausted.
    newest: Block,
    /// M times the newest block.
    mass_newest: Block,
    /// `H`, extended block by block.
    pub(super) projected: DMatrix<f64>,
    /// `R_{j+1}`: coefficients of the newest block in the last product.
    pub(super) coupling: DMatrix<f64>,
    /// Products with the shapes of a released support.
    pub(super) beside: Option<Beside>,
    /// Dimension of the space.
    dimension: usize,
    solves: usize,
    /// Size of the basis from which the projected operator is solved again.
    next_solve: usize,
}

/// Products of T, the shapes of a released support, with the basis.
pub(super) struct Beside {
    /// `Vᵀ M T`.
    pub(super) X: DMatrix<f64>,
    /// `V_1ᵀ M K⁻¹ M T`; zero for the later blocks.
    pub(super) Y_1: DMatrix<f64>,
    /// `Tᵀ M T`.
    pub(super) G: DMatrix<f64>,
    /// `Tᵀ M K⁻¹ M T`.
    pub(super) S: DMatrix<f64>,
}

impl Basis {
    /// First block: `K⁻¹ M` times T and pseudo-random vectors, the same on every run.
    pub(super) fn start(pencil: &mut Pencil<'_>, released: Option<&Released<'_>>) -> Result<Self, ModesError> {
        let (rows, beside) = (pencil.rows, released.map_or(0, |released| released.T.width));
        let mut W = Block::zeros(rows, WIDTH.min(beside + pencil.dimension));
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        for (i, row) in W.rows.iter_mut().enumerate() {
            for (k, x) in row.0[..W.width].iter_mut().enumerate() {
                // xorshift64*, Vigna (2016); the upper bits as a number in (-1, 1).
                state ^= state >> 12;
                state ^= state << 25;
                state ^= state >> 27;
                let random = (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
                *x = released.filter(|_| k < beside).map_or(random, |released| released.T.rows[i].0[k]);
            }
        }
        // W ← K⁻¹ M W, with the products of T that the released pencil needs.
        let mut MW = Block::zeros(rows, W.width);
        (pencil.mass)(&W, &mut MW);
        let sizes2 = W.gram(&MW).diagonal();
        W.clone_from(&MW);
        (pencil.solve)(&mut W);
        let products = released.map(|released| {
            let of_T = |A: DMatrix<f64>| A.columns(0, beside).into_owned();
            (of_T(released.T.gram(&MW)), of_T(W.gram(&MW)).rows(0, beside).into_owned())
        });
        let empty = Block::zeros(rows, 0);
        let mut basis = Self {
            blocks: Vec::new(),
            newest: empty.clone(),
            mass_newest: empty,
            projected: DMatrix::zeros(0, 0),
            coupling: DMatrix::zeros(0, 0),
            beside: None,
            dimension: pencil.dimension,
            solves: W.width,
            next_solve: 0,
        };
        basis.append(W, MW, pencil, sizes2.as_slice())?;
        if basis.is_exhausted() {
            // No vector has mass.
            return Err(ModesError::NotFinite);
        }
        basis.beside = products.map(|(G, S)| Beside {
            X: DMatrix::zeros(0, beside),
            Y_1: basis.coupling.columns(0, beside).into_owned(),
            G: (&G + G.transpose()) * 0.5,
            S: (&S + S.transpose()) * 0.5,
        });
        Ok(basis)
    }

    pub(super) fn len(&self) -> usize {
        self.projected.nrows()
    }

    /// Whether the basis spans the whole space.
    pub(super) fn is_exhausted(&self) -> bool {
        self.newest.width == 0
    }

    /// Performs one step of the recurrence; `T` as at the start.
    pub(super) fn advance(&mut self, pencil: &mut Pencil<'_>, T: Option<&Block>) -> Result<(), ModesError> {
        let empty = || Block::zeros(0, 0);
        let V = std::mem::replace(&mut self.newest, empty());
        let MV = std::mem::replace(&mut self.mass_newest, empty());
        let width = V.width;
        if let (Some(beside), Some(T)) = (&mut self.beside, T) {
            let (old, columns) = beside.X.shape();
            beside.X = std::mem::take(&mut beside.X).resize(old + width, columns, 0.0);
            beside.X.rows_mut(old, width).copy_from(&MV.gram(T));
        }
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
        H.view_mut((old, old), (width, width)).copy_from(&((&A + A.transpose()) * 0.5));
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
    /// B is found in two passes, `B = Q L⁻ᵀ`.
    ///
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
        let Some(L) = ((&second + second.transpose()) * 0.5).cholesky() else {
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
    pub(super) fn is_solve_due(&mut self, count: usize, limit: usize) -> bool {
        // The cost of the small eigenproblem grows with the cube of the basis, so a larger one is
        // solved less often.
        if self.len() < self.next_solve.max(2 * count + WIDTH) && !self.is_full(limit) {
            return false;
        }
        self.next_solve = self.len() + (self.len() / 12).max(1);
        true
    }

    fn is_full(&self, limit: usize) -> bool {
        self.len() >= limit || self.is_exhausted()
    }

    /// Returns an error if the basis has reached its size limit.
    pub(super) fn refuse_if_full(&self, ritz: &Ritz, wanted: usize, limit: usize) -> Result<(), ModesError> {
        if !self.is_full(limit) {
            return Ok(());
        }
        let residual = ritz.residuals.iter().take(wanted).fold(0.0, |worst: f64, r| worst.max(*r));
        Err(ModesError::NotConverged { found: ritz.converged(), wanted, basis: self.len(), residual })
    }

    /// Ritz pairs, largest θ first.
    pub(super) fn ritz(&self) -> Option<Ritz> {
        let (theta, vectors) = Ritz::of(&self.projected)?;
        let residuals = self.residuals(&theta, &vectors);
        let beside = DMatrix::zeros(0, theta.len());
        Some(Ritz { theta, vectors, beside, residuals })
    }

    /// `‖R_{j+1} s_last‖ / θ` of each vector over the basis.
    pub(super) fn residuals(&self, theta: &[f64], vectors: &DMatrix<f64>) -> Vec<f64> {
        if self.is_exhausted() {
            return vec![0.0; theta.len()];
        }
        let last = self.coupling.ncols();
        let bottom = vectors.rows(self.len() - last, last);
        (&self.coupling * bottom).column_iter().zip(theta).map(|(r, theta)| r.norm() / theta).collect()
    }

    /// Computes the requested number of modes of each set of Ritz pairs; `T`: shapes that extend
    /// the basis.
    ///
    /// The shapes overwrite the basis, because storing both would double the memory.
    pub(super) fn into_modes<const N: usize>(self, of: [(&Ritz, usize); N], T: Option<&Block>) -> [Modes; N] {
        let rows = self.newest.rows.len();
        let Self { mut blocks, newest, mass_newest, projected, solves, .. } = self;
        drop((newest, mass_newest));
        blocks.extend(T.cloned());
        let vectors = projected.nrows() + T.map_or(0, |T| T.width);
        // Shapes V s, a block of columns at a time.
        let mut factors = Vec::new();
        for (ritz, count) in of {
            for first in (0..count).step_by(WIDTH) {
                let width = WIDTH.min(count - first);
                let mut C = DMatrix::zeros(vectors, width);
                C.rows_mut(0, projected.nrows()).copy_from(&ritz.vectors.columns(first, width));
                C.rows_mut(projected.nrows(), ritz.beside.nrows()).copy_from(&ritz.beside.columns(first, width));
                factors.push(C);
            }
        }
        combine(&mut blocks, &factors);
        let mut combined = blocks.into_iter();
        of.map(|(ritz, count)| {
            let mut shapes = DMatrix::zeros(rows, count);
            for (first, block) in (0..count).step_by(WIDTH).zip(&mut combined) {
                block.put_columns(&mut shapes, first);
            }
            for mut shape in shapes.column_iter_mut() {
                // Sign: the largest entry is positive.
                let peak =
                    shape.iter().fold(0.0, |peak: f64, x| if x.abs() > peak.abs() * (1.0 + 1e-9) { *x } else { peak });
                if peak < 0.0 {
                    shape.neg_mut();
                }
            }
            let omega2 = ritz.theta[..count].iter().map(|theta| 1.0 / theta).collect();
            Modes { omega2, shapes, residuals: ritz.residuals[..count].to_vec(), solves }
        })
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
