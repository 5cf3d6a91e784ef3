//! Positions of the dependent joints, equation (1), and their slopes T, equation (2) of the module.
//!
//! Loops are solved in their order of dependence; each starts from its closed form, so the result
//! does not depend on the history.

use nalgebra::{Matrix2, Vector2};

use crate::closure::placed_loop::PlacedLoop;
use crate::closure::workspace::Solved;
use crate::data::{Data, begin, joint_position};
use crate::model::{JointMotion, Model};

/// Maximum number of Newton iterations after the closed form. Rigid links need one as confirmation,
/// flexible links three or four.
const MAX_ITERATIONS: usize = 12;

impl Solved {
    /// Computes the dependent coordinates from (1) into `q`, the joint poses of the loops into
    /// `data`, and (2).
    pub(super) fn positions(&mut self, model: &Model, data: &mut Data, q: &mut [f64]) {
        self.open = None;
        for loop_ in &model.loops {
            q[loop_.first..loop_.first + 2].copy_from_slice(&loop_.start);
        }
        begin(model, data, q);
        for (k, loop_) in model.loops.iter().enumerate() {
            for &i in loop_.chains.iter().flatten() {
                // Joints solved by an earlier loop are kept.
                let found = model.loops[..k].iter().any(|other| other.dependent.contains(&i));
                if !found {
                    joint_position(model, data, i, q);
                }
            }
            self.close(model, data, q, k);
        }
    }

    /// Solves one loop: closed form, Newton iterations, then (2).
    fn close(&mut self, model: &Model, data: &mut Data, q: &mut [f64], k: usize) {
        let loop_ = &model.loops[k];
        // Closed form.
        loop_.place_chains(model, data, &mut self.X_C);
        let start = loop_.triangle(model, &self.X_C).solve(loop_.root);
        let mut x = match start {
            Some(turn) => [loop_.start[0] + turn[0], loop_.start[1] + turn[1]],
            None => [f64::NAN; 2],
        };
        // Newton's method on (1), with J at the current poses.
        let mut last = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            for (body, x) in loop_.dependent.into_iter().zip(x) {
                let own = &model.bodies[body];
                if let JointMotion::Axis(motion) = own.motion {
                    data.X_PB[body] = own.X_PJ * motion.pose(x);
                }
            }
            loop_.place_chains(model, data, &mut self.X_C);
            let (c, size) = loop_.gap(&self.X_C);
            loop_.jacobian(model, data, &self.X_C, &mut self.J[k]);
            let J_d = Matrix2::from_columns(&[self.J[k][loop_.first], self.J[k][loop_.first + 1]]);
            self.inverse[k] = J_d.try_inverse().unwrap_or_else(|| Matrix2::from_element(f64::NAN));
            let gap = c.norm();
            // Stops at rounding level, where the residual no longer decreases.
            if gap <= f64::EPSILON * size || gap >= 0.5 * last || gap.is_nan() {
                break;
            }
            last = gap;
            let step = self.inverse[k] * c;
            x = [x[0] - step.x, x[1] - step.y];
        }
        let (c, size) = loop_.gap(&self.X_C);
        let closed = c.norm() <= 1e-9 * size && self.inverse[k].iter().all(|x| x.is_finite());
        if !closed {
            x = [f64::NAN; 2];
            self.open = self.open.or(Some(k));
        }
        q[loop_.first..loop_.first + 2].copy_from_slice(&x);
        self.angle[k] = loop_.transmission(model, &self.X_C, &self.J[k]);
        self.slopes(loop_, k);
    }

    /// (2) of one loop, after the loops it depends on.
    fn slopes(&mut self, loop_: &PlacedLoop, k: usize) {
        let (nv, inverse) = (self.nv, self.inverse[k]);
        let (before, own) = self.T.split_at_mut((loop_.first - nv) * nv);
        let (first, second) = own[..2 * nv].split_at_mut(nv);
        first.fill(0.0);
        second.fill(0.0);
        let mut add = |j: usize, c: Vector2<f64>| {
            let t = inverse * c;
            first[j] -= t.x;
            second[j] -= t.y;
        };
        for &j in &loop_.moved_by {
            match j < nv {
                true => add(j, self.J[k][j]),
                false => {
                    let row = &before[(j - nv) * nv..][..nv];
                    row.iter().enumerate().filter(|(_, t)| **t != 0.0).for_each(|(i, t)| add(i, self.J[k][j] * *t));
                }
            }
        }
    }
}
