//! Clearing of vector registers after faer's kernels.
//!
//! Its assembly kernels leave the upper halves of the registers in use. The processor then
//! preserves them in every instruction that uses only the lower halves, which is most of this
//! program, at a third of the speed, until they are cleared.

/// Empty work over lanes, which ends like all such functions with the upper halves cleared.
#[cfg(target_arch = "x86_64")]
struct Clear;

#[cfg(target_arch = "x86_64")]
impl flexarm_spatial::lanes::OverLanes for Clear {
    type Output = bool;

    #[inline(always)]
    fn run<T: flexarm_spatial::Real>(self) -> bool {
        // Different numbers, so that the upper halves are needed.
        let mut x = T::splat(std::hint::black_box(1.0));
        x.set_lane(T::LANES - 1, std::hint::black_box(2.0));
        (x + x).all_below(5.0)
    }
}

/// Clears the upper halves; call it on a thread after faer has run there.
#[inline(never)]
pub(super) fn clear_upper_halves() {
    #[cfg(target_arch = "x86_64")]
    std::hint::black_box(flexarm_spatial::lanes::with_four_lanes(Clear));
}
