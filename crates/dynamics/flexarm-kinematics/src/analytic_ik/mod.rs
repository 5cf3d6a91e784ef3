//! Inverse kinematics in closed form: every joint position of an arm of six revolute joints that
//! brings a frame to a pose.
//!
//! [`AnalyticArm::new`] looks at the six joint axes and says which class the arm belongs to, or why
//! it has no solution in closed form ([`NoAnalyticIk`]; then
//! [`crate::inverse_kinematics_from_many_starts`]). [`AnalyticArm::solve`] fills [`Solutions`]
//! without allocation. Which of them is meant is a matter of [`Branch`], [`Selection`] and
//! [`AnalyticArm::choose`] (`branch.rs`).
//!
//! | class | what is solved |
//! | --- | --- |
//! | axes 4, 5, 6 meet (spherical wrist) | the first three joints place the meeting point ([`PositionForm`]), then two wrists each |
//! | axes 1, 2, 3 meet (spherical shoulder) | the same arm from the other end |
//! | axes 2, 3, 4 or 3, 4, 5 are parallel | angles 1 and 5 (two and two, or a quartic), then two elbows |
//! | axes 1, 2, 3 or 4, 5, 6 are parallel | angles 4 and 5 (two and two, or a polynomial of degree eight), then two elbows |
//!
//! The equations are the subproblems of Paden and Kahan in the extended set of [Elias & Wen 2022];
//! classes as in [Ostermeier et al. 2024]; the quartic is that of [Pieper 1968]. All roots of a
//! polynomial are found at once (Aberth's iteration on the unit circle of `e^{i q}`), none is
//! searched for.
//!
//! Axes may miss their class by [`AXIS_TOLERANCE_RAD`] and [`AXIS_TOLERANCE`] of the reach, as
//! those of files with five digits do. The class then gives start values, and Newton's method on
//! the arm as it is gives the solutions: each one of them meets the pose to [`POSE_TOLERANCE`].
//! Within about the tolerance of a boundary of the workspace some may be missing then.
//!
//! What misses least where there is no solution is not a solution; [`Solutions::miss`] tells how
//! far it is off. Where a pose leaves a joint free (straight wrist, wrist centre on axis 1, folded
//! bars of one length), one representative is given and marked ([`Solution::free`]).
//!
//! ```
//! use flexarm_kinematics::*;
//! use nalgebra::Vector3;
//!
//! // An arm with the dimensions of a small industrial robot, standing upright with its forearm ahead.
//! let mut arm = Mechanism::new("small");
//! arm.links.push(Link { name: "base".into(), inertia: None });
//! let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
//! let rows = [(z, [0.0, 0.0, 0.29]), (y, [0.0, 0.0, 0.0]), (y, [0.0, 0.0, 0.27]), (x, [0.302, 0.0, 0.07]), (y, [0.0; 3]), (x, [0.072, 0.0, 0.0])];
//! for (k, (axis, [px, py, pz])) in rows.into_iter().enumerate() {
//!     let (parent, child) = (arm.links[k].name.clone(), format!("link_{}", k + 1));
//!     arm.links.push(Link { name: child.clone(), inertia: None });
//!     arm.joints.push(Joint::new(format!("joint_{}", k + 1), JointKind::Continuous(axis), parent, child, Pose::translation(px, py, pz)));
//! }
//! let model = Model::new(&arm)?;
//! let arm = AnalyticArm::new(&model, model.frame("link_6").unwrap())?;
//! assert_eq!(arm.class(), ArmClass::SphericalWrist(PositionForm::Parallel23));
//!
//! let mut solutions = Solutions::default();
//! arm.solve(&arm.pose(&[0.3, 0.4, 0.2, -0.5, 0.6, 1.0]), &mut solutions);
//! assert_eq!(solutions.len(), 8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod branch;
mod parallel;
mod position;
mod recognise;
mod screw;
mod trig;
mod wrist;

use flexarm_spatial::Pose;

pub use branch::{Branch, ControllerAxes, Selection, abb_quadrant, kuka_turn};
pub use position::PositionForm;
pub use recognise::{AXIS_TOLERANCE, AXIS_TOLERANCE_RAD, ArmClass, NoAnalyticIk};
pub use screw::Miss;

use branch::Sides;
use parallel::{Parallel123, Parallel234};
use screw::{Chain, wrapped};
use trig::List;
use wrist::Wrist;

/// What a candidate may miss the pose by to be improved, lengths over the reach.
const CAPTURE: f64 = 3e-3;

/// Most solutions that a class has.
const MOST_SOLUTIONS: usize = 16;

/// What a solution may miss the pose by: so many m (times the reach, where that is above 1 m) and
/// rad.
pub const POSE_TOLERANCE: f64 = 1e-12;

/// Solutions whose angles all agree so well (rad) are one: next to a boundary two become one.
const SAME: f64 = 1e-6;

/// An arm of six revolute joints whose inverse kinematics has a closed form.
#[derive(Clone, Debug)]
pub struct AnalyticArm {
    chain: Chain,
    kernel: Kernel,
    class: ArmClass,
    /// Whether the kernel solves the arm from the tool to the base.
    reversed: bool,
    deviation: f64,
    joints: [usize; 6],
    limits: [(f64, f64); 6],
    sides: Sides,
}

/// Equations of a class.
#[derive(Clone, Copy, Debug)]
enum Kernel {
    Wrist(Wrist),
    Parallel234(Parallel234),
    Parallel123(Parallel123),
}

/// Joint values that may be solutions, as a kernel finds them.
pub(crate) struct Candidates {
    list: List<Candidate, 64>,
}

#[derive(Clone, Copy)]
struct Candidate {
    q: [f64; 6],
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// One of its own; whether one of its joints is free.
    Single { free: bool },
    /// Stands for a whole family if it meets the pose as it is.
    Representative { group: usize },
    /// Of use only where the family of that number has no representative.
    Member { group: usize },
}

impl Kind {
    fn or_free(self, also: bool) -> Self {
        match self {
            Self::Single { free } => Self::Single { free: free || also },
            other => other,
        }
    }
}

/// Below this sine two axes are one line to what a pose may be missed by: only the sum of their
/// angles matters.
const STRAIGHT: f64 = POSE_TOLERANCE;

impl Candidates {
    fn new() -> Self {
        Self { list: List::new(Candidate { q: [0.0; 6], kind: Kind::Single { free: false } }) }
    }

    fn add(&mut self, q: [f64; 6], kind: Kind) {
        self.list.push(Candidate { q, kind });
    }
}

/// Joint values that bring the frame to the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Joint values in the order of the chain (rad), within (-π, π].
    pub q: [f64; 6],
    /// On which sides shoulder, elbow and wrist are.
    pub branch: Branch,
    /// The pose leaves a joint free: this is one of a family of solutions.
    pub free: bool,
    /// What is left between pose and forward kinematics.
    pub miss: Miss,
}

/// All solutions of one query; made once and filled again and again.
#[derive(Clone, Copy, Debug)]
pub struct Solutions {
    list: List<Solution, MOST_SOLUTIONS>,
    miss: Option<Miss>,
}

impl Default for Solutions {
    fn default() -> Self {
        let miss = Miss { position_m: 0.0, rotation_rad: 0.0 };
        let blank = Solution { q: [0.0; 6], branch: Branch::default(), free: false, miss };
        Self { list: List::new(blank), miss: None }
    }
}

impl std::ops::Deref for Solutions {
    type Target = [Solution];

    fn deref(&self) -> &[Solution] {
        self.list.as_slice()
    }
}

impl Solutions {
    /// Where there is no solution: how far off the joint values are that the class's equations come
    /// nearest with. An upper bound of the distance of the pose from the workspace, and none of the
    /// limits of joints.
    pub fn miss(&self) -> Option<Miss> {
        self.miss.filter(|_| self.is_empty())
    }

    fn clear(&mut self) {
        self.list.clear();
        self.miss = None;
    }

    fn add(&mut self, solution: Solution) {
        let same = |s: &Solution| s.q.iter().zip(&solution.q).all(|(a, b)| wrapped(a - b).abs() < SAME);
        if let Some(twin) = self.list.as_mut_slice().iter_mut().find(|s| same(s)) {
            let free = twin.free || solution.free;
            if solution.miss.norm() < twin.miss.norm() {
                *twin = solution;
            }
            twin.free = free;
        } else if self.len() < MOST_SOLUTIONS {
            self.list.push(solution);
        }
    }

    fn missed(&mut self, miss: Miss) {
        if self.miss.is_none_or(|m| miss.norm() < m.norm()) {
            self.miss = Some(miss);
        }
    }
}

impl AnalyticArm {
    /// Class of the arm.
    pub fn class(&self) -> ArmClass {
        self.class
    }

    /// How far its axes are from those of the class: the larger of angles (rad) and of lengths over
    /// the reach.
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// Scale of its lengths: all links stretched out, from axis 1 to the frame (m).
    pub fn reach(&self) -> f64 {
        self.chain.reach
    }

    /// Numbers of its joints' coordinates in the model, in the order of the chain.
    pub fn joints(&self) -> &[usize; 6] {
        &self.joints
    }

    /// Limits of its joints, lower and upper (rad), in the order of the chain; infinite where there
    /// are none.
    pub fn limits(&self) -> &[(f64, f64); 6] {
        &self.limits
    }

    /// `X_WT` at joint values (rad), the same as the model's forward kinematics to rounding.
    pub fn pose(&self, q: &[f64; 6]) -> Pose {
        self.chain.pose(q)
    }

    /// All joint values that bring the frame to `X_WT`, whatever the limits; a free joint is at
    /// zero.
    ///
    /// Does not allocate. A pose with NaN or infinite entries has no solution, and none has one
    /// whose rotation is not orthogonal to [`POSE_TOLERANCE`].
    pub fn solve(&self, X_WT: &Pose, solutions: &mut Solutions) {
        self.solve_near(X_WT, &[0.0; 6], solutions);
    }

    /// [`Self::solve`] with free joints at the values of `near` (rad), say the position before.
    pub fn solve_near(&self, X_WT: &Pose, near: &[f64; 6], solutions: &mut Solutions) {
        solutions.clear();
        let finite = X_WT.translation.vector.iter().chain(X_WT.rotation.matrix().iter()).all(|x| x.is_finite());
        if !finite {
            return;
        }
        let mut found = Candidates::new();
        let (mut G, mut hint) = (X_WT * self.chain.X_0.inverse(), *near);
        if self.reversed {
            G = G.inverse();
            hint.reverse();
        }
        match &self.kernel {
            Kernel::Wrist(kernel) => kernel.solve(&G, &hint, &mut found),
            Kernel::Parallel234(kernel) => kernel.solve(&G, &hint, &mut found),
            Kernel::Parallel123(kernel) => kernel.solve(&G, &hint, &mut found),
        }
        let mut families = 0_u32;
        for candidate in found.list.as_slice() {
            let mut q = candidate.q;
            if self.reversed {
                q.reverse();
            }
            match candidate.kind {
                Kind::Single { free } => {
                    self.accept(q, free, CAPTURE, X_WT, solutions);
                }
                // Not improved: that would lead from where the free joint is to be.
                Kind::Representative { group } => {
                    families |= u32::from(self.accept(q, true, 0.0, X_WT, solutions)) << group;
                }
                Kind::Member { group } if families >> group & 1 == 0 => {
                    self.accept(q, true, CAPTURE, X_WT, solutions);
                }
                Kind::Member { .. } => {}
            }
        }
    }

    /// Improves a candidate that misses by `capture` at most and adds it if it meets the pose.
    fn accept(&self, mut q: [f64; 6], free: bool, capture: f64, X_WT: &Pose, solutions: &mut Solutions) -> bool {
        let miss = self.chain.polish(&mut q, X_WT, capture);
        let q = q.map(wrapped);
        let meets =
            miss.position_m <= POSE_TOLERANCE * self.chain.reach.max(1.0) && miss.rotation_rad <= POSE_TOLERANCE;
        if meets {
            solutions.add(Solution { q, branch: self.branch(&q), free, miss });
        } else {
            solutions.missed(miss);
        }
        meets
    }
}
