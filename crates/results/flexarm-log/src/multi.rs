//! Several recordings of one run.
//!
//! Start at [`RecorderSet`]. Every file gets the same samples, with or without threads.
//! Not here: the threads ([`crate::threads`]), one file ([`crate::file_recorder`]).

use std::path::{Path, PathBuf};

use crate::threads::Threads;
use crate::{LogError, Recorder, RunHeader, RunResult, Sample};

/// Set of recorders that get the same header, samples and result.
///
/// A failing recorder does not keep the others from their data: all are called, then the first
/// error is returned. Each error names its file. If a recorder cannot begin, the set is cleared and
/// the files already created by the others are removed.
#[derive(Default)]
pub struct RecorderSet {
    recorders: Vec<Box<dyn Recorder>>,
    /// The recorders running on threads, between [`RecorderSet::on_threads`] and
    /// [`RecorderSet::finish`].
    threads: Option<Threads>,
    /// Path and identity of each file created.
    made: Vec<(PathBuf, FileId)>,
}

/// Identity of a file, independent of its name: device and inode number.
type FileId = (u64, u64);

fn file_id(path: &Path) -> Option<FileId> {
    let there = path.metadata().ok()?;
    #[cfg(unix)]
    let id = (std::os::unix::fs::MetadataExt::dev(&there), std::os::unix::fs::MetadataExt::ino(&there));
    // On other systems an open file cannot be removed.
    #[cfg(not(unix))]
    let id = (0, u64::from(there.is_file()));
    Some(id)
}

/// Whether there are several processors. The query takes as long as starting a run, so it is made
/// only if there are files.
fn several_processors() -> bool {
    std::thread::available_parallelism().is_ok_and(|processors| processors.get() > 1)
}

impl RecorderSet {
    /// Creates an empty set: every call succeeds and writes nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a recorder.
    pub fn push(&mut self, recorder: Box<dyn Recorder>) {
        self.recorders.push(recorder);
    }

    /// Paths of the files, in the order in which the recorders were added; empty while threads
    /// write them.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.recorders.iter().map(|recorder| recorder.path())
    }

    /// Checks that all files may be created, as far as possible without creating one.
    ///
    /// # Errors
    /// [`LogError::Exists`] for the first file that exists already; [`LogError::Io`] for a file
    /// that cannot be replaced.
    pub fn check(&self) -> Result<(), LogError> {
        self.recorders.iter().try_for_each(|recorder| recorder.check())
    }

    /// Starts all files, or none if one of them cannot be written.
    ///
    /// # Errors
    /// As [`RecorderSet::check`], before any file is created; later, the first error of a recorder,
    /// with all new files removed.
    pub fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        self.check()?;
        let new: Vec<PathBuf> = self.paths().filter(|path| !path.exists()).map(Path::to_owned).collect();
        let begun = self.begin_all(header);
        if begun.is_err() {
            self.recorders.clear(); // closes the files
            for path in new {
                let _ = std::fs::remove_file(path); // best effort; the error that led here is returned
            }
            return begun;
        }
        self.made = self.paths().filter_map(|path| Some((path.to_owned(), file_id(path)?))).collect();
        Ok(())
    }

    /// Starts all recorders, each on a thread of its own: surfaces and files of the robot are
    /// large.
    fn begin_all(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if self.recorders.len() < 2 || !several_processors() {
            return self.all(|recorder| recorder.begin(header));
        }
        std::thread::scope(|scope| {
            let recorders = self.recorders.iter_mut();
            let threads: Vec<_> = recorders.map(|recorder| scope.spawn(move || recorder.begin(header))).collect();
            let joined = |thread: std::thread::ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().map(joined).fold(Ok(()), Result::and)
        })
    }

    /// From here on, after [`RecorderSet::begin`], writes each file on a thread of its own. The
    /// files get the same bytes.
    ///
    /// With a single processor, nothing changes.
    pub fn on_threads(&mut self) {
        if self.threads.is_none() && !self.recorders.is_empty() && several_processors() {
            self.threads = Some(Threads::start(std::mem::take(&mut self.recorders)));
        }
    }

    /// Adds a sample to all files.
    ///
    /// # Errors
    /// The first error of a recorder; with threads it is returned some samples late.
    pub fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        match &mut self.threads {
            Some(threads) => threads.record(sample),
            None => self.all(|recorder| recorder.record(sample)),
        }
    }

    /// Makes the threads add the result and close their files, without waiting for them;
    /// [`RecorderSet::finish`] waits. Without threads nothing happens yet.
    pub fn begin_to_finish(&mut self, result: &RunResult) {
        if let Some(threads) = &mut self.threads {
            threads.close(result);
        }
    }

    /// Adds the result to all files and closes them. After [`RecorderSet::begin_to_finish`], the
    /// result given there is the one written.
    ///
    /// # Errors
    /// The first error of a recorder; [`LogError::Gone`] if files are no longer at their paths, so
    /// that what was written to them cannot be found.
    pub fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        match self.threads.take() {
            Some(threads) => {
                let (recorders, outcome) = threads.finish(result);
                self.recorders = recorders;
                outcome?;
            }
            None => self.all(|recorder| recorder.finish(result))?,
        }
        let is_gone = |(path, id): &&(PathBuf, FileId)| file_id(path) != Some(*id);
        let paths: Vec<PathBuf> = self.made.iter().filter(is_gone).map(|(path, _)| path.clone()).collect();
        if paths.is_empty() { Ok(()) } else { Err(LogError::Gone { paths }) }
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
