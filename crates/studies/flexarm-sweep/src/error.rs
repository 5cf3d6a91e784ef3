//! Errors of studies.
//!
//! `SweepError::Run` has messages of single runs; everything about folders and shards has its
//! variant.

use flexarm_run::ExternalError;
use std::path::PathBuf;

use flexarm_settings::{Fault, Place, Setting};

/// Reason why a study cannot be run, planned or merged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A run cannot be prepared.
    #[error("{0}")]
    Run(String),
    /// A run has no motion.
    #[error("there is no motion: neither the study nor the robot file (default_trajectory) names one")]
    NoMotion,
    /// The folder contains results of another study.
    #[error(
        "{} holds results of another study ({differs}): choose another folder with {} or replace them with {}",
        folder.display(), Setting::Output, Setting::Overwrite
    )]
    Foreign {
        /// Folder.
        folder: PathBuf,
        /// Differences between the studies.
        differs: String,
    },
    /// A folder to be merged belongs to another study than the first.
    #[error(
        "{} is not a shard of the study in {}: {differs} differs; leave it out, or run it again with the same files",
        folder.display(), first.display()
    )]
    ForeignShard {
        /// Folder.
        folder: PathBuf,
        /// First folder.
        first: PathBuf,
        /// Differences between the studies.
        differs: String,
    },
    /// The folder contains no study.
    #[error("{} contains no study.json: give the output folder of a study", folder.display())]
    NoStudy {
        /// Folder.
        folder: PathBuf,
    },
    /// A file in the folder of a study is damaged.
    #[error("{place}: {what}")]
    Broken {
        /// The file, and the line of a journal.
        place: Place,
        /// Description of the damage and advice.
        what: String,
    },
    /// Another process works on the same shard.
    #[error("{}: another process is running this shard: wait for it or stop it", path.display())]
    Running {
        /// Path of the journal.
        path: PathBuf,
    },
    /// The shard does not exist.
    #[error("shard {number} of {of}: expected a number from 1 to {of}, and at most {runs} shards, one for each run")]
    Shard {
        /// Number of the shard.
        number: usize,
        /// Number of shards.
        of: usize,
        /// Number of runs of the study.
        runs: usize,
    },
    /// No shard contains some of the runs.
    #[error("{missing} of {runs} runs are missing: {which}{}", hint(*shards))]
    Missing {
        /// Number of missing runs.
        missing: usize,
        /// Number of runs of the study.
        runs: usize,
        /// Description of the missing runs.
        which: String,
        /// Number of shards of the other runs.
        shards: Option<usize>,
    },
    /// Two shards contain a run with different results.
    #[error(
        "run {run} has different results in {} and {}: one of them is from another version of the program or from \
         other files",
        first.display(), second.display()
    )]
    Twice {
        /// Number of the run.
        run: usize,
        /// File with the run.
        first: PathBuf,
        /// Other file with the run.
        second: PathBuf,
    },
    /// The user stopped the study.
    #[error(
        "stopped after {done} of {runs} runs; they are stored in {}, and the same command continues from there",
        folder.display()
    )]
    Stopped {
        /// Number of finished runs.
        done: usize,
        /// Number of all runs.
        runs: usize,
        /// Folder of the results.
        folder: PathBuf,
    },
}

impl From<SweepError> for flexarm_run::Error {
    fn from(error: SweepError) -> Self {
        Self::External(Box::new(error))
    }
}

impl ExternalError for SweepError {
    fn fault(&self) -> Fault {
        match self {
            Self::Stopped { .. } | Self::Missing { .. } | Self::Running { .. } => Fault::Run,
            _ => Fault::Input,
        }
    }
}

fn hint(shards: Option<usize>) -> String {
    shards.map_or_else(String::new, |_| "; run them, or give their folders as well".into())
}
