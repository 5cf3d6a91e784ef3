//! Which of the inverse kinematics' solutions a target means.

use flexarm_kinematics::{Data, Frame, IkOptions, Model, forward_kinematics, inverse_kinematics};
use flexarm_spatial::Pose;
use nalgebra::DVector;

use crate::program::Configuration;

/// Why there is no solution, as a sentence.
pub(crate) struct NoBranch(pub(crate) String);

/// The arm and a workspace.
pub(crate) struct Branches<'m> {
    model: &'m Model,
    data: Data,
}

impl<'m> Branches<'m> {
    pub(crate) fn new(model: &'m Model) -> Self {
        Self { model, data: Data::new(model) }
    }

    /// Pose of a frame at joint values, in the model's world.
    pub(crate) fn pose(&mut self, frame: &Frame, q: &DVector<f64>) -> Pose {
        forward_kinematics(self.model, &mut self.data, q);
        self.data.X_WF(frame)
    }

    /// Joint values of the branch that is meant.
    pub(crate) fn choose(
        &mut self,
        frame: &Frame,
        X: &Pose,
        configuration: &Configuration,
        q: &DVector<f64>,
        axes: &[usize],
    ) -> Result<DVector<f64>, NoBranch> {
        let mut near = q.clone();
        if let Configuration::Near(values) = configuration {
            for (value, &k) in values.iter().zip(axes) {
                near[k] = *value;
            }
        }
        inverse_kinematics(self.model, &mut self.data, frame, X, &near, &IkOptions::default())
            .map_err(|error| NoBranch(error.to_string()))
    }
}
