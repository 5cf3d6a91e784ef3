//! TCP displacement caused by each contributor: flexible links, elastic drives, and the following
//! error of servos.
//!
//! ```text
//! u_T_W = J_WT_W[:, e] e        first order: columns of the twin's Jacobian of the deflections e
//! ```

use flexarm_analysis::ContributionPeak;
use flexarm_stepping::{ElasticElement, Observation, Plant};
use nalgebra::Vector6;

use crate::arm::{Arm, Owner};
use crate::run::twin::RigidTwin;

/// Monitors all contributors: links, then drives, then the following error.
pub(crate) struct Contributions {
    /// Contributor index of each elastic element.
    places: Vec<usize>,
    /// TCP displacement by each contributor at the last sample: m and rad, world axes.
    moved: Vec<Vector6<f64>>,
    peaks: Vec<ContributionPeak>,
}

impl Contributions {
    pub(crate) fn new(arm: &Arm, n_drives: usize) -> Self {
        let n_links = arm.spans.len();
        let places = arm.owners.iter().map(|owner| match owner {
            Owner::Link(link) => *link,
            Owner::Drive(drive) => n_links + drive,
        });
        let count = n_links + n_drives + 1;
        Self {
            places: places.collect(),
            moved: vec![Vector6::zeros(); count],
            peaks: vec![ContributionPeak::default(); count],
        }
    }

    pub(crate) fn update(&mut self, observed: &Observation, twin: &RigidTwin, plant: &Plant) {
        self.moved.fill(Vector6::zeros());
        for (element, place) in plant.elements.iter().zip(&self.places) {
            // Column by column: a product of dynamically sized views takes three times as long.
            let mut displacement = Vector6::zeros();
            for k in element.coordinate..element.coordinate + element.size {
                displacement += twin.J.column(k) * observed.q[k];
            }
            self.moved[*place] += displacement;
        }
        // Following error: motors under servos deviate from the trajectory.
        if let Some(following) = self.moved.last_mut() {
            for &k in &plant.torque_driven {
                *following += twin.J.column(k) * (observed.q[k] - twin.state.q[k]);
            }
        }
        for (peak, displacement) in self.peaks.iter_mut().zip(&self.moved) {
            peak.update(observed.t, displacement);
        }
    }

    /// Returns the contributor index of a coordinate; motors belong to the following error.
    pub(crate) fn place_of(&self, coordinate: usize, plant: &Plant) -> usize {
        let within = |e: &ElasticElement| (e.coordinate..e.coordinate + e.size).contains(&coordinate);
        plant.elements.iter().position(within).map_or(self.moved.len() - 1, |k| self.places[k])
    }

    /// Returns the TCP displacements at the last sample (m, rad, world axes).
    pub(crate) fn moved(&self) -> &[Vector6<f64>] {
        &self.moved
    }

    /// Returns the maximum displacement by each contributor.
    pub(crate) fn result(&self) -> &[ContributionPeak] {
        &self.peaks
    }
}
