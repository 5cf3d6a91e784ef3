//! Loads of the joints: torques from gravity and acceleration, over the whole workspace.
//!
//! Start at [`Workspace::of`]. Efforts in N m or N, maxima over the sampled poses.
//!
//! Not here: samples of the poses (`sample.rs`), stiffness of gears for these loads (`gears.rs`).

use flexarm_kinematics::{
    Data, Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose, forward_kinematics, gravity_forces, mass_matrix,
};
use nalgebra::{DVector, Matrix3, Translation3, Vector3};

use flexarm_run::caveat::size::halton;

/// Number of poses sampled.
const POSES: u32 = 400;
/// Assumed time in which a joint accelerates to full speed (s).
pub(crate) const SPEED_UP: f64 = 0.35;
/// Ratio of payload to moving mass: 0.15 to 0.2 for both heavy arms and cobots.
const PAYLOAD_SHARE: f64 = 0.15;
/// Density of an unknown payload (kg/m³): aluminium.
const PAYLOAD_DENSITY: f64 = 2700.0;
/// Maximum share of an effort limit taken up by gravity.
const WEIGHT_SHARE: f64 = 0.8;
/// Ratio of effort limit to required effort above which the limit is implausible for a drive.
const SENSELESS: f64 = 25.0;

/// Returns the range in which a coordinate is moved: its limits, at most 2.1 rad or 1 m to each
/// side of the value closest to zero.
pub(crate) fn range(joint: &Joint) -> [f64; 2] {
    let most = if joint.kind.slides() { 1.0 } else { 2.1 };
    let (lower, upper) = (joint.limits.lower, joint.limits.upper);
    if upper - lower <= 2.0 * most {
        return [lower, upper];
    }
    let middle = 0.0f64.clamp(lower + most, upper - most);
    [middle - most, middle + most]
}

/// A payload as an aluminium cube at the TCP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cube {
    pub(crate) mass: f64,
    /// Edge length (m).
    pub(crate) edge: f64,
}

impl Cube {
    pub(crate) fn of(mass: f64) -> Self {
        Self { mass, edge: (mass / PAYLOAD_DENSITY).cbrt() }
    }

    pub(crate) fn moment(&self) -> f64 {
        self.mass * self.edge * self.edge / 6.0
    }
}

/// Returns the robot with a frame and a payload at its tool.
pub(crate) fn loaded(mechanism: &Mechanism, tool: &str, payload: Option<Cube>) -> Mechanism {
    let mut loaded = mechanism.clone();
    let inertia = payload.map(|cube| LinkInertia {
        mass: cube.mass,
        com: Vector3::zeros(),
        inertia_com: Matrix3::identity() * cube.moment(),
    });
    loaded.links.push(Link { name: TOOL.into(), inertia });
    loaded.joints.push(Joint::new(
        "__new_tool_joint",
        JointKind::Fixed,
        tool,
        TOOL,
        Pose::from(Translation3::identity()),
    ));
    loaded
}

/// Name of the frame added by [`loaded`].
pub(crate) const TOOL: &str = "__new_tool";

/// Sampled poses of the arm, with held joints fixed, and the loads of its joints.
pub(crate) struct Workspace {
    /// Coordinates moved by the arm.
    pub(crate) moved: Vec<usize>,
    pub(crate) poses: Vec<Posed>,
    /// Maximum gravity torque per coordinate (N m or N).
    pub(crate) weight: Vec<f64>,
    /// Maximum inertia per coordinate (kg m² or kg).
    pub(crate) inertia: Vec<f64>,
}

/// A pose with its TCP position, lowest height and gravity torques.
#[derive(Clone, Debug)]
pub(crate) struct Posed {
    pub(crate) q: DVector<f64>,
    pub(crate) tool: Vector3<f64>,
    /// Height of the lowest frame (m).
    pub(crate) lowest: f64,
    pub(crate) weight: Vec<f64>,
}

/// Evaluates one pose.
pub(crate) fn posed(model: &Model, data: &mut Data, q: DVector<f64>) -> Posed {
    let weight = gravity_forces(model, data, &q).abs().as_slice().to_vec();
    forward_kinematics(model, data, &q);
    let heights = model.frames().iter().map(|frame| data.X_WF(frame).translation.vector.z);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    let tool = model.frame(TOOL).map_or_else(Vector3::zeros, |frame| data.X_WF(frame).translation.vector);
    Posed { q, tool, lowest, weight }
}

impl Workspace {
    /// Samples the poses of the workspace.
    ///
    /// * `ranges`: range of each coordinate (rad or m); a fixed one has equal ends.
    pub(crate) fn of(model: &Model, ranges: &[[f64; 2]]) -> Self {
        let n = model.nv();
        let moved: Vec<usize> = (0..n).filter(|&k| ranges[k][0] < ranges[k][1]).collect();
        let place = |pose: u32, k: usize| {
            let rank = moved.iter().position(|&m| m == k);
            let [low, high] = ranges[k];
            rank.map_or(low, |rank| low + (high - low) * halton(pose, rank))
        };
        let mut data = Data::new(model);
        let mut workspace =
            Self { moved: moved.clone(), poses: Vec::new(), weight: vec![0.0; n], inertia: vec![0.0; n] };
        // Maxima of inertia and weight at each joint over the poses of a Halton sequence.
        for pose in 1..=POSES {
            let q = DVector::from_fn(n, |k, _| place(pose, k));
            let M = mass_matrix(model, &mut data, &q);
            for k in 0..n {
                workspace.inertia[k] = workspace.inertia[k].max(M[(k, k)]);
            }
            let posed = posed(model, &mut data, q);
            for k in 0..n {
                workspace.weight[k] = workspace.weight[k].max(posed.weight[k]);
            }
            workspace.poses.push(posed);
        }
        workspace
    }

    /// Sum of the maximum gravity torque and the torque to accelerate to `speed` (N m or N).
    pub(crate) fn needed(&self, k: usize, speed: f64) -> f64 {
        self.weight[k] + self.inertia[k] * speed / SPEED_UP
    }
}

/// Returns the fault of an effort limit, as part of a sentence.
///
/// * `floor`: minimum effort of a joint of this arm.
pub(crate) fn effort_fault(effort: f64, weight: f64, needed: f64, floor: f64) -> Option<&'static str> {
    if !effort.is_finite() {
        Some("is missing")
    } else if effort <= 0.0 {
        Some("is zero")
    } else if effort < weight {
        Some("is below the torque that holds the arm against gravity")
    } else if effort > SENSELESS * needed.max(floor) {
        Some("is far above the torque that the arm can require")
    } else {
        None
    }
}

/// Typical torque rating of wrists: that of a payload at a fifth of the reach from the axis (N m),
/// at least of a twentieth of the moving mass.
pub(crate) fn wrist_torque(payload: f64, moving_mass: f64, reach: f64) -> f64 {
    9.81 * payload.max(0.05 * moving_mass) * 0.2 * reach
}

/// Estimates a payload from the arm's mass and the effort limits, rounded down to a number usual in
/// data sheets.
///
/// * `joints`: effort limit, gravity torque without payload, and its increase with payload (N m per
///   kg).
pub fn guessed_payload(mass: f64, joints: &[(f64, f64, f64)]) -> f64 {
    let mut most = PAYLOAD_SHARE * mass;
    for &(effort, weight, per_kg) in joints {
        if effort.is_finite() && effort > weight && effort < SENSELESS * weight.max(1e-3) && per_kg > 1e-6 {
            most = most.min((WEIGHT_SHARE * effort - weight).max(0.0) / per_kg);
        }
    }
    rounded_down(most)
}

/// Rounds down to 1, 1.5, 2, 3, 5 or 7 times a power of ten.
fn rounded_down(value: f64) -> f64 {
    if value < 1e-3 {
        return 0.0;
    }
    let power = 10f64.powf(value.log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0];
    let step = steps.into_iter().rev().find(|s| s * power <= value * (1.0 + 1e-9)).unwrap_or(1.0);
    (step * power * 1e6).round() / 1e6
}
