//! Loops over whole columns, with the vector instructions that the processor has. Operations and their order are the same with and without.

/// Loops over slices, inlined down to them.
pub(super) trait Work {
    /// Does it.
    fn run(self);
}

/// Does the work.
#[cfg(target_arch = "x86_64")]
pub(super) fn quickly(work: impl Work) {
    use flexarm_kinematics::{OverLanes, Real, with_lanes};

    /// Lanes are the compiler's here.
    struct Compiled<'a, W>(&'a mut Option<W>);
    impl<W: Work> OverLanes for Compiled<'_, W> {
        type Output = ();

        #[inline(always)]
        fn run<T: Real>(self) {
            if let Some(work) = self.0.take() {
                work.run();
            }
        }
    }
    let mut work = Some(work);
    with_lanes(Compiled(&mut work));
    if let Some(work) = work {
        work.run();
    }
}

/// Does the work.
#[cfg(not(target_arch = "x86_64"))]
pub(super) fn quickly(work: impl Work) {
    work.run();
}
