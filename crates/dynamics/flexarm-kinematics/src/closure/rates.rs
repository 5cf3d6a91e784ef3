//! Rates of the loops at given velocities: γ of equation (3) and the time derivative of T.
//!
//! Velocities `v`, `w` of the origins of the bodies are relative to the common body C, in its axes;
//! rows of J and J̇ are in the plane of the pin A.
//!
//! Not here: positions of the loops (`positions.rs`), accelerations and forces (`recursions.rs`).

use flexarm_spatial::Twist;
use nalgebra::{Matrix2, Vector2, Vector3};

use crate::closure::placed_loop::PlacedLoop;
use crate::closure::workspace::{LoopRates, Solved};
use crate::data::Data;
use crate::kinematics::{joint_column_rates, joint_columns};
use crate::model::Model;

impl Solved {
    /// (3) at the tree velocities `qdot`, and Ṫ if `with_T`.
    pub(super) fn rates(&self, model: &Model, data: &Data, q: &[f64], qdot: &[f64], to: &mut LoopRates, with_T: bool) {
        let nv = self.nv;
        for (k, loop_) in model.loops.iter().enumerate() {
            loop_.place_chains(model, data, &mut to.X_C);
            loop_.move_chains(model, data, q, qdot, None, to);
            let (J, Jdot) = (&self.J[k], &to.Jdot);
            let minus = -self.inverse[k];
            // J̇ q̇ over all coordinates, plus the γ of dependent joints of earlier loops.
            let own = [loop_.first, loop_.first + 1];
            let all = loop_.moved_by.iter().copied().chain(own);
            let mut c = all.fold(Vector2::zeros(), |sum, j| sum + Jdot[j] * qdot[j]);
            for &j in loop_.moved_by.iter().filter(|j| **j >= nv) {
                c += J[j] * to.gamma[j - nv];
            }
            let gamma = minus * c;
            let d = loop_.first - nv;
            (to.gamma[d], to.gamma[d + 1]) = (gamma.x, gamma.y);
            if with_T {
                self.slope_rates(loop_, k, minus, to);
            }
        }
    }

    /// Writes the rates of the dependent coordinates into `qdot` and Ṫ into `to`, as the subtree of a
    /// body moves with a twist (world axes, about the world origin) while the independent
    /// coordinates keep their values.
    pub(super) fn rates_of_subtree(
        &self,
        model: &Model,
        data: &Data,
        q: &[f64],
        (body, moved): (usize, &Twist),
        qdot: &mut [f64],
        to: &mut LoopRates,
    ) {
        qdot.fill(0.0);
        for (k, loop_) in model.loops.iter().enumerate() {
            loop_.place_chains(model, data, &mut to.X_C);
            let common = moved.at_child(&data.X_WB[loop_.common]);
            loop_.move_chains(model, data, q, qdot, Some((body, &common)), to);
            let rate = self.inverse[k] * loop_.gap_rate(to);
            (qdot[loop_.first], qdot[loop_.first + 1]) = (-rate.x, -rate.y);
            loop_.move_chains(model, data, q, qdot, Some((body, &common)), to);
            self.slope_rates(loop_, k, -self.inverse[k], to);
        }
    }

    /// `Ṫ = -J_d^-1 (J̇ + J̇_d T)`.
    fn slope_rates(&self, loop_: &PlacedLoop, k: usize, minus: Matrix2<f64>, to: &mut LoopRates) {
        let (nv, d) = (self.nv, loop_.first - self.nv);
        let LoopRates { Jdot, Tdot, .. } = to;
        let J = &self.J[k];
        for i in 0..nv {
            let mut c = Jdot[loop_.first] * self.T[d * nv + i] + Jdot[loop_.first + 1] * self.T[(d + 1) * nv + i];
            for &j in &loop_.moved_by {
                if j == i {
                    c += Jdot[j];
                } else if j >= nv {
                    let at = (j - nv) * nv + i;
                    c += Jdot[j] * self.T[at] + J[j] * Tdot[at];
                }
            }
            let rate = minus * c;
            Tdot[d * nv + i] = rate.x;
            Tdot[(d + 1) * nv + i] = rate.y;
        }
    }
}

impl PlacedLoop {
    /// Velocities in the axes of the common body, and the time derivative of the Jacobian.
    ///
    /// * `moved`: additional twist of the subtree of a body, axes and origin of the common body.
    fn move_chains(
        &self,
        model: &Model,
        data: &Data,
        q: &[f64],
        qdot: &[f64],
        moved: Option<(usize, &Twist)>,
        to: &mut LoopRates,
    ) {
        let LoopRates { X_C, v, w, Jdot, .. } = to;
        (v[self.common], w[self.common]) = (Vector3::zeros(), Vector3::zeros());
        // Velocities of the bodies, from the common body outward.
        for &i in self.chains.iter().flatten() {
            let parent = model.bodies[i].parent;
            let arm = X_C[i].translation.vector - X_C[parent].translation.vector;
            let (mut v_i, mut w_i) = (v[parent] + w[parent].cross(&arm), w[parent]);
            joint_columns(model, data, i, X_C[i].rotation.matrix(), |k, l, a| {
                v_i += l * qdot[k];
                w_i += a * qdot[k];
            });
            if let Some((_, twist)) = moved.filter(|(body, _)| *body == i) {
                v_i += twist.linear + twist.angular.cross(&X_C[i].translation.vector);
                w_i += twist.angular;
            }
            (v[i], w[i]) = (v_i, w_i);
        }
        // Columns of J̇ in A axes: d/dt (l + a × r) - w_A × (l + a × r).
        let (X_CA, p_CB) = self.ends_at(X_C);
        let [a, b] = self.ends;
        let v_B = v[b] + w[b].cross(&(p_CB - X_C[b].translation.vector));
        let (R_AC, w_A) = (X_CA.rotation.inverse(), w[a]);
        Jdot.fill(Vector2::zeros());
        for (chain, sign) in self.chains.iter().zip([-1.0, 1.0]) {
            for &i in chain {
                let (r, rdot) = (p_CB - X_C[i].translation.vector, v_B - v[i]);
                let R = X_C[i].rotation.matrix();
                joint_column_rates(model, data, i, R, &w[i], q, qdot, |k, [l, a, ldot, adot]| {
                    let column = l + a.cross(&r);
                    let rate = ldot + adot.cross(&r) + a.cross(&rdot) - w_A.cross(&column);
                    Jdot[k] += (R_AC * rate).xy() * sign;
                });
            }
        }
    }

    /// Time derivative of (1) at the velocities of the last [`Self::move_chains`].
    fn gap_rate(&self, at: &LoopRates) -> Vector2<f64> {
        let LoopRates { X_C, v, w, .. } = at;
        let (X_CA, p_CB) = self.ends_at(X_C);
        let [v_A, v_B] = self.ends.map(|i| v[i] + w[i].cross(&(p_CB - X_C[i].translation.vector)));
        (X_CA.rotation.inverse() * (v_B - v_A)).xy()
    }
}
