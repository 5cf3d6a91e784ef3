//! Joint values that bring the tool to a place: every branch, in closed form where the arm has one.

use flexarm_kinematics::{
    AnalyticArm, Data, Frame, IkOptions, Model, Pose, Solutions, forward_kinematics, frame_jacobian,
    inverse_kinematics_from_many_starts,
};
use nalgebra::{DVector, Matrix6xX};

/// Starts of the search for arms without a closed form.
const STARTS: usize = 12;

/// Inverse kinematics with its workspace.
#[derive(Clone)]
pub(super) struct Finder<'m> {
    model: &'m Model,
    tool: Frame,
    closed: Option<AnalyticArm>,
    solutions: Solutions,
    data: Data,
    /// Where joints stay that the tool's pose leaves free, and what copies by whole turns are to be
    /// near (rad or m).
    near: Vec<f64>,
    /// Where the first joint is (m, world, seen from above).
    foot: [f64; 2],
}

impl<'m> Finder<'m> {
    pub(super) fn new(model: &'m Model, tool: Frame, near: Vec<f64>) -> Self {
        let closed = AnalyticArm::new(model, &tool).ok();
        let mut data = Data::new(model);
        let mut q = DVector::zeros(model.nv());
        q.rows_mut(0, near.len()).copy_from_slice(&near);
        forward_kinematics(model, &mut data, &q);
        // The world is the body before the first.
        let foot = data.X_WB.get(1).map_or([0.0; 2], |X| [X.translation.x, X.translation.y]);
        Self { model, tool, closed, solutions: Solutions::default(), data, near, foot }
    }

    /// Distance of a place from the upright line through the first joint (m).
    pub(super) fn distance_from_foot(&self, [x, y, _]: [f64; 3]) -> f64 {
        (x - self.foot[0]).hypot(y - self.foot[1])
    }

    /// Whether all branches are found, quickly.
    pub(super) fn is_closed(&self) -> bool {
        self.closed.is_some()
    }

    /// Number of joints that move the tool.
    pub(super) fn joints(&mut self) -> usize {
        if self.closed.is_some() {
            return 6;
        }
        // At a pose where no axis goes through the tool by chance.
        let mut q = DVector::zeros(self.model.nv());
        q.iter_mut().enumerate().for_each(|(k, q)| *q = 0.3 + 0.17 * k as f64);
        forward_kinematics(self.model, &mut self.data, &q);
        let mut J = Matrix6xX::zeros(self.model.nv());
        frame_jacobian(self.model, &self.data, &self.tool, &mut J);
        (0..self.model.n_actuated()).filter(|&k| J.column(k).norm() > 1e-9).count()
    }

    /// Joint values within the limits at which the tool has the pose, one per branch, after each
    /// other into `found`.
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
