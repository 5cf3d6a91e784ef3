//! TCP curves in space: position and orientation over one parameter, with two derivatives.
//!
//! The parameter `s` is the distance along the path (m) where the tool travels; where it only
//! turns, a radian counts as [`TURN_LENGTH`]. A [`ToolCurve`] represents a line, an arc, a blend or
//! a piece of a spline: a function for the position and one for the rotation over the same `s`.
//!
//! Rotations other than uniform ones use rotation vectors: `R = R_ref exp(phi(s))`, with the rate
//! map of [`ElasticAngles::RotationVector`] [Bullo & Murray 1995].

use flexarm_spatial::{ElasticAngles, Pose, rotation_vector};
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3, Vector6};

/// Path length of a radian where the tool turns without travelling (m).
pub const TURN_LENGTH: f64 = 0.2;
/// Points nearer than this coincide (m).
const SAME_POINT: f64 = 1e-9;

/// Pose of the tool with its first and second derivatives by `s`, in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolJet {
    /// `X_WT`.
    pub X: Pose,
    /// `[p'; w]`: m and rad per unit of `s`.
    pub V: Vector6<f64>,
    /// `[p''; w']`.
    pub A: Vector6<f64>,
}

/// Quintic in `s` with vector coefficients, lowest first.
type Quintic = [Vector3<f64>; 6];

#[derive(Debug, Clone, PartialEq)]
enum Position {
    /// `p0 + d s`.
    Line {
        p0: Vector3<f64>,
        d: Vector3<f64>,
    },
    /// `c + cos(s/r) x + sin(s/r) y`, `x` and `y` of length r.
    Arc {
        c: Vector3<f64>,
        x: Vector3<f64>,
        y: Vector3<f64>,
        r: f64,
    },
    Quintic(Quintic),
}

#[derive(Debug, Clone, PartialEq)]
enum Rotation {
    /// `exp(w s) R0`, w in world axes.
    Even { R0: Matrix3<f64>, w: Vector3<f64> },
    /// `exp(k s) exp(w s) R0`: uniform rotation relative to axes that turn with an arc, `k` along
    /// its axis (rad/m).
    WithArc { R0: Matrix3<f64>, w: Vector3<f64>, k: Vector3<f64> },
    /// `R_ref exp(phi(s))`.
    Log { R_ref: Matrix3<f64>, phi: Quintic },
}

/// TCP motion over `0 <= s <= length`.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolCurve {
    position: Position,
    rotation: Rotation,
    length: f64,
}

/// Three points that do not define a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ArcError {
    /// Two of the points coincide.
    #[error("two of the three points of the circle are the same point")]
    SamePoint,
    /// The points are on a straight line.
    #[error("the three points of the circle lie on a straight line")]
    Straight,
}

fn exp(w: &Vector3<f64>) -> Matrix3<f64> {
    Rotation3::new(*w).into_inner()
}

/// Rotation vector in world axes that turns `R0` into `R1`.
fn turn(R0: &Matrix3<f64>, R1: &Matrix3<f64>) -> Vector3<f64> {
    rotation_vector(&(R1 * R0.transpose()))
}

/// The same rotation as `w` (at most half a turn) or its complement in the opposite sense,
/// whichever has the smaller `distance`. Orientations in programs are rounded, so the complement
/// must be clearly nearer.
fn nearer_way(w: Vector3<f64>, distance: impl Fn(&Vector3<f64>) -> f64) -> Vector3<f64> {
    const CLEARLY: f64 = 0.02;
    let Some(axis) = w.try_normalize(1e-12) else { return w };
    let other = w - axis * std::f64::consts::TAU;
    if distance(&other) < distance(&w) - CLEARLY { other } else { w }
}

fn quintic(h: f64, [q0, v0, a0]: [Vector3<f64>; 3], [q1, v1, a1]: [Vector3<f64>; 3]) -> Quintic {
    let step = q1 - q0;
    let c3 = (step * 20.0 - (v1 * 8.0 + v0 * 12.0) * h - (a0 * 3.0 - a1) * (h * h)) / (2.0 * h.powi(3));
    let c4 = (step * -30.0 + (v1 * 14.0 + v0 * 16.0) * h + (a0 * 3.0 - a1 * 2.0) * (h * h)) / (2.0 * h.powi(4));
    let c5 = (step * 12.0 - (v1 + v0) * (6.0 * h) + (a1 - a0) * (h * h)) / (2.0 * h.powi(5));
    [q0, v0, a0 / 2.0, c3, c4, c5]
}

/// Value, first and second derivative.
fn at(c: &Quintic, s: f64) -> [Vector3<f64>; 3] {
    let [c0, c1, c2, c3, c4, c5] = c;
    [
        c0 + (c1 + (c2 + (c3 + (c4 + c5 * s) * s) * s) * s) * s,
        c1 + (c2 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * s)) * s) * s) * s,
        c2 * 2.0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * s)) * s) * s,
    ]
}

impl ToolCurve {
    /// A straight line with uniform rotation about one axis by at most half a turn; `X0`, `X1`: poses
    /// `X_WT` at its ends.
    pub fn line(X0: &Pose, X1: &Pose) -> Self {
        let (R0, R1) = (X0.rotation.into_inner(), X1.rotation.into_inner());
        let way = X1.translation.vector - X0.translation.vector;
        let turned = turn(&R0, &R1);
        let length = if way.norm() > SAME_POINT { way.norm() } else { turned.norm() * TURN_LENGTH };
        let per = if length > 0.0 { 1.0 / length } else { 0.0 };
        let position = Position::Line { p0: X0.translation.vector, d: way * per };
        Self { position, rotation: Rotation::Even { R0, w: turned * per }, length }
    }

    /// The arc from `X0` through `via` to `X1`, or over `angle` (rad) if it is given.
    ///
    /// The orientation changes uniformly in the world, or relative to axes that turn with the
    /// tangent, and equals that of `X1` at the point of `X1`; it passes through `via_rotation` if
    /// given. Relative to the tangent there are two senses of rotation: the tool takes the one
    /// nearer to following the tangent or to keeping its orientation, so that equal orientations at
    /// both ends of a half circle remain constant. An arc backwards (negative `angle`) turns the
    /// orientation backwards.
    ///
    /// # Errors
    /// [`ArcError`] if the points do not define a circle.
    pub fn arc(
        X0: &Pose,
        via: &Vector3<f64>,
        via_rotation: Option<&Rotation3<f64>>,
        X1: &Pose,
        angle: Option<f64>,
        turns_with_path: bool,
    ) -> Result<Self, ArcError> {
        let Circle { c, x, y, r, to_via, to_end } =
            Circle::through(&X0.translation.vector, via, &X1.translation.vector)?;
        let sign = angle.map_or(1.0, f64::signum);
        let length = angle.map_or(to_end, f64::abs) * r;
        // Orientation over the length s: rotation per length k of the tangent, w of the tool.
        let (R0, R1) = (X0.rotation.into_inner(), X1.rotation.into_inner());
        let k = x.cross(&y) / (r * r * r);
        let end = to_end * r;
        let rotation = match via_rotation {
            Some(R_via) => {
                let (middle, last) = (to_via * r, end);
                let phi_via = rotation_vector(&(R0.transpose() * R_via.matrix()));
                let phi_end = rotation_vector(&(R0.transpose() * R1));
                let phi_end = nearer_way(phi_end, |phi| (phi - phi_via).norm());
                // The parabola through (0, 0), (middle, phi_via), (last, phi_end).
                let square = (phi_end / last - phi_via / middle) / (last - middle);
                let mut phi = [Vector3::zeros(); 6];
                (phi[1], phi[2]) = (phi_via / middle - square * middle, square);
                Rotation::Log { R_ref: R0, phi }
            }
            None if turns_with_path => {
                let within = exp(&(k * -end)) * R1;
                let staying = k * -end;
                let w = nearer_way(turn(&R0, &within), |w| w.norm().min((w - staying).norm()));
                Rotation::WithArc { R0, w: w * (sign / end), k: k * sign }
            }
            None => Rotation::Even { R0, w: turn(&R0, &R1) * (sign / end) },
        };
        let position = Position::Arc { c, x, y: y * sign, r };
        Ok(Self { position, rotation, length })
    }

    /// The quintic in position and rotation vector that matches both jets at its ends, `length`
    /// apart in `s`.
    pub fn between(a: &ToolJet, b: &ToolJet, length: f64) -> Self {
        let part = |v: &Vector6<f64>, row: usize| Vector3::new(v[row], v[row + 1], v[row + 2]);
        let (Ra, Rb) = (a.X.rotation.into_inner(), b.X.rotation.into_inner());
        let position = quintic(
            length,
            [a.X.translation.vector, part(&a.V, 0), part(&a.A, 0)],
            [b.X.translation.vector, part(&b.V, 0), part(&b.A, 0)],
        );
        // At phi = 0 the rate map is the identity and its bias is zero.
        let at_a = [Vector3::zeros(), Ra.transpose() * part(&a.V, 3), Ra.transpose() * part(&a.A, 3)];
        let phi = rotation_vector(&(Ra.transpose() * Rb));
        let map = ElasticAngles::RotationVector.kinematics(&phi, &Vector3::zeros()).B;
        let inverse = map.try_inverse().unwrap_or_else(Matrix3::identity);
        let rate = inverse * (Rb.transpose() * part(&b.V, 3));
        let bias = ElasticAngles::RotationVector.kinematics(&phi, &rate).bias;
        let at_b = [phi, rate, inverse * (Rb.transpose() * part(&b.A, 3) - bias)];
        let rotation = Rotation::Log { R_ref: Ra, phi: quintic(length, at_a, at_b) };
        Self { position: Position::Quintic(position), rotation, length }
    }

    /// Length of the curve in `s`.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Pose and derivatives at `s`.
    pub fn at(&self, s: f64) -> ToolJet {
        // Position and its derivatives d/ds.
        let [p, dp, ddp] = match &self.position {
            Position::Line { p0, d } => [p0 + d * s, *d, Vector3::zeros()],
            Position::Arc { c, x, y, r } => {
                let (sine, cosine) = (s / r).sin_cos();
                let outwards = x * cosine + y * sine;
                [c + outwards, (y * cosine - x * sine) / *r, -outwards / (r * r)]
            }
            Position::Quintic(c) => at(c, s),
        };
        // Rotation, w with dR/ds = [w]x R, and dw/ds.
        let (R, w, dw) = match &self.rotation {
            Rotation::Even { R0, w } => (exp(&(w * s)) * R0, *w, Vector3::zeros()),
            Rotation::WithArc { R0, w, k } => {
                let E = exp(&(k * s));
                let w_W = E * w;
                (E * exp(&(w * s)) * R0, k + w_W, k.cross(&w_W))
            }
            Rotation::Log { R_ref, phi } => {
                let [phi, dphi, ddphi] = at(phi, s);
                let map = ElasticAngles::RotationVector.kinematics(&phi, &dphi);
                let R = R_ref * map.R;
                (R, R * (map.B * dphi), R * (map.B * ddphi + map.bias))
            }
        };
        let six = |v: Vector3<f64>, w: Vector3<f64>| Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z);
        let X = Pose::from_parts(Translation3::from(p), Rotation3::from_matrix_unchecked(R));
        ToolJet { X, V: six(dp, w), A: six(ddp, dw) }
    }
}

/// The circle through three points: `c + cos(a) x + sin(a) y`, first point at a = 0.
struct Circle {
    c: Vector3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
    r: f64,
    /// Angle of the second point, rad, 0 to 2 pi.
    to_via: f64,
    /// Angle of the third point, greater than that of the second.
    to_end: f64,
}

impl Circle {
    /// Arc from p0 through p1 to p2 (m).
    fn through(p0: &Vector3<f64>, p1: &Vector3<f64>, p2: &Vector3<f64>) -> Result<Self, ArcError> {
        let (a, b) = (p1 - p0, p2 - p0);
        let longest = a.norm().max(b.norm()).max((b - a).norm());
        if a.norm() <= SAME_POINT || b.norm() <= SAME_POINT || (b - a).norm() <= SAME_POINT {
            return Err(ArcError::SamePoint);
        }
        let n = a.cross(&b);
        // Radii beyond a million times the size of the arc count as straight.
        if n.norm() <= 1e-6 * longest * longest.min(a.norm().min(b.norm())) {
            return Err(ArcError::Straight);
        }
        let centre = (b.cross(&n) * a.norm_squared() - a.cross(&n) * b.norm_squared()) / (2.0 * n.norm_squared());
        let (c, r) = (p0 + centre, centre.norm());
        let x = -centre;
        let axis = n.normalize();
        let y = axis.cross(&x);
        let angle = |p: &Vector3<f64>| (p - c).dot(&y).atan2((p - c).dot(&x)).rem_euclid(std::f64::consts::TAU);
        // Viewed along a x b, the three points are in counterclockwise order.
        Ok(Self { c, x, y, r, to_via: angle(p1), to_end: angle(p2) })
    }
}
