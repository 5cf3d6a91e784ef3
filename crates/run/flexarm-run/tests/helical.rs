//! A SCARA whose quill moves along a thread as it turns: from the robot file to statics, runs with
//! every stepper and recordings.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use flexarm_kinematics::Wrench;
use flexarm_run::{LinkModel, Modelling, Motion, Robot, RunOptions, inspect};
use flexarm_stepping::{ReferenceSettings, SpookSettings, StepperKind};

/// Lead of the thread (m per turn).
const LEAD: f64 = 0.05;
/// Stiffness of the gearbox at the quill (N m/rad).
const GEAR: f64 = 900.0;

const ROBOT: &str = r#"
format = 1
urdf = "scara.urdf"
tcp = { link = "tip", xyz = [0.0, 0.0, -0.2] }
lead = { quill = 0.05 }

[[flexible_link]]
link = "upper"
distal = "elbow"
beam = { section = "box", width = 0.06, height = 0.08, wall = 0.004, material = "aluminium", parts = "uniform" }

[[drive]]
joint = "quill"
kind = "gearbox"
gearbox = { stiffness = 900.0, damping = 0.5 }
"#;

struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-helical-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let urdf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/golden/scara.urdf");
        std::fs::copy(urdf, folder.join("scara.urdf")).unwrap();
        Self(folder)
    }

    fn robot(&self, text: &str) -> Result<Robot, flexarm_run::Error> {
        std::fs::write(self.0.join("robot.toml"), text).unwrap();
        Robot::load(&self.0)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Truth: a force F along the spindle rotates its spring by F p/k and moves the TCP by F p²/k along
/// the spindle, with p the lead over 2π.
#[test]
fn a_force_along_the_spindle_turns_its_spring() {
    let place = Place::new("statics");
    let weightless = ROBOT.replace("format = 1", "format = 1\ngravity = [0.0, 0.0, 0.0]");
    let robot = place.robot(&weightless).unwrap();
    let modelling = Modelling { links: LinkModel::Rigid, ..Modelling::default() };
    let mut at = robot.model(&modelling).unwrap().operating_point().unwrap();
    at.solve(&[0.3, -0.4, 0.1, 2.0], &Wrench::zeros()).unwrap();
    let C = at.compliance();
    // Only the spring is elastic, along S = (p a; a) moved to the TCP: rank one, with 1/k in its
    // rotational block.
    let turning = C.fixed_view::<3, 3>(3, 3).into_owned();
    assert!((turning.trace() * GEAR - 1.0).abs() < 1e-9, "{}", turning.trace() * GEAR);
    let axis = turning.symmetric_eigen();
    let a = axis.eigenvectors.column(axis.eigenvalues.imax()).into_owned();
    let along = (a.transpose() * C.fixed_view::<3, 3>(0, 0) * a)[0];
    let p = LEAD / TAU;
    assert!((along * GEAR / (p * p) - 1.0).abs() < 1e-8, "{along}"); // measured 1e-12
}

/// Second algorithm: all steppers compared with the reference, with a flexible link and a spring
/// behind the thread.
#[test]
fn every_stepper_runs_a_robot_with_a_helical_joint() {
    let place = Place::new("runs");
    let robot = place.robot(ROBOT).unwrap();
    let told = inspect(&robot, None, None).unwrap();
    let kinds: Vec<&str> = told.joints.iter().map(|j| j.kind).collect();
    assert_eq!(kinds, ["revolute", "revolute", "prismatic", "helical"]);

    let t: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
    let swing = |t: f64| 0.5 * (1.0 - (std::f64::consts::PI * t).cos());
    let q: Vec<f64> = t.iter().flat_map(|t| [0.5, -0.4, 0.1, 4.0].map(|q| q * swing(*t))).collect();
    let motion = Motion::from_samples(&t, &q, &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let error = |stepper: StepperKind, step_s: f64| {
        let options = RunOptions { stepper, step_s, log_rate_hz: 100.0, ..RunOptions::default() };
        arm.simulate(&motion, &options).unwrap().error_world_m().to_vec()
    };
    let truth = error(StepperKind::Reference(ReferenceSettings::new(1e-9)), 1e-3);
    let largest = truth.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    assert!(largest > 1e-5, "{largest}");
    for (stepper, step_s, bound) in [
        (RunOptions::default().stepper, 1e-3, 2e-2),
        (StepperKind::Rk4, 5e-5, 1e-4),
        (StepperKind::Spook(SpookSettings::default()), 1e-4, 5e-2),
    ] {
        let found = error(stepper, step_s);
        let worst = truth.iter().zip(&found).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        eprintln!("{:<18} {:.1e} of {largest:.1e} m", stepper.name(), worst / largest);
        assert!(worst < bound * largest, "{}: {worst} of {largest}", stepper.name());
    }
    // The weight carried by the quill loads its spring.
    assert!(
        robot
            .model(&Modelling::default())
            .unwrap()
            .statics(None, [0.0; 6])
            .unwrap()
            .sag_m
            .iter()
            .all(|x| x.is_finite())
    );
}

#[test]
fn a_lead_is_refused_where_nothing_turns_and_without_a_length() {
    let place = Place::new("refused");
    let message = |lead: &str| {
        let text = ROBOT.replace("lead = { quill = 0.05 }", lead);
        place.robot(&text).map(|_| "loaded").unwrap_err().to_string()
    };
    let slides = message("lead = { lift = 0.05 }");
    assert!(slides.contains("lift") && slides.contains("quill"), "{slides}");
    let zero = message("lead = { quill = 0.0 }");
    assert!(zero.contains("metres per turn"), "{zero}");
    assert!(message("lead = { quill = nan }").contains("NaN"));
}
