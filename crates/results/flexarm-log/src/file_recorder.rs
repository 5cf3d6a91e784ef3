//! Common part of all recorders: a file created by `begin`, and the check of the order of calls.
//!
//! Start at [`FileRecorder`]; a format implements [`OpenFile`]. Not here: the formats, several
//! files of one run ([`crate::multi`]).

use std::path::{Path, PathBuf};

use crate::{CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample};

/// A recorder of one file; `F` is the file of its format between `begin` and `finish`.
///
/// The file is created by [`Recorder::begin`]. Calls in any other order than `begin`, `record`,
/// `finish` return [`LogError::Order`].
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

/// A file of one format that is being written. If it is dropped without `finish`, it closes itself
/// as far as possible.
pub trait OpenFile: Send + Sized {
    /// Creates the file and writes what is known before the first sample.
    ///
    /// # Errors
    /// [`LogError`] if it cannot be created or written.
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> Result<Self, LogError>;

    /// Adds one sample.
    ///
    /// # Errors
    /// As [`Recorder::record`].
    fn record(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError>;

    /// Keeps what is needed of the last sample to end the file if no further sample follows. Called
    /// after [`OpenFile::record`]; after a batch of samples, once for the last one.
    fn keep(&mut self, _sample: &Sample) {}

    /// Writes the result and closes the file.
    ///
    /// # Errors
    /// As [`Recorder::finish`].
    fn finish(&mut self, path: &Path, result: &RunResult) -> Result<(), LogError>;
}

impl<F> FileRecorder<F> {
    /// Creates a recorder for `path`; the file is created by `begin`.
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
