//! Derivatives of the TCP error with respect to parameters of shipped robots: compared with
//! Richardson differences, with several longer steps, of runs of changed robots; refusals.

use std::path::Path;
use std::sync::Arc;

use flexarm_identify::{Effect, Parameter, nominal, parameters, parameters_like};
use flexarm_run::{Arm, DriveModel, Modelling, Motion, Robot, RunOptions};
use flexarm_sensitivity::{RunParameter, SensitivityRequest, error_slopes, pose_sensitivity, sensitivity};
use flexarm_stepping::{AlphaSettings, ExactRun, Plant, Start};

fn place(what: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(what)
}

fn shipped(robot: &str, motion: &str) -> (Robot, Arc<Arm>, Motion) {
    let robot = Robot::load(place(&format!("robots/{robot}"))).unwrap();
    let motion = Motion::load(place(&format!("trajectories/{motion}.toml")), &robot).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    (robot, arm, motion)
}

/// Errors at all instants of a run with one parameter changed.
fn errors(arm: &Arm, motion: &Motion, parameter: &Parameter, x: f64) -> Vec<f64> {
    let changed = nominal(arm).with(std::slice::from_ref(parameter), &[x]);
    let plant = Plant::new(changed.model, changed.springs, motion.prescribed()).unwrap();
    let run = ExactRun {
        settings: AlphaSettings::default(),
        step_s: 1e-3,
        duration_s: motion.trajectory.duration(),
        start: Start::Equilibrium,
        tool: changed.tool,
    };
    run.errors(&plant).unwrap().errors.into_iter().flatten().collect()
}

/// Derivative by differences of sixth order.
fn richardson(h: f64, f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let d = |h: f64| -> Vec<f64> { f(h).iter().zip(f(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect() };
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    (0..a.len()).map(|k| (64.0 * c[k] - 20.0 * b[k] + a[k]) / 45.0).collect()
}

/// Truth: differences of complete runs, for every kind of parameter in the robot file of kr210.
#[test]
fn the_error_of_kr210_depends_on_its_numbers_as_differences_of_runs_say() {
    let (_, arm, motion) = shipped("kr210", "point_to_point");
    let all: Vec<Parameter> =
        parameters(&arm).into_iter().chain(parameters_like(&arm, "link.*.stiffness_factors[*]")).collect();
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
    let found = error_slopes(&arm, &motion, &RunOptions::default(), &asked, true).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        // In five seconds the phase of the first mode changes by 80 times as much. Dampers have a
        // small effect, and need a larger difference to exceed the rounding.
        let h = match &parameter.effect {
            Effect::Stiffness(_) => 0.004,
            Effect::Damping(_) | Effect::Damper { .. } => 0.1,
            Effect::Mass(_) => 0.5,
            _ => unreachable!("named above are others"),
        };
        let truth = richardson(h, |x| errors(&arm, &motion, parameter, x));
        let own = found.slopes[k].as_flattened();
        let largest = truth.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let off = own.iter().zip(&truth).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        eprintln!("{}: {:.1e} of {largest:.2e}", parameter.name, off / largest);
        // Measured 1e-8 to 5e-8, dampers 1.5e-7.
        assert!(off < 1e-6 * largest + 2e-13, "{}: {:e}", parameter.name, off / largest);
    }
}

/// The run that is repeated is that of `compare`, except for the residuals of its iterations.
#[test]
fn the_error_that_is_differentiated_is_that_of_a_run() {
    let (_, arm, motion) = shipped("kr210", "point_to_point");
    let options = RunOptions::default();
    let found = error_slopes(&arm, &motion, &options, &[], false).unwrap();
    let theirs = arm.simulate(&motion, &options).unwrap().summary.tcp.as_ref().unwrap().peak_m;
    assert!((found.position.peak - theirs).abs() < 1e-4 * theirs, "{} {theirs}", found.position.peak);
}

/// Truth: factors on all six directions together equal the factor on the whole.
#[test]
fn the_six_directions_of_a_link_are_together_its_factor() {
    let (robot, _, motion) = shipped("kr210", "point_to_point");
    let by = vec!["link.link_2.stiffness_factor*".to_owned()];
    let request = SensitivityRequest { parameters: by.clone(), ..SensitivityRequest::default() };
    let found = sensitivity(&robot, &motion, &request).unwrap();
    assert_eq!(found.parameters.len(), 7);
    let whole = found.parameters.iter().find(|p| !p.name.contains("factors")).unwrap();
    let sum: f64 = found.parameters.iter().filter(|p| p.name.contains("factors")).map(|p| p.rms_m).sum();
    assert!((sum - whole.rms_m).abs() < 1e-6 * whole.rms_m.abs(), "{sum} {}", whole.rms_m);

    let at = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];
    let found = pose_sensitivity(&robot, Modelling::default(), Some(&at), &by).unwrap();
    let of = |p: &flexarm_sensitivity::PoseParameter| [p.tcp_m[2], p.compliance[2][2], p.frequencies_hz[0]];
    let whole = of(&found.parameters[0]);
    for (k, whole) in whole.into_iter().enumerate() {
        let sum: f64 = found.parameters[1..].iter().map(|p| of(p)[k]).sum();
        assert!((sum - whole).abs() < 1e-8 * whole.abs(), "{k}: {sum} {whole}");
    }
}

/// The robot file of a shipped robot in a separate folder, to be changed.
struct Changed {
    folder: std::path::PathBuf,
    text: String,
}

impl Changed {
    fn new(name: &str) -> Self {
        Self::of("kr210", name)
    }

    fn of(robot: &str, name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-sensitivity-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let home = place(&format!("robots/{robot}")).canonicalize().unwrap();
        let text = std::fs::read_to_string(home.join("robot.toml")).unwrap();
        let absolute = |text: String, key: &str, path: &str| {
            text.replace(&format!("{key} = \"{path}"), &format!("{key} = \"{}/{path}", home.display()))
        };
        let text = absolute(text, "urdf", &format!("{robot}.urdf"));
        let text = absolute(text, "reduced", "fe/");
        Self { folder, text: absolute(text, "default_trajectory", "../../") }
    }

    /// The robot with one permanent change in its file.
    fn kept(mut self, old: &str, new: &str) -> Self {
        assert!(self.text.contains(old), "{old}");
        self.text = self.text.replacen(old, new, 1);
        self
    }

    fn with(&self, old: &str, new: &str) -> Result<Robot, flexarm_run::Error> {
        assert!(self.text.contains(old), "{old}");
        let file = self.folder.join("robot.toml");
        std::fs::write(&file, self.text.replace(old, new)).unwrap();
        Robot::load(&file)
    }
}

/// A number in a robot or motion file, and the parameter of that name.
struct Written<'a> {
    name: &'a str,
    /// Text before it, the number, text after it.
    text: [&'a str; 3],
    /// Step of the differences, of the logarithm for parameters reported per 1 %.
    size: f64,
}

impl Changed {
    /// Errors at all instants of a run, with a number of the robot file, or else of the motion
    /// file, changed by x.
    fn errors(
        &self,
        motion: &str,
        (modelling, run): (&Modelling, &RunOptions),
        own: Option<&Written<'_>>,
        x: f64,
    ) -> Vec<f64> {
        let motion = std::fs::read_to_string(place(&format!("trajectories/{motion}.toml"))).unwrap();
        let (mut robot, mut moved) = (self.text.clone(), motion);
        if let Some(Written { name, text: [before, number, after], .. }) = own {
            let value: f64 = number.parse().unwrap();
            let linear = *name == "payload.mass" || name.starts_with("motion.");
            let changed = if linear { value + x } else { value * x.exp() };
            let (old, new) = (format!("{before}{number}{after}"), format!("{before}{changed:?}{after}"));
            let own = if name.starts_with("motion.") { &mut moved } else { &mut robot };
            assert!(own.contains(&old), "{old}");
            *own = own.replace(&old, &new);
            if name.starts_with("motion.") {
                // Start and end alike.
                let end = -1.2217304763960306f64;
                *own = own.replace(&format!("{end:?}"), &format!("{:?}", end + x));
            }
        }
        let (file, path) = (self.folder.join("robot.toml"), self.folder.join("motion.toml"));
        std::fs::write(&file, robot).unwrap();
        std::fs::write(&path, moved).unwrap();
        let robot = Robot::load(&file).unwrap();
        let motion = Motion::load(&path, &robot).unwrap();
        let found = error_slopes(&robot.model(modelling).unwrap(), &motion, run, &[], true).unwrap();
        found.errors.into_iter().flatten().collect()
    }

    /// Compares derivatives with differences of runs of changed files.
    fn compare(&self, motion: &str, modelling: Modelling, run: &RunOptions, all: &[Written<'_>]) {
        let file = self.folder.join("robot.toml");
        std::fs::write(&file, &self.text).unwrap();
        let robot = Robot::load(&file).unwrap();
        let motion_file = Motion::load(place(&format!("trajectories/{motion}.toml")), &robot).unwrap();
        let parameters = all.iter().map(|own| own.name.to_owned()).collect();
        let table = self.folder.join("slopes.csv");
        let request =
            SensitivityRequest { modelling, run: run.clone(), parameters, table: Some(table.clone()), overwrite: true };
        let found = sensitivity(&robot, &motion_file, &request).unwrap();
        assert_eq!(found.parameters.len(), all.len());
        let table = std::fs::read_to_string(table).unwrap();
        let mut lines = table.lines();
        let head: Vec<&str> = lines.next().unwrap().split(',').collect();
        let rows: Vec<Vec<f64>> = lines.map(|row| row.split(',').map(|x| x.parse().unwrap()).collect()).collect();
        for own in all {
            let first = head.iter().position(|name| *name == format!("{}.x", own.name)).unwrap();
            let per = &found.parameters.iter().find(|parameter| parameter.name == own.name).unwrap().per;
            let scale = if *per == "1 kg" {
                1.0
            } else if *per == "1 %" {
                0.01
            } else {
                1e-3
            };
            let slopes = rows.iter().flat_map(|row| row[first..first + 6].iter().map(|x| x / scale));
            let truth = richardson(own.size, |x| self.errors(motion, (&modelling, run), Some(own), x));
            let largest = truth.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let off = slopes.zip(&truth).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            eprintln!("{}: {:.1e} of {largest:.2e}", own.name, off / largest);
            // Measured 1e-8 to 4e-7, where friction has least effect.
            assert!(off < 1e-6 * largest + 4e-14 / own.size, "{}: {:e}", own.name, off / largest);
        }
    }
}

/// Truth: differences of complete runs of the robot with changed numbers in its file: under servos
/// whose gains follow the inertia at the start if the file omits them, and one of which is
/// temporarily at its torque limit.
#[test]
fn the_error_of_manutec_r3_under_servos_depends_on_the_numbers_of_its_files() {
    let friction = "friction = { viscous = 20.0, coulomb = 30.0, stribeck = 9.0, regularisation = 0.05 }";
    let servo = "servo = { position_gain = 15.0, velocity_gain = 6000.0, integral_gain = 90000.0 }";
    let head = "joint = \"joint_1\"\n";
    let manutec = Changed::of("manutec_r3", "servo").kept(head, &format!("{head}{friction}\n{servo}\n"));
    let own = |name: &'static str, text: [&'static str; 3], size: f64| Written { name, text, size };
    let all = [
        own("payload.mass", ["mass = ", "15.0", ","], 0.02),
        own("drive.joint_2.gearbox.stiffness", ["stiffness = ", "352800.0", ","], 1e-3),
        own("drive.joint_1.gearbox.damping", ["damping = ", "55.125", " "], 0.05),
        own("drive.joint_1.friction.viscous", ["viscous = ", "20.0", ","], 0.05),
        own("drive.joint_1.friction.coulomb", ["coulomb = ", "30.0", ","], 0.05),
        own("drive.joint_1.friction.stribeck", ["stribeck = ", "9.0", ","], 0.1),
        own("drive.joint_1.friction.regularisation", ["regularisation = ", "0.05", " "], 0.02),
        own("drive.joint_1.servo.position_gain", ["position_gain = ", "15.0", ","], 0.01),
        own("drive.joint_1.servo.velocity_gain", ["velocity_gain = ", "6000.0", ","], 0.01),
        own("drive.joint_1.servo.integral_gain", ["integral_gain = ", "90000.0", " "], 0.01),
        own("motion.joint_2", ["", "0.3490658503988659", ""], 1e-4),
    ];
    let modelling = Modelling { drives: DriveModel::Servo, ..Modelling::default() };
    manutec.compare("manutec_r3", modelling, &RunOptions::default(), &all);
    let robot = Robot::load(manutec.folder.join("robot.toml")).unwrap();
    let motion = Motion::load(place("trajectories/manutec_r3.toml"), &robot).unwrap();
    let parameters = vec!["payload.mass".to_owned()];
    let found =
        sensitivity(&robot, &motion, &SensitivityRequest { modelling, parameters, ..Default::default() }).unwrap();
    let limited = found.caveats.iter().find(|caveat| caveat.code == "servo-limit").unwrap();
    assert!(limited.message.contains("joint_2") && limited.message.contains("first at 1.2"), "{}", limited.message);
}

/// Truth: differences of complete runs of changed files, for an arm with closed loops and for one
/// with modal links with modal damping.
#[test]
fn loops_and_modes_depend_on_the_numbers_of_their_files() {
    let own = |name: &'static str, text: [&'static str; 3], size: f64| Written { name, text, size };
    let coarse = RunOptions { step_s: 0.01, ..RunOptions::default() };
    let all = [
        own("payload.mass", ["mass = ", "180.0", ","], 1.0),
        own("drive.joint_2.gearbox.stiffness", ["stiffness = ", "3.4e6", ","], 0.01),
    ];
    Changed::of("palletiser", "loops").compare("palletise", Modelling::default(), &coarse, &all);
    let modelling = Modelling { links: flexarm_run::LinkModel::Modal, ..Modelling::default() };
    let all = [
        own("payload.mass", ["mass = ", "150.0", ","], 0.5),
        own("link.link_2.damping", ["damping = { modal = ", "0.03", " }"], 0.1),
    ];
    // The first of the two links is link_2: the damping of the other one is written differently.
    let mut kr210 = Changed::new("modes");
    let second = kr210.text.rfind("damping = { modal = 0.03 }").unwrap();
    kr210.text.replace_range(second.., &kr210.text[second..].replacen("0.03 }", "0.0300 }", 1));
    kr210.compare("point_to_point", modelling, &coarse, &all);
}

impl Drop for Changed {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.folder);
    }
}

/// Truth: the same robot with a factor in its file, compared with the derivative; the difference is
/// accurate to five digits.
#[test]
fn a_factor_of_one_direction_in_the_robot_file_does_what_its_derivative_says() {
    let kr210 = Changed::new("factors");
    let at = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0];
    let key = "link = \"link_2\"\n";
    let robot_with = |factors: &str| kr210.with(key, &format!("{key}stiffness_factors = {factors}\n"));
    let sag = |factor: f64| {
        let robot = robot_with(&format!("[1, 1, 1, 1, {factor:?}, 1]")).unwrap();
        robot.model(&Modelling::default()).unwrap().statics(Some(&at), [0.0; 6]).unwrap().sag_m[2]
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
    let modal = Modelling { links: flexarm_run::LinkModel::Modal, ..Modelling::default() };
    let robot = robot_with("[1, 1, 1, 1, 1.25, 1]").unwrap();
    let error = robot.model(&modal).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("lumped link"), "{error}");
}

/// Truth: differences of the static pose of changed files. The deflection of a gear is that of its
/// spring load minus the transmission error; a stiffness acts on the spring load; measured 1e-9 and
/// less of the derivative. Without the transmission error it would be five times as large.
#[test]
fn a_gear_with_ripple_gives_way_at_a_pose_by_what_its_spring_carries() {
    let (old, at) = ("gearbox = { stiffness = 352800.0, damping = 441.0 }", [0.3, -0.4, 0.5, 0.2, 0.6, 0.0]);
    let ripple = "transmission_error = [{ amplitude_arcsec = 600.0, per_motor_turn = 1, phase = 0.7 }]";
    let with = |name: &str, stiffness: f64| {
        let new = format!("gearbox = {{ stiffness = {stiffness:?}, damping = 441.0, {ripple} }}");
        Changed::of("manutec_r3", name).with(old, &new).unwrap()
    };
    let sag = |x: f64| {
        let robot = with("ripple", 352_800.0 * x.exp());
        robot.model(&Modelling::default()).unwrap().statics(Some(&at), [0.0; 6]).unwrap().sag_m.to_vec()
    };
    let by = ["drive.joint_2.gearbox.stiffness".to_owned()];
    let found = pose_sensitivity(&with("ripple", 352_800.0), Modelling::default(), Some(&at), &by).unwrap();
    let truth = richardson(0.05, sag);
    for (own, truth) in found.parameters[0].tcp_m.iter().zip(&truth) {
        eprintln!("{:.3e}: off by {:.1e}", truth, 100.0 * own - truth);
        assert!((100.0 * own - truth).abs() < 1e-8 * truth.abs() + 1e-12, "{own:e} {truth:e}");
    }
}

/// Truth: closed form. A point at r from the TCP, tool axes, moves with the tool as a rigid lever:
/// its compliance is `X C Xᵀ` with `X = [1 -[R r]x; 0 1]`, R the tool's axes in the world, for any
/// arm. The compliance of such a tool in the robot file shows whether the derivative has the right
/// axes (other ones, or those of the flange, give large errors), its first order whether it has the
/// right sign.
#[test]
fn the_compliance_beside_the_tool_is_that_of_a_rigid_lever_in_the_tools_own_axes() {
    use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};
    let at = [0.3, -1.2, 1.5, 0.2, 0.4, -0.5];
    // Rotated relative to the flange, so that its axes differ from all others.
    let turn = [0.4, -0.7, 1.1];
    let kr210 = Changed::new("lever");
    let tool = |xyz: [f64; 3]| {
        let robot = kr210
            .with("xyz = [0.0, 0.0, 0.35], rpy = [0.0, 0.0, 0.0]", &format!("xyz = {xyz:?}, rpy = {turn:?}"))
            .unwrap();
        pose_sensitivity(&robot, Modelling::default(), Some(&at), &["tcp.*".to_owned()]).unwrap()
    };
    let base = [0.0, 0.0, 0.35];
    let matrix = |rows: [[f64; 6]; 6]| Matrix6::from_fn(|i, j| rows[i][j]);
    let here = tool(base);
    let C = matrix(here.compliance);
    let R_FT = Rotation3::from_euler_angles(turn[0], turn[1], turn[2]);
    for (axis, own) in here.parameters.iter().enumerate() {
        // The tool moved by 0.2 m along its own axis, by the robot file, in flange axes.
        let r = 0.2;
        let place = Vector3::from(base) + R_FT * Vector3::ith(axis, r);
        let moved = matrix(tool(place.into()).compliance);
        // Its position in the world: the direction of the derivative, checked separately.
        let a = Vector3::from(own.tcp_m) * (r / 1e-3);
        let lever = |a: Vector3<f64>| {
            let mut X = Matrix6::identity();
            let turned: Matrix3<f64> = -a.cross_matrix();
            X.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
            X
        };
        let closed = lever(a) * C * lever(a).transpose();
        let scale = moved.amax();
        assert!((closed - moved).amax() < 1e-9 * scale, "{}: {:e}", own.name, (closed - moved).amax() / scale);
        // The opposite direction, and other axes, give large errors.
        for a in [-a, Vector3::ith(axis, r), R_FT * Vector3::ith(axis, r)] {
            let other = lever(a) * C * lever(a).transpose();
            assert!((other - moved).amax() > 1e-2 * scale, "{}", own.name);
        }
        // To first order the derivative is the lever's.
        let X = lever(a) - Matrix6::identity();
        let slope = (X * C + C * X.transpose()) * (1e-3 / r);
        let error = (slope - matrix(own.compliance)).amax() / slope.amax();
        eprintln!("{}: {error:.1e}", own.name);
        assert!(error < 1e-12, "{}: {error:e}", own.name);
    }
}

/// Truth: the same robot with its tool elsewhere. The compliance is a quadratic polynomial in the
/// tool position, so that second-order differences are exact except for rounding.
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
fn names_that_are_none_are_refused() {
    let (robot, _, motion) = shipped("manutec_r3", "manutec_r3");
    let request = SensitivityRequest { parameters: vec!["drive.elbow".into()], ..SensitivityRequest::default() };
    let error = sensitivity(&robot, &motion, &request).unwrap_err();
    assert!(error.to_string().contains("motion.joint_1"), "{error}");
    let (kr210, _, motion) = shipped("kr210", "pick_and_place");
    let parameters = vec!["link.link_2.stiffness[7][1]".into()];
    let request = SensitivityRequest { parameters, ..SensitivityRequest::default() };
    let error = sensitivity(&kr210, &motion, &request).unwrap_err().to_string();
    assert!(error.contains("stiffness[i][j], i and j from 0 to 5"), "{error}");
}

#[test]
fn a_pose_in_degrees_is_asked_about() {
    let robot = Robot::load(place("robots/kr210")).unwrap();
    let degrees = [0.0, -60.0, 60.0, 0.0, 30.0, 0.0];
    for (pose, count) in [(degrees, 3), (degrees.map(f64::to_radians), 0)] {
        let found = pose_sensitivity(&robot, Modelling::default(), Some(&pose), &[]).unwrap();
        assert_eq!(found.caveats.iter().filter(|caveat| caveat.message.contains("deg is")).count(), count);
    }
}
