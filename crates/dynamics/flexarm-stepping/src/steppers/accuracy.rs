//! Accuracy of a stepper for an oscillation, measured by running it on the test equation.
//!
//! ```text
//! x'' + 2 ζ x' + x = 1,   x(0) = x'(0) = 0                      (1)
//! x(t) = 1 - e^(-ζt) (cos wt + ζ/w sin wt),   w² = 1 - ζ²       (2)
//! ```
//! (1) is a body on a spring, with time in units of 1/ω.

use std::f64::consts::TAU;
use std::sync::Arc;

use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose, Wrench};
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::{StepRule, StepperKind, new_stepper};
use crate::arm::{Damping, FlexibleArm};
use crate::motion::Held;
use crate::observation::Observation;
use crate::stepper::Start;

/// Load of (1), small enough that no stepper reports a divergence.
const LOAD: f64 = 1e-3;
/// Number of steps per period above which the error of any stepper is small.
const MANY: f64 = 1000.0;

/// Returns the maximum error over the first period of an oscillation relative to its amplitude: the
/// stepper runs on (1) and is compared with (2). Zero for steppers with error control.
///
/// * `h_omega`: step size times angular frequency.
/// * `zeta`: damping ratio of the oscillation, below 1.
///
/// Returns infinity if the stepper does not accept the step size.
pub fn error_of_a_period(kind: StepperKind, h_omega: f64, zeta: f64) -> f64 {
    if kind.entry().steps == StepRule::ByErrorControl || h_omega * MANY < TAU {
        return 0.0;
    }
    let steps = (TAU / h_omega).ceil() as usize;
    swing(kind, h_omega, zeta, steps).unwrap_or(f64::INFINITY)
}

/// Returns the maximum error over `steps` steps; `None` if the stepper refuses them.
fn swing(kind: StepperKind, h: f64, zeta: f64, steps: usize) -> Option<f64> {
    let arm = body_on_spring(zeta)?;
    let mut seen = Observation::new(&arm);
    let mut stepper = new_stepper(kind, arm, h, Start::Undeformed).ok()?;
    let w = (1.0 - zeta * zeta).sqrt();
    let mut largest = 0.0f64;
    for k in 1..=steps {
        stepper.step().ok()?;
        stepper.observe(&mut seen);
        let t = h * k as f64;
        let truth = 1.0 - (-zeta * t).exp() * ((w * t).cos() + zeta / w * (w * t).sin());
        largest = largest.max((seen.q[0] / LOAD - truth).abs());
    }
    largest.is_finite().then_some(largest)
}

/// Returns a body of unit mass on a spring of unit stiffness, with the load of (1).
fn body_on_spring(zeta: f64) -> Option<FlexibleArm> {
    let mut tree = Mechanism::new("oscillator");
    tree.gravity = Vector3::zeros();
    tree.links.push(Link { name: "base".into(), inertia: None });
    let inertia = LinkInertia { mass: 1.0, com: Vector3::zeros(), inertia_com: Matrix3::identity() };
    tree.links.push(Link { name: "body".into(), inertia: Some(inertia) });
    let kind = JointKind::Elastic(ElasticAngles::RotationVector);
    tree.joints.push(Joint::new("spring", kind, "base", "body", Pose::identity()));
    let model = Arc::new(Model::new(&tree).ok()?);
    let spring = ("spring".to_owned(), Matrix6::identity(), Damping::StiffnessProportional(2.0 * zeta));
    let arm = FlexibleArm::new(model, vec![spring], Arc::new(Held(vec![]))).ok()?;
    let body = arm.elements.first()?.body;
    arm.with_loads(vec![(body, Wrench::new(Vector3::x() * LOAD, Vector3::zeros()))]).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steppers::{STEPPERS, SpookPreset, SpookSettings, StepperOptions};

    fn kind(name: &str) -> StepperKind {
        let entry = STEPPERS.into_iter().find(|entry| entry.name == name).unwrap();
        (entry.with)(&StepperOptions::default())
    }

    /// Truth: SPOOK without damping has the frequency `(2/hω) atan(hω/2)` and, from rest, leads by
    /// half a step: `x = 1 - cos(w' t + hω/2) / cos(hω/2)`; and the amplification of RK4,
    /// `|R(iy)|² = 1 - y⁶/72 + y⁸/576`.
    #[test]
    fn the_error_of_a_period_is_that_of_the_closed_amplification() {
        for y in [0.1f64, 0.2, 0.3] {
            let frequency = 2.0 / y * (0.5 * y).atan();
            let off = |t: f64| t.cos() - (frequency * t + 0.5 * y).cos() / (0.5 * y).cos();
            let steps = (TAU / y).ceil() as u32;
            let truth = (1..=steps).map(|k| off(y * f64::from(k)).abs()).fold(0.0, f64::max);
            let found = error_of_a_period(kind("spook"), y, 0.0);
            // Measured 0.0008 to 0.008.
            assert!((found / truth - 1.0).abs() < 0.02, "{y}: {found:.3e}, {truth:.3e}");
        }
        let y = 1.0f64;
        let (loss, phase) =
            (1.0 - (1.0 - y.powi(6) / 72.0 + y.powi(8) / 576.0).sqrt().powf(TAU / y), TAU * y.powi(4) / 120.0);
        let found = error_of_a_period(kind("rk4"), y, 0.0);
        assert!((0.5..2.0).contains(&(found / loss.hypot(phase))), "{found:.3e}, {loss:.3e}, {phase:.3e}");
    }

    /// Truth: the orders stated in the registry.
    #[test]
    fn half_the_step_divides_the_error_of_a_period_by_the_power_of_the_order() {
        for entry in STEPPERS.into_iter().filter(|entry| entry.steps != StepRule::ByErrorControl) {
            let error = |h| error_of_a_period(kind(entry.name), h, 0.03);
            let order = (error(0.2) / error(0.1)).log2();
            assert!(order > f64::from(entry.order) - 0.2, "{}: {order}", entry.name);
        }
        assert_eq!(error_of_a_period(kind("reference"), 1.0, 0.03), 0.0);
    }

    /// The preset of the source damps with a time in proportion to the step: an oscillation without
    /// physical damping decays at any step size.
    #[test]
    fn settings_count() {
        let source = StepperKind::Spook(SpookSettings { preset: SpookPreset::Source, ..SpookSettings::default() });
        let [exact, source] = [kind("spook"), source].map(|kind| error_of_a_period(kind, 0.05, 0.0));
        // Half a step of lead, and nearly a quarter of the amplitude.
        assert!(exact < 0.025 && source > 0.1, "{exact:e} {source:e}");
    }
}
