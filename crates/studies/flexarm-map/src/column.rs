//! Radius of the arm's own column: base and first moving link.

use flexarm_kinematics::{Data, Model, forward_kinematics};
use flexarm_run::Robot;
use nalgebra::{DVector, Vector3};

/// Returns the largest distance from the vertical line (world z) through the first joint of the
/// shapes that at most one joint moves, and of the second joint (m).
///
/// * `near`: joint positions (rad or m).
pub(super) fn radius(robot: &Robot, model: &Model, near: &[f64]) -> f64 {
    let mut data = Data::new(model);
    let mut q = DVector::zeros(model.nv());
    q.rows_mut(0, near.len()).copy_from_slice(near);
    forward_kinematics(model, &mut data, &q);
    // Body 0 is the world, so the first joint carries body 1.
    let Some(foot) = data.X_WB.get(1).map(|X| X.translation.vector) else { return 0.0 };
    let distance = |p: Vector3<f64>| (p - foot).xy().norm();
    let shoulder = data.X_WB.get(2).map_or(0.0, |X| distance(X.translation.vector));
    let own = robot.urdf.visuals.iter().filter(|visual| joints_before(robot, &visual.link) <= 1);
    let shapes = own.filter_map(|visual| {
        let X_WL = data.X_WF(model.frame(&visual.link)?);
        let corners = visual.geometry.triangles().ok()?.transformed(&(X_WL * visual.X_LV)).positions;
        Some(corners.into_iter().map(|p| distance(Vector3::from(p.map(f64::from)))).fold(0.0, f64::max))
    });
    shapes.fold(shoulder, f64::max)
}

/// Number of moving joints between the base and a link.
fn joints_before(robot: &Robot, link: &str) -> usize {
    let joints = &robot.rigid.joints;
    let mut at = joints.iter().find(|joint| joint.child == link);
    let mut count = 0;
    while let Some(joint) = at {
        count += usize::from(joint.kind.degrees_of_freedom() > 0);
        at = joints.iter().find(|other| other.child == joint.parent);
    }
    count
}
