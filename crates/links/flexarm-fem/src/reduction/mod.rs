//! Static and dynamic condensation of a finite element model to its interfaces.
//!
//! ```text
//! u = B u_b + S u_i          rigid ties: rows of B;   S: the free DoF
//! G u = u_g                  distributing ties: the interface follows the mean of its surface
//! T = [static shapes],  K_g = Tᵀ K T,  M_g = Tᵀ M T                     Guyan
//! u = T u_b + Φ η,      K = blkdiag(K_g, diag ω²)                        Craig-Bampton
//! ```
//! `K_ii` is factorised once; static shapes, fixed-interface modes and the modes for checking the
//! result (A clamped and B free, all free) use the same factor.
//!
//! Start at [`Condensation::new`]; the result is a [`Superelement`].
//! Source: Guyan (1965); Craig & Bampton (1968); notation of the theory page, section 1.
//!
//! Not here: elements and assembly ([`crate::model`]), the sparse factor ([`crate::sparse`]).

mod boundary;
mod condensation;
mod grounding;
mod superelement;

pub use boundary::{Boundary, Interface, Tie, TieError};
pub use condensation::{Condensation, CondensationOptions, ReductionError, SolverFigures};
pub use superelement::{InterfaceFrame, Superelement, stiffness12};

pub(crate) use condensation::{spd_inverse, worst};
pub(crate) use superelement::generalised_frequencies;
