//! Angles of an elastic joint: rotation as a function of three angles, and angular velocity as a
//! function of their rates.
//!
//! Frames: P the proximal face of the joint, Q the distal one. `R_PQ = R(angles)` and the angular
//! velocity of Q in P, in **Q axes**, is `w_PQ_Q = B(angles) d(angles)/dt`. Start at
//! [`ElasticAngles`].
//!
//! Not here: quaternions of files, springs over the angles.
//!
//! Source: [Shabana 2013], chapter 2, for Euler angles; [Bullo & Murray 1995] for the exponential
//! map.

use nalgebra::{Matrix3, Quaternion, Scalar, UnitQuaternion, Vector3};

use crate::products::{add, add3, columns, cross, dot, mul3, scaled, scaled3};
use crate::real::Real;
use crate::vectors::skew;

/// Cosine below which the axis is taken from the symmetric part of the rotation matrix, above which
/// from the skew part.
const NEAR_HALF_TURN: f64 = -0.9;

/// Squared sine below which a rotation vector is computed from a series.
const SMALL_SINE_SQUARED: f64 = 5e-4;

/// Parametrisation of the rotation of an elastic joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ElasticAngles {
    /// Rotation vector in P axes: `R = exp([phi]x)`. No singularity below a full turn.
    #[default]
    RotationVector,
    /// `R = Rz(rz) Ry(ry) Rx(rx)`, stored as (rx, ry, rz): Z-Y-X Euler angles, equal to fixed X-Y-Z
    /// angles.
    EulerZyx,
}

/// Rotation, rate map and its bias for one set of angles and rates.
#[derive(Clone, Copy, Debug)]
pub struct AngleKinematics<T: Scalar = f64> {
    /// `R_PQ`.
    pub R: Matrix3<T>,
    /// `B` with `w_PQ_Q = B rates`.
    pub B: Matrix3<T>,
    /// `dB/dt rates`: part of the angular acceleration that is quadratic in the rates.
    pub bias: Vector3<T>,
}

impl ElasticAngles {
    /// Rotation, rate map and bias of a joint.
    ///
    /// ```text
    /// R = R_PQ,   w_PQ_Q = B rates,   d(w_PQ_Q)/dt = B d(rates)/dt + bias
    /// ```
    /// * `angles`: of Q relative to P, rad.
    /// * `rates`: their time derivatives, rad/s.
    ///
    /// Returns `R` and `B` (both dimensionless) and `bias` (rad/s², Q axes). `B` is singular at a
    /// full turn of the rotation vector and at `ry = ±π/2` of the Euler angles.
    ///
    /// # Source
    /// [Bullo & Murray 1995] for the rotation vector, [Shabana 2013], chapter 2, for Euler angles.
    #[inline(always)]
    pub fn kinematics<T: Real>(self, angles: &Vector3<T>, rates: &Vector3<T>) -> AngleKinematics<T> {
        match self {
            Self::RotationVector => rotation_vector_kinematics(angles, rates),
            Self::EulerZyx => euler_zyx_kinematics(angles, rates),
        }
    }

    /// Rotation `R_PQ` and rate map `B` as in [`Self::kinematics`], without the bias.
    ///
    /// * `angles`: of Q relative to P, rad.
    ///
    /// Returns `(R_PQ, B)`, both 3×3 and dimensionless.
    #[inline(always)]
    pub fn pose<T: Real>(self, angles: &Vector3<T>) -> (Matrix3<T>, Matrix3<T>) {
        match self {
            Self::RotationVector => rotation_vector_pose(angles, &exponential_coefficients(dot(angles, angles))),
            Self::EulerZyx => {
                let k = euler_zyx_kinematics(angles, &Vector3::zeros());
                (k.R, k.B)
            }
        }
    }

    /// Time derivative `dB/dt` of the rate map; `dB/dt rates` is the bias of [`Self::kinematics`].
    ///
    /// * `angles`: of Q relative to P, rad.
    /// * `rates`: their time derivatives, rad/s.
    ///
    /// Returns a 3×3 matrix, rad/s, with rows in Q axes and one column per angle.
    #[inline(always)]
    pub fn rate_map_derivative<T: Real>(self, angles: &Vector3<T>, rates: &Vector3<T>) -> Matrix3<T> {
        match self {
            Self::RotationVector => {
                let [_, a, b, da, db] = exponential_coefficients(dot(angles, angles));
                let (P, Pdot) = (skew(angles), skew(rates));
                let xdot = T::splat(2.0) * dot(angles, rates);
                // -a' x' [phi]x - a [rates]x + b' x' [phi]x²
                //   + b ([rates]x [phi]x + [phi]x [rates]x),  x' = 2 phi·rates
                let first = add3(&scaled3(&P, -da * xdot), &scaled3(&Pdot, -a));
                let second = add3(&first, &scaled3(&mul3(&P, &P), db * xdot));
                add3(&second, &scaled3(&add3(&mul3(&Pdot, &P), &mul3(&P, &Pdot)), b))
            }
            Self::EulerZyx => euler_zyx_rate_derivative(angles, rates),
        }
    }

    /// Angles of a rotation matrix: the inverse of the rotation of [`Self::kinematics`].
    ///
    /// * `R`: `R_PQ`, orthonormal.
    ///
    /// Returns the angles, rad: a rotation vector of at most half a turn, or Euler angles with `ry`
    /// from -π/2 to π/2. At `ry = ±π/2` only the sum or difference of `rx` and `rz` is determined.
    pub fn from_rotation(self, R: &Matrix3<f64>) -> Vector3<f64> {
        match self {
            Self::RotationVector => rotation_vector(R),
            Self::EulerZyx => Vector3::new(
                R[(2, 1)].atan2(R[(2, 2)]),
                (-R[(2, 0)]).clamp(-1.0, 1.0).asin(),
                R[(1, 0)].atan2(R[(0, 0)]),
            ),
        }
    }
}

/// Rotation vector (unit axis times angle, 0 to pi) of a rotation matrix, accurate from a
/// picoradian to half a turn.
///
/// ```text
/// (R - Rᵀ)/2 = sin θ [a]x,   (R + Rᵀ)/2 = cos θ 1 + (1 - cos θ) a aᵀ
/// ```
/// * `R`: `R_AB`, orthonormal.
///
/// Returns `θ a`, rad, with the same components in A and in B. At exactly half a turn both `a` and
/// `-a` are valid; one of them is returned.
pub fn rotation_vector(R: &Matrix3<f64>) -> Vector3<f64> {
    let skew = 0.5 * Vector3::new(R[(2, 1)] - R[(1, 2)], R[(0, 2)] - R[(2, 0)], R[(1, 0)] - R[(0, 1)]);
    let (square, cosine) = (skew.norm_squared(), 0.5 * (R.trace() - 1.0));
    if square < SMALL_SINE_SQUARED && cosine > 0.0 {
        // asin s / s; the first omitted term is below 1e-17.
        let series = 1.0 / 6.0 + square * (3.0 / 40.0 + square * (5.0 / 112.0 + square * (35.0 / 1152.0)));
        return skew + skew * (square * series);
    }
    let sine = square.sqrt();
    let angle = sine.atan2(cosine);
    if cosine > NEAR_HALF_TURN {
        // θ / sin θ tends to 1; if the sine underflows, the angle does as well.
        return if sine > 0.0 { skew * (angle / sine) } else { skew };
    }
    // The largest column of a aᵀ is parallel to a; its sign follows from the skew part.
    let outer = 0.5 * (R + R.transpose()) - Matrix3::identity() * cosine;
    let largest = outer.diagonal().imax();
    let axis = outer.column(largest).normalize();
    if axis.dot(&skew) < 0.0 { -axis * angle } else { axis * angle }
}

/// Unit quaternion of a rotation vector.
///
/// ```text
/// q = [cos(θ/2), sin(θ/2)/θ φ],   θ = |φ|
/// ```
/// * `phi`: rotation vector φ of `R_AB`, rad.
///
/// Returns q of `R_AB`, scalar part first in the formula; unit length to rounding without a
/// normalisation.
pub fn quaternion(phi: &Vector3<f64>) -> UnitQuaternion<f64> {
    let x = 0.25 * dot(phi, phi);
    let [s, a, ..] = exponential_coefficients(x);
    let vector = scaled(phi, 0.5 * s);
    UnitQuaternion::new_unchecked(Quaternion::new(1.0 - x * a, vector.x, vector.y, vector.z))
}

/// Coefficients of the exponential map at `x = theta²`, with the derivatives of the last two by x:
/// `[s, a, b, da, db]`.
///
/// `s = sin(theta)/theta`, `a = (1 - cos)/theta²`, `b = (theta - sin)/theta³`.
#[inline(always)]
fn exponential_coefficients<T: Real>(x: T) -> [T; 5] {
    x.branch_below(
        1.0,
        #[inline(always)]
        || coefficients_by_series(x),
        #[inline(always)]
        || coefficients_in_closed_form(x),
    )
}

/// All five coefficients from the series of two functions; the first omitted terms are below 1e-17
/// relative.
///
/// ```text
/// c = (1/2 - a)/x = Σ (-x)^k/(2k + 4)!,   d = (1/6 - b)/x = Σ (-x)^k/(2k + 5)!
/// s = 1 - b x,   da/dx = c - b/2,   db/dx = (3 d - c)/2
/// ```
#[inline(always)]
fn coefficients_by_series<T: Real>(x: T) -> [T; 5] {
    const C: [f64; 8] = [
        1.0 / 24.0,
        -1.0 / 720.0,
        1.0 / 40_320.0,
        -1.0 / 3_628_800.0,
        1.0 / 479_001_600.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 20_922_789_888_000.0,
        -1.0 / 6_402_373_705_728_000.0,
    ];
    const D: [f64; 8] = [
        1.0 / 120.0,
        -1.0 / 5040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
        1.0 / 355_687_428_096_000.0,
        -1.0 / 121_645_100_408_832_000.0,
    ];
    let half = T::splat(0.5);
    let (c, d) = (polynomial(x, &C), polynomial(x, &D));
    let (a, b) = (half - x * c, T::splat(1.0 / 6.0) - x * d);
    [T::one() - x * b, a, b, c - half * b, half * (T::splat(3.0) * d - c)]
}

/// `Σ p_k x^k`, evaluated in independent pairs and pairs of pairs.
#[inline(always)]
fn polynomial<T: Real>(x: T, p: &[f64; 8]) -> T {
    let (x2, pair) = (
        x * x,
        #[inline(always)]
        |k: usize| T::splat(p[k]) + x * T::splat(p[k + 1]),
    );
    (pair(0) + x2 * pair(2)) + (x2 * x2) * (pair(4) + x2 * pair(6))
}

/// Kept out of the code of the recursions: links hardly ever rotate this far.
#[cold]
#[inline(never)]
fn coefficients_in_closed_form<T: Real>(x: T) -> [T; 5] {
    let (one, two) = (T::one(), T::splat(2.0));
    let theta = x.sqrt();
    let (sine, cosine) = theta.sin_cos();
    let (s, a) = (sine / theta, (one - cosine) / x);
    let b = (one - s) / x;
    let da = (T::splat(0.5) * s - a) / x;
    // ds/dx = (cos - s)/(2x) and b = (1 - s)/x
    let db = ((s - cosine) / (two * x) - b) / x;
    [s, a, b, da, db]
}

/// `R` and `B` from the coefficients at `|phi|²`.
#[inline(always)]
fn rotation_vector_pose<T: Real>(phi: &Vector3<T>, coefficients: &[T; 5]) -> (Matrix3<T>, Matrix3<T>) {
    let [s, a, b, ..] = *coefficients;
    (by_powers(phi, s, a), by_powers(phi, -a, b))
}

/// `1 + p [phi]x + r [phi]x²`, with `[phi]x² = phi phiᵀ - phi·phi 1`.
#[inline(always)]
fn by_powers<T: Real>(phi: &Vector3<T>, p: T, r: T) -> Matrix3<T> {
    let (x, y, z) = (phi.x, phi.y, phi.z);
    let rest = T::one() - dot(phi, phi) * r;
    let (px, py, pz) = (x * p, y * p, z * p);
    let (xy, xz, yz) = (x * y * r, x * z * r, y * z * r);
    let (xx, yy, zz) = (x * x * r + rest, y * y * r + rest, z * z * r + rest);
    Matrix3::new(xx, xy - pz, xz + py, xy + pz, yy, yz - px, xz - py, yz + px, zz)
}

#[inline(always)]
fn rotation_vector_kinematics<T: Real>(phi: &Vector3<T>, rates: &Vector3<T>) -> AngleKinematics<T> {
    let coefficients = exponential_coefficients(dot(phi, phi));
    let (R, B) = rotation_vector_pose(phi, &coefficients);
    let [_, _, b, da, db] = coefficients;
    // bias = (dB/dt) rates
    //   = -a' x' phi×rates + b' x' phi×(phi×rates) + b (rates×(phi×rates)),  x' = 2 phi·rates
    let xdot = T::splat(2.0) * dot(phi, rates);
    let c = cross(phi, rates);
    let first = add(&scaled(&c, -da * xdot), &scaled(&cross(phi, &c), db * xdot));
    let bias = add(&first, &scaled(&cross(rates, &c), b));
    AngleKinematics { R, B, bias }
}

#[inline(always)]
fn euler_zyx_kinematics<T: Real>(angles: &Vector3<T>, rates: &Vector3<T>) -> AngleKinematics<T> {
    let ((sx, cx), (sy, cy), (sz, cz)) = (angles.x.sin_cos(), angles.y.sin_cos(), angles.z.sin_cos());
    let (sysx, sycx) = (sy * sx, sy * cx);
    let R = Matrix3::new(
        cz * cy,
        cz * sysx - sz * cx,
        cz * sycx + sz * sx,
        sz * cy,
        sz * sysx + cz * cx,
        sz * sycx - cz * sx,
        -sy,
        cy * sx,
        cy * cx,
    );
    let (zero, one) = (T::zero(), T::one());
    let B = Matrix3::new(one, zero, -sy, zero, cx, sx * cy, zero, -sx, cx * cy);
    // Columns of dB/dt; the first one is zero.
    let [y, z] = euler_zyx_rate_columns((sx, cx), (sy, cy), rates);
    AngleKinematics { R, B, bias: add(&scaled(&y, rates.y), &scaled(&z, rates.z)) }
}

/// Second and third column of `dB/dt`.
#[inline(always)]
fn euler_zyx_rate_columns<T: Real>((sx, cx): (T, T), (sy, cy): (T, T), rates: &Vector3<T>) -> [Vector3<T>; 2] {
    [
        Vector3::new(T::zero(), -sx * rates.x, -cx * rates.x),
        Vector3::new(-cy * rates.y, cx * cy * rates.x - sx * sy * rates.y, -sx * cy * rates.x - cx * sy * rates.y),
    ]
}

#[inline(always)]
fn euler_zyx_rate_derivative<T: Real>(angles: &Vector3<T>, rates: &Vector3<T>) -> Matrix3<T> {
    let [y, z] = euler_zyx_rate_columns(angles.x.sin_cos(), angles.y.sin_cos(), rates);
    columns(Vector3::from_element(T::zero()), y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Rotation3, vector};

    const ANGLES: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.0], [1e-3, -2e-3, 5e-4], [0.05, 0.06, -0.06], [0.4, -0.3, 0.9], [1.2, 0.7, -2.0]];

    /// Truth: nalgebra's exponential and Euler matrices; measured 2e-16.
    #[test]
    fn angles_give_the_rotation_they_name() {
        for v in ANGLES.map(Vector3::from) {
            let zero = Vector3::zeros();
            let R = ElasticAngles::RotationVector.kinematics(&v, &zero).R;
            assert_relative_eq!(R, *Rotation3::from_scaled_axis(v).matrix(), epsilon = 1e-14);
            assert_relative_eq!(rotation_vector(&R), v, epsilon = 1e-14);
            let R = ElasticAngles::EulerZyx.kinematics(&v, &zero).R;
            assert_relative_eq!(R, *Rotation3::from_euler_angles(v.x, v.y, v.z).matrix(), epsilon = 1e-14);
            let back = ElasticAngles::EulerZyx.from_rotation(&R);
            assert_relative_eq!(ElasticAngles::EulerZyx.kinematics(&back, &zero).R, R, epsilon = 1e-14);
        }
    }

    /// Truth: central differences of R and B; measured 3e-10 at a step of 1e-6.
    #[test]
    fn rate_map_and_bias_are_the_time_derivatives() {
        let rates = vector![0.7, -1.3, 0.4];
        for kind in [ElasticAngles::RotationVector, ElasticAngles::EulerZyx] {
            for v in ANGLES.map(Vector3::from) {
                let at = |t: f64| kind.kinematics(&(v + rates * t), &rates);
                let (h, k) = (1e-6, at(0.0));
                let Rdot = (at(h).R - at(-h).R) / (2.0 * h);
                let W = k.R.transpose() * Rdot;
                assert_relative_eq!(vector![W[(2, 1)], W[(0, 2)], W[(1, 0)]], k.B * rates, epsilon = 2e-9);
                let Bdot = (at(h).B - at(-h).B) / (2.0 * h);
                assert_relative_eq!(k.bias, Bdot * rates, epsilon = 2e-9);
                assert_relative_eq!(kind.rate_map_derivative(&v, &rates), Bdot, epsilon = 2e-9);
            }
        }
    }

    /// The series below one radian and the closed form above agree at the boundary; measured
    /// 1.7e-16.
    #[test]
    fn series_and_closed_form_agree_where_they_meet() {
        let below = exponential_coefficients(1.0 - f64::EPSILON);
        let above = exponential_coefficients(1.0);
        for (below, above) in below.into_iter().zip(above) {
            assert_relative_eq!(below, above, epsilon = 2e-15);
        }
    }

    /// Truth: nalgebra's quaternions, and the rotation vectors of their matrices; measured 2e-16
    /// and 1e-16 relative.
    #[test]
    fn quaternions_are_those_of_the_rotation_vector() {
        let axis = vector![0.48, -0.6, 0.64];
        for angle in [0.0, 1e-9, 1e-3, 0.02, 0.0223, 0.0224, 0.03, 0.5, 1.9, 2.1, 3.0] {
            let v = axis * angle;
            let q = quaternion(&v);
            assert_relative_eq!(q.coords, UnitQuaternion::from_scaled_axis(v).coords, epsilon = 2e-15);
            let back = rotation_vector(q.to_rotation_matrix().matrix());
            assert_relative_eq!(back, v, epsilon = 2e-15 * (1.0 + angle));
        }
    }

    /// Rotations up to half a turn about any axis are recovered; measured 1e-15.
    #[test]
    fn rotation_vector_survives_half_a_turn() {
        for axis in [vector![1.0, 0.0, 0.0], vector![0.6, -0.8, 0.0], vector![-0.48, 0.6, 0.64]] {
            for angle in [3.0, 3.13, std::f64::consts::PI - 1e-7] {
                let v = axis * angle;
                assert_relative_eq!(rotation_vector(Rotation3::from_scaled_axis(v).matrix()), v, epsilon = 1e-12);
            }
        }
    }
}
