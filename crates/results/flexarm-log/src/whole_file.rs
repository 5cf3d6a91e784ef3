//! A file that is either complete or absent, for formats that cannot be read before their end is
//! written.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use flexarm_files::Partial;

use crate::{CreateOptions, LogError};

/// Provisional name of a file until [`WholeFile::finish`] renames it. An abandoned file is removed.
#[derive(Debug)]
pub(crate) struct WholeFile {
    options: CreateOptions,
    /// None once the file is renamed.
    partial: Option<Partial>,
}

impl WholeFile {
    /// Creates a file under a provisional name in the folder of `path`.
    pub(crate) fn create(path: &Path, options: CreateOptions) -> Result<(File, Self), LogError> {
        options.check(path)?;
        let (file, partial) = Partial::create(path).map_err(LogError::io(path, "create the file"))?;
        Ok((file, Self { options, partial: Some(partial) }))
    }

    /// Renames the file once its bytes are on the disk. `action` names the last write in errors.
    pub(crate) fn finish(&mut self, mut file: File, path: &Path, action: &'static str) -> Result<(), LogError> {
        // The name must not exist before the bytes are on the disk.
        file.flush().and_then(|()| file.sync_all()).map_err(LogError::io(path, action))?;
        drop(file);
        self.options.check(path)?; // it may have been created since `create`
        match self.partial.take() {
            Some(partial) => partial.finish().map_err(LogError::io(path, "give the file its name")),
            None => Ok(()),
        }
    }
}
