//! The drawable surface of a mesh, and the faces that an interface ties.
//!
//! Start at [`Surface::new`] and [`Surface::tied`]. Positions in link axes, in m; a vertex of the
//! surface is a node of the mesh. Not here: drawing ([`super::scene`]), the skin (`flexarm_fem`).

use nalgebra::Vector3;

use flexarm_fem::Mesh;
use flexarm_fem::mesh::skin;
use flexarm_fem::reduction::Interface;

use super::topology::{feature_edges, prism, triangle_normals};

/// Radius of the rods drawn for beam elements, as a share of the size of the mesh.
const ROD: f64 = 0.008;
/// Number of sides of such a rod.
const ROD_SIDES: u32 = 8;

/// Surface of a mesh: skin of the solids, rods for the beams.
#[derive(Debug)]
pub(super) struct Surface {
    /// Undeformed positions, m.
    pub(super) positions: Vec<Vector3<f64>>,
    /// Node of the mesh that each position moves with.
    pub(super) nodes: Vec<u32>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Face of each triangle of the solids.
    face_of: Vec<u32>,
    /// Corner and mid-side nodes of each face, nodes of the mesh.
    faces: Vec<(Vec<u32>, Vec<u32>)>,
    /// Sharp edges of the body.
    pub(super) features: Vec<[u32; 2]>,
    /// Edges of the faces.
    pub(super) grid: Vec<[u32; 2]>,
    /// Diagonal of the bounding box, m.
    pub(super) size: f64,
}

/// Visible faces that an interface ties.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tied {
    /// Whether each triangle belongs to a tied face.
    pub(super) triangles: Vec<bool>,
    /// Number of faces with all nodes tied.
    pub(super) faces: usize,
    /// Number of faces with all corners but not all mid-side nodes tied.
    pub(super) torn: usize,
    /// Area (m²).
    pub(super) area: f64,
    /// Mean outward normal: of unit length if the faces are flat, shorter if they are curved.
    pub(super) normal: Vector3<f64>,
    /// Centre of the faces, m; of the nodes if there is no face.
    pub(super) centre: Vector3<f64>,
}

impl Surface {
    /// Returns `None` for a mesh without elements.
    pub(super) fn new(mesh: &Mesh) -> Option<Self> {
        let (low, high) = mesh.bounding_box()?;
        let skin = skin(mesh);
        let nodes = skin.nodes();
        let mut vertex_of = vec![u32::MAX; mesh.nodes.len()];
        for (vertex, node) in (0..).zip(&nodes) {
            vertex_of[*node as usize] = vertex;
        }
        let vertex = |node: &u32| vertex_of[*node as usize];
        let triangles: Vec<[u32; 3]> = skin.triangles().iter().map(|t| t.each_ref().map(vertex)).collect();

        let (mut face_of, mut faces, mut grid) = (Vec::with_capacity(triangles.len()), Vec::new(), Vec::new());
        for (number, face) in (0..).zip(skin.faces()) {
            let (c, m) = (face.corners, face.midsides);
            // Same number as in `Skin::triangles`.
            let count = if m.is_empty() { c.len() - 2 } else { 2 * m.len() - 2 };
            face_of.extend(std::iter::repeat_n(number, count));
            faces.push((c.to_vec(), m.to_vec()));
            for k in 0..c.len() {
                let (from, to) = (vertex(&c[k]), vertex(&c[(k + 1) % c.len()]));
                match m.get(k).map(vertex) {
                    Some(middle) => grid.extend([[from, middle], [middle, to]]),
                    None => grid.push([from, to]),
                }
            }
        }
        for edge in &mut grid {
            edge.sort_unstable();
        }
        grid.sort_unstable();
        grid.dedup();

        let positions: Vec<_> = nodes.iter().map(|node| mesh.nodes[*node as usize]).collect();
        let features = feature_edges(&positions, &triangles);
        let size = (high - low).norm();
        let mut surface = Self { positions, nodes, triangles, face_of, faces, features, grid, size };
        for block in mesh.blocks.iter().filter(|block| block.kind.is_beam()) {
            for ends in block.elements() {
                surface.rod(mesh, ends[0], ends[1]);
            }
        }
        Some(surface)
    }

    /// Adds a prism around a beam element; its ends move with the nodes.
    fn rod(&mut self, mesh: &Mesh, from: u32, to: u32) {
        let ends = [from, to].map(|node| &mesh.nodes[node as usize]);
        let Some((positions, triangles)) = prism(ends, ROD * self.size, ROD_SIDES, 0.0) else { return };
        let first = self.positions.len() as u32;
        self.positions.extend(positions);
        self.nodes.extend([from, to].into_iter().flat_map(|node| std::iter::repeat_n(node, ROD_SIDES as usize)));
        self.triangles.extend(triangles.into_iter().map(|t| t.map(|v| first + v)));
    }

    /// Returns the positions displaced by `scale` times a field of the mesh.
    pub(super) fn deformed(&self, field: &[Vector3<f64>], scale: f64) -> Vec<Vector3<f64>> {
        self.positions.iter().zip(&self.nodes).map(|(p, node)| p + field[*node as usize] * scale).collect()
    }

    /// Returns the faces that `interface` ties.
    pub(super) fn tied(&self, mesh: &Mesh, interface: &Interface) -> Tied {
        // Faces with all their nodes tied.
        let mut is_tied = vec![false; mesh.nodes.len()];
        for node in &interface.nodes {
            is_tied[*node as usize] = true;
        }
        let all = |nodes: &[u32]| nodes.iter().all(|node| is_tied[*node as usize]);
        let faces: Vec<bool> = self.faces.iter().map(|(corners, middles)| all(corners) && all(middles)).collect();
        let torn = self.faces.iter().filter(|(corners, middles)| all(corners) && !all(middles)).count();
        let mut triangles: Vec<bool> = self.face_of.iter().map(|face| faces[*face as usize]).collect();
        triangles.resize(self.triangles.len(), false);

        // Their area, mean normal and centre.
        let (mut area, mut normal, mut centre) = (0.0, Vector3::zeros(), Vector3::zeros());
        let normals = triangle_normals(&self.positions, &self.triangles);
        for (number, (n, a)) in normals.iter().enumerate().filter(|(number, _)| triangles[*number]) {
            area += a;
            normal += n * *a;
            centre +=
                self.triangles[number].iter().map(|v| self.positions[*v as usize]).sum::<Vector3<f64>>() * (a / 3.0);
        }
        if area > 0.0 {
            (normal, centre) = (normal / area, centre / area);
        } else {
            let sum: Vector3<f64> = interface.nodes.iter().map(|node| mesh.nodes[*node as usize]).sum();
            centre = sum / interface.nodes.len().max(1) as f64;
        }
        let faces = faces.iter().filter(|tied| **tied).count();
        Tied { triangles, faces, torn, area, normal, centre }
    }
}
