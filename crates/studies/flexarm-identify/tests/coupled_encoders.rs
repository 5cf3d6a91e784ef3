//! Recordings of motors and links of an arm with coupled wrist gears.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flexarm_identify::{IdentifyRequest, identify_robot, parameters};
use flexarm_kinematics::Wrench;
use flexarm_run::{Modelling, Robot};

struct Place(PathBuf);

impl Drop for Place {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.0);
    }
}

/// C of the wrist: joints from motors.
const C: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [-0.2, 1.0, 0.0], [0.4, -0.3, 1.0]];

/// The arm with a load off the axis of its last joint and a coupled wrist; `factors` on the springs
/// of its motors.
fn coupled(folder: &Path, factors: [f64; 3]) -> Robot {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210_identified").canonicalize().unwrap();
    let urdf = home.join("kr210_identified.urdf");
    let text = std::fs::read_to_string(home.join("robot.toml")).unwrap();
    let text = text.replace("\"kr210_identified.urdf\"", &format!("{urdf:?}"));
    let mut out = String::new();
    let mut wrist = None;
    for line in text.lines().filter(|line| !line.starts_with("default_trajectory")) {
        if let Some(joint) = line.strip_prefix("joint = \"joint_") {
            wrist = joint.chars().next().and_then(|c| c.to_digit(10)).and_then(|k| (k as usize).checked_sub(4));
        }
        match (line.strip_prefix("gearbox = { stiffness = ").and_then(|rest| rest.split_once(',')), wrist) {
            (Some((number, rest)), Some(k)) => {
                let number: f64 = number.parse().unwrap();
                writeln!(out, "gearbox = {{ stiffness = {:?},{rest}", number * factors[k]).unwrap();
            }
            _ => writeln!(out, "{line}").unwrap(),
        }
    }
    let extra = format!(
        "\n[payload]\nlink = \"tool0\"\nmass = 150.0\ncom = [0.3, 0.1, 0.2]\n\n[coupling]\njoints = [\"joint_4\", \"joint_5\", \"joint_6\"]\n\
         matrix = {C:?}\n"
    );
    std::fs::write(folder.join("robot.toml"), out + &extra).unwrap();
    Robot::load(folder).unwrap()
}

/// Motor positions behind their gears, and link positions, of equilibria along a quasi-static
/// motion, under gravity only.
fn recording(robot: &Robot, seed: f64) -> String {
    let arm = robot.model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    let mut text = "t,m1,m2,m3,m4,m5,m6,j4,j5,j6,l4,l5,l6\n".to_owned();
    for sample in 0..1200 {
        let t = 10.0 * f64::from(sample);
        let angle = |j: usize| {
            let middle = [0.0, -0.9, 1.2, 0.3, 0.5, 0.2][j];
            middle + 0.8 * (t * std::f64::consts::TAU / (2500.0 + 400.0 * j as f64) + seed * (1.0 + j as f64)).sin()
        };
        let motors: [f64; 6] = std::array::from_fn(angle);
        let mut joints = motors;
        (0..3).for_each(|i| joints[3 + i] = (0..3).map(|k| C[i][k] * motors[3 + k]).sum());
        at.solve(&joints, &Wrench::zeros()).unwrap();
        let e = at.deflections();
        write!(text, "{t}").unwrap();
        let links = (3..6).map(|j| joints[j] + e[j]);
        motors
            .iter()
            .copied()
            .chain(joints[3..].iter().copied())
            .chain(links)
            .for_each(|q| write!(text, ",{q}").unwrap());
        text.push('\n');
    }
    text
}

const MOTORS: &str =
    "joint_1 = \"m1\", joint_2 = \"m2\", joint_3 = \"m3\", joint_4 = \"m4\", joint_5 = \"m5\", joint_6 = \"m6\"";
const JOINTS: &str =
    "joint_1 = \"m1\", joint_2 = \"m2\", joint_3 = \"m3\", joint_4 = \"j4\", joint_5 = \"j5\", joint_6 = \"j6\"";
const ALL: &str = "joint_4 = \"l4\", joint_5 = \"l5\", joint_6 = \"l6\"";

fn job(place: &Path, motor: &str, link: &str, positions: &str, head: &str) -> PathBuf {
    let mut job = format!("format = 1\n{head}");
    for run in 1..=2 {
        job += &format!(
            "[[encoders]]\nfile = \"run_{run}.csv\"\ntime = \"t\"\nmotor = {{ {motor} }}\nlink = {{ {link} }}\nbelow = 0.02\nedge = 300.0\n{positions}\n"
        );
    }
    let path = place.join("job.toml");
    std::fs::write(&path, job).unwrap();
    path
}

/// Truth: the springs of the arm whose equilibria were recorded. The torques are those at the motor
/// angles, which differ from the link angles by the deflection: a relative error of second order.
#[test]
fn springs_of_coupled_motors_are_found_from_encoders_behind_the_gears() {
    let folder = std::env::temp_dir().join(format!("flexarm-coupled-encoders-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("measured")).unwrap();
    let place = Place(folder);
    let factors = [0.8, 1.25, 0.7];
    let measured = coupled(&place.0.join("measured"), factors);
    let robot = coupled(&place.0, [1.0; 3]);
    for (run, seed) in [(1, 0.3), (2, 1.1)] {
        std::fs::write(place.0.join(format!("run_{run}.csv")), recording(&measured, seed)).unwrap();
    }
    let factor_of = |joint: &str| factors[joint.strip_prefix("joint_").unwrap().parse::<usize>().unwrap() - 4];
    let initial = |joint: &str| {
        let arm = robot.model(&Modelling::default()).unwrap();
        let name = format!("drive.{joint}.gearbox.stiffness");
        parameters(&arm).into_iter().find(|p| p.name == name).unwrap().initial
    };
    let motors = "positions = \"motors\"";
    let last = "joint_6 = \"l6\"";
    for (motor, link, positions) in
        [(MOTORS, ALL, motors), (JOINTS, ALL, "positions = \"joints\""), (MOTORS, last, motors)]
    {
        let path = job(&place.0, motor, link, positions, "");
        let found = identify_robot(&robot, &path, &IdentifyRequest::default()).unwrap();
        assert_eq!(found.encoders.len(), 3);
        for gear in &found.encoders {
            let off = gear.stiffness / (initial(&gear.joint) * factor_of(&gear.joint)) - 1.0;
            eprintln!("{positions}, {}: off by {off:.1e}, r2 {:.6}, told {}", gear.joint, gear.r2, gear.told);
            assert!(gear.told && off.abs() < 1e-2, "{}: {off:e}", gear.joint);
        }
    }
    // A gear that is kept deflects according to the robot file: correct if it is that of the arm.
    let kept = coupled(&place.0, [factors[0], 1.0, 1.0]);
    let head = "keep = [\"drive.joint_4.*\"]\n";
    let path = job(&place.0, MOTORS, ALL, motors, head);
    let found = identify_robot(&kept, &path, &IdentifyRequest::default()).unwrap();
    assert_eq!(found.encoders.iter().map(|gear| gear.joint.as_str()).collect::<Vec<_>>(), ["joint_5", "joint_6"]);
    for gear in &found.encoders {
        let off = gear.stiffness / (initial(&gear.joint) * factor_of(&gear.joint)) - 1.0;
        assert!(off.abs() < 1e-2, "{}: {off:e}", gear.joint);
    }
    // The meaning of the angle columns must be declared.
    let error = identify_robot(&robot, &job(&place.0, MOTORS, ALL, "", ""), &IdentifyRequest::default()).unwrap_err();
    assert!(error.to_string().contains("positions = \"motors\""), "{error}");
}
