//! Parameters of servo-controlled joints: friction and gains.
//!
//! Start at [`add_controllers`]. Only values that act have a slope: zeros are left out, since 1 % of
//! zero is no change. Not here: the derivatives (`slopes.rs`), parameters of the robot file (`lib.rs`).

use std::sync::Arc;

use flexarm_run::{Arm, Error, Finding, Scenario};
use flexarm_stepping::{Plant, ServoAxis, TorqueLimited};

use super::slopes::{OfAxis, OfFriction};
use super::{NamedParameter, RunParameter, RunSlopes};

/// Adds friction and gains of servo-controlled joints.
pub(super) fn add_controllers(arm: &Arc<Arm>, scenario: &Scenario, all: &mut Vec<NamedParameter>) -> Result<(), Error> {
    if !arm.has_servo() {
        return Ok(());
    }
    let unloaded = arm.plant(scenario.motion.prescribed()).map_err(|error| arm.explained(error))?;
    let Some(servo) = &unloaded.servo else { return Ok(()) };
    for (number, axis) in servo.axes.iter().enumerate() {
        let joint = &unloaded.model.coordinates()[axis.coordinate];
        let slides = joint.slides();
        all.extend(friction_of(&unloaded, axis.coordinate, &joint.joint, slides));
        all.extend(gains_of(axis, number, &joint.joint, slides));
    }
    Ok(())
}

/// Returns caveats about servos that reached their limits in a differentiated run.
pub(super) fn limited(arm: &Arc<Arm>, found: &RunSlopes) -> Vec<Finding> {
    let joints: Vec<&str> = arm.joints().collect();
    let caveat = |own: &TorqueLimited| {
        let joint = joints[own.coordinate];
        let text = format!(
            "the servo of joint {joint:?} is at its torque limit in {} samples, first at {:.4} s: the derivatives \
             are valid as long as the same samples are saturated; if another sample saturates, the servo integral \
             jumps",
            own.samples, own.first_s
        );
        Finding::warning("servo-limit", format!("joint {joint:?}"), text, "slow the motion down where it is fastest")
    };
    found.limited.iter().map(caveat).collect()
}

/// Returns the nonzero friction parameters of a joint, each per 1 % of its value.
fn friction_of(plant: &Plant, coordinate: usize, joint: &str, slides: bool) -> Vec<NamedParameter> {
    let Some(law) = plant.friction.get(coordinate) else { return Vec::new() };
    let [torque, damping, speed] = if slides { ["N", "N s/m", "m/s"] } else { ["N m", "N m s/rad", "rad/s"] };
    let dry = law.coulomb != 0.0 || law.stribeck != 0.0;
    let all: [(&str, &str, f64, OfFriction, bool); 5] = [
        ("viscous", damping, law.viscous, |law| &mut law.viscous, true),
        ("coulomb", torque, law.coulomb, |law| &mut law.coulomb, true),
        ("stribeck", torque, law.stribeck, |law| &mut law.stribeck, true),
        ("stribeck_velocity", speed, law.stribeck_velocity, |law| &mut law.stribeck_velocity, law.stribeck != 0.0),
        ("regularisation", speed, law.regularisation, |law| &mut law.regularisation, dry),
    ];
    let acting = all.into_iter().filter(|(_, _, value, _, acts)| *acts && *value != 0.0);
    let named = |(key, unit, value, of, _): (&str, &str, f64, OfFriction, bool)| NamedParameter {
        name: format!("drive.{joint}.friction.{key}"),
        unit: unit.into(),
        value,
        per: "1 %",
        scale: 0.01,
        parameter: RunParameter::Friction(coordinate, of),
    };
    acting.map(named).collect()
}

/// Returns the nonzero gains and the feed-forward of a servo, each per 1 % of its value.
fn gains_of(axis: &ServoAxis, number: usize, joint: &str, slides: bool) -> Vec<NamedParameter> {
    let (damping, stiffness) = if slides { ("N s/m", "N/m") } else { ("N m s/rad", "N m/rad") };
    let all: [(&str, &str, f64, OfAxis); 4] = [
        ("position_gain", "1/s", axis.position_gain, |axis| &mut axis.position_gain),
        ("velocity_gain", damping, axis.velocity_gain, |axis| &mut axis.velocity_gain),
        ("integral_gain", stiffness, axis.integral_gain, |axis| &mut axis.integral_gain),
        ("feed_forward", "1", axis.feed_forward, |axis| &mut axis.feed_forward),
    ];
    let named = |(key, unit, value, of): (&str, &str, f64, OfAxis)| NamedParameter {
        name: format!("drive.{joint}.servo.{key}"),
        unit: unit.into(),
        value,
        per: "1 %",
        scale: 0.01,
        parameter: RunParameter::Servo(number, of),
    };
    all.into_iter().filter(|(_, _, value, _)| *value != 0.0).map(named).collect()
}
