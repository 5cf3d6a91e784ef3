//! Third-party robots: grippers, missing masses, arguments.

use crate::common::{Place, ROBOT, SWING, URDF, with};

/// The beam with a prismatic finger at its end, between 0.01 and 0.05 m.
fn with_finger() -> String {
    let finger = "<link name=\"finger\"/>\n<joint name=\"grip\" type=\"prismatic\"><parent link=\"ball\"/><child \
                  link=\"finger\"/><axis xyz=\"0 1 0\"/><limit lower=\"0.01\" upper=\"0.05\" effort=\"10\" \
                  velocity=\"1\"/></joint>\n</robot>";
    with(URDF, "</robot>", finger)
}

#[test]
fn joints_that_a_motion_does_not_name_are_held_and_told() {
    let place = Place::new();
    place.write("beam.urdf", with_finger());
    let tcp = "tcp = { link = \"finger\" }\n";
    place.write(
        "robot.toml",
        ROBOT.replace("gravity =", &format!("{}gravity =", if ROBOT.contains("tcp =") { "" } else { tcp })),
    );
    let answer = place.flexarm(&["check", "robot.toml", "swing.toml"]);
    assert_eq!(answer.code, 0, "{}{}", answer.out, answer.err);
    assert!(format!("{}{}", answer.out, answer.err).contains("\"grip\" at 0.01"), "{}{}", answer.out, answer.err);

    place.write("robot.toml", format!("{}\n[hold]\ngrip = 0.03\n", place.text("robot.toml")));
    let answer = place.flexarm(&["check", "robot.toml", "swing.toml"]);
    assert!(format!("{}{}", answer.out, answer.err).contains("\"grip\" at 0.03"), "{}{}", answer.out, answer.err);
    assert_eq!(place.flexarm(&["compare", "robot.toml", "swing.toml", "--no-files"]).code, 0);

    for (entry, pieces) in [
        ("grip = 0.3", ["\"grip\"", "0.01 to 0.05"]),
        ("gripp = 0.03", ["\"gripp\"", "did you mean \"grip\"?"]),
        ("weld = 0.0", ["\"weld\"", "is not an independent joint"]),
    ] {
        let text = place.text("robot.toml").replace("grip = 0.03", entry);
        place.write("other.toml", text);
        place.refused(&["compare", "other.toml", "swing.toml"], &pieces);
    }
}

#[test]
fn a_motion_of_joints_that_the_robot_does_not_have_is_refused_with_the_one_meant() {
    let place = Place::new();
    place.write("swing.toml", SWING.replace("[\"swing\"]", "[\"swinge\"]"));
    place.refused(&["compare", "robot.toml", "swing.toml"], &["swing.toml", "\"swinge\"", "did you mean \"swing\"?"]);
}

#[test]
fn a_bare_urdf_is_waived_and_estimated_from_the_command_line_or_the_robot_file() {
    let place = Place::new();
    let text = with(URDF, "ixx=\"0.000288\"", "ixx=\"0.5\"");
    place.write("thin.urdf", &text);
    place.refused(&["inspect", "thin.urdf"], &["triangle inequality", "--waive-inertia"]);
    assert_eq!(place.flexarm(&["inspect", "thin.urdf", "--waive-inertia", "bar"]).code, 0);

    let bare = text.replace("inertial>", "inertia_tensor>");
    let shape = "<link name=\"bar\"><visual><geometry><box size=\"0.4 0.02 0.04\"/></geometry></visual>";
    place.write("bare.urdf", with(&bare, "<link name=\"bar\">", shape));
    place.write("bare.toml", "format = 1\nurdf = \"bare.urdf\"\ninertia_from_density = 2500.0\n");
    // 2500 kg/m3 in 0.4 x 0.02 x 0.04 m
    let mass = |arguments: &[&str]| place.json(arguments)["mass_kg"].as_f64().unwrap();
    let masses = [mass(&["inspect", "bare.toml"]), mass(&["inspect", "bare.urdf", "--inertia-from-density", "2500"])];
    for found in masses {
        assert!((found / 0.8 - 1.0).abs() < 1e-12, "{masses:?}"); // measured 2e-16
    }
    place.write("bare.toml", "format = 1\nurdf = \"bare.urdf\"\ninertia_from_total_mass = 3.0\n");
    assert!((mass(&["inspect", "bare.toml"]) / 3.0 - 1.0).abs() < 1e-12);
    // the command line overrides the file
    assert!((mass(&["inspect", "bare.toml", "--inertia-from-density", "2500"]) / 0.8 - 1.0).abs() < 1e-12);
}

#[test]
fn arguments_of_a_xacro_file_come_from_the_robot_file_and_the_command_line() {
    let place = Place::new();
    let text = with(URDF, "<robot ", "<robot xmlns:xacro=\"http://wiki.ros.org/xacro\" ");
    let text = with(&text, "\"1.728\"", "\"${2 * $(arg half)}\"");
    let first = text.find("<link").unwrap();
    let (head, rest) = text.split_at(first);
    place.write("beam.urdf.xacro", format!("{head}<xacro:arg name=\"half\" default=\"0.864\"/>\n{rest}"));
    place.write("arm.toml", "format = 1\nurdf = \"beam.urdf.xacro\"\nargs = { half = 1 }\n");
    let mass = |arguments: &[&str]| place.json(arguments)["mass_kg"].as_f64().unwrap();
    let plain = mass(&["inspect", "beam.urdf"]);
    assert_eq!(mass(&["inspect", "beam.urdf.xacro"]), plain);
    assert!((mass(&["inspect", "arm.toml"]) - plain - (2.0 - 1.728)).abs() < 1e-12);
    assert!((mass(&["inspect", "arm.toml", "--arg", "half=1.5"]) - plain - (3.0 - 1.728)).abs() < 1e-12);
    assert!((mass(&["inspect", "arm.toml", "--arg", "half:=1.5"]) - plain - (3.0 - 1.728)).abs() < 1e-12);
}
