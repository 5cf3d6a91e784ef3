//! Solid elements: shape functions, quadrature, stiffness and mass of one element.
//!
//! Start at `ElementWorkspace::stiffness_and_mass`. `for_each_point` visits the quadrature
//! points with the gradients of the shape functions; `jacobian_range` measures the shape quality
//! of an element. TET4, TET10, HEX8, HEX20, WEDGE6 and WEDGE15, isoparametric, isotropic linear
//! elasticity, in m, Pa and kg; node order as in [`ElementKind`](crate::ElementKind).
//!
//! Notation: `xi = (r, s, t)` reference coordinates, `N_i` shape functions, `J = dx/dxi`, `det` its
//! determinant, `lambda` and `mu` Lamé constants.
//!
//! Not here: beams ([`crate::beam`]), assembly over a mesh. Functions here panic for a beam or a
//! wrong number of nodes: these are errors of the caller, not of a mesh.

mod elasticity;
mod geometry;
mod quadrature;
mod rules;
mod shape;
mod solid;
#[cfg(test)]
mod tests;

pub(crate) use elasticity::{check_solid_material, lame};
pub(crate) use geometry::jacobian_range;
pub use geometry::{InversionPoint, InvertedElement};
#[cfg(test)]
pub(crate) use quadrature::gauss_jacobi;
pub(crate) use quadrature::{TetRule, tet_points};
pub use rules::Quadrature;
pub(crate) use rules::{Point, Purpose, for_each_point};
pub use shape::edges;
pub(crate) use shape::{reference_nodes, shape_functions};
pub(crate) use solid::{ElementWorkspace, mode_gradients_at};
