//! Caveats about balancers relative to the weight they carry, and about their range of length over
//! the joint ranges.
//!
//! Start at [`of_balancers`]; each balancer is compared with the robot without any. Not here:
//! balancers out of range at a pose, which are errors ([`crate::robot::balancer`]).

use flexarm_kinematics::{BalancerLaw, BalancerSpan, Data, Mechanism, Model, forward_kinematics, gravity_forces};
use nalgebra::DVector;

use super::size::spread_poses;
use super::slip::{EFFORT, Factor, slip};
use super::{Finding, kinds, parts};

/// Maximum balancer torque relative to the maximum gravity torque: note, warning.
const STRONG: [f64; 2] = [3.0, 10.0];
/// Maximum ratio of the joint torque with a balancer to that without (RMS).
const RAISED: f64 = 1.1;
/// Minimum balancer torque relative to the maximum gravity torque.
const WEAK: f64 = 1e-3;

/// Returns all of these caveats, over poses spread over the joint ranges.
pub(crate) fn of_balancers(mechanism: &Mechanism, rigid: &Model) -> Vec<Finding> {
    if rigid.balancers().is_empty() {
        return Vec::new();
    }
    let Ok(bare) = Model::new(&Mechanism { balancers: Vec::new(), ..mechanism.clone() }) else { return Vec::new() };
    let weights = spread_poses(&bare).map(|q| gravity_forces(&bare, &mut Data::new(&bare), &q).amax());
    let weight = weights.fold(0.0, f64::max);
    let mut caveats = Vec::new();
    for (k, balancer) in rigid.balancers().iter().enumerate() {
        // Length over the joint ranges: room of the gas, end of the curve.
        let name = format!("balancer {:?}", balancer.name);
        let Lengths { least, most } = lengths(rigid, k);
        match &balancer.law {
            BalancerLaw::Gas(gas) => {
                let (reached, passes) = if gas.pulls { (most, most >= gas.end()) } else { (least, least <= gas.end()) };
                caveats.extend(passes.then(|| kinds::BALANCER_ROOM.found(&name, reached, gas.end())));
            }
            BalancerLaw::Curve(curve) => {
                let [first, last] = curve.range();
                let end = first.abs().max(last.abs());
                let turns = alone(mechanism, &bare, k).unit == "N m" && over_joint(mechanism, k);
                caveats.extend(turns.then(|| parts::angles(&format!("the curve of {name}"), &[end])).flatten());
                let outside = if least < first { Some((least, first)) } else { (most > last).then_some((most, last)) };
                caveats.extend(outside.map(|(x, end)| kinds::BALANCER_CURVE.found(&name, x, end)));
            }
            _ => {}
        }
        // Torque on the joint it acts on most: too strong, too weak, or against the weight's side.
        let alone = alone(mechanism, &bare, k);
        let torque = alone.torque;
        if weight > 0.0 && torque > STRONG[0] * weight {
            let caveat = kinds::BALANCER_STRONG.with_unit(alone.unit).found(&name, torque, STRONG[0] * weight);
            let likely = slip(torque, &(0.01 * weight..=STRONG[0] * weight), EFFORT, 1.0);
            caveats.push(if torque > STRONG[1] * weight { caveat.likely(likely) } else { caveat.as_note() });
        } else if torque < WEAK * weight {
            let gas = matches!(balancer.law, BalancerLaw::Gas(_)).then_some((1e-5, "pressure in bar"));
            let factors: Vec<Factor> = gas.into_iter().chain([(1e-3, "kN, kN m or N/mm")]).collect();
            let likely = slip(torque, &(0.03 * weight..=STRONG[0] * weight), &factors, 1.0);
            let caveat = kinds::BALANCER_WEAK.with_unit(alone.unit).found(&name, torque, WEAK * weight).likely(likely);
            // A gas spring that reaches its free length is weak in some poses, and then no unit explains it.
            caveats.push(if caveat.likely.is_empty() { caveat.as_note() } else { caveat });
        }
        if weight > 0.0 && alone.with > RAISED * alone.without {
            let caveat = kinds::BALANCER_SIDE.with_unit(alone.unit).found(&name, alone.with, alone.without);
            caveats.push(caveat.likely("on the wrong side?"));
        }
    }
    caveats
}

/// Whether a balancer acts on a joint, not between two points.
fn over_joint(mechanism: &Mechanism, number: usize) -> bool {
    matches!(mechanism.balancers[number].span, BalancerSpan::Joint { .. })
}

/// Minimum and maximum length of a balancer.
struct Lengths {
    least: f64,
    most: f64,
}

fn lengths(model: &Model, number: usize) -> Lengths {
    let mut data = Data::new(model);
    let start = Lengths { least: f64::INFINITY, most: f64::NEG_INFINITY };
    spread_poses(model).fold(start, |Lengths { least, most }, q| {
        forward_kinematics(model, &mut data, &q);
        let x = model.balancers()[number].length(&data.X_WB, q.as_slice());
        Lengths { least: least.min(x), most: most.max(x) }
    })
}

/// Effect of one balancer on the joint on which it acts most, over poses spread over the joint
/// ranges.
struct BalancerEffect {
    /// Maximum torque of the balancer.
    torque: f64,
    /// RMS holding torque with this balancer.
    with: f64,
    /// RMS holding torque without any balancer.
    without: f64,
    /// Unit of all three.
    unit: &'static str,
}

fn alone(mechanism: &Mechanism, bare: &Model, number: usize) -> BalancerEffect {
    let mut found = BalancerEffect { torque: 0.0, with: 0.0, without: 0.0, unit: "N m" };
    let alone = Mechanism { balancers: vec![mechanism.balancers[number].clone()], ..mechanism.clone() };
    let Ok(alone) = Model::new(&alone) else { return found };
    let (mut data, mut data_bare) = (Data::new(&alone), Data::new(bare));
    let mut torques = |q: DVector<f64>| {
        (gravity_forces(&alone, &mut data, &q).clone(), gravity_forces(bare, &mut data_bare, &q).clone())
    };
    // Poses beyond the range of a gas balancer are left out: there is no torque.
    let all: Vec<_> =
        spread_poses(bare).map(&mut torques).filter(|(with, _)| with.iter().all(|x| x.is_finite())).collect();
    let own = |k: usize| all.iter().map(|(with, without)| (with[k] - without[k]).abs()).fold(0.0, f64::max);
    let Some(joint) = (0..bare.nv()).max_by(|a, b| own(*a).total_cmp(&own(*b))) else { return found };
    found.torque = own(joint);
    found.unit = bare.coordinates()[joint].effort_unit();
    let rms = |squares: f64| (squares / all.len().max(1) as f64).sqrt();
    found.with = rms(all.iter().map(|(with, _)| with[joint].powi(2)).sum());
    found.without = rms(all.iter().map(|(_, without)| without[joint].powi(2)).sum());
    found
}
