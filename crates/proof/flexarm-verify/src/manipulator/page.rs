//! The page of the case, first half: one motion by every model and stepper; a pick.
//!
//! Not here: numbers (`methods.rs`, `pick.rs`), drives (`drives_page.rs`).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::drives_page::{elastic_drives, which_flexibility};
use super::methods::{CONSTRAINTS, EIGHT_PARTS, FINE_CONSTRAINTS, MODAL, Methods, TWO_PARTS};
use super::pick::{self, LOADS, Pick};
use super::runs::{Run, SAMPLE_MS, Sizes};
use super::{ALL_MODES, AXES, DAMPING, Findings, LINKS, TOLERANCE};
use crate::bench::in_modes;
use crate::page::{Bound, Case, Cell, Figure, Table, digits, error, fixed, plain, word};

/// Every second sample is drawn: 4 ms, a seventh of the period of the fourth mode.
const DRAWN: usize = 2;
/// Payload of the arm (kg): `robots/kr210/README.md`.
const PAYLOAD_KG: f64 = 150.0;

pub(super) fn page(found: &Findings) -> Case {
    let mut case =
        Case::new("manipulator", "4. A whole manipulator", "a six-axis arm in motion: modal links, error control");
    case.text(format!(
        "`{LINKS}`: a six-axis arm of the KR 210 class with {PAYLOAD_KG} kg, whose link arm and forearm are \
         castings reduced from meshes of 10-node tetrahedra. Joints follow the motion exactly. Deflection: \
         flexible minus rigid TCP, world axes. Truth: the same robot with modal links (all ten \
         fixed-interface modes) by the stepper with error control, tolerance {TOLERANCE:e}. Commands: \
         `flexarm compare {LINKS} large_moves --links modal --stepper reference --rtol {TOLERANCE:e}`, with \
         `--with links=lumped,segments=4`; `--stepper spook --step 1e-4`."
    ));
    for motion in &found.motions {
        methods(&mut case, motion);
    }
    if let Some(found) = &found.pick {
        pick(&mut case, found);
    }
    case.heading("Causes of the differences");
    case.text(
        "Two parts carry the weight of each casting in two lumps (cases 1 and 3), which is half or more of \
         their distance from modal links. Chains reduce it and then stop: the seat of the forearm lies along \
         the line from A to B, and slices across that line do not contain the deformation of seat and drum \
         under weight. Modal links need no inner modes here, because the modes of the arm are far below those \
         of a casting with both ends held. Compliant constraints add two causes: damping proportional to \
         stiffness, where the other rows damp each mode by 3 %, and their first order in the step. The preset \
         `source` ties damping to the step.",
    );
    which_flexibility(&mut case, &found.flexibilities);
    elastic_drives(&mut case, &found.elastic_drives);
    case
}

/// Maximum deflections along x, y, z and in total, and sag at the start, in millimetres.
pub(super) fn deflections(run: &Run, decimals: usize) -> impl Iterator<Item = Cell> {
    let [x, y, z, all] = run.peaks().listed();
    [x, y, z, all, run.sag_m].into_iter().map(move |u| fixed(1e3 * u, decimals))
}

/// Distances along x, y, z and in total.
pub(super) fn distances(error_of: Sizes) -> [Cell; 4] {
    error_of.listed().map(error)
}

/// Deflection of a run along an axis over time (mm).
pub(super) fn curve(run: &Run, name: &str, look: CurveLook, axis: usize) -> PlotCurve {
    PlotCurve {
        name: name.into(),
        look,
        x: run.times_s.iter().step_by(DRAWN).copied().collect(),
        y: run.deflection_m.iter().step_by(DRAWN).map(|d| 1e3 * d[axis]).collect(),
    }
}

/// One motion, every model and stepper.
fn methods(case: &mut Case, found: &Methods) {
    case.heading(&format!("`trajectories/{}.toml`, links alone", found.motion));
    case.table(methods_table(found));
    // Spring-damper and compliant constraints with two parts; then the chain that closes the
    // remaining gap; then the error of the stepper only.
    let bounds =
        [(TWO_PARTS, 0.01), (CONSTRAINTS, 0.01), (FINE_CONSTRAINTS, 0.01), (EIGHT_PARTS, 0.004), (MODAL, 2e-4)];
    for (k, bound) in bounds {
        let made = &found.made[k];
        let text = format!("tool on {}, {}: largest distance over the peak deflection", found.motion, made.name());
        case.claim(text, "modal links, error control", made.error.all, Bound::AtMost(bound));
    }
    let caption = format!(
        "Compliant constraints (local) taken apart, same two parts: distance of the tool from the stepper with error control, over the peak, with damping \
         proportional to stiffness in both ({} % of {:.2} Hz). What is left is the stepper's own error.",
        plain(100.0 * DAMPING),
        found.truth.frequencies_hz[0]
    );
    let mut table = Table::new(caption, &["step", "distance", "spring-damper, same step"]);
    for step in &found.steps {
        let name = format!("{} ms", plain(1e3 * step.step_s));
        table.rows.push(vec![word(name), error(step.constraints), error(step.spring_damper)]);
    }
    case.table(table);
    case.figure(methods_figure(found));
}

fn methods_table(found: &Methods) -> Table {
    let caption = format!(
        "Largest deflection along x, y, z and in all [mm], sag at the start [mm], first frequency there [Hz]; then the largest distance of the tool from that of the \
         truth along x, y, z and in all, over the truth's peak of {:.4} mm. {} s, tool seen every {} ms.",
        1e3 * found.peak_m,
        found.truth.duration_s,
        plain(SAMPLE_MS)
    );
    let heads = ["links", "stepper", "x", "y", "z", "peak", "sag", "f_1", "Δx", "Δy", "Δz", "Δ"];
    let mut table = Table::new(caption, &heads);
    let row = |links: &str, stepper: &str, run: &Run, distances: [Cell; 4]| {
        let mut cells = vec![word(links), word(stepper)];
        cells.extend(deflections(run, 4));
        cells.push(digits(run.frequencies_hz.first().copied().unwrap_or(f64::NAN), 5));
        cells.extend(distances);
        cells
    };
    table.rows.push(row("rigid", "-", &found.rigid, distances(found.rigid_error)));
    for made in &found.made {
        table.rows.push(row(&made.links, &made.stepper, &made.run, distances(made.error)));
    }
    let nothing = [(); 4].map(|()| word(""));
    table.rows.push(row(&in_modes(ALL_MODES).0, "error control (truth)", &found.truth, nothing));
    table
}

fn methods_figure(found: &Methods) -> Figure {
    let Methods { motion, truth, peak_m, made, .. } = found;
    let mut panels = Vec::new();
    for (axis, letter) in AXES.iter().enumerate() {
        let mut curves = vec![curve(truth, "modal", CurveLook::Total, axis)];
        let shown = [TWO_PARTS, FINE_CONSTRAINTS].map(|k| &made[k]);
        curves.extend(shown.map(|made| curve(&made.run, &made.name(), CurveLook::Dashed, axis)));
        panels.push(Panel { label: format!("deflection {letter} [mm]"), logarithmic: false, legend: true, curves });
    }
    let distances = [TWO_PARTS, EIGHT_PARTS, FINE_CONSTRAINTS].map(|k| {
        let pairs = made[k].run.tool_m.iter().zip(&truth.tool_m).step_by(DRAWN);
        PlotCurve {
            name: made[k].name(),
            look: CurveLook::Plain,
            x: truth.times_s.iter().step_by(DRAWN).copied().collect(),
            y: pairs.map(|(a, b)| 100.0 * (a - b).norm() / peak_m).collect(),
        }
    });
    panels.push(Panel { label: "Δ [% of peak]".into(), logarithmic: false, legend: true, curves: distances.into() });
    Figure {
        name: format!("manipulator-{}", motion.replace('_', "-")),
        caption: format!("{motion}: deflection of the tool, and distance from modal links"),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels,
    }
}

/// A workpiece that is picked up and set down.
fn pick(case: &mut Case, found: &Pick) {
    case.heading(&format!("`{LOADS}`, links alone"));
    let caption = format!(
        "The gripper of {} kg picks a workpiece of {} kg up at {} s and sets it down at {} s: its weight comes and goes at once, and the arm rings. Largest deflection along \
         x, y, z and in all [mm], sag at the start [mm]; largest distance of the tool from that of the stepper with error control (tolerance {TOLERANCE:e}), over its peak, same links.",
        plain(found.gripper_kg),
        plain(found.workpiece_kg),
        plain(found.picked_s),
        plain(found.placed_s)
    );
    // Each stepper against error control on the same links.
    let mut table = Table::new(caption, &["links", "stepper", "x", "y", "z", "peak", "sag", "Δ"]);
    let row = |links: &str, stepper: &str, run: &Run, distance: Cell| {
        let cells = [word(links), word(stepper)].into_iter().chain(deflections(run, 4));
        cells.chain([distance]).collect()
    };
    for picked in &found.picked {
        let pick::Picked { links, stepper, explicit, run, error: apart } = picked;
        table.rows.push(row(links, stepper, run, error(*apart)));
        let text =
            format!("tool with a workpiece picked up and set down, {links}, {stepper}: largest distance over the peak");
        let bound = if *explicit { 1e-4 } else { 5e-3 };
        case.claim(text, "the same links, error control", *apart, Bound::AtMost(bound));
    }
    // The runs with error control themselves, for their deflections.
    for (links, run) in &found.truths {
        table.rows.push(row(links, "error control", run, word("")));
    }
    case.table(table);
    // The curve along z, in which the workpiece loads the arm.
    let drawn = &found.picked[pick::DRAWN];
    let curves = vec![
        curve(&found.truths[0].1, "error control", CurveLook::Total, 2),
        curve(&drawn.run, &drawn.stepper, CurveLook::Dashed, 2),
    ];
    case.figure(Figure {
        name: "manipulator-pick".into(),
        caption: "pick_and_place with its workpiece: deflection of the tool".into(),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "deflection z [mm]".into(), logarithmic: false, legend: true, curves }],
    });
}
