//! Gaps in sampled data: places where samples are missing.

use crate::spline::JointSamples;
use crate::warning::Warning;

/// A step is a gap if it exceeds this multiple of the usual step.
const GAP: f64 = 4.0;
/// Minimum number of steps from which the usual step is determined.
const MIN_STEPS: usize = 10;
/// Maximum usual step of samples (s); longer steps are those of waypoints.
const LONGEST_STEP: f64 = 0.1;
/// Minimum fraction of the steps within a factor of two of their median in evenly sampled data.
const EVEN: f64 = 0.75;

/// Returns the gaps in the samples, if these are evenly spaced.
///
/// The usual step is the median. Data whose steps vary by more than jitter have no usual step, and
/// data with long steps are waypoints. A joint with the same position on both sides of a long step
/// may be at rest, so that is not a gap. A sample that arrives late and is followed by others in
/// quick succession is not a gap either, since no sample is missing.
///
/// * `times`: times from the first sample, increasing (s).
pub(crate) fn gaps(times: &[f64], joints: &[JointSamples]) -> Option<Warning> {
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.len() < MIN_STEPS {
        return None;
    }
    let mut sorted = steps.clone();
    let (_, &mut usual, _) = sorted.select_nth_unstable_by(steps.len() / 2, f64::total_cmp);
    let even = steps.iter().filter(|step| (0.5 * usual..=2.0 * usual).contains(*step)).count();
    if usual > LONGEST_STEP || (even as f64) < EVEN * steps.len() as f64 {
        return None;
    }
    let moves = |k: usize| joints.iter().any(|joint| joint.position[k + 1] != joint.position[k]);
    let is_gap = |&k: &usize| steps[k] > GAP * usual && moves(k) && !is_made_up_for(&steps, k, usual);
    let found: Vec<usize> = (0..steps.len()).filter(is_gap).collect();
    let longest = *found.iter().max_by(|a, b| steps[**a].total_cmp(&steps[**b]))?;
    Some(Warning::Gaps {
        joints: joints.iter().map(|joint| joint.name.clone()).collect(),
        count: found.len(),
        sample: longest + 1,
        from_s: times[longest],
        to_s: times[longest + 1],
        usual_s: usual,
    })
}

/// Whether short steps after a long one restore the usual number of samples.
fn is_made_up_for(steps: &[f64], long: usize, usual: f64) -> bool {
    let late = steps[long] - usual;
    let behind = steps[long + 1..].iter().take((steps[long] / usual).ceil() as usize);
    behind.map(|step| (usual - step).max(0.0)).sum::<f64>() > 0.5 * late
}
