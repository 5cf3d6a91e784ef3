//! Accuracy of a stepper for an oscillation, measured by running it on the test equation.
//!
//! ```text
//! x'' + 2 ζ x' + x = 1,   x(0) = x'(0) = 0                      (1)
//! x(t) = 1 - e^(-ζt) (cos wt + ζ/w sin wt),   w² = 1 - ζ²       (2)
//! ```
//! (1) is a body on a spring, with time in units of 1/ω.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose, Wrench};
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::{StepRule, StepperKind, new_stepper};
use crate::motion::Held;
use crate::observation::Observation;
use crate::plant::{Damping, Plant};
use crate::stepper::Start;

/// Load of (1), small enough that no stepper reports a divergence.
const LOAD: f64 = 1e-3;
/// Number of steps per period above which the error of any stepper is small.
const MANY: f64 = 1000.0;

/// Returns the maximum error over the first period of an oscillation relative to its amplitude: the
/// stepper runs on (1) and is compared with (2). Zero for steppers with error control; at least one
/// for steps above half a period, which cannot show the oscillation, however close their ends are to
/// (2).
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
    let error = swing(kind, h_omega, zeta, steps).unwrap_or(f64::INFINITY);
    if h_omega > PI { error.max(1.0) } else { error }
}

/// Returns the maximum error over `steps` steps; `None` if the stepper refuses them.
fn swing(kind: StepperKind, h: f64, zeta: f64, steps: usize) -> Option<f64> {
    let plant = body_on_spring(zeta)?;
    let mut observed = Observation::new(&plant);
    let mut stepper = new_stepper(kind, plant, h, Start::Undeformed).ok()?;
    let w = (1.0 - zeta * zeta).sqrt();
    let mut largest = 0.0f64;
    for k in 1..=steps {
        stepper.step().ok()?;
        stepper.observe(&mut observed);
        let t = h * k as f64;
        let truth = 1.0 - (-zeta * t).exp() * ((w * t).cos() + zeta / w * (w * t).sin());
        largest = largest.max((observed.q[0] / LOAD - truth).abs());
    }
    largest.is_finite().then_some(largest)
}

/// Returns a body of unit mass on a spring of unit stiffness, with the load of (1).
fn body_on_spring(zeta: f64) -> Option<Plant> {
    let mut tree = Mechanism::new("oscillator");
    tree.gravity = Vector3::zeros();
    tree.links.push(Link { name: "base".into(), inertia: None });
    let inertia = LinkInertia { mass: 1.0, com: Vector3::zeros(), inertia_com: Matrix3::identity() };
    tree.links.push(Link { name: "body".into(), inertia: Some(inertia) });
    let kind = JointKind::Elastic(ElasticAngles::RotationVector);
    tree.joints.push(Joint::new("spring", kind, "base", "body", Pose::identity()));
    let model = Arc::new(Model::new(&tree).ok()?);
    let spring = ("spring".to_owned(), Matrix6::identity(), Damping::StiffnessProportional(2.0 * zeta));
    let plant = Plant::new(model, vec![spring], Arc::new(Held(vec![]))).ok()?;
    let body = plant.elements.first()?.body;
    plant.with_loads(vec![(body, Wrench::new(Vector3::x() * LOAD, Vector3::zeros()))]).ok()
}
