//! Cost of long chains: an arm of two links, each a chain of elastic joints; set-up, and steps
//! without set-up.
//!
//! ```text
//! cargo run --release --example chains [STEPS] [JOINTS ...]
//! ```
//! Generalised-alpha with default settings at 1 ms; CPU time of one thread, minimum of five.
#![allow(non_snake_case, reason = "monogram notation")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::sync::Arc;

use cpu_time::ThreadTime;
use flexarm_kinematics::{ElasticAngles, Model};
use flexarm_stepping::*;
use flexarm_testkit::chain_arm;

/// Returns the arm; its joints oscillate.
fn plant(joints: usize) -> Plant {
    let chains = chain_arm(joints, 0, ElasticAngles::EulerZyx);
    let model = Arc::new(Model::new(&chains.mechanism).unwrap());
    let damping = Damping::StiffnessProportional(1e-3);
    let springs: Vec<_> = chains.K.iter().map(|K| ("spring".to_owned(), *K, damping)).collect();
    let motion = MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        for (k, q) in q.iter_mut().enumerate() {
            let (size, w) = (0.2 + 0.3 * k as f64, 3.0 + k as f64);
            let (s, c) = (w * t).sin_cos();
            (*q, v[k], a[k]) = (size * (w * t - s), size * w * (1.0 - c), size * w * w * s);
        }
    });
    Plant::new(model, springs, Arc::new(motion)).unwrap()
}

fn main() {
    let mut numbers = std::env::args().skip(1).map(|word| word.parse::<usize>().unwrap());
    let steps = numbers.next().unwrap_or(1000);
    let mut sizes: Vec<usize> = numbers.collect();
    if sizes.is_empty() {
        sizes = vec![1, 2, 4, 8, 16, 32];
    }
    println!(
        "{:>7} {:>12} {:>11} {:>9} {:>10} {:>8}",
        "joints", "coordinates", "set-up ms", "us/step", "eval/step", "factors"
    );
    for joints in sizes {
        let (mut set_up, mut stepping) = (f64::INFINITY, f64::INFINITY);
        let mut counts = Counts::default();
        let mut coordinates = 0;
        for _ in 0..5 {
            let start = ThreadTime::now();
            let plant = plant(joints);
            coordinates = plant.model.n_elastic();
            let alpha = StepperKind::GeneralizedAlpha(AlphaSettings::default());
            let mut stepper = new_stepper(alpha, plant, 1e-3, Start::Equilibrium).unwrap();
            set_up = set_up.min(start.elapsed().as_secs_f64());
            let start = ThreadTime::now();
            for _ in 0..steps {
                stepper.step().unwrap();
            }
            stepping = stepping.min(start.elapsed().as_secs_f64());
            counts = stepper.counts();
        }
        println!(
            "{joints:>7} {coordinates:>12} {:>11.3} {:>9.2} {:>10.3} {:>8}",
            set_up * 1e3,
            stepping * 1e6 / steps as f64,
            counts.evaluations as f64 / steps as f64,
            counts.factorisations
        );
    }
}
