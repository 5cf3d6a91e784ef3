//! Statics of a beam far beyond small deflections.

use std::path::Path;

use flexarm_run::{Modelling, Robot};

/// Tip of an elastica of unit length under a dead force across it, `alpha = F l²/EI`: along the beam
/// and across.
///
/// `θ'² = 2 alpha (sin θ_1 - sin θ)` with the slope θ_1 of the tip; `θ = θ_1 - v²` makes the integrals
/// over the beam regular. θ_1 is the one for which the length is 1.
fn elastica(alpha: f64) -> [f64; 2] {
    // Length, and the tip's place along and across, for a tip that is `short` of a right angle.
    let integrals = |short: f64| {
        let tip = std::f64::consts::FRAC_PI_2 - short;
        let (n, end) = (40_000, tip.sqrt());
        let h = end / f64::from(n);
        let mut sums = [0.0; 3];
        for k in 0..=n {
            let v = h * f64::from(k);
            let theta = tip - v * v;
            // sin θ_1 - sin θ without cancellation.
            let fall = 2.0 * (0.5 * v * v).sin() * (tip - 0.5 * v * v).cos();
            let ds =
                if k == 0 { 2.0 / (2.0 * alpha * tip.cos()).sqrt() } else { 2.0 * v / (2.0 * alpha * fall).sqrt() };
            let weight = h / 3.0 * if k == 0 || k == n { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
            for (sum, factor) in sums.iter_mut().zip([1.0, theta.cos(), theta.sin()]) {
                *sum += weight * ds * factor;
            }
        }
        sums
    };
    let (mut low, mut high) = (-30.0_f64, 1.5_f64.ln());
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        // The closer to a right angle, the longer the beam.
        if integrals(middle.exp())[0] > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let [_, along, across] = integrals(low.exp());
    [along, across]
}

/// Truth: the elastica. Newton's iteration from the straight beam does not reach the larger loads.
#[test]
fn a_beam_that_is_bent_by_a_right_angle_is_in_the_equilibrium_of_the_elastica() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let robot = Robot::load(root.join("tests/benchmarks/large_beams/princeton.toml")).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let (length, stiffness) = (0.508, 71.7e9 * 0.0123777 * 0.0032024_f64.powi(3) / 12.0);
    for force in [5.0, 50.0, 400.0, 800.0, 1000.0] {
        let linear = arm.linearise(None, [0.0, 0.0, force, 0.0, 0.0, 0.0]).unwrap();
        let tip = linear.X_WT.translation.vector;
        let [along, across] = elastica(force * length * length / stiffness);
        let off = (tip.x / length - along).hypot(tip.z / length - across);
        println!("{force} N: tip at {:.4}, {:.4} of the length, off by {off:.1e}", tip.x / length, tip.z / length);
        assert!(off < 2e-2, "{force} N: {off:e}");
    }
}
