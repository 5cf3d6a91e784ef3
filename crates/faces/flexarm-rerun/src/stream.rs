//! Writer of an .rrd file through the Rerun SDK: a recording, and the blueprint with the window
//! layout.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rerun::components::TransformFrameId;
use rerun::external::re_log_types::{BlueprintActivationCommand, StoreSource};
use rerun::log::{Chunk, RowId};
use rerun::sink::MemorySinkStorage;
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamError, SerializationError,
    SerializedComponentColumn, TimeColumn, TimePoint, Transform3D,
};

use super::layout::Entities;

const APPLICATION: &str = "flexarm";
/// Maximum time for which the SDK's writer thread is waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// An error of writing to the stream.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StreamError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error(transparent)]
    Stream(#[from] RecordingStreamError),
    #[error(transparent)]
    Chunk(#[from] rerun::log::ChunkError),
    #[error(transparent)]
    Component(#[from] SerializationError),
}

pub(crate) type Result<T> = std::result::Result<T, StreamError>;

/// An .rrd file being written.
pub(crate) struct RrdStream {
    path: PathBuf,
    recording: RecordingStream,
    blueprint: RecordingStream,
    /// Blueprint messages not yet in the file.
    layout: MemorySinkStorage,
}

impl RrdStream {
    /// Creates the file. Viewers keep recordings with different `id` apart.
    pub(crate) fn create(path: &Path, id: &str) -> Result<Self> {
        let builder = |id: String| {
            let source = StoreSource::Other(concat!("flexarm ", env!("CARGO_PKG_VERSION")).to_owned());
            RecordingStreamBuilder::new(APPLICATION)
                .recording_id(id)
                .store_source(source)
                .send_properties(false)
                .enabled(true)
        };
        let recording = builder(id.to_owned()).save(path)?;
        let (blueprint, layout) = builder(format!("{id}-layout")).blueprint().memory()?;
        Ok(Self { path: path.to_owned(), recording, blueprint, layout })
    }

    pub(crate) fn name(&self, name: &str) -> Result<()> {
        Ok(self.recording.send_recording_name(name)?)
    }

    /// Writes data valid at all times; a later call replaces it.
    pub(crate) fn constant(&self, path: &EntityPath, what: &dyn AsComponents) -> Result<()> {
        Ok(self.recording.log_static(path.clone(), what)?)
    }

    /// Gives the frame of an entity a name, to which other entities can be attached.
    pub(crate) fn name_frame(&self, path: &EntityPath, name: &str) -> Result<()> {
        let named = Transform3D::update_fields()
            .with_parent_frame(TransformFrameId::from_entity_path(path))
            .with_child_frame(name);
        self.constant(&path.join(&EntityPath::from_single_string("frame")), &named)
    }

    /// Writes data valid from one time on.
    pub(crate) fn single(&self, path: &EntityPath, when: &TimePoint, what: &dyn AsComponents) -> Result<()> {
        let chunk = Chunk::builder(path.clone()).with_archetype(RowId::new(), when.clone(), what).build()?;
        self.recording.send_chunk(chunk);
        Ok(())
    }

    /// Writes a row for each time.
    pub(crate) fn columns(
        &self,
        path: &EntityPath,
        times: impl IntoIterator<Item = TimeColumn>,
        columns: impl Iterator<Item = SerializedComponentColumn>,
    ) -> Result<()> {
        Ok(self.recording.send_columns(path.clone(), times, columns)?)
    }

    /// Writes entities of the layout and activates it, now and by default. Entities written later
    /// replace earlier ones.
    pub(crate) fn show(&self, entities: &Entities, version: i64) -> Result<()> {
        self.blueprint.set_time_sequence("blueprint", version);
        for (path, what) in entities {
            self.blueprint.log(path.clone(), what.as_ref())?;
        }
        let Some(info) = self.blueprint.store_info() else { return Ok(()) };
        let blueprint_id = info.store_id;
        let command = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        self.recording.send_blueprint(self.layout.take(), command);
        Ok(())
    }

    /// Waits until all data are in the file.
    ///
    /// # Errors
    /// The SDK's writer thread has failed, or does not answer within [`PATIENCE`]: a request that it
    /// gets while it fails may stay without an answer.
    pub(crate) fn flush(&self) -> Result<()> {
        self.recording.flush_with_timeout(PATIENCE).map_err(|error| self.broken(&error).into())
    }

    /// Writes the index and closes the file.
    pub(crate) fn finish(&self) -> Result<()> {
        self.flush()?;
        let length = || self.path.metadata().ok().map(|file| file.len());
        let before = length();
        self.recording.disconnect();
        // The SDK does not report whether the index was written. It is never empty; the length of a
        // removed file is unknown.
        match length().is_none_or(|length| Some(length) > before) {
            true => Ok(()),
            false => Err(self.broken(&"the index is missing").into()),
        }
    }

    /// Returns why the file cannot be written, which the SDK only logs: a further write fails the
    /// same way.
    fn broken(&self, error: &dyn std::fmt::Display) -> io::Error {
        let probe = || {
            let mut file = OpenOptions::new().append(true).open(&self.path)?;
            let length = file.metadata()?.len();
            let written = file.write_all(&[0; 1 << 16]);
            file.set_len(length)?;
            written
        };
        probe().err().unwrap_or_else(|| io::Error::other(error.to_string()))
    }
}
