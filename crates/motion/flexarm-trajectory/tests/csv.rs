//! CSV files: all kinds of interpolation, round trips, and all errors of a file.

use std::f64::consts::PI;
use std::fmt::Write as _;

use flexarm_settings::Finding;
use flexarm_trajectory::{JointLimits, Plan, PlannedMove, Trajectory, TrajectoryError};
use proptest::prelude::*;

fn parse(text: &str) -> Trajectory {
    Trajectory::parse_csv(text, "arm.csv").unwrap()
}

fn problem(text: &str) -> Finding {
    match Trajectory::parse_csv(text, "arm.csv") {
        Err(TrajectoryError::File(error)) => *error,
        other => panic!("expected an error with a place in the file, got {other:?}"),
    }
}

/// Position, velocity and acceleration of the single joint.
fn at(trajectory: &Trajectory, t: f64) -> [f64; 3] {
    let mut state = [0.0; 3];
    let [q, qdot, qddot] = &mut state;
    trajectory.sample(t, std::slice::from_mut(q), std::slice::from_mut(qdot), std::slice::from_mut(qddot));
    state
}

/// `sin² t` over one period from rest to rest with its first `derivatives` derivatives.
fn sine_file(intervals: u32, derivatives: usize) -> String {
    let header = ["time,q", "time,q,q.vel", "time,q,q.vel,q.acc"][derivatives];
    let mut text = format!("{header}\n");
    for k in 0..=intervals {
        let t = PI * f64::from(k) / f64::from(intervals);
        let values = [t.sin().powi(2), (2.0 * t).sin(), 2.0 * (2.0 * t).cos()];
        write!(text, "{t}").unwrap();
        for value in &values[..=derivatives] {
            write!(text, ",{value}").unwrap();
        }
        text.push('\n');
    }
    text
}

/// Largest position error in the middle of the record (away from the ends, where the acceleration
/// of sin² is not zero).
fn sine_error(intervals: u32, derivatives: usize) -> f64 {
    let trajectory = parse(&sine_file(intervals, derivatives));
    (0..1000)
        .map(|k| PI * (0.25 + 0.5 * f64::from(k) / 1000.0))
        .map(|t| (at(&trajectory, t)[0] - t.sin().powi(2)).abs())
        .fold(0.0, f64::max)
}

/// Truth: a quintic with exact end values has an error of O(h⁶), with estimated ones O(h⁴).
#[test]
fn halving_the_row_spacing_divides_the_error_by_the_order_of_the_spline() {
    for (derivatives, order) in [(0, 4), (1, 4), (2, 6)] {
        let ratio = sine_error(32, derivatives) / sine_error(64, derivatives);
        let expected = 2.0_f64.powi(order);
        assert!((ratio / expected - 1.0).abs() < 0.1, "{derivatives}: {ratio}"); // measured within 0.9 %
    }
}

#[test]
fn file_values_are_met_at_the_rows() {
    let trajectory = parse(&sine_file(16, 2));
    for k in 0..=16 {
        let t = PI * f64::from(k) / 16.0;
        let [q, qdot, qddot] = at(&trajectory, t);
        // measured 2.8e-17, 9.7e-16, 2.1e-14
        assert!((q - t.sin().powi(2)).abs() < 1e-13);
        assert!((qdot - (2.0 * t).sin()).abs() < 1e-12);
        assert!((qddot - 2.0 * (2.0 * t).cos()).abs() < 1e-11);
    }
}

#[test]
fn accelerations_are_continuous_whatever_is_given() {
    for derivatives in [0, 1, 2] {
        let trajectory = parse(&sine_file(20, derivatives));
        for k in 1..20 {
            let t = PI * f64::from(k) / 20.0;
            let (before, after) = (at(&trajectory, t - 1e-9), at(&trajectory, t + 1e-9));
            assert!((before[2] - after[2]).abs() < 1e-6); // measured 3.6e-8, the jerk times the sampling interval
        }
    }
}

/// Positions only, with holds: exactly at rest in the holds, and smooth into and out of them.
#[test]
fn a_hold_in_the_positions_stands_still() {
    let trajectory = parse("time,q\n0,0\n1,0\n2,1\n3,2\n4,2\n5,2\n6,1\n7,0\n8,0\n");
    for t in [0.5, 3.0, 3.3, 4.7, 5.0, 7.5] {
        assert_eq!(at(&trajectory, t)[1..], [0.0, 0.0], "t = {t}");
    }
    assert_eq!(trajectory.warnings(), []);
    let moves: Vec<_> = trajectory.moves().iter().map(|span| (span.start, span.end)).collect();
    assert_eq!(moves, [(1.0, 3.0), (5.0, 7.0)]);
    assert!(trajectory.peak()[0].acceleration_jump.value.abs() < 1e-12); // measured 0
}

#[test]
fn a_turning_point_that_repeats_a_position_is_not_a_hold() {
    let trajectory = parse("time,q\n0,0\n1,0\n2,1\n3,1\n4,0\n5,0\n");
    assert!(at(&trajectory, 2.5)[0] > 1.05);
}

#[test]
fn a_record_that_starts_in_motion_says_so() {
    let trajectory = parse("time,q\n0,0\n1,1\n2,2\n");
    assert!((trajectory.initial_speed() - 1.0).abs() < 1e-15);
    let warnings = trajectory.warnings();
    let codes: Vec<&str> = warnings.iter().map(|warning| &*warning.code).collect();
    assert_eq!(codes, ["motion-start-speed", "motion-end-speed"], "{warnings:?}");
    assert!(warnings[0].to_string().contains("put a row with the same positions before the first one"));
}

#[test]
fn a_finely_sampled_move_from_rest_is_taken_to_start_at_rest() {
    let mut text = "time,q\n".to_owned();
    for k in 0..=100 {
        let u = f64::from(k) / 100.0;
        writeln!(text, "{u},{}", u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u)).unwrap();
    }
    let trajectory = parse(&text);
    assert_eq!(trajectory.warnings(), []);
    let [_, speed, _] = at(&trajectory, 0.5);
    assert!((speed - 15.0 / 8.0).abs() < 1e-6); // measured 4.0e-8
}

#[test]
fn degrees_metres_comments_and_a_late_first_time_are_understood() {
    let text = "\u{feff}# recorded by hand\n#unit: deg\n# time: s\n# metres: rail\n\ntime, axis ,rail,axis.vel\n\
                10.5,180,1.5,0\n# in between\n11.5,90,2,0\n";
    let trajectory = parse(text);
    assert_eq!(trajectory.joints(), ["axis", "rail"]);
    assert_eq!(trajectory.duration(), 1.0);
    let (mut q, mut qdot, mut qddot) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    trajectory.sample(0.0, &mut q, &mut qdot, &mut qddot);
    assert_eq!(q, [PI, 1.5]);
    trajectory.sample(1.0, &mut q, &mut qdot, &mut qddot);
    assert!((q[0] - PI / 2.0).abs() < 1e-14); // measured 1.8e-15
}

#[test]
fn angles_of_more_than_two_turns_need_a_unit() {
    let text = "time,q\n0,0\n1,0\n2,90\n3,90\n";
    assert_eq!(problem(text).code, "unit-needed");
    assert_eq!(parse(&format!("# unit: deg\n{text}")).warnings(), []);
    assert_eq!(parse(&format!("# unit: rad\n{text}")).warnings(), []);
}

#[test]
fn each_fault_of_a_file_is_named_with_its_place() {
    // text, place after the name of the file, code, part of the message
    let cases = [
        ("", "", "empty", "the file is empty"),
        ("# only\n\n# comments\n", "", "empty", "the file is empty"),
        ("q,w\n0,1\n", ":1", "no-time-column", "\"q\", \"w\""),
        ("time,q,q\n0,1,2\n", ":1:8", "repeated-column", "as column 2 is"),
        ("time,q,w.vel\n0,1,2\n", ":1:8", "no-position-column", "\"w\""),
        ("time,q,q.acc\n0,1,2\n1,2,3\n", ":1:8", "samples", "has accelerations but no velocities"),
        ("time\n0\n1\n", ":1", "no-joint", "none of the names \"time\""),
        ("time,q\n", ":1", "samples", "0 rows of samples"),
        ("time,q\n0,1\n", ":1", "samples", "1 rows of samples"),
        ("time,q\n0,1\n\n1\n", ":4", "ragged", "the row has 1 fields, the header 2;"),
        ("time,q\n0,1\n1,2,3\n", ":3", "ragged", "the row has 3 fields, the header 2;"),
        ("time,q\n0,1\n1,x\n", ":3:3", "not-a-number", "q: \"x\""),
        ("time;\"a;b\";q\n0;0;1\n1;\"1\";x\n", ":3:7", "not-a-number", "q: \"x\""),
        ("time   q\n0  1\n1   x\n", ":3:5", "not-a-number", "q: \"x\""),
        ("time,q\n0,1\n1,NaN\n", ":3:3", "not-a-number", "q: \"NaN\""),
        ("time,q\n0,1\ninf,1\n", ":3:1", "not-a-number", "time: \"inf\""),
        ("q,time\n1,0\n2,1\n# a comment\n3,1\n", ":5:3", "samples", "time 1 s does not follow 1 s"),
        ("# unit: grad\ntime,q\n0,1\n1,2\n", ":1", "unknown-unit", "`unit`"),
        ("# time: ms\ntime,q\n0,1\n1,2\n", ":1", "unknown-unit", "`time`"),
        ("time,q\n0,0\n1e-300,1e300\n", ":2", "out-of-range", "joint \"q\""),
    ];
    for (text, place, code, message) in cases {
        let error = problem(text);
        assert_eq!((&*error.location, &*error.code), (&*format!("arm.csv{place}"), code), "{text:?}: {error}");
        assert!(error.message.contains(message), "{text:?}: {error}");
        assert_eq!(error.to_string().lines().count(), 1);
    }
    let text = "# unit: deg\n# unit: rad\ntime,q\n0,1\n1,2\n";
    assert_eq!(problem(text).code, "contradicting-units");
    let text = "# metres: z\ntime,q\n0,1\n1,2\n";
    assert_eq!(problem(text).code, "unknown-joint");
}

#[test]
fn a_message_tells_place_finding_and_remedy_in_one_line() {
    let message = problem("time,q\n0.0,1\n0.2,1\n0.1,1\n").to_string();
    let truth = "arm.csv:4:1: time 0.1 s does not follow 0.2 s; times must increase from row to row: \
                 sort the rows and remove repeated ones";
    assert_eq!(message, truth);
}

/// Truth: the rows removed from a record at 50 Hz.
#[test]
fn a_gap_in_evenly_sampled_rows_is_told_with_its_place_and_length() {
    let row = |k: u32| format!("{},{}\n", 0.02 * f64::from(k), (0.02 * f64::from(k)).sin());
    let rows = |keep: fn(u32) -> bool| (0..200).filter(|k| keep(*k)).map(row).collect::<String>();
    let gaps = |text: &str| -> Vec<String> {
        let warnings = parse(&format!("# unit: rad\ntime,q\n{text}")).warnings();
        warnings.into_iter().filter(|warning| warning.code == "motion-gap").map(|warning| warning.message).collect()
    };
    assert_eq!(gaps(&rows(|_| true)), [] as [&str; 0]);
    let found = gaps(&rows(|k| !(101..121).contains(&k)));
    let truth = "no sample of \"q\" for 0.4200 s, from t = 2.0000 s to 2.4200 s (samples 101 and 102); the usual step is 0.0200 s";
    assert!(found.len() == 1 && found[0].starts_with(truth), "{found:?}");
    let found = gaps(&rows(|k| !(30..34).contains(&k) && !(101..121).contains(&k)));
    assert!(found.len() == 1 && found[0].contains("the longest of 2 gaps"), "{found:?}");
    // With twice the duration, the gap is twice as long.
    let text = format!("# unit: rad\ntime,q\n{}", rows(|k| !(101..121).contains(&k)));
    let slow = parse(&text).scaled(2.0).unwrap().warnings();
    assert!(slow.iter().any(|w| w.to_string().contains("from t = 4.0000 s to 4.8400 s")), "{slow:?}");
}

/// Truth: 0.25 s at 10 Hz are the times 0, 0.1, 0.2 and the end; at 20 Hz the end is a regular time.
#[test]
fn written_rows_are_evenly_spaced_and_the_last_one_is_at_the_end() {
    let motion = parse("# unit: rad\ntime,q\n0,0\n0.25,1\n");
    let times = |rate| motion.row_times(rate, 6).unwrap().collect::<Vec<f64>>();
    assert_eq!(times(10.0), [0.0, 0.1, 0.2, 0.25]);
    assert_eq!(times(20.0), [0.0, 0.05, 0.1, 3.0 / 20.0, 0.2, 0.25]);
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 25.0] {
        let error = motion.row_times(rate, 6).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(&format!("{rate} Hz")) && error.contains("at most 6 rows"), "{error}");
    }
}

#[test]
fn rows_that_repeat_the_one_before_are_left_out_and_counted() {
    let motion = parse("# unit: rad\ntime,q\n0,0\n1,0\n1,0\n1,0\n2,1\n3,1\n");
    let warnings = motion.warnings();
    let repeated = warnings.iter().find(|warning| warning.code == "table-repeated-rows").unwrap();
    assert!(repeated.message.starts_with("2 rows repeat") && repeated.location.ends_with(":5"), "{repeated:?}");
    let plain = parse("# unit: rad\ntime,q\n0,0\n1,0\n2,1\n3,1\n");
    assert_eq!(at(&motion, 1.4), at(&plain, 1.4));
}

#[test]
fn every_bad_line_is_counted_and_the_first_ones_are_named() {
    let message = problem("time,q\n0,0\n1,x\n2,0\n3\n4,0\n5,y\n").to_string();
    let truth = "arm.csv:3:3: ";
    assert!(
        message.starts_with(truth) && message.ends_with(" (2 more lines are wrong: arm.csv:5, arm.csv:7)"),
        "{message}"
    );
    let message = problem("time,q\n0,0\n1,x\n2,x\n").to_string();
    assert!(message.ends_with(" (arm.csv:4 is wrong, too)"), "{message}");
    let many: String = (0..40).map(|k| format!("{k},?\n")).collect();
    let message = problem(&format!("time,q\n{many}")).to_string();
    assert!(message.ends_with(" (39 more lines are wrong: arm.csv:3, arm.csv:4, arm.csv:5, ...)"), "{message}");
    let message = problem("time,q\n0,0\n1,1\n1,2\n2,3\n0.5,4\n1.5,5\n3,6\n").to_string();
    assert!(message.starts_with("arm.csv:4:1: time 1 s does not follow 1 s"), "{message}");
    assert!(message.ends_with(" (2 more lines are wrong: arm.csv:6, arm.csv:7)"), "{message}");
}

#[test]
fn times_and_positions_beyond_any_motion_are_refused_with_their_line() {
    for (text, line) in [("0,0\n1,1\n1e300,2\n", 4), ("0,0\n1,1\n2e7,2\n", 4), ("0,0\n1,1e12\n2,0\n", 2)] {
        let error = problem(&format!("time,q\n{text}"));
        assert_eq!((&*error.code, error.location.clone()), ("out-of-range", format!("arm.csv:{line}")), "{error}");
        assert!(error.to_string().contains("1e9 rad or m and 1e7 s at most"), "{error}");
    }
}

proptest! {
    /// A plan written at a rate that includes its knots is read back as the same curve.
    #[test]
    fn written_and_read_again_a_plan_is_the_same_motion(
        goals in prop::collection::vec(prop::collection::vec(-3.0..3.0_f64, 2), 1..4),
    ) {
        let moves = goals.into_iter().map(|to| PlannedMove { hold: 0.5, ..PlannedMove::quintic(to, 1.5) }).collect();
        let joints = vec!["a, with a comma".to_owned(), "# b".to_owned()];
        let plan = Plan { joints, start: vec![0.5, -0.5], moves }.build()?;
        let mut bytes = Vec::new();
        plan.to_csv(50.0, &mut bytes)?;
        let text = String::from_utf8(bytes).unwrap();
        let read = Trajectory::parse_csv(&text, "written.csv")?;

        prop_assert_eq!(read.joints(), plan.joints());
        prop_assert_eq!(read.duration(), plan.duration());
        let (mut q, mut qdot, mut qddot) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let (mut q2, mut qdot2, mut qddot2) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for k in 0..=400 {
            let t = plan.duration() * f64::from(k) / 400.0;
            plan.sample(t, &mut q, &mut qdot, &mut qddot);
            read.sample(t, &mut q2, &mut qdot2, &mut qddot2);
            for i in 0..2 {
                // measured 1.4e-14, 1.1e-12, 1.8e-10: rounding divided by the row spacing and its
                // square
                prop_assert!((q[i] - q2[i]).abs() < 1e-12);
                prop_assert!((qdot[i] - qdot2[i]).abs() < 1e-10);
                prop_assert!((qddot[i] - qddot2[i]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = Trajectory::parse_csv(&String::from_utf8_lossy(&bytes), "noise");
    }

    /// Random text close enough to the format to pass the header.
    #[test]
    fn no_table_makes_the_reader_panic(text in "(# (unit|time|metres): [a-z,]{0,4}\n)?time,a(,a.vel)?(,a.acc)?(,b)?\n([0-9eE.+\\-]{1,6},[0-9eE.+\\-]{0,8}(,[0-9]{1,2})?\n){0,6}") {
        if let Ok(trajectory) = Trajectory::parse_csv(&text, "noise") {
            let _ = (trajectory.peak(), trajectory.moves(), trajectory.kinks(), trajectory.warnings());
        }
    }

    /// Any f64 values in ascending times: an error or a trajectory that can be sampled.
    #[test]
    fn no_number_makes_the_reader_panic(
        rows in prop::collection::vec((any::<f64>(), any::<f64>(), any::<f64>()), 2..6),
    ) {
        let mut rows = rows;
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut text = "time,a,a.vel,b\n".to_owned();
        for (t, a, b) in rows {
            writeln!(text, "{t:e},{a:e},{b:e},{a:e}").unwrap();
        }
        if let Ok(trajectory) = Trajectory::parse_csv(&text, "noise") {
            let (mut q, mut qdot, mut qddot) = ([0.0; 2], [0.0; 2], [0.0; 2]);
            trajectory.sample(0.5 * trajectory.duration(), &mut q, &mut qdot, &mut qddot);
            let _ = (trajectory.peak(), trajectory.moves(), trajectory.kinks(), trajectory.warnings());
        }
    }
}

// --- Corners
// -----------------------------------------------------------------------------------------------------------

/// Rest, 2 rad/s, -2 rad/s, rest, optionally with velocities: a triangle whose corners are at 0.5,
/// 1.0 and 1.5 s plus `shift`.
fn triangle_file(rate_hz: f64, shift: f64, velocities: bool) -> String {
    let mut text = if velocities { "time,q,q.vel\n".to_owned() } else { "time,q\n".to_owned() };
    for k in 0..=(2.0 * rate_hz) as u32 {
        let t = f64::from(k) / rate_hz;
        let s = t - shift;
        let q = 2.0 * ((s - 0.5).max(0.0) - 2.0 * (s - 1.0).max(0.0) + (s - 1.5).max(0.0));
        let v = 2.0 * (f64::from(s > 0.5) - 2.0 * f64::from(s > 1.0) + f64::from(s > 1.5));
        writeln!(text, "{t},{q}{}", if velocities { format!(",{v}") } else { String::new() }).unwrap();
    }
    text
}

/// Truth: the triangle. Corners at the rows and between them, with and without given velocities,
/// without oscillation next to them.
#[test]
fn corners_of_sampled_positions_are_jumps_of_the_velocity() {
    for (rate, shift) in [(1000.0, 0.0), (500.0, 0.0), (1000.0, 3.7e-4), (500.0, 6e-4), (100.0, 2.5e-3)] {
        for velocities in [false, true] {
            let trajectory = parse(&triangle_file(rate, shift, velocities));
            let jumps = trajectory.velocity_jumps();
            assert_eq!(jumps.len(), 3, "{rate} {shift} {velocities}: {jumps:?}");
            for (jump, (t, dv)) in jumps.iter().zip([(0.5, 2.0), (1.0, -4.0), (1.5, 2.0)]) {
                // measured 2e-13 s, 4e-10
                assert!((jump.time_s - t - shift).abs() < 1e-9 && (jump.jump - dv).abs() < 1e-7, "{jump:?}");
            }
            for k in 0..2000 {
                let t = 1e-3 * f64::from(k) + 5e-4;
                let s = t - shift;
                let truth = 2.0 * ((s - 0.5).max(0.0) - 2.0 * (s - 1.0).max(0.0) + (s - 1.5).max(0.0));
                assert!((at(&trajectory, t)[0] - truth).abs() < 1e-9, "{rate} {shift} {t}");
                assert!(at(&trajectory, t)[2].abs() < 1e-3, "{rate} {shift} {t} {}", at(&trajectory, t)[2]);
            }
            let warnings = trajectory.warnings();
            assert!(warnings.len() == 1 && warnings[0].message.contains("jumps at 3 times"), "{warnings:?}");
            assert!(warnings[0].to_string().contains("\"q\" jumps at 3 times, most at t = 1.00"), "{}", warnings[0]);
        }
    }
}

/// Truth: `cos` before and after a velocity jump of 1 rad/s between two rows, curved on both sides;
/// third order in the row spacing.
#[test]
fn a_corner_between_curved_pieces_is_found() {
    for rate in [1000.0, 200.0] {
        let mut text = "time,q\n".to_owned();
        let corner = 1.0 + 0.3 / rate;
        let truth = |t: f64| (3.0 * t).cos() + (t - corner).max(0.0);
        (0..=(2.0 * rate) as u32).for_each(|k| {
            let t = f64::from(k) / rate;
            writeln!(text, "{t},{}", truth(t)).unwrap();
        });
        let trajectory = parse(&text);
        let inside: Vec<_> =
            trajectory.velocity_jumps().into_iter().filter(|j| j.time_s > 0.1 && j.time_s < 1.9).collect();
        assert_eq!(inside.len(), 1, "{inside:?}");
        // measured 9e-4 of a row, 1e-3 at 200 Hz
        assert!((inside[0].time_s - corner).abs() < 0.05 / rate && (inside[0].jump - 1.0).abs() < 2e-2, "{inside:?}");
    }
}

/// Truth: the curve away from the blends; within them a deviation of at most an eighth of the
/// velocity jump times their length.
#[test]
fn rounded_corners_jump_no_more_and_stay_near() {
    let corners = parse(&triangle_file(1000.0, 3.7e-4, false));
    let rounded = corners.with_rounded_corners(0.02).unwrap();
    assert_eq!(rounded.velocity_jumps(), []);
    assert_eq!(rounded.warnings(), []);
    assert_eq!(rounded.duration(), corners.duration());
    for k in 0..20_000 {
        let t = 1e-4 * f64::from(k);
        let beside = (at(&rounded, t)[0] - at(&corners, t)[0]).abs();
        let near = [0.5, 1.0, 1.5].iter().any(|c| (t - c - 3.7e-4).abs() < 0.01);
        // measured 7.5e-3 at the middle of the blend of 4 rad/s
        assert!(beside <= if near { 4.0 * 0.02 / 8.0 } else { 1e-12 }, "{t} {beside}");
    }
    // Blends without enough room share the available time.
    let long = corners.with_rounded_corners(10.0).unwrap();
    assert_eq!(long.velocity_jumps(), []);
    assert!(corners.with_rounded_corners(0.0).is_err() && corners.with_rounded_corners(f64::NAN).is_err());
}

/// Truth: the rounded motion stays on its limits; the spline through its rows passes them by a part
/// of the last digit.
#[test]
fn a_motion_that_ends_on_its_limits_in_rounded_digits_does_not_pass_them() {
    for (digits, unit) in [(6, "rad"), (4, "deg")] {
        let mut text = format!("# unit: {unit}\ntime,q\n");
        for k in 0..=200 {
            let u = ((0.01 * f64::from(k) - 0.2) / 1.5).clamp(0.0, 1.0);
            let q = 0.5 * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
            let q = if unit == "deg" { q.to_degrees() } else { q };
            writeln!(text, "{:.2},{q:.digits$}", 0.01 * f64::from(k)).unwrap();
        }
        let motion = parse(&text);
        let limits = JointLimits { lower: 0.0, upper: 0.5, ..JointLimits::UNLIMITED };
        assert_eq!(motion.check_limits(&[limits]), [], "{unit}");
        // A violation by a ten-thousandth of the range counts.
        let tight = JointLimits { lower: 5e-5, ..limits };
        assert_eq!(motion.check_limits(&[tight]).len(), 1);
    }
}
