//! The link that carries the tool centre point.

use flexarm_kinematics::{Joint, JointKind, Link, Mechanism, Pose};
use flexarm_urdf::{default_tcp, tcp_candidates};
use nalgebra::Vector3;

fn mechanism(joints: &[(&str, &str, bool)]) -> Mechanism {
    let mut m = Mechanism::new("m");
    m.links.push(Link { name: "base".into(), inertia: None });
    for (parent, child, moves) in joints {
        m.links.push(Link { name: (*child).into(), inertia: None });
        let kind = if *moves { JointKind::Revolute(Vector3::z_axis()) } else { JointKind::Fixed };
        m.joints.push(Joint::new(format!("to_{child}"), kind, *parent, *child, Pose::identity()));
    }
    m
}

#[test]
fn names_come_before_the_longest_chain() {
    let mut arm = vec![("base", "l1", true), ("l1", "l2", true), ("l2", "hand", false), ("l1", "camera", false)];
    assert_eq!(default_tcp(&mechanism(&arm)), Some("hand"));
    arm.push(("base", "flange", false));
    assert_eq!(default_tcp(&mechanism(&arm)), Some("flange"));
    arm.push(("base", "left_tool0", false));
    assert_eq!(default_tcp(&mechanism(&arm)), Some("left_tool0"));
    arm.push(("base", "right_tool0", false));
    assert_eq!(default_tcp(&mechanism(&arm)), Some("flange"), "two arms: no prefix is better than the other");
    arm.push(("base", "tool0", false));
    assert_eq!(tcp_candidates(&mechanism(&arm))[..2], ["tool0", "flange"]);
    assert_eq!(default_tcp(&Mechanism::new("empty")), None);
}
