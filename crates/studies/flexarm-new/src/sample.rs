//! Sample motion: from point to point through the workspace, within the limits of the joints.
//!
//! Start at [`sample_motion`]. Moves are quintic from rest to rest, in the order of the axes. Not
//! here: which poses are sampled ([`super::loads`]), how the motion is written ([`super::text`]).

use flexarm_kinematics::{Data, Joint, Model, State, inverse_dynamics};
use nalgebra::DVector;

use super::loads::{Posed, SPEED_UP, Workspace, posed};

/// Share of the speed limits used by the motion.
const SPEED: f64 = 0.6;
/// Maximum share of the effort limits required by the motion.
const EFFORT: f64 = 0.85;
/// Maximum share of the effort limits required by gravity at rests.
const WEIGHT: f64 = 0.7;
/// Maximum joint speed of the motion, independent of the limit (rad/s, m/s).
const FASTEST: f64 = 2.5;
/// Share of the limits of acceleration and jerk used by the motion.
const WITHIN: f64 = 0.95;
/// Ratios of the peaks of a quintic to the means: speed 15/8 D/T, acceleration 10/√3 D/T², jerk
/// 60 D/T³.
const PEAKS: [f64; 3] = [1.875, 5.773_502_691_896_258, 60.0];
/// Half of the maximum distance of a joint over its speed limit (s): 8 s at 60 % of it.
pub(crate) const LONGEST_WAY: f64 = 1.28;
/// Maximum number of rests in addition to the start.
const GOALS: usize = 4;

/// A joint of the motion.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// Index of its coordinate.
    pub(crate) k: usize,
    pub(crate) slides: bool,
    /// Range of the sampled workspace.
    pub(crate) full: [f64; 2],
    /// Range used by the motion: the same middle, smaller for slow joints.
    pub(crate) range: [f64; 2],
    /// Speed limit, or the one assumed (rad/s, m/s).
    pub(crate) speed: f64,
    /// Effort limit, infinite if it is faulty (N m, N).
    pub(crate) effort: f64,
}

/// A rest of the motion with the duration of the move to it (s); values in the order of the axes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rest {
    pub(crate) at: Vec<f64>,
    pub(crate) duration: f64,
}

/// Rests, beginning (with zero duration) and ending at the start; and notes on limits that cannot
/// be kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct SampleMotion {
    pub(crate) rests: Vec<Rest>,
    pub(crate) notes: Vec<String>,
}

/// Rounds a value to tenths of a degree or tenths of a millimetre, within the range.
fn rounded(axis: &Axis, value: f64) -> f64 {
    let unit = if axis.slides { 1e-4 } else { 0.1f64.to_radians() };
    let steps = (value / unit).round();
    let steps = if steps * unit > axis.range[1] { steps - 1.0 } else { steps };
    let steps = if steps * unit < axis.range[0] { steps + 1.0 } else { steps };
    steps * unit
}

/// Conditions on the poses of the motion.
struct PoseConditions {
    /// Minimum height of all frames (m).
    floor: f64,
    /// Minimum distance of the TCP from the z axis of the world (m).
    radius: f64,
    torque: bool,
}

impl PoseConditions {
    /// Whether a pose is high and far enough, and light enough for the drives.
    fn is_met(&self, pose: &Posed, axes: &[Axis]) -> bool {
        let strong = |axis: &Axis| !axis.effort.is_finite() || pose.weight[axis.k] <= WEIGHT * axis.effort;
        pose.lowest >= self.floor && pose.tool.xy().norm() >= self.radius && (!self.torque || axes.iter().all(strong))
    }
}

/// Returns rests with TCP positions far from each other, and paths between them that keep above the
/// floor.
pub(crate) fn sample_motion(model: &Model, workspace: &Workspace, axes: &[Axis]) -> SampleMotion {
    // Sampled poses, drawn into the ranges of the motion.
    let mut data = Data::new(model);
    let inner = |pose: &Posed| {
        let mut q = pose.q.clone();
        for axis in axes {
            let part = (q[axis.k] - axis.full[0]) / (axis.full[1] - axis.full[0]);
            let [low, high] = axis.range;
            q[axis.k] = rounded(axis, 0.5 * (low + high) + 0.8 * (part - 0.5) * (high - low));
        }
        q
    };
    let poses: Vec<Posed> = workspace.poses.iter().map(|p| posed(model, &mut data, inner(p))).collect();
    // Conditions on the poses, from the best to the weakest that any arm meets.
    let reach = poses.iter().map(|p| p.tool.xy().norm()).fold(0.0, f64::max);
    let all_low = poses.iter().map(|p| p.lowest).fold(f64::INFINITY, f64::min);
    let still = still_height(model, &mut data, workspace);
    let wishes = [
        PoseConditions { floor: still - 0.02 * reach, radius: 0.3 * reach, torque: true },
        PoseConditions { floor: still - 0.3 * reach, radius: 0.2 * reach, torque: true },
        PoseConditions { floor: all_low - 1.0, radius: 0.0, torque: true },
        PoseConditions { floor: all_low - 1.0, radius: 0.0, torque: false },
    ];
    let mut motion = SampleMotion::default();
    let (mut rests, mut wish) = (Vec::new(), 0);
    for (k, one) in wishes.iter().enumerate() {
        wish = k;
        rests = choose(model, &mut data, &poses, axes, one);
        if rests.len() > 2 {
            break;
        }
    }
    // Notes on what the motion does not show or keep.
    if turns_in_place(&poses) {
        let note = "no joint of the motion moves the tool, which is on their axes: it turns in place; choose another tcp or joint";
        motion.notes.push(note.into());
    }
    if wish == 3 {
        motion.notes.push("the effort limits are too low to hold the arm in the poses of the motion".into());
    }
    if rests.is_empty() {
        rests.extend(poses.first().cloned());
    }
    // Moves from rest to rest and back to the start.
    let start: Vec<f64> = axes.iter().map(|axis| rests[0].q[axis.k]).collect();
    motion.rests.push(Rest { at: start.clone(), duration: 0.0 });
    for pose in rests[1..].iter().chain(std::iter::once(&rests[0])) {
        let at: Vec<f64> = axes.iter().map(|axis| pose.q[axis.k]).collect();
        let from = motion.rests[motion.rests.len() - 1].at.clone();
        let (duration, kept) = duration(model, &mut data, &rests[0].q, axes, [&from, &at]);
        if !kept {
            motion.notes.push(format!("the effort limits are exceeded on the way to stop {}", motion.rests.len()));
        }
        motion.rests.push(Rest { at, duration });
    }
    motion
}

/// Height of the lowest fixed frame, at most 0.
fn still_height(model: &Model, data: &mut Data, workspace: &Workspace) -> f64 {
    // Fixed frames have the same height in all poses.
    let heights = |data: &mut Data, q: &DVector<f64>| -> Vec<f64> {
        flexarm_kinematics::forward_kinematics(model, data, q);
        model.frames().iter().map(|frame| data.X_WF(frame).translation.vector.z).collect()
    };
    let some = workspace.poses.iter().take(3).map(|pose| heights(data, &pose.q)).collect::<Vec<_>>();
    let Some(first) = some.first() else { return 0.0 };
    let still = (0..first.len()).filter(|&k| some.iter().all(|h| (h[k] - first[k]).abs() < 1e-6));
    still.map(|k| first[k]).fold(f64::INFINITY, f64::min).min(0.0)
}

/// Distance of two poses (m) below which the TCP has not moved.
const SAME_PLACE: f64 = 1e-6;

/// Chooses the pose closest to the middle of the ranges, then repeatedly the one whose TCP is
/// farthest from all previous ones; if no joint moves the TCP, the one whose joints are.
fn choose(model: &Model, data: &mut Data, poses: &[Posed], axes: &[Axis], wish: &PoseConditions) -> Vec<Posed> {
    let away = |pose: &Posed| -> f64 {
        let part =
            |axis: &Axis| (pose.q[axis.k] - 0.5 * (axis.range[0] + axis.range[1])) / (axis.range[1] - axis.range[0]);
        axes.iter().map(|axis| part(axis).powi(2)).sum()
    };
    // Start at the pose nearest to the middle of the ranges.
    let sound: Vec<&Posed> = poses.iter().filter(|pose| wish.is_met(pose, axes)).collect();
    let Some(&start) = sound.iter().min_by(|a, b| away(a).total_cmp(&away(b))) else { return Vec::new() };
    let mut rests = vec![start.clone()];
    let turns = turns_in_place(poses);
    let apart = |a: &Posed, b: &Posed| if turns { (&a.q - &b.q).norm() } else { (a.tool - b.tool).norm() };
    // A motion must meet the conditions on its way too, here and back to the start.
    let mut way = |a: &Posed, b: &Posed| {
        (1..8).all(|i| wish.is_met(&posed(model, data, a.q.lerp(&b.q, f64::from(i) / 8.0)), axes))
    };
    while rests.len() <= GOALS {
        // Farthest pose from all chosen ones that can be reached.
        let distance = |pose: &Posed| rests.iter().map(|r| apart(r, pose)).fold(f64::INFINITY, f64::min);
        let mut order: Vec<(&Posed, f64)> =
            sound.iter().map(|p| (*p, distance(p))).filter(|(_, d)| *d > SAME_PLACE).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let last = &rests[rests.len() - 1];
        let next = order.iter().map(|(p, _)| *p).find(|pose| way(last, pose) && way(pose, start));
        let Some(next) = next else { break };
        let next = next.clone();
        rests.push(next);
    }
    rests
}

/// Whether the TCP is on the axes of all joints.
fn turns_in_place(poses: &[Posed]) -> bool {
    poses.iter().all(|pose| (pose.tool - poses[0].tool).norm() <= SAME_PLACE)
}

/// Returns the duration of a move (s), in tenths, and whether the effort limits are kept.
fn duration(model: &Model, data: &mut Data, at: &DVector<f64>, axes: &[Axis], [from, to]: [&[f64]; 2]) -> (f64, bool) {
    let mut time = 0.2f64;
    for (axis, way) in axes.iter().zip(from.iter().zip(to).map(|(a, b)| (b - a).abs())) {
        let speed = (SPEED * axis.speed).min(FASTEST);
        let limits = &model.coordinates()[axis.k].limits;
        let acceleration = (speed / SPEED_UP).min(WITHIN * limits.acceleration);
        time = time.max(PEAKS[0] * way / speed).max((PEAKS[1] * way / acceleration).sqrt());
        time = time.max((PEAKS[2] * way / (WITHIN * limits.jerk)).cbrt());
    }
    let tenths = |time: f64| (10.0 * time - 1e-9).ceil() / 10.0;
    time = tenths(time);
    for _ in 0..25 {
        if strong_enough(model, data, at, axes, [from, to], time) {
            return (time, true);
        }
        time = tenths(1.15 * time);
    }
    (time, false)
}

/// Checks the torques of the rigid robot along a quintic against the effort limits.
fn strong_enough(
    model: &Model,
    data: &mut Data,
    at: &DVector<f64>,
    axes: &[Axis],
    [from, to]: [&[f64]; 2],
    time: f64,
) -> bool {
    let mut state = State::zeros(model);
    let mut a = DVector::zeros(model.nv());
    state.q.copy_from(at);
    (0..=40).all(|i| {
        // Quintic s(u) with its time derivatives.
        let u = f64::from(i) / 40.0;
        let s = u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
        let ds = 30.0 * (u * (1.0 - u)).powi(2) / time;
        let dds = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (time * time);
        for (axis, (from, to)) in axes.iter().zip(from.iter().zip(to)) {
            let way = to - from;
            (state.q[axis.k], state.qdot[axis.k], a[axis.k]) = (from + way * s, way * ds, way * dds);
        }
        let torques = inverse_dynamics(model, data, &state, &a);
        axes.iter().all(|axis| !axis.effort.is_finite() || torques[axis.k].abs() <= EFFORT * axis.effort)
    })
}

/// Returns the speed limit of a joint, or an assumed one and true if there is none.
pub(crate) fn speed_of(joint: &Joint) -> (f64, bool) {
    let limit = joint.limits.velocity;
    let assumed = if joint.kind.slides() { 0.25 } else { 1.0 };
    if limit.is_finite() && limit > 1e-6 { (limit, false) } else { (assumed, true) }
}
