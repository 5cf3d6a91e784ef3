//! Modes with one support released, projected onto the basis computed with that support.

use nalgebra::DMatrix;

use super::Ritz;
use super::basis::{Basis, orthonormalising};
use crate::sparse::block::Block;

/// Released support.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Released<'a> {
    /// Static shapes T: displacement of every row per unit of each coordinate of the support; at
    /// most six.
    pub T: &'a Block,
    /// Compliance `C = (Tᵀ K T)⁻¹` of these coordinates.
    pub C: &'a DMatrix<f64>,
}

impl Basis {
    /// Ritz pairs without the support, largest θ first.
    ///
    /// ```text
    /// [V T]ᵀ M K_r⁻¹ M [V T] = [ H + X C Xᵀ     Y + X C G ]     X = Vᵀ M T,  Y = Vᵀ M K⁻¹ M T
    ///                          [ (Y + X C G)ᵀ   S + G C G ]     G = Tᵀ M T,  S = Tᵀ M K⁻¹ M T
    /// ```
    /// where T is made orthonormal to V and in itself: `T' = (T - V X) Q`.
    pub(super) fn released_ritz(&self, released: &Released<'_>) -> Option<Ritz> {
        let beside = self.beside.as_ref()?;
        let (X, G, C) = (&beside.X, &beside.G, released.C);
        let (n, w) = X.shape();
        // P = [V T]ᵀ M K_r⁻¹ M [V T]
        let mut P = DMatrix::zeros(n + w, n + w);
        P.view_mut((0, 0), (n, n)).copy_from(&(&self.projected + X * C * X.transpose()));
        let mut P_VT = X * C * G;
        let mut first = P_VT.rows_mut(0, beside.Y_1.nrows());
        first += &beside.Y_1;
        P.view_mut((0, n), (n, w)).copy_from(&P_VT);
        P.view_mut((n, 0), (w, n)).copy_from(&P_VT.transpose());
        P.view_mut((n, n), (w, w)).copy_from(&(&beside.S + G * C * G));

        // Columns of B: the orthonormal basis [V T'] in terms of [V T]; H = Bᵀ P B.
        let (Q, _) = orthonormalising(&(G - X.transpose() * X), 0.0);
        let extra = Q.ncols();
        let mut B = DMatrix::identity(n + w, n + extra);
        B.view_mut((0, n), (n, extra)).copy_from(&(-X * &Q));
        B.view_mut((n, n), (w, extra)).copy_from(&Q);
        let H = B.transpose() * P * &B;
        let (theta, vectors) = Ritz::of(&((&H + H.transpose()) * 0.5))?;
        let both = B * vectors;
        let vectors = both.rows(0, n).into_owned();
        let residuals = self.residuals(&theta, &vectors);
        Some(Ritz { theta, vectors, beside: both.rows(n, w).into_owned(), residuals })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::Released;
    use crate::sparse::{Block, Cholesky, ModesWanted, Ordering, Pencil, SparseSymmetric, modes_of_two_supports};

    /// Truth: a chain of n unit masses and springs from a wall, its last mass fixed or free: ω² = 4
    /// sin²(kπ/(2n)) and 4 sin²((2k - 1)π/(2(2n + 1))).
    #[test]
    fn a_chain_with_its_end_held_and_free_has_the_frequencies_of_the_closed_forms() {
        for (n, count) in [(300_usize, 12), (4, 20)] {
            let m = n - 1;
            let mut triplets: Vec<_> = (0..m as u32).map(|i| (i, i, 2.0)).collect();
            triplets.extend((1..m as u32).map(|i| (i, i - 1, -1.0)));
            let K = SparseSymmetric::from_triplets(m, &triplets);
            let factor = Cholesky::new(&K, Ordering::MinimumDegree).unwrap();
            let solve = &mut |F: &mut Block| {
                let mut inner = Block { rows: F.rows[..m].to_vec(), width: F.width };
                factor.solve_block(&mut inner);
                *F = Block::zeros(n, F.width);
                F.rows[..m].copy_from_slice(&inner.rows);
            };
            let mass = &mut |X: &Block, Y: &mut Block| Y.clone_from(X);
            // A unit displacement of the last mass stretches the chain uniformly; its stiffness is
            // that of n springs in series.
            let T = DMatrix::from_fn(n, 1, |i, _| (i + 1) as f64 / n as f64);
            let released = Released { T: &Block::of_columns(&T, 0, 1), C: &DMatrix::from_element(1, 1, n as f64) };
            let mut pencil = Pencil { rows: n, dimension: m, solve, mass };
            let (held, free) = modes_of_two_supports(&mut pencil, ModesWanted::Count(count), &released, count).unwrap();
            assert_eq!((held.len(), free.len()), (count.min(m), count.min(n)));
            let half_angle = |x: f64| 4.0 * (x * std::f64::consts::PI / 2.0).sin().powi(2);
            for (k, found) in (1..).zip(&held.omega2) {
                let truth = half_angle(f64::from(k) / n as f64);
                assert!((found / truth - 1.0).abs() < 1e-11, "{found} {truth}"); // measured 6e-14
            }
            for (k, found) in (1..).zip(&free.omega2) {
                let truth = half_angle(f64::from(2 * k - 1) / (2 * n + 1) as f64);
                assert!((found / truth - 1.0).abs() < 1e-11, "{found} {truth}"); // measured 6e-14
            }
        }
    }
}
