//! Matrices on a tree and their solution by elimination along it: O(n), compared with O(n²) for a
//! dense inverse and O(n³) to compute that inverse.
//!
//! A node has six coordinates `x_j` relative to its parent p; damping and stiffness have one block
//! per node:
//!
//! ```text
//! α_j = X_j α_p + x_j,   X_j = [X_t X_tr; 0 X_r]                                             (1)
//! M = Σ_j (∂α_j/∂x)ᵀ I_j (∂α_j/∂x)                                                            (2)
//! M^-1 f:   α_j = I_j^-1 (f_j - Σ_children X_cᵀ f_c),   x_j = α_j - X_j α_p                    (3)
//! ```
//! A matrix `M + Z`, with one block `Z_j` per node in Z, is solved as in the articulated-body
//! algorithm:
//!
//! ```text
//! inward    Î_j = I_j + Σ_children X_cᵀ I'_c X_c,   Δ_j = Î_j + Z_j,   I'_j = Z_j Δ_j^-1 Î_j  (4)
//!           w_j = Δ_j^-1 (r_j - Σ_children X_cᵀ f_c),   f_j = r_j - Z_j w_j                    (5)
//! outward   x_j = w_j - Δ_j^-1 Î_j X_j α_p                                                 (6)
//! ```
//!
//! **With a correction** by s, such as the dispersion correction of generalised-alpha,
//!
//! ```text
//! J = M + Z (1 + s M^-1 K)                                                                  (7)
//! ```
//! has no such form. But with `u = s M^-1 K x` as a second unknown it has, with two vectors per
//! node, and (4) to (6) apply unchanged:
//!
//! ```text
//! [ M + Z    Z ] [ x ]   [ r ]
//! [ -s K     M ] [ u ] = [ 0 ]        [ Z_j Z_j; -s K_j 0 ] for Z_j,   I and X in both rows   (8)
//! ```
//! and the step needs u as well. With some coordinates fixed the matrix keeps its form, with
//! determinant `det M det J > 0`, because
//! `(1 + s K M^-1) J = M + s K + (1 + s K M^-1) Z (1 + s M^-1 K)` is positive definite: no two by
//! two pivot vanishes, whatever the damping.
//!
//! Source of (4) to (6): [Featherstone 2008], Table 7.1. Not here: bodies and joints.

use std::array::from_fn;

use nalgebra::{DVector, Matrix3, Matrix6, Vector6};

use crate::error::StepError;

/// A node of a [`TreeMatrices`]: six coordinates.
#[derive(Clone, Debug)]
pub struct TreeNode {
    /// Index of the parent node, which precedes it; `None` on fixed ground.
    pub parent: Option<usize>,
    /// `I` of (2) in the module documentation, symmetric.
    pub inertia: Matrix6<f64>,
    /// `X_t`, `X_tr`, `X_r` of X in (1).
    pub carried: [Matrix3<f64>; 3],
    /// Block of `Z = c_D D + c_K K`, symmetric.
    pub Z: Matrix6<f64>,
    /// Block of the stiffness K of the springs about their relaxed positions, symmetric.
    pub K: Matrix6<f64>,
}

impl TreeNode {
    /// Creates a node without inertia, damping and stiffness, with the motion of its parent.
    pub fn new(parent: Option<usize>) -> Self {
        let zero = Matrix6::zeros();
        Self {
            parent,
            inertia: zero,
            carried: [Matrix3::identity(), Matrix3::zeros(), Matrix3::identity()],
            Z: zero,
            K: zero,
        }
    }
}

/// Matrices of a [`crate::SecondOrderSystem`] whose coordinates form a tree, six per node in the
/// order of the nodes.
#[derive(Clone, Debug, Default)]
pub struct TreeMatrices {
    /// Nodes, parents before children.
    pub nodes: Vec<TreeNode>,
}

/// F vectors of a node (x, or x and u), and maps between them.
type Vectors<const F: usize> = [Vector6<f64>; F];
type Matrices<const F: usize> = [[Matrix6<f64>; F]; F];
type Scalars<const F: usize> = [[f64; F]; F];

/// Computes `y += A x`.
#[inline]
fn add_product(A: &Matrix6<f64>, x: &Vector6<f64>, y: &mut Vector6<f64>) {
    let y = &mut y.data.0[0];
    for (column, x) in A.data.0.iter().zip(&x.data.0[0]) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += a * x;
        }
    }
}

/// Returns `A x`.
#[inline]
fn product(A: &Matrix6<f64>, x: &Vector6<f64>) -> Vector6<f64> {
    let mut y = Vector6::zeros();
    add_product(A, x, &mut y);
    y
}

/// Returns `A x`.
#[inline]
fn products<const F: usize>(A: &Matrices<F>, x: &Vectors<F>) -> Vectors<F> {
    let mut y = [[0.0; 6]; F];
    for column in 0..6 {
        for (y, row) in y.iter_mut().zip(A) {
            for (A, x) in row.iter().zip(x) {
                let a = x[column];
                for (y, A) in y.iter_mut().zip(&A.data.0[column]) {
                    *y += A * a;
                }
            }
        }
    }
    y.map(Vector6::from)
}

/// Returns column k of all blocks.
fn column<const F: usize>(A: &Matrices<F>, k: usize) -> [Vectors<F>; F] {
    from_fn(|i| from_fn(|j| A[i][j].column(k).into()))
}

/// Returns entry (i, j) of all blocks.
fn entry<const F: usize>(A: &Matrices<F>, i: usize, j: usize) -> Scalars<F> {
    from_fn(|row| from_fn(|column| A[row][column][(i, j)]))
}

/// Returns the inverse of a number or of a two by two matrix; `None` if its determinant is not
/// positive.
fn inverse<const F: usize>(a: &Scalars<F>) -> Option<Scalars<F>> {
    let last = F - 1;
    let determinant = if F == 1 { a[0][0] } else { a[0][0] * a[last][last] - a[0][last] * a[last][0] };
    let mut inverse = [[1.0 / determinant; F]; F];
    if F > 1 {
        inverse[0][0] = a[last][last] / determinant;
        inverse[last][last] = a[0][0] / determinant;
        inverse[0][last] = -a[0][last] / determinant;
        inverse[last][0] = -a[last][0] / determinant;
    }
    (determinant > 0.0 && determinant.is_finite()).then_some(inverse)
}

/// Returns `a b`.
fn scalar_product<const F: usize>(a: &Scalars<F>, b: &Scalars<F>) -> Scalars<F> {
    from_fn(|i| from_fn(|j| (0..F).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Returns `x a`.
fn scaled<const F: usize>(x: &[Vectors<F>; F], a: &Scalars<F>) -> [Vectors<F>; F] {
    from_fn(|i| from_fn(|j| (0..F).fold(Vector6::zeros(), |sum, k| sum + x[i][k] * a[k][j])))
}

/// Inverts a matrix in place by Gauss-Jordan elimination; returns false if a pivot is not positive.
fn invert<const F: usize>(A: &mut Matrices<F>) -> bool {
    for k in 0..6 {
        let Some(pivot) = inverse(&entry(A, k, k)) else { return false };
        // Column k without its pivot.
        let mut own = column(A, k);
        own.iter_mut().flatten().for_each(|part| part[k] = 0.0);
        for j in (0..6).filter(|j| *j != k) {
            // A_kj = A_kk^-1 A_kj,   A_j -= A_k A_kj
            let factor = scalar_product(&pivot, &entry(A, k, j));
            let taken = scaled(&own, &factor);
            for (row, column) in (0..F).flat_map(|row| (0..F).map(move |column| (row, column))) {
                let part = &mut A[row][column];
                part.column_mut(j).axpy(-1.0, &taken[row][column], 1.0);
                part[(k, j)] = factor[row][column];
            }
        }
        let own = scaled(&own, &pivot);
        for (row, column) in (0..F).flat_map(|row| (0..F).map(move |column| (row, column))) {
            let part = &mut A[row][column];
            part.set_column(k, &-own[row][column]);
            part[(k, k)] = pivot[row][column];
        }
    }
    true
}

impl TreeNode {
    /// Returns `X α`.
    #[inline]
    fn outward(&self, alpha: &Vector6<f64>) -> Vector6<f64> {
        let [X_t, X_tr, X_r] = &self.carried;
        let [x, y, z, u, v, w] = alpha.data.0[0];
        let mut moved = [0.0; 6];
        for i in 0..3 {
            let along = X_t[(i, 0)] * x + X_t[(i, 1)] * y + X_t[(i, 2)] * z;
            moved[i] = along + X_tr[(i, 0)] * u + X_tr[(i, 1)] * v + X_tr[(i, 2)] * w;
            moved[3 + i] = X_r[(i, 0)] * u + X_r[(i, 1)] * v + X_r[(i, 2)] * w;
        }
        Vector6::from(moved)
    }

    /// Returns `Xᵀ f`.
    #[inline]
    fn inward(&self, f: &Vector6<f64>) -> Vector6<f64> {
        let [X_t, X_tr, X_r] = &self.carried;
        let [x, y, z, u, v, w] = f.data.0[0];
        let mut carried = [0.0; 6];
        for i in 0..3 {
            carried[i] = X_t[(0, i)] * x + X_t[(1, i)] * y + X_t[(2, i)] * z;
            let lever = X_tr[(0, i)] * x + X_tr[(1, i)] * y + X_tr[(2, i)] * z;
            carried[3 + i] = lever + X_r[(0, i)] * u + X_r[(1, i)] * v + X_r[(2, i)] * w;
        }
        Vector6::from(carried)
    }

    /// Returns `Xᵀ I X`.
    fn inertia_inward(&self, I: &Matrix6<f64>) -> Matrix6<f64> {
        let half = Matrix6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| self.inward(&I.column(k).into()))).transpose();
        Matrix6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| self.inward(&half.column(k).into()))).transpose()
    }

    /// Returns the block `Z_j` of (4), or that of (8) with F = 2.
    fn springs<const F: usize>(&self, s: f64) -> Matrices<F> {
        let mut Z = [[self.Z; F]; F];
        if F > 1 {
            Z[F - 1] = [self.K * -s; F];
            Z[F - 1][F - 1] = Matrix6::zeros();
        }
        Z
    }

    /// Returns `Z_j x` with the block of [`Self::springs`].
    #[inline]
    fn stretched<const F: usize>(&self, s: f64, x: &Vectors<F>) -> Vectors<F> {
        if F == 1 {
            return [product(&self.Z, &x[0]); F];
        }
        let mut y = [product(&self.Z, &(x[0] + x[F - 1])); F];
        y[F - 1] = product(&self.K, &(x[0] * -s));
        y
    }
}

/// Checks that a vector has six entries per node.
#[track_caller]
fn check_vector(what: &str, found: usize, nodes: &[TreeNode]) {
    let expected = 6 * nodes.len();
    assert!(found == expected, "{what} has {found} entries, expected six for each of the {} nodes", nodes.len());
}

/// Elimination (4) of one node.
#[derive(Clone, Debug)]
struct Eliminated<const F: usize> {
    /// `Δ^-1`.
    inverse: Matrices<F>,
    /// `Δ^-1 Î`.
    solved: Matrices<F>,
    /// `Î`.
    inertia: Matrices<F>,
    /// During a solution the forces from the children, then `α`.
    carried: Vectors<F>,
    w: Vectors<F>,
}

/// Elimination of `M + Z`.
#[derive(Clone, Debug, Default)]
struct Elimination<const F: usize> {
    s: f64,
    nodes: Vec<Eliminated<F>>,
}

impl<const F: usize> Elimination<F> {
    /// Factorises by (4); returns false if a pivot is not positive.
    fn factor(&mut self, tree: &[TreeNode], s: f64) -> bool {
        self.s = s;
        let (zero, none) = ([[Matrix6::zeros(); F]; F], [Vector6::zeros(); F]);
        self.nodes
            .resize(tree.len(), Eliminated { inverse: zero, solved: zero, inertia: zero, carried: none, w: none });
        for (node, own) in self.nodes.iter_mut().zip(tree) {
            node.inertia = zero;
            (0..F).for_each(|i| node.inertia[i][i] = own.inertia);
        }
        for (j, own) in tree.iter().enumerate().rev() {
            let (inner, outer) = self.nodes.split_at_mut(j);
            let node = &mut outer[0];
            // Pivot Δ = Î + Z.
            node.inverse = node.inertia;
            for (to, Z) in node.inverse.iter_mut().flatten().zip(own.springs::<F>(s).iter().flatten()) {
                *to += Z;
            }
            if !invert(&mut node.inverse) {
                return false;
            }
            // Columns of Δ^-1 Î and of Z Δ^-1 Î, F vectors each.
            let mut passed = zero;
            for (c, k) in (0..F).flat_map(|c| (0..6).map(move |k| (c, k))) {
                let solved = products(&node.inverse, &from_fn(|i| node.inertia[i][c].column(k).into()));
                let stretched = own.stretched(s, &solved);
                for i in 0..F {
                    node.solved[i][c].set_column(k, &solved[i]);
                    passed[i][c].set_column(k, &stretched[i]);
                }
            }
            // Î of the parent takes Xᵀ Z Δ^-1 Î X.
            let Some(p) = own.parent else { continue };
            for (to, passed) in inner[p].inertia.iter_mut().flatten().zip(passed.iter().flatten()) {
                *to += own.inertia_inward(passed);
            }
        }
        true
    }

    /// Solves by (5) and (6) for `r` in the first rows; leaves the solution of node j in its `w`.
    fn solve(&mut self, tree: &[TreeNode], r: &[f64]) {
        let Self { s, nodes } = self;
        let none = [Vector6::zeros(); F];
        // Inward pass (5).
        nodes.iter_mut().for_each(|node| node.carried = none);
        for (j, own) in tree.iter().enumerate().rev() {
            let (inner, outer) = nodes.split_at_mut(j);
            let node = &mut outer[0];
            let mut f = none;
            f[0] = Vector6::from_column_slice(&r[6 * j..6 * j + 6]);
            node.w = products(&node.inverse, &from_fn(|i| f[i] - node.carried[i]));
            let Some(p) = own.parent else { continue };
            let stretched = own.stretched(*s, &node.w);
            for (i, to) in inner[p].carried.iter_mut().enumerate() {
                *to += own.inward(&(f[i] - stretched[i]));
            }
        }
        // Outward pass (6).
        for (j, own) in tree.iter().enumerate() {
            let (inner, outer) = nodes.split_at_mut(j);
            let node = &mut outer[0];
            let Some(p) = own.parent else {
                node.carried = node.w;
                continue;
            };
            let moved: Vectors<F> = from_fn(|i| own.outward(&inner[p].carried[i]));
            let solved = products(&node.solved, &moved);
            for i in 0..F {
                node.w[i] -= solved[i];
                node.carried[i] = moved[i] + node.w[i];
            }
        }
    }
}

/// `J^-1` on a tree for `J = M + Z`, or for (7); see the module documentation.
#[derive(Clone, Debug, Default)]
pub struct TreeInverse {
    /// The matrices to factorise.
    pub matrices: TreeMatrices,
    /// s of (7); `None` for `J = M + Z`.
    s: Option<f64>,
    plain: Elimination<1>,
    corrected: Elimination<2>,
    /// `I^-1`, for (3).
    inverse_inertia: Vec<Matrix6<f64>>,
    /// α of each node in (3).
    alpha: Vec<Vector6<f64>>,
    /// `s M^-1 K d` of the last solution d.
    shift: DVector<f64>,
}

impl TreeInverse {
    /// Factorises `matrices`: (7) with s, or `M + Z` without; `t`: time (s) for messages. O(n).
    ///
    /// # Errors
    /// [`StepError::Singular`] if an inertia or `J` is not positive definite.
    pub fn factor(&mut self, s: Option<f64>, t: f64) -> Result<(), StepError> {
        self.s = s;
        let positive = match s {
            None => self.plain.factor(&self.matrices.nodes, 0.0),
            Some(s) => {
                self.invert_inertias(t)?;
                self.corrected.factor(&self.matrices.nodes, s)
            }
        };
        if positive { Ok(()) } else { Err(StepError::Singular { matrix: "iteration matrix", t }) }
    }

    fn invert_inertias(&mut self, t: f64) -> Result<(), StepError> {
        let nodes = &self.matrices.nodes;
        self.inverse_inertia.resize(nodes.len(), Matrix6::zeros());
        self.alpha.resize(nodes.len(), Vector6::zeros());
        if self.shift.len() != 6 * nodes.len() {
            self.shift = DVector::zeros(6 * nodes.len());
        }
        for (inverse, node) in self.inverse_inertia.iter_mut().zip(nodes) {
            let mut inertia = [[node.inertia]];
            if !invert(&mut inertia) {
                return Err(StepError::Singular { matrix: "mass matrix", t });
            }
            *inverse = inertia[0][0];
        }
        Ok(())
    }

    /// Replaces `r` (6 per node) by `d = J^-1 r`; with s also computes [`TreeInverse::shift`].
    ///
    /// # Panics
    /// If `r` does not have six entries per node.
    pub fn solve(&mut self, r: &mut DVector<f64>) {
        let nodes = &self.matrices.nodes;
        check_vector("r", r.len(), nodes);
        if self.s.is_none() {
            self.plain.solve(nodes, r.as_slice());
            for (d, node) in r.as_mut_slice().chunks_exact_mut(6).zip(&self.plain.nodes) {
                d.copy_from_slice(node.w[0].as_slice());
            }
            return;
        }
        self.corrected.solve(nodes, r.as_slice());
        let to = r.as_mut_slice().chunks_exact_mut(6).zip(self.shift.as_mut_slice().chunks_exact_mut(6));
        for ((d, shift), node) in to.zip(&self.corrected.nodes) {
            d.copy_from_slice(node.w[0].as_slice());
            shift.copy_from_slice(node.w[1].as_slice());
        }
    }

    /// Returns `s M^-1 K d` of the last solution d.
    pub fn shift(&self) -> &DVector<f64> {
        &self.shift
    }

    /// Computes `y = x + s M^-1 K x`, by (3); x and y have six entries per node.
    ///
    /// # Panics
    /// If x or y has another length.
    pub fn correct(&mut self, x: &DVector<f64>, y: &mut DVector<f64>) {
        check_vector("x", x.len(), &self.matrices.nodes);
        check_vector("y", y.len(), &self.matrices.nodes);
        let Self { matrices, s, inverse_inertia, alpha, .. } = self;
        let s = s.unwrap_or(0.0);
        // Inward pass: accumulate the forces from the children.
        alpha.iter_mut().for_each(|alpha| *alpha = Vector6::zeros());
        for (j, node) in matrices.nodes.iter().enumerate().rev() {
            let f = product(&node.K, &Vector6::from_column_slice(&x.as_slice()[6 * j..6 * j + 6]));
            if let Some(p) = node.parent {
                let carried = node.inward(&f);
                alpha[p] += carried;
            }
            alpha[j] = product(&inverse_inertia[j], &(f - alpha[j]));
        }
        // Outward pass: x_j = α_j - X_j α_p.
        for (j, node) in matrices.nodes.iter().enumerate() {
            let moved = node.parent.map_or(Vector6::zeros(), |p| node.outward(&alpha[p]));
            for i in 0..6 {
                y[6 * j + i] = x[6 * j + i] + s * (alpha[j][i] - moved[i]);
            }
        }
    }
}
