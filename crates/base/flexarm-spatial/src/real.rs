//! Scalar type of the recursions: one number, or several SIMD lanes ([`crate::lanes`]).
//!
//! A recursion over [`Real`] gives every lane bitwise the result for a single number: operations
//! are rounded identically, none is contracted to a fused multiply-add, sums keep their order, and
//! a value-dependent choice of formula is made per lane.
//!
//! Start at [`Real`]. Not here: the vector instructions ([`crate::lanes`]).
//!
//! Sine and cosine are computed here, so that they are the same on every machine: system libraries
//! differ in the last bit between processors. Source: [Cody & Waite 1980] for the reduction;
//! polynomial coefficients as in FreeBSD's `k_sin.c` and `k_cos.c`.

use std::f64::consts::FRAC_2_PI;
use std::ops::Neg;

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar};
use num_traits::{One, Zero};

/// Maximum angle (rad) for sine and cosine of this module, about a quarter of a million turns;
/// beyond it the system functions are used.
const LARGEST_ANGLE: f64 = 1.5e6;

/// Angles below this (rad, less than π/4) need no range reduction; the result is bitwise the same
/// without it.
const NEAR_ZERO: f64 = 0.78;

/// Real number of a recursion, or SIMD lanes of real numbers.
pub trait Real:
    Scalar
    + Copy
    + Send
    + Sync
    + Zero
    + One
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Neg<Output = Self>
{
    /// Number of lanes.
    const LANES: usize;

    /// Sets all lanes to the same number.
    fn splat(x: f64) -> Self;

    /// Number in lane `k`.
    fn lane(self, k: usize) -> f64;

    /// Sets the number in lane `k`.
    fn set_lane(&mut self, k: usize, x: f64);

    /// Numbers lane by lane: those of entry i begin at `i LANES`.
    fn flat(all: &[Self]) -> &[f64];

    /// Loads the first numbers of a slice, one per lane.
    fn load(from: &[f64]) -> Self;

    /// Stores the lanes in the first numbers of a slice.
    fn store(self, to: &mut [f64]);

    /// Square root.
    fn sqrt(self) -> Self;

    /// Whether all lanes are below the bound.
    fn all_below(self, bound: f64) -> bool;

    /// Whether any lane is below the bound.
    fn any_below(self, bound: f64) -> bool;

    /// Whether any lane is above the bound.
    #[inline(always)]
    fn any_above(self, bound: f64) -> bool {
        (-self).any_below(-bound)
    }

    /// Selects `yes` where `self < bound`, otherwise `no`.
    fn pick_below(self, bound: Self, yes: Self, no: Self) -> Self;

    /// Evaluates `yes` where `self < bound`, otherwise `no`. A formula that no lane needs is not
    /// computed.
    #[inline(always)]
    fn branch_below<const N: usize>(
        self,
        bound: f64,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N] {
        if self.all_below(bound) {
            return yes();
        }
        if !self.any_below(bound) {
            return no();
        }
        let (mut all, no) = (yes(), no());
        for (yes, no) in all.iter_mut().zip(no) {
            *yes = self.pick_below(Self::splat(bound), *yes, no);
        }
        all
    }

    /// Absolute value.
    #[inline(always)]
    fn abs(self) -> Self {
        self.pick_below(Self::zero(), -self, self)
    }

    /// Sine and cosine of an angle in rad, to within one unit in the last place.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let size = self.abs();
        if size.all_below(NEAR_ZERO) {
            return (sine_near_zero(self, Self::zero()), cosine_near_zero(self, Self::zero()));
        }
        if size.all_below(LARGEST_ANGLE) { sine_and_cosine(self) } else { sin_cos_by_lane(self) }
    }
}

/// Computes sines and cosines of many angles (rad), each bitwise as by [`Real::sin_cos`].
///
/// # Panics
/// If the slices differ in length.
#[inline(always)]
pub fn sin_cos_all<T: Real>(angles: &[T], sines: &mut [T], cosines: &mut [T]) {
    assert!(sines.len() == angles.len() && cosines.len() == angles.len(), "a sine and a cosine for each angle");
    // No branch inside the loop, so that numbers are vectorised as well. Loops instead of closures
    // here and below: over lanes everything must be inlined.
    let mut in_range = true;
    for angle in angles {
        in_range &= angle.abs().all_below(LARGEST_ANGLE);
    }
    if in_range {
        for ((angle, sine), cosine) in angles.iter().zip(sines).zip(cosines) {
            (*sine, *cosine) = sine_and_cosine(*angle);
        }
    } else {
        for ((angle, sine), cosine) in angles.iter().zip(sines).zip(cosines) {
            (*sine, *cosine) = sin_cos_by_lane(*angle);
        }
    }
}

/// Sine and cosine by lane, if some lane is out of range or not a number.
#[cold]
#[inline(never)]
fn sin_cos_by_lane<T: Real>(x: T) -> (T, T) {
    let (mut sine, mut cosine) = (x, x);
    for k in 0..T::LANES {
        let angle = x.lane(k);
        let (s, c) = if angle.abs() < LARGEST_ANGLE { sine_and_cosine(angle) } else { f64::sin_cos(angle) };
        sine.set_lane(k, s);
        cosine.set_lane(k, c);
    }
    (sine, cosine)
}

/// `x = k π/2 + (y + tail)`: sine and cosine of the remainder, then the quadrant.
#[inline(always)]
fn sine_and_cosine<T: Real>(x: T) -> (T, T) {
    // π/2 in three parts: products of k with the first two are exact.
    const PARTS: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
    let [first, second, third] = splat_all(PARTS);
    let k = rounded(x * T::splat(FRAC_2_PI));
    let a = x - k * first;
    let b = k * second;
    let r = a - b;
    let c = k * third - ((a - r) - b);
    let y = r - c;
    let (sine, cosine) = (sine_near_zero(y, (r - y) - c), cosine_near_zero(y, (r - y) - c));

    // k modulo 4 as -2, -1, 0, 1 or 2: odd quadrants exchange sine and cosine, half of the
    // quadrants change a sign.
    let quarter = k - rounded(k * T::splat(0.25)) * T::splat(4.0);
    let (half, one) = (T::splat(0.5), T::one());
    let odd = (quarter.abs() - one).abs();
    let (s, c) = (odd.pick_below(half, cosine, sine), odd.pick_below(half, sine, cosine));
    ((quarter - half).abs().pick_below(one, s, -s), (quarter + half).abs().pick_below(one, c, -c))
}

/// Splats each number over all lanes. `map` of arrays is not inlined over lanes.
#[inline(always)]
fn splat_all<T: Real, const N: usize>(numbers: [f64; N]) -> [T; N] {
    let mut all = [T::zero(); N];
    for (lanes, number) in all.iter_mut().zip(numbers) {
        *lanes = T::splat(number);
    }
    all
}

/// Nearest integer, for `|x| < 2^51`.
#[inline(always)]
fn rounded<T: Real>(x: T) -> T {
    let large = T::splat(6_755_399_441_055_744.0); // 1.5 * 2^52: its last place is 1
    (x + large) - large
}

/// Sine of `x + tail`, `|x| <= π/4`.
#[inline(always)]
fn sine_near_zero<T: Real>(x: T, tail: T) -> T {
    const S: [f64; 6] = [
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
    ];
    let [s1, s2, s3, s4, s5, s6] = splat_all(S);
    let z = x * x;
    let r = s2 + z * (s3 + z * s4) + z * (z * z) * (s5 + z * s6);
    let v = z * x;
    x - ((z * (tail * T::splat(0.5) - v * r) - tail) - v * s1)
}

/// Cosine of `x + tail`, `|x| <= π/4`.
#[inline(always)]
fn cosine_near_zero<T: Real>(x: T, tail: T) -> T {
    const C: [f64; 6] = [
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    let [c1, c2, c3, c4, c5, c6] = splat_all(C);
    let z = x * x;
    let r = z * (c1 + z * (c2 + z * c3)) + (z * z) * (z * z) * (c4 + z * (c5 + z * c6));
    let half = z * T::splat(0.5);
    let w = T::one() - half;
    w + (((T::one() - w) - half) + (z * r - x * tail))
}

impl Real for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn lane(self, _k: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn set_lane(&mut self, _k: usize, x: f64) {
        *self = x;
    }

    #[inline(always)]
    fn flat(all: &[Self]) -> &[f64] {
        all
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from[0]
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self;
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn all_below(self, bound: f64) -> bool {
        self < bound
    }

    #[inline(always)]
    fn any_below(self, bound: f64) -> bool {
        self < bound
    }

    #[inline(always)]
    fn pick_below(self, bound: Self, yes: Self, no: Self) -> Self {
        if self < bound { yes } else { no }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of units in the last place between two numbers of the same sign.
    fn places(a: f64, b: f64) -> u64 {
        a.to_bits().abs_diff(b.to_bits())
    }

    /// Truth: the system's functions, accurate to half a unit or slightly more; measured 1 unit.
    #[test]
    fn sine_and_cosine_are_within_a_unit_of_the_last_place() {
        let quarters = (-4000..4000).map(|k| f64::from(k) * 0.25 * std::f64::consts::PI);
        let small = (0..300).map(|k| 0.5f64.powi(k));
        let spread = (0..200_000).map(|k| f64::from(k) * 0.618_033_988_749 - 6e4);
        let far = (0..20_000).map(|k| 1.49e6 - f64::from(k) * 7.7);
        for x in quarters.chain(small).chain(spread).chain(far) {
            let (sine, cosine) = Real::sin_cos(x);
            let (s, c) = f64::sin_cos(x);
            assert!(places(sine, s) <= 1, "sin {x}: {sine} against {s}");
            assert!(places(cosine, c) <= 1, "cos {x}: {cosine} against {c}");
        }
    }

    #[test]
    fn without_the_quarters_an_angle_near_zero_has_the_same_bits() {
        let angles = (0..10_000).map(|k| NEAR_ZERO * f64::from(k) / 10_000.0);
        for x in angles.chain((0..1100).map(|k| 0.5f64.powi(k))).filter(|x| *x < NEAR_ZERO).flat_map(|x| [x, -x]) {
            let ((sine, cosine), (s, c)) = (Real::sin_cos(x), sine_and_cosine(x));
            assert_eq!([sine.to_bits(), cosine.to_bits()], [s.to_bits(), c.to_bits()], "{x}");
        }
    }

    #[test]
    fn beyond_a_quarter_of_a_million_turns_the_system_is_asked() {
        assert_eq!(Real::sin_cos(1e22), f64::sin_cos(1e22));
        assert!(Real::sin_cos(f64::NAN).0.is_nan() && Real::sin_cos(f64::INFINITY).1.is_nan());
        assert_eq!(Real::sin_cos(-0.0), (-0.0, 1.0));
    }

    #[test]
    fn a_formula_is_chosen_by_the_number() {
        let choose = |x: f64| x.branch_below(1.0, || [1.0, 2.0], || [3.0, 4.0]);
        assert_eq!(choose(0.5), [1.0, 2.0]);
        assert_eq!(choose(1.0), [3.0, 4.0]);
        assert_eq!(choose(f64::NAN), [3.0, 4.0]);
    }
}
