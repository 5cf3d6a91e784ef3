//! Drawing of arms, meshes and curves.
//!
//! Conventions shared by recordings, markers and pictures: [`Magnifier`] magnifies deflections,
//! [`BendLine`] and [`BentMesh`] deform surfaces, [`palette`] defines the colours. Pictures need no
//! graphics card: `arm_pictures`, `arm_png` and `arm_sheet` draw an arm at one instant,
//! `mesh_picture` the sheets of a mesh reduction (feature `png`), [`LinePlot`] curves as SVG.
//!
//! ```
//! use flexarm_draw::Magnifier;
//! use flexarm_sample::{LinkInfo, RunHeader, Sample, TwinSample};
//! use flexarm_spatial::Pose;
//!
//! // A tool that sags by 2 mm is drawn fifty times as low.
//! let base = LinkInfo { name: "base".into(), parent: None, fixed: true };
//! let tool = LinkInfo { name: "tool".into(), parent: Some(0), fixed: false };
//! let header = RunHeader { links: vec![base, tool], tcp: "tool".into(), magnification: 50.0, ..RunHeader::default() };
//! let twin = |z: f64| {
//!     let X_WT = Pose::translation(1.0, 0.0, z);
//!     TwinSample { X_WL: vec![Pose::identity(), X_WT], X_WT, ..Default::default() }
//! };
//! let sample = Sample { flexible: twin(-0.002), rigid: twin(0.0), ..Sample::default() };
//! let shown = Magnifier::new(&header).magnified(&sample);
//! assert!((shown.X_WT.translation.z + 0.1).abs() < 1e-12);
//! ```
//!
//! Not here: recording files, interpretation of the numbers.
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]

#[cfg(feature = "png")]
mod arm_picture;
mod bend;
pub mod charts;
mod field_plot;
mod magnify;
#[cfg(feature = "png")]
pub mod mesh_picture;
pub mod palette;
mod plot;

#[cfg(feature = "png")]
pub use arm_picture::{ArmPicture, ArmPictureError, ArmSide, arm_color, arm_pictures, arm_png, arm_sheet};
pub use bend::{BendLine, BentMesh, BentPieces};
pub use field_plot::FieldPlot;
pub use magnify::{Magnifier, stations_in_link};
pub use plot::{CurveLook, LinePlot, Panel, PlotCurve, PlotError, page_plot, paper_plot, plan_plot};

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    #[cfg(feature = "png")]
    pub use crate::arm_picture::ellipsoid::{ELLIPSOID, Ellipsoid};
    #[cfg(feature = "png")]
    pub use crate::arm_picture::legend::{ARROW, on_scale};
    #[cfg(feature = "png")]
    pub use crate::arm_picture::{Stage, arrow};
    pub use crate::charts::{bars, range, wrapped};
    #[cfg(feature = "png")]
    pub use crate::mesh_picture::numbers::{displacement, displacements, position, rotations, round_below};
    #[cfg(feature = "png")]
    pub use crate::mesh_picture::raster::cover;
    #[cfg(feature = "png")]
    pub use crate::mesh_picture::stress_sheet::{is_visible, side_of_worst};
    #[cfg(feature = "png")]
    pub use crate::mesh_picture::topology::prism;
    #[cfg(feature = "png")]
    pub use crate::mesh_picture::view::LinkAxes;
    pub use crate::plot::ranges::equally_long;
    pub use crate::plot::style::PLAN;
    pub use crate::plot::svg::{plain, three_digits};
}
