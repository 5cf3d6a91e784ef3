//! Many poses of one arm, four or eight side by side where the processor and the arm allow it.

#[cfg(target_arch = "x86_64")]
use flexarm_kinematics::{OverLanes, Real, with_lanes};
use flexarm_kinematics::{Pose, Wrench};
use nalgebra::{Matrix6, Matrix6xX};

use super::OperatingPoint;
#[cfg(target_arch = "x86_64")]
use super::lanes::{LanePoints, plain};
use crate::error::StepError;

/// Most poses side by side.
const LANES: usize = 8;

/// What is asked of many poses beside their equilibrium: [`OperatingPoint::solve_each`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asked {
    /// The Jacobian of the elastic coordinates.
    pub jacobian: bool,
    /// The compliance of the tool.
    pub compliance: bool,
    /// All natural frequencies.
    pub frequencies: bool,
}

/// What is known of one pose among many, of an arm with n elastic coordinates; world axes, at the
/// tool point, linear first. What was not asked for has no meaning.
#[derive(Clone, Debug)]
pub struct PoseAnswer {
    /// Tool in the world at the equilibrium.
    pub tcp_pose: Pose,
    /// Tool in the world with every elastic coordinate at zero.
    pub rigid_tcp_pose: Pose,
    /// Elastic coordinates (m, rad), n.
    pub deflections: Vec<f64>,
    /// Twist of the tool per rate of the elastic coordinates, 6×n.
    pub jacobian: Matrix6xX<f64>,
    /// As [`OperatingPoint::compliance`].
    pub compliance: Matrix6<f64>,
    /// As [`OperatingPoint::frequencies_hz`], n.
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
    /// Equilibria at many poses under weight and a wrench at the tool, as [`OperatingPoint::solve`]
    /// finds each, to the last bit, and what is asked of them; the answers go to `seen` with the
    /// number of their pose, in order.
    ///
    /// * `poses`: m×joints, pose after pose (rad or m).
    /// * `F_T_W`: force and moment on the tool at its origin, world axes (N, N m).
    ///
    /// Cost: four poses take about as long as one and a half where the processor has AVX2 and the
    /// arm straight springs, no balancers, loops or loads.
    ///
    /// # Errors
    /// Of each pose its own, as [`OperatingPoint::solve`].
    pub fn solve_each(
        &mut self,
        poses: &[f64],
        F_T_W: &Wrench,
        asked: Asked,
        mut seen: impl FnMut(usize, Result<&PoseAnswer, StepError>),
    ) {
        let joints = self.arm.model.n_actuated().max(1);
        let mut answers = vec![PoseAnswer::new(self.r.len()); LANES];
        let done = self.in_lanes(poses, F_T_W, asked, &mut answers, &mut seen);
        for (k, pose) in poses.chunks(joints).enumerate().skip(done) {
            let answer = self.alone(pose, F_T_W, asked, &mut answers[0]);
            seen(k, answer);
        }
    }

    #[inline(never)]
    fn alone<'a>(
        &mut self,
        q: &[f64],
        F_T_W: &Wrench,
        asked: Asked,
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

    /// Poses by lanes, those that leave the plain way alone; how many were taken, from the first
    /// one on.
    #[cfg(target_arch = "x86_64")]
    fn in_lanes(
        &mut self,
        poses: &[f64],
        F_T_W: &Wrench,
        asked: Asked,
        answers: &mut [PoseAnswer],
        seen: &mut dyn FnMut(usize, Result<&PoseAnswer, StepError>),
    ) -> usize {
        let joints = self.arm.model.n_actuated();
        let finite = F_T_W.force.iter().chain(&F_T_W.torque).all(|x| x.is_finite());
        // One pose costs less alone.
        if joints == 0 || poses.len() < 2 * joints || !finite || !plain(&self.arm) {
            return 0;
        }
        with_lanes(poses.len() / joints, InLanes { point: self, poses, F_T_W, asked, answers, seen }).unwrap_or(0)
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn in_lanes(
        &mut self,
        _poses: &[f64],
        _F_T_W: &Wrench,
        _asked: Asked,
        _answers: &mut [PoseAnswer],
        _seen: &mut dyn FnMut(usize, Result<&PoseAnswer, StepError>),
    ) -> usize {
        0
    }
}

/// Poses of a plain arm.
#[cfg(target_arch = "x86_64")]
struct InLanes<'a> {
    point: &'a mut OperatingPoint,
    poses: &'a [f64],
    F_T_W: &'a Wrench,
    asked: Asked,
    /// One for each lane.
    answers: &'a mut [PoseAnswer],
    seen: &'a mut dyn FnMut(usize, Result<&PoseAnswer, StepError>),
}

#[cfg(target_arch = "x86_64")]
impl OverLanes for InLanes<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<T: Real>(self) -> usize {
        let Self { point, poses, F_T_W, asked, answers, seen } = self;
        let Some(mut points) = LanePoints::<T>::new(point) else { return 0 };
        let (joints, mut done) = (point.arm.model.n_actuated(), 0);
        for group in poses.chunks(T::LANES * joints) {
            let usable = |pose: &[f64]| pose.len() == joints && pose.iter().all(|q| q.is_finite());
            let Some(first) = group.chunks(joints).find(|pose| usable(pose)) else { break };
            for lane in 0..T::LANES {
                // A lane without a pose of its own takes one of the others.
                let own = group.chunks(joints).nth(lane).filter(|pose| usable(pose));
                points.place(lane, own.unwrap_or(first));
            }
            let found = points.solve(F_T_W);
            // An arm that is so soft is better taken alone.
            if !found.any_above(0.5) {
                break;
            }
            points.answer(asked, &mut answers[..T::LANES]);
            for (lane, (pose, answer)) in group.chunks(joints).zip(answers.iter_mut()).enumerate() {
                match found.lane(lane) == 1.0 && usable(pose) {
                    true => seen(done, Ok(answer)),
                    false => seen(done, point.alone(pose, F_T_W, asked, answer)),
                }
                done += 1;
            }
        }
        done
    }
}
