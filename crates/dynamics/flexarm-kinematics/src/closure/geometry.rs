//! Geometry of a loop at given joint poses: its gap, Jacobian, triangle and transmission angle.
//!
//! `X_C[i]` is the pose of body i in the common body C of the loop, `X_CA` that of the pin A (its axis is
//! z), `p_CB` the position of the eye. Vectors are in axes of C, but two-vectors in the plane of A. Not
//! here: the solution of (1) (`positions`).

use std::f64::consts::FRAC_PI_2;

use flexarm_spatial::Pose;
use nalgebra::{Vector2, Vector3};

use crate::closure::placed_loop::PlacedLoop;
use crate::closure::triangle::{FlatJoint, Triangle};
use crate::data::Data;
use crate::kinematics::joint_columns;
use crate::model::{Body, JointMotion, Model};

impl PlacedLoop {
    /// Poses of the loop's bodies in the common body.
    pub(super) fn place_chains(&self, model: &Model, data: &Data, X_C: &mut [Pose]) {
        X_C[self.common] = Pose::identity();
        for &i in self.chains.iter().flatten() {
            X_C[i] = X_C[model.bodies[i].parent] * data.X_PB[i];
        }
    }

    /// `X_CA` and `p_CB`: pose of the pin and position of the eye in the common body.
    pub(super) fn ends_at(&self, X_C: &[Pose]) -> (Pose, Vector3<f64>) {
        let eye = &X_C[self.ends[1]];
        (X_C[self.ends[0]] * self.X_pin, eye.rotation * self.p_eye + eye.translation.vector)
    }

    /// Residual of (1) (m), and the size of the loop (m).
    pub(super) fn gap(&self, X_C: &[Pose]) -> (Vector2<f64>, f64) {
        let (X_CA, p_CB) = self.ends_at(X_C);
        let p = X_CA.rotation.inverse() * (p_CB - X_CA.translation.vector);
        let size = self.chains.iter().flatten().map(|&i| X_C[i].translation.vector.amax());
        (p.xy(), size.chain([p_CB.amax(), X_CA.translation.vector.amax()]).fold(0.0, f64::max))
    }

    /// `∂c/∂q`, two rows per coordinate of the tree; zero for coordinates that do not move the
    /// loop.
    pub(super) fn jacobian(&self, model: &Model, data: &Data, X_C: &[Pose], J: &mut [Vector2<f64>]) {
        J.fill(Vector2::zeros());
        let (X_CA, p_CB) = self.ends_at(X_C);
        let R_AC = X_CA.rotation.inverse();
        for (chain, sign) in self.chains.iter().zip([-1.0, 1.0]) {
            for &i in chain {
                let r = p_CB - X_C[i].translation.vector;
                joint_columns(model, data, i, X_C[i].rotation.matrix(), |k, l, a| {
                    J[k] += (R_AC * (l + a.cross(&r))).xy() * sign;
                });
            }
        }
    }

    /// The loop as a triangle in the plane normal to the pin, at the joint poses in `X_C`.
    pub(super) fn triangle(&self, model: &Model, X_C: &[Pose]) -> Triangle {
        let (X_CA, p_CB) = self.ends_at(X_C);
        let R_AC = X_CA.rotation.inverse();
        let flat = |p: &Vector3<f64>| (R_AC * (p - X_CA.translation.vector)).xy();
        let joint = |which: usize| {
            let body = self.dependent[which];
            let axis = model.bodies[body].motion_axis();
            let axis_A = R_AC * (X_C[body].rotation * axis);
            let slides = model.bodies[body].slides();
            let way = if slides { axis_A.xy() } else { Vector2::new(axis_A.z.signum(), 0.0) };
            FlatJoint { slides, at: flat(&X_C[body].translation.vector), way }
        };
        Triangle { joints: [joint(0), joint(1)], ends: [Vector2::zeros(), flat(&p_CB)], shape: self.shape }
    }

    /// Transmission angle (rad), 90 degrees at best: the angle between the two triangle sides
    /// without driving joints. With a sliding dependent joint it is the angle between the two
    /// directions in which the dependent joints move the pin.
    pub(super) fn transmission(&self, model: &Model, X_C: &[Pose], J: &[Vector2<f64>]) -> f64 {
        let between = |a: Vector2<f64>, b: Vector2<f64>| (a.x * b.y - a.y * b.x).abs().atan2(a.dot(&b).abs());
        if self.dependent.iter().any(|&body| model.bodies[body].slides()) {
            return between(J[self.first], J[self.first + 1]);
        }
        let Triangle { joints, ends, .. } = self.triangle(model, X_C);
        let corners = [joints[0].at, joints[1].at, ends[1]];
        let angle = |k: usize| {
            let [a, b] = [1, 2].map(|step| corners[(k + step) % 3] - corners[k]);
            between(a, b)
        };
        match self.corner {
            Some(k) => angle(k),
            None => (0..3).map(angle).fold(FRAC_PI_2, f64::min),
        }
    }
}

impl Body {
    fn motion_axis(&self) -> Vector3<f64> {
        match self.motion {
            JointMotion::Axis(motion) => motion.axis(),
            _ => Vector3::z(),
        }
    }

    fn slides(&self) -> bool {
        matches!(self.motion, JointMotion::Axis(motion) if motion.slides())
    }
}

impl Model {
    /// Actuated coordinates that move a dependent coordinate of the tree, in ascending order.
    pub(crate) fn leaders(&self, dependent: usize) -> Vec<usize> {
        let (mut found, mut open) = (Vec::new(), vec![dependent]);
        while let Some(k) = open.pop() {
            let moved_by = self.loops.iter().filter(|l| (l.first..l.first + 2).contains(&k)).flat_map(|l| &l.moved_by);
            for &j in moved_by {
                match j {
                    j if j >= self.nv() => open.push(j),
                    j if j < self.n_actuated() && !found.contains(&j) => found.push(j),
                    _ => {}
                }
            }
        }
        found.sort_unstable();
        found
    }
}
