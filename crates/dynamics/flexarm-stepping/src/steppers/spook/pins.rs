//! Pins that close loops: two constraint rows each, between bodies that no joint connects.
//!
//! ```text
//! c_k = e_k . d,   d = p_eye - p_pin
//! G_A = [ -e, -(r_A + d) x e ],   G_B = [ e, r_B x e ]
//! K z = r,   [ K  -Gᵀ ] [ z ]   [ r ]
//!            [ G   Σ  ] [ μ ] = [ s ]
//! z = z_r + Z μ,   Z = K^-1 Gᵀ,   (G Z + Σ) μ = s - G z_r
//! ```
//! The directions e_1, e_2 are perpendicular to the pin and fixed to the body A that carries it;
//! the eye is on body B. K is the matrix of the opened tree, in which dependent joints are free
//! along their axes; Z is solved for row by row. Displacement along the pin and tilt of the eye on
//! it are free, as in [`flexarm_kinematics::PlacedLoop`].

use flexarm_kinematics::{JointMotion, Model, Pose};
use nalgebra::{DMatrix, DVector, Vector2, Vector3, Vector6};

use super::BodyState;
use super::solve::joined;
use crate::error::DEAD_POINT_RAD;

/// Maximum distance of a pin from its eye (m); beyond it the loop is open.
const LARGEST_GAP: f64 = 1e-2;

/// One of the two rows of a pin.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Gradients on the body with the pin and on the body with the eye.
    G: [Vector6<f64>; 2],
    c: f64,
}

/// Velocities and impulses of the tree.
pub(super) type TreeVelocities = (Vec<Vector6<f64>>, Vec<Vector6<f64>>);

/// All pins of an arm, with workspace.
#[derive(Clone)]
pub(super) struct Pins {
    rows: Vec<Row>,
    /// Bodies of each row.
    bodies: Vec<[usize; 2]>,
    /// Response of the tree to a unit impulse of each row.
    columns: Vec<TreeVelocities>,
    A: DMatrix<f64>,
    mu: DVector<f64>,
}

impl Pins {
    pub(super) fn new(model: &Model) -> Self {
        let (n, count) = (model.bodies().len(), 2 * model.loops().len());
        let zero = Row { G: [Vector6::zeros(); 2], c: 0.0 };
        let zeros = || vec![Vector6::zeros(); n];
        Self {
            rows: vec![zero; count],
            bodies: model.loops().iter().flat_map(|own| [own.ends; 2]).collect(),
            columns: (0..count).map(|_| (zeros(), zeros())).collect(),
            A: DMatrix::zeros(count, count),
            mu: DVector::zeros(count),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Updates the rows at the current poses `X_WB` of the bodies. Returns the first loop that is open or at a dead
    /// point.
    pub(super) fn update(&mut self, model: &Model, poses: &[Pose], bodies: &[BodyState]) -> Option<usize> {
        let mut open = None;
        for (k, own) in model.loops().iter().enumerate() {
            let [A, B] = own.ends;
            let X = poses[A] * own.pin();
            let p_eye = poses[B].rotation * own.eye() + poses[B].translation.vector;
            let d = p_eye - X.translation.vector;
            // From the centre of mass of A to the eye: r_A + d.
            let (r_A, r_B) = (p_eye - bodies[A].x, p_eye - bodies[B].x);
            for (row, axis) in [Vector3::x(), Vector3::y()].into_iter().enumerate() {
                let e = X.rotation * axis;
                let G = [joined(&-e, &-r_A.cross(&e)), joined(&e, &r_B.cross(&e))];
                self.rows[2 * k + row] = Row { G, c: e.dot(&d) };
            }
            let gap = Vector2::new(self.rows[2 * k].c, self.rows[2 * k + 1].c).norm();
            // Velocity of the eye across the pin per rate of each dependent joint.
            let [u, v] = own.dependent.map(|i| {
                let body = &model.bodies()[i];
                let X_WP = poses[body.parent] * body.X_PJ;
                let JointMotion::Axis(motion) = body.motion else { return Vector2::zeros() };
                let S = motion.twist(1.0);
                let lever = p_eye - X_WP.translation.vector;
                (X.rotation.inverse() * (X_WP.rotation * S.linear + (X_WP.rotation * S.angular).cross(&lever))).xy()
            });
            let closes = gap <= LARGEST_GAP && u.perp(&v).abs() >= DEAD_POINT_RAD * u.norm() * v.norm();
            if !closes && open.is_none() {
                open = Some(k);
            }
        }
        open
    }

    /// Returns the rate of a row at velocities `v`.
    fn rate(&self, row: usize, v: &[Vector6<f64>]) -> f64 {
        let [A, B] = self.bodies[row];
        self.rows[row].G[0].dot(&v[A]) + self.rows[row].G[1].dot(&v[B])
    }

    /// Adds the impulses of the pins to the solution of the opened tree.
    ///
    /// * `before`: velocities at the start of the step; `h`, `upsilon`, `sigma`: of the pins.
    /// * `open`: solves the tree for momenta on the bodies only.
    ///
    /// Returns `None` if the matrix of the pins is not positive definite.
    pub(super) fn close<E>(
        &mut self,
        (v, lambda): (&mut [Vector6<f64>], &mut [Vector6<f64>]),
        before: &[BodyState],
        [h, upsilon, sigma]: [f64; 3],
        mut open: impl FnMut([(usize, Vector6<f64>); 2], &mut TreeVelocities) -> Result<(), E>,
    ) -> Result<Option<()>, E> {
        // Columns of Z = K^-1 Gᵀ.
        let count = self.rows.len();
        for j in 0..count {
            let ([A, B], G) = (self.bodies[j], self.rows[j].G);
            open([(A, G[0]), (B, G[1])], &mut self.columns[j])?;
        }
        // (G Z + Σ) μ = s - G z_r
        for i in 0..count {
            for j in 0..count {
                self.A[(i, j)] = self.rate(i, &self.columns[j].0);
            }
            self.A[(i, i)] += sigma;
            let ([A, B], Row { G, c }) = (self.bodies[i], self.rows[i]);
            let rate = G[0].dot(&before[A].V.to_vector()) + G[1].dot(&before[B].V.to_vector());
            self.mu[i] = upsilon * (rate - 4.0 / h * c) - self.rate(i, v);
        }
        if !eliminate(&mut self.A, &mut self.mu) {
            return Ok(None);
        }
        for (mu, (v_j, lambda_j)) in self.mu.iter().zip(&self.columns) {
            v.iter_mut().zip(v_j).for_each(|(v, v_j)| *v += v_j * *mu);
            lambda.iter_mut().zip(lambda_j).for_each(|(lambda, lambda_j)| *lambda += lambda_j * *mu);
        }
        Ok(Some(()))
    }
}

/// Solves a positive definite system in place; returns whether it is positive definite.
fn eliminate(A: &mut DMatrix<f64>, x: &mut DVector<f64>) -> bool {
    let n = x.len();
    for k in 0..n {
        if !(A[(k, k)] > 0.0 && A[(k, k)].is_finite()) {
            return false;
        }
        for i in k + 1..n {
            let factor = A[(i, k)] / A[(k, k)];
            for j in k..n {
                A[(i, j)] -= factor * A[(k, j)];
            }
            x[i] -= factor * x[k];
        }
    }
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| A[(k, j)] * x[j]).sum();
        x[k] = (x[k] - rest) / A[(k, k)];
    }
    true
}
