//! Resolves `package://name/meshes/a.stl` and similar references to files.
//!
//! Order for packages: the caller's map, the parent folders of the URDF, the caller's search paths.
//! Only [`search_paths_from_environment`], which the caller may use, reads the environment.
//!
//! Not here: reading the files, packages on the network.

use std::path::{Path, PathBuf};

use flexarm_settings::Setting;

/// Returns the folders in `ROS_PACKAGE_PATH` and `AMENT_PREFIX_PATH`, for
/// [`crate::ReadOptions::search_paths`].
///
/// The only function of this crate that reads the environment, apart from `$(env NAME)` in xacro.
pub fn search_paths_from_environment() -> Vec<PathBuf> {
    ["ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"]
        .into_iter()
        .filter_map(std::env::var_os)
        .flat_map(|value| std::env::split_paths(&value).collect::<Vec<_>>())
        .filter(|path| !path.as_os_str().is_empty())
        .collect()
}

/// Places to search.
pub(crate) struct Resolver<'a> {
    /// Folder of the URDF.
    pub(crate) folder: PathBuf,
    pub(crate) packages: &'a [(String, PathBuf)],
    pub(crate) search_paths: &'a [PathBuf],
}

/// Reason why no file was found.
#[derive(Debug, PartialEq)]
pub(crate) struct NotFound {
    pub(crate) reason: String,
    pub(crate) help: String,
}

impl Resolver<'_> {
    /// Returns each mesh reference of a URDF once, as written, with its file; references without a
    /// file are omitted.
    pub(crate) fn mesh_files(&self, urdf: &str) -> Vec<(String, PathBuf)> {
        let mut files: Vec<(String, PathBuf)> = Vec::new();
        for element in urdf.split("<mesh").skip(1).filter_map(|rest| rest.split('>').next()) {
            let Some((_, value)) = element.split_once("filename") else { continue };
            let Some(value) = value.trim_start().strip_prefix('=').map(str::trim_start) else { continue };
            let reference = value.chars().next().filter(|quote| "\"'".contains(*quote));
            let Some(reference) = reference.and_then(|quote| value[1..].split(quote).next()) else { continue };
            if files.iter().all(|(known, _)| known != reference) {
                let plain = reference.replace("&apos;", "'").replace("&quot;", "\"").replace("&amp;", "&");
                files.extend(self.resolve(plain.trim()).ok().map(|file| (reference.to_owned(), file)));
            }
        }
        files
    }

    pub(crate) fn resolve(&self, uri: &str) -> Result<PathBuf, NotFound> {
        let not_found = |reason: String, help: &str| Err(NotFound { reason, help: help.to_owned() });
        if let Some(rest) = uri.strip_prefix("package://").or_else(|| uri.strip_prefix("model://")) {
            return self.in_package(rest);
        }
        if uri.starts_with("http://") || uri.starts_with("https://") {
            return not_found("meshes are not fetched from the network".into(), "download it beside the URDF");
        }
        let path = match uri.strip_prefix("file://") {
            Some(path) => PathBuf::from(percent_decoded(path)),
            None => self.folder.join(uri),
        };
        existing(&path).ok_or_else(|| NotFound {
            reason: format!("{} does not exist", path.display()),
            help: other_case(&path).unwrap_or_else(|| "correct the path; it is relative to the URDF's folder".into()),
        })
    }

    fn in_package(&self, rest: &str) -> Result<PathBuf, NotFound> {
        let (package, inside) = rest.split_once('/').unwrap_or((rest, ""));
        let mut missing = None;
        for folder in self.package_folders(package) {
            let path = folder.join(inside);
            match existing(&path) {
                Some(path) => return Ok(path),
                None => missing = missing.or(Some(path)),
            }
        }
        Err(match missing {
            Some(path) => NotFound {
                reason: format!("{} does not exist", path.display()),
                help: other_case(&path).unwrap_or_else(|| "is the package complete?".into()),
            },
            None => NotFound {
                reason: format!("the package {package:?} was not found"),
                help: format!(
                    "say where it is with {} {package}=FOLDER, or put the URDF inside the package",
                    Setting::Package
                ),
            },
        })
    }

    /// Returns the folder of a package as an absolute path; `near` is the folder of the file that
    /// refers to it.
    pub(crate) fn find_package(&self, package: &str, near: Option<&Path>) -> Result<PathBuf, NotFound> {
        let mut found = self.package_folders(package).into_iter().next();
        for start in near.into_iter().chain([self.folder.as_path()]) {
            found = found.or_else(|| neighbour(start, package));
        }
        let found = found.map(|folder| std::path::absolute(&folder).unwrap_or(folder));
        found.ok_or_else(|| NotFound {
            reason: format!("the package {package:?} was not found"),
            help: format!(
                "say where it is with {} {package}=FOLDER, or by packages in the robot file",
                Setting::Package
            ),
        })
    }

    /// All folders that may be the package, best first.
    fn package_folders(&self, package: &str) -> Vec<PathBuf> {
        if package.is_empty() || package == "." || package == ".." {
            return Vec::new();
        }
        let mut folders: Vec<PathBuf> =
            self.packages.iter().filter(|(name, _)| name == package).map(|(_, path)| path.clone()).collect();

        // Upwards from the URDF: the package itself, or a sibling in a workspace. First along the
        // given path, then along the canonical one (installations often link to sources).
        let named = std::path::absolute(&self.folder).ok();
        let real = named.as_deref().and_then(|folder| folder.canonicalize().ok());
        for start in named.iter().chain(real.as_ref().filter(|real| named.as_ref() != Some(real))) {
            for ancestor in start.ancestors() {
                if is_package(ancestor, package) {
                    folders.push(ancestor.to_owned());
                }
                folders.push(ancestor.join(package));
            }
        }
        // Installed packages: PREFIX/share/NAME; workspaces: SRC/NAME and SRC/REPOSITORY/NAME.
        for path in self.search_paths {
            if is_package(path, package) {
                folders.push(path.clone());
            }
            folders.extend([path.join("share").join(package), path.join(package)]);
            let repositories = std::fs::read_dir(path).into_iter().flatten().flatten();
            let mut nested: Vec<_> = repositories.map(|entry| entry.path().join(package)).collect();
            nested.sort();
            folders.extend(nested);
        }
        folders.retain(|folder| folder.is_dir());
        folders
    }
}

/// Finds a package next to the one that contains `start`, whose folder has another name.
fn neighbour(start: &Path, package: &str) -> Option<PathBuf> {
    let start = std::path::absolute(start).ok()?;
    let own = start.ancestors().find(|folder| folder.join("package.xml").is_file())?;
    let beside = std::fs::read_dir(own.parent()?).ok()?.flatten().take(1000);
    let mut folders: Vec<PathBuf> = beside.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders.into_iter().find(|folder| is_package(folder, package))
}

/// Whether the folder or its `package.xml` has the package's name.
fn is_package(folder: &Path, package: &str) -> bool {
    if folder.file_name().is_some_and(|name| name == package) {
        return true;
    }
    let Ok(manifest) = std::fs::read_to_string(folder.join("package.xml")) else { return false };
    let Ok(document) = roxmltree::Document::parse(&manifest) else { return false };
    let name = document.root_element().children().find(|n| n.has_tag_name("name"));
    name.and_then(|n| n.text()).is_some_and(|name| name.trim() == package)
}

fn existing(path: &Path) -> Option<PathBuf> {
    path.is_file().then(|| path.to_owned())
}

/// Hint for a file name that differs only in case, from case-insensitive systems.
fn other_case(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_str()?;
    let names = std::fs::read_dir(path.parent()?).ok()?.flatten().filter_map(|e| e.file_name().into_string().ok());
    let mut similar: Vec<String> = names.filter(|name| name.eq_ignore_ascii_case(wanted)).collect();
    similar.sort();
    similar.first().map(|name| format!("there is {name:?} in that folder: the case of letters differs"))
}

fn percent_decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = bytes.get(at + 1..at + 3).and_then(|h| std::str::from_utf8(h).ok());
        match (bytes[at], hex.and_then(|h| u8::from_str_radix(h, 16).ok())) {
            (b'%', Some(byte)) => {
                decoded.push(byte);
                at += 3;
            }
            (byte, _) => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&decoded).into_owned()
}
