//! Stored results of the other programs: accuracy and cost.
//!
//! Read from `tests/verification/other_programs.json`, with program, version and script. Not here:
//! this build (`today.rs`).

use serde_json::Value;

use crate::Error;
use crate::bench::Stored;

/// A motion of the stored runs.
pub(super) struct StoredMotion {
    pub(super) name: String,
    /// Maximum deflection of the truth (m).
    pub(super) peak_m: f64,
}

/// A run of a program; errors over the peak deflection of the truth, `None` if it was not run.
pub(super) struct StoredRun {
    pub(super) program: String,
    pub(super) method: String,
    pub(super) step_s: Option<f64>,
    /// On the first motion: in total, along x, y, z, root mean square.
    pub(super) error: Option<f64>,
    pub(super) axis_errors: [Option<f64>; 3],
    pub(super) rms_error: Option<f64>,
    /// In total on the second motion.
    pub(super) second_error: Option<f64>,
    /// CPU time over simulated time.
    pub(super) cpu: Option<f64>,
    pub(super) note: String,
    /// Whether the curve was extrapolated to zero step size from two runs.
    extrapolated: bool,
}

/// Results of all programs on two motions.
pub(super) struct StoredRuns {
    pub(super) motions: [StoredMotion; 2],
    pub(super) runs: Vec<StoredRun>,
}

impl StoredRuns {
    pub(super) fn new(stored: &Stored) -> Result<Option<Self>, Error> {
        let motions = stored.at("trajectories")?.as_array().cloned().unwrap_or_default();
        let [first, second] = motions.as_slice() else { return Ok(None) };
        Ok(Some(Self { motions: [first, second].map(StoredMotion::new), runs: runs(first, second) }))
    }
}

impl StoredMotion {
    fn new(of: &Value) -> Self {
        Self { name: text(&of["name"]), peak_m: of["peak_m"].as_f64().unwrap_or(f64::NAN) }
    }
}

fn text(of: &Value) -> String {
    of.as_str().unwrap_or("?").to_owned()
}

fn runs(first: &Value, second: &Value) -> Vec<StoredRun> {
    let rows = |of: &Value| of["rows"].as_array().cloned().unwrap_or_default();
    let others = rows(second);
    let mut runs: Vec<StoredRun> = Vec::new();
    let mut last = String::new();
    for (k, row) in rows(first).iter().enumerate() {
        // Both motions were run with the same list of methods.
        let same = |other: &&Value| ["program", "method", "step_s"].iter().all(|key| other[*key] == row[*key]);
        let other = others.get(k).filter(same).cloned().unwrap_or(Value::Null);
        let run = StoredRun::new(row, &other, &last);
        if !run.extrapolated {
            last.clone_from(&run.method);
        }
        runs.push(run);
    }
    runs
}

impl StoredRun {
    /// * `other`: the same run on the second motion. `last`: method of the previous row, to which
    ///   "the same" refers.
    fn new(row: &Value, other: &Value, last: &str) -> Self {
        let method = text(&row["method"]);
        let how = method.strip_prefix("the same");
        Self {
            program: text(&row["program"]),
            extrapolated: how.is_some(),
            method: how.map(|how| format!("{last}{how}")).unwrap_or(method),
            step_s: row["step_s"].as_f64(),
            error: row["error_peak_rel"].as_f64(),
            axis_errors: [0, 1, 2].map(|i| row["error_xyz_rel"][i].as_f64()),
            rms_error: row["error_rms_rel"].as_f64(),
            second_error: other["error_peak_rel"].as_f64(),
            cpu: row["cpu_s_per_s"].as_f64(),
            note: row["note"].as_str().unwrap_or("").to_owned(),
        }
    }

    /// Returns whether the run uses another model.
    fn is_another_model(&self) -> bool {
        self.note.starts_with("another model")
    }

    /// Returns whether the curve is converged: extrapolated to zero step size, or the finest run of
    /// a high-order method. All such curves must coincide.
    pub(super) fn is_converged(&self) -> bool {
        let converged = self.extrapolated || self.method == "RK4" && self.step_s.is_some_and(|h| h < 2e-4);
        converged && !self.is_another_model() && self.program != "flexarm"
    }

    /// Name and values in the picture of error over cost; `None` if the run is not drawn.
    pub(super) fn drawn(&self) -> Option<(String, [f64; 2])> {
        let (error, cpu) = (self.error?, self.cpu?);
        let wanted = self.step_s.is_some()
            && cpu.is_finite()
            && error > 0.0
            && self.program != "Pinocchio"
            && !self.is_another_model()
            && self.method != "discrete";
        let stem = self.method.split(", rtol").next().unwrap_or(&self.method);
        wanted.then(|| (format!("{}: {stem}", self.program), [cpu, error]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn row(program: &str, method: &str, note: &str) -> Value {
        json!({ "program": program, "method": method, "step_s": 1e-3, "error_peak_rel": 2e-5, "cpu_s_per_s": 0.5, "note": note })
    }

    #[test]
    fn the_same_means_the_method_above_and_is_converged() {
        let first = json!({ "rows": [row("MuJoCo", "Euler", ""), row("MuJoCo", "the same, to h = 0", "")] });
        let second = json!({ "rows": [row("MuJoCo", "Euler", ""), row("MuJoCo", "another", "")] });
        let runs = runs(&first, &second);
        assert_eq!(runs[1].method, "Euler, to h = 0");
        assert!(runs[1].is_converged() && !runs[0].is_converged());
        // A row of another method on the second motion must not be matched with this one.
        assert_eq!([runs[0].second_error, runs[1].second_error], [Some(2e-5), None]);
    }

    #[test]
    fn other_models_are_neither_drawn_nor_judged() {
        let run = |row: &Value| StoredRun::new(row, &Value::Null, "RK4");
        assert_eq!(run(&row("Exudyn", "BDF, rtol 1e-6", "")).drawn(), Some(("Exudyn: BDF".into(), [0.5, 2e-5])));
        let other = run(&row("Exudyn", "the same, to h = 0", "another model: angles"));
        assert!(other.drawn().is_none() && !other.is_converged());
        assert!(run(&row("Pinocchio", "RK4", "")).drawn().is_none());
        let mut failed = row("Exudyn", "BDF", "");
        failed["error_peak_rel"] = Value::Null;
        assert!(run(&failed).drawn().is_none());
    }
}
