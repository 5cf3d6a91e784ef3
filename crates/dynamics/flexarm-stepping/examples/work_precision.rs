//! Time against error: every stepper on the reference arm, 4 s, steps without set-up.
//!
//! ```text
//! cargo run --release -p flexarm-stepping --example work_precision
//! ```
//! The error is the maximum distance of the tool from that of the reference, every 0.5 ms or after
//! every longer step, relative to its peak deflection; CPU time of one thread, minimum of five
//! runs, all lines in turn.
#![allow(non_snake_case, reason = "monogram notation")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, State, forward_kinematics};
use flexarm_stepping::*;
use flexarm_testkit::{follow_reference_motion, reference_arm};
use nalgebra::{DVector, Vector3};

const DURATION: f64 = 4.0;
/// Interval of the compared points (s).
const POINTS: f64 = 0.5e-3;

fn plant() -> Plant {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let damping = Damping::StiffnessProportional(reference.beta);
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K, damping)).to_vec();
    let motion = MotionFn(follow_reference_motion);
    Plant::new(model, springs, Arc::new(motion)).unwrap()
}

/// Returns the tool positions every [`POINTS`], and the work.
fn path(plant: &Plant, kind: StepperKind, h: f64) -> (Vec<Vector3<f64>>, Counts) {
    let tool = plant.model.frame("tcp").unwrap();
    let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).unwrap();
    let mut seen = Observation::new(plant);
    // Longer steps are compared at their own times.
    let every = (POINTS / h).round().max(1.0) as usize;
    let mut points = Vec::new();
    for step in 0..=(DURATION / h).round() as usize {
        if step % every == 0 {
            stepper.observe(&mut seen);
            points.push((seen.X_WB[tool.body] * tool.X_BF).translation.vector);
        }
        stepper.step().unwrap();
    }
    (points, stepper.counts())
}

/// Returns the CPU time of the steps (s).
fn cost(plant: &Plant, kind: StepperKind, h: f64) -> f64 {
    let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).unwrap();
    let start = cpu_time::ThreadTime::now();
    for _ in 0..(DURATION / h).round() as usize {
        stepper.step().unwrap();
    }
    start.elapsed().as_secs_f64()
}

/// Returns the same points of the rigid arm.
fn rigid_path(plant: &Plant, count: usize) -> Vec<Vector3<f64>> {
    let (mut data, mut state) = (Data::new(&plant.model), State::zeros(&plant.model));
    let mut qddot = DVector::zeros(plant.model.nv());
    let place = |k: usize| {
        plant.prescribed_state(k as f64 * POINTS, &mut state, &mut qddot);
        forward_kinematics(&plant.model, &mut data, &state.q);
        data.X_WF(plant.model.frame("tcp").unwrap()).translation.vector
    };
    (0..count).map(place).collect()
}

fn main() {
    let plant = plant();
    let alpha = StepperKind::GeneralizedAlpha(AlphaSettings::default());
    let reference = StepperKind::Reference(ReferenceSettings::new(1e-12));
    let (truth, _) = path(&plant, reference, POINTS);
    let rigid = rigid_path(&plant, truth.len());
    let peak = truth.iter().zip(&rigid).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);

    let mut lines: Vec<(StepperKind, f64)> = Vec::new();
    lines.extend([20e-3, 10e-3, 5e-3, 2.5e-3, 2e-3, 1e-3, 0.5e-3, 0.25e-3].map(|h| (alpha, h)));
    lines.extend([16e-3, 8e-3].map(|h| (alpha, h)));
    let extrapolated = StepperKind::ExtrapolatedAlpha(ExtrapolatedAlpha::default());
    lines.extend([10e-3, 8e-3, 5e-3, 4e-3, 2.5e-3, 2e-3, 1e-3].map(|h| (extrapolated, h)));
    lines.extend([10e-3, 5e-3, 2.5e-3, 1e-3, 0.5e-3].map(|h| (StepperKind::Sdirk3, h)));
    lines.extend([1e-6, 1e-8].map(|rtol| (StepperKind::Reference(ReferenceSettings::new(rtol)), 10e-3)));
    let mut least = vec![f64::INFINITY; lines.len()];
    for _ in 0..5 {
        for (least, (kind, h)) in least.iter_mut().zip(&lines) {
            *least = least.min(cost(&plant, *kind, *h));
        }
    }
    println!(
        "{:<18} {:>8} {:>10} {:>10} {:>10} {:>12}",
        "stepper", "step ms", "error/peak", "eval/step", "factors", "CPU ms per s"
    );
    for ((kind, h), cost) in lines.iter().zip(&least) {
        let (points, counts) = path(&plant, *kind, *h);
        let stride = (h / POINTS).round().max(1.0) as usize;
        let error = points.iter().zip(truth.iter().step_by(stride)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        println!(
            "{:<18} {:>8} {:>10.1e} {:>10.2} {:>10} {:>12.3}",
            kind.name(),
            h * 1e3,
            error / peak,
            counts.evaluations as f64 / counts.steps as f64,
            counts.factorisations,
            cost * 1e3 / DURATION
        );
    }
}
