//! Robots with published joint stiffness: elastic gearboxes by file, against other tools and closed
//! forms.
#![allow(non_snake_case, reason = "C: compliance")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::{DriveModel, Modelling, Motion, Robot};
use flexarm_stepping::{Held, Observation, ReferenceSettings, Start, StepperKind, new_stepper, static_equilibrium};
use nalgebra::Vector3;
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the workspace").to_owned()
}

fn load(file: &str) -> Robot {
    Robot::load(root().join(file)).expect("a sound robot")
}

fn golden(file: &str) -> Value {
    let text = std::fs::read_to_string(root().join("tests/golden").join(file)).expect("golden file");
    serde_json::from_str(&text).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn worst(found: &[f64], truth: &[f64]) -> f64 {
    assert_eq!(found.len(), truth.len());
    found.iter().zip(truth).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

/// KR 210 and KR 500 with identified gearboxes, with and without load, in two poses: frequencies,
/// sag and compliance.
///
/// Truth: Pinocchio and numpy, two ways (tools/golden_identified.py). Measured: frequencies without
/// weight 2e-13, with it 1e-12, sag 4e-16 m, compliance 8e-16 of its diagonal.
#[test]
fn identified_arms_have_the_frequencies_and_the_compliance_of_the_other_tool() {
    let data = golden("identified_arms.json");
    for case in data["cases"].as_array().expect("cases") {
        let file = case["file"].as_str().expect("a name");
        let q = numbers(&case["q"]);
        let robot = load(file);
        let under_weight = robot.model(&Modelling::default()).expect("modes").modes(Some(&q), None, 6).expect("modes");
        let weight = worst(&under_weight.undamped_frequencies_hz, &numbers(&case["gravity"]["frequencies_hz"]));
        let mut weightless = robot.clone();
        weightless.rigid.gravity = Vector3::zeros();
        let springs = weightless.model(&Modelling::default()).expect("modes").modes(Some(&q), None, 6).expect("modes");
        let springs = worst(&springs.undamped_frequencies_hz, &numbers(&case["springs"]["frequencies_hz"]));
        let held = robot.model(&Modelling::default()).expect("statics").statics(Some(&q), [0.0; 6]).expect("statics");
        let truth = numbers(&case["gravity"]["sag"]);
        let sag = (0..3).map(|k| (held.sag_m[k] - truth[k]).abs()).fold(0.0, f64::max);
        let free =
            weightless.model(&Modelling::default()).expect("statics").statics(Some(&q), [0.0; 6]).expect("statics");
        let C: Vec<Vec<f64>> = case["compliance"].as_array().expect("rows").iter().map(numbers).collect();
        let mut compliance = 0.0f64;
        for i in 0..6 {
            for j in 0..6 {
                let scale = (C[i][i] * C[j][j]).sqrt();
                compliance = compliance.max((free.compliance[i][j] - C[i][j]).abs() / scale);
            }
        }
        eprintln!("{file}: springs {springs:.1e}, weight {weight:.1e}, sag {sag:.1e} m, compliance {compliance:.1e}");
        assert!(springs < 1e-10 && weight < 1e-9 && sag < 1e-12 && compliance < 1e-12);
    }
}

/// Largest TCP difference to a stored curve, and the largest deflection in it (m).
fn along(robot: &str, trajectory: &str, curve: &str) -> (f64, f64) {
    let robot = load(&format!("robots/{robot}"));
    let path = root().join("trajectories").join(trajectory);
    let motion = Motion::load_for(&path, &robot.rigid_model().expect("a tree")).expect("a sound trajectory");
    let plant = robot.model(&Modelling::default()).expect("a tree").plant(motion.prescribed()).expect("an arm");
    let tcp = plant.model.frame(flexarm::robots::TCP_FRAME).expect("there").clone();
    let mut seen = Observation::new(&plant);
    let kind = StepperKind::Reference(ReferenceSettings::new(1e-10));
    let mut stepper = new_stepper(kind, plant, 2e-3, Start::Equilibrium).expect("starts");
    let text = std::fs::read_to_string(root().join("tests/golden").join(curve)).expect("golden file");
    let (mut error, mut peak) = (0.0f64, 0.0f64);
    for (k, line) in text.lines().filter(|l| !l.starts_with(['#', 't'])).enumerate() {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().expect("a number")).collect();
        assert!((row[0] - 2e-3 * k as f64).abs() < 1e-9);
        if k > 0 {
            stepper.step().expect("steps");
        }
        stepper.observe(&mut seen);
        let p = (seen.X_WB[tcp.body] * tcp.X_BF).translation.vector;
        error = error.max((p - Vector3::new(row[4], row[5], row[6])).norm());
        peak = peak.max((Vector3::new(row[1], row[2], row[3]) - Vector3::new(row[4], row[5], row[6])).norm());
    }
    (error, peak)
}

/// Manutec r3 on its published move and the KR 210 on a fast one, motors prescribed, gearboxes
/// elastic.
///
/// Truth: Pinocchio's recursions with DOP853 at rtol 1e-12 (tools/golden_gearboxes.py). Measured
/// 1.3e-10 m (Manutec) and 3.8e-11 m (KR 210).
#[test]
fn arms_with_elastic_gearboxes_move_as_the_other_tool_has_them() {
    let (manutec, peak) = along("manutec_r3", "manutec_r3.toml", "manutec_r3.csv");
    eprintln!("Manutec r3: {manutec:.1e} m of {peak:.6} m");
    assert!((peak - 0.015554954).abs() < 1e-6);
    assert!(manutec < 1e-9);
    let (kr210, peak) = along("kr210_identified", "identified_arms.toml", "kr210_identified.csv");
    eprintln!("KR 210: {kr210:.1e} m of {peak:.6} m");
    assert!((peak - 0.003947889).abs() < 1e-6);
    assert!(kr210 < 1e-9);
}

/// The three-mass arm with its motor held and free. Truth: closed form; published 4.23, 10.39 and
/// 8.97, 11.57 Hz.
///
/// Measured 1e-14; the free motor has a rotation without frequency before its modes.
#[test]
fn three_mass_arm_has_its_closed_form_frequencies() {
    let truth = golden("three_mass.json");
    let held =
        load("robots/abb_three_mass").model(&Modelling::default()).expect("modes").modes(None, None, 2).expect("modes");
    let free = load("robots/abb_three_mass/torque.toml")
        .model(&Modelling::default())
        .expect("modes")
        .modes(None, None, 3)
        .expect("modes");
    let held_truth = numbers(&truth["held"]["frequencies_hz"]);
    let free_truth = numbers(&truth["free"]["frequencies_hz"]);
    eprintln!("held {:?}, free {:?}", held.undamped_frequencies_hz, free.undamped_frequencies_hz);
    assert!(worst(&held.undamped_frequencies_hz, &held_truth) < 1e-12);
    assert!(free.undamped_frequencies_hz[0] < 1e-5);
    assert!(worst(&free.undamped_frequencies_hz[1..], &free_truth) < 1e-9);
    for (found, published) in held_truth.iter().chain(&free_truth).zip([4.23, 10.39, 8.97, 11.57]) {
        assert!((found - published).abs() < 5e-3);
    }
}

/// The four-mass arm with its motor held and free, the gear at its softer slope, friction of the
/// motor alone.
///
/// Truth: numpy (tools/golden_moberg.py); tools/check_moberg.py has responses and runs too. Measured
/// 3e-15, damping ratios 3e-14; the free motor has a rotation and its decay before the modes.
#[test]
fn four_mass_arm_has_the_frequencies_and_the_damping_of_its_equations() {
    let text = std::fs::read_to_string(root().join("tests/benchmarks/moberg/poles.json")).expect("benchmark file");
    let truth: Value = serde_json::from_str(&text).expect("JSON");
    for (file, motor) in [("robots/test/moberg_arm", "held"), ("robots/test/moberg_arm/torque.toml", "free")] {
        let cases = truth["cases"].as_array().expect("cases");
        let fits = |case: &&Value| case["k1"] == 16.7 && case["motor"] == motor && case["friction"] == "motor";
        let case = cases.iter().find(fits).expect("a case");
        let found = load(file).model(&Modelling::default()).expect("modes").modes(None, None, 5).expect("modes");
        let first = found.frequencies_hz.len() - 3;
        let frequencies = worst(&found.frequencies_hz[first..], &numbers(&case["frequencies_hz"]));
        let damping = worst(&found.damping_ratio[first..], &numbers(&case["damping_ratios"]));
        eprintln!("motor {motor}: frequencies {frequencies:.1e}, damping {damping:.1e}");
        assert!(frequencies < 1e-9 && damping < 1e-9, "motor {motor}: {frequencies:e}, {damping:e}");
    }
}

/// `--drives rigid` takes the springs out again, and what is left is the rigid arm.
#[test]
fn drives_can_be_made_rigid_by_a_word() {
    let robot = load("robots/kr210_identified");
    let rigid = Modelling { drives: DriveModel::Rigid, ..Modelling::default() };
    let plant = robot.model(&rigid).expect("a tree").plant(Arc::new(Held(vec![0.0; 6]))).expect("an arm");
    assert_eq!(plant.n_free(), 0);
    let soft = robot.model(&Modelling::default()).expect("a tree").plant(Arc::new(Held(vec![0.0; 6]))).expect("an arm");
    assert_eq!(static_equilibrium(&soft, 0.0).expect("stands").len(), 6);
}
