//! Deflections of the gearboxes of elastic drives.

use flexarm_stepping::FlexibleArm;
use nalgebra::DVector;

use crate::flexible::{FlexibleRobot, Owner};

/// Monitors the springs between motors and links.
pub(crate) struct Deflections {
    /// First coordinate, number of coordinates, and drive of each spring.
    springs: Vec<(usize, usize, usize)>,
    /// Maximum deflection per drive (rad or m).
    largest: Vec<f64>,
}

impl Deflections {
    pub(crate) fn new(arm: &FlexibleArm, flexible: &FlexibleRobot, n_drives: usize) -> Self {
        let springs = arm.elements.iter().zip(&flexible.owners).filter_map(|(element, owner)| match owner {
            // The translations of several springs do not count.
            Owner::Drive(_)
                if element.slides(&arm.model) && flexible.owners.iter().filter(|o| *o == owner).count() > 1 =>
            {
                None
            }
            Owner::Drive(drive) => Some((element.coordinate, element.size, *drive)),
            Owner::Link(_) => None,
        });
        Self { springs: springs.collect(), largest: vec![0.0; n_drives] }
    }

    /// `q`: all coordinates of the model.
    pub(crate) fn update(&mut self, q: &DVector<f64>) {
        for &(first, size, drive) in &self.springs {
            let e = q.rows(first, size);
            // For springs with six coordinates only the rotations count.
            let deflection = if size == 6 { e.rows(3, 3).norm() } else { e.norm() };
            self.largest[drive] = self.largest[drive].max(deflection);
        }
    }

    /// Returns the maximum deflection per drive (rad or m); 0 for rigid ones.
    pub(crate) fn result(&self) -> &[f64] {
        &self.largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gearbox_of_six_coordinates_is_judged_by_its_rotations() {
        let mut seen = Deflections { springs: vec![(1, 6, 0), (7, 1, 2)], largest: vec![0.0; 3] };
        seen.update(&DVector::from_row_slice(&[9.0, 5.0, 5.0, 5.0, 0.0, 3.0, -4.0, -2.0]));
        seen.update(&DVector::from_row_slice(&[9.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
        assert_eq!(seen.result(), [5.0, 0.0, 2.0]);
    }
}
