//! One pose of a map: equilibrium, compliance, frequencies and shares as a row of numbers.

use flexarm_analysis::tcp_error;
use flexarm_kinematics::Wrench;
use flexarm_stepping::OperatingPoint;
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::columns::{HEAD, Layout};
use crate::error::Error;
use crate::lobes::{CuttingTool, lowest_limit};
use crate::options::Modelling;
use crate::posed::failed;
use crate::robot::Robot;

/// Where a pose is in the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub(super) place: usize,
    pub(super) direction: usize,
    pub(super) branch: usize,
}

/// Answers pose after pose.
#[derive(Clone)]
pub(super) struct Evaluator<'a> {
    at: OperatingPoint,
    layout: &'a Layout,
    wrench: Wrench,
    cut: Option<Cut<'a>>,
}

/// A tool that cuts, on an arm.
#[derive(Clone, Copy)]
pub(super) struct Cut<'a> {
    pub(super) robot: &'a Robot,
    pub(super) modelling: &'a Modelling,
    pub(super) tool: &'a CuttingTool,
    pub(super) zero_order: bool,
}

impl<'a> Evaluator<'a> {
    pub(super) fn new(at: OperatingPoint, layout: &'a Layout, wrench: [f64; 6], cut: Option<Cut<'a>>) -> Self {
        let [fx, fy, fz, tx, ty, tz] = wrench;
        Self { at, layout, wrench: Wrench::new(Vector3::new(fx, fy, fz), Vector3::new(tx, ty, tz)), cut }
    }

    /// Whether a pose takes so long that few should be taken between two looks at whether to go on.
    pub(super) fn is_slow(&self) -> bool {
        self.cut.is_some()
    }

    /// Appends the row of a pose.
    ///
    /// * `q`: actuated joints in coordinate order (rad or m).
    ///
    /// # Errors
    /// [`OperatingPoint::solve`], and those of limits of depth; nothing is appended.
    pub(super) fn push(&mut self, q: &[f64], seat: Seat, rows: &mut Vec<f64>) -> Result<(), Error> {
        let first = rows.len();
        let result = self.fill(q, seat, rows);
        if result.is_err() {
            rows.truncate(first);
        }
        result
    }

    fn fill(&mut self, q: &[f64], seat: Seat, rows: &mut Vec<f64>) -> Result<(), Error> {
        let at = &mut self.at;
        at.solve(q, &Wrench::zeros()).map_err(failed)?;
        let X_rigid = at.rigid_tcp_pose();
        rows.extend(X_rigid.translation.vector.iter());
        rows.extend([seat.place as f64, seat.direction as f64, seat.branch as f64]);
        debug_assert_eq!(HEAD.len(), 6);
        rows.extend(q);
        let sag = tcp_error(&X_rigid, &at.tcp_pose());
        push_displacement(&sag, rows);
        // Frequencies are those under weight alone, compliance and shares those under the load.
        let mut hz = [f64::NAN; 12];
        if self.layout.frequencies > 0 {
            let found = &at.frequencies_hz()[..self.layout.frequencies];
            hz[..found.len()].copy_from_slice(found);
        }
        let mut moved = sag;
        if self.layout.loaded {
            at.solve(q, &self.wrench).map_err(failed)?;
            moved = tcp_error(&X_rigid, &at.tcp_pose());
            push_displacement(&moved, rows);
            rows.push(size(&[moved[0] - sag[0], moved[1] - sag[1], moved[2] - sag[2]]));
        }
        push_compliance(&at.compliance(), rows);
        rows.extend(&hz[..self.layout.frequencies]);
        if let Some(Cut { robot, modelling, tool, zero_order }) = self.cut {
            rows.push(lowest_limit(robot, modelling, tool, zero_order, q)?);
        }
        self.push_shares(&moved, rows);
        Ok(())
    }

    /// Part of each element in the displacement of the tool: `J_e δ_e` along it, over its size.
    fn push_shares(&self, moved: &[f64; 6], rows: &mut Vec<f64>) {
        let d = Vector3::new(moved[0], moved[1], moved[2]);
        let whole = d.norm_squared();
        let (J, e) = (self.at.jacobian(), self.at.deflections());
        for range in &self.layout.elements {
            let mut along = 0.0;
            for k in range.clone() {
                along += J.column(self.layout.joints + k).fixed_rows::<3>(0).dot(&d) * e[k];
            }
            rows.push(if whole > 0.0 { along / whole } else { f64::NAN });
        }
    }
}

fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn push_displacement(moved: &[f64; 6], rows: &mut Vec<f64>) {
    rows.extend(&moved[..3]);
    rows.push(size(&moved[..3]));
    rows.push(size(&moved[3..]));
}

fn push_compliance(C: &Matrix6<f64>, rows: &mut Vec<f64>) {
    rows.extend([C[(0, 0)], C[(1, 1)], C[(2, 2)]]);
    rows.extend([(0, 1), (0, 2), (1, 2)].map(|(i, j)| 0.5 * (C[(i, j)] + C[(j, i)])));
    let (worst, direction) = largest_gain(&C.fixed_view::<3, 3>(0, 0).into_owned());
    rows.push(worst);
    rows.extend(direction.iter());
    rows.push(largest_gain(&C.fixed_view::<3, 3>(3, 3).into_owned()).0);
}

/// Largest singular value of a matrix and the direction that it belongs to; its largest component is positive.
fn largest_gain(C: &Matrix3<f64>) -> (f64, Vector3<f64>) {
    // Compliances are 1e-9 or so: their squares lose nothing once they are scaled.
    let scale = C.amax();
    if !(scale.is_finite() && scale > 0.0) {
        return (if scale == 0.0 { 0.0 } else { f64::NAN }, Vector3::zeros());
    }
    let S = C / scale;
    let eigen = (S.transpose() * S).symmetric_eigen();
    let (k, square) = eigen.eigenvalues.argmax();
    let v = eigen.eigenvectors.column(k).into_owned();
    let v = v * v[v.iamax()].signum();
    (scale * square.max(0.0).sqrt(), v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, matrix};

    /// Truth: `C = R diag(3, 1, 2) Rᵀ` has the largest gain 3 along the first column of R; of `u vᵀ` it is `|u| |v|` along v.
    #[test]
    fn the_worst_direction_is_that_of_the_largest_singular_value() {
        let R = Rotation3::from_euler_angles(0.3, -1.1, 2.0).into_inner();
        let (gain, v) = largest_gain(&(R * Matrix3::from_diagonal(&Vector3::new(3e-7, 1e-7, 2e-7)) * R.transpose()));
        assert!((gain / 3e-7 - 1.0).abs() < 1e-14, "{gain}");
        assert!(v.cross(&R.column(0)).norm() < 1e-13);
        let (u, w) = (matrix![1.0; -2.0; 0.5], matrix![0.2; 0.1; -0.7]);
        let (gain, v) = largest_gain(&(u * w.transpose()));
        assert!((gain / (u.norm() * w.norm()) - 1.0).abs() < 1e-14);
        assert!(v.cross(&w.normalize()).norm() < 1e-13 && v[v.iamax()] > 0.0);
        assert_eq!(largest_gain(&Matrix3::zeros()).0, 0.0);
    }
}
