//! Joint targets at rest against the equilibrium computed independently.

use std::sync::Arc;

use flexarm_kinematics::{Frame, Model, Wrench, rotation_vector};
use flexarm_stepping::{
    Damping, EquationsOfMotion, Held, OperatingPoint, Plant, StaticTargets, linearise, static_targets,
};
use flexarm_testkit::reference_arm;
use nalgebra::{Vector3, Vector6};

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

fn plant(softer: f64) -> (Plant, Frame) {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let spring =
        |name: &str, k: usize| (name.to_owned(), reference.K_S[k] / softer, Damping::StiffnessProportional(2e-3));
    let tool = model.frame("tcp").expect("there").clone();
    let springs = vec![spring("lower", 0), spring("upper", 1)];
    (Plant::new(model, springs, Arc::new(Held(POSE.to_vec()))).expect("valid"), tool)
}

/// Truth: the equilibrium of [`OperatingPoint`], on an arm that sags by 4 cm, also under a load.
#[test]
fn at_rest_the_tool_of_a_soft_arm_is_where_the_rigid_arm_has_it() {
    let (plant, tool) = plant(20.0);
    let load = Wrench::new(Vector3::new(90.0, 50.0, -200.0), Vector3::new(10.0, 0.0, 20.0));
    let found = static_targets(&plant, &tool, &POSE, &load, 0.0, &[true; 6]).unwrap();
    let mut at = OperatingPoint::new(plant.clone(), tool.clone());
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
    let (plant, tool) = plant(20.0);
    let position = [true, true, true, false, false, false];
    let all = static_targets(&plant, &tool, &POSE, &Wrench::zeros(), 0.0, &[true; 6]).unwrap();
    let some = static_targets(&plant, &tool, &POSE, &Wrench::zeros(), 0.0, &position).unwrap();
    let way = |found: &StaticTargets| found.q.iter().zip(POSE).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(some.after.amax() < 1e-12 && way(&some) < way(&all), "{} {}", way(&some), way(&all));
}

/// Truth: Richardson differences of the equilibrium of [`OperatingPoint`], on an arm that sags by 4
/// cm, also under a load.
#[test]
fn the_tool_at_rest_moves_with_each_command_as_its_equilibrium_does() {
    let (plant, tool) = plant(20.0);
    let load = Wrench::new(Vector3::new(90.0, 50.0, -200.0), Vector3::new(10.0, 0.0, 20.0));
    let slopes = linearise(&plant, &tool, &load, 0.0).unwrap().command_slopes().unwrap();
    let mut at = OperatingPoint::new(plant, tool);
    at.solve(&POSE, &load).unwrap();
    let here = at.tcp_pose();
    for k in 0..6 {
        let mut place = |x: f64| {
            let mut q = POSE;
            q[k] += x;
            at.solve(&q, &load).unwrap();
            let X = at.tcp_pose();
            let turned = rotation_vector((X.rotation * here.rotation.inverse()).matrix());
            let p = X.translation.vector;
            Vector6::new(p.x, p.y, p.z, turned.x, turned.y, turned.z)
        };
        let mut d = |h: f64| (place(h) - place(-h)) / (2.0 * h);
        let (a, b, c) = (d(0.02), d(0.01), d(0.005));
        let truth = ((c * 4.0 - b) * 16.0 - (b * 4.0 - a)) / 45.0;
        let error = (slopes.column(k) - truth).amax() / truth.amax();
        eprintln!("joint {}: {error:.1e}", k + 1);
        assert!(error < 1e-8, "joint {}: {error:e}", k + 1);
    }
}

/// A wrong number of joints ended in a slice of another length; wrong vectors gave numbers for some.
#[test]
fn vectors_of_another_length_than_the_arm_are_refused_with_both_lengths() {
    let (plant, tool) = plant(1.0);
    for length in [0, 5, 7] {
        let error = static_targets(&plant, &tool, &vec![0.1; length], &Wrench::zeros(), 0.0, &[true; 6]).unwrap_err();
        assert_eq!(error.to_string(), format!("{length} joint positions are given, the arm has 6 joints"));
    }
    let refused = |expected: &str, call: &mut dyn FnMut()| {
        let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call)).expect_err(expected);
        let text = panic.downcast_ref::<String>().unwrap();
        assert!(text.contains(expected), "{text}");
    };
    let mut at = OperatingPoint::new(plant.clone(), tool);
    at.solve(&POSE, &Wrench::zeros()).unwrap();
    let inertia = plant.model.bodies()[1].inertia;
    refused("p has 11 entries, the arm has 12 elastic coordinates", &mut || {
        at.add_weight(1, &inertia, &mut [0.0; 11]);
    });
    let mut equations = EquationsOfMotion::at_rest(plant).unwrap();
    let x = equations.x().to_vec();
    refused("v has 13 entries, the arm has 12 free coordinates", &mut || equations.set_state(&x, &[0.0; 13]));
}
