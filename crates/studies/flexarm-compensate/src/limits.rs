//! Limits of the joints: what commands pass, and what becomes of them then.

use flexarm_trajectory::{Extreme, JointLimits};

use super::{CompensateError, CompensateRequest, Compensation, Found, Stop, attempt};
use flexarm_run::Arm;
use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::Motion;
use flexarm_run::MotionViolation;
use flexarm_run::Robot;
use flexarm_run::Scenario;
use flexarm_run::motion::limits as limits_of;
use flexarm_run::motion_report::of_effort;
use flexarm_run::motion_report::of_limit;

/// What is passed by less than this part of the limit more than by the motion itself is the
/// motion's own.
const SAME: f64 = 1e-3;
/// Room that a slower motion leaves below a limit.
const ROOM: f64 = 1.01;
/// Most times that a motion is slowed.
const MOST_TIMES: usize = 6;
/// A motion is not made longer than this many times.
const SLOWEST: f64 = 5.0;

/// What becomes of commands that pass a limit which the motion itself keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LimitRule {
    /// The motion is run more slowly; what time does not mend is an error that names all of them.
    #[default]
    Slow,
    /// An error that names all of them.
    Refuse,
    /// They stand in the answer, with a caveat.
    Tell,
}

/// Limits that a motion passes, with the largest torques of its run.
pub(super) fn passed(
    robot: &Robot,
    motion: &Motion,
    efforts: &[Extreme],
    request: &CompensateRequest,
) -> Result<Vec<MotionViolation>, Error> {
    let model = robot.rigid_model()?;
    let mut limits = limits_of(&model);
    for (limit, acceleration) in limits.iter_mut().zip(&request.accelerations) {
        *limit = JointLimits { acceleration: Some(*acceleration), ..*limit };
    }
    let mut passed: Vec<MotionViolation> = motion.trajectory.check_limits(&limits).iter().map(of_limit).collect();
    for (c, worst) in model.coordinates().iter().zip(efforts) {
        passed.extend(of_effort(&c.joint, worst, worst.time_s, c.limits.effort, "flexible robot"));
    }
    Ok(passed)
}

/// Those that the motion itself keeps, or passes by less.
pub(super) fn worse<'a>(
    passed: &'a [MotionViolation],
    own: &'a [MotionViolation],
) -> impl Iterator<Item = &'a MotionViolation> {
    passed.iter().filter(|limit| {
        let before = own.iter().find(|own| own.joint == limit.joint && own.kind == limit.kind);
        let over = |limit: &MotionViolation| (limit.value - limit.limit).abs();
        before.is_none_or(|before| over(limit) > over(before) + SAME * limit.limit.abs())
    })
}

/// Commands that keep the limits, by the rule that was asked for.
pub(super) fn kept(
    robot: &Robot,
    arm: &Arm,
    scenario: &Scenario,
    request: &CompensateRequest,
    stop: Stop<'_>,
) -> Result<(Compensation, Found), Error> {
    let mut scenario = scenario.clone();
    let mut slowed = 1.0;
    for _ in 0..MOST_TIMES {
        let (mut answer, found, own) = attempt(robot, arm, &scenario, request, stop)?;
        answer.slowed = slowed;
        if slowed > 1.0 {
            let text = format!("the motion takes {slowed:.4} times as long, so that limits of the joints are kept");
            let help = "let commands pass them (`limits` = tell), or slow the motion where it is quickest";
            answer.caveats.push(Caveat::said("slowed", "compensation", text, help));
        }
        let worse: Vec<MotionViolation> = worse(&answer.limits, &own).cloned().collect();
        if worse.is_empty() || request.limits == LimitRule::Tell {
            return Ok((answer, found));
        }
        let factor = worse.iter().map(slower).fold(1.0, f64::max);
        let hopeless = request.limits == LimitRule::Refuse || !factor.is_finite() || slowed * factor > SLOWEST;
        if hopeless || !(scenario.loads.is_empty() && scenario.payloads.is_empty()) {
            return Err(refused(&worse, request.limits).into());
        }
        slowed *= factor;
        let motion = scenario.motion.scaled(factor, &*robot.rigid_model()?)?;
        scenario = Scenario { motion, ..scenario };
    }
    let (answer, _, own) = attempt(robot, arm, &scenario, request, stop)?;
    Err(refused(&worse(&answer.limits, &own).cloned().collect::<Vec<_>>(), request.limits).into())
}

/// How many times as long a motion must take for a limit to be kept; infinite if time does not
/// help.
fn slower(limit: &MotionViolation) -> f64 {
    let over = ROOM * (limit.value / limit.limit).abs();
    match limit.kind {
        "velocity" => over,
        // Of a torque the part of the weight stays: this is asked again until it is enough.
        "acceleration" | "effort" => over.sqrt(),
        _ => f64::INFINITY,
    }
}

fn refused(worse: &[MotionViolation], rule: LimitRule) -> CompensateError {
    CompensateError::Limits {
        limits: worse.iter().map(|limit| limit.message.clone()).collect(),
        slower: rule == LimitRule::Slow,
    }
}
