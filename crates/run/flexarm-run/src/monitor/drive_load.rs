//! Loads of the drives: maximum force of each, time at which it first exceeded its limit, and
//! number of samples with a saturated servo.

use flexarm_stepping::{FlexibleArm, Observation};

/// Figures of one drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DriveLoad {
    /// Maximum torque or force (N m or N).
    pub(crate) peak: f64,
    /// Time at which it first exceeded the joint's limit (s).
    pub(crate) over_since_s: Option<f64>,
    /// Number of samples in which its servo was at its limit.
    pub(crate) at_limit: usize,
}

/// Limits of one drive (N m or N).
struct Limits {
    joint: f64,
    /// Limit of the servo, if there is one.
    servo: Option<f64>,
}

/// Monitors the drives, in the order of the actuated coordinates.
pub(crate) struct DriveLoads {
    limits: Vec<Limits>,
    seen: Vec<DriveLoad>,
}

impl DriveLoads {
    pub(crate) fn new(arm: &FlexibleArm) -> Self {
        let actuated = &arm.model.coordinates()[..arm.model.n_actuated()];
        let servo = |k: usize| {
            let mut axes = arm.servo.iter().flat_map(|servo| &servo.axes);
            axes.find(|axis| axis.coordinate == k).map(|axis| axis.limit)
        };
        let limits = actuated.iter().enumerate().map(|(k, c)| Limits { joint: c.limits.effort, servo: servo(k) });
        Self { limits: limits.collect(), seen: vec![DriveLoad::default(); actuated.len()] }
    }

    pub(crate) fn update(&mut self, seen: &Observation) {
        self.add(seen.t, seen.drive.as_slice());
    }

    /// Adds the torques or forces of all drives at time `t` (s).
    fn add(&mut self, t: f64, forces: &[f64]) {
        for ((load, limits), force) in self.seen.iter_mut().zip(&self.limits).zip(forces) {
            load.peak = load.peak.max(force.abs());
            if force.abs() > limits.joint {
                load.over_since_s.get_or_insert(t);
            }
            load.at_limit += usize::from(limits.servo.is_some_and(|limit| force.abs() >= limit));
        }
    }

    /// Returns one entry per drive.
    pub(crate) fn result(&self) -> &[DriveLoad] {
        &self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_time_beyond_the_limit_counts_and_a_servo_at_its_limit_is_counted() {
        let limits = vec![Limits { joint: 10.0, servo: Some(8.0) }, Limits { joint: 5.0, servo: None }];
        let mut drives = DriveLoads { limits, seen: vec![DriveLoad::default(); 2] };
        for (k, force) in [1.0, 8.0, -8.0, 11.0, 12.0, 2.0].into_iter().enumerate() {
            drives.add(0.1 * k as f64, &[force, -0.25 * force]);
        }
        let truth = [
            DriveLoad { peak: 12.0, over_since_s: Some(0.1 * 3.0), at_limit: 4 },
            DriveLoad { peak: 3.0, over_since_s: None, at_limit: 0 },
        ];
        assert_eq!(drives.result(), truth);
    }
}
