//! Errors of turning a mesh into a link.
//!
//! Causes keep their own types and texts. Not here: errors of mesh files (`flexarm-fe-io`), of jobs
//! (`flexarm-linkmaker`).

use crate::chain::ChainError;
use crate::cut::CutError;
use crate::error::{Direction, FemError};
use crate::model::AssemblyError;
use crate::reduction::ReductionError;
use crate::sparse::ModesError;

/// Errors of turning a mesh into a link.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshLinkError {
    /// Elements, materials or sections are invalid.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// Ties or factorisation failed.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// The modes could not be computed.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// The parts could not be cut.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// A chain could not be made.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The gate rejected the result.
    #[error(transparent)]
    Gate(Box<FemError>),
    /// An interface is not supported by the mesh.
    #[error("interface {interface:?} can move without force while {first:?} is held ({direction}): {cause}")]
    FreeInterface {
        /// Name of the interface.
        interface: String,
        /// Name of the proximal interface.
        first: String,
        /// Free motion, link axes.
        direction: Direction,
        /// Probable cause, as far as the mesh shows it.
        cause: String,
    },
    /// Bodies of the mesh can rotate against each other.
    #[error("{source}; {cause}")]
    Hinge {
        /// Error of the reduction.
        source: ReductionError,
        /// Places where the bodies touch.
        cause: String,
    },
    /// Elements of different kinds do not fit at their common faces.
    #[error(
        "{count} pair(s) of elements meet without fitting: {list}; the faces gape or overlap; use one order of \
         elements, and wedges or one kind where tetrahedra meet bricks"
    )]
    Misfit {
        /// Number of pairs.
        count: usize,
        /// First pairs.
        list: String,
    },
    /// A split leaves no material on one side.
    #[error("the cut through the elastic joint at ({:.6}, {:.6}, {:.6}) m: {source}; choose another place for the split", p[0], p[1], p[2])]
    Split {
        /// Split point, link axes, m.
        p: [f64; 3],
        /// Cause.
        source: CutError,
    },
    /// Parts of the mesh are connected to no interface.
    #[error(
        "the mesh falls into {parts} parts that share no node: {list}; only one may remain; {}",
        if *coincident > 0 {
            format!("{coincident} pair(s) of nodes lie in one place: merge them (Coherence in Gmsh, or merge in the reduction)")
        } else {
            "no two of their nodes lie in one place: is a part there that does not belong to the link?".to_owned()
        }
    )]
    Unconnected {
        /// Number of parts.
        parts: usize,
        /// Sizes of the parts, with one node each.
        list: String,
        /// Number of pairs of coincident nodes.
        coincident: usize,
    },
}

impl From<FemError> for MeshLinkError {
    fn from(error: FemError) -> Self {
        Self::Gate(Box::new(error))
    }
}
