//! Errors of crates that build on this one.

use std::error::Error as _;

use flexarm_run::{Error, ExternalError, Fault};

#[derive(Debug, thiserror::Error)]
#[error("no depth")]
struct OfAStudy(#[source] std::fmt::Error);

impl ExternalError for OfAStudy {
    fn fault(&self) -> Fault {
        Fault::Run
    }
}

#[test]
fn an_error_of_a_study_keeps_its_text_its_cause_and_its_fault() {
    let error = Error::External(Box::new(OfAStudy(std::fmt::Error)));
    assert_eq!((error.to_string(), error.fault()), ("no depth".into(), Fault::Run));
    assert_eq!(error.source().map(ToString::to_string), Some(std::fmt::Error.to_string()));
    assert!(error.external::<OfAStudy>().is_some());
    assert!(Error::nothing_yields().external::<OfAStudy>().is_none());
}
