//! Parameters of servo-controlled joints: friction, gains, and the controllers' knowledge of the
//! arm.

use flexarm_identify::{Effect, RunParameter};
use flexarm_kinematics::{Model, SpatialInertia};
use flexarm_stepping::{AxisSlope, FlexibleArm, Friction, RunSlopes, ServoAxis};
use nalgebra::DVector;

use super::NamedParameter;
use flexarm_run::Arm;
use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::Scenario;
use flexarm_run::robot::PAYLOAD_LINK;

/// Step sizes for the finite differences of gains by a mass (kg) or a joint position (rad or m);
/// the gains are smooth functions of both.
const MASS_STEP: f64 = 0.02;
const JOINT_STEP: f64 = 2e-3;

/// Adds friction and gains of servo-controlled joints, and accounts for the controllers' reaction
/// to masses and motions.
pub(super) fn add_controllers(arm: &Arm, scenario: &Scenario, all: &mut Vec<NamedParameter>) -> Result<(), Error> {
    let flexible = arm.flexible();
    if !flexible.has_servo() {
        return Ok(());
    }
    let unloaded = flexible.arm(scenario.motion.prescribed()).map_err(|error| flexible.explained(error))?;
    let n = unloaded.model.n_actuated();
    let mut start = DVector::zeros(n);
    let (mut rates, mut accelerations) = (vec![0.0; n], vec![0.0; n]);
    unloaded.motion.sample(0.0, start.as_mut_slice(), &mut rates, &mut accelerations);
    for named in &mut *all {
        follow(arm, named, &start);
    }
    let Some(servo) = &unloaded.servo else { return Ok(()) };
    for (number, axis) in servo.axes.iter().enumerate() {
        let joint = &unloaded.model.coordinates()[axis.coordinate];
        let slides = joint.slides();
        all.extend(friction_of(&unloaded, axis.coordinate, &joint.joint, slides));
        all.extend(gains_of(axis, number, &joint.joint, slides));
    }
    Ok(())
}

/// Makes the controllers follow a mass or a motion parameter: the rigid model of the feed-forward
/// carries the mass too, and gains not set in the robot file follow the inertia at the start.
fn follow(arm: &Arm, named: &mut NamedParameter, start: &DVector<f64>) {
    let flexible = arm.flexible();
    let (mut fed_forward, gains) = (
        Vec::new(),
        match &named.parameter {
            RunParameter::Arm(parameter) => {
                let Effect::Mass { body, per_kg } = &parameter.effect else { return };
                let own = rigid_mass(&flexible.rigid);
                flexible.gain_slopes(MASS_STEP, |kg| {
                    let rigid = own
                        .map_or_else(|| (*flexible.rigid).clone(), |(k, own)| carrying(&flexible.rigid, k, &own, kg));
                    (carrying(&flexible.model, *body, per_kg, kg), rigid, start.clone())
                })
            }
            RunParameter::Joint(k) => flexible.gain_slopes(JOINT_STEP, |shift| {
                let mut at = start.clone();
                at[*k] += shift;
                ((*flexible.model).clone(), (*flexible.rigid).clone(), at)
            }),
            _ => return,
        },
    );
    if matches!(named.parameter, RunParameter::Arm(_)) {
        fed_forward.extend(rigid_mass(&flexible.rigid));
    }
    let parameter = Box::new(named.parameter.clone());
    named.parameter = RunParameter::Followed { parameter, fed_forward, gains };
}

/// Returns caveats about servos that reached their limits in a differentiated run.
pub(super) fn limited(arm: &Arm, found: &RunSlopes) -> Vec<Caveat> {
    let joints: Vec<&str> = arm.joints().collect();
    let caveat = |own: &flexarm_stepping::TorqueLimited| {
        let joint = joints[own.coordinate];
        let text = format!(
            "the servo of joint {joint:?} is at its torque limit in {} samples, first at {:.4} s: the derivatives \
             are valid as long as the same samples are saturated; if another sample saturates, the servo integral \
             jumps",
            own.samples, own.first_s
        );
        Caveat::from_message(
            "servo-limit",
            format!("joint {joint:?}"),
            text,
            "slow the motion down where it is fastest",
        )
    };
    found.limited.iter().map(caveat).collect()
}
/// Returns the body of the rigid robot's payload, and the inertia of a kilogram there.
fn rigid_mass(rigid: &Model) -> Option<(usize, SpatialInertia)> {
    let frame = rigid.frame(PAYLOAD_LINK)?;
    let point = SpatialInertia { mass: 1.0, ..SpatialInertia::zeros() };
    Some((frame.body, point.at_parent(&frame.X_BF)))
}

/// Returns a model with `kg` times the inertia `per_kg` added to a body.
fn carrying(model: &Model, body: usize, per_kg: &SpatialInertia, kg: f64) -> Model {
    let mut inertia = model.bodies()[body].inertia;
    inertia += SpatialInertia {
        mass: kg * per_kg.mass,
        first_moment: kg * per_kg.first_moment,
        rotational: kg * per_kg.rotational,
    };
    model.with_inertia(body, inertia)
}

/// Returns the nonzero friction parameters of a joint, each per 1 % of its value.
fn friction_of(arm: &FlexibleArm, coordinate: usize, joint: &str, slides: bool) -> Vec<NamedParameter> {
    let Some(law) = arm.friction.get(coordinate) else { return Vec::new() };
    let [torque, damping, speed] = if slides { ["N", "N s/m", "m/s"] } else { ["N m", "N m s/rad", "rad/s"] };
    let none = Friction { viscous: 0.0, coulomb: 0.0, stribeck: 0.0, stribeck_velocity: 0.0, regularisation: 0.0 };
    let mut found = Vec::new();
    let mut add = |key: &str, unit: &str, value: f64, by: Friction, acts: bool| {
        if value != 0.0 && acts {
            found.push(NamedParameter {
                name: format!("drive.{joint}.friction.{key}"),
                unit: unit.into(),
                value,
                per: "1 %",
                scale: 0.01,
                parameter: RunParameter::Friction(coordinate, by),
            });
        }
    };
    let dry = law.coulomb != 0.0 || law.stribeck != 0.0;
    add("viscous", damping, law.viscous, Friction { viscous: law.viscous, ..none }, true);
    add("coulomb", torque, law.coulomb, Friction { coulomb: law.coulomb, ..none }, true);
    add("stribeck", torque, law.stribeck, Friction { stribeck: law.stribeck, ..none }, true);
    let by = Friction { stribeck_velocity: law.stribeck_velocity, ..none };
    add("stribeck_velocity", speed, law.stribeck_velocity, by, law.stribeck != 0.0);
    let by = Friction { regularisation: law.regularisation, ..none };
    add("regularisation", speed, law.regularisation, by, dry);
    found
}

/// Returns the nonzero gains and the feed-forward of a servo, each per 1 % of its value.
fn gains_of(axis: &ServoAxis, number: usize, joint: &str, slides: bool) -> Vec<NamedParameter> {
    let (damping, stiffness) = if slides { ("N s/m", "N/m") } else { ("N m s/rad", "N m/rad") };
    let ahead = f64::from(u8::from(axis.feed_forward));
    let none = AxisSlope::default();
    let all = [
        ("position_gain", "1/s", axis.position_gain, AxisSlope { position_gain: axis.position_gain, ..none }),
        ("velocity_gain", damping, axis.velocity_gain, AxisSlope { velocity_gain: axis.velocity_gain, ..none }),
        ("integral_gain", stiffness, axis.integral_gain, AxisSlope { integral_gain: axis.integral_gain, ..none }),
        ("feed_forward", "1", ahead, AxisSlope { feed_forward: ahead, ..none }),
    ];
    let named = |(key, unit, value, by): (&str, &str, f64, AxisSlope)| NamedParameter {
        name: format!("drive.{joint}.servo.{key}"),
        unit: unit.into(),
        value,
        per: "1 %",
        scale: 0.01,
        parameter: RunParameter::Servo(number, by),
    };
    all.into_iter().filter(|(_, _, value, _)| *value != 0.0).map(named).collect()
}
