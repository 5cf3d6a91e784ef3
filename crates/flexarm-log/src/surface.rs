//! Surfaces made ready to be drawn: corners shared where the surface is smooth, split where it has an edge.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::LinkMesh;

/// Faces that meet at a smaller angle than this are drawn as one round surface (rad).
const CREASE_RAD: f64 = 0.6;

impl LinkMesh {
    /// The same surface with normals of its own making: triangle soup (STL) becomes a mesh with shared corners, which
    /// looks round where it is round and takes a third of the space.
    #[must_use]
    pub fn with_creases(mut self) -> Self {
        let point = |k: u32| Vector3::from(self.positions[k as usize].map(f64::from));
        let normal_of = |[a, b, c]: [u32; 3]| (point(b) - point(a)).cross(&(point(c) - point(a)));
        let area_normals: Vec<Vector3<f64>> = self.triangles.iter().map(|t| normal_of(*t)).collect();

        // Per place: corners made so far, each with the direction that opened it and its sum of normals.
        let mut made: HashMap<[u32; 3], Vec<(Vector3<f64>, usize)>> = HashMap::new();
        let (mut positions, mut sums): (Vec<[f32; 3]>, Vec<Vector3<f64>>) = (Vec::new(), Vec::new());
        let mut triangles = Vec::with_capacity(self.triangles.len());
        for (triangle, normal) in self.triangles.iter().zip(&area_normals) {
            let Some(direction) = normal.try_normalize(1e-18) else { continue };
            let corners = triangle.map(|corner| {
                let position = self.positions[corner as usize];
                // -0 and 0 are the same place.
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

    /// The part of the surface whose triangles are wanted, without corners that no triangle uses.
    pub(crate) fn part(&self, wanted: impl Fn(&[u32; 3]) -> bool) -> Self {
        let with_normals = self.normals.len() == self.positions.len();
        let mut new_index: HashMap<u32, u32> = HashMap::new();
        let mut part = Self { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new(), ..self.clone() };
        for triangle in self.triangles.iter().filter(|t| wanted(t)) {
            let corners = triangle.map(|corner| {
                *new_index.entry(corner).or_insert_with(|| {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn soup(corners: &[[f32; 3]]) -> LinkMesh {
        LinkMesh {
            link: 0,
            name: "soup".into(),
            positions: corners.to_vec(),
            normals: Vec::new(),
            triangles: (0..corners.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
            color: [1.0; 4],
            file: None,
        }
    }

    #[test]
    fn flat_neighbours_share_corners_and_edges_keep_their_own() {
        let (o, x, y, z, xy) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
        // A square of two triangles, and a wall that stands on its edge o-y.
        let mesh = soup(&[o, x, xy, o, xy, y, o, y, z]).with_creases();
        assert_eq!(mesh.positions.len(), 4 + 3);
        assert_eq!(mesh.triangles.len(), 3);
        assert!(mesh.normals[..4].iter().all(|n| *n == [0.0, 0.0, 1.0]));
        assert!(mesh.normals[4..].iter().all(|n| *n == [1.0, 0.0, 0.0]));
    }

    #[test]
    fn a_part_has_only_its_own_corners() {
        let mesh = soup(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0; 3], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0]]);
        let part = mesh.part(|t| t[0] == 3);
        assert_eq!((part.positions.len(), part.triangles.clone()), (3, vec![[0, 1, 2]]));
        assert_eq!(part.positions[0], [5.0; 3]);
    }
}
