//! Joint targets at rest against the equilibrium found by another way.
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::sync::Arc;

use flexarm_kinematics::{Frame, Model, Wrench};
use flexarm_stepping::{Damping, FlexibleArm, Held, OperatingPoint, StaticTargets, static_targets};
use flexarm_testkit::reference_arm;
use nalgebra::Vector3;

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

fn arm(softer: f64) -> (FlexibleArm, Frame) {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let spring =
        |name: &str, k: usize| (name.to_owned(), reference.K_S[k] / softer, Damping::StiffnessProportional(2e-3));
    let tool = model.frame("tcp").expect("there").clone();
    let springs = vec![spring("lower", 0), spring("upper", 1)];
    (FlexibleArm::new(model, springs, Arc::new(Held(POSE.to_vec()))).expect("valid"), tool)
}

/// Truth: the equilibrium of [`OperatingPoint`], on an arm that sags by 4 cm, under a load besides.
#[test]
fn at_rest_the_tool_of_a_soft_arm_is_where_the_rigid_arm_has_it() {
    let (arm, tool) = arm(20.0);
    let load = Wrench::new(Vector3::new(90.0, 50.0, -200.0), Vector3::new(10.0, 0.0, 20.0));
    let found = static_targets(&arm, &tool, &POSE, &load, 0.0, &[true; 6]).unwrap();
    let mut at = OperatingPoint::new(arm.clone(), tool.clone());
    at.solve(&POSE, &Wrench::zeros()).unwrap();
    let wanted = at.rigid_tcp_pose();
    at.solve(&found.q, &load).unwrap();
    let off = (at.tcp_pose().translation.vector - wanted.translation.vector).norm();
    let turned = (at.tcp_pose().rotation.matrix() - wanted.rotation.matrix()).norm();
    eprintln!(
        "before {:.1} mm, after {off:.1e} m and {turned:.1e} rad in {} iterations",
        1e3 * found.before.rows(0, 3).norm(),
        found.iterations
    );
    assert!(found.before.rows(0, 3).norm() > 0.03);
    assert!(off < 1e-11 && turned < 1e-11, "{off:e} {turned:e}");
}

#[test]
fn with_the_position_alone_the_joints_move_as_little_as_they_can() {
    let (arm, tool) = arm(20.0);
    let position = [true, true, true, false, false, false];
    let all = static_targets(&arm, &tool, &POSE, &Wrench::zeros(), 0.0, &[true; 6]).unwrap();
    let some = static_targets(&arm, &tool, &POSE, &Wrench::zeros(), 0.0, &position).unwrap();
    let way = |found: &StaticTargets| found.q.iter().zip(POSE).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(some.after.amax() < 1e-12 && way(&some) < way(&all), "{} {}", way(&some), way(&all));
}
