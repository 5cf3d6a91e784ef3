//! Mesh files of a robot, as attachments of a recording.

use std::collections::BTreeSet;

use crate::{Attachment, LogError, RunHeader, mesh_media_type};

/// Reads each file once, named `meshes/<file name>`.
pub(crate) fn mesh_files(header: &RunHeader) -> Result<Vec<Attachment>, LogError> {
    let (mut paths, mut names, mut files) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for path in header.meshes.iter().filter_map(|mesh| mesh.file.as_deref()) {
        if !paths.insert(path) {
            continue;
        }
        let bytes = std::fs::read(path).map_err(LogError::io(path, "read the mesh to attach it"))?;
        let file_name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        let mut name = format!("meshes/{file_name}");
        if !names.insert(name.clone()) {
            name = format!("meshes/{}/{file_name}", paths.len()); // file of the same name in another folder
            names.insert(name.clone());
        }
        files.push(Attachment { name, media_type: mesh_media_type(path).to_owned(), bytes });
    }
    Ok(files)
}
