//! The same body without one of its supports, projected onto the basis that the supported one has.

use nalgebra::DMatrix;

use super::Ritz;
use super::basis::{Basis, orthonormalising};
use crate::sparse::block::Block;

/// A support that is taken away.
#[derive(Debug, Clone, Copy)]
pub struct Released<'a> {
    /// Its static shapes T: displacement of every row for a unit of each of its coordinates; at most six.
    pub T: &'a Block,
    /// Compliance `C = (Tᵀ K T)⁻¹` of these coordinates.
    pub C: &'a DMatrix<f64>,
}

impl Basis {
    /// Ritz values without the support, largest θ first.
    ///
    /// ```text
    /// [V T]ᵀ M K_r⁻¹ M [V T] = | H + X C Xᵀ        Y + X C G   |      X = Vᵀ M T,   Y = Vᵀ M K⁻¹ M T
    ///                          | (Y + X C G)ᵀ      S + G C G   |      G = Tᵀ M T,   S = Tᵀ M K⁻¹ M T
    /// ```
    /// and T is made orthonormal to V and in itself: `T' = (T - V X) Q`.
    pub(super) fn released_ritz(&self, released: &Released<'_>) -> Option<Ritz> {
        let beside = self.beside.as_ref()?;
        let (X, G, C) = (&beside.X, &beside.G, released.C);
        let (n, w) = X.shape();
        let mut P = DMatrix::zeros(n + w, n + w);
        P.view_mut((0, 0), (n, n)).copy_from(&(&self.projected + X * C * X.transpose()));
        let mut P_VT = X * C * G;
        let mut first = P_VT.rows_mut(0, beside.Y_1.nrows());
        first += &beside.Y_1;
        P.view_mut((0, n), (n, w)).copy_from(&P_VT);
        P.view_mut((n, 0), (w, n)).copy_from(&P_VT.transpose());
        P.view_mut((n, n), (w, w)).copy_from(&(&beside.S + G * C * G));

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
