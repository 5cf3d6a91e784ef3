//! Loads of planned measurements that the drives can hold.
//!
//! Efforts are those of the rigid arm's drives at rest, linear in the applied force. Frames: force
//! in world axes at a point of the tool.

use flexarm_kinematics::Wrench;
use flexarm_run::{Arm, Error};
use nalgebra::{Matrix6xX, Rotation3, Vector3};

/// Maximum force of a plan by default (N).
const LARGEST: f64 = 500.0;
/// Share of the force that the limits allow at half of the poses.
const SHARE: f64 = 0.5;
/// Minimum force worth hanging on (N).
const SMALLEST: f64 = 1.0;

/// Holding efforts at a pose, Jacobian of the joints and orientation of the tool.
type AtPose = (Vec<f64>, Matrix6xX<f64>, Rotation3<f64>);

/// Efforts of the drives at candidate poses under the arm's weight.
pub(super) struct Efforts {
    joints: Vec<String>,
    limits: Vec<f64>,
    /// `None` for poses without equilibrium.
    poses: Vec<Option<AtPose>>,
}

impl Efforts {
    pub(super) fn of(arm: &Arm, poses: &[Vec<f64>]) -> Result<Self, Error> {
        let mut at = arm.operating_point()?;
        let model = &arm.model;
        let actuated = &model.coordinates()[..model.n_actuated()];
        let mut pose = |q: &Vec<f64>| {
            at.solve(q, &Wrench::zeros()).ok()?;
            let J = at.jacobian().columns(0, actuated.len()).into_owned();
            Some((at.holding_efforts().to_vec(), J, at.tcp_pose().rotation))
        };
        Ok(Self {
            joints: arm.joints().map(str::to_owned).collect(),
            limits: actuated.iter().map(|c| c.limits.effort).collect(),
            poses: poses.iter().map(&mut pose).collect(),
        })
    }

    /// Returns the effort of each joint at a pose per newton along a force at a point (tool axes).
    fn per_newton(J: &Matrix6xX<f64>, R: &Rotation3<f64>, force: &Vector3<f64>, at: &Vector3<f64>) -> Vec<f64> {
        let moment = (R * at).cross(force);
        J.column_iter().map(|s| s.fixed_rows::<3>(0).dot(force) + s.fixed_rows::<3>(3).dot(&moment)).collect()
    }

    /// Returns the joint whose limit a force exceeds most at a pose, and the effort over the limit;
    /// `None` if it exceeds none.
    pub(super) fn excess(&self, pose: usize, force: [f64; 3], at: [f64; 3]) -> Option<(&str, f64)> {
        let (weight, J, R) = self.poses[pose].as_ref()?;
        let own = Self::per_newton(J, R, &force.into(), &at.into());
        let shares = weight.iter().zip(own).zip(&self.limits).map(|((w, f), limit)| (w - f).abs() / limit);
        let (joint, share) = shares.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (share > 1.0).then(|| (self.joints[joint].as_str(), share))
    }

    /// Returns the forces of a plan: down, along x and along y of the world, half of what the limits
    /// of the drives leave at half of the poses, 500 N at most.
    ///
    /// * `at`: points of application, tool axes (m).
    pub(super) fn default_forces(&self, at: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let directions = [-Vector3::z(), Vector3::x(), Vector3::y()];
        let mut most: Vec<f64> = Vec::new();
        for (weight, J, R) in self.poses.iter().flatten() {
            for (direction, at) in directions.iter().flat_map(|d| at.iter().map(move |at| (d, at))) {
                let own = Self::per_newton(J, R, direction, &(*at).into());
                let left = weight.iter().zip(own).zip(&self.limits).map(|((w, f), limit)| (limit - w.abs()) / f.abs());
                most.push(left.fold(f64::INFINITY, f64::min).max(0.0));
            }
        }
        most.sort_by(f64::total_cmp);
        let force = most.get(most.len() / 2).map_or(LARGEST, |most| (SHARE * most).clamp(SMALLEST, LARGEST));
        // Two digits are enough for a weight.
        let unit = 10f64.powi(force.log10().floor() as i32 - 1);
        let force = (force / unit + 1e-9).floor() * unit;
        directions.map(|direction| (direction * force).into()).to_vec()
    }
}
