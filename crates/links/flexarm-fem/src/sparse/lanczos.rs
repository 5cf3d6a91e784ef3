//! Lowest modes of a large pencil `K φ = ω² M φ` by shift-invert block Lanczos.
//!
//! ```text
//! K⁻¹ M φ = θ φ,   θ = 1/ω²
//! K⁻¹ M V_j = V_{j-1} R_jᵀ + V_j A_j + V_{j+1} R_{j+1},   Vᵀ M V = 1
//! H = Vᵀ M K⁻¹ M V: block tridiagonal of A_j and R_j,   H s = θ s
//! ‖K⁻¹ M φ - θ φ‖_M = ‖R_{j+1} s_last‖   for φ = V s
//! ```
//! All basis vectors are kept M-orthonormal, so no ghost modes appear. A block of eight finds
//! multiple frequencies (the two bending planes of a round tube) together, and one pass over the
//! factor serves the whole block. The operator is given as two closures, so that the caller handles
//! constraints.
//!
//! Modes of the same body with one support released come from the same basis
//! ([`modes_of_two_supports`]), without further solves.
//!
//! Source: Grimes, Lewis & Simon (1994), A shifted block Lanczos algorithm, sections 2 and 4, with
//! full reorthogonalisation in place of their selective one.

mod basis;
mod released;

use nalgebra::DMatrix;

use self::basis::Basis;
use super::block::Block;
use super::dense::symmetric_eigen;

pub(crate) use basis::orthonormalising;
pub(crate) use released::Released;

/// Residual `‖K⁻¹ M φ - θ φ‖_M / θ` below which a mode is converged.
const TOLERANCE: f64 = 1e-10;

/// Pencil (K, M), given by its action on blocks of vectors.
pub(crate) struct Pencil<'a> {
    /// Length of a vector.
    pub rows: usize,
    /// Dimension of the range of `solve`, at most `rows`.
    pub dimension: usize,
    /// Replaces F by `K⁻¹ F`, with all constraints satisfied.
    pub solve: &'a mut dyn FnMut(&mut Block),
    /// Computes `Y = M X`.
    pub mass: &'a mut dyn FnMut(&Block, &mut Block),
}

/// Selection of modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModesWanted {
    /// This number of lowest modes.
    Count(usize),
    /// All modes below a bound on ω².
    Below {
        /// Bound on ω², (rad/s)².
        omega2: f64,
        /// Maximum number of modes; more are an error.
        at_most: usize,
    },
}

/// Modes, in ascending order.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Squared natural frequencies, (rad/s)².
    pub omega2: Vec<f64>,
    /// Mass-normalised shapes as columns, with the largest component positive.
    pub shapes: DMatrix<f64>,
    /// `‖K⁻¹ M φ - θ φ‖_M / θ` of each mode, from the recurrence.
    pub residuals: Vec<f64>,
    /// Number of right-hand sides solved; zero if another basis was reused.
    pub solves: usize,
}

impl Modes {
    /// Empty set of modes of a system with `rows` rows.
    pub fn none(rows: usize) -> Self {
        Self { omega2: Vec::new(), shapes: DMatrix::zeros(rows, 0), residuals: Vec::new(), solves: 0 }
    }

    /// Number of modes.
    pub fn len(&self) -> usize {
        self.omega2.len()
    }

    /// Whether there are no modes.
    pub fn is_empty(&self) -> bool {
        self.omega2.is_empty()
    }

    /// Natural frequencies, Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.omega2.iter().map(|omega2| omega2.sqrt() / std::f64::consts::TAU).collect()
    }
}

/// Errors of computing modes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// The basis reached its size limit before convergence.
    #[error(
        "{found} of {wanted} modes found with a basis of {basis} vectors; the worst of the others has a residual of {residual:.1e}"
    )]
    NotConverged {
        /// Number of converged modes.
        found: usize,
        /// Number of requested modes.
        wanted: usize,
        /// Number of vectors in the basis.
        basis: usize,
        /// Maximum residual of the requested modes.
        residual: f64,
    },
    /// More modes than allowed are below the frequency bound.
    #[error("more than {at_most} modes lie below the bound; lower the bound or ask for a number of modes")]
    TooMany {
        /// Maximum number of modes.
        at_most: usize,
    },
    /// A product with M or K⁻¹ is NaN or infinite.
    #[error("the eigenproblem gave a number that is not finite: is the mass zero or the stiffness singular?")]
    NotFinite,
}

/// Computes the lowest modes of a pencil.
///
/// Returns fewer modes than requested only if the space has no more.
///
/// # Errors
/// [`ModesError`].
pub(crate) fn smallest_modes(pencil: &mut Pencil<'_>, wanted: ModesWanted) -> Result<Modes, ModesError> {
    let count = wanted.count(pencil.dimension);
    if count == 0 {
        return Ok(Modes::none(pencil.rows));
    }
    let mut basis = Basis::start(pencil, None)?;
    let limit = pencil.dimension.min(8 * count + 120);
    let (ritz, found) = loop {
        basis.advance(pencil, None)?;
        if basis.is_solve_due(count, limit) {
            let ritz = basis.ritz().ok_or(ModesError::NotFinite)?;
            match ritz.settled(wanted, count, &basis)? {
                Some(found) => break (ritz, found),
                None => basis.refuse_if_full(&ritz, count, limit)?,
            }
        }
    };
    let [modes] = basis.into_modes([(&ritz, found)], None);
    Ok(modes)
}

/// Computes the lowest modes of a pencil, and `released_count` modes with one support released,
/// from one basis.
///
/// ```text
/// K_r⁻¹ = K⁻¹ + T C Tᵀ,   C = (Tᵀ K T)⁻¹      T: static shapes of the released support
/// K_r⁻¹ M [V T] = [V T] P + V_{j+1} R_{j+1} s_last    where V begins with K⁻¹ M T
/// ```
/// The basis of the first pencil, extended by T, is a Lanczos basis of the second.
///
/// # Errors
/// [`ModesError`].
pub(crate) fn modes_of_two_supports(
    pencil: &mut Pencil<'_>,
    wanted: ModesWanted,
    released: &Released<'_>,
    released_count: usize,
) -> Result<(Modes, Modes), ModesError> {
    let (rows, dimension) = (pencil.rows, pencil.dimension);
    let count = wanted.count(dimension);
    let others = ModesWanted::Count(released_count.min(dimension + released.T.width));
    let most = count.max(released_count);
    if most == 0 {
        return Ok((Modes::none(rows), Modes::none(rows)));
    }
    let mut basis = Basis::start(pencil, Some(released))?;
    let limit = dimension.min(8 * most + 120);
    loop {
        basis.advance(pencil, Some(released.T))?;
        if !basis.is_solve_due(most, limit) {
            continue;
        }
        let ritz = basis.ritz().ok_or(ModesError::NotFinite)?;
        // Both sets of modes from the same basis; each must have settled.
        let found = if count == 0 { Some(0) } else { ritz.settled(wanted, count, &basis)? };
        let other = basis.released_ritz(released).ok_or(ModesError::NotFinite)?;
        match (found, other.settled(others, others.count(usize::MAX), &basis)?) {
            (Some(found), Some(other_found)) => {
                let [modes, other] = basis.into_modes([(&ritz, found), (&other, other_found)], Some(released.T));
                return Ok((modes, Modes { solves: 0, ..other }));
            }
            (None, _) => basis.refuse_if_full(&ritz, count, limit)?,
            (_, None) => basis.refuse_if_full(&other, released_count, limit)?,
        }
    }
}

impl ModesWanted {
    /// Number of modes to compute in a space of this dimension.
    fn count(self, dimension: usize) -> usize {
        match self {
            Self::Count(count) => count.min(dimension),
            Self::Below { at_most, .. } => (at_most + 1).min(dimension),
        }
    }
}

/// Eigenpairs of a projected operator, largest θ first.
struct Ritz {
    theta: Vec<f64>,
    /// Eigenvectors over the basis.
    vectors: DMatrix<f64>,
    /// Components over the shapes of a released support; no rows if there is none.
    beside: DMatrix<f64>,
    residuals: Vec<f64>,
}

impl Ritz {
    /// Positive eigenvalues of `H` and their eigenvectors; `None` if not finite.
    fn of(H: &DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let (eigenvalues, eigenvectors) = symmetric_eigen(H)?;
        let positive: Vec<usize> = (0..eigenvalues.len()).rev().filter(|k| eigenvalues[*k] > 0.0).collect();
        Some((positive.iter().map(|k| eigenvalues[*k]).collect(), eigenvectors.select_columns(&positive)))
    }

    fn converged(&self) -> usize {
        self.residuals.iter().take_while(|r| **r <= TOLERANCE).count()
    }

    /// Returns the number of modes to return, once it is certain.
    fn settled(&self, wanted: ModesWanted, count: usize, basis: &Basis) -> Result<Option<usize>, ModesError> {
        let exhausted = basis.is_exhausted();
        let good = if exhausted { self.theta.len() } else { self.converged() };
        match wanted {
            ModesWanted::Count(_) => Ok((good >= count || exhausted).then_some(good.min(count))),
            ModesWanted::Below { omega2, at_most } => {
                let below = self.theta[..good].iter().take_while(|theta| 1.0 / **theta < omega2).count();
                if below > at_most {
                    return Err(ModesError::TooMany { at_most });
                }
                // One converged mode above the bound shows that no mode below it is missing.
                Ok((below < good || exhausted).then_some(below))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Cholesky, Ordering, SparseSymmetric};

    /// Chain of unit masses and springs, both ends fixed: ω² = 4 sin²(kπ/(2(n+1))).
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
        let factor = Cholesky::new(K, Ordering::MinimumDegree).unwrap();
        let solve = &mut |F: &mut Block| factor.solve_block(F);
        let mass = &mut |X: &Block, Y: &mut Block| Y.clone_from(X);
        smallest_modes(&mut Pencil { rows: K.size(), dimension: K.size(), solve, mass }, wanted)
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

    /// A mass that is zero for every possible motion: an error, not a panic.
    #[test]
    fn a_body_without_mass_has_no_modes() {
        let (K, _) = chain(20, 1);
        let factor = Cholesky::new(&K, Ordering::MinimumDegree).unwrap();
        let solve = &mut |F: &mut Block| factor.solve_block(F);
        let mass = &mut |_: &Block, Y: &mut Block| *Y = Block::zeros(20, Y.width);
        let found = smallest_modes(&mut Pencil { rows: 20, dimension: 20, solve, mass }, ModesWanted::Count(3));
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
