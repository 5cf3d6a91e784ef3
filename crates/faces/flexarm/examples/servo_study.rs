//! Finds the gain of the position loops with the shortest settling time. One robot, one motion, one
//! run per gain on all cores:
//! `cargo run --release -p flexarm --no-default-features --example servo_study`
//!
//! All joints are driven by torque through elastic gears. A slow loop lags; a fast one excites the
//! arm.
#![allow(clippy::print_stdout, reason = "an example shows its answer")]

use flexarm::runs::TcpFigures;
use flexarm::{DriveModel, Error, Modelling, Motion, Robot, RunOptions};

/// Gains of the position loops (1/s).
const GAINS: [f64; 6] = [5.0, 10.0, 20.0, 40.0, 80.0, 160.0];

/// TCP figures with all position loops at a gain (1/s).
fn tool(robot: &Robot, motion: &Motion, gain: f64) -> Result<TcpFigures, Error> {
    let mut tuned = robot.clone();
    for drive in &mut tuned.drives {
        drive.servo.position_gain = Some(gain);
    }
    let arm = tuned.model(&Modelling { drives: DriveModel::Servo, ..Modelling::default() })?;
    let run = arm.simulate(motion, &RunOptions { settling_band_m: 1e-3, ..RunOptions::default() })?;
    Ok(run.summary.tcp.unwrap_or_default())
}

fn main() -> Result<(), Error> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the checkout");
    let robot = Robot::load(root.join("robots/manutec_r3"))?;
    let motion = Motion::load(root.join("trajectories/manutec_r3.toml"), &robot)?;
    let found: Vec<Result<TcpFigures, Error>> = std::thread::scope(|scope| {
        let (robot, motion) = (&robot, &motion);
        let runs: Vec<_> = GAINS.into_iter().map(|gain| scope.spawn(move || tool(robot, motion, gain))).collect();
        runs.into_iter().map(|run| run.join().expect("a run does not panic")).collect()
    });
    println!("gain [1/s]   settled within 1 mm [s]   overshoot [mm]   largest error [mm]");
    for (gain, tcp) in GAINS.into_iter().zip(found) {
        let tcp = tcp?;
        let settled = tcp.settling_s.map_or_else(|| "not".to_owned(), |s| format!("{s:.3}"));
        println!("{gain:>10} {settled:>25} {:>16.2} {:>20.2}", 1e3 * tcp.overshoot_m, 1e3 * tcp.peak_m);
    }
    Ok(())
}
