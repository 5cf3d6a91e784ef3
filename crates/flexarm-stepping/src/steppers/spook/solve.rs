//! Elimination of the saddle-point matrix over a tree of bodies, leaves first: O(bodies).
//!
//! ```text
//! body c:   M_c v_c - G_cᵀ λ - (children) = b_c              joint of c:  G_p v_p + G_c v_c + Σ λ = s
//! M̂_c v_c = b̂_c + G_cᵀ λ                                       (children eliminated)
//! S λ = ŝ - G_p v_p,   S = Σ + G_c M̂_c^-1 G_cᵀ,   ŝ = s - G_c M̂_c^-1 b̂_c
//! M̂_p += G_pᵀ S^-1 G_p,   b̂_p += G_pᵀ S^-1 ŝ
//! ```
//! For a serial arm this is the block tridiagonal LDLᵀ in body order. M̂ and S are symmetric positive definite.

use nalgebra::{Cholesky, Const, Matrix6, Vector6};

type Factor = Cholesky<f64, Const<6>>;

/// Workspaces of the elimination.
pub(super) struct TreeSolver {
    parent: Vec<usize>,
    pub(super) M: Vec<Matrix6<f64>>,
    pub(super) b: Vec<Vector6<f64>>,
    body: Vec<Option<Factor>>,
    joint: Vec<Option<Factor>>,
    s: Vec<Vector6<f64>>,
}

impl TreeSolver {
    pub(super) fn new(parent: Vec<usize>) -> Self {
        let n = parent.len();
        Self {
            parent,
            M: vec![Matrix6::zeros(); n],
            b: vec![Vector6::zeros(); n],
            body: vec![None; n],
            joint: vec![None; n],
            s: vec![Vector6::zeros(); n],
        }
    }

    /// Solves for velocities and impulses; `M` and `b` hold the bodies' blocks and are used up.
    ///
    /// `joint(i)` gives `(G_p, G_c, Σ, s)` of the joint that carries body i. Returns the body whose block is not
    /// positive definite, if any.
    pub(super) fn solve<'r>(
        &mut self,
        joint: impl Fn(usize) -> (&'r Matrix6<f64>, &'r Matrix6<f64>, Matrix6<f64>, Vector6<f64>),
        v: &mut [Vector6<f64>],
        lambda: &mut [Vector6<f64>],
    ) -> Result<(), usize> {
        let n = self.parent.len();
        for i in (1..n).rev() {
            let (G_p, G_c, sigma, s) = joint(i);
            let body = Cholesky::new(self.M[i]).ok_or(i)?;
            let W = body.solve(&G_c.transpose());
            let S = sigma + G_c * W;
            let factor = Cholesky::new((S + S.transpose()) * 0.5).ok_or(i)?;
            let s = s - W.tr_mul(&self.b[i]);
            let p = self.parent[i];
            if p > 0 {
                let Z = factor.solve(G_p);
                self.M[p] += G_p.tr_mul(&Z);
                self.b[p] += Z.tr_mul(&s);
            }
            self.s[i] = s;
            self.body[i] = Some(body);
            self.joint[i] = Some(factor);
        }
        v[0] = Vector6::zeros();
        for i in 1..n {
            let (G_p, G_c, ..) = joint(i);
            let (Some(body), Some(factor)) = (&self.body[i], &self.joint[i]) else { return Err(i) };
            lambda[i] = factor.solve(&(self.s[i] - G_p * v[self.parent[i]]));
            v[i] = body.solve(&(self.b[i] + G_c.tr_mul(&lambda[i])));
        }
        Ok(())
    }
}
