//! Caveats about robots and runs as values: probable errors in an input, and limits of a result's
//! validity.
//!
//! Every command that uses a robot reports the same caveats about it ([`Arm::caveats`](crate::Arm::caveats)); runs and statics
//! add their own. Each message is built in one place ([`FindingKind::found`]). Start at `kinds`, the
//! catalogue; `docs/caveats.md` lists it with the source of each threshold.
//!
//! Not here: inputs that make a model impossible, which are an [`crate::Error`].

pub(crate) mod balancers;
pub(crate) mod chain;
pub(crate) mod drives;
pub(crate) mod entries;
pub(crate) mod kinds;
mod kinds_of_entries;
mod kinds_of_use;
pub(crate) mod links;
pub(crate) mod loads;
pub(crate) mod loops;
pub(crate) mod lumping;
pub mod motion;
pub mod of_use;
pub(crate) mod parts;
pub(crate) mod pose;
pub mod size;
pub mod slip;
pub(crate) mod stiffness;
pub mod validity;

pub use flexarm_settings::finding::{Finding, Severity};
pub use flexarm_settings::finding::{FindingKind, once_each, warnings};
pub use kinds_of_entries::UNUSUAL;
pub use of_use::Use;
