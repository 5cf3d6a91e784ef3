//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::print_stdout, reason = "measured errors beside their bounds")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "the letters of the matrices")]

use flexarm_testkit::allocations::CountingAllocator;

mod arms;
mod arrays;
mod balancers;
mod batch;
mod beam_stress;
mod caveats;
mod caveats_everywhere;
mod caveats_of_entries;
mod compensate;
mod compensate_variants;
mod controller_axes;
mod errors;
mod figures;
mod gears;
mod headline;
mod helical;
mod identify;
mod identify_coupled_encoders;
mod identify_encoders;
mod identify_entries;
mod identify_files;
mod identify_levers;
mod identify_response;
mod large_deflection;
mod library;
mod link_bodies;
mod lobes;
mod loops;
mod map;
mod mesh_mutations;
mod model_limits;
mod mounting;
mod new_robot;
mod no_allocation;
mod program_round_trip;
mod ranges;
#[cfg(feature = "mcap")]
mod recording_files;
mod report;
mod robot_export;
mod robot_file_docs;
mod run_says;
mod sensitivity;
mod stress;
#[cfg(feature = "parquet")]
mod sweep;
mod swung_stress;
mod telescope;
mod third_interface;
mod tool_path;

/// Counts the allocations of each thread, and so of each test.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
