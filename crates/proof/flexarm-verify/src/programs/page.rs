//! The page of the case: accuracy and cost of programs, and today's build.
//!
//! Not here: numbers (`stored.rs`, `today.rs`).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::stored::{StoredMotion, StoredRun, StoredRuns};
use super::today::{MOTION, ROUNDING_M, SAMPLE_HZ, Today};
use super::{About, Findings};
use crate::page::{Bound, Case, Cell, Figure, Table, digits, error, plain, word};

/// Damping ratio of the first mode, and tolerance of DOP853 in the stored truth:
/// `tools/crosscheck/other_programs.py`.
const DAMPING: f64 = 0.03;
const STORED_TOLERANCE: f64 = 1e-12;
/// Maximum distance between converged curves, over the peak.
const CONVERGED: f64 = 1e-6;
/// Error of Exudyn's floating frame with respect to modal links, over the peak: with its marker as
/// it is, and with a structure ten times as stiff: `tools/crosscheck/exudyn_ffrf.py`.
const FLOATING_FRAME_ERRORS: [f64; 2] = [5.6e-4, 3.3e-5];

pub(super) fn page(found: &Findings) -> Case {
    let mut case = Case::new("programs", "5. Other programs", "a six-axis arm: Pinocchio, Exudyn, MuJoCo");
    let About { programs, date, machine, damping_s } = &found.about;
    case.text(format!(
        "The arm of case 4 with two rigid parts per link and the full 6x6 between them, in four programs, \
         each with its own recursions and integrators: flexarm, {}. The results of the others are stored by \
         `tools/crosscheck/other_programs.py` on {date} ({machine}), which reads robot, link and trajectory \
         files by itself. For the same model in all programs damping is proportional to stiffness \
         ({damping_s} s, {} % of the first mode) and the elastic joints have Euler angles. Truth: Pinocchio's \
         recursions with DOP853 at a tolerance of {STORED_TOLERANCE:e}. This case is about motion; cases 1 to \
         3 are about reduction.",
        programs.join(", "),
        plain(100.0 * DAMPING)
    ));
    today(&mut case, &found.today);
    if let Some(found) = &found.stored {
        stored_runs(&mut case, found);
    }
    case.heading("Other comparisons");
    let [floating_frame, stiff] = FLOATING_FRAME_ERRORS;
    case.text(format!(
        "Modal links against Exudyn's floating frame (`ObjectFFRFreducedOrder`) on the reference arm, meshes \
         assembled by NGSolve: `tools/crosscheck/exudyn_ffrf.py`. The curves differ by {floating_frame:e} of \
         the peak, because of a term of second order in Exudyn's interface marker ({stiff:e} with a structure \
         ten times as stiff). Recursions against Pinocchio entry by entry, rotating beams against a \
         geometrically exact beam, identified arms: [theory](../theory.md), with their tests."
    ));
    case
}

/// Results of this build on this machine.
fn today(case: &mut Case, found: &Today) {
    case.heading("This build against the stored truth");
    let caption = format!(
        "`trajectories/{MOTION}.toml`, tool every {} ms against the stored truth (rounded to the nanometre, {:.0e} of its peak of {:.5} mm): largest distance, along x, \
         y, z and in all, over the peak; distance at the start.",
        plain(1e3 / SAMPLE_HZ),
        ROUNDING_M / found.peak_m,
        1e3 * found.peak_m
    );
    let mut table = Table::new(caption, &["stepper", "step", "Δx", "Δy", "Δz", "Δ", "start"]);
    for stepper in &found.steppers {
        let step = format!("{} ms", plain(1e3 * stepper.step_s));
        let mut cells = vec![word(&stepper.name), word(&step)];
        cells.extend(stepper.axis_errors.into_iter().chain([stepper.error, stepper.start_error]).map(error));
        table.rows.push(cells);
        let text = format!("tool on {MOTION}, {}, {step}", stepper.name);
        case.claim(text, "Pinocchio, DOP853", stepper.error, Bound::AtMost(stepper.bound));
    }
    case.table(table);
}

/// All stored results, as one table and one picture.
fn stored_runs(case: &mut Case, found: &StoredRuns) {
    case.heading("Accuracy and cost, one run on one machine");
    let [first, second] = &found.motions;
    let mut table = stored_heads(first, second);
    for run in &found.runs {
        table.rows.push(stored_row(run));
        if run.is_converged() {
            let text = format!("stored converged curve of {} ({})", run.program, run.method);
            let apart = run.error.unwrap_or(f64::NAN);
            case.stored_claim(text, "Pinocchio, DOP853", apart, Bound::AtMost(CONVERGED));
        }
    }
    case.table(table);
    case.text(
        "Extrapolated to zero step, the curves of all four programs agree: equations of motion, inertias, \
         springs, damping and motion are the same. Rows marked \"another model\" differ at any step by terms of \
         second order in the deflection: rotation vectors instead of Euler angles between the parts, and a \
         spring of Exudyn's that takes angles for a moment.",
    );
    case.figure(cost_figure(found));
}

fn stored_heads(first: &StoredMotion, second: &StoredMotion) -> Table {
    let caption = format!(
        "Error: largest distance of the tool over the truth's peak deflection ({:.4} mm on {}, {:.4} mm on {}). CPU: milliseconds per simulated second of {}, one thread, least of three; \
         flexarm's with the rigid twin and a sample per step of the log, Exudyn's of the solver alone, MuJoCo's of its rollout in C. \"-\": not run, refused or unstable, see the note.",
        1e3 * first.peak_m,
        first.name,
        1e3 * second.peak_m,
        second.name,
        first.name
    );
    let (first, second) = (first.name.as_str(), second.name.as_str());
    let heads = ["program", "method", "step [ms]", first, "x", "y", "z", "RMS", second, "CPU [ms/s]", "note"];
    Table::new(caption, &heads)
}

fn stored_row(run: &StoredRun) -> Vec<Cell> {
    let relative = |x: Option<f64>| x.map_or(word("-"), error);
    let milli = |x: Option<f64>| x.map_or(word("-"), |x| digits(1e3 * x, 3));
    let mut cells = vec![word(&run.program), word(&run.method), milli(run.step_s), relative(run.error)];
    cells.extend(run.axis_errors.map(relative));
    cells.extend([relative(run.rms_error), relative(run.second_error), milli(run.cpu)]);
    cells.push(word(run.note.replace('|', "/")));
    cells
}

fn cost_figure(found: &StoredRuns) -> Figure {
    let mut curves: Vec<PlotCurve> = Vec::new();
    for (name, [cpu, apart]) in found.runs.iter().filter_map(StoredRun::drawn) {
        match curves.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => {
                curve.x.push(1e3 * cpu);
                curve.y.push(apart);
            }
            None => curves.push(PlotCurve { name, look: CurveLook::Marked, x: vec![1e3 * cpu], y: vec![apart] }),
        }
    }
    Figure {
        name: "programs-cost".into(),
        caption: format!(
            "{}: error over cost, one run on one machine (without other models and MuJoCo's `discrete`)",
            found.motions[0].name
        ),
        x_label: "CPU [ms per simulated second]".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "error / peak".into(), logarithmic: true, legend: true, curves }],
    }
}
