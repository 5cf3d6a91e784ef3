//! An assumption about a robot.

use serde::Serialize;

/// An assumption.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumption {
    /// Subject: a joint, a link, the payload.
    pub about: String,
    /// The assumption made.
    pub text: String,
    /// Way to replace it by a fact.
    pub mend: String,
}

pub(crate) fn assumption(about: &str, text: String, mend: &str) -> Assumption {
    Assumption { about: about.to_owned(), text, mend: mend.to_owned() }
}
