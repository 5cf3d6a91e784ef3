//! The page of the case: torques, gears, servos, frequencies.
//!
//! Not here: numbers (the other files of the folder).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::frequencies::{Frequencies, MEASURED_HZ, WRIST};
use super::gears::{COMPARED_HZ, Gears, LATE_S, SHOWN};
use super::recording::{AXES, EDGE_S, RUNS, SMOOTH_HZ, STEP_S, WITH_ENCODER};
use super::servo::Servos;
use super::torques::{Torques, VARIANTS};
use super::{Findings, ROBOT};
use crate::bench::Worst;
use crate::page::{Bound, Case, Figure, Table, digits, fixed, listed, plain, word};

/// Bounds of the torque residual of a good rigid model, axes 1 to 3, on the two runs that were not
/// used for the fit.
const TORQUE_BOUNDS: [f64; WITH_ENCODER] = [0.11, 0.045, 0.031];
/// Bound of the deflection residual of axes 2 and 3 with springs of constant stiffness (rad).
const DEFLECTION_BOUND: f64 = 40e-6;
/// Minimum deflection residual of axes 2 and 3 with rigid gears (rad).
const RIGID_GEAR: [f64; 2] = [80e-6, 100e-6];
/// Bound of the frequency error; the truth is rounded to 0.01 Hz.
const FREQUENCY_BOUND: f64 = 2e-3;

pub(super) fn page(found: &Findings) -> Case {
    let mut case = Case::new("measured", "6. A measured robot", "recordings of a KUKA KR 300: torques, gears");
    case.text(format!(
        "A KUKA KR 300 R2500 ultra SE with a load of 151 kg, recorded at TU Kaiserslautern in October 2020 \
         (Weigand, Ulmen, Janot, Ruskowski; github.com/JonasWeigand/Robot_Identification, MIT licence): \
         {RUNS} runs of 10 s with motor positions, link encoders behind the gears of axes 1 to \
         {WITH_ENCODER}, and motor torques, every {} ms (`tests/verification/kr300`). Parameters are those of \
         the authors; fitted here are friction and, from the link encoders of the same runs, the stiffness of \
         two gears (`{ROBOT}` and its README).",
        plain(1e3 * STEP_S)
    ));
    torques(&mut case, &found.torques);
    gears(&mut case, &found.gears);
    servos(&mut case, &found.servos);
    frequencies(&mut case, &found.frequencies);
    case
}

fn torques(case: &mut Case, found: &Torques) {
    case.heading("Torques of the motors");
    case.text(format!(
        "Inverse dynamics of the rigid arm (links, load, rotors times ratio squared, hydraulic \
         counterbalance) along the recorded motor positions, against the recorded torques. Both are smoothed \
         at {} Hz without phase; {} s at both ends and samples in which the axis is slower than 1 deg/s are \
         left out. Friction (offset, viscous, Coulomb) is fitted to run 1; runs 2 and 3 are unseen.",
        plain(SMOOTH_HZ),
        plain(EDGE_S)
    ));
    // Residuals of each variant of the model, run by run.
    let mut table = Table::new("RMS of measured minus computed over RMS of the torque [%].", &["model", "run"]);
    table.columns.extend((1..=AXES).map(|k| format!("A{k}")));
    for ((what, _), runs) in VARIANTS.iter().zip(&found.errors) {
        for (run, errors) in runs.iter().enumerate() {
            let cells = [word(*what), word((run + 1).to_string())].into_iter();
            table.rows.push(cells.chain(errors.iter().map(|e| fixed(100.0 * e, 1))).collect());
        }
    }
    case.table(table);
    // Bounds for the full model in the runs outside the fit, and for what each omission costs.
    let worst_unseen = |variant: usize, axis: usize| found.errors[variant].iter().skip(1).map(|run| run[axis]).worst();
    for (axis, bound) in TORQUE_BOUNDS.into_iter().enumerate() {
        let text = format!("torque of axis {} in the unseen runs", axis + 1);
        case.claim(text, "recorded motor torques", worst_unseen(0, axis), Bound::AtMost(bound));
    }
    let least =
        |variant: usize, axis: usize| found.errors[variant].iter().map(|run| run[axis]).fold(f64::INFINITY, f64::min);
    case.claim(
        "the same of axis 2 without the counterbalance",
        "recorded motor torques",
        least(1, 1),
        Bound::AtLeast(0.3),
    );
    case.claim("the same of axis 1 without the rotors", "recorded motor torques", least(2, 0), Bound::AtLeast(0.2));
    // The fitted friction.
    let mut table = Table::new(
        "Friction of run 1, on the joint's side.",
        &["axis", "offset [N m]", "viscous [N m s/rad]", "Coulomb [N m]"],
    );
    for (axis, friction) in found.friction.iter().enumerate() {
        let cells = friction.iter().map(|x| fixed(*x, 0));
        table.rows.push([word(format!("A{}", axis + 1))].into_iter().chain(cells).collect());
    }
    case.table(table);
    case.text(
        "The source gives the load no inertia of its own, and the rest of axis 1 looks like missing inertia. \
         The friction of the wrist's axes cannot be separated in these runs. At rest friction takes any value \
         up to its limit, which a formula in the speed does not contain: hence the first second of the \
         curves.",
    );
    case.figure(torque_figure(found));
}

fn torque_figure(found: &Torques) -> Figure {
    let shown = &found.shown;
    let panels = shown.measured.iter().zip(&shown.computed).enumerate().map(|(axis, (measured, computed))| {
        let curve = |name: &str, look, y: &[f64]| PlotCurve {
            name: name.into(),
            look,
            x: thinned(&shown.time_s),
            y: thinned(y).iter().map(|tau| 1e-3 * tau).collect(),
        };
        let curves = vec![curve("measured", CurveLook::Total, measured), curve("computed", CurveLook::Plain, computed)];
        Panel { label: format!("torque on joint {} [kN m]", axis + 1), logarithmic: false, legend: true, curves }
    });
    Figure {
        name: "measured-torques".into(),
        caption: "Run 3, unseen: torques on joints 1 to 3, measured and computed".into(),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels: panels.collect(),
    }
}

/// Keeps every third sample, so that curves have a few hundred points.
fn thinned(x: &[f64]) -> Vec<f64> {
    x.iter().step_by(3).copied().collect()
}

fn gears(case: &mut Case, found: &Gears) {
    case.heading("Deflection of the gears");
    let stiffness = |axis: usize| digits(1e-6 * found.stiffness[axis], 3).print();
    case.text(format!(
        "A run with elastic gears and motors along the recorded positions, against motor minus link encoder, \
         up to {} Hz, all runs. The encoder is {} ms late, which is corrected. Springs of {} MN m/rad (axis \
         2) and {} MN m/rad (axis 3). The zero of each run is fitted and, in the last two columns, errors of \
         the encoder: its ripple and one term of eccentricity per turn. Axis 1 carries no weight: its gear \
         deflects less than the error of its encoder, so its stiffness cannot be determined.",
        plain(COMPARED_HZ),
        plain(1e3 * LATE_S),
        stiffness(1),
        stiffness(2)
    ));
    // Residual of the measured deflection: rigid gear, spring, encoder errors.
    let mut table = Table::new(
        "RMS of what is left of the measured deflection [µrad].",
        &["axis", "rigid gear", "elastic gear", "and ripple", "and eccentricity"],
    );
    for (axis, rest) in found.rests.iter().enumerate() {
        let cells = [rest.rigid, rest.spring, rest.ripple, rest.eccentricity].map(|x| fixed(1e6 * x, 0));
        table.rows.push([word(format!("A{}", axis + 1))].into_iter().chain(cells).collect());
    }
    case.table(table);
    // The spring must explain the deflection, and a rigid gear must not.
    for (axis, rigid) in [1, 2].into_iter().zip(RIGID_GEAR) {
        let rest = found.rests[axis];
        let name = axis + 1;
        let truth = "motor minus link encoder";
        case.claim(
            format!("deflection of gear {name}, RMS of the rest [rad]"),
            truth,
            rest.eccentricity,
            Bound::AtMost(DEFLECTION_BOUND),
        );
        case.claim(format!("the same with a rigid gear {name} [rad]"), truth, rest.rigid, Bound::AtLeast(rigid));
    }
    case.figure(gear_figure(found));
}

fn gear_figure(found: &Gears) -> Figure {
    let panels = [1, 2].map(|axis| {
        let curve = |name: &str, look, y: &[f64]| PlotCurve {
            name: name.into(),
            look,
            x: thinned(&found.time_s),
            y: thinned(y).iter().map(|e| 1e6 * e).collect(),
        };
        let curves = vec![
            curve("measured, encoder errors taken off", CurveLook::Total, &found.measured[axis]),
            curve("simulated", CurveLook::Plain, &found.simulated[axis]),
        ];
        Panel { label: format!("gear {} [µrad]", axis + 1), logarithmic: false, legend: true, curves }
    });
    Figure {
        name: "measured-gears".into(),
        caption: format!("Run {SHOWN}: motor minus link of axes 2 and 3, measured and simulated, without their means"),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels: panels.into(),
    }
}

fn servos(case: &mut Case, found: &Servos) {
    case.heading("Servos");
    case.text(
        "All axes under servos along the reference of run 1, with the default gains of robot files: the gains \
         of the source have no documented units, and its controller closes axes 1 to 3 on the link encoder. \
         Only orders of magnitude are compared.",
    );
    // Tracking errors, recorded and simulated with and without feedforward.
    let mut table =
        Table::new("RMS of reference minus position (links of axes 1 to 3, motors of 4 to 6) [deg].", &["what"]);
    table.columns.extend((1..=AXES).map(|k| format!("A{k}")));
    let rows = [
        ("measured", &found.measured),
        ("simulated, torques of the rigid robot fed forward", &found.fed_forward),
        ("simulated, nothing fed forward", &found.alone),
    ];
    for (what, tracking) in rows {
        let cells = tracking.iter().map(|x| digits(x.to_degrees(), 2));
        table.rows.push([word(what)].into_iter().chain(cells).collect());
    }
    case.table(table);
    // Servos without delay must follow at least as closely as the recorded ones.
    let worst = (0..WITH_ENCODER).map(|axis| found.alone[axis] / found.measured[axis]).worst();
    case.claim(
        "tracking error of axes 1 to 3 under servos over the measured one",
        "recorded link encoders, run 1",
        worst,
        Bound::AtMost(1.0),
    );
    case.text(
        "Simulated axes follow more closely than the real ones: the model has no delay of communication, no \
         current loop and no stiction. The recorded wrist is ahead of its reference, because the controller \
         feeds forward more friction (454, 1000 and 459 N m s/rad in the source) than axes 4 to 6 have (table \
         above).",
    );
}

fn frequencies(case: &mut Case, found: &Frequencies) {
    case.heading("Frequencies");
    let mut table = Table::new("First frequencies with held motors [Hz].", &["springs", "home pose", "5 s into run 1"]);
    for set in &found.sets {
        let hz = |k: usize| listed(&set.hz[k].iter().map(|hz| digits(*hz, 3).print()).collect::<Vec<_>>());
        table.rows.push(vec![word(&set.what), word(hz(0)), word(hz(1))]);
    }
    case.table(table);
    case.claim(
        "frequencies of the gears of the source",
        "mass matrix of Pinocchio, rounded to 0.01 Hz",
        found.error,
        Bound::AtMost(FREQUENCY_BOUND),
    );
    let [low, high] = MEASURED_HZ;
    case.text(format!(
        "While axis 1 moves, the recordings show a vibration of {} to {} Hz in which the link encoder moves \
         five times as far as the motor, in phase. With the gears alone the model is higher at that pose; \
         wrist gears of the class (`{WRIST}`) explain a part of the difference. Links, bearings, pedestal and \
         the mounting of the load are not in this model, and the recordings do not separate them.",
        plain(low),
        plain(high)
    ));
}
