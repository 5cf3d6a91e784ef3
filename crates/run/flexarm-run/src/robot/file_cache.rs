//! Cache of the files from which robots are built, for programs that build many robots from nearly
//! the same file.
//!
//! A file that changes during the lifetime of a cache is not read again.

use std::collections::HashMap;
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

impl FileCache {
    /// Reads a description, or returns the cached one.
    ///
    /// # Errors
    /// As [`read_urdf`].
    pub(crate) fn urdf(&self, path: &Path, options: &ReadOptions) -> Result<UrdfRobot, Error> {
        let key = (path.to_owned(), format!("{options:?}"));
        let known = self.urdfs.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        if let Some(known) = known {
            return Ok((*known).clone());
        }
        let read = Arc::new(read_urdf(path, options)?);
        self.urdfs.lock().unwrap_or_else(PoisonError::into_inner).insert(key, read.clone());
        Ok((*read).clone())
    }

    /// Reads a reduced link, or returns the cached one.
    ///
    /// # Errors
    /// As [`read_flex`].
    pub(crate) fn flex(&self, path: &Path) -> Result<ReducedLink, Error> {
        let known = self.links.lock().unwrap_or_else(PoisonError::into_inner).get(path).cloned();
        if let Some(known) = known {
            return Ok((*known).clone());
        }
        let read = Arc::new(read_flex(path).map_err(Box::new)?);
        self.links.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned(), read.clone());
        Ok((*read).clone())
    }

    /// Reads the stress fields of a link, or returns the cached ones.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read, [`Error::Modelling`] for one that is damaged.
    pub(crate) fn stress(&self, path: &Path) -> Result<Arc<StressFields>, Error> {
        let known = self.stresses.lock().unwrap_or_else(PoisonError::into_inner).get(path).cloned();
        if let Some(known) = known {
            return Ok(known);
        }
        let unreadable = |error: std::io::Error| Error::File { path: path.to_owned(), what: error.to_string() };
        let bytes = std::fs::read(path).map_err(unreadable)?;
        let wrong = |error| Error::Modelling(format!("{}: {error}", path.display()));
        let read = Arc::new(parse_stress(&bytes).map_err(wrong)?);
        self.stresses.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned(), read.clone());
        Ok(read)
    }
}
