//! Closed loops of robot files: the shipped palletiser compared with closed forms, its runs, and
//! the messages of refusals.

use std::path::{Path, PathBuf};

use flexarm_kinematics::Wrench;
use flexarm_run::{LinkModel, LoadOptions, Modelling, Motion, Robot, RobotLoop, RunOptions, check, inspect};
use flexarm_stepping::StepperKind;

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(path)
}

fn palletiser() -> Robot {
    Robot::load(project("robots/palletiser")).unwrap()
}

/// Values of joint_1 to joint_4.
const PLACES: [[f64; 4]; 3] = [[0.3, 0.5, 0.8, -0.4], [-1.2, -0.1, 0.9, 2.0], [2.0, 0.9, 0.7, 0.0]];

/// In the order of the tree, where the crank comes after everything that the lower arm carries.
fn order([turn, lower, crank, tool]: [f64; 4]) -> [f64; 4] {
    [turn, lower, tool, crank]
}

/// Truth: opposite sides stay parallel. Lower arm and upper arm position the TCP, each by its own
/// driving joint, the hand stays level, and a weight at the TCP is carried according to virtual
/// work. Measured 1.3e-15 m, 4e-16 and 1.9e-15 of the weight.
#[test]
fn the_palletiser_stands_and_holds_as_its_parallelograms_say() {
    let robot = palletiser();
    let mut empty = robot.clone();
    empty.rigid.links.iter_mut().filter(|l| l.name == "__payload").for_each(|l| l.inertia = None);
    for at in PLACES {
        let seen = inspect(&robot, Some(&order(at)), None).unwrap();
        assert_eq!(
            seen.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(),
            ["joint_1", "joint_2", "joint_4", "joint_3"]
        );
        let out = 0.3 + 1.28 * at[1].sin() + 1.35 * at[2].cos() + 0.22;
        let up = 0.81 + 1.28 * at[1].cos() - 1.35 * at[2].sin() - 0.25 - 0.03 - 0.45;
        let truth = [out * at[0].cos(), out * at[0].sin(), up];
        let off = (0..3).map(|k| (seen.tcp.position_m[k] - truth[k]).abs()).fold(0.0, f64::max);
        let [_, x, y, _] = seen.tcp.quaternion_wxyz;
        let bare = inspect(&empty, Some(&order(at)), None).unwrap();
        let weight = 180.0 * 9.81;
        let held = order([0.0, -weight * 1.28 * at[1].sin(), -weight * 1.35 * at[2].cos(), 0.0]);
        let miss =
            (0..4).map(|k| (seen.gravity_torque[k] - bare.gravity_torque[k] - held[k]).abs()).fold(0.0, f64::max);
        eprintln!("tool {off:.1e} m, tilt {:.1e}, torque {:.1e}", x.hypot(y), miss / weight);
        assert!(off < 1e-13 && x.hypot(y) < 1e-13 && miss < 1e-12 * weight, "{off:e} {x} {y} {miss:e}");
        // The elbow turns by the difference of the two drives, the wrist compensates the rotation
        // of the upper arm.
        let joint = |name: &str| seen.loops.iter().flat_map(|l| &l.dependent).find(|j| j.name == name).unwrap().q;
        assert!((joint("elbow") - (at[2] - at[1])).abs() < 1e-8, "{}", joint("elbow"));
        assert!((joint("wrist") + at[2]).abs() < 1e-8);
        let lever = 125f64.to_radians() - (at[2] - at[1]);
        let angle = seen.loops[0].transmission_angle;
        assert!((angle - lever.min(std::f64::consts::PI - lever)).abs() < 1e-8, "{angle}");
        assert!(seen.loops[0].smallest_transmission_angle.unwrap() <= angle);
    }
}

#[test]
fn the_palletiser_as_shipped_has_no_warnings() {
    let findings = check(&project("robots/palletiser/robot.toml"), None, &LoadOptions::default());
    let loud: Vec<_> = findings.iter().filter(|f| f.severity != flexarm_run::Severity::Note).collect();
    assert!(loud.is_empty(), "{loud:#?}");
}

/// Truth: the energy balance closes, and steppers that share only the equations agree. Measured
/// peak 3.94 mm, 2.4e-7 between them.
#[test]
fn a_run_of_the_palletiser_keeps_the_books_in_every_stepper() {
    let robot = palletiser();
    let motion = Motion::load(robot.default_trajectory.clone().unwrap(), &robot).unwrap();
    assert!(motion.violations.is_empty(), "{:?}", motion.violations);
    let arm = robot.model(&Modelling::default()).unwrap();
    let options = |stepper| RunOptions { stepper, log_rate_hz: 1000.0, ..RunOptions::default() };
    let sdirk = StepperKind::Sdirk3;
    let peaks = [StepperKind::default(), sdirk].map(|stepper| {
        let run = arm.simulate(&motion, &options(stepper)).unwrap();
        assert!(run.summary.caveats.iter().all(|c| c.code != "energy-open"), "{:?}", run.summary.caveats);
        run.summary.tcp.as_ref().unwrap().peak_m
    });
    eprintln!("peaks {peaks:?}");
    assert!(peaks[0] > 3e-4 && (peaks[0] / peaks[1] - 1.0).abs() < 1e-5, "{peaks:?}");
    // SPOOK in its own coordinates, first order and with stiffness-proportional damping.
    let spook = StepperKind::Spook(flexarm_stepping::SpookSettings::default());
    let run = arm.simulate(&motion, &options(spook)).unwrap();
    let off = run.summary.tcp.as_ref().unwrap().peak_m / peaks[0] - 1.0;
    eprintln!("SPOOK {off:.1e}");
    assert!(off.abs() < 1e-2, "{off:.1e}");
}

/// Truth: one spring on the crank, virtual work: with only the gearbox of joint_3 elastic, the TCP
/// sinks by (dz/dq)² F/k, dz/dq = 1.35 cos q3.
#[test]
fn compliance_of_the_crank_reaches_the_tool_through_the_rod() {
    let mut robot = palletiser();
    robot.drives.retain(|drive| drive.joint == "joint_3");
    let arm = robot.model(&Modelling { links: LinkModel::Rigid, ..Modelling::default() }).unwrap();
    let mut point = arm.operating_point().unwrap();
    for at in PLACES {
        point.solve(&order(at), &Wrench::zeros()).unwrap();
        let found = point.compliance()[(2, 2)];
        // The weight on the lever softens or stiffens it by m g r / k, measured 3.5e-3.
        let truth = (1.35 * at[2].cos()).powi(2) / 2.8e6;
        assert!((found / truth - 1.0).abs() < 5e-3, "{found:e} {truth:e}");
        let table = robot
            .model(&Modelling { links: LinkModel::Rigid, ..Modelling::default() })
            .unwrap()
            .statics(Some(&order(at)), [0.0; 6]);
        assert!(table.is_ok());
    }
}

/// Truth: virtual work. With only a rod of stiffness EA/L elastic, the TCP sinks by (dS/dF)² L/EA,
/// where S = F 1.35 cos q3/(0.4 sin μ) is the force in the rod, μ the transmission angle. Measured
/// 3e-4, 2e-4 and 1e-3 (the weight on the lever).
#[test]
fn a_rod_that_stretches_lets_the_tool_sink_by_the_square_of_its_lever() {
    let shipped = std::fs::read_to_string(project("robots/palletiser/robot.toml")).unwrap();
    let (head, loops) = shipped.split_once("[[loop]]").unwrap();
    let (loops, _) = loops.split_once("# The upper arm bends").unwrap();
    let rod = "[[flexible_link]]\nlink = \"drive_rod_bar\"\ndistal = \"drive_rod_end_joint\"\nbeam = { section = \"given\", EA = 3.3e8, EI_y = 2.0e5, \
               EI_z = 2.0e5, GJ = 1.6e5, mass_per_length = 17.0, rotary_y = 0.01, rotary_z = 0.01, theory = \"euler-bernoulli\", y_axis = [0.0, 1.0, 0.0], split = 0.5 }\n";
    let folder = std::env::temp_dir().join(format!("flexarm-loop-rod-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(project("robots/palletiser/palletiser.urdf"), folder.join("palletiser.urdf")).unwrap();
    let text = format!("{head}[[loop]]{loops}\n{rod}").replace("default_trajectory", "# default_trajectory");
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    let robot = Robot::load(&folder).unwrap();
    let mut point = robot.model(&Modelling::default()).unwrap().operating_point().unwrap();
    for at in PLACES {
        point.solve(&order(at), &Wrench::zeros()).unwrap();
        let angle = inspect(&robot, Some(&order(at)), None).unwrap().loops[0].transmission_angle;
        let truth = (1.35 * at[2].cos() / (0.4 * angle.sin())).powi(2) * 1.28 / 3.3e8;
        let off = point.compliance()[(2, 2)] / truth - 1.0;
        eprintln!("rod: {off:.1e} of {truth:.2e} m/N");
        assert!(off.abs() < 2e-3, "{off:e}");
    }
}

fn motion_of(robot: &Robot, q: &[[f64; 4]]) -> Motion {
    let t: Vec<f64> = (0..q.len()).map(|k| k as f64).collect();
    let rows: Vec<[f64; 4]> = q.iter().map(|row| order(*row)).collect();
    Motion::from_samples(&t, &rows.concat(), robot).unwrap()
}

#[test]
fn a_motion_over_a_dead_point_or_out_of_reach_is_refused_with_time_and_loop() {
    let robot = palletiser();
    let arm = robot.model(&Modelling::default()).unwrap();
    let run = |q: &[[f64; 4]]| {
        let options = RunOptions { ignore_limits: true, ..RunOptions::default() };
        arm.simulate(motion_of(&robot, q), &options).map(|_| ()).unwrap_err().to_string()
    };
    // The lever becomes parallel to the lower arm with the elbow at 125 degrees.
    let error = run(&[[0.0, 0.0, 0.3, 0.0], [0.0, -0.4, 2.5, 0.0]]);
    assert!(
        error.contains("\"drive of the upper arm\": at t = 0.") && error.contains("passes its dead point"),
        "{error}"
    );
    // A rod that is too short cannot close the loop everywhere.
    let mut short = palletiser();
    let mut own = short.rigid.loops.remove(0);
    own.name = "short".into();
    short.rigid.joints.iter_mut().filter(|j| j.child == own.eye).for_each(|j| j.X_PJ.translation.vector.z = 1.2);
    short.rigid.loops.push(own);
    let far = [0.0, 0.6, -0.6, 0.0];
    let error = inspect(&short, Some(&order(far)), None).unwrap_err().to_string();
    assert!(error.contains("loop \"short\": it does not close there"), "{error}");
    assert!(short.model(&Modelling::default()).unwrap().statics(Some(&order(far)), [0.0; 6]).is_err());
}

#[test]
fn a_motion_names_the_joints_that_drive() {
    let robot = palletiser();
    let folder = std::env::temp_dir().join(format!("flexarm-loop-motion-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (file, text) in [
        ("m.csv", "time,joint_2,elbow\n0,0,0\n1,0.1,0.1\n"),
        (
            "m.toml",
            "format = 1\nunit = \"rad\"\njoints = [\"elbow\"]\nstart = [0.0]\n[[move]]\nto = [0.2]\nduration = 1.0\n",
        ),
    ] {
        std::fs::write(folder.join(file), text).unwrap();
        let error = Motion::load(folder.join(file), &robot).unwrap_err().to_string();
        assert!(error.contains("\"elbow\"") && error.contains("follow from closed loops"), "{error}");
    }
}

/// Returns the message for the shipped robot file with a change.
fn refused(from: &str, to: &str) -> String {
    let folder = std::env::temp_dir().join(format!("flexarm-loops-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(project("robots/palletiser/palletiser.urdf"), folder.join("palletiser.urdf")).unwrap();
    let text = std::fs::read_to_string(project("robots/palletiser/robot.toml")).unwrap();
    assert!(text.contains(from), "{from}");
    let path = folder.join("robot.toml");
    std::fs::write(&path, text.replacen(from, to, 1).replace("default_trajectory", "# default_trajectory")).unwrap();
    let error = Robot::load(&path).map(|_| format!("accepted: {to}")).unwrap_err().to_string();
    assert!(error.contains("robot.toml:"), "{error}");
    error
}

#[test]
fn what_no_loop_is_is_refused_with_its_place_and_what_is_expected() {
    let pair = "dependent = [\"elbow\", \"drive_rod\"]";
    for (from, to, words) in [
        (pair, "dependent = [\"elbow\"]", "dependent names 1 joints, expected two"),
        (pair, "dependent = [\"elbow\", \"knee\"]", "there is no joint \"knee\""),
        (pair, "dependent = [\"elbow\", \"joint_3\"]", "joint_3"),
        (pair, "dependent = [\"elbow\", \"wrist\"]", "does not lie between pin and eye; the joints there are"),
        (pair, "dependent = [\"elbow\", \"drive_rod\"]\naxis = [0.0, 0.0, 0.0]", "expected the direction of the pin"),
        (pair, "dependent = [\"elbow\", \"drive_rod\"]\naxis = [1.0, 0.0, 0.0]", "off the plane of the loop"),
        (pair, "dependent = [\"elbow\", \"drive_rod\"]\nat = { knee = 0.1 }", "names joint \"knee\""),
        (pair, "dependent = [\"elbow\", \"drive_rod\"]\nstiffness = 1e8", "unknown field `stiffness`"),
        ("pin = { link = \"upper_arm\"", "pin = { link = \"ghost\"", "\"ghost\" is not a link of the robot"),
        (
            "xyz = [0.0, 0.0, 1.28]",
            "xyz = [0.0, 0.0, 12.8]",
            "does not close where its driving joints are at the start",
        ),
        ("xyz = [0.0, 0.0, 1.28]", "xyz = [0.0, nan, 1.28]", "expected finite numbers"),
        ("name = \"level of the plate\"", "name = \"drive of the upper arm\"", "is defined twice"),
        ("joint = \"joint_3\"", "joint = \"elbow\"", "follows from loop \"drive of the upper arm\": nothing drives it"),
        ("[[loop]]", "[hold]\nelbow = 0.1\n\n[[loop]]", "hold the joints that drive the loop"),
        ("[[loop]]", "[lead]\nelbow = 0.1\n\n[[loop]]", "is helical"),
        (
            "[[drive]]",
            "[[balancer]]\njoint = \"elbow\"\nsine = { torque = 1.0, zero = 0.0 }\n\n[[drive]]",
            "follows from a loop",
        ),
    ] {
        let error = refused(from, to);
        assert!(error.contains(words), "{to}\n{error}");
    }
}

/// The same loop as a value; a drive on one of its joints is refused.
#[test]
fn loops_are_values_too() {
    let robot = palletiser();
    let mut open = robot.clone();
    let taken = open.rigid.loops.remove(0);
    open.rigid.links.retain(|l| l.name != taken.pin && l.name != taken.eye);
    open.rigid.joints.retain(|j| j.child != taken.pin && j.child != taken.eye);
    let own = RobotLoop {
        name: "drive".into(),
        pin: ("upper_arm".into(), [-0.327660818, 0.0, -0.229430575]),
        axis: Some([0.0, 1.0, 0.0]),
        eye: ("drive_rod_bar".into(), [0.0, 0.0, 1.28]),
        dependent: ["elbow".into(), "drive_rod".into()],
        at: Vec::new(),
    };
    let closed = open.clone().with_loops(vec![own.clone()]).unwrap();
    for at in PLACES {
        let [a, b] = [&closed, &robot].map(|robot| inspect(robot, Some(&order(at)), None).unwrap().gravity_torque);
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
    }
    let mut driven = robot.drives[2].clone();
    driven.joint = "elbow".into();
    open.drives.push(driven);
    let error = open.with_loops(vec![own]).unwrap_err().to_string();
    assert!(error.contains("has a drive and follows from the loop"), "{error}");
}

/// Bars that do not fit at rest are reported: with a pin 30 mm off the loop closes at another
/// position.
#[test]
fn a_loop_that_closes_elsewhere_than_it_is_drawn_is_told() {
    let mut robot = palletiser();
    let eye = robot.rigid.loops[0].eye.clone();
    robot.rigid.joints.iter_mut().filter(|j| j.child == eye).for_each(|j| j.X_PJ.translation.vector.z += 0.03);
    let caveats = robot.caveats();
    let told = caveats.iter().find(|c| c.code == "loop-assembled").unwrap_or_else(|| panic!("{caveats:#?}"));
    assert!(told.value.unwrap() > 0.02 && told.message.contains("drive of the upper arm"), "{told:?}");
    assert!(palletiser().caveats().iter().all(|c| c.code != "loop-assembled"));
}
