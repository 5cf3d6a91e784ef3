//! Robots of one and two joints, as texts.

use std::path::Path;

use flexarm_run::{Description, Error, LoadOptions, Robot, RobotSource};

const TWO_JOINTS: &str = r#"<robot name="two">
  <link name="base"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="5" effort="10"/></joint>
  <link name="upper"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="b" type="revolute"><parent link="upper"/><child link="fore"/><axis xyz="0 0 1"/><origin xyz="0.6 0 0"/>
    <limit lower="-3" upper="3" velocity="5" effort="5"/></joint>
  <link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;

const LIFT: &str = r#"<robot name="lift">
  <link name="base"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="0 0 1"/>
    <limit lower="0.1" upper="1.2" velocity="5" effort="1000"/></joint>
  <link name="carriage"><inertial><mass value="2"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;

fn load(urdf: &str, tcp: &str, text: &str) -> Result<Robot, Error> {
    let text = format!("format = 1\nurdf = \"arm.urdf\"\ntcp = {{ link = \"{tcp}\" }}\n{text}");
    let (path, options, description) =
        (Path::new("robot.toml"), &LoadOptions::default(), Some(Description::Text(urdf)));
    let source = RobotSource { text: Some(&text), description, ..RobotSource::new(path, options) };
    source.load().map(|arm| arm.robot().clone())
}

/// Two joints `a` and `b` about z, with effort limits of 10 and 5 N m.
pub(crate) fn two_joints(text: &str) -> Result<Robot, Error> {
    load(TWO_JOINTS, "fore", text)
}

/// A sliding joint `lift` along z, from 0.1 to 1.2 m.
pub(crate) fn lift(text: &str) -> Result<Robot, Error> {
    load(LIFT, "carriage", text)
}

/// What a robot file is refused for, without the place in the file.
pub(crate) fn refusal(found: Result<Robot, Error>) -> String {
    match found {
        Err(Error::RobotFile(error)) => error.message,
        other => panic!("{other:?}"),
    }
}
