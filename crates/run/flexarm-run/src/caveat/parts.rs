//! Caveats about TCP, payload, gravity, masses and limits, judged by the size of the robot.
//!
//! Start at [`of_robot`]. Thresholds are multiples of the arm's reach, mass and weight ([`Size`]), so
//! that they hold for small arms and cranes. Not here: which link carries TCP and payload
//! (`chain.rs`), drives and flexible links.

use flexarm_kinematics::{Joint, Link, LinkInertia, Mechanism, Model};
use flexarm_linkmaker::yardsticks::OSMIUM;
use nalgebra::Vector3;

use super::size::{Size, gyration, inertia_moved, least_density, weight_carried};
use super::slip::{self, slip};
use super::{Finding, kinds};
use crate::robot::{PAYLOAD_LINK, Robot};

/// Distance of a TCP or payload from its link that is out of reach: multiple of the robot's size,
/// and minimum (m).
const FAR: (f64, f64) = (1.5, 2.0);
/// Maximum length of an arm (m); concrete pumps reach 70 m.
const LONGEST: f64 = 100.0;
/// Maximum distance of a joint from its parent, relative to that of all other joints together.
const MAX_DISTANCE_RATIO: f64 = 20.0;
/// Maximum plausible angle in a file (rad): one turn.
const TURN: f64 = std::f64::consts::TAU;
/// Payload mass relative to the robot's mass: implausible, unusual.
const PAYLOAD_SHARE: (f64, f64) = (3.0, 1.0);
/// Factor on the same without gravity: the arm of the space shuttle moved 70 times its mass.
const WEIGHTLESS: f64 = 30.0;
/// Mass above which a payload is not a point mass (kg).
const POINT_MASS: f64 = 10.0;
/// Joint speed (rad/s) and tip speed (m/s) above which limits are probably in degrees per second.
const FAST: (f64, f64) = (30.0, 120.0);
/// Joint speed that no robot has (rad/s); the fastest SCARA and delta robots have 45.
const FASTEST: f64 = 50.0;
/// Speed of the tip (m/s) that the speed limit of a joint allows at most; delta robots have 10.
const SWEEP: f64 = 40.0;
/// Speed limit (rad/s) of the fastest joint of an arm that is shorter than a crane (m).
const SLOWEST: (f64, f64) = (0.1, 10.0);
/// Minimum range of a joint (rad), unless few joints have less.
const NARROW: f64 = 0.15;
/// Maximum effort limit relative to the largest gravity torque.
const STRONG: f64 = 300.0;
/// Maximum tip acceleration from an effort limit (m/s²).
const TIP_ACCELERATION: f64 = 5e4;
/// Gravity on the moon, on Mars and on earth (m/s²).
const GRAVITIES: [(f64, &str); 3] = [(1.62, "on the moon"), (3.71, "on Mars"), (9.81, "")];

/// Returns all of these caveats about a loaded robot.
pub(crate) fn of_robot(robot: &Robot) -> Vec<Finding> {
    let mechanism = &robot.urdf.mechanism;
    let size = Size::of(mechanism);
    let mut caveats: Vec<Finding> = distances(mechanism, &size).collect();
    caveats.extend(bodies(mechanism, &size));
    caveats.extend(gravity(&robot.rigid.gravity));
    let tool = robot.tcp.1.translation.vector.norm();
    caveats.extend(far("the TCP", tool, &size));
    let joint = robot.rigid.joints.iter().find(|j| j.child == PAYLOAD_LINK);
    if let (Some(joint), Some(inertia)) = (joint, robot.rigid.link(PAYLOAD_LINK).and_then(|l| l.inertia)) {
        let carried = LinkInertia { com: joint.X_PJ.translation.vector, ..inertia };
        let weighs = robot.rigid.gravity.norm() > 0.0;
        caveats.extend(payload("the payload", &carried, &size, weighs));
    }
    caveats.extend(super::chain::of_chain(robot, &size));
    caveats.extend(joint_limits(mechanism, &size));
    if let Ok(model) = robot.rigid_model() {
        caveats.extend(strong_drives(&model, &size));
    }
    caveats
}

/// Checks for angles of more than a turn (rad).
pub(crate) fn angles(of: &str, values: &[f64]) -> Option<Finding> {
    let largest = values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let caveat = || kinds::ANGLE.found(of, largest, TURN);
    (largest > TURN + 1e-9).then(|| caveat().likely(slip(largest, &(0.0..=TURN), slip::ANGLE, 1.0)))
}

/// Checks for a distance from the link larger than the size of the robot.
fn far(what: &str, distance: f64, size: &Size) -> Option<Finding> {
    let limit = (FAR.0 * size.extent).max(FAR.1);
    let caveat = || kinds::FAR.found(what, distance, size.extent);
    (distance > limit).then(|| caveat().likely(slip(distance, &(0.0..=limit), slip::LENGTH, 1.0)))
}

/// Checks for joints farther apart than any real arm is long, or than the rest of this arm
/// suggests.
fn distances<'a>(mechanism: &'a Mechanism, size: &'a Size) -> impl Iterator<Item = Finding> + 'a {
    let length = |j: &Joint| j.X_PJ.translation.vector.norm();
    let all: f64 = mechanism.joints.iter().map(length).sum();
    let unusual = mechanism.joints.iter().filter_map(move |joint| {
        let (own, others) = (length(joint), all - length(joint));
        let sound = 0.0..=others.max(1.0);
        let is_far = own > LONGEST || (others > 1e-3 && own > MAX_DISTANCE_RATIO * others && own > FAR.1);
        let caveat = || kinds::JOINT_DISTANCE.found(format!("joint {:?}", joint.name), own, others);
        is_far.then(|| caveat().likely(slip(own, &sound, slip::LENGTH, 1.0)))
    });
    let long = || kinds::SIZE.found("the arm", size.extent, LONGEST);
    let long = (size.extent > LONGEST).then(|| long().likely(slip(size.extent, &(0.05..=30.0), slip::LENGTH, 1.0)));
    unusual.chain(long)
}

/// Checks masses and inertias: radius of gyration against the size of the arm, density against that
/// of osmium.
fn bodies(mechanism: &Mechanism, size: &Size) -> Vec<Finding> {
    let with_mass = || {
        let inertia_of = |l: &Link| l.inertia.filter(|i| i.mass > 0.0).map(|i| (l.name.clone(), i));
        mechanism.links.iter().filter_map(inertia_of)
    };
    let far_out = with_mass().map(|(name, i)| size.at(&name) + i.com.norm()).fold(0.0, f64::max);
    let mut caveats = Vec::new();
    // Only the worst link is reported: a wrong unit usually applies to the whole file.
    let widest = with_mass().map(|(name, i)| (gyration(&i), name)).max_by(|a, b| a.0.total_cmp(&b.0));
    let limit = if far_out > 0.0 { 2.0 * far_out } else { LONGEST };
    if let Some((radius, name)) = widest.filter(|(radius, _)| *radius > limit) {
        let caveat = kinds::INERTIA.found(format!("link {name:?}"), radius, far_out);
        caveats.push(caveat.likely(slip(radius, &(0.0..=0.5 * limit), slip::INERTIA, 0.5)));
    }
    let dense: Vec<_> = with_mass().filter(|(_, i)| gyration(i) > 0.0 && least_density(i) > OSMIUM).collect();
    let share = dense.iter().map(|(_, i)| i.mass).sum::<f64>() / size.mass;
    if let Some((name, inertia)) = dense.iter().max_by(|a, b| a.1.mass.total_cmp(&b.1.mass)) {
        let density = least_density(inertia);
        let caveat = kinds::DENSITY.found(format!("link {name:?}"), density, OSMIUM);
        // A few point masses among bodies are an accepted placeholder for unknown inertias.
        let likely = slip(density, &(20.0..=OSMIUM), slip::MASS, 1.0);
        caveats.push(if share > 0.5 { caveat.likely(likely) } else { caveat.as_note() });
    }
    caveats
}

/// Checks the magnitude and the direction of gravity.
pub(crate) fn gravity(g: &Vector3<f64>) -> Option<Finding> {
    let size = g.norm();
    let near = |(place, _): &&(f64, &str)| (size / place - 1.0).abs() < 0.03;
    match GRAVITIES.iter().find(near) {
        _ if size == 0.0 => Some(kinds::GRAVITY.found("gravity", 0.0, 9.81).as_note()),
        Some((_, "")) if g.z < -0.99 * size => None,
        Some((_, "")) => {
            let way = if g.z > 0.99 * size { "upwards: the arm hangs from a ceiling" } else { "not along -z" };
            let message = format!("gravity points {way} in the axes of the base");
            Some(Finding { value: Some(g.z), yardstick: Some(-9.81), ..tilted(message) })
        }
        Some((_, words)) => Some(kinds::GRAVITY.found("gravity", size, 9.81).likely(*words).as_note()),
        None => {
            let digit = "the decimal point";
            let factors =
                &[(1e2, "cm/s2"), (1e3, "mm/s2"), (0.10197, "in g"), (3.2808, "ft/s2"), (10.0, digit), (0.1, digit)];
            Some(kinds::GRAVITY.found("gravity", size, 9.81).likely(slip(size, &(9.7..=9.9), factors, 1.0)))
        }
    }
}

fn tilted(message: String) -> Finding {
    let help = "right for a robot on a wall, a ceiling or a slope; else turn gravity over";
    Finding { unit: "m/s2".into(), ..Finding::warning("gravity-direction", "gravity", message, help) }.as_note()
}

/// Checks a payload; `inertia.com` is in the axes of the link that carries it.
pub(crate) fn payload(what: &str, inertia: &LinkInertia, size: &Size, weighs: bool) -> Vec<Finding> {
    let mut caveats: Vec<Finding> = far(what, inertia.com.norm(), size).into_iter().collect();
    if inertia.mass <= 0.0 {
        return caveats;
    }
    // Mass, against that of the robot.
    let share = inertia.mass / size.mass;
    let share = if weighs { share } else { share / WEIGHTLESS };
    if share > PAYLOAD_SHARE.1 {
        let caveat = kinds::PAYLOAD_MASS.found(what, inertia.mass, size.mass);
        let likely = slip(inertia.mass, &(0.0..=2.0 * size.mass), slip::MASS, 1.0);
        caveats.push(if share > PAYLOAD_SHARE.0 { caveat.likely(likely) } else { caveat.as_note() });
    }
    // Inertia: a point, an impossible body, one larger than the arm, one denser than any metal.
    let mut moments: [f64; 3] = inertia.inertia_com.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    let [low, middle, high] = moments;
    if high == 0.0 {
        let point = || kinds::POINT_PAYLOAD.found(what, inertia.mass, POINT_MASS);
        caveats.extend((inertia.mass > POINT_MASS).then(point));
        return caveats;
    }
    if high > (low + middle) * (1.0 + 1e-6) {
        caveats.push(kinds::TRIANGLE.found(what, high, low + middle));
    }
    let (radius, limit) = (gyration(inertia), size.extent.max(0.2));
    if radius > limit {
        let caveat = kinds::PAYLOAD_INERTIA.found(what, radius, size.extent);
        caveats.push(caveat.likely(slip(radius, &(0.0..=0.5 * limit), slip::INERTIA, 0.5)));
    }
    let density = least_density(inertia);
    caveats.extend((density > OSMIUM).then(|| kinds::DENSITY.found(what, density, OSMIUM)));
    caveats
}

/// Checks for speeds and ranges in other units.
fn joint_limits(mechanism: &Mechanism, size: &Size) -> Vec<Finding> {
    let turning: Vec<&Joint> = mechanism.joints.iter().filter(|j| j.kind.turns()).collect();
    // Machines with one or two axes can be modelled on the motor side.
    let arm = turning.len() > 2;
    let mut caveats = Vec::new();
    let name = |joint: &Joint| format!("joint {:?}", joint.name);
    for joint in turning.iter().filter(|joint| joint.limits.velocity.is_finite()) {
        let (speed, reach) = (joint.limits.velocity, size.beyond(&joint.parent));
        let most = if arm { FAST.0.min(SWEEP / reach) } else { FAST.0 };
        let caveat = (speed > most).then(|| kinds::SPEED_LIMIT.found(name(joint), speed, most));
        let [degrees, turns] = [slip::ANGLE[0], (60.0 / TURN, "1/min")];
        // In degrees a limit is at least 40 per second.
        let likely = match slip(speed, &(0.7..=most), &[degrees], 1.0) {
            none if none.is_empty() => slip(speed, &(0.05..=most), &[turns, degrees], 1.0),
            found => found,
        };
        let caveat = caveat.map(|caveat| caveat.likely(likely));
        let surely = if arm { speed > FASTEST || speed * reach > SWEEP } else { speed * reach > FAST.1 };
        caveats.extend(caveat.map(|caveat| if surely { caveat } else { caveat.as_note() }));
    }
    let speeds = turning.iter().map(|j| j.limits.velocity).filter(|speed| *speed > 0.0);
    let fastest = speeds.fold(0.0f64, f64::max);
    if arm && fastest > 0.0 && fastest < SLOWEST.0 && size.extent < SLOWEST.1 {
        let caveat = kinds::SLOW_JOINTS.found("the fastest joint", fastest, SLOWEST.0);
        caveats.push(caveat.likely(slip(fastest, &(SLOWEST.0..=FAST.0), TWICE, 1.0)));
    }
    let ends = |j: &Joint| j.limits.lower.abs().max(j.limits.upper.abs());
    let wide: Vec<_> = turning.iter().filter(|j| ends(j).is_finite() && ends(j) > 2.0 * TURN).collect();
    let width = |j: &Joint| j.limits.upper - j.limits.lower;
    let narrow: Vec<_> = turning.iter().filter(|j| arm && width(j) > 0.0 && width(j) < NARROW).collect();
    let severity = |caveat: Finding, of: usize| if 2 * of > turning.len() { caveat } else { caveat.as_note() };
    caveats.extend(wide.iter().map(|joint| {
        let caveat = kinds::JOINT_RANGE.found(name(joint), ends(joint), 2.0 * TURN);
        severity(caveat.likely(slip(ends(joint), &(0.0..=2.0 * TURN), &slip::ANGLE[..1], 1.0)), wide.len())
    }));
    caveats.extend(narrow.iter().map(|joint| {
        let caveat = kinds::NARROW_RANGE.found(name(joint), width(joint), NARROW);
        severity(caveat.likely(slip(width(joint), &(NARROW..=2.0 * TURN), TWICE, 1.0)), narrow.len())
    }));
    caveats
}

/// Radians that were converted as degrees.
const TWICE: &[slip::Factor] = &[(1.0 / slip::DEGREES, "converted to radians twice")];

/// Gravity torques below this fraction of the arm's weight times its reach count as zero.
const NO_WEIGHT: f64 = 1e-4;

/// Checks for effort limits far above the gravity and inertia torques of the arm.
fn strong_drives(model: &Model, size: &Size) -> Option<Finding> {
    let weight = weight_carried(model);
    let most = weight.iter().fold(0.0f64, |m, w| m.max(*w));
    // A joint with a nearly vertical axis only carries the gravity torque due to its misalignment,
    // which is no measure for a drive.
    let some = NO_WEIGHT * size.mass * model.gravity.norm() * size.extent;
    let limited = |k: &usize| model.coordinates()[*k].limits.effort.is_finite();
    let effort = |k: usize| model.coordinates()[k].limits.effort;
    let joints: Vec<usize> = (0..model.nv()).filter(limited).collect();
    let least = joints.iter().filter(|k| weight[**k] > 0.05 * most && weight[**k] > some);
    let least = least.map(|k| (effort(*k) / weight[*k], *k)).min_by(|a, b| a.0.total_cmp(&b.0));
    let joint = |k: usize| format!("joint {:?}", model.coordinates()[k].joint);
    let unit = |k: usize| model.coordinates()[k].effort_unit();
    if let Some((ratio, k)) = least {
        let caveat = || kinds::EFFORT_LIMIT.with_unit(unit(k)).found(joint(k), effort(k), weight[k]);
        return (ratio > STRONG).then(|| caveat().likely(slip(ratio, &(0.5..=100.0), slip::EFFORT, 1.0)));
    }
    // Without a gravity torque the limit is judged by the acceleration it could cause.
    let inertia = inertia_moved(model);
    let heaviest = joints.into_iter().max_by(|a, b| inertia[*a].total_cmp(&inertia[*b]))?;
    let acceleration = effort(heaviest) / inertia[heaviest] * size.extent;
    let caveat = || kinds::TIP_ACCELERATION.found(joint(heaviest), acceleration, TIP_ACCELERATION);
    let turns = !model.coordinates()[heaviest].slides();
    (turns && acceleration.is_finite() && acceleration > TIP_ACCELERATION)
        .then(|| caveat().likely(slip(acceleration, &(0.1..=TIP_ACCELERATION), slip::EFFORT, 1.0)))
}
