//! Gaps in sampled data: places where samples are missing.

use crate::spline::JointSamples;
use crate::warning::Warning;

/// A step is a gap if it exceeds this multiple of the usual step.
const GAP: f64 = 4.0;
/// Minimum number of steps from which the usual step is determined.
const LEAST_STEPS: usize = 10;
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
    if steps.len() < LEAST_STEPS {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn found(times: &[f64], position: impl Fn(f64) -> f64) -> Option<Warning> {
        let position = times.iter().map(|t| position(*t)).collect();
        gaps(times, &[JointSamples { name: "j".into(), position, ..JointSamples::default() }])
    }

    fn sampled(n: usize, step: f64) -> Vec<f64> {
        (0..n).map(|k| k as f64 * step).collect()
    }

    /// Truth: the samples that were taken out.
    #[test]
    fn missing_samples_are_found_with_their_place_also_where_clocks_jitter() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as f64 / 2f64.powi(31) - 0.5
        };
        for jitter in [0.0, 0.3, 0.9] {
            let mut times: Vec<f64> = sampled(500, 0.02).iter().map(|t| t + 0.02 * jitter * random()).collect();
            assert_eq!(found(&times, f64::sin), None, "{jitter}");
            times.drain(201..221);
            let Some(Warning::Gaps { count: 1, sample: 201, from_s, to_s, usual_s, .. }) = found(&times, f64::sin)
            else {
                panic!("{jitter}: {:?}", found(&times, f64::sin))
            };
            assert_eq!([from_s, to_s], [times[200], times[201]]);
            assert!((usual_s - 0.02).abs() < 2e-3, "{usual_s}");
        }
    }

    #[test]
    fn holds_late_samples_waypoints_and_uneven_rows_are_no_gaps() {
        // A table that leaves out the rows of a hold.
        let mut times = sampled(300, 0.01);
        times.iter_mut().skip(150).for_each(|t| *t += 2.0);
        let hold = |t: f64| if t < 1.49 { t } else { 1.49 + (t - 3.5).max(0.0) };
        assert_eq!(found(&times, hold), None);
        // Five messages received late, all at once.
        let mut times = sampled(300, 0.01);
        for (k, late) in [(100, 0.05), (101, 0.041), (102, 0.032), (103, 0.023), (104, 0.014)] {
            times[k] += late;
        }
        assert_eq!(found(&times, f64::sin), None);
        // Waypoints at even times with one long move, and waypoints at uneven times.
        let mut times = sampled(30, 0.5);
        times.iter_mut().skip(12).for_each(|t| *t += 4.0);
        assert_eq!(found(&times, f64::sin), None);
        let uneven: Vec<f64> = (0..40).map(|k| 0.05 * f64::from(k * k)).collect();
        assert_eq!(found(&uneven, f64::sin), None);
        assert_eq!(found(&[0.0, 0.1, 0.2, 1.0], f64::sin), None);
    }
}
