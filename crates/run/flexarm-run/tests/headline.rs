//! The headline of a result must agree with the run, statics and the robot.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flexarm_log::Trace;
use flexarm_run::internals::rounded;
use flexarm_run::{
    DriveModel, Keep, LinkModel, Modelling, Motion, Robot, RunOptions, RunRequest, Settling, Summary, Variant,
    compare_study, study_rows,
};
use nalgebra::Vector3;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn load(robot: &str) -> Robot {
    Robot::load(root().join("robots").join(robot)).unwrap()
}

fn motion(robot: &Robot, trajectory: &str) -> Motion {
    Motion::load_for(&root().join("trajectories").join(trajectory), &robot.rigid_model().unwrap()).unwrap()
}

fn run(robot: &Robot, trajectory: &str, options: &RunOptions) -> (Summary, Trace) {
    run_as(robot, trajectory, &Modelling::default(), options)
}

fn run_as(robot: &Robot, trajectory: &str, modelling: &Modelling, options: &RunOptions) -> (Summary, Trace) {
    let motion = motion(robot, trajectory);
    let arm = robot.model(modelling).unwrap();
    let run = arm.simulate_with(&motion, options, RunRequest::keeping(Keep::Curves)).unwrap();
    (run.summary, run.trace)
}

/// Truth: `statics` at the poses of the motion, which computes each equilibrium from scratch.
/// Measured 3e-8 of the maximum sag within moves, where the curve is interpolated.
#[test]
fn the_static_part_of_a_run_is_the_sag_at_the_pose() {
    let robot = load("kr210");
    let motion = motion(&robot, "pick_and_place.toml");
    let (summary, trace) = run(&robot, "pick_and_place.toml", &RunOptions::default());
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for row in trace.rows.iter().step_by(97) {
        let (mut q, mut v, mut a) = ([0.0; 6], [0.0; 6], [0.0; 6]);
        motion.trajectory.sample(row.time_s, &mut q, &mut v, &mut a);
        let sag = robot.model(&Modelling::default()).unwrap().statics(Some(&q), [0.0; 6]).unwrap().sag_m;
        worst = worst.max((Vector3::from(sag) - Vector3::from(row.static_m)).norm());
        largest = largest.max(Vector3::from(sag).norm());
    }
    eprintln!("static part within {:.1e} of the largest sag, {:.4} mm", worst / largest, 1e3 * largest);
    assert!(worst < 1e-6 * largest);
    let tcp = summary.tcp.unwrap();
    let start = Vector3::from(trace.rows[0].static_m).norm();
    assert!((start - tcp.static_sag_m).abs() < 1e-9 * start); // measured 2e-12
}

/// Truth: the parts are a sum, and the shares add up to first order.
#[test]
fn the_parts_of_the_first_line_add_up_to_the_largest_error() {
    for (robot, of_second_order) in [("kr210", 3e-3), ("kr210/links.toml", 3e-3), ("abb_three_mass/torque.toml", 3e-2)]
    {
        let motion = if robot.starts_with("kr210") { "point_to_point.toml" } else { "three_mass.toml" };
        let (summary, trace) = run(&load(robot), motion, &RunOptions::default());
        let tcp = summary.tcp.as_ref().unwrap();
        let (at_rest, moving) = (tcp.static_at_peak_m.unwrap(), tcp.dynamic_at_peak_m.unwrap());
        assert!((at_rest + moving - tcp.peak_m).abs() < 1e-15, "{robot}");
        let shares: f64 = tcp.shares_at_peak.iter().map(|share| share.along_m).sum();
        assert!((shares / tcp.peak_m - 1.0).abs() < of_second_order, "{robot}: {shares:e} of {:e}", tcp.peak_m);
        // The maximum dynamic part is that of the recorded curves.
        let dynamic = trace.rows.iter().map(|row| {
            let error = Vector3::from_row_slice(&row.error_world[..3]);
            (error - Vector3::from(row.static_m)).norm()
        });
        assert_eq!(tcp.dynamic_peak_m, dynamic.reduce(f64::max), "{robot}");
    }
}

/// A number after a word in a text.
fn after(text: &str, word: &str) -> f64 {
    let rest = text.split(word).nth(1).unwrap_or_else(|| panic!("no {word:?} in {text:?}"));
    let number: String = rest.trim_start().chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    number.parse().unwrap_or_else(|_| panic!("no number after {word:?} in {text:?}"))
}

#[test]
fn the_first_line_of_the_shipped_arm_names_links_and_gearboxes() {
    let (summary, _) = run(&load("kr210"), "pick_and_place.toml", &RunOptions::default());
    let (line, tcp) = (&summary.headline, summary.tcp.as_ref().unwrap());
    let sum = |kind: &str| 1e3 * tcp.shares_at_peak.iter().filter(|s| s.kind == kind).map(|s| s.along_m).sum::<f64>();
    assert!((after(line, "TCP error") - 1e3 * tcp.peak_m).abs() < 0.006, "{line}");
    assert!((after(line, "=") - 1e3 * tcp.static_at_peak_m.unwrap()).abs() < 0.006, "{line}");
    assert!((after(line, "static +") - 1e3 * tcp.dynamic_at_peak_m.unwrap()).abs() < 0.006, "{line}");
    assert!((after(line, "maximum") - 1e3 * tcp.dynamic_peak_m.unwrap()).abs() < 0.006, "{line}");
    assert!((after(line, "links") - sum("link")).abs() < 0.006, "{line}");
    assert!((after(line, "gearboxes") - sum("gearbox")).abs() < 0.006, "{line}");
    assert!(line.ends_with("(largest: joint_2)") && sum("gearbox") > 3.0 * sum("link"), "{line}");
    assert_eq!((summary.bends.links.len(), summary.bends.gearboxes.len()), (2, 6));
}

#[test]
fn a_robot_with_nothing_that_bends_says_so_first_and_how_to_give_it_something() {
    let folder = root().join("robots/kr210");
    let bare = Robot::load(folder.join("kr210.urdf")).unwrap();
    let (summary, _) = run(&bare, "point_to_point.toml", &RunOptions::default());
    assert!(summary.bends.is_nothing() && summary.headline.starts_with("nothing is flexible"), "{}", summary.headline);
    for word in ["[[flexible_link]]", "[[drive]]", "gearbox", "robot file"] {
        assert!(summary.headline.contains(word), "{word}: {}", summary.headline);
    }
    // Rigid by choice is not a fault of the file.
    let modelling = Modelling { links: LinkModel::Rigid, drives: DriveModel::Rigid, ..Modelling::default() };
    let (summary, _) = run_as(&load("kr210"), "point_to_point.toml", &modelling, &RunOptions::default());
    let line = &summary.headline;
    assert!(line.starts_with("nothing is flexible") && line.contains("as chosen") && !line.contains("[["), "{line}");
    // Without the rigid twin there is no comparison; the headline still names the flexible links.
    let options = RunOptions { with_twin: false, ..RunOptions::default() };
    let (summary, _) = run(&load("kr210/links.toml"), "point_to_point.toml", &options);
    assert_eq!(summary.headline, "flexible: links link_2, link_3; not compared with the rigid robot");
}

/// Truth: the stops of the same run. Two of its three stops last half a second, in which the arm
/// with elastic gearboxes does not come to rest.
#[test]
fn a_stop_at_which_the_tool_does_not_settle_is_the_settling_time_of_the_run() {
    let (summary, _) = run(&load("kr210"), "pick_and_place.toml", &RunOptions::default());
    let tcp = summary.tcp.as_ref().unwrap();
    let settled: Vec<bool> = tcp.holds.iter().map(|hold| hold.settling_s.is_some()).collect();
    assert_eq!(settled, [false, false, true]);
    assert_eq!(tcp.settling_s, None);
    assert!(matches!(tcp.settling_state(), Settling::NotSettled { ref stops, of: 3 } if stops.len() == 2));
    assert!(tcp.settling.starts_with("not settled at stop 1, which lasts 0.500 s, stop 2"), "{}", tcp.settling);
    for text in [flexarm_run::markdown(&summary), flexarm_run::rows(&summary).into_iter().map(|row| row.1).collect()] {
        assert!(text.contains("not settled at stop 1"), "{text}");
    }
    // With a wider band the worst stop counts, not the last one.
    let options = RunOptions { settling_band_m: 1.5e-4, ..RunOptions::default() };
    let (summary, _) = run(&load("kr210"), "pick_and_place.toml", &options);
    let tcp = summary.tcp.unwrap();
    let worst = tcp.holds.iter().map(|hold| hold.settling_s.unwrap()).fold(0.0, f64::max);
    assert!(tcp.settling_s == Some(worst) && worst > 0.0, "{tcp:?}");
}

#[test]
fn a_study_has_both_parts_and_the_word_of_each_run() {
    let variant = |label: &str, robot: &str| {
        let robot = load(robot);
        let motion = motion(&robot, "pick_and_place.toml");
        let arm = robot.model(&Modelling::default()).unwrap();
        Variant { label: label.into(), arm, scenario: motion.into(), options: RunOptions::default() }
    };
    let variants = [variant("as given", "kr210"), variant("castings", "kr210/links.toml")];
    let (summary, _) = compare_study(&variants, None, &mut |_, _| ControlFlow::Continue(())).unwrap();
    let rows = study_rows(&summary);
    let column = |name: &str| rows[0].iter().position(|head| head == name).unwrap_or_else(|| panic!("{:?}", rows[0]));
    let tcp = summary.with[0].tcp.as_ref().unwrap();
    assert_eq!(rows[2][column("static [mm]")], format!("{:.4}", 1e3 * tcp.static_at_peak_m.unwrap()));
    assert_eq!(rows[2][column("dynamic [mm]")], format!("{:.4}", 1e3 * tcp.dynamic_peak_m.unwrap()));
    assert_eq!(rows[1][column("settling [s]")], "not settled");
    let page = flexarm_run::markdown(&summary);
    assert!(page.contains(&format!("* castings: {}", summary.with[0].headline)), "{page}");
}

/// Truth: sums of the printed numbers.
#[test]
fn rounded_parts_add_up_to_the_rounded_whole() {
    assert_eq!(rounded(&[1.414, 4.606], 6.02, 2), ["1.41", "4.61"]);
    assert_eq!(rounded(&[1.4157, 4.6051], 6.0208, 2), ["1.42", "4.60"]);
    assert_eq!(rounded(&[-0.126, 1.135], 1.009, 2), ["-0.13", "1.14"]);
    assert_eq!(rounded(&[-0.001, 1.0], 0.999, 2), ["0.00", "1.00"]);
    // Parts that do not add up stay as they are.
    assert_eq!(rounded(&[1.0, 2.0], 5.0, 1), ["1.0", "2.0"]);
    assert!(rounded(&[], 1.0, 2).is_empty());
}
