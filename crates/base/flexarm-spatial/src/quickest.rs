//! Recursions over any [`Space`], in the quickest one of the processor: vectors packed into registers, or numbers. Both have the same bits.

#[cfg(target_arch = "x86_64")]
use crate::packed::PackedRoom;
use crate::space::{Plain, Space};

/// What a recursion keeps between two calls, over any space.
pub trait Kept {
    /// It.
    type Of<S: Space<Real = f64>>: Send;
}

/// How what is kept is made. What it calls is inlined, down to the instructions: mark it `#[inline(always)]`.
pub trait Make<K: Kept>: Copy {
    /// Makes it, if it can be.
    fn make<S: Space<Real = f64>>(self) -> Option<K::Of<S>>;
}

/// Work with what is kept. What it calls is inlined, down to the instructions: mark it `#[inline(always)]`.
pub trait Work<K: Kept> {
    /// What it finds.
    type Output;

    /// Does it.
    fn run<S: Space<Real = f64>>(self, kept: &mut K::Of<S>) -> Self::Output;
}

/// What a recursion keeps, in the quickest space.
pub struct Quickest<K: Kept>(Way<K>);

enum Way<K: Kept> {
    /// Over numbers.
    Plain(Box<K::Of<Plain<f64>>>),
    /// In registers.
    #[cfg(target_arch = "x86_64")]
    Packed(PackedRoom<K>),
}

impl<K: Kept> Quickest<K> {
    /// `None` where nothing is made.
    pub fn new(make: impl Make<K>) -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        if let Some(room) = PackedRoom::new(make) {
            return Some(Self(Way::Packed(room)));
        }
        Self::plain(make)
    }

    /// Over numbers, whatever the processor has.
    pub fn plain(make: impl Make<K>) -> Option<Self> {
        Some(Self(Way::Plain(Box::new(make.make()?))))
    }

    /// Does the work.
    #[inline]
    pub fn run<W: Work<K>>(&mut self, work: W) -> W::Output {
        match &mut self.0 {
            Way::Plain(kept) => work.run::<Plain<f64>>(kept),
            #[cfg(target_arch = "x86_64")]
            Way::Packed(room) => room.run(work),
        }
    }
}
