//! Statics of a beam far beyond small deflections.
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]
#![allow(clippy::print_stdout, reason = "measured errors beside their bounds")]

use std::path::Path;

use flexarm::{Modelling, Robot};

/// Tip of an elastica of unit length under a dead force across it, `alpha = F l²/EI`: along the beam
/// and across. Shooting for `θ'' = -alpha cos θ`, `θ(0) = 0`, `θ'(1) = 0`.
fn elastica(alpha: f64) -> [f64; 2] {
    let shot = |bend: f64| {
        let (n, mut state) = (20_000, [0.0, bend, 0.0, 0.0]);
        let h = 1.0 / f64::from(n);
        let rate = |s: &[f64; 4]| [s[1], -alpha * s[0].cos(), s[0].cos(), s[0].sin()];
        let moved = |s: &[f64; 4], by: f64, k: &[f64; 4]| std::array::from_fn(|i| s[i] + by * k[i]);
        for _ in 0..n {
            let a = rate(&state);
            let b = rate(&moved(&state, 0.5 * h, &a));
            let c = rate(&moved(&state, 0.5 * h, &b));
            let d = rate(&moved(&state, h, &c));
            state = std::array::from_fn(|i| state[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        state
    };
    // The tip turns by less than a right angle: θ'(0)² = 2 alpha sin θ(1).
    let (mut low, mut high) = (0.0, (2.0 * alpha).sqrt());
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let tip = shot(middle);
        if tip[1] > 0.0 || tip[0] > std::f64::consts::FRAC_PI_2 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let tip = shot(low);
    [tip[2], tip[3]]
}

/// Truth: the elastica. Newton's iteration from the straight beam does not reach the larger loads.
#[test]
fn a_beam_that_is_bent_by_a_right_angle_is_in_the_equilibrium_of_the_elastica() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let robot = Robot::load(root.join("tests/benchmarks/large_beams/princeton.toml")).unwrap();
    let arm = robot.flexible(Modelling::default()).unwrap();
    let (length, EI) = (0.508, 71.7e9 * 0.0123777 * 0.0032024_f64.powi(3) / 12.0);
    for force in [5.0, 50.0, 400.0, 800.0, 1000.0] {
        let linear = arm.linearise(None, [0.0, 0.0, force, 0.0, 0.0, 0.0]).unwrap();
        let tip = linear.X_WT.translation.vector;
        let [along, across] = elastica(force * length * length / EI);
        let off = (tip.x / length - along).hypot(tip.z / length - across);
        println!("{force} N: tip at {:.4}, {:.4} of the length, off by {off:.1e}", tip.x / length, tip.z / length);
        assert!(off < 2e-2, "{force} N: {off:e}");
    }
}
