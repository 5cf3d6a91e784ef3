//! Cost of a run of a prepared arm, separately for set-up and steps:
//! `cargo run --release -p flexarm --no-default-features --example prepared_runs`
//!
//! CPU time of one thread, the minimum of nine runs. Set-up is the time of a run of one step at
//! rest.
//!
//! With arguments `STEPPER:STEP ...` (step size in s; for `reference` the relative tolerance),
//! prints a line for each with the CPU ms per simulated second of the reference arm: for a run with
//! samples only at its start and end, and for one with 100 samples per second and the rigid twin.
//! `tools/peers.py` compares these with other programs.
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use std::path::Path;

use cpu_time::ThreadTime;
use flexarm::steppers::{ReferenceSettings, STEPPERS, StepperOptions};
use flexarm::{Arm, Error, Keep, Modelling, Motion, Robot, RunOptions, RunRequest};

const TIMES: usize = 9;

/// CPU time of a run (s), the minimum of several.
fn cost(mut run: impl FnMut() -> Result<(), Error>) -> Result<f64, Error> {
    let mut least = f64::INFINITY;
    for _ in 0..TIMES {
        let start = ThreadTime::now();
        run()?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    Ok(least)
}

fn figures(arm: &Arm, motion: &Motion, options: &RunOptions) -> Result<(), Error> {
    arm.simulate_with(motion, options, RunRequest::keeping(Keep::Figures)).map(drop)
}

fn columns(arm: &Arm, motion: &Motion, options: &RunOptions) -> Result<f64, Error> {
    cost(|| arm.simulate(motion, options).map(drop))
}

/// Parses the options of `STEPPER:STEP`.
fn told(line: &str) -> Option<RunOptions> {
    let (name, step) = line.split_once(':')?;
    let (entry, step) = (STEPPERS.iter().find(|entry| entry.name == name)?, step.parse().ok()?);
    let default = RunOptions::default();
    Some(match name {
        "reference" => {
            let settings = StepperOptions { reference: ReferenceSettings::new(step), ..StepperOptions::default() };
            RunOptions { stepper: (entry.with)(&settings), ..default }
        }
        _ => RunOptions { stepper: (entry.with)(&StepperOptions::default()), step_s: step, ..default },
    })
}

/// Prints a line with CPU ms per simulated second for each argument.
fn lines(root: &Path, wanted: &[String]) -> Result<(), Error> {
    let robot = Robot::load(root.join("robots/test/reference_arm"))?;
    let motion = Motion::load(root.join("trajectories/reference_arm.toml"), &robot)?;
    let arm = robot.model(&Modelling::default())?;
    for line in wanted {
        match told(line) {
            Some(options) => {
                let duration = motion.trajectory.duration();
                let mut spent = [0.0; 2];
                for (spent, log_rate_hz) in spent.iter_mut().zip([1.0 / duration, 100.0]) {
                    let options = RunOptions { log_rate_hz, ..options.clone() };
                    *spent = 1e3 * cost(|| figures(&arm, &motion, &options))? / duration;
                }
                println!("{line} {:.4} {:.4}", spent[0], spent[1]);
            }
            None => println!("{line} is no STEPPER:STEP"),
        }
    }
    Ok(())
}

/// Returns a motion that rests at the first position, with the duration of one step.
fn at_rest(motion: &Motion, robot: &Robot) -> Result<Motion, Error> {
    let joints = motion.trajectory.joints().len();
    let (mut q, mut rates) = (vec![0.0; joints], vec![0.0; 2 * joints]);
    let (v, a) = rates.split_at_mut(joints);
    motion.trajectory.sample(0.0, &mut q, v, a);
    Motion::from_samples(&[0.0, 0.5e-3, 1e-3], &[&q[..], &q, &q].concat(), robot)
}

fn main() -> Result<(), Error> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if !wanted.is_empty() {
        return lines(root, &wanted);
    }
    println!("{:<16} {:>8} {:>12} {:>18} {:>12}", "robot", "step ms", "set-up us", "CPU ms per sim. s", "us per step");
    for (name, motion) in [("test/reference_arm", "reference_arm.toml"), ("kr210", "pick_and_place.toml")] {
        let robot = Robot::load(root.join("robots").join(name))?;
        let motion = Motion::load(root.join("trajectories").join(motion), &robot)?;
        let arm = robot.model(&Modelling::default())?;
        let duration = motion.trajectory.duration();
        for step_s in [10e-3, 5e-3, 1e-3] {
            let options = RunOptions { step_s, ..RunOptions::default() };
            let whole = columns(&arm, &motion, &options)?;
            let set_up = columns(&arm, &at_rest(&motion, &robot)?, &RunOptions::default())?;
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
