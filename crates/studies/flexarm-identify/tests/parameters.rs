//! Patterns of names of parameters.

use flexarm_identify::parameters::{asks_for, fits};

#[test]
fn an_entry_has_two_names_and_is_asked_for_by_its_indices_alone() {
    let name = "link.arm.stiffness[1][5]";
    assert!(fits("link.arm.stiffness[5][1]", name) && asks_for("link.*.stiffness[*][*]", name));
    assert!(!asks_for("*", name) && !asks_for("link.*stiffness*", name));
    assert!(asks_for("tcp.*", "tcp.rx") && !asks_for("*", "tcp.x"));
}

#[test]
fn a_star_stands_for_anything_in_a_name() {
    assert!(fits("drive.*.gearbox.stiffness", "drive.joint_2.gearbox.stiffness"));
    assert!(fits("*", "payload.mass") && fits("link.*", "link.a.stiffness_factor"));
    assert!(!fits("drive.*", "payload.mass") && !fits("payload", "payload.mass"));
    assert!(fits("*stiffness*", "drive.a.gearbox.stiffness[2]"));
}
