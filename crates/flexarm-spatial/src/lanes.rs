//! Four numbers side by side, for processors with AVX2: the scalar of recursions over four runs or poses at once.
//!
//! `Four` is a [`Real`]: each lane has the bits of the same recursion over `f64`. Nobody outside can name it: it is what
//! [`with_lanes`] hands to its work once it has seen that the processor has the instructions.

#![allow(unsafe_code, reason = "vector instructions, which are called where they were found to be there")]

use std::arch::x86_64::{
    __m256d, _CMP_LT_OQ, _mm256_add_pd, _mm256_blendv_pd, _mm256_cmp_pd, _mm256_div_pd, _mm256_movemask_pd,
    _mm256_mul_pd, _mm256_set1_pd, _mm256_sqrt_pd, _mm256_sub_pd, _mm256_xor_pd,
};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::real::Real;

/// Four numbers.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
struct Four(__m256d);

/// Work over lanes. What it calls is inlined, down to the instructions: mark it `#[inline(always)]`.
pub trait OverLanes {
    /// What comes of it.
    type Output;

    /// Does it over lanes of this type.
    fn run<T: Real>(self) -> Self::Output;
}

/// Does the work with vector instructions; `None` where the processor has none.
pub fn with_lanes<W: OverLanes>(work: W) -> Option<W::Output> {
    #[target_feature(enable = "avx2")]
    fn compiled<W: OverLanes>(work: W) -> W::Output {
        work.run::<Four>()
    }
    // SAFETY: the processor has what `compiled` is compiled for.
    std::arch::is_x86_feature_detected!("avx2").then(|| unsafe { compiled(work) })
}

impl Four {
    /// From the lanes.
    #[inline(always)]
    fn new(lanes: [f64; 4]) -> Self {
        // SAFETY: the same four numbers in the same order.
        Self(unsafe { std::mem::transmute::<[f64; 4], __m256d>(lanes) })
    }

    /// The lanes.
    #[inline(always)]
    fn lanes(self) -> [f64; 4] {
        // SAFETY: the same four numbers in the same order.
        unsafe { std::mem::transmute::<__m256d, [f64; 4]>(self.0) }
    }

    /// One bit for each lane that is below.
    #[inline(always)]
    fn below(self, bound: Self) -> i32 {
        // SAFETY: see the module page.
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, bound.0)) }
    }
}

macro_rules! operation {
    ($trait:ident, $method:ident, $assign:ident, $assign_method:ident, $instruction:ident) => {
        impl $trait for Four {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the module page.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
        impl $assign for Four {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = $trait::$method(*self, other);
            }
        }
    };
}
operation!(Add, add, AddAssign, add_assign, _mm256_add_pd);
operation!(Sub, sub, SubAssign, sub_assign, _mm256_sub_pd);
operation!(Mul, mul, MulAssign, mul_assign, _mm256_mul_pd);
operation!(Div, div, DivAssign, div_assign, _mm256_div_pd);

impl Neg for Four {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
    }
}

impl PartialEq for Four {
    fn eq(&self, other: &Self) -> bool {
        self.lanes() == other.lanes()
    }
}

impl Zero for Four {
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl One for Four {
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

impl Real for Four {
    const LANES: usize = 4;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_set1_pd(x) })
    }

    #[inline(always)]
    fn lane(self, k: usize) -> f64 {
        self.lanes()[k]
    }

    #[inline(always)]
    fn set_lane(&mut self, k: usize, x: f64) {
        let mut lanes = self.lanes();
        lanes[k] = x;
        *self = Self::new(lanes);
    }

    #[inline(always)]
    fn flat(all: &[Self]) -> &[f64] {
        // SAFETY: each is four numbers without gaps, and more strictly aligned.
        unsafe { std::slice::from_raw_parts(all.as_ptr().cast(), 4 * all.len()) }
    }

    #[inline(always)]
    fn flat_mut(all: &mut [Self]) -> &mut [f64] {
        // SAFETY: as in `flat`; every bit pattern is a number.
        unsafe { std::slice::from_raw_parts_mut(all.as_mut_ptr().cast(), 4 * all.len()) }
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self::new([from[0], from[1], from[2], from[3]])
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..4].copy_from_slice(&self.lanes());
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_sqrt_pd(self.0) })
    }

    #[inline(always)]
    fn all_below(self, bound: f64) -> bool {
        self.below(Self::splat(bound)) == 0b1111
    }

    #[inline(always)]
    fn any_below(self, bound: f64) -> bool {
        self.below(Self::splat(bound)) != 0
    }

    #[inline(always)]
    fn pick_below(self, bound: Self, yes: Self, no: Self) -> Self {
        // SAFETY: see the module page.
        Self(unsafe { _mm256_blendv_pd(no.0, yes.0, _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, bound.0)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ElasticAngles;
    use nalgebra::Vector3;

    struct Kinematics([[f64; 3]; 4]);

    impl OverLanes for Kinematics {
        type Output = [Vec<f64>; 4];

        #[inline(always)]
        fn run<T: Real>(self) -> Self::Output {
            let mut angles = Vector3::from_element(T::zero());
            for (lane, own) in self.0.iter().enumerate() {
                angles.iter_mut().zip(own).for_each(|(to, angle)| to.set_lane(lane, *angle));
            }
            let rates = Vector3::new(T::splat(0.3), T::splat(-1.1), T::splat(0.7));
            let kin = ElasticAngles::RotationVector.kinematics(&angles, &rates);
            let euler = ElasticAngles::EulerZyx.kinematics(&angles, &rates);
            let all = kin.R.iter().chain(&kin.B).chain(&kin.bias).chain(&euler.R).chain(&euler.B).chain(&euler.bias);
            let all: Vec<T> = all.copied().collect();
            std::array::from_fn(|lane| all.iter().map(|x| x.lane(lane)).collect())
        }
    }

    /// Truth: the same over one number; both formulas of the rotation vector in one call.
    #[test]
    fn every_lane_has_the_bits_of_a_single_number() {
        for angles in [
            [[1e-3, 2e-4, -5e-4], [0.4, -0.3, 0.9], [1.0, 2.0, -1.0], [0.0, 0.0, 0.0]],
            [[1e-3, 2e-4, -5e-4]; 4],
            [[0.5, -7.0, 3.0], [2e6, 0.1, 0.2], [-40.0, 12.0, 1e5], [f64::MIN_POSITIVE, 1.0, 0.0]],
        ] {
            let Some(lanes) = with_lanes(Kinematics(angles)) else { return };
            for (lane, v) in lanes.iter().zip(angles.map(Vector3::from)) {
                let rates = Vector3::new(0.3, -1.1, 0.7);
                let kin = ElasticAngles::RotationVector.kinematics(&v, &rates);
                let euler = ElasticAngles::EulerZyx.kinematics(&v, &rates);
                let all = kin.R.iter().chain(&kin.B).chain(&kin.bias).chain(&euler.R).chain(&euler.B);
                let bits = |x: &f64| x.to_bits();
                let single: Vec<u64> = all.chain(&euler.bias).map(bits).collect();
                assert_eq!(lane.iter().map(bits).collect::<Vec<_>>(), single);
            }
        }
    }
}
