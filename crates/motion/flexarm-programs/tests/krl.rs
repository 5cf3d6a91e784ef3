//! KUKA KRL: values of fixtures against explicit products of rotation matrices and numbers computed
//! by hand.

use crate::common::{assert_pose, at_mm, euler_product, joints_deg, moves, pose, read, read_text};
use approx::assert_relative_eq;
use flexarm_path::program::{Blend, Configuration, Item, MoveKind, Selection, Target};
use flexarm_programs::ReadOptions;
use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Vector3};

#[test]
fn inline_forms_of_a_pendant_take_speed_frames_and_blends_from_the_data_list() {
    let program = read("pendant.src", &ReadOptions::default());
    let moves = moves(&program);
    assert_eq!(program.name, "pendant");
    assert_eq!(moves.len(), 3);

    let (home, ptp, lin) = (moves[0], moves[1], moves[2]);
    assert_eq!((home.place.line, home.statement.as_str()), (Some(16), "PTP XHOME"));
    for (found, expected) in joints_deg(home).iter().zip([10.0, -90.0, 90.0, 0.0, 45.0, 0.0]) {
        assert_relative_eq!(*found, expected, epsilon = 1e-12);
    }
    assert_eq!(home.speed.joint_fraction, Some(0.5));
    assert_eq!(home.blend, Blend::Stop);

    // A is about z, B about the new y, C about the new x.
    assert_pose(&pose(ptp), &at_mm(1200.0, -300.0, 900.0, euler_product(30.0, 40.0, -50.0)));
    assert_pose(&ptp.X_WB, &at_mm(500.0, 0.0, 100.0, euler_product(90.0, 0.0, 0.0)));
    assert_pose(&ptp.X_FT.unwrap(), &at_mm(10.0, 20.0, 150.0, euler_product(0.0, 90.0, 0.0)));
    assert_eq!((ptp.speed.joint_fraction, ptp.speed.joint_acceleration_fraction), (Some(0.3), Some(0.8)));
    // 60 % of half the path
    assert_eq!(ptp.blend, Blend::Fraction(0.3));
    let Target::Pose { configuration, .. } = &ptp.to else { panic!() };
    assert_eq!(*configuration, Configuration::Selected(Selection::Kuka { status: Some(2), turn: Some(35) }));

    assert_eq!((lin.speed.linear_m_s, lin.kind.clone()), (Some(0.4), MoveKind::Line));
    assert_relative_eq!(lin.speed.linear_m_s2.unwrap(), 0.5 * 2.3, max_relative = 1e-15);
    // WAIT SEC after the output makes the move stop despite C_DIS.
    assert_eq!(lin.blend, Blend::Stop);
    assert!(matches!(&program.items[3], Item::Dwell { place, seconds: 0.5 } if place.line == Some(31)));
    let outputs = program.notes.iter().find(|note| note.message.starts_with("inputs and outputs")).unwrap();
    assert!(outputs.location.ends_with(":30:1"), "{outputs}");
}

#[test]
fn what_a_target_leaves_out_stays_and_relative_moves_add() {
    let program = read("shapes.src", &ReadOptions::default());
    let moves = moves(&program);
    let expected = [[0.0, 0.0, 0.0], [0.0, 20.0, 0.0], [-15.0, 20.0, 5.0]];
    for (step, [a1, a4, a6]) in moves.iter().zip(expected) {
        let joints = joints_deg(step);
        for (found, expected) in joints.iter().zip([a1, -90.0, 90.0, a4, 45.0, a6]) {
            assert_relative_eq!(*found, expected, epsilon = 1e-12);
        }
        assert_relative_eq!(step.speed.joint_fraction.unwrap(), 0.4 * 0.5, max_relative = 1e-15);
    }
    // The base is the product of two frames: 100 mm along y of the first one, rotated by 90
    // degrees.
    let X_WB = at_mm(1000.0, 100.0, 0.0, euler_product(90.0, 0.0, 0.0));
    let R = euler_product(0.0, 0.0, 180.0);
    let expected = [(100.0, 50.0), (120.0, 50.0), (140.0, 50.0), (160.0, 50.0), (160.0, 80.0), (170.0, 75.0)];
    for (step, (x, z)) in moves[3..9].iter().zip(expected) {
        assert_pose(&step.X_WB, &X_WB);
        assert_pose(&pose(step), &at_mm(x, 0.0, z, R));
    }
    let blends: Vec<Blend> = moves[4..8].iter().map(|step| step.blend).collect();
    let angle = 20f64.to_radians();
    assert_eq!(
        blends,
        [Blend::Distance(0.008), Blend::Velocity(0.7), Blend::Distance(0.008), Blend::Orientation(angle)]
    );
    assert_eq!(moves[4].speed.linear_m_s, Some(0.1)); // 0.2 m/s at 50 %
    assert_relative_eq!(moves[4].speed.angular_rad_s.unwrap(), 50f64.to_radians(), max_relative = 1e-15);
    assert_eq!(moves[4].speed.linear_m_s2, Some(1.5)); // the override does not affect accelerations
}

#[test]
fn frames_are_seen_from_the_left_one_and_tool_moves_follow_the_tool() {
    let program = read("shapes.src", &ReadOptions::default());
    let moves = moves(&program);
    // The tool points down (C = 180): -20 along its z is 20 upwards, a rotation of 30 about it is
    // -30 about the base's z.
    let R = euler_product(-30.0, 0.0, 0.0) * euler_product(0.0, 0.0, 180.0);
    assert_pose(&pose(moves[9]), &at_mm(160.0, 0.0, 70.0, R));
    assert_pose(&pose(moves[10]), &at_mm(160.0, 0.0, 50.0, R)); // 20 along the tool: downwards
    assert_pose(&pose(moves[11]), &at_mm(160.0, 0.0, 65.0, R)); // raise(15)
}

#[test]
fn circles_have_their_auxiliary_point_and_angle_and_splines_pass_their_knots() {
    let program = read("shapes.src", &ReadOptions::default());
    let moves = moves(&program);
    let MoveKind::Arc { via, angle, turns_with_path, .. } = &moves[12].kind else { panic!() };
    assert_eq!(*via, Vector3::new(0.18, 0.02, 0.05));
    assert_relative_eq!(angle.unwrap(), 3.0 * std::f64::consts::PI, max_relative = 1e-15);
    assert!(!turns_with_path);
    let kinds: Vec<&MoveKind> = moves[13..].iter().map(|step| &step.kind).collect();
    assert_eq!(kinds, [&MoveKind::Spline, &MoveKind::Line, &MoveKind::Spline]);
    let blends: Vec<Blend> = moves[13..].iter().map(|step| step.blend).collect();
    assert_eq!(blends, [Blend::Pass, Blend::Pass, Blend::Stop]);
    assert!(moves[13..].iter().all(|step| step.speed.linear_m_s == Some(0.05)));
    assert_pose(&pose(moves[15]), &at_mm(220.0, 30.0, 50.0, euler_product(0.0, 0.0, 180.0)));
}

#[test]
fn after_a_circle_of_540_degrees_the_robot_is_on_its_other_side() {
    let text = "DEF c()\nPTP {X 0, Y 0, Z 0, A 0, B 0, C 0}\nCIRC {X 10, Y 10, Z 0}, {X 20, Y 0, Z 0}, CA 540\n\
                LIN_REL {Z 5}\nCIRC {X 30, Y 10, Z 5}, {X 40, Y 0, Z 5}, CA 90\nLIN_REL {Z 5}\nEND\n";
    let program = read_text("c.src", text, &ReadOptions::default()).unwrap();
    let moves = moves(&program);
    // Targets without angles keep those of the start.
    assert_pose(&pose(moves[2]), &at_mm(20.0, 0.0, 5.0, Rotation3::identity()));
    assert_pose(&pose(moves[4]), &at_mm(30.0, 10.0, 10.0, Rotation3::identity()));
}

#[test]
fn spline_inline_forms_take_their_settings_from_with() {
    let text = "DEF s()\nDECL E6POS XP1\nDECL FDAT FP1\nDECL LDAT LCPDAT1\nXP1={X 100,Y 0,Z 0,A 0,B 0,C 0,S 6,T 2}\n\
        FP1={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE}\nLCPDAT1={VEL 2.0,ACC 100.0,APO_DIST 7.0,ORI_TYP #VAR}\n\
        TOOL_DATA[1]={X 0,Y 0,Z 99,A 0,B 0,C 0}\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.9\n\
        SPTP XP1 WITH $VEL_AXIS[1]=SVEL_JOINT(35.0), $TOOL=STOOL2(FP1), $BASE=SBASE(FP1.BASE_NO), $LOAD=SLOAD(FP1.TOOL_NO), \
        $ACC_AXIS[1]=SACC_JOINT(PDEFAULT), $GEAR_JERK[1]=SGEAR_JERK(PDEFAULT)\n\
        SLIN {X 200} WITH $VEL=SVEL_CP(0.3, , LCPDAT1), $APO=SAPO(LCPDAT1), $ORI_TYPE=SORI_TYP(LCPDAT1) C_SPL\n\
        LIN {X 300}\nEND\n";
    let program = read_text("s.src", text, &ReadOptions::default()).unwrap();
    let moves = moves(&program);
    assert_eq!(moves[0].speed.joint_fraction, Some(0.35));
    assert_pose(&moves[0].X_FT.unwrap(), &at_mm(0.0, 0.0, 99.0, Rotation3::identity()));
    assert_eq!((moves[1].speed.linear_m_s, moves[1].blend), (Some(0.3), Blend::Distance(0.007)));
    // WITH ends with its move.
    assert_eq!(moves.len(), 3);
    assert_eq!(moves[2].speed.linear_m_s, Some(0.9));
}

#[test]
fn a_relative_move_from_joint_values_uses_the_kinematics_that_are_given() {
    let text =
        "DEF r()\n$TOOL={X 0,Y 0,Z 100,A 0,B 0,C 0}\nPTP {A1 90,A2 0,A3 0,A4 0,A5 0,A6 0}\nLIN_REL {X 50}\nEND\n";
    let refused = read_text("r.src", text, &ReadOptions::default()).unwrap_err();
    assert!(refused.starts_with("r.src:4:9: `{X 50}`: coordinates that are not given stay"), "{refused}");
    // An arm of one metre that rotates about z.
    let forward = |q: &[f64]| -> Option<Pose> {
        Some(at_mm(1000.0 * q[0].cos(), 1000.0 * q[0].sin(), 0.0, euler_product(q[0].to_degrees(), 0.0, 0.0)))
    };
    let options = ReadOptions { forward: Some(&forward), ..ReadOptions::default() };
    let program = read_text("r.src", text, &options).unwrap();
    assert_pose(&pose(moves(&program)[1]), &at_mm(50.0, 1000.0, 100.0, euler_product(90.0, 0.0, 0.0)));
}

#[test]
fn statements_that_cannot_be_run_are_named_with_place_and_remedy() {
    let head = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n";
    let cases = [
        ("WAIT FOR $IN[1]", "t.src:3:1: `WAIT FOR $IN[1]`: depends on `$IN[1]`, which only the controller knows"),
        ("IF $IN[3] THEN\nPTP {A1 5}\nENDIF", "t.src:3:4: `$IN[3]`: depends on `$IN[3]`"),
        ("LOOP\nPTP {A1 5}\nENDLOOP", "t.src:3:1: `LOOP`: this loop does not end"),
        ("WHILE TRUE\nPTP {A1 5}\nENDWHILE", "this loop does not end"),
        ("GOTO there", "`GOTO there`: jumps (GOTO) are not read"),
        ("grip(1)", "`grip(1)`: the routine `grip` is neither in this file nor beside it"),
        ("$VEL_XYZ = 3", "`$VEL_XYZ`: what the system variable `$VEL_XYZ` does to the motion is not known here"),
        ("$BASE = BASE_DATA[3]\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "$BASE depends on `BASE_DATA[3]`"),
        ("BAS(#BASE,4)", "BASE_DATA[4] is not in the files: give `$config.dat`"),
        ("LIN {X 1,Y 2,Z 3,A 0,B 0,C 0} C_FOO", "`C_FOO`: `C_FOO` behind a target is not known"),
        ("LIN {A1 5}", "`LIN {A1 5}`: a path needs a target with X, Y, Z"),
        ("PTP", "`PTP`: a value is expected here, found the end of the line"),
        ("LIN {X 1,Y 2,Z 3,A 0,B 0,C 0", "`}` is expected here, found the end of the line"),
        ("$IPO_MODE = #TCP\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "the robot guides the work piece here"),
        ("$ORI_TYPE = #JOINT\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "$ORI_TYPE = #JOINT is not read"),
        (
            "PTP {X 1,Y 2,Z 3,A 0,B 0,C 0,E1 5}\nPTP {X 1,Y 2,Z 3,A 0,B 0,C 0,E1 6}",
            "external axis 1 moves, from 5 (t.src:3:5) to 6",
        ),
        (
            "PTP {X 1,Y 2,Z 3,A 0,B 0,C 0}\nPTP {A1 10}",
            "axis 2 stays or moves on, but the position before was not given in axis values",
        ),
        ("$VEL_AXIS[2]=50\nPTP {A1 10}", "$VEL_AXIS[] differs between the axes"),
        (
            "PTP {X 1,Y 2,Z 3,A 0,B 0,C 0}\nLIN_REL {B 10}",
            "a relative turn by B or C in the base is understood in two ways",
        ),
        ("PTP_SPLINE\nSPL {X 1}\nENDSPLINE", "splines of joint moves (PTP_SPLINE) are not read"),
        ("SPL {X 1,Y 2,Z 3,A 0,B 0,C 0}", "SPL is allowed in a SPLINE block only"),
        ("PTP XHOME9", "depends on `XHOME9`, in `$config.dat` (`companions`), which only the controller knows"),
        ("IF TRUE THEN\nPTP {A1 5}", "t.src:3:1: `IF`: this block does not end: `ENDIF` is missing"),
        ("x = 1 / 0", "`1 / 0`: a division by 0"),
    ];
    for (statement, message) in cases {
        let text = format!("DEF t()\n{head}{statement}\nEND\n");
        let error = read_text("t.src", &text, &ReadOptions::default()).expect_err(statement);
        assert!(error.contains(message), "{statement}\n  gives {error}\n  not   {message}");
    }
    let first =
        read_text("t.src", "DEF t()\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n", &ReadOptions::default()).unwrap_err();
    assert!(
        first.starts_with("t.src:2:1: `LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}`: the first move must be a joint move"),
        "{first}"
    );
}

#[test]
fn options_decide_what_the_file_leaves_open() {
    let text =
        "DEF o()\nBAS(#BASE,4)\nPTP {X 1,Y 2,Z 3,A 0,B 0,C 0}\nWAIT FOR $IN[2]\nLOOP\nLIN_REL {X 1}\nENDLOOP\nEND\n";
    let options = ReadOptions {
        given: vec![("BASE_DATA[4]".into(), "{X 10,Y 0,Z 0,A 0,B 0,C 0}".into())],
        waits_are_over: true,
        endless_passes: Some(3),
        ..ReadOptions::default()
    };
    let program = read_text("o.src", text, &options).unwrap();
    let moves = moves(&program);
    assert_eq!(moves.len(), 4);
    assert_pose(&pose(moves[3]), &at_mm(4.0, 2.0, 3.0, Rotation3::identity()));
    assert_pose(&moves[3].X_WB, &at_mm(10.0, 0.0, 0.0, Rotation3::identity()));
    let starts = ReadOptions { start: Some(vec![0.0; 6]), ..ReadOptions::default() };
    assert!(read_text("t.src", "DEF t()\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n", &starts).is_ok());
}
