//! Skin of a mesh: faces of volume elements that belong to one element only.
//!
//! Start at [`skin`]. Corners counter-clockwise seen from outside, node indices of the mesh.
//!
//! Not here: the nodes of the skin with their normals (`surface_nodes`), pictures.

use super::faces::{face_corners, face_nodes};
use super::{ElementBlock, Mesh};

/// Faces of the skin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Skin {
    /// Nodes of all faces, face by face.
    nodes: Vec<u32>,
    /// Per face: end of its nodes, number of corners, block, and element in the block.
    faces: Vec<Entry>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    end: usize,
    corners: u8,
    block: u32,
    element: u32,
}

/// One face of the skin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SkinFace<'a> {
    /// Index of the block of its element in [`Mesh::blocks`].
    pub block: usize,
    /// Index of the element within its block.
    pub element: usize,
    /// Three or four corners, counter-clockwise seen from outside.
    pub corners: &'a [u32],
    /// Mid-side nodes, one per corner, the first between the first two corners; empty in first
    /// order.
    pub midsides: &'a [u32],
}

/// Finds the skin of the volume elements.
///
/// "Outside" is valid for elements of positive volume. Coincident faces without common corners, as
/// between unconnected parts, both belong to the skin. Time is linear: about a second for six
/// million tetrahedra.
pub fn skin(mesh: &Mesh) -> Skin {
    // Faces are sorted into buckets by their smallest corner; both copies of a face share a bucket.
    let mut starts = vec![0_usize; mesh.nodes.len() + 1];
    for_each_face(&mesh.blocks, |_, key| starts[key[0] as usize + 1] += 1);
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    let count = starts.last().copied().unwrap_or(0);
    let mut bucketed = vec![([0_u32; 3], FaceRef::default()); count];
    let mut next = starts.clone();
    for_each_face(&mesh.blocks, |face, key| {
        let slot = &mut next[key[0] as usize];
        bucketed[*slot] = ([key[1], key[2], key[3]], face);
        *slot += 1;
    });

    // Faces without a copy in their bucket form the skin.
    let mut outer = Vec::new();
    for bucket in starts.windows(2).map(|ends| ends[0]..ends[1]) {
        let bucket = &mut bucketed[bucket];
        bucket.sort_unstable_by_key(|(rest, _)| *rest);
        let single = bucket.chunk_by(|a, b| a.0 == b.0).filter(|equal| equal.len() == 1);
        outer.extend(single.map(|equal| equal[0].1));
    }
    outer.sort_unstable();

    let tables: Vec<Vec<Vec<u8>>> = mesh.blocks.iter().map(|block| face_nodes(block.kind)).collect();
    let mut skin = Skin::default();
    for face in outer {
        let block = &mesh.blocks[face.block as usize];
        let first = face.element as usize * block.kind.nodes();
        let places = &tables[face.block as usize][usize::from(face.face)];
        skin.nodes.extend(places.iter().map(|place| block.connectivity[first + usize::from(*place)]));
        let corners = face_corners(block.kind)[usize::from(face.face)].len() as u8;
        skin.faces.push(Entry { end: skin.nodes.len(), corners, block: face.block, element: face.element });
    }
    skin
}

/// Face by block, element and face number.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FaceRef {
    pub(super) block: u32,
    pub(super) element: u32,
    face: u8,
}

/// Calls `call` with every face and its sorted corners; the fourth of a triangle is `u32::MAX`.
pub(super) fn for_each_face(blocks: &[ElementBlock], mut call: impl FnMut(FaceRef, [u32; 4])) {
    for (b, block) in (0..).zip(blocks) {
        let faces = face_corners(block.kind);
        for (element, nodes) in (0..).zip(block.elements()) {
            for (face, corners) in (0..).zip(faces) {
                let mut key = [u32::MAX; 4];
                for (slot, corner) in key.iter_mut().zip(*corners) {
                    *slot = nodes[usize::from(*corner)];
                }
                key.sort_unstable();
                call(FaceRef { block: b, element, face }, key);
            }
        }
    }
}

impl Skin {
    /// Number of faces.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there are no faces, as in a mesh of beams.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Iterates over the faces in the order of their elements.
    pub fn faces(&self) -> impl Iterator<Item = SkinFace<'_>> {
        self.faces.iter().scan(0, |start, entry| {
            let nodes = &self.nodes[*start..entry.end];
            *start = entry.end;
            let (corners, midsides) = nodes.split_at(usize::from(entry.corners));
            Some(SkinFace { block: entry.block as usize, element: entry.element as usize, corners, midsides })
        })
    }

    /// Nodes on the skin including mid-side nodes, sorted.
    pub fn nodes(&self) -> Vec<u32> {
        let mut nodes = self.nodes.clone();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Skin as plane triangles with all its nodes, for pictures: 1, 2, 4 or 6 per face.
    ///
    /// Returns node indices, counter-clockwise seen from outside.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(4 * self.len());
        for face in self.faces() {
            let (c, m) = (face.corners, face.midsides);
            let inner = if m.is_empty() { c } else { m };
            // In second order: a triangle at each corner, then the polygon of the mid-side nodes.
            for k in 0..m.len() {
                triangles.push([c[k], m[k], m[(k + m.len() - 1) % m.len()]]);
            }
            triangles.extend((2..inner.len()).map(|k| [inner[0], inner[k - 1], inner[k]]));
        }
        triangles
    }
}
