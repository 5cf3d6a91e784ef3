//! Joint limits: violations by commands, and their treatment.
//!
//! Start at [`kept`], which repeats the compensation with a slower motion until the limits are
//! kept.

use std::sync::Arc;

use flexarm_settings::Words;
use flexarm_trajectory::{Extreme, JointLimits};

use super::{CompensateError, CompensateRequest, Compensation, MotionPair, Stop, attempt};
use flexarm_run::motion::limits as limits_of;
use flexarm_run::motion_report::of_effort;
use flexarm_run::{Arm, Error, Finding, Motion, MotionViolation, Robot, Scenario};

/// Increase of a violation over that of the motion itself, as a fraction of the limit, up to which
/// it counts as the motion's own.
const SAME: f64 = 1e-3;
/// Margin of a slowed motion below a limit.
const MARGIN: f64 = 1.01;
/// Maximum number of attempts at slowing a motion.
const MAX_TIMES: usize = 6;
/// Maximum factor by which a motion is slowed.
const SLOWEST: f64 = 5.0;

/// Treatment of commands that violate a limit which the motion itself keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LimitRule {
    /// Slow the motion down; limits that this does not help are listed in an error.
    #[default]
    Slow,
    /// Return an error that lists all of them.
    Refuse,
    /// Report them in the result, with a caveat.
    Tell,
}

impl Words for LimitRule {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("slow", Self::Slow, "Slow the motion down; a violation that slowing does not remove is an error"),
        ("refuse", Self::Refuse, "Stop with an error that lists all violations"),
        ("tell", Self::Tell, "List the violations and write the motion all the same"),
    ];
}

/// Returns the limits violated by a motion, including the drive limits for the peak efforts of its
/// run.
pub(super) fn passed(
    robot: &Robot,
    motion: &Motion,
    efforts: &[Extreme],
    request: &CompensateRequest,
) -> Result<Vec<MotionViolation>, Error> {
    let model = robot.rigid_model()?;
    let mut limits = limits_of(&model);
    for (limit, acceleration) in limits.iter_mut().zip(&request.accelerations) {
        *limit = JointLimits { acceleration: *acceleration, ..*limit };
    }
    let mut passed = motion.trajectory.check_limits(&limits);
    for (c, worst) in model.coordinates().iter().zip(efforts) {
        passed.extend(of_effort(&c.joint, worst, worst.time_s, c.limits.effort));
    }
    Ok(passed.iter().map(MotionViolation::from).collect())
}

/// Returns the violations that the motion itself does not have, or has to a lesser degree.
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

/// Finds commands that keep the limits, according to the rule of the request.
pub(super) fn kept(
    robot: &Robot,
    arm: &Arc<Arm>,
    scenario: &Scenario,
    request: &CompensateRequest,
    stop: Stop<'_>,
) -> Result<(Compensation, MotionPair), Error> {
    // The slower motion is compensated anew: its deflection is another one.
    let mut scenario = scenario.clone();
    let mut slowed = 1.0;
    for _ in 0..MAX_TIMES {
        let (mut answer, found, own) = attempt(robot, arm, &scenario, request, stop)?;
        answer.slowed = slowed;
        if slowed > 1.0 {
            let text = format!("the motion is slowed down by a factor of {slowed:.4} to satisfy joint limits");
            let help = "allow violations (`limits` = tell), or slow the motion down where it is fastest";
            answer.caveats.push(Finding::warning("slowed", "compensation", text, help));
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

/// Returns the factor by which to lengthen a motion to keep a limit; infinite if that does not
/// help.
fn slower(limit: &MotionViolation) -> f64 {
    let over = MARGIN * (limit.value / limit.limit).abs();
    match limit.kind {
        "velocity" => over,
        // The gravity part of a torque does not scale: repeat until the torque is low enough.
        "acceleration" | "effort" => over.sqrt(),
        _ => f64::INFINITY,
    }
}

/// Returns the error about limits that slowing does not keep, or must not.
fn refused(worse: &[MotionViolation], rule: LimitRule) -> CompensateError {
    let limits: Vec<&str> = worse.iter().map(|limit| &*limit.message).collect();
    let limits = limits.join("; ");
    let remedy = match rule == LimitRule::Slow {
        true => {
            "a slower motion does not help, or loads fix its timing: change the motion there, or accept the \
             violation (`limits` = tell)"
        }
        false => "slow the motion down (`limits` = slow), or accept the violation (tell)",
    };
    CompensateError::Input(format!(
        "the new commands exceed limits that the original motion satisfies: {limits}; {remedy}"
    ))
}
