//! Caveats of a compensation.
//!
//! [`of`] collects them. Not here: joint limits themselves ([`super::limits`]).

use std::sync::Arc;

use flexarm_trajectory::Extreme;

use super::job::{Commands, Discarded};
use super::{CompensateRequest, Compensation, Method, limits};
use flexarm_run::{Arm, Finding, MotionViolation, Robot};

/// Minimum remaining fraction of the model's peak error that is explained, and minimum share of it
/// above the cutoff frequency for that explanation.
const ENOUGH_LEFT: f64 = 0.01;
const MOSTLY: f64 = 0.5;
/// Fraction of the torque limit at which a servo counts as saturated.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// Finding about poses where the joints cannot correct all requested components.
fn singular_caveat((t_s, directions): (f64, usize), asked: usize) -> Option<Finding> {
    (directions < asked).then(|| {
        let text = format!(
            "at {t_s:.2} s the joints can move the TCP in only {directions} of the {asked} requested directions (a \
             singular pose, or too few joints): the others are corrected little or not at all"
        );
        Finding::warning(
            "singular",
            "compensation",
            text,
            "request fewer components, or change the motion to avoid this pose",
        )
    })
}

/// Finding about more than a hundredth of the peak left on the model because the motion is too fast.
fn quick_caveat(answer: &Compensation, quicker: f64) -> Option<Finding> {
    let (first, hz) = (answer.model_peaks_m.first()?, answer.cutoff_hz?);
    let least = answer.model_peaks_m.iter().copied().fold(f64::INFINITY, f64::min);
    (answer.iterations > 0 && least > ENOUGH_LEFT * first && quicker > MOSTLY).then(|| {
        let text = format!(
            "{:.1} % of the peak error remains on the model itself; {:.0} % of that, by its RMS, is above {hz:.1} Hz, \
             the cutoff frequency of the inversion",
            100.0 * least / first,
            100.0 * quicker
        );
        Finding::warning("too-quick", "compensation", text, "make the motion slower or its accelerations smoother")
    })
}

/// Finding about discarded iterations, which increased the error on the model, with the cutoff
/// frequency of those kept.
fn discarded_caveat(answer: &Compensation, discarded: &[Discarded]) -> Option<Finding> {
    let each = |of: &Discarded| match of.growth.is_finite() {
        true => {
            format!("iteration {} (up to {:.1} Hz) multiplied it by {:.3}", of.iteration, of.cutoff_hz, of.growth)
        }
        false => format!("iteration {} (up to {:.1} Hz) diverged", of.iteration, of.cutoff_hz),
    };
    let named: Vec<String> = discarded.iter().map(each).collect();
    let kept = match (answer.iterations, answer.cutoff_hz) {
        (0, _) | (_, None) => "no iteration is kept".to_owned(),
        (kept, Some(hz)) => format!("{kept} kept, corrected up to {hz:.1} Hz"),
    };
    (!named.is_empty()).then(|| {
        let text = format!(
            "iterations that increase the RMS or largest error on the model are discarded: {}; {kept}",
            named.join(", ")
        );
        let caveat = Finding::warning(
            "discarded",
            "compensation",
            text,
            "choose a lower cutoff, or set the damping of links and gearboxes",
        );
        if answer.iterations > 0 { caveat.as_note() } else { caveat }
    })
}

/// Finding about saturated servos of the plant: commands cannot compensate for missing torque.
pub(super) fn of_servos(plant: &Arc<Arm>, efforts: &[Extreme]) -> Option<Finding> {
    let joints: Vec<&str> = plant.joints().collect();
    let at_limit = plant.servo_limits().filter_map(|(k, limit)| {
        let worst = efforts.get(k).filter(|worst| worst.value.abs() >= AT_LIMIT * limit)?;
        Some(format!("{} ({limit:.1} N m or N at {:.3} s)", joints.get(k)?, worst.time_s))
    });
    let named: Vec<String> = at_limit.collect();
    (!named.is_empty()).then(|| {
        let text = format!(
            "servos are at their torque limits: {}: the error due to the missing torque is not corrected",
            named.join(", ")
        );
        Finding::warning("servo-limit", "compensation", text, "slow the motion down where it is fastest")
    })
}

/// Returns the caveats of a result.
///
/// * `own`: limits that the motion itself violates.
pub(super) fn of(
    answer: &Compensation,
    own: &[MotionViolation],
    robot: &Robot,
    found: &Commands,
    request: &CompensateRequest,
) -> Vec<Finding> {
    // Joint limits, effects that are not in the model, and a small gain.
    let mut caveats = Vec::new();
    let worse: Vec<&str> = limits::worse(&answer.limits, own).map(|limit| limit.message.as_str()).collect();
    if !worse.is_empty() {
        let text = format!("the new commands exceed limits that the original motion satisfies: {}", worse.join("; "));
        caveats.push(Finding::warning("limits", "compensation", text, "slow the motion down a little"));
    }
    let unknown: Vec<&str> = robot
        .drives
        .iter()
        .filter(|d| d.play(false) != [0.0; 2] || d.friction != flexarm_stepping::Friction::NONE)
        .map(|d| d.joint.as_str())
        .collect();
    if !unknown.is_empty() {
        let text = format!(
            "errors due to backlash and friction of {} are not corrected: they depend on the direction of approach",
            unknown.join(", ")
        );
        caveats
            .push(Finding::warning("play", "compensation", text, "approach every point from the same side").as_note());
    }
    // Shaping alone is not meant to reduce the error.
    let corrected = request.method == Method::Static || request.iterations > 0;
    if corrected && answer.after.peak_m > 0.5 * answer.before.peak_m {
        let text = format!(
            "the error on the plant is reduced by less than half ({:.3} of {:.3} mm remain)",
            1e3 * answer.after.peak_m,
            1e3 * answer.before.peak_m
        );
        caveats.push(Finding::warning(
            "little-gained",
            "compensation",
            text,
            "the model differs from the plant, or the motion is too fast for it",
        ));
    }
    caveats.extend(discarded_caveat(answer, &found.discarded));
    caveats.extend(quick_caveat(answer, found.quicker));
    let asked = request.components.iter().filter(|asked| **asked).count();
    caveats.extend(found.fewest.and_then(|fewest| singular_caveat(fewest, asked)));
    caveats
}
