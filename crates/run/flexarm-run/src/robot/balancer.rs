//! Balancers: springs, gas springs and counterbalances of a robot, and the poses in which they can
//! act.

use flexarm_kinematics::{
    Balancer, BalancerLaw, BalancerPlace, BalancerSpan, Data, Frame, Joint, JointKind, Link, Mechanism, Model,
    PlacedBalancer, Pose, forward_kinematics, frame_jacobian,
};
use flexarm_settings::known_names;
use flexarm_trajectory::Trajectory;
use nalgebra::{DVector, Matrix6xX, Rotation3, Vector3};
use serde::Serialize;

use crate::error::Error;
use crate::robot::Robot;
use crate::robot::entry_checks::loop_of_joint;

/// A balancer to add to a robot ([`Robot::with_balancer`]).
#[derive(Clone, Debug, PartialEq)]
pub struct RobotBalancer {
    /// Unique name.
    pub name: String,
    /// Points or joint on which it acts.
    pub ends: BalancerEnds,
    /// Force law.
    pub law: BalancerLaw,
}

/// Points or joint between which a balancer acts.
#[derive(Clone, Debug, PartialEq)]
pub enum BalancerEnds {
    /// Along the line between two points: link, and point in link axes (m).
    Points([(String, [f64; 3]); 2]),
    /// Over the joint with this name.
    Joint(String),
}

impl RobotBalancer {
    /// Returns a balancer along the line between two points, each in the axes of its link (m). The
    /// law is a function of their distance (m, N).
    pub fn between(name: &str, from: (&str, [f64; 3]), to: (&str, [f64; 3]), law: BalancerLaw) -> Self {
        let ends = BalancerEnds::Points([from, to].map(|(link, p)| (link.to_owned(), p)));
        Self { name: name.to_owned(), ends, law }
    }

    /// Returns a balancer over a joint. The law is a function of the joint value (rad, N m; m, N).
    pub fn over_joint(name: &str, joint: &str, law: BalancerLaw) -> Self {
        Self { name: name.to_owned(), ends: BalancerEnds::Joint(joint.to_owned()), law }
    }
}

/// A balancer at a pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BalancerInfo {
    /// Name.
    pub name: String,
    /// `line` or `joint`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Length of the line (m), or value of the joint (rad or m).
    pub length: f64,
    /// Tension, which pulls the ends together or the joint to lower values (N; N m or N).
    pub tension: f64,
    /// Derivative of the tension with respect to the length (N/m; N m/rad).
    pub stiffness: f64,
    /// Generalised force on each joint (N m or N), in coordinate order.
    pub torque: Vec<f64>,
}

impl Robot {
    /// Adds a balancer to the robot.
    ///
    /// # Errors
    /// [`Error::Modelling`] for unknown links and joints, two ends that do not move relative to each
    /// other, values that are not finite, and a duplicate name.
    pub fn with_balancer(mut self, balancer: RobotBalancer) -> Result<Self, Error> {
        self.add_balancer(balancer)?;
        Ok(self)
    }

    pub(crate) fn add_balancer(&mut self, balancer: RobotBalancer) -> Result<(), Error> {
        let RobotBalancer { name, ends, law } = balancer;
        if self.rigid.balancers.iter().any(|other| other.name == name) {
            return Err(Error::Modelling(format!("balancer {name:?} is defined twice: names must be unique")));
        }
        let span = match ends {
            BalancerEnds::Joint(joint) => {
                let moves = |j: &&Joint| j.kind.axis_motion().is_some() && !j.kind.is_elastic();
                let Some(found) = self.rigid.joints.iter().filter(moves).find(|j| j.name == joint) else {
                    let known: Vec<_> = self.rigid.joints.iter().filter(moves).map(|j| j.name.clone()).collect();
                    return Err(Error::Modelling(format!(
                        "balancer {name:?}: the robot has no movable joint {joint:?}; it has {}",
                        known_names(&joint, &known)
                    )));
                };
                if let Some(own) = loop_of_joint(&self.rigid, &joint) {
                    return Err(Error::Modelling(format!(
                        "balancer {name:?}: joint {joint:?} follows from a loop, {own:?}: give its two ends, from \
                         and to, instead"
                    )));
                }
                if matches!(law, BalancerLaw::Sine { .. }) && found.kind.slides() {
                    return Err(Error::Modelling(format!(
                        "balancer {name:?}: a sine is a torque over an angle, but joint {joint:?} slides: use spring \
                         or curve"
                    )));
                }
                BalancerSpan::Joint { joint, child: found.child.clone() }
            }
            BalancerEnds::Points(ends) => self.line(&name, &ends)?,
        };
        self.rigid.balancers.push(Balancer { name, span, law });
        Ok(())
    }

    /// Adds frames for the two ends. They are fixed to their links, so that on a flexible link each
    /// moves with the part it is on.
    fn line(&mut self, name: &str, ends: &[(String, [f64; 3]); 2]) -> Result<BalancerSpan, Error> {
        let name = name.to_owned();
        for (link, p) in ends {
            if self.rigid.link(link).is_none() {
                let known: Vec<_> =
                    self.rigid.links.iter().map(|l| l.name.clone()).filter(|l| !l.starts_with("__")).collect();
                return Err(Error::Modelling(format!(
                    "balancer {name:?}: {link:?} is not a link of the robot; its links are {}",
                    known_names(link, &known)
                )));
            }
            if let Some(value) = p.iter().find(|x| !x.is_finite()) {
                return Err(Error::Modelling(format!(
                    "balancer {name:?}: its point on link {link:?} has the entry {value}, expected finite numbers in \
                     m"
                )));
            }
        }
        let [first, second] = [0, 1].map(|k| ends[k].0.clone());
        if carrier(&self.rigid, &first) == carrier(&self.rigid, &second) {
            return Err(Error::Modelling(format!(
                "balancer {name:?}: no joint moves link {second:?} against link {first:?}, so it does nothing: put \
                 its ends on links with a joint between them"
            )));
        }
        let frames = ["from", "to"].map(|end| format!("__balancer_{name}_{end}"));
        for ((link, p), frame) in ends.iter().zip(&frames) {
            let X = Pose::from_parts(Vector3::from(*p).into(), Rotation3::identity());
            self.rigid.joints.push(Joint::new(format!("{frame}_joint"), JointKind::Fixed, link, frame, X));
            self.rigid.links.push(Link { name: frame.clone(), inertia: None });
        }
        let [from, to] = frames;
        Ok(BalancerSpan::Points { from, to })
    }
}

/// Returns the link at the inner end of the chain of fixed joints that carries a link.
fn carrier<'m>(mechanism: &'m Mechanism, link: &'m str) -> &'m str {
    let mut at = link;
    while let Some(joint) = mechanism.joints.iter().find(|j| j.child == at && j.kind == JointKind::Fixed) {
        at = &joint.parent;
    }
    at
}

/// Returns the balancers of the rigid robot at joint values (rad or m).
pub(crate) fn at_pose(model: &Model, q: &DVector<f64>) -> Vec<BalancerInfo> {
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, q);
    let info = |balancer: &PlacedBalancer| {
        let length = balancer.length(&data.X_WB, q.as_slice());
        BalancerInfo {
            name: balancer.name.clone(),
            kind: if matches!(balancer.place, BalancerPlace::Points(_)) { "line" } else { "joint" },
            length,
            tension: balancer.law.tension(length),
            stiffness: balancer.law.rate(length),
            torque: torques(model, &data, balancer, length),
        }
    };
    model.balancers().iter().map(info).collect()
}

/// Generalised force of a balancer on each coordinate (N m or N), for the poses in `data` and its
/// length there.
fn torques(model: &Model, data: &Data, balancer: &PlacedBalancer, length: f64) -> Vec<f64> {
    let mut torque = vec![0.0; model.nv()];
    match &balancer.place {
        BalancerPlace::Joint { terms, .. } => {
            terms.iter().for_each(|(k, c)| torque[*k] -= c * balancer.law.tension(length));
        }
        BalancerPlace::Points(_) => {
            let Some(line) = balancer.line(&data.X_WB) else { return torque };
            let mut J = Matrix6xX::zeros(model.nv());
            for (end, F_W) in [line.F_W, -line.F_W].into_iter().enumerate() {
                let X_BF = Pose::from_parts(line.p_B[end].into(), Rotation3::identity());
                let frame = Frame { name: String::new(), body: line.bodies[end], X_BF };
                frame_jacobian(model, data, &frame, &mut J);
                for (k, column) in J.column_iter().enumerate() {
                    torque[k] += column.fixed_rows::<3>(0).dot(&F_W);
                }
            }
        }
    }
    torque
}

/// Checks that every balancer is within its range at these joint values (rad or m).
///
/// # Errors
/// [`Error::Modelling`] for the first balancer that is not.
pub(crate) fn check_pose(model: &Model, data: &mut Data, q: &DVector<f64>) -> Result<(), Error> {
    if model.balancers().is_empty() {
        return Ok(());
    }
    forward_kinematics(model, data, q);
    for balancer in model.balancers() {
        let length = balancer.length(&data.X_WB, q.as_slice());
        let name = balancer.name.clone();
        match &balancer.law {
            BalancerLaw::Gas(gas) if gas.volume_ratio(length) <= 0.0 => {
                let beyond = if gas.pulls { "above" } else { "below" };
                let message = format!(
                    "balancer {name:?} is {length:.4} m long there, its gas has no room left {beyond} {end:.4} m: \
                     check its ends (m), volume (m³), area (m²) and the length to which these belong",
                    end = gas.end()
                );
                return Err(Error::Modelling(message));
            }
            law => {
                let line = matches!(balancer.place, BalancerPlace::Points(_));
                if line && length == 0.0 && law.tension(length) != 0.0 {
                    return Err(Error::Modelling(format!(
                        "both ends of balancer {name:?} are at the same place there, so that its force has no \
                         direction: move an end"
                    )));
                }
            }
        }
    }
    Ok(())
}

/// Number of time intervals at which a motion is checked.
const TIMES: usize = 1000;

/// As [`check_pose`], along a motion of the rigid robot.
///
/// # Errors
/// [`Error::Modelling`].
pub(crate) fn check_motion(model: &Model, trajectory: &Trajectory) -> Result<(), Error> {
    if model.balancers().is_empty() {
        return Ok(());
    }
    let n = model.nv();
    let (mut data, mut q, mut v, mut a) = (Data::new(model), DVector::zeros(n), vec![0.0; n], vec![0.0; n]);
    for i in 0..=TIMES {
        let t = trajectory.duration() * i as f64 / TIMES as f64;
        trajectory.sample(t, q.as_mut_slice(), &mut v, &mut a);
        check_pose(model, &mut data, &q).map_err(|source| Error::Modelling(format!("at t = {t:.3} s: {source}")))?;
    }
    Ok(())
}
