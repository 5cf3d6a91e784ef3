//! The tests of the crate, as one program: it links once.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation: X_WT, pose of T in W")]

use flexarm_testkit::allocations::CountingAllocator;

#[cfg(feature = "mcap")]
mod bent;
mod csv;
mod damaged;
#[cfg(feature = "parquet")]
mod data_table;
mod files;
mod formats;
mod magnify;
#[cfg(feature = "mcap")]
mod markers;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "mcap")]
mod rates;
mod read;
mod recorder_set;
mod synthetic;
mod trace;

/// Counts the allocations of each thread, and so of each test.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
