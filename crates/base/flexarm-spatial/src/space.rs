//! How a recursion holds its vectors and 3×3 matrices: as numbers, or each vector packed into one register.
//!
//! A recursion that is written over [`Space`] has the same bits in every one of them: sums keep their order, and no operation is
//! contracted. [`Plain`] is three numbers (or lanes of numbers) a vector; `Packed` needs AVX2.

use std::fmt::Debug;
use std::marker::PhantomData;

use nalgebra::{Matrix3, Vector3};

use crate::products::{add, add3, column, columns, cross, dot, mul, mul3, scaled, scaled3, sub, tr_mul};
use crate::real::{Real, sin_cos_all};

/// A constant vector, as long as a register.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub struct Fixed(pub(crate) [f64; 4]);

impl Fixed {
    /// 1 along an axis, 0, 1 or 2.
    pub const fn unit(axis: usize) -> Self {
        let mut all = [0.0; 4];
        all[axis] = 1.0;
        Self(all)
    }
}

impl From<&Vector3<f64>> for Fixed {
    fn from(v: &Vector3<f64>) -> Self {
        Self([v.x, v.y, v.z, 0.0])
    }
}

/// `K_0 + s K_1 + c K_2` of constant matrices, columns and rows of each: a rotation over the sine and cosine of its angle.
#[derive(Clone, Copy, Debug)]
pub struct TurnTable {
    pub(crate) columns: [[Fixed; 3]; 3],
    pub(crate) rows: [[Fixed; 3]; 3],
}

impl TurnTable {
    /// From the three matrices.
    pub fn new(K: [&Matrix3<f64>; 3]) -> Self {
        let vectors = |A: &Matrix3<f64>| [0, 1, 2].map(|j| Fixed::from(&A.column(j).into_owned()));
        Self { columns: K.map(vectors), rows: K.map(|A| vectors(&A.transpose())) }
    }
}

/// Vectors and matrices of a recursion. Matrices are of two kinds: for products with a vector alone, and for those with the
/// transpose as well.
pub trait Space: Copy + Send + Sync + Debug + 'static {
    /// Numbers.
    type Real: Real;
    /// Three of them.
    type Vector: Copy + Send + Sync + Debug;
    /// A, for `A v`.
    type Matrix: Copy + Send + Sync + Debug;
    /// A, for `A v` and `Aᵀ v`.
    type Both: Copy + Send + Sync + Debug;

    /// A constant.
    fn fixed(v: &Fixed) -> Self::Vector;

    /// From its components.
    fn vector(v: &Vector3<Self::Real>) -> Self::Vector;

    /// The components.
    fn components(v: &Self::Vector) -> Vector3<Self::Real>;

    /// For products with vectors.
    fn matrix(A: &Matrix3<Self::Real>) -> Self::Matrix;

    /// For products with vectors, from either side.
    fn both(A: &Matrix3<Self::Real>) -> Self::Both;

    /// The entries.
    fn entries(A: &Self::Both) -> Matrix3<Self::Real>;

    /// `a + b`.
    fn add(a: &Self::Vector, b: &Self::Vector) -> Self::Vector;

    /// `a - b`.
    fn sub(a: &Self::Vector, b: &Self::Vector) -> Self::Vector;

    /// `a s`.
    fn scaled(a: &Self::Vector, s: Self::Real) -> Self::Vector;

    /// `a × b`.
    fn cross(a: &Self::Vector, b: &Self::Vector) -> Self::Vector;

    /// `aᵀ b`.
    fn dot(a: &Self::Vector, b: &Self::Vector) -> Self::Real;

    /// Sines and cosines of three angles (rad).
    fn sin_cos(angles: &Self::Vector) -> [Self::Vector; 2];

    /// `A v`.
    fn mul(A: &Self::Matrix, v: &Self::Vector) -> Self::Vector;

    /// `A v`.
    fn turn(A: &Self::Both, v: &Self::Vector) -> Self::Vector;

    /// `Aᵀ v`.
    fn turn_back(A: &Self::Both, v: &Self::Vector) -> Self::Vector;

    /// `A B`.
    fn turned(A: &Self::Both, B: &Self::Both) -> Self::Both;

    /// `A + B`.
    fn sum(A: &Self::Matrix, B: &Self::Matrix) -> Self::Matrix;

    /// `R A Rᵀ`.
    fn congruent(R: &Self::Both, A: &Self::Matrix) -> Self::Matrix;

    /// From three columns.
    fn of_columns(columns: [Self::Vector; 3]) -> Self::Matrix;

    /// The columns of A.
    fn columns(A: &Self::Matrix) -> [Self::Vector; 3];

    /// `Aᵀ`.
    fn transposed(A: &Self::Both) -> Self::Both;

    /// Column j of A.
    fn column(A: &Self::Both, j: usize) -> Self::Vector;

    /// Row j of A.
    fn row(A: &Self::Both, j: usize) -> Self::Vector;

    /// `u wᵀ + [v]x + d 1`.
    fn dyad(u: &Self::Vector, w: &Self::Vector, v: &Self::Vector, d: Self::Real) -> Self::Matrix;

    /// `u wᵀ + [v]x + d 1`.
    fn dyad_both(u: &Self::Vector, w: &Self::Vector, v: &Self::Vector, d: Self::Real) -> Self::Both;

    /// Sines and cosines of many angles (rad), whose number is a multiple of four.
    fn sin_cos_all(angles: &[Self::Real], sines: &mut [Self::Real], cosines: &mut [Self::Real]);

    /// A rotation at the sine and cosine of its angle.
    fn turned_by(table: &TurnTable, sine: Self::Real, cosine: Self::Real) -> Self::Both;
}

/// Three numbers a vector, or three lanes of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Plain<T>(PhantomData<T>);

impl<T: Real> Space for Plain<T> {
    type Real = T;
    type Vector = Vector3<T>;
    type Matrix = Matrix3<T>;
    type Both = Matrix3<T>;

    #[inline(always)]
    fn fixed(v: &Fixed) -> Vector3<T> {
        let [x, y, z, _] = v.0;
        Vector3::new(T::splat(x), T::splat(y), T::splat(z))
    }

    #[inline(always)]
    fn vector(v: &Vector3<T>) -> Vector3<T> {
        *v
    }

    #[inline(always)]
    fn components(v: &Vector3<T>) -> Vector3<T> {
        *v
    }

    #[inline(always)]
    fn matrix(A: &Matrix3<T>) -> Matrix3<T> {
        *A
    }

    #[inline(always)]
    fn both(A: &Matrix3<T>) -> Matrix3<T> {
        *A
    }

    #[inline(always)]
    fn entries(A: &Matrix3<T>) -> Matrix3<T> {
        *A
    }

    #[inline(always)]
    fn add(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
        add(a, b)
    }

    #[inline(always)]
    fn sub(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
        sub(a, b)
    }

    #[inline(always)]
    fn scaled(a: &Vector3<T>, s: T) -> Vector3<T> {
        scaled(a, s)
    }

    #[inline(always)]
    fn cross(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
        cross(a, b)
    }

    #[inline(always)]
    fn dot(a: &Vector3<T>, b: &Vector3<T>) -> T {
        dot(a, b)
    }

    #[inline(always)]
    fn sin_cos(angles: &Vector3<T>) -> [Vector3<T>; 2] {
        let ((sx, cx), (sy, cy), (sz, cz)) = (angles.x.sin_cos(), angles.y.sin_cos(), angles.z.sin_cos());
        [Vector3::new(sx, sy, sz), Vector3::new(cx, cy, cz)]
    }

    #[inline(always)]
    fn mul(A: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
        mul(A, v)
    }

    #[inline(always)]
    fn turn(A: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
        mul(A, v)
    }

    #[inline(always)]
    fn turn_back(A: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
        tr_mul(A, v)
    }

    #[inline(always)]
    fn turned(A: &Matrix3<T>, B: &Matrix3<T>) -> Matrix3<T> {
        mul3(A, B)
    }

    #[inline(always)]
    fn sum(A: &Matrix3<T>, B: &Matrix3<T>) -> Matrix3<T> {
        add3(A, B)
    }

    #[inline(always)]
    fn congruent(R: &Matrix3<T>, A: &Matrix3<T>) -> Matrix3<T> {
        let [a, b, c] = [mul(A, &Self::row(R, 0)), mul(A, &Self::row(R, 1)), mul(A, &Self::row(R, 2))];
        columns(mul(R, &a), mul(R, &b), mul(R, &c))
    }

    #[inline(always)]
    fn of_columns([a, b, c]: [Vector3<T>; 3]) -> Matrix3<T> {
        columns(a, b, c)
    }

    #[inline(always)]
    fn columns(A: &Matrix3<T>) -> [Vector3<T>; 3] {
        [column(A, 0), column(A, 1), column(A, 2)]
    }

    #[inline(always)]
    fn transposed(A: &Matrix3<T>) -> Matrix3<T> {
        columns(Self::row(A, 0), Self::row(A, 1), Self::row(A, 2))
    }

    #[inline(always)]
    fn column(A: &Matrix3<T>, j: usize) -> Vector3<T> {
        column(A, j)
    }

    #[inline(always)]
    fn row(A: &Matrix3<T>, j: usize) -> Vector3<T> {
        let [a, b, c] = &A.data.0;
        Vector3::new(a[j], b[j], c[j])
    }

    #[inline(always)]
    fn dyad(u: &Vector3<T>, w: &Vector3<T>, v: &Vector3<T>, d: T) -> Matrix3<T> {
        columns(
            Vector3::new(u.x * w.x + d, u.y * w.x + v.z, u.z * w.x - v.y),
            Vector3::new(u.x * w.y - v.z, u.y * w.y + d, u.z * w.y + v.x),
            Vector3::new(u.x * w.z + v.y, u.y * w.z - v.x, u.z * w.z + d),
        )
    }

    #[inline(always)]
    fn dyad_both(u: &Vector3<T>, w: &Vector3<T>, v: &Vector3<T>, d: T) -> Matrix3<T> {
        Self::dyad(u, w, v, d)
    }

    #[inline(always)]
    fn sin_cos_all(angles: &[T], sines: &mut [T], cosines: &mut [T]) {
        sin_cos_all(angles, sines, cosines);
    }

    #[inline(always)]
    fn turned_by(table: &TurnTable, sine: T, cosine: T) -> Matrix3<T> {
        let [K0, K1, K2] = [constant(&table.columns[0]), constant(&table.columns[1]), constant(&table.columns[2])];
        add3(&add3(&K0, &scaled3(&K1, sine)), &scaled3(&K2, cosine))
    }
}

/// A constant matrix by its columns.
#[inline(always)]
fn constant<T: Real>([a, b, c]: &[Fixed; 3]) -> Matrix3<T> {
    columns(Plain::fixed(a), Plain::fixed(b), Plain::fixed(c))
}
