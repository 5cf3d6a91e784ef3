//! URScript: values of a fixture against Rodrigues' formula and numbers computed by hand.

use crate::common::{assert_pose, at_mm, euler_product, moves, pose, read, read_text, rodrigues};
use approx::assert_relative_eq;
use flexarm_path::program::{Blend, Configuration, Item, MoveKind, Target};
use flexarm_programs::ReadOptions;
use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Vector3};

#[test]
fn poses_are_places_and_rotation_vectors_in_the_base() {
    let program = read("pick.script", &ReadOptions::default());
    let moves = moves(&program);
    assert_eq!(program.name, "pick");
    assert_eq!(moves[0].to, Target::Joints(vec![0.0, -1.57, 1.57, -1.57, -1.57, 0.0]));
    assert_eq!((moves[0].speed.joint_rad_s, moves[0].speed.joint_rad_s2), (Some(0.8), Some(2.0)));
    assert_pose(&moves[0].X_FT.unwrap(), &at_mm(0.0, 0.0, 150.0, euler_product(0.0, 90.0, 0.0)));
    // The feature's x axis is the base's y axis; the tool is rotated by 180 degrees about x.
    let R = euler_product(90.0, 0.0, 0.0) * euler_product(0.0, 0.0, 180.0);
    for (k, step) in moves[1..4].iter().enumerate() {
        assert_pose(&pose(step), &at_mm(400.0, -200.0 + 50.0 * k as f64, 100.0, R));
        assert_eq!((step.blend, step.speed.linear_m_s), (Blend::Distance(0.01), Some(0.25)));
    }
    // lift by -0.2 along the tool, which points down
    assert_pose(&pose(moves[4]), &at_mm(400.0, -100.0, 300.0, R));
    let Target::Pose { configuration, .. } = &moves[4].to else { panic!() };
    assert_eq!(*configuration, Configuration::Near(vec![0.0, -1.57, 1.57, -1.57, -1.57, 0.0]));
    assert_eq!(moves[4].speed.duration_s, Some(2.5));
    let R = rodrigues(Vector3::new(0.3, -0.4, 0.5));
    assert_pose(&pose(moves[5]), &at_mm(500.0, 100.0, 300.0, R));
    assert_eq!((moves[5].speed.linear_m_s, moves[5].speed.linear_m_s2), (Some(0.1), Some(1.2)));
    let MoveKind::Arc { via, turns_with_path, .. } = &moves[6].kind else { panic!() };
    assert_eq!((*via, *turns_with_path), (Vector3::new(0.55, 0.15, 0.3), false));
    assert_pose(&pose(moves[7]), &at_mm(600.0, 100.0, 350.0, R));
    assert!(matches!(&program.items[8], Item::Dwell { place, seconds: 0.75 } if place.line == Some(26)));
    let Target::Joints(joints) = &moves[8].to else { panic!() };
    assert_relative_eq!(joints[0], std::f64::consts::FRAC_PI_2, max_relative = 1e-15);
}

#[test]
fn an_arc_of_mode_1_turns_the_tool_with_the_circle() {
    let text = "movej(p[0.5, 0, 0.3, 0, 0, 0])\nmovec(p[0.4, 0.1, 0.3, 0, 0, 0], p[0.3, 0, 0.3, 0, 0, 0], mode=1)\n";
    let program = read_text("a.script", text, &ReadOptions::default()).unwrap();
    let moves = moves(&program);
    // Half a circle counterclockwise about z.
    assert_pose(&pose(moves[1]), &at_mm(300.0, 0.0, 300.0, euler_product(180.0, 0.0, 0.0)));
    assert!(matches!(moves[1].kind, MoveKind::Arc { turns_with_path: true, .. }));
}

#[test]
fn functions_of_poses_follow_the_manual() {
    // pose_add adds positions and composes rotations; the inverse undoes; interpolation is uniform.
    let text = "a = p[0.1, 0.2, 0.3, 0.4, 0, 0]\nb = p[0.01, 0.02, 0.03, 0, 0.5, 0]\nmovej(pose_add(a, b))\n\
        movel(pose_trans(pose_inv(a), pose_trans(a, b)))\nmovel(interpolate_pose(a, p[0.3, 0.2, 0.3, 1.2, 0, 0], 0.25))\n\
        r = rpy2rotvec([0.1, 0.2, 0.3])\nmovel(p[0, 0, 0.5, r[0], r[1], r[2]])\nb[2] = 0.7\nmovel(b)\nx = (2 + 4) / 3 - 5 % 3\nsleep(x + 0.5)\n\
        n = 0\nwhile True:\nn = n + 1\nif n == 3: break end\nmovel(p[0, 0, 0.1 * n, 0, 0, 0])\nend\nsleep(1)\n";
    let text = text.replace("if n == 3: break end", "if n == 3:\nbreak\nend");
    let program = read_text("f.script", &text, &ReadOptions::default()).unwrap();
    let moves = moves(&program);
    let turn = rodrigues(Vector3::new(0.4, 0.0, 0.0)) * rodrigues(Vector3::new(0.0, 0.5, 0.0));
    assert_pose(&pose(moves[0]), &at_mm(110.0, 220.0, 330.0, turn));
    assert_pose(&pose(moves[1]), &at_mm(10.0, 20.0, 30.0, rodrigues(Vector3::new(0.0, 0.5, 0.0))));
    assert_pose(&pose(moves[2]), &at_mm(150.0, 200.0, 300.0, rodrigues(Vector3::new(0.6, 0.0, 0.0))));
    let [roll, pitch, yaw] = [0.1, 0.2, 0.3f64].map(f64::to_degrees);
    assert_pose(&pose(moves[3]), &at_mm(0.0, 0.0, 500.0, euler_product(yaw, pitch, roll)));
    assert_relative_eq!(pose(moves[4]).translation.z, 0.7);
    assert_eq!(moves.len(), 7); // two passes of the loop, then break
    let dwells: Vec<f64> = program
        .items
        .iter()
        .filter_map(|item| if let Item::Dwell { seconds, .. } = item { Some(*seconds) } else { None })
        .collect();
    assert_eq!(dwells, [0.5, 1.0]); // 6 / 3 - 2 + 0.5
}

#[test]
fn statements_that_cannot_be_run_are_named_with_place_and_remedy() {
    let cases = [
        (
            "movel(get_actual_tcp_pose())",
            "t.script:3:9: `get_actual_tcp_pose()`: depends on `get_actual_tcp_pose(...)`",
        ),
        ("servoj([0,0,0,0,0,0])", "`servoj([0,0,0,0,0,0])`: `servoj` moves the robot by data outside the program"),
        ("while True:\n movej([0,0,0,0,0,1])\nend", "t.script:3:3: `while True:`: this loop does not end"),
        ("if get_digital_in(1):\n movej([0,0,0,0,0,1])\nend", "`get_digital_in(1)`: depends on `get_digital_in(...)`"),
        ("movej([0,0,0,0,0])", "a list of 6 joint values in rad is expected, found 5"),
        ("movel(p[1,2,3])", "a pose has 6 numbers, p[x, y, z, rx, ry, rz]; found 3"),
        ("movec([0,0,0,0,0,0], p[0,0,0,0,0,0])", "depends on the kinematics of the robot"),
        ("grip_close()", "`grip_close` is not known here"),
        ("run t()", "threads are not simulated"),
        ("movej(q)", "`q`: depends on `q`"),
        ("movej([0,0,0,0,0,0], r=-1)", "the size of the blend is -1, expected 0 to 10000"),
        ("movej([0,0,0,0,0,0], v=0)", "the joint speed is 0, expected 1e-6 to 1e12 (rad/s)"),
        ("movel(p[1,2,3,0,0,0]", "`)` is expected here"),
        ("if True:\nmovej([0,0,0,0,0,1])", "this block does not end: `end` is missing"),
    ];
    for (statement, message) in cases {
        let text = format!("def t():\n  movej([0,0,0,0,0,0])\n  {statement}\nend\n");
        let error = read_text("t.script", &text, &ReadOptions::default()).unwrap_err();
        assert!(error.contains(message), "{statement}\n  gives {error}\n  not   {message}");
    }
    let two = "def a():\n movej([0,0,0,0,0,0])\nend\ndef b():\n movej([0,0,0,0,0,0])\nend\n";
    let error = read_text("t.script", two, &ReadOptions::default()).unwrap_err();
    assert!(
        error.contains(
            "the file has the definitions `a`, `b` and calls none: name the one with which the program starts"
        ),
        "{error}"
    );
    let options = ReadOptions { entry: Some("b".into()), ..ReadOptions::default() };
    assert_eq!(read_text("t.script", two, &options).unwrap().items.len(), 1);
}

#[test]
fn kinematics_that_are_given_serve_forward_kinematics_of_the_program() {
    let forward = |q: &[f64]| -> Option<Pose> { Some(at_mm(0.0, 0.0, 1000.0 * q[0], Rotation3::identity())) };
    let options = ReadOptions { forward: Some(&forward), ..ReadOptions::default() };
    let text = "set_tcp(p[0,0,0.1,0,0,0])\nmovej([0.2,0,0,0,0,0])\nmovel(pose_trans(get_forward_kin([0.5,0,0,0,0,0]), p[0.01,0,0,0,0,0]))\n";
    let program = read_text("k.script", text, &options).unwrap();
    assert_pose(&pose(moves(&program)[1]), &at_mm(10.0, 0.0, 600.0, Rotation3::identity()));
}
