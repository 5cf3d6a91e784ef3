//! Lowest natural frequencies with held motors: the share of the recorded vibration that gear
//! elasticity explains.

use flexarm::{DriveModel, Modelling, Robot, Wrench};

use super::recording::WITH_ENCODER;
use crate::Error;
use crate::bench::{Bench, Worst};

/// Gear stiffness of axes 1 to 3 in the source (N m/rad).
const SOURCE: [f64; WITH_ENCODER] = [4_577_800.0, 7_518_900.0, 4_099_900.0];
/// Frequencies of these springs with rigid links at the home pose and 5 s into run 1, from the mass
/// matrix of Pinocchio 3 (`pin.crba`, URDF with the load) without gravity (Hz, two decimals).
const PINOCCHIO_HZ: [[f64; 3]; 2] = [[12.10, 12.90, 24.76], [9.88, 13.39, 35.08]];
/// Lowest vibration in the recordings while axis 1 moves, runs 1 and 3; there the link encoder
/// moves five times as far as the motor (Hz).
pub(super) const MEASURED_HZ: [f64; 2] = [5.9, 6.3];
/// A robot of the same class whose wrist gears were identified.
pub(super) const WRIST: &str = "robots/kr500_identified/robot.toml";

/// One set of springs at both poses.
pub(super) struct Set {
    pub(super) what: String,
    /// Lowest frequencies, home pose and 5 s into run 1 (Hz).
    pub(super) hz: [Vec<f64>; 2],
}

pub(super) struct Frequencies {
    pub(super) sets: Vec<Set>,
    /// Maximum relative difference of the first set from Pinocchio's mass matrix.
    pub(super) error: f64,
}

impl Frequencies {
    /// * `there`: joint positions 5 s into run 1 (rad).
    pub(super) fn new(bench: &Bench, robot: &Robot, home: &[f64], there: &[f64]) -> Result<Self, Error> {
        let weightless = |mut robot: Robot| {
            robot.rigid.gravity.fill(0.0);
            robot.rigid.balancers.clear();
            robot
        };
        let wrist = bench.robot(WRIST)?;
        let source = with_stiffness(robot, &SOURCE);
        let kinds = [
            ("gears of axes 1 to 3 as the source has them, no weight", weightless(source)),
            ("gears of axes 1 to 3 as in `robots/kr300`", robot.clone()),
            ("and wrist gears as identified on a KR 500", with_wrist(robot, &wrist)),
        ];
        let sets = kinds.into_iter().map(|(what, robot)| {
            let arm = robot.model(&Modelling { drives: DriveModel::Elastic, ..Modelling::default() })?;
            let mut at = arm.operating_point()?;
            let mut hz = |q: &[f64]| -> Result<Vec<f64>, Error> {
                at.solve(q, &Wrench::zeros()).map_err(crate::bench::step_error)?;
                Ok(at.frequencies_hz().iter().take(3).copied().collect())
            };
            Ok(Set { what: what.to_owned(), hz: [hz(home)?, hz(there)?] })
        });
        let sets: Vec<Set> = sets.collect::<Result<_, Error>>()?;
        let pairs = sets[0].hz.iter().zip(&PINOCCHIO_HZ).flat_map(|(found, truth)| found.iter().zip(truth));
        let error = pairs.map(|(found, truth)| found / truth - 1.0).worst();
        Ok(Self { sets, error })
    }
}

fn with_stiffness(robot: &Robot, stiffness: &[f64]) -> Robot {
    let mut robot = robot.clone();
    for (drive, k) in robot.drives.iter_mut().zip(stiffness) {
        if let Some((gear, _)) = &mut drive.gearbox {
            gear.stiffness = flexarm_flexlink::GearStiffness::Axis(*k);
        }
    }
    robot
}

/// Returns the robot with the wrist gears of another.
fn with_wrist(robot: &Robot, other: &Robot) -> Robot {
    let mut robot = robot.clone();
    for (drive, other) in robot.drives.iter_mut().zip(&other.drives).skip(WITH_ENCODER) {
        drive.kind = other.kind;
        drive.gearbox.clone_from(&other.gearbox);
        if let Some((gear, _)) = &mut drive.gearbox {
            gear.joint.clone_from(&drive.joint);
        }
    }
    robot
}
