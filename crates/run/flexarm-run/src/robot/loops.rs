//! Closed loops: the pins that close the kinematic loops of a robot, the poses in which they close,
//! and their transmission angles.
//!
//! Two joints of each loop depend on the others. The transmission angle is that between the two bars
//! at the pin, at most π/2; at zero, the dead point, the loop could continue in two ways. Start at
//! [`Robot::with_loops`] and [`along_motion`]. Not here: the entries of a robot file (`loop_entry`),
//! the solution of a loop at a pose (`flexarm-kinematics`).

use flexarm_kinematics::{Data, LoopClosure, Mechanism, Model, ModelError, PlacedLoop, forward_kinematics};
use flexarm_trajectory::Trajectory;
use nalgebra::{DVector, Rotation3, Unit, Vector3};
use serde::Serialize;

use crate::caveat::size::spread_poses;
use crate::error::Error;
use crate::robot::Robot;
use crate::robot::entry_checks::{add_point, check_point, loop_of_joint};

/// A loop to add to a robot ([`Robot::with_loops`]): a pin on one link passes through an eye on
/// another.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotLoop {
    /// Unique name.
    pub name: String,
    /// Link that carries the pin, and a point on the pin's axis in link axes (m).
    pub pin: (String, [f64; 3]),
    /// Axis of the pin in the axes of that link; by default that of the first revolute dependent
    /// joint.
    pub axis: Option<[f64; 3]>,
    /// Link that carries the eye, and the eye's position in link axes (m).
    pub eye: (String, [f64; 3]),
    /// The two joints of the loop that depend on the others.
    pub dependent: [String; 2],
    /// Joint values near which the loop is assembled (rad or m); 0 for joints not listed.
    pub at: Vec<(String, f64)>,
}

/// A loop at a pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoopInfo {
    /// Name.
    pub name: String,
    /// Dependent joints.
    pub dependent: Vec<DependentInfo>,
    /// Transmission angle (rad, at most π/2).
    pub transmission_angle: f64,
    /// Minimum transmission angle over poses spread over the joint ranges, except those excluded by
    /// limits of dependent joints.
    pub smallest_transmission_angle: Option<f64>,
}

/// A dependent joint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DependentInfo {
    /// Name.
    pub name: String,
    /// `revolute`, `continuous` or `prismatic`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Minimum position (rad or m).
    pub lower: Option<f64>,
    /// Maximum position (rad or m).
    pub upper: Option<f64>,
    /// Position (rad or m).
    pub q: f64,
}

impl Robot {
    /// Adds closed loops to the robot.
    ///
    /// # Errors
    /// [`Error::Loop`] for unknown links and joints, values that are not finite, a duplicate name,
    /// loops that are not planar, do not close or are at a dead point where they are assembled, and
    /// joints that have a drive.
    pub fn with_loops(mut self, loops: Vec<RobotLoop>) -> Result<Self, Error> {
        for own in loops {
            self.add_loop(own)?;
        }
        if let Some(drive) = self.drives.iter().find(|drive| loop_of_joint(&self.rigid, &drive.joint).is_some()) {
            let name = loop_of_joint(&self.rigid, &drive.joint).unwrap_or_default().to_owned();
            let what =
                format!("joint {:?} has a drive and follows from the loop: only one of both moves it", drive.joint);
            return Err(Error::Loop { name, what });
        }
        self.check_loops()?;
        Ok(self)
    }

    /// Adds a loop, with frames for its pin and its eye.
    pub(crate) fn add_loop(&mut self, own: RobotLoop) -> Result<(), Error> {
        let RobotLoop { name, pin, axis, eye, dependent, at } = own;
        if self.rigid.loops.iter().any(|other| other.name == name) {
            return Err(Error::Loop { name, what: "it is defined twice: names must be unique".into() });
        }
        for (link, p) in [&pin, &eye] {
            check_point(&self.rigid, link, p).map_err(|what| Error::Loop { name: name.clone(), what })?;
        }
        // Axis of the pin, or else of a dependent joint.
        let axis = match axis {
            None => axis_of_joint(&self.rigid, &pin.0, &dependent).ok_or_else(|| Error::Loop {
                name: name.clone(),
                what:
                    "none of its dependent joints turns, so that its pin needs an axis: give axis = [x, y, z] in axes \
                       of the pin's link"
                        .into(),
            })?,
            Some(axis) => Unit::try_new(Vector3::from(axis), 1e-9)
                .filter(|axis| axis.iter().all(|x| x.is_finite()))
                .ok_or_else(|| Error::Loop {
                    name: name.clone(),
                    what: format!("axis is {axis:?}, expected the direction of the pin in axes of its link"),
                })?,
        };
        // Points of the loop as frames of the mechanism.
        let frames = ["pin", "eye"].map(|end| format!("__loop_{name}_{end}"));
        for ((link, p), frame) in [pin, eye].iter().zip(&frames) {
            add_point(&mut self.rigid, link, *p, frame);
        }
        let [pin, eye] = frames;
        self.rigid.loops.push(LoopClosure { name, pin, axis, eye, dependent, at });
        Ok(())
    }

    /// Checks that all loops close.
    pub(crate) fn check_loops(&self) -> Result<(), Error> {
        match Model::new(&self.rigid) {
            Err(ModelError::BadLoop { name, what }) => Err(Error::Loop { name, what }),
            _ => Ok(()),
        }
    }
}

/// Returns the axis of the first revolute one of the joints, in the axes of link L, with all joints
/// at zero.
fn axis_of_joint(mechanism: &Mechanism, link: &str, joints: &[String; 2]) -> Option<Unit<Vector3<f64>>> {
    let turning = joints.iter().filter_map(|name| mechanism.joint(name)).find(|joint| joint.kind.turns())?;
    let axis_J = turning.kind.axis_motion()?.axis();
    let R_WJ = rotation_at_zero(mechanism, &turning.child)?;
    let R_WL = rotation_at_zero(mechanism, link)?;
    Unit::try_new(R_WL.inverse() * (R_WJ * axis_J), 1e-9)
}

/// Returns the orientation `R_WL` of a link with all joints at zero; `None` if the joints do not form
/// a tree.
fn rotation_at_zero(mechanism: &Mechanism, link: &str) -> Option<Rotation3<f64>> {
    let (mut body, mut R_BL) = (link, Rotation3::identity());
    for _ in 0..=mechanism.joints.len() {
        match mechanism.joints.iter().find(|joint| joint.child == body) {
            Some(joint) => (body, R_BL) = (&joint.parent, joint.X_PJ.rotation * R_BL),
            None => return Some(R_BL),
        }
    }
    None
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// Returns the loops of the rigid robot at joint values (rad or m).
pub(crate) fn at_pose(model: &Model, q: &DVector<f64>) -> Vec<LoopInfo> {
    if model.loops().is_empty() {
        return Vec::new();
    }
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, q);
    let smallest = over_ranges(model).smallest;
    let joint = |k: usize| {
        let c = &model.dependent()[k];
        let (lower, upper) = (finite(c.limits.lower), finite(c.limits.upper));
        DependentInfo { name: c.joint.clone(), kind: c.kind, lower, upper, q: data.dependent_values()[k] }
    };
    let info = |(k, own): (usize, &PlacedLoop)| LoopInfo {
        name: own.name.clone(),
        dependent: vec![joint(2 * k), joint(2 * k + 1)],
        transmission_angle: data.transmission_angles()[k],
        smallest_transmission_angle: finite(smallest[k]),
    };
    model.loops().iter().enumerate().map(info).collect()
}

/// Behaviour of the loops in poses spread over the joint ranges.
pub(crate) struct OverRanges {
    /// Minimum transmission angle of each loop (rad); infinite if no pose counted.
    pub(crate) smallest: Vec<f64>,
    /// Fraction of the poses in which each loop does not close.
    pub(crate) open: Vec<f64>,
}

/// Evaluates the loops over the joint ranges; poses excluded by limits of dependent joints do not
/// count for the angles.
pub(crate) fn over_ranges(model: &Model) -> OverRanges {
    let (n, mut data) = (model.loops().len(), Data::new(model));
    let (mut smallest, mut open, mut poses) = (vec![f64::INFINITY; n], vec![0.0; n], 0.0);
    for q in spread_poses(model) {
        forward_kinematics(model, &mut data, &q);
        poses += 1.0;
        if let Some(k) = data.open_loop() {
            open[k] += 1.0;
            continue;
        }
        let values = model.dependent().iter().zip(data.dependent_values());
        if values.into_iter().any(|(c, q)| *q < c.limits.lower || *q > c.limits.upper) {
            continue;
        }
        smallest.iter_mut().zip(data.transmission_angles()).for_each(|(least, angle)| *least = least.min(*angle));
    }
    open.iter_mut().for_each(|open| *open /= poses);
    OverRanges { smallest, open }
}

/// Checks that all loops close at these joint values (rad or m).
///
/// # Errors
/// [`Error::Loop`] with the first loop that does not close.
pub(crate) fn check_pose(model: &Model, data: &mut Data, q: &DVector<f64>) -> Result<(), Error> {
    if model.loops().is_empty() {
        return Ok(());
    }
    forward_kinematics(model, data, q);
    match data.open_loop() {
        None => Ok(()),
        Some(k) => Err(Error::Loop { name: model.loops()[k].name.clone(), what: OPEN.into() }),
    }
}

/// Message about a loop whose links do not reach each other.
const OPEN: &str = "it does not close there: its links do not reach each other; keep the driving joints within the range \
                    of its bars, or check their lengths";
/// Message about a loop whose links are in line.
const DEAD_POINT: &str = "it passes its dead point there: its links are collinear and could continue in two ways; keep \
                          the motion away from it";
/// Number of time intervals at which a motion is checked.
const TIMES: usize = 1000;

/// Behaviour of the loops along a motion of the rigid robot.
pub struct AlongMotion {
    /// Minimum transmission angle of each loop (rad), and its time (s).
    pub(crate) smallest: Vec<(f64, f64)>,
    /// Minimum and maximum of each dependent joint (rad or m).
    pub(crate) range: Vec<[f64; 2]>,
}

/// Follows a motion and checks that the loops close and do not pass a dead point, where the
/// assembly mode is ambiguous.
///
/// # Errors
/// [`Error::Loop`] with the time at which a loop does not close or passes a dead point.
pub fn along_motion(model: &Model, trajectory: &Trajectory) -> Result<AlongMotion, Error> {
    let (n, loops) = (model.nv(), model.loops().len());
    let mut found = AlongMotion {
        smallest: vec![(f64::INFINITY, 0.0); loops],
        range: vec![[f64::INFINITY, f64::NEG_INFINITY]; model.dependent().len()],
    };
    if loops == 0 {
        return Ok(found);
    }
    let (mut data, mut q, mut v, mut a) = (Data::new(model), DVector::zeros(n), vec![0.0; n], vec![0.0; n]);
    // Angles at the last two times.
    let mut before: Vec<[f64; 2]> = vec![[f64::NAN; 2]; loops];
    for i in 0..=TIMES {
        let t = trajectory.duration() * i as f64 / TIMES as f64;
        trajectory.sample(t, q.as_mut_slice(), &mut v, &mut a);
        let at = |k: usize, what: &str| Error::Loop {
            name: model.loops()[k].name.clone(),
            what: format!("at t = {t:.3} s {what}"),
        };
        forward_kinematics(model, &mut data, &q);
        if let Some(k) = data.open_loop() {
            return Err(at(k, OPEN));
        }
        for (k, angle) in data.transmission_angles().iter().copied().enumerate() {
            // An angle whose extrapolation is below zero but which rises again has passed zero.
            let [last_but_one, last] = before[k];
            if 2.0 * last - last_but_one <= 0.0 && angle > 0.0 && last < 0.2 {
                return Err(at(k, DEAD_POINT));
            }
            before[k] = [last, angle];
            if angle < found.smallest[k].0 {
                found.smallest[k] = (angle, t);
            }
        }
        for ([low, high], value) in found.range.iter_mut().zip(data.dependent_values()) {
            (*low, *high) = (low.min(*value), high.max(*value));
        }
    }
    Ok(found)
}
