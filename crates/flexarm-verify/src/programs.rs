//! The same arm and motion in other programs: stored results, and our curve of today against the stored truth.

use std::ops::ControlFlow;
use std::path::Path;

use flexarm::{ConstraintForm, Modelling, ReferenceSettings, RunOptions, StepperKind, simulate_traced};
use flexarm_draw::{CurveLook, Panel, PlotCurve};
use flexarm_kinematics::ElasticAngles;
use flexarm_stepping::Damping;
use nalgebra::Vector3;
use serde_json::Value;

use crate::Error;
use crate::Pace;
use crate::bench::{ALPHA, Bench, Stored, Worst, larger, spook};
use crate::page::{Bound, Case, Cell, Figure, Table, digits, error, word};

const ROBOT: &str = "robots/kr210/links.toml";
const STORED: &str = "other_programs.json";
const CURVE: &str = "tests/verification/kr210_pick_and_place_pinocchio.csv";

/// The case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    let mut case = Case::new("programs", "5. Other programs");
    let stored = bench.stored(STORED)?;
    let beta = stored.number("model/damping_beta_s")?;
    let versions = stored.at("versions")?.as_object().into_iter().flatten();
    let versions: Vec<String> = versions
        .filter(|(name, _)| ["exudyn", "mujoco", "pinocchio"].contains(&name.as_str()))
        .map(|(name, version)| format!("{name} {}", version.as_str().unwrap_or("?")))
        .collect();
    case.text(format!(
        "The arm of case 4, two rigid parts per link with the full 6x6 between them, in four programs, each with its own recursions and integrators: flexarm, {}. Stored by \
         `tools/crosscheck/other_programs.py` on {} ({}), which reads robot, link and trajectory files by itself. So that all have the same model, damping is proportional to \
         stiffness ({beta} s, 3 % of the first mode) and the elastic joints have Euler angles; truth is Pinocchio's recursions with DOP853 at a tolerance of 1e-12. All programs get the parts and the 6x6 of the same `.flex` files: this case is about motion, cases 1 to 3 are about reduction. Again: `python tools/crosscheck/other_programs.py`.",
        versions.join(", "),
        stored.at("date")?.as_str().unwrap_or("?"),
        stored.at("machine")?.as_str().unwrap_or("?"),
    ));
    today(&mut case, bench, beta)?;
    stored_runs(&mut case, &stored)?;
    case.heading("Elsewhere on this page and in the project");
    case.text(
        "CalculiX and NGSolve on the meshes: cases 1 to 3. Modal links against Exudyn's floating frame (`ObjectFFRFreducedOrder`) on the reference arm, meshes assembled by \
         NGSolve: `tools/crosscheck/exudyn_ffrf.py`; the tools' curves differ by 5.6e-4 of the peak, which statics put to a term of second order in Exudyn's interface marker \
         (3.3e-5 with a structure ten times as stiff). Recursions against Pinocchio entry by entry, rotating beams against a geometrically exact beam, identified arms: \
         [theory.md](theory.md), with the tests that hold them.",
    );
    Ok(case)
}

/// What this build gives on this machine.
fn today(case: &mut Case, bench: &Bench, beta: f64) -> Result<(), Error> {
    case.heading("This build against the stored truth");
    let truth = Curve::read(&bench.root.join(CURVE))?;
    let mut robot = bench.robot(ROBOT)?;
    for link in &mut robot.flexible {
        link.damping = Damping::StiffnessProportional(beta);
        link.flexible.angles = ElasticAngles::EulerZyx;
    }
    let motion = bench.motion(&robot, "trajectories/pick_and_place.toml")?;
    let mut table = Table::new(
        format!(
            "`trajectories/pick_and_place.toml`, tool every 10 ms against the stored truth (rounded to the nanometre, {:.0e} of its peak of {:.5} mm): largest distance, along x, \
             y, z and in all, over the peak; distance at the start.",
            0.5e-9 / truth.peak,
            1e3 * truth.peak
        ),
        &["stepper", "step", "Δx", "Δy", "Δz", "Δ", "start"],
    );
    let all: &[(&str, StepperKind, f64, f64)] = &[
        ("RK4", StepperKind::Rk4, 2.5e-4, 1e-6),
        ("generalised-alpha", ALPHA, 1e-3, 1e-4),
        ("generalised-alpha", ALPHA, 2.5e-4, 1e-5),
        ("SPOOK, local", spook(ConstraintForm::Local), 1e-3, 0.01),
        ("SPOOK, local", spook(ConstraintForm::Local), 1e-4, 5e-4),
        ("SPOOK, global", spook(ConstraintForm::Global), 1e-4, 5e-4),
        ("error control, 1e-9", StepperKind::Reference(ReferenceSettings::new(1e-9)), 1e-2, 2e-6),
    ];
    for (name, stepper, step_s, bound) in all.iter().filter(|(.., h, _)| !bench.quick || *h >= 2.5e-4) {
        let options = RunOptions {
            stepper: *stepper,
            step_s: *step_s,
            log_rate_hz: 100.0,
            modelling: Modelling::default(),
            ..RunOptions::default()
        };
        let (_, trace) = simulate_traced(&robot, &motion, &options, None, &mut |_, _| ControlFlow::Continue(()))?;
        let tools: Vec<Vector3<f64>> = trace.rows.iter().map(|row| Vector3::from(row.flexible_m)).collect();
        if tools.len() != truth.flexible.len() {
            let what = format!("has {} samples, the run {}: not the same motion", truth.flexible.len(), tools.len());
            return Err(flexarm::Error::File { path: bench.root.join(CURVE), what }.into());
        }
        let apart: Vec<Vector3<f64>> = tools.iter().zip(&truth.flexible).map(|(a, b)| a - b).collect();
        let most = |f: &dyn Fn(&Vector3<f64>) -> f64| apart.iter().map(f).worst() / truth.peak;
        let mut cells = vec![word(*name), word(format!("{} ms", 1e3 * step_s))];
        cells.extend((0..3).map(|i| error(most(&|d| d[i].abs()))));
        let all = most(&|d| d.norm());
        cells.extend([error(all), error(apart[0].norm() / truth.peak)]);
        table.rows.push(cells);
        let text = format!("tool on pick_and_place, {name}, {} ms", 1e3 * step_s);
        case.claim(text, "Pinocchio, DOP853", all, Bound::AtMost(*bound));
    }
    case.table(table);
    Ok(())
}

/// The stored truth.
struct Curve {
    flexible: Vec<Vector3<f64>>,
    /// Largest deflection (m).
    peak: f64,
}

impl Curve {
    fn read(path: &Path) -> Result<Self, Error> {
        let fail = |what: String| flexarm::Error::File { path: path.to_owned(), what };
        let text = std::fs::read_to_string(path).map_err(|e| fail(format!("cannot be read: {e}")))?;
        let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        let (mut flexible, mut peak) = (Vec::new(), 0.0f64);
        for row in rows {
            let values: Option<Vec<f64>> = row.split(',').map(|word| word.trim().parse().ok()).collect();
            let values = values
                .filter(|v| v.len() == 7 && v.iter().all(|x| x.is_finite()))
                .ok_or_else(|| fail(format!("row {row:?}: expected seven finite numbers")))?;
            let (rigid, tool) = (Vector3::from_column_slice(&values[1..4]), Vector3::from_column_slice(&values[4..7]));
            peak = larger(peak, (tool - rigid).norm());
            flexible.push(tool);
        }
        Ok(Self { flexible, peak })
    }
}

/// Everything that was stored, as one table and one picture.
fn stored_runs(case: &mut Case, stored: &Stored) -> Result<(), Error> {
    case.heading("Accuracy and cost, one run on one machine");
    let trajectories = stored.at("trajectories")?.as_array().cloned().unwrap_or_default();
    let [first, second] = trajectories.as_slice() else { return Ok(()) };
    let rows = |of: &Value| of["rows"].as_array().cloned().unwrap_or_default();
    let name = |of: &Value| of["name"].as_str().unwrap_or("?").to_owned();
    let peak = |of: &Value| 1e3 * of["peak_m"].as_f64().unwrap_or(f64::NAN);
    let mut table = Table::new(
        format!(
            "Error: largest distance of the tool over the truth's peak deflection ({:.4} mm on {}, {:.4} mm on {}). CPU: milliseconds per simulated second of {}, one thread, least of three; \
             flexarm's with the rigid twin and a sample per step of the log, Exudyn's of the solver alone, MuJoCo's of its rollout in C. \"-\": not run, refused or unstable, see the note.",
            peak(first),
            name(first),
            peak(second),
            name(second),
            name(first)
        ),
        &["program", "method", "step [ms]", &name(first), "x", "y", "z", "RMS", &name(second), "CPU [ms/s]", "note"],
    );
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let cell = |value: &Value| -> Cell {
        match value.as_f64() {
            Some(x) => error(x),
            None => word("-"),
        }
    };
    let second_rows = rows(second);
    let (mut curves, mut last): (Vec<PlotCurve>, String) = Default::default();
    for (k, row) in rows(first).iter().enumerate() {
        // Both motions were run with the same list.
        let same = |other: &&Value| ["program", "method", "step_s"].iter().all(|key| other[*key] == row[*key]);
        let other = second_rows.get(k).filter(same).cloned().unwrap_or(Value::Null);
        let (program, method) = (row["program"].as_str().unwrap_or("?"), row["method"].as_str().unwrap_or("?"));
        let (method, extrapolated) = match method.strip_prefix("the same") {
            Some(how) => (format!("{last}{how}"), true),
            None => (method.to_owned(), false),
        };
        let method = method.as_str();
        let step = row["step_s"].as_f64();
        let mut cells = vec![word(program), word(method), step.map_or(word("-"), |h| digits(1e3 * h, 3))];
        cells.push(cell(&row["error_peak_rel"]));
        cells.extend((0..3).map(|i| cell(&row["error_xyz_rel"][i])));
        cells.push(cell(&row["error_rms_rel"]));
        cells.push(cell(&other["error_peak_rel"]));
        cells.push(row["cpu_s_per_s"].as_f64().map_or(word("-"), |cpu| digits(1e3 * cpu, 3)));
        cells.push(word(row["note"].as_str().unwrap_or("").replace('|', "/")));
        table.rows.push(cells);

        let (cpu, apart) = (number(&row["cpu_s_per_s"]), number(&row["error_peak_rel"]));
        let is_model = row["note"].as_str().is_some_and(|note| note.starts_with("another model"));
        let drawn = step.is_some()
            && cpu.is_finite()
            && apart > 0.0
            && program != "Pinocchio"
            && !is_model
            && method != "discrete";
        if drawn {
            let stem = method.split(", rtol").next().unwrap_or(method);
            let name = format!("{program}: {stem}");
            match curves.iter_mut().find(|curve| curve.name == name) {
                Some(curve) => {
                    curve.x.push(1e3 * cpu);
                    curve.y.push(apart);
                }
                None => curves.push(PlotCurve { name, look: CurveLook::Marked, x: vec![1e3 * cpu], y: vec![apart] }),
            }
        }
        // Curves brought to no step, or the finest of a method of high order: they must be one.
        let converged = extrapolated || method == "RK4" && step.is_some_and(|h| h < 2e-4);
        if converged && !is_model && program != "flexarm" {
            let text = format!("stored converged curve of {program} ({method})");
            case.claim(text, "Pinocchio, DOP853", apart, Bound::AtMost(1e-6));
        }
        if !extrapolated {
            last = method.to_owned();
        }
    }
    case.table(table);
    case.text(
        "Brought to no step, the curves of all four programs are one to better than 1e-6 of the peak: equations of motion, inertias, springs, damping and motion are the same. Rows marked \
         \"another model\" stay away whatever the step, by terms of second order in the deflection: rotation vectors instead of Euler angles between the parts, and a spring of Exudyn's that takes \
         angles for a moment. They say how much such a choice matters, a few 1e-4 of the deflection.",
    );
    case.figure(Figure {
        name: "programs-cost".into(),
        caption: format!(
            "{}: error over cost, one run on one machine (without other models and MuJoCo's `discrete`)",
            name(first)
        ),
        x_label: "CPU [ms per simulated second]".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "error / peak".into(), logarithmic: true, legend: true, curves }],
    });
    Ok(())
}
