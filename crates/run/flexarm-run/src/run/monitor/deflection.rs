//! Deflections of the gearboxes of elastic drives.

use flexarm_stepping::Plant;
use nalgebra::DVector;

use crate::arm::{Arm, Owner};

/// Monitors the springs between motors and links.
pub struct Deflections {
    /// First coordinate, number of coordinates, and drive of each spring.
    springs: Vec<(usize, usize, usize)>,
    /// Maximum deflection per drive (rad or m).
    largest: Vec<f64>,
}

impl Deflections {
    /// Creates the monitor.
    ///
    /// * `n_drives`: number of drives of the robot.
    pub fn new(plant: &Plant, arm: &Arm, n_drives: usize) -> Self {
        let springs = plant.elements.iter().zip(&arm.owners).filter_map(|(element, owner)| match owner {
            // The translations of several springs do not count.
            Owner::Drive(_)
                if element.slides(&plant.model) && arm.owners.iter().filter(|o| *o == owner).count() > 1 =>
            {
                None
            }
            Owner::Drive(drive) => Some((element.coordinate, element.size, *drive)),
            Owner::Link(_) => None,
        });
        Self { springs: springs.collect(), largest: vec![0.0; n_drives] }
    }

    /// Takes a sample.
    ///
    /// * `q`: all coordinates of the model (rad or m).
    pub fn update(&mut self, q: &DVector<f64>) {
        for &(first, size, drive) in &self.springs {
            let e = q.rows(first, size);
            // For springs with six coordinates only the rotations count.
            let deflection = if size == 6 { e.rows(3, 3).norm() } else { e.norm() };
            self.largest[drive] = self.largest[drive].max(deflection);
        }
    }

    /// Returns the maximum deflection per drive (rad or m); 0 for rigid ones.
    pub fn result(&self) -> &[f64] {
        &self.largest
    }
}
