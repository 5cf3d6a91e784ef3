//! Volume, centroid and inertia of the body enclosed by a mesh, as exact sums over tetrahedra.
//!
//! Start at [`TriangleMesh::mass_properties`]. All values are in m, in the axes of the mesh.
//! Not here: densities and the sum over the shapes of a link (`inertia`), primitives
//! ([`crate::Geometry::mass_properties`]).

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};

use super::TriangleMesh;

/// Mass properties of a homogeneous body of density 1 kg/m³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume in m³.
    pub volume: f64,
    /// Centroid in m.
    pub centroid: Vector3<f64>,
    /// Inertia about the centroid per unit density, in m⁵.
    pub inertia: Matrix3<f64>,
    /// Number of edges without exactly one triangle on each side; coincident vertices count as one.
    pub open_edges: usize,
    /// Whether the triangles face inward; the values above are corrected for this.
    pub inside_out: bool,
}

impl MassProperties {
    /// Whether the mesh is closed; otherwise the other values are meaningless.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0
    }
}

impl TriangleMesh {
    /// Returns the mass properties of the enclosed body, in the axes of the mesh.
    ///
    /// Each triangle (a, b, c) forms a tetrahedron with a reference point; with d = a · (b × c):
    ///
    /// ```text
    /// V = Σ d/6,   V c = Σ d/24 (a+b+c),   ∫ r rᵀ = Σ d/120 (aaᵀ + bbᵀ + ccᵀ + (a+b+c)(a+b+c)ᵀ)
    /// ```
    /// Exact for a closed mesh, up to rounding. The reference is the centre of the bounding box, so
    /// that a mesh far from its origin loses no digits. The cost is linear in the triangles.
    pub fn mass_properties(&self) -> MassProperties {
        let (low, high) = self.bounds().unwrap_or_default();
        let reference = (low + high) * 0.5;
        let vertex = |i: u32| {
            let p = self.positions.get(i as usize).copied().unwrap_or_default();
            Vector3::from(p.map(f64::from)) - reference
        };
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for &[i, j, k] in &self.triangles {
            let (a, b, c) = (vertex(i), vertex(j), vertex(k));
            let d = a.dot(&b.cross(&c));
            let sum = a + b + c;
            volume += d / 6.0;
            first += sum * (d / 24.0);
            second += (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose()) * (d / 120.0);
        }
        // Triangles that face inward give the negative of all integrals.
        let inside_out = volume < 0.0;
        if inside_out {
            (volume, first, second) = (-volume, -first, -second);
        }
        let centroid = if volume > 0.0 { first / volume } else { Vector3::zeros() };
        // Parallel axis theorem from the reference to the centroid, then ∫ r rᵀ to the inertia.
        let covariance = second - centroid * centroid.transpose() * volume;
        MassProperties {
            volume,
            centroid: centroid + reference,
            inertia: Matrix3::identity() * covariance.trace() - covariance,
            open_edges: self.open_edges((high - low).norm()),
            inside_out,
        }
    }

    /// Index for each vertex, equal for coincident vertices.
    pub(crate) fn welded(&self) -> Vec<u32> {
        let (low, high) = self.bounds().unwrap_or_default();
        self.welded_by((high - low).norm())
    }

    /// Formats without shared vertices repeat them, some with rounding; vertices are welded to a
    /// millionth of the size.
    fn welded_by(&self, size: f64) -> Vec<u32> {
        let cell = (size * 1e-6).max(f64::MIN_POSITIVE);
        let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
        self.positions
            .iter()
            .map(|p| {
                let next = cells.len() as u32;
                *cells.entry(p.map(|x| (f64::from(x) / cell).round() as i64)).or_insert(next)
            })
            .collect()
    }

    /// Number of edges that are not traversed equally often in both directions.
    fn open_edges(&self, size: f64) -> usize {
        let welded = self.welded_by(size);
        // Passes from the lower to the higher vertex minus those back, for each edge.
        let mut balance: HashMap<(u32, u32), i64> = HashMap::new();
        for triangle in &self.triangles {
            for side in 0..3 {
                let corner = |i: usize| welded.get(triangle[i % 3] as usize).copied().unwrap_or(0);
                let (from, to) = (corner(side), corner(side + 1));
                if from != to {
                    *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
                }
            }
        }
        balance.values().filter(|&&b| b != 0).count()
    }
}
