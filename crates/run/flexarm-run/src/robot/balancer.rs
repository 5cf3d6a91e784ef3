//! Balancers: springs, gas springs and counterbalances of a robot, and the poses in which they can
//! act.
//!
//! A balancer between two points acts along their line, one over a joint on its value (rad or m).
//! Tension is positive where it pulls the ends together or the joint to lower values. Start at
//! [`Robot::with_balancer`]. Not here: the entries of a robot file (`balancer_entry`), the force
//! laws and their place in the recursions (`flexarm-kinematics`).

use flexarm_kinematics::{
    Balancer, BalancerLaw, BalancerPlace, BalancerSpan, Data, Frame, Joint, Model, PlacedBalancer, Pose,
    forward_kinematics, frame_jacobian,
};
use flexarm_settings::known_names;
use flexarm_trajectory::Trajectory;
use nalgebra::{DVector, Matrix6xX, Rotation3};
use serde::Serialize;

use crate::error::Error;
use crate::robot::Robot;
use crate::robot::entry_checks::{add_point, carrier, check_point, loop_of_joint};

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
        let fail = |what: String| Error::Modelling(format!("balancer {name:?}{what}"));
        if self.rigid.balancers.iter().any(|other| other.name == name) {
            return Err(fail(" is defined twice: names must be unique".into()));
        }
        // Over one joint that moves by itself, or along the line between two frames.
        let span = match ends {
            BalancerEnds::Joint(joint) => {
                let moves = |j: &&Joint| j.kind.axis_motion().is_some() && !j.kind.is_elastic();
                let Some(found) = self.rigid.joint(&joint).filter(moves) else {
                    let known: Vec<_> = self.rigid.joints.iter().filter(moves).map(|j| j.name.clone()).collect();
                    let known = known_names(&joint, &known);
                    return Err(fail(format!(": the robot has no movable joint {joint:?}; it has {known}")));
                };
                if let Some(own) = loop_of_joint(&self.rigid, &joint) {
                    let remedy = "give its two ends, from and to, instead";
                    return Err(fail(format!(": joint {joint:?} follows from a loop, {own:?}: {remedy}")));
                }
                if matches!(law, BalancerLaw::Sine { .. }) && found.kind.slides() {
                    let what = format!(": a sine is a torque over an angle, but joint {joint:?} slides");
                    return Err(fail(what + ": use spring or curve"));
                }
                BalancerSpan::Joint { joint, child: found.child.clone() }
            }
            BalancerEnds::Points(ends) => {
                let frames = self.line(&name, &ends).map_err(|what| fail(format!(": {what}")))?;
                let [from, to] = frames;
                BalancerSpan::Points { from, to }
            }
        };
        self.rigid.balancers.push(Balancer { name, span, law });
        Ok(())
    }

    /// Adds frames for the two ends of a line; returns their names.
    fn line(&mut self, name: &str, ends: &[(String, [f64; 3]); 2]) -> Result<[String; 2], String> {
        for (link, p) in ends {
            check_point(&self.rigid, link, p)?;
        }
        let [(first, _), (second, _)] = ends;
        if carrier(&self.rigid, first) == carrier(&self.rigid, second) {
            return Err(format!(
                "no joint moves link {second:?} against link {first:?}, so it does nothing: put its ends on links \
                 with a joint between them"
            ));
        }
        let frames = ["from", "to"].map(|end| format!("__balancer_{name}_{end}"));
        for ((link, p), frame) in ends.iter().zip(&frames) {
            add_point(&mut self.rigid, link, *p, frame);
        }
        Ok(frames)
    }
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

/// Returns the generalised force of a balancer on each coordinate (N m or N), for the poses in `data`
/// and its length there.
///
/// ```text
/// τ = -T ∂l/∂q over a joint,    τ = Σ J_WEᵀ F_E_W over the two ends E of a line
/// ```
fn torques(model: &Model, data: &Data, balancer: &PlacedBalancer, length: f64) -> Vec<f64> {
    let mut torque = vec![0.0; model.nv()];
    match &balancer.place {
        BalancerPlace::Joint { terms, .. } => {
            terms.iter().for_each(|(k, c)| torque[*k] -= c * balancer.law.tension(length));
        }
        BalancerPlace::Points(_) => {
            let Some(line) = balancer.line(&data.X_WB) else { return torque };
            let mut J = Matrix6xX::zeros(model.nv());
            for (end, f_E_W) in [line.F_W, -line.F_W].into_iter().enumerate() {
                let X_BF = Pose::from_parts(line.p_B[end].into(), Rotation3::identity());
                let frame = Frame { name: String::new(), body: line.bodies[end], X_BF };
                frame_jacobian(model, data, &frame, &mut J);
                for (k, column) in J.column_iter().enumerate() {
                    torque[k] += column.fixed_rows::<3>(0).dot(&f_E_W);
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
            // Beyond the end of its stroke the gas has no volume.
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
