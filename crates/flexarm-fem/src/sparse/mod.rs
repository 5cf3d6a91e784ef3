//! Sparse symmetric matrices: storage, products, Cholesky factors, eigenpairs. The one place that names faer.
//!
//! ```text
//! SparseSymmetric --(Ordering)--> Cholesky --solve--> K⁻¹ F        many right-hand sides at a time
//!                                     |
//!                                 smallest_modes: shift-invert block Lanczos on any operator (K, M)
//! ```
//! Only the lower triangle is stored, by columns. Tall results are nalgebra matrices, one column per
//! right-hand side.
//!
//! Not here: what the rows mean. Degrees of freedom, ties and boundaries are the business of
//! [`crate::reduction`].

mod cholesky;
mod dense;
mod lanczos;
mod ordering;
mod registers;
mod symmetric;

pub use cholesky::{Cholesky, FactorFigures, NotPositiveDefinite, Threads};
pub use lanczos::{Modes, ModesError, ModesWanted, smallest_modes};
pub use ordering::Ordering;
pub use symmetric::{Pattern, SparseSymmetric};

pub(crate) use dense::{add_product, gram};
