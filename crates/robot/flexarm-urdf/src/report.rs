//! Collects the findings of the checks, so that all faults are reported together.

use crate::error::{Issue, Problem};
use crate::finding::{Finding, Severity, TextPosition};

/// Faults, warnings and notes about one file.
#[derive(Default)]
pub struct Report {
    /// Errors.
    pub issues: Vec<Issue>,
    /// Warnings and notes, with the line for sorting.
    remarks: Vec<(u32, Finding)>,
}

impl Report {
    pub(crate) fn error(&mut self, place: &TextPosition, problem: Problem) {
        self.issues.push(Issue { place: place.clone(), problem });
    }

    pub(crate) fn warning(
        &mut self,
        place: &TextPosition,
        code: &'static str,
        message: String,
        help: impl Into<String>,
    ) {
        self.remark(Severity::Warning, place, code, message, help.into());
    }

    pub(crate) fn note(&mut self, place: &TextPosition, code: &'static str, message: String, help: impl Into<String>) {
        self.remark(Severity::Note, place, code, message, help.into());
    }

    fn remark(&mut self, severity: Severity, place: &TextPosition, code: &'static str, message: String, help: String) {
        let location = format!("{}:{}", place.file.display(), place.line);
        self.remarks.push((place.line, Finding { severity, code, location, message, help }));
    }

    /// Adds earlier findings.
    pub(crate) fn take(&mut self, findings: Vec<Finding>) {
        let line = |f: &Finding| f.location.rsplit(':').next().and_then(|l| l.parse().ok()).unwrap_or(0);
        self.remarks.extend(findings.into_iter().map(|finding| (line(&finding), finding)));
    }

    /// Warnings and notes in the order of the file.
    pub(crate) fn remarks(&self) -> Vec<Finding> {
        let mut sorted: Vec<_> = self.remarks.iter().collect();
        sorted.sort_by_key(|(line, _)| *line);
        sorted.into_iter().map(|(_, finding)| finding.clone()).collect()
    }

    /// The errors in the order of the file.
    pub(crate) fn sorted_issues(&self) -> Vec<Issue> {
        let mut issues = self.issues.clone();
        issues.sort_by_key(|issue| (issue.place.line, issue.place.column));
        issues
    }
}
