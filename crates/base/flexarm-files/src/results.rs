//! Result files: rejected before the work if a location is in use, and never left half written.

use std::cell::RefCell;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::FileError;

thread_local! {
    /// Predicate that returns true once the results of this thread are no longer wanted.
    static UNWANTED: RefCell<Option<Rc<dyn Fn() -> bool>>> = const { RefCell::new(None) };
}

/// Runs `work`; once `unwanted` returns true, [`write_all`] on this thread refuses to write.
///
/// A cancelled call therefore leaves no files behind, at whatever stage it was.
pub fn writing_unless<T>(unwanted: impl Fn() -> bool + 'static, work: impl FnOnce() -> T) -> T {
    /// Restores the previous predicate on drop.
    struct Before(Option<Rc<dyn Fn() -> bool>>);
    impl Drop for Before {
        fn drop(&mut self) {
            UNWANTED.set(self.0.take());
        }
    }
    let _before = Before(UNWANTED.replace(Some(Rc::new(unwanted))));
    work()
}

/// Checks that the paths can be written.
///
/// # Errors
/// [`FileError::Taken`] for an existing file without `overwrite`, and [`FileError::Unusable`] for a
/// folder in place of a file or vice versa.
pub fn check_free(paths: &[PathBuf], overwrite: bool) -> Result<(), FileError> {
    for path in paths {
        let fail = |what: &str| Err(FileError::Unusable { path: path.clone(), what: what.into() });
        if path.is_dir() {
            return fail("is a folder, a file is to be written there");
        }
        if !overwrite && path.exists() {
            return Err(FileError::Taken { path: path.clone(), place: "place", movable: false });
        }
        if let Some(above) = path.ancestors().skip(1).find(|above| above.exists())
            && !above.is_dir()
        {
            let what = "is a file; the results need a folder".into();
            return Err(FileError::Unusable { path: above.to_owned(), what });
        }
    }
    Ok(())
}

/// Writes all files, each first under another name; they are renamed only when all are written. A
/// full disk or a failed rename therefore leaves no new files behind. Files that were already
/// overwritten before the failure keep their new content.
///
/// # Errors
/// [`FileError::Write`]; with [`ErrorKind::Interrupted`] if the results are no longer wanted
/// ([`writing_unless`]).
pub fn write_all(files: &[(PathBuf, impl AsRef<[u8]>)]) -> Result<(), FileError> {
    let unwanted = UNWANTED.with_borrow(Clone::clone);
    if let (Some(unwanted), Some((path, _))) = (unwanted, files.first())
        && unwanted()
    {
        return Err(FileError::Write { path: path.clone(), source: ErrorKind::Interrupted.into() });
    }
    let mut undo = Undo::default();
    for (path, bytes) in files {
        let failed = |source| FileError::Write { path: path.clone(), source };
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            undo.make(folder).map_err(failed)?;
        }
        let partial = partial(path);
        undo.files.push(partial.clone());
        std::fs::write(&partial, bytes).map_err(failed)?;
    }
    for (path, _) in files {
        let is_new = !path.exists();
        std::fs::rename(partial(path), path).map_err(|source| FileError::Write { path: path.clone(), source })?;
        if is_new {
            undo.files.push(path.clone());
        }
    }
    undo.keep();
    Ok(())
}

/// Converts a name to one that is valid in a file name.
pub fn file_stem(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

fn partial(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

/// Removes the files and folders it made when dropped, unless [`Undo::keep`] was called.
#[derive(Debug, Default)]
pub struct Undo {
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
    done: bool,
}

impl Undo {
    /// Creates a folder and its missing parents.
    ///
    /// # Errors
    /// Error of the file system.
    pub fn make(&mut self, folder: &Path) -> std::io::Result<()> {
        let missing: Vec<PathBuf> =
            folder.ancestors().take_while(|f| !f.as_os_str().is_empty() && !f.exists()).map(Path::to_owned).collect();
        std::fs::create_dir_all(folder)?;
        self.folders.extend(missing.into_iter().rev());
        Ok(())
    }

    /// Keeps everything that was made.
    pub fn keep(&mut self) {
        self.done = true;
    }
}

impl Drop for Undo {
    fn drop(&mut self) {
        if self.done {
            return;
        }
        // Files that cannot be removed remain; the error that led here is reported.
        for file in &self.files {
            let _ = std::fs::remove_file(file);
        }
        for folder in self.folders.iter().rev() {
            let _ = std::fs::remove_dir(folder);
        }
    }
}
