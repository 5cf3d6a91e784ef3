//! The page of the case: loads at the flange, weight, frequencies, ties.
//!
//! Not here: numbers (`study.rs`, `truth.rs`).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::study::{AXIAL_PART, FlangeLoads, Frequencies, TIED_MODES, Ties, Weight, worst_of};
use super::truth::MODES;
use super::{AXES, About, CHAINS, Findings, G, MeshResult};
use crate::bench::{LOADS, SMALL_MOTION, compliance_error};
use crate::compliance::{add_errors, claim_each};
use crate::page::{Bound, Case, Figure, Table, digits, error, fixed, listed, plain, signed, word};

pub(super) fn page(found: &Findings) -> Case {
    let mut case = Case::new("lower-arm", "3. Lower arm", "a casting: CalculiX, NGSolve");
    case.text(about(&found.about, found.whole.as_ref()));
    flange_loads(&mut case, found);
    weight(&mut case, found);
    frequencies(&mut case, found);
    if let Some(whole) = &found.whole {
        ties(&mut case, whole);
    }
    case
}

fn about(found: &About, whole: Option<&MeshResult>) -> String {
    let About { mass_kg, length_m, programs } = found;
    let truth = match whole {
        None => format!(
            "Truth, in this quick run, instead of the mesh: the matrices of the link file, and frequencies by NGSolve. Other programs: {programs}."
        ),
        Some(whole) => format!(
            "Truth: the whole mesh, {} degrees of freedom, assembled and condensed here, which is judged first against two other programs on the same mesh: {programs}.",
            whole.degrees_of_freedom
        ),
    };
    format!(
        "`robots/test/lower_arm`: an aluminium casting of {mass_kg:.2} kg, {length_m:.1} m between its axes, bowed, hollow, without a plane of symmetry, meshed with TET10; the disc at its end is left out. Its seat A is held, seat \
        B is loaded and watched; both are tied rigidly unless said otherwise. The link is `lower_arm.flex`, made from this mesh by `flexarm reduce`: the 6x6 at B, two parts, chains of {} parts, ten modes. \
        Axes of the link, z from A towards B. By hand: `flexarm reduce robots/test/lower_arm/lower_arm.reduce.toml`, `flexarm modes lower_arm --segments 4`. {truth}",
        listed(&CHAINS)
    )
}

/// Six loads at B: other programs and every method compared with the mesh.
fn flange_loads(case: &mut Case, findings: &Findings) {
    case.heading("Six loads at the flange");
    let (found, by, whole) = (&findings.flange_loads, findings.truth_name(), findings.whole.is_some());
    let FlangeLoads { truth, programs, link_file, methods } = found;
    let small = plain(1e6 * SMALL_MOTION);
    let caption = format!(
        "Motion of B along each load, per unit of it, and the error of the others: the largest of the six components of the motion of B, over `sqrt(C_ii C_jj)`. Compliant constraints and \
         spring-damper run in time until they rest, loads that move B by {small} µm or {small} µrad (F_z: {} µm), up and down.",
        plain(1e6 * AXIAL_PART * SMALL_MOTION)
    );
    let head = if whole { "mesh [µm, µrad per N, N m]" } else { "link file [µm, µrad per N, N m]" };
    let mut table = Table::new(caption, &["load", head]);
    table.rows = (0..LOADS.len()).map(|j| vec![word(LOADS[j]), digits(1e6 * truth[(j, j)], 6)]).collect();
    for methods in [programs.as_slice(), std::slice::from_ref(link_file), methods] {
        add_errors(&mut table, truth, methods);
    }
    case.table(table);
    // Other programs check the mesh, the mesh checks the rest; a file is not compared with itself.
    for program in programs {
        let text = format!("casting, loads at the flange, {by}");
        case.claim(text, &program.name, compliance_error(&program.C, truth), Bound::AtMost(1e-7));
    }
    let judged = if whole { std::slice::from_ref(link_file) } else { &[] };
    for methods in [judged, methods] {
        claim_each(case, "casting, loads at the flange", (by, truth), methods, 1e-7);
    }
    case.text(
        "The link file holds all digits. Along z the casting is much stiffer than across: a load that moves B \
         visibly along z bends it sideways and acts on the bent link, an effect of second order for parts \
         that rotate. Therefore a tenth of the usual load is applied along z. Modal links without stiffness \
         by load are linear.",
    );
}

/// Own weight in three directions.
fn weight(case: &mut Case, findings: &Findings) {
    case.heading("Own weight in three directions");
    let (found, by) = (&findings.weight, findings.truth_name());
    case.table(weight_table(found, by));
    case.text(
        "Modal links have the sag exactly with any number of modes; without modes they are Guyan's \
         condensation. Two parts miss about a sixth, as for a uniform bar. With more parts the error falls \
         with the square of their length and then stops. Along z it stays large: seat A faces sideways, so \
         part of the casting hangs on the wall of the seat and turns it, which slices in a row from A to B do \
         not contain.",
    );
    let text = format!("casting, own weight, {by}");
    case.claim(text, "CalculiX and NGSolve", found.worst_program(), Bound::AtMost(1e-7));
    case.claim(
        "casting, own weight, modal link with any number of modes",
        "the mesh",
        found.worst_modal(),
        Bound::AtMost(1e-7),
    );
    for (parts, bounds) in [(2, [0.3, 0.6]), (8, [0.02, 0.17])] {
        let [across, along] = found.across_and_along(parts);
        let text = format!("casting, weight across (x, y), {parts} parts, shift");
        case.claim(text, "the mesh", across, Bound::AtMost(bounds[0]));
        let text = format!("casting, weight along z, {parts} parts, shift");
        case.claim(text, "the mesh", along, Bound::AtMost(bounds[1]));
    }
}

fn weight_table(found: &Weight, by: &str) -> Table {
    let sizes = found.sizes.iter().zip(AXES).map(|(sizes, axis)| {
        let [shift, turn] = sizes.map(|size| digits(1e6 * size, 4).print());
        format!("{axis} {shift} µm and {turn} µrad")
    });
    let caption = format!(
        "Motion of B under {G} m/s² along an axis, casting alone; by {by} {}. Errors of the shift and of the rotation as vectors, over their sizes. The robot: a hundredth of the weight up and \
         down, so linear.",
        sizes.collect::<Vec<_>>().join(", ")
    );
    let mut table = Table::new(caption, &["model"]);
    table.columns.extend(AXES.iter().flat_map(|axis| ["shift", "rotation"].map(|what| format!("{axis}, {what}"))));
    let programs = found.programs.iter().map(|(name, errors)| (*name, errors));
    for (name, errors) in programs.chain(found.models.iter().map(|(model, errors)| (model.name.as_str(), errors))) {
        let cells = errors.iter().flatten().map(|e| error(*e));
        table.rows.push(std::iter::once(word(name)).chain(cells).collect());
    }
    table
}

/// Frequencies with A held.
fn frequencies(case: &mut Case, findings: &Findings) {
    case.heading("Frequencies");
    let (found, by, whole) = (&findings.frequencies, findings.truth_name(), findings.whole.is_some());
    for ((name, errors), bound) in found.programs.iter().zip([5e-6, 1e-7]).filter(|_| whole) {
        let text = format!("casting, six frequencies, {by}");
        case.claim(text, *name, worst_of(errors, MODES), Bound::AtMost(bound));
    }
    let bounds =
        [("2 parts", 2, 0.07), ("8 parts", 2, 3.5e-3), ("modal, 0 modes", 2, 6.6e-3), ("modal, 10 modes", MODES, 0.01)];
    for (name, count, bound) in bounds {
        let what = if count == MODES { "six frequencies" } else { "first two frequencies" };
        let errors = found.models.iter().find(|(model, ..)| model.name == name).map(|(_, errors, _)| errors);
        let measured = errors.map_or(f64::NAN, |errors| worst_of(errors, count));
        case.claim(format!("casting, {what}, {name}"), "the mesh", measured, Bound::AtMost(bound));
    }
    case.table(frequency_table(found, if whole { by } else { "NGSolve" }));
    case.text(
        "CalculiX integrates the mass of this element with four points, which is not exact, so its difference \
         grows with the frequency. In f_1 and f_2 the casting bends, f_4 is torsion, and f_3, f_5 and f_6 \
         bend a second time, where two parts are too few. Modal links approach from above. Ten modes with \
         both seats held bring all six frequencies within half a per cent; the convergence is slow because \
         held seats have to represent a free B.",
    );
    case.figure(frequency_figure(found));
}

fn frequency_table(found: &Frequencies, by: &str) -> Table {
    let hz: Vec<String> = found.hz.iter().map(|f| format!("{f:.3}")).collect();
    let caption =
        format!("A held, B free, casting alone, without weight; by {by} {} Hz. Relative differences.", hz.join(", "));
    let mut table = Table::new(caption, &["model", "elastic coordinates"]);
    table.columns.extend((1..=MODES).map(|k| format!("f_{k}")));
    for (name, errors) in &found.programs {
        let cells = [word(*name), word("")].into_iter();
        table.rows.push(cells.chain(errors.iter().map(|e| signed(*e))).collect());
    }
    for (model, errors, coordinates) in &found.models {
        let cells = [word(&model.name), fixed(*coordinates as f64, 0)].into_iter();
        table.rows.push(cells.chain(errors.iter().map(|e| signed(*e))).collect());
    }
    table
}

fn frequency_figure(found: &Frequencies) -> Figure {
    let curves = found.models.iter().map(|(model, errors, _)| {
        let (x, y) = (1..=errors.len()).map(|k| k as f64).zip(errors.iter().map(|e| e.abs())).unzip();
        PlotCurve { name: model.name.clone(), look: CurveLook::Marked, x, y }
    });
    let curves = curves.collect();
    Figure {
        name: "lower-arm-frequencies".into(),
        caption: "Casting with A held: error of each frequency, by model".into(),
        x_label: "frequency number".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    }
}

/// Rigid ties compared with distributing ones.
fn ties(case: &mut Case, whole: &MeshResult) {
    case.heading("Rigid or distributing ties");
    let found: &Ties = &whole.ties;
    // Compliance and frequencies with each pair of ties, over those of rigid ties.
    let mut table = Table::new(
        "The same mesh, seats tied rigidly (RBE2) or by the mean of their nodes (RBE3, equal weights): compliance along each load and frequencies, over those of rigid ties, less one.",
        &["A", "B"],
    );
    table.columns.extend(LOADS.map(String::from));
    table.columns.extend((1..=TIED_MODES).map(|k| format!("f_{k}")));
    for tied in &found.pairs {
        let cells = tied.ties.iter().map(|tie| word(tie.name()));
        let errors = tied.compliance.iter().chain(&tied.hz).map(|e| signed(*e));
        table.rows.push(cells.chain(errors).collect());
    }
    // Distributing ties of the other programs against those here.
    for (name, difference) in &found.programs {
        let text = "casting, distributing ties, loads at the flange, the mesh";
        case.claim(text, *name, *difference, Bound::AtMost(1e-7));
    }
    case.table(table);
    case.text(
        "No other choice on this page has a larger effect. A rigid tie makes the seat as stiff as a plate; a \
         distributing tie lets its ring and the wall behind it deform, as if the neighbour were soft. The \
         real neighbour lies between the two. Seat A decides the displacement under transverse forces and the \
         frequencies, seat B the rotation.",
    );
    case.claim(
        "casting, what distributing ties add to every entry of the compliance's diagonal: an effect of the tie",
        "rigid ties",
        found.softest(),
        Bound::AtLeast(0.06),
    );
}
