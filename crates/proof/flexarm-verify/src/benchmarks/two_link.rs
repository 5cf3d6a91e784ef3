//! Two-link arms of slender beams against geometrically exact beams.
//!
//! Chains of rigid parts and modal links follow two motions; compared is the distance of the tip from
//! that of the rigid arm (plane of motion, m). Truth: files of spectral elements of Reissner's beams.
//! Not here: bounds and words (`page.rs`).

use nalgebra::Vector2;

use super::{FOLDER, Method, in_plane, same_times};
use crate::Error;
use crate::bench::{Bench, Worst, columns, in_modes, in_parts};

/// Step size (s) and samples per second.
pub(super) const STEP_S: f64 = 2e-4;
const RATE_HZ: f64 = 100.0;
/// Numbers of parts of the chains.
pub(super) const PARTS: [usize; 2] = [8, 16];
/// Number of modes of the modal links.
pub(super) const MODES: usize = 4;
/// Minimum height of the beams with stiffness by load (mm): below, a link deflects by half its
/// length, and the steps do not converge.
const STIFFENED_FROM_MM: usize = 20;
/// Name, height of the beams (mm) and motion of the runs.
const RUNS: [(&str, usize, &str); 5] = [
    ("slew_30", 30, "slew.toml"),
    ("slew_20", 20, "slew.toml"),
    ("slew_10", 10, "slew.toml"),
    ("spin_30", 30, "spin.csv"),
    ("spin_10", 10, "spin.csv"),
];

/// A motion of one arm.
pub(super) struct Run {
    pub(super) name: &'static str,
    /// Maximum distance of the tip from that of the rigid arm (m).
    pub(super) peak_m: f64,
    /// Maximum distance of the tip from the truth, over the peak; one per method, NaN if it
    /// was left out.
    pub(super) errors: Vec<f64>,
    pub(super) time_s: Vec<f64>,
    /// Distance of the tip from that of the rigid arm: truth, and methods (m).
    pub(super) truth_m: Vec<f64>,
    pub(super) found_m: Vec<Vec<f64>>,
}

/// Findings on the two-link arms.
pub(super) struct TwoLink {
    pub(super) methods: Vec<String>,
    pub(super) runs: Vec<Run>,
}

/// Index of the modal links without and with stiffness by load in the list of methods.
pub(super) const LINEAR: usize = PARTS.len();
pub(super) const STIFFENED: usize = LINEAR + 1;

impl TwoLink {
    pub(super) fn new(bench: &Bench, progress: &mut dyn FnMut(f64)) -> Result<Self, Error> {
        let chains = PARTS.iter().map(|n| Method::new(in_parts(*n)));
        let modal = [Method::new(in_modes(MODES)), Method::stiffening(in_modes(MODES))];
        let methods: Vec<Method> = chains.chain(modal).collect();
        let mut runs = Vec::new();
        for (k, (name, height, motion)) in RUNS.iter().enumerate() {
            progress(k as f64 / RUNS.len() as f64);
            runs.push(Run::new(bench, &methods, name, *height, motion)?);
        }
        Ok(Self { methods: methods.into_iter().map(|method| method.name).collect(), runs })
    }
}

impl Run {
    fn new(bench: &Bench, methods: &[Method], name: &'static str, height: usize, motion: &str) -> Result<Self, Error> {
        let folder = format!("{FOLDER}/two_link");
        let robot = bench.robot(&format!("{folder}/two_link_{height}.toml"))?;
        let motion = bench.motion(&robot, &format!("{folder}/{motion}"))?;
        let names = ["t[s]", "deviation_x[m]", "deviation_y[m]"];
        let truth = columns(&bench.file(&format!("{folder}/truth_{name}.csv")), names)?;
        let deviation: Vec<Vector2<f64>> = truth.iter().map(|[_, x, y]| Vector2::new(*x, *y)).collect();
        let truth_m: Vec<f64> = deviation.iter().map(Vector2::norm).collect();
        let peak_m = truth_m.iter().copied().worst();
        let (mut errors, mut found_m) = (Vec::new(), Vec::new());
        for method in methods {
            if method.stiffening && height < STIFFENED_FROM_MM {
                errors.push(f64::NAN);
                found_m.push(Vec::new());
                continue;
            }
            let trace = method.run(&robot, &motion, STEP_S, RATE_HZ)?;
            let rows = trace.rows.iter();
            let found: Vec<Vector2<f64>> =
                rows.clone().map(|row| in_plane(row.flexible_m) - in_plane(row.rigid_m)).collect();
            let comparable = same_times(rows.map(|row| row.time_s), truth.iter().map(|[t, ..]| *t));
            let error = found.iter().zip(&deviation).map(|(a, b)| (a - b).norm()).worst() / peak_m;
            errors.push(if comparable { error } else { f64::NAN });
            found_m.push(found.iter().map(Vector2::norm).collect());
        }
        let time_s = truth.iter().map(|[t, ..]| *t).collect();
        Ok(Self { name, peak_m, errors, time_s, truth_m, found_m })
    }
}
