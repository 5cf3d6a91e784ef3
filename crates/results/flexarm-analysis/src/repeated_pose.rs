//! Poses at which the TCP comes to rest more than once: pose accuracy and repeatability in the
//! sense of ISO 9283.

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

/// Returns the poses with two or more rests, ordered by their first rest; the attained position is
/// that at the end of a rest.
pub(crate) fn repeated_poses(holds: &[HoldMetrics]) -> Vec<RepeatedPose> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn rest(place_m: [f64; 3], end_error_m: [f64; 3]) -> HoldMetrics {
        HoldMetrics {
            start_s: 0.0,
            end_s: 1.0,
            place_m,
            end_error_m,
            final_error_m: end_error_m,
            settling_s: Some(0.0),
            overshoot_m: 0.0,
            line: None,
        }
    }

    /// Truth: errors (1, 0, 0), (-1, 0, 0), (0, 2, 0), (0, -2, 0) about (3, 4, 0): the mean has a
    /// distance of 5, the distances 1, 1, 2, 2 have the mean 1.5 and the standard deviation
    /// 1/sqrt(3).
    #[test]
    fn accuracy_and_repeatability_are_those_of_the_formulas_of_the_standard() {
        let (a, b) = ([1.0, 0.0, 0.5], [0.0, 1.0, 0.5]);
        let about = |x: f64, y: f64| rest(a, [3.0 + x, 4.0 + y, 0.0]);
        let holds = [about(1.0, 0.0), rest(b, [9.0; 3]), about(-1.0, 0.0), about(0.0, 2.0), about(0.0, -2.0)];
        let poses = repeated_poses(&holds);
        assert_eq!(poses.len(), 1, "a pose with a single visit has no repeatability");
        assert_eq!((poses[0].place_m, poses[0].visits), (a, 4));
        assert!((poses[0].accuracy_m - 5.0).abs() < 1e-14);
        assert!((poses[0].repeatability_m - (1.5 + 3.0_f64.sqrt())).abs() < 1e-14);
    }

    #[test]
    fn a_robot_that_comes_to_the_same_place_every_time_repeats_exactly() {
        let holds = vec![rest([1.0, 2.0, 3.0], [1e-3, 0.0, -2e-3]); 30];
        let poses = repeated_poses(&holds);
        assert!((poses[0].accuracy_m - 5.0_f64.sqrt() * 1e-3).abs() < 1e-17);
        assert!(poses[0].repeatability_m < 1e-17); // measured 0 or rounding of the mean
    }
}
