//! Meshes for tests: a box in every kind of solid, with nodes moved arbitrarily.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::element::edges;
use crate::mesh::{ElementBlock, ElementKind, Mesh, Region};

/// All solid element kinds.
pub(crate) const SOLIDS: [ElementKind; 6] = [
    ElementKind::Tet4,
    ElementKind::Tet10,
    ElementKind::Hex8,
    ElementKind::Hex20,
    ElementKind::Wedge6,
    ElementKind::Wedge15,
];

/// Pseudo-random numbers between -1 and 1, the same in every run.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// Unit cube in `divisions` cells, each of one brick, two wedges or six tetrahedra, one region.
///
/// Corners are placed by `place(unit position)`; mid-edge nodes too if `curved`, otherwise in the
/// middle of the edge.
pub(crate) fn cube(
    kind: ElementKind,
    divisions: [usize; 3],
    curved: bool,
    mut place: impl FnMut(Vector3<f64>) -> Vector3<f64>,
) -> Mesh {
    let mut mesh = Mesh {
        regions: vec![Region { name: "box".into(), material: None, beam: None }],
        blocks: vec![ElementBlock { kind, region: 0, ids: vec![], connectivity: vec![] }],
        ..Mesh::default()
    };
    // Key: position in half cells, so that midpoints of edges have one too.
    let mut known: BTreeMap<[usize; 3], u32> = BTreeMap::new();
    let mut node = |mesh: &mut Mesh, key: [usize; 3], ends: Option<[u32; 2]>| {
        *known.entry(key).or_insert_with(|| {
            let unit = Vector3::from_fn(|c, _| key[c] as f64 / (2 * divisions[c]) as f64);
            let x = match ends {
                Some([a, b]) if !curved => (mesh.nodes[a as usize] + mesh.nodes[b as usize]) * 0.5,
                _ => place(unit),
            };
            mesh.nodes.push(x);
            mesh.node_ids.push(mesh.nodes.len() as u64);
            mesh.nodes.len() as u32 - 1
        })
    };
    for cell in (0..divisions.iter().product())
        .map(|i: usize| [i % divisions[0], i / divisions[0] % divisions[1], i / (divisions[0] * divisions[1])])
    {
        for corners in cells(kind) {
            let keys: Vec<[usize; 3]> =
                corners.iter().map(|corner| [0, 1, 2].map(|c| 2 * (cell[c] + (corner >> c & 1)))).collect();
            let mut element: Vec<u32> = keys.iter().map(|key| node(&mut mesh, *key, None)).collect();
            for [a, b] in edges(kind).iter().take(kind.nodes() - keys.len()) {
                let key = [0, 1, 2].map(|c| (keys[*a][c] + keys[*b][c]) / 2);
                let ends = [element[*a], element[*b]];
                element.push(node(&mut mesh, key, Some(ends)));
            }
            let block = &mut mesh.blocks[0];
            block.ids.push(block.ids.len() as u64 + 1);
            block.connectivity.extend(element);
        }
    }
    mesh
}

/// Corners of the elements in one cell; bits 0, 1, 2 of a number are x, y, z.
fn cells(kind: ElementKind) -> Vec<Vec<usize>> {
    match kind {
        ElementKind::Hex8 | ElementKind::Hex20 => vec![vec![0, 1, 3, 2, 4, 5, 7, 6]],
        ElementKind::Wedge6 | ElementKind::Wedge15 => vec![vec![0, 1, 3, 4, 5, 7], vec![0, 3, 2, 4, 7, 6]],
        // One tetrahedron per permutation of the axes along the path from corner 0 to corner 7.
        _ => vec![[1, 2, 4], [2, 4, 1], [4, 1, 2], [1, 4, 2], [2, 1, 4], [4, 2, 1]]
            .into_iter()
            .enumerate()
            .map(|(i, [a, b, _])| if i < 3 { vec![0, a, a | b, 7] } else { vec![0, a | b, a, 7] })
            .collect(),
    }
}

/// Positions of the nodes of one element.
pub(crate) fn positions(mesh: &Mesh, element: &[u32]) -> Vec<Vector3<f64>> {
    element.iter().map(|node| mesh.nodes[*node as usize]).collect()
}
