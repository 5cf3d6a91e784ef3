//! The tests of the crate, as one program: it links once.
#![allow(clippy::expect_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

use flexarm_testkit::allocations::CountingAllocator;

mod balancers;
mod chains;
mod drives;
mod elimination;
mod events;
mod exact_run;
mod gears;
mod guides;
mod helical;
mod linear;
mod loops;
mod modal_links;
mod observed_run;
mod oscillators;
mod poses;
mod reference_arm;
mod reference_stepper;
mod rotation;
mod solver_work;
mod static_targets;
mod statics;

/// Counts the allocations of each thread, and so of each test.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
