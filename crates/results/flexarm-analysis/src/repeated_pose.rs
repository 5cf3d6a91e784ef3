//! Poses at which the TCP comes to rest more than once: pose accuracy and repeatability in the
//! sense of ISO 9283. Not here: the rests themselves (`hold`).

use nalgebra::Vector3;

use crate::hold::HoldMetrics;

/// Maximum distance of two rests at the same position of the rigid TCP, m.
const SAME_PLACE: f64 = 1e-6;

/// A pose that is visited at least twice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepeatedPose {
    /// Position of the rigid TCP, m, world axes.
    pub place_m: [f64; 3],
    /// Number of times the TCP came to rest there.
    pub visits: usize,
    /// Distance of the mean attained position from that of the rigid TCP, m (pose accuracy AP).
    pub accuracy_m: f64,
    /// `l̄ + 3 S`, m, with the mean and the standard deviation S of the distances `l` of the
    /// attained positions from their mean (pose repeatability RP).
    pub repeatability_m: f64,
}

/// Returns the poses with two or more rests, ordered by their first rest; the attained position
/// (world, m) is that at the end of a rest.
pub fn repeated_poses(holds: &[HoldMetrics]) -> Vec<RepeatedPose> {
    let mut groups: Vec<(Vector3<f64>, Vec<Vector3<f64>>)> = Vec::new();
    for hold in holds {
        let (place, error) = (Vector3::from(hold.place_m), Vector3::from(hold.end_error_m));
        match groups.iter_mut().find(|(known, _)| (known - place).norm() <= SAME_PLACE) {
            Some((_, errors)) => errors.push(error),
            None => groups.push((place, vec![error])),
        }
    }
    groups.iter().filter(|(_, errors)| errors.len() > 1).map(|(place, errors)| repeated(place, errors)).collect()
}

/// Accuracy and repeatability of a pose from the errors of its visits (m, world axes), as in ISO
/// 9283: mean distance from their mean plus three standard deviations.
fn repeated(place: &Vector3<f64>, errors: &[Vector3<f64>]) -> RepeatedPose {
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<Vector3<f64>>() / n;
    let distances: Vec<f64> = errors.iter().map(|error| (error - mean).norm()).collect();
    let average = distances.iter().sum::<f64>() / n;
    let variance = distances.iter().map(|l| (l - average).powi(2)).sum::<f64>() / (n - 1.0);
    RepeatedPose {
        place_m: (*place).into(),
        visits: errors.len(),
        accuracy_m: mean.norm(),
        repeatability_m: average + 3.0 * variance.sqrt(),
    }
}
