//! Elimination over the tree of bodies of SPOOK, compared with the dense saddle-point matrix.

use flexarm_stepping::internals::{Jacobian, Rows, Sigma, Symmetric, TreeSolver, Triangle};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};
use proptest::prelude::*;

use crate::draw::Draw;

impl Draw {
    fn vector(&mut self) -> Vector6<f64> {
        Vector6::from_fn(|_, _| self.next())
    }

    fn triangle(&mut self) -> Triangle {
        let mut block = || Matrix3::from_fn(|_, _| self.next()) + Matrix3::identity() * 2.0;
        Triangle { tv: block(), tw: block(), rw: block() }
    }

    fn rows(&mut self, levers: bool) -> Rows {
        let G = if levers {
            let mut lever = || Vector3::from_fn(|_, _| self.next());
            Jacobian::Levers { parent: lever(), child: lever() }
        } else {
            let (parent, child) = (self.triangle(), self.triangle());
            let (tv, rw) = (child.tv.try_inverse().unwrap(), child.rw.try_inverse().unwrap());
            Jacobian::Turned { parent, child, back: Triangle { tv, tw: -(tv * child.tw * rw), rw } }
        };
        Rows { g: Vector6::zeros(), G, S: self.vector() }
    }

    /// Returns a hard, soft, singly soft or free Σ, and its matrix.
    fn sigma(&mut self, kind: u64) -> (Sigma, Matrix6<f64>) {
        let hard = 1e-8;
        match kind % 4 {
            0 => (Sigma::Hard(hard), Matrix6::identity() * hard),
            1 => {
                let C = self.definite(0.3) * 1e-3;
                (Sigma::Soft(Symmetric::new(&C), Symmetric::new(&C.try_inverse().unwrap())), C)
            }
            2 => (Sigma::Free(hard), Matrix6::identity() * hard),
            _ => {
                let line = self.vector();
                let C = Matrix6::identity() * hard + line * line.transpose();
                (Sigma::Mixed(Symmetric::new(&C)), C)
            }
        }
    }
}

/// Returns a 6×6 matrix from its action on the unit vectors.
fn matrix(map: impl Fn(&Vector6<f64>) -> Vector6<f64>) -> Matrix6<f64> {
    Matrix6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| map(&Vector6::ith(k, 1.0))))
}

/// Truth: the saddle-point matrix (1) of the whole tree, dense, by LU; bodies with levers and
/// with rotated rows, joints that are hard, soft, soft in one direction, and free in one.
/// Measured: 2e-12 of the velocities and 9e-12 of the impulses, at compliances from 1e-8 to 1.
#[test]
fn elimination_along_the_tree_solves_the_whole_matrix() {
    proptest!(|(seed in any::<u64>(), count in 1_usize..9)| {
        let mut draw = Draw(seed);
        let n = count + 1;
        let parent: Vec<usize> = (0..n).map(|i| ((draw.next().abs() * i as f64) as usize).min(i.saturating_sub(1))).collect();
        let M: Vec<Matrix6<f64>> = (0..n).map(|_| draw.definite(0.3)).collect();
        let rows: Vec<Rows> = (0..n as u64).map(|i| draw.rows((seed >> i) & 1 == 0)).collect();
        let (sigma, C): (Vec<Sigma>, Vec<Matrix6<f64>>) = (0..n as u64).map(|i| draw.sigma((seed >> 8) + i)).unzip();
        let mut solver = TreeSolver::new(parent.clone());
        for (i, M) in M.iter().enumerate() {
            (solver.M[i], solver.b[i], solver.s[i]) = (Symmetric::new(M), draw.vector(), draw.vector());
        }

        // Unknowns: velocities, impulses, rates ε of the free lines.
        let (mut A, mut right) = (DMatrix::zeros(13 * count, 13 * count), DVector::zeros(13 * count));
        for i in 1..n {
            let (v, l) = (6 * (i - 1), 6 * (count + i - 1));
            let (G_p, G_c) = (matrix(|x| rows[i].G.of_parent(x)), matrix(|x| rows[i].G.of_child(x)));
            A.view_mut((v, v), (6, 6)).copy_from(&M[i]);
            A.view_mut((v, l), (6, 6)).copy_from(&-G_c.transpose());
            A.view_mut((l, v), (6, 6)).copy_from(&G_c);
            A.view_mut((l, l), (6, 6)).copy_from(&C[i]);
            if parent[i] > 0 {
                let p = 6 * (parent[i] - 1);
                A.view_mut((p, l), (6, 6)).copy_from(&-G_p.transpose());
                A.view_mut((l, p), (6, 6)).copy_from(&G_p);
            }
            let e = 12 * count + i - 1;
            match sigma[i] {
                Sigma::Free(_) => {
                    A.view_mut((l, e), (6, 1)).copy_from(&rows[i].S);
                    A.view_mut((e, l), (1, 6)).copy_from(&rows[i].S.transpose());
                }
                _ => A[(e, e)] = 1.0,
            }
            right.rows_mut(v, 6).copy_from(&solver.b[i]);
            right.rows_mut(l, 6).copy_from(&solver.s[i]);
        }
        let truth = A.lu().solve(&right).unwrap();

        let (mut v, mut lambda) = (vec![Vector6::zeros(); n], vec![Vector6::zeros(); n]);
        solver.solve(&rows, &sigma, &mut v, &mut lambda).unwrap();
        for (found, first) in [(&v, 0), (&lambda, 6 * count)] {
            let truth = truth.rows(first, 6 * count);
            let far = (1..n).map(|i| (found[i] - truth.fixed_rows::<6>(6 * (i - 1))).norm()).fold(0.0, f64::max);
            prop_assert!(far < 1e-10 * truth.norm(), "{far:e} of {:e}", truth.norm());
        }
    });
}
