//! A user-defined observer that ends the run once the TCP has been at rest long enough.
//! `cargo run --release -p flexarm --no-default-features --example stop_at_rest`
//!
//! The observer receives every logged sample during the run and stores what it needs, here one
//! number.
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use std::ops::ControlFlow;

use flexarm::recordings::Sample;
use flexarm::{Error, Modelling, Motion, Robot, RunOptions, RunRequest};

/// Criterion of rest: distance of the TCP from its final position (m), and duration (s).
const NEAR_M: f64 = 2e-4;
const LONG_S: f64 = 0.25;

/// Distance of the TCP from its static position (m), which is caused by motion only.
fn ringing_m(sample: &Sample) -> f64 {
    let part = |c: usize| sample.error_world[c] - sample.static_m[c];
    (part(0).powi(2) + part(1).powi(2) + part(2).powi(2)).sqrt()
}

fn main() -> Result<(), Error> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    let robot = Robot::load(root.join("robots/kr210"))?;
    let motion = Motion::load(root.join("trajectories/point_to_point.toml"), &robot)?;
    let arm = robot.model(&Modelling::default())?;
    let (moves, whole) = (motion.trajectory.moves(), motion.trajectory.duration());
    let end_of_move = moves.last().map_or(0.0, |last| last.end);

    let (mut largest_m, mut restless_s) = (0.0_f64, 0.0);
    let mut observer = |sample: &Sample| {
        largest_m = largest_m.max(ringing_m(sample));
        if ringing_m(sample) > NEAR_M || sample.time_s < end_of_move {
            restless_s = sample.time_s;
        }
        if sample.time_s - restless_s < LONG_S { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let request = RunRequest { observer: Some(&mut observer), ..RunRequest::default() };
    let run = arm.simulate_with(&motion, &RunOptions::default(), request);
    match run {
        Err(Error::Interrupted { t, .. }) => println!("stopped at {t:.3} s of {whole} s"),
        Err(other) => return Err(other),
        Ok(_) => println!("the tool did not come to rest in {whole} s"),
    }
    println!("the motion shook the tool by {:.3} mm at most", 1e3 * largest_m);
    println!("it came within {:.2} mm of its place {:.3} s after the move", 1e3 * NEAR_M, restless_s - end_of_move);
    Ok(())
}
