//! `flexarm new` as a program: files, answer, exit codes.

use crate::common::Place;

/// A box of 0.5 m on a vertical axis, another one on a horizontal axis.
pub(crate) const ARM: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0.25 0 0"/><mass value="6"/><inertia ixx="0.02" iyy="0.13" izz="0.13" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></visual>
  </link>
  <link name="fore">
    <inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.004" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="tool0"/>
  <joint name="a1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="200" velocity="2"/></joint>
  <joint name="a2" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="80" velocity="2"/></joint>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="tool0"/><origin xyz="0.4 0 0"/></joint>
</robot>"#;

#[test]
fn new_writes_a_robot_that_runs_and_answers_with_its_keys() {
    let place = Place::new();
    place.write("two.urdf", ARM);
    let answer = place.json(&["new", "two.urdf", "-o", "made", "--payload", "3"]);
    for key in [
        "robot",
        "motion",
        "urdf",
        "base",
        "tool",
        "chain",
        "joints",
        "held",
        "links",
        "drives",
        "assumptions",
        "findings",
        "files",
        "summary",
    ] {
        assert!(answer.get(key).is_some(), "{key}");
    }
    assert_eq!(answer["drives"].as_array().unwrap().len(), 2);
    assert_eq!(answer["links"][0]["section"], "box");
    assert!(answer["summary"]["tcp"]["peak_m"].as_f64().unwrap() > 1e-5);
    assert!(answer["findings"].as_array().unwrap().iter().all(|f| f["severity"] == "note"), "{}", answer["findings"]);
    assert!(place.path("made/first_run/report.html").is_file());
    assert_eq!(place.flexarm(&["check", "made"]).code, 0);
    // Existing files are kept.
    place.refused(&["new", "two.urdf", "-o", "made", "--no-run"], &["--force", "exists already"]);
    let forced = place.flexarm(&["new", "two.urdf", "-o", "made", "--no-run", "--force"]);
    assert_eq!(forced.code, 0, "{}", forced.err);
    assert!(forced.out.contains("box 100 x 100 mm") && forced.out.contains("assumed"), "{}", forced.out);
}

/// Truth: at 80 N m of rated torque a cycloidal reducer is some twice as stiff as a strain-wave gear.
#[test]
fn an_arm_gets_reducers_of_the_kind_that_is_asked_for() {
    let place = Place::new();
    place.write("two.urdf", ARM);
    let drive = |more: &[&str]| {
        let line = [&["new", "two.urdf", "-o", "made", "--no-run", "--force"], more].concat();
        place.json(&line)["drives"][0].clone()
    };
    let [usual, strain, cycloidal] =
        [drive(&[]), drive(&["--reducers", "strain-wave"]), drive(&["--reducers", "cycloidal"])];
    assert_eq!(usual, strain);
    assert!(strain["source"].as_str().unwrap().starts_with("strain-wave gears"), "{strain}");
    assert!(cycloidal["source"].as_str().unwrap().starts_with("cycloidal reducers"), "{cycloidal}");
    let ratio = cycloidal["stiffness"].as_f64().unwrap() / strain["stiffness"].as_f64().unwrap();
    assert!((2.0..3.0).contains(&ratio), "{ratio}");
}

#[test]
fn new_says_how_to_go_on_where_it_cannot() {
    let place = Place::new();
    place.write("two.urdf", ARM.replace("inertial", "sensor"));
    place.refused(
        &["new", "two.urdf", "-o", "made"],
        &["no link of the arm has a mass", "--inertia-from-total-mass KG"],
    );
    place.refused(&["new", "two.urdf", "--tool", "tool1", "--mass", "9"], &["did you mean \"tool0\"?"]);
    place.refused(&["new", "robot.toml"], &["already a robot file"]);
    place.refused(&["new", "none.urdf"], &["none.urdf", "no such file"]);
    let answer = place.json(&["new", "two.urdf", "-o", "made", "--inertia-from-total-mass", "12", "--no-run"]);
    assert!(answer["summary"].is_null());
    assert!((answer["moving_mass_kg"].as_f64().unwrap() / 12.0 - 1.0).abs() < 1e-9);
}
