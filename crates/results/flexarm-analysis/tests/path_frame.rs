//! Axes along a path.

use flexarm_analysis::internals::tangential_at;
use flexarm_analysis::*;
use nalgebra::Vector3;

/// Truth: on a circle the normal points to the centre, the binormal along the axis.
#[test]
fn on_a_circle_the_normal_points_to_the_centre() {
    let times: Vec<f64> = (0..400).map(|k| 0.005 * f64::from(k) + 0.001 * f64::from(k % 2)).collect();
    let positions: Vec<[f64; 3]> = times.iter().map(|t| [0.4 * t.cos(), 0.4 * t.sin(), 0.7]).collect();
    for (t, frame) in times.iter().zip(path_frames(&times, &positions)).skip(1).take(398) {
        let inward = Vector3::new(-t.cos(), -t.sin(), 0.0);
        assert!((frame.tangential - Vector3::new(-t.sin(), t.cos(), 0.0)).norm() < 1e-7); // measured 2.0e-9
        assert!((frame.normal - inward).norm() < 1e-7); // measured 2.0e-9
        assert!((frame.binormal - Vector3::z()).norm() < 1e-9); // measured 0
    }
}

/// Frames of a path given by its position over time, every millisecond.
fn along(seconds: f64, place: impl Fn(f64) -> Vector3<f64>) -> Vec<PathFrame> {
    let times: Vec<f64> = (0..(1e3 * seconds) as u32).map(|k| 1e-3 * f64::from(k)).collect();
    let positions: Vec<[f64; 3]> = times.iter().map(|&t| place(t).into()).collect();
    path_frames(&times, &positions)
}

fn right_handed(frame: &PathFrame) -> f64 {
    (frame.tangential.cross(&frame.normal) - frame.binormal).norm()
}

/// Maximum change of the transverse axes between two successive samples.
fn largest_turn(frames: &[PathFrame]) -> f64 {
    let turn = |w: &[PathFrame]| (w[1].normal - w[0].normal).norm().max((w[1].binormal - w[0].binormal).norm());
    frames.windows(2).map(turn).fold(0.0, f64::max)
}

/// Truth: a plane curve. Where it changes from left to right, the axis out of the plane is
/// constant and the normal turns with the tangent (here by at most 1.3e-2 per sample).
#[test]
fn inflections_of_an_s_and_of_a_figure_eight_flip_nothing() {
    let tilt = nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 0.2);
    let s_curve = along(2.0, |t| tilt * Vector3::new(t, 0.3 * (std::f64::consts::PI * t).sin(), 0.0));
    let eight = along(6.0, |t| tilt * Vector3::new(0.4 * (2.0 * t).sin(), 0.8 * t.sin(), 0.0));
    for frames in [s_curve, eight] {
        let out = frames[0].binormal;
        assert!((out.dot(&(tilt * Vector3::z())).abs() - 1.0).abs() < 1e-9);
        for frame in &frames {
            assert!((frame.binormal - out).norm() < 1e-9); // measured 3e-11
            assert!(right_handed(frame) < 1e-12); // measured 4e-16
        }
        assert!(largest_turn(&frames) < 2e-2, "{}", largest_turn(&frames));
    }
}

/// Truth: closed form. With respect to the principal normal N and binormal B of a helix of
/// curvature κ and torsion τ, the frame turns back by the torsion: `n = cos(τs) N - sin(τs) B`.
#[test]
fn along_a_helix_the_axes_lag_the_principal_normal_by_its_torsion() {
    let (radius, rise, rate) = (0.3, 0.1, 1.5);
    let frames = along(8.0, |t| {
        let angle = rate * t;
        Vector3::new(radius * angle.cos(), radius * angle.sin(), rise * angle)
    });
    let length = f64::hypot(radius, rise);
    let torsion = rise / (length * length);
    let principal = |t: f64| {
        let angle = rate * t;
        let T = Vector3::new(-radius * angle.sin(), radius * angle.cos(), rise) / length;
        let N = Vector3::new(-angle.cos(), -angle.sin(), 0.0);
        (N, T.cross(&N))
    };
    for (k, frame) in frames.iter().enumerate().take(7999).skip(1) {
        let t = 1e-3 * k as f64;
        let (N, B) = principal(t);
        let lag = torsion * length * rate * t;
        assert!((frame.normal - (N * lag.cos() - B * lag.sin())).norm() < 2e-3, "{t}"); // measured 4.7e-4
    }
    assert!(largest_turn(&frames) < 2e-3);
}

/// Truth: a path that is traversed back. Only ahead and behind are exchanged; a transverse
/// error keeps its sign.
#[test]
fn turning_back_on_a_bent_path_keeps_both_axes_across() {
    let angle = |t: f64| 0.6 * (1.0 - (1.5 * t).cos());
    let frames = along(4.0, |t| Vector3::new(0.5 * angle(t).cos(), 0.5 * angle(t).sin(), 0.2));
    // It reverses at t = π / 1.5.
    let (before, after) = (&frames[2000], &frames[2190]);
    assert!((before.tangential + after.tangential).norm() < 2e-2);
    assert!((before.normal - after.normal).norm() < 2e-2 && (before.binormal - after.binormal).norm() < 1e-9);
    assert!(largest_turn(&frames) < 5e-3, "{}", largest_turn(&frames));
}

/// Truth: the axes of a straight line do not turn, even if the TCP stops and goes back.
#[test]
fn on_a_line_and_at_rest_the_axes_are_kept() {
    let times: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k)).collect();
    let direction = Vector3::new(1.0, 2.0, -2.0) / 3.0;
    let way = |t: f64| if t < 1.0 { 0.0 } else { 0.1 * (1.0 - (3.0 * (t - 1.0)).cos()) };
    let positions: Vec<[f64; 3]> = times.iter().map(|&t| (direction * way(t)).into()).collect();
    let frames = path_frames(&times, &positions);
    for sample in [0, 50, 99, 110, 250, times.len() - 1] {
        assert_eq!(tangential_at(&times, &positions, sample), frames[sample].tangential);
    }
    // at rest before the motion: the axes of its start
    assert!((frames[50].tangential - direction).norm() < 1e-12); // measured 2.2e-16
    assert_eq!(frames[50], frames[99]);
    for frame in &frames[110..] {
        assert!((frame.tangential.dot(&direction).abs() - 1.0).abs() < 1e-12); // measured 3.3e-16
        assert!((frame.normal - frames[110].normal).norm() < 1e-9); // measured 6e-17
        assert!((frame.binormal - frames[110].binormal).norm() < 1e-9); // measured 2e-16
        let ahead = frame.tangential.dot(&direction).signum();
        let handed = frame.tangential.cross(&frame.normal) - frame.binormal * ahead;
        assert!(handed.norm() < 1e-14);
    }
}

/// Truth: a circle stays in its plane from its first sample on, however slowly it begins.
#[test]
fn a_circle_from_rest_has_its_own_plane_from_the_start() {
    let tilt = nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 0.2);
    for seconds in [2.0, 60.0] {
        let times: Vec<f64> = (0..2000).map(|k| seconds * f64::from(k) / 1999.0).collect();
        let angle = |t: f64| {
            let u = t / seconds;
            2.0 * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u)
        };
        let place = |t: f64| tilt * Vector3::new(0.4 * angle(t).cos(), 0.4 * angle(t).sin(), 0.0);
        let positions: Vec<[f64; 3]> = times.iter().map(|&t| place(t).into()).collect();
        for frame in path_frames(&times, &positions) {
            assert!((frame.binormal - tilt * Vector3::z()).norm() < 1e-3); // rounding of small accelerations
        }
    }
}

#[test]
fn a_path_along_the_old_normal_still_has_axes() {
    let frame = PathFrame::world().next(&Vector3::new(0.0, 1.0, 0.0));
    assert_eq!(frame.components(&Vector3::y()), [1.0, 0.0, 0.0]);
    assert!((frame.normal.norm() - 1.0).abs() < 1e-15 && frame.normal.dot(&Vector3::y()).abs() < 1e-15);
}
