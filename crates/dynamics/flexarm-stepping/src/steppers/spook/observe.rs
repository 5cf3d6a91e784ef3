//! Observation of SPOOK: coordinates, forces, energies and powers from bodies and impulses; `λ/h` is the mean
//! force of a joint over the last step.

use flexarm_kinematics::JointMotion;
use nalgebra::{DVector, Matrix6, Vector6};

use crate::observation::Observation;
use crate::steppers::spook::Spook;

impl Spook {
    /// Writes the poses of the bodies; returns their kinetic and gravitational energy (J).
    pub(super) fn observe_bodies(&self, out: &mut Observation) -> (f64, f64) {
        let (mut kinetic, mut potential) = (0.0, 0.0);
        for (i, state) in self.bodies.iter().enumerate() {
            out.X_WB[i] = state.X_WB();
            let w = state.R.inverse() * state.V.angular;
            kinetic += 0.5 * (state.mass * state.V.linear.norm_squared() + w.dot(&(state.J * w)));
            potential -= state.mass * self.plant.model.gravity.dot(&state.x);
        }
        (kinetic, potential)
    }

    /// Writes the drive force of the joint of body i, or the coordinates of its spring with rates
    /// and load. `force`: force of the joint on the body, in its rows.
    pub(super) fn observe_joint(&self, i: usize, force: Vector6<f64>, out: &mut Observation) {
        let body = &self.plant.model.bodies()[i];
        let element = || self.plant.elements.iter().position(|element| element.body == i);
        match body.motion {
            JointMotion::Axis(motion) if body.elastic => {
                // Spring of a drive: one coordinate, load -K (e + τ ė).
                let (g, rate) = self.deflection_now(i, Default::default());
                let (e, rate) = (motion.coordinate_of(&g), motion.coordinate_of(&rate));
                out.q[body.coordinate] = e;
                out.qdot[body.coordinate] = rate;
                if let Some(k) = element() {
                    out.load[k] = Vector6::zeros();
                    out.load[k][0] = -self.plant.elements[k].K[(0, 0)] * (e + rate * self.plant.tau[k]);
                }
            }
            JointMotion::Axis(_) if body.coordinate < out.drive.len() => {
                // Drive: component of the joint force along its axis.
                out.drive[body.coordinate] = self.rows[i].S.dot(&force);
            }
            JointMotion::Axis(_) => {}
            JointMotion::Interface { .. } | JointMotion::Welded => {}
            JointMotion::Elastic(angles) => {
                // Elastic joint of a link: six coordinates, load -K (e + τ ė).
                let (g, rate) = self.deflection_now(i, angles);
                out.q.fixed_rows_mut::<6>(body.coordinate).copy_from(&g);
                out.qdot.fixed_rows_mut::<6>(body.coordinate).copy_from(&rate);
                if let Some(k) = element() {
                    let K = Matrix6::from_column_slice(self.plant.elements[k].K.as_slice());
                    out.load[k] = -(K * (g + rate * self.plant.tau[k]));
                }
            }
        }
    }

    /// Returns the power of dampers and friction (W) at all rates `qdot`.
    pub(super) fn damping_power(&self, qdot: &DVector<f64>) -> f64 {
        let mut damping = 0.0;
        for (k, element) in self.plant.elements.iter().enumerate() {
            let rate = qdot.rows(element.coordinate, element.size);
            damping += self.plant.tau[k] * rate.dot(&(&element.K * rate));
        }
        for (k, rate) in self.now.qdot.iter().enumerate() {
            damping += self.plant.friction_torque(k, *rate) * rate;
        }
        damping
    }

    /// Returns the power of the external loads (W).
    pub(super) fn load_power(&self) -> f64 {
        let mut power = 0.0;
        for load in &self.plant.loads {
            let body = &self.bodies[load.body];
            let X = body.X_WB();
            let F = load.on_body(self.events.side(self.t), &X);
            let v = body.V.linear - body.V.angular.cross(&(X.rotation * body.com));
            power += v.dot(&(X.rotation * F.force)) + body.V.angular.dot(&(X.rotation * F.torque));
        }
        power
    }
}
