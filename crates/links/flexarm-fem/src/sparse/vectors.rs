//! Loops over the rows of blocks with the vector instructions of the processor. Operations and
//! their order are the same without vector instructions.

use flexarm_spatial::Real;

use super::block::{Row, WIDTH};

/// Loop over rows, to be inlined completely.
pub(crate) trait Work {
    /// Result of the work.
    type Output;

    /// Runs the work with `P` vectors per row; mark it and its callees `#[inline(always)]`.
    fn run<T: Real, const P: usize>(self) -> Self::Output;
}

/// Runs the work with the widest available vectors.
pub(crate) fn quickly<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if flexarm_spatial::lanes::most_lanes() > 1 {
        use flexarm_spatial::lanes::{OverLanes, with_four_lanes};

        struct InLanes<W>(W);
        impl<W: Work> OverLanes for InLanes<W> {
            type Output = W::Output;

            #[inline(always)]
            fn run<T: Real>(self) -> W::Output {
                const { assert!(2 * T::LANES == WIDTH, "two vectors are a row") };
                self.0.run::<T, 2>()
            }
        }
        return with_four_lanes(InLanes(work)).unwrap_or_else(|| unreachable!("a processor with lanes has four"));
    }
    work.run::<f64, WIDTH>()
}

/// One row in vector registers.
#[derive(Clone, Copy)]
pub(crate) struct Wide<T, const P: usize>([T; P]);

impl<T: Real, const P: usize> Wide<T, P> {
    /// Row of zeros.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self([T::splat(0.0); P])
    }

    /// Loads a row.
    #[inline(always)]
    pub(crate) fn load(row: &Row) -> Self {
        let mut wide = Self::zero();
        for p in 0..P {
            wide.0[p] = T::load(&row.0[p * T::LANES..][..T::LANES]);
        }
        wide
    }

    /// Stores to a row.
    #[inline(always)]
    pub(crate) fn store(self, row: &mut Row) {
        for p in 0..P {
            self.0[p].store(&mut row.0[p * T::LANES..][..T::LANES]);
        }
    }

    /// Computes `self += factor other`.
    #[inline(always)]
    pub(crate) fn add(&mut self, factor: f64, other: Self) {
        let factor = T::splat(factor);
        for p in 0..P {
            self.0[p] += factor * other.0[p];
        }
    }

    /// Computes `self -= factor other`.
    #[inline(always)]
    pub(crate) fn subtract(&mut self, factor: f64, other: Self) {
        let factor = T::splat(factor);
        for p in 0..P {
            self.0[p] -= factor * other.0[p];
        }
    }
}
