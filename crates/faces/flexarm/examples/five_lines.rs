//! Load, run, print: `cargo run --release -p flexarm --no-default-features --example five_lines`
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use flexarm::{Error, Modelling, Motion, Robot, RunOptions};

fn main() -> Result<(), Error> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    let robot = Robot::load(root.join("robots/kr210"))?;
    let motion = Motion::load(root.join("trajectories/pick_and_place.toml"), &robot)?;
    let run = robot.model(&Modelling::default())?.simulate(&motion, &RunOptions::default())?;
    println!("{}", run.summary.headline);
    Ok(())
}
