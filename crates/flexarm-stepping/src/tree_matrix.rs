//! Matrices that sit on a tree, and their solutions by elimination along it: O(n), instead of O(n²) with a dense inverse and
//! O(n³) to make that.
//!
//! A node has six coordinates `x_j` and moves with its parent p; damping and stiffness have a block per node:
//!
//! ```text
//! α_j = X_j α_p + x_j,   X_j = [A B; 0 C]                                                     (1)
//! M = Σ_j (∂α_j/∂x)ᵀ I_j (∂α_j/∂x)                                                            (2)
//! M^-1 f:   α_j = I_j^-1 (f_j - Σ_children X_cᵀ f_c),   x_j = α_j - X_j α_p                    (3)
//! ```
//! `M + S`, S a block `S_j` per node, is solved as articulated bodies are:
//!
//! ```text
//! inward    Î_j = I_j + Σ_children X_cᵀ I'_c X_c,   Δ_j = Î_j + S_j,   I'_j = S_j Δ_j^-1 Î_j       (4)
//!           w_j = Δ_j^-1 (r_j - Σ_children X_cᵀ f_c),   f_j = r_j - S_j w_j                        (5)
//! outward   x_j = w_j - Δ_j^-1 Î_j X_j α_p                                                      (6)
//! ```
//!
//! **With `κ K (1 + s M^-1 K)` instead of S** (the dispersion correction of generalised-alpha, damping in proportion to stiffness)
//!
//! ```text
//! J = M + κ K (1 + s M^-1 K) = (M + a K) M^-1 (M + b K),   a + b = κ,   a b = κ s                 (7)
//! ```
//! is in general no such matrix, and a, b are real, equal or complex. They are ν times the roots of `β² = τ β - 1` with `ν² = κ s`,
//! `τ = κ/ν`. So J is eliminated once in numbers `p + q β` (complex ones are those of τ = 0): from (4) to (6) with `S = ν β K`,
//!
//! ```text
//! y = p + q β = (M + ν β K)^-1 r,   J^-1 r = p + τ q,   s M^-1 K J^-1 r = -(s/ν) q                 (8)
//! ```
//! (8) are the partial fractions `(a y_a - b y_b)/(a - b)` and `s (y_b - y_a)/(a - b)`, without their division. M and K are
//! positive definite, so that no pivot vanishes.
//!
//! Source of (4) to (6): [Featherstone 2008], Table 7.1. Not here: bodies and joints.

use std::array::from_fn;

use nalgebra::{DVector, Matrix3, Matrix6, Vector6};

use crate::error::StepError;

/// A node of a [`TreeMatrices`]: six coordinates.
#[derive(Clone, Debug)]
pub struct TreeNode {
    /// Number of the node that it moves with, which comes before it; none if it stands on fixed ground.
    pub parent: Option<usize>,
    /// `I`, symmetric, in (2) of the module page.
    pub inertia: Matrix6<f64>,
    /// `A`, `B`, `C` of X in (1).
    pub carried: [Matrix3<f64>; 3],
    /// Block of `c_D D + c_K K`, symmetric.
    pub C: Matrix6<f64>,
    /// Block of K, of the springs about their relaxed places, symmetric.
    pub K: Matrix6<f64>,
}

impl TreeNode {
    /// On fixed ground, without inertia, damping and stiffness.
    pub fn new(parent: Option<usize>) -> Self {
        let zero = Matrix6::zeros();
        Self {
            parent,
            inertia: zero,
            carried: [Matrix3::identity(), Matrix3::zeros(), Matrix3::identity()],
            C: zero,
            K: zero,
        }
    }
}

/// The matrices of a [`crate::SecondOrderSystem`] whose coordinates sit on a tree, six and six in the order of its nodes.
#[derive(Clone, Debug, Default)]
pub struct TreeMatrices {
    /// Parents before children.
    pub nodes: Vec<TreeNode>,
    /// κ, where `c_D D + c_K K = κ K` on all nodes.
    pub ratio: Option<f64>,
}

/// A vector of a node, and a matrix, of F = 1 real numbers or F = 2 parts of numbers `p + q β`.
type Vectors<const F: usize> = [Vector6<f64>; F];
type Matrices<const F: usize> = [Matrix6<f64>; F];

/// `y += A x`.
#[inline(always)]
fn add_product(A: &Matrix6<f64>, x: &Vector6<f64>, y: &mut Vector6<f64>) {
    let y = &mut y.data.0[0];
    for (column, x) in A.data.0.iter().zip(&x.data.0[0]) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += a * x;
        }
    }
}

/// `A x`.
#[inline(always)]
fn product(A: &Matrix6<f64>, x: &Vector6<f64>) -> Vector6<f64> {
    let mut y = Vector6::zeros();
    add_product(A, x, &mut y);
    y
}

/// Numbers `p + q β`, of which F = 1 has p alone.
#[derive(Clone, Copy, Debug, Default)]
struct Numbers<const F: usize> {
    /// `β² = τ β - 1`.
    tau: f64,
}

impl<const F: usize> Numbers<F> {
    /// `1/a`; none where there is no positive number of that kind.
    fn inverse(self, a: [f64; F]) -> Option<[f64; F]> {
        let mut inverse = [1.0 / a[0]; F];
        let mut norm = a[0];
        if F == 2 {
            let [p, q] = [a[0], a[F - 1]];
            norm = p * p + self.tau * p * q + q * q;
            inverse = [(p + self.tau * q) / norm; F];
            inverse[F - 1] = -q / norm;
        }
        (norm > 0.0 && norm.is_finite()).then_some(inverse)
    }

    /// `y += A x`.
    #[inline(always)]
    fn add_product(self, A: &Matrices<F>, x: &Vectors<F>, y: &mut Vectors<F>) {
        if F == 1 {
            return add_product(&A[0], &x[0], &mut y[0]);
        }
        let (mut p, mut q) = (y[0].data.0[0], y[F - 1].data.0[0]);
        let columns = A[0].data.0.iter().zip(&A[F - 1].data.0);
        for ((P, Q), (a, b)) in columns.zip(x[0].data.0[0].iter().zip(&x[F - 1].data.0[0])) {
            let c = a + self.tau * b;
            for i in 0..6 {
                p[i] += P[i] * a - Q[i] * b;
                q[i] += P[i] * b + Q[i] * c;
            }
        }
        (y[0].data.0[0], y[F - 1].data.0[0]) = (p, q);
    }

    #[inline(always)]
    fn product(self, A: &Matrices<F>, x: &Vectors<F>) -> Vectors<F> {
        let mut y = [Vector6::zeros(); F];
        self.add_product(A, x, &mut y);
        y
    }

    /// `ν β x`; with F = 1, x.
    #[inline(always)]
    fn times_unit(self, nu: f64, x: &Vectors<F>) -> Vectors<F> {
        let mut y = *x;
        if F == 2 {
            y[0] = x[F - 1] * -nu;
            y[F - 1] = (x[0] + x[F - 1] * self.tau) * nu;
        }
        y
    }

    /// Puts the inverse of a symmetric matrix in its place, by Gauss and Jordan; false where a pivot is not positive.
    fn invert(self, A: &mut Matrices<F>) -> bool {
        for k in 0..6 {
            let Some(inverse) = self.inverse(from_fn(|part| A[part][(k, k)])) else { return false };
            // Column k with its pivot taken out.
            let mut own: Vectors<F> = from_fn(|part| A[part].column(k).into());
            own.iter_mut().for_each(|part| part[k] = 0.0);
            for j in (0..6).filter(|j| *j != k) {
                // A_j -= A_k A_kj/A_kk,   A_kj = A_kj/A_kk
                let factor = self.scalar(from_fn(|part| A[part][(k, j)]), inverse);
                let column = self.scaled(&own, factor);
                for ((part, column), factor) in A.iter_mut().zip(&column).zip(factor) {
                    part.column_mut(j).axpy(-1.0, column, 1.0);
                    part[(k, j)] = factor;
                }
            }
            let column = self.scaled(&own, inverse);
            for ((part, column), inverse) in A.iter_mut().zip(&column).zip(inverse) {
                part.set_column(k, &-column);
                part[(k, k)] = inverse;
            }
        }
        true
    }

    fn scalar(self, a: [f64; F], b: [f64; F]) -> [f64; F] {
        let mut y = [a[0] * b[0]; F];
        if F == 2 {
            y[0] -= a[F - 1] * b[F - 1];
            y[F - 1] = a[0] * b[F - 1] + a[F - 1] * (b[0] + self.tau * b[F - 1]);
        }
        y
    }

    fn scaled(self, x: &Vectors<F>, a: [f64; F]) -> Vectors<F> {
        let mut y = x.map(|x| x * a[0]);
        if F == 2 {
            y[0] -= x[F - 1] * a[F - 1];
            y[F - 1] = x[0] * a[F - 1] + x[F - 1] * (a[0] + self.tau * a[F - 1]);
        }
        y
    }
}

impl TreeNode {
    /// `X α`.
    #[inline(always)]
    fn outward(&self, alpha: &Vector6<f64>) -> Vector6<f64> {
        let [A, B, C] = &self.carried;
        let [x, y, z, u, v, w] = alpha.data.0[0];
        let mut moved = [0.0; 6];
        for i in 0..3 {
            moved[i] = A[(i, 0)] * x + A[(i, 1)] * y + A[(i, 2)] * z + B[(i, 0)] * u + B[(i, 1)] * v + B[(i, 2)] * w;
            moved[3 + i] = C[(i, 0)] * u + C[(i, 1)] * v + C[(i, 2)] * w;
        }
        Vector6::from(moved)
    }

    /// `Xᵀ f`.
    #[inline(always)]
    fn inward(&self, f: &Vector6<f64>) -> Vector6<f64> {
        let [A, B, C] = &self.carried;
        let [x, y, z, u, v, w] = f.data.0[0];
        let mut carried = [0.0; 6];
        for i in 0..3 {
            carried[i] = A[(0, i)] * x + A[(1, i)] * y + A[(2, i)] * z;
            carried[3 + i] =
                B[(0, i)] * x + B[(1, i)] * y + B[(2, i)] * z + C[(0, i)] * u + C[(1, i)] * v + C[(2, i)] * w;
        }
        Vector6::from(carried)
    }

    /// `Xᵀ I X` for a symmetric I.
    fn inertia_inward(&self, I: &Matrix6<f64>) -> Matrix6<f64> {
        let half = Matrix6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| self.inward(&I.column(k).into()))).transpose();
        let whole = Matrix6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| self.inward(&half.column(k).into())));
        (whole + whole.transpose()) * 0.5
    }
}

/// (4) of one node.
#[derive(Clone, Debug)]
struct Eliminated<const F: usize> {
    /// `Δ^-1`.
    inverse: Matrices<F>,
    /// `Δ^-1 Î`.
    held: Matrices<F>,
    /// Î before; in a solution what the children put on the node, then `α`.
    inertia: Matrices<F>,
    carried: Vectors<F>,
    w: Vectors<F>,
}

/// Elimination of `M + S`, or with F = 2 of `M + ν β K`.
#[derive(Clone, Debug, Default)]
struct Elimination<const F: usize> {
    numbers: Numbers<F>,
    nu: f64,
    nodes: Vec<Eliminated<F>>,
}

impl<const F: usize> Elimination<F> {
    /// What is on the springs of a node: with F = 2, before `ν β`.
    #[inline(always)]
    fn block(node: &TreeNode) -> &Matrix6<f64> {
        if F == 2 { &node.K } else { &node.C }
    }

    /// (4); false where a pivot is not positive.
    fn factor(&mut self, tree: &[TreeNode], numbers: Numbers<F>, nu: f64) -> bool {
        (self.numbers, self.nu) = (numbers, nu);
        let (zero, none) = ([Matrix6::zeros(); F], [Vector6::zeros(); F]);
        self.nodes.resize(tree.len(), Eliminated { inverse: zero, held: zero, inertia: zero, carried: none, w: none });
        for (node, own) in self.nodes.iter_mut().zip(tree) {
            node.inertia = zero;
            node.inertia[0] = own.inertia;
        }
        for (j, own) in tree.iter().enumerate().rev() {
            let (inner, outer) = self.nodes.split_at_mut(j);
            let (node, block) = (&mut outer[0], Self::block(own));
            node.inverse = node.inertia;
            // ν β K has no first part.
            node.inverse[F - 1] += block * if F == 2 { nu } else { 1.0 };
            if !numbers.invert(&mut node.inverse) {
                return false;
            }
            for k in 0..6 {
                let column = numbers.product(&node.inverse, &from_fn(|part| node.inertia[part].column(k).into()));
                node.held.iter_mut().zip(&column).for_each(|(held, column)| held.set_column(k, column));
            }
            let Some(p) = own.parent else { continue };
            let mut passed = zero;
            for k in 0..6 {
                let column = numbers.times_unit(nu, &from_fn(|part| node.held[part].column(k).into()));
                passed.iter_mut().zip(&column).for_each(|(to, column)| to.set_column(k, &product(block, column)));
            }
            for (to, passed) in inner[p].inertia.iter_mut().zip(&passed) {
                *to += own.inertia_inward(&((passed + passed.transpose()) * 0.5));
            }
        }
        true
    }

    /// (5) and (6): leaves the parts of the solution of node j in its `w`.
    fn solve(&mut self, tree: &[TreeNode], r: &[f64]) {
        let Self { numbers, nu, nodes } = self;
        let none = [Vector6::zeros(); F];
        nodes.iter_mut().for_each(|node| node.carried = none);
        for (j, own) in tree.iter().enumerate().rev() {
            let (inner, outer) = nodes.split_at_mut(j);
            let node = &mut outer[0];
            let own_r = Vector6::from_column_slice(&r[6 * j..6 * j + 6]);
            let mut z = node.carried.map(|f| -f);
            z[0] += own_r;
            node.w = numbers.product(&node.inverse, &z);
            let Some(p) = own.parent else { continue };
            let stretched = numbers.times_unit(*nu, &node.w);
            for (part, (to, stretched)) in inner[p].carried.iter_mut().zip(&stretched).enumerate() {
                let mut f = -product(Self::block(own), stretched);
                if part == 0 {
                    f += own_r;
                }
                *to += own.inward(&f);
            }
        }
        for (j, own) in tree.iter().enumerate() {
            let (inner, outer) = nodes.split_at_mut(j);
            let node = &mut outer[0];
            let Some(p) = own.parent else {
                node.carried = node.w;
                continue;
            };
            let moved = inner[p].carried.map(|alpha| own.outward(&alpha));
            let held = numbers.product(&node.held, &moved);
            for (part, w) in node.w.iter_mut().enumerate() {
                *w -= held[part];
                node.carried[part] = moved[part] + *w;
            }
        }
    }
}

/// `J^-1` of `J = M + C`, or of (7), on a tree; see the module page.
#[derive(Clone, Debug, Default)]
pub(crate) struct TreeInverse {
    pub(crate) matrices: TreeMatrices,
    /// s of (7); none: `J = M + C`.
    s: Option<f64>,
    plain: Elimination<1>,
    corrected: Elimination<2>,
    /// `I^-1`, for (3).
    lightness: Vec<Matrix6<f64>>,
    /// α of each node in (3).
    alpha: Vec<Vector6<f64>>,
    /// `s M^-1 K d` of the last solution d.
    shift: DVector<f64>,
}

impl TreeInverse {
    /// Whether (7) with this s, or `M + C` without, can be eliminated from the matrices that are there.
    pub(crate) fn applies(&self, s: Option<f64>) -> bool {
        s.is_none() || self.matrices.ratio.is_some_and(|kappa| kappa > 0.0)
    }

    /// Factorises what is in `matrices`, (7) with s or `M + C` without.
    ///
    /// # Errors
    /// [`StepError::Singular`] if an inertia or `J` is not positive definite.
    pub(crate) fn factor(&mut self, s: Option<f64>, t: f64) -> Result<(), StepError> {
        let nodes = &self.matrices.nodes;
        self.s = s;
        let kappa = self.matrices.ratio.unwrap_or(f64::NAN);
        let positive = match s {
            None => self.plain.factor(nodes, Numbers::default(), 1.0),
            Some(s) => {
                let nu = (kappa * s).sqrt();
                self.invert_inertias(t)?;
                self.corrected.factor(&self.matrices.nodes, Numbers { tau: kappa / nu }, nu)
            }
        };
        if positive { Ok(()) } else { Err(StepError::Singular { matrix: "iteration matrix", t }) }
    }

    fn invert_inertias(&mut self, t: f64) -> Result<(), StepError> {
        let nodes = &self.matrices.nodes;
        self.lightness.resize(nodes.len(), Matrix6::zeros());
        self.alpha.resize(nodes.len(), Vector6::zeros());
        if self.shift.len() != 6 * nodes.len() {
            self.shift = DVector::zeros(6 * nodes.len());
        }
        for (inverse, node) in self.lightness.iter_mut().zip(nodes) {
            let mut inertia = [node.inertia];
            if !Numbers::default().invert(&mut inertia) {
                return Err(StepError::Singular { matrix: "mass matrix", t });
            }
            *inverse = inertia[0];
        }
        Ok(())
    }

    /// Replaces `r` by `d = J^-1 r`; with s also finds [`TreeInverse::shift`].
    pub(crate) fn solve(&mut self, r: &mut DVector<f64>) {
        let nodes = &self.matrices.nodes;
        let Some(s) = self.s else {
            self.plain.solve(nodes, r.as_slice());
            for (d, node) in r.as_mut_slice().chunks_exact_mut(6).zip(&self.plain.nodes) {
                d.copy_from_slice(node.w[0].as_slice());
            }
            return;
        };
        self.corrected.solve(nodes, r.as_slice());
        let (tau, scale) = (self.corrected.numbers.tau, -s / self.corrected.nu);
        let to = r.as_mut_slice().chunks_exact_mut(6).zip(self.shift.as_mut_slice().chunks_exact_mut(6));
        for ((d, shift), node) in to.zip(&self.corrected.nodes) {
            let [p, q] = &node.w;
            for i in 0..6 {
                d[i] = p[i] + tau * q[i];
                shift[i] = scale * q[i];
            }
        }
    }

    /// `s M^-1 K d` of the last solution d.
    pub(crate) fn shift(&self) -> &DVector<f64> {
        &self.shift
    }

    /// `y = x + s M^-1 K x`, by (3).
    pub(crate) fn correct(&mut self, x: &DVector<f64>, y: &mut DVector<f64>) {
        let Self { matrices, s, lightness, alpha, .. } = self;
        let s = s.unwrap_or(0.0);
        // First what the children put on each node.
        alpha.iter_mut().for_each(|alpha| *alpha = Vector6::zeros());
        for (j, node) in matrices.nodes.iter().enumerate().rev() {
            let f = product(&node.K, &Vector6::from_column_slice(&x.as_slice()[6 * j..6 * j + 6]));
            if let Some(p) = node.parent {
                let carried = node.inward(&f);
                alpha[p] += carried;
            }
            alpha[j] = product(&lightness[j], &(f - alpha[j]));
        }
        for (j, node) in matrices.nodes.iter().enumerate() {
            let moved = node.parent.map_or(Vector6::zeros(), |p| node.outward(&alpha[p]));
            for i in 0..6 {
                y[6 * j + i] = x[6 * j + i] + s * (alpha[j][i] - moved[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::prelude::*;
    use proptest::test_runner::TestRunner;

    /// Numbers between -1 and 1 in turn.
    struct Draw(u64);

    impl Draw {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn symmetric(&mut self, least: f64) -> Matrix6<f64> {
            let A = Matrix6::from_fn(|_, _| self.next());
            A * A.transpose() + Matrix6::identity() * least
        }
    }

    /// A random tree with branches and several roots; stiffness of very different size from node to node.
    fn tree(seed: u64, count: usize) -> TreeMatrices {
        let mut draw = Draw(seed);
        let nodes = (0..count).map(|j| {
            // Mostly chains.
            let parent = ((draw.next().abs() * (j as f64 + 1.0)) as usize).min(j);
            let parent = if draw.next() < 0.4 { j } else { parent };
            let block = |draw: &mut Draw| Matrix3::from_fn(|_, _| draw.next());
            let size = 10f64.powf(3.0 * draw.next());
            TreeNode {
                parent: parent.checked_sub(1),
                inertia: draw.symmetric(0.3),
                carried: [block(&mut draw), block(&mut draw), block(&mut draw)],
                C: draw.symmetric(0.1) * size,
                K: draw.symmetric(0.1) * size,
            }
        });
        TreeMatrices { nodes: nodes.collect(), ratio: None }
    }

    /// (2), C and K as dense matrices.
    fn dense(tree: &TreeMatrices) -> [DMatrix<f64>; 3] {
        let n = 6 * tree.nodes.len();
        let (mut M, mut C, mut K) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        let mut moves: Vec<DMatrix<f64>> = Vec::new();
        for (j, node) in tree.nodes.iter().enumerate() {
            let mut E = DMatrix::zeros(6, n);
            if let Some(p) = node.parent {
                let mut X = DMatrix::zeros(6, 6);
                let [A, B, C] = &node.carried;
                for (row, column, block) in [(0, 0, A), (0, 3, B), (3, 3, C)] {
                    X.view_mut((row, column), (3, 3)).copy_from(block);
                }
                E += X * &moves[p];
            }
            E.view_mut((0, 6 * j), (6, 6)).fill_with_identity();
            let I = DMatrix::from_column_slice(6, 6, node.inertia.as_slice());
            M += E.transpose() * I * &E;
            C.view_mut((6 * j, 6 * j), (6, 6)).copy_from(&node.C);
            K.view_mut((6 * j, 6 * j), (6, 6)).copy_from(&node.K);
            moves.push(E);
        }
        [M, C, K]
    }

    fn far(found: &DVector<f64>, truth: &DVector<f64>) -> f64 {
        (found - truth).norm() / truth.norm()
    }

    /// Truth: the dense matrices of the same tree, by LU. Measured: 3e-13.
    #[test]
    fn a_tree_is_solved_as_its_dense_matrix_is() {
        let mut runner = TestRunner::new(ProptestConfig::with_cases(60));
        let cases = (any::<u64>(), 1_usize..=32);
        let result = runner.run(&cases, |(seed, count)| {
            let matrices = tree(seed, count);
            let [M, C, _] = dense(&matrices);
            let r = DVector::from_fn(6 * count, |i, _| ((i * i) as f64).sin());
            let truth = (M + C).lu().solve(&r).unwrap();
            let mut inverse = TreeInverse { matrices, ..Default::default() };
            inverse.factor(None, 0.0).unwrap();
            let mut d = r.clone();
            inverse.solve(&mut d);
            prop_assert!(far(&d, &truth) < 1e-12, "{:e}", far(&d, &truth));
            Ok(())
        });
        result.unwrap();
    }

    /// Truth: `J = M + κ K + κ s K M^-1 K` dense, by LU, where a and b of (7) are complex, equal, real, and very different
    /// (`τ = κ/ν` of 0.02, 1, 2, 2.1 and 50); solution, shift, and `x + s M^-1 K x`.
    /// Measured: 3e-13, 7e-14, 5e-14.
    #[test]
    fn the_corrected_matrix_is_solved_by_one_elimination_whatever_its_roots() {
        let mut runner = TestRunner::new(ProptestConfig::with_cases(60));
        let cases = (any::<u64>(), 1_usize..=32, prop::sample::select(vec![0.02, 1.0, 2.0, 2.1, 50.0]), -2.0..1.0f64);
        let result = runner.run(&cases, |(seed, count, tau, size)| {
            let mut matrices = tree(seed, count);
            let nu = 10f64.powf(size);
            let (kappa, s) = (tau * nu, nu / tau);
            matrices.ratio = Some(kappa);
            let [M, _, K] = dense(&matrices);
            let M_inverse_K = M.clone().lu().solve(&K).unwrap();
            let J = &M + &K * kappa + &K * &M_inverse_K * (kappa * s);
            let r = DVector::from_fn(6 * count, |i, _| ((i * i) as f64).sin());
            let truth = J.lu().solve(&r).unwrap();
            let mut inverse = TreeInverse { matrices, ..Default::default() };
            inverse.factor(Some(s), 0.0).unwrap();
            let mut d = r.clone();
            inverse.solve(&mut d);
            let mut corrected = r.clone();
            inverse.correct(&r, &mut corrected);
            let errors = [
                far(&d, &truth),
                far(inverse.shift(), &(&M_inverse_K * &truth * s)),
                far(&corrected, &(&r + &M_inverse_K * &r * s)),
            ];
            prop_assert!(errors.iter().all(|error| *error < 1e-10), "{errors:?} {tau}");
            Ok(())
        });
        result.unwrap();
    }

    /// A node without inertia has no acceleration, with springs or without.
    #[test]
    fn a_node_without_inertia_is_found() {
        let mut matrices = tree(1, 3);
        matrices.ratio = Some(1.0);
        matrices.nodes[2].inertia = Matrix6::zeros();
        let mut inverse = TreeInverse { matrices, ..Default::default() };
        assert!(matches!(inverse.factor(Some(1.0), 0.5), Err(StepError::Singular { matrix: "mass matrix", .. })));
    }
}
