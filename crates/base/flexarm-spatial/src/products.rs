//! Operations on 3-vectors and 3×3 matrices in the inner loops of the recursions, written out
//! explicitly. nalgebra's general product of small matrices takes twice as many instructions, and
//! over SIMD lanes inlining of its operations is not guaranteed, although it is required
//! ([`crate::lanes`]). The order of sums is fixed, so results are the same on every machine.
//!
//! Plain arrays of numbers without frames or units; those are the caller's. Not here: six-vectors
//! ([`crate::Twist`], [`crate::Wrench`]), functions of angles ([`crate::ElasticAngles`]).

use nalgebra::{Matrix3, Vector3};

use crate::real::Real;

/// `a + b`.
#[inline(always)]
pub fn add<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x + b.x, a.y + b.y, a.z + b.z)
}

/// `a - b`.
#[inline(always)]
pub fn sub<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x - b.x, a.y - b.y, a.z - b.z)
}

/// `a s`.
#[inline(always)]
pub fn scaled<T: Real>(a: &Vector3<T>, s: T) -> Vector3<T> {
    Vector3::new(a.x * s, a.y * s, a.z * s)
}

/// `a × b`.
#[inline(always)]
pub fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// `aᵀ b`.
#[inline(always)]
pub fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// `A + B`.
#[inline(always)]
pub fn add3<T: Real>(A: &Matrix3<T>, B: &Matrix3<T>) -> Matrix3<T> {
    by_columns(
        #[inline(always)]
        |j| add(&column(A, j), &column(B, j)),
    )
}

/// `A s`.
#[inline(always)]
pub fn scaled3<T: Real>(A: &Matrix3<T>, s: T) -> Matrix3<T> {
    by_columns(
        #[inline(always)]
        |j| scaled(&column(A, j), s),
    )
}

/// `Aᵀ`.
#[inline(always)]
pub fn transposed<T: Real>(A: &Matrix3<T>) -> Matrix3<T> {
    let [a, b, c] = &A.data.0;
    Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])
}

#[inline(always)]
fn by_columns<T: Real>(column: impl Fn(usize) -> Vector3<T>) -> Matrix3<T> {
    columns(column(0), column(1), column(2))
}

/// `A v`.
#[inline(always)]
pub fn mul<T: Real>(A: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    let [a, b, c] = &A.data.0;
    let (x, y, z) = (v.x, v.y, v.z);
    Vector3::new(a[0] * x + b[0] * y + c[0] * z, a[1] * x + b[1] * y + c[1] * z, a[2] * x + b[2] * y + c[2] * z)
}

/// `Aᵀ v`.
#[inline(always)]
pub fn tr_mul<T: Real>(A: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    let [a, b, c] = &A.data.0;
    let (x, y, z) = (v.x, v.y, v.z);
    Vector3::new(a[0] * x + a[1] * y + a[2] * z, b[0] * x + b[1] * y + b[2] * z, c[0] * x + c[1] * y + c[2] * z)
}

/// Matrix with the given columns.
#[inline(always)]
pub fn columns<T: Real>(a: Vector3<T>, b: Vector3<T>, c: Vector3<T>) -> Matrix3<T> {
    Matrix3::new(a.x, b.x, c.x, a.y, b.y, c.y, a.z, b.z, c.z)
}

/// Column j as a vector.
#[inline(always)]
pub fn column<T: Real>(A: &Matrix3<T>, j: usize) -> Vector3<T> {
    let c = &A.data.0[j];
    Vector3::new(c[0], c[1], c[2])
}

/// `A B`.
#[inline(always)]
pub fn mul3<T: Real>(A: &Matrix3<T>, B: &Matrix3<T>) -> Matrix3<T> {
    columns(mul(A, &column(B, 0)), mul(A, &column(B, 1)), mul(A, &column(B, 2)))
}

/// `Aᵀ B`.
#[inline(always)]
pub fn tr_mul3<T: Real>(A: &Matrix3<T>, B: &Matrix3<T>) -> Matrix3<T> {
    columns(tr_mul(A, &column(B, 0)), tr_mul(A, &column(B, 1)), tr_mul(A, &column(B, 2)))
}

/// `R A Rᵀ` for a symmetric A, such as an inertia `I_A = R_AB I_B R_ABᵀ`.
///
/// Computes six entries; the result is symmetric bit for bit.
#[inline(always)]
pub fn turn_symmetric<T: Real>(R: &Matrix3<T>, A: &Matrix3<T>) -> Matrix3<T> {
    let [t0, t1, t2] = &mul3(R, A).data.0;
    let [r0, r1, r2] = &R.data.0;
    let xx = t0[0] * r0[0] + t1[0] * r1[0] + t2[0] * r2[0];
    let xy = t0[0] * r0[1] + t1[0] * r1[1] + t2[0] * r2[1];
    let xz = t0[0] * r0[2] + t1[0] * r1[2] + t2[0] * r2[2];
    let yy = t0[1] * r0[1] + t1[1] * r1[1] + t2[1] * r2[1];
    let yz = t0[1] * r0[2] + t1[1] * r1[2] + t2[1] * r2[2];
    let zz = t0[2] * r0[2] + t1[2] * r1[2] + t2[2] * r2[2];
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// `[p]x A`: cross product of p with each column of A.
#[inline(always)]
pub fn cross3<T: Real>(p: &Vector3<T>, A: &Matrix3<T>) -> Matrix3<T> {
    by_columns(
        #[inline(always)]
        |j| cross(p, &column(A, j)),
    )
}

/// Converts a constant vector to the scalar type of a recursion.
#[inline(always)]
pub fn lift<T: Real>(v: &Vector3<f64>) -> Vector3<T> {
    Vector3::new(T::splat(v.x), T::splat(v.y), T::splat(v.z))
}

/// Converts a constant matrix to the scalar type of a recursion.
#[inline(always)]
pub fn lift3<T: Real>(A: &Matrix3<f64>) -> Matrix3<T> {
    let [a, b, c] = &A.data.0;
    columns(
        Vector3::new(T::splat(a[0]), T::splat(a[1]), T::splat(a[2])),
        Vector3::new(T::splat(b[0]), T::splat(b[1]), T::splat(b[2])),
        Vector3::new(T::splat(c[0]), T::splat(c[1]), T::splat(c[2])),
    )
}
