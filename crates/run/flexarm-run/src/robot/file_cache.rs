//! Cache of the files from which robots are built, for programs that build many robots from nearly
//! the same file.
//!
//! A file that changes during the lifetime of a cache is not read again.

use std::collections::HashMap;
use std::hash::Hash;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_fem::stress::{StressFields, parse_stress};
use flexarm_fem::{ReducedLink, read_flex};
use flexarm_urdf::{ReadOptions, UrdfRobot, read_urdf};

use crate::error::Error;

/// Files already read.
#[derive(Debug, Default)]
pub struct FileCache {
    /// By path and options.
    urdfs: Mutex<HashMap<(PathBuf, String), Arc<UrdfRobot>>>,
    links: Mutex<HashMap<PathBuf, Arc<ReducedLink>>>,
    stresses: Mutex<HashMap<PathBuf, Arc<StressFields>>>,
}

/// Returns the content cached under a key; reads and keeps it if there is none.
fn cached<K: Eq + Hash, T>(
    files: &Mutex<HashMap<K, Arc<T>>>,
    key: K,
    read: impl FnOnce(&K) -> Result<T, Error>,
) -> Result<Arc<T>, Error> {
    let lock = || files.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = lock().get(&key) {
        return Ok(known.clone());
    }
    // Not locked while reading, so that threads read different files at the same time.
    let content = Arc::new(read(&key)?);
    lock().insert(key, content.clone());
    Ok(content)
}

impl FileCache {
    /// Reads a description, or returns the cached one.
    ///
    /// # Errors
    /// As [`read_urdf`].
    pub(crate) fn urdf(&self, path: &Path, options: &ReadOptions) -> Result<UrdfRobot, Error> {
        let key = (path.to_owned(), format!("{options:?}"));
        cached(&self.urdfs, key, |_| Ok(read_urdf(path, options)?)).map(Arc::unwrap_or_clone)
    }

    /// Reads a reduced link, or returns the cached one.
    ///
    /// # Errors
    /// As [`read_flex`].
    pub(crate) fn flex(&self, path: &Path) -> Result<ReducedLink, Error> {
        let read = |path: &PathBuf| Ok(read_flex(path).map_err(Box::new)?);
        cached(&self.links, path.to_owned(), read).map(Arc::unwrap_or_clone)
    }

    /// Reads the stress fields of a link, or returns the cached ones.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read, [`Error::Modelling`] for one that is damaged.
    pub(crate) fn stress(&self, path: &Path) -> Result<Arc<StressFields>, Error> {
        cached(&self.stresses, path.to_owned(), |path| {
            let unreadable = |error: std::io::Error| Error::File { path: path.clone(), what: error.to_string() };
            let bytes = std::fs::read(path).map_err(unreadable)?;
            parse_stress(&bytes).map_err(|error| Error::Modelling(format!("{}: {error}", path.display())))
        })
    }
}
