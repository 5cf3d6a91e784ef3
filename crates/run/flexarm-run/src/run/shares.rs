//! Contributions of each link, gearbox and servo to the maximum TCP error.
//!
//! ```text
//! x_flexible - x_rigid = ∫ J(q(s)) Δq ds,   q(s) = q_rigid + s Δq,   s from 0 to 1        (1)
//! ```
//! Each coordinate has its own term in `J Δq`, so the terms of all coordinates add up to the error.
//! Three-point Gauss quadrature has an error of seventh order in Δq.

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, Model, forward_kinematics, frame_jacobian};
use flexarm_stepping::Observation;
use nalgebra::{DVector, Matrix6xX, Vector3};

use crate::run::twin::RigidTwin;

/// Nodes and weights of Gauss quadrature on 0..1.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Coordinates at the maximum TCP error so far.
#[derive(Default)]
pub(super) struct AtPeak {
    size_m: f64,
    error: Vector3<f64>,
    model: Option<Arc<Model>>,
    rigid: DVector<f64>,
    flexible: DVector<f64>,
}

impl AtPeak {
    /// Stores the sample if its error is the largest so far; the first of equal ones is kept.
    pub(super) fn update(&mut self, error: &[f64; 6], observed: &Observation, twin: &RigidTwin) {
        let error = Vector3::from_row_slice(&error[..3]);
        if error.norm() > self.size_m {
            (self.size_m, self.error) = (error.norm(), error);
            self.model = Some(observed.model.clone());
            self.rigid.clone_from(&twin.state.q);
            self.flexible.clone_from(&observed.q);
        }
    }

    /// Returns the contribution of each coordinate along the direction of the error (m), and the
    /// remainder due to no coordinate: joint drift of steppers in maximal coordinates.
    pub(super) fn along(&self, tcp: &Frame) -> (Vec<f64>, f64) {
        let Some(model) = &self.model else { return (Vec::new(), 0.0) };
        let (mut data, mut J) = (Data::new(model), Matrix6xX::zeros(model.nv()));
        let change = &self.flexible - &self.rigid;
        let direction = self.error / self.size_m;
        let mut along = vec![0.0; model.nv()];
        for (place, weight) in GAUSS {
            forward_kinematics(model, &mut data, &(&self.rigid + &change * place));
            frame_jacobian(model, &data, tcp, &mut J);
            for ((along, column), change) in along.iter_mut().zip(J.column_iter()).zip(change.iter()) {
                *along += weight * change * direction.dot(&column.fixed_rows::<3>(0));
            }
        }
        let rest = self.size_m - along.iter().sum::<f64>();
        (along, rest)
    }
}
