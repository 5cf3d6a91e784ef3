//! Initial viewpoint of a recording.
//!
//! Start at [`eye`]; world axes, m. Not here: views and panels (`layout.rs`).

use nalgebra::{Rotation3, Vector3};

use flexarm_log::{RunHeader, Sample};

/// Position and target of the 3D view's camera (m, world).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    pub(crate) position: [f32; 3],
    pub(crate) target: [f32; 3],
}

/// Horizontal distance of the colour scale from the middle, and half its height, as fractions of
/// the camera distance: within a view that is wider than high, outside the arm.
const BESIDE: [f64; 2] = [0.62, 0.3];

impl Eye {
    /// End points of a vertical line at the left border of the initial view (m): bottom and top.
    pub(crate) fn beside(&self) -> [[f64; 3]; 2] {
        let [position, target] = [self.position, self.target].map(|p| Vector3::from(p.map(f64::from)));
        let ahead = target - position;
        let right = ahead.cross(&Vector3::z()).try_normalize(0.0).unwrap_or_else(Vector3::x);
        let [aside, half] = BESIDE.map(|share| share * ahead.norm());
        let middle = target - right * aside;
        [-half, half].map(|rise| (middle + Vector3::z() * rise).into())
    }
}

/// Angle about z from the direction in which the arm reaches to the camera direction (rad): out of
/// the plane of the arm's first pose, so that bending in that plane is visible.
const TURN_RAD: f64 = -1.15;
/// Elevation of the camera (tangent of the angle).
const RISE: f64 = 0.36;
/// Distance of the camera in radii of the bounding sphere: the viewer's vertical field of view is
/// 55 degrees, and the view is about as wide as it is high.
const DISTANCE: f64 = 1.6;
/// Factor on the radius: bodies extend beyond their frames.
const MARGIN: f64 = 1.08;

/// Returns a viewpoint from which the whole run is visible.
pub(crate) fn eye(header: &RunHeader, first: Option<&Sample>) -> Option<Eye> {
    let (base, tool) = match first {
        Some(sample) => {
            let base = sample.flexible.X_WL.first().map_or_else(Vector3::zeros, |X| X.translation.vector);
            (base, sample.flexible.X_WT.translation.vector)
        }
        None => (Vector3::zeros(), Vector3::x()),
    };
    // Box around the first sample, for a recording without the volume of the run.
    let around_first = || {
        let points = first.into_iter().flat_map(|sample| sample.flexible.X_WL.iter().chain([&sample.flexible.X_WT]));
        let mut corners: Option<[[f64; 3]; 2]> = None;
        for p in points.map(|X| X.translation.vector) {
            let [low, high] = corners.get_or_insert([p.into(), p.into()]);
            for c in 0..3 {
                (low[c], high[c]) = (low[c].min(p[c]), high[c].max(p[c]));
            }
        }
        corners
    };
    let [low, high] = header.volume.or_else(around_first)?.map(Vector3::from);
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).norm() * MARGIN);
    if !(radius.is_finite() && radius > 0.0) {
        return None;
    }
    // Look from the side and from above, at an angle to the direction from base to tool.
    let to_tool = tool - base;
    let ahead = Vector3::new(to_tool.x, to_tool.y, 0.0).try_normalize(0.05 * radius).unwrap_or_else(Vector3::x);
    let aside = Rotation3::from_axis_angle(&Vector3::z_axis(), TURN_RAD) * ahead;
    let position = middle + radius * DISTANCE * (aside + RISE * Vector3::z()).normalize();
    let point = |p: Vector3<f64>| p.map(|part| part as f32).into();
    Some(Eye { position: point(position), target: point(middle) })
}
