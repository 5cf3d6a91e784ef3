//! Array interfaces: results of an arm with its links, rigid-body algorithms on rows, arms
//! commanded online, work that is stopped.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use flexarm_kinematics::Wrench;
use flexarm_log::{RecordingFormat, flat_columns};
use flexarm_run::{
    Arm, Command, DriveModel, Error, LinkModel, Live, LiveOptions, Modelling, Motion, Outputs, Recursions,
    ResponseRequest, Robot, RunOptions, RunRequest, Scenario, Servos, Variation,
};

const POSE: [f64; 6] = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

fn robot(name: &str) -> Robot {
    Robot::load(root().join("robots").join(name)).unwrap()
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap()
}

/// Numbers between -1 and 1 that fill the interval evenly.
fn numbers(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|k| 2.0 * (seed * (k + 1) as f64).fract() - 1.0).collect()
}

#[test]
fn an_arm_answers_as_the_robot_that_is_substituted_for_each_question() {
    let robot = robot("kr210");
    let modelling = Modelling { links: LinkModel::Modal, drives: DriveModel::Elastic, ..Modelling::default() };
    let arm = robot.model(&modelling).unwrap();
    let wrench = [10.0, 0.0, -500.0, 0.0, 1.0, 0.0];
    let statics = robot.model(&modelling).unwrap().statics(Some(&POSE), wrench).unwrap();
    assert_eq!(json(&arm.statics(Some(&POSE), wrench).unwrap()), json(&statics));
    let modes = robot.model(&modelling).unwrap().modes(Some(&POSE), None, 5).unwrap();
    assert_eq!(json(&arm.modes(Some(&POSE), None, 5).unwrap()), json(&modes));
    let request = ResponseRequest { points: 20, ..ResponseRequest::default() };
    let response = robot.model(&modelling).unwrap().response(Some(&POSE), &request).unwrap();
    assert_eq!(json(&arm.response(Some(&POSE), &request).unwrap()), json(&response));

    let linear = arm.linearise(Some(&POSE), wrench).unwrap();
    let C = linear.compliance().unwrap();
    let difference = (0..36).map(|k| (C[(k / 6, k % 6)] - statics.compliance[k / 6][k % 6]).abs()).fold(0.0, f64::max);
    assert!(difference <= 1e-12 * C.amax(), "{difference:e}");
    assert!(matches!(arm.statics(Some(&[0.0; 5]), wrench), Err(Error::Pose(_))));
}

/// Rows of the rigid-body algorithms, one by one and all at once.
fn check_rows(recursions: &Recursions) {
    let (n, m) = (recursions.model().nv(), 600);
    let [q, v, a] = [0.618, 0.324, 0.755].map(|seed| numbers(m * n, seed));
    let q: Vec<f64> = q.iter().map(|x| 0.1 * x).collect();
    let [mut tau, mut bias, mut back] = [(); 3].map(|()| vec![0.0; m * n]);
    let mut M = vec![0.0; m * n * n];
    recursions.inverse_dynamics(&q, &v, &a, &mut tau).unwrap();
    recursions.nonlinear_effects(&q, &v, &mut bias).unwrap();
    recursions.mass_matrix(&q, &mut M).unwrap();
    recursions.forward_dynamics(&q, &v, &tau, &mut back).unwrap();
    for k in [0, 63, 64, 599] {
        let row = k * n..(k + 1) * n;
        let mut alone = vec![0.0; n];
        recursions.inverse_dynamics(&q[row.clone()], &v[row.clone()], &a[row.clone()], &mut alone).unwrap();
        assert_eq!(alone, tau[row.clone()], "row {k} has the bits of the row alone");
        let scale = tau[row.clone()].iter().map(|x| x.abs()).fold(1.0, f64::max);
        for i in 0..n {
            let Ma: f64 = (0..n).map(|j| M[k * n * n + i * n + j] * a[k * n + j]).sum();
            assert!((Ma + bias[k * n + i] - tau[k * n + i]).abs() <= 1e-11 * scale, "tau = M a + bias");
            assert!((back[k * n + i] - a[k * n + i]).abs() <= 1e-6, "forward dynamics undo the inverse");
        }
    }
    let frame = recursions.frame("tcp").unwrap();
    let (mut J, mut X, mut ahead) = (vec![0.0; 6 * n], vec![0.0; 16], vec![0.0; 16]);
    recursions.jacobian(&q[..n], &frame, &mut J).unwrap();
    recursions.pose(&q[..n], &frame, &mut X).unwrap();
    let (h, mut moved) = (1e-7, q[..n].to_vec());
    moved[0] += h;
    recursions.pose(&moved, &frame, &mut ahead).unwrap();
    for i in 0..3 {
        let slope = (ahead[4 * i + 3] - X[4 * i + 3]) / h;
        assert!((slope - J[i * n]).abs() <= 1e-5, "the Jacobian is the slope of the pose: {slope} and {}", J[i * n]);
    }
    assert!(matches!(recursions.inverse_dynamics(&q, &v[1..], &a, &mut tau), Err(Error::Pose(_))));
    assert!(matches!(recursions.frame("no_link"), Err(Error::Load(_))));
}

#[test]
fn rows_of_the_recursions_have_the_bits_of_each_alone_and_fit_each_other() {
    check_rows(&robot("kr210").recursions().unwrap());
    check_rows(&robot("test/reference_arm").model(&Modelling::default()).unwrap().recursions());
    check_rows(&robot("palletiser").recursions().unwrap());
}

/// Maximum distance between the TCP of an arm that gets a motion as targets, with or without their
/// velocities, and that of the run along it, over the maximum error of the run.
fn off(arm: &Arc<Arm>, motion: &Motion, period_s: f64, with_velocities: bool) -> f64 {
    let options = RunOptions { log_rate_hz: 1.0 / period_s, ..RunOptions::default() };
    let run = arm.simulate(motion, &options).unwrap();
    let n = motion.trajectory.joints().len();
    let [mut q, mut v, mut a] = [(); 3].map(|()| vec![0.0; n]);
    motion.trajectory.sample(0.0, &mut q, &mut v, &mut a);
    let mut live = arm.live(Some(&q), period_s, &options).unwrap();
    let place = run.values("tcp_position");
    let mut largest = 0.0_f64;
    for (k, t) in run.time_s().iter().enumerate().skip(1) {
        motion.trajectory.sample(*t, &mut q, &mut v, &mut a);
        live.step(&Command { q: &q, qdot: with_velocities.then_some(&v), ..Command::default() }).unwrap();
        let tool = live.tcp_pose().translation.vector;
        let distance = (0..3).map(|c| (tool[c] - place[3 * k + c]).powi(2)).sum::<f64>().sqrt();
        largest = largest.max(distance);
    }
    let error = run.error_world_m().chunks(3).map(|e| (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt());
    largest / error.fold(0.0, f64::max)
}

#[test]
fn an_arm_that_is_commanded_along_a_motion_goes_where_the_run_goes() {
    let robot = robot("kr210");
    let arm = robot.model(&Modelling::default()).unwrap();
    let motion = Motion::load(root().join("trajectories/point_to_point.toml"), &robot).unwrap();
    // Cubics between targets are not the quintics of the motion.
    let (fine, coarse) = (off(&arm, &motion, 1e-3, true), off(&arm, &motion, 0.05, true));
    println!("off by {fine:.1e} of the error at 1 kHz, {coarse:.1e} at 20 Hz");
    assert!(fine <= 2e-5 && coarse <= 0.02, "{fine:e}, {coarse:e}");
    assert!(coarse > 4.0 * fine, "shorter periods are closer: {fine:e}, {coarse:e}");

    // Without velocities, accelerations are one period late.
    let (fine, coarse) = (off(&arm, &motion, 1e-3, false), off(&arm, &motion, 4e-3, false));
    println!("without velocities {fine:.1e} at 1 kHz, {coarse:.1e} at 250 Hz");
    assert!(fine <= 2e-2 && coarse <= 8e-2, "{fine:e}, {coarse:e}");
    let servo = Modelling { drives: DriveModel::Servo, ..Modelling::default() };
    let (robot, name) = (self::robot("test/reference_arm"), "trajectories/reference_arm.toml");
    let motion = Motion::load(root().join(name), &robot).unwrap();
    let arm = robot.model(&servo).unwrap();
    let (told, late) = (off(&arm, &motion, 1e-3, true), off(&arm, &motion, 1e-3, false));
    println!("servos {told:.1e}, without velocities {late:.1e}");
    assert!(told <= 1e-3 && late <= 0.3, "{told:e}, {late:e}");
}

#[test]
fn a_live_arm_refuses_what_makes_no_sense_and_starts_again() {
    let arm =
        robot("test/reference_arm").model(&Modelling { drives: DriveModel::Servo, ..Modelling::default() }).unwrap();
    let options = RunOptions::default();
    assert!(matches!(arm.live(None, 1.5e-3, &options), Err(Error::Value(_))));
    assert!(matches!(arm.live(Some(&[0.0; 3]), 1e-3, &options), Err(Error::Pose(_))));
    let mut live = arm.live(Some(&[0.0; 6]), 2e-3, &options).unwrap();
    assert!(matches!(live.step(&Command { q: &[f64::NAN; 6], ..Command::default() }), Err(Error::Pose(_))));
    let begin = live.tcp_pose();
    for k in 1..=50 {
        live.step(&Command { q: &[1e-3 * f64::from(k); 6], ..Command::default() }).unwrap();
    }
    assert!((live.time_s() - 0.1).abs() < 1e-12);
    assert!(live.position()[0] > 0.0 && live.position()[0] < 0.05, "servos lag: {}", live.position()[0]);
    live.reset(Some(&[0.0; 6])).unwrap();
    assert_eq!((live.time_s(), live.tcp_pose()), (0.0, begin));
}

/// Default pose of statics, live arms and their reset: the start of the robot's motion.
#[test]
fn a_live_arm_begins_where_statics_stand() {
    let arm = robot("kr210").model(&Modelling::default()).unwrap();
    let stands = arm.statics(None, [0.0; 6]).unwrap();
    let mut live = arm.live(None, 1e-3, &RunOptions::default()).unwrap();
    assert_eq!(live.position(), stands.at);
    let tcp = live.tcp_pose().translation.vector;
    let place: Vec<f64> = (0..3).map(|k| stands.tcp_position_m[k] + stands.tcp_displacement_m[k]).collect();
    // measured 0.0
    let apart = tcp.iter().zip(&place).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
    println!("{apart:e} m apart");
    assert!(apart < 1e-12 || (0..3).all(|k| (tcp[k] - stands.tcp_position_m[k]).abs() < 1e-12), "{tcp} {place:?}");
    live.step(&Command { q: &POSE, ..Command::default() }).unwrap();
    live.reset(None).unwrap();
    assert_eq!(live.position(), stands.at);
}

/// Follows a circle of two joints for `steps` periods of 1 ms; returns the TCP positions.
fn circle(live: &mut Live, from: &[f64], steps: std::ops::Range<u32>) -> Vec<[f64; 3]> {
    let mut positions = Vec::new();
    for k in steps {
        let s = 0.02 * f64::from(k + 1);
        let mut q = from.to_vec();
        q[0] += 0.1 * (1.0 - s.cos());
        q[1] += 0.05 * (s - s.sin());
        live.step(&Command { q: &q, ..Command::default() }).unwrap();
        positions.push(live.tcp_pose().translation.vector.into());
    }
    positions
}

#[test]
fn a_live_arm_returns_to_a_state_and_repeats_what_followed_bit_for_bit() {
    let backlash = robot("palletiser").model(&Modelling::default()).unwrap();
    let servo = Modelling { drives: DriveModel::Servo, links: LinkModel::Modal, ..Modelling::default() };
    let arms = [backlash, robot("test/reference_arm").model(&servo).unwrap(), robot("kr300").model(&servo).unwrap()];
    for arm in arms {
        let from = vec![0.1; arm.joints().count()];
        let mut live = arm.live(Some(&from), 1e-3, &RunOptions::default()).unwrap();
        circle(&mut live, &from, 0..100);
        let state = live.state().unwrap();
        let first = circle(&mut live, &from, 100..200);
        live.restore(&state).unwrap();
        assert_eq!(first, circle(&mut live, &from, 100..200));
        live.restore(&state).unwrap();
        assert_eq!(first, circle(&mut live, &from, 100..200), "a state can be used again");
        let mut other = arm.live(Some(&from), 1e-3, &RunOptions::default()).unwrap();
        assert!(matches!(other.restore(&state), Err(Error::Value(_))));
    }
}

#[test]
fn motors_with_the_torques_of_servos_move_as_under_servos() {
    let servo = Modelling { drives: DriveModel::Servo, ..Modelling::default() };
    let arm = robot("test/reference_arm").model(&servo).unwrap();
    let (options, from) = (RunOptions::default(), vec![0.1; 6]);
    let mut closed = arm.live(Some(&from), 1e-3, &options).unwrap();
    let mut open = arm
        .live_with(Some(&from), 1e-3, &options, &LiveOptions { servos: Servos::Open, ..LiveOptions::default() })
        .unwrap();
    assert_eq!(closed.effort(), open.effort(), "the first torques hold the pose");
    let (mut largest, mut moved) = (0.0_f64, 0.0_f64);
    for k in 0..300 {
        // The servos hold these torques during the next step.
        let torque = closed.effort().to_vec();
        circle(&mut closed, &from, k..k + 1);
        open.step(&Command { q: &from, torque: Some(&torque), ..Command::default() }).unwrap();
        let both = closed.position().iter().zip(open.position());
        largest = largest.max(both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
        moved = moved.max((closed.position()[0] - from[0]).abs());
    }
    println!("motors differ by {largest:.1e} rad of {moved:.1e}");
    assert!(moved > 0.05 && largest <= 1e-9, "{largest:e}");
    // Without torques the arm falls.
    open.step(&Command { q: &from, ..Command::default() }).unwrap();
    assert_eq!(open.effort(), [0.0; 6]);
}

#[test]
fn control_periods_of_any_whole_number_of_steps_can_follow_each_other() {
    let arm = robot("kr210").model(&Modelling::default()).unwrap();
    let options = RunOptions { step_s: 1e-3, ..RunOptions::default() };
    // Constant accelerations: the parabolas are exact whatever the periods.
    let at = |t: f64| POSE.map(|q| q + 0.2 * t * t);
    let tip = |lengths: &[f64]| {
        let mut live = arm.live(Some(&POSE), 1e-3, &options).unwrap();
        for _ in 0..10 {
            live.step(&Command { q: &at(live.time_s() + 1e-3), ..Command::default() }).unwrap();
        }
        while live.time_s() < 0.4 - 1e-9 {
            for length in lengths {
                let q = at(live.time_s() + length);
                live.advance(*length, &Command { q: &q, ..Command::default() }).unwrap();
            }
        }
        live.tcp_pose().translation.vector
    };
    let (even, uneven) = (tip(&[1e-3]), tip(&[1e-3, 7e-3, 2e-3, 3e-3]));
    let apart = (even - uneven).norm();
    println!("{apart:.1e} m apart");
    assert!(apart <= 1e-9, "{apart:e}");
    let mut live = arm.live(None, 1e-3, &options).unwrap();
    assert!(matches!(live.advance(1.5e-3, &Command { q: &POSE, ..Command::default() }), Err(Error::Value(_))));
}

#[test]
fn work_stops_when_it_is_told_to() {
    let robot = robot("kr210");
    let arm = robot.model(&Modelling::default()).unwrap();
    let poses = POSE.repeat(4000);
    let asked = AtomicUsize::new(0);
    let stop = || asked.fetch_add(1, Ordering::Relaxed) >= 2;
    let stopped = arm.operating_points_until(&poses, &Wrench::zeros(), &stop);
    assert!(matches!(stopped, Err(Error::Interrupted { .. })));
    assert!(asked.load(Ordering::Relaxed) < 10, "it asks for every piece and begins none after that");

    let motion = Motion::load(root().join("trajectories/point_to_point.toml"), &robot).unwrap();
    let options = RunOptions::default();
    let scenarios = vec![Scenario::new(motion.clone()); 3];
    let runs = arm.simulate_batch(&scenarios, &options, &|| true);
    assert!(runs.iter().all(|run| matches!(run, Err(Error::Interrupted { .. }))));
    let variations = vec![Variation::new(&motion); 3];
    let runs = arm.deflections(&variations, &options, false, &|| true);
    assert!(runs.iter().all(|run| matches!(run, Err(Error::Interrupted { .. }))));

    let half = 0.5 * motion.trajectory.duration();
    let mut progress = |t: f64, _: f64| if t < half { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
    let run =
        arm.simulate_with(&motion, &options, RunRequest { progress: Some(&mut progress), ..RunRequest::default() });
    assert!(matches!(run, Err(Error::Interrupted { t, .. }) if t >= half && t < half + 0.1));
}

#[test]
fn columns_in_memory_are_the_table_of_the_csv() {
    for name in ["kr210", "palletiser", "test/one_beam"] {
        let robot = robot(name);
        let motion = Motion::load(robot.default_trajectory.as_ref().unwrap(), &robot).unwrap();
        let folder = std::env::temp_dir().join(format!("flexarm-arrays-{}-{name}", std::process::id()));
        let outputs = Outputs {
            recordings: BTreeSet::from([RecordingFormat::Csv]),
            overwrite: true,
            ..Outputs::everything(&folder)
        };
        let options = RunOptions { log_rate_hz: 50.0, ..RunOptions::default() };
        let arm = robot.model(&Modelling::default()).unwrap();
        let request = RunRequest { outputs: Some(&outputs), ..RunRequest::default() };
        let run = arm.simulate_with(&motion, &options, request).unwrap();
        let text = std::fs::read_to_string(folder.join("run.csv")).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let columns = flat_columns(&run.columns);
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(lines.next().unwrap().split(',').collect::<Vec<_>>(), names);
        for (row, line) in lines.enumerate() {
            for (value, (name, numbers)) in line.split(',').zip(&columns) {
                assert_eq!(value.parse::<f64>().unwrap(), numbers[row], "{name}, row {row}");
            }
        }
        assert!(columns.iter().all(|(_, numbers)| numbers.len() == run.columns.rows()));
    }
}
