//! Derivatives of the tool's error by the numbers of shipped robots: against Richardson differences of runs, what they cost, what is refused.
#![allow(clippy::unwrap_used, reason = "a test stops at the first failure")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]

use std::path::Path;
use std::time::Instant;

use flexarm::identify::{Effect, Parameter};
use flexarm::sensitivity::{RunParameter, SensitivityRequest, pose_sensitivity, sensitivity};
use flexarm::{Arm, DriveModel, Modelling, Motion, Robot, RunOptions, Variation};
use flexarm_stepping::{AlphaSettings, FlexibleArm, SlopesRequest, Start, run_slopes};

fn place(what: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(what)
}

fn shipped(robot: &str, motion: &str) -> (Robot, Arm, Motion) {
    let robot = Robot::load(place(&format!("robots/{robot}"))).unwrap();
    let motion = Motion::load(place(&format!("trajectories/{motion}.toml")), &robot).unwrap();
    let arm = robot.flexible(Modelling::default()).unwrap();
    (robot, arm, motion)
}

/// Errors of all times of a run with one parameter changed.
fn errors(arm: &Arm, motion: &Motion, parameter: &Parameter, x: f64) -> Vec<f64> {
    let plant = arm.plant().with(std::slice::from_ref(parameter), &[x]);
    let flexible = FlexibleArm::new(plant.model, plant.springs, motion.prescribed()).unwrap();
    let request = SlopesRequest {
        settings: AlphaSettings::default(),
        step_s: 1e-3,
        duration_s: motion.trajectory.duration(),
        start: Start::Equilibrium,
        tool: plant.tool,
        keep_samples: true,
    };
    run_slopes(&flexible, &request, &[]).unwrap().errors.into_iter().flatten().collect()
}

/// Derivative by differences of sixth order.
fn richardson(h: f64, f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let d = |h: f64| -> Vec<f64> { f(h).iter().zip(f(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect() };
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    (0..a.len()).map(|k| (64.0 * c[k] - 20.0 * b[k] + a[k]) / 45.0).collect()
}

/// Truth: differences of whole runs, of every kind of number that the robot file of kr210 has.
#[test]
fn the_error_of_kr210_depends_on_its_numbers_as_differences_of_runs_say() {
    let (_, arm, motion) = shipped("kr210", "point_to_point");
    let all: Vec<Parameter> = arm.parameters().into_iter().chain(arm.link_directions()).collect();
    let of = |name: &str| all.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("{name}")).clone();
    let names = [
        "drive.joint_2.gearbox.stiffness",
        "drive.joint_3.gearbox.damping",
        "link.link_2.stiffness_factor",
        "link.link_3.stiffness_factors[4]",
        "link.link_2.damping",
        "payload.mass",
    ];
    let parameters: Vec<Parameter> =
        names.iter().filter(|name| all.iter().any(|p| p.name == **name)).map(|n| of(n)).collect();
    assert!(parameters.len() >= 5, "{:?}", all.iter().map(|p| &p.name).collect::<Vec<_>>());
    let asked: Vec<RunParameter> = parameters.iter().cloned().map(RunParameter::Arm).collect();
    let found = arm.error_slopes(&motion, &RunOptions::default(), &asked, true).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        // In five seconds the phase of the first mode changes by 80 times as much.
        // What dampers do is small, and needs a longer way out of the rounding.
        let h = match &parameter.effect {
            Effect::Stiffness(_) => 0.004,
            Effect::Damping(_) => 0.1,
            Effect::Mass { .. } => 0.5,
        };
        let truth = richardson(h, |x| errors(&arm, &motion, parameter, x));
        let own: Vec<f64> = found.slopes.iter().skip(k).step_by(asked.len()).flatten().copied().collect();
        let largest = truth.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let off = own.iter().zip(&truth).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        eprintln!("{}: {:.1e} of {largest:.2e}", parameter.name, off / largest);
        // Of what changes the error by less than 10 um the differences are rounded at 1e-14 m.
        assert!(off < 1e-8 * largest + 2e-13, "{}: {:e}", parameter.name, off / largest);
    }
}

/// All numbers of kr210 at once against one ordinary run; differences would take two or more runs for each.
#[test]
fn all_numbers_of_a_robot_cost_a_few_runs() {
    let (robot, arm, motion) = shipped("kr210", "pick_and_place");
    let options = RunOptions::default();
    let mut ordinary = f64::INFINITY;
    for _ in 0..3 {
        let clock = Instant::now();
        let found = arm.deflections(&[Variation::new(&motion)], &options, false);
        ordinary = ordinary.min(clock.elapsed().as_secs_f64());
        assert!(found[0].as_ref().unwrap().peak_m > 0.0);
    }
    let clock = Instant::now();
    let whole = arm.simulate(&motion, &options).unwrap();
    let simulated = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let found = sensitivity(&robot, &motion, &SensitivityRequest::default()).unwrap();
    let all = clock.elapsed().as_secs_f64();
    eprintln!(
        "{} parameters: {all:.3} s; one deflection run {ordinary:.3} s ({:.1} runs), a run with columns {simulated:.3} s ({:.1} runs)",
        found.parameters.len(),
        all / ordinary,
        all / simulated
    );
    assert!(all < found.parameters.len() as f64 * ordinary, "{all} s, {ordinary} s");
    let (ours, theirs) = (found.peak_m, whole.summary.tcp.as_ref().unwrap().peak_m);
    assert!((ours - theirs).abs() < 1e-4 * theirs, "{ours} {theirs}");
}

/// Truth: factors of all six directions together are the factor of the whole.
#[test]
fn the_six_directions_of_a_link_are_together_its_factor() {
    let (robot, _, motion) = shipped("kr210", "point_to_point");
    let by = vec!["link.link_2.stiffness_factor*".to_owned()];
    let request = SensitivityRequest { parameters: by.clone(), ..SensitivityRequest::default() };
    let found = sensitivity(&robot, &motion, &request).unwrap();
    assert_eq!(found.parameters.len(), 7);
    let whole = found.parameters.iter().find(|p| !p.name.contains("factors")).unwrap();
    let sum: f64 = found.parameters.iter().filter(|p| p.name.contains("factors")).map(|p| p.rms_m).sum();
    assert!((sum - whole.rms_m).abs() < 1e-9 * whole.rms_m.abs(), "{sum} {}", whole.rms_m);

    let at = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];
    let found = pose_sensitivity(&robot, Modelling::default(), Some(&at), &by).unwrap();
    let of = |p: &flexarm::sensitivity::PoseParameter| [p.tcp_m[2], p.compliance[2][2], p.frequencies_hz[0]];
    let whole = of(&found.parameters[0]);
    for (k, whole) in whole.into_iter().enumerate() {
        let sum: f64 = found.parameters[1..].iter().map(|p| of(p)[k]).sum();
        assert!((sum - whole).abs() < 1e-8 * whole.abs(), "{k}: {sum} {whole}");
    }
}

/// The robot file of kr210 in a folder of its own, to be changed.
struct Changed {
    folder: std::path::PathBuf,
    text: String,
}

impl Changed {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-sensitivity-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let home = place("robots/kr210").canonicalize().unwrap();
        let text = std::fs::read_to_string(home.join("robot.toml")).unwrap();
        let absolute = |text: String, key: &str, path: &str| {
            text.replace(&format!("{key} = \"{path}"), &format!("{key} = \"{}/{path}", home.display()))
        };
        let text = absolute(text, "urdf", "kr210.urdf");
        let text = absolute(text, "reduced", "fe/");
        Self { folder, text: absolute(text, "default_trajectory", "../../") }
    }

    fn with(&self, old: &str, new: &str) -> Result<Robot, flexarm::Error> {
        assert!(self.text.contains(old), "{old}");
        let file = self.folder.join("robot.toml");
        std::fs::write(&file, self.text.replace(old, new)).unwrap();
        Robot::load(&file)
    }
}

impl Drop for Changed {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.folder);
    }
}

/// Truth: the same robot with a factor in its file, against the derivative; five digits are those of the difference.
#[test]
fn a_factor_of_one_direction_in_the_robot_file_does_what_its_derivative_says() {
    let kr210 = Changed::new("factors");
    let at = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];
    let key = "link = \"link_2\"\n";
    let robot_with = |factors: &str| kr210.with(key, &format!("{key}stiffness_factors = {factors}\n"));
    let sag = |factor: f64| {
        let robot = robot_with(&format!("[1, 1, 1, 1, {factor:?}, 1]")).unwrap();
        flexarm::statics(&robot, &Modelling::default(), Some(&at), [0.0; 6]).unwrap().sag_m[2]
    };
    let robot = robot_with("[1, 1, 1, 1, 1.25, 1]").unwrap();
    let by = ["link.link_2.stiffness_factors[4]".to_owned()];
    let found = pose_sensitivity(&robot, Modelling::default(), Some(&at), &by).unwrap();
    let slope = found.parameters[0].tcp_m[2] * 100.0;
    let h = 1e-3f64;
    let difference = (sag(1.25 * h.exp()) - sag(1.25 * (-h).exp())) / (2.0 * h);
    eprintln!("slope {slope:.6e} m, difference {difference:.6e} m");
    assert!((difference - slope).abs() < 1e-5 * slope.abs());
    assert_eq!(found.parameters[0].value, 1.25);

    let error = robot_with("[1, 1, 1]").unwrap_err().to_string();
    assert!(error.contains("expected six positive numbers"), "{error}");
    let modal = Modelling { links: flexarm::LinkModel::Modal, ..Modelling::default() };
    let robot = robot_with("[1, 1, 1, 1, 1.25, 1]").unwrap();
    let error = robot.flexible(modal).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("lumped link"), "{error}");
}

/// Truth: the same robot with its tool elsewhere. The compliance is a polynomial of second degree in the place of the tool, so that
/// differences of second order are exact but for rounding.
#[test]
fn the_place_of_the_tool_moves_it_and_changes_its_compliance_as_another_tool_does() {
    let at = [0.3, -1.2, 1.5, 0.2, 0.4, -0.5];
    let by = ["tcp.*".to_owned()];
    let kr210 = Changed::new("tool");
    let with_tool = |axis: usize, h: f64| {
        let mut xyz = [0.0, 0.0, 0.35];
        xyz[axis] += h;
        let robot = kr210.with("xyz = [0.0, 0.0, 0.35]", &format!("xyz = {xyz:?}")).unwrap();
        pose_sensitivity(&robot, Modelling::default(), Some(&at), &by).unwrap()
    };
    let found = with_tool(0, 0.0);
    assert_eq!(found.parameters.iter().map(|own| own.name.as_str()).collect::<Vec<_>>(), ["tcp.x", "tcp.y", "tcp.z"]);
    for (axis, own) in found.parameters.iter().enumerate() {
        let (more, less) = (with_tool(axis, 0.05), with_tool(axis, -0.05));
        let (mut error, mut size) = (0.0f64, 0.0f64);
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            let difference = 1e-3 * (more.compliance[i][j] - less.compliance[i][j]) / 0.1;
            error = error.max((difference - own.compliance[i][j]).abs());
            size = size.max(difference.abs());
        }
        eprintln!("{}: {:.1e} of the compliance's change", own.name, error / size);
        assert!(error < 1e-9 * size, "{error} {size}");
        assert!((nalgebra::Vector3::from(own.tcp_m).norm() - 1e-3).abs() < 1e-15);
        assert!(own.frequencies_hz.iter().all(|x| *x == 0.0));
    }
}

#[test]
fn what_has_no_derivatives_and_names_that_are_none_are_refused() {
    let (robot, _, motion) = shipped("manutec_r3", "manutec_r3");
    let servo = Modelling { drives: DriveModel::Servo, ..Modelling::default() };
    let run = RunOptions { modelling: servo, ..RunOptions::default() };
    let error = sensitivity(&robot, &motion, &SensitivityRequest { run, ..Default::default() }).unwrap_err();
    assert!(error.to_string().contains("prescribe the joints' motion"), "{error}");
    let request = SensitivityRequest { parameters: vec!["drive.elbow".into()], ..SensitivityRequest::default() };
    let error = sensitivity(&robot, &motion, &request).unwrap_err();
    assert!(error.to_string().contains("motion.joint_1"), "{error}");
}
