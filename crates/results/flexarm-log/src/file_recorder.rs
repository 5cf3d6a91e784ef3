//! What all recorders have in common: a file that is opened by `begin`, and calls that come in
//! order.

use std::path::{Path, PathBuf};

use crate::{CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample};

/// A recorder of one file; `F` is the file of its format between `begin` and `finish`.
///
/// The file is created by [`Recorder::begin`]. Calls in another order than `begin`, `record`,
/// `finish` are [`LogError::Order`].
#[derive(Debug)]
pub struct FileRecorder<F> {
    path: PathBuf,
    options: CreateOptions,
    state: State<F>,
}

#[derive(Debug)]
enum State<F> {
    New,
    Open(Box<F>),
    Finished,
}

/// A file of one format that is being written. Dropped without `finish`, it closes itself as well
/// as it can.
pub trait OpenFile: Send + Sized {
    /// Makes the file and writes what is known before the first sample.
    ///
    /// # Errors
    /// [`LogError`] if it cannot be created or written.
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> Result<Self, LogError>;

    /// Adds one instant.
    ///
    /// # Errors
    /// As [`Recorder::record`].
    fn record(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError>;

    /// Copies what a file without further samples needs of the one that was added last. Called
    /// after [`OpenFile::record`], of several samples in a row after the last.
    fn keep(&mut self, _sample: &Sample) {}

    /// Adds the result and ends the file.
    ///
    /// # Errors
    /// As [`Recorder::finish`].
    fn finish(&mut self, path: &Path, result: &RunResult) -> Result<(), LogError>;
}

impl<F> FileRecorder<F> {
    /// A recorder that will write `path`; the file is created by `begin`.
    pub fn create(path: impl Into<PathBuf>, options: CreateOptions) -> Self {
        Self { path: path.into(), options, state: State::New }
    }
}

impl<F: OpenFile> Recorder for FileRecorder<F> {
    fn check(&self) -> Result<(), LogError> {
        self.options.check(&self.path)
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if !matches!(self.state, State::New) {
            return Err(LogError::begun_twice(&self.path));
        }
        self.state = State::Open(Box::new(F::begin(&self.path, self.options, header)?));
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        self.record_all(std::slice::from_ref(sample))
    }

    fn record_all(&mut self, samples: &[Sample]) -> Result<(), LogError> {
        let State::Open(file) = &mut self.state else { return Err(LogError::not_open(&self.path, "record")) };
        let mut last = None;
        let written = samples.iter().try_for_each(|sample| {
            file.record(&self.path, sample)?;
            last = Some(sample);
            Ok(())
        });
        if let Some(last) = last {
            file.keep(last);
        }
        written
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        match std::mem::replace(&mut self.state, State::Finished) {
            State::Open(mut file) => file.finish(&self.path, result),
            before => {
                self.state = before;
                Err(LogError::not_open(&self.path, "finish"))
            }
        }
    }

    fn path(&self) -> &Path {
        &self.path
    }
}
