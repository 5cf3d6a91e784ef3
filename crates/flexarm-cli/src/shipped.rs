//! Where shipped robots and trajectories are found: by path, or by name in the folders that come with the program.

use std::path::{Path, PathBuf};

/// Folders that may hold `robots/` and `trajectories/`: here, beside the program, and where it was built.
fn roots() -> Vec<PathBuf> {
    let mut roots = vec![PathBuf::from(".")];
    if let Some(folder) = std::env::current_exe().ok().as_deref().and_then(Path::parent) {
        roots.push(folder.join("../share/flexarm"));
    }
    roots.push(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."));
    roots
}

/// The path itself if it exists, else `<root>/<folder>/<name>` with one of the endings.
pub(crate) fn find(given: &Path, folder: &str, endings: &[&str]) -> PathBuf {
    let is_name = given.components().count() == 1;
    if given.exists() || !is_name {
        return given.to_owned();
    }
    let name = given.to_string_lossy();
    roots()
        .iter()
        .flat_map(|root| endings.iter().map(|e| root.join(folder).join(format!("{name}{e}"))).collect::<Vec<_>>())
        .find(|path| path.exists())
        .unwrap_or_else(|| given.to_owned())
}

/// A robot by path or name.
pub(crate) fn robot(given: Option<&Path>) -> PathBuf {
    find(given.unwrap_or(Path::new("kr210")), "robots", &["/robot.toml"])
}

/// A trajectory by path or name.
pub(crate) fn trajectory(given: &Path) -> PathBuf {
    find(given, "trajectories", &["", ".toml", ".csv"])
}

/// A folder `out/<stem>-<n>` that is not there yet.
pub(crate) fn new_output_folder(stem: &str) -> PathBuf {
    let clean: String =
        stem.chars().map(|c| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' }).collect();
    (1..).map(|n| Path::new("out").join(format!("{clean}-{n:03}"))).find(|p| !p.exists()).expect("some number is free")
}

/// The folder with `robots` and `tests`: the first root that has both, else where the program was built.
pub(crate) fn checkout() -> PathBuf {
    let has_both = |root: &PathBuf| root.join("robots").is_dir() && root.join("tests/verification").is_dir();
    roots().into_iter().find(has_both).unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
}
