//! Sparse symmetric matrices: storage, products, Cholesky factors, eigenpairs. The only module that
//! uses faer.
//!
//! ```text
//! SparseSymmetric --(Ordering)--> Cholesky --solve--> K⁻¹ F     eight right-hand sides at a time
//!                                     |
//!                                 smallest_modes: shift-invert block Lanczos on any (K, M)
//! ```
//! Only the lower triangle is stored, by columns. Tall results are nalgebra matrices, one column
//! per right-hand side; operations on a factor, matrix or basis take them as `Block`s, row by
//! row.
//!
//! Not here: the meaning of the rows. Degrees of freedom, ties and boundaries belong to
//! [`crate::reduction`].

mod block;
mod cholesky;
mod dense;
mod dissection;
mod lanczos;
mod ordering;
mod registers;
mod symmetric;
mod vectors;

pub use cholesky::FactorFigures;
pub use lanczos::{Modes, ModesError, ModesWanted};
pub use ordering::Ordering;
pub use symmetric::{Pattern, SparseSymmetric};

pub(crate) use block::{Block, Row, WIDTH, grams, subtract_products};
pub(crate) use cholesky::{Cholesky, NotPositiveDefinite};
pub(crate) use dense::{add_product, gram};
pub(crate) use lanczos::{Pencil, Released, modes_of_two_supports, orthonormalising, smallest_modes};
pub(crate) use vectors::{Wide, Work, quickly};
