//! Stress of a solid mesh from its displacements: at integration points and averaged at nodes.
//!
//! Start at [`StressRecovery`]. Stresses are in Pa in the axes of the mesh, six components in the
//! order `xx yy zz xy yz zx`.
//!
//! ```text
//! σ = λ tr(ε) 1 + 2 μ ε,   ε = (∇u + ∇uᵀ)/2     at the integration points
//! σ_corner = pinv(N_corner(ξ_p)) σ_p            in each element; mid-side nodes: mean of corners
//! σ_node = mean over the elements of one material at the node
//! ```
//! Stresses at the integration points converge faster than at nodes, so they are extrapolated to
//! the corners by the shape functions of the corners (least squares where there are more points
//! than corners). Averages do not mix materials: at the seam of two, the stress jumps.
//!
//! A link that is one beam gets its stress from its section forces
//! ([`crate::BeamLink::stress_fields`]).
//!
//! Not here: beam elements of a mesh; ties, near which the stress of a rigid interface is not that
//! of the part.
//!
//! Source: Hinton & Campbell (1974), *Int. J. Numer. Meth. Eng.* 8; Barlow (1976), *Int. J. Numer.
//! Meth. Eng.* 10.

mod beam;
mod error;
mod fields;
mod file;
mod gauge;
mod map;
mod recovery;
#[cfg(test)]
mod tests;

pub use error::StressError;
pub use fields::{INERTIA_LOADS, SectionForces, StressFields, StressSite};
pub use file::{parse_stress, write_stress};
pub use map::{StressMap, inertia_loads};
pub use recovery::{NodalPlace, StressPoint, StressRecovery, von_mises};
