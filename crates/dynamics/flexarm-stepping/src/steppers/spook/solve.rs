//! Elimination of the saddle-point matrix over a tree of bodies, from the leaves: O(bodies).
//!
//! ```text
//! body c:       M_c v_c - G_cᵀ λ - (children) = b_c
//! joint of c:   G_p v_p + G_c v_c + Σ λ = s                                     (1)
//! M̂_c v_c = b̂_c + G_cᵀ λ                                       (children eliminated)
//! Q λ = ŝ - G_p v_p,   Q = Σ + G_c M̂_c^-1 G_cᵀ,   ŝ = s - G_c M̂_c^-1 b̂_c        (2)
//! M̂_p += G_pᵀ Q^-1 G_p,   b̂_p += G_pᵀ Q^-1 ŝ                                    (3)
//! ```
//! Each `v` is the twist of a body at its centre of mass, `b` a momentum about it, both in world
//! axes, linear part first; `λ`, `s` and `Σ` are in the six rows of a joint.
//!
//! For a serial arm this is the block tridiagonal LDLᵀ in body order. M̂ and Q are symmetric
//! positive definite. `G_c` is square and block triangular with a known inverse, so that neither M̂
//! nor Q is factorised; in the coordinates of the rows
//!
//! ```text
//! M̃ = G_c^-T M̂_c G_c^-1,   b̃ = G_c^-T b̂_c,   H = M̃ + Σ^-1
//! Q^-1 = Σ^-1 H^-1 M̃,   Q^-1 ŝ = Σ^-1 H^-1 (M̃ s - b̃),   v_c = G_c^-1 (s - Σ λ - G_p v_p)     (4)
//! ```
//! which holds for hard joints (Σ almost zero) and soft ones alike. If Σ is hard in some directions
//! and soft in others, `Q = Σ + M̃^-1` is inverted directly. A joint that is free along a line σ of
//! its rows (a dependent joint of a closed loop) has a rate ε and no force along it: with
//! `a = Q_0^-1 σ` of the same joint without the free line
//!
//! ```text
//! Q^-1 = Q_0^-1 - a aᵀ / σᵀa,   σᵀλ = 0,   ε = (σᵀ Q_0^-1 ŝ - aᵀ G_p v_p) / σᵀa
//! v_c = G_c^-1 (s - Σ λ - G_p v_p - σ ε)                                             (5)
//! ```

use flexarm_spatial::products::{cross3, mul, mul3, tr_mul, tr_mul3, turn_symmetric};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::constraint::Rows;

/// `[[vv, vw], [vwᵀ, ww]]`, symmetric: blocks of linear (v) and angular (w) rows and columns.
#[derive(Clone, Copy, Debug)]
pub struct Symmetric {
    /// Linear block.
    pub vv: Matrix3<f64>,
    /// Linear rows, angular columns.
    pub vw: Matrix3<f64>,
    /// Angular block.
    pub ww: Matrix3<f64>,
}

/// `[[tv, tw], [0, rw]]`.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// From linear to linear.
    pub tv: Matrix3<f64>,
    /// From angular to linear.
    pub tw: Matrix3<f64>,
    /// From angular to angular.
    pub rw: Matrix3<f64>,
}

#[inline]
fn halves(v: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]))
}

/// Six-vector of a linear and an angular part in the same axes.
#[inline]
pub(super) fn joined(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Returns a symmetric matrix from its lower triangle; the upper triangle is not read.
#[inline]
fn mirrored(X: &Matrix3<f64>) -> Matrix3<f64> {
    let (xy, xz, yz) = (X[(1, 0)], X[(2, 0)], X[(2, 1)]);
    Matrix3::new(X[(0, 0)], xy, xz, xy, X[(1, 1)], yz, xz, yz, X[(2, 2)])
}

/// Returns the inverse of a symmetric matrix by cofactors; `None` if the determinant is not
/// positive.
#[inline]
fn inverse(X: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let (a, b, c): (Vector3<f64>, Vector3<f64>, Vector3<f64>) =
        (X.column(0).into(), X.column(1).into(), X.column(2).into());
    let (r0, r1, r2) = (b.cross(&c), c.cross(&a), a.cross(&b));
    let determinant = a.dot(&r0);
    let s = 1.0 / determinant;
    let inverse = Matrix3::from_columns(&[r0 * s, r1 * s, r2 * s]).transpose();
    (determinant > 0.0 && determinant.is_finite()).then_some(mirrored(&inverse))
}

impl Symmetric {
    pub(super) fn zeros() -> Self {
        Self { vv: Matrix3::zeros(), vw: Matrix3::zeros(), ww: Matrix3::zeros() }
    }

    /// Creates the blocks of a symmetric matrix, linear rows first, in its axes.
    pub fn new(X: &Matrix6<f64>) -> Self {
        let block = |i, j| X.fixed_view::<3, 3>(i, j).into_owned();
        Self { vv: block(0, 0), vw: block(0, 3), ww: block(3, 3) }
    }

    pub(super) fn scaled(&self, s: f64) -> Self {
        Self { vv: self.vv * s, vw: self.vw * s, ww: self.ww * s }
    }

    /// Returns `blkdiag(R, R) X blkdiag(R, R)ᵀ`: the matrix in the axes into which R turns.
    pub(super) fn turned(&self, R: &Matrix3<f64>) -> Self {
        let vw = mul3(&mul3(R, &self.vw), &R.transpose());
        Self { vv: turn_symmetric(R, &self.vv), vw, ww: turn_symmetric(R, &self.ww) }
    }

    #[inline]
    fn plus(&self, o: &Self) -> Self {
        Self { vv: self.vv + o.vv, vw: self.vw + o.vw, ww: self.ww + o.ww }
    }

    #[inline]
    fn times(&self, v: &Vector6<f64>) -> Vector6<f64> {
        let (a, b) = halves(v);
        joined(&(mul(&self.vv, &a) + mul(&self.vw, &b)), &(tr_mul(&self.vw, &a) + mul(&self.ww, &b)))
    }

    /// Returns `X Y`, which must be symmetric.
    #[inline]
    fn commuting_product(&self, Y: &Self) -> Self {
        let Bt = Y.vw.transpose();
        let vv = mul3(&self.vv, &Y.vv) + mul3(&self.vw, &Bt);
        let vw = mul3(&self.vv, &Y.vw) + mul3(&self.vw, &Y.ww);
        let ww = tr_mul3(&self.vw, &Y.vw) + mul3(&self.ww, &Y.ww);
        Self { vv: mirrored(&vv), vw, ww: mirrored(&ww) }
    }

    /// Returns `X Y Z`, which must be symmetric.
    #[inline]
    fn symmetric_product(&self, Y: &Self, Z: &Self) -> Self {
        // Columns of Y Z.
        let Bt = Z.vw.transpose();
        let (tt, tr) = (mul3(&Y.vv, &Z.vv) + mul3(&Y.vw, &Bt), mul3(&Y.vv, &Z.vw) + mul3(&Y.vw, &Z.ww));
        let (rt, rr) = (tr_mul3(&Y.vw, &Z.vv) + mul3(&Y.ww, &Bt), tr_mul3(&Y.vw, &Z.vw) + mul3(&Y.ww, &Z.ww));
        let vv = mul3(&self.vv, &tt) + mul3(&self.vw, &rt);
        let vw = mul3(&self.vv, &tr) + mul3(&self.vw, &rr);
        let ww = tr_mul3(&self.vw, &tr) + mul3(&self.ww, &rr);
        Self { vv: mirrored(&vv), vw, ww: mirrored(&ww) }
    }

    /// Inverts by elimination of `vv`; `None` if not positive definite.
    #[inline]
    fn inverse(&self) -> Option<Self> {
        // H = vv^-1 vw, complement ww - vwᵀ H.
        let vv = inverse(&self.vv)?;
        let H = mul3(&vv, &self.vw);
        let ww = inverse(&mirrored(&(self.ww - tr_mul3(&self.vw, &H))))?;
        let vw = -mul3(&H, &ww);
        Some(Self { vv: mirrored(&(vv - mul3(&vw, &H.transpose()))), vw, ww: mirrored(&ww) })
    }
}

impl Triangle {
    #[inline]
    fn times(&self, v: &Vector6<f64>) -> Vector6<f64> {
        let (a, b) = halves(v);
        joined(&(mul(&self.tv, &a) + mul(&self.tw, &b)), &mul(&self.rw, &b))
    }

    #[inline]
    fn tr_times(&self, f: &Vector6<f64>) -> Vector6<f64> {
        let (a, b) = halves(f);
        joined(&tr_mul(&self.tv, &a), &(tr_mul(&self.tw, &a) + tr_mul(&self.rw, &b)))
    }

    /// Returns `Gᵀ X G`.
    #[inline]
    fn congruent(&self, X: &Symmetric) -> Symmetric {
        let Self { tv, tw, rw } = self;
        let (t, r) = (mul3(&X.vv, tw) + mul3(&X.vw, rw), tr_mul3(&X.vw, tw) + mul3(&X.ww, rw));
        let ww = tr_mul3(tw, &t) + tr_mul3(rw, &r);
        Symmetric { vv: mirrored(&tr_mul3(tv, &mul3(&X.vv, tv))), vw: tr_mul3(tv, &t), ww: mirrored(&ww) }
    }
}

/// Returns `Gᵀ X G` for `G = [[1, [r]x], [0, 1]]`.
#[inline]
fn shifted(X: &Symmetric, r: &Vector3<f64>) -> Symmetric {
    // vv [r]x = -([r]x vv)ᵀ for a symmetric block.
    let vw = X.vw - cross3(r, &X.vv).transpose();
    Symmetric { vv: X.vv, vw, ww: mirrored(&(X.ww - cross3(r, &vw) - cross3(r, &X.vw).transpose())) }
}

/// `G_p` and `G_c` of a joint, and the inverse of `G_c`.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::large_enum_variant, reason = "a box per joint would be in the way of every step")]
pub enum Jacobian {
    /// `[[-1, [parent]x], [0, -1]]` and `[[1, -[child]x], [0, 1]]`: rows in world axes.
    Levers {
        /// Lever on the parent.
        parent: Vector3<f64>,
        /// Lever on the child.
        child: Vector3<f64>,
    },
    /// General block triangles.
    Turned {
        /// `G_p`.
        parent: Triangle,
        /// `G_c`.
        child: Triangle,
        /// `G_c^-1`.
        back: Triangle,
    },
}

impl Jacobian {
    /// Returns `G_p v` for the twist of the parent in world axes (m/s, rad/s).
    #[inline]
    pub fn of_parent(&self, v: &Vector6<f64>) -> Vector6<f64> {
        match self {
            Self::Levers { parent, .. } => {
                let (v, w) = halves(v);
                joined(&(parent.cross(&w) - v), &-w)
            }
            Self::Turned { parent, .. } => parent.times(v),
        }
    }

    /// Returns `G_c v` for the twist of the child in world axes.
    #[inline]
    pub fn of_child(&self, v: &Vector6<f64>) -> Vector6<f64> {
        match self {
            Self::Levers { child, .. } => {
                let (v, w) = halves(v);
                joined(&(v - child.cross(&w)), &w)
            }
            Self::Turned { child, .. } => child.times(v),
        }
    }

    /// Returns `G_c^-1 u`.
    #[inline]
    fn back(&self, u: &Vector6<f64>) -> Vector6<f64> {
        match self {
            Self::Levers { child, .. } => {
                let (v, w) = halves(u);
                joined(&(v + child.cross(&w)), &w)
            }
            Self::Turned { back, .. } => back.times(u),
        }
    }

    /// Returns `G_c^-T M G_c^-1` and `G_c^-T b`.
    #[inline]
    fn in_rows(&self, M: &Symmetric, b: &Vector6<f64>) -> (Symmetric, Vector6<f64>) {
        match self {
            Self::Levers { child, .. } => {
                let (f, t) = halves(b);
                (shifted(M, child), joined(&f, &(t - child.cross(&f))))
            }
            Self::Turned { back, .. } => (back.congruent(M), back.tr_times(b)),
        }
    }

    /// Returns `G_pᵀ A G_p` and `G_pᵀ y`.
    #[inline]
    fn on_parent(&self, A: &Symmetric, y: &Vector6<f64>) -> (Symmetric, Vector6<f64>) {
        match self {
            Self::Levers { parent, .. } => {
                let (f, t) = halves(y);
                (shifted(A, &-parent), joined(&-f, &(-t - parent.cross(&f))))
            }
            Self::Turned { parent, .. } => (parent.congruent(A), parent.tr_times(y)),
        }
    }
}

/// Σ of a joint.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::large_enum_variant, reason = "a box per joint would be in the way of every step")]
pub enum Sigma {
    /// Multiple of the identity.
    Hard(f64),
    /// Σ and its inverse.
    Soft(Symmetric, Symmetric),
    /// Σ only.
    Mixed(Symmetric),
    /// Multiple of the identity, except along the line S of the rows, the motion subspace of the
    /// joint, which is free.
    Free(f64),
}

impl Sigma {
    #[inline]
    fn times(&self, v: &Vector6<f64>) -> Vector6<f64> {
        match self {
            Self::Hard(sigma) | Self::Free(sigma) => v * *sigma,
            Self::Soft(sigma, _) | Self::Mixed(sigma) => sigma.times(v),
        }
    }

    /// Returns `Q^-1` and `Q^-1 ŝ` by (4).
    #[inline]
    fn eliminate(&self, M: &Symmetric, b: &Vector6<f64>, s: &Vector6<f64>) -> Option<(Symmetric, Vector6<f64>)> {
        let push = M.times(s) - b;
        Some(match self {
            Self::Hard(sigma) | Self::Free(sigma) => {
                // Σ^-1 H^-1 = (1 + σ M̃)^-1, which commutes with M̃.
                let mut E = M.scaled(*sigma);
                E.vv += Matrix3::identity();
                E.ww += Matrix3::identity();
                let E = E.inverse()?;
                (E.commuting_product(M), E.times(&push))
            }
            Self::Soft(_, K) => {
                let H = M.plus(K).inverse()?;
                (K.symmetric_product(&H, M), K.times(&H.times(&push)))
            }
            Self::Mixed(sigma) => {
                let M_inverse = M.inverse()?;
                let Q_inverse = sigma.plus(&M_inverse).inverse()?;
                let y = Q_inverse.times(&(s - M_inverse.times(b)));
                (Q_inverse, y)
            }
        })
    }
}

/// A joint with everything outward of it eliminated: `Q^-1` and `Q^-1 ŝ`.
#[derive(Clone, Copy, Debug)]
struct EliminatedJoint {
    Q_inverse: Symmetric,
    y: Vector6<f64>,
    /// For a joint with a free line: `a / σᵀa`, and the part of ε that is independent of the
    /// parent.
    free: Option<(Vector6<f64>, f64)>,
}

impl EliminatedJoint {
    /// Frees the line σ by (5).
    fn freed(self, line: &Vector6<f64>) -> Option<Self> {
        let Self { Q_inverse, y, .. } = self;
        let a = Q_inverse.times(line);
        let inertia = line.dot(&a);
        if !(inertia > 0.0 && inertia.is_finite()) {
            return None;
        }
        let (a, own) = (a / inertia, line.dot(&y) / inertia);
        let (f, t) = halves(&(a * inertia.sqrt()));
        let outer = Symmetric { vv: f * f.transpose(), vw: f * t.transpose(), ww: t * t.transpose() };
        let Q_inverse = Q_inverse.plus(&outer.scaled(-1.0));
        Some(Self { Q_inverse, y: y - a * (own * inertia), free: Some((a, own)) })
    }
}

/// Workspaces of the elimination.
#[derive(Clone)]
pub struct TreeSolver {
    parent: Vec<usize>,
    /// Matrices of the bodies.
    pub M: Vec<Symmetric>,
    /// Right-hand sides b of the bodies.
    pub b: Vec<Vector6<f64>>,
    /// Right-hand sides s of the joints.
    pub s: Vec<Vector6<f64>>,
    joints: Vec<EliminatedJoint>,
}

impl TreeSolver {
    /// Allocates storage for a tree of bodies, parents before children; body 0 is the world.
    pub fn new(parent: Vec<usize>) -> Self {
        let (n, zero) = (parent.len(), Vector6::zeros());
        let joints = vec![EliminatedJoint { Q_inverse: Symmetric::zeros(), y: zero, free: None }; n];
        Self { parent, M: vec![Symmetric::zeros(); n], b: vec![zero; n], s: vec![zero; n], joints }
    }

    /// Solves for velocities and impulses; `M`, `b` and `s` are the blocks of bodies and joints.
    /// `M` and `b` are overwritten.
    ///
    /// * `rows`, `sigma`: of the joint that carries each body.
    ///
    /// Returns the body whose block is not positive definite, if any.
    pub fn solve(
        &mut self,
        rows: &[Rows],
        sigma: &[Sigma],
        v: &mut [Vector6<f64>],
        lambda: &mut [Vector6<f64>],
    ) -> Result<(), usize> {
        let n = self.parent.len();
        // Inward pass: eliminate body and joint, (3) to (5).
        for i in (1..n).rev() {
            let (M, b) = rows[i].G.in_rows(&self.M[i], &self.b[i]);
            let (Q_inverse, y) = sigma[i].eliminate(&M, &b, &self.s[i]).ok_or(i)?;
            let mut joint = EliminatedJoint { Q_inverse, y, free: None };
            if let Sigma::Free(_) = sigma[i] {
                joint = joint.freed(&rows[i].S).ok_or(i)?;
            }
            let EliminatedJoint { Q_inverse, y, .. } = joint;
            let p = self.parent[i];
            if p > 0 {
                let (M, b) = rows[i].G.on_parent(&Q_inverse, &y);
                self.M[p] = self.M[p].plus(&M);
                self.b[p] += b;
            }
            self.joints[i] = joint;
        }
        // Outward pass: impulses and velocities.
        v[0] = Vector6::zeros();
        for i in 1..n {
            let EliminatedJoint { Q_inverse, y, free } = &self.joints[i];
            let moved = rows[i].G.of_parent(&v[self.parent[i]]);
            lambda[i] = y - Q_inverse.times(&moved);
            let mut u = self.s[i] - sigma[i].times(&lambda[i]) - moved;
            if let Some((a, own)) = free {
                u -= rows[i].S * (own - a.dot(&moved));
            }
            v[i] = rows[i].G.back(&u);
        }
        Ok(())
    }
}
