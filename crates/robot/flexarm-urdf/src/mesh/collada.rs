//! COLLADA 1.4/1.5: triangles and polylists of the visual scene, in metres, z up, node transforms
//! applied.
//!
//! `mesh_loader` reads COLLADA too, but it draws a geometry with several instances only once, does
//! not rotate normals, ignores the up axis and panics on some broken files. Not supported: skins,
//! textures, curves, line sets.
//!
//! Frames: G geometry, N node, V the URDF's visual frame. `T_VG` includes the unit.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Matrix3, Matrix4, Rotation3, Unit, Vector3, Vector4};
use roxmltree::{Document, Node};

use flexarm_settings::{Finding, Place};

use super::{MAX_TRIANGLES, TriangleMesh, UpAxis, dominant_color, mesh_error, stl, unit_normal};

/// Maximum nesting depth of nodes; a deeper one is treated as a cycle of `<instance_node>`.
const MAX_DEPTH: usize = 64;
/// Maximum number of nodes in one scene; more are rejected as malicious.
const MAX_INSTANCES: usize = 100_000;

/// Transform of a node for points, normals and the winding of triangles.
pub(super) struct Transform {
    pub(super) T: Matrix4<f64>,
    /// Inverse transpose of the linear part.
    normals: Matrix3<f64>,
    mirrored: bool,
}

impl Transform {
    pub(super) fn new(T: &Matrix4<f64>) -> Self {
        let linear = T.fixed_view::<3, 3>(0, 0).into_owned();
        let normals = linear.try_inverse().map_or_else(Matrix3::identity, |inverse| inverse.transpose());
        Self { T: *T, normals, mirrored: linear.determinant() < 0.0 }
    }

    pub(super) fn normal(&self, n: &Vector3<f64>) -> [f32; 3] {
        unit_normal(self.normals * n)
    }

    pub(super) fn winding(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }
}

pub(super) fn decode(
    bytes: &[u8],
    path: &Path,
    up_axis: UpAxis,
    remarks: &mut Vec<String>,
) -> Result<TriangleMesh, Box<Finding>> {
    let malformed = |reason: String| mesh_error(path.display(), format!("not a sound COLLADA file: {}", reason));
    let text = std::str::from_utf8(bytes).map_err(|error| malformed(error.to_string()))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let document = Document::parse(text).map_err(|error| {
        let place = Place::of_file(path.display()).at(error.pos().row as usize, error.pos().col as usize);
        mesh_error(place, format!("not a sound COLLADA file: {error}"))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(malformed(format!("the root element is <{}>", root.tag_name().name())));
    }

    let ids = root.descendants().filter_map(|n| n.attribute("id").map(|id| (id, n))).collect();
    let mut reader = Reader {
        path,
        document: &document,
        ids,
        mesh: TriangleMesh::default(),
        normals: Vec::new(),
        colors: Vec::new(),
        instances: 0,
        unsupported: None,
    };
    let T_V = asset_transform(root, up_axis, remarks);
    let scene = named(root, "scene").and_then(|s| named(s, "instance_visual_scene"));
    match scene.and_then(|s| reader.target(s, "url")) {
        Some(scene) => reader.children(scene, &T_V, 0)?,
        // A library without a scene: every geometry once, in its own frame.
        None => {
            for geometry in root.descendants().filter(|n| n.has_tag_name_of("geometry")) {
                reader.geometry(geometry, &T_V, &HashMap::new())?;
            }
        }
    }

    let Reader { mut mesh, normals, colors, unsupported, .. } = reader;
    if let (true, Some(feature)) = (mesh.triangles.is_empty(), &unsupported) {
        return Err(super::unsupported(path, format!("<{feature}> of COLLADA")));
    }
    if let Some(feature) = unsupported {
        remarks.push(format!("its <{feature}> parts are left out"));
    }
    mesh.color = dominant_color(&colors);
    if normals.len() == mesh.positions.len() {
        mesh.normals = stl::usable(normals);
    }
    Ok(mesh)
}

/// Transform from the file's coordinates to metres with z up, from the unit and up axis of the
/// file.
fn asset_transform(root: Node<'_, '_>, up_axis: UpAxis, remarks: &mut Vec<String>) -> Matrix4<f64> {
    let asset = named(root, "asset");
    let meter = asset
        .and_then(|a| named(a, "unit"))
        .and_then(|u| u.attribute("meter"))
        .and_then(|m| m.trim().parse::<f64>().ok())
        .filter(|m| m.is_finite() && *m > 0.0)
        .unwrap_or(1.0);
    if up_axis == UpAxis::Ignored {
        return Matrix4::new_scaling(meter);
    }
    let up = asset.and_then(|a| named(a, "up_axis")).and_then(|u| u.text()).map_or("Y_UP", str::trim);
    // x, y, z of the file in V, as columns
    let R = match up {
        "Z_UP" => Matrix3::identity(),
        "X_UP" => Matrix3::from_columns(&[Vector3::z(), -Vector3::x(), -Vector3::y()]),
        _ => Matrix3::from_columns(&[Vector3::x(), Vector3::z(), -Vector3::y()]),
    };
    if up != "Z_UP" {
        remarks.push(format!(
            "{up} is turned to z up; RViz and Gazebo ignore the up axis: compare pictures, and ignore it too if the mesh is oriented wrongly"
        ));
    }
    (R * meter).to_homogeneous()
}

struct Reader<'a, 'i> {
    path: &'a Path,
    document: &'a Document<'i>,
    ids: HashMap<&'a str, Node<'a, 'i>>,
    mesh: TriangleMesh,
    normals: Vec<[f32; 3]>,
    colors: Vec<(Option<[f32; 4]>, usize)>,
    instances: usize,
    /// First unsupported kind of primitive, which is omitted.
    unsupported: Option<String>,
}

/// Map from material symbol to material element.
type Bindings<'a, 'i> = HashMap<&'a str, Node<'a, 'i>>;

impl<'a, 'i> Reader<'a, 'i> {
    fn malformed(&self, node: Node<'_, '_>, reason: impl std::fmt::Display) -> Box<Finding> {
        let at = self.document.text_pos_at(node.range().start);
        let place = Place::of_file(self.path.display()).at(at.row as usize, at.col as usize);
        mesh_error(place, format!("not a sound COLLADA file: {reason}"))
    }

    /// Element that a `#id` attribute refers to.
    fn target(&self, node: Node<'_, '_>, attribute: &str) -> Option<Node<'a, 'i>> {
        self.ids.get(node.attribute(attribute)?.trim().strip_prefix('#')?).copied()
    }

    /// Adds everything below a node or scene, whose own transform is already in `T`.
    fn children(&mut self, parent: Node<'a, 'i>, T: &Matrix4<f64>, depth: usize) -> Result<(), Box<Finding>> {
        self.instances += 1;
        if depth > MAX_DEPTH || self.instances > MAX_INSTANCES {
            return Err(self.malformed(parent, "the nodes form a cycle or are far too many"));
        }
        for child in elements(parent) {
            match child.tag_name().name() {
                "node" => self.children(child, &(T * self.local(child)?), depth + 1)?,
                "instance_node" => {
                    if let Some(node) = self.target(child, "url") {
                        self.children(node, &(T * self.local(node)?), depth + 1)?;
                    }
                }
                "instance_geometry" => {
                    let Some(geometry) = self.target(child, "url") else {
                        return Err(self.malformed(child, "it refers to a geometry that does not exist"));
                    };
                    let bound = child.descendants().filter(|n| n.has_tag_name_of("instance_material"));
                    let materials =
                        bound.filter_map(|m| Some((m.attribute("symbol")?, self.target(m, "target")?))).collect();
                    self.geometry(geometry, T, &materials)?;
                }
                "instance_controller" => self.unsupported = Some("instance_controller".to_owned()),
                _ => {}
            }
        }
        Ok(())
    }

    /// Product of the transform elements of a node, in order.
    fn local(&self, node: Node<'a, 'i>) -> Result<Matrix4<f64>, Box<Finding>> {
        let mut T = Matrix4::identity();
        for element in elements(node) {
            let numbers = |n: usize| {
                let values = floats(element.text().unwrap_or(""));
                values.filter(|v| v.len() == n).ok_or_else(|| self.malformed(element, format!("expected {n} numbers")))
            };
            T *= match element.tag_name().name() {
                "matrix" => Matrix4::from_row_slice(&numbers(16)?),
                "translate" => Matrix4::new_translation(&Vector3::from_row_slice(&numbers(3)?)),
                "scale" => Matrix4::new_nonuniform_scaling(&Vector3::from_row_slice(&numbers(3)?)),
                "rotate" => {
                    let v = numbers(4)?;
                    let axis = Unit::try_new(Vector3::new(v[0], v[1], v[2]), 1e-12);
                    let R = axis.map(|axis| Rotation3::from_axis_angle(&axis, v[3].to_radians()));
                    R.map_or_else(Matrix4::identity, |R| R.to_homogeneous())
                }
                "lookat" | "skew" => {
                    let reason = format!("<{}> is not supported", element.tag_name().name());
                    return Err(self.malformed(element, reason));
                }
                _ => continue,
            };
        }
        Ok(T)
    }

    fn geometry(
        &mut self,
        geometry: Node<'a, 'i>,
        T_VG: &Matrix4<f64>,
        materials: &Bindings<'a, 'i>,
    ) -> Result<(), Box<Finding>> {
        let Some(mesh) = named(geometry, "mesh") else { return Ok(()) };
        let transform = Transform::new(T_VG);
        for primitive in elements(mesh) {
            match primitive.tag_name().name() {
                "triangles" | "polylist" => {
                    let count = self.primitive(primitive, &transform)?;
                    let color = primitive.attribute("material").and_then(|symbol| materials.get(symbol).copied());
                    self.colors.push((color.and_then(|material| self.color(material)), count));
                    if self.mesh.triangles.len() > MAX_TRIANGLES {
                        return Err(self.malformed(primitive, "more than 50 million triangles"));
                    }
                }
                kind @ ("polygons" | "trifans" | "tristrips") => self.unsupported = Some(kind.to_owned()),
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds one `<triangles>` or `<polylist>`; returns the number of triangles.
    fn primitive(&mut self, primitive: Node<'a, 'i>, transform: &Transform) -> Result<usize, Box<Finding>> {
        let inputs: Vec<Input> = elements(primitive)
            .filter(|n| n.tag_name().name() == "input")
            .map(|n| self.input(n))
            .collect::<Result<_, _>>()?;
        let stride = inputs.iter().map(|i| i.offset + 1).max().unwrap_or(1);
        let find = |semantic: &str| inputs.iter().find(|i| i.semantic == semantic);
        let Some(positions) = find("POSITION") else {
            return Err(self.malformed(primitive, "no input of POSITION or VERTEX"));
        };
        let normals = find("NORMAL");

        let indices = named(primitive, "p").map_or(Some(Vec::new()), |p| integers(p.text().unwrap_or("")));
        let indices = indices.ok_or_else(|| self.malformed(primitive, "<p> holds something else than indices"))?;
        let corners = indices.len() / stride;
        let sizes = match named(primitive, "vcount") {
            Some(counts) => integers(counts.text().unwrap_or(""))
                .ok_or_else(|| self.malformed(counts, "<vcount> holds something else than counts"))?,
            None => vec![3; corners / 3],
        };

        // Vertices with the same position and normal are shared.
        let mut vertices: HashMap<(u32, u32), u32> = HashMap::new();
        let mut count = 0;
        let mut first = 0usize;
        for size in sizes {
            let size = size as usize;
            if size > corners - first {
                return Err(self.malformed(primitive, format!("{corners} corners, fewer than the polygons need")));
            }
            let mut polygon = Vec::with_capacity(size);
            for corner in first..first + size {
                let index = |input: &Input| indices[corner * stride + input.offset];
                let key = (index(positions), normals.map_or(0, index));
                let next = self.mesh.positions.len() as u32;
                let vertex = *vertices.entry(key).or_insert(next);
                if vertex == next {
                    let p = positions.vector(key.0).ok_or_else(|| self.beyond(primitive, key.0))?;
                    let q = transform.T * Vector4::new(p.x, p.y, p.z, 1.0);
                    self.mesh.positions.push([q.x as f32, q.y as f32, q.z as f32]);
                    if let Some(input) = normals {
                        let n = input.vector(key.1).ok_or_else(|| self.beyond(primitive, key.1))?;
                        self.normals.push(transform.normal(&n));
                    }
                }
                polygon.push(vertex);
            }
            // Triangle fan: exact for convex polygons, which exporters write.
            for k in 2..size {
                self.mesh.triangles.push(transform.winding([polygon[0], polygon[k - 1], polygon[k]]));
                count += 1;
            }
            first += size;
        }
        Ok(count)
    }

    fn beyond(&self, primitive: Node<'_, '_>, index: u32) -> Box<Finding> {
        self.malformed(primitive, format!("index {index} is beyond its source"))
    }

    /// Reads an `<input>`; for VERTEX, the positions that it refers to.
    fn input(&self, node: Node<'a, 'i>) -> Result<Input, Box<Finding>> {
        let offset = node.attribute("offset").and_then(|o| o.trim().parse().ok()).unwrap_or(0usize);
        if offset > 64 {
            return Err(self.malformed(node, "an offset above 64"));
        }
        let mut semantic = node.attribute("semantic").unwrap_or("");
        let mut source = self.target(node, "source");
        if semantic == "VERTEX" {
            let position = source.into_iter().flat_map(elements).find(|n| n.attribute("semantic") == Some("POSITION"));
            semantic = "POSITION";
            source = position.and_then(|p| self.target(p, "source"));
        }
        let mut input = Input { semantic: semantic.to_owned(), offset, stride: 3, values: Vec::new() };
        if !matches!(semantic, "POSITION" | "NORMAL") {
            return Ok(input);
        }
        let Some(source) = source else { return Err(self.malformed(node, format!("no source of {semantic}"))) };
        let array = named(source, "float_array").map(|a| floats(a.text().unwrap_or("")));
        input.values = array
            .flatten()
            .ok_or_else(|| self.malformed(source, "no <float_array>, or something else than numbers in it"))?;
        let accessor = source.descendants().find(|n| n.tag_name().name() == "accessor");
        let stride = accessor.and_then(|a| a.attribute("stride")).and_then(|s| s.trim().parse().ok());
        input.stride = stride.filter(|s: &usize| (3..=64).contains(s)).unwrap_or(3);
        Ok(input)
    }

    /// Diffuse colour of a material.
    fn color(&self, material: Node<'a, 'i>) -> Option<[f32; 4]> {
        let effect = self.target(named(material, "instance_effect")?, "url")?;
        let diffuse = effect.descendants().find(|n| n.tag_name().name() == "diffuse")?;
        let values = floats(named(diffuse, "color")?.text()?)?;
        let [r, g, b, a] = <[f64; 4]>::try_from(values).ok()?;
        Some([r, g, b, a].map(|v| v.clamp(0.0, 1.0) as f32))
    }
}

struct Input {
    semantic: String,
    offset: usize,
    stride: usize,
    values: Vec<f64>,
}

impl Input {
    fn vector(&self, index: u32) -> Option<Vector3<f64>> {
        let start = (index as usize).checked_mul(self.stride)?;
        self.values.get(start..start.checked_add(3)?).map(Vector3::from_row_slice)
    }
}

trait TagName {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl TagName for Node<'_, '_> {
    /// Compares the local name regardless of the namespace, which differs between 1.4 and 1.5.
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

fn elements<'a, 'i: 'a>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

fn named<'a, 'i: 'a>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    elements(node).find(|n| n.tag_name().name() == name)
}

fn floats(text: &str) -> Option<Vec<f64>> {
    text.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
}

fn integers(text: &str) -> Option<Vec<u32>> {
    text.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
}
