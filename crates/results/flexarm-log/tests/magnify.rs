//! The magnified arm: properties it keeps, and displacements it enlarges.

use crate::synthetic;
use flexarm_draw::Magnifier;
use flexarm_kinematics::{Pose, rotation_vector};
use flexarm_log::RunHeader;

fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.translation.vector - b.translation.vector).norm()
        + rotation_vector((a.rotation.inverse() * b.rotation).matrix()).norm()
}

fn with_factor(magnification: f64) -> Magnifier {
    Magnifier::new(&RunHeader { magnification, ..synthetic::header() })
}

#[test]
fn factor_one_gives_the_flexible_robot() {
    for step in [0, 250, 600, 700] {
        let sample = synthetic::sample(step);
        let same = with_factor(1.0).magnified(&sample);
        let pairs = same.X_WL.iter().zip(&sample.flexible.X_WL).chain(same.X_WS.iter().zip(&sample.flexible.X_WS));
        let worst = pairs.map(|(a, b)| distance(a, b)).fold(distance(&same.X_WT, &sample.flexible.X_WT), f64::max);
        assert!(worst < 1e-12, "{worst:e}");
    }
}

/// Truth: to first order the displacement of the TCP is multiplied; the rest is of second order in
/// the angle, here 1.7e-3 rad times 20.
#[test]
fn the_tool_moves_by_the_factor_to_first_order() {
    let sample = synthetic::sample(640);
    let from_rigid = |X_WT: &Pose| X_WT.translation.vector - sample.rigid.X_WT.translation.vector;
    // Reference from the sample itself: the magnifier must not be its own truth.
    let (once, twenty) = (from_rigid(&sample.flexible.X_WT), from_rigid(&with_factor(20.0).magnified(&sample).X_WT));
    let error = (twenty - once * 20.0).norm() / twenty.norm();
    assert!(error < 0.04, "{error}");
}

/// Truth: a rigid link keeps its length and a joint stays closed at any factor; here forearm to
/// tool, and the joint at the end of the flexible link.
#[test]
fn rigid_links_stay_rigid_and_joints_stay_closed() {
    let sample = synthetic::sample(640);
    let large = with_factor(200.0).magnified(&sample);
    let relative = large.X_WL[3].inv_mul(&large.X_WL[4]);
    let truth = sample.rigid.X_WL[3].inv_mul(&sample.rigid.X_WL[4]);
    assert!(distance(&relative, &truth) < 1e-12);
    let gap = (large.X_WS[1].translation.vector - large.X_WL[3].translation.vector).norm();
    assert!(gap < 1e-12, "{gap:e}");
    assert!((large.X_WT.translation.vector - sample.rigid.X_WT.translation.vector).norm() > 0.1, "it is seen");
}
