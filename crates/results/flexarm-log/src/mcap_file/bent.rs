//! Flexible links for viewers that only know rigid bodies: the surface is cut into slabs across the
//! link, each with its own frame that moves with the section at its middle.
//!
//! Meshes are sent once and frames often, so the bent link moves as smoothly as the rest of the
//! arm, at a hundredth of the bytes of a new surface per frame. Slabs overlap slightly, which hides
//! the gaps between them.

use flexarm_kinematics::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};

use crate::{BendInfo, LinkMesh, RunHeader, TwinSample};
use flexarm_draw::{BendLine, BentMesh, stations_in_link};

/// Number of slabs between the interfaces; there is one more before and one behind them.
const INNER: usize = 8;
/// Fraction of a slab by which a triangle may reach into the next one without being drawn there
/// too.
const OVERLAP: f64 = 0.05;

/// A flexible link cut into slabs.
pub(crate) struct BentLink {
    /// Index into [`RunHeader::links`].
    pub(crate) link: usize,
    bend: BendInfo,
    line: BendLine,
    /// Index of its first station in [`TwinSample::X_WS`].
    first: usize,
    /// Middle of each slab on the line, in link axes (m).
    middles: Vec<Vector3<f64>>,
    /// Two unit vectors in the undeformed sections, in link axes.
    across: [Vector3<f64>; 2],
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

    fn new(bend: &BendInfo, first: usize) -> Option<Self> {
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
    pub(crate) fn poses(&self, twin: &TwinSample) -> impl Iterator<Item = Pose> {
        let moved = stations_in_link(twin, self.link, self.first, self.bend.X_LS.len());
        let line = self.line.bent(&moved);
        let pose = |middle: &Vector3<f64>| {
            let at = line.deformed(middle);
            // Rotation that maps the undeformed section directions e, f to the deformed ones u, v.
            let [u, v] = self.across.map(|e| line.deformed(&(middle + e)) - at);
            let [e, f] = self.across;
            let turn =
                Matrix3::from_columns(&[u, v, u.cross(&v)]) * Matrix3::from_columns(&[e, f, e.cross(&f)]).transpose();
            let turn = Rotation3::from_matrix_unchecked(turn);
            Pose::from_parts(Translation3::from(at - turn * middle), turn)
        };
        self.middles.iter().map(pose).collect::<Vec<_>>().into_iter()
    }

    /// Returns the corners of each slab's triangles, three per triangle, undeformed, in link axes.
    pub(crate) fn slabs(&self, mesh: &LinkMesh) -> Vec<Vec<[f32; 3]>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(at: [f64; 3], angle: [f64; 3]) -> Pose {
        Pose::from_parts(Translation3::from(Vector3::from(at)), Rotation3::from_scaled_axis(Vector3::from(angle)))
    }

    fn link() -> (BentLink, BendInfo) {
        let X_LS = vec![pose([0.1, 0.0, 0.2], [0.0; 3]), pose([0.1, 0.3, 1.0], [0.0; 3])];
        let bend = BendInfo { link: 0, X_LS, carries: Vec::new() };
        (BentLink::new(&bend, 0).unwrap(), bend)
    }

    /// Identity: without deflection, every slab frame is at the link frame.
    #[test]
    fn slabs_of_an_undeformed_link_are_at_the_link() {
        let (link, bend) = link();
        let twin = TwinSample { X_WL: vec![Pose::identity()], X_WS: bend.X_LS.clone(), ..TwinSample::default() };
        assert_eq!(link.poses(&twin).count(), INNER + 2);
        for X in link.poses(&twin) {
            assert!((X.to_homogeneous() - nalgebra::Matrix4::identity()).norm() < 1e-14); // measured 3e-16
        }
    }

    /// Truth: the bent surface evaluated point by point, at points of the middle sections.
    #[test]
    fn a_slab_moves_with_the_section_in_its_middle() {
        let (link, _) = link();
        let moved = vec![pose([0.11, 0.0, 0.2], [0.0, 0.02, 0.0]), pose([0.12, 0.33, 0.98], [0.1, -0.05, 0.2])];
        let twin = TwinSample { X_WL: vec![Pose::identity()], X_WS: moved.clone(), ..TwinSample::default() };
        for (X, middle) in link.poses(&twin).zip(&link.middles) {
            for point in [*middle, middle + 0.2 * link.across[0] - 0.1 * link.across[1]] {
                let drawn = X * nalgebra::Point3::from(point);
                assert!((drawn.coords - link.line.bent(&moved).deformed(&point)).norm() < 1e-14); // measured 2e-16
            }
        }
    }

    /// Truth: every triangle of the cut surface is in a slab, and none is far from its slab.
    #[test]
    fn slabs_together_hold_the_surface() {
        let (link, bend) = link();
        let mesh = LinkMesh {
            link: 0,
            name: "sheet".into(),
            positions: vec![[0.1, -0.2, 0.0], [0.1, 0.5, 1.4], [0.2, 0.5, 1.4], [0.2, -0.2, 0.0]],
            normals: Vec::new(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            color: [1.0; 4],
            file: None,
        };
        let slabs = link.slabs(&mesh);
        let cut = BentMesh::new(&mesh, &bend).unwrap().mesh;
        let drawn: std::collections::BTreeSet<_> =
            slabs.iter().flatten().map(|corner| corner.map(f32::to_bits)).collect();
        assert!(cut.positions.iter().all(|corner| drawn.contains(&corner.map(f32::to_bits))));
        let total = slabs.iter().map(Vec::len).sum::<usize>() / 3;
        assert!((cut.triangles.len()..3 * cut.triangles.len()).contains(&total), "{total}");
        for (k, slab) in slabs.iter().enumerate().skip(1).take(INNER) {
            for triangle in slab.chunks(3) {
                let place = |c: &[f32; 3]| link.line.place(&Vector3::from(c.map(f64::from))) * INNER as f64;
                let places = triangle.iter().map(|corner| place(corner) / link.line.length());
                let low = places.clone().fold(f64::INFINITY, f64::min);
                let high = places.fold(f64::NEG_INFINITY, f64::max);
                assert!(low < k as f64 && high > k as f64 - 1.0, "slab {k} has a triangle from {low} to {high}");
            }
        }
    }
}
