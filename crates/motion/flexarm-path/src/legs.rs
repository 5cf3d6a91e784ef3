//! Converts the moves of a program to paths from target to target, with the joints at both ends.
//!
//! Start at [`Legs::up_to_stop`]. A path of the tool is a curve in the world M of the model; its
//! joints at the end follow from those at the start by continuation, so that a line keeps the
//! branch of the inverse kinematics. Lengths are in m. Not here: blends (`route`), times
//! (`schedule`).

use flexarm_kinematics::{Data, Frame, IkOptions, inverse_kinematics_with_rule};
use flexarm_settings::{Finding, Place};
use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{DVector, Vector3, Vector6};

use crate::arm::{PathOptions, ProgramArm, base_of, tool_of};
use crate::branch::{Branches, NoBranch};
use crate::curve::{ToolCurve, ToolJet};
use crate::error::{BLOCKED, at_item, at_move, no_move};
use crate::follow::{Blocked, Follower, FrameCurve, GuidedJoint, JointJet};
use crate::program::{Blend, Item, Move, MoveKind, Program, Target};

/// Joint moves shorter than this (rad or m) are ignored.
const NO_WAY: f64 = 1e-12;
/// Length of a radian in a joint move that does not move the tool (m).
const JOINT_LENGTH: f64 = 0.5;

/// Fraction of a joint's velocity and acceleration limits for motion towards a better posture while
/// the tool moves.
const PART: f64 = 0.2;
/// TCP speed assumed if the program gives none (m/s).
const SPEED: f64 = 0.5;
/// A posture change smaller than this fraction of the desired one is dropped.
const SMALLEST_PART: f64 = 1e-6;

/// Path of a leg, over a parameter in metres.
#[derive(Debug, Clone)]
pub(crate) enum LegPath {
    /// A frame of the arm follows a curve.
    Tool(FrameCurve),
    /// Straight line in joint space: `q0 + d s`.
    Joints { q0: DVector<f64>, d: DVector<f64> },
    /// The quintic between two joint jets.
    Bridge { from: JointJet, to: JointJet },
}

/// One move: its path and the joints at both ends.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    /// The move.
    pub(crate) of: Move,
    pub(crate) way: LegPath,
    pub(crate) length: f64,
    pub(crate) q0: DVector<f64>,
    pub(crate) q1: DVector<f64>,
    /// Whether the end is a knot of a spline, after which the next leg continues smoothly.
    pub(crate) smooth: bool,
}

/// Current joint values and the next item of the program.
pub(crate) struct Start {
    pub(crate) q: DVector<f64>,
    /// Index of the first item still to be done.
    pub(crate) first: usize,
    /// Whether `q` is the exact start of the program, not only near it.
    pub(crate) known: bool,
}

impl Start {
    /// State before the first move; checks all numbers.
    pub(crate) fn of(program: &Program, arm: &ProgramArm<'_>) -> Result<Self, Box<Finding>> {
        for item in &program.items {
            item.check().map_err(|error| at_item(item, error))?;
        }
        let first = program.items.iter().find_map(|item| match item {
            Item::Move(first) => Some(first),
            Item::Dwell { .. } => None,
        });
        let first = first.ok_or_else(|| no_move(&program.name))?;
        if !arm.starts_at_rest && first.kind != MoveKind::Joint {
            let why = "the program begins with a move of the tool, and where it starts is not known: begin with a \
                       joint move, or give a start";
            return Err(at_move(first, "no-start", why));
        }
        Ok(Self { q: arm.rest.clone(), first: 0, known: arm.starts_at_rest })
    }
}

/// The arm and its workspaces for building legs.
pub(crate) struct Legs<'m> {
    pub(crate) arm: ProgramArm<'m>,
    pub(crate) options: PathOptions,
    branches: Branches<'m>,
    followers: Vec<(Pose, Follower<'m>)>,
    /// Joint held on tool paths.
    hold: Option<usize>,
}

impl<'m> Legs<'m> {
    pub(crate) fn new(arm: &ProgramArm<'m>, options: &PathOptions, hold: Option<usize>) -> Self {
        let branches = Branches::new(arm.model);
        Self { arm: arm.clone(), options: options.clone(), branches, followers: Vec::new(), hold }
    }

    /// Returns the follower of a frame: one per tool, so that a redundant arm always holds the same
    /// joints.
    pub(crate) fn follower(&mut self, frame: &Frame, q: &DVector<f64>) -> &mut Follower<'m> {
        let found = self.followers.iter().position(|(X, _)| *X == frame.X_BF);
        let k = found.unwrap_or_else(|| {
            self.followers.push((frame.X_BF, Follower::new(self.arm.model, frame, q, self.hold)));
            self.followers.len() - 1
        });
        &mut self.followers[k].1
    }

    /// Names of joints that are held although they could move the tool.
    pub(crate) fn fixed_joints(&self) -> Vec<String> {
        let mut fixed: Vec<usize> = self.followers.iter().flat_map(|(_, follower)| follower.fixed_joints()).collect();
        fixed.sort_unstable();
        fixed.dedup();
        fixed.into_iter().map(|k| self.arm.model.coordinates()[k].joint.clone()).collect()
    }

    /// Pose of a frame at joint values, in the model's world.
    pub(crate) fn pose(&mut self, frame: &Frame, q: &DVector<f64>) -> Pose {
        self.branches.pose(frame, q)
    }

    /// Builds the legs up to the next stop; afterwards `k` is the index of the item after the last
    /// leg.
    pub(crate) fn up_to_stop(
        &mut self,
        items: &[Item],
        k: &mut usize,
        start: &mut Start,
        stops: &mut Vec<(Place, String)>,
    ) -> Result<Vec<Leg>, Box<Finding>> {
        let mut legs: Vec<Leg> = Vec::new();
        while let Some(Item::Move(of)) = items.get(*k) {
            // Neighbouring spline moves form one leg.
            let group = spline_group(items, *k);
            if group.is_empty() {
                *k += 1;
                legs.extend(self.leg(of, start)?);
            } else {
                *k += group.len();
                legs.extend(self.spline(&group, start)?);
            }
            let last = &items[*k - 1];
            let Item::Move(last) = last else { break };
            if last.blend == Blend::Stop {
                break;
            }
            if let Some(Item::Dwell { place, .. }) = items.get(*k) {
                stops.push((place.clone(), "a dwell follows, so the tool stops".to_owned()));
            }
        }
        Ok(legs)
    }

    /// Builds the leg of one move; `None` if the arm is already at the target.
    pub(crate) fn leg(&mut self, of: &Move, start: &mut Start) -> Result<Option<Leg>, Box<Finding>> {
        if of.kind == MoveKind::Joint {
            return self.joint_leg(of, start);
        }
        let frame = tool_of(&self.arm, of);
        let X0 = self.pose(&frame, &start.q);
        let curve = self.tool_curve(of, &X0)?;
        self.tool_leg(of, frame, curve, start)
    }

    /// Path of the TCP of a move from pose X0, both in the base of the arm.
    fn tool_curve(&mut self, of: &Move, X0: &Pose) -> Result<ToolCurve, Box<Finding>> {
        let X_MB = base_of(&self.arm, of);
        let X1 = match &of.to {
            Target::Pose { X_BT, .. } => X_MB * X_BT,
            // A line to joint values (movel with a list of joints) goes to their pose.
            Target::Joints(values) => {
                let q = self.with_axes(of, values, &self.arm.rest.clone())?;
                let frame = tool_of(&self.arm, of);
                self.pose(&frame, &q)
            }
        };
        let MoveKind::Arc { via, via_rotation, angle, turns_with_path } = &of.kind else {
            return Ok(ToolCurve::line(X0, &X1));
        };
        let via = (X_MB * nalgebra::Point3::from(*via)).coords;
        let via_rotation = via_rotation.map(|R| X_MB.rotation * R);
        ToolCurve::arc(X0, &via, via_rotation.as_ref(), &X1, *angle, *turns_with_path)
            .map_err(|error| at_move(of, "arc", error))
    }

    /// Follows a curve once to find the joints at its end.
    fn tool_leg(
        &mut self,
        of: &Move,
        frame: Frame,
        curve: ToolCurve,
        start: &mut Start,
    ) -> Result<Option<Leg>, Box<Finding>> {
        let length = curve.length();
        if length <= 1e-9 {
            return Ok(None);
        }
        let q0 = start.q.clone();
        let mut way = FrameCurve::new(curve, frame);
        let mut q1 = self.end_of(&way, &q0).map_err(|blocked| blocked_error(of, &way.curve, blocked))?;
        if let Some((guided, q)) = self.guided(of, &way, &q0, &q1) {
            (way.guided, q1) = (guided, q);
        }
        start.q.copy_from(&q1);
        Ok(Some(Leg { of: of.clone(), way: LegPath::Tool(way), length, q0, q1, smooth: false }))
    }

    /// Inserts values of the controller's axes into the vector of all coordinates.
    fn with_axes(&self, of: &Move, values: &[f64], q: &DVector<f64>) -> Result<DVector<f64>, Box<Finding>> {
        let (found, axes) = (values.len(), self.arm.axes.len());
        if found > axes {
            return Err(at_move(of, "axes", format!("{found} axis values for an arm of {axes} axes")));
        }
        let mut q = q.clone();
        self.arm.set_axes(values, &mut q);
        Ok(q)
    }

    /// Leg of a joint move; `None` for the first move if the arm was not known to be anywhere
    /// before.
    fn joint_leg(&mut self, of: &Move, start: &mut Start) -> Result<Option<Leg>, Box<Finding>> {
        let frame = tool_of(&self.arm, of);
        let q1 = match &of.to {
            Target::Joints(values) => self.with_axes(of, values, &start.q)?,
            Target::Pose { X_BT, configuration } => {
                let X_MT = base_of(&self.arm, of) * X_BT;
                let choice = self.branches.choose(&frame, &X_MT, configuration, &start.q, &self.arm);
                choice.map_err(|NoBranch(why)| unreachable(of, &why))?
            }
        };
        let q0 = std::mem::replace(&mut start.q, q1.clone());
        if !std::mem::replace(&mut start.known, true) {
            return Ok(None);
        }
        let step = &q1 - &q0;
        if step.amax() <= NO_WAY {
            return Ok(None);
        }
        let length = self.travel(&frame, &q0, &step).max(JOINT_LENGTH * step.amax());
        let way = LegPath::Joints { q0: q0.clone(), d: step / length };
        Ok(Some(Leg { of: of.clone(), way, length, q0, q1, smooth: false }))
    }

    /// Length of the TCP path in a joint move, by chords (m).
    fn travel(&mut self, frame: &Frame, q0: &DVector<f64>, step: &DVector<f64>) -> f64 {
        const CHORDS: usize = 16;
        let mut point = |k: usize| {
            let q = q0 + step * (k as f64 / CHORDS as f64);
            self.pose(frame, &q).translation.vector
        };
        let points: Vec<Vector3<f64>> = (0..=CHORDS).map(&mut point).collect();
        points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }

    /// Joints at the end of a path.
    fn end_of(&mut self, way: &FrameCurve, q0: &DVector<f64>) -> Result<DVector<f64>, Blocked> {
        let follower = self.follower(&way.frame, q0);
        let begun = follower.start(way, 0.0, q0)?;
        Ok(follower.advance(way, 0.0, &begun, way.curve.length())?.q)
    }

    /// Motion of the redundant joints along a path towards the posture of the options' rule, or
    /// part of the way there; and the joints at its end. `None` without a rule, or if no better
    /// posture is found.
    fn guided(
        &mut self,
        of: &Move,
        way: &FrameCurve,
        q0: &DVector<f64>,
        q1: &DVector<f64>,
    ) -> Option<(Vec<GuidedJoint>, DVector<f64>)> {
        let rule = self.options.rule.clone()?;
        let left_over = self.follower(&way.frame, q0).fixed_joints();
        let length = way.curve.length();
        if left_over.is_empty() {
            return None;
        }
        // The posture that the rule wants at the end of the path.
        let (model, X1) = (self.arm.model, way.curve.at(length).X);
        let mut data = Data::new(model);
        let options = IkOptions::default();
        let wanted = inverse_kinematics_with_rule(model, &mut data, &way.frame, &X1, q1, &options, &rule).ok()?.q;
        // The part of the way there that the joints have time for, halved until the arm can follow.
        let largest_part = left_over
            .iter()
            .map(|&k| self.largest_change(of, k, length) / (wanted[k] - q0[k]).abs())
            .fold(1.0, f64::min);
        let mut part = largest_part;
        while part * largest_part > SMALLEST_PART {
            let joint = |&k: &usize| {
                let to = q0[k] + part * (wanted[k] - q0[k]);
                GuidedJoint { k, from: [q0[k], 0.0, 0.0], to: [to, 0.0, 0.0] }
            };
            let trial = FrameCurve { guided: left_over.iter().map(joint).collect(), ..way.clone() };
            if let Ok(q) = self.end_of(&trial, q0) {
                return Some((trial.guided, q));
            }
            part *= 0.5;
        }
        None
    }

    /// Maximum change of a redundant joint along a path that does not slow the tool: a fifth of its
    /// velocity and acceleration limits.
    fn largest_change(&self, of: &Move, k: usize, length: f64) -> f64 {
        // Peak derivatives of the quintic from rest to rest over its length.
        const RATE: f64 = 1.875;
        const SECOND: f64 = 5.7735;
        let (bounds, speed) = (&self.arm.bounds[k], of.speed.linear_m_s.unwrap_or(SPEED));
        let by_rate = PART * bounds.velocity / speed * length / RATE;
        let by_second = PART * bounds.acceleration / speed.powi(2) * length.powi(2) / SECOND;
        by_rate.min(by_second)
    }

    /// Legs of a spline through the targets of consecutive moves.
    pub(crate) fn spline(&mut self, group: &[&Move], start: &mut Start) -> Result<Vec<Leg>, Box<Finding>> {
        let frame = tool_of(&self.arm, group[0]);
        let mut poses = vec![self.pose(&frame, &start.q)];
        let mut owners: Vec<&Move> = Vec::new();
        for of in group {
            let Target::Pose { X_BT, .. } = &of.to else {
                return Err(unreachable(of, "a spline goes through poses, not through joint values"));
            };
            let X_MT = base_of(&self.arm, of) * X_BT;
            let last = &poses[poses.len() - 1];
            if (X_MT.translation.vector - last.translation.vector).norm() > 1e-9 {
                poses.push(X_MT);
                owners.push(of);
            }
        }
        let mut legs = Vec::new();
        for (k, curve) in spline_curves(&poses).into_iter().enumerate() {
            let leg = self.tool_leg(owners[k], frame.clone(), curve, start)?;
            legs.extend(leg.map(|leg| Leg { smooth: k + 1 < owners.len(), ..leg }));
        }
        Ok(legs)
    }
}

/// Moves from `k` on that are knots of one spline: consecutive spline moves with the same tool.
pub(crate) fn spline_group(items: &[Item], k: usize) -> Vec<&Move> {
    let knot = |item: &'_ Item| matches!(item, Item::Move(of) if of.kind == MoveKind::Spline);
    let mut group: Vec<&Move> = Vec::new();
    for item in items[k..].iter().take_while(|item| knot(item)) {
        let Item::Move(of) = item else { break };
        if group.first().is_some_and(|first| first.X_FT != of.X_FT) {
            break;
        }
        group.push(of);
        // A stop within the block ends the curve.
        if of.blend == Blend::Stop {
            break;
        }
    }
    group
}

/// The natural cubic spline through positions over chord length; orientations have continuous
/// rates.
fn spline_curves(poses: &[Pose]) -> Vec<ToolCurve> {
    let p: Vec<Vector3<f64>> = poses.iter().map(|X| X.translation.vector).collect();
    let h: Vec<f64> = p.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    let n = h.len();
    // Rotation vectors per length between neighbouring poses.
    let second = natural_second_derivatives(&p, &h);
    let turns: Vec<Vector3<f64>> = poses
        .windows(2)
        .zip(&h)
        .map(|(pair, h)| rotation_vector((pair[1].rotation * pair[0].rotation.inverse()).matrix()) / *h)
        .collect();
    let jet = |k: usize| {
        let rate = if k < n {
            (p[k + 1] - p[k]) / h[k] - (second[k] * 2.0 + second[k + 1]) * (h[k] / 6.0)
        } else {
            (p[k] - p[k - 1]) / h[k - 1] + (second[k - 1] + second[k] * 2.0) * (h[k - 1] / 6.0)
        };
        // At inner knots the turning rate of the parabola through three poses.
        let turn = match k {
            0 => turns[0],
            k if k == n => turns[n - 1],
            k => (turns[k - 1] * h[k] + turns[k] * h[k - 1]) / (h[k - 1] + h[k]),
        };
        let six = |v: Vector3<f64>, w: Vector3<f64>| Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z);
        ToolJet { X: poses[k], V: six(rate, turn), A: six(second[k], Vector3::zeros()) }
    };
    (0..n).map(|k| ToolCurve::between(&jet(k), &jet(k + 1), h[k])).collect()
}

/// Second derivatives at the knots of the natural cubic spline (Thomas algorithm).
fn natural_second_derivatives(p: &[Vector3<f64>], h: &[f64]) -> Vec<Vector3<f64>> {
    let n = h.len();
    let mut second = vec![Vector3::zeros(); n + 1];
    let (mut factor, mut rhs) = (vec![0.0; n + 1], vec![Vector3::zeros(); n + 1]);
    for k in 1..n {
        let right = ((p[k + 1] - p[k]) / h[k] - (p[k] - p[k - 1]) / h[k - 1]) * 6.0;
        let pivot = 2.0 * (h[k - 1] + h[k]) - h[k - 1] * factor[k - 1];
        factor[k] = h[k] / pivot;
        rhs[k] = (right - rhs[k - 1] * h[k - 1]) / pivot;
    }
    for k in (1..n).rev() {
        second[k] = rhs[k] - second[k + 1] * factor[k];
    }
    second
}

/// Error about a target that no joint values reach.
fn unreachable(of: &Move, why: &str) -> Box<Finding> {
    at_move(of, "unreachable", format!("no joint values bring the tool there: {why}"))
}

/// Error for a path that cannot be followed, with the reason as a sentence.
pub(crate) fn blocked_error(of: &Move, curve: &ToolCurve, blocked: Blocked) -> Box<Finding> {
    let part = 100.0 * blocked.s / curve.length();
    let p = curve.at(blocked.s).X.translation.vector;
    let place = format!("{part:.1} % of the way, at ({:.4}, {:.4}, {:.4}) m", p.x, p.y, p.z);
    let why = if blocked.too_few_joints {
        format!("the arm has too few joints to follow this path with its orientation beyond {place}")
    } else {
        format!(
            "the arm cannot continue beyond {place}: it is out of reach or at a singular pose, where joint {:?} would have to move without bound (minimum singular value {:.1e} m/rad): move the path or the workpiece, or go there by a joint move",
            blocked.joint, blocked.sigma
        )
    };
    at_move(of, BLOCKED, why)
}
