//! What may be unknown of an arm, and the arm with given values of it.

use std::sync::Arc;

use flexarm_kinematics::{Frame, Model, SpatialInertia};
use flexarm_stepping::{FlexibleArm, GearCoupling, Held, Spring, StepError};
use nalgebra::DMatrix;

/// An arm before anything is measured: tree, springs in coordinate order, tool.
#[derive(Clone, Debug)]
pub struct Plant {
    /// The tree.
    pub model: Arc<Model>,
    /// Its springs, one per elastic group.
    pub springs: Vec<Spring>,
    /// The tool.
    pub tool: Frame,
    /// Gears that move several joints; their springs above are those of the motors.
    pub coupling: Option<GearCoupling>,
}

/// Where a stiffness or a damping acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Number of the spring.
    pub spring: usize,
    /// One of its coordinates; all of them without.
    pub coordinate: Option<usize>,
}

/// What a parameter does.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Factor on the stiffness of springs. On one coordinate of a spring K becomes `S K S` with `√factor` there, so that it stays
    /// symmetric and positive definite.
    Stiffness(Vec<Place>),
    /// Factor on the damping of springs, whatever describes it.
    Damping(Vec<usize>),
    /// Mass (kg) on a body with inertia in proportion: `per_kg` about Bo, B axes.
    Mass {
        /// The body.
        body: usize,
        /// Inertia of a kilogram of it.
        per_kg: SpatialInertia,
    },
}

/// Something unknown of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name for people, as in robot files.
    pub name: String,
    /// Unit of its value.
    pub unit: String,
    /// Value in the arm as it is.
    pub initial: f64,
    /// Standard deviation of what is known before: of the logarithm for stiffnesses and dampings, in the unit else.
    pub prior: f64,
    /// What it does.
    pub effect: Effect,
}

impl Parameter {
    /// Whether the search goes along its logarithm, so that it stays positive.
    pub fn is_logarithmic(&self) -> bool {
        matches!(self.effect, Effect::Stiffness(_) | Effect::Damping(_))
    }

    /// Value at a coordinate of the search, which is 0 at the initial value.
    pub fn value(&self, x: f64) -> f64 {
        if self.is_logarithmic() { self.initial * x.exp() } else { self.initial + x }
    }

    /// Standard deviation of the value, to first order, from that of the search's coordinate.
    pub fn deviation(&self, x: f64, std: f64) -> f64 {
        if self.is_logarithmic() { self.value(x) * std } else { std }
    }

    /// Interval of the value, so many deviations to each side.
    pub fn interval(&self, x: f64, std: f64, deviations: f64) -> [f64; 2] {
        [self.value(x - deviations * std), self.value(x + deviations * std)]
    }
}

impl Plant {
    /// The plant with parameters at coordinates `x` of the search.
    #[must_use]
    pub fn with(&self, parameters: &[Parameter], x: &[f64]) -> Self {
        let mut plant = self.clone();
        for (parameter, x) in parameters.iter().zip(x) {
            match &parameter.effect {
                Effect::Stiffness(places) => {
                    for place in places {
                        stiffen(&mut plant.springs[place.spring], place.coordinate, x.exp());
                    }
                }
                Effect::Damping(springs) => {
                    for spring in springs {
                        let spring = &mut plant.springs[*spring];
                        spring.damping = spring.damping.scaled(x.exp());
                    }
                }
                Effect::Mass { body, per_kg } => plant = plant.carrying(*body, &scaled(per_kg, *x)),
            }
        }
        plant
    }

    /// The plant with inertia added to a body (about Bo, B axes).
    #[must_use]
    pub fn carrying(&self, body: usize, inertia: &SpatialInertia) -> Self {
        let mut sum = self.model.bodies()[body].inertia;
        sum += *inertia;
        Self { model: Arc::new(self.model.with_inertia(body, sum)), ..self.clone() }
    }

    /// The arm held at a pose.
    ///
    /// # Errors
    /// As [`FlexibleArm::new`] and [`FlexibleArm::with_coupling`].
    pub fn held(&self, q: &[f64]) -> Result<FlexibleArm, StepError> {
        let arm = FlexibleArm::new(self.model.clone(), self.springs.clone(), Arc::new(Held(q.to_vec())))?;
        match &self.coupling {
            Some(coupling) => arm.with_coupling(coupling.clone()),
            None => Ok(arm),
        }
    }
}

/// So many kilograms of it.
pub(crate) fn scaled(per_kg: &SpatialInertia, kg: f64) -> SpatialInertia {
    SpatialInertia {
        mass: kg * per_kg.mass,
        first_moment: kg * per_kg.first_moment,
        rotational: kg * per_kg.rotational,
    }
}

fn stiffen(spring: &mut Spring, coordinate: Option<usize>, factor: f64) {
    match coordinate {
        None => {
            spring.K *= factor;
            spring.curve = spring.curve.as_ref().map(|curve| curve.scaled(factor));
        }
        Some(k) => {
            let root = factor.sqrt();
            spring.K.row_mut(k).scale_mut(root);
            spring.K.column_mut(k).scale_mut(root);
            if spring.K.nrows() == 1 {
                spring.curve = spring.curve.as_ref().map(|curve| curve.scaled(factor));
            }
        }
    }
}

/// `dK/d(ln factor)` of a spring's matrix.
pub(crate) fn slope_of(K: &DMatrix<f64>, coordinate: Option<usize>) -> DMatrix<f64> {
    match coordinate {
        None => K.clone(),
        Some(k) => {
            DMatrix::from_fn(K.nrows(), K.ncols(), |i, j| 0.5 * K[(i, j)] * (f64::from(i == k) + f64::from(j == k)))
        }
    }
}
