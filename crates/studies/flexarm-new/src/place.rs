//! Location of the description: referenced in place if it is close to the new folder, else copied
//! with its meshes.
//!
//! Start at [`place`]; [`refuse_other_formats`] comes first. Paths in the robot file are relative
//! to its folder.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use super::draft::Draft;
use super::{NewError, NewOptions};
use flexarm_run::Error;

/// Reference of the new robot file to its description.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    /// Value of `urdf` in the robot file.
    pub(crate) reference: String,
    /// Path of the robot file, for messages.
    pub(crate) robot_path: PathBuf,
    /// Values of `packages` and `args` in the robot file.
    pub(crate) packages: Vec<(String, String)>,
    pub(crate) arguments: Vec<(String, String)>,
    /// Files to copy.
    pub(crate) files: Vec<(PathBuf, Vec<u8>)>,
    /// Description of the location, as text.
    pub(crate) words: String,
}

/// Rejects files that are robots in other formats, or no robots.
///
/// # Errors
/// [`NewError`] for another format, or [`Error::File`] for a file that is missing or cannot be read.
pub(crate) fn refuse_other_formats(path: &Path) -> Result<(), Error> {
    let is = |what: &str, help: &str| {
        let path = path.display();
        Err(NewError(format!("{path}: this is {what}, a URDF or xacro file is required; {help}")).into())
    };
    // A folder, or no file at all.
    if path.is_dir() {
        let mut found: Vec<String> = std::fs::read_dir(path)
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(|name| name.ends_with(".urdf") || name.ends_with(".xacro"))
            .collect();
        found.sort();
        let help = if found.is_empty() {
            "give the file itself".to_owned()
        } else {
            format!("give one of {}", found.join(", "))
        };
        return is("a folder", &help);
    }
    if !path.is_file() {
        let what = "there is no such file; give a .urdf or .xacro file".into();
        return Err(Error::File { path: path.to_owned(), what });
    }
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(4096).read_to_end(&mut head));
    read.map_err(|error| Error::File { path: path.to_owned(), what: format!("cannot be read: {error}") })?;
    // Formats by ending and by the first bytes.
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let text = String::from_utf8_lossy(&head);
    let root = |name: &str| text.contains(&format!("<{name} ")) || text.contains(&format!("<{name}>"));
    let usd = "export it as URDF from the program it was made with (Isaac Sim has a URDF exporter)";
    match ending.as_str() {
        _ if head.starts_with(b"PXR-USDC") || head.starts_with(b"#usda") || ending == "usdz" => is("a USD file", usd),
        "toml" => is("already a robot file", "run it with flexarm compare, or give the description it refers to"),
        "stl" | "dae" | "obj" | "glb" | "gltf" | "step" | "stp" => {
            is("a mesh or drawing", "give the URDF that refers to it; for a single link use flexarm reduce")
        }
        _ if root("sdf") && !root("robot") => {
            is("an SDF file", "export the robot as URDF; if the SDF was made from a URDF, give that URDF")
        }
        _ if root("mujoco") && !root("robot") => {
            is("an MJCF file of MuJoCo", "give the URDF it was made from, or convert it (mjcf2urdf)")
        }
        _ => Ok(()),
    }
}

/// Returns the relative path from a folder to a file; both must be absolute.
pub fn relative(from: &Path, to: &Path) -> Option<String> {
    let (from, to): (Vec<_>, Vec<_>) = (from.components().collect(), to.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let down = to[common..].iter().map(|c| match c {
        Component::Normal(name) => name.to_str().map(str::to_owned),
        _ => None,
    });
    let parts =
        std::iter::repeat_n(Some("..".to_owned()), from.len() - common).chain(down).collect::<Option<Vec<_>>>()?;
    Some(parts.join("/"))
}

/// Returns the path without symbolic links and dots; for a missing folder, only its existing part
/// is resolved.
fn real(path: &Path) -> Option<PathBuf> {
    let whole = std::path::absolute(path).ok()?;
    let there = whole.ancestors().find(|above| above.exists())?;
    let rest = whole.strip_prefix(there).ok()?;
    let real = there.canonicalize().ok()?;
    Some(if rest.as_os_str().is_empty() { real } else { real.join(rest) })
}

/// References a description in the new folder, in its parent or in a sibling; copies any
/// other.
pub(crate) fn place(draft: &Draft, urdf: &Path, folder: &Path, options: &NewOptions) -> Result<Placed, Error> {
    let robot_path = folder.join("robot.toml");
    if let (Some(out), Some(file)) = (real(folder), real(urdf))
        && let Some(home) = file.parent()
        && (home == out || out.parent() == Some(home) || (out.parent().is_some() && out.parent() == home.parent()))
        && out.parent().and_then(Path::parent).is_some()
        && let Some(reference) = relative(&out, &file)
    {
        let packages = options.urdf.packages.iter().map(|(name, to)| {
            let to = real(to).unwrap_or_else(|| to.clone());
            let path = relative(&out, &to).filter(|_| to.is_absolute());
            (name.clone(), path.unwrap_or_else(|| to.display().to_string()))
        });
        return Ok(Placed {
            words: format!("the description is not copied: urdf = {reference:?}, relative to this folder"),
            reference,
            robot_path,
            packages: packages.collect(),
            arguments: options.urdf.arguments.clone(),
            files: Vec::new(),
        });
    }
    copied(draft, urdf, folder, robot_path)
}

/// Copies the description, expanded if it was xacro, with its meshes and with relative paths.
fn copied(draft: &Draft, urdf: &Path, folder: &Path, robot_path: PathBuf) -> Result<Placed, Error> {
    let name = format!("{}.urdf", flexarm_files::file_stem(&draft.name));
    let mut names: BTreeMap<String, PathBuf> = BTreeMap::new();
    let mut files = Vec::new();
    let mut text = draft.urdf.text.clone();
    let mut meshes = 0;
    for (reference, path) in &draft.urdf.mesh_files {
        let own = path.file_name().map_or_else(|| "mesh".into(), |n| flexarm_files::file_stem(&n.to_string_lossy()));
        let mut new = own.clone();
        let mut number = 1;
        while names.get(&new).is_some_and(|other| other != path) {
            number += 1;
            new = format!("{number}_{own}");
        }
        for quote in ['"', '\''] {
            text = text.replace(&format!("{quote}{reference}{quote}"), &format!("{quote}meshes/{new}{quote}"));
        }
        if names.insert(new.clone(), path.clone()).is_none() {
            let bytes = |path: &Path| {
                std::fs::read(path)
                    .map_err(|e| Error::File { path: path.to_owned(), what: format!("cannot be read: {e}") })
            };
            files.push((folder.join("meshes").join(&new), bytes(path)?));
            meshes += 1;
            // Materials and buffers that the mesh refers to are next to it.
            for beside in ["mtl", "bin"].map(|ending| path.with_extension(ending)).into_iter().filter(|p| p.is_file()) {
                let own = beside.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                if names.insert(own.clone(), beside.clone()).is_none() {
                    files.push((folder.join("meshes").join(own), bytes(&beside)?));
                }
            }
        }
    }
    files.push((folder.join(&name), text.into_bytes()));
    let words = format!(
        "the description was copied from {} with {meshes} meshes, all paths relative: the folder can be moved",
        urdf.display()
    );
    Ok(Placed { reference: name, robot_path, packages: Vec::new(), arguments: Vec::new(), files, words })
}
