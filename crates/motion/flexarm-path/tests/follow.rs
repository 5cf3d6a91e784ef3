//! Joints that follow a curve of the tool.

use flexarm_kinematics::{Data, Frame, Model, forward_kinematics};
use flexarm_path::ToolCurve;
use flexarm_path::internals::{Follower, FrameCurve};
use flexarm_spatial::Pose;
use flexarm_testkit::reference_arm;
use nalgebra::{DVector, Rotation3, Translation3, Vector3};

fn arm() -> (Model, Frame, DVector<f64>) {
    let model = Model::new(&reference_arm(false).mechanism).unwrap();
    let frame = model.frame("tcp").unwrap().clone();
    let q = DVector::from_vec(vec![0.2, 0.5, 0.7, 0.3, 0.8, -0.4]);
    (model, frame, q)
}

fn pose_at(model: &Model, frame: &Frame, q: &DVector<f64>) -> Pose {
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, q);
    data.X_WF(frame)
}

/// Truth: forward kinematics, and finite differences of the joint values.
#[test]
fn joints_follow_a_line_with_their_derivatives() {
    let (model, frame, q) = arm();
    let X0 = pose_at(&model, &frame, &q);
    let turned = Rotation3::new(Vector3::new(0.2, -0.3, 0.1)) * X0.rotation;
    let X1 = Pose::from_parts(Translation3::from(X0.translation.vector + Vector3::new(0.1, -0.2, 0.1)), turned);
    let line = FrameCurve::new(ToolCurve::line(&X0, &X1), frame.clone());
    let mut follower = Follower::new(&model, &frame, &q, None);
    let start = follower.start(&line, 0.0, &q).unwrap();
    let end = follower.advance(&line, 0.0, &start, line.curve.length()).unwrap();
    let X = pose_at(&model, &frame, &end.q);
    assert!((X.translation.vector - X1.translation.vector).norm() < 1e-12); // measured 1e-16
    let middle = 0.4 * line.curve.length();
    let at = |follower: &mut Follower, s: f64| follower.advance(&line, 0.0, &start, s).unwrap();
    let (h, mid) = (1e-4, at(&mut follower, middle));
    let (low, high) = (at(&mut follower, middle - h), at(&mut follower, middle + h));
    assert!(((&high.q - &low.q) / (2.0 * h) - &mid.d).amax() < 1e-6 * mid.d.amax());
    assert!(((&high.d - &low.d) / (2.0 * h) - &mid.dd).amax() < 1e-5 * mid.dd.amax());
}

#[test]
fn a_line_that_leaves_the_reach_is_blocked_where_the_arm_is_stretched() {
    let (model, frame, q) = arm();
    let X0 = pose_at(&model, &frame, &q);
    let far = X0.translation.vector + X0.translation.vector.normalize() * 20.0;
    let line = ToolCurve::line(&X0, &Pose::from_parts(Translation3::from(far), X0.rotation));
    let line = FrameCurve::new(line, frame.clone());
    let mut follower = Follower::new(&model, &frame, &q, None);
    let start = follower.start(&line, 0.0, &q).unwrap();
    let blocked = follower.advance(&line, 0.0, &start, line.curve.length()).unwrap_err();
    assert!(blocked.s > 0.0 && blocked.s < 20.0 && blocked.sigma < 0.05, "{blocked:?}");
}
