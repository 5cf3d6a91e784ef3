//! Tool error relative to the rigid arm, and its derivatives from those of the coordinates.

use flexarm_kinematics::{Data, ElasticAngles, Frame, forward_kinematics, frame_jacobian, rotation_vector};
use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3, Vector6};

use crate::arm::FlexibleArm;
use crate::run_slopes::Direction;
use crate::run_slopes::columns::add_product;
use crate::run_slopes::recurrence::Recurrence;

/// Tool error and derivatives at one time, with workspaces.
pub(super) struct ToolError {
    tool: Frame,
    /// Rigid arm: all elastic coordinates zero.
    rigid: Data,
    q: DVector<f64>,
    J: Matrix6xX<f64>,
    J_rigid: Matrix6xX<f64>,
    /// Derivatives of the tool pose as twists, for the flexible and for the rigid arm, p × 6.
    twists: DMatrix<f64>,
    rigid_twists: DMatrix<f64>,
    /// Change of the tool point per direction, tool axes.
    points: Vec<Vector3<f64>>,
    /// Columns of J for the free coordinates and for the joints; the latter are zero for free
    /// joints.
    J_free: Matrix6xX<f64>,
    J_joints: Matrix6xX<f64>,
    /// Whether any direction changes the motion of the joints.
    moves: bool,
    /// Derivatives of the error per direction, after [`ToolError::look`].
    pub(super) slopes: Vec<[f64; 6]>,
}

impl ToolError {
    pub(super) fn new(arm: &FlexibleArm, tool: &Frame, directions: &[Direction]) -> Self {
        let nv = arm.model.nv();
        Self {
            tool: tool.clone(),
            rigid: Data::new(&arm.model),
            q: DVector::zeros(nv),
            J: Matrix6xX::zeros(nv),
            J_rigid: Matrix6xX::zeros(nv),
            J_free: Matrix6xX::zeros(arm.n_free()),
            J_joints: Matrix6xX::zeros(arm.model.n_actuated()),
            twists: DMatrix::zeros(directions.len(), 6),
            rigid_twists: DMatrix::zeros(directions.len(), 6),
            points: directions.iter().map(|direction| direction.tool).collect(),
            moves: directions.iter().any(|direction| direction.motion.is_some()),
            slopes: vec![[0.0; 6]; directions.len()],
        }
    }

    /// Returns the error at the current time of the run: displacement and rotation vector, world
    /// axes.
    pub(super) fn look(&mut self, run: &Recurrence<'_>) -> Vector6<f64> {
        let (model, data) = run.poses();
        let m = model.n_actuated();
        self.q.fill(0.0);
        self.q.rows_mut(0, m).copy_from_slice(&run.reference[0]);
        forward_kinematics(model, &mut self.rigid, &self.q);
        let (X, X_rigid) = (data.X_WF(&self.tool), self.rigid.X_WF(&self.tool));
        let (R, R_rigid) = (X.rotation.matrix(), X_rigid.rotation.matrix());
        let turned = R * R_rigid.transpose();
        let theta = rotation_vector(&turned);
        let p = X.translation.vector - X_rigid.translation.vector;
        let error = Vector6::new(p.x, p.y, p.z, theta.x, theta.y, theta.z);
        if self.slopes.is_empty() {
            return error;
        }
        frame_jacobian(model, data, &self.tool, &mut self.J);
        if self.moves {
            frame_jacobian(model, &self.rigid, &self.tool, &mut self.J_rigid);
        }
        // w = B θ' in the axes of the rotated frame.
        let (_, B) = ElasticAngles::RotationVector.pose(&theta);
        let rates = B.try_inverse().unwrap_or(B) * turned.transpose();
        self.twists.fill(0.0);
        for (i, k) in run.free().iter().enumerate() {
            self.J_free.column_mut(i).copy_from(&self.J.column(*k));
        }
        add_product(&self.J_free, (0, 0), &run.x, &mut self.twists);
        if self.moves {
            for k in 0..m {
                let own = if run.free().contains(&k) { Vector6::zeros() } else { self.J.column(k).into_owned() };
                self.J_joints.set_column(k, &own);
            }
            add_product(&self.J_joints, (0, 0), &run.joints[0], &mut self.twists);
            self.rigid_twists.fill(0.0);
            add_product(&self.J_rigid, (0, 0), &run.joints[0], &mut self.rigid_twists);
        }
        for (k, slope) in self.slopes.iter_mut().enumerate() {
            let part =
                |twists: &DMatrix<f64>, c: usize| Vector3::new(twists[(k, c)], twists[(k, c + 1)], twists[(k, c + 2)]);
            let (twists, rigid) = (&self.twists, &self.rigid_twists);
            let moved = part(twists, 0) - part(rigid, 0) + (R - R_rigid) * self.points[k];
            let turning = rates * (part(twists, 3) - turned * part(rigid, 3));
            *slope = [moved.x, moved.y, moved.z, turning.x, turning.y, turning.z];
        }
        error
    }
}
