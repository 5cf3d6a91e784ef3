//! Matrices of the tree reduced to the independent coordinates: mass matrix and static tangent.
//!
//! T is that of (2), its rows are the dependent coordinates d, e. Coordinates before `first` are left
//! out.

use flexarm_spatial::Twist;
use nalgebra::DMatrix;

use crate::closure::workspace::{LoopRates, Solved};
use crate::data::Data;
use crate::model::Model;

/// `[1; T]ᵀ A [1; T]` for the coordinates from `first` on; A covers the tree coordinates from there
/// on.
pub(super) fn reduce(A: &DMatrix<f64>, solved: &Solved, first: usize, to: &mut DMatrix<f64>) {
    let n = solved.nv - first;
    let nd = A.nrows() - n;
    let T = |d: usize, j: usize| solved.T[d * solved.nv + first + j];
    for j in 0..n {
        for i in 0..n {
            // A_ij + A_id T_dj + T_di (A_dj + A_de T_ej), sums over the dependent d and e.
            let mut sum = A[(i, j)];
            for d in 0..nd {
                let (left, right) = (T(d, i), T(d, j));
                if right != 0.0 {
                    sum += A[(i, n + d)] * right;
                }
                if left != 0.0 {
                    sum += left * A[(n + d, j)];
                    for e in 0..nd {
                        let right = T(e, j);
                        if right != 0.0 {
                            sum += left * A[(n + d, n + e)] * right;
                        }
                    }
                }
            }
            to[(i, j)] = sum;
        }
    }
}

/// Loop terms of [`crate::StaticTangent`], with workspace.
#[derive(Clone, Debug)]
pub(crate) struct LoopTangent {
    /// `∂τ_t/∂q_t` of the tree.
    pub(crate) G: DMatrix<f64>,
    rates: LoopRates,
    qdot: Vec<f64>,
}

impl LoopTangent {
    pub(crate) fn new(model: &Model, first: usize) -> Self {
        let n = model.nv() + model.dependent().len();
        Self { G: DMatrix::zeros(n - first, n - first), rates: LoopRates::new(model), qdot: vec![0.0; n] }
    }

    /// (5) into `to`, for the tangent of the tree in `G` and the forces `tau_d` on the dependent
    /// coordinates.
    pub(crate) fn reduce(&mut self, model: &Model, data: &Data, first: usize, tau_d: &[f64], to: &mut DMatrix<f64>) {
        let Some(loops) = &data.loops else { return };
        let solved = &loops.solved;
        reduce(&self.G, solved, first, to);
        let nv = solved.nv;
        for j in first..nv {
            // T does not depend on this coordinate, so the second term of (5) is zero.
            let moves = model.loops.iter().any(|loop_| loop_.moved_by.contains(&j));
            if !moves {
                continue;
            }
            self.qdot.fill(0.0);
            self.qdot[j] = 1.0;
            solved.carry_over(&mut self.qdot);
            solved.rates(model, data, &loops.q, &self.qdot, &mut self.rates, true);
            for (row, tau) in self.rates.Tdot.chunks_exact(nv).zip(tau_d) {
                for i in first..nv {
                    to[(i - first, j - first)] += tau * row[i];
                }
            }
        }
    }

    /// Adds the change of the forces on the independent coordinates to `dtau`, given that on the
    /// coordinates of the opened tree at constant dependent ones, as the subtree of a body moves with
    /// a twist; returns the rates of the dependent coordinates.
    pub(crate) fn add_moved_subtree(
        &mut self,
        model: &Model,
        data: &Data,
        first: usize,
        moved: (usize, &Twist),
        (tau_d, dtree): (&[f64], &mut [f64]),
        dtau: &mut [f64],
    ) -> &[f64] {
        let Some(loops) = &data.loops else { return &[] };
        let (solved, nv) = (&loops.solved, loops.solved.nv);
        solved.rates_of_subtree(model, data, &loops.q, moved, &mut self.qdot, &mut self.rates);
        // Forces of the tree change with the dependent coordinates too.
        for (k, rate) in (nv - first..).zip(&self.qdot[nv..]) {
            dtree.iter_mut().zip(self.G.column(k).iter()).for_each(|(to, slope)| *to += slope * rate);
        }
        // dτ = dτ_own + Tᵀ dτ_d + Ṫᵀ τ_d
        let (own, dependent) = dtree.split_at(nv - first);
        dtau.iter_mut().zip(own).for_each(|(to, own)| *to += own);
        let rows = solved.T.chunks_exact(nv).zip(self.rates.Tdot.chunks_exact(nv));
        for (((T, Tdot), dtau_d), tau_d) in rows.zip(dependent).zip(tau_d) {
            let slopes = T.iter().zip(Tdot).skip(first);
            dtau.iter_mut().zip(slopes).for_each(|(to, (t, tdot))| *to += t * dtau_d + tdot * tau_d);
        }
        &self.qdot[nv..]
    }
}
