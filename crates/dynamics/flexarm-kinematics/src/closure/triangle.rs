//! Closed form of a loop in its plane: the triangle of its two dependent joints and its end points.
//!
//! Two-vectors are in the plane normal to the pin (m), angles about the pin (rad). Joint a moves the
//! end `moved`; joint b is carried by a, or moves the end `other`. Not here: deflections out of the
//! plane (`positions`).

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};

/// Location of the dependent joints: both on one chain (`inner` is the inner one), or one on each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    OneChain { chain: usize, inner: usize },
    BothChains { of_pin: usize },
}

/// Dependent joint projected onto the plane of the loop.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlatJoint {
    pub(super) slides: bool,
    pub(super) at: Vector2<f64>,
    /// Direction of a sliding joint; for a revolute joint, x is the sign of its axis along the pin
    /// axis.
    pub(super) way: Vector2<f64>,
}

/// The loop in its plane: the dependent joints and the two end points to be joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) joints: [FlatJoint; 2],
    pub(super) ends: [Vector2<f64>; 2],
    pub(super) shape: Shape,
}

fn angle_of(v: &Vector2<f64>) -> f64 {
    v.y.atan2(v.x)
}

/// Wraps an angle to [-π, π].
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

impl Triangle {
    /// Displacements of the dependent joints that close the loop, for one of the two roots (1 or
    /// -1); `None` if the sides cannot reach.
    pub(super) fn solve(&self, root: f64) -> Option<[f64; 2]> {
        // Either the first joint carries the second one and both move the first point, or the first
        // joint moves the first point and the second joint the second point.
        let (first, second, moved, other, carried) = match self.shape {
            Shape::OneChain { chain, inner } => (inner, 1 - inner, self.ends[chain], self.ends[1 - chain], true),
            Shape::BothChains { of_pin } => (of_pin, 1 - of_pin, self.ends[0], self.ends[1], false),
        };
        let (a, b) = (self.joints[first], self.joints[second]);
        // Carried: a(b(moved)) = other. Otherwise: a(moved) = b(other).
        let (x_a, x_b) = match (a.slides, b.slides) {
            (false, false) => turn_turn(&a, &b, &moved, &other, carried, root)?,
            (false, true) if carried => {
                let (w, r) = (moved - a.at, (other - a.at).norm());
                let s = slide_to(&w, &b.way, r, root)?;
                (angle_of(&(other - a.at)) - angle_of(&(w + b.way * s)), s)
            }
            (false, true) => {
                let (m, w) = (other - a.at, moved - a.at);
                let s = slide_to(&m, &b.way, w.norm(), root)?;
                (angle_of(&(m + b.way * s)) - angle_of(&w), s)
            }
            (true, false) => {
                // Relative to the rotating joint, the other end slides in the opposite direction.
                let (point, target) = if carried { (moved, other) } else { (other, moved) };
                let (w, m, sign) = (point - b.at, target - b.at, if carried { -1.0 } else { 1.0 });
                let s = slide_to(&m, &(a.way * sign), w.norm(), root)?;
                (s, angle_of(&(m + a.way * (sign * s))) - angle_of(&w))
            }
            (true, true) => {
                let sign = if carried { 1.0 } else { -1.0 };
                let s = Matrix2::from_columns(&[a.way, b.way * sign]).try_inverse()? * (other - moved);
                (s.x, s.y)
            }
        };
        let turned = |joint: &FlatJoint, x: f64| if joint.slides { x } else { wrapped(x) * joint.way.x };
        let mut found = [0.0; 2];
        (found[first], found[second]) = (turned(&a, x_a), turned(&b, x_b));
        found.iter().all(|x| x.is_finite()).then_some(found)
    }
}

/// Two revolute joints. Carried: `R_a (v + R_b w) = t`; otherwise `R_a u = v + R_b w`.
fn turn_turn(
    a: &FlatJoint,
    b: &FlatJoint,
    moved: &Vector2<f64>,
    other: &Vector2<f64>,
    carried: bool,
    root: f64,
) -> Option<(f64, f64)> {
    let v = b.at - a.at;
    let (w, t) = if carried { (moved - b.at, other - a.at) } else { (other - b.at, moved - a.at) };
    let cosine = (t.norm_squared() - v.norm_squared() - w.norm_squared()) / (2.0 * v.norm() * w.norm());
    // For an extended triangle, rounding may put the cosine slightly above 1.
    if cosine.is_nan() || cosine.abs() > 1.0 + 1e-12 {
        return None;
    }
    let x_b = root * cosine.clamp(-1.0, 1.0).acos() - (angle_of(&w) - angle_of(&v));
    let (sine, cosine) = x_b.sin_cos();
    let reached = v + Vector2::new(cosine * w.x - sine * w.y, sine * w.x + cosine * w.y);
    let x_a = angle_of(&t) - angle_of(&reached);
    Some((if carried { x_a } else { -x_a }, x_b))
}

/// Slide s for which `|m + s d| = r`.
fn slide_to(m: &Vector2<f64>, d: &Vector2<f64>, r: f64, root: f64) -> Option<f64> {
    let along = m.dot(d);
    let square = along * along - m.norm_squared() + r * r;
    (square >= 0.0).then(|| -along + root * square.sqrt())
}
