//! Standard motions within a cube of the workspace, as TCP moves.
//!
//! * Poses and paths after ISO 9283: the test plane contains two opposite edges of the cube along y
//!   and a diagonal in x and z; pose P1 is its centre, P2 to P5 are at 80 % of the distance to its
//!   corners, the square path connects P2 to P5 with sharp corners, the circles have diameters of
//!   80 % and 10 % of the side.
//! * Circles in the three coordinate planes of the cube, in both directions, after ISO 230-4.
//! * Settling: short moves along each axis, each followed by a rest.

use flexarm_kinematics::Pose;
use flexarm_path::program::MoveKind;
use nalgebra::{Rotation3, Translation3, Vector3};
use serde::Deserialize;

/// Distance of the poses from the centre, as a fraction of that of the corners.
const TOWARDS_CORNER: f64 = 0.8;
/// Diameters of the circles of the path test relative to the side of the cube.
const LARGE: f64 = 0.8;
const SMALL: f64 = 0.1;
/// Rest time at each pose, s.
const REST: f64 = 1.0;

/// Standard motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standard {
    /// P1 to P5, with a rest at each.
    Iso9283Poses,
    /// The square and two circles in the test plane.
    Iso9283Paths,
    /// Circles in the planes xy, yz and zx, in both directions.
    Circularity,
    /// Moves along x, y and z, with a rest after each.
    Settle,
}

/// One step of a standard motion.
#[allow(clippy::large_enum_variant, reason = "a few dozen of them, made once")]
pub enum Step {
    /// Move to a TCP pose in the base.
    To(MoveKind, Pose),
    /// Rest (s).
    Rest(f64),
}

impl Standard {
    /// Returns the steps of `repeats` cycles in a cube, after a joint move to its centre.
    ///
    /// * `centre`: `p_BoCo_B`, centre of the cube in the base B of the path (m). `side`: its edge,
    ///   along the axes of B (m).
    /// * `R`: `R_BT`, orientation of the tool during all steps.
    pub fn steps(self, centre: Vector3<f64>, side: f64, R: Rotation3<f64>, repeats: usize) -> Vec<Step> {
        let pose = |p: Vector3<f64>| Pose::from_parts(Translation3::from(p), R);
        let joint = |p: Vector3<f64>| Step::To(MoveKind::Joint, pose(p));
        let line = |p: Vector3<f64>| Step::To(MoveKind::Line, pose(p));
        // P2 to P5 in the test plane.
        let corner = |y: f64, d: f64| centre + Vector3::new(d, y, -d) * (0.5 * side * TOWARDS_CORNER);
        let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
        let mut steps = vec![joint(centre)];
        for _ in 0..repeats {
            match self {
                // P5 to P2, then P1 in the centre, with a rest at each.
                Self::Iso9283Poses => {
                    for p in corners.iter().rev().chain([&centre]) {
                        steps.extend([line(*p), Step::Rest(REST)]);
                    }
                }
                // The square P2 to P5, then the large and the small circle in the test plane.
                Self::Iso9283Paths => {
                    steps.extend(corners.iter().chain([&corners[0]]).map(|p| line(*p)));
                    // Two circles about the centre, in the plane of the corners.
                    let (u, v) = (Vector3::y(), Vector3::new(1.0, 0.0, -1.0).normalize());
                    for part in [LARGE, SMALL] {
                        steps.extend(circle(centre, 0.5 * part * side, u, v, &pose));
                    }
                }
                // Circles in the three coordinate planes, each in both directions.
                Self::Circularity => {
                    // A circle in each coordinate plane, in both senses.
                    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
                    for (u, v) in [(x, y), (y, z), (z, x)] {
                        steps.extend(circle(centre, 0.5 * side, u, v, &pose));
                        steps.extend(circle(centre, 0.5 * side, u, -v, &pose));
                    }
                }
                // Both ends of a stroke along each axis, with a rest at each.
                Self::Settle => {
                    // To both sides of the centre along each axis.
                    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                        for p in [centre + axis * (0.5 * side), centre - axis * (0.5 * side)] {
                            steps.extend([line(p), Step::Rest(REST)]);
                        }
                    }
                }
            }
        }
        steps
    }
}

/// A line to the circle, one turn in two halves without a stop between them, and a stop.
fn circle(c: Vector3<f64>, r: f64, u: Vector3<f64>, v: Vector3<f64>, pose: &dyn Fn(Vector3<f64>) -> Pose) -> [Step; 3] {
    let half = |via: Vector3<f64>, to: Vector3<f64>| {
        let kind = MoveKind::Arc { via: c + via * r, via_rotation: None, angle: None, turns_with_path: false };
        Step::To(kind, pose(c + to * r))
    };
    [Step::To(MoveKind::Line, pose(c + u * r)), half(v, -u), half(-v, u)]
}
