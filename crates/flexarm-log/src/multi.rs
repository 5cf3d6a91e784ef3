//! Several recordings of one run.

use std::path::Path;

use crate::{LogError, Recorder, RunHeader, RunResult, Sample};

/// Recorders that get the same header, samples and result.
///
/// One that fails does not keep the others from their data: all are called, then the first error is returned.
/// Each error names its file.
#[derive(Default)]
pub struct RecorderSet {
    recorders: Vec<Box<dyn Recorder>>,
}

impl RecorderSet {
    /// An empty set: every call succeeds and writes nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a recorder.
    pub fn push(&mut self, recorder: Box<dyn Recorder>) {
        self.recorders.push(recorder);
    }

    /// The files, in the order in which the recorders were added.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.recorders.iter().map(|recorder| recorder.path())
    }

    /// Starts all files, or none if one of them may not be written.
    ///
    /// # Errors
    /// [`LogError::Exists`] for the first file that is there already, before any file is created; later, the
    /// first error of a recorder.
    pub fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        for recorder in &self.recorders {
            recorder.check()?;
        }
        self.all(|recorder| recorder.begin(header))
    }

    /// Adds one instant to all files.
    ///
    /// # Errors
    /// The first error of a recorder.
    pub fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        self.all(|recorder| recorder.record(sample))
    }

    /// Adds the result to all files and closes them.
    ///
    /// # Errors
    /// The first error of a recorder.
    pub fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        self.all(|recorder| recorder.finish(result))
    }

    fn all(&mut self, mut call: impl FnMut(&mut dyn Recorder) -> Result<(), LogError>) -> Result<(), LogError> {
        let mut outcome = Ok(());
        for recorder in &mut self.recorders {
            outcome = outcome.and(call(recorder.as_mut()));
        }
        outcome
    }
}

impl Extend<Box<dyn Recorder>> for RecorderSet {
    fn extend<I: IntoIterator<Item = Box<dyn Recorder>>>(&mut self, recorders: I) {
        self.recorders.extend(recorders);
    }
}
