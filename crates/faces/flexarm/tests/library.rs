//! The library as used by other programs: numbers in, columns out, built once and used repeatedly.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flexarm::motions::AppliedLoad;
use flexarm::recordings::Sample;
use flexarm::robots::Description;
use flexarm::{
    Arm, DriveModel, Error, Keep, LinkModel, Modelling, Motion, PayloadChange, Robot, RobotSource, Run, RunOptions,
    RunRequest, Scenario, Wrench,
};
use nalgebra::Vector3;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn is_shared<T: Send + Sync + 'static>() {}
fn is_sent<T: Send + 'static>() {}

#[test]
fn arms_are_shared_by_threads_and_workspaces_are_sent_to_them() {
    is_shared::<Arm>();
    is_shared::<Motion>();
    is_shared::<Run>();
    is_sent::<flexarm::poses::OperatingPoint>();
    is_sent::<Error>();
}

/// Truth: the run that writes files, whose figures are checked against physics by other tests.
#[test]
fn a_run_by_values_is_the_run_by_files() {
    let robot = Robot::load(root().join("robots/kr210")).unwrap();
    let motion = Motion::load(root().join("trajectories/pick_and_place.toml"), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let options = RunOptions::default();
    let run = arm.simulate(&motion, &options).unwrap();
    let curves = arm.simulate_with(&motion, &options, RunRequest::keeping(Keep::Curves)).unwrap().summary;
    assert_eq!(run.summary.tcp, curves.tcp);
    // The figures do not depend on what else is requested of a run.
    let timeless = |mut summary: flexarm::Summary| {
        (summary.wall_s, summary.cpu_s) = (0.0, 0.0);
        (summary.real_time_factor, summary.cpu_s_per_simulated_s) = (0.0, 0.0);
        serde_json::to_string(&summary).unwrap()
    };
    let figures = timeless(run.summary.clone());
    for _ in 0..2 {
        // The second starts from the equilibrium of the first.
        assert_eq!(
            timeless(arm.simulate_with(&motion, &options, RunRequest::keeping(Keep::Figures)).unwrap().summary),
            figures
        );
    }
    assert_eq!(timeless(curves), figures);

    let (t, e) = (run.time_s(), run.error_world_m());
    assert_eq!((t.len(), e.len()), (5001, 3 * 5001));
    let peak = e.chunks_exact(3).map(|e| Vector3::from_row_slice(e).norm()).fold(0.0, f64::max);
    assert_eq!(peak, run.summary.tcp.as_ref().unwrap().peak_m);
    for column in run.columns.columns() {
        assert_eq!(column.values.len(), column.width * run.columns.rows(), "{}", column.name);
    }
    // The contributions to the TCP error add up to it, to first order in the deflection.
    let shares = run.values("contribution");
    let n = run.columns.contributors.len();
    for (e, shares) in e.chunks_exact(3).zip(shares.chunks_exact(3 * n)) {
        let sum = shares.chunks_exact(3).fold(Vector3::zeros(), |sum, s| sum + Vector3::from_row_slice(s));
        assert!((sum - Vector3::from_row_slice(e)).norm() < 2e-5); // measured 9e-6 m of 6 mm
    }
}

/// Truth: the same motion, read from a file. Measured: the same bits.
#[test]
fn a_motion_of_arrays_is_that_of_the_file() {
    let robot = Robot::load(root().join("robots/test/one_beam")).unwrap();
    let t: Vec<f64> = (0..=200).map(|k| 0.01 * f64::from(k)).collect();
    let q: Vec<f64> = t.iter().map(|t| 0.3 * (1.0 - (std::f64::consts::PI * t).cos())).collect();
    let motion = Motion::from_samples(&t, &q, &robot).unwrap();
    let rows = t.iter().zip(&q).map(|(t, q)| format!("{t},{q}\n")).collect::<String>();
    let arm = robot.model(&Modelling::default()).unwrap();
    let joint = arm.joints().next().unwrap();
    let file = std::env::temp_dir().join(format!("flexarm-library-{}.csv", std::process::id()));
    std::fs::write(&file, format!("time,{joint}\n{rows}")).unwrap();
    let read = Motion::load(&file, &robot).unwrap();
    std::fs::remove_file(&file).unwrap();
    let run = |motion: &Motion| arm.simulate(motion, &RunOptions::default()).unwrap();
    assert_eq!(run(&motion).error_world_m(), run(&read).error_world_m());

    for (t, q, words) in [
        (&t[..], &q[1..], "200 joint values are given for 201 times"),
        (&[0.0, 0.0][..], &[0.0, 1.0][..], "does not follow"),
        (&[0.0, 1.0][..], &[0.0, f64::NAN][..], "NaN"),
    ] {
        let said = Motion::from_samples(t, q, &robot).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
}

/// Truth: the same loads and payloads from a file. Measured: the same bits.
#[test]
fn loads_and_payloads_by_value_are_those_of_the_file() {
    let robot = Robot::load(root().join("robots/test/one_beam")).unwrap();
    let motion = Motion::load(root().join("trajectories/beam_swing.toml"), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let file = std::env::temp_dir().join(format!("flexarm-library-{}.loads.toml", std::process::id()));
    let by_file = |text: &str| {
        std::fs::write(&file, format!("format = 1\n{text}")).unwrap();
        let read = Scenario::from(&motion).with_loads_file(&file);
        std::fs::remove_file(&file).unwrap();
        read.unwrap()
    };
    let run = |scenario: &Scenario| arm.simulate(scenario, &RunOptions::default()).unwrap();
    let error = |scenario: &Scenario| run(scenario).error_world_m().to_vec();
    let pushed = error(&by_file("[[load]]\nkind = \"step\"\nforce = [0.0, 3.0, -5.0]\nstart = 0.2\nend = 0.7\n"));
    let F = Wrench::new(Vector3::new(0.0, 3.0, -5.0), Vector3::zeros());
    let applied = |load: AppliedLoad| Scenario::from(&motion).with_load(load);
    assert_eq!(error(&applied(AppliedLoad::during("tcp", F, 0.2, 0.7))), pushed);
    assert_ne!(error(&Scenario::from(&motion)), pushed);

    // Equivalent samples, inside and outside: zero before and after.
    let sampled = AppliedLoad::sampled("tcp", &[0.2, 0.4, 0.7], &[F; 3]).unwrap();
    for t in [0.1999, 0.2, 0.3, 0.7, 0.7001] {
        assert_eq!(sampled.wrench.at(t).force.y, if (0.2..=0.7).contains(&t) { 3.0 } else { 0.0 }, "{t}");
    }
    let worst = error(&applied(sampled)).iter().zip(&pushed).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
    eprintln!("sampled and constant: {worst:e} m");
    assert!(worst < 1e-12, "{worst:e}"); // measured 6e-17
    assert!(AppliedLoad::sampled("tcp", &[0.2, 0.2], &[F; 2]).is_err());
    let elsewhere = applied(AppliedLoad::during("nowhere", F, 0.2, 0.7));
    let refused = |scenario: &Scenario| arm.simulate(scenario, &RunOptions::default()).unwrap_err().to_string();
    assert!(refused(&elsewhere).contains("\"nowhere\": expected \"tcp\""));

    // A payload is attached and released again; the corresponding energy is in the balance.
    let text = "[[payload]]\nat = 0.3\nmass = 0.4\ncom = [0.0, 0.1, 0.0]\ninertia = [2e-3, 3e-3, 4e-3, 1e-4, 0.0, 0.0]\n\
                [[payload]]\nat = 0.8\nmass = 0.0\n";
    let inertia = nalgebra::Matrix3::new(2e-3, 1e-4, 0.0, 1e-4, 3e-3, 0.0, 0.0, 0.0, 4e-3);
    let pick = PayloadChange::attach(0.3, 0.4, Vector3::new(0.0, 0.1, 0.0)).with_inertia(inertia);
    let carried = Scenario::from(&motion).with_payload(PayloadChange::release(0.8)).with_payload(pick);
    let (by_file, by_value) = (run(&by_file(text)), run(&carried));
    assert_eq!(by_file.error_world_m(), by_value.error_world_m());
    assert_eq!(by_file.summary.energy, by_value.summary.energy);
    assert!(by_value.summary.energy.payload_j.abs() > 1e-3, "{:?}", by_value.summary.energy);
    let nowhere = Scenario::from(&motion).with_payload(PayloadChange::release(0.8).on_link("nowhere"));
    assert!(refused(&nowhere).starts_with("payload link \"nowhere\": expected a link that moves"));
    // Same caveats: a load after the end has no effect in either form.
    let late = applied(AppliedLoad::during("tcp", F, 90.0, 91.0));
    assert!(run(&late).summary.warnings.iter().any(|warning| warning.contains("it does nothing")));
}

#[test]
fn an_observer_sees_every_sample_and_can_stop_the_run() {
    let robot = Robot::load(root().join("robots/test/one_beam")).unwrap();
    let motion = Motion::load(root().join("trajectories/beam_swing.toml"), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let mut seen = 0;
    let mut count = |_: &Sample| {
        seen += 1;
        ControlFlow::Continue(())
    };
    let request = RunRequest { observer: Some(&mut count), ..RunRequest::default() };
    let run = arm.simulate_with(&motion, &RunOptions::default(), request).unwrap();
    assert_eq!(seen, run.columns.rows());
    let mut until =
        |sample: &Sample| if sample.time_s > 0.1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let request = RunRequest { observer: Some(&mut until), ..RunRequest::default() };
    let stopped = arm.simulate_with(&motion, &RunOptions::default(), request);
    assert!(matches!(stopped, Err(Error::Interrupted { t, .. }) if (t - 0.102).abs() < 1e-9), "{:?}", stopped.err());
}

/// Truth: [`Arm::statics`] and [`Arm::modes`], which compute equilibrium and modes by other
/// code, with an eigenvalue solver for damped modes. Every shipped robot, link model and drive,
/// with force and moment at the TCP; the three-mass arm rotates by half a radian under them.
/// Measured over 104 poses: 6e-13, 1e-10 (tangents by differences), 2e-14, 1e-13.
#[test]
fn operating_points_are_what_statics_and_modes_say() {
    let modellings = [
        Modelling::default(),
        Modelling { links: LinkModel::Modal, ..Modelling::default() },
        Modelling { drives: DriveModel::Rigid, ..Modelling::default() },
    ];
    let (mut checked, mut worst) = (0, [0.0_f64; 4]);
    let robots = ["robots", "robots/test"].into_iter().flat_map(|place| std::fs::read_dir(root().join(place)).unwrap());
    for folder in robots.map(|entry| entry.unwrap().path()) {
        if !folder.join("robot.toml").is_file() {
            continue;
        }
        let robot = Robot::load(&folder).unwrap();
        for modelling in modellings {
            let Ok(arm) = robot.model(&modelling) else { continue };
            if arm.springs.is_empty() {
                continue;
            }
            let model = &arm.model;
            let ranges: Vec<(f64, f64)> = model.coordinates()[..model.n_actuated()]
                .iter()
                .map(|c| (c.limits.lower.max(-3.0), c.limits.upper.min(3.0)))
                .collect();
            let mut at = arm.operating_point().unwrap();
            for k in 0..4 {
                let place = |i: usize| 0.2 + 0.6 * (0.618 * (7 * k + i + 1) as f64).fract();
                let q: Vec<f64> = ranges.iter().enumerate().map(|(i, (a, b))| a + (b - a) * place(i)).collect();
                let moment = if k % 2 == 0 { 0.0 } else { 5.0 };
                let wrench = [10.0, -20.0, 15.0 * k as f64, moment, 0.0, -moment];
                let F = Wrench::new(Vector3::from_row_slice(&wrench[..3]), Vector3::from_row_slice(&wrench[3..]));
                let truth = robot.model(&modelling).unwrap().statics(Some(&q), wrench).unwrap();
                at.solve(&q, &F).unwrap();
                let moved = at.tcp_pose().translation.vector - at.rigid_tcp_pose().translation.vector;
                let expected = Vector3::from(truth.tcp_displacement_m);
                worst[0] = worst[0].max((moved - expected).norm() / expected.norm().max(1e-6));
                let C = at.compliance();
                let largest = truth.compliance.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
                for (i, row) in truth.compliance.iter().enumerate() {
                    for (j, expected) in row.iter().enumerate() {
                        worst[1] = worst[1].max((C[(i, j)] - expected).abs() / largest);
                    }
                }
                let efforts = at.holding_efforts().iter().zip(&truth.holding_torque);
                let scale = truth.holding_torque.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
                worst[2] = efforts.fold(worst[2], |worst, (a, b)| worst.max((a - b).abs() / scale));
                at.solve(&q, &Wrench::zeros()).unwrap();
                let torque_driven = robot.drives.iter().any(|drive| drive.kind == flexarm::robots::DriveKind::Torque);
                if !torque_driven {
                    let modes = robot.model(&modelling).unwrap().modes(Some(&q), None, 6).unwrap();
                    for (found, truth) in at.frequencies_hz().iter().zip(&modes.undamped_frequencies_hz) {
                        worst[3] = worst[3].max((found / truth - 1.0).abs());
                    }
                }
                checked += 1;
            }
        }
    }
    let [displacement, compliance, effort, frequency] = worst;
    eprintln!(
        "{checked} poses: displacement {displacement:.1e}, compliance {compliance:.1e}, efforts {effort:.1e}, \
         frequencies {frequency:.1e}"
    );
    assert!(checked > 60);
    assert!(worst[0] < 1e-10 && worst[1] < 1e-8 && worst[2] < 1e-11 && worst[3] < 1e-10, "{worst:?}");
}

#[test]
fn poses_of_another_length_and_without_numbers_are_refused() {
    let arm = Robot::load(root().join("robots/kr210")).unwrap().model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    for q in [&[0.0; 5][..], &[0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0]] {
        assert!(at.solve(q, &Wrench::zeros()).unwrap_err().to_string().contains("6"));
    }
    at.solve(&[0.0, -1.0, 1.0, 0.0, 0.5, 0.0], &Wrench::zeros()).unwrap();
    assert!(at.residual() < 1e-12 && at.iterations() < 8, "{} {}", at.residual(), at.iterations());
}

#[test]
fn a_load_beyond_buckling_is_no_operating_point_and_the_next_pose_is() {
    let arm = Robot::load(root().join("robots/test/one_beam")).unwrap().model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    let push = Wrench::new(Vector3::new(-1e9, 0.0, 0.0), Vector3::zeros());
    assert!(at.solve(&[0.0], &push).is_err() && at.residual().is_nan());
    at.solve(&[0.0], &Wrench::zeros()).unwrap();
    assert!(at.residual() < 1e-12, "{}", at.residual());
}

/// Truth: the same robot from its files.
#[test]
fn a_robot_of_texts_is_the_robot_of_its_files() {
    let folder = root().join("robots/kr210");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let (text, urdf) = (read("robot.toml"), read("kr210.urdf"));
    let options = flexarm::LoadOptions::default();
    // The description has no file: the robot file names one that does not exist.
    let text = text.replace("urdf = \"kr210.urdf\"", "urdf = \"nowhere.urdf\"");
    let nowhere = folder.join("nowhere.toml");
    let of_texts = |urdf: &str| {
        let description = Some(Description::Text(urdf));
        RobotSource { text: Some(&text), description, ..RobotSource::new(&nowhere, &options) }.load()
    };
    let ours = of_texts(&urdf).unwrap().robot().clone();
    let theirs = Robot::load(&folder).unwrap();
    let sag = |robot: &Robot| {
        let mut at = robot.model(&Modelling::default()).unwrap().operating_point().unwrap();
        at.solve(&[0.0, -1.2, 1.5, 0.0, 0.4, 0.0], &Wrench::zeros()).unwrap();
        (at.tcp_pose(), at.compliance())
    };
    assert_eq!(sag(&ours), sag(&theirs));
    // Errors in the description are reported with their line, as are errors in the robot file.
    let told = of_texts(&urdf.replace("joint_3", "joint_2")).unwrap_err().to_string();
    assert!(told.contains("nowhere.urdf:") && told.contains("joint_2"), "{told}");
    let nowhere = folder.join("nowhere.toml");
    let wrong = RobotSource { text: Some(&text), ..RobotSource::new(&nowhere, &options) };
    let wrong = wrong.load().unwrap_err().to_string();
    assert!(wrong.contains("there is no file"), "{wrong}");
}

/// Truth: the columns themselves. Inconsistent columns are refused.
#[test]
fn columns_that_were_kept_elsewhere_are_columns_again() {
    let robot = Robot::load(root().join("robots/test/reference_arm")).unwrap();
    let motion = Motion::load(robot.default_trajectory.clone().unwrap(), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    for with_twin in [true, false] {
        let options = RunOptions { step_s: 4e-3, with_twin, ..RunOptions::default() };
        let columns = arm.simulate(&motion, &options).unwrap().columns;
        let kept: Vec<_> = columns.columns().iter().map(|c| (c.name.clone(), c.values.clone())).collect();
        assert_eq!(columns.filled(kept.clone()).unwrap(), columns);
        let mut short = kept.clone();
        short[2].1.pop();
        assert!(columns.filled(short).is_none());
        let mut turned = kept.clone();
        turned.swap(1, 2);
        assert!(columns.filled(turned).is_none());
        assert!(columns.filled(kept[..5].to_vec()).is_none());
    }
}
