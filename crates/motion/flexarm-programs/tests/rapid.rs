//! ABB RAPID: values of a fixture against explicit rotation matrices of quaternions and numbers
//! computed by hand.

use crate::common::{assert_pose, at_mm, euler_product, joints_deg, moves, pose, read, read_text};
use approx::assert_relative_eq;
use flexarm_path::program::{Blend, Configuration, Item, MoveKind, Selection, Target};
use flexarm_programs::ReadOptions;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Explicit rotation matrix of a quaternion with the real part first.
fn of_quaternion(q: [f64; 4]) -> Rotation3<f64> {
    let [w, x, y, z] = q;
    Rotation3::from_matrix_unchecked(Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    ))
}

#[test]
fn targets_tools_and_work_objects_are_poses_of_their_quaternions() {
    let program = read("cell.mod", &ReadOptions::default());
    let moves = moves(&program);
    assert_eq!(program.name, "Cell");
    for (found, expected) in joints_deg(moves[0]).iter().zip([10.0, -20.0, 30.0, 0.0, 45.0, -60.0]) {
        assert_relative_eq!(*found, expected, epsilon = 1e-12);
    }
    let R = of_quaternion([0.5, 0.5, 0.5, 0.5]);
    assert_pose(&pose(moves[1]), &at_mm(600.0, 100.0, 700.0, R));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert_pose(&moves[1].X_FT.unwrap(), &at_mm(0.0, 0.0, 120.0, of_quaternion([half, 0.0, half, 0.0])));
    // User frame rotated by 90 degrees about z; the object frame's (0, 50) is (-50, 0) there.
    assert_pose(&moves[1].X_WB, &at_mm(950.0, 0.0, 20.0, euler_product(90.0, 0.0, 0.0)));
    let Target::Pose { configuration, .. } = &moves[1].to else { panic!() };
    assert_eq!(*configuration, Configuration::Selected(Selection::Abb { quadrants: [0, -1, 2], cfx: 1 }));
    assert_pose(&pose(moves[2]), &at_mm(610.0, 100.0, 670.0, R)); // Offs is in the object frame
    // RelTool \Rz:=90 at 12 mm along the tool
    assert_pose(&pose(moves[7]), &at_mm(600.0, 0.0, 712.0, euler_product(90.0, 0.0, 0.0)));
}

/// Truth: lines and columns counted by hand; the text before the third statement has a letter of two
/// bytes, and the loop runs every statement five times.
#[test]
fn a_note_names_each_of_its_places_once_also_in_a_loop_and_counts_columns_in_letters() {
    let start = "MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;";
    let outputs = "SetDO a,1;\n".repeat(8);
    let text = format!(
        "MODULE m\nPROC main()\n{start}\nFOR i FROM 1 TO 5 DO\n  SetDO a,1; TPWrite \"ü\"; SetDO b,1;\n{outputs}ENDFOR\nENDPROC\nENDMODULE\n"
    );
    let program = read_text("m.mod", &text, &ReadOptions::default()).unwrap();
    let note = program.notes.iter().find(|note| note.message.starts_with("outputs")).unwrap().to_string();
    let note = note.replace("/nowhere/", "");
    let truth = "m.mod:5:3: outputs are not simulated (also at m.mod:5:27, m.mod:6:1, m.mod:7:1 and 6 more)";
    assert_eq!(note, truth);
}

#[test]
fn speeds_zones_and_times_are_those_of_their_data_and_switches() {
    let program = read("cell.mod", &ReadOptions::default());
    let moves = moves(&program);
    assert_eq!(moves[1].speed.linear_m_s, Some(0.5));
    assert_relative_eq!(moves[1].speed.angular_rad_s.unwrap(), 500f64.to_radians(), max_relative = 1e-15);
    assert_eq!(moves[1].blend, Blend::Distance(0.01));
    assert_relative_eq!(moves[2].speed.linear_m_s.unwrap(), 0.075, max_relative = 1e-15);
    assert_relative_eq!(moves[2].speed.angular_rad_s.unwrap(), 30f64.to_radians(), max_relative = 1e-15);
    assert_eq!(moves[2].blend, Blend::Stop);
    // \V takes precedence over v200, \Z over z50; the loop counts downwards automatically.
    let xs: Vec<f64> = moves[3..5].iter().map(|step| pose(step).translation.x).collect();
    assert_eq!(xs, [0.65, 0.6]);
    for step in &moves[3..5] {
        assert_relative_eq!(step.speed.linear_m_s.unwrap(), 0.12, max_relative = 1e-15);
        assert_eq!(step.blend, Blend::Distance(0.004));
    }
    assert_eq!(moves[5].speed.duration_s, Some(3.0));
    assert_relative_eq!(pose(moves[5]).translation.z, 0.74, max_relative = 1e-15);
    let MoveKind::Arc { via, turns_with_path, .. } = &moves[6].kind else { panic!() };
    assert!((via - Vector3::new(0.625, 0.025, 0.74)).amax() < 1e-15);
    assert!(turns_with_path);
    // VelSet 50, 400: half of v1000 is above 400 mm/s; AccSet 60.
    assert_relative_eq!(moves[7].speed.linear_m_s.unwrap(), 0.4, max_relative = 1e-15);
    assert_eq!(moves[7].speed.joint_acceleration_fraction, Some(0.6));
    assert!(matches!(&program.items[8], Item::Dwell { place, seconds: 0.25 } if place.line == Some(37)));
    assert_eq!((moves[8].place.line, pose(moves[8]).translation.x), (Some(43), 0.65)); // CASE 4
}

#[test]
fn statements_that_cannot_be_run_are_named_with_place_and_remedy() {
    let target = "[[600,0,700],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let head = format!("MoveJ {target}, v100, fine, tool0;\n");
    let cases = [
        ("WaitDI di1, 1;", "t.mod:4:1: `WaitDI di1, 1`: depends on `waitdi`, which only the controller knows"),
        ("IF di1 = 1 MoveL Offs(CRobT(\\Tool:=tool0),0,0,1), v5, fine, tool0;", "`di1 = 1`: depends on `di1`"),
        ("WHILE TRUE DO\nMoveJ $, v5, fine, tool0;\nENDWHILE", "t.mod:4:1: `WHILE TRUE DO MoveJ"),
        ("MoveL *, v100, fine, tool0;", "the target `*` is kept by the controller"),
        (
            "MoveL [[600,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;",
            "pos has 3 parts, found 2",
        ),
        (
            "MoveL [[600,0,7],[2,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;",
            "the quaternion [2.0, 0.0, 0.0, 0.0] has not the length 1",
        ),
        ("MoveL $, v123, fine, tool0;", "`v123`: depends on `v123`"),
        (
            "MoveL $, v100, fine, tool0\\WObj:=[FALSE,FALSE,\"STN1\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];",
            "this work object is moved by a mechanical unit (ufprog FALSE)",
        ),
        (
            "MoveL $, v100, fine, [FALSE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];",
            "the robot carries the work piece (robhold FALSE)",
        ),
        ("MoveL $, v100, fine;", "the tool is missing: put `tool0` for the flange"),
        (
            "MoveL [[600,0,7],[1,0,0,0],[0,0,0,0],[5,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;\nMoveL [[600,0,7],[1,0,0,0],[0,0,0,0],[9,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;",
            "external axis 1 moves, from 5 (t.mod:4:7) to 9",
        ),
        ("SearchL di1, p1, p2, v100, tool0;", "this instruction changes the motion by data outside the program"),
        ("GOTO there;", "jumps (GOTO) are not read"),
        ("%\"proc\"%;", "calls by a text (%...%) are not read"),
        ("Weld 3;", "`Weld 3`: the instruction or routine `weld` is not known here"),
        ("MoveL $, v100, fine, tool0", "`;` is expected before `endproc`"),
        ("SingArea \\LockAxis4;", "only SingArea \\Off and \\Wrist are read"),
        ("MoveL $\\Corr, v100, fine, tool0;", "corrections of the path by a sensor"),
    ];
    for (statement, message) in cases {
        let text = format!("MODULE t\nPROC main()\n{head}{}\nENDPROC\nENDMODULE\n", statement.replace('$', target));
        let error = read_text("t.mod", &text, &ReadOptions::default()).unwrap_err();
        assert!(error.contains(message), "{statement}\n  gives {error}\n  not   {message}");
    }
}

#[test]
fn settings_of_the_program_change_the_moves_behind_them() {
    let text = "MODULE m\nVAR pose shift := [[0,0,100],[1,0,0,0]];\nPROC main()\nVAR robtarget p := [[100,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
        ConfJ\\Off;\nPathAccLim TRUE\\AccMax:=3, TRUE\\DecelMax:=2;\nMoveJ p, v100, fine, tool0;\nPDispSet shift;\nCirPathMode\\CirPointOri;\n\
        MoveC Offs(p,10,10,0), Offs(p,20,0,0), v100, z10, tool0;\nPDispOff;\nMoveL p, [80,30,1,1], [FALSE,0,0,0,0,0,0], tool0;\n\
        MoveJ CRobT(\\Tool:=tool0), v100, fine, tool0;\nENDPROC\nENDMODULE\n";
    let program = read_text("m.mod", text, &ReadOptions::default()).unwrap();
    let moves = moves(&program);
    let Target::Pose { configuration, .. } = &moves[0].to else { panic!() };
    assert_eq!(*configuration, Configuration::NEAREST);
    assert_eq!(moves[0].speed.linear_m_s2, Some(2.0));
    assert_pose(&moves[1].X_WB, &at_mm(0.0, 0.0, 100.0, Rotation3::identity()));
    let MoveKind::Arc { via_rotation, turns_with_path, .. } = &moves[1].kind else { panic!() };
    assert_eq!((*via_rotation, *turns_with_path), (Some(Rotation3::identity()), false));
    assert_pose(&moves[2].X_WB, &at_mm(0.0, 0.0, 0.0, Rotation3::identity()));
    assert_eq!(moves[2].blend, Blend::Pass);
    assert_pose(&pose(moves[3]), &at_mm(100.0, 0.0, 0.0, Rotation3::identity()));
}
