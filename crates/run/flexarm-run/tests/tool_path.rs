//! Motions given by TCP paths: files, standard motions and robot programs on a shipped arm.

use std::path::{Path, PathBuf};

use flexarm_kinematics::{Data, Model, Pose, forward_kinematics};
use flexarm_run::{Motion, Robot, TCP_FRAME};
use nalgebra::{DVector, Rotation3, Vector3};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn kr210() -> Robot {
    Robot::load(root().join("robots/kr210")).unwrap()
}

/// A separate folder for each test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("flexarm-tool-path-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn load(robot: &Robot, name: &str, text: &str) -> Result<Motion, flexarm_run::Error> {
    let folder = folder(&name.replace('.', "-"));
    std::fs::write(folder.join(name), text).unwrap();
    let motion = Motion::load(folder.join(name), robot);
    std::fs::remove_dir_all(folder).unwrap();
    motion
}

/// Times and TCP poses at `n + 1` instants.
fn poses(model: &Model, motion: &Motion, n: usize) -> Vec<(f64, Pose)> {
    let (frame, mut data) = (model.frame(TCP_FRAME).unwrap().clone(), Data::new(model));
    let joints = model.nv();
    (0..=n)
        .map(|k| {
            let t = motion.trajectory.duration() * k as f64 / n as f64;
            let (mut q, mut v, mut a) = (DVector::zeros(joints), vec![0.0; joints], vec![0.0; joints]);
            motion.trajectory.sample(t, q.as_mut_slice(), &mut v, &mut a);
            forward_kinematics(model, &mut data, &q);
            (t, data.X_WF(&frame))
        })
        .collect()
}

fn from_polyline(p: &Vector3<f64>, corners: &[Vector3<f64>]) -> f64 {
    let from = |pair: &[Vector3<f64>]| {
        let d = pair[1] - pair[0];
        let part = ((p - pair[0]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
        (p - pair[0] - d * part).norm()
    };
    corners.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

/// Truth: the square as written, its speed, and the blends at its corners.
#[test]
fn the_milling_square_is_milled_where_the_file_says() {
    let robot = kr210();
    let model = robot.rigid_model().unwrap();
    let motion = Motion::load(root().join("trajectories/milling_square.toml"), &robot).unwrap();
    assert!(motion.violations.is_empty());
    let corner = |x: f64, y: f64, z: f64| Vector3::new(1.5 + x, -0.15 + y, 0.9 + z);
    let way: Vec<Vector3<f64>> =
        [(0.0, 0.0, 0.05), (0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.3, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.0)]
            .map(|(x, y, z)| corner(x, y, z))
            .into();
    let down = Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
    let (mut off, mut turned, mut top): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let seen = poses(&model, &motion, 9001);
    for pair in seen.windows(2) {
        let (p, q) = (pair[0].1.translation.vector, pair[1].1.translation.vector);
        if way[2..5].iter().all(|corner| (q - corner).norm() > 8.0e-3 + 1e-9) {
            off = off.max(from_polyline(&q, &way));
        }
        turned = turned.max(down.angle_to(&pair[1].1.rotation));
        top = top.max((q - p).norm() / (pair[1].0 - pair[0].0));
    }
    assert!(off < 1e-9, "{off:.1e}"); // measured below 1e-10
    assert!(turned < 1e-7, "{turned:.1e}"); // angle_to is an arc cosine
    assert!((top - 0.25).abs() < 5e-4, "{top}");
    let moves = &motion.tool_path.as_ref().unwrap().moves;
    assert_eq!(moves.len(), 6);
    assert!((moves[1].blend_m - 8e-3).abs() < 1e-9);
}

/// Truth: both express the same motion in two languages.
#[test]
fn a_program_of_the_controller_moves_as_the_path_file_that_says_the_same() {
    let robot = kr210();
    let model = robot.rigid_model().unwrap();
    let krl = "DEF square()\n\
        $ACC.CP = 2.0\n\
        $VEL.CP = 0.2\n\
        PTP {A1 0, A2 -60, A3 90, A4 0, A5 60, A6 0}\n\
        LIN {X 1700, Y 0, Z 1300, A 0, B 90, C 0} C_DIS\n\
        LIN {X 1700, Y 200, Z 1300, A 0, B 90, C 0}\n\
        CIRC {X 1800, Y 100, Z 1300}, {X 1700, Y 0, Z 1300, A 0, B 90, C 0}\n\
        WAIT SEC 0.5\n\
        END\n";
    let program = load(&robot, "square.src", krl).unwrap();
    let file = load(
        &robot,
        "square.toml",
        "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\nspeed = 200.0\nacceleration = 2000.0\n\
         [[move]]\njoints = [0, -60, 90, 0, 60, 0]\n\
         [[move]]\nline = [1700, 0, 1300]\nrpy = [0, 90, 0]\n\
         [[move]]\nline = [1700, 200, 1300]\n\
         [[move]]\narc = [1700, 0, 1300]\nvia = [1800, 100, 1300]\n\
         [[move]]\ndwell = 0.5\n",
    )
    .unwrap();
    let (a, b) = (poses(&model, &program, 4000), poses(&model, &file, 4000));
    assert!(program.format.contains("KRL"), "{}", program.format);
    assert!((program.trajectory.duration() - file.trajectory.duration()).abs() < 1e-9);
    let apart = a.iter().zip(&b).map(|(a, b)| (a.1.translation.vector - b.1.translation.vector).norm());
    assert!(apart.fold(0.0, f64::max) < 1e-9);
}

/// A line past the singular pose of the wrist, where joint 4 would exceed its speed. Truth: the
/// limits as checked by runs.
#[test]
fn a_line_past_a_singular_pose_of_the_wrist_keeps_the_limits_that_runs_check() {
    let robot = kr210();
    for offset in [10, 20, 40] {
        let motion = load(
            &robot,
            "singular.toml",
            &format!(
                "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\nspeed = 800.0\nacceleration = 4000.0\n\
                 [[move]]\njoint_to = [1800, {offset}, 2000]\nrpy = [0, 90, 0]\nnear = [0, -60, 60, 0, 10, 0]\n\
                 [[move]]\nline = [1800, {offset}, 1300]\n"
            ),
        );
        let motion = motion.unwrap();
        assert!(motion.violations.is_empty(), "{offset} mm: {:?}", motion.violations);
        let slowed = motion.tool_path.as_ref().and_then(|path| path.moves[0].slowed.as_ref());
        assert!(slowed.is_some_and(|slowed| slowed.part < 0.5), "{offset} mm: {slowed:?}");
    }
}

/// Truth: the same table in UTF-8, and the omitted samples.
#[test]
fn a_table_in_the_letters_of_old_windows_is_recognised_and_its_gap_is_told() {
    let robot = kr210();
    let rows = (0..200).filter(|k| !(101..121).contains(k));
    let row = |k: i32| format!("{:.3};{:.6}\n", 0.02 * f64::from(k), (0.02 * f64::from(k)).sin()).replace('.', ",");
    let text = format!("# Prüfstand\nZeit[s];joint_a1 [°]\n{}", rows.map(row).collect::<String>());
    let joint = robot.rigid_model().unwrap().coordinates()[0].joint.clone();
    let text = text.replace("joint_a1", &joint);
    let folder = folder("windows");
    let old: Vec<u8> = text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
    let read = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        Motion::load(folder.join(name), &robot).unwrap()
    };
    let (old, new) = (read("old.txt", &old), read("new.txt", text.as_bytes()));
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(old.trajectory, new.trajectory);
    let told = old.caveats().iter().any(|caveat| caveat.message.contains("0.4200 s, from t = 2.0000 s to 2.4200 s"));
    assert!(told, "{:?}", old.caveats());
}

#[test]
fn standard_motions_stay_in_their_cube_and_rest_where_they_should() {
    let robot = kr210();
    let model = robot.rigid_model().unwrap();
    let centre = Vector3::new(1.8, 0.0, 1.2);
    for (name, reach) in [("iso9283-poses", 0.8), ("iso9283-paths", 0.8), ("circularity", 1.0), ("settle", 1.0)] {
        let text = format!(
            "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\nspeed = 500\nacceleration = 3000\n\
             [standard]\nmotion = \"{name}\"\ncentre = [1800, 0, 1200]\nside = 400\nrpy = [180, 0, 0]\n\
             near = [0, -60, 90, 0, 60, 0]\n"
        );
        let motion = load(&robot, "standard.toml", &text).unwrap();
        let far = poses(&model, &motion, 3000)
            .iter()
            .map(|(_, tool)| (tool.translation.vector - centre).amax())
            .fold(0.0, f64::max);
        assert!((far - 0.2 * reach).abs() < 1e-6 || name == "iso9283-paths" && far <= 0.16 + 1e-9, "{name}: {far}");
    }
}

#[test]
fn examples_of_the_page_load() {
    let robot = kr210();
    let page = std::fs::read_to_string(root().join("docs/paths.md")).unwrap();
    let examples: Vec<&str> = page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert_eq!(examples.len(), 3);
    let folder = folder("page");
    std::fs::write(
        folder.join("part.nc"),
        "G21 G90\nG0 X0 Y0 Z20\nG1 Z0 F3000\nG1 X100\nG2 X100 Y50 I0 J25\nG1 X0\nM30\n",
    )
    .unwrap();
    for (k, example) in examples.into_iter().enumerate() {
        let path = folder.join(format!("example_{k}.toml"));
        std::fs::write(&path, example).unwrap();
        let motion = Motion::load(&path, &robot).unwrap_or_else(|error| panic!("example {k}: {error}"));
        assert!(motion.trajectory.duration() > 1.0);
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_wrong_is_told_with_its_place_and_the_remedy() {
    let robot = kr210();
    let head = "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\n";
    let start = "[[move]]\njoints = [0, -60, 90, 0, 60, 0]\n";
    let cases = [
        (format!("format = 1\n[path]\nangles = \"deg\"\n{start}"), "lengths"),
        (format!("format = 1\n[path]\nlengths = \"cm\"\nangles = \"deg\"\n{start}"), "give \"m\" or \"mm\""),
        (format!("{head}{start}[[move]]\narc = [1, 2, 3]\n"), "via"),
        (format!("{head}{start}[[move]]\nline = [1, 2, 3]\ndwell = 1.0\n"), "a move is one of line and dwell"),
        (format!("{head}{start}[[move]]\nblend = 1.0\n"), "a move needs one of"),
        (format!("{head}{start}[[move]]\nlin = [1, 2, 3]\n"), "unknown field `lin`"),
        (format!("{head}[[move]]\nline = [1700, 0, 1300]\n"), "orientation of the tool is not known"),
        (format!("{head}[[move]]\nline = [1700, 0, 1300]\nrpy = [0, 90, 0]\n"), "begins with a move of the tool"),
        (format!("{head}{start}[[move]]\nline = [9000, 0, 1300]\n"), "the arm cannot continue beyond"),
        (format!("{head}{start}[[move]]\njoint_to = [9000, 0, 1300]\n"), "out of reach by about"),
        (format!("{head}[[move]]\njoints = [0, -60, 90]\n"), "3 values for the 6 joints"),
        (
            format!("{head}speed = -2.0\n{start}[[move]]\nline = [1700, 0, 1300]\n"),
            "the speed of the path is -0.002, expected",
        ),
        (format!("{head}[limits]\njoint_9 = {{ velocity = 1 }}\n{start}"), "the robot has no joint \"joint_9\""),
        (format!("{head}{start}[[move]]\nline = [1700, 0, 1300]\nquaternion = [2, 0, 0, 0]\n"), "it must be 1"),
        (head.to_string(), "no move"),
    ];
    for (text, words) in cases {
        let error = load(&robot, "wrong.toml", &text).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("wrong.toml"), "{words:?} in {error:?}");
    }
    let error =
        load(&robot, "wrong.src", "DEF x()\nPTP {A1 0, A2 -60, A3 90, A4 0, A5 60, A6 0}\nWAIT FOR $IN[1]\nEND\n");
    let error = error.unwrap_err().to_string();
    assert!(error.contains("wrong.src:3") && error.contains("WAIT FOR"), "{error}");
}

#[test]
fn what_joints_do_that_a_path_does_not_need_is_a_known_word_or_a_posture() {
    let robot = kr210();
    let file = |redundancy: &str| {
        format!(
            "format = 1\n[path]\nlengths = \"m\"\nangles = \"deg\"\nspeed = 0.2\nredundancy = {redundancy}\n\
             [[move]]\njoints = [0.0, -60.0, 90.0, 0.0, 60.0, 0.0]\n[[move]]\nline = [1.6, 0.1, 1.2]\n"
        )
    };
    // Six joints have no redundancy: all rules give the same motion.
    let durations: Vec<f64> = ["\"hold\"", "\"away-from-limits\"", "[0.0, -60.0, 90.0, 0.0, 60.0, 0.0]"]
        .iter()
        .map(|word| load(&robot, "path.toml", &file(word)).unwrap().trajectory.duration())
        .collect();
    assert!(durations.iter().all(|t| *t == durations[0]), "{durations:?}");
    for wrong in ["\"sideways\"", "[0.0, 10.0]", "[0.0, -60.0, 90.0, 0.0, 60.0, nan]"] {
        let error = load(&robot, "path.toml", &file(wrong)).unwrap_err().to_string();
        assert!(error.contains("path.toml:6:14") && error.contains("6 joint values to stay near to"), "{error}");
    }
}

/// Truth: the third derivative of the joint curves.
#[test]
fn jerks_of_joints_hold_in_a_path_file_and_in_a_program_and_are_shown_with_their_limits() {
    let robot = kr210();
    let folder = folder("jerks");
    let limits: String = (1..=6).map(|k| format!("joint_{k} = {{ acceleration = 300, jerk = 1500 }}\n")).collect();
    let head = "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\nspeed = 250.0\n";
    let path = format!(
        "{head}blend = 10.0\n[limits]\n{limits}\
         [[move]]\njoints = [0, -60, 90, 0, 60, 0]\nblend = 0.0\n\
         [[move]]\nline = [1700, 0, 1300]\nrpy = [0, 90, 0]\n\
         [[move]]\nline = [1700, 200, 1300]\n\
         [[move]]\nline = [1700, 200, 1400]\nblend = 0.0\n"
    );
    let program = format!("{head}[limits]\n{limits}[program]\nfile = \"part.src\"\n");
    let krl = "DEF part()\nPTP {A1 0, A2 -60, A3 90, A4 0, A5 60, A6 0}\n\
        LIN {X 1700, Y 0, Z 1300, A 0, B 90, C 0} C_DIS\nLIN {X 1700, Y 200, Z 1300, A 0, B 90, C 0}\nEND\n";
    std::fs::write(folder.join("part.src"), krl).unwrap();
    for (name, text) in [("path.toml", &path), ("program.toml", &program)] {
        let file = folder.join(name);
        std::fs::write(&file, text).unwrap();
        let report = flexarm_run::motion_report(&file, Some(&robot), &Default::default(), &[], 500.0, false).unwrap();
        let limit = 1500f64.to_radians();
        for peak in &report.peaks {
            assert!((peak.jerk_limit.unwrap() - limit).abs() < 1e-9);
            assert!(peak.jerk.abs() < limit * 1.001 && peak.acceleration_jump < 1e-6, "{} {}", peak.joint, peak.jerk);
        }
        let most = report.peaks.iter().map(|peak| peak.jerk.abs()).fold(0.0, f64::max);
        assert!(most > 0.98 * limit, "{most}");
        assert!(report.violations.iter().all(|violation| violation.kind != "jerk"));
    }
    // A limit that is active only at a corner: reported with its joint.
    let slowed = load(&robot, "path.toml", &path).unwrap();
    let said = &slowed.tool_path.as_ref().unwrap().moves;
    let by_jerk = said
        .iter()
        .filter_map(|of| of.slowed.as_ref())
        .any(|slow| matches!(&slow.by, flexarm_path::SlowedBy::JointJerk(_)));
    assert!(by_jerk, "{said:?}");
    let wrong = path.replacen("jerk = 1500", "jerk = 0", 1);
    let error = load(&robot, "path.toml", &wrong).unwrap_err().to_string();
    assert!(error.contains("path.toml:") && error.contains("jerk of joint \"") && error.contains("is 0.0,"), "{error}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Truth: a circle by hand, and a tool with constant orientation. Full circles are programmed as
/// two halves.
#[test]
fn two_halves_of_a_circle_with_one_orientation_leave_the_tool_as_it_stands_in_every_language() {
    let robot = kr210();
    let model = robot.rigid_model().unwrap();
    // The tool points down: rotated by half a turn about y. The flange is 350 mm above the TCP.
    let rapid = "MODULE m\nVAR robtarget p:=[[1700,0,1200],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nPROC main()\n\
        ConfJ \\Off;\nConfL \\Off;\nMoveAbsJ [[0,-60,90,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v500,fine,tool0;\nMoveL p,v500,fine,tool0;\n\
        MoveC Offs(p,-100,100,0),Offs(p,-200,0,0),v200,z1,tool0;\nMoveC Offs(p,-100,-100,0),p,v200,fine,tool0;\nENDPROC\nENDMODULE\n";
    let krl = "DEF m()\n$VEL.CP=0.2\n$CIRC_TYPE=#PATH\n$TOOL={X 0,Y 0,Z 0,A 0,B 0,C 0}\n\
        PTP {A1 0,A2 -60,A3 90,A4 0,A5 60,A6 0}\nLIN {X 1700,Y 0,Z 1200,A 0,B 180,C 0}\n\
        CIRC {X 1600,Y 100,Z 1200},{X 1500,Y 0,Z 1200,A 0,B 180,C 0}, CA 360\nEND\n";
    let script = "def m():\n  set_tcp(p[0,0,0,0,0,0])\n  movej([0,-1.0471976,1.5707963,0,1.0471976,0])\n\
        movel(p[1.7,0,1.2,0,3.14159265,0])\n  movec(p[1.6,0.1,1.2,0,3.14159265,0],p[1.5,0,1.2,0,3.14159265,0])\n\
        movec(p[1.6,-0.1,1.2,0,3.14159265,0],p[1.7,0,1.2,0,3.14159265,0])\nend\n";
    let path = "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\nspeed = 200.0\ntool = { xyz = [0, 0, 0] }\n\
        [[move]]\njoints = [0, -60, 90, 0, 60, 0]\n[[move]]\nline = [1700, 0, 1200]\nrpy = [0, 180, 0]\n\
        [[move]]\narc = [1500, 0, 1200]\nvia = [1600, 100, 1200]\nturns_with_path = true\n\
        [[move]]\narc = [1700, 0, 1200]\nvia = [1600, -100, 1200]\nturns_with_path = true\n";
    for (name, text) in [("m.mod", rapid), ("m.src", krl), ("m.script", script), ("m.toml", path)] {
        let motion = load(&robot, name, text).unwrap();
        let arcs: Vec<_> = motion.tool_path.as_ref().unwrap().moves[1..].to_vec();
        let (from, to) = (arcs[0].span_s[0], arcs[arcs.len() - 1].span_s[1]);
        let down = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
        let (mut turned, mut off, mut farthest) = (0.0f64, 0.0f64, 0.0f64);
        for (t, pose) in poses(&model, &motion, 4000).iter().filter(|(t, _)| *t >= from + 1e-9 && *t <= to) {
            turned = turned.max((pose.rotation.inverse() * down).angle());
            let flange = pose * nalgebra::Point3::new(0.0, 0.0, -0.35);
            off = off.max(((flange - nalgebra::Point3::new(1.6, 0.0, 1.2)).norm() - 0.1).abs());
            farthest = farthest.max((flange - nalgebra::Point3::new(1.7, 0.0, 1.2)).norm());
            assert!(t.is_finite());
        }
        // Measured: 2e-7 rad (a RAPID quaternion is exact; URScript angles have nine digits), 2e-6
        // m in the blend.
        assert!(turned < 1e-6 && off < 1e-4 && farthest > 0.1999, "{name}: {turned:.1e} rad, {off:.1e} m, {farthest}");
    }
}

/// A number that no robot can follow is refused at its location, before any computation.
#[test]
fn numbers_of_path_files_beyond_what_a_robot_can_do_are_refused() {
    let robot = kr210();
    let head = "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\n";
    let start = "[[move]]\njoints = [0, -60, 90, 0, 60, 0]\n";
    let program = folder("huge-nc");
    std::fs::write(program.join("part.nc"), "G21 G90\nG0 X1700 Y0 Z1200\nM30\n").unwrap();
    let file = format!("[program]\nfile = {:?}\nrpy = [0, 180, 0]\n", program.join("part.nc").display().to_string());
    let cases = [
        format!("{head}[[move]]\njoints = [inf, -60, 90, 0, 60, 0]\n"),
        format!("{head}[[move]]\njoints = [0, -60, 90, 0, 60, nan]\n"),
        format!("{head}[[move]]\njoints = [1e308, -60, 90, 0, 60, 0]\n"),
        format!("{head}{start}[[move]]\nline = [1e308, 0, 1200]\n"),
        format!("{head}{start}[[move]]\nline = [-inf, 0, 1200]\n"),
        format!("{head}{start}[[move]]\njoint_to = [1700, 0, 1200]\nrpy = [0, 180, 0]\nnear = [inf, 0, 0, 0, 0, 0]\n"),
        format!("{head}{start}[[move]]\nline = [1700, 0, 1200]\nrpy = [inf, 0, 0]\n"),
        format!("{head}{start}[[move]]\narc = [1700, 0, 1200]\nvia = [1e300, 0, 1200]\n"),
        format!("{head}{start}[[move]]\narc = [1700, 0, 1200]\nvia = [1600, 0, 1200]\nangle = 1e300\n"),
        format!("{head}{start}[[move]]\ndwell = inf\n"),
        format!("{head}{start}[[move]]\ndwell = 1e300\n"),
        format!("{head}speed = 1e-300\n{start}"),
        format!("{head}blend = inf\n{start}"),
        format!("{head}rise = 1e300\n{start}"),
        format!("{head}base = {{ xyz = [inf, 0, 0] }}\n{start}"),
        format!("{head}tool = {{ xyz = [1e300, 0, 0] }}\n{start}"),
        format!("{head}redundancy = [1e300, 0, 0, 0, 0, 0]\n{start}"),
        format!("{head}[limits]\njoint_1 = {{ velocity = 1e-300 }}\n{start}"),
        format!("{head}[standard]\nmotion = \"settle\"\ncentre = [inf, 0, 0]\nside = 100.0\nrpy = [0, 180, 0]\n"),
        format!("{head}[standard]\nmotion = \"settle\"\ncentre = [0, 0, 0]\nside = 1e300\nrpy = [0, 180, 0]\n"),
        format!("{head}{file}start = [inf, -60, 90, 0, 60, 0]\n"),
        format!("{head}{file}rapid = inf\n"),
        format!("{head}{file}rapid = 1e-300\n"),
    ];
    for text in cases {
        let error = load(&robot, "huge.toml", &text).unwrap_err().to_string();
        assert!(error.contains("expected") && error.contains("huge.toml"), "{text}\n  gives {error}");
    }
    std::fs::remove_dir_all(program).unwrap();
}

/// Truth: the straight line between the TCP at the start and the first point.
#[test]
fn the_first_rapid_from_joint_values_is_a_line_where_rapids_have_a_speed() {
    let robot = kr210();
    let model = robot.rigid_model().unwrap();
    let folder = folder("first-rapid");
    std::fs::write(folder.join("part.nc"), "G21 G90 G61\nG0 X1600 Y300 Z1200\nG1 X1700 F6000\nM30\n").unwrap();
    let text = format!(
        "format = 1\n[path]\nlengths = \"mm\"\nangles = \"deg\"\n[program]\nfile = {:?}\nstart = [0, -60, 90, 0, 60, 0]\nrapid = 300.0\n",
        folder.join("part.nc").display().to_string()
    );
    let motion = load(&robot, "part.toml", &text).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    let places: Vec<Vector3<f64>> =
        poses(&model, &motion, 2000).iter().map(|(_, pose)| pose.translation.vector).collect();
    let corners = [places[0], Vector3::new(1.6, 0.3, 1.2), Vector3::new(1.7, 0.3, 1.2)];
    let off = places.iter().map(|p| from_polyline(p, &corners)).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off:.1e} m from the lines");
}
