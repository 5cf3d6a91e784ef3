//! Classification of an arm from its joint axes.
//!
//! Start at [`AnalyticArm::new`]. [`recognise`] tries the classes from both ends of the arm; [`Lines`]
//! are the axes in world coordinates at zero joint values, in the order from one of the ends.
//! Deviations are angles (rad) or lengths relative to the reach. Not here: the solvers (`wrist`,
//! `parallel`).

use nalgebra::{DVector, Matrix3, Vector3};

use super::branch::Sides;
use super::parallel::{Parallel123, Parallel234};
use super::position::{PositionForm, feet};
use super::screw::{Chain, Screw};
use super::wrist::Wrist;
use super::{AnalyticArm, Kernel};
use crate::axis_motion::AxisMotion;
use crate::data::Data;
use crate::kinematics::forward_kinematics;
use crate::model::{Frame, JointMotion, Model};

/// Maximum angle between axes that are treated as parallel (rad).
pub const AXIS_TOLERANCE_RAD: f64 = 2e-5;

/// Maximum distance between axes that are treated as intersecting, relative to the reach.
pub const AXIS_TOLERANCE: f64 = 2e-5;

/// Geometric class that gives an arm a closed-form inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArmClass {
    /// Axes 4, 5 and 6 intersect in a point, which the first three joints position.
    SphericalWrist(PositionForm),
    /// Axes 1, 2 and 3 intersect in a point; the form is that of joints 6, 5, 4, in this order.
    SphericalShoulder(PositionForm),
    /// Three successive axes are parallel.
    ThreeParallel {
        /// Number of the first of them, 1 to 4.
        first: usize,
        /// Whether the last two axes, seen from the end at which the solution starts, intersect, as
        /// axes 5 and 6 of Universal Robots arms do: then no polynomial is needed.
        meeting: bool,
    },
}

impl ArmClass {
    /// Maximum number of solutions of a pose.
    pub fn most_solutions(self) -> usize {
        match self {
            Self::ThreeParallel { first: 1 | 4, meeting: false } => 16,
            _ => 8,
        }
    }
}

impl std::fmt::Display for ArmClass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let position = |form: &PositionForm, [a, b, c]: [usize; 3]| match form {
            PositionForm::Parallel23 => format!("axes {b} and {c} are parallel"),
            PositionForm::Intersecting12 => format!("axes {a} and {b} intersect"),
            PositionForm::Intersecting23 => format!("axes {b} and {c} intersect"),
            PositionForm::Parallel12 => format!("axes {a} and {b} are parallel"),
            PositionForm::General => format!("axes {a}, {b} and {c} are in general position"),
        };
        match self {
            Self::SphericalWrist(form) => {
                write!(f, "spherical wrist (axes 4, 5 and 6 meet), {}", position(form, [1, 2, 3]))
            }
            Self::SphericalShoulder(form) => {
                write!(f, "spherical shoulder (axes 1, 2 and 3 meet), {}", position(form, [6, 5, 4]))
            }
            Self::ThreeParallel { first, .. } => {
                write!(f, "axes {first}, {} and {} are parallel", first + 1, first + 2)
            }
        }
    }
}

/// Reason why there is no closed form; such arms are solved numerically by
/// [`crate::inverse_kinematics_from_many_starts`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoAnalyticIk {
    /// The number of joints between base and frame is not six.
    #[error(
        "analytic inverse kinematics of frame {frame:?} needs six joints between it and the base, found {}: {joints:?}",
        joints.len()
    )]
    JointCount {
        /// The frame.
        frame: String,
        /// Joints that move the frame, from the base outward.
        joints: Vec<String>,
    },
    /// A joint is not suitable.
    #[error("analytic inverse kinematics: joint {joint:?} {what}")]
    Joint {
        /// The joint.
        joint: String,
        /// Description of the problem.
        what: &'static str,
    },
    /// The joints cannot move the frame in all six directions.
    #[error(
        "the six joints move frame {frame:?} in five directions at most (smallest singular value {smallest:.1e} of the largest): \
         its poses have families of solutions or none"
    )]
    Deficient {
        /// The frame.
        frame: String,
        /// Ratio of smallest to largest singular value of the Jacobian, lengths relative to the
        /// reach: maximum over a few positions.
        smallest: f64,
    },
    /// The arm is of no class with a closed form.
    #[error(
        "the axes of {frame:?} are of no class with a closed form: axes 4, 5, 6 miss a common point by {wrist_m:.3e} m, axes 1, \
         2, 3 by {shoulder_m:.3e} m (allowed {allowed_m:.1e} m), and the best three axes in a row are {parallel_rad:.1e} rad from \
         parallel (allowed {AXIS_TOLERANCE_RAD:.0e} rad)"
    )]
    NoClass {
        /// The frame.
        frame: String,
        /// Maximum distance of axes 4, 5, 6 from the point closest to them (m).
        wrist_m: f64,
        /// Same for axes 1, 2, 3 (m).
        shoulder_m: f64,
        /// Allowed distance (m).
        allowed_m: f64,
        /// Maximum angle within the three successive axes that are closest to parallel (rad).
        parallel_rad: f64,
    },
    /// The values of the fixed joints have the wrong length or are not finite.
    #[error(
        "analytic inverse kinematics: {found} joint values for a model of {needed} coordinates, or some are not finite"
    )]
    FixedJoints {
        /// Values given.
        found: usize,
        /// Coordinates of the model.
        needed: usize,
    },
}

impl AnalyticArm {
    /// Creates the solver for the arm from the base to `frame`, which six revolute joints must
    /// move.
    ///
    /// Fixed joints between them are allowed; elastic coordinates are zero.
    ///
    /// # Errors
    /// [`NoAnalyticIk`] with the missing geometric property.
    pub fn new(model: &Model, frame: &Frame) -> Result<Self, NoAnalyticIk> {
        check_open(model, frame)?;
        let joints = moving_joints(model, frame);
        let others = DVector::zeros(model.nv());
        match joints.as_slice().try_into() {
            Ok(joints) => Self::with_joints(model, frame, joints, &others),
            Err(_) => {
                let names = joints.iter().map(|&k| model.coordinates()[k].joint.clone()).collect();
                Err(NoAnalyticIk::JointCount { frame: frame.name.clone(), joints: names })
            }
        }
    }

    /// Creates the solver for six of the joints with all others fixed, such as a rail, a turntable
    /// or a seventh axis.
    ///
    /// * `joints`: indices of the six coordinates, in the order of the chain.
    /// * `q_fixed`: values of all coordinates, nv long (rad or m); those of the six are ignored.
    ///
    /// # Errors
    /// [`NoAnalyticIk`] with the missing geometric property, or for a `q_fixed` of another length.
    ///
    /// # Panics
    /// If a joint is not a coordinate of the model.
    pub fn with_joints(
        model: &Model,
        frame: &Frame,
        joints: &[usize; 6],
        q_fixed: &DVector<f64>,
    ) -> Result<Self, NoAnalyticIk> {
        if q_fixed.len() != model.nv() || !q_fixed.iter().all(|x| x.is_finite()) {
            return Err(NoAnalyticIk::FixedJoints { found: q_fixed.len(), needed: model.nv() });
        }
        check_open(model, frame)?;
        let chain = chain_of(model, frame, joints, q_fixed)?;
        let smallest = dexterity(&chain);
        if smallest < 1e-7 {
            return Err(NoAnalyticIk::Deficient { frame: frame.name.clone(), smallest });
        }
        let RecognisedArm { class, kernel, reversed, deviation } = recognise(&chain, &frame.name)?;
        let limits = joints.map(|k| (model.coordinates()[k].limits.lower, model.coordinates()[k].limits.upper));
        let sides = Sides::new(&kernel, reversed, -model.gravity);
        Ok(Self { chain, kernel, class, reversed, deviation, joints: *joints, limits, sides })
    }
}

/// Checks that no joint of the chain is determined by a closed loop, since its axis would depend on
/// other joints.
fn check_open(model: &Model, frame: &Frame) -> Result<(), NoAnalyticIk> {
    let mut body = frame.body;
    while body > 0 {
        let own = &model.bodies()[body];
        if own.coordinate != usize::MAX && own.coordinate >= model.nv() {
            return Err(NoAnalyticIk::Joint { joint: own.joint.clone(), what: "follows from a closed loop" });
        }
        body = own.parent;
    }
    Ok(())
}

/// Actuated coordinates that move the frame, from the base outward.
fn moving_joints(model: &Model, frame: &Frame) -> Vec<usize> {
    let mut joints = Vec::new();
    let mut body = frame.body;
    while body > 0 {
        let b = &model.bodies()[body];
        if matches!(b.motion, JointMotion::Axis(_)) && !b.elastic && !joints.contains(&b.coordinate) {
            joints.push(b.coordinate);
        }
        body = b.parent;
    }
    joints.reverse();
    joints
}

/// World lines of the six joint axes at zero, with all other joints fixed.
fn chain_of(model: &Model, frame: &Frame, joints: &[usize; 6], q_fixed: &DVector<f64>) -> Result<Chain, NoAnalyticIk> {
    // The six joints are revolute and actuated; they stand at zero, all others where they are fixed.
    let mut q = q_fixed.clone();
    for &k in joints {
        let inside = model.coordinates().get(k).filter(|_| k < model.n_actuated());
        let Some(coordinate) = inside else {
            return Err(NoAnalyticIk::Joint {
                joint: format!("number {k}"),
                what: "is no actuated joint of the model",
            });
        };
        if !matches!(model.bodies()[coordinate.body].motion, JointMotion::Axis(AxisMotion::Revolute(_))) {
            return Err(NoAnalyticIk::Joint { joint: coordinate.joint.clone(), what: "is not revolute" });
        }
        q[k] = 0.0;
    }
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, &q);
    // Axes from the frame to the base, then in the order of the chain.
    let mut axes = Vec::with_capacity(6);
    let mut body = frame.body;
    while body > 0 {
        let b = &model.bodies()[body];
        if let JointMotion::Axis(motion) = b.motion
            && joints.contains(&b.coordinate)
        {
            if model.coordinates()[b.coordinate].body != body {
                return Err(NoAnalyticIk::Joint { joint: b.joint.clone(), what: "follows another joint of the arm" });
            }
            let X = &data.X_WB[body];
            axes.push((b.coordinate, Screw { h: (X.rotation * motion.axis()).normalize(), o: X.translation.vector }));
        }
        body = b.parent;
    }
    axes.reverse();
    if axes.iter().map(|a| a.0).ne(joints.iter().copied()) {
        let names = axes.iter().map(|a| model.coordinates()[a.0].joint.clone()).collect();
        return Err(NoAnalyticIk::JointCount { frame: frame.name.clone(), joints: names });
    }
    let axes: [Screw; 6] = std::array::from_fn(|i| axes[i].1);
    let X_0 = data.X_WF(frame);
    // Reach: distances between successive axis points, and to the frame.
    let ends = axes[1..].iter().map(|a| a.o).chain([X_0.translation.vector]);
    let reach = axes.iter().zip(ends).map(|(a, end)| (end - a.o).norm()).sum::<f64>().max(1e-6);
    Ok(Chain { axes, X_0, reach })
}

/// Ratio of smallest to largest singular value of the Jacobian (lengths relative to the reach):
/// maximum over a few positions.
fn dexterity(chain: &Chain) -> f64 {
    let positions =
        [[0.3, -0.7, 1.1, 0.5, -0.9, 0.4], [-1.2, 0.4, -0.6, 1.3, 0.8, -0.2], [2.1, 0.9, 0.5, -1.6, 1.4, 1.0]];
    let conditioning = |q: &[f64; 6]| {
        let mut J = chain.jacobian(q);
        J.fixed_rows_mut::<3>(0).scale_mut(1.0 / chain.reach);
        let values = J.singular_values();
        values.min() / values.max()
    };
    positions.iter().map(conditioning).fold(0.0, f64::max)
}

struct RecognisedArm {
    class: ArmClass,
    kernel: Kernel,
    reversed: bool,
    deviation: f64,
}

/// Returns the first matching class, simplest first.
fn recognise(chain: &Chain, frame: &str) -> Result<RecognisedArm, NoAnalyticIk> {
    let from_tool = Lines::new(chain, true);
    let from_base = Lines::new(chain, false);
    // Three axes that meet at one point, at the tool or at the base.
    for lines in [&from_base, &from_tool] {
        if let Some((kernel, form, deviation)) = lines.wrist() {
            let class = if lines.reversed { ArmClass::SphericalShoulder(form) } else { ArmClass::SphericalWrist(form) };
            return Ok(RecognisedArm { class, kernel, reversed: lines.reversed, deviation });
        }
    }
    // Three neighbouring parallel axes, joints 2 to 4 first.
    for start in [1, 0] {
        for lines in [&from_base, &from_tool] {
            if let Some((kernel, meeting, deviation)) = lines.three_parallel(start) {
                let first = if lines.reversed { 4 - start } else { start + 1 };
                let class = ArmClass::ThreeParallel { first, meeting };
                return Ok(RecognisedArm { class, kernel, reversed: lines.reversed, deviation });
            }
        }
    }
    // No class matches: report the distance from each.
    let apart = |lines: &Lines| lines.meeting_point().map_or(f64::INFINITY, |(_, apart)| apart);
    let spread = |i: usize| from_base.angle(i, i + 1).max(from_base.angle(i, i + 2));
    Err(NoAnalyticIk::NoClass {
        frame: frame.to_owned(),
        wrist_m: apart(&from_base),
        shoulder_m: apart(&from_tool),
        allowed_m: AXIS_TOLERANCE * chain.reach,
        parallel_rad: (0..4).map(spread).fold(f64::INFINITY, f64::min),
    })
}

/// Joint axes, ordered from one end of the arm to the other.
struct Lines {
    axes: [Screw; 6],
    reach: f64,
    reversed: bool,
}

impl Lines {
    fn new(chain: &Chain, reversed: bool) -> Self {
        let mut axes = chain.axes;
        if reversed {
            axes.reverse();
            axes = axes.map(|a| a.reversed());
        }
        Self { axes, reach: chain.reach, reversed }
    }

    /// Angle between two lines, regardless of direction (rad).
    fn angle(&self, i: usize, j: usize) -> f64 {
        let (a, b) = (&self.axes[i].h, &self.axes[j].h);
        a.cross(b).norm().atan2(a.dot(b).abs())
    }

    fn parallel(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.angle(i, j)).filter(|a| *a <= AXIS_TOLERANCE_RAD)
    }

    /// Midpoint of the common perpendicular of two intersecting lines, and its length relative to
    /// the reach. `None` if the lines do not intersect, or if they are nearly parallel and
    /// intersect too far away for accurate computation.
    fn meeting(&self, i: usize, j: usize) -> Option<(Vector3<f64>, f64)> {
        if self.parallel(i, j).is_some() {
            return None;
        }
        let (a, b) = feet(&self.axes[i], &self.axes[j]);
        let apart = (a - b).norm() / self.reach;
        let near = (a - self.axes[i].o).norm() <= 10.0 * self.reach;
        Some((0.5 * (a + b), apart)).filter(|_| near && apart <= AXIS_TOLERANCE)
    }

    /// Point closest to the last three lines, and its maximum distance from them (m).
    fn meeting_point(&self) -> Option<(Vector3<f64>, f64)> {
        let (mut A, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for axis in &self.axes[3..] {
            let across = Matrix3::identity() - axis.h * axis.h.transpose();
            A += across;
            b += across * axis.o;
        }
        let c = A.lu().solve(&b)?;
        let apart = self.axes[3..].iter().map(|a| a.distance(&c)).fold(0.0, f64::max);
        Some((c, apart)).filter(|_| apart.is_finite())
    }

    /// Axes with a spherical wrist made exact, the form of the position problem, and the largest
    /// deviation from both (relative to the reach, or rad).
    fn wrist(&self) -> Option<(Kernel, PositionForm, f64)> {
        let (center, apart) = self.meeting_point()?;
        let apart = apart / self.reach;
        if apart > AXIS_TOLERANCE || self.parallel(3, 4).is_some() || self.parallel(4, 5).is_some() {
            return None;
        }
        // The last three axes meet: move their points to the centre.
        let mut axes = self.axes;
        for axis in &mut axes[3..] {
            axis.o = center;
        }
        // First form that the other axes match; their small deviation from it is removed.
        let (form, deviation) = if let Some(angle) = self.parallel(1, 2) {
            axes[2].h = axes[1].h * axes[1].h.dot(&axes[2].h).signum();
            (PositionForm::Parallel23, angle)
        } else if let Some((o, apart)) = self.meeting(0, 1) {
            (axes[0].o, axes[1].o) = (o, o);
            (PositionForm::Intersecting12, apart)
        } else if let Some((o, apart)) = self.meeting(1, 2) {
            (axes[1].o, axes[2].o) = (o, o);
            (PositionForm::Intersecting23, apart)
        } else if let Some(angle) = self.parallel(0, 1) {
            axes[1].h = axes[0].h * axes[0].h.dot(&axes[1].h).signum();
            (PositionForm::Parallel12, angle)
        } else {
            axes[1].o = feet(&axes[0], &axes[1]).1;
            (PositionForm::General, 0.0)
        };
        let kernel = Kernel::Wrist(Wrist::new(axes, center, form, self.reach));
        Some((kernel, form, apart.max(deviation)))
    }

    /// Three parallel axes starting at index `start` (0 or 1).
    fn three_parallel(&self, start: usize) -> Option<(Kernel, bool, f64)> {
        let deviation = self.parallel(start, start + 1)?.max(self.parallel(start, start + 2)?);
        if self.parallel(4, 5).is_some() {
            return None;
        }
        let mut axes = self.axes;
        let h = axes[start].h;
        for axis in &mut axes[start + 1..start + 3] {
            axis.h = h * h.dot(&axis.h).signum();
        }
        let meeting = self.meeting(4, 5);
        let deviation = deviation.max(meeting.map_or(0.0, |m| m.1));
        let kernel = match start {
            1 => Kernel::Parallel234(Parallel234::new(axes, meeting.is_some(), self.reach)),
            _ => Kernel::Parallel123(Parallel123::new(axes, meeting.is_some(), self.reach)),
        };
        Some((kernel, meeting.is_some(), deviation))
    }
}
