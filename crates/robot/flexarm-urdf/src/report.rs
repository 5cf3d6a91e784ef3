//! Collects the findings of the checks, so that all faults are reported together.
//!
//! Start at [`Report`]; findings are in the order of the file. Not here: the checks (`lint`).

use flexarm_settings::{Finding, Place, Severity};

/// Faults, warnings and notes about one file.
#[derive(Default)]
pub struct Report {
    /// Errors.
    pub issues: Vec<Finding>,
    /// Links with an issue that can be waived.
    pub(crate) waivable: Vec<String>,
    /// Warnings and notes.
    remarks: Vec<Finding>,
}

impl Report {
    pub(crate) fn error(&mut self, place: &Place, code: &str, message: impl Into<String>, help: impl Into<String>) {
        self.issues.push(Finding::error(code, place.to_string(), message, help));
    }

    pub(crate) fn warning(&mut self, place: &Place, code: &str, message: impl Into<String>, help: impl Into<String>) {
        self.remarks.push(Finding::warning(code, place.to_string(), message, help));
    }

    pub(crate) fn note(&mut self, place: &Place, code: &str, message: impl Into<String>, help: impl Into<String>) {
        self.remarks.push(Finding::warning(code, place.to_string(), message, help).as_note());
    }

    /// Adds findings of any severity.
    pub(crate) fn take(&mut self, findings: impl IntoIterator<Item = Finding>) {
        for finding in findings {
            let list = if finding.severity == Severity::Error { &mut self.issues } else { &mut self.remarks };
            list.push(finding);
        }
    }

    /// Warnings and notes in the order of the file.
    pub(crate) fn remarks(&self) -> Vec<Finding> {
        let mut remarks = self.remarks.clone();
        remarks.sort_by_key(|remark| position(remark).0);
        remarks
    }

    /// The errors in the order of the file.
    pub(crate) fn sorted_issues(&self) -> Vec<Finding> {
        let mut issues = self.issues.clone();
        issues.sort_by_key(position);
        issues
    }
}

/// Line and column of a finding in a file, from 1; zero where there is none.
pub(crate) fn position(finding: &Finding) -> (u32, u32) {
    let mut numbers = finding.location.rsplit(':').map_while(|part| part.parse().ok());
    let column = numbers.next().unwrap_or(0);
    numbers.next().map_or((column, 0), |line| (line, column))
}

/// Names in quotes, separated by commas.
pub(crate) fn quoted<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
    names.into_iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
}

/// Remedy for a name that does not exist.
pub(crate) fn did_you_mean(closest: Option<String>, otherwise: &str) -> String {
    closest.map_or_else(|| otherwise.into(), |name| format!("did you mean {name:?}?"))
}
