//! The page of the case, first half: closed forms, large loads, motion.
//!
//! Bounds of the claims stand here, beside the sentence that they are for. Not here: numbers
//! (`study.rs`, `motion.rs`, `large_loads.rs`), the mesh (`mesh_page.rs`).

use flexarm::steppers::ConstraintForm;
use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::bar::{BALL_KG, HEIGHT_M, LENGTH_M, WIDTH_M};
use super::motion::{
    CLAIMED_STEP_S, DAMPING, DURATION_S, SAMPLE_S, SPEED, SPIN_STEP_S, SpinUp, Steps, TIME_S, TOLERANCE, TRUE_PARTS,
};
use super::study::{COUNTS, Deflection, EndLoads, STATION_LOAD, Splits, StationLoad, Stations, Weight};
use super::{Findings, mesh_page};
use crate::bench::{LOADS, PATH_DAMPING_S, SMALL_MOTION};
use crate::compliance::{add_errors, claim_each};
use crate::page::{Bound, Case, Figure, Table, digits, error, fixed, plain, signed, word};

pub(super) fn page(found: &Findings) -> Case {
    let mut case = Case::new("one-beam", "1. One beam", "a bar: closed forms, CalculiX");
    case.text(format!(
        "`robots/test/one_beam`: an aluminium bar, {LENGTH_M} m long, {} mm wide and {} mm high, clamped at A, \
         with a ball of {BALL_KG} kg at its end B. Truths are closed forms of Euler and Bernoulli's theory \
         unless a table says otherwise. x points along the bar, z upwards. Commands: `flexarm statics \
         one_beam --wrench 0,0,10`, `flexarm modes one_beam --segments 5`.",
        plain(1e3 * WIDTH_M),
        plain(1e3 * HEIGHT_M)
    ));
    end_loads(&mut case, &found.end_loads);
    stations(&mut case, &found.stations);
    splits(&mut case, &found.splits);
    weight(&mut case, &found.weight);
    steps(&mut case, &found.steps);
    spin_up(&mut case, &found.spin_up);
    mesh_page::mesh(&mut case, &found.mesh);
    mesh_page::large_loads(&mut case, &found.large_loads);
    case
}

/// Six end loads, each method compared with the closed form.
fn end_loads(case: &mut Case, found: &EndLoads) {
    case.heading("Six loads at the end");
    let EndLoads { truth, with_shear, methods } = found;
    let small = plain(1e6 * SMALL_MOTION);
    let caption = format!(
        "Displacement of the end along the load, per unit of it (N or N m), in closed form, and what shear would add; then the error \
         of each method: the largest of the six components of the end's motion, over `sqrt(C_ii C_jj)`. Compliant constraints and \
         spring-damper run in time from the undeformed bar until they rest, with loads that move the end by {small} µm or {small} µrad, up \
         and down (`(u(F) - u(-F))/2F`)."
    );
    let mut table = Table::new(caption, &["load", "closed form [µm, µrad]", "shear"]);
    for (j, load) in LOADS.into_iter().enumerate() {
        let shear = with_shear[(j, j)] / truth[(j, j)] - 1.0;
        table.rows.push(vec![word(load), digits(1e6 * truth[(j, j)], 6), signed(shear)]);
    }
    add_errors(&mut table, truth, methods);
    case.table(table);
    claim_each(case, "end loads", ("closed form", truth), methods, 1e-6);
}

/// Loads at stations along the bar; deflection and slope along it.
fn stations(case: &mut Case, found: &Stations) {
    case.heading("Deflection and rotation along the beam, loads at stations");
    case.text(
        "Rigid parts bend at their joints only. The motion of the end under loads at the end is exact; \
         between the ends a link of n parts consists of n straight pieces. Modal links have no stations \
         between their interfaces.",
    );
    let load = plain(1e3 * STATION_LOAD);
    let caption = format!(
        "Force F_z of {load} mN or moment -M_y of {load} mN m at x = a: deflection w and slope w' of the loaded station in closed form, and the error there."
    );
    // Deflection and slope at the loaded station and at the end, by number of parts.
    let [mut there, mut end] = [caption, "The same loads, deflection and slope of the end.".into()].map(|caption| {
        let mut table = Table::new(caption, &["load at a/l", "", "", "closed form [µm, µrad]"]);
        table.columns.extend(COUNTS.map(|n| format!("{n} parts")));
        table
    });
    for station in &found.stations {
        for (table, place, seen) in [(&mut there, "a", &station.at_load), (&mut end, "l", &station.at_end)] {
            add_station(table, station.fraction, station.load, place, seen);
        }
    }
    case.table(there);
    case.table(end);
    case.text(
        "A load at the edge of a slice is carried exactly, because it loads whole slices; a load within a \
         slice sees all of its joint or none of it. The joints of a robot load links at their ends, so this \
         matters for own weight, and for cables and motors on a link.",
    );
    // At the end, a load at the end is exact for any number of parts.
    case.claim(
        format!(
            "deflection and slope of the end under a load at the end, {} to {} parts",
            COUNTS[0],
            COUNTS[COUNTS.len() - 1]
        ),
        "closed form",
        found.worst_at_the_end(),
        Bound::AtMost(1e-6),
    );
    case.figure(along_figure(found));
}

/// Adds a row for the deflection and one for the slope.
fn add_station(table: &mut Table, fraction: f64, load: StationLoad, place: &str, seen: &Deflection) {
    let load = if load == StationLoad::Force { "F_z" } else { "-M_y" };
    for (k, what) in [format!("w({place})"), format!("w'({place})")].into_iter().enumerate() {
        let mut row = vec![fixed(fraction, 2), word(load), word(what), digits(1e6 * seen.closed[k], 5)];
        row.extend(seen.errors.iter().map(|errors| signed(errors[k])));
        table.rows.push(row);
    }
}

fn along_figure(found: &Stations) -> Figure {
    let labels = ["w, force at l [µm]", "w', force at l [µrad]", "w, force at l/2 [µm]", "w', force at l/2 [µrad]"];
    let curve = |name: String, look, y: &[f64]| {
        let y = y.iter().map(|y| 1e6 * y).collect();
        PlotCurve { name, look, x: found.places_m.clone(), y }
    };
    let panels = labels.into_iter().zip(&found.along).map(|(label, along)| {
        let mut curves = vec![curve("closed form".into(), CurveLook::Total, &along.closed)];
        curves.extend(along.parts.iter().map(|(n, y)| curve(format!("{n} parts"), CurveLook::Plain, y)));
        Panel { label: label.into(), logarithmic: false, legend: true, curves }
    });
    Figure {
        name: "one-beam-along".into(),
        caption: format!(
            "Deflection and slope along the bar under {} mN upwards at the end and at mid length",
            plain(1e3 * STATION_LOAD)
        ),
        x_label: "x [m]".into(),
        logarithmic_x: false,
        panels: panels.collect(),
    }
}

/// Position of the joint, and the error without the coupling terms.
fn splits(case: &mut Case, found: &Splits) {
    case.heading("Place of the joint, and coupling terms");
    let mut table = Table::new(
        "Two parts, joint at x = s. Error of the end's compliance (six loads) with the full 6x6 and with its diagonal alone (plain springs); \
         sag of the end under bar and ball, first frequency sideways and upwards, against closed forms.",
        &["s/l", "end loads, 6x6", "end loads, diagonal", "sag", "f_1 sideways", "f_1 upwards"],
    );
    for split in &found.0 {
        let mut row = vec![fixed(split.fraction, 1), error(split.coupled), error(split.uncoupled)];
        row.extend([split.sag, split.hz[0], split.hz[1]].map(signed));
        table.rows.push(row);
    }
    case.table(table);
    // The full 6x6 is exact for any place of the joint; its diagonal alone must not be.
    let (first, last) = (&found.0[0], &found.0[found.0.len() - 1]);
    case.claim(
        format!("end loads, joint anywhere between {} and {} of the length", first.fraction, last.fraction),
        "closed form",
        found.worst_coupled(),
        Bound::AtMost(1e-6),
    );
    let most = found.worst_uncoupled();
    case.claim(
        "plain springs (no coupling terms), worst place of the joint: the effect must show",
        "closed form",
        most,
        Bound::AtLeast(0.1),
    );
    case.text(
        "At mid length, the elastic centre of a uniform bar, the 6x6 is diagonal and plain springs suffice; \
         elsewhere the coupling terms are needed. Statics under end loads do not depend on the place of the \
         joint, sag and frequencies do.",
    );
    case.figure(split_figure(found));
}

fn split_figure(found: &Splits) -> Figure {
    let errors = found.0.iter().map(|split| [split.uncoupled, split.sag, split.hz[0], split.hz[1]]);
    let errors: Vec<[f64; 4]> = errors.collect();
    let names = ["end loads, no coupling", "sag", "f_1 sideways", "f_1 upwards"];
    let curves = names.into_iter().enumerate().map(|(k, name)| PlotCurve {
        name: name.into(),
        look: CurveLook::Marked,
        x: found.0.iter().map(|split| split.fraction).collect(),
        y: errors.iter().map(|errors| 100.0 * errors[k]).collect(),
    });
    Figure {
        name: "one-beam-split".into(),
        caption: "Two parts: error over the place of the joint".into(),
        x_label: "s/l".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "error [%]".into(), logarithmic: false, legend: true, curves: curves.collect() }],
    }
}

/// Sag under the bar's own weight and frequencies as functions of the number of parts and modes.
fn weight(case: &mut Case, found: &Weight) {
    case.heading("Own weight and frequencies: how many parts, how many modes");
    let Weight { sag_m, side_hz, up_hz, models } = found;
    let caption = format!(
        "Bar without the ball. Truth: sag q l^4/(8 EI) = {:.5} mm; frequencies of the clamped beam with the rotary inertia of its section \
         (Rayleigh): sideways {:.4}, {:.3} Hz, upwards {:.4}, {:.3} Hz.",
        1e3 * sag_m,
        side_hz[0],
        side_hz[1],
        up_hz[0],
        up_hz[1]
    );
    // Each model against q l⁴/(8 EI) and the frequencies of Rayleigh's beam.
    let heads = ["model", "elastic coordinates", "sag", "f_1 sideways", "f_1 upwards", "f_2 sideways", "f_2 upwards"];
    let mut table = Table::new(caption, &heads);
    for model in models {
        let mut row = vec![word(&model.name), fixed(model.elastic_coordinates as f64, 0), signed(model.sag)];
        row.extend(model.hz.map(signed));
        table.rows.push(row);
    }
    case.table(table);
    // Exact for modal links; two parts miss a sixth, and many parts converge.
    let claims = [
        ("own-weight sag, modal link with any number of modes", found.modal_sag_error(), 1e-6),
        ("own-weight sag, two parts: what they do not give exactly", found.sag_error(2), 0.17),
        ("own-weight sag, 17 parts", found.sag_error(17), 1e-3),
        ("first two frequencies in both planes, modal, 12 modes", found.worst_hz("modal, 12 modes", 4), 3e-4),
        ("first frequency in both planes, 17 parts", found.worst_hz("17 parts", 2), 3e-4),
    ];
    for (text, measured, bound) in claims {
        case.claim(text, "closed form", measured, Bound::AtMost(bound));
    }
    case.text(
        "Two parts carry the weight at two points: one sixth of the sag under own weight is missing. The \
         error falls with the square of the length of a part. Modal links have the sag exactly with any \
         number of modes, because the static shape of the end is one of their coordinates.",
    );
}

/// Ring-down: error as a function of the step size.
fn steps(case: &mut Case, found: &Steps) {
    case.heading("Step size");
    let damping = plain(100.0 * DAMPING);
    let caption = format!(
        "Bar and ball let go undeformed, {DURATION_S} s of ringing up and down ({:.2} Hz, damping {damping} % of it, proportional to stiffness). Largest error of \
         the end every {} ms, over the largest deflection ({:.4} mm). Truth: the same two-part model by the stepper with error control, tolerance {TOLERANCE:e}.",
        found.first_hz,
        plain(1e3 * SAMPLE_S),
        1e3 * found.peak_m
    );
    let mut table = Table::new(caption, &["stepper"]);
    table.columns.extend(found.steps_s.iter().map(|h| format!("h = {} ms", plain(1e3 * h))));
    for stepper in &found.steppers {
        let errors = stepper.errors.iter().map(|e| error(*e));
        table.rows.push(std::iter::once(word(stepper.name)).chain(errors).collect());
        let bound = match () {
            () if stepper.is_alpha() => 2e-3,
            () if stepper.is_spook(ConstraintForm::Local) => 0.05,
            () => continue,
        };
        let text = format!("ring-down, {}, {} ms", stepper.name, plain(1e3 * CLAIMED_STEP_S));
        case.claim(text, "stepper with error control", found.at_claimed_step(stepper), Bound::AtMost(bound));
    }
    case.table(table);
    case.text(
        "\"-\": beyond the stability limit of the explicit stepper, which is refused. The preset `source` ties \
         the damping to the step (τ = 2h) and does not converge; the exact form converges with first order.",
    );
    let curves = found.steppers.iter().map(|stepper| {
        // The curves of the local and the global form coincide here.
        let dashed = stepper.is_spook(ConstraintForm::Global);
        PlotCurve {
            name: stepper.name.replace('`', ""),
            look: if dashed { CurveLook::Dashed } else { CurveLook::Marked },
            x: found.steps_s.iter().map(|h| 1e3 * h).collect(),
            y: stepper.errors.clone(),
        }
    });
    let curves = curves.collect();
    case.figure(Figure {
        name: "one-beam-steps".into(),
        caption: "Ring-down of the bar: error over the step".into(),
        x_label: "step [ms]".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "error / peak".into(), logarithmic: true, legend: true, curves }],
    });
}

/// Spin-up.
fn spin_up(case: &mut Case, found: &SpinUp) {
    case.heading("In fast motion");
    let caption = format!(
        "The joint spins up to {SPEED} rad/s in {TIME_S} s (`q'' = (w/T)(1 - cos 2πt/T)`), bar and ball, damping proportional to stiffness ({} ms), generalised-alpha at {} ms: largest distance of the end from that of {TRUE_PARTS} parts, over their \
         largest deflection of {:.3} mm; in all, along the undeformed bar, and across it.",
        plain(1e3 * PATH_DAMPING_S),
        plain(1e3 * SPIN_STEP_S),
        1e3 * found.peak_m
    );
    let mut table = Table::new(caption, &["model", "Δ", "along", "across"]);
    for model in &found.models {
        table.rows.push(std::iter::once(word(&model.name)).chain(model.errors.map(error)).collect());
        if model.stiffening {
            case.claim(
                format!("spin-up, {}, across the bar", model.name),
                format!("chain of {TRUE_PARTS} rigid parts"),
                model.errors[2],
                Bound::AtMost(1e-3),
            );
        }
    }
    case.table(table);
    case.text(
        "A chain of rigid parts has no centrifugal terms of its own, so the agreement checks those of the \
         modal link. Without stiffness by load a modal link is too soft when it spins. With it, the remaining \
         error is along the bar: the end of a modal link moves straight across, without the shortening 3/5 \
         w²/l of a bent bar ([theory](../theory.md), section 11).",
    );
}
