//! A telescopic column with mimic joints, elastic connections and calibrated joint frames, from the
//! robot file to the identification.

use std::path::{Path, PathBuf};

use flexarm_identify::{Identification, IdentifyRequest, PlanRequest, identify_robot, plan_measurements};
use flexarm_run::{Modelling, Motion, Robot, RunOptions, Scenario};

/// Two tubes that move half of the lift each, and an arm with a mass at its end.
const URDF: &str = include_str!("data/lift.urdf");

/// A folder that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-telescope-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("lift.urdf"), URDF).unwrap();
        Self(folder)
    }

    fn robot(&self, text: &str) -> Result<Robot, flexarm_run::Error> {
        let file = self.0.join("robot.toml");
        std::fs::write(&file, format!("format = 1\nurdf = \"lift.urdf\"\ntcp = {{ link = \"tcp\" }}\n{text}")).unwrap();
        Robot::load(&file)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn elastic(compliance: [f64; 3], play: &str, connection: f64, gear: f64) -> String {
    let law = format!("{{ compliance = {compliance:?}{play} }}");
    let guide = |joint: &str, end: f64| {
        format!(
            "[[drive]]\njoint = \"{joint}\"\nkind = \"gearbox\"\n\
             gearbox = {{ guide = {{ outer_end = {end}, inner_end = 0.0, x = {law}, y = {law} }} }}\n"
        )
    };
    format!(
        "{}{}[[drive]]\njoint = \"foot\"\nkind = \"gearbox\"\ngearbox = {{ stiffness = [{connection}, {connection}, 1e12] }}\n\
         [[drive]]\njoint = \"wrist\"\nkind = \"gearbox\"\ngearbox = {{ stiffness = {gear} }}\n",
        guide("lower", 1.4),
        guide("lift", 2.5)
    )
}

const LAW: [f64; 3] = [1e-6, 4e-7, 3e-7];

/// Truth: the weight's moment times the compliance of each place, C(l) at the two overlaps.
#[test]
fn tubes_connection_and_gear_of_a_lift_deflect_as_their_laws_say() {
    let folder = Folder::new("laws");
    let robot = folder.robot(&elastic(LAW, "", 2e5, 3e4)).unwrap();
    let lift = 1.6;
    let found = robot.model(&Modelling::default()).unwrap().statics(Some(&[lift, 0.0, 0.0]), [0.0; 6]).unwrap();
    let names: Vec<&str> = found.elements.iter().map(|element| element.name.as_str()).collect();
    assert_eq!(names, ["foot.x", "foot.y", "foot.z", "lower.x", "lower.y", "lift.x", "lift.y", "wrist"]);
    let tilt = |name: &str| found.elements.iter().find(|element| element.name == name).unwrap().deflection[0];
    let (weight, hand) = (9.81 * (40.0 * 0.8 + 4.0 * 1.1), 9.81 * 4.0 * 0.2);
    let C = |l: f64| LAW[0] + LAW[1] / l + LAW[2] / (l * l);
    let overlaps = [1.4 - (0.5 * lift + 0.05), 2.5 - lift];
    for (name, truth) in [
        ("foot.y", weight / 2e5),
        ("lower.y", C(overlaps[0]) * weight),
        ("lift.y", C(overlaps[1]) * weight),
        ("wrist", hand / 3e4),
    ] {
        let error = tilt(name) / truth - 1.0;
        eprintln!("{name}: {:.4e} rad, {error:.1e}", tilt(name));
        // The arm sinks and moves out as it tilts: 0.6 % of the moment.
        assert!(error.abs() < 0.01, "{name}: {error:e}");
    }
    // Only tilts: no deflection is along an axis.
    assert!(found.sag_m[2] < 0.0 && found.sag_m[0] > 0.0);
}

/// Truth: the URDF with the frames written into it.
#[test]
fn calibrated_frames_and_zeros_move_the_tcp_as_frames_of_the_urdf_do() {
    let folder = Folder::new("calibration");
    let text = "[[calibration]]\njoint = \"turn\"\nxyz = [0.002, -0.001, 0.003]\nrpy = [0.004, 0.0, 0.0]\nzero = 0.01\n\
                [[calibration]]\njoint = \"lift\"\nzero = -0.004\n";
    let at = |robot: &Robot, q: &[f64]| {
        robot.model(&Modelling::default()).unwrap().statics(Some(q), [0.0; 6]).unwrap().tcp_position_m
    };
    let found = at(&folder.robot(text).unwrap(), &[0.7, 0.3, -0.4]);
    let frame = "<origin xyz=\"0 0 0.2\"/>";
    let urdf = URDF.replace(frame, "<origin xyz=\"0.002 -0.001 0.203\" rpy=\"0.004 0 0\"/>");
    std::fs::write(folder.0.join("lift.urdf"), urdf).unwrap();
    // The lower tube follows the lift as it is commanded.
    let mut truth = at(&folder.robot("").unwrap(), &[0.7, 0.31, -0.4]);
    truth[2] -= 0.004;
    let error = (0..3).map(|k| (found[k] - truth[k]).abs()).fold(0.0, f64::max);
    eprintln!("calibrated frames {error:.1e} m");
    assert!(error < 1e-14, "{error:e}"); // measured 6e-17
}

#[test]
fn wrong_guides_connections_calibrations_and_masses_are_refused_with_place_and_remedy() {
    let folder = Folder::new("refused");
    let drive = |joint: &str, gearbox: &str| {
        format!("[[drive]]\njoint = \"{joint}\"\nkind = \"gearbox\"\ngearbox = {{ {gearbox} }}\n")
    };
    let y = "y = { compliance = [1e-6, 0, 0] }";
    for (text, parts) in [
        (drive("turn", &format!("guide = {{ outer_end = 1, {y} }}")), &["joint \"turn\"", "prismatic"][..]),
        (drive("lift", &format!("guide = {{ outer_end = 1.5, {y} }}")), &["at joint position 2 m", "-0.5000 m"]),
        (
            drive("lift", &format!("stiffness = 1e5, guide = {{ outer_end = 3, {y} }}")),
            &["takes the place of stiffness"],
        ),
        (drive("lift", "guide = { outer_end = 3 }"), &["needs x, y or z"]),
        (drive("foot", "stiffness = 1e5"), &["no such movable joint"]),
        (
            "[[drive]]\njoint = \"foot\"\nkind = \"torque\"\ngearbox = { stiffness = [1e5, 1e5, 1e5] }\n".to_owned(),
            &["the joint is fixed", "kind = \"gearbox\""],
        ),
        ("[[calibration]]\njoint = \"turm\"\nzero = 0.1\n".to_owned(), &["did you mean \"turn\"", "robot.toml:5"]),
        (
            "[[calibration]]\njoint = \"turn\"\nzero = 0.1\n[[calibration]]\njoint = \"turn\"\n".to_owned(),
            &["two [[calibration]]"],
        ),
        ("[[inertial]]\nlink = \"am\"\nmass = 3.0\n".to_owned(), &["link \"am\" is not a link", "robot.toml:5"]),
        ("[[inertial]]\nlink = \"tcp\"\nmass = 3.0\n".to_owned(), &["no mass that could be changed"]),
        ("[[inertial]]\nlink = \"arm\"\nmass = -3.0\n".to_owned(), &["expected a positive number of kg"]),
        ("[[inertial]]\nlink = \"arm\"\ncom = [0.0, nan, 0.0]\n".to_owned(), &["inertial com"]),
        ("[[inertial]]\nlink = \"arm\"\n[[inertial]]\nlink = \"arm\"\n".to_owned(), &["two [[inertial]]"]),
    ] {
        let message = folder.robot(&text).unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    // Beyond the limits the tubes come apart, which is an error of the pose.
    let robot = folder.robot(&elastic(LAW, "", 2e5, 3e4)).unwrap();
    let message =
        robot.model(&Modelling::default()).unwrap().statics(Some(&[2.6, 0.0, 0.0]), [0.0; 6]).unwrap_err().to_string();
    assert!(message.contains("guide \"lift.x\"") && message.contains("overlap by -0.1000 m"), "{message}");
}

/// Writes places of the TCP as a tracker sees it, and returns the poses.
fn measured(folder: &Folder, robot: &Robot, tracker: [f64; 3]) -> Vec<[f64; 3]> {
    let mut table = String::from("lift,turn,wrist,x,y,z\n");
    let poses: Vec<[f64; 3]> = (0..60)
        .map(|k| {
            let k = f64::from(k);
            [1.0 + 0.99 * (0.9 * k).sin(), 2.8 * (0.37 * k).sin(), 2.0 * (1.1 * k).cos()]
        })
        .collect();
    for q in &poses {
        let p = place(robot, q);
        let [x, y, z] = [0, 1, 2].map(|k| p[k] - tracker[k]);
        table += &format!("{},{},{},{x},{y},{z}\n", q[0], q[1], q[2]);
    }
    std::fs::write(folder.0.join("places.csv"), table).unwrap();
    poses
}

fn place(robot: &Robot, q: &[f64; 3]) -> [f64; 3] {
    let found = robot.model(&Modelling::default()).unwrap().statics(Some(q), [0.0; 6]).unwrap();
    [0, 1, 2].map(|k| found.tcp_position_m[k] + found.sag_m[k])
}

fn identified(folder: &Folder, robot: &Robot, fit: &str) -> Identification {
    let file = folder.0.join("measurements.toml");
    let frames = "[instrument.tracker]\n[target.ball]\nxyz = [0, 0, 0]\n";
    let text = format!("format = 1\n{fit}\n{frames}[[place]]\nfile = \"places.csv\"\nstd = 1e-5\n");
    std::fs::write(&file, text).unwrap();
    let output = Some(folder.0.join("out"));
    identify_robot(robot, Path::new(&file), &IdentifyRequest { output, ..IdentifyRequest::default() }).unwrap()
}

/// Truth: the arm that was measured, without noise; the new robot file predicts its places.
#[test]
fn laws_of_tied_guides_and_joint_frames_are_found_from_the_weight_of_the_arm_alone() {
    let folder = Folder::new("identify");
    let play = |gap: f64, width: f64| format!(", play = {{ gap = {gap}, centre = 3.0, width = {width} }}");
    let frames = "[[calibration]]\njoint = \"wrist\"\nxyz = [0.001, 0.0, -0.002]\nzero = 0.003\n";
    let truth = folder.robot(&(elastic([0.0, 0.0, 4e-7], &play(6e-4, 60.0), 2.6e5, 2.1e4) + frames)).unwrap();
    let poses = measured(&folder, &truth, [3.0, -1.0, 0.5]);
    let places: Vec<[f64; 3]> = poses.iter().map(|q| place(&truth, q)).collect();
    let guess = folder.robot(&elastic([0.0, 0.0, 3e-7], &play(4e-4, 40.0), 2e5, 3e4)).unwrap();
    let fit = "fit = [\"drive.*.gearbox.stiffness*\", \"drive.*.guide.*\", \"joint.wrist.*\"]\n\
               keep = [\"drive.foot.gearbox.stiffness[2]\", \"drive.*.guide.*.compliance[0]\", \"drive.*.guide.*.compliance[1]\", \
               \"*.centre\", \"joint.wrist.yaw\", \"joint.wrist.pitch\"]\n\
               tie = [\"drive.*.guide.*.compliance[2]\", \"drive.*.guide.*.gap\", \"drive.*.guide.*.width\"]";
    let found = identified(&folder, &guess, fit);
    for (name, truth) in [
        ("drive.*.guide.*.compliance[2]", 4e-7),
        ("drive.*.guide.*.gap", 6e-4),
        ("drive.*.guide.*.width", 60.0),
        ("drive.foot.gearbox.stiffness[0]", 2.6e5),
        ("drive.wrist.gearbox.stiffness", 2.1e4),
    ] {
        let parameter = found.parameters.iter().find(|parameter| parameter.name == name).unwrap();
        let error = parameter.value / truth - 1.0;
        eprintln!("{name}: {:.6e}, {error:.1e}", parameter.value);
        // measured at most 1.7e-3: few poses are within the transition of the play
        assert!(parameter.identifiable && error.abs() < 5e-3, "{name}: {} {error:e}", parameter.value);
    }
    let written = Robot::load(folder.0.join("out/robot.toml")).unwrap();
    assert_eq!(written.calibration.len(), 1);
    let worst = |robot: &Robot| {
        let offs: Vec<[f64; 3]> = poses
            .iter()
            .zip(&places)
            .map(|(q, p)| {
                let own = place(robot, q);
                [0, 1, 2].map(|k| own[k] - p[k])
            })
            .collect();
        // The tracker's place absorbs a common shift.
        let mean = [0, 1, 2].map(|k| offs.iter().map(|off| off[k]).sum::<f64>() / offs.len() as f64);
        offs.iter().flat_map(|off| [0, 1, 2].map(|k| (off[k] - mean[k]).abs())).fold(0.0, f64::max)
    };
    let [before, after] = [worst(&guess), worst(&written)];
    eprintln!("places off by {before:.1e} m before, {after:.1e} m with the new file");
    assert!(after < 1e-5 && before > 1e-3, "{before:e} {after:e}");
}

/// Truth: the frames of the arm that was measured, without noise; no part of it is elastic.
#[test]
fn joint_frames_of_a_rigid_arm_are_found_without_any_stiffness() {
    let folder = Folder::new("geometry");
    let truth = folder.robot("[[calibration]]\njoint = \"wrist\"\nxyz = [0.001, 0.0, -0.002]\nzero = 0.003\n").unwrap();
    measured(&folder, &truth, [3.0, -1.0, 0.5]);
    let nominal = folder.robot("").unwrap();
    let found = identified(&folder, &nominal, "fit = [\"joint.wrist.x\", \"joint.wrist.z\", \"joint.wrist.zero\"]");
    let parameter = |name: &str| found.parameters.iter().find(|parameter| parameter.name == name).unwrap();
    for (name, truth) in [("joint.wrist.x", 0.001), ("joint.wrist.zero", 0.003)] {
        let (value, error) = (parameter(name).value, (parameter(name).value - truth).abs());
        eprintln!("{name}: {value:.6e}, off by {error:.1e}");
        assert!(parameter(name).identifiable && error < 0.02 * parameter(name).std, "{name}: {value} {error:e}");
    }
    // The height of the tracker, which is not known, hides that of the wrist.
    assert!(!parameter("joint.wrist.z").identifiable);
    let written = Robot::load(folder.0.join("out/robot.toml")).unwrap();
    assert_eq!(written.calibration.len(), 1);
    let file = folder.0.join("measurements.toml");
    let text = std::fs::read_to_string(&file).unwrap().replace("fit = ", "keep = ");
    std::fs::write(&file, text).unwrap();
    let message = identify_robot(&nominal, &file, &IdentifyRequest::default()).unwrap_err().to_string();
    assert!(message.contains("no stiffness to identify") && message.contains("joint.*"), "{message}");
    // Loads displace nothing, so no plan is of use.
    let request = PlanRequest { fit: vec!["joint.*".into()], ..PlanRequest::new(8) };
    let message = plan_measurements(&nominal, &request).unwrap_err().to_string();
    assert!(message.contains("there is nothing to plan"), "{message}");
}

/// Truth: the same energy in two ways; the lift moves through the reaction of its guides.
#[test]
fn a_run_of_a_lift_balances_its_energy() {
    let folder = Folder::new("run");
    let robot = folder.robot(&elastic(LAW, ", play = { gap = 1e-3, width = 80.0 }", 2e5, 3e4)).unwrap();
    let ramp = |t: f64| (t / 1.2).powi(3) * (10.0 - 15.0 * t / 1.2 + 6.0 * (t / 1.2).powi(2));
    let times: Vec<f64> = (0..=1200).map(|k| 1e-3 * f64::from(k)).collect();
    let joints: Vec<f64> = times.iter().flat_map(|t| [0.3 + 1.4 * ramp(*t), 0.8 * ramp(*t), 0.0]).collect();
    let motion = Motion::from_samples(&times, &joints, &robot).unwrap();
    let options = RunOptions { step_s: 5e-4, log_rate_hz: 2000.0, ..RunOptions::default() };
    let arm = robot.model(&Modelling::default()).unwrap();
    let summary = arm.simulate(Scenario::new(motion), &options).unwrap().summary;
    let energy = &summary.energy;
    eprintln!("{:?} peak {:?}", energy, summary.tcp.as_ref().map(|tcp| tcp.peak_m));
    assert!(energy.imbalance < 1e-3, "{energy:?}");
    let drives: Vec<(&str, bool)> =
        summary.elastic_drives.iter().map(|drive| (drive.joint.as_str(), drive.slides)).collect();
    assert_eq!(drives, [("lower", false), ("lift", false), ("foot", false), ("wrist", false)]);
}
