//! STL, binary and ASCII, distinguished by size: a binary file has 84 + 50 n bytes, regardless of
//! its header.

use std::path::Path;

use flexarm_settings::Finding;

use super::{Draft, TriangleMesh, mesh_error, obj};

/// Size of the header before the number of triangles (bytes).
const HEADER: usize = 80;
/// Size of a triangle (bytes).
const RECORD: usize = 50;

/// Whether the size is that of a binary file with the number of triangles in its header.
pub(super) fn has_binary_size(bytes: &[u8]) -> bool {
    triangle_count(bytes).is_some_and(|n| bytes.len() as u64 == size(n))
}

fn triangle_count(bytes: &[u8]) -> Option<u32> {
    bytes.get(HEADER..HEADER + 4)?.try_into().ok().map(u32::from_le_bytes)
}

fn size(triangles: u32) -> u64 {
    (HEADER + 4) as u64 + RECORD as u64 * u64::from(triangles)
}

pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<TriangleMesh, Box<Finding>> {
    let malformed = |reason: String| mesh_error(path.display(), format!("not a sound STL file: {reason}"));
    // Many exporters write "solid" into the header of binary files, so the size is decisive.
    let ascii = bytes.trim_ascii_start().starts_with(b"solid") && std::str::from_utf8(bytes).is_ok();
    if ascii && !has_binary_size(bytes) {
        let scene = mesh_loader::Loader::default()
            .load_stl_from_slice(bytes, path)
            .map_err(|error| malformed(error.to_string()))?;
        return obj::merged(scene, path);
    }

    let count = triangle_count(bytes)
        .ok_or_else(|| malformed(format!("{} bytes, expected at least 84 for a binary file", bytes.len())))?;
    if (bytes.len() as u64) < size(count) {
        let needed = size(count);
        return Err(malformed(format!(
            "cut off: {} bytes, expected {needed} for the {count} triangles of its header",
            bytes.len()
        )));
    }
    // Bytes after the last triangle (line ends, tool data) are ignored.
    let records = bytes[HEADER + 4..].chunks_exact(RECORD).take(count as usize);
    let Draft { mut mesh, mut normals, colors } = Draft::default();
    for record in records {
        // A record has the normal, three vertices, and two bytes of attributes.
        let number =
            |i: usize| f32::from_le_bytes([record[4 * i], record[4 * i + 1], record[4 * i + 2], record[4 * i + 3]]);
        let vector = |i: usize| [number(3 * i), number(3 * i + 1), number(3 * i + 2)];
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([vector(1), vector(2), vector(3)]);
        normals.extend([vector(0); 3]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Ok(Draft { mesh, normals, colors }.finish())
}
