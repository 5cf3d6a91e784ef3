//! Interface of all recorders.

use crate::{RunHeader, RunResult, Sample};

/// Writes a run while it is simulated: `begin` once, `record` any number of times, `finish` once.
///
/// A recorder dropped without `finish` closes its file as far as possible, without result figures.
pub trait Recorder: Send {
    /// Checks that `begin` may create the file, as far as possible without creating it.
    ///
    /// # Errors
    /// [`crate::LogError::Exists`] if the file exists and overwriting was not requested.
    fn check(&self) -> Result<(), crate::LogError> {
        Ok(())
    }

    /// Starts the file.
    ///
    /// # Errors
    /// [`crate::LogError`] if it cannot be created or written.
    fn begin(&mut self, header: &RunHeader) -> Result<(), crate::LogError>;

    /// Adds one sample. The recorder flushes on its own, at least once a second of wall time.
    ///
    /// # Errors
    /// [`crate::LogError::Shape`] if the sample does not fit the header; [`crate::LogError`] on a
    /// write error (full disk).
    fn record(&mut self, sample: &Sample) -> Result<(), crate::LogError>;

    /// Adds samples one after another, up to the first that fails.
    ///
    /// # Errors
    /// As [`Recorder::record`].
    fn record_all(&mut self, samples: &[Sample]) -> Result<(), crate::LogError> {
        samples.iter().try_for_each(|sample| self.record(sample))
    }

    /// Adds the result and closes the file.
    ///
    /// # Errors
    /// [`crate::LogError`] on a write error.
    fn finish(&mut self, result: &RunResult) -> Result<(), crate::LogError>;

    /// Path of the file.
    fn path(&self) -> &std::path::Path;
}
