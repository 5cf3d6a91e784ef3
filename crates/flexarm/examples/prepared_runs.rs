//! What a run of an arm that is built costs, set-up and steps apart:
//! `cargo run --release -p flexarm --no-default-features --example prepared_runs`
//!
//! CPU time of one thread, the smallest of nine runs. Set-up is what a run of one step at rest takes.
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use std::path::Path;

use cpu_time::ThreadTime;
use flexarm::{Arm, Error, Modelling, Motion, Robot, RunOptions};

const TIMES: usize = 9;

/// CPU time of a run (s), the smallest of some.
fn cost(arm: &Arm, motion: &Motion, options: &RunOptions) -> Result<f64, Error> {
    let mut least = f64::INFINITY;
    for _ in 0..TIMES {
        let start = ThreadTime::now();
        arm.simulate(motion, options)?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    Ok(least)
}

/// The first place of a motion, for the time of a step.
fn at_rest(motion: &Motion, robot: &Robot) -> Result<Motion, Error> {
    let joints = motion.trajectory.joints().len();
    let (mut q, mut rates) = (vec![0.0; joints], vec![0.0; 2 * joints]);
    let (v, a) = rates.split_at_mut(joints);
    motion.trajectory.sample(0.0, &mut q, v, a);
    Motion::from_samples(&[0.0, 0.5e-3, 1e-3], &[&q[..], &q, &q].concat(), robot)
}

fn main() -> Result<(), Error> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the checkout");
    println!("{:<16} {:>8} {:>12} {:>18} {:>12}", "robot", "step ms", "set-up us", "CPU ms per sim. s", "us per step");
    for (name, motion) in [("reference_arm", "reference_arm.toml"), ("kr210", "pick_and_place.toml")] {
        let robot = Robot::load(root.join("robots").join(name))?;
        let motion = Motion::load(root.join("trajectories").join(motion), &robot)?;
        let arm = robot.flexible(Modelling::default())?;
        let duration = motion.trajectory.duration();
        for step_s in [10e-3, 5e-3, 1e-3] {
            let options = RunOptions { step_s, ..RunOptions::default() };
            let whole = cost(&arm, &motion, &options)?;
            let set_up = cost(&arm, &at_rest(&motion, &robot)?, &RunOptions::default())?;
            let steps = duration / step_s;
            println!(
                "{name:<16} {:>8} {:>12.0} {:>18.3} {:>12.2}",
                1e3 * step_s,
                1e6 * set_up,
                1e3 * whole / duration,
                1e6 * (whole - set_up) / steps
            );
        }
    }
    Ok(())
}
