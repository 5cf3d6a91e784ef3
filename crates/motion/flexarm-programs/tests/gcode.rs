//! G-code: values of a fixture against circles in closed form and numbers computed by hand.

use crate::common::{assert_pose, at_mm, euler_product, moves, pose, read, read_text};
use approx::assert_relative_eq;
use flexarm_path::program::{Blend, Item, Move, MoveKind};
use flexarm_programs::{GCodeOptions, ReadOptions, Rotary};
use nalgebra::{Rotation3, Vector3};

fn place_mm(step: &Move) -> [f64; 3] {
    (pose(step).translation.vector * 1e3).into()
}

fn via_mm(step: &Move) -> Vector3<f64> {
    match &step.kind {
        MoveKind::Arc { via, .. } => via * 1e3,
        other => panic!("{} is {other:?}", step.statement),
    }
}

#[test]
fn words_make_rapids_lines_and_arcs_with_feed_in_mm_per_minute() {
    let program = read("plate.ngc", &ReadOptions::default());
    let moves = moves(&program);
    assert_eq!((program.name.as_str(), moves[0].place.line, &moves[0].kind), ("plate", Some(6), &MoveKind::Joint));
    assert_pose(&pose(moves[0]), &at_mm(0.0, 0.0, 10.0, euler_product(0.0, 0.0, 180.0))); // the tool points down
    assert_eq!(moves[0].blend, Blend::Stop);
    assert_eq!((moves[1].speed.linear_m_s, moves[2].speed.linear_m_s), (Some(0.005), Some(0.02)));
    assert_eq!(moves[1].blend, Blend::Distance(5e-5)); // G64 P0.05
    // A quarter of a circle about (50, 10), counterclockwise: its middle is at 315 degrees.
    let side = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    assert!((via_mm(moves[3]) - Vector3::new(50.0 + side, 10.0 - side, -1.0)).norm() < 1e-12); // measured 7e-15
    // R10 clockwise from (60, 40) to (50, 50): the centre of the shorter arc is (60, 50).
    assert!((via_mm(moves[5]) - Vector3::new(60.0 - side, 50.0 - side, -1.0)).norm() < 1e-12);
    assert_eq!(moves[5].blend, Blend::Distance(5e-5));
    assert_eq!(moves[6].blend, Blend::Pass); // G61
    assert_relative_eq!(place_mm(moves[6])[0], 0.0, epsilon = 1e-12); // G91 X-50
}

#[test]
fn whole_circles_and_helices_are_arcs_that_stay_on_them() {
    let program = read("plate.ngc", &ReadOptions::default());
    let all = moves(&program);
    let on_line = |line: usize| all.iter().filter(|step| step.place.line == Some(line)).copied().collect::<Vec<_>>();
    // A full circle of radius 5 about (5, 50), clockwise: two halves, the upper one first.
    let circle = on_line(15);
    assert_eq!(circle.len(), 2);
    assert!((via_mm(circle[0]) - Vector3::new(5.0, 55.0, -1.0)).norm() < 1e-12);
    assert!((via_mm(circle[1]) - Vector3::new(5.0, 45.0, -1.0)).norm() < 1e-12);
    assert!((Vector3::from(place_mm(circle[1])) - Vector3::new(0.0, 50.0, -1.0)).norm() < 1e-12);

    // A helix of one turn, 2 mm down: each arc through three points is within 1 um of x = 5 - 5 cos
    // u, z = -1 - u / pi.
    let helix = on_line(16);
    let point = |u: f64| Vector3::new(5.0 - 5.0 * u.cos(), 50.0 - 5.0 * u.sin(), -1.0 - u / std::f64::consts::PI);
    let count = helix.len();
    let mut start = point(0.0);
    let mut worst: f64 = 0.0;
    for (k, piece) in helix.iter().enumerate() {
        let (via, end) = (via_mm(piece), Vector3::from(place_mm(piece)));
        let u = |part: f64| std::f64::consts::TAU * (k as f64 + part) / count as f64;
        assert!((via - point(u(0.5))).norm() < 1e-11 && (end - point(u(1.0))).norm() < 1e-11);
        // Plane and centre of the circle, from its perpendicular bisectors.
        let normal = (via - start).cross(&(end - start)).normalize();
        let rows =
            nalgebra::Matrix3::from_rows(&[(via - start).transpose(), (end - start).transpose(), normal.transpose()]);
        let right = Vector3::new(
            (via - start).dot(&(via + start)) / 2.0,
            (end - start).dot(&(end + start)) / 2.0,
            normal.dot(&start),
        );
        let centre = rows.try_inverse().unwrap() * right;
        for part in [0.1, 0.25, 0.4, 0.6, 0.8] {
            let p = point(u(part)) - centre;
            let off_plane = normal.dot(&p);
            let off_circle = (p - normal * off_plane).norm() - (start - centre).norm();
            worst = worst.max(off_plane.hypot(off_circle));
        }
        assert_eq!(piece.blend, Blend::Pass);
        start = end;
    }
    assert!(worst < 1e-3 && worst > 1e-6, "{worst} mm over {count} pieces"); // allowed 1e-3 mm
}

#[test]
fn planes_radii_units_and_times_follow_the_standard() {
    let program = read("plate.ngc", &ReadOptions::default());
    let all = moves(&program);
    let at = |line: usize| *all.iter().find(|step| step.place.line == Some(line)).unwrap();
    assert_eq!(place_mm(at(18)).map(|x| (x * 1e9).round() / 1e9), [15.0, 42.5, -3.0]); // X[#1 * 2] Y[50 - #1]
    let dwells = |item: &Item| matches!(item, Item::Dwell { place, seconds: 0.5 } if place.line == Some(19));
    assert!(program.items.iter().any(dwells));
    assert_relative_eq!(place_mm(at(20))[0], 25.4, max_relative = 1e-12); // G20 X1
    assert_relative_eq!(at(20).speed.linear_m_s.unwrap(), 10.0 * 0.0254 / 60.0, max_relative = 1e-15);
    assert_eq!(at(22).speed.duration_s, Some(30.0)); // G93 F2: half a minute

    // G18: I and K; from z to x is counterclockwise viewed from y. A negative radius selects the
    // longer arc.
    let text =
        "G21 G61 G18 F600\nG0 X0 Y5 Z10\nG3 X10 Z0 I0 K-10\nG17\nG3 X0 Y-5 R-10\nG90.1\nG19\nG3 Y5 Z10 J-5 K10\nM2\n";
    let program = read_text("a.nc", text, &ReadOptions::default()).unwrap();
    let moves = moves(&program);
    let side = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    assert!((via_mm(moves[1]) - Vector3::new(side, 5.0, side)).norm() < 1e-12);
    // From (10, 5) to (0, -5) with radius 10, the longer arc counterclockwise: the centre is (0,
    // 5), three quarters.
    assert!((via_mm(moves[2]) - Vector3::new(-side, 5.0 + side, 0.0)).norm() < 1e-12);
    // Absolute centre (y -5, z 10) of radius 10: a quarter, from (y -5, z 0) to (y 5, z 10).
    assert!((via_mm(moves[3]) - Vector3::new(0.0, -5.0 + side, 10.0 - side)).norm() < 1e-12);
}

#[test]
fn work_frames_offsets_and_tilts_are_those_of_the_options() {
    let X_WB = at_mm(1000.0, 0.0, 200.0, euler_product(90.0, 0.0, 0.0));
    let gcode = GCodeOptions {
        offsets: vec![("G55".into(), X_WB)],
        rotary: Rotary::Tilt,
        reference_mm: Some([0.0, 0.0, 500.0]),
        ..GCodeOptions::default()
    };
    let options = ReadOptions { gcode, ..ReadOptions::default() };
    let text = "G21 G90 G55 G61\nG0 X10 Y20 Z30\nG92 X0 Y0 Z0\nG1 X5 B30 C90 F600\nG92.1\nG53 G1 X1000 Y0 Z300\nG54\nG1 X7\nG28 Z100\nM30\n";
    let program = read_text("o.nc", text, &options).unwrap();
    let moves = moves(&program);
    assert_pose(&moves[0].X_WB, &X_WB);
    let down = euler_product(0.0, 0.0, 180.0);
    // G92 made (10, 20, 30) the zero.
    assert_pose(&pose(moves[1]), &at_mm(15.0, 20.0, 30.0, euler_product(90.0, 30.0, 0.0) * down));
    // Machine coordinates (1000, 0, 300) are 100 mm above the work zero.
    assert_pose(&pose(moves[2]), &at_mm(0.0, 0.0, 100.0, euler_product(90.0, 30.0, 0.0) * down));
    // In G54, which equals the machine frame, the tool is still at (1000, 0, 300).
    assert_pose(&moves[3].X_WB, &at_mm(0.0, 0.0, 0.0, Rotation3::identity()));
    assert_relative_eq!(place_mm(moves[3])[2], 300.0, max_relative = 1e-12);
    assert_relative_eq!(place_mm(moves[4])[2], 100.0, max_relative = 1e-12); // G28 by Z100
    assert_relative_eq!(place_mm(moves[5])[2], 500.0, max_relative = 1e-12);
    assert_relative_eq!(place_mm(moves[5])[0], 7.0, max_relative = 1e-12);
}

/// Truth: the tool position at the start, known from the kinematics; omitted coordinates are kept.
#[test]
fn from_joint_values_at_the_start_rapids_at_a_speed_are_lines_from_where_the_tool_is() {
    let start = at_mm(40.0, 30.0, 80.0, Rotation3::identity());
    let forward = |_: &[f64]| Some(start);
    for rapid_m_s in [Some(0.5), None] {
        let options = ReadOptions {
            start: Some(vec![0.0; 6]),
            forward: Some(&forward),
            own_tool: Some(at_mm(0.0, 0.0, 20.0, Rotation3::identity())),
            gcode: GCodeOptions { rapid_m_s, ..GCodeOptions::default() },
            ..ReadOptions::default()
        };
        let program = read_text("s.nc", "G21 G90\nG0 Z150\nG91\nG0 X5\nM30\n", &options).unwrap();
        let moves = moves(&program);
        let kind = if rapid_m_s.is_some() { MoveKind::Line } else { MoveKind::Joint };
        assert!(moves.iter().all(|step| step.kind == kind && step.speed.linear_m_s == rapid_m_s));
        let places = [place_mm(moves[0]), place_mm(moves[1])];
        for (found, truth) in places.iter().flatten().zip([40.0, 30.0, 150.0, 45.0, 30.0, 150.0]) {
            assert!((found - truth).abs() < 1e-9, "{places:?}");
        }
    }
}

#[test]
fn what_is_assumed_is_told() {
    let program = read_text("n.nc", "G1 F100\nG0 Z5\nG1 X10\n", &ReadOptions::default()).unwrap();
    let notes: Vec<String> = program.notes.iter().map(ToString::to_string).collect();
    for expected in [
        "neither G20 nor G21 is there: lengths are in mm",
        "neither G61 nor G64 is there",
        "no place of the work frame (G54) was given",
        "n.nc:2:1: X is not given before this move: 0 of the work frame is taken",
        "the program ends without M2 or M30",
    ] {
        assert!(notes.iter().any(|note| note.contains(expected)), "{expected} is not in {notes:?}");
    }
}

#[test]
fn codes_that_cannot_be_run_are_named_with_place_and_remedy() {
    let cases = [
        ("G41 D1 X5", "t.nc:2:1: `G41`: cutter radius compensation is not computed"),
        ("G43 H1 Z5", "`G43`: tool length compensation (G43) is not computed"),
        ("G81 X1 Y1 Z-2 R1", "`G81`: drilling cycles are not read"),
        ("G28 Z0", "the machine's reference point is not known"),
        ("G95 F0.1", "feed per turn of the spindle is not read"),
        ("G2 X10", "an arc needs its centre (I or J) or its radius (R)"),
        ("G2 X10 Y0 I4 J0", "the arc begins 4.0000 mm and ends 6.0000 mm away from its centre"),
        ("G2 X10 R3", "the radius 3.0000 mm is less than half of the way of 10.0000 mm"),
        ("G2 R5", "an arc with a radius ends where it begins"),
        ("G1 G0 X3", "two codes of one line contradict each other"),
        ("G1 X3 X4", "the letter X occurs twice"),
        ("G1 X#7", "the parameter #7 has no value"),
        ("O100 sub", "subroutines and loops (O words) are not read"),
        ("G1 A30", "rotary axes are not read as they are"),
        ("G1 U3", "the axis U is not read"),
        ("G12 X3", "this code is unknown"),
        ("G4", "G4 needs its time"),
        ("G1 Xa", "a number is expected behind the letter"),
        ("G1 F0 X3", "the feed is 0: it must be above 0"),
        ("(open", "this comment does not end on its line"),
        ("M98 P1", "subroutines (M98, M99) are not read"),
    ];
    for (line, message) in cases {
        let text = format!("G21 G61 F100 G0 X0 Y0 Z0\n{line}\nG1 X1\n");
        let error = read_text("t.nc", &text, &ReadOptions::default()).unwrap_err();
        assert!(error.contains(message), "{line}\n  gives {error}\n  not   {message}");
    }
    let error = read_text("t.nc", "G21\nG0 X0 Y0 Z0\nG1 X1\n", &ReadOptions::default()).unwrap_err();
    assert!(error.contains("no feed is set: put an F word"), "{error}");
    let error = read_text("t.nc", "G21 G1 X1 F100\nM2\n", &ReadOptions::default()).unwrap_err();
    assert!(error.contains("the first move must be a joint move"), "{error}");
}
