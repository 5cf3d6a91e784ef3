//! Joints along a TCP path: values and two derivatives by the parameter, by continuation from the
//! start of the path.
//!
//! ```text
//! J q' = V,    J q'' = A - J' q',    V, A: derivatives of the tool's pose by s
//! ```
//! From one point to the next the joints are predicted by their Taylor polynomial and corrected by
//! Newton's method; steps are halved where the two differ too much, so that the branch of the
//! inverse kinematics is kept. An arm with fewer than six joints follows the paths that it can
//! follow (least squares, then a check). For an arm with more than six joints, joints are held
//! until six are left, or move according to [`FrameCurve::guided`].
//!
//! Start at [`Follower::start`], then [`Follower::advance`]. `s` is in m, poses are in the world of
//! the model. Not here: the curves ([`crate::ToolCurve`]), branches of the inverse kinematics
//! (`branch`).

use flexarm_kinematics::{
    Data, Frame, Model, State, forward_kinematics, forward_kinematics_velocity, frame_jacobian,
    frame_jacobian_derivative,
};
use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{DMatrix, DVector, Matrix6xX, Vector6};

use crate::curve::{TURN_LENGTH, ToolCurve};

/// Newton's method has converged below this error (m and rad).
const ARRIVED: f64 = 1e-12;
/// Maximum residual for an arm with fewer than six joints (m and rad).
const FOLLOWED: f64 = 1e-9;
/// Maximum difference between prediction and correction before a step is halved (rad or m).
const SURPRISE: f64 = 0.03;
/// Minimum step along a path before the path counts as blocked, relative to its length.
const SHORTEST: f64 = 1e-7;
/// Maximum number of Newton corrections of a point.
const CORRECTIONS: usize = 12;

/// All independent coordinates with their derivatives by the parameter of the path.
#[derive(Debug, Clone, PartialEq)]
pub struct JointJet {
    /// Values (rad or m).
    pub q: DVector<f64>,
    /// First derivative.
    pub d: DVector<f64>,
    /// Second derivative.
    pub dd: DVector<f64>,
}

/// The quintic between two joint jets at `s`, with its third derivative.
pub(crate) fn between(a: &JointJet, b: &JointJet, h: f64, s: f64) -> (JointJet, DVector<f64>) {
    let step = &b.q - &a.q;
    let c3 = (&step * 20.0 - (&b.d * 8.0 + &a.d * 12.0) * h - (&a.dd * 3.0 - &b.dd) * (h * h)) / (2.0 * h.powi(3));
    let c4 =
        (&step * -30.0 + (&b.d * 14.0 + &a.d * 16.0) * h + (&a.dd * 3.0 - &b.dd * 2.0) * (h * h)) / (2.0 * h.powi(4));
    let c5 = (step * 12.0 - (&b.d + &a.d) * (6.0 * h) + (&b.dd - &a.dd) * (h * h)) / (2.0 * h.powi(5));
    let q = &a.q + (&a.d + (&a.dd * 0.5 + (&c3 + (&c4 + &c5 * s) * s) * s) * s) * s;
    let d = &a.d + (&a.dd + (&c3 * 3.0 + (&c4 * 4.0 + &c5 * (5.0 * s)) * s) * s) * s;
    let dd = &a.dd + (&c3 * 6.0 + (&c4 * 12.0 + &c5 * (20.0 * s)) * s) * s;
    let ddd = c3 * 6.0 + (c4 * 24.0 + c5 * (60.0 * s)) * s;
    (JointJet { q, d, dd }, ddd)
}

/// A coordinate that moves along a path by its own polynomial while others follow the tool.
#[derive(Debug, Clone, PartialEq)]
pub struct GuidedJoint {
    /// Index of the coordinate.
    pub k: usize,
    /// Value and two derivatives by the parameter at the start of the path (rad or m, and per m).
    pub from: [f64; 3],
    /// The same at the end of the path.
    pub to: [f64; 3],
}

impl GuidedJoint {
    /// Value and two derivatives at `s` of a path of length `h`: the quintic between both ends.
    pub fn at(&self, h: f64, s: f64) -> [f64; 3] {
        let one = |x: f64| DVector::from_element(1, x);
        let jet = |[q, d, dd]: [f64; 3]| JointJet { q: one(q), d: one(d), dd: one(dd) };
        let (found, _) = between(&jet(self.from), &jet(self.to), h, s);
        [found.q[0], found.d[0], found.dd[0]]
    }
}

/// A curve with the frame of the arm that follows it.
#[derive(Debug, Clone)]
pub struct FrameCurve {
    /// The curve.
    pub curve: Box<ToolCurve>,
    /// Frame that follows the curve.
    pub frame: Frame,
    /// Redundant joints that move along by their own polynomial; other redundant joints are held.
    pub guided: Vec<GuidedJoint>,
}

impl FrameCurve {
    /// With all redundant joints held.
    pub fn new(curve: ToolCurve, frame: Frame) -> Self {
        Self { curve: Box::new(curve), frame, guided: Vec::new() }
    }

    fn guides(&self, s: f64) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.guided.iter().map(move |joint| (joint.k, joint.at(self.curve.length(), s)))
    }
}

/// The joints cannot follow the tool path.
#[derive(Debug, Clone, PartialEq)]
pub struct Blocked {
    /// Parameter up to which they can.
    pub s: f64,
    /// Minimum singular value of the Jacobian there (rotation scaled by [`TURN_LENGTH`]), m/rad.
    pub sigma: f64,
    /// Joint that would have to move fastest there.
    pub joint: String,
    /// Whether the arm has too few joints for the position or orientation of the tool.
    pub too_few_joints: bool,
}

/// An arm whose frame follows a path.
pub struct Follower<'m> {
    model: &'m Model,
    frame: Frame,
    data: Data,
    state: State,
    J: Matrix6xX<f64>,
    Jdot: Matrix6xX<f64>,
    /// Indices of the coordinates that follow the tool, ascending.
    active: Vec<usize>,
}

/// Returns the indices of the actuated coordinates that move a frame, ascending: those whose column
/// of the Jacobian is not zero at a generic pose.
pub fn coordinates_of(model: &Model, frame: &Frame) -> Vec<usize> {
    let mut data = Data::new(model);
    let mut J = Matrix6xX::zeros(model.nv());
    // At a generic, non-singular pose.
    let q = DVector::from_fn(model.nv(), |k, _| if k < model.n_actuated() { 0.3 + 0.17 * k as f64 } else { 0.0 });
    forward_kinematics(model, &mut data, &q);
    frame_jacobian(model, &data, frame, &mut J);
    (0..model.n_actuated()).filter(|&k| J.column(k).norm() > 1e-12).collect()
}

impl<'m> Follower<'m> {
    /// Creates a follower for a frame of a model. For an arm with more than six joints the held
    /// joints are chosen at `q` so that the minimum singular value of the remaining ones is
    /// largest.
    ///
    /// * `q`: all independent coordinates.
    /// * `hold`: a joint that is held in any case if the arm has more than six joints.
    pub fn new(model: &'m Model, frame: &Frame, q: &DVector<f64>, hold: Option<usize>) -> Self {
        let mut follower = Self {
            model,
            frame: frame.clone(),
            data: Data::new(model),
            state: State::zeros(model),
            J: Matrix6xX::zeros(model.nv()),
            Jdot: Matrix6xX::zeros(model.nv()),
            active: coordinates_of(model, frame),
        };
        if follower.active.len() > 6 {
            follower.active.retain(|&k| Some(k) != hold);
        }
        while follower.active.len() > 6 {
            follower.fix_one(q);
        }
        follower
    }

    /// Returns the coordinates that are held while the others follow, ascending; empty for an arm
    /// with six joints or fewer.
    pub fn fixed_joints(&self) -> Vec<usize> {
        let moving = coordinates_of(self.model, &self.frame);
        moving.into_iter().filter(|k| !self.active.contains(k)).collect()
    }

    /// Holds the joint without which the minimum singular value is largest.
    fn fix_one(&mut self, q: &DVector<f64>) {
        forward_kinematics(self.model, &mut self.data, q);
        frame_jacobian(self.model, &self.data, &self.frame, &mut self.J);
        let without = |k: usize| {
            let rest: Vec<usize> = self.active.iter().copied().filter(|&c| c != k).collect();
            self.scaled(&rest).singular_values().min()
        };
        let best = self.active.iter().copied().max_by(|&a, &b| without(a).total_cmp(&without(b)));
        self.active.retain(|&k| Some(k) != best);
    }

    /// Columns of the last Jacobian, with rotations scaled to metres.
    fn scaled(&self, columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(6, columns.len(), |r, c| self.J[(r, columns[c])] * if r < 3 { 1.0 } else { TURN_LENGTH })
    }

    /// Solution of `J x = b` for the active joints (least squares if there are fewer than six).
    fn solve(&self, b: &Vector6<f64>) -> Option<DVector<f64>> {
        let scaled = DVector::from_fn(6, |r, _| b[r] * if r < 3 { 1.0 } else { TURN_LENGTH });
        let J = self.scaled(&self.active);
        let x = if self.active.len() == 6 {
            J.lu().solve(&scaled)?
        } else {
            let qr = J.qr();
            let rhs = qr.q().tr_mul(&scaled);
            qr.r().solve_upper_triangular(&rhs)?
        };
        x.iter().all(|x| x.is_finite()).then_some(x)
    }

    /// Finds the joint values at which the frame has the given pose, starting from nearby values;
    /// `None` if Newton's method does not converge.
    fn correct(&mut self, X_WT: &Pose, q: &mut DVector<f64>) -> Option<()> {
        let mut last = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            forward_kinematics(self.model, &mut self.data, q);
            let X = self.data.X_WF(&self.frame);
            let p = X_WT.translation.vector - X.translation.vector;
            let r = rotation_vector((X_WT.rotation * X.rotation.inverse()).matrix());
            let error = p.norm().max(r.norm());
            frame_jacobian(self.model, &self.data, &self.frame, &mut self.J);
            // For large arms rounding stops the convergence slightly above `ARRIVED`.
            if error <= ARRIVED || (error <= FOLLOWED && error > 0.5 * last) {
                return Some(());
            }
            let step = self.solve(&Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z))?;
            if step.amax() > 0.5 {
                return None;
            }
            for (x, &k) in step.iter().zip(&self.active) {
                q[k] += x;
            }
            last = error;
        }
        None
    }

    /// Joint values and derivatives at `s` of a path, from nearby values.
    fn jet(&mut self, way: &FrameCurve, s: f64, near: &DVector<f64>) -> Option<JointJet> {
        // Values: guided joints by their polynomials, the others by Newton's method.
        let tool = way.curve.at(s);
        let mut q = near.clone();
        for (k, [value, ..]) in way.guides(s) {
            q[k] = value;
        }
        self.correct(&tool.X, &mut q)?;
        // J d = V, and J dd = A - J' d, less the part of the guided joints.
        let mut d = DVector::zeros(q.len());
        let mut V = tool.V;
        for (k, [_, rate, _]) in way.guides(s) {
            d[k] = rate;
            V -= self.J.column(k) * rate;
        }
        for (x, &k) in self.solve(&V)?.iter().zip(&self.active) {
            d[k] = *x;
        }
        self.state.q.copy_from(&q);
        self.state.qdot.copy_from(&d);
        forward_kinematics_velocity(self.model, &mut self.data, &self.state);
        frame_jacobian_derivative(self.model, &self.data, &self.state, &self.frame, &mut self.Jdot);
        let bias: Vector6<f64> = (&self.Jdot * &d).fixed_rows::<6>(0).into();
        let mut dd = DVector::zeros(q.len());
        let mut A = tool.A - bias;
        for (k, [.., second]) in way.guides(s) {
            dd[k] = second;
            A -= self.J.column(k) * second;
        }
        for (x, &k) in self.solve(&A)?.iter().zip(&self.active) {
            dd[k] = *x;
        }
        Some(JointJet { q, d, dd })
    }

    /// Returns the speed of the frame's origin for the joint rates `d` (m per unit of the
    /// parameter).
    pub fn speed(&mut self, jet: &JointJet) -> f64 {
        forward_kinematics(self.model, &mut self.data, &jet.q);
        frame_jacobian(self.model, &self.data, &self.frame, &mut self.J);
        (&self.J * &jet.d).fixed_rows::<3>(0).norm()
    }

    /// Returns the distance of the frame from a curve's pose at `s`: maximum of position (m) and
    /// rotation (rad) errors.
    pub fn distance(&mut self, curve: &ToolCurve, s: f64, q: &DVector<f64>) -> f64 {
        forward_kinematics(self.model, &mut self.data, q);
        let (X, target) = (self.data.X_WF(&self.frame), curve.at(s).X);
        let p = target.translation.vector - X.translation.vector;
        p.norm().max(rotation_vector((target.rotation * X.rotation.inverse()).matrix()).norm())
    }

    /// Returns the minimum singular value of the Jacobian at the last point (m/rad), with rotations
    /// scaled by [`TURN_LENGTH`].
    pub fn sigma(&self) -> f64 {
        self.scaled(&self.active).singular_values().min()
    }

    /// Returns joint values and derivatives at `s`, where a path begins, from joint values `q` near
    /// that pose (all independent coordinates, rad or m).
    ///
    /// # Errors
    /// [`Blocked`] if the pose is not reached near these values, or the arm is singular there.
    pub fn start(&mut self, way: &FrameCurve, s: f64, q: &DVector<f64>) -> Result<JointJet, Blocked> {
        self.jet(way, s, q).ok_or_else(|| self.blocked(s, q))
    }

    /// Returns joint values and derivatives at `to` by continuation from those at `from`; either
    /// parameter may be the larger.
    ///
    /// # Errors
    /// [`Blocked`] if the arm cannot reach that far on this branch, or passes a singular pose.
    pub fn advance(&mut self, way: &FrameCurve, from: f64, at: &JointJet, to: f64) -> Result<JointJet, Blocked> {
        let shortest = SHORTEST * way.curve.length().max((to - from).abs());
        let (mut s, mut jet, mut h) = (from, at.clone(), to - from);
        while s != to {
            let next = if (to - s).abs() <= h.abs() { to } else { s + h };
            let step = next - s;
            let predicted = &jet.q + &jet.d * step + &jet.dd * (0.5 * step * step);
            let moved = (&predicted - &jet.q).amax() <= 0.5;
            // A step is good if Newton's method ends near the prediction: the branch is the same.
            let found = if moved { self.jet(way, next, &predicted) } else { None };
            match found.filter(|found| (&found.q - &predicted).amax() <= SURPRISE) {
                Some(found) => (s, jet, h) = (next, found, 2.0 * h),
                None if 0.5 * step.abs() < shortest => return Err(self.blocked(s, &jet.q)),
                None => h = 0.5 * step,
            }
        }
        Ok(jet)
    }

    fn blocked(&mut self, s: f64, q: &DVector<f64>) -> Blocked {
        forward_kinematics(self.model, &mut self.data, q);
        frame_jacobian(self.model, &self.data, &self.frame, &mut self.J);
        let svd = self.scaled(&self.active).svd(false, true);
        let least = svd.singular_values.imin();
        let fastest = svd.v_t.as_ref().map_or(0, |v| v.row(least).transpose().iamax());
        let joint = self.active.get(fastest).map_or_else(String::new, |&k| self.model.coordinates()[k].joint.clone());
        Blocked { s, sigma: svd.singular_values[least], joint, too_few_joints: self.active.len() < 6 }
    }
}
