//! Evaluation of the poses of a map: equilibrium, compliance, frequencies and contributions of each
//! pose as a row of numbers.
//!
//! Start at [`Evaluator::push`]. Wrenches and displacements are at the TCP in world axes, linear
//! part first. Not here: which poses are evaluated ([`super::take`]), the names of the columns
//! ([`super::columns`]).

use flexarm_analysis::tcp_error;
use flexarm_kinematics::Wrench;
use flexarm_stepping::{OperatingPoint, PoseAnswer, PoseOutputs};
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::columns::{Layout, MAX_FREQUENCIES};
use flexarm_chatter::{CuttingTool, lowest_limit};
use flexarm_run::{Error, Modelling, Robot, posed};

/// Indices of a pose in the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseLabel {
    pub(super) place: usize,
    pub(super) direction: usize,
    pub(super) branch: usize,
}

/// Sag and frequencies of a pose under gravity only.
#[derive(Clone, Copy)]
struct GravityResult {
    sag: [f64; 6],
    hz: [f64; MAX_FREQUENCIES],
}

impl GravityResult {
    fn new(found: &PoseAnswer, layout: &Layout) -> Self {
        let mut hz = [f64::NAN; MAX_FREQUENCIES];
        hz[..layout.frequencies].copy_from_slice(&found.frequencies_hz[..layout.frequencies]);
        Self { sag: tcp_error(&found.rigid_tcp_pose, &found.tcp_pose), hz }
    }
}

/// Evaluates poses in batches.
#[derive(Clone)]
pub(super) struct Evaluator<'a> {
    at: OperatingPoint,
    layout: &'a Layout,
    wrench: Wrench,
    cut: Option<Cut<'a>>,
}

/// A cutting tool on an arm.
#[derive(Clone, Copy)]
pub(super) struct Cut<'a> {
    pub(super) robot: &'a Robot,
    pub(super) modelling: &'a Modelling,
    pub(super) tool: &'a CuttingTool,
}

impl Cut<'_> {
    fn lowest_limit(&self, q: &[f64], go_on: &dyn Fn() -> bool) -> Result<f64, Error> {
        lowest_limit(self.robot, self.modelling, self.tool, q, go_on)
    }
}

impl<'a> Evaluator<'a> {
    pub(super) fn new(at: OperatingPoint, layout: &'a Layout, wrench: [f64; 6], cut: Option<Cut<'a>>) -> Self {
        let [fx, fy, fz, tx, ty, tz] = wrench;
        Self { at, layout, wrench: Wrench::new(Vector3::new(fx, fy, fz), Vector3::new(tx, ty, tz)), cut }
    }

    /// Whether a pose takes so long that a thread takes one place at a time.
    pub(super) fn is_slow(&self) -> bool {
        self.cut.is_some()
    }

    /// Appends a row for each pose with a result, in order; the errors of the other poses go to
    /// `failed`, also in order.
    ///
    /// * `poses`: actuated joints in coordinate order (rad or m), pose after pose.
    /// * `labels`: one per pose.
    /// * `go_on`: returns `false` if the rest is not wanted; cutting limits then fail.
    pub(super) fn push(
        &mut self,
        poses: &[f64],
        labels: &[PoseLabel],
        rows: &mut Vec<f64>,
        go_on: &dyn Fn() -> bool,
        mut failed: impl FnMut(Error),
    ) {
        let Self { at, layout, wrench, cut } = self;
        let (joints, loaded) = (layout.joints, layout.loaded);
        let mut push = |k: usize, weighed: &GravityResult, found: &PoseAnswer| -> Result<(), Error> {
            let q = &poses[k * joints..][..joints];
            let depth = cut.map(|cut| cut.lowest_limit(q, go_on)).transpose()?;
            push_row(layout, q, labels[k], weighed, found, depth, rows);
            Ok(())
        };
        // Frequencies are computed under gravity only, compliance and contributions under the load.
        let under_weight = PoseOutputs { frequencies: layout.frequencies > 0, compliance: !loaded, jacobian: !loaded };
        if !loaded {
            return at.solve_each(poses, &Wrench::zeros(), under_weight, |k, answer| match answer {
                Ok(found) => push(k, &GravityResult::new(found, layout), found).unwrap_or_else(&mut failed),
                Err(error) => failed(posed::step_error(error)),
            });
        }
        let mut weighed = Vec::with_capacity(labels.len());
        at.solve_each(poses, &Wrench::zeros(), under_weight, |_, answer| {
            weighed.push(answer.map(|found| GravityResult::new(found, layout)));
        });
        let under_load = PoseOutputs { frequencies: false, compliance: true, jacobian: true };
        let mut weighed = weighed.into_iter();
        at.solve_each(poses, wrench, under_load, |k, answer| match (weighed.next(), answer) {
            (Some(Ok(weighed)), Ok(found)) => push(k, &weighed, found).unwrap_or_else(&mut failed),
            (Some(Err(error)), _) | (_, Err(error)) => failed(posed::step_error(error)),
            (None, Ok(_)) => {}
        });
    }
}

/// Appends the row of a pose, in the order of [`Layout::new`].
///
/// * `weighed`: results under gravity only; `found`: under the load as well.
/// * `depth`: limit of a cutting tool (m).
fn push_row(
    layout: &Layout,
    q: &[f64],
    label: PoseLabel,
    weighed: &GravityResult,
    found: &PoseAnswer,
    depth: Option<f64>,
    rows: &mut Vec<f64>,
) {
    rows.extend(found.rigid_tcp_pose.translation.vector.iter());
    rows.extend([label.place as f64, label.direction as f64, label.branch as f64]);
    rows.extend(q);
    // Sag under gravity, then the displacement and its change due to the load.
    let sag = &weighed.sag;
    push_displacement(sag, rows);
    let mut moved = *sag;
    if layout.loaded {
        moved = tcp_error(&found.rigid_tcp_pose, &found.tcp_pose);
        push_displacement(&moved, rows);
        rows.push(size(&[moved[0] - sag[0], moved[1] - sag[1], moved[2] - sag[2]]));
    }
    push_compliance(&found.compliance, rows);
    if layout.matrix {
        rows.extend(found.compliance.transpose().iter());
    }
    rows.extend(&weighed.hz[..layout.frequencies]);
    rows.extend(depth);
    push_shares(layout, &moved, found, rows);
}

/// Appends the share of each element in the TCP displacement `d`: `(J_e δ_e · d) / |d|²`.
fn push_shares(layout: &Layout, moved: &[f64; 6], found: &PoseAnswer, rows: &mut Vec<f64>) {
    let d = Vector3::new(moved[0], moved[1], moved[2]);
    let whole = d.norm_squared();
    let (J, e) = (&found.jacobian, &found.deflections);
    for range in &layout.elements {
        let mut along = 0.0;
        for k in range.clone() {
            along += J.column(k).fixed_rows::<3>(0).dot(&d) * e[k];
        }
        rows.push(if whole > 0.0 { along / whole } else { f64::NAN });
    }
}

/// Returns the length of a vector.
fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Appends a displacement with its norm and angle.
fn push_displacement(moved: &[f64; 6], rows: &mut Vec<f64>) {
    rows.extend(&moved[..3]);
    rows.push(size(&moved[..3]));
    rows.push(size(&moved[3..]));
}

/// Appends the figures of a 6×6 compliance at the TCP, world axes, linear part first.
fn push_compliance(C: &Matrix6<f64>, rows: &mut Vec<f64>) {
    rows.extend([C[(0, 0)], C[(1, 1)], C[(2, 2)]]);
    rows.extend([(0, 1), (0, 2), (1, 2)].map(|(i, j)| 0.5 * (C[(i, j)] + C[(j, i)])));
    let (worst, direction) = largest_gain(&C.fixed_view::<3, 3>(0, 0).into_owned());
    rows.push(worst);
    rows.extend(direction.iter());
    rows.push(largest_gain(&C.fixed_view::<3, 3>(3, 3).into_owned()).0);
}

/// Returns the largest singular value of a matrix and its right singular vector, signed so that its
/// largest component is positive: the largest displacement per force, and the direction of that force.
///
/// Returns zero vectors for a zero matrix, with the gain 0, and for one that is not finite, with NaN.
pub fn largest_gain(C: &Matrix3<f64>) -> (f64, Vector3<f64>) {
    // Compliances are of the order of 1e-9: scaling avoids loss in their squares.
    let scale = C.amax();
    if !(scale.is_finite() && scale > 0.0) {
        return (if scale == 0.0 { 0.0 } else { f64::NAN }, Vector3::zeros());
    }
    let S = C / scale;
    // Singular values and right singular vectors from SᵀS.
    let eigen = (S.transpose() * S).symmetric_eigen();
    let (k, square) = eigen.eigenvalues.argmax();
    let v = eigen.eigenvectors.column(k).into_owned();
    let v = v * v[v.iamax()].signum();
    (scale * square.max(0.0).sqrt(), v)
}
