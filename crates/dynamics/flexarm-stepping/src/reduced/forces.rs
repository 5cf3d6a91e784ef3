//! Generalised forces beside those of the tree: springs, dampers, friction, gears, controller.
//!
//! x, v, f are over the free coordinates: joints driven by torque, then elastic ones. Forces are on the
//! left side of the equations of motion. Not here: inertia, weight and loads (the recursions).

use nalgebra::DVector;

use crate::dense::add_product;
use crate::gear::{GearState, LoadFriction};
use crate::geometric::add_geometric_forces;
use crate::reduced::ReducedArm;

impl ReducedArm {
    /// Adds springs, dampers, friction and controller: `f += K x + D v + friction - τ`.
    pub(super) fn add_forces(&mut self, x: &DVector<f64>, v: &DVector<f64>, f: &mut DVector<f64>) {
        let driven = self.plant.torque_driven.len();
        if self.gears.is_some() {
            return self.add_gear_forces(x, v, f);
        }
        for (i, &k) in self.plant.torque_driven.iter().enumerate() {
            f[i] += self.plant.friction_torque(k, v[i]);
            f[i] -= self.servo.as_ref().map_or(0.0, |s| s.torque[i]);
        }
        let (x, v, f) = (&x.as_slice()[driven..], &v.as_slice()[driven..], &mut f.as_mut_slice()[driven..]);
        for (k, element) in self.plant.elements.iter().enumerate() {
            let first = self.plant.offset(element);
            let range = first..first + element.size;
            if self.plant.proportional && element.curve.is_none() {
                // K (x + tau v)
                let (tau, shifted) = (self.plant.tau[k], &mut self.shifted.as_mut_slice()[..element.size]);
                for ((shifted, x), v) in shifted.iter_mut().zip(&x[range.clone()]).zip(&v[range.clone()]) {
                    *shifted = x + tau * v;
                }
                add_product(element.K.as_slice(), shifted, &mut f[range]);
            } else {
                element.add_spring_force(&x[range.clone()], &[], &mut f[range.clone()]);
                if self.plant.proportional {
                    f[first] += self.plant.tau[k] * element.K[(0, 0)] * v[first];
                }
            }
        }
        if !self.plant.proportional {
            self.plant.add_damping(v, f);
        }
    }

    /// Works as [`ReducedArm::add_forces`] for arms with gear effects other than elasticity, at the
    /// state set before.
    #[cold]
    fn add_gear_forces(&mut self, x: &DVector<f64>, v: &DVector<f64>, f: &mut DVector<f64>) {
        let Self { plant, gears: Some(gears), state, servo, tau, .. } = self else { return };
        let driven = plant.torque_driven.len();
        let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
        gears.update(plant, q, qdot, &x.as_slice()[driven..], &v.as_slice()[driven..]);
        f.rows_mut(driven, gears.F.len()).axpy(1.0, &gears.F, 1.0);
        if driven == 0 {
            return;
        }
        // Motors: transmission error and friction minus the torque of the controller.
        let GearState { F, friction, .. } = &mut **gears;
        let load = |k: Option<usize>| k.map_or(0.0, |k| F[plant.offset(&plant.elements[k])]);
        plant.friction_torques(qdot, |law| load(law.element), friction);
        let motors = &mut tau.as_mut_slice()[..friction.len()];
        motors.copy_from_slice(friction);
        plant.add_motor_forces(q, F.as_slice(), motors);
        for (i, &k) in plant.torque_driven.iter().enumerate() {
            f[i] += motors[k] - servo.as_ref().map_or(0.0, |s| s.torque[i]);
        }
    }

    /// Adds the torques of transmission errors and friction to the actuated joints in `data.tau`,
    /// at the state set before.
    #[cold]
    fn add_gear_torques(&mut self, x: &DVector<f64>, v: &DVector<f64>) {
        let Self { plant, gears: Some(gears), state, data, qddot, .. } = self else { return };
        let (n, driven) = (plant.model.n_actuated(), plant.torque_driven.len());
        let (q, qdot) = (state.q.as_slice(), state.qdot.as_slice());
        gears.update(plant, q, qdot, &x.as_slice()[driven..], &v.as_slice()[driven..]);
        let GearState { F, friction, .. } = &mut **gears;
        let tau = &mut data.tau.as_mut_slice()[..n];
        let rotor = |k: usize| plant.model.rotor_inertia(k) * qddot[k];
        let load = |law: &LoadFriction| match law.element {
            Some(k) => F[plant.offset(&plant.elements[k])],
            // A rigid gear transmits the torque of the joint without the share of its own rotor.
            None => tau[law.coordinate] - rotor(law.coordinate),
        };
        plant.friction_torques(qdot, load, friction);
        plant.add_motor_forces(q, F.as_slice(), tau);
        tau.iter_mut().zip(friction).for_each(|(tau, friction)| *tau += *friction);
    }

    pub(super) fn add_geometric_forces(&self, x: &DVector<f64>, f: &mut DVector<f64>) {
        let driven = self.plant.torque_driven.len();
        add_geometric_forces(&self.plant, &self.data, &x.as_slice()[driven..], &mut f.as_mut_slice()[driven..]);
    }

    /// Adds friction and gear torques to the actuated joints in `data.tau`, at the state set
    /// before.
    pub(super) fn add_joint_torques(&mut self, x: &DVector<f64>, v: &DVector<f64>) {
        if self.gears.is_some() {
            return self.add_gear_torques(x, v);
        }
        for k in 0..self.plant.model.n_actuated() {
            self.data.tau[k] += self.plant.friction_torque(k, self.state.qdot[k]);
        }
    }
}
