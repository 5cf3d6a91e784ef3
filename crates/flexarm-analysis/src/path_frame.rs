//! Path axes: along the path of the rigid tool, towards its centre of curvature, and across both.
//!
//! Where the path does not define them (at rest, on a straight line), axes are kept from the sample before, so that
//! they vary smoothly and an error has one sign on a straight line. Up to the first bend they are those with which it
//! begins: a motion from rest is slow at first, and its curvature does not show.

use nalgebra::Vector3;

/// Slower than this, in m/s, the tool is at rest.
const REST_SPEED: f64 = 1e-5;
/// Lateral acceleration below this, in m/s², is taken for rounding.
const STRAIGHT_ACCELERATION: f64 = 1e-6;
/// So is lateral acceleration below this part of the whole.
const STRAIGHT_FRACTION: f64 = 1e-6;
/// Curvature below this, in 1/m, is straight.
const STRAIGHT_CURVATURE: f64 = 1e-4;

/// Right-handed unit axes in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathFrame {
    /// Direction of the velocity.
    pub tangential: Vector3<f64>,
    /// Direction of the lateral acceleration: towards the centre of curvature.
    pub normal: Vector3<f64>,
    /// `tangential × normal`.
    pub binormal: Vector3<f64>,
}

impl PathFrame {
    /// Tangential, normal and binormal along the x, y and z axis of the world.
    pub fn world() -> Self {
        Self { tangential: Vector3::x(), normal: Vector3::y(), binormal: Vector3::z() }
    }

    /// The axes before the first sample, from the velocities (m/s) and accelerations (m/s²) of a whole motion in order:
    /// tangential along its beginning, normal towards the inside of its first bend. Without a bend the normal is any; without
    /// motion these are the world axes.
    pub fn before(rates: impl IntoIterator<Item = [Vector3<f64>; 2]>) -> Self {
        let mut first: Option<[Vector3<f64>; 2]> = None;
        for [velocity, acceleration] in rates {
            if velocity.norm() <= REST_SPEED {
                continue;
            }
            let [v, a] = *first.get_or_insert([velocity, acceleration]);
            if lateral(&velocity, &acceleration).is_some() {
                return Self::world().next(&velocity, &acceleration).next(&v, &a);
            }
        }
        first.map_or_else(Self::world, |[v, a]| Self::world().next(&v, &a))
    }

    /// The axes of the next sample, from the velocity (m/s) and acceleration (m/s²) of the rigid tool in the world.
    ///
    /// * At rest (slower than 1e-5 m/s): these axes again.
    /// * Straight (lateral acceleration below 1e-6 m/s², below 1e-6 of the whole, or a radius beyond 10 km): the new
    ///   tangential axis, and the old normal made perpendicular to it (the old binormal, should the old normal lie
    ///   along the path).
    #[must_use]
    pub fn next(&self, velocity: &Vector3<f64>, acceleration: &Vector3<f64>) -> Self {
        let speed = velocity.norm();
        if speed <= REST_SPEED {
            return *self;
        }
        let tangential = velocity / speed;
        let across = |v: &Vector3<f64>| v - tangential * tangential.dot(v);
        let sideways = lateral(velocity, acceleration).unwrap_or_else(|| {
            let kept = across(&self.normal);
            if kept.norm() > 0.1 { kept } else { across(&self.binormal) }
        });
        let normal = sideways.normalize();
        Self { tangential, normal, binormal: tangential.cross(&normal) }
    }

    /// Parts of a world vector along the tangential, normal and binormal axis.
    pub fn components(&self, v: &Vector3<f64>) -> [f64; 3] {
        [self.tangential.dot(v), self.normal.dot(v), self.binormal.dot(v)]
    }
}

/// Acceleration across the velocity, unless it is so small that the path is straight.
fn lateral(velocity: &Vector3<f64>, acceleration: &Vector3<f64>) -> Option<Vector3<f64>> {
    let speed = velocity.norm();
    let tangential = velocity / speed;
    let lateral = acceleration - tangential * tangential.dot(acceleration);
    let noise =
        STRAIGHT_ACCELERATION.max(STRAIGHT_FRACTION * acceleration.norm()).max(STRAIGHT_CURVATURE * speed * speed);
    (lateral.norm() > noise).then_some(lateral)
}

/// Path axes at every sample of the rigid tool's positions.
///
/// Velocity and acceleration are those of the parabola through a sample and its two neighbours (exact for constant
/// acceleration, whatever the steps); the first and last sample use the parabola next to them. The axes begin as
/// [`PathFrame::before`] says.
///
/// * `times`: s, strictly increasing. `positions`: m, in the world, one per time.
pub fn path_frames(times: &[f64], positions: &[[f64; 3]]) -> Vec<PathFrame> {
    let n = times.len().min(positions.len());
    if n < 3 {
        return vec![PathFrame::world(); n];
    }
    let rates = |i: usize| parabola_rates(times, positions, i.clamp(1, n - 2), times[i]);
    let mut frame = PathFrame::before((0..n).map(rates));
    let next = |[velocity, acceleration]: [Vector3<f64>; 2]| {
        frame = frame.next(&velocity, &acceleration);
        frame
    };
    (0..n).map(rates).map(next).collect()
}

/// Velocity at `t` and acceleration of the parabola through samples `i - 1`, `i` and `i + 1`.
fn parabola_rates(times: &[f64], positions: &[[f64; 3]], i: usize, t: f64) -> [Vector3<f64>; 2] {
    let p = |k: usize| Vector3::from(positions[k]);
    let (before, after) = (times[i] - times[i - 1], times[i + 1] - times[i]);
    let (left, right) = ((p(i) - p(i - 1)) / before, (p(i + 1) - p(i)) / after);
    let acceleration = (right - left) * (2.0 / (before + after));
    // The slope of a chord is the velocity half-way along it.
    let velocity = left + acceleration * (t - 0.5 * (times[i - 1] + times[i]));
    [velocity, acceleration]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: on a circle the normal points to the centre, the binormal along the axis.
    #[test]
    fn on_a_circle_the_normal_points_to_the_centre() {
        let times: Vec<f64> = (0..400).map(|k| 0.005 * f64::from(k) + 0.001 * f64::from(k % 2)).collect();
        let positions: Vec<[f64; 3]> = times.iter().map(|t| [0.4 * t.cos(), 0.4 * t.sin(), 0.7]).collect();
        for (t, frame) in times.iter().zip(path_frames(&times, &positions)).skip(1).take(398) {
            let inward = Vector3::new(-t.cos(), -t.sin(), 0.0);
            assert!((frame.tangential - Vector3::new(-t.sin(), t.cos(), 0.0)).norm() < 1e-7); // measured 2.0e-9
            assert!((frame.normal - inward).norm() < 1e-7); // measured 2.0e-9
            assert!((frame.binormal - Vector3::z()).norm() < 1e-9); // measured 3.3e-16
        }
    }

    /// Truth: the axes of a straight line do not turn, not even when the tool stops and goes back.
    #[test]
    fn on_a_line_and_at_rest_the_axes_are_kept() {
        let times: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let direction = Vector3::new(1.0, 2.0, -2.0) / 3.0;
        let way = |t: f64| if t < 1.0 { 0.0 } else { 0.1 * (1.0 - (3.0 * (t - 1.0)).cos()) };
        let positions: Vec<[f64; 3]> = times.iter().map(|&t| (direction * way(t)).into()).collect();
        let frames = path_frames(&times, &positions);
        // at rest before the motion: the axes with which it begins
        assert!((frames[50].tangential - direction).norm() < 1e-12); // measured 2.2e-16
        assert_eq!(frames[50], frames[99]);
        for frame in &frames[110..] {
            assert!((frame.tangential.dot(&direction).abs() - 1.0).abs() < 1e-12); // measured 3.3e-16
            assert!((frame.normal - frames[110].normal).norm() < 1e-9); // measured 0
            let handed = frame.tangential.cross(&frame.normal) - frame.binormal;
            assert!(handed.norm() < 1e-14);
        }
    }

    /// Truth: a circle lies in its plane from its first sample on, however slowly it begins.
    #[test]
    fn a_circle_from_rest_has_its_own_plane_from_the_start() {
        let tilt = nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 0.2);
        for seconds in [2.0, 60.0] {
            let times: Vec<f64> = (0..2000).map(|k| seconds * f64::from(k) / 1999.0).collect();
            let angle = |t: f64| {
                let u = t / seconds;
                2.0 * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u)
            };
            let place = |t: f64| tilt * Vector3::new(0.4 * angle(t).cos(), 0.4 * angle(t).sin(), 0.0);
            let positions: Vec<[f64; 3]> = times.iter().map(|&t| place(t).into()).collect();
            for frame in path_frames(&times, &positions) {
                assert!((frame.binormal - tilt * Vector3::z()).norm() < 1e-3); // rounding of small accelerations
            }
        }
    }

    #[test]
    fn a_path_along_the_old_normal_still_has_axes() {
        let frame = PathFrame::world().next(&Vector3::new(0.0, 1.0, 0.0), &Vector3::zeros());
        assert_eq!(frame.components(&Vector3::y()), [1.0, 0.0, 0.0]);
        assert!((frame.normal.norm() - 1.0).abs() < 1e-15 && frame.normal.dot(&Vector3::y()).abs() < 1e-15);
    }
}
