//! Systems on a tree, solved by elimination, compared with dense ones.

use flexarm_stepping::internals::TreeInverse;
use flexarm_stepping::{StepError, TreeMatrices, TreeNode};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use crate::draw::Draw;

/// Creates a random tree with branches and several roots; stiffness differs by orders of
/// magnitude between nodes.
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
            inertia: draw.definite(0.3),
            carried: [block(&mut draw), block(&mut draw), block(&mut draw)],
            Z: draw.definite(0.1) * size,
            K: draw.definite(0.1) * size,
        }
    });
    TreeMatrices { nodes: nodes.collect() }
}

fn inverse_of(matrices: TreeMatrices) -> TreeInverse {
    let mut inverse = TreeInverse::default();
    inverse.matrices = matrices;
    inverse
}

/// Returns M of (2), C and K as dense matrices.
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
        C.view_mut((6 * j, 6 * j), (6, 6)).copy_from(&node.Z);
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
        let mut inverse = inverse_of(matrices);
        inverse.factor(None, 0.0).unwrap();
        let mut d = r.clone();
        inverse.solve(&mut d);
        prop_assert!(far(&d, &truth) < 1e-12, "{:e}", far(&d, &truth));
        Ok(())
    });
    result.unwrap();
}

/// Truth: `J = M + C (1 + s M^-1 K)` dense, by LU; solution, shift, and `x + s M^-1 K x`. With
/// damping unrelated to the stiffness, and with `C = κ K` where the roots a and b are complex,
/// equal, real, and very different (`τ = (κ/s)^1/2` of 0.02, 1, 2, 2.1 and 50). Measured:
/// 2e-12, 2e-12, 1e-12.
#[test]
fn the_corrected_matrix_is_solved_with_one_elimination_whatever_the_damping() {
    let mut runner = TestRunner::new(ProptestConfig::with_cases(100));
    let ratios = prop::sample::select(vec![None, Some(0.02), Some(1.0), Some(2.0), Some(2.1), Some(50.0)]);
    let cases = (any::<u64>(), 1_usize..=32, ratios, -2.0..1.0f64);
    let result = runner.run(&cases, |(seed, count, tau, size)| {
        let mut matrices = tree(seed, count);
        let nu = 10f64.powf(size);
        let s = nu / tau.unwrap_or(1.0);
        if let Some(tau) = tau {
            matrices.nodes.iter_mut().for_each(|node| node.Z = node.K * (tau * nu));
        }
        let [M, C, K] = dense(&matrices);
        let M_inverse_K = M.clone().lu().solve(&K).unwrap();
        let J = &M + &C + &C * &M_inverse_K * s;
        let r = DVector::from_fn(6 * count, |i, _| ((i * i) as f64).sin());
        let truth = J.lu().solve(&r).unwrap();
        let mut inverse = inverse_of(matrices);
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
        prop_assert!(errors.iter().all(|error| *error < 1e-10), "{errors:?} {tau:?}");
        Ok(())
    });
    result.unwrap();
}

/// A node without inertia is reported as a singular mass matrix, with springs or without.
#[test]
fn a_node_without_inertia_is_found() {
    let mut matrices = tree(1, 3);
    matrices.nodes[2].inertia = Matrix6::zeros();
    let mut inverse = inverse_of(matrices);
    assert!(matches!(inverse.factor(Some(1.0), 0.5), Err(StepError::Singular { matrix: "mass matrix", .. })));
}
