//! Closed chains: planar loops closed by a pin, treated as dependent joints of the tree.
//!
//! A pin on link A passes through an eye of link B. In the plane of the loop this gives two
//! equations, which determine two joints of the loop. All algorithms see only the tree of the
//! independent coordinates. `p_AB` is the position of the eye relative to A, E the two axes of A
//! perpendicular to the pin, q the independent and q_d the dependent coordinates:
//!
//! ```text
//! c(q, q_d) = Eᵀ p_AB = 0                                                     position             (1)
//! q̇_d = T q̇            T = -J_d^-1 J                                          J = ∂c/∂q            (2)
//! q̈_d = T q̈ + γ        γ = -J_d^-1 (J̇ q̇ + J̇_d q̇_d)                            acceleration         (3)
//! τ   = τ_t + Tᵀ τ_d    M = [1; T]ᵀ M_t [1; T]                                 virtual work         (4)
//! ∂τ/∂q = [1; T]ᵀ (∂τ_t/∂q_t) [1; T] + Σ_d τ_d ∂²q_d/∂q²                       statics              (5)
//! ```
//! τ_t and M_t belong to the opened tree with all its coordinates and come from the ordinary
//! recursions. The two dependent joints and the pin form a triangle whose sides follow from the
//! independent coordinates. (1) therefore has two closed-form solutions, the two assembly modes; a
//! loop keeps the mode in which it was built. Newton's method on (1) starts from the closed form
//! and adds the effect of out-of-plane deflection and the last digits. Hence q_d is a function of q
//! only and does not depend on the history.
//!
//! Loops may depend on each other: dependent joints of one loop may be part of another. They are
//! solved in sequence.
//!
//! A [`LoopClosure`] of the mechanism becomes a [`PlacedLoop`] in `draft`, and gets its assembly
//! mode in `assemble`. At each pose `positions` and `rates` solve (1) to (3), with the closed form
//! in `triangle`; `recursions` and `reduce` apply (4) and (5). Not here: reading loops from robot
//! files, springs.

mod assemble;
mod cholesky;
mod draft;
mod geometry;
mod loop_closure;
mod placed_loop;
mod positions;
mod rates;
mod recursions;
mod reduce;
mod triangle;
mod workspace;

pub use loop_closure::LoopClosure;
pub use placed_loop::PlacedLoop;

pub(crate) use assemble::assemble;
pub(crate) use draft::{LoopDraft, draft_loops};
pub(crate) use recursions::{inverse_dynamics, mass_matrix_at_poses, move_bodies, place, solve};
pub(crate) use reduce::LoopTangent;
pub(crate) use workspace::LoopData;
