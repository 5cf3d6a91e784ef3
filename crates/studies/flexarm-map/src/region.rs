//! Region of a map: TCP positions on a grid, joint positions, or a motion; and the tool directions.
//!
//! Plain data of a request, and the geometry of grid and tool directions. Frames: W world, T tool,
//! whose z points along the tool. Not here: checks against a robot ([`super::checked_region`]).

use std::f64::consts::FRAC_PI_2;

use flexarm_kinematics::Pose;
use flexarm_run::Finding;
use flexarm_run::caveat::{UNUSUAL, slip};
use flexarm_settings::Setting;
use nalgebra::{Matrix3, Rotation3, Translation3, Unit, Vector3};

use super::MapError;

/// Maximum number of places and of rows of a map, held in memory with about 300 bytes each.
pub const MAX_PLACES: usize = 5_000_000;
/// Maximum number of places times directions, to bound the run time.
pub(super) const MAX_QUERIES: f64 = 1e8;
/// Golden angle (rad) of the spiral of cone directions.
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

/// Region of a map.
#[derive(Clone, Debug)]
pub enum MapRegion {
    /// A grid of TCP positions, by inverse kinematics.
    Workspace(WorkspaceGrid),
    /// A grid of joint positions; joints not named stay at [`super::MapRequest::at`].
    Joints(Vec<JointRange>),
    /// Listed poses: all actuated joints in coordinate order (rad or m). The table has the 6×6
    /// compliance of each.
    Poses(Vec<Vec<f64>>),
    /// Instants at equal time intervals along a motion.
    Along {
        /// The motion.
        motion: Box<flexarm_run::Motion>,
        /// Number of instants, including both ends.
        points: usize,
    },
}

impl Default for MapRegion {
    fn default() -> Self {
        Self::Workspace(WorkspaceGrid::default())
    }
}

/// A box of TCP positions in the world.
#[derive(Clone, Debug, Default)]
pub struct WorkspaceGrid {
    /// Lower and upper corner (m); default: the reach of the arm.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Grid spacing (m); default: about a thirtieth of the longest edge.
    pub spacing_m: Option<f64>,
    /// Radius around the vertical line (world z) through the first joint within which places are
    /// left out (m), because the arm itself is there; default: 0 in a box that is given, else the
    /// radius of base and first moving link.
    pub keep_out_m: Option<f64>,
    /// Tool directions.
    pub tool: ToolDirections,
}

/// Tool orientations evaluated at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolDirections {
    /// Direction of the tool's z axis in the world, of any length.
    pub axis: [f64; 3],
    /// Rotation of the tool about that axis (rad): at 0 its x axis is in the plane of that axis and
    /// world x, on the side of x.
    pub roll_rad: f64,
    /// Half angle of a cone about the axis within which the tool may tilt (rad).
    pub cone_rad: f64,
    /// Number of directions in the cone, including the axis.
    pub tilts: usize,
    /// Number of rotations about the axis, evenly spaced over a turn.
    pub rolls: usize,
}

impl Default for ToolDirections {
    fn default() -> Self {
        Self { axis: [0.0, 0.0, -1.0], roll_rad: 0.0, cone_rad: 0.0, tilts: 1, rolls: 1 }
    }
}

/// Minimum half angle of a cone (rad): a degree.
const NARROW: f64 = 1.0 / slip::DEGREES;

impl ToolDirections {
    /// Returns a caveat for angles that are as small as if radians were taken for degrees: a narrow
    /// cone, and a right angle (1.57) as the roll.
    pub(crate) fn caveat(&self) -> Option<Finding> {
        let kind = UNUSUAL.with_unit("degrees");
        let quarters = self.roll_rad.to_degrees() / FRAC_PI_2;
        let right = quarters != 0.0 && quarters.abs() < 4.5 && (quarters - quarters.round()).abs() < 1e-3;
        let (what, angle, least) = match (self.cone_rad > 0.0 && self.cone_rad < NARROW, right) {
            (true, _) => ("the half angle of the cone", self.cone_rad, NARROW),
            (false, true) => ("the roll of the tool", self.roll_rad, quarters.abs() * FRAC_PI_2),
            _ => return None,
        };
        let found = kind.found(what, angle.to_degrees(), least.to_degrees());
        Some(found.likely("about 57 times too small: radians?"))
    }

    /// Returns the rotations of the tool in the world: tilts, and for each of them the rolls.
    ///
    /// # Errors
    /// [`MapError::Input`] for an axis without a direction, and for an invalid
    /// cone or more than 10,000 directions.
    pub fn rotations(&self) -> Result<Vec<Rotation3<f64>>, MapError> {
        let axis = Unit::try_new(Vector3::from(self.axis), 1e-12).filter(|axis| axis.iter().all(|x| x.is_finite()));
        let axis = axis.ok_or_else(|| {
            MapError::Input(format!(
                "the tool axis ({}) must be finite and non-zero, found {found:?}",
                Setting::ToolAxis,
                found = self.axis
            ))
        })?;
        let (cone, tilts, rolls) = (self.cone_rad, self.tilts, self.rolls);
        let refused = || {
            MapError::Input(format!(
                "the cone of tool directions must have a half angle from 0 to 180 degrees, at least one tilt and one \
                 roll, and at most 10000 directions, found {:.4} degrees, {tilts} tilts, {rolls} rolls",
                cone.to_degrees()
            ))
        };
        if !(0.0..=std::f64::consts::PI).contains(&cone) || self.tilts == 0 || self.rolls == 0 {
            return Err(refused());
        }
        if !self.roll_rad.is_finite() || self.tilts.saturating_mul(self.rolls) > 10_000 {
            return Err(refused());
        }
        let straight = upright(&axis);
        let mut rotations = Vec::new();
        for tilt in 0..self.tilts {
            // Equal areas of the spherical cap, from the axis to the rim.
            let part = if self.tilts == 1 { 0.0 } else { tilt as f64 / (self.tilts - 1) as f64 };
            let angle = (1.0 - part * (1.0 - cone.cos())).clamp(-1.0, 1.0).acos();
            let about = GOLDEN_RAD * tilt as f64;
            let across = Unit::new_normalize(straight * Vector3::new(about.cos(), about.sin(), 0.0));
            let tilted = Rotation3::from_axis_angle(&across, angle) * straight;
            for roll in 0..self.rolls {
                let turn = self.roll_rad + std::f64::consts::TAU * roll as f64 / self.rolls as f64;
                rotations.push(tilted * Rotation3::from_axis_angle(&Vector3::z_axis(), turn));
            }
        }
        Ok(rotations)
    }
}

/// Returns the rotation with z axis `axis` and the x axis as close as possible to world x.
fn upright(axis: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let near = if axis.x.abs() < 0.999 { Vector3::x() } else { -Vector3::z() * axis.x.signum() };
    let x = (near - axis.into_inner() * axis.dot(&near)).normalize();
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, axis.cross(&x), axis.into_inner()]))
}

/// Values of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointRange {
    /// Name of the joint.
    pub joint: String,
    /// First and last value (rad or m).
    pub range: [f64; 2],
    /// Number of values, including both ends; a single value is the middle.
    pub points: usize,
}

impl JointRange {
    /// Returns value `k`.
    pub(super) fn value(&self, k: usize) -> f64 {
        let [first, last] = self.range;
        match self.points {
            1 => 0.5 * (first + last),
            n => first + (last - first) * k as f64 / (n - 1) as f64,
        }
    }
}

/// TCP positions on a regular grid, x varying fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// First place (m).
    pub lower: [f64; 3],
    /// Spacing (m).
    pub spacing_m: f64,
    /// Number of places along x, y and z.
    pub count: [usize; 3],
}

impl Grid {
    /// Returns the grid centred in a box.
    ///
    /// # Errors
    /// [`MapError::Input`] for an invalid box, an
    /// invalid spacing or too many places.
    #[doc(hidden)]
    pub fn within([lower, upper]: [[f64; 3]; 2], spacing_m: f64) -> Result<Self, MapError> {
        let sound = (0..3).all(|c| lower[c].is_finite() && upper[c].is_finite() && lower[c] <= upper[c]);
        if !sound {
            return Err(MapError::Input(format!(
                "the box ({}) must have its lower corner first, found {lower:?} to {upper:?} m",
                Setting::Bounds
            )));
        }
        if !(spacing_m.is_finite() && spacing_m > 0.0) {
            return Err(MapError::Input(format!(
                "the grid spacing ({}) must be positive, found {spacing_m} m",
                Setting::GridSpacing
            )));
        }
        // An edge that is a multiple of the spacing includes both its ends.
        let steps = [0, 1, 2].map(|c| ((upper[c] - lower[c]) / spacing_m + 1e-9).floor());
        let places = steps.iter().map(|n| n + 1.0).product::<f64>();
        if places > MAX_PLACES as f64 {
            return Err(MapError::too_many(places));
        }
        let first = |c: usize| lower[c] + 0.5 * (upper[c] - lower[c] - steps[c] * spacing_m).max(0.0);
        Ok(Self { lower: [first(0), first(1), first(2)], spacing_m, count: steps.map(|n| n as usize + 1) })
    }

    /// Number of places.
    pub fn places(&self) -> usize {
        self.count.iter().product()
    }

    /// Returns the indices of a place along x, y and z.
    pub fn index(&self, place: usize) -> [usize; 3] {
        let [nx, ny, _] = self.count;
        [place % nx, place / nx % ny, place / (nx * ny)]
    }

    /// Returns the position of a place (m, world).
    pub fn place(&self, place: usize) -> [f64; 3] {
        let k = self.index(place);
        [0, 1, 2].map(|c| self.lower[c] + self.spacing_m * k[c] as f64)
    }
}

/// Returns the pose of a tool at a place.
pub(super) fn pose_at(place: [f64; 3], rotation: &Rotation3<f64>) -> Pose {
    Pose::from_parts(Translation3::from(Vector3::from(place)), *rotation)
}

/// Returns the round number nearest to `x`: 1, 2 or 5 times a power of ten.
pub fn round_number(x: f64) -> f64 {
    let power = 10_f64.powf(x.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0].into_iter();
    let nearest = factors.min_by(|a, b| (x / power - a).abs().total_cmp(&(x / power - b).abs()));
    power * nearest.unwrap_or(1.0)
}
