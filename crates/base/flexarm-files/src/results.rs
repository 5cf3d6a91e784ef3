//! Result files: rejected before the work if a location is in use, and never left half written.
//!
//! Before the work [`check_free`] and [`check_apart`], after it [`write_all`]; a recording that
//! grows during the work is a [`Partial`].
//!
//! Not here: what is written; names of files in a folder of results.

use std::cell::RefCell;
use std::fs::{File, OpenOptions};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::FileError;

/// Maximum number of provisional names that are tried.
const MAX_NAMES: u32 = 10_000;
/// Maximum number of symbolic links to a file, that of Linux.
const MAX_LINKS: u32 = 40;

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
        if path.exists() && !path.is_file() {
            return fail("is a device or a pipe, a file is to be written there");
        }
        // A link that leads nowhere yet is taken too.
        if !overwrite && path.symlink_metadata().is_ok() {
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

/// Checks that no result replaces a file that it is made of, whatever the names of the two.
///
/// # Errors
/// [`FileError::Unusable`], also where results may overwrite files.
pub fn check_apart(outputs: &[PathBuf], inputs: &[&Path]) -> Result<(), FileError> {
    let inputs: Vec<PathBuf> = inputs.iter().filter_map(|input| input.canonicalize().ok()).collect();
    match outputs.iter().find(|output| output.canonicalize().is_ok_and(|output| inputs.contains(&output))) {
        None => Ok(()),
        Some(path) => {
            let what = "is input and output: give the output another name or folder".into();
            Err(FileError::Unusable { path: path.clone(), what })
        }
    }
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
    // Dropped in reverse order: the files before their folders.
    let mut undo = Undo::default();
    let mut partials = Vec::new();
    for (path, bytes) in files {
        let failed = |source| FileError::Write { path: path.clone(), source };
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            undo.make(folder).map_err(failed)?;
        }
        let (mut file, partial) = Partial::create(path).map_err(failed)?;
        file.write_all(bytes.as_ref()).map_err(failed)?;
        partials.push((path, partial));
    }
    for (path, partial) in partials {
        let is_new = !path.exists();
        partial.finish().map_err(|source| FileError::Write { path: path.clone(), source })?;
        if is_new {
            undo.files.push(path.clone());
        }
    }
    undo.keep();
    Ok(())
}

/// A file under a name that nothing else has, until it is complete. It is removed unless it is
/// finished.
#[derive(Debug)]
pub struct Partial {
    /// Provisional name, in the folder of the final one; empty once the file is finished.
    path: PathBuf,
    end: PathBuf,
}

impl Partial {
    /// Creates the file that is to get the name `path`. A symbolic link is followed, and a file that
    /// is replaced keeps its permissions.
    ///
    /// # Errors
    /// Error of the file system.
    pub fn create(path: &Path) -> std::io::Result<(File, Self)> {
        let mut end = path.to_owned();
        for _ in 0..MAX_LINKS {
            let Ok(next) = end.read_link() else { break };
            end = end.with_file_name(next);
        }
        let mut number = 0_u32;
        loop {
            // Short: the final name may be as long as the file system allows.
            let path = end.with_file_name(format!("flexarm-{number}.partial"));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    let new = Self { path, end };
                    #[cfg(unix)]
                    if let Ok(there) = new.end.metadata() {
                        file.set_permissions(there.permissions())?;
                    }
                    return Ok((file, new));
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists && number < MAX_NAMES => number += 1,
                Err(error) => return Err(error),
            }
        }
    }

    /// Returns the provisional name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its final name.
    ///
    /// # Errors
    /// Error of the file system; the file is then removed.
    pub fn finish(mut self) -> std::io::Result<()> {
        std::fs::rename(&self.path, &self.end)?;
        self.path = PathBuf::new();
        Ok(())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            let _ = std::fs::remove_file(&self.path); // best effort
        }
    }
}

/// Creates a folder in `parent` that only this user may enter, under an unpredictable name, so that
/// a folder or link prepared by others is not used.
///
/// # Errors
/// Error of the file system.
pub fn private_folder(parent: &Path) -> std::io::Result<PathBuf> {
    let random = RandomState::new().build_hasher().finish(); // its keys are the system's random bytes
    let folder = parent.join(format!("flexarm-{random:016x}"));
    let mut builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(&folder)?;
    Ok(folder)
}

/// Converts a name to one that is valid in a file name.
pub fn file_stem(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
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
