//! Look-up of shipped robots and trajectories, by path or by name in the folders that come with the
//! program.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use flexarm::Error;
use flexarm::robots::closest;

use crate::failure::Failure;

/// Folders of robots: arms, and arms for tests.
const ROBOTS: [&str; 2] = ["robots", "robots/test"];

/// A folder registered by the process.
static BROUGHT: OnceLock<PathBuf> = OnceLock::new();

/// Registers the folder; only the first call has an effect.
pub(crate) fn ship_from(folder: PathBuf) {
    let _ = BROUGHT.set(folder);
}

/// Folders of the files that come with the program: the registered one, and the one beside it.
fn installed() -> impl Iterator<Item = PathBuf> {
    let program = std::env::current_exe().ok();
    let beside = program.as_deref().and_then(Path::parent).map(|folder| folder.join("../share/flexarm"));
    BROUGHT.get().cloned().into_iter().chain(beside)
}

/// Folders that may hold `robots/` and `trajectories/`: the current folder, those of the installed
/// files, and the one where the program was built.
fn roots() -> Vec<PathBuf> {
    let mut roots = vec![PathBuf::from(".")];
    roots.extend(installed());
    roots.extend(Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).map(Path::to_owned));
    roots
}

/// The folders below every root.
fn places(folders: &[&str]) -> impl Iterator<Item = PathBuf> {
    roots().into_iter().flat_map(move |root| folders.iter().map(move |folder| root.join(folder)))
}

/// Returns the path itself if it exists, else `<root>/<folder>/<name>` with one of the extensions.
pub(crate) fn find(given: &Path, folders: &[&str], endings: &[&str]) -> PathBuf {
    let is_name = given.components().count() == 1;
    if given.exists() || !is_name {
        return given.to_owned();
    }
    let name = &given.to_string_lossy();
    let places = places(folders);
    let mut files = places.flat_map(|place| endings.iter().map(move |e| place.join(format!("{name}{e}"))));
    files.find(|path| path.exists()).unwrap_or_else(|| given.to_owned())
}

/// Returns a robot by path, name, or path below the folder of the shipped ones
/// (`kr210/beams.toml`), for files that refer to robots.
pub(crate) fn robot_file(given: &Path) -> PathBuf {
    let found = robot(Some(given)).unwrap_or_else(|_| given.to_owned());
    if found.exists() {
        return found;
    }
    places(&ROBOTS).map(|place| place.join(given)).find(|path| path.exists()).unwrap_or(found)
}

/// Returns a library that comes with the program, by the name of its file; never one of the current
/// folder, which others may have put there.
pub(crate) fn library(name: &str) -> Option<PathBuf> {
    installed().map(|root| root.join("lib").join(name)).find(|path| path.is_file())
}

/// A robot by path or name; the default robot without one.
///
/// # Errors
/// [`Error::File`] for a name that no shipped robot has, with the names that there are.
pub(crate) fn robot(given: Option<&Path>) -> Result<PathBuf, Error> {
    let given = given.unwrap_or(Path::new("fanuc_r2000_210f"));
    let path = find(given, &ROBOTS, &["/robot.toml"]);
    let advice = "give a robot.toml, a folder with one, or a .urdf or .xacro file";
    known(given, path, "robot", advice, || names(&ROBOTS, |entry| entry.join("robot.toml").is_file()))
}

/// A trajectory by path or name.
///
/// # Errors
/// [`Error::File`] for a name that no shipped trajectory has, with the names that there are.
pub(crate) fn trajectory(given: &Path) -> Result<PathBuf, Error> {
    let path = trajectory_file(given);
    let is_motion = |path: &Path| has_ending(path, &["toml", "csv"]) && !path.to_string_lossy().contains(".loads.");
    known(given, path, "trajectory", "give a .csv or .toml file, a bag or a robot program", || {
        names(&["trajectories"], is_motion)
    })
}

/// A trajectory by path or name, for files that name trajectories.
pub(crate) fn trajectory_file(given: &Path) -> PathBuf {
    find(given, &["trajectories"], &["", ".toml", ".csv"])
}

/// Returns a cutting tool by path or name.
///
/// # Errors
/// [`Error::File`] for a name that no shipped tool has, with the names that there are.
pub(crate) fn tool(given: &Path) -> Result<PathBuf, Error> {
    let path = find(given, &["robots/tools"], &[".toml"]);
    known(given, path, "tool", "give a .toml file", || names(&["robots/tools"], |path| has_ending(path, &["toml"])))
}

/// Returns the folder of the built web page.
///
/// # Errors
/// [`Error::File`] if this installation has none.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn web_page() -> Result<PathBuf, Error> {
    let built = roots().into_iter().flat_map(|root| [root.join("web"), root.join("web/dist")]);
    built.into_iter().find(|folder| folder.join("flexarm.wasm").is_file()).ok_or_else(|| Error::File {
        path: PathBuf::from("web/dist"),
        what: "there is no built web page; `python3 tools/build_web.py` in the sources builds it".into(),
    })
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|ending| endings.iter().any(|e| ending == *e))
}

/// Names of the entries of folders of shipped files.
fn names(folders: &[&str], wanted: impl Fn(&Path) -> bool) -> Vec<String> {
    let entries = |place: PathBuf| std::fs::read_dir(place).into_iter().flatten().flatten();
    let paths = places(folders).flat_map(entries).map(|entry| entry.path()).filter(|path| wanted(path));
    let mut names: Vec<String> = paths.filter_map(|p| Some(p.file_stem()?.to_string_lossy().into_owned())).collect();
    names.sort();
    names.dedup();
    names
}

/// The path, unless it is a bare name that leads to no file.
fn known(
    given: &Path,
    path: PathBuf,
    kind: &str,
    advice: &str,
    names: impl FnOnce() -> Vec<String>,
) -> Result<PathBuf, Error> {
    if path.exists() || given.components().count() != 1 || given.extension().is_some() {
        return Ok(path);
    }
    let names = names();
    let meant = closest(&given.to_string_lossy(), names.iter().map(String::as_str));
    let meant = meant.map_or_else(String::new, |name| format!("did you mean {name:?}? "));
    let what = format!(
        "there is no such file and no such {kind} among the shipped ones; {meant}shipped are {}; or {advice}",
        names.join(", ")
    );
    Err(Error::File { path, what })
}

/// Output folder of a command: the requested folder, or a new one that is unique to this run.
pub(crate) enum OutputFolder {
    None,
    Asked(PathBuf),
    New(NewFolder),
}

/// A newly created folder `out/<stem>-<n>`. It is removed if nothing was written into it.
pub(crate) struct NewFolder {
    path: PathBuf,
    /// Whether `out` itself was created.
    with_parent: bool,
}

impl OutputFolder {
    /// Returns the requested folder, a new one named after `stem`, or none if no files are wanted.
    ///
    /// # Errors
    /// [`Error::Write`] if a new folder cannot be created.
    pub(crate) fn of(asked: Option<&Path>, stem: &str, wanted: bool) -> Result<Self, Failure> {
        match asked {
            _ if !wanted => Ok(Self::None),
            Some(folder) => Ok(Self::Asked(folder.to_owned())),
            None => NewFolder::create(stem).map(Self::New),
        }
    }

    pub(crate) fn path(&self) -> Option<PathBuf> {
        match self {
            Self::None => None,
            Self::Asked(path) => Some(path.clone()),
            Self::New(new) => Some(new.path.clone()),
        }
    }
}

impl NewFolder {
    /// Takes the first free number. Creating the folder and checking that it is free are one
    /// operation, so concurrent runs get different folders.
    fn create(stem: &str) -> Result<Self, Failure> {
        let clean: String =
            stem.chars().map(|c| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' }).collect();
        let out = Path::new("out");
        let with_parent = !out.exists();
        let mut number = 1_u64;
        loop {
            std::fs::create_dir_all(out).map_err(|source| Error::Write { path: out.to_owned(), source })?;
            let path = out.join(format!("{clean}-{number:03}"));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path, with_parent }),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
                // Another run has just removed `out`, which it had created and not used.
                Err(error) if error.kind() == ErrorKind::NotFound && !out.exists() => {}
                Err(source) => return Err(Error::Write { path, source }.into()),
            }
        }
    }
}

impl Drop for NewFolder {
    /// `remove_dir` removes only empty folders.
    fn drop(&mut self) {
        if std::fs::remove_dir(&self.path).is_ok() && self.with_parent {
            let _ = std::fs::remove_dir("out");
        }
    }
}
