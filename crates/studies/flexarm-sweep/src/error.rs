//! What keeps a study from being run, planned or merged.

use flexarm_run::ExternalError;
use std::path::PathBuf;

use flexarm_settings::{Fault, Setting};

/// A study that cannot be run, planned or merged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A run that cannot be made ready.
    #[error("{0}")]
    Run(String),
    /// A run without a motion.
    #[error("there is no motion: neither the study nor the robot file (default_trajectory) names one")]
    NoMotion,
    /// A folder with results of another study.
    #[error(
        "{} holds results of another study ({differs}): choose another folder with {} or replace them with {}",
        folder.display(), Setting::Output, Setting::Overwrite
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// What differs.
        differs: String,
    },
    /// A folder to be merged that is of another study than the first.
    #[error("{} is no shard of the study in {}: {differs} differs; leave it out, or run it again with the same files", folder.display(), first.display())]
    ForeignShard {
        /// The folder.
        folder: PathBuf,
        /// The first folder.
        first: PathBuf,
        /// What differs.
        differs: String,
    },
    /// A folder without a study.
    #[error("{} holds no study: there is no study.json in it; give the folder that a run of the study wrote into", folder.display())]
    NoStudy {
        /// The folder.
        folder: PathBuf,
    },
    /// A file of a study's folder that is not as it was written.
    #[error("{}: {what}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        what: String,
    },
    /// Another process works on the same shard.
    #[error("{}: another process is running this shard: wait for it or stop it", path.display())]
    Running {
        /// Its journal.
        path: PathBuf,
    },
    /// A shard that there is not.
    #[error("shard {number} of {of}: expected a number from 1 to {of}, and at most {runs} shards, one for each run")]
    Shard {
        /// Its number.
        number: usize,
        /// Of so many.
        of: usize,
        /// Runs of the study.
        runs: usize,
    },
    /// Runs that no shard has.
    #[error("{missing} of {runs} runs are missing: {which}{}", hint(*shards))]
    Missing {
        /// How many.
        missing: usize,
        /// Of so many.
        runs: usize,
        /// Which.
        which: String,
        /// Into how many shards the others were cut.
        shards: Option<usize>,
    },
    /// A run that two shards have with different results.
    #[error("run {run} is there twice with different results, in {} and {}: one of them was made by another program or of other files", first.display(), second.display())]
    Twice {
        /// The run.
        run: usize,
        /// A file with it.
        first: PathBuf,
        /// The other one.
        second: PathBuf,
    },
    /// The user stopped it.
    #[error("stopped after {done} of {runs} runs; they are kept in {}, the same command goes on from there", folder.display())]
    Stopped {
        /// Runs that are done.
        done: usize,
        /// Of so many.
        runs: usize,
        /// Where they are.
        folder: PathBuf,
    },
    /// A search without room.
    #[error("{what}")]
    Minimise {
        /// What is missing.
        what: String,
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
