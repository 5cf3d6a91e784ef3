//! Time per step of many runs of the reference arm: individually and in parallel lanes.
//!
//! ```text
//! cargo run --release -p flexarm-stepping --example batch [RUNS]
//! ```
//! 4 s; stiffness and speed differ from run to run. CPU time of one thread including the start of
//! the runs, all lines in turn, minimum of five.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::sync::Arc;

use flexarm_kinematics::Model;
use flexarm_stepping::*;
use flexarm_testkit::{reference_arm, reference_motion};

fn runs(number: usize, duration_s: f64) -> Vec<BatchRun> {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let one = |k: usize| {
        let part = k as f64 / number as f64;
        let speed = 0.8 + 0.4 * part;
        let springs = reference
            .K_S
            .map(|stiffness| {
                ("spring".to_owned(), stiffness * (0.7 + 0.6 * part), Damping::StiffnessProportional(reference.beta))
            })
            .to_vec();
        let motion = MotionFn(move |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
            let (x, y, z) = reference_motion(speed * t);
            for k in 0..q.len() {
                (q[k], v[k], a[k]) = (x[k], speed * y[k], speed * speed * z[k]);
            }
        });
        BatchRun { arm: FlexibleArm::new(model.clone(), springs, Arc::new(motion)).unwrap(), duration_s }
    };
    (0..number).map(one).collect()
}

/// Returns the CPU time of one thread (s).
fn cost(work: impl FnOnce()) -> f64 {
    let start = cpu_time::ThreadTime::now();
    work();
    start.elapsed().as_secs_f64()
}

fn main() {
    let number = std::env::args().nth(1).map_or(32, |n| n.parse().unwrap());
    let (runs, begin) = (runs(number, 4.0), runs(number, 0.0));
    println!("{:>8} {:>10} {:>12} {:>12} {:>7}", "step ms", "start us", "alone us", "together us", "ratio");
    for step_s in [8e-3, 5e-3, 2.5e-3, 1e-3] {
        let tool = runs[0].arm.model.frame("tcp").unwrap().clone();
        let batch =
            Batch { step_s, stepper: StepperKind::default(), start: Start::Equilibrium, tool, keep_samples: false };
        let mut best = [f64::INFINITY; 3];
        for _ in 0..5 {
            let times = [
                cost(|| drop(batch.run(&begin))),
                cost(|| runs.iter().for_each(|run| drop(batch.run_alone(run).unwrap()))),
                cost(|| batch.run(&runs).into_iter().for_each(|run| drop(run.unwrap()))),
            ];
            best.iter_mut().zip(times).for_each(|(best, time)| *best = best.min(time));
        }
        let steps = number as f64 * (4.0 / step_s).round();
        let us = best.map(|time| 1e6 * time / steps);
        let start = 1e6 * best[0] / number as f64;
        println!("{:>8} {start:>10.1} {:>12.3} {:>12.3} {:>7.2}", 1e3 * step_s, us[1], us[2], us[1] / us[2]);
    }
}
