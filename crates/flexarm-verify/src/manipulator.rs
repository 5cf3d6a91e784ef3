//! The whole manipulator in motion: link models and steppers against modal links, links against drives.

use std::ops::ControlFlow;

use flexarm::{
    ConstraintForm, DriveModel, LinkModel, Modelling, Motion, ReferenceSettings, Robot, RunOptions, Scenario,
    SpookPreset, SpookSettings, StepperKind, Summary, Trace, simulate_traced,
};
use flexarm_draw::{CurveLook, Panel, PlotCurve};
use flexarm_fem::element::Quadrature;
use flexarm_fem::reduction::Tie;
use flexarm_fem::{Material, UnitSystem};
use flexarm_stepping::Damping;
use nalgebra::{Matrix6, Vector3, Vector6};

use crate::Error;
use crate::Pace;
use crate::bench::{ALPHA, Bench, larger, modal, parts, spook};
use crate::meshed::Meshed;
use crate::page::{Bound, Case, Figure, Table, digits, error, fixed, signed, word};
use crate::pick::pick;

const LINKS: &str = "robots/kr210/links.toml";
const DRIVES: &str = "robots/kr210/robot.toml";
/// Modes in the castings' files.
const ALL_MODES: usize = 10;
/// Every so many samples are drawn: 4 ms, a seventh of the period of the fourth mode.
const DRAWN: usize = 2;
const AXES: [&str; 3] = ["x", "y", "z"];

/// A run that was made, seen every 2 ms.
pub(crate) struct Run {
    pub(crate) summary: Summary,
    trace: Trace,
}

/// Makes runs and tells how far it is.
pub(crate) struct Runs<'a, 'p> {
    pace: &'a mut Pace<'p>,
    done: f64,
    all: f64,
}

impl Runs<'_, '_> {
    fn make(
        &mut self,
        robot: &Robot,
        motion: &Motion,
        modelling: Modelling,
        stepper: StepperKind,
        step_s: f64,
    ) -> Result<Run, Error> {
        self.make_with(robot, &motion.into(), &RunOptions { stepper, step_s, modelling, ..RunOptions::default() })
    }

    /// With more than motion, links, drives and stepper of one's own.
    pub(crate) fn make_with(&mut self, robot: &Robot, scenario: &Scenario, options: &RunOptions) -> Result<Run, Error> {
        let options = RunOptions { log_rate_hz: 500.0, ..options.clone() };
        let weight = weight(options.stepper, options.step_s);
        let mut progress = |t: f64, total: f64| match self.pace.at((self.done + weight * t / total) / self.all) {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        };
        let (summary, trace) = simulate_traced(robot, scenario, &options, None, &mut progress)?;
        self.done += weight;
        Ok(Run { summary, trace })
    }
}

/// What a run costs, roughly, in runs by generalised-alpha.
fn weight(stepper: StepperKind, step_s: f64) -> f64 {
    match stepper {
        StepperKind::Reference(_) => 20.0,
        StepperKind::Spook(_) => 2e-3 / step_s,
        _ => 1e-3 / step_s,
    }
}

impl Run {
    fn tool(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.trace.rows.iter().map(|row| Vector3::from(row.flexible_m))
    }

    /// Flexible minus rigid tool.
    fn deflection(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.trace.rows.iter().map(|row| Vector3::from(row.flexible_m) - Vector3::from(row.rigid_m))
    }

    /// Deflection along an axis over time (mm).
    pub(crate) fn curve(&self, name: &str, look: CurveLook, axis: usize) -> PlotCurve {
        PlotCurve {
            name: name.into(),
            look,
            x: self.trace.rows.iter().step_by(DRAWN).map(|row| row.time_s).collect(),
            y: self.deflection().step_by(DRAWN).map(|d| 1e3 * d[axis]).collect(),
        }
    }

    /// Largest deflection, of all and of x, y, z.
    pub(crate) fn peaks(&self) -> [f64; 4] {
        peaks(self.deflection())
    }

    /// Largest distance of the tools of two runs, of all and of x, y, z.
    pub(crate) fn apart(&self, other: &Self) -> [f64; 4] {
        if self.trace.rows.len() != other.trace.rows.len() {
            return [f64::NAN; 4];
        }
        peaks(self.tool().zip(other.tool()).map(|(a, b)| a - b))
    }
}

/// Largest length, then largest component along x, y, z.
fn peaks(vectors: impl Iterator<Item = Vector3<f64>>) -> [f64; 4] {
    let sizes = |v: Vector3<f64>| [v.norm(), v.x.abs(), v.y.abs(), v.z.abs()];
    let most = vectors.map(sizes).reduce(|a, b| std::array::from_fn(|i| larger(a[i], b[i])));
    most.unwrap_or([f64::NAN; 4])
}

/// The case.
pub(crate) fn case(bench: &Bench, pace: &mut Pace<'_>) -> Result<Case, Error> {
    let mut case = Case::new("manipulator", "4. A whole manipulator");
    case.text(
        "`robots/kr210/links.toml`: a six-axis arm of the KR 210 class with 150 kg; link arm and forearm are castings, reduced from meshes of 10-node tetrahedra. \
         Joints follow the motion exactly. Deflection is the flexible tool minus the rigid one, world axes. Truth is the same robot with modal links \
         (all ten fixed-interface modes) by the stepper with error control, tolerance 1e-8. By hand: `flexarm compare robots/kr210/links.toml large_moves --links modal --stepper reference --rtol 1e-8`, \
         `--with links=lumped,segments=4` beside it; `--stepper spook --step 1e-4`.",
    );
    let robot = bench.robot(LINKS)?;
    let moves: &[&str] =
        if bench.quick { &["point_to_point"] } else { &["pick_and_place", "point_to_point", "large_moves"] };
    // One motion of all methods weighs about 150 runs by generalised-alpha, a pick 55, the rest 80.
    let pick_weight = if bench.quick { 0.0 } else { 55.0 };
    let mut runs = Runs { pace, done: 0.0, all: 150.0 * moves.len() as f64 + 80.0 + pick_weight };
    for name in moves {
        methods(&mut case, bench, &mut runs, &robot, name)?;
    }
    if !bench.quick {
        pick(&mut case, bench, &mut runs, &robot)?;
    }
    case.heading("What is left, and why");
    case.text(
        "*Two parts* miss the modal links by 0.5 to 0.7 % of the peak, half of it or more at rest too: they carry the weight of each casting in two lumps (cases 1 and 3). *Chains* close two thirds of it and then \
         stop; the table below says why. *Modal links* need no inner modes here: with both ends held a casting rings above 490 Hz, the arm at 12 to 33 Hz. *Compliant constraints* have two causes more: \
         damping in proportion to stiffness where the others damp each mode by 3 % (the rows at 0.1 ms), and their first order in the step. The preset `source` ties damping to the step.",
    );
    if !bench.quick {
        where_chains_stop(&mut case, bench, &robot)?;
    }
    which_flexibility(&mut case, bench, &mut runs, moves)?;
    elastic_drives(&mut case, bench, &mut runs, moves[moves.len() - 1])?;
    Ok(case)
}

const SOURCE: StepperKind =
    StepperKind::Spook(SpookSettings { form: ConstraintForm::Local, preset: SpookPreset::Source });

/// One motion, every model and stepper.
fn methods(case: &mut Case, bench: &Bench, runs: &mut Runs<'_, '_>, robot: &Robot, name: &str) -> Result<(), Error> {
    let motion = bench.motion(robot, &format!("trajectories/{name}.toml"))?;
    case.heading(&format!("`trajectories/{name}.toml`, links alone"));
    let reference = StepperKind::Reference(ReferenceSettings::new(1e-8));
    let truth = runs.make(robot, &motion, modal(ALL_MODES), reference, 2e-3)?;
    let [peak, ..] = truth.peaks();
    let (local, global) = (spook(ConstraintForm::Local), spook(ConstraintForm::Global));
    // SPOOK damps each spring in proportion to its stiffness; with such damping in both, only the steppers differ.
    let mut proportional = robot.clone();
    let first = truth.summary.frequencies_hz[0];
    for link in &mut proportional.flexible {
        link.damping = Damping::StiffnessProportional(2.0 * 0.03 / (std::f64::consts::TAU * first));
    }
    let list: Vec<(&str, &str, &Robot, Modelling, StepperKind, f64)> = vec![
        ("2 parts", "spring-damper, 1 ms", robot, parts(2), ALPHA, 1e-3),
        ("3 parts", "spring-damper, 1 ms", robot, parts(3), ALPHA, 1e-3),
        ("4 parts", "spring-damper, 1 ms", robot, parts(4), ALPHA, 1e-3),
        ("8 parts", "spring-damper, 1 ms", robot, parts(8), ALPHA, 1e-3),
        ("2 parts", "compliant constraints, local, 1 ms", robot, parts(2), local, 1e-3),
        ("2 parts", "compliant constraints, local, 0.1 ms", robot, parts(2), local, 1e-4),
        ("2 parts", "compliant constraints, global, 0.1 ms", robot, parts(2), global, 1e-4),
        ("4 parts", "compliant constraints, local, 0.1 ms", robot, parts(4), local, 1e-4),
        ("2 parts", "compliant constraints, preset `source`, 1 ms", robot, parts(2), SOURCE, 1e-3),
        ("modal, no modes (Guyan)", "spring-damper, 1 ms", robot, modal(0), ALPHA, 1e-3),
        ("modal, 10 modes", "spring-damper, 1 ms", robot, modal(ALL_MODES), ALPHA, 1e-3),
    ];
    let mut table = Table::new(
        format!(
            "Largest deflection along x, y, z and in all [mm], sag at the start [mm], first frequency there [Hz]; then the largest distance of the tool from that of the \
             truth along x, y, z and in all, over the truth's peak of {:.4} mm. {} s, tool seen every 2 ms.",
            1e3 * peak,
            truth.summary.duration_s
        ),
        &["links", "stepper", "x", "y", "z", "peak", "sag", "f_1", "Δx", "Δy", "Δz", "Δ"],
    );
    let row = |links: &str, stepper: &str, run: &Run, against: Option<&Run>| {
        let [all, x, y, z] = run.peaks();
        let sag = run.summary.tcp.as_ref().map_or(f64::NAN, |tcp| tcp.static_sag_m);
        let mut cells = vec![word(links), word(stepper)];
        cells.extend([x, y, z, all, sag].map(|u| fixed(1e3 * u, 4)));
        cells.push(digits(run.summary.frequencies_hz.first().copied().unwrap_or(f64::NAN), 5));
        match against {
            Some(truth) => {
                let [all, x, y, z] = run.apart(truth);
                cells.extend([x, y, z, all].map(|u| error(u / peak)));
            }
            None => cells.extend(["", "", "", ""].map(word)),
        }
        cells
    };
    let rigid =
        runs.make(robot, &motion, Modelling { links: LinkModel::Rigid, ..Modelling::default() }, ALPHA, 2e-3)?;
    table.rows.push(row("rigid", "-", &rigid, Some(&truth)));
    let mut kept = Vec::new();
    for (links, stepper, robot, modelling, kind, h) in &list {
        let run = runs.make(robot, &motion, *modelling, *kind, *h)?;
        table.rows.push(row(links, stepper, &run, Some(&truth)));
        kept.push((format!("{links}, {stepper}"), run.apart(&truth)[0] / peak, run));
    }
    table.rows.push(row("modal, 10 modes", "error control (truth)", &truth, None));
    case.table(table);
    let claim = |case: &mut Case, k: usize, bound: f64| {
        let (what, apart, _) = &kept[k];
        let text = format!("tool on {name}, {what}: largest distance over the peak deflection");
        case.claim(text, "modal links, error control", *apart, Bound::AtMost(bound));
    };
    // Spring-damper and compliant constraints with two parts; the chain that closes what is left; the stepper alone.
    claim(case, 0, 0.01);
    claim(case, 4, 0.01);
    claim(case, 5, 0.01);
    claim(case, 3, 0.004);
    claim(case, 10, 2e-4);

    // Where the rest of compliant constraints comes from: same model, same damping, stepper with error control.
    let exact = runs.make(&proportional, &motion, parts(2), reference, 2e-3)?;
    let mut split = Table::new(
        format!(
            "Compliant constraints (local) taken apart, same two parts: distance of the tool from the stepper with error control, over the peak, with damping \
             proportional to stiffness in both (3 % of {first:.2} Hz). What is left is the stepper's own error."
        ),
        &["step", "distance", "spring-damper, same step"],
    );
    let steps: &[f64] = if bench.quick { &[1e-3] } else { &[2e-3, 1e-3, 5e-4, 1e-4] };
    for &h in steps {
        let mut cells = vec![word(format!("{} ms", 1e3 * h))];
        for kind in [local, ALPHA] {
            cells.push(error(runs.make(&proportional, &motion, parts(2), kind, h)?.apart(&exact)[0] / peak));
        }
        split.rows.push(cells);
    }
    case.table(split);

    let mut panels = Vec::new();
    let shown = [0, 5];
    for (axis, letter) in AXES.iter().enumerate() {
        let mut curves = vec![truth.curve("modal", CurveLook::Total, axis)];
        curves.extend(shown.map(|k| kept[k].2.curve(&kept[k].0, CurveLook::Dashed, axis)));
        panels.push(Panel { label: format!("deflection {letter} [mm]"), logarithmic: false, legend: true, curves });
    }
    let distances = [0, 3, 5].map(|k| PlotCurve {
        name: kept[k].0.clone(),
        look: CurveLook::Plain,
        x: truth.trace.rows.iter().step_by(DRAWN).map(|row| row.time_s).collect(),
        y: kept[k].2.tool().zip(truth.tool()).step_by(DRAWN).map(|(a, b)| 100.0 * (a - b).norm() / peak).collect(),
    });
    panels.push(Panel { label: "Δ [% of peak]".into(), logarithmic: false, legend: true, curves: distances.into() });
    case.figure(Figure {
        name: format!("manipulator-{}", name.replace('_', "-")),
        caption: format!("{name}: deflection of the tool, and distance from modal links"),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels,
    });
    Ok(())
}

/// The forearm's sag under its own weight, part by part: chain against mesh.
///
/// Under a unit force at B the mesh moves by `U`, and by reciprocity the sag of B is the sum of weight times `U`; the parts of a chain
/// move rigidly. The difference is summed over the nodes of each part.
fn where_chains_stop(case: &mut Case, bench: &Bench, robot: &Robot) -> Result<(), Error> {
    const PARTS: usize = 8;
    let ductile_iron = Material { E: 169e9, nu: 0.275, rho: 7100.0, G: None };
    let fe =
        Meshed::read_with(bench, "robots/kr210/fe/link_3.msh.gz", UnitSystem::SI, ductile_iron, Quadrature::Exact)?;
    let Some(link) = robot.flexible.iter().map(|l| &l.flexible.reduced).find(|r| r.name == "link_3") else {
        return Ok(());
    };
    let (A, B) = (link.X_LA.translation.vector, link.X_LB.translation.vector);
    let condensation = fe.condense(&[fe.interface("A", A, Tie::Rigid)?, fe.interface("B", B, Tie::Rigid)?])?;
    let U = condensation.unit_load_shapes();
    let weights = fe.model.M.product(&fe.model.rigid_modes(&Vector3::zeros()).columns(0, 3).into_owned());
    let line = (B - A).normalize();
    let mut table = Table::new(
        "Forearm casting alone, A held: sag of B along an axis under its own weight along it. Chains of 3, 4 and 8 parts over the full mesh; then where the 8 parts lose it, part by part from A to B, as a share of \
         the mesh's sag.",
        &["along", "3 parts", "4 parts", "8 parts"],
    );
    table.columns.extend((1..=PARTS).map(|k| format!("part {k}")));
    let chains = link.details.as_ref().map_or(&[][..], |details| &details.chains);
    for (axis, letter) in AXES.iter().enumerate() {
        let (mut totals, mut by_part) = (Vec::new(), Vec::new());
        for chain in chains {
            let springs: Vec<(Vector3<f64>, Matrix6<f64>)> = chain
                .joints
                .iter()
                .filter_map(|joint| Some((joint.X_LS.translation.vector, joint.K_S.try_inverse()?)))
                .collect();
            let force = Vector3::ith(axis, 1.0);
            let give: Vec<Vector6<f64>> = springs
                .iter()
                .map(|(p, C)| {
                    let moment = (B - p).cross(&force);
                    C * Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
                })
                .collect();
            let mut lost = vec![0.0; chain.parts.len()];
            let (mut of_mesh, mut of_chain) = (0.0, 0.0);
            for (node, p) in fe.mesh.nodes.iter().enumerate() {
                let dofs = fe.model.dofs.of(node);
                let part = springs.iter().filter(|(at, _)| (p - at).dot(&line) > 0.0).count();
                let moved: Vector3<f64> = springs[..part]
                    .iter()
                    .zip(&give)
                    .map(|((at, _), d)| d.fixed_rows::<3>(0) + d.fixed_rows::<3>(3).into_owned().cross(&(p - at)))
                    .sum();
                for (k, dof) in dofs.enumerate() {
                    let weight = weights[(dof, axis)];
                    of_mesh += weight * U[(dof, axis)];
                    of_chain += weight * moved[k];
                    lost[part] += weight * (moved[k] - U[(dof, axis)]);
                }
            }
            totals.push(of_chain / of_mesh - 1.0);
            if chain.parts.len() == PARTS {
                by_part = lost.iter().map(|l| l / of_mesh).collect();
            }
        }
        let mut row = vec![word(*letter)];
        row.extend(totals.into_iter().chain(by_part).map(signed));
        table.rows.push(row);
    }
    case.table(table);
    case.text(
        "A chain's slices stand across the line from A to B and their strain energy becomes the joints, which is exact for loads at B. Weight sits within. The forearm's seat A lies *along* that line (an annulus of \
         168 mm radius in the plane of the line): the slices next to it cut through seat and drum, whose material is held here and gives there and does not move as rigid sections. That is where the weight is lost, and more \
         parts do not bring it back. A modal link, even without inner modes, has it exactly. Drives and gears, half of the forearm's mass, ride on the joints in all models alike, so a few per cent of the casting's own sag across are 0.2 % of the tool's.",
    );
    Ok(())
}

/// Links, drives, both.
fn which_flexibility(case: &mut Case, bench: &Bench, runs: &mut Runs<'_, '_>, moves: &[&str]) -> Result<(), Error> {
    case.heading("Which flexibility matters");
    case.text(
        "`robots/kr210/robot.toml` has gearboxes that yield, besides: stiffness and damping identified on another KR 210 whose links were taken as rigid (so what bends \
         in them is in the gearboxes' numbers too, and \"both\" is an upper bound). Motors follow the motion exactly; spring-damper, two parts, 1 ms.",
    );
    let robot = bench.robot(DRIVES)?;
    let mut table = Table::new(
        "Largest deflection along x, y, z, in all and its RMS [mm]; sag at the start [mm]; first frequencies there [Hz].",
        &["motion", "flexible", "x", "y", "z", "peak", "RMS", "sag", "f_1", "f_2", "f_3", "f_4"],
    );
    let both = Modelling::default();
    let kinds = [
        ("links", Modelling { drives: DriveModel::Rigid, ..both }),
        ("drives", Modelling { links: LinkModel::Rigid, ..both }),
        ("both", both),
    ];
    let mut additive = 0.0f64;
    for name in moves {
        let motion = bench.motion(&robot, &format!("trajectories/{name}.toml"))?;
        let made: Vec<Run> =
            kinds.iter().map(|(_, m)| runs.make(&robot, &motion, *m, ALPHA, 1e-3)).collect::<Result<_, Error>>()?;
        for ((what, _), run) in kinds.iter().zip(&made) {
            let [all, x, y, z] = run.peaks();
            let tcp = run.summary.tcp.as_ref();
            let (rms, sag) = tcp.map_or((f64::NAN, f64::NAN), |tcp| (tcp.rms_m, tcp.static_sag_m));
            let mut cells = vec![word(*name), word(*what)];
            cells.extend([x, y, z, all, rms, sag].map(|u| fixed(1e3 * u, 3)));
            cells.extend(run.summary.frequencies_hz.iter().take(4).map(|f| digits(*f, 4)));
            table.rows.push(cells);
        }
        // At rest compliances in series add.
        let sags: Vec<Vector3<f64>> = made.iter().filter_map(|run| run.deflection().next()).collect();
        if let [links, drives, both] = sags[..] {
            additive = larger(additive, (links + drives - both).norm() / both.norm());
        }
    }
    case.table(table);
    case.claim(
        "sag of links and drives together: sum of the two alone",
        "series springs, to first order",
        additive,
        Bound::AtMost(0.01),
    );
    case.text(
        "Drives of this class give three to four times what the castings do. At rest the two add up. In motion peaks need not: both together ring lower and longer (point_to_point, large_moves: the peak of both is the larger), or do not peak at one time \
         (pick_and_place).",
    );
    Ok(())
}

/// The methods again with drives that yield.
fn elastic_drives(case: &mut Case, bench: &Bench, runs: &mut Runs<'_, '_>, name: &str) -> Result<(), Error> {
    case.heading(&format!("`trajectories/{name}.toml`, links and drives"));
    let robot = bench.robot(DRIVES)?;
    let motion = bench.motion(&robot, &format!("trajectories/{name}.toml"))?;
    let reference = StepperKind::Reference(ReferenceSettings::new(1e-8));
    let truth = runs.make(&robot, &motion, modal(ALL_MODES), reference, 2e-3)?;
    let [peak, ..] = truth.peaks();
    let mut table = Table::new(
        format!(
            "Largest deflection along x, y, z and in all, sag at the start [mm]; largest distance of the tool from modal links with the same drives, over their peak of {:.3} mm.",
            1e3 * peak
        ),
        &["links", "stepper", "x", "y", "z", "peak", "sag", "Δx", "Δy", "Δz", "Δ"],
    );
    let mut row = |links: &str, stepper: &str, run: &Run| {
        let [all, x, y, z] = run.peaks();
        let sag = run.summary.tcp.as_ref().map_or(f64::NAN, |tcp| tcp.static_sag_m);
        let mut cells = vec![word(links), word(stepper)];
        cells.extend([x, y, z, all, sag].map(|u| fixed(1e3 * u, 3)));
        let [all, x, y, z] = run.apart(&truth);
        cells.extend([x, y, z, all].map(|u| error(u / peak)));
        table.rows.push(cells);
        all / peak
    };
    let rigid = Modelling { links: LinkModel::Rigid, drives: DriveModel::Rigid, ..Modelling::default() };
    let links_only = Modelling { drives: DriveModel::Rigid, ..modal(ALL_MODES) };
    let drives_only = Modelling { links: LinkModel::Rigid, ..Modelling::default() };
    let local = spook(ConstraintForm::Local);
    let list = [
        ("rigid, drives too", "-", rigid, ALPHA, 2e-3),
        ("modal, drives rigid", "spring-damper, 1 ms", links_only, ALPHA, 1e-3),
        ("rigid", "spring-damper, 1 ms", drives_only, ALPHA, 1e-3),
        ("2 parts", "spring-damper, 1 ms", parts(2), ALPHA, 1e-3),
        ("8 parts", "spring-damper, 1 ms", parts(8), ALPHA, 1e-3),
        ("2 parts", "compliant constraints, local, 1 ms", parts(2), local, 1e-3),
        ("2 parts", "compliant constraints, local, 0.1 ms", parts(2), local, 1e-4),
        ("2 parts", "compliant constraints, global, 0.1 ms", parts(2), spook(ConstraintForm::Global), 1e-4),
    ];
    let mut kept = Vec::new();
    for (k, (links, stepper, modelling, kind, h)) in list.into_iter().enumerate() {
        let run = runs.make(&robot, &motion, modelling, kind, h)?;
        let apart = row(links, stepper, &run);
        if [3, 4, 6].contains(&k) {
            let text = format!("tool on {name} with elastic drives, {links}, {stepper}");
            case.claim(text, "modal links, error control", apart, Bound::AtMost(0.004));
        }
        kept.push(run);
    }
    row("modal, 10 modes", "error control (truth)", &truth);
    case.table(table);
    let mut panels = Vec::new();
    for (axis, letter) in AXES.iter().enumerate() {
        let curves = vec![
            truth.curve("links and drives, modal", CurveLook::Total, axis),
            kept[3].curve("links and drives, 2 parts, spring-damper", CurveLook::Dashed, axis),
            kept[2].curve("drives alone", CurveLook::Plain, axis),
            kept[1].curve("links alone", CurveLook::Plain, axis),
        ];
        panels.push(Panel { label: format!("deflection {letter} [mm]"), logarithmic: false, legend: true, curves });
    }
    case.figure(Figure {
        name: "manipulator-drives".into(),
        caption: format!("{name}: deflection of the tool with links, drives and both elastic"),
        x_label: "time [s]".into(),
        logarithmic_x: false,
        panels,
    });
    Ok(())
}
