//! Σ and Υ of the rows of each joint.

use flexarm_kinematics::Model;
use nalgebra::Matrix6;

use super::RIGID_COMPLIANCE;
use super::settings::SpookPreset;
use super::solve::{Sigma, Symmetric};
use crate::plant::Plant;

/// Compliance of the rows of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointCompliance {
    pub(super) sigma: Sigma,
    pub(super) upsilon: f64,
}

/// Returns Υ of rigid rows, with τ = 2h.
pub(super) fn rigid_upsilon(preset: SpookPreset) -> f64 {
    match preset {
        SpookPreset::Exact => 1.0 / 9.0,
        SpookPreset::Source => 1.0 / 8.0,
    }
}

/// Returns whether the joint of a body is a dependent joint of a closed loop.
fn is_dependent(model: &Model, body: usize) -> bool {
    model.loops().iter().any(|own| own.dependent.contains(&body))
}

/// Compliance `Σ` of the rows of a joint for the step size h (s): that of its spring, or almost
/// zero.
pub(super) fn joint_compliance(plant: &Plant, body: usize, h: f64, preset: SpookPreset) -> JointCompliance {
    let element = plant.elements.iter().position(|e| e.body == body);
    let upsilon = match (preset, element) {
        (SpookPreset::Exact, Some(k)) => 1.0 / (1.0 + 4.0 * plant.tau[k] / h),
        (preset, _) => rigid_upsilon(preset),
    };
    let factor = 4.0 / (h * h) * upsilon;
    let six = |X: &nalgebra::DMatrix<f64>| Symmetric::new(&Matrix6::from_column_slice(X.as_slice()));
    let sigma = match element.map(|k| &plant.elements[k]) {
        Some(element) if element.size == 6 => {
            Sigma::Soft(six(&element.C).scaled(factor), six(&element.K).scaled(1.0 / factor))
        }
        // One compliant row among rigid ones.
        Some(element) => {
            let mut C = Matrix6::identity() * RIGID_COMPLIANCE;
            if let Some(motion) = plant.single_axis(body) {
                let S = motion.column();
                C += S * S.transpose() * element.C[(0, 0)];
            }
            Sigma::Mixed(Symmetric::new(&C).scaled(factor))
        }
        None if is_dependent(&plant.model, body) => Sigma::Free(RIGID_COMPLIANCE * factor),
        None => Sigma::Hard(RIGID_COMPLIANCE * factor),
    };
    JointCompliance { sigma, upsilon }
}
