//! Path axes: one along the path of the rigid TCP, and two across it that rotate no more than the
//! tangent requires.
//!
//! The transverse axes are carried along by the smallest rotation from one tangent to the next
//! (parallel transport; a rotation-minimising frame, [Bishop 1975]). They are defined wherever
//! there is a tangent: they do not flip where the curvature changes sign, and an error keeps its
//! sign on a straight line. At rest they are kept. The normal starts towards the inside of the
//! first bend; for a plane path it stays in the plane and the binormal is perpendicular to it.

use nalgebra::Vector3;

/// Speed below which the TCP is at rest, in m/s.
const REST_SPEED: f64 = 1e-5;
/// Lateral acceleration below which a path is straight, in m/s²: such values are rounding.
const STRAIGHT_ACCELERATION: f64 = 1e-6;
/// Fraction of the total acceleration below which lateral acceleration is rounding.
const STRAIGHT_FRACTION: f64 = 1e-6;
/// Curvature below which a path is straight, in 1/m.
const STRAIGHT_CURVATURE: f64 = 1e-4;
/// Cosine between two tangents below which the path reverses: within 10 degrees.
const TURNED_BACK: f64 = -0.985;

/// Orthonormal axes in the world; right-handed until the path reverses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathFrame {
    /// Direction of the velocity.
    pub tangential: Vector3<f64>,
    /// Across the path: initially towards the centre of curvature of the first bend.
    pub normal: Vector3<f64>,
    /// Across both: initially `tangential × normal`.
    pub binormal: Vector3<f64>,
}

impl PathFrame {
    /// Returns tangential, normal and binormal along the x, y and z axis of the world.
    pub fn world() -> Self {
        Self { tangential: Vector3::x(), normal: Vector3::y(), binormal: Vector3::z() }
    }

    /// Returns the axes before the first sample, from the velocities (m/s) and accelerations (m/s²)
    /// of a whole motion in order: tangential along its beginning, normal towards the inside of its
    /// first bend. Without a bend the normal is arbitrary; without motion these are the world axes.
    ///
    /// A path counts as straight where the lateral acceleration is below 1e-6 m/s² or below 1e-6 of
    /// the total, or the radius exceeds 10 km.
    pub fn before(rates: impl IntoIterator<Item = [Vector3<f64>; 2]>) -> Self {
        let mut first: Option<Vector3<f64>> = None;
        for [velocity, acceleration] in rates {
            if velocity.norm() <= REST_SPEED {
                continue;
            }
            let start = *first.get_or_insert(velocity);
            if let Some(inwards) = lateral(&velocity, &acceleration) {
                let (tangential, normal) = (velocity.normalize(), inwards.normalize());
                let at_bend = Self { tangential, normal, binormal: tangential.cross(&normal) };
                return at_bend.next(&start).right_handed();
            }
        }
        first.map_or_else(Self::world, |start| Self::world().next(&start).right_handed())
    }

    /// Returns the axes of the next sample, from the velocity (m/s) of the rigid TCP in the world.
    ///
    /// * At rest (slower than 1e-5 m/s): the same axes.
    /// * Moving: the new tangential axis, with normal and binormal turned by the smallest rotation.
    /// * Reversing on its own path (within 10 degrees): the tangential axis changes its sign,
    ///   normal and binormal do not.
    #[must_use]
    pub fn next(&self, velocity: &Vector3<f64>) -> Self {
        let speed = velocity.norm();
        if speed <= REST_SPEED {
            return *self;
        }
        let tangential = velocity / speed;
        let cosine = self.tangential.dot(&tangential);
        let axis = self.tangential.cross(&tangential);
        let carried = |v: &Vector3<f64>| match cosine < TURNED_BACK {
            true => *v,
            // Rodrigues' formula with the sine in the axis.
            false => v + axis.cross(v) + axis.cross(&axis.cross(v)) / (1.0 + cosine),
        };
        // Orthogonalise at each step, so that rounding does not accumulate.
        let across = |v: Vector3<f64>| v - tangential * tangential.dot(&v);
        let normal = across(carried(&self.normal)).normalize();
        let binormal = across(carried(&self.binormal));
        let binormal = (binormal - normal * normal.dot(&binormal)).normalize();
        Self { tangential, normal, binormal }
    }

    /// Returns the components of a world vector along the tangential, normal and binormal axis.
    pub fn components(&self, v: &Vector3<f64>) -> [f64; 3] {
        [self.tangential.dot(v), self.normal.dot(v), self.binormal.dot(v)]
    }

    fn right_handed(self) -> Self {
        Self { binormal: self.tangential.cross(&self.normal), ..self }
    }
}

/// Acceleration perpendicular to the velocity, unless it is so small that the path is straight.
fn lateral(velocity: &Vector3<f64>, acceleration: &Vector3<f64>) -> Option<Vector3<f64>> {
    let speed = velocity.norm();
    let tangential = velocity / speed;
    let lateral = acceleration - tangential * tangential.dot(acceleration);
    let noise =
        STRAIGHT_ACCELERATION.max(STRAIGHT_FRACTION * acceleration.norm()).max(STRAIGHT_CURVATURE * speed * speed);
    (lateral.norm() > noise).then_some(lateral)
}

/// Computes the path axes at every sample of the rigid TCP positions.
///
/// Velocity and acceleration are those of the parabola through a sample and its two neighbours
/// (exact for constant acceleration with any steps); the first and last sample use the adjacent
/// parabola. The initial axes are those of [`PathFrame::before`].
///
/// * `times`: s, strictly increasing. `positions`: m, in the world, one per time.
pub fn path_frames(times: &[f64], positions: &[[f64; 3]]) -> Vec<PathFrame> {
    let n = times.len().min(positions.len());
    if n < 3 {
        return vec![PathFrame::world(); n];
    }
    let rates = |i: usize| parabola_rates(times, positions, i.clamp(1, n - 2), times[i]);
    let mut frame = PathFrame::before((0..n).map(rates));
    let next = |[velocity, _]: [Vector3<f64>; 2]| {
        frame = frame.next(&velocity);
        frame
    };
    (0..n).map(rates).map(next).collect()
}

/// Computes only the tangential axis of [`path_frames`] at one sample.
pub(crate) fn tangential_at(times: &[f64], positions: &[[f64; 3]], sample: usize) -> Vector3<f64> {
    let n = times.len().min(positions.len());
    if n < 3 {
        return PathFrame::world().tangential;
    }
    let rates = |i: usize| parabola_rates(times, positions, i.clamp(1, n - 2), times[i]);
    // At rest the axes are those of the preceding motion.
    let moving = (0..=sample).rev().map(|i| rates(i)[0]).find(|velocity| velocity.norm() > REST_SPEED);
    let at_rest = || PathFrame::before((0..n).map(rates)).tangential;
    moving.map_or_else(at_rest, |velocity| velocity / velocity.norm())
}

/// Velocity at `t`, and acceleration, of the parabola through samples `i - 1`, `i` and `i + 1`.
fn parabola_rates(times: &[f64], positions: &[[f64; 3]], i: usize, t: f64) -> [Vector3<f64>; 2] {
    let p = |k: usize| Vector3::from(positions[k]);
    let (before, after) = (times[i] - times[i - 1], times[i + 1] - times[i]);
    let (left, right) = ((p(i) - p(i - 1)) / before, (p(i + 1) - p(i)) / after);
    let acceleration = (right - left) * (2.0 / (before + after));
    // The slope of a chord is the velocity at its midpoint in time.
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
            assert!((frame.binormal - Vector3::z()).norm() < 1e-9); // measured 0
        }
    }

    /// Frames of a path given by its position over time, every millisecond.
    fn along(seconds: f64, place: impl Fn(f64) -> Vector3<f64>) -> Vec<PathFrame> {
        let times: Vec<f64> = (0..(1e3 * seconds) as u32).map(|k| 1e-3 * f64::from(k)).collect();
        let positions: Vec<[f64; 3]> = times.iter().map(|&t| place(t).into()).collect();
        path_frames(&times, &positions)
    }

    fn right_handed(frame: &PathFrame) -> f64 {
        (frame.tangential.cross(&frame.normal) - frame.binormal).norm()
    }

    /// Maximum change of the transverse axes between two successive samples.
    fn largest_turn(frames: &[PathFrame]) -> f64 {
        let turn = |w: &[PathFrame]| (w[1].normal - w[0].normal).norm().max((w[1].binormal - w[0].binormal).norm());
        frames.windows(2).map(turn).fold(0.0, f64::max)
    }

    /// Truth: a plane curve. Where it changes from left to right, the axis out of the plane is
    /// constant and the normal turns with the tangent (here by at most 1.3e-2 per sample).
    #[test]
    fn inflections_of_an_s_and_of_a_figure_eight_flip_nothing() {
        let tilt = nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 0.2);
        let s_curve = along(2.0, |t| tilt * Vector3::new(t, 0.3 * (std::f64::consts::PI * t).sin(), 0.0));
        let eight = along(6.0, |t| tilt * Vector3::new(0.4 * (2.0 * t).sin(), 0.8 * t.sin(), 0.0));
        for frames in [s_curve, eight] {
            let out = frames[0].binormal;
            assert!((out.dot(&(tilt * Vector3::z())).abs() - 1.0).abs() < 1e-9);
            for frame in &frames {
                assert!((frame.binormal - out).norm() < 1e-9); // measured 3e-11
                assert!(right_handed(frame) < 1e-12); // measured 4e-16
            }
            assert!(largest_turn(&frames) < 2e-2, "{}", largest_turn(&frames));
        }
    }

    /// Truth: closed form. With respect to the principal normal N and binormal B of a helix of
    /// curvature κ and torsion τ, the frame turns back by the torsion: `n = cos(τs) N - sin(τs) B`.
    #[test]
    fn along_a_helix_the_axes_lag_the_principal_normal_by_its_torsion() {
        let (radius, rise, rate) = (0.3, 0.1, 1.5);
        let frames = along(8.0, |t| {
            let angle = rate * t;
            Vector3::new(radius * angle.cos(), radius * angle.sin(), rise * angle)
        });
        let length = f64::hypot(radius, rise);
        let torsion = rise / (length * length);
        let principal = |t: f64| {
            let angle = rate * t;
            let T = Vector3::new(-radius * angle.sin(), radius * angle.cos(), rise) / length;
            let N = Vector3::new(-angle.cos(), -angle.sin(), 0.0);
            (N, T.cross(&N))
        };
        for (k, frame) in frames.iter().enumerate().take(7999).skip(1) {
            let t = 1e-3 * k as f64;
            let (N, B) = principal(t);
            let lag = torsion * length * rate * t;
            assert!((frame.normal - (N * lag.cos() - B * lag.sin())).norm() < 2e-3, "{t}"); // measured 4.7e-4
        }
        assert!(largest_turn(&frames) < 2e-3);
    }

    /// Truth: a path that is traversed back. Only ahead and behind are exchanged; a transverse
    /// error keeps its sign.
    #[test]
    fn turning_back_on_a_bent_path_keeps_both_axes_across() {
        let angle = |t: f64| 0.6 * (1.0 - (1.5 * t).cos());
        let frames = along(4.0, |t| Vector3::new(0.5 * angle(t).cos(), 0.5 * angle(t).sin(), 0.2));
        // It reverses at t = π / 1.5.
        let (before, after) = (&frames[2000], &frames[2190]);
        assert!((before.tangential + after.tangential).norm() < 2e-2);
        assert!((before.normal - after.normal).norm() < 2e-2 && (before.binormal - after.binormal).norm() < 1e-9);
        assert!(largest_turn(&frames) < 5e-3, "{}", largest_turn(&frames));
    }

    /// Truth: the axes of a straight line do not turn, even if the TCP stops and goes back.
    #[test]
    fn on_a_line_and_at_rest_the_axes_are_kept() {
        let times: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
        let direction = Vector3::new(1.0, 2.0, -2.0) / 3.0;
        let way = |t: f64| if t < 1.0 { 0.0 } else { 0.1 * (1.0 - (3.0 * (t - 1.0)).cos()) };
        let positions: Vec<[f64; 3]> = times.iter().map(|&t| (direction * way(t)).into()).collect();
        let frames = path_frames(&times, &positions);
        for sample in [0, 50, 99, 110, 250, times.len() - 1] {
            assert_eq!(tangential_at(&times, &positions, sample), frames[sample].tangential);
        }
        // at rest before the motion: the axes of its start
        assert!((frames[50].tangential - direction).norm() < 1e-12); // measured 2.2e-16
        assert_eq!(frames[50], frames[99]);
        for frame in &frames[110..] {
            assert!((frame.tangential.dot(&direction).abs() - 1.0).abs() < 1e-12); // measured 3.3e-16
            assert!((frame.normal - frames[110].normal).norm() < 1e-9); // measured 6e-17
            assert!((frame.binormal - frames[110].binormal).norm() < 1e-9); // measured 2e-16
            let ahead = frame.tangential.dot(&direction).signum();
            let handed = frame.tangential.cross(&frame.normal) - frame.binormal * ahead;
            assert!(handed.norm() < 1e-14);
        }
    }

    /// Truth: a circle stays in its plane from its first sample on, however slowly it begins.
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
        let frame = PathFrame::world().next(&Vector3::new(0.0, 1.0, 0.0));
        assert_eq!(frame.components(&Vector3::y()), [1.0, 0.0, 0.0]);
        assert!((frame.normal.norm() - 1.0).abs() < 1e-15 && frame.normal.dot(&Vector3::y()).abs() < 1e-15);
    }
}
