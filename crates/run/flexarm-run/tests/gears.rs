//! Gear properties of robot files other than stiffness: from the keys to statics, runs with every
//! stepper, figures and caveats.

use std::path::{Path, PathBuf};

use flexarm_run::{DriveModel, Error, LoadOptions, Modelling, Motion, Robot, RunOptions, Variation, check, inspect};
use flexarm_stepping::{ReferenceSettings, SpookSettings, StepperKind};
use nalgebra::{Matrix2, Vector2};

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// The shipped KR 210 class arm with different drives for its last joints.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-gears-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let urdf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210/kr210.urdf");
        std::fs::copy(urdf, folder.join("kr210.urdf")).unwrap();
        Self(folder)
    }

    fn load(&self, text: &str) -> Result<Robot, Error> {
        std::fs::write(self.0.join("robot.toml"), format!("{HEAD}{text}")).unwrap();
        Robot::load(&self.0)
    }

    fn robot(&self, text: &str) -> Robot {
        self.load(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const HEAD: &str = "format = 1\nurdf = \"kr210.urdf\"\ntcp = { link = \"tool0\" }\n\
                    payload = { link = \"tool0\", mass = 80.0, com = [0.0, 0.0, 0.2], inertia = [2.0, 2.0, 1.0, 0.0, 0.0, 0.0] }\n";
const AT: [f64; 6] = [0.0, -1.1, 1.2, 0.3, 0.4, 0.0];

fn drive(joint: &str, gearbox: &str, rest: &str) -> String {
    format!(
        "[[drive]]\njoint = \"{joint}\"\nkind = \"gearbox\"\nratio = 200.0\nmotor_inertia = 0.003\ngearbox = {{ {gearbox} }}\n{rest}\n"
    )
}

fn moving(robot: &Robot) -> Motion {
    let smooth = |s: f64| s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    let t: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.005).collect();
    let by = [0.1, 0.15, -0.1, 0.3, 0.2, -0.3];
    let at = |t: f64| AT.iter().zip(by).map(move |(q, d)| q + d * smooth((t / 0.4).min(1.0)));
    let q: Vec<f64> = t.iter().flat_map(|t| at(*t)).collect();
    Motion::from_samples(&t, &q, robot).unwrap()
}

fn steppers() -> [(StepperKind, f64, f64); 4] {
    [
        (StepperKind::default(), 2.5e-4, 2e-2),
        (StepperKind::Sdirk3, 2.5e-4, 1e-2),
        (StepperKind::Rk4, 1e-4, 1e-3),
        (StepperKind::Reference(ReferenceSettings::new(1e-8)), 1e-3, 1e-3),
    ]
}

/// Truth: the ripple in arc seconds at the motor angle, added to the deflection of the same gear
/// without ripple, to first order (2.2e-3: the gravity torque changes with it); RK4 at 0.05 ms for
/// the other steppers. A run in a batch equals a single run.
#[test]
fn the_ripple_of_a_gear_is_where_the_robot_file_puts_it() {
    let place = Place::new("ripple");
    let ripple = "stiffness = 2.0e6, damping = 1500.0, transmission_error = [{ amplitude_arcsec = 20.0, per_motor_turn = 1 }, \
                  { amplitude = 5.0e-5, per_joint_turn = 39, phase = 1.2 }]";
    let robot = place.robot(&drive("joint_2", ripple, ""));
    let plain = place.robot(&drive("joint_2", "stiffness = 2.0e6, damping = 1500.0", ""));
    let deflection = |robot: &Robot| {
        robot.model(&Modelling::default()).unwrap().statics(Some(&AT), [0.0; 6]).unwrap().elements[0].clone()
    };
    let (with, without) = (deflection(&robot), deflection(&plain));
    let truth = 20.0 * ARCSEC * (200.0 * AT[1]).sin() + 5e-5 * (39.0 * AT[1] + 1.2).sin();
    let found = with.deflection[0] - without.deflection[0];
    assert!((found - truth).abs() < 5e-3 * truth.abs(), "{found} {truth}");
    // The spring carries the same weight, with no more energy.
    assert!(
        (with.load[0] / without.load[0] - 1.0).abs() < 1e-3 && (with.energy_j / without.energy_j - 1.0).abs() < 2e-3
    );

    let arm = robot.model(&Modelling::default()).unwrap();
    let motion = moving(&robot);
    let run = |stepper: StepperKind, step_s: f64| {
        arm.simulate(&motion, &RunOptions { stepper, step_s, ..RunOptions::default() }).unwrap()
    };
    let fine = run(StepperKind::Rk4, 5e-5);
    let peak = fine.summary.tcp.as_ref().unwrap().peak_m;
    for (stepper, step, bound) in steppers() {
        let run = run(stepper, step);
        let error =
            run.error_world_m().iter().zip(fine.error_world_m()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eprintln!(
            "{:<18} {:.1e} of the peak, energy {:.1e}",
            stepper.name(),
            error / peak,
            run.summary.energy.imbalance
        );
        assert!(error < bound * peak && run.summary.energy.imbalance < 0.02, "{} {}", stepper.name(), error / peak);
    }
    let options = RunOptions { step_s: 2.5e-4, ..RunOptions::default() };
    let alone = arm.simulate(&motion, &options).unwrap().summary.tcp.unwrap().peak_m;
    for found in arm.deflections(&vec![Variation::new(&motion); 4], &options, false, &|| false) {
        assert!((found.unwrap().peak_m / alone - 1.0).abs() < 1e-3);
    }
    let spook =
        RunOptions { stepper: StepperKind::Spook(SpookSettings::default()), step_s: 1e-4, ..RunOptions::default() };
    assert!(arm.simulate(&motion, &spook).err().unwrap().to_string().contains("transmission errors"));
    // Steps that do not resolve the ripple are reported.
    let coarse = arm.simulate(&motion, &RunOptions { step_s: 5e-3, ..RunOptions::default() }).unwrap();
    assert!(coarse.summary.caveats.iter().any(|c| c.code == "ripple-step"), "{:?}", coarse.summary.warnings);
}

/// The hysteresis loop of a gear dissipates energy in a run and is part of the energy balance;
/// statics report their branch of the loop. The reference and spook steppers report that they do
/// not support it.
#[test]
fn the_hysteresis_of_a_gear_takes_energy_and_says_what_statics_make_of_it() {
    let place = Place::new("hysteresis");
    let law = "stiffness = 2.0e6, damping = 1500.0, hysteresis = { loss_arcmin = 1.0, lost_motion_arcmin = 1.0, rated_torque = 3000.0 }";
    let robot = place.robot(&drive("joint_1", law, ""));
    let arm = robot.model(&Modelling::default()).unwrap();
    let motion = moving(&robot);
    let mut peaks = Vec::new();
    for (stepper, step_s) in [(StepperKind::default(), 2.5e-4), (StepperKind::Sdirk3, 2.5e-4), (StepperKind::Rk4, 1e-4)]
    {
        let run = arm.simulate(&motion, &RunOptions { stepper, step_s, ..RunOptions::default() }).unwrap();
        let (energy, tcp) = (&run.summary.energy, run.summary.tcp.as_ref().unwrap());
        eprintln!(
            "{:<18} peak {:.5e} m, {:.4e} of {:.4e} J, open {:.1e}",
            stepper.name(),
            tcp.peak_m,
            energy.hysteresis_j,
            energy.dissipated_j,
            energy.imbalance
        );
        assert!(
            energy.hysteresis_j > 1e-3 && energy.hysteresis_j <= energy.dissipated_j && energy.imbalance < 5e-3,
            "{energy:?}"
        );
        peaks.push([tcp.peak_m, energy.hysteresis_j]);
    }
    for found in &peaks[..2] {
        assert!(
            (found[0] / peaks[2][0] - 1.0).abs() < 5e-3 && (found[1] / peaks[2][1] - 1.0).abs() < 3e-2,
            "{peaks:?}"
        );
    }
    for (stepper, step_s) in [
        (StepperKind::Spook(SpookSettings::default()), 1e-4),
        (StepperKind::Reference(ReferenceSettings::new(1e-8)), 1e-3),
    ] {
        let refused = arm.simulate(&motion, &RunOptions { stepper, step_s, ..RunOptions::default() }).err().unwrap();
        assert!(refused.to_string().contains("hysteresis"), "{refused}");
    }
    let told = robot.model(&Modelling::default()).unwrap().statics(Some(&AT), [0.0; 6]).unwrap().caveats;
    assert!(told.iter().any(|c| c.code == "hysteresis-linear" && c.message.contains("first loading")), "{told:?}");
}

const WRIST: &str = "[coupling]\njoints = [\"joint_5\", \"joint_6\"]\nmatrix = [[1.0, 0.0], [-0.05, 1.0]]\n";

/// Truth: the wrist's part of the compliance about its joint axes is `C K_m^-1 Cᵀ`, its rotors add
/// `C^-T J_m C^-1` to the mass matrix, its motor torques are `Cᵀ τ`; an identity coupling changes
/// nothing.
#[test]
fn a_coupled_wrist_has_springs_rotors_and_torques_at_its_motors() {
    let place = Place::new("wrist");
    let drives = drive("joint_5", "stiffness = 1.5e5, damping = 60.0", "friction = { viscous = 20.0, coulomb = 10.0 }")
        + &drive("joint_6", "stiffness = 0.9e5, damping = 40.0", "friction = { viscous = 10.0, coulomb = 5.0 }");
    let robot = place.robot(&format!("{drives}{WRIST}"));
    let plain = place.robot(&drives);
    let C = Matrix2::new(1.0, 0.0, -0.05, 1.0);
    let wrench = [100.0, 300.0, -200.0, 20.0, -10.0, 30.0];
    let loaded = robot.model(&Modelling::default()).unwrap().statics(Some(&AT), wrench).unwrap();
    let load = Vector2::new(loaded.elements[0].load[0], loaded.elements[1].load[0]);
    let truth = C * Matrix2::new(1.0 / 1.5e5, 0.0, 0.0, 1.0 / 0.9e5) * C.transpose() * load;
    for k in 0..2 {
        let found = loaded.elements[k].deflection[0];
        assert!((found / truth[k] - 1.0).abs() < 1e-12, "{found} {truth}");
    }
    let energy: f64 = loaded.elements.iter().map(|e| e.energy_j).sum();
    assert!((energy / (0.5 * load.dot(&truth)) - 1.0).abs() < 1e-12);
    let motors = C.transpose() * Vector2::new(loaded.holding_torque[4], loaded.holding_torque[5]);
    assert!(
        (loaded.motor_torque["joint_5"] - motors[0]).abs() < 1e-9
            && (loaded.motor_torque["joint_6"] - motors[1]).abs() < 1e-9
    );

    let inspected = [&robot, &plain].map(|robot| inspect(robot, Some(&AT), None).unwrap());
    let back = C.try_inverse().unwrap();
    let rotors = back.transpose() * Matrix2::identity() * (200.0f64.powi(2) * 0.003) * back;
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let own = if i == j { 200.0f64.powi(2) * 0.003 } else { 0.0 };
        let found = inspected[0].mass_matrix[4 + i][4 + j] - inspected[1].mass_matrix[4 + i][4 + j] + own;
        assert!((found - rotors[(i, j)]).abs() < 1e-10, "{i} {j} {found} {rotors}");
    }
    assert_eq!(inspected[0].coupling.as_ref().unwrap().matrix, [[1.0, 0.0], [-0.05, 1.0]]);

    // With every stepper, also torque-controlled.
    let motion = moving(&robot);
    for drives in [DriveModel::AsFiled, DriveModel::Servo] {
        let arm = robot.model(&Modelling { drives, ..Modelling::default() }).unwrap();
        let mut peaks = Vec::new();
        for (stepper, step_s, _) in steppers() {
            let run = arm.simulate(&motion, &RunOptions { stepper, step_s, ..RunOptions::default() }).unwrap();
            let motors = &run.summary.motors;
            eprintln!(
                "{:<18} peak {:.6e} m, open {:.1e}, {motors:?}",
                stepper.name(),
                run.summary.tcp.as_ref().unwrap().peak_m,
                run.summary.energy.imbalance
            );
            assert!(
                motors.len() == 2 && run.summary.energy.imbalance < 2e-2,
                "{motors:?} {}",
                run.summary.energy.imbalance
            );
            peaks.push(run.summary.tcp.unwrap().peak_m);
        }
        assert!(peaks.iter().all(|p| (p / peaks[3] - 1.0).abs() < 2e-2), "{peaks:?}");
    }
    let one = place.robot(&format!("{drives}{}", WRIST.replace("-0.05", "0.0")));
    let hz = [&one, &plain]
        .map(|robot| robot.model(&Modelling::default()).unwrap().modes(Some(&AT), None, 6).unwrap().frequencies_hz);
    assert_eq!(hz[0], hz[1]);
    let runs = [&one, &plain]
        .map(|robot| robot.model(&Modelling::default()).unwrap().simulate(&motion, &RunOptions::default()).unwrap());
    assert_eq!(runs[0].error_world_m(), runs[1].error_world_m());
}

/// Truth: the torques of the drive without it, plus the given ratio of the transmitted torque
/// against the motion.
#[test]
fn friction_under_load_adds_its_part_of_the_torque() {
    let place = Place::new("load");
    let text = |load: &str| {
        drive("joint_2", "stiffness = 2.0e6, damping = 1500.0", &format!("friction = {{ coulomb = 100.0{load} }}"))
    };
    let run = |robot: &Robot| {
        let arm = robot.model(&Modelling::default()).unwrap();
        arm.simulate(moving(robot), &RunOptions::default()).unwrap().summary
    };
    let (with, without) = (run(&place.robot(&text(", load = 0.06"))), run(&place.robot(&text(""))));
    // The arm moves in the same way, since the motor position is prescribed.
    let peaks = [&with, &without].map(|run| run.tcp.as_ref().unwrap().peak_m);
    assert!((peaks[0] / peaks[1] - 1.0).abs() < 1e-6, "{peaks:?}"); // measured 1.2e-7
    let more = with.energy.dissipated_j - without.energy.dissipated_j;
    assert!(more > 10.0 && with.energy.imbalance < 1e-3, "{more} {}", with.energy.imbalance);
    assert!((with.energy.drives_j - without.energy.drives_j - more).abs() < 1e-3 * more);
}

#[test]
fn what_gears_cannot_have_is_refused_with_what_was_found_and_expected() {
    let place = Place::new("refused");
    let fails = |text: String, words: &[&str]| {
        let error = place.load(&text).expect_err(&text).to_string();
        for word in words.iter().chain(&["robot.toml:"]) {
            assert!(error.contains(word), "{text}: {error}");
        }
    };
    let gear = |keys: &str| drive("joint_5", keys, "");
    fails(gear("stiffness = [1e6, 1e6, 1e6], hysteresis = { loss = 1e-4 }"), &["one stiffness"]);
    fails(gear("stiffness = 1e5, hysteresis = { los = 1e-4 }"), &["unknown field"]);
    fails(gear("stiffness = 1e5, transmission_error = [{ amplitude = 1e-5 }]"), &["per_motor_turn"]);
    let six = drive("joint_6", "stiffness = 1e5", "");
    let both = |a: &str, wrist: &str| format!("{}{six}{wrist}", gear(a));
    fails(gear("stiffness = 1e5") + WRIST, &["none has a gearbox"]);
    fails(both("stiffness = 1e5, backlash = 1e-4", WRIST), &["backlash", "joint_5"]);
    fails(both("stiffness = 1e5, hysteresis = { loss = 1e-4 }", WRIST), &["hysteresis", "joint_5"]);
    fails(both("stiffness = 1e5", &WRIST.replace("-0.05, 1.0", "1.0, 0.0")), &["cannot be inverted"]);
    fails(both("stiffness = 1e5", &WRIST.replace("[-0.05, 1.0]", "[1.0]")), &["2 rows of 2"]);
    fails(both("stiffness = 1e5", &WRIST.replace("joint_6", "joint_5")), &["listed twice"]);
    fails(both("stiffness = 1e5", &WRIST.replace("joint_6", "joint_7")), &["joint_7", "joint_6"]);
    let loaded = "[[drive]]\njoint = \"joint_5\"\nkind = \"torque\"\nfriction = { load = 0.1 }\n";
    fails(loaded.into(), &["needs a gearbox"]);
    // Degrees, arc seconds and per cent instead of radians and ratios are reported.
    let slips = gear(
        "stiffness = 1e5, hysteresis = { loss = 1.5 }, transmission_error = [{ amplitude = 20.0, per_motor_turn = 1 }]",
    )
    .replace("gearbox = {", "friction = { load = 5.0 }\ngearbox = {");
    place.robot(&slips);
    let told = check(&place.0, None, &LoadOptions::default());
    for (code, likely) in
        [("hysteresis-loss", "arc minutes"), ("transmission-error", "arc seconds"), ("load-friction", "per cent")]
    {
        assert!(told.iter().any(|f| f.code == code && f.likely.contains(likely)), "{code}: {told:?}");
    }
}
