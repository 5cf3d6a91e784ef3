//! A study of many runs of one arm on all cores: payload, stiffness, damping and speed vary.
//!
//! ```text
//! cargo run --release -p flexarm --no-default-features --example many_runs [RUNS]
//! ```
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use std::path::Path;
use std::time::Instant;

use flexarm::runs::Variation;
use flexarm::{Error, Modelling, Motion, PayloadChange, Robot, RunOptions, Scenario};

fn main() -> Result<(), Error> {
    let number: u32 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(400);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    println!(
        "{:<16} {:>8} {:>6} {:>10} {:>14} {:>12} {:>12}",
        "robot", "step ms", "runs", "wall s", "us a run-step", "least mm", "largest mm"
    );
    for (name, file) in [("test/reference_arm", "reference_arm.toml"), ("kr210", "pick_and_place.toml")] {
        let robot = Robot::load(root.join("robots").join(name))?;
        let motion = Motion::load(root.join("trajectories").join(file), &robot)?;
        let arm = robot.model(&Modelling::default())?;
        let run = |k: u32| -> Result<Variation, Error> {
            let part = f64::from(k) / f64::from(number);
            let slower = Motion::along(motion.trajectory.scaled(1.0 + 0.2 * part)?, file, &robot)?;
            let payload = PayloadChange::attach(0.0, 1.0 + 4.0 * part, [0.0, 0.0, 0.05].into());
            let scenario = Scenario::new(slower).with_payload(payload);
            Ok(Variation::new(scenario).with_stiffness(0.8 + 0.4 * part).with_damping(1.5 - part))
        };
        let runs = (0..number).map(run).collect::<Result<Vec<_>, Error>>()?;
        for step_s in [5e-3, 1e-3] {
            let options = RunOptions { step_s, ..RunOptions::default() };
            let start = Instant::now();
            let found =
                arm.deflections(&runs, &options, false, &|| false).into_iter().collect::<Result<Vec<_>, Error>>()?;
            let wall = start.elapsed().as_secs_f64();
            let steps: u64 = found.iter().map(|run| run.steps).sum();
            let peaks = found.iter().map(|run| 1e3 * run.peak_m);
            let (least, largest) = peaks.fold((f64::INFINITY, 0.0f64), |(a, b), peak| (a.min(peak), b.max(peak)));
            let us = 1e6 * wall / steps as f64;
            println!(
                "{name:<16} {:>8} {number:>6} {wall:>10.3} {us:>14.3} {least:>12.4} {largest:>12.4}",
                1e3 * step_s
            );
        }
    }
    Ok(())
}
