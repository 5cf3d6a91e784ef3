//! Vector registers after faer's kernels.
//!
//! Its kernels in assembly leave the upper halves of the registers in use. The processor then keeps
//! them through every instruction that works on the lower halves alone, which is most of this
//! program, at a third of its speed, until they are cleared.

/// Work that ends as every function over lanes does: with all upper halves cleared.
#[cfg(target_arch = "x86_64")]
struct Clear;

#[cfg(target_arch = "x86_64")]
impl flexarm_spatial::lanes::OverLanes for Clear {
    type Output = bool;

    #[inline(always)]
    fn run<T: flexarm_spatial::Real>(self) -> bool {
        // Numbers that differ, so that the upper halves are needed.
        let mut x = T::splat(std::hint::black_box(1.0));
        x.set_lane(T::LANES - 1, std::hint::black_box(2.0));
        (x + x).all_below(5.0)
    }
}

/// To be called on a thread when faer has worked there.
#[inline(never)]
pub(super) fn clear_upper_halves() {
    #[cfg(target_arch = "x86_64")]
    std::hint::black_box(flexarm_spatial::lanes::with_four_lanes(Clear));
}
