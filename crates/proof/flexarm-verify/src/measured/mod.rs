//! A measured robot, a KUKA KR 300 R2500 with 150 kg and motor and link encoders, compared with
//! inverse dynamics, gears, servos and frequencies.
//!
//! `recording` and `signal` prepare the recordings, `torques`, `gears`, `servo` and `frequencies`
//! compute findings, `page` writes them up.

mod frequencies;
mod gears;
mod page;
mod recording;
mod servo;
mod torques;

use crate::bench::Bench;
use crate::page::Case;
use crate::{Error, Pace};

use frequencies::Frequencies;
use gears::Gears;
use recording::{RUNS, Recording, STEP_S};
use servo::Servos;
use torques::Torques;

const ROBOT: &str = "robots/kr300/robot.toml";

/// Findings of the case.
struct Findings {
    torques: Torques,
    gears: Gears,
    /// Tracking in run 1.
    servos: Servos,
    frequencies: Frequencies,
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, pace: &mut Pace<'_>) -> Result<Case, Error> {
    let robot = bench.robot(ROBOT)?;
    let runs: Vec<Recording> = (1..=RUNS).map(|k| Recording::new(bench, &robot, k)).collect::<Result<_, _>>()?;
    pace.at(0.1);
    let torques = Torques::new(&robot, &runs)?;
    pace.at(0.2);
    let gears = Gears::new(&robot, &runs)?;
    pace.at(0.6);
    let servos = Servos::new(&robot, &runs[0])?;
    pace.at(0.9);
    let [home, there] = [0.0, 5.0].map(|t: f64| runs[0].at(&runs[0].q, (t / STEP_S).round() as usize));
    let frequencies = Frequencies::new(bench, &robot, &home, &there)?;
    Ok(page::page(&Findings { torques, gears, servos, frequencies }))
}
