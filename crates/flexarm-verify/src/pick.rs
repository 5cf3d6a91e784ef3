//! The manipulator picks something up and sets it down: every stepper over payloads that change at once.

use flexarm::{DriveModel, Modelling, ReferenceSettings, Robot, RunOptions, Scenario, StepperKind};
use flexarm_draw::{CurveLook, Panel, PlotCurve};

use crate::Error;
use crate::bench::{ALPHA, Bench, modal, parts};
use crate::manipulator::{Run, Runs};
use crate::page::{Bound, Case, Figure, Table, error, fixed, word};

const MOTION: &str = "trajectories/pick_and_place.toml";
const LOADS: &str = "trajectories/pick_and_place.loads.toml";

/// Steppers against the one with error control, links in two parts and in modes.
pub(crate) fn pick(case: &mut Case, bench: &Bench, runs: &mut Runs<'_, '_>, robot: &Robot) -> Result<(), Error> {
    let scenario = Scenario::new(bench.motion(robot, MOTION)?).with_loads_file(bench.file(LOADS))?;
    case.heading(&format!("`{LOADS}`, links alone"));
    let mut make = |links: Modelling, stepper: StepperKind, step_s: f64| {
        let modelling = Modelling { drives: DriveModel::Rigid, ..links };
        runs.make_with(robot, &scenario, &RunOptions { stepper, step_s, modelling, ..RunOptions::default() })
    };
    let reference = StepperKind::Reference(ReferenceSettings::new(1e-8));
    let mut table = Table::new(
        "The gripper of 30 kg picks a workpiece of 120 kg up at 1.25 s and sets it down at 5.55 s: its weight comes and goes at once, and the arm rings. Largest deflection along \
         x, y, z and in all [mm], sag at the start [mm]; largest distance of the tool from that of the stepper with error control (tolerance 1e-8), over its peak, same links.",
        &["links", "stepper", "x", "y", "z", "peak", "sag", "Δ"],
    );
    let row = |links: &str, stepper: &str, run: &Run, apart: Option<f64>| {
        let [all, x, y, z] = run.peaks();
        let sag = run.summary.tcp.as_ref().map_or(f64::NAN, |tcp| tcp.static_sag_m);
        let mut cells = vec![word(links), word(stepper)];
        cells.extend([x, y, z, all, sag].map(|u| fixed(1e3 * u, 4)));
        cells.push(apart.map_or_else(|| word(""), error));
        cells
    };
    let list = [
        ("2 parts", parts(2), "spring-damper, 2 ms", ALPHA, 2e-3),
        ("2 parts", parts(2), "spring-damper, 1 ms", ALPHA, 1e-3),
        ("2 parts", parts(2), "explicit, 0.1 ms", StepperKind::Rk4, 1e-4),
        ("modal, no modes", modal(0), "spring-damper, 1 ms", ALPHA, 1e-3),
    ];
    let (two, none) = (make(parts(2), reference, 2e-3)?, make(modal(0), reference, 2e-3)?);
    let mut curves: Vec<PlotCurve> = vec![two.curve("error control", CurveLook::Total, 2)];
    for (links, modelling, stepper, kind, step_s) in list {
        let truth = if links == "2 parts" { &two } else { &none };
        let run = make(modelling, kind, step_s)?;
        let apart = run.apart(truth)[0] / truth.peaks()[0];
        table.rows.push(row(links, stepper, &run, Some(apart)));
        let text =
            format!("tool with a workpiece picked up and set down, {links}, {stepper}: largest distance over the peak");
        let bound = if kind == StepperKind::Rk4 { 1e-4 } else { 5e-3 };
        case.claim(text, "the same links, error control", apart, Bound::AtMost(bound));
        if step_s == 1e-3 && links == "2 parts" {
            curves.push(run.curve("spring-damper, 1 ms", CurveLook::Dashed, 2));
        }
    }
    table.rows.push(row("2 parts", "error control", &two, None));
    table.rows.push(row("modal, no modes", "error control", &none, None));
    case.table(table);
    let panel = Panel { label: "deflection z [mm]".into(), logarithmic: false, legend: true, curves };
    case.figure(Figure {
        name: "manipulator-pick".into(),
        caption: "pick_and_place with its workpiece: deflection of the tool".into(),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels: vec![panel],
    });
    Ok(())
}
