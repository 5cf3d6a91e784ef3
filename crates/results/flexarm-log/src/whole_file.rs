//! A file that is either complete or absent, for formats that cannot be read before their end is
//! written.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::{CreateOptions, LogError};

/// Temporary name of a file, `<file>.partial`, until [`WholeFile::finish`] renames it. An abandoned
/// file is removed.
#[derive(Debug)]
pub(crate) struct WholeFile {
    options: CreateOptions,
    /// None once the file is renamed.
    partial: Option<PathBuf>,
}

impl WholeFile {
    /// Creates a file under the temporary name of `path`.
    pub(crate) fn create(path: &Path, options: CreateOptions) -> Result<(File, Self), LogError> {
        options.check(path)?;
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".partial");
        let partial = path.with_file_name(name);
        let file = File::create(&partial).map_err(LogError::io(path, "create the file"))?;
        Ok((file, Self { options, partial: Some(partial) }))
    }

    /// Renames the file once its bytes are on the disk. `action` names the last write in errors.
    pub(crate) fn finish(&mut self, mut file: File, path: &Path, action: &'static str) -> Result<(), LogError> {
        // The name must not exist before the bytes are on the disk.
        file.flush().and_then(|()| file.sync_all()).map_err(LogError::io(path, action))?;
        drop(file);
        self.options.check(path)?; // it may have been created since `create`
        if let Some(partial) = &self.partial {
            std::fs::rename(partial, path).map_err(LogError::io(path, "give the file its name"))?;
        }
        self.partial = None;
        Ok(())
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some(path) = &self.partial {
            let _ = std::fs::remove_file(path); // best effort
        }
    }
}
