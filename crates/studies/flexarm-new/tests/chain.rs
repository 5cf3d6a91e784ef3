//! The arm within a robot.

use flexarm_kinematics::{Joint, JointKind, Link, Mechanism, Mimic, Pose};
use flexarm_new::NewOptions;
use flexarm_new::internals::{Chain, find};
use nalgebra::{Translation3, Vector3};

/// Joints as (parent, child, moves, offset along x).
fn mechanism(joints: &[(&str, &str, bool, f64)]) -> Mechanism {
    let mut m = Mechanism::new("m");
    m.links.push(Link { name: "base".into(), inertia: None });
    for (parent, child, moves, x) in joints {
        m.links.push(Link { name: (*child).into(), inertia: None });
        let kind = if *moves { JointKind::Revolute(Vector3::z_axis()) } else { JointKind::Fixed };
        let X = Pose::from_parts(Translation3::new(*x, 0.0, 0.0), nalgebra::Rotation3::identity());
        m.joints.push(Joint::new(format!("to_{child}"), kind, *parent, *child, X));
    }
    m
}

fn names(mechanism: &Mechanism, chain: &Chain) -> Vec<String> {
    chain.joints.iter().map(|&k| mechanism.joints[k].child.clone()).collect()
}

#[test]
fn fingers_are_no_part_of_the_arm_whether_by_name_or_because_a_hand_fans_out() {
    let arm = [("base", "a", true, 0.3), ("a", "b", true, 0.5), ("b", "c", true, 0.4), ("c", "tool", false, 0.1)];
    let by_name = [&arm[..], &[("tool", "left_finger", true, 0.02), ("left_finger", "tip", true, 0.05)]].concat();
    let by_shape =
        [&arm[..], &[("tool", "x1", true, 0.02), ("x1", "x2", true, 0.05), ("tool", "y1", true, 0.02)]].concat();
    for joints in [by_name, by_shape] {
        let mechanism = mechanism(&joints);
        let chain = find(&mechanism, &NewOptions::default()).unwrap();
        assert_eq!(names(&mechanism, &chain), ["a", "b", "c"]);
        assert_eq!(chain.tool, "tool");
        assert_eq!(chain.held.len(), joints.len() - 4);
    }
}

#[test]
fn of_two_arms_the_first_is_taken_and_the_other_told_and_legs_are_no_arms() {
    let joints = [
        ("base", "leg_1", true, 0.3),
        ("leg_1", "leg_2", true, 0.5),
        ("leg_2", "leg_3", true, 0.5),
        ("base", "l1", true, 0.3),
        ("l1", "l2", true, 0.4),
        ("l2", "left_tool0", false, 0.1),
        ("base", "r1", true, 0.3),
        ("r1", "r2", true, 0.4),
        ("r2", "right_tool0", false, 0.1),
    ];
    let mechanism = mechanism(&joints);
    let chain = find(&mechanism, &NewOptions::default()).unwrap();
    assert_eq!(chain.tool, "left_tool0");
    assert!(chain.choices[0].contains("right_tool0"), "{:?}", chain.choices);
    assert_eq!(chain.held.len(), 5);
    let right = NewOptions { tool: Some("right_tool0".into()), ..NewOptions::default() };
    assert_eq!(names(&mechanism, &find(&mechanism, &right).unwrap()), ["r1", "r2"]);
    let from = NewOptions { base: Some("r1".into()), ..right.clone() };
    assert_eq!(names(&mechanism, &find(&mechanism, &from).unwrap()), ["r2"]);
    let wrong = NewOptions { base: Some("l1".into()), ..right };
    let error = find(&mechanism, &wrong).unwrap_err().to_string();
    assert!(error.contains("is not connected to the base"), "{error}");
}

#[test]
fn followers_and_joints_without_room_move_nothing_by_themselves() {
    let mut mechanism = mechanism(&[("base", "a", true, 0.3), ("a", "b", true, 0.5), ("b", "c", true, 0.5)]);
    mechanism.joints[1].mimic = Some(Mimic { joint: "to_a".into(), ratio: 1.0, offset: 0.0 });
    (mechanism.joints[2].limits.lower, mechanism.joints[2].limits.upper) = (0.1, 0.1);
    let chain = find(&mechanism, &NewOptions::default()).unwrap();
    assert_eq!(names(&mechanism, &chain), ["a"]);
    mechanism.joints.iter_mut().for_each(|j| j.kind = JointKind::Fixed);
    let error = find(&mechanism, &NewOptions::default()).unwrap_err().to_string();
    assert!(error.contains("has no joint that moves"), "{error}");
}
