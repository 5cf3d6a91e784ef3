//! Finds the parameters with the strongest effect: derivatives of the TCP error along a motion with
//! respect to all parameters of the robot, from two runs for each:
//! `cargo run --release -p flexarm --no-default-features --example sensitivity`
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use flexarm::sensitivity::{SensitivityRequest, sensitivity};
use flexarm::{Error, Motion, Robot};

fn main() -> Result<(), Error> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    let robot = Robot::load(root.join("robots/kr210"))?;
    let motion = Motion::load(root.join("trajectories/pick_and_place.toml"), &robot)?;
    let found = sensitivity(&robot, &motion, &SensitivityRequest::default())?;
    println!("RMS error {:.3} mm, {} numbers", 1e3 * found.rms_m, found.parameters.len());
    for own in found.parameters.iter().take(5) {
        println!("{:>+9.3} um per {:<6} more of {}", 1e6 * own.rms_m, own.per, own.name);
    }
    Ok(())
}
