//! The page of the case: loads at the tip, meshes, sections, ring-down, whirl.
//!
//! Bounds of the claims stand here, beside the sentence that they are for. Not here: numbers (the
//! other files of the folder).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::beams::{BALL_KG, BEAMS, BOX, LENGTHS_M, TUBE, tip};
use super::ring_down::{self, DAMPING, FIVE_PARTS, LINEAR, RingDown, Run, STEP_S, TOLERANCE, TWO_PARTS};
use super::sections::{Sections, TIES, TORSION};
use super::study::{Meshes, Model, TipLoads};
use super::whirl::{self, TRUE_PARTS, Whirl};
use super::{Findings, MESH};
use crate::bench::{LOADS, PATH_DAMPING_S, SMALL_MOTION, column_error, compliance_error};
use crate::compliance::{add_errors, claim_each};
use crate::page::{Bound, Case, Cell, Figure, Table, digits, error, fixed, plain, signed, word};

/// Integration points of CalculiX along each axis of an element.
const CALCULIX_POINTS: usize = 3;
/// Every second sample is drawn: ten curves per panel would hide each other, and a point every 2 ms
/// resolves 100 Hz.
const DRAWN: usize = 2;
const AXES: [&str; 3] = ["x", "y", "z"];

pub(super) fn page(found: &Findings) -> Case {
    let mut case = Case::new("three-beams", "2. Three beams", "beams in space: closed forms, NGSolve, CalculiX");
    let ([up, forwards, sideways], tip) = (LENGTHS_M, tip());
    case.text(format!(
        "`robots/test/three_beams`: three aluminium beams joined at right angles: a tube of {up} m upwards, a box \
         of {forwards} m forwards (x) and a rectangle of {sideways} m sideways (y), with a ball of {BALL_KG} \
         kg at the tip ({}, {}, {}) m. The joint at the base is held at 0. Every load at the tip bends and \
         twists several beams. World axes, z upwards; Timoshenko's theory. Commands: `flexarm statics \
         three_beams --wrench 0,0,10`, `flexarm compare three_beams`.",
        tip.x, tip.y, tip.z
    ));
    tip_loads(&mut case, &found.tip_loads);
    meshes(&mut case, &found.meshes);
    if let Some(found) = &found.sections {
        sections(&mut case, found);
    }
    ring_down(&mut case, &found.ring_down);
    whirl(&mut case, &found.whirl);
    case
}

/// Six loads at the tip, each method compared with the closed form.
fn tip_loads(case: &mut Case, found: &TipLoads) {
    case.heading("Six loads at the tip");
    let TipLoads { truth, of_beams, methods } = found;
    let small = plain(1e6 * SMALL_MOTION);
    let caption = format!(
        "Motion of the tip along each load, per unit of it: the sum over the beams `Ad_k R_k C_k R_kᵀ Ad_kᵀ` of textbook cantilevers C_k (Timoshenko; shear factors by \
         Cowper, torsion of the box by Bredt), and the share of each beam. Error of each method: the largest of the six components of the tip's motion, over \
         `sqrt(C_ii C_jj)`. Compliant constraints and spring-damper run in time from the undeformed arm to rest, with loads that move the tip by {small} µm or {small} µrad, up and down."
    );
    let mut table = Table::new(caption, &["load", "closed form [µm, µrad per N, N m]"]);
    table.columns.extend(BEAMS.map(String::from));
    for (j, load) in LOADS.into_iter().enumerate() {
        let mut row = vec![word(load), digits(1e6 * truth[(j, j)], 6)];
        row.extend(of_beams.iter().map(|C| word(format!("{:.1} %", 100.0 * C[(j, j)] / truth[(j, j)]))));
        table.rows.push(row);
    }
    add_errors(&mut table, truth, methods);
    case.table(table);
    claim_each(case, "loads at the tip", ("closed form", truth), methods, 1e-7);
}

/// The same arm from meshes, compared with the mesh of the whole arm in two other programs.
fn meshes(case: &mut Case, found: &Meshes) {
    case.heading("The same arm from meshes, against two other programs");
    case.text(format!(
        "`{MESH}`: each beam is meshed with HEX20 and reduced on its own, with rigid ties and ten modes. The \
         other programs solve the whole arm as one mesh of the same elements with the same ties. Truth: {}, \
         which integrates to rounding, as flexarm does. {} takes {p} x {p} x {p} points per element, which \
         are not exact in the curved elements of the tube. Double precision leaves eight to nine digits of \
         the compliance of thin walls.",
        found.ngsolve.provenance,
        found.calculix.provenance,
        p = CALCULIX_POINTS
    ));
    // Compliance of the tip: NGSolve's whole mesh against CalculiX and against every method here.
    let (truth, theirs) = (&found.ngsolve.C_tip, &found.calculix.C_tip);
    let caption = "Motion of the tip along each load, per unit of it, and the error of each method, all as above; truth: NGSolve.";
    let mut table = Table::new(caption, &["load", "NGSolve [µm, µrad per N, N m]", "CalculiX"]);
    for (j, load) in LOADS.into_iter().enumerate() {
        table.rows.push(vec![word(load), digits(1e6 * truth[(j, j)], 6), error(column_error(theirs, truth, j))]);
    }
    add_errors(&mut table, truth, &found.methods);
    case.table(table);
    let by = "NGSolve, whole mesh";
    claim_each(case, "meshed arm, loads at the tip", (by, truth), &found.methods, 1e-7);
    let between = compliance_error(theirs, truth);
    case.stored_claim("meshed arm, loads at the tip: CalculiX against NGSolve", by, between, Bound::AtMost(1e-7));
    // Sag and frequencies of each model against the same mesh.
    case.table(sag_and_frequencies(found));
    case.text(
        "Two parts carry the weight of a beam at two points. The ball is most of the load and is carried \
         exactly, so less is missing than in a bare bar. In the lowest modes the ball moves, which all models \
         have. In higher modes the beams bend between their ends, where two parts have a single joint and a \
         modal link without modes has static shapes only. Modal links have the sag exactly with any number of \
         modes.",
    );
    // Modal links have the sag exactly; parts converge with their number.
    let claims = [
        ("sag, modal links with any number of modes", found.modal_sag_error(), 1e-7),
        ("sag, two parts", found.shift_error("2 parts"), 0.015),
        ("sag, five parts", found.shift_error("5 parts"), 1e-3),
        ("first four frequencies, two parts", found.worst_hz_error("2 parts", 4), 0.014),
        ("eight frequencies, modal, 10 modes", found.worst_hz_error("modal, 10 modes", found.ngsolve.hz.len()), 1.1e-4),
    ];
    for (what, measured, bound) in claims {
        case.claim(format!("meshed arm, {what}"), "NGSolve", measured, Bound::AtMost(bound));
    }
    case.figure(frequency_figure(&found.models));
}

/// Sag under gravity and frequencies of every model.
fn sag_and_frequencies(found: &Meshes) -> Table {
    let (sag, hz) = (&found.ngsolve.sag, &found.ngsolve.hz);
    let caption = format!(
        "Sag of the tip under the weight of beams and ball, linear (a hundredth of the weight, up and down): error of the shift and of the rotation as vectors over their sizes, {:.5} mm \
         and {:.5} mrad; frequencies with the ball, without the stiffness of weight: {} Hz. Truth: NGSolve.",
        1e3 * sag.fixed_rows::<3>(0).norm(),
        1e3 * sag.fixed_rows::<3>(3).norm(),
        hz.iter().map(|f| format!("{f:.4}")).collect::<Vec<_>>().join(", ")
    );
    let mut table = Table::new(caption, &["model", "elastic coordinates", "sag, shift", "sag, rotation"]);
    table.columns.extend((1..=hz.len()).map(|k| format!("f_{k}")));
    let row = |name: &str, coordinates: Cell, sag: &[f64; 2], hz: &[f64]| {
        let mut row = vec![word(name), coordinates];
        row.extend(sag.map(error));
        row.extend(hz.iter().map(|e| signed(*e)));
        row
    };
    table.rows.push(row("CalculiX", word(""), &found.calculix_sag_errors, &found.calculix_hz_errors));
    for model in &found.models {
        let coordinates = fixed(model.elastic_coordinates as f64, 0);
        table.rows.push(row(&model.name, coordinates, &model.sag_errors, &model.hz_errors));
    }
    table
}

fn frequency_figure(models: &[Model]) -> Figure {
    let curve = |model: &Model| {
        let errors = model.hz_errors.iter().map(|e| e.abs());
        let (x, y) = (1..=model.hz_errors.len()).map(|k| k as f64).zip(errors).unzip();
        PlotCurve { name: model.name.clone(), look: CurveLook::Marked, x, y }
    };
    let curves = models.iter().map(curve).collect();
    Figure {
        name: "three-beams-frequencies".into(),
        caption: "Three beams from meshes: error of each frequency, by model".into(),
        x_label: "frequency number".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    }
}

/// Differences between the sections of beam theory and the meshes, beam by beam.
fn sections(case: &mut Case, found: &Sections) {
    case.heading("Beam theory against the meshes");
    // Ends of the beams with both ties, and sections in the middle, where the ends do not matter.
    let mut ends = Table::new(
        "Compliance of the end of each beam from its mesh, over that of beam theory, less one; axes of the beam (x along it, y and z across). Both ends tied rigidly or by the mean of \
         their nodes.",
        &[
            "beam",
            "ties",
            "u_x by F_x",
            "u_y by F_y",
            "u_z by F_z",
            "theta_x by M_x",
            "theta_y by M_y",
            "theta_z by M_z",
        ],
    );
    let caption = "The same meshes, stiffness of the section in the middle tenth of the length (strain energy of two layers of elements under end loads), over that of beam theory, less one.";
    let mut middles = Table::new(caption, &["beam", "EA", "EI_y", "EI_z", "GJ", "kGA_y", "kGA_z", "mass"]);
    for (name, beam) in BEAMS.into_iter().zip(&found.beams) {
        for (tie, errors) in TIES.iter().zip(&beam.end_errors) {
            let cells = [word(name), word(tie.name())].into_iter();
            ends.rows.push(cells.chain(errors.map(signed)).collect());
        }
        middles.rows.push(std::iter::once(word(name)).chain(beam.middle_errors.map(signed)).collect());
    }
    case.table(ends);
    case.table(middles);
    case.text(
        "Away from the ends the meshes agree with beam theory in stretch and bending. Four effects remain. \
         Torsion of the box: Bredt's formula leaves out the thickness of the wall, and the mesh has one \
         element through it. Shear: Cowper's factors compare mean displacements, the strain energy compares \
         work. Rigid ties keep the ends from contracting and warping. Ties by the mean spread a torque evenly \
         over the nodes; this is not the shear flow of a box, and it distorts the section near the ends.",
    );
    // Beam theory away from the ends; a tube has no warping, so its torsion agrees at the ends as well.
    let middle = found.worst_in_the_middle();
    // A tie by the mean is not the shear flow of a box: this difference must show.
    case.claim("meshed beams, EA and EI in the middle", "beam theory", middle, Bound::AtMost(2e-5));
    let tube_torsion = found.beams[TUBE].end_errors[0][TORSION].abs();
    case.claim("meshed tube in torsion, ends tied rigidly", "beam theory", tube_torsion, Bound::AtMost(1e-7));
    case.claim(
        "meshed box in torsion over beam theory, ends tied by the mean: an effect of the tie",
        "beam theory",
        found.beams[BOX].end_errors[1][TORSION],
        Bound::AtLeast(0.1),
    );
    // Reading the files of the reduced beams back.
    let filed = found.worst_file();
    case.claim("files of the reduced beams: compliance", "the same meshes reduced here", filed, Bound::AtMost(1e-7));
}

/// Ring-down under gravity: errors of the steppers and of the models.
fn ring_down(case: &mut Case, found: &RingDown) {
    case.heading("Ring-down");
    let caption = format!(
        "The arm of beam theory let go undeformed under its weight, {} s, damping proportional to stiffness ({} % of the first mode, {:.2} Hz, the same constant for all models). \
         Largest distance of the tip from the truth, every ms, over the largest deflection ({:.4} mm). Truth of the method: modal links with {} modes each and stiffness by load. Truth of the stepper: \
         its own model. Both by the stepper with error control, tolerance {TOLERANCE:e}. The last column is the distance of these two truths; x, y, z are the parts of the method's error.",
        found.duration_s,
        plain(100.0 * DAMPING),
        found.first_hz,
        1e3 * found.peak_m,
        ring_down::MODES
    );
    // Error of each run against both truths.
    let heads = ["model", "stepper", "h [ms]", "method", "x", "y", "z", "stepper alone", "model alone"];
    let mut table = Table::new(caption, &heads);
    for run in &found.runs {
        let [x, y, z] = run.axis_errors;
        let errors = [run.method_error, x, y, z, run.stepper_error, found.model_error(run.model)];
        let cells = [word(&found.models[run.model].name), word(run.stepper), digits(1e3 * run.step_s, 1)].into_iter();
        table.rows.push(cells.chain(errors.map(error)).collect());
    }
    // Steppers against error control on the same model, at one step.
    for run in found.runs.iter().filter(|run| run.step_s == STEP_S) {
        let bound = if run.compliant { 0.045 } else { 3e-4 };
        case.claim(
            format!("three beams, ring-down, {}, {} ms: stepper alone", run_name(found, run), plain(1e3 * STEP_S)),
            "stepper with error control",
            run.stepper_error,
            Bound::AtMost(bound),
        );
    }
    case.table(table);
    // Parts against modal links, both with error control.
    for (name, model, bound) in [("two", TWO_PARTS, 0.05), ("five", FIVE_PARTS, 3e-3)] {
        let text = format!("three beams, ring-down, {name} parts: model alone");
        let truth = format!("modal links, {} modes", ring_down::MODES);
        case.claim(text, truth, found.model_error(model), Bound::AtMost(bound));
    }
    case.figure(ring_down_figure(found));
}

/// Name of a run: stepper and model.
fn run_name(found: &RingDown, run: &Run) -> String {
    format!("{}, {}", run.stepper, found.models[run.model].name)
}

fn ring_down_figure(found: &RingDown) -> Figure {
    let truth = found.truth();
    // Every DRAWN-th sample: each axis of the tip, then the distance from the truth.
    let curve = |name: &str, look, y: &dyn Fn(usize) -> f64| {
        let drawn = (0..truth.len()).step_by(DRAWN);
        PlotCurve {
            name: name.into(),
            look,
            x: drawn.clone().map(|k| k as f64 * STEP_S).collect(),
            y: drawn.map(y).collect(),
        }
    };
    let drawn: Vec<&Run> = found.runs.iter().filter(|run| run.step_s == STEP_S && run.model != LINEAR).collect();
    let mut panels: Vec<Panel> = Vec::new();
    for (i, axis) in AXES.iter().enumerate() {
        let mut curves = vec![curve("modal, stepper with error control", CurveLook::Total, &|k| 1e3 * truth[k][i])];
        let of = |run: &&Run| curve(&run_name(found, run), CurveLook::Plain, &|k| 1e3 * run.path[k][i]);
        curves.extend(drawn.iter().map(of));
        panels.push(Panel { label: format!("{axis} [mm]"), logarithmic: false, legend: true, curves });
    }
    let apart = |run: &&Run| {
        let share = |k: usize| 100.0 * (run.path[k] - truth[k]).norm() / found.peak_m;
        curve(&run_name(found, run), CurveLook::Plain, &share)
    };
    let curves = drawn.iter().map(apart).collect();
    panels.push(Panel { label: "difference [% of peak]".into(), logarithmic: false, legend: true, curves });
    Figure {
        name: "three-beams-ring-down".into(),
        caption: format!(
            "Tip of the three beams, let go under gravity, and the distance of each method from modal links; steps of {} ms",
            plain(1e3 * STEP_S)
        ),
        x_label: "t [s]".into(),
        logarithmic_x: false,
        panels,
    }
}

/// Ringing during rotation.
fn whirl(case: &mut Case, found: &Whirl) {
    /// Bounds, one per speed.
    const BOUNDS: [f64; 2] = [1.7e-3, 6e-3];
    case.heading("Ringing while it turns");
    let caption = format!(
        "The joint turns steadily, and the arm is let go undeformed under its weight and the centrifugal force, {} s, damping proportional to stiffness ({} ms), generalised-alpha at {} ms: largest distance of the tip from that of {TRUE_PARTS} parts per \
         beam, over their largest deflection.",
        plain(whirl::STEP_S * whirl::STEPS as f64),
        plain(1e3 * PATH_DAMPING_S),
        plain(1e3 * whirl::STEP_S)
    );
    let mut table = Table::new(caption, &["model"]);
    table.rows = found.models.iter().map(|model| vec![word(&model.name)]).collect();
    for (turn, bound) in found.turns.iter().zip(BOUNDS) {
        table.columns.push(format!("{} rad/s, peak {:.2} mm", turn.speed_rad_s, 1e3 * turn.peak_m));
        for ((row, model), found) in table.rows.iter_mut().zip(&found.models).zip(&turn.errors) {
            row.push(error(*found));
            if model.stiffening {
                let text = format!("three beams, ringing at {} rad/s, {}", turn.speed_rad_s, model.name);
                case.claim(text, format!("chains of {TRUE_PARTS} rigid parts"), *found, Bound::AtMost(bound));
            }
        }
    }
    case.table(table);
    case.text(
        "Coriolis and centrifugal terms of modal links are compared with rigid bodies, which have none of \
         their own. With stiffness by load the remaining error is of second order in the deflection (case 1).",
    );
}
