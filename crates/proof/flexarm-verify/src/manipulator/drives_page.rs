//! The page of the case, second half: links and drives.
//!
//! The first table compares links, drives and both; the second, with elastic drives, compares steppers
//! and models of the links. Truth: modal links, stepper with error control. Not here: numbers (`drives.rs`).

use flexarm_draw::{CurveLook, Panel};

use super::drives::{CLAIMED, DRIVES_ALONE, ElasticDrives, Flexibilities, LINKS_ALONE, STEP_S, TWO_PARTS};
use super::page::{curve, deflections, distances};
use super::{AXES, DRIVES};
use crate::page::{Bound, Case, Figure, Table, digits, fixed, plain, word};

/// Number of frequencies in the table.
const MODES: usize = 4;

/// Elastic links, elastic drives, and both.
pub(super) fn which_flexibility(case: &mut Case, found: &Flexibilities) {
    case.heading("Which flexibility matters");
    case.text(format!(
        "`{DRIVES}` adds elastic gearboxes, with stiffness and damping identified on another KR 210 whose \
         links were taken as rigid: the numbers of the gearboxes contain some deflection of links, and \"both\" \
         is an upper bound. Motors follow the motion exactly; spring-damper, two parts, {} ms.",
        plain(1e3 * STEP_S)
    ));
    // Deflection, sag and frequencies with links, drives, and both elastic.
    let mut table = Table::new(
        "Largest deflection along x, y, z, in all and its RMS [mm]; sag at the start [mm]; first frequencies there [Hz].",
        &["motion", "flexible", "x", "y", "z", "peak", "RMS", "sag"],
    );
    table.columns.extend((1..=MODES).map(|k| format!("f_{k}")));
    for made in &found.made {
        let run = &made.run;
        let [x, y, z, all] = run.peaks().listed();
        let mut cells = vec![word(made.motion), word(made.what)];
        cells.extend([x, y, z, all, run.rms_m, run.sag_m].map(|u| fixed(1e3 * u, 3)));
        cells.extend(run.frequencies_hz.iter().take(MODES).map(|f| digits(*f, 4)));
        table.rows.push(cells);
    }
    case.table(table);
    // Springs in series: at rest the two deflections add up.
    case.claim(
        "sag of links and drives together: sum of the two alone",
        "series springs, to first order",
        found.sum_error,
        Bound::AtMost(0.01),
    );
    case.text(
        "Drives of this class deflect three to four times as much as the castings. At rest the two add up. In \
         motion the peaks need not add up: both together have lower frequencies and ring longer, or do not \
         peak at the same time.",
    );
}

/// Every method again with elastic drives.
pub(super) fn elastic_drives(case: &mut Case, found: &ElasticDrives) {
    let ElasticDrives { motion, peak_m, truth, made } = found;
    case.heading(&format!("`trajectories/{motion}.toml`, links and drives"));
    let caption = format!(
        "Largest deflection along x, y, z and in all, sag at the start [mm]; largest distance of the tool from modal links with the same drives, over their peak of {:.3} mm.",
        1e3 * peak_m
    );
    let heads = ["links", "stepper", "x", "y", "z", "peak", "sag", "Δx", "Δy", "Δz", "Δ"];
    let mut table = Table::new(caption, &heads);
    for made in made.iter().chain([truth]) {
        let cells = [word(&made.links), word(&made.stepper)].into_iter().chain(deflections(&made.run, 3));
        table.rows.push(cells.chain(distances(made.error)).collect());
    }
    for made in CLAIMED.map(|k| &made[k]) {
        let text = format!("tool on {motion} with elastic drives, {}", made.name());
        case.claim(text, "modal links, error control", made.error.all, Bound::AtMost(0.004));
    }
    case.table(table);
    case.figure(drives_figure(found));
}

fn drives_figure(found: &ElasticDrives) -> Figure {
    let ElasticDrives { motion, truth, made, .. } = found;
    let panels = AXES.iter().enumerate().map(|(axis, letter)| {
        let curves = vec![
            curve(&truth.run, "links and drives, modal", CurveLook::Total, axis),
            curve(&made[TWO_PARTS].run, "links and drives, 2 parts, spring-damper", CurveLook::Dashed, axis),
            curve(&made[DRIVES_ALONE].run, "drives alone", CurveLook::Plain, axis),
            curve(&made[LINKS_ALONE].run, "links alone", CurveLook::Plain, axis),
        ];
        Panel { label: format!("deflection {letter} [mm]"), logarithmic: false, legend: true, curves }
    });
    Figure {
        name: "manipulator-drives".into(),
        caption: format!("{motion}: deflection of the tool with links, drives and both elastic"),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels: panels.collect(),
    }
}
