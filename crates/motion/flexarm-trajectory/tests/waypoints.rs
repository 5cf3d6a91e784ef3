//! Waypoint files: effect of each key, and all errors of a file.

use std::f64::consts::PI;
use std::path::Path;

use approx::assert_relative_eq;
use flexarm_settings::Finding;
use flexarm_trajectory::{JointLimits, Trajectory, TrajectoryError};
use proptest::prelude::*;

const HEAD: &str = "format = 1\nunit = \"deg\"\njoints = [\"a\", \"b\"]\nstart = [0, 10.0]\n";

fn parse(text: &str) -> Trajectory {
    Trajectory::parse_toml(text, "arm.toml", &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn fault(text: &str) -> Finding {
    match Trajectory::parse_toml(text, "arm.toml", &[]) {
        Err(TrajectoryError::File(error)) => *error,
        other => panic!("expected an error with a place in the file, got {other:?}\n{text}"),
    }
}

fn position(trajectory: &Trajectory, t: f64) -> Vec<f64> {
    let n = trajectory.joints().len();
    let (mut q, mut qdot, mut qddot) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    trajectory.sample(t, &mut q, &mut qdot, &mut qddot);
    q
}

#[test]
fn a_table_moves_some_joints_and_leaves_the_others() {
    let trajectory = parse(&format!(
        "{HEAD}[[move]]\nto = {{ b = 90 }}\nduration = 1\nhold = 0.5\n[[move]]\nto = [45, 0]\nduration = 2"
    ));
    assert_eq!(trajectory.duration(), 3.5);
    let q = position(&trajectory, 1.2);
    assert_eq!(q, [0.0, PI / 2.0]);
    assert_relative_eq!(position(&trajectory, 3.5)[0], PI / 4.0, max_relative = 1e-14); // measured 1.1e-15
}

#[test]
fn prismatic_joints_are_in_metres_in_a_file_of_degrees() {
    let text = "format = 1\nunit = \"deg\"\nmetres = [\"rail\"]\njoints = [\"rail\", \"axis\"]\nstart = [0.5, 180]\n\
                acceleration = [2.0, 90.0]\nprofile = \"trapezoid\"\nrounding = 0\n[limits]\nrail = { velocity = 1.0 }\n\
                axis = { velocity = 90.0 }\n[[move]]\nto = { rail = 1.5 }";
    let trajectory = parse(text);
    assert_eq!(position(&trajectory, 0.0), [0.5, PI]);
    // 1 m at 1 m/s and 2 m/s²: 0.5 s of cruise and 1 s of ramps.
    assert_relative_eq!(trajectory.duration(), 1.5, max_relative = 1e-15);
}

/// The limits of the move take precedence over those of the file, and these over the caller's.
#[test]
fn the_nearest_limit_counts() {
    let robot = JointLimits { velocity: PI, acceleration: PI, ..JointLimits::UNLIMITED };
    let head = "format = 1\nunit = \"deg\"\njoints = [\"a\"]\nstart = [0]\nprofile = \"trapezoid\"\nrounding = 0\n";
    let duration = |tail: &str| {
        let known = [("unused", JointLimits::UNLIMITED), ("a", robot)];
        Trajectory::parse_toml(&format!("{head}{tail}"), "arm.toml", &known).unwrap().duration()
    };
    let all = 1e-14;
    // 360 deg at 180 deg/s: 2 s of cruise plus v / a of ramps.
    assert_relative_eq!(duration("[[move]]\nto = [360]"), 3.0, max_relative = all);
    assert_relative_eq!(duration("speed = 0.5\n[[move]]\nto = [360]"), 4.5, max_relative = all);
    assert_relative_eq!(duration("speed = 0.5\n[[move]]\nspeed = 1.0\nto = [360]"), 3.0, max_relative = all);
    assert_relative_eq!(duration("acceleration = 360\n[[move]]\nto = [360]"), 2.5, max_relative = all);
    assert_relative_eq!(
        duration("acceleration = 360\n[[move]]\nto = [360]\nacceleration = [720]"),
        2.25,
        max_relative = all
    );
    assert_relative_eq!(duration("[limits]\na = { velocity = 90 }\n[[move]]\nto = [360]"), 4.5, max_relative = all);
}

#[test]
fn points_on_the_way_are_passed_without_a_stop() {
    let trajectory = parse(&format!("{HEAD}[[move]]\nto = [60, 10]\nvia = [[30, 40]]\nduration = 1.0"));
    assert_eq!(trajectory.moves().len(), 1);
    let knots = trajectory.kinks();
    assert_eq!(knots, [0.0, 1.0]); // the jerk is continuous at the via point
    let q = position(&trajectory, 0.5);
    assert!((q[0] - PI / 6.0).abs() < 1e-14 && (q[1] - 40.0 * PI / 180.0).abs() < 1e-14); // measured 0
}

#[test]
fn every_profile_can_be_chosen_per_move() {
    let head = "format = 1\nunit = \"rad\"\njoints = [\"a\"]\nstart = [0]\nprofile = \"s-curve\"\n";
    let trajectory = parse(&format!(
        "{head}[[move]]\nto = [1]\nduration = 1\n[[move]]\nto = [2]\nduration = 1\nprofile = \"trapezoid\"\n\
         [[move]]\nto = [3]\nduration = 1\nprofile = \"quintic\"\n"
    ));
    // s-curve: 7 pieces, trapezoid: 7 pieces, quintic: 1; each boundary of a piece is a kink.
    assert_eq!(trajectory.kinks().len(), 16);
    assert_eq!(trajectory.warnings(), []);
}

#[test]
fn each_fault_of_a_file_is_named_with_its_place() {
    let good_move = "[[move]]\nto = [1, 2]\nduration = 1\n";
    let replaced = |from: &str, to: &str| format!("{}{good_move}", HEAD.replace(from, to));
    let cases: Vec<(String, (usize, usize), &str)> = vec![
        (replaced("format = 1", "format = 2"), (1, 10), "format: format 2 is not known"),
        (replaced("format = 1\n", ""), (1, 1), "toml"),
        (replaced("\"deg\"", "\"gon\""), (2, 8), "unknown-unit"),
        (replaced("[\"a\", \"b\"]", "[]"), (3, 10), "value"),
        (replaced("\"b\"", "\"a\""), (3, 16), "value"),
        (replaced("10.0", "10.0, 3"), (4, 9), "list-length: `start` has 3 entries; expected 2"),
        (replaced("10.0", "nan"), (4, 9), "value"),
        (replaced("10.0", "\"10\""), (4, 13), "toml"),
        (replaced("unit", "metres = [\"c\"]\nunit"), (2, 11), "unknown-joint"),
        (replaced("unit", "sped = 0.5\nunit"), (2, 1), "toml"),
        (replaced("unit", "speed = 50\nunit"), (2, 9), "value"),
        (replaced("unit", "profile = \"cubic\"\nunit"), (2, 11), "toml"),
        (replaced("unit", "acceleration = -1\nunit"), (2, 16), "value"),
        (replaced("unit", "jerk = [1]\nunit"), (2, 8), "list-length"),
        (replaced("unit", "rounding = 1.5\nunit"), (2, 12), "value"),
        (format!("{HEAD}[limits]\nc = {{}}\n{good_move}"), (6, 1), "unknown-joint"),
        (format!("{HEAD}[limits]\na = {{ velocity = 0 }}\n{good_move}"), (6, 18), "value"),
        (format!("{HEAD}[limits]\na = {{ torque = 1 }}\n{good_move}"), (6, 7), "toml"),
        (format!("{HEAD}[[move]]\nto = [1]\nduration = 1"), (6, 6), "list-length"),
        (format!("{HEAD}[[move]]\nto = {{ c = 1 }}\nduration = 1"), (6, 8), "unknown-joint"),
        (format!("{HEAD}[[move]]\nto = 1\nduration = 1"), (6, 6), "value"),
        (format!("{HEAD}[[move]]\nto = [1, 2]\nduration = 0"), (7, 12), "value"),
        (format!("{HEAD}[[move]]\nto = [1, 2]\nhold = -1"), (7, 8), "value"),
        (format!("{HEAD}[[move]]\nto = [1, 2]"), (5, 1), "missing-limit: move 1 has no duration"),
        (
            format!("{HEAD}[[move]]\nto = [1, 2]\nvia = [[0, 10]]\nduration = 1"),
            (5, 1),
            "plan: move 1: point 1 on the way",
        ),
        (
            format!("{HEAD}[[move]]\nto = [1, 2]\nvia = [[9, 9]]\nduration = 1\nprofile = \"trapezoid\""),
            (5, 1),
            "plan: move 1 passes points",
        ),
        (format!("{HEAD}[[move]]\nto = [1, 2\n"), (6, 11), "toml"),
    ];
    for (text, place, found) in cases {
        let error = fault(&text);
        assert_eq!(error.location, format!("arm.toml:{}:{}", place.0, place.1), "{text}\n{error}");
        assert!(format!("{}: {}", error.code, error.message).starts_with(found), "{text}\n{error:?}");
        assert_eq!(error.to_string().lines().count(), 1, "{error}");
    }

    let error = fault(&format!("{HEAD}move = []"));
    assert!(error.message.starts_with("nothing moves and nothing is held"), "{error}");
    let error = fault(&format!("{HEAD}[[move]]\nto = [1e308, 2]\nduration = 1e-300"));
    assert_eq!(error.code, "out-of-range");
    // The duration is infinite because of a tiny velocity limit; the other joint does not move at
    // all.
    let text = format!("{HEAD}[limits]\na = {{ velocity = 1e-308 }}\n[[move]]\nto = {{ a = 1e300 }}\n");
    assert_eq!(fault(&text).code, "out-of-range");
}

/// Truth by hand: one joint with a seven-phase S-curve, v/a + a/j + L/v; of two joints one is
/// always the slower.
#[test]
fn an_optimal_move_takes_the_least_time_of_its_limits() {
    let head = "format = 1\nunit = \"rad\"\njoints = [\"a\", \"b\"]\nstart = [0, 0]\n\
                [limits]\na = { velocity = 2.0, acceleration = 8.0, jerk = 80.0 }\n\
                b = { velocity = 9.0, acceleration = 99.0, jerk = 999.0 }\n";
    for via in ["", "via = [[0.5, 0.25], [1.1, 0.55]]\n"] {
        let motion = parse(&format!("{head}[[move]]\nlaw = \"optimal\"\n{via}to = [3.0, 1.5]\n"));
        let late = motion.duration() / (2.0 / 8.0 + 8.0 / 80.0 + 3.0 / 2.0) - 1.0;
        assert!((0.0..1e-3).contains(&late), "{via:?} {late:.1e}"); // measured 1.6e-4
        let peak = &motion.peak()[0];
        assert!(peak.velocity.value <= 2.0 * (1.0 + 1e-12) && peak.acceleration.value.abs() <= 8.0 * (1.0 + 1e-12));
        assert!(peak.jerk.value.abs() <= 80.0 * (1.0 + 1e-9), "{}", peak.jerk.value);
    }
}

/// Truth: the points, the limits, and the slower quintic through the same points.
#[test]
fn an_optimal_move_passes_its_points_within_all_limits_and_before_the_quintic_does() {
    let head = "format = 1\nunit = \"deg\"\njoints = [\"a\", \"b\", \"c\"]\nstart = [0, 0, 5]\nspeed = 0.8\n\
                [limits]\na = { velocity = 100, acceleration = 400, jerk = 4000 }\n\
                b = { velocity = 80, acceleration = 300 }\nc = { velocity = 50, acceleration = 500, jerk = 9000 }\n";
    let via = "via = [[30, 20, 5], [60, -10, 5], [40, -40, 5], [10, -20, 5]]\nto = [0, 0, 5]\n";
    let motion = parse(&format!("{head}[[move]]\nlaw = \"optimal\"\n{via}hold = 0.5\n"));
    let quintic = parse(&format!("{head}[[move]]\n{via}hold = 0.5\n"));
    // measured 3.088 s and 5.772 s
    assert!(motion.duration() < 0.8 * quintic.duration(), "{} {}", motion.duration(), quintic.duration());
    let n = 20_000;
    let at = |k: usize| position(&motion, motion.duration() * k as f64 / n as f64);
    for point in [[30.0f64, 20.0], [60.0, -10.0], [40.0, -40.0], [10.0, -20.0], [0.0, 0.0]] {
        let away = |q: Vec<f64>| (q[0] - point[0].to_radians()).hypot(q[1] - point[1].to_radians());
        let nearest = (0..=n).map(|k| away(at(k))).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-4, "{point:?} {nearest:.1e}");
    }
    let deg = f64::to_radians(1.0);
    for (peak, limit) in motion.peak().iter().zip([[80.0, 400.0, 4000.0], [64.0, 300.0, 6000.0]]) {
        let [v, a, j] = limit.map(|limit| limit * deg * (1.0 + 1e-9));
        assert!(peak.velocity.value.abs() <= v && peak.acceleration.value.abs() <= a, "{peak:?}");
        assert!(peak.jerk.value.abs() <= j && peak.acceleration_jump.value.abs() < 1e-6, "{peak:?}");
    }
    assert_eq!(motion.warnings(), []);
    // Longer duration, same path.
    let slow = parse(&format!("{head}[[move]]\nlaw = \"optimal\"\n{via}duration = 5.0\n"));
    assert_eq!(slow.duration(), 5.0);
    // A duration that is too short gives a warning, an unknown acceleration limit an error.
    let short = parse(&format!("{head}[[move]]\nlaw = \"optimal\"\n{via}duration = 0.5\n"));
    assert!(short.warnings().iter().any(|warning| warning.to_string().contains("move 1: the given duration takes")));
    let fault = fault(&format!(
        "{HEAD}[limits]\na = {{ velocity = 1 }}\nb = {{ velocity = 1 }}\n[[move]]\nlaw = \"optimal\"\nto = [1, 2]\n"
    ));
    assert!(fault.to_string().contains("the acceleration limit of joint \"a\" is not known"), "{fault}");
}

#[test]
fn numbers_beyond_any_motion_are_refused_with_their_place() {
    for (moves, key) in [
        ("to = [1, 2]\nduration = 1e300", "`duration` is 1"),
        ("to = [1, 2]\nduration = 1\nhold = 1e8", "`hold` is 100000000"),
        ("to = [1e12, 2]\nduration = 1", "joint \"a\" goes beyond 1e9 rad or m"),
        ("to = { b = 1e12 }\nduration = 1", "joint \"b\" goes beyond 1e9 rad or m"),
    ] {
        let fault = fault(&format!("{HEAD}[[move]]\n{moves}"));
        assert!(fault.location.starts_with("arm.toml:") && fault.to_string().contains(key), "{fault}");
    }
}

#[test]
fn a_message_tells_place_finding_and_remedy_in_one_line() {
    let message = fault(&HEAD.replace("\"deg\"", "\"degrees\"")).to_string();
    // The first error here is that no move follows.
    assert!(message.starts_with("arm.toml:1:1: missing field `move`"), "{message}");
    let text = format!("{}[[move]]\nto = [1, 2]\n", HEAD.replace("\"deg\"", "\"degrees\""));
    let truth = "arm.toml:2:8: unit \"degrees\" of `unit` is not known; accepted: \"rad\", \"deg\"";
    assert_eq!(fault(&text).to_string(), truth);
}

#[test]
fn the_ending_of_the_name_chooses_the_reader() {
    let folder = std::env::temp_dir().join(format!("flexarm-trajectory-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let waypoints = write("a.TOML", format!("{HEAD}[[move]]\nto = [1, 2]\nduration = 1").as_bytes());
    assert_eq!(Trajectory::from_path(&waypoints, &[]).unwrap().duration(), 1.0);
    let samples = write("a.csv", b"time,q\n0,0\n2,1\n");
    assert_eq!(Trajectory::from_path(&samples, &[]).unwrap().duration(), 2.0);
    let latin = write("b.csv", b"time,q\n0,0\n\xfc,1\n");
    let message = Trajectory::from_path(&latin, &[]).unwrap_err().to_string();
    assert!(message.ends_with("b.csv:3: the file is not UTF-8 text; save it as UTF-8"), "{message}");
    let unknown = Trajectory::from_path(Path::new("a.xlsx"), &[]);
    assert!(matches!(unknown, Err(TrajectoryError::UnknownExtension { .. })));
    assert!(matches!(Trajectory::from_path(&folder.join("none.csv"), &[]), Err(TrajectoryError::Read { .. })));
    std::fs::remove_dir_all(&folder).unwrap();
}

proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = Trajectory::parse_toml(&String::from_utf8_lossy(&bytes), "noise", &[]);
    }

    /// Random values within the format: any f64 and any profile.
    #[test]
    fn no_number_makes_the_reader_panic(
        numbers in prop::collection::vec(prop_oneof![any::<f64>(), -2.0..2.0_f64], 8),
        profile in prop_oneof![Just("quintic"), Just("trapezoid"), Just("s-curve")],
        has_duration: bool,
        has_via: bool,
        synchronised: bool,
    ) {
        let n = |i: usize| {
            let value: f64 = numbers[i];
            if value.is_nan() { "nan".to_owned() } else if value.is_infinite() { "inf".to_owned() } else { format!("{value:e}") }
        };
        let mut text = format!(
            "format = 1\nunit = \"rad\"\njoints = [\"a\", \"b\"]\nstart = [{}, {}]\nprofile = \"{profile}\"\n\
             synchronised = {synchronised}\nacceleration = {}\njerk = {}\n[limits]\na = {{ velocity = {} }}\nb = {{ velocity = 1 }}\n\
             [[move]]\nto = [{}, {}]\n",
            n(0), n(1), n(2), n(3), n(4), n(5), n(6)
        );
        if has_via {
            text += "profile = \"quintic\"\nvia = [[0.5, 0.25]]\n";
        }
        if has_duration {
            text += &format!("duration = {}\n", n(7));
        }
        if let Ok(trajectory) = Trajectory::parse_toml(&text, "noise", &[]) {
            let (mut q, mut qdot, mut qddot) = ([0.0; 2], [0.0; 2], [0.0; 2]);
            trajectory.sample(0.5 * trajectory.duration(), &mut q, &mut qdot, &mut qddot);
            let _ = (trajectory.peak(), trajectory.moves(), trajectory.kinks(), trajectory.warnings());
        }
    }
}

#[test]
fn quintic_moves_are_written_as_the_waypoints_that_they_are_and_other_motions_are_not() {
    let text = r#"
        format = 1
        unit = "deg"
        joints = ["a", "b"]
        start = [0.0, 10.0]
        [[move]]
        to = [0.0, 10.0]
        duration = 0.25
        hold = 0.25
        [[move]]
        to = [90.0, -45.0]
        duration = 2.0
        hold = 0.5
        [[move]]
        to = [10.0, -45.0]
        duration = 1.5
    "#;
    let motion = Trajectory::parse_toml(text, "moves.toml", &[]).unwrap();
    let back = Trajectory::parse_toml(&motion.to_waypoints_toml().unwrap(), "back.toml", &[]).unwrap();
    assert!((back.duration() - 4.5).abs() < 1e-12);
    let mut worst = 0.0f64;
    for i in 0..=900 {
        let t = 0.005 * f64::from(i);
        let (mut q, mut p, mut x, mut y) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
        motion.sample(t, &mut q, &mut x, &mut y);
        back.sample(t, &mut p, &mut x, &mut y);
        worst = worst.max((q[0] - p[0]).abs()).max((q[1] - p[1]).abs());
    }
    assert!(worst < 1e-12, "{worst:e}");
    let sine = "time,a\n0,0\n0.5,0.3\n1,0.5\n1.5,0.3\n2,0\n";
    let error = Trajectory::parse_csv(sine, "sine.csv").unwrap().to_waypoints_toml().unwrap_err();
    assert!(matches!(error, TrajectoryError::NotWaypoints { difference, .. } if difference > 0.1), "{error}");
}

/// Truth: the motion itself, whose knots are at rows of the file.
#[test]
fn a_motion_that_is_not_made_of_moves_comes_back_from_its_samples() {
    let sine = "time,a,rail\n0,0,1\n0.5,0.3,2\n1,0.5,2\n1.5,0.3,1\n2,0,1\n";
    let motion = Trajectory::parse_csv(sine, "sine.csv").unwrap();
    let text = motion.to_samples_toml(2.0).unwrap();
    let back = Trajectory::parse_toml(&text, "sine.toml", &[]).unwrap();
    assert_eq!((back.joints(), back.duration()), (motion.joints(), 2.0));
    let mut worst = 0.0f64;
    for i in 0..=400 {
        let (mut q, mut p, mut x, mut y) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
        motion.sample(0.005 * f64::from(i), &mut q, &mut x, &mut y);
        back.sample(0.005 * f64::from(i), &mut p, &mut x, &mut y);
        worst = worst.max((q[0] - p[0]).abs()).max((q[1] - p[1]).abs());
    }
    assert!(worst < 1e-12, "{worst:e}");
    // In degrees, with a prismatic joint, without velocities.
    let text = "format = 1\nunit = \"deg\"\nmetres = [\"rail\"]\njoints = [\"a\", \"rail\"]\n[samples]\ntime = [0, 1]\nposition = [[0, 0], [90, 2]]\n";
    let (mut q, mut x, mut y) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    Trajectory::parse_toml(text, "deg.toml", &[]).unwrap().sample(1.0, &mut q, &mut x, &mut y);
    assert!((q[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-15 && q[1] == 2.0);
    for (from, to, told) in [
        ("[90, 2]", "[90]", "a number for each joint"),
        ("[[0, 0], ", "[", "a row for each time"),
        ("[0, 1]\n", "[1, 0]\n", "increase"),
        ("format = 1", "format = 2", "format"),
        ("position", "place", "position"),
    ] {
        let error = Trajectory::parse_toml(&text.replacen(from, to, 1), "x.toml", &[]).unwrap_err().to_string();
        assert!(error.contains(told) && error.contains("x.toml"), "{error}");
    }
}
