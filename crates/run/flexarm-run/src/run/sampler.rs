//! Fills the [`Sample`] of a time step for recordings, curves and observers; the same sample is
//! reused. Poses of links and stations are in the world; six-vectors linear first.

use flexarm_kinematics::{AxisMotion, Frame, JointMotion};
use flexarm_log::{ElasticSample, EnergySample, Sample};
use flexarm_stepping::{Observation, Plant};

use crate::arm::{Arm, Owner};
use crate::robot::Robot;
use crate::run::monitor::tool::ToolError;
use crate::run::twin::RigidTwin;

/// Frames and coordinates of an arm that go into a sample.
pub(super) struct Sampler {
    link_frames: Vec<Frame>,
    /// Stations along the flexible links.
    stations: Vec<Frame>,
    /// Link-side angle of a joint: actuated coordinate, elastic coordinate, weight.
    angles: Vec<(usize, usize, f64)>,
}

impl Sampler {
    pub(super) fn new(robot: &Robot, arm: &Arm, link_frames: Vec<Frame>, stations: Vec<Frame>) -> Self {
        Self { link_frames, stations, angles: link_side_angles(robot, arm) }
    }

    /// Fills in the arm and its twin.
    pub(super) fn fill(&self, sample: &mut Sample, observed: &Observation, twin: &RigidTwin, tool: &ToolError) {
        sample.time_s = observed.t;
        sample.error_world = tool.error;
        sample.error_path = tool.path_error;
        sample.static_m = tool.static_m;
        let [kinetic, potential, elastic] = observed.energy;
        sample.energy = EnergySample { kinetic, potential, elastic };
        self.fill_flexible(sample, observed, tool);
        self.fill_rigid(sample, twin, tool);
    }

    fn fill_flexible(&self, sample: &mut Sample, observed: &Observation, tool: &ToolError) {
        let n = observed.drive.len();
        let flexible = &mut sample.flexible;
        flexible.q.clear();
        flexible.q.extend_from_slice(&observed.q.as_slice()[..n]);
        flexible.qdot.clear();
        flexible.qdot.extend_from_slice(&observed.qdot.as_slice()[..n]);
        for &(k, e, weight) in &self.angles {
            flexible.q[k] += weight * observed.q[e];
            flexible.qdot[k] += weight * observed.qdot[e];
        }
        flexible.effort.clear();
        flexible.effort.extend_from_slice(observed.drive.as_slice());
        flexible.X_WL.clear();
        flexible.X_WL.extend(self.link_frames.iter().map(|f| observed.X_WB[f.body] * f.X_BF));
        flexible.X_WT = tool.X_flexible;
        flexible.X_WS.clear();
        flexible.X_WS.extend(self.stations.iter().map(|f| observed.X_WB[f.body] * f.X_BF));
    }

    fn fill_rigid(&self, sample: &mut Sample, twin: &RigidTwin, tool: &ToolError) {
        let n = sample.flexible.q.len();
        let rigid = &mut sample.rigid;
        rigid.q.clear();
        rigid.q.extend_from_slice(&twin.state.q.as_slice()[..n]);
        rigid.qdot.clear();
        rigid.qdot.extend_from_slice(&twin.state.qdot.as_slice()[..n]);
        rigid.effort.clear();
        rigid.effort.extend_from_slice(&twin.data.tau.as_slice()[..n]);
        rigid.X_WL.clear();
        rigid.X_WL.extend(self.link_frames.iter().map(|f| twin.data.X_WF(f)));
        rigid.X_WT = tool.X_rigid;
    }
}

/// Fills in deflection and load of each spring, along the axes of its joint.
pub(super) fn fill_elastic(sample: &mut Sample, observed: &Observation, plant: &Plant) {
    sample.elastic.resize(plant.elements.len(), ElasticSample::default());
    for (k, element) in plant.elements.iter().enumerate() {
        let e = observed.q.rows(element.coordinate, element.size);
        let (mut deflection, mut load) = ([0.0; 6], observed.load[k].into());
        match (element.size, plant.model.bodies()[element.body].motion) {
            (1, JointMotion::Axis(motion)) => place(&mut deflection, &mut load, motion, e[0]),
            (n, _) => (0..n.min(6)).for_each(|c| deflection[c] = e[c]),
        }
        sample.elastic[k] = ElasticSample { deflection, load };
    }
}

/// Distributes one deflection and its load along the axis of its joint.
fn place(deflection: &mut [f64; 6], load: &mut [f64; 6], motion: AxisMotion, e: f64) {
    let (torque, axis, first) = (load[0], motion.axis(), if motion.slides() { 0 } else { 3 });
    let slides_as_it_turns = !motion.slides() && motion.travel() > 0.0;
    let S = motion.column();
    *load = [0.0; 6];
    for c in 0..3 {
        deflection[first + c] = e * axis[c];
        load[first + c] = torque * axis[c];
        if slides_as_it_turns {
            deflection[c] = e * S[c];
        }
    }
}

/// Contributions of gearbox springs to the link-side angle, in addition to the motor's angle.
pub(crate) fn link_side_angles(robot: &Robot, arm: &Arm) -> Vec<(usize, usize, f64)> {
    let mut angles = Vec::new();
    for (group, owner) in arm.model.elastic().iter().zip(&arm.owners) {
        let Owner::Drive(drive) = owner else { continue };
        let joint = &robot.drives[*drive].joint;
        let actuated = &arm.model.coordinates()[..arm.model.n_actuated()];
        let Some(k) = actuated.iter().position(|c| c.joint == *joint) else { continue };
        let motor = &arm.model.bodies()[actuated[k].body];
        let JointMotion::Axis(motion) = motor.motion else { continue };
        let axis = motion.axis();
        match arm.model.bodies()[group.body].motion {
            // A sliding spring does not turn a joint, and a turning one does not move a slide.
            JointMotion::Axis(own) if own.slides() != motion.slides() => {}
            JointMotion::Axis(own) => {
                angles.push((k, group.coordinate, axis.dot(&own.axis())));
            }
            _ => {
                let first = group.coordinate + if motion.slides() { 0 } else { 3 };
                angles.extend((0..3).map(|c| (k, first + c, axis[c])));
            }
        }
    }
    angles
}
