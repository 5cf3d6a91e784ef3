//! Caveats that `check` reports for a robot, a motion and loads are also reported by everything
//! that uses them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use flexarm::compensate::{CompensateRequest, compensate_motion};
use flexarm::lobes::{CuttingPlace, CuttingTool, LobesRequest, lobes};
use flexarm::map::{JointRange, MapRegion, MapRequest, map};
use flexarm::motions::{MotionOptions, motion_report};
use flexarm::poses::ResponseRequest;
use flexarm::robots::check_with_loads;
use flexarm::sensitivity::{SensitivityRequest, pose_sensitivity, sensitivity};
use flexarm::{Finding, LoadOptions, Modelling, Motion, Robot, RunOptions, Scenario, inspect};

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(path)
}

/// A folder that is removed at the end.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

/// Codes of warnings.
fn codes(caveats: &[Finding]) -> BTreeSet<String> {
    caveats.iter().filter(|c| c.warns() && c.code != "missing-mesh").map(|c| c.code.clone()).collect()
}

/// The KR 210 with one drive in N m/deg, without damping in the next, on a motion that is far too
/// fast for it.
fn odd_robot(folder: &Folder) -> (PathBuf, PathBuf) {
    let text = std::fs::read_to_string(project("robots/kr210/drives.toml")).unwrap();
    let urdf = project("robots/kr210/kr210.urdf").canonicalize().unwrap();
    let motion = project("trajectories/pick_and_place.toml").canonicalize().unwrap();
    let text = text
        .replace("\"kr210.urdf\"", &format!("{urdf:?}"))
        .replace("\"../../trajectories/pick_and_place.toml\"", &format!("{motion:?}"))
        .replace("3376721.9", "58935.0")
        .replace("damping = 1232.3", "damping = 0.0");
    (folder.write("robot.toml", &text), motion)
}

const POSE: [f64; 6] = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];

#[test]
fn every_command_with_a_pose_says_of_a_robot_what_check_says() {
    let folder = Folder::new("said-at-poses");
    let (file, _) = odd_robot(&folder);
    let findings = check_with_loads(&file, None, None, &LoadOptions::default());
    let told: BTreeSet<String> =
        findings.iter().filter(|f| f.warns() && f.code != "missing-mesh").map(|f| f.code.clone()).collect();
    // The first two are caveats of the robot, the last one of the arm at its pose.
    for code in ["gear-stiffness", "no-damping", "gear-rotation"] {
        assert!(told.contains(code), "{told:?}");
    }
    let robot = Robot::load(&file).unwrap();
    let modelling = Modelling::default();
    let says = |what: &str, caveats: &[Finding], warnings: &[String]| {
        let said = codes(caveats);
        assert!(told.is_subset(&said), "{what} does not say {:?}", told.difference(&said));
        let sentences: Vec<String> = caveats.iter().filter(|c| c.warns()).map(|c| c.message.clone()).collect();
        assert_eq!(sentences, warnings, "{what}");
    };
    let found = robot.model(&modelling).unwrap().statics(Some(&POSE), [0.0; 6]).unwrap();
    says("statics", &found.caveats, &found.warnings);
    let found = robot.model(&modelling).unwrap().modes(Some(&POSE), None, 4).unwrap();
    says("modes", &found.caveats, &found.warnings);
    let request = ResponseRequest { points: 10, ..ResponseRequest::default() };
    let found = robot.model(&modelling).unwrap().response(Some(&POSE), &request).unwrap();
    says("response", &found.caveats, &found.warnings);
    let found = inspect(&robot, Some(&POSE), None).unwrap();
    says("inspect", &found.caveats, &found.warnings);
    let found = pose_sensitivity(&robot, modelling, Some(&POSE), &["payload.mass".to_owned()]).unwrap();
    says("sensitivity at a pose", &found.caveats, &found.warnings);
    let joint = JointRange { joint: "joint_2".into(), range: [-1.3, -1.1], points: 2 };
    let request = MapRequest {
        region: MapRegion::Joints(vec![joint]),
        at: Some(POSE.to_vec()),
        frequencies: Some(0),
        ..MapRequest::default()
    };
    let found = map(&robot, &request, &mut |_, _| std::ops::ControlFlow::Continue(())).unwrap();
    says("map", &found.caveats, &found.warnings);
    let tool = CuttingTool::load(project("robots/tools/endmill_20mm.toml")).unwrap().at_speeds(vec![8000.0]);
    let request = LobesRequest::default();
    let found = lobes(&robot, &tool, &CuttingPlace::At(Some(&POSE)), &request, &|_, _| true).unwrap();
    says("lobes", &found.caveats, &found.warnings);
}

#[test]
fn every_command_with_a_motion_says_of_it_and_of_its_loads_what_check_says() {
    let folder = Folder::new("said-along-motions");
    let (file, motion) = odd_robot(&folder);
    let loads = folder
        .write("loads.toml", "format = 1\n[[load]]\nkind = \"sine\"\nforce = [50, 0, 0]\nfrequency = 2\nphase = 90\n");
    let findings = check_with_loads(&file, Some(&motion), Some(&loads), &LoadOptions::default());
    let told: BTreeSet<String> =
        findings.iter().filter(|f| f.warns() && f.code != "missing-mesh").map(|f| f.code.clone()).collect();
    for code in ["gear-stiffness", "no-damping", "gear-rotation", "angle"] {
        assert!(told.contains(code), "{told:?}");
    }
    let robot = Robot::load(&file).unwrap();
    let own = Motion::load(&motion, &robot).unwrap();
    let scenario = Scenario::new(own.clone()).with_loads_file(&loads).unwrap();
    let says = |what: &str, caveats: &[Finding], warnings: &[String]| {
        let said = codes(caveats);
        assert!(told.is_subset(&said), "{what} does not say {:?}", told.difference(&said));
        assert_eq!(warnings.len(), caveats.iter().filter(|c| c.warns()).count(), "{what}");
    };
    let run = RunOptions { step_s: 0.004, ..RunOptions::default() };
    let found = robot.model(&Modelling::default()).unwrap().simulate(&scenario, &run).unwrap().summary;
    says("compare", &found.caveats, &found.warnings);
    let request = SensitivityRequest {
        parameters: vec!["payload.mass".into()],
        run: run.clone(),
        ..SensitivityRequest::default()
    };
    let found = sensitivity(&robot, &scenario, &request).unwrap();
    says("sensitivity", &found.caveats, &found.warnings);
    let request = CompensateRequest { iterations: 1, sweep: false, run, ..CompensateRequest::default() };
    let found = compensate_motion(&robot, &scenario, &request).unwrap();
    says("compensate", &found.caveats, &found.warnings);

    // Without the loads: maps and lobes along the motion, and the motion itself.
    let told: BTreeSet<String> = told.into_iter().filter(|code| code != "angle").collect();
    let request = MapRequest {
        region: MapRegion::Along { motion: Box::new(own.clone()), points: 3 },
        frequencies: Some(0),
        ..MapRequest::default()
    };
    let found = map(&robot, &request, &mut |_, _| std::ops::ControlFlow::Continue(())).unwrap();
    assert!(told.is_subset(&codes(&found.caveats)), "{told:?} {:?}", found.warnings);
    let report = motion_report(&motion, Some(&robot), &MotionOptions::default(), &[], 100.0, false).unwrap();
    assert!(report.warnings.iter().any(|text| text.contains("deflects by")), "{:?}", report.warnings);
    assert!(report.warnings.iter().any(|text| text.contains("a damping of 0")), "{:?}", report.warnings);
}
