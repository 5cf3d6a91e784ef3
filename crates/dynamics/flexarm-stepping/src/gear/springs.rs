//! Springs of an arm with gear laws: deflections, forces, and reactions on the motors.
//!
//! e: elastic coordinates, q: all coordinates, δ, F: (1) and (2) of the module. Not here: sliders
//! during a run (`state`).

use nalgebra::DVector;

use crate::error::StepError;
use crate::guide::Guide;
use crate::plant::{ElasticElement, Plant};
use crate::statics::spring_forces;

impl Plant {
    /// Returns the deflection δ (rad, m) of a spring with one coordinate e, with the joints at `q`:
    /// e minus the transmission error, if any.
    pub fn deflection(&self, element: usize, e: f64, q: &[f64]) -> f64 {
        let errors = self.transmission.iter().filter(|error| error.element == element);
        errors.fold(e, |delta, error| delta - error.at(q[error.motor]))
    }

    /// Returns the slope of a nonlinear spring for small motions about the coordinates `q`: no
    /// slider slips, and within backlash the steepest slope counts. `None` for a linear spring.
    pub fn vibration_slope(&self, element: usize, q: &[f64]) -> Option<f64> {
        let own = &self.elements[element];
        let curve = own.curve.as_ref()?;
        let delta = self.deflection(element, q[own.coordinate], q);
        Some(match &own.hysteresis {
            Some(law) => law.stuck_slope(delta),
            None => curve.slope_beyond_play(delta, q),
        })
    }

    /// Returns the forces of the springs and the energy of each element, at rest with all
    /// coordinates at `q`.
    ///
    /// The forces are over the elastic coordinates (N, N m). For coupled gears the energy is the
    /// share of the joint, `F e / 2`.
    ///
    /// # Panics
    /// If `q` is not nv long.
    pub fn springs_at_rest(&self, q: &DVector<f64>) -> (DVector<f64>, Vec<f64>) {
        self.model.check_size("q", q.len());
        let e = q.rows(self.model.n_actuated(), self.model.n_elastic()).into_owned();
        let F = spring_forces(self, q.as_slice(), &e);
        let energy = |(k, element): (usize, &ElasticElement)| {
            let first = self.offset(element);
            let own = &e.as_slice()[first..first + element.size];
            match element.size {
                1 if self.cross_stiffness.iter().any(|(i, j, _)| *i == first || *j == first) => 0.5 * F[first] * own[0],
                1 => element.energy(&[self.deflection(k, own[0], q.as_slice())], q.as_slice()),
                _ => element.energy(own, q.as_slice()),
            }
        };
        let energies = self.elements.iter().enumerate().map(energy).collect();
        (F, energies)
    }

    /// Returns the largest friction torque of the gears with hysteresis (N m or N); a scale for the
    /// force balance, in which smaller residuals do not count.
    pub(crate) fn friction_of_gears(&self) -> f64 {
        let laws = self.elements.iter().filter_map(|element| element.hysteresis.as_ref());
        laws.map(|law| law.sliders.iter().map(|s| s.stiffness * s.reach).sum()).fold(0.0, f64::max)
    }

    /// Adds the cross stiffness of coupled springs: `f += K x`.
    pub(crate) fn add_cross_forces(&self, x: &[f64], f: &mut [f64]) {
        for &(i, j, k) in &self.cross_stiffness {
            f[i] += k * x[j];
            f[j] += k * x[i];
        }
    }

    /// Returns whether any gear has hysteresis.
    pub fn has_hysteresis(&self) -> bool {
        self.elements.iter().any(|element| element.hysteresis.is_some())
    }

    /// Returns whether any joint has a telescopic guide.
    pub(crate) fn has_guides(&self) -> bool {
        self.guides().next().is_some()
    }

    fn guides(&self) -> impl Iterator<Item = (&ElasticElement, &Guide)> {
        self.elements.iter().filter_map(|element| Some((element, element.curve.as_ref()?.guide()?)))
    }

    /// Returns the error for the first guide whose tubes are apart or without stiffness with the
    /// joints at `q`, if any.
    pub(crate) fn apart(&self, q: &[f64]) -> Option<StepError> {
        let apart = |(element, guide): (&ElasticElement, &Guide)| {
            let overlap = guide.overlap(q);
            let compliance = guide.compliance(overlap);
            let fine = overlap > 0.0 && compliance > 0.0;
            (!fine).then(|| StepError::Apart { name: element.name.clone(), overlap, compliance })
        };
        self.guides().find_map(apart)
    }

    /// Adds the reactions of transmission errors, equation (4), and of guides on the motors, for
    /// the spring forces F and all coordinates `q`, to `tau` over all joints.
    pub(crate) fn add_motor_forces(&self, q: &[f64], F: &[f64], tau: &mut [f64]) {
        for error in &self.transmission {
            tau[error.motor] -= error.slope(q[error.motor]) * F[self.offset(&self.elements[error.element])];
        }
        for (element, guide) in self.guides() {
            tau[guide.coordinate] += guide.reaction(q[element.coordinate], q);
        }
    }
}
