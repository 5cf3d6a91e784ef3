//! Errors about a program that the arm cannot run, as findings at its statements.

use flexarm_settings::Finding;

use crate::program::{Item, Move};

/// Code of the finding about a path that leaves the workspace or passes a singular pose.
pub const BLOCKED: &str = "blocked-path";

/// Error about the program as a whole.
pub(crate) fn no_move(name: &str) -> Box<Finding> {
    Box::new(Finding::error("no-move", name, "the program has no move", ""))
}

/// Error about a move.
pub(crate) fn at_move(of: &Move, code: &str, why: impl std::fmt::Display) -> Box<Finding> {
    Box::new(Finding::error(code, of.place.to_string(), format!("{}: {why}", of.statement), ""))
}

/// Error about a number of an item.
pub(crate) fn at_item(item: &Item, why: impl std::fmt::Display) -> Box<Finding> {
    match item {
        Item::Move(of) => at_move(of, "value", why),
        Item::Dwell { place, .. } => Box::new(Finding::error("value", place.to_string(), format!("wait: {why}"), "")),
    }
}
