//! Arms with gear laws: checks, and effect of the laws on springs and dampers.
//!
//! C, K and θ are those of (5) of the module: here C are the gears, not a compliance.

use nalgebra::DMatrix;

use crate::error::StepError;
use crate::gear::coupling::GearCoupling;
use crate::gear::transmission::TransmissionError;
use crate::plant::{Damping, Plant};

impl Plant {
    /// Returns the arm with gears that couple several joints. Springs, dampers and friction given
    /// so far are those of the motors after their gears; they are transformed to the joints.
    ///
    /// # Errors
    /// [`StepError::Setup`] if sizes differ, or if springs have more than one coordinate, are
    /// nonlinear or are missing for some motors; errors of [`Plant::new`].
    pub fn with_coupling(mut self, coupling: GearCoupling) -> Result<Self, StepError> {
        let n = coupling.coordinates.len();
        let single = |k: &usize| self.elements.get(*k).is_some_and(|e| e.size == 1 && e.curve.is_none());
        let fits = coupling.C.shape() == (n, n) && coupling.C_inverse.shape() == (n, n);
        if !(fits
            && (coupling.elements.is_empty() || coupling.elements.len() == n)
            && coupling.elements.iter().all(single))
        {
            return Err(StepError::Setup(format!(
                "a coupling of {n} joints needs {n} straight springs of one coordinate, or none, and a {n}x{n} matrix"
            )));
        }
        // Stiffness and damping over the joints: C^-T diag(k) C^-1.
        let (mut stiffness, mut damping) = (Vec::new(), Vec::new());
        for &k in &coupling.elements {
            let element = &self.elements[k];
            stiffness.push(element.K[(0, 0)]);
            damping.push(if let Damping::Dampers(d) = element.damping { d[0] } else { 0.0 });
        }
        let K = GearCoupling::on_joints(&coupling.C_inverse, &per_motor(n, &stiffness));
        let D = GearCoupling::on_joints(&coupling.C_inverse, &per_motor(n, &damping));
        // Off-diagonal entries become cross terms, the diagonal replaces that of the motors' springs.
        for (i, &k) in coupling.elements.iter().enumerate() {
            let row = self.offset(&self.elements[k]);
            for (j, &l) in coupling.elements.iter().enumerate().skip(i + 1) {
                let column = self.offset(&self.elements[l]);
                self.cross_stiffness.extend((K[(i, j)] != 0.0).then_some((row, column, K[(i, j)])));
                self.cross_damping.extend((D[(i, j)] != 0.0).then_some((row, column, D[(i, j)])));
            }
            let element = &mut self.elements[k];
            element.K[(0, 0)] = K[(i, i)];
            element.C[(0, 0)] = 1.0 / K[(i, i)];
            match &mut element.damping {
                Damping::Dampers(d) => d[0] = D[(i, i)],
                _ if D[(i, i)] != 0.0 => self.cross_damping.push((row, row, D[(i, i)])),
                _ => {}
            }
        }
        self.coupling = Some(coupling);
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns the arm with transmission errors.
    ///
    /// # Errors
    /// [`StepError::Setup`] if an element does not exist or has more than one coordinate; errors of
    /// [`Plant::new`].
    pub fn with_transmission_errors(mut self, errors: Vec<TransmissionError>) -> Result<Self, StepError> {
        for error in &errors {
            let single = self.elements.get(error.element).is_some_and(|e| e.size == 1);
            if !single || error.motor >= self.model.n_actuated() {
                let text =
                    format!("transmission error of element {}: it needs a spring of one coordinate", error.element);
                return Err(StepError::Setup(text));
            }
        }
        self.transmission = errors;
        self.update_modes_and_damping()?;
        Ok(self)
    }

    /// Returns `dK/d(ln k)` for the stiffness k of one motor's spring in coupled gears: the elastic
    /// coordinates of all coupled springs, and the matrix over them. `None` if the element is not
    /// coupled.
    pub fn coupled_stiffness_slope(&self, element: usize) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let coupling = self.coupling.as_ref()?;
        let motor = coupling.elements.iter().position(|k| *k == element)?;
        let places: Vec<usize> = coupling.elements.iter().map(|k| self.offset(&self.elements[*k])).collect();
        let K = self.stiffness().select_rows(&places).select_columns(&places);
        let own = (coupling.C.tr_mul(&K) * &coupling.C)[(motor, motor)];
        let row = coupling.C_inverse.row(motor);
        Some((places, row.tr_mul(&row) * own))
    }

    /// Returns `dD/d(ln d)` for the damper d of one motor in coupled gears, in the form of
    /// [`Plant::coupled_stiffness_slope`].
    pub fn coupled_damping_slope(&self, element: usize) -> Option<(Vec<usize>, DMatrix<f64>)> {
        let coupling = self.coupling.as_ref()?;
        let motor = coupling.elements.iter().position(|k| *k == element)?;
        let places: Vec<usize> = coupling.elements.iter().map(|k| self.offset(&self.elements[*k])).collect();
        // Dampers only: other damping is derived from the modes.
        let mut D = DMatrix::zeros(places.len(), places.len());
        for (i, k) in coupling.elements.iter().enumerate() {
            D[(i, i)] = if let Damping::Dampers(d) = self.elements[*k].damping { d[0] } else { 0.0 };
        }
        let place = |row: usize| places.iter().position(|k| *k == row);
        for &(row, column, d) in &self.cross_damping {
            let (Some(i), Some(j)) = (place(row), place(column)) else { continue };
            (D[(i, j)], D[(j, i)]) = (d, d);
        }
        let own = (coupling.C.tr_mul(&D) * &coupling.C)[(motor, motor)];
        let row = coupling.C_inverse.row(motor);
        Some((places, row.tr_mul(&row) * own))
    }

    /// Returns whether any gear has a transmission error, hysteresis, load-dependent friction or
    /// coupling, or any joint a telescopic guide.
    pub(crate) fn has_gear_laws(&self) -> bool {
        !(self.transmission.is_empty() && self.load_friction.is_empty())
            || self.has_hysteresis()
            || self.has_guides()
            || self.coupling.as_ref().is_some_and(|coupling| !coupling.is_none())
    }
}

/// Returns the values per motor; zeros if the gears are rigid.
fn per_motor(n: usize, values: &[f64]) -> Vec<f64> {
    if values.is_empty() { vec![0.0; n] } else { values.to_vec() }
}
