//! Path axes: one along the path of the rigid TCP, and two across it that rotate no more than the
//! tangent requires.
//!
//! The transverse axes are carried along by the smallest rotation from one tangent to the next
//! (parallel transport; a rotation-minimising frame, [Bishop 1975]). They are defined wherever
//! there is a tangent: they do not flip where the curvature changes sign, and an error keeps its
//! sign on a straight line. At rest they are kept. The normal starts towards the inside of the
//! first bend; for a plane path it stays in the plane and the binormal is perpendicular to it.
//!
//! World axes, SI units. Start at [`PathFrame::next`] sample by sample, at [`path_frames`] for a
//! whole record.
//!
//! Not here: the error itself (`pose_error.rs`).

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

    /// Returns the components of a world vector along the tangential, normal and binormal axis. In
    /// the unit of `v`.
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

/// Computes only the tangential axis of [`path_frames`] at one sample. Times in s, positions in the
/// world (m); a unit vector.
pub fn tangential_at(times: &[f64], positions: &[[f64; 3]], sample: usize) -> Vector3<f64> {
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
