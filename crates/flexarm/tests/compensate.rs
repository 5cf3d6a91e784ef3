//! Motions with which the flexible tool follows the rigid one: on the model itself, on plants that are off, at rest, with shapers.
#![allow(clippy::unwrap_used, reason = "a test stops at the first failure")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]

use std::path::{Path, PathBuf};

use flexarm::compensate::{
    CompensateRequest, Compensation, Method, ShaperKind, compensate_motion, compensate_motion_until,
};
use flexarm::{Error, Modelling, Motion, Robot, RunOptions, Wrench};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn shipped(robot: &str, motion: &str) -> (Robot, Motion) {
    let robot = Robot::load(root().join("robots").join(robot)).unwrap();
    let motion = Motion::load(root().join("trajectories").join(motion), &robot).unwrap();
    (robot, motion)
}

fn told(name: &str, found: &Compensation) {
    let mm = |x: f64| 1e3 * x;
    eprintln!(
        "{name}: peak {:.4} -> {:.5} mm, RMS {:.4} -> {:.5}, up to {:?} Hz, on the model {:?}",
        mm(found.before.peak_m),
        mm(found.after.peak_m),
        mm(found.before.rms_m),
        mm(found.after.rms_m),
        found.cutoff_hz,
        found.model_peaks_m.iter().map(|x| mm(*x)).collect::<Vec<_>>()
    );
    for plant in &found.plants {
        eprintln!("    {}: {:.4} -> {:.4} mm", plant.plant, mm(plant.before.peak_m), mm(plant.after.peak_m));
    }
}

fn request() -> CompensateRequest {
    CompensateRequest { iterations: 3, sweep: false, ..CompensateRequest::default() }
}

/// Truth: the simulation itself, with links and drives.
#[test]
fn three_iterations_take_all_but_a_hundredth_of_the_peak_of_a_pick_and_place_cycle_away() {
    let (robot, motion) = shipped("kr210", "pick_and_place.toml");
    let found = compensate_motion(&robot, &motion, &request()).unwrap();
    told("pick and place", &found);
    assert!(found.before.peak_m > 1e-3);
    assert!(found.after.peak_m <= 0.01 * found.before.peak_m, "{:e}", found.after.peak_m);
    assert!(found.limits.is_empty(), "{:?}", found.limits);
    // What was found is what any run of that motion shows.
    let arm = robot.flexible(Modelling::default()).unwrap();
    let again = Motion::along((*found.trajectory).clone(), "again", &robot).unwrap();
    let run = arm.simulate(&again, &RunOptions { log_rate_hz: 1000.0, ..RunOptions::default() }).unwrap();
    assert!(run.summary.caveats.iter().all(|caveat| caveat.code != "corner"));
}

#[test]
fn a_milling_square_is_milled_where_the_rigid_arm_would() {
    let (robot, motion) = shipped("kr210", "milling_square.toml");
    let found = compensate_motion(&robot, &motion, &request()).unwrap();
    told("milling square", &found);
    assert!(found.after.peak_m <= 0.01 * found.before.peak_m, "{:e} of {:e}", found.after.peak_m, found.before.peak_m);
}

#[test]
fn a_stiffness_that_is_off_by_a_third_still_takes_most_of_the_error_away() {
    let (robot, motion) = shipped("kr210", "pick_and_place.toml");
    let found = compensate_motion(&robot, &motion, &CompensateRequest { sweep: true, ..request() }).unwrap();
    told("plants", &found);
    assert_eq!(found.plants.len(), 5);
    for plant in &found.plants {
        let left = plant.after.rms_m / plant.before.rms_m;
        // Where links alone bend there is little to take away, and the drives' part is too much.
        if plant.plant != "links alone give way" {
            assert!(left < 0.5, "{}: {left}", plant.plant);
        }
    }
}

/// Truth: the equilibrium at the end of the motion, found at the operating point.
#[test]
fn at_rest_commands_leave_nothing_where_the_motion_ends() {
    let (robot, motion) = shipped("kr210", "pick_and_place.toml");
    let found = compensate_motion(&robot, &motion, &CompensateRequest { method: Method::Static, ..request() }).unwrap();
    told("static", &found);
    let arm = robot.flexible(Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    let end = |trajectory: &flexarm::Trajectory| {
        let (mut q, mut v, mut a) = ([0.0; 6], [0.0; 6], [0.0; 6]);
        trajectory.sample(trajectory.duration(), &mut q, &mut v, &mut a);
        q
    };
    at.solve(&end(&motion.trajectory), &Wrench::zeros()).unwrap();
    let wanted = at.rigid_tcp_pose();
    at.solve(&end(&found.trajectory), &Wrench::zeros()).unwrap();
    let off = (at.tcp_pose().translation.vector - wanted.translation.vector).norm();
    eprintln!("at the end {off:.1e} m");
    assert!(off <= 1e-9, "{off:e}");
    // In motion inertia is left.
    assert!(found.after.rms_m < 0.5 * found.before.rms_m);
}

#[test]
fn a_shaped_motion_ends_with_less_vibration() {
    let (robot, motion) = shipped("kr210", "pick_and_place.toml");
    let bare = CompensateRequest { iterations: 0, ..request() };
    let plain = compensate_motion(&robot, &motion, &bare).unwrap();
    let shaped =
        compensate_motion(&robot, &motion, &CompensateRequest { shaper: Some(ShaperKind::Zv), ..bare }).unwrap();
    let swing = |found: &Compensation| {
        let last = &found.curves[found.curves.len().saturating_sub(200)..];
        let (low, high) = last.iter().fold((f64::INFINITY, 0.0f64), |(l, h), c| (l.min(c[1]), h.max(c[1])));
        high - low
    };
    eprintln!(
        "swing at the end {:.2e} and {:.2e} m, {:.3} s longer",
        swing(&plain),
        swing(&shaped),
        shaped.shaper_delay_s
    );
    assert!(shaped.shaper_delay_s > 0.02 && swing(&shaped) < 0.5 * swing(&plain));
}

/// The home pose of most wrists is singular: axis 5 at zero.
#[test]
fn a_motion_that_begins_at_a_singular_wrist_is_compensated_and_that_is_said() {
    let (robot, motion) = shipped("kr300", "kr300.toml");
    let found = compensate_motion(&robot, &motion, &request()).unwrap();
    told("kr300", &found);
    assert!(found.caveats.iter().any(|caveat| caveat.code == "singular"));
    assert!(found.after.peak_m <= 0.01 * found.before.peak_m, "{:e}", found.after.peak_m);
}

/// The run is logged at whole numbers of steps; the motion does not end at one.
#[test]
fn the_error_does_not_depend_on_the_step_at_which_it_is_sampled() {
    let (robot, motion) = shipped("kr210", "milling_square.toml");
    let peak = |step_s: f64| {
        let run = RunOptions { step_s, ..RunOptions::default() };
        let found = compensate_motion(&robot, &motion, &CompensateRequest { run, iterations: 0, ..request() }).unwrap();
        found.before.rms_m
    };
    let (fine, odd) = (peak(1e-3), peak(0.7e-3));
    assert!((odd / fine - 1.0).abs() < 1e-4, "{fine:e} {odd:e}");
}

#[test]
fn what_cannot_be_compensated_is_said() {
    let (robot, motion) = shipped("kr210", "pick_and_place.toml");
    let fails = |robot: &Robot, request: CompensateRequest, part: &str| {
        let error = compensate_motion(robot, &motion, &request).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    fails(&robot, CompensateRequest { components: [false; 6], ..request() }, "no component");
    let coarse = RunOptions { step_s: 0.05, ..RunOptions::default() };
    fails(&robot, CompensateRequest { run: coarse, ..request() }, "at most 0.004 s");
    fails(&robot, CompensateRequest { cutoff_hz: Some(-1.0), ..request() }, "expected a positive frequency");
    let rigid = Robot::load(root().join("robots/kr210/kr210.urdf")).unwrap();
    fails(&rigid, request(), "no flexible link and no elastic drive");
    let other = Robot::load(root().join("robots/kr500_identified")).unwrap();
    let names =
        |robot: &Robot| robot.flexible(Modelling::default()).unwrap().joints().map(str::to_owned).collect::<Vec<_>>();
    if names(&other) != names(&robot) {
        fails(&robot, CompensateRequest { plant: Some(("other".into(), other)), ..request() }, "must be the same");
    }
}

/// Asked to stop at any look, it stops there, and writes nothing.
#[test]
fn a_compensation_that_is_stopped_leaves_nothing() {
    use std::sync::atomic::{AtomicUsize, Ordering};

    let (robot, motion) = shipped("kr210", "point_to_point.toml");
    let folder = std::env::temp_dir().join(format!("flexarm-compensate-stop-{}", std::process::id()));
    let all = AtomicUsize::new(0);
    let count = || all.fetch_add(1, Ordering::Relaxed) > usize::MAX - 1;
    for method in [Method::Dynamic, Method::Static] {
        let request = CompensateRequest { method, sweep: true, output: Some(folder.clone()), ..request() };
        all.store(0, Ordering::Relaxed);
        let unwritten = CompensateRequest { output: None, ..request.clone() };
        compensate_motion_until(&robot, &motion, &unwritten, &count).unwrap();
        let looks = all.load(Ordering::Relaxed);
        eprintln!("{looks} looks");
        for at in [0, looks / 10, looks / 2, looks - 1] {
            let seen = AtomicUsize::new(0);
            let stop = || seen.fetch_add(1, Ordering::Relaxed) >= at;
            let stopped = compensate_motion_until(&robot, &motion, &request, &stop);
            assert!(matches!(stopped, Err(Error::Interrupted { .. })), "at look {at} of {looks}");
            assert!(!folder.exists());
        }
    }
}
