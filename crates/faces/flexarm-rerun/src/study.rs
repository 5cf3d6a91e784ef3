//! Several runs in one recording, drawn over each other.
//!
//! The runs share one file: each locks it while it writes. Not here: the contents of a run
//! (`run.rs`).

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rerun::TextDocument;

use super::entity::path;
use super::run::RunRole;
use super::{RunWriter, Store, content_hash, stream_error};
use flexarm_log::{CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample, StudyRecorder};

/// A recording of several runs: each has its arm in its own colour (deflections magnified), its TCP
/// path and its error; the first one also all curves and the rigid twin.
///
/// The runs are recorded one after another, each by its own recorder ([`StudyRecorder::recorder`]); time starts at zero for
/// each.
pub(crate) struct RrdStudy {
    path: PathBuf,
    options: CreateOptions,
    labels: Vec<String>,
    store: Arc<Mutex<Option<Store>>>,
}

impl RrdStudy {
    /// Creates a study for `path`, with a label for each run; the file is created when the first
    /// run begins.
    pub(crate) fn create(path: impl Into<PathBuf>, options: CreateOptions, labels: Vec<String>) -> Self {
        Self { path: path.into(), options, labels, store: Arc::default() }
    }
}

impl StudyRecorder for RrdStudy {
    fn recorder(&self, number: usize) -> Box<dyn Recorder> {
        Box::new(StudyRun {
            path: self.path.clone(),
            options: self.options,
            role: RunRole::InStudy(number, self.labels[number].clone()),
            labels: self.labels.clone(),
            store: self.store.clone(),
            run: None,
        })
    }

    fn finish(self: Box<Self>, text: &str) -> Result<(), LogError> {
        let Some(mut store) = lock(&self.store).take() else { return Err(LogError::not_open(&self.path, "finish")) };
        let mut close = || {
            store.stream.constant(&path(["summary"]), &TextDocument::from_markdown(text))?;
            store.finish()
        };
        close().map_err(stream_error(&self.path, "write the result and the index"))
    }
}

impl Drop for RrdStudy {
    /// Writes the index of an abandoned study; errors cannot be reported here.
    fn drop(&mut self) {
        if let Some(mut store) = lock(&self.store).take() {
            let _ = store.finish();
        }
    }
}

/// Records one run of a study.
struct StudyRun {
    path: PathBuf,
    options: CreateOptions,
    role: RunRole,
    labels: Vec<String>,
    store: Arc<Mutex<Option<Store>>>,
    run: Option<RunWriter>,
}

impl Recorder for StudyRun {
    fn check(&self) -> Result<(), LogError> {
        match lock(&self.store).is_some() {
            true => Ok(()), // created by this study
            false => self.options.check(&self.path),
        }
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if self.run.is_some() {
            return Err(LogError::begun_twice(&self.path));
        }
        let mut shared = lock(&self.store);
        let error = stream_error(&self.path, "write the description of the run");
        if shared.is_none() {
            self.options.create(&self.path)?;
            let open = Store::new(&self.path, content_hash(header, &self.labels), self.options)
                .and_then(|store| store.describe(header, &self.role).map(|()| store));
            *shared = Some(open.map_err(stream_error(&self.path, "write the description of the study"))?);
        }
        let Some(store) = shared.as_mut() else { return Err(LogError::not_open(&self.path, "begin")) };
        let run = RunWriter::begin(store, header, self.role.clone(), &self.labels).map_err(error)?;
        self.run = Some(run);
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let mut shared = lock(&self.store);
        match (shared.as_mut(), self.run.as_mut()) {
            (Some(store), Some(run)) => {
                run.record(store, &self.path, sample)?;
                run.tracks.keep(sample);
                Ok(())
            }
            _ => Err(LogError::not_open(&self.path, "record")),
        }
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        let mut shared = lock(&self.store);
        match (shared.as_mut(), self.run.take()) {
            (Some(store), Some(mut run)) => {
                // Flush at once: the next run may take long, or fail.
                let written = run.finish(store, result).and_then(|()| store.stream.flush());
                written.map_err(stream_error(&self.path, "write the end of a run"))
            }
            _ => Err(LogError::not_open(&self.path, "finish")),
        }
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for StudyRun {
    /// Writes the last rows of an abandoned run; errors cannot be reported here.
    fn drop(&mut self) {
        if let (Some(store), Some(mut run)) = (lock(&self.store).as_mut(), self.run.take()) {
            let _ = run.finish(store, &RunResult::default());
        }
    }
}

fn lock(store: &Mutex<Option<Store>>) -> MutexGuard<'_, Option<Store>> {
    store.lock().unwrap_or_else(PoisonError::into_inner)
}
