//! The page of the case: two-link arms, slider crank, blade.
//!
//! Not here: numbers (the files of their names).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::slider_crank::{CHAIN, LINEAR_ROD, SPOOK, STIFFENED_ROD, SliderCrank};
use super::swept_rotor::{COUNT, Spin};
use super::two_link::{LINEAR, MODES, PARTS, STIFFENED, TwoLink};
use super::{FOLDER, Findings, slider_crank, two_link};
use crate::bench::Worst;
use crate::page::{Bound, Case, Figure, Table, digits, error, fixed, plain, word};

/// Truth of the two-link arms.
const EXACT_ARM: &str = "geometrically exact beams";
/// Truth of the slider crank.
const EXACT_ROD: &str = "geometrically exact rod";
/// Truth of the turning blade.
const SOLID: &str = "CalculiX, 400 solids";
/// Bounds of chains with [`PARTS`] parts: those of finite elements with two nodes, one per part.
const CHAIN_BOUNDS: [f64; 2] = [0.015, 4e-3];
/// Bounds of modal links with stiffness by load for the runs slew_30, slew_20 and spin_30.
const MODAL_BOUNDS: [(&str, f64); 3] = [("slew_30", 0.02), ("slew_20", 0.04), ("spin_30", 0.02)];

pub(super) fn page(found: &Findings) -> Case {
    let mut case = Case::new(
        "benchmarks",
        "7. Benchmarks in large motion",
        "slender arms, slider crank, blade: geometrically exact beams, CalculiX",
    );
    case.text(format!(
        "Slender beams that move fast and far, without damping, from plain files that any program can read \
         (`{FOLDER}`, with the rules and the origin of each truth)."
    ));
    two_link_arms(&mut case, &found.two_link);
    slider_crank(&mut case, &found.slider_crank);
    swept_rotor(&mut case, &found.spins);
    case
}

fn two_link_arms(case: &mut Case, found: &TwoLink) {
    case.heading("Two-link arms");
    case.text(format!(
        "Two aluminium bars of 1 m, 50 mm wide and 30, 20 or 10 mm high (the number in the name) in the plane of \
         motion, 1 kg at the elbow and at the tip, no gravity. `slew`: both joints move by quintics of 1 s. `spin`: \
         the first joint reaches 8 rad/s in 1 s and keeps it, the second swings by 1 rad. Truth: Reissner's beams as \
         spectral elements, converged to 4e-8 m. Generalised-alpha with steps of {} ms.",
        plain(1e3 * two_link::STEP_S)
    ));
    // Distance of the tip from the exact beams, by run and method.
    let mut table = Table::new(
        "Maximum distance of the tip from the truth, over the maximum distance of the truth from the rigid arm.",
        &["run", "peak [mm]"],
    );
    table.columns.extend(found.methods.iter().cloned());
    for run in &found.runs {
        let cells = [word(run.name), fixed(1e3 * run.peak_m, 2)].into_iter();
        table.rows.push(cells.chain(run.errors.iter().map(|e| error(*e))).collect());
    }
    case.table(table);
    // Bounds for chains in every run, for modal links within their range of deflections.
    for (k, (parts, bound)) in PARTS.iter().zip(CHAIN_BOUNDS).enumerate() {
        let worst = found.runs.iter().map(|run| run.errors[k]).worst();
        case.claim(format!("tip of two-link arms, {parts} parts, worst run"), EXACT_ARM, worst, Bound::AtMost(bound));
    }
    let error_of = |name: &str, method: usize| {
        found.runs.iter().find(|run| run.name == name).map_or(f64::NAN, |run| run.errors[method])
    };
    for (name, bound) in MODAL_BOUNDS {
        let text = format!("tip in {name}, modal links with stiffness by load");
        case.claim(text, EXACT_ARM, error_of(name, STIFFENED), Bound::AtMost(bound));
    }
    // Without stiffness by load the error of the spin must show.
    let text = "the same in spin_30 without stiffness by load";
    case.claim(text, EXACT_ARM, error_of("spin_30", LINEAR), Bound::AtLeast(0.03));
    case.text(format!(
        "Chains of rigid parts bend without limit: their error falls with the square of the number of parts, \
         also where the tip deviates by more than a metre. Modal links ({MODES} modes) assume small \
         deflections of each link from its own frame. With stiffness by load they hold while a link deflects \
         by a few per cent of its length; the arms of 10 mm are beyond that, and their steps do not converge \
         (-)."
    ));
    case.figure(spin_figure(found));
}

fn spin_figure(found: &TwoLink) -> Figure {
    let panels = found.runs.iter().filter(|run| run.name.starts_with("spin")).map(|run| {
        let curve = |name: &str, look, y: &[f64]| millimetres(name, look, run.time_s.clone(), y);
        let mut curves = vec![curve("truth", CurveLook::Total, &run.truth_m)];
        // A method that was left out has no samples.
        for k in [0, LINEAR, STIFFENED].into_iter().filter(|k| !run.found_m[*k].is_empty()) {
            curves.push(curve(&found.methods[k], CurveLook::Plain, &run.found_m[k]));
        }
        Panel { label: format!("{} [mm]", run.name), logarithmic: false, legend: true, curves }
    });
    Figure {
        name: "benchmarks-spin".into(),
        caption: "Distance of the tip from that of the rigid arm during spin-up".into(),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels: panels.collect(),
    }
}

fn slider_crank(case: &mut Case, found: &SliderCrank) {
    case.heading("Slider crank");
    case.text(format!(
        "Simeon's mechanism (1996; problem `crank` of the IVP test set): a crank of 0.15 m, a steel rod of 0.3 m and \
         8 x 8 mm, a slider of 76 g; the crank reaches 150 rad/s within 0.05 s, from rest. The rod is cut into two \
         flexible links in its middle, the slider closes a loop. Truths: the rod as a geometrically exact beam \
         without shear, and as a linear beam in the frame of its chord with six sines. They differ by {} mm in the \
         slider's position and by {} in the deflection, which is what axial forces add. Steps of {} ms.",
        plain(1e3 * (found.truths_apart.0 * 1e6).round() * 1e-6),
        error(found.truths_apart.1).print(),
        plain(1e3 * slider_crank::STEP_S)
    ));
    // Errors of the slider and of the rod's middle against both truths.
    let [exact, linear] = found.peak_m.map(|peak| fixed(1e3 * peak, 4).print());
    let mut table = Table::new(
        format!(
            "Maximum error of the slider's position [µm], and of the rod's deflection in the middle over its peak \
             ({exact} mm exact, {linear} mm linear)."
        ),
        &["rod", "slider, exact", "slider, linear", "middle, exact", "middle, linear"],
    );
    for run in &found.runs {
        let slider = run.slider_m.map(|x| digits(1e6 * x, 2));
        let middle = run.middle.map(error);
        table.rows.push([word(format!("two of {}", run.method))].into_iter().chain(slider).chain(middle).collect());
    }
    case.table(table);
    // Chains against the exact rod, with both ways to close the loop.
    let chain = &found.runs[CHAIN];
    let text = "slider of the slider crank, 8 parts per half, over the rod's length";
    case.claim(text, EXACT_ROD, chain.slider_m[0] / 0.3, Bound::AtMost(1e-5));
    case.claim("rod's deflection in the middle, the same", EXACT_ROD, chain.middle[0], Bound::AtMost(0.01));
    let constrained = &found.runs[SPOOK];
    let text = "slider with compliant constraints, over the rod's length";
    case.claim(text, EXACT_ROD, constrained.slider_m[0] / 0.3, Bound::AtMost(1e-5));
    case.claim("rod's deflection with compliant constraints", EXACT_ROD, constrained.middle[0], Bound::AtMost(0.01));
    // Modal links with and without stiffness by load: the effect of the axial force must show.
    let [plain_modal, stiffened] = [LINEAR_ROD, STIFFENED_ROD].map(|k| found.runs[k].middle[0]);
    let text = "rod's deflection, modal links with stiffness by load";
    case.claim(text, EXACT_ROD, stiffened, Bound::AtMost(0.01));
    case.claim("the same without stiffness by load", EXACT_ROD, plain_modal, Bound::AtLeast(0.03));
    case.text(
        "Chains carry the axial force of the rod by themselves; modal links need stiffness by load for it, \
         which includes the force of the loop's pin. The far end of a modal link moves along a straight line \
         in its frame and not on an arc, so the chord becomes longer by half the squared slope. This is the \
         remaining error of the slider.",
    );
    case.figure(rod_figure(found));
}

fn rod_figure(found: &SliderCrank) -> Figure {
    let time_ms: Vec<f64> = found.time_s.iter().map(|t| 1e3 * t).collect();
    let curve = |name: &str, look, y: &[f64]| millimetres(name, look, time_ms.clone(), y);
    let curves = vec![
        curve("exact", CurveLook::Total, &found.truth_m[0]),
        curve("linear", CurveLook::Plain, &found.truth_m[1]),
        curve(&found.runs[CHAIN].method, CurveLook::Plain, &found.runs[CHAIN].middle_m),
    ];
    Figure {
        name: "benchmarks-rod".into(),
        caption: "Deflection in the middle of the rod of the slider crank".into(),
        x_label: "time [ms]".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "deflection [mm]".into(), logarithmic: false, legend: true, curves }],
    }
}

fn swept_rotor(case: &mut Case, found: &[Spin]) {
    case.heading("Turning blade with a swept tip");
    case.text(format!(
        "The aluminium strip of Epps & Chandra (J. American Helicopter Society 41, 1996): 25.4 x 1.6 mm, clamped \
         63.5 mm from the axis, straight over 0.8 m, the last 152.4 mm swept back in the plane of rotation. 400 HEX20 \
         elements, reduced to 16 modes with geometric stiffening; the lowest {COUNT} frequencies about the equilibrium \
         of the turning blade. Truth: 400 C3D20R of CalculiX, large displacements under the spin, then eigenvalues \
         with the stiffness of that state; half the elements change them by up to 1 %."
    ));
    let mut table = Table::new(
        "Maximum error of eight frequencies, and the first two [Hz] with their truth.",
        &["sweep [deg]", "speed [rpm]", "error", "first", "truth", "second", "truth"],
    );
    for spin in found {
        let head = [fixed(spin.sweep_deg, 0), fixed(spin.speed_rpm, 0), error(spin.error())];
        let hz = spin.found_hz.iter().zip(&spin.truth_hz).take(2);
        table.rows.push(head.into_iter().chain(hz.flat_map(|(a, b)| [fixed(*a, 3), fixed(*b, 3)])).collect());
    }
    case.table(table);
    for (text, coupled, bound) in [
        ("frequencies of a blade at rest, or turning without sweep", false, 0.01),
        ("frequencies of a turning blade with a swept tip", true, 0.02),
    ] {
        let worst = found.iter().filter(|spin| spin.is_coupled() == coupled).map(Spin::error).worst();
        case.claim(text, SOLID, worst, Bound::AtMost(bound));
    }
}

/// A curve of lengths in metres, drawn in millimetres.
fn millimetres(name: &str, look: CurveLook, x: Vec<f64>, y: &[f64]) -> PlotCurve {
    PlotCurve { name: name.into(), look, x, y: y.iter().map(|m| 1e3 * m).collect() }
}
