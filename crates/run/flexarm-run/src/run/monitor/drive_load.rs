//! Loads of the drives: maximum force of each, time at which it first exceeded its limit, and
//! number of samples with a saturated servo.

use flexarm_stepping::{Observation, Plant};

/// Figures of one drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriveLoad {
    /// Maximum torque or force (N m or N).
    pub peak: f64,
    /// Time at which it first exceeded the joint's limit (s).
    pub over_since_s: Option<f64>,
    /// Number of samples in which its servo was at its limit.
    pub at_limit: usize,
}

/// Limits of one drive (N m or N).
struct Limits {
    joint: f64,
    /// Limit of the servo, if there is one.
    servo: Option<f64>,
}

/// Monitors the drives, in the order of the actuated coordinates.
pub struct DriveLoads {
    limits: Vec<Limits>,
    loads: Vec<DriveLoad>,
}

impl DriveLoads {
    /// Takes the limits from the arm.
    pub fn new(plant: &Plant) -> Self {
        let actuated = &plant.model.coordinates()[..plant.model.n_actuated()];
        let servo = |k: usize| {
            let mut axes = plant.servo.iter().flat_map(|servo| &servo.axes);
            axes.find(|axis| axis.coordinate == k).map(|axis| axis.limit)
        };
        let limits = actuated.iter().enumerate().map(|(k, c)| Limits { joint: c.limits.effort, servo: servo(k) });
        Self { limits: limits.collect(), loads: vec![DriveLoad::default(); actuated.len()] }
    }

    /// Adds a sample.
    pub fn update(&mut self, observed: &Observation) {
        for ((load, limits), force) in self.loads.iter_mut().zip(&self.limits).zip(&observed.drive) {
            load.peak = load.peak.max(force.abs());
            if force.abs() > limits.joint {
                load.over_since_s.get_or_insert(observed.t);
            }
            load.at_limit += usize::from(limits.servo.is_some_and(|limit| force.abs() >= limit));
        }
    }

    /// Returns one entry per drive.
    pub fn result(&self) -> &[DriveLoad] {
        &self.loads
    }
}
