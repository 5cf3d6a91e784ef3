//! Lines, arcs and quintics of the tool.

use flexarm_path::{ArcError, ToolCurve, ToolJet};
use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{Rotation3, Translation3, Vector3, Vector6};
use proptest::prelude::*;

fn pose(v: [f64; 6]) -> Pose {
    Pose::from_parts(Translation3::new(v[0], v[1], v[2]), Rotation3::new(Vector3::new(v[3], v[4], v[5])))
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    let R = a.rotation.inverse() * b.rotation;
    (a.translation.vector - b.translation.vector).norm() + rotation_vector(R.matrix()).norm()
}

/// Second algorithm: central differences of the poses and of the first derivative.
fn assert_derivatives(curve: &ToolCurve, bound: f64) -> Result<(), TestCaseError> {
    for k in 1..8 {
        let (s, h) = (curve.length() * f64::from(k) / 8.0, 1e-4 * curve.length());
        let (low, mid, high) = (curve.at(s - h), curve.at(s), curve.at(s + h));
        let dp = (high.X.translation.vector - low.X.translation.vector) / (2.0 * h);
        let R = high.X.rotation.matrix() * low.X.rotation.matrix().transpose();
        let w = rotation_vector(&R) / (2.0 * h);
        let A = (high.V - low.V) / (2.0 * h);
        let V = Vector6::new(dp.x, dp.y, dp.z, w.x, w.y, w.z);
        let scale = 1.0 + mid.V.norm() + mid.A.norm() * curve.length();
        prop_assert!((V - mid.V).norm() <= bound * scale, "V {:.2e} of {scale}", (V - mid.V).norm());
        prop_assert!((A - mid.A).norm() * curve.length() <= bound * scale, "A {:.2e}", (A - mid.A).norm());
    }
    Ok(())
}

proptest! {
    #[test]
    fn a_line_meets_both_poses_and_turns_evenly(a in prop::array::uniform6(-1.0..1.0f64), b in prop::array::uniform6(-1.0..1.0f64)) {
        let (X0, X1) = (pose(a), pose(b));
        let line = ToolCurve::line(&X0, &X1);
        prop_assert!(apart(&line.at(0.0).X, &X0) < 1e-14);
        prop_assert!(apart(&line.at(line.length()).X, &X1) < 1e-12); // measured 6e-16
        prop_assert_eq!(line.at(0.1).V, line.at(0.3).V);
        assert_derivatives(&line, 1e-7)?;
    }

    /// Truth: every point has the same distance from the centre as the three given ones, and
    /// the target is reached.
    #[test]
    fn an_arc_passes_its_three_points_at_one_distance_from_its_centre(
        a in prop::array::uniform6(-1.0..1.0f64), b in prop::array::uniform6(-1.0..1.0f64),
        via in prop::array::uniform3(-1.0..1.0f64), with_path in any::<bool>(), by_via in any::<bool>(),
    ) {
        let (X0, X1, via) = (pose(a), pose(b), Vector3::from(via));
        let (u, v) = (via - X0.translation.vector, X1.translation.vector - X0.translation.vector);
        prop_assume!(u.cross(&v).norm() > 0.05);
        let R_via = Rotation3::new(Vector3::new(0.1, -0.2, 0.3)) * X0.rotation;
        let arc = ToolCurve::arc(&X0, &via, by_via.then_some(&R_via), &X1, None, with_path).unwrap();
        prop_assert!(apart(&arc.at(0.0).X, &X0) < 1e-12);
        prop_assert!(apart(&arc.at(arc.length()).X, &X1) < 1e-10); // measured 4e-14
        let nearest = |target: &Vector3<f64>| (0..=20000)
            .map(|k| (arc.at(arc.length() * f64::from(k) / 2e4).X.translation.vector - target).norm())
            .fold(f64::INFINITY, f64::min);
        prop_assert!(nearest(&via) < 1e-4 * arc.length());
        prop_assert!((arc.at(0.4 * arc.length()).V.fixed_rows::<3>(0).norm() - 1.0).abs() < 1e-12);
        assert_derivatives(&arc, 1e-6)?;
    }

    #[test]
    fn a_quintic_between_two_jets_has_both(
        a in prop::array::uniform6(-1.0..1.0f64), b in prop::array::uniform6(-1.0..1.0f64),
        v in prop::array::uniform6(-1.0..1.0f64), w in prop::array::uniform6(-1.0..1.0f64),
        c in prop::array::uniform6(-1.0..1.0f64), d in prop::array::uniform6(-1.0..1.0f64),
    ) {
        let jet = |x, v, a| ToolJet { X: pose(x), V: Vector6::from(v), A: Vector6::from(a) };
        let (start, end) = (jet(a, v, c), jet(b, w, d));
        let curve = ToolCurve::between(&start, &end, 1.3);
        for (found, truth) in [(curve.at(0.0), start), (curve.at(1.3), end)] {
            prop_assert!(apart(&found.X, &truth.X) < 1e-11);
            prop_assert!((found.V - truth.V).norm() < 1e-10); // measured 2e-14
            prop_assert!((found.A - truth.A).norm() < 1e-9);
        }
        assert_derivatives(&curve, 2e-4)?;
    }
}

/// Truth: a quarter circle of radius 1 about z from (1,0,0), continued to three quarters.
#[test]
fn an_angle_carries_an_arc_beyond_its_third_point_and_the_orientation_with_it() {
    let X0 = Pose::from_parts(Translation3::new(1.0, 0.0, 0.0), Rotation3::identity());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let via = Vector3::new(half, half, 0.0);
    let quarter = std::f64::consts::FRAC_PI_2;
    let X1 = Pose::from_parts(Translation3::new(0.0, 1.0, 0.0), Rotation3::new(Vector3::z() * quarter));
    for with_path in [false, true] {
        let arc = ToolCurve::arc(&X0, &via, None, &X1, Some(3.0 * quarter), with_path).unwrap();
        let end = Pose::from_parts(Translation3::new(0.0, -1.0, 0.0), Rotation3::new(Vector3::z() * (3.0 * quarter)));
        assert!(apart(&arc.at(arc.length()).X, &end) < 1e-14);
        assert!((arc.length() - 3.0 * quarter).abs() < 1e-14);
    }
    // In the opposite sense.
    let back = ToolCurve::arc(&X0, &via, None, &X1, Some(-quarter), false).unwrap();
    assert!((back.at(back.length()).X.translation.vector - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-14);
    let line = Vector3::new(0.5, 0.5, 0.0);
    assert_eq!(ToolCurve::arc(&X0, &line, None, &X1, None, false), Err(ArcError::Straight));
}

/// Start, middle and end of an arc about z of radius 0.1 m from (0.1, 0, 0) over an angle, with
/// end orientation.
fn about_z(angle: f64, R0: Rotation3<f64>, R1: Rotation3<f64>) -> [Pose; 3] {
    let at = |a: f64, R| Pose::from_parts(Translation3::new(0.1 * a.cos(), 0.1 * a.sin(), 0.0), R);
    [at(0.0, R0), at(angle / 2.0, R0), at(angle, R1)]
}

/// Total angle by which the tool turns along a curve.
fn turned(arc: &ToolCurve) -> f64 {
    (0..1000).map(|k| arc.at(arc.length() * (f64::from(k) + 0.5) / 1e3).V.fixed_rows::<3>(3).norm()).sum::<f64>()
        * arc.length()
        / 1e3
}

proptest! {
    /// Truth: the tool keeps its orientation. With rounded end orientations the total rotation
    /// grows by at most (a/2) / sin(a/2), 21 at the largest angle a.
    #[test]
    fn a_tool_that_is_told_the_same_orientation_at_both_ends_of_an_arc_does_not_turn(
        angle in prop_oneof![Just(std::f64::consts::PI), 3.1..3.2f64, 0.3..6.0f64],
        r in prop::array::uniform3(-3.0..3.0f64), noise in prop::array::uniform3(-1e-3..1e-3f64),
        with_path in any::<bool>(), by_via in any::<bool>(), rounded in any::<bool>(),
    ) {
        let R0 = Rotation3::new(Vector3::from(r));
        let noise = if rounded { Vector3::from(noise) } else { Vector3::zeros() };
        let [X0, X_via, X1] = about_z(angle, R0, Rotation3::new(noise) * R0);
        let via = by_via.then_some(&R0);
        let arc = ToolCurve::arc(&X0, &X_via.translation.vector, via, &X1, None, with_path).unwrap();
        let bound = 1e-9 + 25.0 * noise.norm();
        prop_assert!(turned(&arc) < bound, "{} rad", turned(&arc)); // measured up to 1e-13 without rounding
    }

    /// Truth: a tool that is programmed to turn with the tangent turns by the angle of the arc.
    #[test]
    fn a_tool_that_follows_the_tangent_turns_by_the_angle_of_the_arc(angle in 0.3..6.0f64, r in prop::array::uniform3(-3.0..3.0f64)) {
        let R0 = Rotation3::new(Vector3::from(r));
        let [X0, X_via, X1] = about_z(angle, R0, Rotation3::new(Vector3::z() * angle) * R0);
        let arc = ToolCurve::arc(&X0, &X_via.translation.vector, None, &X1, None, true).unwrap();
        prop_assert!((turned(&arc) - angle).abs() < 1e-9);
    }
}

/// Truth: a rotation to the auxiliary point and on to the end continues in one sense.
#[test]
fn an_orientation_at_the_auxiliary_point_is_passed_in_one_sense() {
    for (via, end) in [(2.0, 4.0), (-2.0, -4.0), (3.0, 5.0)] {
        let R = |a: f64| Rotation3::new(Vector3::new(0.0, 0.6, 0.8) * a);
        let [X0, X_via, X1] = about_z(std::f64::consts::PI, R(0.0), R(end));
        let arc = ToolCurve::arc(&X0, &X_via.translation.vector, Some(&R(via)), &X1, None, false).unwrap();
        assert!((turned(&arc) - f64::abs(end)).abs() < 1e-6, "{via} {end}: {}", turned(&arc));
    }
}

/// Truth: three quarters backwards end at the same place as one quarter forwards, with the
/// orientation turned back by three quarters.
#[test]
fn an_arc_backwards_turns_the_orientation_backwards() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let [X0, X_via, X1] = about_z(quarter, Rotation3::identity(), Rotation3::new(Vector3::x() * 0.3));
    let arc = ToolCurve::arc(&X0, &X_via.translation.vector, None, &X1, Some(-3.0 * quarter), false).unwrap();
    let end = Pose::from_parts(X1.translation, Rotation3::new(Vector3::x() * -0.9));
    assert!(apart(&arc.at(arc.length()).X, &end) < 1e-12);
}
