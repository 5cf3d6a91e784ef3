//! SIMD scalars for recursions over several runs or poses at once: four numbers with AVX2, eight
//! with AVX-512.
//!
//! `Four` and `Eight` implement [`Real`]: each lane gives bitwise the result of the same recursion
//! over `f64`. The types are private; [`with_lanes`] passes them to its work after checking that
//! the processor has the instructions.
//!
//! Not here: which runs or poses share a pass (`flexarm-stepping`).

#![allow(unsafe_code, reason = "vector instructions, which are called where they were found to be there")]

use std::arch::x86_64::{
    __m256d, __m512d, _CMP_LT_OQ, _mm256_add_pd, _mm256_andnot_pd, _mm256_blendv_pd, _mm256_cmp_pd, _mm256_div_pd,
    _mm256_movemask_pd, _mm256_mul_pd, _mm256_set1_pd, _mm256_sqrt_pd, _mm256_sub_pd, _mm256_xor_pd, _mm512_add_pd,
    _mm512_andnot_pd, _mm512_cmp_pd_mask, _mm512_div_pd, _mm512_mask_blend_pd, _mm512_mul_pd, _mm512_set1_pd,
    _mm512_sqrt_pd, _mm512_sub_pd, _mm512_xor_pd,
};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::real::Real;

/// Work over SIMD lanes. Its callees must be inlined down to the instructions: mark them
/// `#[inline(always)]`.
pub trait OverLanes {
    /// Result of the work.
    type Output;

    /// Does the work with lanes of this type.
    fn run<T: Real>(self) -> Self::Output;
}

/// Maximum number of lanes of this processor; 1 if it has none.
pub fn most_lanes() -> usize {
    if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
        8
    } else if is_x86_feature_detected!("avx2") {
        4
    } else {
        1
    }
}

/// Does the work with vector instructions in four lanes; `None` if the processor has none.
pub fn with_four_lanes<W: OverLanes>(work: W) -> Option<W::Output> {
    #[target_feature(enable = "avx2")]
    fn over_four<W: OverLanes>(work: W) -> W::Output {
        work.run::<Four>()
    }
    // SAFETY: the processor has the features for which the function is compiled.
    is_x86_feature_detected!("avx2").then(|| unsafe { over_four(work) })
}

/// Does the work with vector instructions, in as many lanes as [`lanes_for`] returns; `None` if the
/// processor has none.
pub fn with_lanes<W: OverLanes>(things: usize, work: W) -> Option<W::Output> {
    #[target_feature(enable = "avx512f,avx512dq")]
    fn over_eight<W: OverLanes>(work: W) -> W::Output {
        work.run::<Eight>()
    }
    match lanes_for(things) {
        // SAFETY: the processor has the features for which the function is compiled.
        8 => Some(unsafe { over_eight(work) }),
        _ => with_four_lanes(work),
    }
}

/// Number of lanes that [`with_lanes`] uses for this many items: eight only if there are more than
/// four.
pub fn lanes_for(things: usize) -> usize {
    match most_lanes() {
        8 if things <= 4 => 4,
        most => most,
    }
}

/// Implements a type of SIMD lanes: type, number of lanes, register type and its instructions.
macro_rules! lanes {
    ($name:ident, $lanes:literal, $register:ident, $splat:ident, $xor:ident, $andnot:ident, $sqrt:ident, $($trait:ident $method:ident $assign:ident $assign_method:ident $instruction:ident),+) => {
        #[doc = concat!("So many numbers: ", $lanes, ".")]
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        struct $name($register);

        impl $name {
            /// Creates it from the lanes.
            #[inline(always)]
            fn new(lanes: [f64; $lanes]) -> Self {
                // SAFETY: the same numbers in the same order.
                Self(unsafe { std::mem::transmute::<[f64; $lanes], $register>(lanes) })
            }

            /// Numbers in the lanes.
            #[inline(always)]
            fn lanes(self) -> [f64; $lanes] {
                // SAFETY: the same numbers in the same order.
                unsafe { std::mem::transmute::<$register, [f64; $lanes]>(self.0) }
            }
        }

        $(
            impl $trait for $name {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    // SAFETY: see the module documentation.
                    Self(unsafe { $instruction(self.0, other.0) })
                }
            }
            impl $assign for $name {
                #[inline(always)]
                fn $assign_method(&mut self, other: Self) {
                    *self = $trait::$method(*self, other);
                }
            }
        )+

        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $xor(self.0, $splat(-0.0)) })
            }
        }

        impl PartialEq for $name {
            fn eq(&self, other: &Self) -> bool {
                self.lanes() == other.lanes()
            }
        }

        impl Zero for $name {
            #[inline(always)]
            fn zero() -> Self {
                Self::splat(0.0)
            }

            fn is_zero(&self) -> bool {
                *self == Self::zero()
            }
        }

        impl One for $name {
            #[inline(always)]
            fn one() -> Self {
                Self::splat(1.0)
            }
        }

        impl Real for $name {
            const LANES: usize = $lanes;

            #[inline(always)]
            fn splat(x: f64) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $splat(x) })
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
                // SAFETY: each entry consists of its numbers without gaps, with stricter alignment.
                unsafe { std::slice::from_raw_parts(all.as_ptr().cast(), $lanes * all.len()) }
            }

            #[inline(always)]
            fn load(from: &[f64]) -> Self {
                let mut lanes = [0.0; $lanes];
                lanes.copy_from_slice(&from[..$lanes]);
                Self::new(lanes)
            }

            #[inline(always)]
            fn store(self, to: &mut [f64]) {
                to[..$lanes].copy_from_slice(&self.lanes());
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $sqrt(self.0) })
            }

            #[inline(always)]
            fn all_below(self, bound: f64) -> bool {
                self.below(Self::splat(bound)) == ((1 << $lanes) - 1)
            }

            #[inline(always)]
            fn any_below(self, bound: f64) -> bool {
                self.below(Self::splat(bound)) != 0
            }

            #[inline(always)]
            fn pick_below(self, bound: Self, yes: Self, no: Self) -> Self {
                self.picked(bound, yes, no)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $andnot($splat(-0.0), self.0) })
            }
        }
    };
}
lanes!(
    Four, 4, __m256d, _mm256_set1_pd, _mm256_xor_pd, _mm256_andnot_pd, _mm256_sqrt_pd,
    Add add AddAssign add_assign _mm256_add_pd,
    Sub sub SubAssign sub_assign _mm256_sub_pd,
    Mul mul MulAssign mul_assign _mm256_mul_pd,
    Div div DivAssign div_assign _mm256_div_pd
);
lanes!(
    Eight, 8, __m512d, _mm512_set1_pd, _mm512_xor_pd, _mm512_andnot_pd, _mm512_sqrt_pd,
    Add add AddAssign add_assign _mm512_add_pd,
    Sub sub SubAssign sub_assign _mm512_sub_pd,
    Mul mul MulAssign mul_assign _mm512_mul_pd,
    Div div DivAssign div_assign _mm512_div_pd
);

impl Four {
    /// Bit mask of the lanes that are below.
    #[inline(always)]
    fn below(self, bound: Self) -> i32 {
        // SAFETY: see the module documentation.
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, bound.0)) }
    }

    /// `yes` where below, otherwise `no`.
    #[inline(always)]
    fn picked(self, bound: Self, yes: Self, no: Self) -> Self {
        // SAFETY: see the module documentation.
        Self(unsafe { _mm256_blendv_pd(no.0, yes.0, _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, bound.0)) })
    }
}

impl Eight {
    /// Bit mask of the lanes that are below.
    #[inline(always)]
    fn below(self, bound: Self) -> i32 {
        // SAFETY: see the module documentation.
        i32::from(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, bound.0) })
    }

    /// `yes` where below, otherwise `no`.
    #[inline(always)]
    fn picked(self, bound: Self, yes: Self, no: Self) -> Self {
        // SAFETY: see the module documentation.
        Self(unsafe { _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, bound.0), no.0, yes.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ElasticAngles;
    use nalgebra::Vector3;

    struct Kinematics([[f64; 3]; 4]);

    impl OverLanes for Kinematics {
        type Output = Vec<Vec<f64>>;

        #[inline(always)]
        fn run<T: Real>(self) -> Self::Output {
            let mut angles = Vector3::from_element(T::zero());
            for (lane, own) in self.0.iter().cycle().take(T::LANES).enumerate() {
                angles.iter_mut().zip(own).for_each(|(to, angle)| to.set_lane(lane, *angle));
            }
            let rates = Vector3::new(T::splat(0.3), T::splat(-1.1), T::splat(0.7));
            let kin = ElasticAngles::RotationVector.kinematics(&angles, &rates);
            let euler = ElasticAngles::EulerZyx.kinematics(&angles, &rates);
            let all = kin.R.iter().chain(&kin.B).chain(&kin.bias).chain(&euler.R).chain(&euler.B).chain(&euler.bias);
            let all: Vec<T> = all.copied().collect();
            (0..T::LANES).map(|lane| all.iter().map(|x| x.lane(lane)).collect()).collect()
        }
    }

    /// Truth: the same over a single number; both formulas of the rotation vector in one call; four
    /// and eight lanes, if the processor has them.
    #[test]
    fn every_lane_has_the_bits_of_a_single_number() {
        for angles in [
            [[1e-3, 2e-4, -5e-4], [0.4, -0.3, 0.9], [1.0, 2.0, -1.0], [0.0, 0.0, 0.0]],
            [[1e-3, 2e-4, -5e-4]; 4],
            [[0.5, -7.0, 3.0], [2e6, 0.1, 0.2], [-40.0, 12.0, 1e5], [f64::MIN_POSITIVE, 1.0, 0.0]],
        ] {
            let together = [4, 8].iter().filter_map(|things| with_lanes(*things, Kinematics(angles)));
            let lanes: Vec<Vec<f64>> = together.flatten().collect();
            for (lane, v) in lanes.iter().zip(angles.map(Vector3::from).iter().cycle()) {
                let rates = Vector3::new(0.3, -1.1, 0.7);
                let kin = ElasticAngles::RotationVector.kinematics(v, &rates);
                let euler = ElasticAngles::EulerZyx.kinematics(v, &rates);
                let all = kin.R.iter().chain(&kin.B).chain(&kin.bias).chain(&euler.R).chain(&euler.B);
                let bits = |x: &f64| x.to_bits();
                let single: Vec<u64> = all.chain(&euler.bias).map(bits).collect();
                assert_eq!(lane.iter().map(bits).collect::<Vec<_>>(), single);
            }
        }
    }
}
