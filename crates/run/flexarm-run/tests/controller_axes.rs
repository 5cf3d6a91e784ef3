//! Controller axes whose zeros and signs differ from those of the joints in the description.

use std::path::PathBuf;

use flexarm_run::{Error, Motion, Robot, RobotSource, inspect};

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../robots").join(name)
}

/// Position of the flange at axis values in degrees (m).
fn flange(robot: &str, degrees: [f64; 6]) -> [f64; 3] {
    let options = flexarm_run::LoadOptions { tcp: Some("tool0".into()), ..Default::default() };
    let arm = RobotSource::new(&shipped(robot), &options).load().unwrap();
    let q = degrees.map(f64::to_radians);
    inspect(arm.robot(), Some(&q), None).unwrap().tcp.position_m
}

/// Truth: the drawings in KUKA's data sheets. At A2 = -90 the link arm is upright, at A3 = 90 the
/// forearm is horizontal: lengths add up by hand. Axis 1 turns clockwise as seen from above. Bound
/// 1 um: the rest is rounding in the description.
#[test]
fn shipped_kuka_arms_have_the_zeros_and_senses_of_their_controller() {
    let home = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0];
    let arms = [
        ("kr210", [0.33 + 1.22 + 0.215, 0.0, 0.645 + 1.15 + 0.115]),
        // According to its README: (1.590, 0, 1.784) m.
        ("kr300", [1.590, 0.0, 1.784]),
    ];
    for (name, truth) in arms {
        let found = flange(name, home);
        for k in 0..3 {
            assert!((found[k] - truth[k]).abs() < 1e-6, "{name}: {found:?} instead of {truth:?}");
        }
        let turned = flange(name, [30.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
        assert!((turned[1] + truth[0] * 0.5).abs() < 1e-6, "{name}: A1 turns the other way: {turned:?}");
        // Increasing axis 2 leans the arm forward and down.
        let leant = flange(name, [0.0, -60.0, 90.0, 0.0, 0.0, 0.0]);
        assert!(leant[0] > found[0] && leant[2] < found[2], "{name}: {leant:?}");
    }
}

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn robot_with(name: &str, axes: &str) -> (Folder, Result<Robot, Error>) {
    let folder = Folder(std::env::temp_dir().join(format!("flexarm-axes-{name}-{}", std::process::id())));
    std::fs::create_dir_all(&folder.0).unwrap();
    let urdf = shipped("kr300/kr300.urdf").canonicalize().unwrap();
    let text = format!("format = 1\nurdf = {:?}\ntcp = {{ link = \"tool0\" }}\n{axes}", urdf.display().to_string());
    std::fs::write(folder.0.join("robot.toml"), text).unwrap();
    let robot = Robot::load(&folder.0);
    (folder, robot)
}

/// Truth: zero + sense a + factor a_other by hand. Bound 1e-9 rad.
#[test]
fn a_program_moves_the_joints_to_where_its_axis_values_are_by_zero_sense_and_coupling() {
    let axes = r#"
        [[controller_axis]]
        joint = "joint_a1"
        sense = -1
        [[controller_axis]]
        joint = "joint_a2"
        zero_deg = -90.0
        [[controller_axis]]
        joint = "joint_a3"
        zero_deg = 90.0
        relative_to = "joint_a2"
    "#;
    let (folder, robot) = robot_with("program", axes);
    let robot = robot.unwrap();
    let program = "DEF p()\nPTP {A1 10, A2 20, A3 30, A4 5, A5 15, A6 -25}\nPTP {A1 -10, A2 30, A3 10, A4 5, A5 15, A6 -25}\nEND\n";
    let path = folder.0.join("p.src");
    std::fs::write(&path, program).unwrap();
    let motion = Motion::load(&path, &robot).unwrap();
    let (mut q, mut v, mut a) = ([0.0; 6], [0.0; 6], [0.0; 6]);
    let truths = [(0.0, [-10.0, -70.0, 100.0, 5.0, 15.0, -25.0]), (1e9, [10.0, -60.0, 70.0, 5.0, 15.0, -25.0])];
    for (t, truth) in truths {
        motion.trajectory.sample(f64::min(t, motion.trajectory.duration()), &mut q, &mut v, &mut a);
        for k in 0..6 {
            assert!((q[k].to_degrees() - truth[k]).abs() < 6e-8, "{t}: {q:?}");
        }
    }
    let told: Vec<String> = motion.caveats().into_iter().map(|caveat| caveat.message).collect();
    let told = told.into_iter().find(|text| text.contains("joint_a3 = A3"));
    let told = told.unwrap_or_default();
    assert!(told.contains("joint_a1 = -A1") && told.contains("joint_a3 = A3 + 90.0000 - 1 A2"), "{told:?}");
}

#[test]
fn entries_that_make_no_sense_are_refused_with_their_line() {
    let cases = [
        ("joint = \"joint_a9\"", "did you mean"),
        ("joint = \"joint_a1\"\nsense = 2", "expected 1 or -1"),
        ("joint = \"joint_a1\"\nzero = 0.1\nzero_deg = 3.0", "both given"),
        ("joint = \"joint_a1\"\nrelative_to = \"joint_a2\"", "does not carry it"),
        ("joint = \"joint_a1\"\nrelative_to = \"joint_a1\"", "no joint"),
        ("joint = \"joint_a2\"\nfactor = -1.0", "relative_to"),
        ("joint = \"joint_a2\"\nzero = inf", "finite"),
        ("joint = \"joint_a2\"\n[[controller_axis]]\njoint = \"joint_a2\"", "second entry"),
        ("joint = \"joint_a2\"\noffset = 1.0", "unknown field"),
    ];
    for (k, (keys, words)) in cases.into_iter().enumerate() {
        let (_folder, robot) = robot_with(&format!("refused-{k}"), &format!("[[controller_axis]]\n{keys}\n"));
        let error = robot.unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("robot.toml:"), "{keys}: {error}");
    }
}
