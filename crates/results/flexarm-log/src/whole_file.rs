//! A file that is there whole or not at all: for formats that nobody can read before their end is
//! written.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::{CreateOptions, LogError};

/// The provisional name of a file, `<file>.partial`, until [`WholeFile::finish`] gives it its own.
/// A file that is given up goes away.
#[derive(Debug)]
pub(crate) struct WholeFile {
    options: CreateOptions,
    /// None once the file has its own name.
    partial: Option<PathBuf>,
}

impl WholeFile {
    /// A new file under the provisional name of `path`.
    pub(crate) fn create(path: &Path, options: CreateOptions) -> Result<(File, Self), LogError> {
        options.check(path)?;
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".partial");
        let partial = path.with_file_name(name);
        let file = File::create(&partial).map_err(LogError::io(path, "create the file"))?;
        Ok((file, Self { options, partial: Some(partial) }))
    }

    /// Gives the file its name, once its bytes are on the disk. `action` is what an error calls the
    /// last of them.
    pub(crate) fn finish(&mut self, mut file: File, path: &Path, action: &'static str) -> Result<(), LogError> {
        // The name must not be there before the bytes are.
        file.flush().and_then(|()| file.sync_all()).map_err(LogError::io(path, action))?;
        drop(file);
        self.options.check(path)?; // not there at the start, but perhaps now
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
            let _ = std::fs::remove_file(path); // what cannot be removed stays
        }
    }
}
