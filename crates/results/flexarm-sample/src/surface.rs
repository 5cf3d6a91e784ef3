//! Preparation of surfaces for drawing: corners are shared where the surface is smooth, and split
//! at edges.
//!
//! Start at `LinkMesh::with_creases`. Link axes, m, single precision. Not here: reading mesh files
//! (`flexarm-urdf`), drawing.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::LinkMesh;

/// Angle between faces below which they are drawn as one smooth surface (rad).
const CREASE_RAD: f64 = 0.6;

impl LinkMesh {
    /// Returns the same surface with recomputed normals: a triangle soup (STL) becomes a mesh with
    /// shared corners, which looks smooth where it is and takes a third of the space.
    #[must_use]
    pub fn with_creases(mut self) -> Self {
        let point = |k: u32| Vector3::from(self.positions[k as usize].map(f64::from));
        let normal_of = |[a, b, c]: [u32; 3]| (point(b) - point(a)).cross(&(point(c) - point(a)));
        let area_normals: Vec<Vector3<f64>> = self.triangles.iter().map(|t| normal_of(*t)).collect();

        // Per position: corners created so far, each with the direction of its first face and its
        // sum of normals.
        let mut made: HashMap<[u32; 3], Vec<(Vector3<f64>, usize)>> = HashMap::new();
        let (mut positions, mut sums): (Vec<[f32; 3]>, Vec<Vector3<f64>>) = (Vec::new(), Vec::new());
        let mut triangles = Vec::with_capacity(self.triangles.len());
        for (triangle, normal) in self.triangles.iter().zip(&area_normals) {
            let Some(direction) = normal.try_normalize(1e-18) else { continue };
            let corners = triangle.map(|corner| {
                let position = self.positions[corner as usize];
                // -0 and 0 are the same position.
                let place = position.map(|x| (x + 0.0).to_bits());
                let here = made.entry(place).or_default();
                let found = here.iter().find(|(first, _)| first.dot(&direction) > CREASE_RAD.cos()).map(|(_, k)| *k);
                let index = found.unwrap_or_else(|| {
                    here.push((direction, positions.len()));
                    positions.push(position);
                    sums.push(Vector3::zeros());
                    positions.len() - 1
                });
                sums[index] += normal;
                index as u32
            });
            triangles.push(corners);
        }
        let unit = |sum: &Vector3<f64>| sum.try_normalize(0.0).unwrap_or_else(Vector3::z).map(|x| x as f32).into();
        self.normals = sums.iter().map(unit).collect();
        (self.positions, self.triangles) = (positions, triangles);
        self
    }

    /// Returns a similar surface with at most `corners` corners: corners in the same cell of a grid
    /// are merged; the finest sufficient grid is used.
    #[must_use]
    pub fn simplified(self, corners: usize) -> Self {
        if self.positions.len() <= corners {
            return self;
        }
        let extent = |c: usize| {
            let places = || self.positions.iter().map(|p| p[c]);
            places().fold(f32::MIN, f32::max) - places().fold(f32::MAX, f32::min)
        };
        let largest = (0..3).map(extent).fold(0.0, f32::max);
        // Take the finest grid that fits; the coarsest one always does.
        let cells = [256.0, 192.0, 144.0, 108.0, 80.0, 60.0, 45.0, 34.0, 25.0, 19.0, 14.0, 10.0, 7.0, 5.0, 3.0, 2.0];
        let mut coarser = cells.iter().map(|cells| self.clustered(largest / cells));
        coarser.clone().find(|mesh| mesh.positions.len() <= corners).or_else(|| coarser.next_back()).unwrap_or(self)
    }

    fn clustered(&self, cell: f32) -> Self {
        let with_normals = self.normals.len() == self.positions.len();
        // One position per cell for all normals, so that edges stay closed.
        let mut places: HashMap<[i32; 3], [f32; 3]> = HashMap::new();
        let mut corners: HashMap<([i32; 3], [i8; 3]), u32> = HashMap::new();
        let mut to = Self { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new(), ..self.clone() };
        let index: Vec<u32> = (0..self.positions.len())
            .map(|k| {
                let position = self.positions[k];
                let at = position.map(|x| (x / cell).round() as i32);
                let place = *places.entry(at).or_insert(position);
                let normal = if with_normals { self.normals[k] } else { [0.0; 3] };
                *corners.entry((at, normal.map(|x| (2.0 * x).round() as i8))).or_insert_with(|| {
                    to.positions.push(place);
                    if with_normals {
                        to.normals.push(normal);
                    }
                    (to.positions.len() - 1) as u32
                })
            })
            .collect();
        let kept = self.triangles.iter().map(|t| t.map(|k| index[k as usize]));
        let flat = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| to.positions[k as usize]);
            a == b || b == c || c == a
        };
        to.triangles = kept.filter(|t| !flat(t)).collect();
        to
    }

    /// Returns the part of the surface with the wanted triangles, without unused corners.
    pub fn part(&self, wanted: impl Fn(&[u32; 3]) -> bool) -> Self {
        let with_normals = self.normals.len() == self.positions.len();
        let mut new_index = vec![None; self.positions.len()];
        let mut part = Self { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new(), ..self.clone() };
        for triangle in self.triangles.iter().filter(|t| wanted(t)) {
            let corners = triangle.map(|corner| {
                *new_index[corner as usize].get_or_insert_with(|| {
                    part.positions.push(self.positions[corner as usize]);
                    if with_normals {
                        part.normals.push(self.normals[corner as usize]);
                    }
                    (part.positions.len() - 1) as u32
                })
            });
            part.triangles.push(corners);
        }
        part
    }
}

/// Returns the media type of a mesh file by its extension.
#[must_use]
pub fn mesh_media_type(path: &std::path::Path) -> &'static str {
    let extension = path.extension().and_then(std::ffi::OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "stl" => "model/stl",
        "obj" => "model/obj",
        "dae" => "model/vnd.collada+xml",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        _ => "application/octet-stream",
    }
}
