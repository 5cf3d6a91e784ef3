//! The case studies: each method against each truth, from shipped files, as tables, figures and claims with bounds.
//!
//! [`verify`] runs them, [`Verification::page`] makes the page `docs/verification.md`. A case is a module with one function
//! that takes a [`Bench`] and returns a [`page::Case`]; a new one gets a line in `CASES`. What other programs computed is
//! stored in `tests/verification`, with the script that writes it.
//!
//! Not here: methods. Everything is done through the public faces of the other crates, and closed forms are written down
//! again in [`textbook`], apart from the code that they judge.
#![allow(non_snake_case, reason = "monogram notation: X_WF, EI_y, C; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

pub mod bench;
pub mod check;
mod files;
mod lower_arm;
mod manipulator;
mod meshed;
mod one_beam;
pub mod page;
mod programs;
pub mod textbook;
mod three_beams;

use std::ops::ControlFlow;

use flexarm::Error;

use bench::Bench;
use page::Case;

pub use files::{PAGE, VerificationFiles};

/// A case study: name, what it is, how it is run.
type Entry = (&'static str, fn(&Bench) -> Result<Case, Error>);

/// The cases, in the order of the page.
const CASES: [Entry; 5] = [
    ("one-beam", one_beam::case),
    ("three-beams", three_beams::case),
    ("lower-arm", lower_arm::case),
    ("manipulator", manipulator::case),
    ("programs", programs::case),
];

/// Names of the cases.
pub fn case_names() -> Vec<&'static str> {
    CASES.iter().map(|(name, _)| *name).collect()
}

/// What came out.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Verification {
    /// The cases.
    pub cases: Vec<Case>,
    /// Whether every claim holds.
    pub passed: bool,
}

/// Runs cases, all if none is named.
///
/// * `progress`: called before each case with its name, number and the number of cases; breaking off ends the run.
///
/// # Errors
/// [`Error::Usage`] for an unknown name, [`Error::File`] where files of the checkout are missing, and what the steps of a case
/// may end with.
pub fn verify(
    bench: &Bench,
    names: &[String],
    progress: &mut dyn FnMut(&str, usize, usize) -> ControlFlow<()>,
) -> Result<Verification, Error> {
    if let Some(unknown) = names.iter().find(|name| !case_names().contains(&name.as_str())) {
        let known = case_names().join(", ");
        return Err(Error::Usage(format!("there is no case {unknown:?}; the cases are {known}")));
    }
    let wanted: Vec<&Entry> =
        CASES.iter().filter(|(name, _)| names.is_empty() || names.iter().any(|n| n == name)).collect();
    let mut cases = Vec::new();
    for (k, (name, run)) in wanted.iter().enumerate() {
        if progress(name, k, wanted.len()).is_break() {
            return Err(Error::Interrupted { t: 0.0, partial: false });
        }
        cases.push(run(bench)?);
    }
    let passed = cases.iter().flat_map(Case::claims).all(|claim| claim.holds);
    Ok(Verification { cases, passed })
}
