//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

use flexarm_testkit::allocations::CountingAllocator;

mod analytic_ik;
mod arms;
mod balancer_laws;
mod balancers;
mod helical;
mod identities;
mod loops;
mod singular_mass;
mod trig;

/// Counts the allocations of each thread, and so of each test.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
