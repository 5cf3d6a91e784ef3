//! Models that several crates' tests and benches share: random trees, the reference arm, an arm of
//! chains, one with a closed loop.
//!
//! Truth lives in the tests; here are only inputs. Everything is deterministic for given arguments.
#![allow(non_snake_case, reason = "monogram notation, as in the crates under test")]

pub mod allocations;
mod chain_arm;
mod palletiser;
mod random_tree;
mod reference_arm;

pub use chain_arm::{ChainArm, chain_arm};
pub use palletiser::{PalletisingArm, palletising_arm};
pub use random_tree::{Cloud, Draw, random_flexible_tree, random_state, random_tree};
pub use reference_arm::{ReferenceArm, arm_of_parts, follow_reference_motion, reference_arm, reference_motion};
