//! A run of the page.

use flexarm_log::Trace;

use super::number::number;
use crate::run::summary::Summary;

/// Run shown in a report.
#[derive(Clone, Copy, Debug)]
pub struct ReportRun<'a> {
    /// Name of the run, used if there are several.
    pub label: &'a str,
    /// Figures of the run.
    pub summary: &'a Summary,
    /// Curves of the run.
    pub trace: &'a Trace,
}

/// Describes stepper and step size, as far as known.
pub(super) fn method(s: &Summary, before: &str) -> Option<String> {
    let step = (s.stepper.h_s > 0.0).then(|| format!("{before}{} ms", number(1e3 * s.stepper.h_s, 4)));
    let name = Some(s.stepper.name.clone()).filter(|name| !name.is_empty());
    let known: Vec<String> = name.into_iter().chain(step).collect();
    (!known.is_empty()).then(|| known.join(", "))
}
