//! Flexible links for viewers that only know rigid bodies: the surface is cut into slabs across the
//! link, each with its own frame that moves with the section at its middle.
//!
//! Meshes are sent once and frames often, so the bent link moves as smoothly as the rest of the
//! arm, at a hundredth of the bytes of a new surface per frame. Slabs overlap slightly, which hides
//! the gaps between them. Start at [`BentLink::slabs`] and [`BentLink::poses`].
//!
//! Frames: L link; all vectors in L, in m. Not here: the deflection line
//! ([`flexarm_draw::BendLine`]).

use flexarm_kinematics::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};

use crate::{BendInfo, LinkMesh, RunHeader, TwinSample};
use flexarm_draw::{BendLine, BentMesh, stations_in_link};

/// Number of slabs between the interfaces; there is one more before and one behind them.
pub const INNER: usize = 8;
/// Fraction of a slab by which a triangle may reach into the next one without being drawn there
/// too.
const OVERLAP: f64 = 0.05;

/// A flexible link cut into slabs.
pub struct BentLink {
    /// Index into [`RunHeader::links`].
    pub(crate) link: usize,
    bend: BendInfo,
    /// Deflection line.
    pub line: BendLine,
    /// Index of its first station in [`TwinSample::X_WS`].
    first: usize,
    /// Middle of each slab on the line, in link axes (m).
    pub middles: Vec<Vector3<f64>>,
    /// Two unit vectors in the undeformed sections, in link axes.
    pub across: [Vector3<f64>; 2],
}

impl BentLink {
    /// Returns the flexible links of a run.
    pub(crate) fn all(header: &RunHeader) -> Vec<Self> {
        let mut first = 0;
        let link = |bend: &BendInfo| {
            let own = first;
            first += bend.X_LS.len();
            Self::new(bend, own)
        };
        header.bends.iter().filter_map(link).collect()
    }

    /// Prepares the messages of a bend; `None` without a line to bend.
    ///
    /// * `first`: index of its first station in [`TwinSample::X_WS`].
    pub fn new(bend: &BendInfo, first: usize) -> Option<Self> {
        let line = BendLine::new(bend)?;
        let ends = [bend.X_LS.first()?, bend.X_LS.last()?].map(|X| X.translation.vector);
        let along = ends[1] - ends[0];
        let middle = |k: usize| match k {
            0 => -1e-3,
            k if k > INNER => 1.0 + 1e-3,
            k => (k as f64 - 0.5) / INNER as f64,
        };
        let middles = (0..INNER + 2).map(|k| ends[0] + along * middle(k)).collect();
        let smallest = Vector3::ith(along.iamin(), 1.0);
        let e = along.cross(&smallest).normalize();
        let across = [e, along.normalize().cross(&e)];
        Some(Self { link: bend.link, bend: bend.clone(), line, first, middles, across })
    }

    /// Number of slabs.
    pub(crate) fn count(&self) -> usize {
        self.middles.len()
    }

    /// Returns the pose of each slab's frame in the link; undeformed, all equal the link's frame.
    pub fn poses(&self, twin: &TwinSample) -> impl Iterator<Item = Pose> {
        let moved = stations_in_link(twin, self.link, self.first, self.bend.X_LS.len());
        let line = self.line.bent(&moved);
        let pose = |middle: &Vector3<f64>| {
            let at = line.deformed(middle);
            // Rotation R from the undeformed section directions e, f to the deformed ones u, v.
            let [u, v] = self.across.map(|e| line.deformed(&(middle + e)) - at);
            let [e, f] = self.across;
            let R =
                Matrix3::from_columns(&[u, v, u.cross(&v)]) * Matrix3::from_columns(&[e, f, e.cross(&f)]).transpose();
            let R = Rotation3::from_matrix_unchecked(R);
            Pose::from_parts(Translation3::from(at - R * middle), R)
        };
        self.middles.iter().map(pose).collect::<Vec<_>>().into_iter()
    }

    /// Returns the corners of each slab's triangles, three per triangle, undeformed, in link axes.
    pub fn slabs(&self, mesh: &LinkMesh) -> Vec<Vec<[f32; 3]>> {
        let mut slabs = vec![Vec::new(); self.count()];
        let Some(bent) = BentMesh::new(mesh, &self.bend) else { return slabs };
        let slab = self.line.length() / INNER as f64;
        // Position along the link in slabs: the first slab ends at 0, the inner ones at 1, 2, ...
        let place = |corner: &[f32; 3]| self.line.place(&Vector3::from(corner.map(f64::from))) / slab;
        let number = |place: f64| (place.floor().clamp(-1.0, INNER as f64) + 1.0) as usize;
        for triangle in &bent.mesh.triangles {
            let corners = triangle.map(|k| bent.mesh.positions[k as usize]);
            let places = corners.map(|corner| place(&corner));
            let low = places.into_iter().fold(f64::INFINITY, f64::min);
            let high = places.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let reach = OVERLAP.min(0.5 * (high - low));
            for slab in &mut slabs[number(low + reach)..=number(high - reach)] {
                slab.extend(corners);
            }
        }
        slabs
    }
}
