//! glTF 2.0, binary or with separate buffers: triangles of the default scene, z up, node transforms
//! applied.
//!
//! The `gltf` crate splits the file and reads its structure; indices and ranges are resolved here,
//! because its own validation and iterators panic on invalid ones. Not supported: textures, skins,
//! sparse or packed accessors.

use std::path::Path;

use gltf::Semantic;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::Mode;
use gltf::json::validation::Checked;
use gltf::json::{Index, Node, Root};
use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3, Vector4};

use super::collada::Transform;
use super::{LARGEST, MAX_TRIANGLES, MeshError, TriangleMesh, dominant_color, stl};

/// Maximum nesting depth of nodes; a deeper one is treated as a cycle.
const MAX_DEPTH: usize = 64;
/// Maximum number of mesh instances in one file; more are rejected as malicious.
const MAX_INSTANCES: usize = 100_000;

pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<TriangleMesh, MeshError> {
    check_lengths(bytes, path)?;
    let (json, blob) = if bytes.starts_with(b"glTF") {
        let glb = gltf::Glb::from_slice(bytes).map_err(|error| malformed(path, error.to_string()))?;
        (glb.json, glb.bin)
    } else {
        (bytes.into(), None)
    };
    let root = Root::from_slice(&json).map_err(|error| malformed(path, error.to_string()))?;
    // Extensions of materials do not affect the triangles.
    let required = root.extensions_required.iter().find(|e| !e.starts_with("KHR_materials") && !e.contains("texture"));
    if let Some(extension) = required {
        let feature = format!("files with the glTF extension {extension}");
        return Err(MeshError::Unsupported { path: path.to_owned(), feature });
    }

    let mut reader = Reader {
        path,
        root: &root,
        buffers: read_buffers(&root, blob.map(|b| b.into_owned()), path)?,
        mesh: TriangleMesh::default(),
        normals: Vec::new(),
        colors: Vec::new(),
        instances: 0,
    };
    // glTF has y up: x, y, z of the file as columns in axes with z up.
    let R = Matrix3::from_columns(&[Vector3::x(), Vector3::z(), -Vector3::y()]);
    let T_V = R.to_homogeneous();
    let scene = root.scene.map_or_else(|| root.scenes.first(), |index| root.get(index));
    match scene {
        Some(scene) => scene.nodes.iter().try_for_each(|&node| reader.node(node, &T_V, 0))?,
        None => root.meshes.iter().try_for_each(|mesh| reader.mesh(mesh, &T_V))?,
    }
    let Reader { mut mesh, normals, colors, .. } = reader;
    mesh.color = dominant_color(&colors);
    if normals.len() == mesh.positions.len() {
        mesh.normals = stl::usable(normals);
    }
    Ok(mesh)
}

fn malformed(path: &Path, reason: impl Into<String>) -> MeshError {
    MeshError::Malformed { path: path.to_owned(), format: "glTF", reason: reason.into() }
}

/// Checks the lengths in the header of a binary file, which must not exceed the file.
fn check_lengths(bytes: &[u8], path: &Path) -> Result<(), MeshError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let word = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes).map(u64::from);
    let (Some(total), Some(json)) = (word(8), word(12)) else {
        return Err(malformed(path, "cut off within its header"));
    };
    if total > bytes.len() as u64 || json + 20 > total {
        return Err(malformed(path, format!("cut off: {} bytes, expected {total}", bytes.len())));
    }
    Ok(())
}

/// Reads the bytes of all buffers, from the file itself, separate files, or base64 text.
fn read_buffers(root: &Root, mut blob: Option<Vec<u8>>, path: &Path) -> Result<Vec<Vec<u8>>, MeshError> {
    let mut buffers = Vec::new();
    for buffer in &root.buffers {
        let data = match buffer.uri.as_deref() {
            None => blob.take().ok_or_else(|| malformed(path, "its binary part is missing"))?,
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => data
                    .split_once(";base64,")
                    .and_then(|(_, text)| decode_base64(text))
                    .ok_or_else(|| malformed(path, "a buffer is not base64 text"))?,
                None => {
                    let file = path.with_file_name(uri);
                    if !file.is_file() {
                        return Err(malformed(path, format!("its buffer {uri:?} is not beside it")));
                    }
                    let large = std::fs::metadata(&file).is_ok_and(|meta| meta.len() > LARGEST);
                    if large {
                        return Err(malformed(path, format!("its buffer {uri:?} has more than {LARGEST} bytes")));
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
    root: &'a Root,
    buffers: Vec<Vec<u8>>,
    mesh: TriangleMesh,
    normals: Vec<[f32; 3]>,
    colors: Vec<(Option<[f32; 4]>, usize)>,
    instances: usize,
}

impl<'a> Reader<'a> {
    fn malformed(&self, reason: impl Into<String>) -> MeshError {
        malformed(self.path, reason)
    }

    fn unsupported(&self, feature: impl Into<String>) -> MeshError {
        MeshError::Unsupported { path: self.path.to_owned(), feature: feature.into() }
    }

    /// Returns the element at an index, or an error if it does not exist.
    fn get<T>(&self, index: Index<T>, what: &str) -> Result<&'a T, MeshError>
    where
        Root: gltf::json::root::Get<T>,
    {
        self.root.get(index).ok_or_else(|| self.malformed(format!("{what} {} does not exist", index.value())))
    }

    fn node(&mut self, index: Index<Node>, T_parent: &Matrix4<f64>, depth: usize) -> Result<(), MeshError> {
        self.instances += 1;
        if depth > MAX_DEPTH || self.instances > MAX_INSTANCES {
            return Err(self.malformed("its nodes form a cycle or are far too many"));
        }
        let node = self.get(index, "node")?;
        let T = T_parent * local_transform(node);
        if let Some(mesh) = node.mesh {
            self.mesh(self.get(mesh, "mesh")?, &T)?;
        }
        node.children.iter().flatten().try_for_each(|&child| self.node(child, &T, depth + 1))
    }

    fn mesh(&mut self, mesh: &gltf::json::Mesh, T: &Matrix4<f64>) -> Result<(), MeshError> {
        let transform = Transform::new(T);
        for primitive in &mesh.primitives {
            match primitive.mode {
                Checked::Valid(Mode::Triangles) => {}
                Checked::Valid(Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) => continue,
                Checked::Valid(mode) => return Err(self.unsupported(format!("{mode:?} of glTF"))),
                Checked::Invalid => return Err(self.malformed("a primitive has an unknown mode")),
            }
            let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
            let Some(positions) = attribute(Semantic::Positions) else { continue };
            let positions = self.vectors(positions)?;
            let normals = attribute(Semantic::Normals).map(|index| self.vectors(index)).transpose()?;
            let indices: Vec<u32> = match primitive.indices {
                Some(index) => self.indices(index)?,
                None => (0..positions.len() as u32).collect(),
            };
            if let Some(index) = indices.iter().find(|&&i| i as usize >= positions.len()) {
                return Err(self.malformed(format!("a triangle uses vertex {index} of {}", positions.len())));
            }

            let total = self.mesh.positions.len() + positions.len();
            if total > u32::MAX as usize || self.mesh.triangles.len() > MAX_TRIANGLES {
                return Err(self.unsupported("more than 50 million triangles"));
            }
            let first = self.mesh.positions.len() as u32;
            self.mesh.positions.extend(positions.iter().map(|p| transform.point(p)));
            if let Some(normals) = normals.filter(|n| n.len() == positions.len()) {
                self.normals.extend(normals.iter().map(|n| transform.normal(n)));
            }
            let triangles = indices.chunks_exact(3).map(|t| transform.winding([t[0], t[1], t[2]].map(|i| i + first)));
            self.mesh.triangles.extend(triangles);
            let material = primitive.material.map(|index| self.get(index, "material")).transpose()?;
            let color = material.map(|m| m.pbr_metallic_roughness.base_color_factor.0);
            self.colors.push((color, indices.len() / 3));
        }
        Ok(())
    }

    fn vectors(&self, index: Index<Accessor>) -> Result<Vec<Vector3<f64>>, MeshError> {
        let accessor = self.get(index, "accessor")?;
        let (Checked::Valid(component), Checked::Valid(Type::Vec3)) = (accessor.component_type, accessor.type_) else {
            return Err(self.malformed("positions and normals are not vectors"));
        };
        if component.0 != ComponentType::F32 {
            return Err(self.unsupported("packed vertices of glTF"));
        }
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let vector = |b: &[u8]| Vector3::new(number(b), number(&b[4..]), number(&b[8..]));
        self.elements(accessor, 12, vector)
    }

    fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, MeshError> {
        let accessor = self.get(index, "accessor")?;
        let (Checked::Valid(component), Checked::Valid(Type::Scalar)) = (accessor.component_type, accessor.type_)
        else {
            return Err(self.malformed("its indices are not scalars"));
        };
        match component.0 {
            ComponentType::U8 => self.elements(accessor, 1, |b| u32::from(b[0])),
            ComponentType::U16 => self.elements(accessor, 2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
            ComponentType::U32 => self.elements(accessor, 4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            _ => Err(self.malformed("its indices are not unsigned integers")),
        }
    }

    /// Reads the elements of `size` bytes each, with all bounds checked.
    fn elements<T>(&self, accessor: &Accessor, size: usize, read: impl Fn(&[u8]) -> T) -> Result<Vec<T>, MeshError> {
        if accessor.sparse.is_some() {
            return Err(self.unsupported("sparse accessors of glTF"));
        }
        let view = accessor.buffer_view.ok_or_else(|| self.unsupported("accessors of glTF without data"))?;
        let view = self.get(view, "buffer view")?;
        let buffer = self.buffers.get(view.buffer.value()).map_or(&[][..], Vec::as_slice);
        let stride = view.byte_stride.map_or(size, |s| s.0.max(size));
        let bytes = slice(buffer, view.byte_offset.map_or(0, |o| o.0), view.byte_length.0)
            .and_then(|bytes| bytes.get(usize::try_from(accessor.byte_offset.map_or(0, |o| o.0)).ok()?..));
        // The last element need not fill its stride.
        let count = usize::try_from(accessor.count.0).ok();
        let span =
            count.and_then(|n| n.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size)));
        match (bytes, count, span) {
            (Some(bytes), Some(count), Some(span)) if span <= bytes.len() => {
                Ok((0..count).map(|i| read(&bytes[i * stride..i * stride + size])).collect())
            }
            _ => Err(self.malformed("an accessor reaches beyond its buffer")),
        }
    }
}

fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    bytes.get(start..start.checked_add(usize::try_from(length).ok()?)?)
}

/// Transform of a node, from its matrix or its translation, rotation and scale.
fn local_transform(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = node.matrix {
        return Matrix4::from_column_slice(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| Vector3::from(v.map(f64::from)));
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let q = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12).unwrap_or_default();
    Matrix4::new_translation(&vector(node.translation, Vector3::zeros()))
        * q.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&vector(node.scale, Vector3::repeat(1.0)))
}

impl Transform {
    fn point(&self, p: &Vector3<f64>) -> [f32; 3] {
        let q = self.T * Vector4::new(p.x, p.y, p.z, 1.0);
        [q.x as f32, q.y as f32, q.z as f32]
    }
}
