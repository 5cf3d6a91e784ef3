//! Forces of load-dependent (geometric) stiffness of modal bodies: `f = Σ load_k G_k η`, with loads from
//! accelerations and angular velocity of the body and from the wrenches at its interfaces.

use flexarm_kinematics::{Data, JointMotion, Wrench};
use flexarm_spatial::GeometricStiffness;

use crate::plant::Plant;

/// Adds the forces of load-dependent stiffness of modal bodies, for the loads of the last
/// Newton-Euler pass in `data`; `e` and `f` are over the elastic coordinates.
pub(crate) fn add_geometric_forces(plant: &Plant, data: &Data, e: &[f64], f: &mut [f64]) {
    for element in &plant.elements {
        let Some(geometric) = &element.geometric else { continue };
        let range = plant.offset(element)..plant.offset(element) + element.size;
        for (matrix, load) in geometric.matrices().zip(geometric_loads(plant, data, element.body, geometric)) {
            if load == 0.0 {
                continue;
            }
            for (column, eta) in matrix.as_slice().chunks_exact(matrix.nrows()).zip(&e[range.clone()]) {
                for (f, g) in f[range.clone()].iter_mut().zip(column) {
                    *f += load * g * eta;
                }
            }
        }
    }
}

/// Returns the loads in the order of [`GeometricStiffness::matrices`], from the last Newton-Euler
/// pass.
fn geometric_loads<'a>(
    plant: &'a Plant,
    data: &'a Data,
    body: usize,
    geometric: &'a GeometricStiffness,
) -> impl Iterator<Item = f64> + 'a {
    let (V, A) = (data.V[body], data.A[body]);
    let (w, a) = (V.angular, A.linear + V.angular.cross(&V.linear));
    let own = [
        a.x,
        a.y,
        a.z,
        A.angular.x,
        A.angular.y,
        A.angular.z,
        w.x * w.x,
        w.y * w.y,
        w.z * w.z,
        w.x * w.y,
        w.x * w.z,
        w.y * w.z,
    ];
    let wrenches = (0..geometric.interface.len()).flat_map(move |number| {
        // The load at the interface is the negative of the wrench that the attached body requires,
        // in link axes.
        let carried = plant.model.bodies().iter().enumerate().find(|(_, b)| {
            b.parent == body && matches!(b.motion, JointMotion::Interface { interface, .. } if interface == number)
        });
        let F = carried.map_or(Wrench::zeros(), |(i, _)| {
            let R = data.X_PB[i].rotation;
            Wrench::new(-(R * data.F[i].force), -(R * data.F[i].torque))
        });
        [F.force.x, F.force.y, F.force.z, F.torque.x, F.torque.y, F.torque.z]
    });
    own.into_iter().chain(wrenches)
}
