//! glTF 2.0, binary or with buffers beside it: triangles of the default scene with node transforms.
//!
//! The `gltf` crate reads and checks the structure; the numbers are taken from the buffers here, because its own
//! iterators panic on accessors that reach beyond them. Not read: textures, skins, sparse or packed accessors.

use std::path::Path;

use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, Document, Gltf, Node, Semantic, buffer};
use nalgebra::{Matrix4, Vector3, Vector4};

use super::collada::Transform;
use super::{MAX_TRIANGLES, MeshError, TriangleMesh, dominant_color, stl};

/// Nodes below nodes; deeper is taken for a cycle.
const MAX_DEPTH: usize = 64;
/// Placed meshes in one file; more is taken for a trap.
const MAX_INSTANCES: usize = 100_000;

pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<TriangleMesh, MeshError> {
    let malformed = |reason: String| MeshError::Malformed { path: path.to_owned(), format: "glTF", reason };
    check_lengths(bytes).map_err(malformed)?;
    let Gltf { document, blob } = Gltf::from_slice(bytes).map_err(|error| malformed(error.to_string()))?;
    let mut reader = Reader {
        path,
        buffers: read_buffers(&document, blob, path)?,
        mesh: TriangleMesh::default(),
        normals: Vec::new(),
        colors: Vec::new(),
        instances: 0,
    };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    match scene {
        Some(scene) => {
            for node in scene.nodes() {
                reader.node(&node, &Matrix4::identity(), 0)?;
            }
        }
        None => {
            for mesh in document.meshes() {
                reader.mesh(&mesh, &Matrix4::identity())?;
            }
        }
    }
    let Reader { mut mesh, normals, colors, .. } = reader;
    mesh.color = dominant_color(&colors);
    if normals.len() == mesh.positions.len() {
        mesh.normals = stl::usable(normals);
    }
    Ok(mesh)
}

/// The lengths in the header of a binary file, which must not exceed it.
fn check_lengths(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let word = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes).map(u64::from);
    let (Some(total), Some(json)) = (word(8), word(12)) else { return Err("cut off within its header".to_owned()) };
    if total > bytes.len() as u64 || json + 20 > total {
        return Err(format!("cut off: {} bytes, expected {total}", bytes.len()));
    }
    Ok(())
}

/// The bytes of all buffers, from the file itself, files beside it, or base64 text.
fn read_buffers(document: &Document, blob: Option<Vec<u8>>, path: &Path) -> Result<Vec<Vec<u8>>, MeshError> {
    let mut blob = blob;
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let missing = |reason: String| MeshError::Malformed { path: path.to_owned(), format: "glTF", reason };
        let data = match buffer.source() {
            buffer::Source::Bin => blob.take().ok_or_else(|| missing("its binary part is missing".to_owned()))?,
            buffer::Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => data
                    .split_once(";base64,")
                    .and_then(|(_, text)| decode_base64(text))
                    .ok_or_else(|| missing("a buffer is not base64 text".to_owned()))?,
                None => {
                    let file = path.with_file_name(uri);
                    let is_file = std::fs::metadata(&file).is_ok_and(|m| m.is_file());
                    if !is_file {
                        return Err(missing(format!("its buffer {uri:?} is not beside it")));
                    }
                    std::fs::read(&file).map_err(|source| MeshError::Io { path: file, source })?
                }
            },
        };
        buffers.push(data);
    }
    Ok(buffers)
}

fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
            bits &= (1 << held) - 1;
        }
    }
    Some(bytes)
}

struct Reader<'a> {
    path: &'a Path,
    buffers: Vec<Vec<u8>>,
    mesh: TriangleMesh,
    normals: Vec<[f32; 3]>,
    colors: Vec<(Option<[f32; 4]>, usize)>,
    instances: usize,
}

impl Reader<'_> {
    fn malformed(&self, reason: impl Into<String>) -> MeshError {
        MeshError::Malformed { path: self.path.to_owned(), format: "glTF", reason: reason.into() }
    }

    fn unsupported(&self, feature: impl Into<String>) -> MeshError {
        MeshError::Unsupported { path: self.path.to_owned(), feature: feature.into() }
    }

    fn node(&mut self, node: &Node<'_>, T_parent: &Matrix4<f64>, depth: usize) -> Result<(), MeshError> {
        self.instances += 1;
        if depth > MAX_DEPTH || self.instances > MAX_INSTANCES {
            return Err(self.malformed("its nodes form a cycle or are far too many"));
        }
        let local = node.transform().matrix();
        let T = T_parent * Matrix4::from_fn(|row, column| f64::from(local[column][row]));
        if let Some(mesh) = node.mesh() {
            self.mesh(&mesh, &T)?;
        }
        node.children().try_for_each(|child| self.node(&child, &T, depth + 1))
    }

    fn mesh(&mut self, mesh: &gltf::Mesh<'_>, T: &Matrix4<f64>) -> Result<(), MeshError> {
        let transform = Transform::new(T);
        for primitive in mesh.primitives() {
            use gltf::mesh::Mode;
            match primitive.mode() {
                Mode::Triangles => {}
                Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => continue,
                mode => return Err(self.unsupported(format!("{mode:?} of glTF"))),
            }
            let Some(accessor) = primitive.get(&Semantic::Positions) else { continue };
            let positions = self.vectors(&accessor)?;
            let normals = primitive.get(&Semantic::Normals).map(|a| self.vectors(&a)).transpose()?;
            let indices: Vec<u32> = match primitive.indices() {
                Some(accessor) => self.indices(&accessor)?,
                None => (0..positions.len() as u32).collect(),
            };
            if let Some(index) = indices.iter().find(|&&i| i as usize >= positions.len()) {
                return Err(self.malformed(format!("a triangle uses vertex {index} of {}", positions.len())));
            }
            let first = u32::try_from(self.mesh.positions.len() + positions.len())
                .map_err(|_| self.unsupported("more than 2^32 vertices"))?
                - positions.len() as u32;
            self.mesh.positions.extend(positions.iter().map(|p| transform.point(p)));
            if let Some(normals) = normals.filter(|n| n.len() == positions.len()) {
                self.normals.extend(normals.iter().map(|n| transform.normal(n)));
            }
            let triangles =
                indices.chunks_exact(3).map(|t| transform.winding([t[0] + first, t[1] + first, t[2] + first]));
            self.mesh.triangles.extend(triangles);
            let color =
                primitive.material().index().map(|_| primitive.material().pbr_metallic_roughness().base_color_factor());
            self.colors.push((color, indices.len() / 3));
            if self.mesh.triangles.len() > MAX_TRIANGLES {
                return Err(self.unsupported("more than 50 million triangles"));
            }
        }
        Ok(())
    }

    fn vectors(&self, accessor: &Accessor<'_>) -> Result<Vec<Vector3<f64>>, MeshError> {
        if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
            return Err(self.unsupported("packed vertices of glTF"));
        }
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let vector = |b: &[u8]| Vector3::new(number(b), number(&b[4..]), number(&b[8..]));
        self.elements(accessor, 12, vector)
    }

    fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, MeshError> {
        if accessor.dimensions() != Dimensions::Scalar {
            return Err(self.malformed("its indices are not scalars"));
        }
        match accessor.data_type() {
            DataType::U8 => self.elements(accessor, 1, |b| u32::from(b[0])),
            DataType::U16 => self.elements(accessor, 2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
            DataType::U32 => self.elements(accessor, 4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            _ => Err(self.malformed("its indices are not unsigned integers")),
        }
    }

    /// The elements of `size` bytes each, with all bounds checked.
    fn elements<T>(
        &self,
        accessor: &Accessor<'_>,
        size: usize,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, MeshError> {
        if accessor.sparse().is_some() {
            return Err(self.unsupported("sparse accessors of glTF"));
        }
        let view = accessor.view().ok_or_else(|| self.unsupported("accessors of glTF without data"))?;
        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
        let stride = view.stride().unwrap_or(size).max(size);
        let end = view.offset().checked_add(view.length());
        let view_bytes = end.and_then(|end| buffer.get(view.offset()..end));
        let count = accessor.count();
        let span = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        let end = span.and_then(|span| span.checked_add(accessor.offset()));
        let bytes = match (view_bytes, end) {
            (Some(bytes), Some(end)) => bytes.get(accessor.offset()..end),
            _ => None,
        };
        let bytes = bytes.ok_or_else(|| self.malformed("an accessor reaches beyond its buffer"))?;
        Ok((0..count).map(|i| read(&bytes[i * stride..i * stride + size])).collect())
    }
}

impl Transform {
    fn point(&self, p: &Vector3<f64>) -> [f32; 3] {
        let q = self.T * Vector4::new(p.x, p.y, p.z, 1.0);
        [q.x as f32, q.y as f32, q.z as f32]
    }
}
