//! Several recordings of one run.

use std::path::{Path, PathBuf};

use crate::threads::Threads;
use crate::{LogError, Recorder, RunHeader, RunResult, Sample};

/// Recorders that get the same header, samples and result.
///
/// One that fails does not keep the others from their data: all are called, then the first error is
/// returned. Each error names its file. One that cannot begin ends the set, and the files that the
/// others have made go away.
#[derive(Default)]
pub struct RecorderSet {
    recorders: Vec<Box<dyn Recorder>>,
    /// The recorders in their place, between [`RecorderSet::on_threads`] and
    /// [`RecorderSet::finish`].
    threads: Option<Threads>,
    /// Which file was made under which name.
    made: Vec<(PathBuf, FileId)>,
}

/// What tells two files of one name apart: device and number on it.
type FileId = (u64, u64);

fn file_id(path: &Path) -> Option<FileId> {
    let there = path.metadata().ok()?;
    #[cfg(unix)]
    let id = (std::os::unix::fs::MetadataExt::dev(&there), std::os::unix::fs::MetadataExt::ino(&there));
    // Elsewhere a file that is open cannot be removed.
    #[cfg(not(unix))]
    let id = (0, u64::from(there.is_file()));
    Some(id)
}

/// To ask takes as long as to begin a run: only where there are files.
fn several_processors() -> bool {
    std::thread::available_parallelism().is_ok_and(|processors| processors.get() > 1)
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

    /// The files, in the order in which the recorders were added; none while they are written on
    /// threads.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.recorders.iter().map(|recorder| recorder.path())
    }

    /// Whether all files may be created, as far as can be told without creating one.
    ///
    /// # Errors
    /// [`LogError::Exists`] for the first file that is there already; [`LogError::Io`] for one that
    /// cannot be replaced.
    pub fn check(&self) -> Result<(), LogError> {
        self.recorders.iter().try_for_each(|recorder| recorder.check())
    }

    /// Starts all files, or none if one of them may not be written.
    ///
    /// # Errors
    /// As [`RecorderSet::check`], before any file is created; later, the first error of a recorder,
    /// and no new file is left.
    pub fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        self.check()?;
        let new: Vec<PathBuf> = self.paths().filter(|path| !path.exists()).map(Path::to_owned).collect();
        let begun = self.begin_all(header);
        if begun.is_err() {
            self.recorders.clear(); // closes the files
            for path in new {
                let _ = std::fs::remove_file(path); // what cannot be removed stays; the error that led here is told
            }
            return begun;
        }
        self.made = self.paths().filter_map(|path| Some((path.to_owned(), file_id(path)?))).collect();
        Ok(())
    }

    /// Surfaces and files of the robot are much to write: each recorder begins on a thread of its
    /// own.
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

    /// Has each file written on a thread of its own from here on, after [`RecorderSet::begin`]. The
    /// files get the same bytes.
    ///
    /// Where there is one processor, nothing changes.
    pub fn on_threads(&mut self) {
        if self.threads.is_none() && !self.recorders.is_empty() && several_processors() {
            self.threads = Some(Threads::start(std::mem::take(&mut self.recorders)));
        }
    }

    /// Adds one instant to all files.
    ///
    /// # Errors
    /// The first error of a recorder; on threads it is told some samples after the one that it
    /// belongs to.
    pub fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        match &mut self.threads {
            Some(threads) => threads.record(sample),
            None => self.all(|recorder| recorder.record(sample)),
        }
    }

    /// Has the threads add the result and close their files, and does not wait for that;
    /// [`RecorderSet::finish`] does. Without threads nothing happens yet.
    pub fn begin_to_finish(&mut self, result: &RunResult) {
        if let Some(threads) = &mut self.threads {
            threads.close(result);
        }
    }

    /// Adds the result to all files and closes them, unless [`RecorderSet::begin_to_finish`] did;
    /// then the result is that one's.
    ///
    /// # Errors
    /// The first error of a recorder; [`LogError::Gone`] if files are no longer where they were
    /// made: what was written to them cannot be found.
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
