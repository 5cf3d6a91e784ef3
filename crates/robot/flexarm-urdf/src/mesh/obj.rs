//! OBJ with the colours of its material files, read by `mesh_loader`; and conversion of its scenes
//! to one mesh.

use std::path::Path;

use flexarm_files::read_file;
use flexarm_settings::Finding;

use super::{Draft, MAX_BYTES, TriangleMesh, check_inside, mesh_error, unsupported};

pub(super) fn decode(bytes: &[u8], path: &Path, remarks: &mut Vec<String>) -> Result<TriangleMesh, Box<Finding>> {
    let read_file = |file: &Path| {
        if let Err(reason) = check_inside(path, file) {
            remarks.push(reason.clone());
            return Err(std::io::Error::other(reason));
        }
        read_file(file, MAX_BYTES)
    };
    let scene = mesh_loader::Loader::default().load_obj_from_slice_with_reader(bytes, path, read_file);
    let scene = scene.map_err(|error| mesh_error(path.display(), format!("not a sound OBJ file: {error}")))?;
    merged(scene, path)
}

/// Merges all parts of a scene into one mesh.
pub(super) fn merged(scene: mesh_loader::Scene, path: &Path) -> Result<TriangleMesh, Box<Finding>> {
    let Draft { mut mesh, mut normals, mut colors } = Draft::default();
    for (i, part) in scene.meshes.into_iter().enumerate() {
        // Indices of a part start at its own first vertex; overflow is reported below.
        let first = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
        mesh.triangles.extend(part.faces.iter().map(|face| face.map(|index| index.saturating_add(first))));
        colors.push((scene.materials.get(i).and_then(|m| m.color.diffuse), part.faces.len()));
        mesh.positions.extend(part.vertices);
        normals.extend(part.normals);
    }
    if mesh.positions.len() > u32::MAX as usize {
        return Err(unsupported(path, "more than 2^32 vertices".to_owned()));
    }
    Ok(Draft { mesh, normals, colors }.finish())
}
