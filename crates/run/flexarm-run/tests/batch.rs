//! Batches of poses and runs: the same results as one by one, for any number of threads.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_kinematics::Wrench;
use flexarm_run::{
    Arm, Modelling, Motion, OperatingPoints, PayloadChange, Robot, RunOptions, Scenario, TCP_FRAME, Variation,
};
use flexarm_stepping::{StepperKind, ToolDeflection};
use nalgebra::Vector3;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn kr210() -> (Robot, Arc<Arm>) {
    let robot = Robot::load(root().join("robots/kr210")).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    (robot, arm)
}

/// Runs work with this number of threads.
fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// 700 poses, more than two chunks of work; one of them is NaN.
fn poses(joints: usize) -> Vec<f64> {
    let mut poses: Vec<f64> =
        (0..700 * joints).map(|k| -0.4 + 0.8 * ((k as f64) * 0.618_033_988_749_895).fract()).collect();
    poses[301 * joints] = f64::NAN;
    poses
}

/// Truth: the workspace that solves one pose after another, to the last bit.
#[test]
fn poses_on_all_cores_have_the_answers_of_one_by_one_and_the_bytes_of_one_thread() {
    let (_, arm) = kr210();
    let joints = arm.joints().count();
    let (poses, pull) = (poses(joints), Wrench::new(Vector3::new(200.0, -100.0, 50.0), Vector3::new(5.0, 0.0, 20.0)));
    let all =
        |threads: usize| -> OperatingPoints { with_threads(threads, || arm.operating_points(&poses, &pull).unwrap()) };
    let (one, three) = (all(1), all(3));
    assert_eq!(one.len(), 700);
    for (a, b) in [
        (&one.tcp_m, &three.tcp_m),
        (&one.deflection_m, &three.deflection_m),
        (&one.compliance, &three.compliance),
        (&one.frequencies_hz, &three.frequencies_hz),
    ] {
        assert_eq!(bits(a), bits(b));
    }
    assert!(one.failures.len() == 1 && one.failures[0].0 == 301 && one.tcp_m[3 * 301].is_nan());

    let mut at = arm.operating_point().unwrap();
    for k in (0..700).step_by(37).filter(|k| *k != 301) {
        at.solve(&poses[joints * k..][..joints], &pull).unwrap();
        assert_eq!(bits(&one.tcp_m[3 * k..][..3]), bits(at.tcp_pose().translation.vector.as_slice()), "{k}");
        assert_eq!(bits(&one.compliance[36 * k..][..36]), bits(at.compliance().transpose().as_slice()), "{k}");
        let hz = &one.frequencies_hz[one.frequencies() * k..][..one.frequencies()];
        assert_eq!(bits(hz), bits(at.frequencies_hz()), "{k}");
    }
}

/// Values that do not form complete poses are refused with both numbers.
#[test]
fn half_a_pose_is_refused() {
    let (_, arm) = kr210();
    let error = arm.operating_points(&[0.0; 7], &Wrench::zeros()).unwrap_err().to_string();
    assert!(error.contains('7') && error.contains("multiple of the 6 joints"), "{error}");
    assert!(arm.operating_points(&[], &Wrench::zeros()).unwrap().is_empty());
}

/// A rigid arm has poses but no frequencies.
#[test]
fn a_rigid_arm_has_poses_without_deflection() {
    let (robot, _) = kr210();
    let rigid = Modelling {
        links: flexarm_run::LinkModel::Rigid,
        drives: flexarm_run::DriveModel::Rigid,
        ..Modelling::default()
    };
    let found = robot.model(&rigid).unwrap().operating_points(&[0.1; 12], &Wrench::zeros()).unwrap();
    assert!(found.len() == 2 && found.frequencies() == 0 && found.frequencies_hz.is_empty());
    assert!(found.failures.is_empty() && found.deflection_m.iter().all(|x| *x == 0.0));
}

/// Runs on all cores equal sequential runs, to the last bit.
#[test]
fn runs_on_all_cores_are_those_of_one_thread() {
    let (robot, arm) = kr210();
    let motion = Motion::load(root().join("trajectories/point_to_point.toml"), &robot).unwrap();
    let scenarios: Vec<Scenario> = (0..3).map(|_| Scenario::from(&motion)).collect();
    let options = RunOptions { step_s: 10e-3, ..RunOptions::default() };
    let alone = arm.simulate(&motion, &options).unwrap();
    for run in with_threads(3, || arm.simulate_batch(&scenarios, &options, &|| false)) {
        let run = run.unwrap();
        assert_eq!(bits(run.error_world_m()), bits(alone.error_world_m()));
        assert_eq!(run.summary.headline, alone.summary.headline);
    }
}

/// A study of ten runs: different motions, payloads, stiffnesses, dampings; one with a load.
fn study(robot: &Robot) -> Vec<Variation> {
    let motion = Motion::load(root().join("trajectories/point_to_point.toml"), robot).unwrap();
    let slower = motion.trajectory.scaled(1.5).unwrap();
    let slower = Motion::along(slower, "slower", robot).unwrap();
    let of = |motion: &Motion, payload: f64| {
        let payload = PayloadChange::attach(0.0, payload, Vector3::new(0.0, 0.05, 0.1));
        Variation::new(Scenario::from(motion).with_payload(payload))
    };
    let mut runs: Vec<Variation> = (0..9)
        .map(|k| {
            let part = f64::from(k);
            let motion = if k % 3 == 0 { &slower } else { &motion };
            let run = of(motion, 20.0 + 15.0 * part);
            if k < 4 { run } else { run.with_stiffness(0.6 + 0.05 * part).with_damping(0.5 + 0.2 * part) }
        })
        .collect();
    let push = flexarm_run::AppliedLoad::during(
        TCP_FRAME,
        Wrench::new(Vector3::new(0.0, 0.0, 300.0), Vector3::zeros()),
        0.2,
        0.5,
    );
    runs.push(Variation::new(Scenario::from(&motion).with_load(push)));
    runs
}

/// Truth: the same run with all its figures; peak, time of the peak and last sample agree to the
/// rounding of a distance.
#[test]
fn deflections_of_a_study_are_those_of_whole_runs() {
    let (robot, arm) = kr210();
    let options = RunOptions { step_s: 5e-3, log_rate_hz: 200.0, ..RunOptions::default() };
    let runs = study(&robot);
    let found = arm.deflections(&runs, &options, true, &|| false);
    for (k, (run, found)) in
        runs.iter().zip(found).enumerate().filter(|(_, (run, _))| (run.stiffness, run.damping) == (1.0, 1.0))
    {
        let (found, whole) = (found.unwrap(), arm.simulate(&run.scenario, &options).unwrap());
        let tcp = whole.summary.tcp.as_ref().unwrap();
        let error = whole.error_world_m();
        assert_eq!(error.len(), 3 * found.samples_m.len(), "{k}");
        let apart = error.iter().zip(found.samples_m.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eprintln!("run {k}: peak {:.3e} m, samples apart {apart:.1e} m", found.peak_m);
        assert!(apart < 1e-12 && found.peak_m > 1e-4, "{k}: {apart}"); // measured 9e-16
        assert!((found.peak_m - tcp.peak_m).abs() < 1e-12 && found.t_peak_s == tcp.t_peak_s, "{k}");
    }
}

/// Order, neighbours and threads change no bit.
#[test]
fn deflections_do_not_depend_on_company_order_or_threads() {
    let (robot, arm) = kr210();
    let options = RunOptions { step_s: 5e-3, ..RunOptions::default() };
    let runs = study(&robot);
    let all = |runs: &[Variation], threads: usize| -> Vec<ToolDeflection> {
        let found = with_threads(threads, || arm.deflections(runs, &options, true, &|| false));
        found.into_iter().map(Result::unwrap).collect()
    };
    let one = all(&runs, 1);
    assert_eq!(one, all(&runs, 3));
    let mut reversed = all(&runs.iter().rev().cloned().collect::<Vec<_>>(), 2);
    reversed.reverse();
    assert_eq!(one, reversed);
    for (run, together) in runs.iter().zip(&one) {
        assert_eq!(all(std::slice::from_ref(run), 1)[0], *together);
    }
    assert!(one.windows(2).all(|pair| pair[0].peak_m != pair[1].peak_m), "each run is another one");
}

/// An invalid run is refused at its index, by name, and the others continue; other steppers give
/// figures as well.
#[test]
fn a_bad_run_is_refused_in_its_place() {
    let (robot, arm) = kr210();
    let options = RunOptions { step_s: 10e-3, ..RunOptions::default() };
    let mut runs = study(&robot)[..3].to_vec();
    runs[1] = runs[1].clone().with_stiffness(-1.0);
    let found = arm.deflections(&runs, &options, false, &|| false);
    assert!(found[0].is_ok() && found[2].is_ok());
    let error = found[1].as_ref().unwrap_err().to_string();
    assert!(error.contains("factor of the stiffness") && error.contains("-1"), "{error}");
    let sdirk = RunOptions { stepper: StepperKind::Sdirk3, ..options.clone() };
    let third = arm.deflections(&runs[..1], &sdirk, false, &|| false)[0].as_ref().unwrap().peak_m;
    let second = found[0].as_ref().unwrap().peak_m;
    assert!(third != second && (third / second - 1.0).abs() < 0.05, "{third} {second}");
    let rigid = Modelling {
        links: flexarm_run::LinkModel::Rigid,
        drives: flexarm_run::DriveModel::Rigid,
        ..Modelling::default()
    };
    let rigid = robot.model(&rigid).unwrap().deflections(&runs[..1], &options, false, &|| false);
    assert_eq!(rigid[0].as_ref().unwrap().peak_m, 0.0);
}
