//! The files that a robot's meshes came from, as attachments of a recording.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::Path;

use crate::{Attachment, LogError, RunHeader};

/// Each file once, as `meshes/<file name>`.
pub(crate) fn mesh_files(header: &RunHeader) -> Result<Vec<Attachment>, LogError> {
    let (mut seen, mut names, mut files) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for path in header.meshes.iter().filter_map(|mesh| mesh.file.as_deref()) {
        if !seen.insert(path) {
            continue;
        }
        let bytes = std::fs::read(path).map_err(LogError::io(path, "read the mesh to attach it"))?;
        let file_name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        let mut name = format!("meshes/{file_name}");
        if !names.insert(name.clone()) {
            name = format!("meshes/{}/{file_name}", seen.len()); // another folder's file of that name
            names.insert(name.clone());
        }
        files.push(Attachment { name, media_type: media_type(path).to_owned(), bytes });
    }
    Ok(files)
}

fn media_type(path: &Path) -> &'static str {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "stl" => "model/stl",
        "obj" => "model/obj",
        "dae" => "model/vnd.collada+xml",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        _ => "application/octet-stream",
    }
}
