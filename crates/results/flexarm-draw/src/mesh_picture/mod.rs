//! Pictures of a mesh reduction: tied faces, position of the cut, deformations.
//!
//! ```text
//! interfaces.png   the body from three sides, tied faces in the colour of their interface, frames, cut plane
//! unit_loads.png   deflection under 1 kN and 1 kN m at B in six panels, A held
//! modes.png        the first six modes with A held, with the frequencies of the reduced models
//! ```
//! A reduction can have consistent numbers and still use the wrong faces; a picture shows that at a
//! glance. Start at [`MeshPictures`], which draws each sheet as an image in memory.
//!
//! Layers: [`scene`] draws triangles and has no concept of finite elements, the sheets convert a
//! mesh and its reduction into scenes. The same input gives the same bytes. No graphics card is
//! needed.
//!
//! Not here: the reduction itself ([`flexarm_fem::mesh_link`]), writing of files, recordings of
//! runs.

pub mod color;
mod deflection_sheet;
pub(crate) mod draw;
mod image;
mod interface_sheet;
mod legend;
pub(crate) mod numbers;
pub(crate) mod raster;
pub mod scene;
mod sheet;
pub(crate) mod stress_sheet;
mod surface;
pub(crate) mod topology;
pub(crate) mod view;

use nalgebra::{DMatrix, Vector3};

use flexarm_fem::model::DofMap;
use flexarm_fem::reduction::Interface;
use flexarm_fem::{Mesh, MeshReduction};

pub use image::{Image, PngError, Rgb};
pub use stress_sheet::{StressPicture, stress_sheet};
pub use view::View;

use surface::Surface;
use view::LinkAxes;

/// Reason why there are no pictures.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// A mesh without elements.
    #[error("the mesh has no elements, so there is nothing to draw")]
    EmptyMesh,
    /// No modes were computed.
    #[error("the reduction has no modes with A held; ask for at least one (judged_modes)")]
    NoModes,
    /// Mesh and reduction do not match.
    #[error("{what}: found {found}, the mesh needs {expected}; is this the reduction of another mesh?")]
    Mismatch {
        /// Mismatched quantity.
        what: String,
        /// Its size.
        found: usize,
        /// Size required by the mesh.
        expected: usize,
    },
    /// A position or displacement that is not finite.
    #[error("{what} of node index {node} is not finite")]
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
        /// Index of the node.
        node: usize,
    },
}

/// A mesh and its reduction, ready to be drawn.
#[derive(Debug)]
pub struct MeshPictures<'a> {
    mesh: &'a Mesh,
    interfaces: &'a [Interface],
    reduction: &'a MeshReduction,
    dofs: DofMap,
    surface: Surface,
    axes: LinkAxes,
}

impl<'a> MeshPictures<'a> {
    /// Checks that mesh, interfaces and reduction match, and extracts the skin.
    ///
    /// * `interfaces`: those of the reduction, proximal first.
    ///
    /// # Errors
    /// [`PictureError::EmptyMesh`], [`PictureError::Mismatch`], [`PictureError::NotFinite`].
    pub fn new(
        mesh: &'a Mesh,
        interfaces: &'a [Interface],
        reduction: &'a MeshReduction,
    ) -> Result<Self, PictureError> {
        // Sizes of displacements and modes, and nodes of the interfaces.
        let dofs = DofMap::new(mesh);
        let fits = |what: &str, found: usize, expected: usize, fine: bool| {
            if fine { Ok(()) } else { Err(PictureError::Mismatch { what: what.to_owned(), found, expected }) }
        };
        if mesh.element_count() == 0 {
            return Err(PictureError::EmptyMesh);
        }
        let (loads, modes) = (&reduction.unit_loads, &reduction.held_modes.shapes);
        fits("degrees of freedom of the unit loads", loads.nrows(), dofs.size(), loads.nrows() == dofs.size())?;
        fits("unit loads", loads.ncols(), 6, loads.ncols() >= 6)?;
        let modes_fit = reduction.held_modes.is_empty() || modes.nrows() == dofs.size();
        fits("degrees of freedom of the modes", modes.nrows(), dofs.size(), modes_fit)?;
        let (shapes, count) = (modes.ncols(), reduction.held_modes.len());
        fits("shapes of the modes", shapes, count, shapes >= count)?;
        for interface in interfaces {
            let last = interface.nodes.iter().copied().max().unwrap_or(0) as usize;
            let what = format!("nodes that interface {:?} counts", interface.name);
            fits(&what, last + 1, mesh.nodes.len(), last < mesh.nodes.len())?;
        }
        // Finite positions and displacements.
        let finite = |p: &Vector3<f64>| p.iter().all(|x| x.is_finite());
        if let Some(node) = mesh.nodes.iter().position(|p| !finite(p)) {
            return Err(PictureError::NotFinite { what: "the position", node });
        }
        if let Some(at) = loads.iter().position(|u| !u.is_finite()) {
            let (node, _) = dofs.node_of(at % dofs.size());
            return Err(PictureError::NotFinite { what: "the displacement under a unit load", node });
        }
        if let Some(at) = modes.iter().position(|u| !u.is_finite()) {
            let (node, _) = dofs.node_of(at % dofs.size());
            return Err(PictureError::NotFinite { what: "a mode shape", node });
        }
        let surface = Surface::new(mesh).ok_or(PictureError::EmptyMesh)?;
        let axes = LinkAxes::new(&surface.positions, &reduction.link.p_AB());
        Ok(Self { mesh, interfaces, reduction, dofs, surface, axes })
    }

    /// Renders the sheet of interfaces and cut.
    pub fn render_interfaces(&self) -> Image {
        interface_sheet::draw(self)
    }

    /// Renders the sheet of unit loads at B.
    pub fn render_unit_loads(&self) -> Image {
        deflection_sheet::unit_loads(self)
    }

    /// Renders the sheet of modes with A held.
    ///
    /// # Errors
    /// [`PictureError::NoModes`].
    pub fn render_modes(&self) -> Result<Image, PictureError> {
        deflection_sheet::modes(self)
    }

    /// Converts a column of displacements to one vector per node; zero for nodes without elements.
    fn field(&self, columns: &DMatrix<f64>, column: usize) -> Vec<Vector3<f64>> {
        let at = |node: usize| {
            let dofs = self.dofs.of(node);
            if dofs.is_empty() { Vector3::zeros() } else { Vector3::from_fn(|i, _| columns[(dofs.start + i, column)]) }
        };
        (0..self.dofs.nodes()).map(at).collect()
    }

    /// Maximum displacement on the surface.
    fn peak(&self, field: &[Vector3<f64>]) -> f64 {
        self.surface.nodes.iter().map(|node| field[*node as usize].norm()).fold(0.0, f64::max)
    }
}
