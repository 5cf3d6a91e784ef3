//! Case studies that compare each method with each truth, from shipped files; the results are
//! tables, figures and claims with bounds.
//!
//! [`verify`] runs them, [`Verification::pages`] makes `docs/verification.md` and a page per case. A case is a
//! module with one function that takes a [`Bench`] and returns a [`page::Case`]; a new case gets a
//! line in `CASES`. Within a case, some files compute findings (plain numbers with names) and
//! others write the text: the numbers in its sentences come from the findings and from constants.
//! Results of other programs are stored in `tests/verification`, with the script that writes them.
//!
//! ```
//! assert!(flexarm_verify::case_names().contains(&"three-beams"));
//! ```
//!
//! Not here: methods. The cases use only the public API of the other crates, and closed forms are
//! written again in `textbook`, independently of the code under test.
#![allow(non_snake_case, reason = "monogram notation: X_WF, EI_y, C; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

pub mod bench;
mod benchmarks;
mod calibrated_arm;
pub mod check;
mod compliance;
mod error;
mod files;
mod lower_arm;
mod manipulator;
mod measured;
mod measured_arm;
mod meshed;
mod one_beam;
pub mod page;
mod programs;
mod textbook;
mod three_beams;

use bench::Bench;
use page::Case;

pub use error::Error;
pub use files::{VerificationFiles, differences_from};

/// A case study: name, relative run time, and the function that runs it.
type Entry = (&'static str, f64, fn(&Bench, &mut Pace<'_>) -> Result<Case, Error>);

/// The cases, in the order of the page.
const CASES: [Entry; 9] = [
    ("one-beam", 1.0, one_beam::case),
    ("three-beams", 5.0, three_beams::case),
    ("lower-arm", 5.0, lower_arm::case),
    ("manipulator", 45.0, manipulator::case),
    ("programs", 3.0, programs::case),
    ("measured", 3.0, measured::case),
    ("benchmarks", 8.0, benchmarks::case),
    ("measured-arm", 0.1, measured_arm::case),
    ("calibrated-arm", 0.5, calibrated_arm::case),
];

/// Names of the cases.
pub fn case_names() -> Vec<&'static str> {
    CASES.iter().map(|(name, ..)| *name).collect()
}

/// Result of the case studies.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Verification {
    /// The cases.
    pub cases: Vec<Case>,
    /// Whether every claim holds.
    pub passed: bool,
    /// Whether slow parts were left out.
    pub quick: bool,
}

/// Callback that receives the completed share, 0 to 1, and the name of the current case.
pub type Progress<'a> = dyn FnMut(f64, &str) + 'a;

/// Progress of a case.
pub(crate) struct Pace<'a> {
    name: &'static str,
    /// Share of the whole run completed before this case, and the share of the case itself.
    begin: f64,
    own: f64,
    progress: &'a mut Progress<'a>,
}

impl Pace<'_> {
    /// Reports the completed share of the case, 0 to 1.
    pub(crate) fn at(&mut self, share: f64) {
        (self.progress)(self.begin + self.own * share, self.name);
    }
}

/// Runs the named cases, or all if none is named.
///
/// # Errors
/// [`Error::Case`] for an unknown name, [`flexarm::Error::File`] if files of the checkout are
/// missing, and the errors of the individual cases.
pub fn verify(bench: &Bench, names: &[String], progress: &mut Progress<'_>) -> Result<Verification, Error> {
    if let Some(unknown) = names.iter().find(|name| !case_names().contains(&name.as_str())) {
        let known = case_names().join(", ");
        return Err(Error::Case(format!("there is no case {unknown:?}; the cases are {known}")));
    }
    let wanted: Vec<&Entry> =
        CASES.iter().filter(|(name, ..)| names.is_empty() || names.iter().any(|n| n == name)).collect();
    let all: f64 = wanted.iter().map(|(_, weight, _)| weight).sum();
    let (mut cases, mut done) = (Vec::new(), 0.0);
    for (name, weight, run) in wanted {
        let mut tell = |share: f64, name: &str| progress(share, name);
        let mut pace = Pace { name, begin: done / all, own: weight / all, progress: &mut tell };
        pace.at(0.0);
        cases.push(run(bench, &mut pace)?);
        done += weight;
    }
    let passed = cases.iter().flat_map(Case::claims).all(|claim| claim.holds);
    Ok(Verification { cases, passed, quick: bench.quick })
}
