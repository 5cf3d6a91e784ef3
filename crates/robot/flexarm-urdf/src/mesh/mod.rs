//! Triangle meshes: reading STL, OBJ, COLLADA and glTF, and their mass properties.
//!
//! All meshes are converted to metres and to the axes of the URDF's visual frame, ready for
//! drawing:
//!
//! | format | unit | up axis | node transforms |
//! | --- | --- | --- | --- |
//! | STL, OBJ | none: taken as metres | none | none |
//! | COLLADA (`.dae`) | `<unit>` applied | `<up_axis>` turned to z | applied |
//! | glTF (`.glb`, `.gltf`) | metres by definition | y by definition, turned to z | applied |
//!
//! For y up the rotation is `(x, y, z) -> (x, -z, y)`. Viewers differ here: for glTF, RViz (since
//! 2025), Drake and Blender rotate, older RViz does not; for COLLADA, RViz and Gazebo ignore
//! `<up_axis>`, so that some robot files have a wrong one: [`UpAxis::Ignored`] reads them. The
//! scale of the URDF is applied last ([`TriangleMesh::scaled`]).
//!
//! Start at [`load_mesh`]; every reader fills a `Draft`. Not here: finding files (`resolve`),
//! placing shapes on links ([`crate::Visual`]).

mod collada;
mod gltf_file;
mod mass;
mod obj;
mod section;
mod stl;

use std::path::{Component, Path, PathBuf};

use flexarm_files::read_file;
use flexarm_kinematics::Pose;
use flexarm_settings::Finding;
use nalgebra::{Matrix3, Matrix4, Vector3};

pub use mass::MassProperties;
pub use section::{CrossSection, cross_section};

/// Maximum number of triangles including instances; more are rejected as malicious.
const MAX_TRIANGLES: usize = 50_000_000;
/// Maximum nesting depth of scene nodes; a deeper one is treated as a cycle.
const MAX_DEPTH: usize = 64;
/// Maximum number of scene nodes including instances; more are rejected as malicious.
const MAX_INSTANCES: usize = 100_000;

/// Maximum file size (bytes): 20 million triangles of a binary STL.
const MAX_BYTES: u64 = 1 << 30;

/// Triangles with shared vertices; counter-clockwise viewed from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertices in m.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one for each vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Diffuse colour of the largest part, red, green, blue, alpha from 0 to 1.
    pub color: Option<[f32; 4]>,
}

/// Error about a mesh file.
fn mesh_error(place: impl std::fmt::Display, message: impl Into<String>) -> Box<Finding> {
    Box::new(Finding::error("mesh", place.to_string(), message, ""))
}

/// Error about a feature of the format that is not read.
fn unsupported(path: &Path, feature: impl std::fmt::Display) -> Box<Finding> {
    mesh_error(path.display(), format!("{feature} are not supported; export plain triangles"))
}

/// Error about a file that cannot be read.
fn unreadable(path: &Path, error: impl std::fmt::Display) -> Box<Finding> {
    mesh_error(path.display(), format!("cannot be read: {error}"))
}

/// Treatment of the `<up_axis>` of a COLLADA file; not applicable to other formats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// Rotates the mesh from the declared up axis to z, as specified by COLLADA.
    #[default]
    Declared,
    /// Uses the coordinates as they are, like RViz and Gazebo.
    Ignored,
}

/// Reads a mesh according to its format, which is recognised by the extension, otherwise by the
/// content.
///
/// Returns the mesh in m, in the axes of the URDF's visual frame V, without the scale of the URDF.
///
/// # Errors
/// Finding with the place and what is wrong; arbitrary bytes never cause a panic.
pub fn load_mesh(path: impl AsRef<Path>, up_axis: UpAxis) -> Result<TriangleMesh, Box<Finding>> {
    load_with_remarks(path.as_ref(), up_axis).map(|loaded| loaded.mesh)
}

/// A mesh and remarks on how it was read.
#[derive(Debug)]
#[doc(hidden)]
pub struct Loaded {
    pub mesh: TriangleMesh,
    pub remarks: Vec<String>,
}

/// [`load_mesh`] with remarks on what was left out.
pub fn load_with_remarks(path: &Path, up_axis: UpAxis) -> Result<Loaded, Box<Finding>> {
    decode(&read_file(path, MAX_BYTES).map_err(|error| unreadable(path, error))?, path, up_axis)
}

/// Decodes the bytes of a mesh file; `path` gives the extension, the name for messages, and the
/// folder of further files.
#[doc(hidden)]
pub fn decode(bytes: &[u8], path: &Path, up_axis: UpAxis) -> Result<Loaded, Box<Finding>> {
    let mut remarks = Vec::new();
    let mesh = match format(bytes, path) {
        Some(Format::Stl) => stl::decode(bytes, path),
        Some(Format::Obj) => obj::decode(bytes, path, &mut remarks),
        Some(Format::Collada) => collada::decode(bytes, path, up_axis, &mut remarks),
        Some(Format::Gltf) => gltf_file::decode(bytes, path),
        None => Err(mesh_error(path.display(), "unknown mesh format, expected STL, OBJ, DAE, GLB or GLTF")),
    }?;
    check(&mesh, path)?;
    Ok(Loaded { mesh, remarks })
}

/// Checks that a file that a mesh names is inside the mesh's robot or package: the nearest folder
/// above the mesh with a `robot.toml` or `package.xml`, else the folder of the mesh. Links count as
/// what they point to.
///
/// # Errors
/// The reason why the file must not be read.
fn check_inside(mesh: &Path, file: &Path) -> Result<(), String> {
    let folder = mesh.parent().unwrap_or(Path::new(""));
    let beside = Path::new(".").join(folder);
    let beside = beside.canonicalize().unwrap_or(beside);
    let inside = beside.join(file.strip_prefix(folder).unwrap_or(file));
    let named = inside.canonicalize().unwrap_or_else(|_| without_parents(&inside));
    let top = |folder: &Path| {
        let is_top = |above: &&Path| ["robot.toml", "package.xml"].iter().any(|name| above.join(name).is_file());
        folder.ancestors().find(is_top).unwrap_or(folder).to_owned()
    };
    // Installed meshes may be links to those of the sources.
    let source = mesh.canonicalize().ok().and_then(|mesh| Some(top(mesh.parent()?)));
    let own = top(&beside);
    if named.starts_with(&own) || source.is_some_and(|top| named.starts_with(top)) {
        return Ok(());
    }
    let (file, own) = (file.display(), own.display());
    Err(format!("{file}, which it names, is outside {own} and is not read: copy it beside the mesh"))
}

/// Removes each `..` with the folder before it.
fn without_parents(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => _ = plain.pop(),
            part => plain.push(part),
        }
    }
    plain
}

enum Format {
    Stl,
    Obj,
    Collada,
    Gltf,
}

fn format(bytes: &[u8], path: &Path) -> Option<Format> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("stl" | "stla" | "stlb") => return Some(Format::Stl),
        Some("obj") => return Some(Format::Obj),
        Some("dae") => return Some(Format::Collada),
        Some("glb" | "gltf") => return Some(Format::Gltf),
        _ => {}
    }
    let head = &bytes[..bytes.len().min(1024)];
    let contains = |needle: &[u8]| head.windows(needle.len()).any(|w| w == needle);
    if bytes.starts_with(b"glTF") {
        Some(Format::Gltf)
    } else if contains(b"<COLLADA") {
        Some(Format::Collada)
    } else if bytes.starts_with(b"solid") || stl::has_binary_size(bytes) {
        Some(Format::Stl)
    } else {
        None
    }
}

/// Checks the invariants of every reader: indices in range, finite numbers, at least one triangle.
fn check(mesh: &TriangleMesh, path: &Path) -> Result<(), Box<Finding>> {
    let malformed = |reason: String| mesh_error(path.display(), format!("not a sound mesh file: {reason}"));
    if mesh.triangles.is_empty() {
        return Err(mesh_error(path.display(), "there are no triangles in it"));
    }
    let count = mesh.positions.len();
    if let Some(index) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= count) {
        return Err(malformed(format!("a triangle uses vertex {index} of {count}")));
    }
    if let Some(p) = mesh.positions.iter().find(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(malformed(format!("the vertex {p:?} is not finite")));
    }
    Ok(())
}

impl TriangleMesh {
    /// Returns the mesh as a binary STL file, with normals computed from the triangles.
    ///
    /// # Panics
    /// If a triangle has an index beyond `positions`; meshes that were read have none.
    pub fn to_stl(&self) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for triangle in &self.triangles {
            let corners = triangle.map(|k| Vector3::from(self.positions[k as usize]));
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let normal = normal.try_normalize(0.0).unwrap_or_default();
            let numbers = std::iter::once(normal).chain(corners).flat_map(|v: Vector3<f32>| [v.x, v.y, v.z]);
            bytes.extend(numbers.flat_map(f32::to_le_bytes));
            bytes.extend([0; 2]);
        }
        bytes
    }

    /// Scales along the axes by `scale`, whose entries are not zero; negative ones mirror, and the
    /// triangles keep their outward side. Normals are scaled by the inverse, since they are
    /// orthogonal to the surface.
    pub fn scaled(mut self, scale: &Vector3<f64>) -> Self {
        for p in &mut self.positions {
            *p = std::array::from_fn(|i| (f64::from(p[i]) * scale[i]) as f32);
        }
        if let Some(normals) = &mut self.normals {
            for n in normals {
                let stretched = Vector3::from_fn(|i, _| f64::from(n[i]) / scale[i]);
                *n = unit_normal(stretched);
            }
        }
        if scale.product() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// Transforms a mesh given in B to A; `X_AB` is the pose of B in A, with the translation in m.
    pub fn transformed(mut self, X_AB: &Pose) -> Self {
        for p in &mut self.positions {
            let p_A = X_AB * nalgebra::Point3::from(p.map(f64::from));
            *p = p_A.coords.map(|x| x as f32).into();
        }
        if let Some(normals) = &mut self.normals {
            for n in normals {
                *n = (X_AB.rotation * Vector3::from(n.map(f64::from))).map(|x| x as f32).into();
            }
        }
        self
    }

    /// Returns the minimum and maximum corner (m) of the bounding box of all vertices, in the axes
    /// of the mesh; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let mut points = self.positions.iter().map(|p| Vector3::from(p.map(f64::from)));
        let first = points.next()?;
        Some(points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p))))
    }
}

/// Normalised vector, or +z if it has no direction.
fn unit_normal(n: Vector3<f64>) -> [f32; 3] {
    n.try_normalize(1e-300)
        .filter(|n| n.iter().all(|x| x.is_finite()))
        .unwrap_or_else(Vector3::z)
        .map(|x| x as f32)
        .into()
}

/// Axes x, y, z of a file with y up, as columns in axes with z up.
fn y_up() -> Matrix3<f64> {
    Matrix3::from_columns(&[Vector3::x(), Vector3::z(), -Vector3::y()])
}

/// A mesh while its file is read.
#[derive(Default)]
struct Draft {
    mesh: TriangleMesh,
    /// Normals of the vertices that have one.
    normals: Vec<[f32; 3]>,
    /// Colour and number of triangles of each part.
    colors: Vec<(Option<[f32; 4]>, usize)>,
}

impl Draft {
    /// Returns the mesh with the colour of most triangles, and with normals if every vertex has a
    /// unit vector; many STL files have zeros.
    fn finish(mut self) -> TriangleMesh {
        let mut totals: Vec<([f32; 4], usize)> = Vec::new();
        for (color, count) in self.colors {
            let Some(color) = color else { continue };
            match totals.iter_mut().find(|(c, _)| *c == color) {
                Some((_, total)) => *total += count,
                None => totals.push((color, count)),
            }
        }
        self.mesh.color = totals.into_iter().max_by_key(|(_, total)| *total).map(|(color, _)| color);
        let is_unit = |n: &[f32; 3]| (n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-2;
        let usable = !self.normals.is_empty() && self.normals.len() == self.mesh.positions.len();
        self.mesh.normals = Some(self.normals).filter(|normals| usable && normals.iter().all(is_unit));
        self.mesh
    }
}

/// Transform `T_VG` of a part from its frame G to the visual frame V, for points, normals and the
/// winding of triangles. It may scale and mirror.
struct Transform {
    T_VG: Matrix4<f64>,
    /// Inverse transpose of the linear part.
    normals: Matrix3<f64>,
    mirrored: bool,
}

impl Transform {
    fn new(T_VG: &Matrix4<f64>) -> Self {
        let linear = T_VG.fixed_view::<3, 3>(0, 0).into_owned();
        let normals = linear.try_inverse().map_or_else(Matrix3::identity, |inverse| inverse.transpose());
        Self { T_VG: *T_VG, normals, mirrored: linear.determinant() < 0.0 }
    }

    fn point(&self, p_G: &Vector3<f64>) -> [f32; 3] {
        (self.T_VG * p_G.push(1.0)).xyz().map(|x| x as f32).into()
    }

    fn normal(&self, n_G: &Vector3<f64>) -> [f32; 3] {
        unit_normal(self.normals * n_G)
    }

    fn winding(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }
}
