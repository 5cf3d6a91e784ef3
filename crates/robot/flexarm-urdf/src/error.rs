//! Errors of robot descriptions.
//!
//! Faults of the content are findings with a place; all are reported together. Not here: their texts
//! (the checks).

use std::path::PathBuf;

use flexarm_settings::Finding;

/// Error of reading a robot description.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}\n  help: {}", path.display(), help(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// The file has faults. All of them are listed, in the order of the file; of an expansion of
    /// xacro, only the first.
    #[error("{}", issues.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Invalid {
        /// At least one.
        issues: Vec<Finding>,
        /// Links with an issue that [`ReadOptions::waive`](crate::ReadOptions::waive) permits.
        waivable: Vec<String>,
    },
}

impl From<Box<Finding>> for UrdfError {
    fn from(issue: Box<Finding>) -> Self {
        Self::Invalid { issues: vec![*issue], waivable: Vec::new() }
    }
}

impl UrdfError {
    /// The faults in the file; empty if it could not be read.
    pub fn issues(&self) -> &[Finding] {
        match self {
            Self::Invalid { issues, .. } => issues,
            Self::Io { .. } => &[],
        }
    }

    /// The errors as findings, for a report.
    pub fn into_findings(self) -> Vec<Finding> {
        match self {
            Self::Invalid { issues, .. } => issues,
            Self::Io { path, source } => {
                let message = format!("the file cannot be read: {source}");
                vec![Finding::error("unreadable", path.display().to_string(), message, help(&source))]
            }
        }
    }
}

fn help(error: &std::io::Error) -> &'static str {
    match error.kind() {
        std::io::ErrorKind::NotFound => "correct the path",
        std::io::ErrorKind::PermissionDenied => "check the permissions",
        _ => "give a URDF or xacro file",
    }
}
