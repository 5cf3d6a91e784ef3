//! Lowest modes of a large pencil `K φ = ω² M φ` by shift-invert block Lanczos.
//!
//! ```text
//! K⁻¹ M φ = θ φ,   θ = 1/ω²
//! W = K⁻¹ M V_j,   W <- W - V Vᵀ M W (twice),   W = V_{j+1} R_{j+1},   H = Vᵀ M K⁻¹ M V
//! H s = θ s,   ‖K⁻¹ M φ - θ φ‖_M = ‖R_{j+1} s_last‖   for φ = V s
//! ```
//! All basis vectors are kept M-orthonormal, so no ghost modes appear; a block finds multiple
//! frequencies (the two bending planes of a round tube) together, and one pass over the factor serves
//! the whole block. The operator is given as two closures, so that constraints stay outside.
//!
//! Source: Grimes, Lewis & Simon (1994), A shifted block Lanczos algorithm, sections 2 and 4, with full
//! reorthogonalisation in place of their selective one.

use nalgebra::{DMatrix, SymmetricEigen};

use super::dense::{add_product, gram, symmetric_eigen};

/// Residual `‖K⁻¹ M φ - θ φ‖_M / θ` at which a mode counts as found.
const TOLERANCE: f64 = 1e-10;

/// Columns of one block.
const BLOCK: usize = 4;

/// Which modes are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModesWanted {
    /// The lowest ones, so many.
    Count(usize),
    /// All below a bound on ω² in (rad/s)², but at most `at_most`.
    Below {
        /// Bound on ω², (rad/s)².
        omega2: f64,
        /// Refuse to return more than this.
        at_most: usize,
    },
}

/// Modes, ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Squared natural frequencies, (rad/s)².
    pub omega2: Vec<f64>,
    /// Shapes by columns, mass-normalised, largest component positive.
    pub shapes: DMatrix<f64>,
    /// `‖K⁻¹ M φ - θ φ‖_M / θ` of each mode, from the recurrence.
    pub residuals: Vec<f64>,
    /// Right-hand sides solved.
    pub solves: usize,
}

impl Modes {
    /// No modes of a system with so many rows.
    pub fn none(rows: usize) -> Self {
        Self { omega2: Vec::new(), shapes: DMatrix::zeros(rows, 0), residuals: Vec::new(), solves: 0 }
    }

    /// Number of modes.
    pub fn len(&self) -> usize {
        self.omega2.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.omega2.is_empty()
    }

    /// Natural frequencies, Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.omega2.iter().map(|omega2| omega2.sqrt() / std::f64::consts::TAU).collect()
    }
}

/// Why the modes were not found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// The basis grew to its limit first.
    #[error(
        "{found} of {wanted} modes found with a basis of {basis} vectors; the worst of the others has a residual of {residual:.1e}"
    )]
    NotConverged {
        /// Modes that were found.
        found: usize,
        /// Modes that were asked for.
        wanted: usize,
        /// Vectors in the basis.
        basis: usize,
        /// Largest residual among the wanted ones.
        residual: f64,
    },
    /// The frequency bound lets in more modes than allowed.
    #[error("more than {at_most} modes lie below the bound; lower the bound or ask for a number of modes")]
    TooMany {
        /// The limit.
        at_most: usize,
    },
    /// A product with M or K⁻¹ gave a NaN or an infinity.
    #[error("the eigenproblem gave a number that is not finite: is the mass zero or the stiffness singular?")]
    NotFinite,
}

/// The lowest modes of the pencil behind `solve` and `mass`.
///
/// * `rows`: length of a vector; `dimension`: of the space that `solve` maps into (at most `rows`).
/// * `solve`: replaces F by `K⁻¹ F`, with every constraint fulfilled.
/// * `mass`: `Y = M X`.
///
/// Fewer modes than asked for are returned only where the space has no more.
///
/// # Errors
/// [`ModesError`].
pub fn smallest_modes(
    rows: usize,
    dimension: usize,
    wanted: ModesWanted,
    solve: &mut dyn FnMut(&mut DMatrix<f64>),
    mass: &mut dyn FnMut(&DMatrix<f64>, &mut DMatrix<f64>),
) -> Result<Modes, ModesError> {
    let count = match wanted {
        ModesWanted::Count(count) => count.min(dimension),
        ModesWanted::Below { at_most, .. } => (at_most + 1).min(dimension),
    };
    if count == 0 || dimension == 0 {
        return Ok(Modes::none(rows));
    }
    let mut basis = Basis::new(rows, BLOCK.min(dimension));
    basis.start(solve, mass)?;
    if basis.exhausted {
        // No vector has mass.
        return Err(ModesError::NotFinite);
    }
    let limit = dimension.min(8 * count + 120);
    let mut next_look = count.min(dimension);
    loop {
        basis.advance(solve, mass)?;
        let full = basis.len() >= limit || basis.exhausted;
        // The small eigenproblem grows with the cube of the basis: a larger one is looked at less often.
        if basis.len() < next_look && !full {
            continue;
        }
        next_look = basis.len() + (basis.len() / 12).max(1);
        let ritz = basis.ritz().ok_or(ModesError::NotFinite)?;
        if let Some(found) = ritz.settled(count, wanted, basis.exhausted)? {
            let shapes = basis.shapes(&ritz, found);
            let omega2 = ritz.theta[..found].iter().map(|theta| 1.0 / theta).collect();
            return Ok(Modes { omega2, shapes, residuals: ritz.residuals[..found].to_vec(), solves: basis.solves });
        }
        if full {
            let found = ritz.converged();
            let residual = ritz.residuals.iter().take(count).fold(0.0, |worst: f64, r| worst.max(*r));
            return Err(ModesError::NotConverged { found, wanted: count, basis: basis.len(), residual });
        }
    }
}

/// The basis, by blocks, and the projected operator.
struct Basis {
    rows: usize,
    width: usize,
    blocks: Vec<DMatrix<f64>>,
    /// `M` times the newest block.
    mass_newest: DMatrix<f64>,
    /// Newest block not yet multiplied.
    newest: DMatrix<f64>,
    /// `H`, grown block by block.
    projected: DMatrix<f64>,
    /// `R_{j+1}`.
    coupling: DMatrix<f64>,
    solves: usize,
    exhausted: bool,
}

struct Ritz {
    theta: Vec<f64>,
    vectors: DMatrix<f64>,
    residuals: Vec<f64>,
}

impl Ritz {
    fn converged(&self) -> usize {
        self.residuals.iter().take_while(|r| **r <= TOLERANCE).count()
    }

    /// Number of modes to return, once that is certain.
    fn settled(&self, count: usize, wanted: ModesWanted, exhausted: bool) -> Result<Option<usize>, ModesError> {
        let good = if exhausted { self.theta.len() } else { self.converged() };
        match wanted {
            ModesWanted::Count(_) => Ok((good >= count || exhausted).then_some(good.min(count))),
            ModesWanted::Below { omega2, at_most } => {
                let below = self.theta[..good].iter().take_while(|theta| 1.0 / **theta < omega2).count();
                if below > at_most {
                    return Err(ModesError::TooMany { at_most });
                }
                // One converged mode above the bound shows that none below is missing.
                Ok((below < good || exhausted).then_some(below))
            }
        }
    }
}

impl Basis {
    fn new(rows: usize, width: usize) -> Self {
        let empty = DMatrix::zeros(rows, 0);
        Self {
            rows,
            width,
            blocks: Vec::new(),
            mass_newest: empty.clone(),
            newest: empty,
            projected: DMatrix::zeros(0, 0),
            coupling: DMatrix::zeros(0, 0),
            solves: 0,
            exhausted: false,
        }
    }

    fn len(&self) -> usize {
        self.blocks.iter().map(DMatrix::ncols).sum()
    }

    /// First block: `K⁻¹ M` of pseudo-random vectors, the same ones on every run.
    fn start(
        &mut self,
        solve: &mut dyn FnMut(&mut DMatrix<f64>),
        mass: &mut dyn FnMut(&DMatrix<f64>, &mut DMatrix<f64>),
    ) -> Result<(), ModesError> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let random = DMatrix::from_fn(self.rows, self.width, |_, _| {
            // xorshift64*, Vigna (2016); the upper bits as a number in (-1, 1).
            state ^= state >> 12;
            state ^= state << 25;
            state ^= state >> 27;
            (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        });
        let mut W = DMatrix::zeros(self.rows, self.width);
        mass(&random, &mut W);
        solve(&mut W);
        self.solves += self.width;
        self.append(W, mass)?;
        Ok(())
    }

    /// One step of the recurrence.
    fn advance(
        &mut self,
        solve: &mut dyn FnMut(&mut DMatrix<f64>),
        mass: &mut dyn FnMut(&DMatrix<f64>, &mut DMatrix<f64>),
    ) -> Result<(), ModesError> {
        let mut W = std::mem::replace(&mut self.mass_newest, DMatrix::zeros(0, 0));
        let block = std::mem::replace(&mut self.newest, DMatrix::zeros(0, 0));
        let width = block.ncols();
        self.blocks.push(block);
        solve(&mut W);
        self.solves += width;

        // Twice is enough to keep the basis orthonormal to rounding.
        let size = self.len();
        let mut coefficients = DMatrix::zeros(size, width);
        let mut MW = DMatrix::zeros(self.rows, width);
        for _ in 0..2 {
            mass(&W, &mut MW);
            let mut row = 0;
            for V in &self.blocks {
                let C = gram(V, &MW);
                add_product(&mut W, -1.0, V, &C);
                let mut part = coefficients.view_mut((row, 0), C.shape());
                part += &C;
                row += V.ncols();
            }
        }

        // H gets this block column; what lies above is its mirror image.
        let mut H = DMatrix::zeros(size, size);
        let old = size - width;
        H.view_mut((0, 0), (old, old)).copy_from(&self.projected);
        H.view_mut((0, old), (size, width)).copy_from(&coefficients);
        let mirrored = coefficients.rows(0, old).transpose();
        H.view_mut((old, 0), (width, old)).copy_from(&mirrored);
        let corner = coefficients.rows(old, width).into_owned();
        H.view_mut((old, old), (width, width)).copy_from(&((&corner + corner.transpose()) * 0.5));
        self.projected = H;
        self.append(W, mass)
    }

    /// Makes `W` M-orthonormal and takes it as the newest block; directions that vanish are dropped.
    fn append(
        &mut self,
        W: DMatrix<f64>,
        mass: &mut dyn FnMut(&DMatrix<f64>, &mut DMatrix<f64>),
    ) -> Result<(), ModesError> {
        let width = W.ncols();
        let mut MW = DMatrix::zeros(self.rows, width);
        mass(&W, &mut MW);
        let mut G = gram(&W, &MW);
        G = (&G + G.transpose()) * 0.5;
        if G.iter().any(|x| !x.is_finite()) {
            return Err(ModesError::NotFinite);
        }
        // W = V R with V = W Q Λ^-1/2, R = Λ^1/2 Qᵀ, where G = Q Λ Qᵀ is scaled first.
        let scale: Vec<f64> = G.diagonal().iter().map(|g| if *g > 0.0 { 1.0 / g.sqrt() } else { 0.0 }).collect();
        let scaled = DMatrix::from_fn(width, width, |i, j| G[(i, j)] * scale[i] * scale[j]);
        let eigen = SymmetricEigen::new(scaled);
        // What is left after orthogonalisation must stand out of the rounding of the operator.
        let reference = self.projected.diagonal().iter().fold(0.0, |peak: f64, h| peak.max(h.abs()));
        let noise = 1e-13 * reference;
        let keep: Vec<usize> = (0..width)
            .filter(|k| {
                let vector = eigen.eigenvectors.column(*k);
                let size = (0..width).map(|i| (vector[i] / scale[i].max(1e-300)).powi(2)).sum::<f64>().sqrt();
                eigen.eigenvalues[*k] > 1e-10
                    && eigen.eigenvalues[*k].sqrt() * size.min(1e300) > noise
                    && scale.iter().any(|s| *s > 0.0)
            })
            .collect();
        if keep.is_empty() {
            self.exhausted = true;
            self.coupling = DMatrix::zeros(0, width);
            self.newest = DMatrix::zeros(self.rows, 0);
            self.mass_newest = DMatrix::zeros(self.rows, 0);
            return Ok(());
        }
        let Q = DMatrix::from_fn(width, keep.len(), |i, k| {
            scale[i] * eigen.eigenvectors[(i, keep[k])] / eigen.eigenvalues[keep[k]].sqrt()
        });
        let mut V = DMatrix::zeros(self.rows, keep.len());
        add_product(&mut V, 1.0, &W, &Q);
        let mut MV = DMatrix::zeros(self.rows, keep.len());
        // Once more against the basis and itself: a near-dependent block magnifies what was left.
        for _ in 0..1 {
            mass(&V, &mut MV);
            for U in &self.blocks {
                let C = gram(U, &MV);
                add_product(&mut V, -1.0, U, &C);
            }
        }
        mass(&V, &mut MV);
        let G = gram(&V, &MV);
        let Some(R) = ((&G + G.transpose()) * 0.5).cholesky() else {
            return Err(ModesError::NotFinite);
        };
        let inverse = R.l().transpose().try_inverse().ok_or(ModesError::NotFinite)?;
        let (mut orthonormal, mut M_orthonormal) =
            (DMatrix::zeros(self.rows, keep.len()), DMatrix::zeros(self.rows, keep.len()));
        add_product(&mut orthonormal, 1.0, &V, &inverse);
        add_product(&mut M_orthonormal, 1.0, &MV, &inverse);
        self.coupling = gram(&orthonormal, &MW);
        self.newest = orthonormal;
        self.mass_newest = M_orthonormal;
        Ok(())
    }

    /// Ritz values, largest θ first.
    fn ritz(&self) -> Option<Ritz> {
        let (eigenvalues, eigenvectors) = symmetric_eigen(&self.projected)?;
        let order = (0..eigenvalues.len()).rev();
        let size = self.projected.nrows();
        let last = self.blocks.last().map_or(0, DMatrix::ncols);
        let positive: Vec<usize> = order.filter(|k| eigenvalues[*k] > 0.0).collect();
        let theta: Vec<f64> = positive.iter().map(|k| eigenvalues[*k]).collect();
        let vectors = eigenvectors.select_columns(&positive);
        let bottom = vectors.rows(size - last, last);
        let residuals = match self.coupling.nrows() {
            0 => vec![0.0; theta.len()],
            _ => (&self.coupling * bottom).column_iter().zip(&theta).map(|(r, theta)| r.norm() / theta).collect(),
        };
        Some(Ritz { theta, vectors, residuals })
    }

    fn shapes(&self, ritz: &Ritz, count: usize) -> DMatrix<f64> {
        let mut shapes = DMatrix::zeros(self.rows, count);
        let mut row = 0;
        for V in &self.blocks {
            let S = ritz.vectors.view((row, 0), (V.ncols(), count)).into_owned();
            add_product(&mut shapes, 1.0, V, &S);
            row += V.ncols();
        }
        for mut shape in shapes.column_iter_mut() {
            let peak =
                shape.iter().fold(0.0, |peak: f64, x| if x.abs() > peak.abs() * (1.0 + 1e-9) { *x } else { peak });
            if peak < 0.0 {
                shape.neg_mut();
            }
        }
        shapes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Cholesky, Ordering, SparseSymmetric, Threads};

    /// Chain of unit masses and springs, both ends held: ω² = 4 sin²(kπ/(2(n+1))).
    fn chain(n: usize, copies: usize) -> (SparseSymmetric, Vec<f64>) {
        let mut triplets = Vec::new();
        for copy in 0..copies {
            let first = copy * n;
            for i in first..first + n {
                triplets.push((i as u32, i as u32, 2.0));
                if i > first {
                    triplets.push((i as u32, i as u32 - 1, -1.0));
                }
            }
        }
        let omega2 = |k: usize| 4.0 * (k as f64 * std::f64::consts::PI / (2.0 * (n as f64 + 1.0))).sin().powi(2);
        let truth = (1..=n).flat_map(|k| std::iter::repeat_n(omega2(k), copies)).collect();
        (SparseSymmetric::from_triplets(n * copies, &triplets), truth)
    }

    fn modes_of(K: &SparseSymmetric, wanted: ModesWanted) -> Result<Modes, ModesError> {
        let factor = Cholesky::new(K, Ordering::MinimumDegree, Threads(1)).unwrap();
        smallest_modes(K.size(), K.size(), wanted, &mut |F| factor.solve_in_place(F), &mut |X, Y| Y.copy_from(X))
    }

    #[test]
    fn frequencies_of_a_chain_of_masses_are_the_closed_form() {
        let (K, truth) = chain(300, 1);
        let modes = modes_of(&K, ModesWanted::Count(20)).unwrap();
        for (found, truth) in modes.omega2.iter().zip(&truth) {
            assert!((found / truth - 1.0).abs() < 1e-11, "{found} {truth}"); // measured 1e-12
        }
        let gram = modes.shapes.transpose() * &modes.shapes;
        assert!((gram - DMatrix::identity(20, 20)).amax() < 1e-12);
    }

    #[test]
    fn a_frequency_that_is_there_three_times_is_found_three_times() {
        let (K, truth) = chain(100, 3);
        let modes = modes_of(&K, ModesWanted::Count(12)).unwrap();
        for (found, truth) in modes.omega2.iter().zip(&truth) {
            assert!((found / truth - 1.0).abs() < 1e-11);
        }
    }

    #[test]
    fn a_frequency_bound_returns_exactly_the_modes_below_it() {
        let (K, truth) = chain(200, 1);
        let bound = (truth[16] + truth[17]) / 2.0;
        let modes = modes_of(&K, ModesWanted::Below { omega2: bound, at_most: 100 }).unwrap();
        assert_eq!(modes.len(), 17);
        let refused = modes_of(&K, ModesWanted::Below { omega2: bound, at_most: 5 });
        assert_eq!(refused.unwrap_err(), ModesError::TooMany { at_most: 5 });
    }

    /// A mass that is zero wherever the body can move: an error, not a panic.
    #[test]
    fn a_body_without_mass_has_no_modes() {
        let (K, _) = chain(20, 1);
        let factor = Cholesky::new(&K, Ordering::MinimumDegree, Threads(1)).unwrap();
        let mut solve = |F: &mut DMatrix<f64>| factor.solve_in_place(F);
        let found = smallest_modes(20, 20, ModesWanted::Count(3), &mut solve, &mut |_, Y| Y.fill(0.0));
        assert_eq!(found.unwrap_err(), ModesError::NotFinite);
    }

    #[test]
    fn a_small_system_gives_all_its_modes_and_no_more() {
        let (K, truth) = chain(5, 1);
        let modes = modes_of(&K, ModesWanted::Count(50)).unwrap();
        assert_eq!(modes.len(), 5);
        for (found, truth) in modes.omega2.iter().zip(&truth) {
            assert!((found / truth - 1.0).abs() < 1e-12);
        }
    }
}
