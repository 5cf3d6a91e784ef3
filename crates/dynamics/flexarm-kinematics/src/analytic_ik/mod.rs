//! Analytic inverse kinematics: all joint values of an arm with six revolute joints that bring a
//! frame to a pose.
//!
//! [`AnalyticArm::new`] determines the class of the arm from its six joint axes, or the reason why
//! it has no closed form ([`NoAnalyticIk`]; then use
//! [`crate::inverse_kinematics_from_many_starts`]). [`AnalyticArm::solve`] fills [`Solutions`]
//! without allocation. One of the solutions is selected with [`Branch`], [`Selection`] and
//! [`AnalyticArm::choose`] (`branch.rs`).
//!
//! | class | solution |
//! | --- | --- |
//! | axes 4, 5, 6 intersect (spherical wrist) | joints 1 to 3 from the wrist centre ([`PositionForm`]), then two wrists each |
//! | axes 1, 2, 3 intersect (spherical shoulder) | the same arm from the other end |
//! | axes 2, 3, 4 or 3, 4, 5 are parallel | angles 1 and 5 (two and two, or a quartic), then two elbows |
//! | axes 1, 2, 3 or 4, 5, 6 are parallel | angles 4 and 5 (two and two, or a polynomial of degree eight), then two elbows |
//!
//! The equations are the subproblems of Paden and Kahan in the extended set of [Elias & Wen 2022];
//! classes as in [Ostermeier et al. 2024]; the quartic is that of [Pieper 1968]. All roots of a
//! polynomial are computed at once (Aberth's iteration on the unit circle of `e^{i q}`), without a
//! search.
//!
//! Axes may deviate from their class by [`AXIS_TOLERANCE_RAD`] and by [`AXIS_TOLERANCE`] of the
//! reach, as they do in files with five digits. The class then gives start values, and Newton's
//! method on the actual arm gives the solutions: each meets the pose to [`POSE_TOLERANCE`]. Within
//! about the tolerance of a workspace boundary, solutions may then be missing.
//!
//! If there is no solution, the closest approximation is not returned; [`Solutions::miss`] is its
//! residual. If a pose leaves a joint free (straight wrist, wrist centre on axis 1, folded bars of
//! equal length), one representative is returned and marked ([`Solution::free`]).
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
pub(crate) mod trig;
mod wrist;

use flexarm_spatial::Pose;

pub use branch::{Branch, ControllerAxes, Selection, kuka_turn};
pub use position::PositionForm;
pub use recognise::{AXIS_TOLERANCE, AXIS_TOLERANCE_RAD, ArmClass, NoAnalyticIk};
pub use screw::Miss;

use branch::Sides;
use parallel::{Parallel123, Parallel234};
use screw::{Chain, wrapped};
use trig::List;
use wrist::Wrist;

/// Maximum pose residual of a candidate for it to be refined (rad; lengths relative to the reach).
const CAPTURE: f64 = 3e-3;

/// Maximum number of solutions of any class.
const MAX_SOLUTIONS: usize = 16;

/// Maximum pose residual of a solution (m, times the reach if that is above 1 m; rad).
pub const POSE_TOLERANCE: f64 = 1e-12;

/// Solutions are merged if all their angles agree to this tolerance (rad): two solutions merge at a
/// boundary.
const SAME: f64 = 1e-6;

/// Arm of six revolute joints whose inverse kinematics has a closed form.
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

/// Solver of a class.
#[derive(Clone, Copy, Debug)]
enum Kernel {
    Wrist(Wrist),
    Parallel234(Parallel234),
    Parallel123(Parallel123),
}

/// Candidate joint values found by a kernel.
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
    /// Isolated candidate, and whether one of its joints is free.
    Single { free: bool },
    /// Represents a family of solutions if it meets the pose without refinement.
    Representative { group: usize },
    /// Used only if the family of that number has no accepted representative.
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

/// Two axes whose angle has a sine below this are collinear to within the pose tolerance: only the
/// sum of their joint angles matters.
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
    /// Sides of shoulder, elbow and wrist.
    pub branch: Branch,
    /// Whether the pose leaves a joint free, so that this is one of a family of solutions.
    pub free: bool,
    /// Residual between the pose and forward kinematics.
    pub miss: Miss,
}

/// All solutions of one query; reusable.
#[derive(Clone, Copy, Debug)]
pub struct Solutions {
    list: List<Solution, MAX_SOLUTIONS>,
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
    /// Residual of the best candidate if there is no solution. It is an upper bound on the distance
    /// of the pose from the workspace, without regard to joint limits.
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
        } else if self.len() < MAX_SOLUTIONS {
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

    /// Deviation of the axes from the ideal class: the larger of angles (rad) and of lengths
    /// relative to the reach.
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// Length scale: total length of all links, from axis 1 to the frame (m).
    pub fn reach(&self) -> f64 {
        self.chain.reach
    }

    /// Indices of the joint coordinates in the model, in the order of the chain.
    pub fn joints(&self) -> &[usize; 6] {
        &self.joints
    }

    /// Joint limits, lower and upper (rad), in the order of the chain; infinite where there are
    /// none.
    pub fn limits(&self) -> &[(f64, f64); 6] {
        &self.limits
    }

    /// `X_WT` at joint values (rad); equals the model's forward kinematics to rounding.
    pub fn pose(&self, q: &[f64; 6]) -> Pose {
        self.chain.pose(q)
    }

    /// Computes all joint values that bring the frame to `X_WT`, regardless of limits; a free joint
    /// is set to zero. `X_WT`: in the world, translation in m; joint values in rad.
    ///
    /// Does not allocate. A pose with NaN or infinite entries has no solution, nor has a pose whose
    /// rotation is not orthogonal to [`POSE_TOLERANCE`].
    pub fn solve(&self, X_WT: &Pose, solutions: &mut Solutions) {
        self.solve_near(X_WT, &[0.0; 6], solutions);
    }

    /// As [`Self::solve`], with free joints at the values in `near` (rad), such as the previous
    /// position.
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
                // Not refined: refinement would move the free joint away from its requested value.
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

    /// Refines a candidate whose residual is at most `capture`, and adds it if it meets the pose.
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
