//! Every link model on one robot and motion: deflection, frequencies, error and cost side by side.
//!
//! ```text
//! cargo run --release -p flexarm --no-default-features --example link_models [ROBOT [TRAJECTORY]]
//! ```
//! The truth is the modal link with 20 fixed-interface modes and load-dependent stiffness,
//! integrated by the reference stepper. Cost is the CPU time of the steps only, the minimum of five
//! runs; differences between single runs are noise.
#![allow(clippy::print_stdout, clippy::unwrap_used, non_snake_case, reason = "a program for people; monogram notation")]

use std::path::PathBuf;

use flexarm::robots::TCP_FRAME;
use flexarm::steppers::Start;
use flexarm::{LinkModel, Modelling, Motion, Robot, StepperKind};
use flexarm_stepping::{AlphaSettings, Observation, Plant, ReferenceSettings, static_equilibrium};
use nalgebra::Vector3;

const STEP: f64 = 1e-3;

/// Computes TCP positions every millisecond, and the cost (CPU seconds per simulated second).
fn run(plant: &Plant, kind: StepperKind, duration: f64) -> (Vec<Vector3<f64>>, f64) {
    let tcp = plant.model.frame(TCP_FRAME).unwrap().clone();
    let steps = (duration / STEP).round() as usize;
    let mut seen = Observation::new(plant);
    let (mut path, mut cost) = (Vec::new(), f64::INFINITY);
    let repeats = if matches!(kind, StepperKind::Reference(_)) { 1 } else { 5 };
    for repeat in 0..repeats {
        let mut stepper = flexarm_stepping::new_stepper(kind, plant.clone(), STEP, Start::Equilibrium).unwrap();
        let started = cpu_time::ThreadTime::now();
        for _ in 0..steps {
            stepper.step().unwrap();
        }
        cost = cost.min(started.elapsed().as_secs_f64() / duration);
        if repeat > 0 {
            continue;
        }
        let mut stepper = flexarm_stepping::new_stepper(kind, plant.clone(), STEP, Start::Equilibrium).unwrap();
        for step in 0..=steps {
            stepper.observe(&mut seen);
            path.push((seen.X_WB[tcp.body] * tcp.X_BF).translation.vector);
            if step < steps {
                stepper.step().unwrap();
            }
        }
    }
    (path, cost)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let robot = PathBuf::from(arguments.next().unwrap_or_else(|| "robots/test/reference_arm".into()));
    let mut robot = Robot::load(&robot).unwrap();
    let trajectory = arguments.next().map_or_else(|| robot.default_trajectory.clone().unwrap(), PathBuf::from);
    let motion = Motion::load_for(&trajectory, &robot.rigid_model().unwrap()).unwrap();
    let duration = motion.trajectory.duration();
    let plant =
        |robot: &Robot, modelling: &Modelling| robot.model(modelling).unwrap().plant(motion.prescribed()).unwrap();

    let rigid = plant(&robot, &Modelling { links: LinkModel::Rigid, ..Modelling::default() });
    let (reference_path, _) = run(&rigid, StepperKind::Rk4, duration);
    let modal = |modes| Modelling { links: LinkModel::Modal, modes: Some(modes), ..Modelling::default() };
    let modal_all = Modelling { links: LinkModel::Modal, ..Modelling::default() };
    let lumped = |n| Modelling { links: LinkModel::Lumped, segments: Some(n), ..Modelling::default() };
    let stiffened =
        |robot: &mut Robot, on: bool| robot.flexible_links.iter_mut().for_each(|l| l.choices.geometric = on);
    let beams = robot.flexible_links.iter().all(|l| l.beam.is_some());
    stiffened(&mut robot, beams);
    let (truth, _) = run(&plant(&robot, &if beams { modal(20) } else { modal_all }), reference(), duration);
    let peak = truth.iter().zip(&reference_path).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    println!("{}: peak deflection {:.6} mm over {duration} s; step {STEP} s", robot.name, 1e3 * peak);
    println!(
        "| links | coordinates | sag [mm] | peak error [% of peak] | f1 ... f10 [Hz] | us per simulated ms | times lumped |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");

    let alpha = StepperKind::GeneralizedAlpha(AlphaSettings::default());
    let mut cases: Vec<(String, Modelling, bool)> = Vec::new();
    for n in [2, 3, 5, 9] {
        cases.push((format!("{n} parts"), lumped(n), false));
    }
    for n in [0, 2, 6, 12] {
        cases.push((format!("modal, {n} modes"), modal(n), false));
    }
    cases.push(("modal, 6 modes, stiffening".into(), modal(6), true));
    let mut base = f64::NAN;
    for (name, modelling, geometric) in cases {
        stiffened(&mut robot, geometric && beams);
        let Ok(model) = robot.model(&modelling) else { continue };
        let plant = model.plant(motion.prescribed()).unwrap();
        let (path, cost) = run(&plant, alpha, duration);
        let error = path.iter().zip(&truth).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / peak;
        let sag = (path[0] - reference_path[0]).norm();
        let f: Vec<String> = plant.modes.frequencies_hz().iter().take(10).map(|f| format!("{f:.2}")).collect();
        if base.is_nan() {
            base = cost;
        }
        assert!(static_equilibrium(&plant, 0.0).is_ok());
        println!(
            "| {name} | {} | {:.5} | {:.3} | {} | {:.2} | {:.2} |",
            plant.model.n_elastic(),
            1e3 * sag,
            100.0 * error,
            f.join(" "),
            1e3 * cost,
            cost / base
        );
    }
}

fn reference() -> StepperKind {
    StepperKind::Reference(ReferenceSettings::new(1e-8))
}
