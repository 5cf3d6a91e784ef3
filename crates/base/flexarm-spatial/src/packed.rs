//! Vectors of three numbers in one register each, for processors with AVX2: what a recursion over one run is fastest in.
//!
//! `Packed` is a [`Space`]: it has the bits of [`crate::space::Plain`]. Nobody outside can name it: it is what [`crate::quickest::Quickest`]
//! hands to its work, where the processor has the instructions.

#![allow(unsafe_code, reason = "vector instructions, which are called where they were found to be there")]

use std::arch::x86_64::{
    __m256d, _mm_add_sd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm256_add_pd, _mm256_blend_pd, _mm256_castpd256_pd128,
    _mm256_extractf128_pd, _mm256_load_pd, _mm256_mul_pd, _mm256_permute4x64_pd, _mm256_set_pd, _mm256_set1_pd,
    _mm256_sub_pd, _mm256_xor_pd,
};

use nalgebra::{Matrix3, Vector3};

use crate::products::columns;
use crate::quickest::{Kept, Make, Work};
use crate::space::{Fixed, Space, TurnTable};

/// Three numbers; the fourth is finite and means nothing.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
struct Register(__m256d);

/// The vectors of a recursion over one number, packed.
#[derive(Clone, Copy, Debug)]
struct Packed(());

/// What a work keeps, over packed vectors; it is there only where the processor has the instructions.
pub(crate) struct PackedRoom<K: Kept>(Box<K::Of<Packed>>);

impl<K: Kept> PackedRoom<K> {
    /// `None` where the processor does not pack vectors, or nothing is made.
    pub(crate) fn new(make: impl Make<K>) -> Option<Self> {
        #[target_feature(enable = "avx2")]
        fn compiled<K: Kept>(make: impl Make<K>) -> Option<Box<K::Of<Packed>>> {
            make.make::<Packed>().map(Box::new)
        }
        // SAFETY: the processor has what `compiled` is compiled for.
        if is_x86_feature_detected!("avx2") { unsafe { compiled::<K>(make) }.map(Self) } else { None }
    }

    /// Does the work.
    #[inline]
    pub(crate) fn run<W: Work<K>>(&mut self, work: W) -> W::Output {
        #[target_feature(enable = "avx2")]
        fn compiled<K: Kept, W: Work<K>>(work: W, kept: &mut K::Of<Packed>) -> W::Output {
            work.run::<Packed>(kept)
        }
        // SAFETY: there is no room where the processor does not have what `compiled` is compiled for.
        unsafe { compiled::<K, W>(work, &mut self.0) }
    }
}

/// Loops over numbers, inlined down to them.
pub trait Loops {
    /// Does them.
    fn run(self);
}

/// Runs loops with the vector instructions that the processor has. Operations and their order are the same with and without.
#[inline]
pub fn quickly(loops: impl Loops) {
    #[target_feature(enable = "avx2")]
    fn compiled(loops: impl Loops) {
        loops.run();
    }
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has what `compiled` is compiled for.
        unsafe { compiled(loops) }
    } else {
        loops.run();
    }
}

/// (y, z, x) of (x, y, z).
const YZX: i32 = 0b11_00_10_01;

impl Register {
    #[inline(always)]
    fn of(x: f64, y: f64, z: f64) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_set_pd(0.0, z, y, x) })
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_add_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_sub_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_mul_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_set1_pd(x) })
    }

    /// The components in another order.
    #[inline(always)]
    fn permuted<const ORDER: i32>(self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_permute4x64_pd::<ORDER>(self.0) })
    }

    /// Where the mask has a bit, the component of the other one.
    #[inline(always)]
    fn blended<const MASK: i32>(self, other: Self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_blend_pd::<MASK>(self.0, other.0) })
    }

    /// With the signs of the components changed where those of the other one are negative.
    #[inline(always)]
    fn signed(self, x: f64, y: f64, z: f64) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_xor_pd(self.0, Self::of(x, y, z).0) })
    }

    #[inline(always)]
    fn constant(v: &Fixed) -> Self {
        // SAFETY: four numbers, aligned.
        Self(unsafe { _mm256_load_pd(v.0.as_ptr()) })
    }

    #[inline(always)]
    fn components(self) -> [f64; 3] {
        // SAFETY: the same four numbers in the same order.
        let [x, y, z, _] = unsafe { std::mem::transmute::<__m256d, [f64; 4]>(self.0) };
        [x, y, z]
    }

    /// Sum of the components, from the first one on.
    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see the module page.
        unsafe {
            let low = _mm256_castpd256_pd128(self.0);
            let first = _mm_add_sd(low, _mm_unpackhi_pd(low, low));
            _mm_cvtsd_f64(_mm_add_sd(first, _mm256_extractf128_pd::<1>(self.0)))
        }
    }

    /// `a x + b y + c z` of three columns.
    #[inline(always)]
    fn combined([a, b, c]: &[Self; 3], v: Self) -> Self {
        let ab = a.times(v.permuted::<0b00_00_00_00>()).plus(b.times(v.permuted::<0b01_01_01_01>()));
        ab.plus(c.times(v.permuted::<0b10_10_10_10>()))
    }

    /// Columns of `u wᵀ + [v]x + d 1`.
    #[inline(always)]
    fn dyad(u: Self, w: Self, v: Self, d: Self) -> [Self; 3] {
        // (d, z, -y), (-z, d, x), (y, -x, d)
        let first = v.permuted::<0b11_01_10_00>().signed(0.0, 0.0, -0.0).blended::<0b0001>(d);
        let second = v.permuted::<0b11_00_01_10>().signed(-0.0, 0.0, 0.0).blended::<0b0010>(d);
        let third = v.permuted::<0b11_10_00_01>().signed(0.0, -0.0, 0.0).blended::<0b0100>(d);
        [
            u.times(w.permuted::<0b00_00_00_00>()).plus(first),
            u.times(w.permuted::<0b01_01_01_01>()).plus(second),
            u.times(w.permuted::<0b10_10_10_10>()).plus(third),
        ]
    }

    /// `K_0 + s K_1 + c K_2`, column by column.
    #[inline(always)]
    fn turned([K0, K1, K2]: &[[Fixed; 3]; 3], s: Self, c: Self) -> [Self; 3] {
        let mut all = [s; 3];
        for (j, column) in all.iter_mut().enumerate() {
            let first = Self::constant(&K0[j]).plus(Self::constant(&K1[j]).times(s));
            *column = first.plus(Self::constant(&K2[j]).times(c));
        }
        all
    }
}

/// Columns and rows of a matrix.
#[derive(Clone, Copy, Debug)]
struct BothSides {
    columns: [Register; 3],
    rows: [Register; 3],
}

impl Space for Packed {
    type Real = f64;
    type Vector = Register;
    type Matrix = [Register; 3];
    type Both = BothSides;

    #[inline(always)]
    fn fixed(v: &Fixed) -> Register {
        Register::constant(v)
    }

    #[inline(always)]
    fn vector(v: &Vector3<f64>) -> Register {
        Register::of(v.x, v.y, v.z)
    }

    #[inline(always)]
    fn components(v: &Register) -> Vector3<f64> {
        Vector3::from(v.components())
    }

    #[inline(always)]
    fn matrix(A: &Matrix3<f64>) -> [Register; 3] {
        let [a, b, c] = &A.data.0;
        [Register::of(a[0], a[1], a[2]), Register::of(b[0], b[1], b[2]), Register::of(c[0], c[1], c[2])]
    }

    #[inline(always)]
    fn both(A: &Matrix3<f64>) -> BothSides {
        let [a, b, c] = &A.data.0;
        let rows = [Register::of(a[0], b[0], c[0]), Register::of(a[1], b[1], c[1]), Register::of(a[2], b[2], c[2])];
        BothSides { columns: Self::matrix(A), rows }
    }

    #[inline(always)]
    fn entries(A: &BothSides) -> Matrix3<f64> {
        let [a, b, c] = &A.columns;
        columns(Self::components(a), Self::components(b), Self::components(c))
    }

    #[inline(always)]
    fn add(a: &Register, b: &Register) -> Register {
        a.plus(*b)
    }

    #[inline(always)]
    fn sub(a: &Register, b: &Register) -> Register {
        a.minus(*b)
    }

    #[inline(always)]
    fn scaled(a: &Register, s: f64) -> Register {
        a.times(Register::splat(s))
    }

    #[inline(always)]
    fn cross(a: &Register, b: &Register) -> Register {
        // (z, x, y) of the product.
        a.times(b.permuted::<YZX>()).minus(a.permuted::<YZX>().times(*b)).permuted::<YZX>()
    }

    #[inline(always)]
    fn dot(a: &Register, b: &Register) -> f64 {
        a.times(*b).sum()
    }

    #[inline(always)]
    fn sin_cos(angles: &Register) -> [Register; 2] {
        crate::lanes::sin_cos_of_four(angles.0).map(Register)
    }

    #[inline(always)]
    fn mul(A: &[Register; 3], v: &Register) -> Register {
        Register::combined(A, *v)
    }

    #[inline(always)]
    fn turn(A: &BothSides, v: &Register) -> Register {
        Register::combined(&A.columns, *v)
    }

    #[inline(always)]
    fn turn_back(A: &BothSides, v: &Register) -> Register {
        Register::combined(&A.rows, *v)
    }

    #[inline(always)]
    fn turned(A: &BothSides, B: &BothSides) -> BothSides {
        let [a, b, c] = B.columns;
        let [d, e, f] = A.rows;
        BothSides {
            columns: [Self::turn(A, &a), Self::turn(A, &b), Self::turn(A, &c)],
            rows: [Self::turn_back(B, &d), Self::turn_back(B, &e), Self::turn_back(B, &f)],
        }
    }

    #[inline(always)]
    fn sum(A: &[Register; 3], B: &[Register; 3]) -> [Register; 3] {
        [A[0].plus(B[0]), A[1].plus(B[1]), A[2].plus(B[2])]
    }

    #[inline(always)]
    fn congruent(R: &BothSides, A: &[Register; 3]) -> [Register; 3] {
        let [a, b, c] = R.rows;
        let [a, b, c] = [Self::mul(A, &a), Self::mul(A, &b), Self::mul(A, &c)];
        [Self::turn(R, &a), Self::turn(R, &b), Self::turn(R, &c)]
    }

    #[inline(always)]
    fn of_columns(columns: [Register; 3]) -> [Register; 3] {
        columns
    }

    #[inline(always)]
    fn columns(A: &[Register; 3]) -> [Register; 3] {
        *A
    }

    #[inline(always)]
    fn transposed(A: &BothSides) -> BothSides {
        BothSides { columns: A.rows, rows: A.columns }
    }

    #[inline(always)]
    fn column(A: &BothSides, j: usize) -> Register {
        A.columns[j]
    }

    #[inline(always)]
    fn row(A: &BothSides, j: usize) -> Register {
        A.rows[j]
    }

    #[inline(always)]
    fn dyad(u: &Register, w: &Register, v: &Register, d: f64) -> [Register; 3] {
        Register::dyad(*u, *w, *v, Register::splat(d))
    }

    #[inline(always)]
    fn dyad_both(u: &Register, w: &Register, v: &Register, d: f64) -> BothSides {
        let d = Register::splat(d);
        // The transpose is w uᵀ - [v]x + d 1.
        let back = v.signed(-0.0, -0.0, -0.0);
        BothSides { columns: Register::dyad(*u, *w, *v, d), rows: Register::dyad(*w, *u, back, d) }
    }

    #[inline(always)]
    fn sin_cos_all(angles: &[f64], sines: &mut [f64], cosines: &mut [f64]) {
        crate::lanes::sin_cos_by_fours(angles, sines, cosines);
    }

    #[inline(always)]
    fn turned_by(table: &TurnTable, sine: f64, cosine: f64) -> BothSides {
        let (s, c) = (Register::splat(sine), Register::splat(cosine));
        BothSides { columns: Register::turned(&table.columns, s, c), rows: Register::turned(&table.rows, s, c) }
    }
}
