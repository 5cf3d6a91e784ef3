//! Recordings for the Rerun viewer, which a crate above this one writes: whoever wants them installs
//! its code once.

use std::path::PathBuf;
use std::sync::OnceLock;

use crate::{CreateOptions, LogError, Recorder};

static WRITER: OnceLock<RrdWriter> = OnceLock::new();

/// Code that writes `.rrd` files.
#[derive(Clone, Copy, Debug)]
pub struct RrdWriter {
    /// Returns the recorder of a run.
    pub recorder: fn(PathBuf, CreateOptions) -> Box<dyn Recorder>,
    /// Returns the recorder of several runs, one for each label.
    pub study: fn(PathBuf, CreateOptions, Vec<String>) -> Box<dyn StudyRecorder>,
}

/// A recording of several runs, drawn over each other.
pub trait StudyRecorder: Send {
    /// Returns the recorder of the run with this number.
    ///
    /// # Panics
    /// If there is no label with this number.
    fn recorder(&self, number: usize) -> Box<dyn Recorder>;

    /// Ends the file, with a text (Markdown) that compares the runs.
    ///
    /// # Errors
    /// [`LogError`] on a write error, or if no run was recorded.
    fn finish(self: Box<Self>, text: &str) -> Result<(), LogError>;
}

/// Makes [`RecordingFormat::Rrd`](crate::RecordingFormat::Rrd) available in this process. Only the
/// first call has an effect.
pub fn install_rrd_writer(writer: RrdWriter) {
    let _ = WRITER.set(writer);
}

/// Creates the recording of a study for `path`, with a label for each run; `None` if no writer is
/// installed. The file is created when the first run begins.
pub fn study_recorder(
    path: impl Into<PathBuf>,
    options: CreateOptions,
    labels: Vec<String>,
) -> Option<Box<dyn StudyRecorder>> {
    WRITER.get().map(|writer| (writer.study)(path.into(), options, labels))
}

pub(super) fn writer() -> Option<RrdWriter> {
    WRITER.get().copied()
}
