//! Strain gauges on the surface of a link.
//!
//! ```text
//! ε = dᵀ ε d,   ε_ii = (σ_ii - ν (σ_jj + σ_kk)) / E,   ε_ij = σ_ij / 2G
//! ```
//! with the direction d of the gauge in the tangent plane of the surface. Start at
//! [`StressFields::strain_by_stress`]. Link axes, m, Pa. Not here: the stress
//! ([`super::StressMap`]).

use nalgebra::{Rotation3, Unit, Vector3};

use super::error::StressError;
use super::fields::StressFields;

/// Minimum sine of the angle between the direction of a gauge and the normal of the surface.
const TANGENTIAL: f64 = 0.1;

impl StressFields {
    /// Returns the index of the site nearest to a point; of a node with several materials the first
    /// one.
    ///
    /// * `point`: link axes, m.
    ///
    /// # Errors
    /// [`StressError`] if the point is farther from it than the longest edge at this node, or there
    /// is no surface.
    pub fn nearest_site(&self, point: &Vector3<f64>) -> Result<usize, StressError> {
        let place = |k: u32| self.sites[k as usize].position;
        let from = |k: &u32| (place(*k) - point).norm();
        let nearest = self.triangles.iter().flatten().copied().min_by(|a, b| from(a).total_cmp(&from(b)));
        let site = nearest.ok_or_else(|| StressError("the stress file has no surface".into()))?;
        let own = self.triangles.iter().filter(|corners| corners.contains(&site)).flatten();
        let edge = own.map(|k| (place(*k) - place(site)).norm()).fold(0.0, f64::max);
        let off = from(&site);
        if off > edge {
            let (at, off) = (place(site) * 1e3, 1e3 * off);
            return Err(StressError(format!(
                "the nearest node of the surface, at ({:.1}, {:.1}, {:.1}) mm, is {off:.1} mm away, farther than the \
                 edges of the mesh there: give a point on the surface, in the axes of the link (m)",
                at.x, at.y, at.z
            )));
        }
        Ok(site as usize)
    }

    /// Returns the outward unit normal of the surface at a site, link axes: mean of its triangles
    /// with weights that are exact on a sphere.
    ///
    /// ```text
    /// n ~ Σ e × f / (|e|² |f|²)      e, f: edges of a triangle that start at the site
    /// ```
    /// # Panics
    /// For an index that is not a site.
    ///
    /// # Source
    /// Max (1999), *J. Graphics Tools* 4(2).
    pub fn normal(&self, site: usize) -> Vector3<f64> {
        let edge = |k: u32| self.sites[k as usize].position - self.sites[site].position;
        let weighted = self.triangles.iter().filter_map(|corners| {
            let k = corners.iter().position(|corner| *corner as usize == site)?;
            let [e, f] = [1, 2].map(|next| edge(corners[(k + next) % 3]));
            Some(e.cross(&f) / (e.norm_squared() * f.norm_squared()))
        });
        weighted.sum::<Vector3<f64>>().normalize()
    }

    /// Returns the strain along a direction on the surface per unit of each stress component `xx yy
    /// zz xy yz zx` (1/Pa).
    ///
    /// * `direction`: link axes, any length; its part in the tangent plane counts.
    /// * `angle`: by which it is turned about the outward normal (rad).
    ///
    /// # Errors
    /// [`StressError`] for a direction normal to the surface.
    pub fn strain_by_stress(&self, site: usize, direction: &Vector3<f64>, angle: f64) -> Result<[f64; 6], StressError> {
        let n = self.normal(site);
        let along = direction - n * n.dot(direction);
        // Not above, rather than below: a direction of zero length gives no number.
        if !(along.norm() > TANGENTIAL * direction.norm()) {
            let n = n.map(|x| (x * 100.0).round() / 100.0 + 0.0);
            return Err(StressError(format!(
                "the direction has no part along the surface, whose normal there is [{}, {}, {}]",
                n.x, n.y, n.z
            )));
        }
        let d = Rotation3::from_axis_angle(&Unit::new_unchecked(n), angle) * along.normalize();
        let material = &self.materials[self.sites[site].material];
        let (E, nu) = (material.E, material.nu);
        let G = material.G.unwrap_or(E / (2.0 * (1.0 + nu)));
        let normal = |c: usize| (d[c] * d[c] * (1.0 + nu) - nu) / E;
        let shear = |a: usize, b: usize| d[a] * d[b] / G;
        Ok([normal(0), normal(1), normal(2), shear(0, 1), shear(1, 2), shear(2, 0)])
    }
}
