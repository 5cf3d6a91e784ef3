//! Simeon's slider crank, a closed loop with a flexible rod, against a geometrically exact beam.
//!
//! Motion in a plane; the deflection is the distance of the middle of the rod from the line between
//! its ends (m). Truths: an exact and a linear beam, stored in `tests/benchmarks/slider_crank`.

use flexarm::{LoadOptions, RobotSource};
use nalgebra::Vector2;

use super::{FOLDER, Method, in_plane, same_times};
use crate::Error;
use crate::bench::{Bench, Worst, columns, in_modes, in_parts};

/// Length of the crank (m).
const CRANK_M: f64 = 0.15;
/// Step size (s) and samples per second.
pub(super) const STEP_S: f64 = 2e-5;
const RATE_HZ: f64 = 5000.0;
/// Number of parts of each half of the rod, and of modes of each half.
const PARTS: [usize; 2] = [4, 8];
const MODES: usize = 4;

/// Results of one method.
pub(super) struct Run {
    pub(super) method: String,
    /// Maximum error of the slider's position (m): exact and linear truth.
    pub(super) slider_m: [f64; 2],
    /// Maximum error of the deflection in the middle of the rod, over its peak: exact and linear
    /// truth.
    pub(super) middle: [f64; 2],
    /// Deflection in the middle (m).
    pub(super) middle_m: Vec<f64>,
}

/// Findings on the slider crank.
pub(super) struct SliderCrank {
    /// Peaks of the deflection in the middle (m): exact and linear truth.
    pub(super) peak_m: [f64; 2],
    /// Maximum difference of the two truths: slider (m), and deflection in the middle over its
    /// peak.
    pub(super) truths_apart: (f64, f64),
    pub(super) time_s: Vec<f64>,
    /// Deflection in the middle (m): exact and linear truth.
    pub(super) truth_m: [Vec<f64>; 2],
    pub(super) runs: Vec<Run>,
}

/// Indices in the list of runs: the finest chain, modal links without and with stiffness by load,
/// and the chain with compliant constraints.
pub(super) const CHAIN: usize = PARTS.len() - 1;
pub(super) const LINEAR_ROD: usize = PARTS.len();
pub(super) const STIFFENED_ROD: usize = PARTS.len() + 1;
pub(super) const SPOOK: usize = PARTS.len() + 2;

impl SliderCrank {
    pub(super) fn new(bench: &Bench, progress: &mut dyn FnMut(f64)) -> Result<Self, Error> {
        let folder = format!("{FOLDER}/slider_crank");
        let file = format!("{folder}/slider_crank.toml");
        let robot = bench.robot(&file)?;
        let at_slider = LoadOptions { tcp: Some("slider".into()), ..LoadOptions::default() };
        let slider_robot = RobotSource::new(&bench.file(&file), &at_slider).load()?.robot().clone();
        let motion = bench.motion(&robot, &format!("{folder}/ramp.csv"))?;
        let names = ["t[s]", "exact_slider_x[m]", "exact_mid_v[m]", "linear_slider_x[m]", "linear_mid_v[m]"];
        let truth = columns(&bench.file(&format!("{folder}/truth_ramp.csv")), names)?;
        let column = |k: usize| -> Vec<f64> { truth.iter().map(|row| row[k]).collect() };
        let (slider_truth, truth_m) = ([column(1), column(3)], [column(2), column(4)]);
        let peak_m = [0, 1].map(|k| truth_m[k].iter().copied().worst());
        let crank: Vec<Vector2<f64>> = truth.iter().map(|row| crank_pin(&motion.trajectory, row[0])).collect();
        // Chains, modal rods without and with stiffness by load, compliant constraints.
        let mut methods: Vec<Method> = PARTS.iter().map(|n| Method::new(in_parts(*n))).collect();
        methods.extend([Method::new(in_modes(MODES)), Method::stiffening(in_modes(MODES))]);
        methods.push(Method::spook(in_parts(PARTS[1])));
        let (mut runs, count) = (Vec::new(), methods.len());
        for (k, method) in methods.into_iter().enumerate() {
            progress(k as f64 / count as f64);
            // The middle of the rod and the slider are two frames: a run for each.
            let middle = method.run(&robot, &motion, STEP_S, RATE_HZ)?;
            let slider = method.run(&slider_robot, &motion, STEP_S, RATE_HZ)?;
            let comparable = same_times(middle.rows.iter().map(|row| row.time_s), truth.iter().map(|row| row[0]));
            let slider_x: Vec<f64> = slider.rows.iter().map(|row| row.flexible_m[0]).collect();
            let places = middle.rows.iter().map(|row| in_plane(row.flexible_m));
            let middle_m: Vec<f64> =
                places.zip(&crank).zip(&slider_x).map(|((at, pin), x)| lateral(at, pin, *x)).collect();
            let checked = |x: f64| if comparable { x } else { f64::NAN };
            let slider_m = [0, 1].map(|k| checked(apart(&slider_x, &slider_truth[k])));
            let middle = [0, 1].map(|k| checked(apart(&middle_m, &truth_m[k]) / peak_m[k]));
            runs.push(Run { method: method.name, slider_m, middle, middle_m });
        }
        let truths_apart = (apart(&slider_truth[0], &slider_truth[1]), apart(&truth_m[0], &truth_m[1]) / peak_m[0]);
        Ok(Self { peak_m, truths_apart, time_s: column(0), truth_m, runs })
    }
}

/// Position of the crank's pin at time `t` (m).
fn crank_pin(trajectory: &flexarm::motions::Trajectory, t: f64) -> Vector2<f64> {
    let (mut q, mut rates) = ([0.0], [0.0]);
    trajectory.sample(t, &mut q, &mut rates, &mut [0.0]);
    CRANK_M * Vector2::new(q[0].cos(), q[0].sin())
}

/// Distance of a point from the line from the crank's pin to the slider at `(x, 0)`, positive on
/// the left (m).
fn lateral(point: Vector2<f64>, pin: &Vector2<f64>, x: f64) -> f64 {
    let chord = (Vector2::new(x, 0.0) - pin).normalize();
    chord.perp(&(point - pin))
}

/// Maximum distance between two curves.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a - b).worst()
}
