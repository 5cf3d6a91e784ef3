//! Limits of the model of a link: few modes, rigid parts of castings, large deflections.

use std::path::{Path, PathBuf};

use flexarm_run::{Description, *};

/// A bar of 4 m on a vertical axis without gravity, with a tool of 2 kg at its end.
fn turning_bar(modes: usize) -> Robot {
    let urdf = r#"<robot name="arm"><link name="base"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="bar"/><axis xyz="0 0 1"/>
    <limit velocity="20" effort="100000"/></joint>
  <link name="bar"/>
  <joint name="bolts" type="fixed"><parent link="bar"/><child link="tool"/><origin xyz="4 0 0"/></joint>
  <link name="tool"><inertial><mass value="2"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;
    let text = format!(
        "format = 1\nurdf = \"arm.urdf\"\ngravity = [0.0, 0.0, 0.0]\ntcp = {{ link = \"tool\" }}\n[[flexible_link]]\nlink = \
         \"bar\"\ndistal = \"bolts\"\nmodel = \"modal\"\nmodes = {modes}\ngeometric_stiffening = true\ndamping = {{ modal = \
         0.01 }}\nbeam = {{ section = \"rectangle\", width = 0.03, height = 0.03, material = \"aluminium\" }}"
    );
    let (path, options, description) =
        (Path::new("robot.toml"), &LoadOptions::default(), Some(Description::Text(urdf)));
    let source = RobotSource { text: Some(&text), description, ..RobotSource::new(path, options) };
    source.load().unwrap().robot().clone()
}

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots").join(name)
}

/// Truth: the same bar with 40 modes. The caveat is said wherever a frequency is off by 2 %, and not
/// from 16 modes on.
#[test]
fn too_few_modes_of_a_turning_link_are_a_caveat_and_enough_are_none() {
    let table =
        |modes: usize| turning_bar(modes).model(&Modelling::default()).unwrap().modes(None, Some(&[15.0]), 8).unwrap();
    let truth = table(40).frequencies_hz;
    let mut said = [0, 0];
    for modes in [2, 4, 8, 16, 32] {
        let found = table(modes);
        let errors = found.frequencies_hz.iter().zip(&truth).map(|(hz, truth)| (hz / truth - 1.0).abs());
        let error = errors.fold(0.0, f64::max);
        let is_said = found.caveats.iter().any(|caveat| caveat.code == "few-modes");
        println!("{modes} modes: {error:.1e} off, said {is_said}");
        assert!(error < 0.02 || is_said, "{modes} modes: {error:.1e}");
        assert!(modes < 16 || !is_said, "{modes} modes: {error:.1e}");
        said[usize::from(is_said)] += 1;
    }
    assert!(said[0] > 0 && said[1] > 0, "{said:?}");
    // At rest there is nothing to couple the modes.
    let rest = turning_bar(2).model(&Modelling::default()).unwrap().modes(None, None, 8).unwrap();
    assert!(!rest.caveats.iter().any(|caveat| caveat.code == "few-modes"));
}

/// Truth: the modes of the mesh in the `.flex` file. The casting of the forearm keeps an error of its
/// sag with any number of parts (docs/theory.md, section 7); straight bars do not.
#[test]
fn rigid_parts_that_do_not_converge_to_their_casting_are_a_caveat_of_every_verb() {
    let robot = Robot::load(shipped("kr210")).unwrap();
    let parts = |n: usize| Modelling { links: LinkModel::Lumped, segments: Some(n), ..Modelling::default() };
    let said =
        |caveats: &[Finding]| caveats.iter().find(|c| c.code == "parts-off" && c.location.contains("link_3")).cloned();
    let arm = robot.model(&parts(8)).unwrap();
    let q = robot.start_pose().unwrap();
    let found = said(&arm.statics(None, [0.0; 6]).unwrap().caveats).unwrap();
    println!("{}", found.message);
    assert!(found.value.unwrap() > 0.04 && found.help.contains("modal"), "{found:?}");
    assert!(said(&arm.modes(Some(&q), None, 3).unwrap().caveats).is_some());
    assert!(said(&arm.caveats(flexarm_run::caveat::Use::Any)).is_some());
    let modal = robot.model(&Modelling { links: LinkModel::Modal, ..Modelling::default() }).unwrap();
    assert!(said(&modal.caveats(flexarm_run::caveat::Use::Any)).is_none());
    for bar in ["test/one_beam/mesh.toml", "test/three_beams/mesh.toml"] {
        let robot = Robot::load(shipped(bar)).unwrap();
        for n in [2, 3, 5] {
            let arm = robot.model(&parts(n)).unwrap();
            assert!(!arm.findings.iter().any(|caveat| caveat.code == "parts-off"), "{bar} {n}: {:?}", arm.findings);
        }
    }
}

/// Truth: a quarter of the step fails as well.
#[test]
fn an_iteration_that_fails_far_beyond_small_deflections_blames_the_model_and_not_the_step() {
    let folder = std::env::temp_dir().join(format!("flexarm-model-limits-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("motion.toml");
    let text = "format = 1\nunit = \"deg\"\njoints = [\"turn\"]\nstart = [0.0]\nprofile = \"quintic\"\n[[move]]\nto = \
                [660.0]\nduration = 2.0\nhold = 1.0\n";
    std::fs::write(&path, text).unwrap();
    let robot = turning_bar(6);
    let motion = Motion::load(&path, &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    for step_s in [1e-3, 2.5e-4] {
        let options = RunOptions { step_s, ..RunOptions::default() };
        let error = arm.simulate(&motion, &options).unwrap_err().to_string();
        assert!(error.contains("the model has ended") && error.contains("\"bar\""), "{step_s}: {error}");
        assert!(!error.contains("try a smaller"), "{step_s}: {error}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Truth: the motion of the robot file.
#[test]
fn an_arm_stands_at_the_start_of_its_own_motion_by_default() {
    let robot = Robot::load(shipped("kr210")).unwrap();
    let motion = Motion::load(robot.default_trajectory.as_ref().unwrap(), &robot).unwrap();
    let mut q = vec![0.0; 6];
    motion.trajectory.sample(0.0, &mut q, &mut [0.0; 6], &mut [0.0; 6]);
    assert!(q.iter().any(|q| *q != 0.0));
    let arm = robot.model(&Modelling::default()).unwrap();
    assert_eq!(robot.start_pose().unwrap(), q);
    assert_eq!(arm.statics(None, [0.0; 6]).unwrap().at, q);
    assert_eq!(robot.model(&Modelling::default()).unwrap().statics(None, [0.0; 6]).unwrap().at, q);
    assert_eq!(arm.modes(None, None, 1).unwrap().at, q);
    assert_eq!(inspect(&robot, None, None).unwrap().q, q);
}
