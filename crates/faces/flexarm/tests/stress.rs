//! Stress of a meshed link over a run, against the superposition of its fields by hand.

use std::path::{Path, PathBuf};

use flexarm::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
use flexarm::{LinkModel, Modelling, Motion, Robot, RunOptions, Scenario, StepperKind, StepperOptions, Summary};
use flexarm_fem::stress::{StressFields, inertia_loads, parse_stress, von_mises};
use nalgebra::Vector3;

/// The lower arm, reduced with stress, in a folder of its own.
struct Arm {
    folder: PathBuf,
}

impl Drop for Arm {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Arm {
    fn new(name: &str) -> Self {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().join("robots/lower_arm");
        let folder = std::env::temp_dir().join(format!("flexarm stress {name} {}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for file in ["lower_arm.urdf", "lower_arm.stl"] {
            std::fs::copy(shipped.join(file), folder.join(file)).unwrap();
        }
        let text = std::fs::read_to_string(shipped.join("robot.toml")).unwrap();
        let lines = text.lines().filter(|line| !line.starts_with("default_trajectory"));
        std::fs::write(folder.join("robot.toml"), lines.map(|line| format!("{line}\n")).collect::<String>()).unwrap();
        let job = ReduceJob::load(&shipped.join("lower_arm.reduce.toml")).unwrap();
        let job = ReduceJob { stress: Some(true), modes: Some(6), chains: Some(vec![4]), ..job };
        let outputs = ReduceOutputs { flex: Some(folder.join("lower_arm.flex")), ..ReduceOutputs::default() };
        let summary = reduce(&job, &ReduceOptions::default(), Some(&outputs), &mut |_| {}).unwrap();
        assert_eq!(summary.files.stress, Some(folder.join("lower_arm.stress").display().to_string()));
        Self { folder }
    }

    fn fields(&self) -> StressFields {
        parse_stress(&std::fs::read(self.folder.join("lower_arm.stress")).unwrap()).unwrap()
    }

    fn run(&self, motion: impl Fn(f64) -> f64, seconds: f64, modelling: Modelling) -> Summary {
        let robot = Robot::load(&self.folder).unwrap();
        let times: Vec<f64> = (0..=(1000.0 * seconds) as u32).map(|k| 1e-3 * f64::from(k)).collect();
        let angles: Vec<f64> = times.iter().map(|t| motion(*t)).collect();
        let motion = Motion::from_samples(&times, &angles, &robot).unwrap();
        let options = RunOptions { modelling, ..RunOptions::default() };
        let arm = robot.flexible(modelling).unwrap();
        arm.simulate(Scenario::new(motion), &options).unwrap().summary
    }
}

/// Models of the link with their names.
fn models() -> [(&'static str, Modelling); 4] {
    let lumped = |segments| Modelling { links: LinkModel::Lumped, segments: Some(segments), ..Modelling::default() };
    let modal = |modes| Modelling { links: LinkModel::Modal, modes: Some(modes), ..Modelling::default() };
    [("two parts", lumped(2)), ("four parts", lumped(4)), ("two modes", modal(2)), ("six modes", modal(6))]
}

/// Largest von Mises stress (Pa) of the rigid link at angle q, rate and acceleration: its fields under
/// its own inertia and that of the disc at its end.
fn by_hand(fields: &StressFields, clear: f64, [q, rate, acceleration]: [f64; 3]) -> f64 {
    let (omega, alpha) = (Vector3::y() * rate, Vector3::y() * acceleration);
    // Acceleration minus gravity in link axes; joint_1 is the link's origin.
    let a = Vector3::new(-q.sin(), 0.0, q.cos()) * 9.81;
    let p_B = fields.poses[1].translation.vector;
    let r = Vector3::new(0.0, 0.0375, 0.0);
    let of_disc = a + alpha.cross(&(p_B + r)) + omega.cross(&omega.cross(&(p_B + r)));
    let force = -15.0 * of_disc;
    let disc = nalgebra::Matrix3::from_diagonal(&Vector3::new(0.037406, 0.06075, 0.037406));
    let torque = r.cross(&force) - disc * alpha - omega.cross(&(disc * omega));
    let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
    let loads = inertia_loads(&a, &alpha, &omega);
    let seats = fields.seats.iter().enumerate().filter(|(_, seat)| seat.from_tie >= clear);
    let stress = seats.map(|(k, _)| {
        von_mises(std::array::from_fn(|c| {
            let row = fields.stress.row(6 * k + c);
            let amplitudes = wrench.iter().chain(&loads);
            amplitudes.enumerate().map(|(j, amplitude)| f64::from(row[j]) * amplitude).sum()
        }))
    });
    stress.fold(0.0, f64::max)
}

#[test]
fn a_held_link_has_the_stress_of_its_weight_whatever_its_model() {
    let arm = Arm::new("held");
    let fields = arm.fields();
    for (name, modelling) in models() {
        let summary = arm.run(|_| 1.2, 0.01, modelling);
        let link = &summary.stress[0];
        let truth = by_hand(&fields, link.clear_of_ties_m, [1.2, 0.0, 0.0]);
        let off = link.worst[0].von_mises_pa / truth - 1.0;
        println!("{name}: {:.4} MPa, off by {off:.1e}", 1e-6 * link.worst[0].von_mises_pa);
        assert!(off.abs() < 3e-4, "{name}: {off:e}"); // the deflection turns the link by 1e-4
        assert_eq!(link.nodes, fields.seats.len());
        let place = &link.worst[0];
        assert!((place.of_yield.unwrap() * 250e6 / place.von_mises_pa - 1.0).abs() < 1e-12);
        assert_eq!(place.material.as_deref(), Some("EN AW-6082 T6"));
        assert!(place.damage.unwrap() < 1e-20, "a constant stress has no cycles");
    }
}

#[test]
fn a_swung_link_bears_its_inertia_and_that_of_its_load() {
    let arm = Arm::new("swung");
    let fields = arm.fields();
    // Accelerations grow from zero, so that the link does not ring: 0.8 Hz against its 34 Hz.
    let (size, w) = (0.2, 5.0);
    let motion = |t: f64| size * (w * t - (w * t).sin());
    for (name, modelling) in models() {
        let summary = arm.run(motion, 1.2, modelling);
        let link = &summary.stress[0];
        let worst = &link.worst[0];
        let t = worst.t_s;
        let state = [motion(t), size * w * (1.0 - (w * t).cos()), size * w * w * (w * t).sin()];
        let off = worst.von_mises_pa / by_hand(&fields, link.clear_of_ties_m, state) - 1.0;
        println!("{name}: {:.3} MPa at {t:.3} s, off by {off:.1e}", 1e-6 * worst.von_mises_pa);
        assert!(off.abs() < 0.02, "{name}: {off:e}");
        let damage = worst.damage.unwrap();
        assert!(damage > 0.0 && damage < 1e-9, "{damage:e}");
    }
}

#[test]
fn stress_files_that_do_not_fit_are_refused_and_steppers_without_accelerations_say_so() {
    let arm = Arm::new("refused");
    let file = arm.folder.join("lower_arm.stress");
    let robot = Robot::load(&arm.folder).unwrap();
    let motion = Motion::from_samples(&[0.0, 0.01], &[0.3, 0.3], &robot).unwrap();
    let scenario = Scenario::new(motion);
    let run = |options: &RunOptions| {
        let flexible = Robot::load(&arm.folder).unwrap().flexible(options.modelling).unwrap();
        flexible.simulate(&scenario, options)
    };
    let spook = flexarm::STEPPERS.iter().find(|entry| entry.name == "spook").unwrap();
    let stepper: StepperKind = (spook.with)(&StepperOptions::default());
    let blind = run(&RunOptions { stepper, step_s: 1e-3, ..RunOptions::default() }).unwrap().summary;
    assert!(blind.stress.is_empty() && blind.caveats.iter().any(|caveat| caveat.code == "no-stress"));

    // Fields of a link of another thickness, then half a file.
    let mut other = arm.fields();
    other.compliance *= 1.1;
    std::fs::write(&file, flexarm_fem::stress::write_stress(&other)).unwrap();
    let error = run(&RunOptions::default()).unwrap_err().to_string();
    assert!(error.contains("another link") && error.contains("lower_arm.stress"), "{error}");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    let error = run(&RunOptions::default()).unwrap_err().to_string();
    assert!(error.contains("lower_arm.stress") && error.contains("reduce the mesh again"), "{error}");
    std::fs::remove_file(&file).unwrap();
    assert!(run(&RunOptions::default()).unwrap().summary.stress.is_empty());
}
