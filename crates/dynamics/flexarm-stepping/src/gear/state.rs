//! Gear state of a run: slider positions, and the forces of the last evaluation.
//!
//! Over the elastic coordinates: deflection δ and its rate, forces F; (1) to (3) of the module. Not
//! here: the laws (`hysteresis`, `transmission`), forces on the motors (`springs`, `friction`).

use nalgebra::{DVector, Vector6};

use crate::dense::add_product;
use crate::drive::SpringCurve;
use crate::gear::hysteresis::SliderState;
use crate::plant::{ElasticElement, Plant};

/// Gear state of a run: slider positions, and the forces of the last evaluation.
#[derive(Clone, Debug)]
pub(crate) struct GearState {
    /// Actuated joints at the last evaluation.
    q: Vec<f64>,
    /// Deflections and their rates, per elastic coordinate.
    pub(crate) delta: DVector<f64>,
    pub(crate) rate: DVector<f64>,
    /// Forces of springs and dampers at these deflections.
    pub(crate) F: DVector<f64>,
    /// Share of the dampers.
    damper: DVector<f64>,
    /// Friction per actuated coordinate.
    pub(crate) friction: Vec<f64>,
    /// Sliders of each element; `None` without hysteresis.
    slipped: Vec<Option<SliderState>>,
    /// Energy lost to hysteresis so far (J).
    pub(crate) lost: f64,
}

impl GearState {
    /// Creates the state if the arm has gear laws.
    pub(crate) fn of(plant: &Plant) -> Option<Box<Self>> {
        let (zeros, elements) = (DVector::zeros(plant.model.n_elastic()), plant.elements.iter());
        plant.has_gear_laws().then(|| {
            Box::new(Self {
                q: vec![0.0; plant.model.n_actuated()],
                delta: zeros.clone(),
                rate: zeros.clone(),
                F: zeros.clone(),
                damper: zeros,
                friction: vec![0.0; plant.model.n_actuated()],
                slipped: elements.map(|element| element.hysteresis.as_ref().map(SliderState::at_rest)).collect(),
                lost: 0.0,
            })
        })
    }

    /// Computes springs and dampers at elastic coordinates `e` and rates `v`, with the joints at
    /// `q` and `qdot`.
    pub(crate) fn update(&mut self, plant: &Plant, q: &[f64], qdot: &[f64], e: &[f64], v: &[f64]) {
        let Self { q: joints, delta, rate, F, damper, slipped, .. } = self;
        let actuated = joints.len();
        joints.copy_from_slice(&q[..actuated]);
        // Deflections (1) and their rates.
        delta.as_mut_slice().copy_from_slice(e);
        rate.as_mut_slice().copy_from_slice(v);
        for error in &plant.transmission {
            let k = plant.offset(&plant.elements[error.element]);
            delta[k] -= error.at(q[error.motor]);
            rate[k] -= error.slope(q[error.motor]) * qdot[error.motor];
        }
        // Dampers: D δ̇.
        damper.fill(0.0);
        if plant.proportional {
            for (element, tau) in plant.elements.iter().zip(&plant.tau) {
                let range = plant.offset(element)..plant.offset(element) + element.size;
                add_product(
                    element.K.as_slice(),
                    &rate.as_slice()[range.clone()],
                    &mut damper.as_mut_slice()[range.clone()],
                );
                damper.as_mut_slice()[range].iter_mut().for_each(|d| *d *= tau);
            }
        } else {
            plant.add_damping(rate.as_slice(), damper.as_mut_slice());
        }
        // Springs: equation (2).
        F.copy_from(damper);
        for (element, slipped) in plant.elements.iter().zip(&*slipped) {
            let range = plant.offset(element)..plant.offset(element) + element.size;
            match element.hysteresis.as_ref().zip(slipped.as_ref()) {
                Some((law, slipped)) => {
                    let delta = delta[range.start];
                    F[range.start] += law.elastic.torque(delta) + slipped.torque(law, delta);
                }
                None => {
                    element.add_spring_force(&delta.as_slice()[range.clone()], q, &mut F.as_mut_slice()[range]);
                }
            }
        }
        plant.add_cross_forces(delta.as_slice(), F.as_mut_slice());
    }

    /// Returns the slope of a nonlinear spring with one coordinate at its last deflection.
    pub(crate) fn slope(&self, plant: &Plant, k: usize, element: &ElasticElement, curve: &SpringCurve) -> f64 {
        let delta = self.delta[plant.offset(element)];
        match element.hysteresis.as_ref().zip(self.slipped[k].as_ref()) {
            Some((law, slipped)) => law.elastic.slope(delta) + slipped.slope(law, delta),
            None => curve.slope(delta, &self.q),
        }
    }

    /// Writes the loads `-F` of the elements; returns the power dissipated by the dampers (W).
    pub(crate) fn loads(&self, plant: &Plant, loads: &mut [Vector6<f64>]) -> f64 {
        for (load, element) in loads.iter_mut().zip(&plant.elements) {
            let first = plant.offset(element);
            *load = Vector6::from_fn(|c, _| if c < element.size { -self.F[first + c] } else { 0.0 });
        }
        self.damper.dot(&self.rate)
    }

    /// Returns the energy in the springs at the last deflections (J).
    pub(crate) fn energy(&self, plant: &Plant) -> f64 {
        let mut energy = 0.0;
        for (element, slipped) in plant.elements.iter().zip(&self.slipped) {
            let delta = &self.delta.as_slice()[plant.offset(element)..][..element.size];
            energy += match element.hysteresis.as_ref().zip(slipped.as_ref()) {
                Some((law, slipped)) => law.elastic.energy(delta[0]) + slipped.energy(law, delta[0]),
                None => element.energy(delta, &self.q),
            };
        }
        energy + plant.cross_stiffness.iter().map(|&(i, j, k)| k * self.delta[i] * self.delta[j]).sum::<f64>()
    }

    /// Accepts the end of a step with the joints at `q` and the elastic coordinates at `e`: moves
    /// the sliders by (3) and adds their losses. The first call of a run moves them along the first
    /// loading curve.
    pub(crate) fn settle(&mut self, plant: &Plant, q: &[f64], e: &[f64]) {
        for (k, (element, slipped)) in plant.elements.iter().zip(&mut self.slipped).enumerate() {
            let Some((law, slipped)) = element.hysteresis.as_ref().zip(slipped.as_mut()) else { continue };
            let delta = plant.deflection(k, e[plant.offset(element)], q);
            self.lost += slipped.advance(law, delta);
        }
    }

    /// Moves the sliders as [`GearState::settle`] does, for the time before the run: without
    /// losses.
    pub(crate) fn begin(&mut self, plant: &Plant, q: &[f64], e: &[f64]) {
        self.settle(plant, q, e);
        self.lost = 0.0;
    }
}
