//! Size and mass of a robot, from which its own thresholds follow.
//!
//! Torques and inertias are evaluated over poses spread evenly over the joint ranges, the same in every
//! call (`spread_poses`). Not here: thresholds.

use std::collections::HashMap;

use flexarm_kinematics::{Data, LinkInertia, Mechanism, Model, gravity_forces, mass_matrix};
use nalgebra::DVector;

/// Number of poses at which gravity torques are evaluated.
const POSES: u32 = 32;

/// Size of a robot, without its payload and tool.
pub struct Size {
    /// Distance from the base along the chain, per link (m).
    distances: HashMap<String, f64>,
    /// Reach of the mass from the base: joint distances, mass centres and radii of gyration (m).
    pub(crate) extent: f64,
    /// Mass (kg).
    pub(crate) mass: f64,
}

impl Size {
    /// Returns the size of a mechanism: distances between joint origins along the chain, whatever the
    /// pose, and the whole travel of sliding joints with limits.
    pub fn of(mechanism: &Mechanism) -> Self {
        let mut distances = HashMap::new();
        let children: Vec<&str> = mechanism.joints.iter().map(|j| j.child.as_str()).collect();
        let base = mechanism.links.iter().find(|l| !children.contains(&l.name.as_str()));
        let mut open: Vec<(&str, f64)> = base.map(|l| (l.name.as_str(), 0.0)).into_iter().collect();
        while let Some((link, distance)) = open.pop() {
            distances.insert(link.to_owned(), distance);
            for joint in mechanism.child_joints(link) {
                let range = joint.limits.lower.abs().max(joint.limits.upper.abs());
                let travel = range * joint.kind.travel();
                let travel = if travel.is_finite() { travel } else { 0.0 };
                open.push((&joint.child, distance + joint.X_PJ.translation.vector.norm() + travel));
            }
        }
        let mut size = Self { distances, extent: 0.0, mass: 0.0 };
        for link in &mechanism.links {
            let own = link.inertia.filter(|i| i.mass > 0.0).map_or(0.0, |i| i.com.norm() + gyration(&i));
            size.extent = size.extent.max(size.at(&link.name) + own);
            size.mass += link.inertia.map_or(0.0, |i| i.mass);
        }
        size
    }

    /// Returns the distance of a link from the base along the chain (m).
    pub(crate) fn at(&self, link: &str) -> f64 {
        self.distances.get(link).copied().unwrap_or(0.0)
    }

    /// Returns the maximum reach beyond a link (m).
    pub(crate) fn beyond(&self, link: &str) -> f64 {
        (self.extent - self.at(link)).max(0.0)
    }
}

/// Returns the maximum radius of gyration of a body about its centre of mass (m): `√(I_max/m)`.
pub(crate) fn gyration(inertia: &LinkInertia) -> f64 {
    let largest = inertia.inertia_com.symmetric_eigenvalues().max();
    (largest.max(0.0) / inertia.mass).sqrt()
}

/// Returns the minimum density of a body with this mass and inertia (kg/m³).
pub(crate) fn least_density(inertia: &LinkInertia) -> f64 {
    flexarm_linkmaker::yardsticks::least_density(inertia.mass, &inertia.inertia_com)
}

/// Returns the maximum gravity and balancer torque of each joint of the rigid robot, over poses spread over the
/// joint ranges (N m or N).
pub(crate) fn weight_carried(model: &Model) -> DVector<f64> {
    let mut data = Data::new(model);
    let mut weight = DVector::zeros(model.nv());
    for q in spread_poses(model) {
        let torques = gravity_forces(model, &mut data, &q).abs();
        // A balancer may be out of range there, which has a caveat of its own.
        if torques.iter().all(|torque| torque.is_finite()) {
            weight = weight.sup(&torques);
        }
    }
    weight
}

/// Returns the inertia moved by each joint in the middle of the ranges, including rotors (kg m² or kg).
pub(crate) fn inertia_moved(model: &Model) -> DVector<f64> {
    let limits = |k: usize| &model.coordinates()[k].limits;
    let q = DVector::from_fn(model.nv(), |k, _| middle(limits(k).lower, limits(k).upper));
    mass_matrix(model, &mut Data::new(model), &q).diagonal()
}

/// Returns poses spread over the joint ranges (rad or m); unlimited ranges are taken as -3 to 3.
pub(crate) fn spread_poses(model: &Model) -> impl Iterator<Item = DVector<f64>> + '_ {
    let place = |pose: u32, k: usize| {
        let limits = &model.coordinates()[k].limits;
        let range = |limit: f64, other: f64| if limit.is_finite() { limit } else { other };
        let (low, high) = (range(limits.lower, -3.0), range(limits.upper, 3.0));
        low + (high - low) * halton(pose, k)
    };
    (1..=POSES).map(move |pose| DVector::from_fn(model.nv(), |k, _| place(pose, k)))
}

/// Returns the middle of a joint range; for an open range the value nearest to zero.
pub(crate) fn middle(lower: f64, upper: f64) -> f64 {
    if lower.is_finite() && upper.is_finite() { 0.5 * (lower + upper) } else { 0.0f64.max(lower).min(upper) }
}

/// Returns an entry of the Halton sequence in the base assigned to a coordinate, between 0 and 1: the
/// digits of the index in that base, mirrored at the point.
///
/// * `index`: from 1 on. `coordinate`: from 0 on; from 16 on the bases repeat.
///
/// # Source
/// Halton (1960), *Numer. Math.* 2, 84-90.
pub fn halton(mut index: u32, coordinate: usize) -> f64 {
    const PRIMES: [u32; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];
    let base = PRIMES[coordinate % PRIMES.len()];
    let (mut value, mut fraction) = (0.0, 1.0);
    while index > 0 {
        fraction /= f64::from(base);
        value += fraction * f64::from(index % base);
        index /= base;
    }
    value
}
