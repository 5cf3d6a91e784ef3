//! The lowest natural frequency alone, with a proof that it is the lowest.
//!
//! ```text
//! x ← (S - σ M)^-1 M x,   ρ = xᵀ S x / xᵀ M x          σ below the lowest eigenvalue of S φ = λ M φ      (1)
//! S - (ρ - ε) M positive definite  =>  no eigenvalue below ρ - ε                                        (2)
//! ```
//! ρ is never below the lowest eigenvalue, so with (2), Sylvester's law of inertia, it is that eigenvalue to within ε. The
//! factor of each shift proves it to be a lower bound. Source: [Golub and Van Loan 2013], 8.2, 8.4.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::iteration_matrix::storage_of;

/// Passes of (1) without a shift before the first one is tried.
const PASSES: usize = 3;
/// First shift below the quotient, as a part of it; each that is too high is followed by one this many times as far away.
const GAP: f64 = 0.02;
const FARTHER: f64 = 8.0;
/// Shifts that are tried.
const TRIES: usize = 3;
/// Passes of (1) with the shift, at most.
const MOST_PASSES: usize = 12;
/// A quotient that changes by less, as a part of it, has settled.
const SETTLED: f64 = 1e-14;
/// ε of (2) over ρ.
const PROVED: f64 = 1e-10;

/// Workspace of the iteration, with the shape of the last answer.
#[derive(Clone)]
pub(crate) struct LowestMode {
    x: DVector<f64>,
    y: DVector<f64>,
    Mx: DVector<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl LowestMode {
    /// For n coordinates.
    pub(crate) fn new(n: usize) -> Self {
        let mut mode = Self {
            x: DVector::zeros(n),
            y: DVector::zeros(n),
            Mx: DVector::zeros(n),
            factor: Cholesky::new(DMatrix::identity(n, n)),
        };
        mode.forget();
        mode
    }

    /// The next search begins as the first one did.
    pub(crate) fn forget(&mut self) {
        // No mode of an arm is orthogonal to this but by chance, and then (2) tells.
        self.x.iter_mut().enumerate().for_each(|(k, x)| *x = 1.0 + 0.1 * (k % 7) as f64);
    }

    /// Lowest eigenvalue of `S φ = λ M φ`; `None` where it is not found and proved at once.
    ///
    /// * `S`, `M`: n×n, symmetric; `factor` that of S.
    pub(crate) fn eigenvalue(
        &mut self,
        S: &DMatrix<f64>,
        factor: &Cholesky<f64, Dyn>,
        M: &DMatrix<f64>,
    ) -> Option<f64> {
        let mut rho = f64::INFINITY;
        for _ in 0..PASSES {
            rho = self.pass(0.0, factor, M)?;
        }
        // (1) with the highest shift that is proved.
        let mut gap = GAP;
        let mut shifted = None;
        for _ in 0..TRIES {
            shifted = self.shifted(S, M, rho * (1.0 - gap));
            if shifted.is_some() {
                break;
            }
            gap *= FARTHER;
        }
        let shifted = shifted?;
        let sigma = rho * (1.0 - gap);
        let mut settled = false;
        for _ in 0..MOST_PASSES {
            let before = rho;
            rho = self.pass(sigma, &shifted, M)?;
            settled = (rho - before).abs() <= SETTLED * rho;
            if settled {
                break;
            }
        }
        self.factor = Some(shifted);
        if !settled {
            return None;
        }
        // (2)
        self.factor = Some(self.shifted(S, M, rho * (1.0 - PROVED))?);
        Some(rho)
    }

    /// Factor of `S - σ M`, if that is positive definite.
    fn shifted(&mut self, S: &DMatrix<f64>, M: &DMatrix<f64>, sigma: f64) -> Option<Cholesky<f64, Dyn>> {
        let mut A = storage_of(&mut self.factor, S.nrows());
        for (a, (s, m)) in A.iter_mut().zip(S.iter().zip(M)) {
            *a = s - sigma * m;
        }
        Cholesky::new(A)
    }

    /// One pass of (1) with the factor of `S - σ M`; the quotient of the vector that it gives.
    fn pass(&mut self, sigma: f64, factor: &Cholesky<f64, Dyn>, M: &DMatrix<f64>) -> Option<f64> {
        let Self { x, y, Mx, .. } = self;
        Mx.gemv(1.0, M, x, 0.0);
        y.copy_from(Mx);
        factor.solve_mut(y);
        // yᵀ (S - σ M) y = yᵀ M x
        let stiffness = y.dot(Mx);
        Mx.gemv(1.0, M, y, 0.0);
        let mass = y.dot(Mx);
        let rho = sigma + stiffness / mass;
        let size = y.amax();
        if !(rho.is_finite() && rho > 0.0 && size > 0.0) {
            return None;
        }
        for (x, y) in x.iter_mut().zip(y.iter()) {
            *x = y / size;
        }
        Some(rho)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use proptest::prelude::*;

    /// Truth: nalgebra's eigenvalues of `L^-1 S L^-T`. Clusters included: the proof is within 1e-10. Where the two
    /// lowest are between 1e-10 and about 1e-3 apart the matrix is left to the full solver.
    #[test]
    fn the_lowest_eigenvalue_is_found_and_proved() {
        let (answered, all) = (Cell::new(0), Cell::new(0));
        proptest!(|(n in 1_usize..20, seed in proptest::collection::vec(-1.0_f64..1.0, 800), spread in 0.0_f64..4.0, tight in 0.0_f64..12.0)| {
            let random = |first: usize| DMatrix::from_fn(n, n, |i, j| seed[first + i * 20 + j]);
            let Q = random(0).qr().q();
            // The second lowest is as near to the lowest as can be.
            let lambda = |k: usize| match k {
                0 => 1.0,
                1 => 1.0 + 10f64.powf(-tight),
                k => 10f64.powf(spread * k as f64 / n as f64) * 2.0,
            };
            let B = random(400) + DMatrix::identity(n, n) * 3.0;
            // S = Bᵀ Q Λ Qᵀ B, M = Bᵀ B have the eigenvalues Λ.
            let M = B.transpose() * &B;
            let S = B.transpose() * &Q * DMatrix::from_fn(n, n, |i, j| if i == j { lambda(i) } else { 0.0 }) * Q.transpose() * &B;
            let S = 0.5 * (&S + S.transpose());
            let factor = Cholesky::new(S.clone()).unwrap();
            let mut mode = LowestMode::new(n);
            all.set(all.get() + 1);
            if let Some(found) = mode.eigenvalue(&S, &factor, &M) {
                answered.set(answered.get() + 1);
                prop_assert!((found - 1.0).abs() < 1.1e-10 + 1e-12, "{found}");
            }
        });
        let (answered, all) = (answered.get(), all.get());
        assert!(10 * answered > 2 * all, "{answered} of {all}");
    }

    /// A vector without a part along the lowest mode converges to another one: the proof does not let it pass.
    #[test]
    fn a_higher_mode_is_not_taken_for_the_lowest() {
        let (S, M) = (DMatrix::from_diagonal(&vec![1.0, 1.001, 5.0].into()), DMatrix::identity(3, 3));
        let factor = Cholesky::new(S.clone()).unwrap();
        let mut mode = LowestMode::new(3);
        mode.x.copy_from_slice(&[0.0, 1.0, 0.2]);
        assert_eq!(mode.eigenvalue(&S, &factor, &M), None);
        mode.forget();
        assert!((mode.eigenvalue(&S, &factor, &M).unwrap() - 1.0).abs() < 1e-12);
    }
}
