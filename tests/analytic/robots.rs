//! The shipped robots end to end: files in, table out, against stored and closed-form truth.
#![allow(non_snake_case, reason = "names of mechanics: V shear force, M moment")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use flexarm::recordings::RecordingFormat;
use flexarm::{Keep, LinkModel, Modelling, Motion, Outputs, Robot, RunOptions, RunRequest, Summary};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the workspace").to_owned()
}

fn load(robot: &str) -> Robot {
    Robot::load(root().join("robots").join(robot)).expect("a sound robot")
}

/// Runs a robot and reads its table back: column name to values.
fn run(
    robot: &str,
    trajectory: &str,
    modelling: &Modelling,
    options: &RunOptions,
) -> (Summary, HashMap<String, Vec<f64>>) {
    let robot = load(robot);
    let path = root().join("trajectories").join(trajectory);
    let motion = Motion::load_for(&path, &robot.rigid_model().expect("a tree")).expect("a sound trajectory");
    let unique = format!("flexarm-robots-{}-{}-{trajectory}-{}", std::process::id(), robot.name, options.log_rate_hz);
    let folder = std::env::temp_dir().join(unique);
    let outputs = Outputs { recordings: [RecordingFormat::Csv].into(), ..Outputs::everything(&folder) };
    let arm = robot.model(modelling).expect("a model");
    let request = RunRequest { outputs: Some(&outputs), ..RunRequest::keeping(Keep::Figures) };
    let summary = arm.simulate_with(&motion, options, request).expect("runs").summary;
    let text = std::fs::read_to_string(folder.join("run.csv")).expect("the table");
    std::fs::remove_dir_all(&folder).expect("our own folder");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let mut table: HashMap<String, Vec<f64>> = HashMap::new();
    for line in lines {
        for (name, value) in names.iter().zip(line.split(',')) {
            table.entry((*name).to_owned()).or_default().push(value.parse().expect("a number"));
        }
    }
    (summary, table)
}

/// The reference arm from its folder meets the converged curve of the other tool
/// (tests/golden/reference_arm_mid.csv).
///
/// Measured: rigid twin 1e-11 m, the digits stored; flexible 2.6e-5 of the peak deflection at 1 ms.
#[test]
fn reference_arm_by_file_equals_the_converged_curve() {
    let options = RunOptions { log_rate_hz: 250.0, ..RunOptions::default() };
    let (summary, table) = run("test/reference_arm", "reference_arm.toml", &Modelling::default(), &options);
    let golden = std::fs::read_to_string(root().join("tests/golden/reference_arm_mid.csv")).expect("golden file");
    let rows: Vec<Vec<f64>> = golden
        .lines()
        .filter(|l| !l.starts_with(['#', 't']))
        .map(|l| l.split(',').map(|x| x.parse().expect("a number")).collect())
        .collect();
    assert_eq!(rows.len(), table["time"].len());
    let (mut rigid, mut flexible, mut peak) = (0.0f64, 0.0f64, 0.0f64);
    for (k, row) in rows.iter().enumerate() {
        let distance = |prefix: &str, at: usize| {
            let d =
                ["x_m", "y_m", "z_m"].iter().enumerate().map(|(i, n)| table[&format!("{prefix}_{n}")][k] - row[at + i]);
            d.map(|x| x * x).sum::<f64>().sqrt()
        };
        assert!((table["time"][k] - row[0]).abs() < 1e-12);
        rigid = rigid.max(distance("rigid", 1));
        flexible = flexible.max(distance("flexible", 4));
        peak = peak.max((0..3).map(|i| (row[4 + i] - row[1 + i]).powi(2)).sum::<f64>().sqrt());
    }
    eprintln!("rigid {rigid:.1e} m, flexible {:.2e} of the peak {peak} m", flexible / peak);
    assert!(rigid < 1e-9);
    assert!(flexible < 1e-4 * peak);
    let tcp = summary.tcp.expect("compared");
    assert!((tcp.static_sag_m - 0.0014795856516374522).abs() < 1e-9);
    assert!((tcp.peak_m - 0.0048363608115477305).abs() < 1e-6);
}

/// One cantilever of aluminium, 20 x 40 mm: sag of its tip mass and own weight.
///
/// Truth for the two-part model: the tip load's deflection F l³/(3EI) is exact; half of the beam's
/// weight acts at the middle of the outer half and bends the spring like any load there, so the sag
/// under own weight is 3/32 instead of 1/8 of m g l³/EI (the README of the robot has the numbers).
#[test]
fn one_beam_sags_as_its_two_part_model_must() {
    let (summary, _) = run("test/one_beam", "beam_hold.toml", &Modelling::default(), &RunOptions::default());
    let robot = load("test/one_beam");
    let span = &robot.model(&Modelling::default()).expect("a tree").spans[0];
    let mass = |name: &str| robot.urdf.mechanism.link(name).and_then(|l| l.inertia).map_or(0.0, |i| i.mass);
    let (l, g) = (span.length, 9.81);
    // bending about the horizontal section axis: height 40 mm upright
    let b_h = [0.02f64, 0.04f64];
    let sags = [b_h[0] * b_h[1].powi(3), b_h[1] * b_h[0].powi(3)].map(|bh3| {
        let stiffness = 70e9 * bh3 / 12.0;
        let tip = mass("tip") * g * l.powi(3) / (3.0 * stiffness);
        let beam = mass("beam_1") * g;
        // outer half at 3/4 l: shear V = beam/2 and moment V l/4 about the split at l/2, carried to
        // the tip: u_tip = V l³/(12 EI) + M/(EI/l) l/2 with the spring at mid length
        let (V, M) = (0.5 * beam, 0.5 * beam * l / 4.0);
        tip + V * l.powi(3) / (12.0 * stiffness) + M * l / stiffness * 0.5 * l
    });
    let found = summary.tcp.expect("compared").static_sag_m;
    let nearest = sags.iter().map(|s| (found / s - 1.0).abs()).fold(f64::INFINITY, f64::min);
    eprintln!("sag {found:.6e} m, closed form {sags:?}, difference {nearest:.1e}");
    assert!(nearest < 2e-4); // measured 1e-6: the sag is not infinitely small
}

/// The KR 210 weighs what is published, and its links bend in the range that its README states.
#[test]
fn kr210_has_the_published_mass_and_a_plausible_first_frequency() {
    let inspection = flexarm::inspect(&load("kr210"), None, None).expect("inspects");
    let urdf: f64 = inspection.links.iter().map(|l| l.mass_kg).sum();
    assert!((urdf - 1077.424).abs() < 0.01, "{urdf}");
    let (summary, table) =
        run("kr210/links.toml", "point_to_point.toml", &Modelling::default(), &RunOptions::default());
    let f1 = summary.frequencies_hz[0];
    assert!((10.0..25.0).contains(&f1), "{f1}");
    // Both parts of a cut link are exactly the link: the rigid twin needs the torques of the URDF's
    // robot.
    assert!(summary.warnings.iter().all(|w| !w.contains("weigh")), "{:?}", summary.warnings);
    assert!(table["rigid_joint_2_effort"].iter().all(|t| t.is_finite()));
}

/// Generalised-alpha, SPOOK and RK4 agree on the shipped arm's peak; measured within 4e-4.
#[test]
fn steppers_agree_on_the_shipped_arm() {
    use flexarm::StepperKind;
    use flexarm::steppers::SpookSettings;
    let peak = |stepper: StepperKind, step_s: f64| {
        let options = RunOptions { stepper, step_s, ..RunOptions::default() };
        let robot = load("kr210");
        let path = root().join("trajectories/point_to_point.toml");
        let motion = Motion::load_for(&path, &robot.rigid_model().expect("a tree")).expect("sound");
        let arm = robot.model(&Modelling::default()).expect("a model");
        arm.simulate(&motion, &options).expect("runs").summary.tcp.expect("compared").peak_m
    };
    let reference = peak(StepperKind::Rk4, 5e-5);
    let alpha = peak(RunOptions::default().stepper, 1e-3) / reference - 1.0;
    let spook = peak(StepperKind::Spook(SpookSettings::default()), 1e-4) / reference - 1.0;
    eprintln!("peak {reference:.6e} m; generalised-alpha at 1 ms {alpha:.1e}, spook at 0.1 ms {spook:.1e}");
    assert!(alpha.abs() < 1e-3);
    // spook damps in proportion to stiffness where the robot file asks for modal damping
    assert!(spook.abs() < 2e-2);
}

/// Three beams welded at right angles, all of them modal: a modal link on a fixed joint is a body
/// of its own.
///
/// Truth: the same beams in seven parts each, which come to it with the square of their number.
/// Measured: peak 6e-5, first four frequencies 1e-5 to 3e-4.
#[test]
fn modal_links_on_fixed_corners_agree_with_many_parts() {
    let run_with = |modelling| {
        let options = RunOptions { log_rate_hz: 100.0, ..RunOptions::default() };
        run("test/three_beams", "beam_swing.toml", &modelling, &options).0
    };
    let modal = run_with(Modelling { links: LinkModel::Modal, ..Modelling::default() });
    let parts = run_with(Modelling { links: LinkModel::Lumped, segments: Some(7), ..Modelling::default() });
    let peak = |s: &Summary| s.tcp.as_ref().expect("compared").peak_m;
    let error = peak(&modal) / peak(&parts) - 1.0;
    let frequencies = modal.frequencies_hz.iter().zip(&parts.frequencies_hz).take(4);
    let worst = frequencies.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    eprintln!("three beams, modal against seven parts: peak {error:.1e}, frequencies {worst:.1e}");
    assert_eq!(modal.links_model, "modal");
    assert!(error.abs() < 1e-3 && worst < 1e-3);
}
