//! A counting allocator: a test that installs it can assert that a loop does not allocate.
//!
//! ```ignore
//! #[global_allocator]
//! static ALLOCATOR: CountingAllocator = CountingAllocator;
//! let allocations = count_allocations(|| step());
//! ```
#![allow(unsafe_code, reason = "GlobalAlloc is an unsafe trait; every call is passed on to the system allocator")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
    /// Bytes held, and the most so far: what one thread takes and another gives back is counted
    /// wrongly.
    static HELD: Cell<isize> = const { Cell::new(0) };
    static MAX: Cell<isize> = const { Cell::new(0) };
}

fn hold(bytes: isize) {
    let _ = HELD.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = MAX.try_with(|most| most.set(most.get().max(held.get())));
    });
}

/// Passes everything to the system allocator and counts per thread.
pub struct CountingAllocator;

// SAFETY: forwards to `System` unchanged.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|c| c.set(c.get() + 1));
        hold(layout.size() as isize);
        // SAFETY: same contract as ours.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        hold(-(layout.size() as isize));
        // SAFETY: same contract as ours.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Number of allocations that `work` makes on this thread (with [`CountingAllocator`] installed).
pub fn count_allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

/// Most bytes that `work` holds at a time on this thread (with [`CountingAllocator`] installed).
pub fn most_bytes(work: impl FnOnce()) -> usize {
    let before = HELD.with(Cell::get);
    MAX.with(|most| most.set(before));
    work();
    (MAX.with(Cell::get) - before).max(0) as usize
}
