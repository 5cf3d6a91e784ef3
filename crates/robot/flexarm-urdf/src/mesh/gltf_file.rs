//! glTF 2.0, binary or with separate buffers: triangles of the default scene, z up, node transforms
//! applied.
//!
//! Start at [`decode`]. Frames: N node, P its parent, F the file's axes (y up), V the URDF's visual
//! frame, all in m. Not supported: textures, skins, sparse or packed accessors.

use std::borrow::Cow;
use std::path::Path;

use flexarm_files::read_file;
use flexarm_settings::Finding;
use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::{
    Draft, MAX_BYTES, MAX_DEPTH, MAX_INSTANCES, MAX_TRIANGLES, Transform, TriangleMesh, check_inside, mesh_error,
    unreadable, unsupported, y_up,
};

/// What is read of the JSON part. Indices are not checked.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Root {
    extensions_required: Vec<String>,
    scene: Option<usize>,
    scenes: Vec<Scene>,
    nodes: Vec<Node>,
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<BufferView>,
    buffers: Vec<Buffer>,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Node {
    mesh: Option<usize>,
    children: Vec<usize>,
    matrix: Option<[f32; 16]>,
    translation: Option<[f32; 3]>,
    rotation: Option<[f32; 4]>,
    scale: Option<[f32; 3]>,
}

#[derive(Deserialize)]
struct Mesh {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: Option<usize>,
    material: Option<usize>,
    mode: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct Attributes {
    position: Option<usize>,
    normal: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Material {
    #[serde(default)]
    pbr_metallic_roughness: Surface,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Surface {
    base_color_factor: Option<[f32; 4]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    shape: String,
    sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct BufferView {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

/// Types of the numbers of an accessor.
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<TriangleMesh, Box<Finding>> {
    let (json, blob) = parts(bytes, path)?;
    let root: Root = serde_json::from_slice(json).map_err(|error| malformed(path, error.to_string()))?;
    // Extensions of materials do not affect the triangles.
    let required = root.extensions_required.iter().find(|e| !e.starts_with("KHR_materials") && !e.contains("texture"));
    if let Some(extension) = required {
        let feature = format!("files with the glTF extension {extension}");
        return Err(unsupported(path, feature));
    }

    let mut reader =
        Reader { path, root: &root, buffers: read_buffers(&root, blob, path)?, draft: Draft::default(), instances: 0 };
    let T_VF = y_up().to_homogeneous();
    match root.scenes.get(root.scene.unwrap_or(0)) {
        Some(scene) => scene.nodes.iter().try_for_each(|&node| reader.node(node, &T_VF, 0))?,
        // A file without scenes: every mesh once, in its own frame.
        None => root.meshes.iter().try_for_each(|mesh| reader.mesh(mesh, &T_VF))?,
    }
    Ok(reader.draft.finish())
}

fn malformed(path: &Path, reason: impl Into<String>) -> Box<Finding> {
    mesh_error(path.display(), format!("not a sound glTF file: {}", reason.into()))
}

/// JSON and, of a binary file, the bytes after it.
type Parts<'a> = (&'a [u8], Option<&'a [u8]>);

/// Splits a file. A binary one has a header of 12 bytes (magic, version, length), then chunks, each
/// with length, kind and content.
fn parts<'a>(bytes: &'a [u8], path: &Path) -> Result<Parts<'a>, Box<Finding>> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let (Some(version), Some(total)) = (word(4), word(8)) else {
        return Err(malformed(path, "cut off within its header"));
    };
    if version != 2 {
        return Err(unsupported(path, format!("files of glTF {version}")));
    }
    let total = total as usize;
    if total > bytes.len() {
        return Err(malformed(path, format!("cut off: {} bytes, expected {total}", bytes.len())));
    }
    let chunk = |at: usize, kind: &[u8]| {
        let length = word(at).filter(|_| bytes.get(at + 4..at + 8) == Some(kind))?;
        bytes[..total].get(at + 8..(at + 8).checked_add(length as usize)?)
    };
    let json = chunk(12, b"JSON").ok_or_else(|| malformed(path, "its JSON part is missing or cut off"))?;
    Ok((json, chunk(20 + json.len(), b"BIN\0")))
}

/// Reads the bytes of all buffers, from the file itself, separate files, or base64 text.
fn read_buffers<'a>(root: &Root, mut blob: Option<&'a [u8]>, path: &Path) -> Result<Vec<Cow<'a, [u8]>>, Box<Finding>> {
    let mut buffers = Vec::new();
    for buffer in &root.buffers {
        let data = match buffer.uri.as_deref() {
            None => Cow::Borrowed(blob.take().ok_or_else(|| malformed(path, "its binary part is missing"))?),
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => data
                    .split_once(";base64,")
                    .and_then(|(_, text)| decode_base64(text))
                    .ok_or_else(|| malformed(path, "a buffer is not base64 text"))?
                    .into(),
                None => {
                    // A file beside this one.
                    let file = path.with_file_name(uri);
                    check_inside(path, &file).map_err(|reason| malformed(path, reason))?;
                    if !file.is_file() {
                        return Err(malformed(path, format!("its buffer {uri:?} is not beside it")));
                    }
                    read_file(&file, MAX_BYTES).map_err(|error| unreadable(&file, error))?.into()
                }
            },
        };
        buffers.push(data);
    }
    Ok(buffers)
}

fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    // Each letter has six bits; `bits` contains the last `count` of them that are not written yet.
    let (mut bits, mut count) = (0u32, 0);
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
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    Some(bytes)
}

struct Reader<'a> {
    path: &'a Path,
    root: &'a Root,
    buffers: Vec<Cow<'a, [u8]>>,
    draft: Draft,
    instances: usize,
}

impl Reader<'_> {
    /// Returns the element at an index, or an error if it does not exist.
    fn get<'b, T>(&self, list: &'b [T], index: usize, what: &str) -> Result<&'b T, Box<Finding>> {
        list.get(index).ok_or_else(|| malformed(self.path, format!("{what} {index} does not exist")))
    }

    /// Adds a node N and all nodes below it; `T_VP` is the transform of its parent.
    fn node(&mut self, index: usize, T_VP: &Matrix4<f64>, depth: usize) -> Result<(), Box<Finding>> {
        self.instances += 1;
        if depth > MAX_DEPTH || self.instances > MAX_INSTANCES {
            return Err(malformed(self.path, "its nodes form a cycle or are far too many"));
        }
        let node = self.get(&self.root.nodes, index, "node")?;
        let T_VN = T_VP * local_transform(node);
        if let Some(mesh) = node.mesh {
            self.mesh(self.get(&self.root.meshes, mesh, "mesh")?, &T_VN)?;
        }
        node.children.iter().try_for_each(|&child| self.node(child, &T_VN, depth + 1))
    }

    fn mesh(&mut self, mesh: &Mesh, T_VN: &Matrix4<f64>) -> Result<(), Box<Finding>> {
        let transform = Transform::new(T_VN);
        for primitive in &mesh.primitives {
            match primitive.mode.unwrap_or(4) {
                0..=3 => continue, // points and lines
                4 => {}
                5 | 6 => return Err(unsupported(self.path, "strips and fans of triangles of glTF")),
                mode => return Err(malformed(self.path, format!("a primitive has the unknown mode {mode}"))),
            }
            let Some(positions) = primitive.attributes.position else { continue };
            let positions = self.vectors(positions)?;
            let normals = primitive.attributes.normal.map(|index| self.vectors(index)).transpose()?;
            let indices: Vec<u32> = match primitive.indices {
                Some(index) => self.indices(index)?,
                None => (0..positions.len() as u32).collect(),
            };
            if let Some(index) = indices.iter().find(|&&i| i as usize >= positions.len()) {
                return Err(malformed(self.path, format!("a triangle uses vertex {index} of {}", positions.len())));
            }

            let draft = &mut self.draft;
            let total = draft.mesh.positions.len() + positions.len();
            if total > u32::MAX as usize || draft.mesh.triangles.len() > MAX_TRIANGLES {
                return Err(unsupported(self.path, "more than 50 million triangles"));
            }
            // Indices of a primitive start at its own first vertex.
            let first = draft.mesh.positions.len() as u32;
            draft.mesh.positions.extend(positions.iter().map(|p| transform.point(p)));
            if let Some(normals) = normals.filter(|n| n.len() == positions.len()) {
                draft.normals.extend(normals.iter().map(|n| transform.normal(n)));
            }
            let triangles = indices.chunks_exact(3).map(|t| transform.winding([t[0], t[1], t[2]].map(|i| i + first)));
            draft.mesh.triangles.extend(triangles);
            let material = primitive.material.map(|index| self.get(&self.root.materials, index, "material"));
            let color = material.transpose()?.map(|m| m.pbr_metallic_roughness.base_color_factor.unwrap_or([1.0; 4]));
            self.draft.colors.push((color, indices.len() / 3));
        }
        Ok(())
    }

    fn vectors(&self, index: usize) -> Result<Vec<Vector3<f64>>, Box<Finding>> {
        let accessor = self.get(&self.root.accessors, index, "accessor")?;
        if accessor.shape != "VEC3" {
            return Err(malformed(self.path, "positions and normals are not vectors"));
        }
        if accessor.component_type != F32 {
            return Err(unsupported(self.path, "packed vertices of glTF"));
        }
        let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let vector = |b: &[u8]| Vector3::new(number(b), number(&b[4..]), number(&b[8..]));
        self.elements(accessor, 12, vector)
    }

    fn indices(&self, index: usize) -> Result<Vec<u32>, Box<Finding>> {
        let accessor = self.get(&self.root.accessors, index, "accessor")?;
        if accessor.shape != "SCALAR" {
            return Err(malformed(self.path, "its indices are not scalars"));
        }
        match accessor.component_type {
            U8 => self.elements(accessor, 1, |b| u32::from(b[0])),
            U16 => self.elements(accessor, 2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
            U32 => self.elements(accessor, 4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            _ => Err(malformed(self.path, "its indices are not unsigned integers")),
        }
    }

    /// Reads the elements of `size` bytes each, with all bounds checked.
    fn elements<T>(&self, accessor: &Accessor, size: usize, read: impl Fn(&[u8]) -> T) -> Result<Vec<T>, Box<Finding>> {
        if accessor.sparse.is_some() {
            return Err(unsupported(self.path, "sparse accessors of glTF"));
        }
        let view = accessor.buffer_view.ok_or_else(|| unsupported(self.path, "accessors of glTF without data"))?;
        let view = self.get(&self.root.buffer_views, view, "buffer view")?;
        let buffer = self.get(&self.buffers, view.buffer, "buffer")?;
        let stride = view.byte_stride.map_or(size, |stride| stride.max(size));
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| buffer.get(view.byte_offset..end)?.get(accessor.byte_offset..));
        // The last element need not fill its stride.
        let count = accessor.count;
        let span = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        match (bytes, span) {
            (Some(bytes), Some(span)) if span <= bytes.len() => {
                Ok((0..count).map(|i| read(&bytes[i * stride..i * stride + size])).collect())
            }
            _ => Err(malformed(self.path, "an accessor reaches beyond its buffer")),
        }
    }
}

/// Transform `T_PN` of a node in its parent, from its matrix or its translation, rotation and
/// scale.
fn local_transform(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = node.matrix {
        return Matrix4::from_column_slice(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| Vector3::from(v.map(f64::from)));
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]).map(f64::from);
    let q = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12).unwrap_or_default();
    Matrix4::new_translation(&vector(node.translation, Vector3::zeros()))
        * q.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&vector(node.scale, Vector3::repeat(1.0)))
}
