//! Gaps in sampled data: places where samples are missing.
//!
//! Start at [`gaps`]: a step of more than [`GAP`] usual steps, in evenly sampled data. Not here:
//! interpolation across a gap (`spline.rs`).

use flexarm_settings::Finding;

use crate::findings::first_names;
use crate::spline::JointSamples;

/// A step is a gap if it exceeds this multiple of the usual step.
const GAP: f64 = 4.0;
/// Minimum number of steps from which the usual step is determined.
const MIN_STEPS: usize = 10;
/// Maximum usual step of samples (s); longer steps are those of waypoints.
const LONGEST_STEP: f64 = 0.1;
/// Minimum fraction of the steps within a factor of two of their median in evenly sampled data.
const EVEN: f64 = 0.75;

/// Missing samples in evenly sampled data: the longest gap, and the number of gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Number of gaps of these samples.
    pub count: usize,
    /// Number of the sample before the longest gap, from 1.
    pub sample: usize,
    /// Start of the longest gap, s.
    pub from_s: f64,
    /// End of the longest gap, s.
    pub to_s: f64,
    /// Usual step of the samples, s.
    pub usual_s: f64,
}

impl Gap {
    /// Returns the gap of a motion with times `start + factor t`.
    pub(crate) fn at_times(&self, start: f64, factor: f64) -> Self {
        let scaled = |t: f64| start + factor * t;
        Self { from_s: scaled(self.from_s), to_s: scaled(self.to_s), usual_s: factor * self.usual_s, ..self.clone() }
    }

    pub(crate) fn warning(&self) -> Finding {
        let Self { joints, count, sample, from_s, to_s, usual_s } = self;
        let more = if *count > 1 { format!(", the longest of {count} gaps") } else { String::new() };
        let message = format!(
            "no sample of {} for {:.4} s, from t = {from_s:.4} s to {to_s:.4} s (samples {sample} and {}){more}; the usual \
             step is {usual_s:.4} s: what the joints do there is a guess; record the motion again, or cut it there",
            first_names(joints),
            to_s - from_s,
            sample + 1
        );
        let warning = Finding::warning("motion-gap", "", message, "").measured(to_s - from_s, GAP * usual_s);
        Finding { unit: "s".into(), ..warning }
    }
}

/// Returns the gaps in the samples, if these are evenly spaced.
///
/// The usual step is the median. Data whose steps vary by more than jitter have no usual step, and
/// data with long steps are waypoints. A joint with the same position on both sides of a long step
/// may be at rest, so that is not a gap. A sample that arrives late and is followed by others in
/// quick succession is not a gap either, since no sample is missing.
///
/// * `times`: times from the first sample, increasing (s).
pub(crate) fn gaps(times: &[f64], joints: &[JointSamples]) -> Option<Gap> {
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
    Some(Gap {
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
