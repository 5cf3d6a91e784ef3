//! Element types of Gmsh: dimension, number of nodes, and conversion to our node order.
//!
//! Start at [`shape`]. Our order: corners, then mid-side nodes in the order of the edges. Not here:
//! sections of the file (`msh2.rs`, `msh4.rs`).

use flexarm_fem::mesh::ElementKind;

/// Gmsh element type.
pub struct Shape {
    /// Name in Gmsh.
    pub(super) name: &'static str,
    /// Topological dimension.
    pub(super) dim: u8,
    /// Number of nodes of one element.
    pub(super) nodes: usize,
    /// For supported volumes: the kind, and Gmsh's local index of each of our nodes.
    pub(super) solid: Option<(ElementKind, &'static [u8])>,
}

const TET: &[u8] = &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
const HEX: &[u8] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15];
const WEDGE: &[u8] = &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11];

/// Maximum number of nodes of the types in the table.
pub(super) const MAX_NODES: usize = 125;

/// Looks up an element type number.
///
/// Source: Gmsh reference manual, "MSH file format" (numbers) and "Node ordering" (edges).
pub fn shape(number: i64) -> Option<Shape> {
    let plain = |name, dim, nodes| Some(Shape { name, dim, nodes, solid: None });
    let solid = |name, kind: ElementKind, order: &'static [u8]| {
        let nodes = kind.nodes();
        Some(Shape { name, dim: 3, nodes, solid: Some((kind, &order[..nodes])) })
    };
    match number {
        // First and second order.
        1 => plain("2-node line", 1, 2),
        2 => plain("3-node triangle", 2, 3),
        3 => plain("4-node quadrangle", 2, 4),
        4 => solid("4-node tetrahedron", ElementKind::Tet4, TET),
        5 => solid("8-node hexahedron", ElementKind::Hex8, HEX),
        6 => solid("6-node prism", ElementKind::Wedge6, WEDGE),
        7 => plain("5-node pyramid", 3, 5),
        8 => plain("3-node line", 1, 3),
        9 => plain("6-node triangle", 2, 6),
        10 => plain("9-node quadrangle", 2, 9),
        11 => solid("10-node tetrahedron", ElementKind::Tet10, TET),
        12 => plain("27-node hexahedron", 3, 27),
        13 => plain("18-node prism", 3, 18),
        14 => plain("14-node pyramid", 3, 14),
        15 => plain("point", 0, 1),
        16 => plain("8-node quadrangle", 2, 8),
        17 => solid("20-node hexahedron", ElementKind::Hex20, HEX),
        18 => solid("15-node prism", ElementKind::Wedge15, WEDGE),
        19 => plain("13-node pyramid", 3, 13),
        // Higher orders, which only count the nodes to skip.
        20 => plain("9-node triangle", 2, 9),
        21 => plain("10-node triangle", 2, 10),
        22 => plain("12-node triangle", 2, 12),
        23 | 24 => plain("15-node triangle", 2, 15),
        25 => plain("21-node triangle", 2, 21),
        26 => plain("4-node line", 1, 4),
        27 => plain("5-node line", 1, 5),
        28 => plain("6-node line", 1, 6),
        29 => plain("20-node tetrahedron", 3, 20),
        30 => plain("35-node tetrahedron", 3, 35),
        31 => plain("56-node tetrahedron", 3, 56),
        36 => plain("16-node quadrangle", 2, 16),
        92 => plain("64-node hexahedron", 3, 64),
        93 => plain("125-node hexahedron", 3, 125),
        _ => None,
    }
}

/// Advice for handling an unsupported volume type in Gmsh.
pub(super) fn advice(number: i64) -> &'static str {
    match number {
        12 | 13 => "in Gmsh set Mesh.SecondOrderIncomplete=1, which leaves out nodes in faces and volumes",
        7 | 14 | 19 => {
            "pyramids join hexahedra to tetrahedra: mesh the part with one of them only, \
             in Gmsh without Recombine or with transfinite volumes throughout"
        }
        _ => "in Gmsh set Mesh.ElementOrder=2 (or 1) and Mesh.SecondOrderIncomplete=1",
    }
}
