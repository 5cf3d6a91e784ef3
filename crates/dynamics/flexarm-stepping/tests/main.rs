//! The tests of the crate, as one program: it links once.
#![allow(clippy::expect_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

use flexarm_testkit::allocations::CountingAllocator;

mod balancers;
mod chains;
mod dense;
mod draw;
mod drive_laws;
mod drives;
mod eigenvalues;
mod elimination;
mod event_queue;
mod events;
mod exact_run;
mod gear_laws;
mod gears;
mod guide_law;
mod guides;
mod helical;
mod linear;
mod loops;
mod modal_links;
mod observed_run;
mod oscillators;
mod period_error;
mod poses;
mod reference_arm;
mod reference_stepper;
mod registry;
mod rotation;
mod sdirk3;
mod solver_work;
mod spook_elimination;
mod static_targets;
mod statics;
mod tree_inverse;

/// Counts the allocations of each thread, and so of each test.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
