//! Forces of the balancers in the recursions: external wrenches, and torques on joints.

use flexarm_spatial::Wrench;

use crate::balancer::lengths::measure;
use crate::balancer::placed::BalancerPlace;
use crate::data::Data;
use crate::kinematics::place_bodies;
use crate::model::Model;

/// Runs a recursion with the forces of line balancers added to the external wrenches; restores
/// `data.F_ext` afterwards.
pub(crate) fn with_lines(model: &Model, data: &mut Data, q: &[f64], run: impl FnOnce(&mut Data)) {
    place_bodies(model, data, q);
    measure(model, data, q);
    data.F_ext_saved.copy_from_slice(&data.F_ext);
    for balancer in &model.balancers {
        let Some(line) = balancer.line(&data.X_WB) else { continue };
        for (end, F_W) in [line.F_W, -line.F_W].into_iter().enumerate() {
            let body = line.bodies[end];
            let F_B = data.X_WB[body].rotation.inverse() * F_W;
            data.F_ext[body] += Wrench::new(F_B, line.p_B[end].cross(&F_B));
        }
    }
    run(data);
    data.F_ext.copy_from_slice(&data.F_ext_saved);
}

/// `τ += factor c T`, (3): with factor 1 the forces that hold the joints against their balancers.
pub(crate) fn add_joint_torques(model: &Model, data: &mut Data, factor: f64) {
    for (balancer, x) in model.balancers.iter().zip(&data.balanced) {
        if let BalancerPlace::Joint { terms, .. } = &balancer.place {
            let T = factor * balancer.law.tension(*x);
            for (k, c) in terms {
                data.tau[*k] += c * T;
            }
        }
    }
}
