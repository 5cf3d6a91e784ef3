//! The tests of the crate, as one program: it links once.
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]
#![allow(clippy::print_stdout, reason = "measured errors beside their bounds")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(non_snake_case, reason = "monogram notation")]

use flexarm_testkit::allocations::CountingAllocator;

mod arms;
mod arrays;
mod balancers;
mod batch;
mod beam_stress;
mod caveat_words;
mod caveats;
mod caveats_of_entries;
mod controller_axes;
mod errors;
mod figures;
mod gear_laws;
mod gears;
mod guides;
mod headline;
mod helical;
mod large_deflection;
mod link_bodies;
mod load_jumps;
mod loads_and_limits;
mod loops;
mod magnification;
mod model_limits;
mod monitors;
mod motion_places;
mod mounting;
mod no_allocation;
mod program_round_trip;
mod ranges;
#[cfg(feature = "mcap")]
mod recording_files;
mod recordings;
mod report;
mod report_page;
mod robot_export;
mod robot_file_docs;
mod run_says;
mod settling;
mod small_robots;
mod standard_motions;
mod stepper_settings;
mod stress;
mod swung_stress;
mod telescope;
mod third_interface;
mod tool_path;

/// Counts the allocations of each thread, and so of each test.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
