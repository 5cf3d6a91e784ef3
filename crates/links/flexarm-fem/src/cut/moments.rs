//! Mass moments of order 0, 1 and 2 about a fixed point.
//!
//! `∫ dm`, `∫ r dm`, `∫ r rᵀ dm` add over pieces; only [`Moments::rigid_part`] turns them into
//! mass, centre of mass and inertia. Axes of the mesh; kg, m. Not here: integrals over solids
//! (`piece.rs`).

use nalgebra::{Matrix3, Vector3};

use crate::error::{FemError, positive};
use crate::mesh::BeamProperties;
use crate::rigid_part::RigidPart;
use crate::section::Section;

/// `∫ dm` (kg), `∫ r dm` (kg·m), `∫ r rᵀ dm` (kg·m²) with `r` measured from `origin`, mesh axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    pub(super) origin: Vector3<f64>,
    pub(super) mass: f64,
    pub(super) first: Vector3<f64>,
    pub(super) second: Matrix3<f64>,
}

impl Moments {
    pub(super) fn about(origin: Vector3<f64>) -> Self {
        Self { origin, mass: 0.0, first: Vector3::zeros(), second: Matrix3::zeros() }
    }

    /// Adds a point mass at `r` from the origin.
    pub(super) fn add_point(&mut self, mass: f64, r: &Vector3<f64>) {
        self.mass += mass;
        self.first += r * mass;
        self.second += r * r.transpose() * mass;
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first += other.first;
        self.second += other.second;
    }

    pub(super) fn subtract(&mut self, other: &Self) {
        self.add(&other.times(-1.0));
    }

    pub(super) fn times(&self, factor: f64) -> Self {
        Self { origin: self.origin, mass: self.mass * factor, first: self.first * factor, second: self.second * factor }
    }

    /// Rigid part with the inertia `I = tr(S) 1 - S`, S shifted to the centre of mass.
    pub(super) fn rigid_part(&self) -> RigidPart {
        let c = self.first / self.mass;
        let S = self.second - c * c.transpose() * self.mass;
        RigidPart { mass: self.mass, com: self.origin + c, inertia: Matrix3::identity() * S.trace() - S }.symmetrised()
    }
}

/// Straight uniform line of mass with the second moments of its section.
pub(super) struct Line {
    start: Vector3<f64>,
    along: Vector3<f64>,
    mass: f64,
    /// `∫ r rᵀ dm` of the cross sections about the axis.
    section: Matrix3<f64>,
}

impl Line {
    /// Creates the line of a beam element between two nodes, mesh axes, m.
    ///
    /// * `density`: kg/m³, unless the section has its own mass.
    pub(super) fn new(
        beam: &BeamProperties,
        density: f64,
        start: Vector3<f64>,
        end: Vector3<f64>,
    ) -> Result<Self, FemError> {
        let along = end - start;
        let length = positive("length of a beam element (m)", along.norm())?;
        let e_x = along / length;
        let across = beam.y_axis - e_x * e_x.dot(&beam.y_axis);
        let direction = positive("part of the section's y axis across the beam", across.norm())?;
        let e_y = across / direction;
        let e_z = e_x.cross(&e_y);

        // rotary_z = ∫ y² dm per length: about z, from mass distributed along y.
        let (mass_per_length, rotary_y, rotary_z) = match beam.section {
            Section::Given(bar) => (bar.mass_per_length, bar.rotary_y, bar.rotary_z),
            shape => {
                // Poisson's ratio only affects shear factors, not the mass.
                let s = shape.properties(0.3)?;
                (density * s.A, density * s.I_y, density * s.I_z)
            }
        };
        let section = (e_y * e_y.transpose() * rotary_z + e_z * e_z.transpose() * rotary_y) * length;
        Ok(Self { start, along, mass: mass_per_length * length, section })
    }

    /// Moments of the piece between two fractions of the length, about `origin` (mesh axes, m).
    pub(super) fn piece(&self, from: f64, to: f64, origin: &Vector3<f64>) -> Moments {
        let share = to - from;
        let mut moments = Moments::about(*origin);
        let middle = self.start + self.along * (0.5 * (from + to)) - origin;
        moments.add_point(self.mass * share, &middle);
        let half = self.along * share;
        moments.second += half * half.transpose() * (self.mass * share / 12.0) + self.section * share;
        moments
    }
}
