//! Many poses of one arm, four or eight in parallel if processor and arm allow it.
//!
//! Start at [`OperatingPoint::solve_each`]. [`InLanes`] fills the lanes with poses; a pose that leaves
//! the standard path of `lanes` is solved by itself. Not here: the equilibria (`super`, `lanes`).

#[cfg(target_arch = "x86_64")]
use flexarm_kinematics::{OverLanes, Real, with_lanes};
use flexarm_kinematics::{Pose, Wrench};
use nalgebra::{Matrix6, Matrix6xX};

use super::OperatingPoint;
#[cfg(target_arch = "x86_64")]
use super::lanes::{LanePoints, plain};
use crate::error::StepError;

/// Maximum number of poses in parallel.
const LANES: usize = 8;

/// Optional outputs per pose, in addition to the equilibrium; see [`OperatingPoint::solve_each`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoseOutputs {
    /// Whether the Jacobian of the elastic coordinates is computed.
    pub jacobian: bool,
    /// Whether the compliance of the tool is computed.
    pub compliance: bool,
    /// Whether the natural frequencies are computed.
    pub frequencies: bool,
}

/// Results for one of many poses of an arm with n elastic coordinates; world axes, at the tool
/// point, linear part first. Fields that were not requested have no meaning.
#[derive(Clone, Debug)]
pub struct PoseAnswer {
    /// Pose of the tool in the world at the equilibrium.
    pub tcp_pose: Pose,
    /// Pose of the tool in the world with all elastic coordinates zero.
    pub rigid_tcp_pose: Pose,
    /// Elastic coordinates (m, rad), n.
    pub deflections: Vec<f64>,
    /// Twist of the tool per rate of the elastic coordinates, 6×n.
    pub jacobian: Matrix6xX<f64>,
    /// Compliance; see [`OperatingPoint::compliance`].
    pub compliance: Matrix6<f64>,
    /// Frequencies (Hz), n; see [`OperatingPoint::frequencies_hz`].
    pub frequencies_hz: Vec<f64>,
}

impl PoseAnswer {
    fn new(n: usize) -> Self {
        Self {
            tcp_pose: Pose::identity(),
            rigid_tcp_pose: Pose::identity(),
            deflections: vec![0.0; n],
            jacobian: Matrix6xX::zeros(n),
            compliance: Matrix6::zeros(),
            frequencies_hz: vec![0.0; n],
        }
    }
}

impl OperatingPoint {
    /// Computes equilibria at many poses under weight and a wrench at the tool, bitwise as
    /// [`OperatingPoint::solve`] does, with the requested outputs; calls `report` with the number of
    /// each pose and its result, in order.
    ///
    /// * `poses`: m×joints, pose after pose (rad or m).
    /// * `F_T_W`: force and moment on the tool at its origin, world axes (N, N m).
    ///
    /// Cost: with AVX2 four poses take about as long as one and a half, if the arm has only linear
    /// springs and no balancers, loops or loads.
    ///
    /// # Errors
    /// Per pose, as [`OperatingPoint::solve`].
    pub fn solve_each(
        &mut self,
        poses: &[f64],
        F_T_W: &Wrench,
        asked: PoseOutputs,
        mut report: impl FnMut(usize, Result<&PoseAnswer, StepError>),
    ) {
        let joints = self.plant.model.n_actuated().max(1);
        let mut answers = vec![PoseAnswer::new(self.r.len()); LANES];
        let done = self.in_lanes(poses, F_T_W, asked, &mut answers, &mut report);
        for (k, pose) in poses.chunks(joints).enumerate().skip(done) {
            let answer = self.alone(pose, F_T_W, asked, &mut answers[0]);
            report(k, answer);
        }
    }

    /// Solves one pose on its own, and copies the requested outputs.
    #[inline(never)]
    fn alone<'a>(
        &mut self,
        q: &[f64],
        F_T_W: &Wrench,
        asked: PoseOutputs,
        answer: &'a mut PoseAnswer,
    ) -> Result<&'a PoseAnswer, StepError> {
        self.solve(q, F_T_W)?;
        answer.tcp_pose = self.tcp_pose();
        answer.rigid_tcp_pose = self.rigid_tcp_pose();
        answer.deflections.copy_from_slice(self.deflections());
        if asked.jacobian {
            let n = answer.jacobian.ncols();
            answer.jacobian.copy_from(&self.J.columns(self.J.ncols() - n, n));
        }
        if asked.compliance {
            answer.compliance = self.compliance();
        }
        if asked.frequencies {
            answer.frequencies_hz.copy_from_slice(self.frequencies_hz());
        }
        Ok(answer)
    }

    /// Computes poses in lanes, and individually those that leave the standard path; returns the
    /// number of poses done, from the first one on.
    #[cfg(target_arch = "x86_64")]
    fn in_lanes(
        &mut self,
        poses: &[f64],
        F_T_W: &Wrench,
        asked: PoseOutputs,
        answers: &mut [PoseAnswer],
        report: &mut dyn FnMut(usize, Result<&PoseAnswer, StepError>),
    ) -> usize {
        let joints = self.plant.model.n_actuated();
        let finite = F_T_W.force.iter().chain(&F_T_W.torque).all(|x| x.is_finite());
        // A single pose is cheaper without lanes.
        if joints == 0 || poses.len() < 2 * joints || !finite || !plain(&self.plant) {
            return 0;
        }
        with_lanes(poses.len() / joints, InLanes { point: self, poses, F_T_W, asked, answers, report }).unwrap_or(0)
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn in_lanes(
        &mut self,
        _poses: &[f64],
        _F_T_W: &Wrench,
        _asked: PoseOutputs,
        _answers: &mut [PoseAnswer],
        _seen: &mut dyn FnMut(usize, Result<&PoseAnswer, StepError>),
    ) -> usize {
        0
    }
}

/// Poses of an arm that lanes support.
#[cfg(target_arch = "x86_64")]
struct InLanes<'a> {
    point: &'a mut OperatingPoint,
    poses: &'a [f64],
    F_T_W: &'a Wrench,
    asked: PoseOutputs,
    /// One per lane.
    answers: &'a mut [PoseAnswer],
    report: &'a mut dyn FnMut(usize, Result<&PoseAnswer, StepError>),
}

#[cfg(target_arch = "x86_64")]
impl OverLanes for InLanes<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<T: Real>(self) -> usize {
        let Self { point, poses, F_T_W, asked, answers, report } = self;
        let Some(mut points) = LanePoints::<T>::new(point) else { return 0 };
        let (joints, mut done) = (point.plant.model.n_actuated(), 0);
        for group in poses.chunks(T::LANES * joints) {
            let usable = |pose: &[f64]| pose.len() == joints && pose.iter().all(|q| q.is_finite());
            let Some(first) = group.chunks(joints).find(|pose| usable(pose)) else { break };
            for lane in 0..T::LANES {
                // A lane without a valid pose of its own repeats another one.
                let own = group.chunks(joints).nth(lane).filter(|pose| usable(pose));
                points.place(lane, own.unwrap_or(first));
            }
            let found = points.solve(F_T_W);
            // A very soft arm is better computed pose by pose.
            if !found.any_above(0.5) {
                break;
            }
            points.answer(asked, &mut answers[..T::LANES]);
            for (lane, (pose, answer)) in group.chunks(joints).zip(answers.iter_mut()).enumerate() {
                match found.lane(lane) == 1.0 && usable(pose) {
                    true => report(done, Ok(answer)),
                    false => report(done, point.alone(pose, F_T_W, asked, answer)),
                }
                done += 1;
            }
        }
        done
    }
}
