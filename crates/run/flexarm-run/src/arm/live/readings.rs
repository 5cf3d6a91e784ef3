//! Readings of an arm that is commanded: joints, TCP, gauges.
//!
//! World axes; TCP velocities at the TCP, linear first. Not here: the state and its steps
//! (`live/mod.rs`), the columns of a run (`run/sampler.rs`).

use std::sync::Arc;

use flexarm_kinematics::{
    Data, Pose, State, forward_kinematics, forward_kinematics_velocity, frame_twist, inverse_dynamics,
};
use flexarm_stepping::{Observation, Plant};
use nalgebra::{Vector3, Vector6};

use crate::arm::Arm;
use crate::error::Error;
use crate::robot::tcp_frame;
use crate::run::link_side_angles;
use crate::run::monitor::stress::StressMonitor;

/// Quantities of an arm at its current state.
pub struct Readings {
    arm: Arc<Arm>,
    pub(super) observed: Observation,
    /// Workspaces for the poses of the rigid arm at the targets and for the velocities of the
    /// flexible one.
    rigid: (Data, State),
    moving: (Data, State),
    /// Result of [`link_side_angles`].
    link_sides: Vec<(usize, usize, f64)>,
    /// Stress of the links; only for a robot with gauges.
    stress: Option<StressMonitor>,
}

impl Readings {
    /// Allocates the readings of an arm; `stiffness`: factor on that of all links.
    pub(super) fn new(arm: &Arc<Arm>, commanded: &Plant, stiffness: f64) -> Result<Self, Error> {
        let stress = match arm.robot().gauges.is_empty() {
            true => None,
            false => {
                let mut robot = arm.robot().clone();
                robot.flexible_links.iter_mut().for_each(|link| link.stiffness_factor *= stiffness);
                StressMonitor::new(&Arm { robot: Arc::new(robot), ..Arm::clone(arm) }, commanded)?
            }
        };
        Ok(Self {
            observed: Observation::new(commanded),
            rigid: (Data::new(&arm.rigid), State::zeros(&arm.rigid)),
            moving: (Data::new(&arm.model), State::zeros(&arm.model)),
            link_sides: link_side_angles(arm.robot(), arm),
            stress,
            arm: arm.clone(),
        })
    }

    /// Sets the joint targets of [`Readings::target_pose`].
    pub(super) fn set_targets(&mut self, q: &[f64]) {
        self.rigid.1.q.as_mut_slice().copy_from_slice(q);
    }

    /// Returns the time (s).
    pub fn time_s(&self) -> f64 {
        self.observed.t
    }

    /// Returns the actual joint positions (rad or m); under servos they lag behind their targets.
    pub fn position(&self) -> &[f64] {
        &self.observed.q.as_slice()[..self.arm.model.n_actuated()]
    }

    /// Returns the joint velocities (rad/s or m/s).
    pub fn velocity(&self) -> &[f64] {
        &self.observed.qdot.as_slice()[..self.arm.model.n_actuated()]
    }

    /// Returns the torques or forces of the drives (N m or N).
    pub fn effort(&self) -> &[f64] {
        self.observed.drive.as_slice()
    }

    /// Returns the joint positions at the links: with the deflections of the gearboxes (rad or m).
    pub fn link_position(&self) -> Vec<f64> {
        self.at_links(self.observed.q.as_slice())
    }

    /// Returns the joint velocities at the links (rad/s or m/s).
    pub fn link_velocity(&self) -> Vec<f64> {
        self.at_links(self.observed.qdot.as_slice())
    }

    fn at_links(&self, values: &[f64]) -> Vec<f64> {
        let mut at_links = values[..self.arm.model.n_actuated()].to_vec();
        for &(joint, coordinate, share) in &self.link_sides {
            at_links[joint] += share * values[coordinate];
        }
        at_links
    }

    /// Returns the joint accelerations (rad/s² or m/s²); NaN with a stepper that has none.
    pub fn acceleration(&self) -> &[f64] {
        &self.observed.qddot.as_slice()[..self.arm.model.n_actuated()]
    }

    /// Returns the elastic coordinates.
    pub fn deflection(&self) -> &[f64] {
        &self.observed.q.as_slice()[self.arm.model.n_actuated()..]
    }

    /// Returns the velocities of the elastic coordinates (per s).
    pub fn deflection_velocity(&self) -> &[f64] {
        &self.observed.qdot.as_slice()[self.arm.model.n_actuated()..]
    }

    /// Returns the accelerations of the elastic coordinates (per s²); NaN with a stepper that has
    /// none.
    pub fn deflection_acceleration(&self) -> &[f64] {
        &self.observed.qddot.as_slice()[self.arm.model.n_actuated()..]
    }

    /// Returns the TCP pose `X_WT` in the world (m), with the deflections.
    pub fn tcp_pose(&self) -> Pose {
        let tcp = &self.arm.tcp;
        self.observed.X_WB[tcp.body] * tcp.X_BF
    }

    /// Returns the velocity `V_WT` of the TCP at its origin: linear, then angular, world axes (m/s,
    /// rad/s).
    pub fn tcp_velocity(&mut self) -> Vector6<f64> {
        let (data, state) = &mut self.moving;
        state.q.copy_from(&self.observed.q);
        state.qdot.copy_from(&self.observed.qdot);
        forward_kinematics_velocity(&self.arm.model, data, state);
        let V = frame_twist(data, &self.arm.tcp);
        Vector6::from_iterator(V.linear.iter().chain(V.angular.iter()).copied())
    }

    /// Returns the acceleration of the TCP, world axes (m/s²); NaN with a stepper that has no
    /// accelerations.
    pub fn tcp_acceleration(&mut self) -> Vector3<f64> {
        let (model, tcp) = (&self.arm.model, &self.arm.tcp);
        let (data, state) = &mut self.moving;
        state.q.copy_from(&self.observed.q);
        state.qdot.copy_from(&self.observed.qdot);
        inverse_dynamics(model, data, state, &self.observed.qddot);
        // Spatial acceleration plus ω × v, without the gravity term.
        let (V, A) = (data.V[tcp.body].at_child(&tcp.X_BF), data.A[tcp.body].at_child(&tcp.X_BF));
        let R = self.observed.X_WB[tcp.body].rotation * tcp.X_BF.rotation;
        R * (A.linear + V.angular.cross(&V.linear)) + model.gravity
    }

    /// Returns the names of the channels of strain gauges and stress points, as in recordings; those
    /// on links that the arm has rigid are left out.
    pub fn gauge_channels(&self) -> Vec<String> {
        self.stress.as_ref().map_or_else(Vec::new, StressMonitor::channels)
    }

    /// Returns the values of [`Readings::gauge_channels`]: strain (m/m) or stress (Pa); NaN with a
    /// stepper that has no accelerations.
    pub fn gauges(&mut self) -> Vec<f64> {
        let mut values = Vec::new();
        if let Some(stress) = &mut self.stress {
            stress.clear();
            stress.update(&self.observed);
            stress.read_gauges(&self.observed, &mut values);
        }
        values
    }

    /// Returns the TCP pose `X_WT` of the rigid arm with its joints at the last targets.
    pub fn target_pose(&mut self) -> Pose {
        let (data, state) = &mut self.rigid;
        forward_kinematics(&self.arm.rigid, data, &state.q);
        data.X_WF(&tcp_frame(&self.arm.rigid))
    }
}
