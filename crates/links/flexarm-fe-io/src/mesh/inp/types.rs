//! Element types of Abaqus and CalculiX.
//!
//! Start at [`class`]. Not here: the lines of a deck (`deck.rs`), faces (`flexarm_fem::mesh`).

use flexarm_fem::beam::BeamTheory;
use flexarm_fem::mesh::ElementKind;

/// Class of an element type.
#[derive(Clone, Copy, PartialEq)]
pub enum Class {
    /// Volume element of this kind.
    Solid(ElementKind),
    /// Straight beam with this theory.
    Beam(BeamTheory),
    /// Plane element or line with this number of nodes, which mesh programs write along with a
    /// solid; used as a group of nodes.
    Skin(usize),
}

impl Class {
    /// Number of nodes of one element.
    pub(super) const fn nodes(self) -> usize {
        match self {
            Self::Solid(kind) => kind.nodes(),
            Self::Beam(_) => 2,
            Self::Skin(nodes) => nodes,
        }
    }
}

/// Looks up a type in upper case; also returns a remark if the type requests something unsupported.
pub fn class(name: &str) -> Option<(Class, Option<&'static str>)> {
    const REDUCED: Option<&str> = Some("reduced integration is not used: the program has its own rules");
    let solid = |kind, remark| Some((Class::Solid(kind), remark));
    match name {
        "C3D4" => solid(ElementKind::Tet4, None),
        "C3D10" => solid(ElementKind::Tet10, None),
        "C3D10M" | "C3D10HS" | "C3D10T" => solid(ElementKind::Tet10, Some("read as plain C3D10")),
        // The `Exact` quadrature always has incompatible modes, that of CalculiX only for C3D8I.
        "C3D8" => solid(ElementKind::Hex8, Some("read with incompatible modes unless quadrature = calculix")),
        "C3D8I" => solid(ElementKind::Hex8, None),
        "C3D8R" => solid(ElementKind::Hex8, REDUCED),
        "C3D20" => solid(ElementKind::Hex20, None),
        "C3D20R" => solid(ElementKind::Hex20, REDUCED),
        "C3D6" => solid(ElementKind::Wedge6, None),
        "C3D15" => solid(ElementKind::Wedge15, None),
        "B31" => Some((Class::Beam(BeamTheory::Timoshenko), None)),
        "B33" => Some((Class::Beam(BeamTheory::EulerBernoulli), None)),
        // Types that Gmsh writes for the surfaces and curves of a solid.
        "CPS3" => Some((Class::Skin(3), None)),
        "CPS4" => Some((Class::Skin(4), None)),
        "CPS6" => Some((Class::Skin(6), None)),
        "CPS8" => Some((Class::Skin(8), None)),
        "T3D2" => Some((Class::Skin(2), None)),
        "T3D3" => Some((Class::Skin(3), None)),
        _ => None,
    }
}

/// Advice for an unsupported type.
pub(super) fn advice(name: &str) -> &'static str {
    match name {
        "B32" | "B32R" | "B21" | "B22" | "B23" => "beams must be two-node ones in space: B31 or B33",
        _ if name.starts_with('S') || name.starts_with("CPE") || name.starts_with("CAX") || name.starts_with('M') => {
            "shells, membranes, plane elements and masses are not read: mesh the part with solids"
        }
        _ => "remove these elements from the deck, or mesh with a supported type",
    }
}
