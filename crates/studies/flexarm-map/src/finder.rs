//! Inverse kinematics: joint positions for a TCP pose, all branches, in closed form where the arm
//! has one.

use flexarm_kinematics::{
    AnalyticArm, Data, Frame, IkOptions, Model, Pose, Solutions, forward_kinematics, frame_jacobian,
    inverse_kinematics_from_many_starts,
};
use nalgebra::{DVector, Matrix6xX};

/// Number of starts of the search for arms without a closed form.
const STARTS: usize = 12;

/// Inverse kinematics solver with its buffers.
#[derive(Clone)]
pub(super) struct Finder<'m> {
    model: &'m Model,
    tool: Frame,
    closed: Option<AnalyticArm>,
    solutions: Solutions,
    data: Data,
    /// Positions of the joints that the TCP pose leaves free, and reference for the choice among
    /// solutions that differ by whole turns (rad or m).
    near: Vec<f64>,
    /// Position of the first joint (m, world x and y).
    foot: [f64; 2],
}

impl<'m> Finder<'m> {
    pub(super) fn new(model: &'m Model, tool: Frame, near: Vec<f64>) -> Self {
        let closed = AnalyticArm::new(model, &tool).ok();
        let mut data = Data::new(model);
        let mut q = DVector::zeros(model.nv());
        q.rows_mut(0, near.len()).copy_from_slice(&near);
        forward_kinematics(model, &mut data, &q);
        // Body 0 is the world, so the first joint carries body 1.
        let foot = data.X_WB.get(1).map_or([0.0; 2], |X| [X.translation.x, X.translation.y]);
        Self { model, tool, closed, solutions: Solutions::default(), data, near, foot }
    }

    /// Returns the distance of a place from the vertical line through the first joint (m).
    pub(super) fn distance_from_foot(&self, [x, y, _]: [f64; 3]) -> f64 {
        (x - self.foot[0]).hypot(y - self.foot[1])
    }

    /// Whether the arm has a closed form, which finds all branches quickly.
    pub(super) fn is_closed(&self) -> bool {
        self.closed.is_some()
    }

    /// Returns the number of joints that move the TCP.
    pub(super) fn joints(&mut self) -> usize {
        if self.closed.is_some() {
            return 6;
        }
        // Evaluate at a generic pose, where no joint axis passes through the TCP by chance.
        let mut q = DVector::zeros(self.model.nv());
        q.iter_mut().enumerate().for_each(|(k, q)| *q = 0.3 + 0.17 * k as f64);
        forward_kinematics(self.model, &mut self.data, &q);
        let mut J = Matrix6xX::zeros(self.model.nv());
        frame_jacobian(self.model, &self.data, &self.tool, &mut J);
        (0..self.model.n_actuated()).filter(|&k| J.column(k).norm() > 1e-9).count()
    }

    /// Appends to the cleared `found` the joint positions within the limits for a TCP pose, one set
    /// per branch.
    pub(super) fn find(&mut self, X_WT: &Pose, found: &mut Vec<f64>) {
        found.clear();
        let Some(arm) = &self.closed else { return self.search(X_WT, found) };
        let joints = *arm.joints();
        let near = joints.map(|k| self.near[k]);
        arm.solve_near(X_WT, &near, &mut self.solutions);
        for solution in self.solutions.iter() {
            if let Some(six) = arm.nearest_within_limits(&solution.q, &near) {
                let first = found.len();
                found.extend_from_slice(&self.near);
                joints.iter().zip(six).for_each(|(&k, q)| found[first + k] = q);
            }
        }
    }

    /// Appends the solutions that a numerical search finds from several starts.
    fn search(&mut self, X_WT: &Pose, found: &mut Vec<f64>) {
        let options = IkOptions { max_iterations: 60, ..IkOptions::default() };
        let near = DVector::from_column_slice(&self.near);
        let (model, tool) = (self.model, &self.tool);
        if let Ok(all) = inverse_kinematics_from_many_starts(model, &mut self.data, tool, X_WT, &near, &options, STARTS)
        {
            all.iter().for_each(|one| found.extend_from_slice(&one.q.as_slice()[..self.near.len()]));
        }
    }
}
