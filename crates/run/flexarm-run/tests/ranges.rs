//! Unrealistic numbers are refused where they are given, with their location, and never cause a
//! panic.

use std::path::{Path, PathBuf};

use flexarm_run::{
    Description, Error, LoadOptions, Modelling, Motion, PayloadChange, Robot, RobotSource, RunOptions, Scenario,
};
use flexarm_stepping::StepperKind;
use toml::de::{DeTable, DeValue};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

/// Two short links on torque drives with a spring in the second gear; the second joint drives a
/// third.
const ARM: &str = r#"<robot name="small">
  <link name="base"/>
  <link name="a"><inertial><origin xyz="0 0 0.1"/><mass value="1.0"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="b"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
    <inertia ixx="0.005" iyy="0.005" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="c"><inertial><origin xyz="0 0 0.05"/><mass value="0.2"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j1" type="continuous"><parent link="base"/><child link="a"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/></joint>
  <joint name="j2" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/></joint>
  <joint name="j3" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>MIMIC</joint>
</robot>"#;

const FILE: &str = r#"format = 1
urdf = "small.urdf"
[tcp]
link = "c"
xyz = [0.0, 0.0, 0.1]
[[drive]]
joint = "j1"
kind = "torque"
motor_inertia = 1e-4
ratio = 50.0
[[drive]]
joint = "j2"
kind = "torque"
motor_inertia = 1e-4
ratio = 50.0
gearbox = { stiffness = 1e4, damping = 1.0 }
"#;

fn small(mimic: bool) -> Robot {
    let follows = if mimic { "<mimic joint=\"j1\" multiplier=\"-1\"/>" } else { "" };
    let urdf = ARM.replace("MIMIC", follows);
    let (path, options, description) =
        (Path::new("small/robot.toml"), &LoadOptions::default(), Some(Description::Text(&urdf)));
    let source = RobotSource { text: Some(FILE), description, ..RobotSource::new(path, options) };
    source.load().unwrap().robot().clone()
}

fn run(robot: &Robot, payload: PayloadChange, stepper: StepperKind) -> Result<(), Error> {
    let n = robot.rigid_model().unwrap().n_actuated();
    let motion = Motion::from_samples(&[0.0, 0.02], &vec![0.3; 2 * n], robot).unwrap();
    let scenario = Scenario::new(motion).with_payload(payload);
    let options = RunOptions { step_s: 1e-3, stepper, ..RunOptions::default() };
    robot.model(&Modelling::default())?.simulate(&scenario, &options).map(|_| ())
}

#[test]
fn a_payload_that_no_arm_carries_is_refused_with_its_unit() {
    let robot = small(false);
    for (mass, com, words) in [(1e15, 0.1, "1e15 kg"), (1.0, 1e6, "1e6 m"), (1.0, -1e6, "-1e6 m")] {
        let payload = PayloadChange::attach(0.01, mass, [0.0, 0.0, com].into());
        let error = run(&robot, payload, StepperKind::default()).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("at most"), "{error}");
    }
}

/// The heaviest and farthest payload that is accepted: a hundred million times the arm. It runs or
/// stops with time and cause.
#[test]
fn a_run_whose_mass_matrix_cannot_be_factorised_stops_with_its_time() {
    for mimic in [false, true] {
        let robot = small(mimic);
        for stepper in [StepperKind::default(), StepperKind::Rk4, StepperKind::Sdirk3] {
            for (mass, com) in [(1e7, 1e4), (1e7, 1.0), (1e-9, 1e4)] {
                let payload = PayloadChange::attach(0.01, mass, [com, 0.0, com].into());
                if let Err(error) = run(&robot, payload, stepper) {
                    assert!(matches!(error, Error::Step { .. }), "{error}");
                    assert!(error.to_string().contains("t = ") || error.to_string().contains("is unstable"), "{error}");
                }
            }
        }
    }
}

#[test]
fn a_pose_and_a_force_that_no_arm_meets_are_refused() {
    let robot = Robot::load(root().join("robots/kr210")).unwrap();
    let told = |at: [f64; 6], force: [f64; 6]| {
        robot.model(&Modelling::default()).unwrap().statics(Some(&at), force).map(|_| ()).unwrap_err().to_string()
    };
    assert!(told([1e9, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 6]).contains("joint_1"));
    assert!(told([0.0; 6], [1e12, 0.0, 0.0, 0.0, 0.0, 0.0]).contains("1e12 N"));
}

/// Positions of all numbers in the text of a file.
fn numbers(value: &DeValue<'_>, span: std::ops::Range<usize>, found: &mut Vec<std::ops::Range<usize>>) {
    match value {
        DeValue::Float(_) => found.push(span),
        DeValue::Array(all) => all.iter().for_each(|x| numbers(x.get_ref(), x.span(), found)),
        DeValue::Table(table) => table.iter().for_each(|(_, x)| numbers(x.get_ref(), x.span(), found)),
        _ => {}
    }
}

#[test]
fn every_number_of_a_robot_file_is_refused_when_it_is_huge_or_none() {
    let (mut tried, options) = (0, LoadOptions::default());
    for robot in ["kr210", "test/reference_arm", "palletiser"] {
        let path = root().join("robots").join(robot).join("robot.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        let mut places = Vec::new();
        let table = DeTable::parse(&text).unwrap();
        table.get_ref().iter().for_each(|(_, x)| numbers(x.get_ref(), x.span(), &mut places));
        for place in places {
            for bad in ["1e40", "-1e40", "nan", "inf"] {
                let mut wrong = text.clone();
                wrong.replace_range(place.clone(), bad);
                let source = RobotSource { text: Some(&wrong), ..RobotSource::new(&path, &options) };
                let error = source.load().map(|_| ()).unwrap_err().to_string();
                assert!(error.contains("robot.toml:"), "{bad} for {}: {error}", &text[place.clone()]);
                tried += 1;
            }
        }
    }
    assert!(tried > 200, "{tried}");
}
