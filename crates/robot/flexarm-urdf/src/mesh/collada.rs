//! COLLADA 1.4/1.5: triangles and polylists of the visual scene, in metres, z up, node transforms
//! applied.
//!
//! `mesh_loader` reads COLLADA too, but it draws a geometry with several instances only once, does
//! not rotate normals, ignores the up axis and panics on some broken files. Not supported: skins,
//! textures, curves, line sets.
//!
//! Frames: G geometry, N node, F the file's axes and unit, V the URDF's visual frame in m. Elements
//! are compared by local names, since the namespace differs between 1.4 and 1.5.

use std::collections::HashMap;
use std::path::Path;
use std::str::FromStr;

use flexarm_settings::{Finding, Place};
use nalgebra::{Matrix3, Matrix4, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node};

use super::{Draft, MAX_DEPTH, MAX_INSTANCES, MAX_TRIANGLES, Transform, TriangleMesh, UpAxis, mesh_error, y_up};
use crate::xml::{elements, named};

pub(super) fn decode(
    bytes: &[u8],
    path: &Path,
    up_axis: UpAxis,
    remarks: &mut Vec<String>,
) -> Result<TriangleMesh, Box<Finding>> {
    let malformed = |reason: String| mesh_error(path.display(), format!("not a sound COLLADA file: {reason}"));
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
    let mut reader =
        Reader { path, document: &document, ids, draft: Draft::default(), instances: 0, unsupported: None };
    let T_VF = asset_transform(root, up_axis, remarks);
    let scene = named(root, "scene").and_then(|s| named(s, "instance_visual_scene"));
    match scene.and_then(|s| reader.target(s, "url")) {
        Some(scene) => reader.children(scene, &T_VF, 0)?,
        // A library without a scene: every geometry once, in its own frame.
        None => {
            for geometry in root.descendants().filter(|n| n.tag_name().name() == "geometry") {
                reader.geometry(geometry, &T_VF, &HashMap::new())?;
            }
        }
    }

    let Reader { draft, unsupported, .. } = reader;
    if let Some(feature) = unsupported {
        if draft.mesh.triangles.is_empty() {
            return Err(super::unsupported(path, format!("<{feature}> of COLLADA")));
        }
        remarks.push(format!("its <{feature}> parts are left out"));
    }
    Ok(draft.finish())
}

/// Transform `T_VF` from the file's coordinates to metres with z up, from the unit and up axis of
/// the file.
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
    // Rotation that brings the up axis of the file to z.
    let R_VF = match up {
        "Z_UP" => Matrix3::identity(),
        "X_UP" => Matrix3::from_columns(&[Vector3::z(), -Vector3::x(), -Vector3::y()]),
        _ => y_up(),
    };
    if up != "Z_UP" {
        remarks.push(format!(
            "{up} is turned to z up; RViz and Gazebo ignore the up axis: compare pictures, and ignore it too if the mesh is oriented wrongly"
        ));
    }
    (R_VF * meter).to_homogeneous()
}

struct Reader<'a, 'i> {
    path: &'a Path,
    document: &'a Document<'i>,
    ids: HashMap<&'a str, Node<'a, 'i>>,
    draft: Draft,
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

    /// Adds everything below a node N or scene; `T_VN` contains its own transform.
    fn children(&mut self, parent: Node<'a, 'i>, T_VN: &Matrix4<f64>, depth: usize) -> Result<(), Box<Finding>> {
        self.instances += 1;
        if depth > MAX_DEPTH || self.instances > MAX_INSTANCES {
            return Err(self.malformed(parent, "the nodes form a cycle or are far too many"));
        }
        for child in elements(parent) {
            match child.tag_name().name() {
                "node" => self.children(child, &(T_VN * self.local(child)?), depth + 1)?,
                "instance_node" => {
                    if let Some(node) = self.target(child, "url") {
                        self.children(node, &(T_VN * self.local(node)?), depth + 1)?;
                    }
                }
                "instance_geometry" => {
                    let Some(geometry) = self.target(child, "url") else {
                        return Err(self.malformed(child, "it refers to a geometry that does not exist"));
                    };
                    // Materials bound to the symbols of the geometry.
                    let bound = child.descendants().filter(|n| n.tag_name().name() == "instance_material");
                    let materials =
                        bound.filter_map(|m| Some((m.attribute("symbol")?, self.target(m, "target")?))).collect();
                    self.geometry(geometry, T_VN, &materials)?;
                }
                "instance_controller" => self.unsupported = Some("instance_controller".to_owned()),
                _ => {}
            }
        }
        Ok(())
    }

    /// Product of the transform elements of a node, in order: its pose in the parent node.
    fn local(&self, node: Node<'a, 'i>) -> Result<Matrix4<f64>, Box<Finding>> {
        let mut T = Matrix4::identity();
        for element in elements(node) {
            let numbers = |n: usize| {
                let values = numbers_in::<f64>(element.text().unwrap_or(""));
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

    /// Adds the triangles of a geometry G, with the colours of their materials; other primitives
    /// are noted.
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
                    self.draft.colors.push((color.and_then(|material| self.color(material)), count));
                    if self.draft.mesh.triangles.len() > MAX_TRIANGLES {
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

        let indices = named(primitive, "p").map_or(Some(Vec::new()), |p| numbers_in::<u32>(p.text().unwrap_or("")));
        let indices = indices.ok_or_else(|| self.malformed(primitive, "<p> holds something else than indices"))?;
        let corners = indices.len() / stride;
        let sizes: Vec<usize> = match named(primitive, "vcount") {
            Some(counts) => numbers_in(counts.text().unwrap_or(""))
                .ok_or_else(|| self.malformed(counts, "<vcount> holds something else than counts"))?,
            None => vec![3; corners / 3],
        };

        // Vertices with the same position and normal are shared.
        let mut vertices: HashMap<(u32, u32), u32> = HashMap::new();
        let mut count = 0;
        let mut first = 0usize;
        for size in sizes {
            if size > corners - first {
                return Err(self.malformed(primitive, format!("{corners} corners, fewer than the polygons need")));
            }
            let mut polygon = Vec::with_capacity(size);
            for corner in first..first + size {
                let index = |input: &Input| indices[corner * stride + input.offset];
                let key = (index(positions), normals.map_or(0, index));
                let next = self.draft.mesh.positions.len() as u32;
                let vertex = *vertices.entry(key).or_insert(next);
                if vertex == next {
                    let p_G = positions.vector(key.0).ok_or_else(|| self.beyond(primitive, key.0))?;
                    self.draft.mesh.positions.push(transform.point(&p_G));
                    if let Some(input) = normals {
                        let n_G = input.vector(key.1).ok_or_else(|| self.beyond(primitive, key.1))?;
                        self.draft.normals.push(transform.normal(&n_G));
                    }
                }
                polygon.push(vertex);
            }
            // Triangle fan: exact for convex polygons, which exporters write.
            for k in 2..size {
                self.draft.mesh.triangles.push(transform.winding([polygon[0], polygon[k - 1], polygon[k]]));
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
        let array = named(source, "float_array").map(|a| numbers_in(a.text().unwrap_or("")));
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
        let values = numbers_in(named(diffuse, "color")?.text()?)?;
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

/// All words of a text as numbers; `None` if one is something else.
fn numbers_in<T: FromStr>(text: &str) -> Option<Vec<T>> {
    text.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
}
