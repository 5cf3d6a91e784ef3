//! One clamped beam: everything that has an answer on paper.

mod mesh;

use std::sync::Arc;

use flexarm::{ConstraintForm, LinkModel, Modelling, Robot, SpookPreset, SpookSettings, Start, StepperKind};
use flexarm_draw::{CurveLook, Panel, PlotCurve};
use flexarm_kinematics::LinkInertia;
use flexarm_stepping::{Damping, MotionFn, ReferenceSettings};
use nalgebra::{Matrix6, Vector3, Vector6};

use crate::Error;
use crate::Pace;
use crate::bench::{
    ALPHA, Bench, LOADS, LUMPED, Rig, Worst, column_error, compliance_error, damped, larger, modal, parts, small_loads,
    spook, tool_path, weightless,
};
use crate::page::{Bound, Case, Figure, Table, bare_error, digits, error, fixed, signed, word};
use crate::textbook::{Stiffness, rectangle_torsion};

const ROBOT: &str = "robots/one_beam/robot.toml";
/// The same with the link reduced from a mesh.
const MESHED: &str = "robots/one_beam/mesh.toml";
const G: f64 = 9.81;
/// Ball at the end of the bar (kg).
const BALL: f64 = 0.5;

/// Rotary inertia of the section, `rho I`, bending sideways and upwards (kg m).
const ROTARY: [f64; 2] = [2700.0 * 0.04 * 0.02 * 0.02 * 0.02 / 12.0, 2700.0 * 0.02 * 0.04 * 0.04 * 0.04 / 12.0];

/// The bar of `robots/one_beam/README.md`: 0.8 m, 20 mm wide (y), 40 mm high (z), aluminium.
fn bar() -> Stiffness {
    let (l, b, h, E, nu, rho) = (0.8, 0.02, 0.04, 70e9, 0.33, 2700.0);
    let area = b * h;
    let GJ = E / (2.0 * (1.0 + nu)) * rectangle_torsion(h, b);
    let bending = |along: f64, across: f64| E * across * along.powi(3) / 12.0;
    Stiffness { l, EA: E * area, EI_y: bending(h, b), EI_z: bending(b, h), GJ, kGA: [f64::INFINITY; 2], mu: rho * area }
}

/// The same with shear: Cowper's factor of a rectangle, 10(1 + nu)/(12 + 11 nu).
fn bar_with_shear() -> Stiffness {
    let (nu, bar) = (0.33, bar());
    let kGA = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * bar.EA / (2.0 * (1.0 + nu));
    Stiffness { kGA: [kGA; 2], ..bar }
}

/// The case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    let mut case = Case::new("one-beam", "1. One beam");
    case.text(
        "`robots/one_beam`: a bar of aluminium, 0.8 m long, 20 mm wide and 40 mm high, clamped at A, a ball of 0.5 kg at its end B. \
         Euler and Bernoulli's theory unless said otherwise, so closed forms are exact truths. x points along the bar, z upwards. \
         By hand: `flexarm statics one_beam --wrench 0,0,10`, `flexarm modes one_beam --segments 5`.",
    );
    let robot = bench.robot(ROBOT)?;
    end_loads(&mut case, &robot)?;
    stations(&mut case, &robot)?;
    splits(&mut case, &robot)?;
    weight_and_frequencies(&mut case, &robot)?;
    steps(&mut case, &robot, bench.quick)?;
    fast_motion(&mut case, &robot)?;
    let meshed = bench.robot(MESHED)?;
    mesh::mesh(&mut case, bench, &meshed)?;
    mesh::large_loads(&mut case, bench, &robot, &meshed)?;
    Ok(case)
}

/// Six end loads, each method against the closed form.
fn end_loads(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("Six loads at the end");
    let truth = bar().tip_compliance();
    let (robot, loads) = (damped(weightless(robot.clone())), small_loads(&truth));
    let two = Rig::new(&robot, &parts(2), None)?;
    let mut methods: Vec<(String, Matrix6<f64>)> = Vec::new();
    for (name, kind) in LUMPED {
        let C = two.compliance(&loads, |rig, wrench| rig.settled(wrench, kind, 2e-3))?;
        methods.push((format!("{name}, 2 parts"), C));
    }
    for (name, modelling) in [("5 parts", parts(5)), ("modal, 6 modes", modal(6))] {
        let rig = Rig::new(&robot, &modelling, None)?;
        methods.push((name.into(), rig.compliance(&loads, Rig::statics)?));
    }
    let shear = bar_with_shear().tip_compliance();
    let mut table = Table::new(
        "Displacement of the end along the load, per unit of it (N or N m), in closed form, and what shear would add; then the error \
         of each method: the largest of the six components of the end's motion, over `sqrt(C_ii C_jj)`. Compliant constraints and \
         spring-damper run in time from the undeformed bar until they rest, with loads that move the end by 10 µm or 10 µrad, up \
         and down (`(u(F) - u(-F))/2F`).",
        &["load", "closed form [µm, µrad]", "shear"],
    );
    table.columns.extend(methods.iter().map(|(name, _)| name.clone()));
    for j in 0..6 {
        let mut row = vec![word(LOADS[j]), digits(1e6 * truth[(j, j)], 6), signed(shear[(j, j)] / truth[(j, j)] - 1.0)];
        row.extend(methods.iter().map(|(_, C)| error(column_error(C, &truth, j))));
        table.rows.push(row);
    }
    case.table(table);
    for (name, C) in &methods {
        let worst = compliance_error(C, &truth);
        case.claim(format!("end loads, {name}"), "closed form", worst, Bound::AtMost(1e-6));
    }
    Ok(())
}

/// Bodies of a lumped bar with the place where each begins.
fn bodies(rig: &Rig) -> Vec<(usize, f64)> {
    let base = rig.arm.model.frame("beam_1").map_or(0, |frame| frame.body);
    let joints = rig.arm.elements.iter().map(|element| {
        let at = rig.at_point(element.body, Vector3::zeros());
        (element.body, -at.frame.X_BF.translation.vector.x)
    });
    std::iter::once((base, 0.0)).chain(joints).collect()
}

/// A rig of the point of the bar at `x`.
fn at(rig: &Rig, bodies: &[(usize, f64)], x: f64) -> Rig {
    let body = bodies.iter().rev().find(|(_, from)| *from <= x + 1e-12).map_or(bodies[0].0, |(body, _)| *body);
    rig.at_point(body, Vector3::new(x, 0.0, 0.0))
}

/// Loads at stations along the bar, deflection and slope along it.
fn stations(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("Deflection and rotation along the beam, loads at stations");
    case.text(
        "Rigid parts bend at their joints only, and there they shift as well as turn. At the end, and for loads at the end, that is exact; between, a link of \
         n parts is n straight pieces. Modal links are watched at their interfaces alone, so they are not in this table; the mesh below has its stations as interfaces.",
    );
    let bar = bar();
    let robot = weightless(robot.clone());
    let counts = [2, 3, 5, 9, 17];
    let rigs: Vec<(usize, Rig)> =
        counts.iter().map(|&n| Ok((n, Rig::new(&robot, &parts(n), None)?))).collect::<Result<_, Error>>()?;
    // The size does not matter as long as the bar hardly bends.
    let (force, moment) = (0.1, 0.1);
    let heads: Vec<String> = counts.iter().map(|n| format!("{n} parts")).collect();
    let with = |caption: &str| {
        let mut table = Table::new(caption, &["load at a/l", "", "", "closed form [µm, µrad]"]);
        table.columns.extend(heads.iter().cloned());
        table
    };
    let mut there = with(
        "Force F_z of 100 mN or moment -M_y of 100 mN m at x = a: deflection w and slope w' of the loaded station in closed form, and the error there.",
    );
    let mut end = with("The same loads, deflection and slope of the end.");
    let mut worst_end = 0.0f64;
    for fraction in [0.3, 0.5, 0.75, 1.0] {
        let a = fraction * bar.l;
        for (name, wrench) in [
            ("F_z", Vector6::new(0.0, 0.0, force, 0.0, 0.0, 0.0)),
            ("-M_y", Vector6::new(0.0, 0.0, 0.0, 0.0, -moment, 0.0)),
        ] {
            let closed = |x: f64| {
                if name == "F_z" { bar.under_force(force, a, x) } else { bar.under_moment(moment, a, x) }
            };
            for (table, x, place) in [(&mut there, a, "a"), (&mut end, bar.l, "l")] {
                // Deflection along z, and slope: a rotation about -y.
                let mut rows = [0, 1].map(|k| {
                    let what = if k == 0 { format!("w({place})") } else { format!("w'({place})") };
                    vec![fixed(fraction, 2), word(name), word(what), digits(1e6 * closed(x)[k], 5)]
                });
                for (_, rig) in &rigs {
                    let bodies = bodies(rig);
                    let u = at(rig, &bodies, a).statics_at(&wrench, &at(rig, &bodies, x))?;
                    for (row, (found, truth)) in rows.iter_mut().zip([u[2], -u[4]].into_iter().zip(closed(x))) {
                        row.push(signed(found / truth - 1.0));
                        if place == "l" && fraction == 1.0 {
                            worst_end = larger(worst_end, (found / truth - 1.0).abs());
                        }
                    }
                }
                table.rows.extend(rows);
            }
        }
    }
    case.table(there);
    case.table(end);
    case.text(
        "A load at the edge of a slice (joint k of n - 1 stands in the middle of slice k) loads whole slices only and is carried exactly; a load within a slice \
         sees all of the slice's joint or nothing of it. Links are loaded at their ends by the joints of a robot, so this matters for their own weight and for \
         cables and motors on the way.",
    );
    case.claim(
        "deflection and slope of the end under a load at the end, 2 to 17 parts",
        "closed form",
        worst_end,
        Bound::AtMost(1e-6),
    );

    let places: Vec<f64> = (0..=400).map(|k| bar.l * f64::from(k) / 400.0).collect();
    let mut panels = Vec::new();
    for (label, a, k) in [
        ("w, force at l [µm]", bar.l, 0),
        ("w', force at l [µrad]", bar.l, 1),
        ("w, force at l/2 [µm]", 0.5 * bar.l, 0),
        ("w', force at l/2 [µrad]", 0.5 * bar.l, 1),
    ] {
        let wrench = Vector6::new(0.0, 0.0, force, 0.0, 0.0, 0.0);
        let curve = |name: &str, look, y: Vec<f64>| PlotCurve { name: name.into(), look, x: places.clone(), y };
        let closed = places.iter().map(|x| 1e6 * bar.under_force(force, a, *x)[k]).collect();
        let mut curves = vec![curve("closed form", CurveLook::Total, closed)];
        for (n, rig) in rigs.iter().filter(|(n, _)| [2, 3, 5].contains(n)) {
            let bodies = bodies(rig);
            let loaded = at(rig, &bodies, a);
            let w = places.iter().map(|x| {
                let u = loaded.statics_at(&wrench, &at(rig, &bodies, *x))?;
                Ok(1e6 * if k == 0 { u[2] } else { -u[4] })
            });
            curves.push(curve(&format!("{n} parts"), CurveLook::Plain, w.collect::<Result<_, Error>>()?));
        }
        panels.push(Panel { label: label.into(), logarithmic: false, legend: true, curves });
    }
    case.figure(Figure {
        name: "one-beam-along".into(),
        caption: "Deflection and slope along the bar under 100 mN upwards at the end and at mid length".into(),
        x_label: "x [m]".into(),
        logarithmic_x: false,
        panels,
    });
    Ok(())
}

/// Where the link is cut, and what happens without the coupling terms.
fn splits(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("Place of the joint, and coupling terms");
    let bar = bar();
    let truth = bar.tip_compliance();
    let weight = bar.own_weight(G) + BALL * G * truth[(2, 2)];
    let f1 = [bar.bending_hz(bar.EI_z, ROTARY[0], BALL, 1)[0], bar.bending_hz(bar.EI_y, ROTARY[1], BALL, 1)[0]];
    let mut table = Table::new(
        "Two parts, joint at x = s. Error of the end's compliance (six loads) with the full 6x6 and with its diagonal alone (plain springs); \
         sag of the end under bar and ball, first frequency sideways and upwards, against closed forms.",
        &["s/l", "end loads, 6x6", "end loads, diagonal", "sag", "f_1 sideways", "f_1 upwards"],
    );
    let (mut worst, mut curves) = (0.0f64, vec![Vec::new(); 4]);
    let fractions = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
    for fraction in fractions {
        let mut robot = robot.clone();
        let link = &mut robot.flexible[0];
        if let Some(beam) = &mut link.beam {
            beam.split_fraction = fraction;
            link.flexible.reduced = beam.reduce()?;
        }
        let light = weightless(robot.clone());
        let C = Rig::new(&light, &parts(2), None)?.compliance(&small_loads(&truth), Rig::statics)?;
        let mut uncoupled = light.clone();
        uncoupled.flexible[0].flexible.coupling = false;
        let D = Rig::new(&uncoupled, &parts(2), None)?.compliance(&small_loads(&truth), Rig::statics)?;
        let heavy = Rig::new(&robot, &parts(2), None)?;
        let sag = -heavy.statics(&Vector6::zeros())?[2];
        let [side, up] = heavy.bending_hz();
        let errors = [
            compliance_error(&C, &truth),
            compliance_error(&D, &truth),
            sag / weight - 1.0,
            nth(&side, 0) / f1[0] - 1.0,
            nth(&up, 0) / f1[1] - 1.0,
        ];
        worst = larger(worst, errors[0]);
        let mut row = vec![fixed(fraction, 1), error(errors[0]), error(errors[1])];
        row.extend(errors[2..].iter().map(|e| signed(*e)));
        table.rows.push(row);
        for (curve, e) in curves.iter_mut().zip(&errors[1..]) {
            curve.push(100.0 * e);
        }
    }
    case.table(table);
    case.claim(
        "end loads, joint anywhere between 0.1 and 0.9 of the length",
        "closed form",
        worst,
        Bound::AtMost(1e-6),
    );
    let plain = curves[0].iter().copied().fold(f64::INFINITY, f64::min);
    let most = curves[0].iter().copied().worst();
    case.claim(
        "plain springs (no coupling terms), worst place of the joint: the effect must show",
        "closed form",
        1e-2 * most,
        Bound::AtLeast(0.1),
    );
    case.text(format!(
        "At mid length, the elastic centre of a uniform bar, the 6x6 is diagonal and nothing is lost by plain springs ({:.2} %); a joint anywhere else \
         needs the coupling terms. Statics under end loads do not care where the joint is, sag and frequencies do: each place gives the \
         masses another lever.",
        plain.abs()
    ));
    let names = ["end loads, no coupling", "sag", "f_1 sideways", "f_1 upwards"];
    let curves = names.iter().zip(curves).map(|(name, y)| PlotCurve {
        name: (*name).into(),
        look: CurveLook::Marked,
        x: fractions.to_vec(),
        y,
    });
    case.figure(Figure {
        name: "one-beam-split".into(),
        caption: "Two parts: error over the place of the joint".into(),
        x_label: "s/l".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "error [%]".into(), logarithmic: false, legend: true, curves: curves.collect() }],
    });
    Ok(())
}

/// Sag under the bar's own weight and frequencies over the number of parts and modes.
fn weight_and_frequencies(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("Own weight and frequencies: how many parts, how many modes");
    let bar = bar();
    let mut bare = robot.clone();
    without_ball(&mut bare);
    let sag = bar.own_weight(G);
    let side = bar.bending_hz(bar.EI_z, ROTARY[0], 0.0, 2);
    let up = bar.bending_hz(bar.EI_y, ROTARY[1], 0.0, 2);
    let mut table = Table::new(
        format!(
            "Bar without the ball. Truth: sag q l^4/(8 EI) = {:.5} mm; frequencies of the clamped beam with the rotary inertia of its section \
             (Rayleigh): sideways {:.4}, {:.3} Hz, upwards {:.4}, {:.3} Hz.",
            1e3 * sag,
            side[0],
            side[1],
            up[0],
            up[1]
        ),
        &["model", "elastic coordinates", "sag", "f_1 sideways", "f_1 upwards", "f_2 sideways", "f_2 upwards"],
    );
    let models: Vec<(String, flexarm::Modelling)> =
        [2, 3, 5, 9, 17]
            .map(|n| (format!("{n} parts"), parts(n)))
            .into_iter()
            .chain([0, 2, 6, 12].map(|m| {
                (if m == 0 { "modal, no modes (Guyan)".into() } else { format!("modal, {m} modes") }, modal(m))
            }))
            .collect();
    let (mut modal_sag, mut many_modes, mut many_parts) = (0.0f64, f64::NAN, f64::NAN);
    let mut sags = Vec::new();
    for (name, modelling) in &models {
        let rig = Rig::new(&bare, modelling, None)?;
        let found = -rig.statics(&Vector6::zeros())?[2] / sag - 1.0;
        let found_hz = rig.bending_hz();
        let errors: Vec<f64> = (0..2)
            .flat_map(|k| [(&found_hz[0], &side), (&found_hz[1], &up)].map(|(f, truth)| nth(f, k) / truth[k] - 1.0))
            .collect();
        let mut row = vec![word(name), fixed(rig.arm.model.n_elastic() as f64, 0), signed(found)];
        row.extend(errors.iter().map(|e| signed(*e)));
        if *name == "modal, 12 modes" {
            many_modes = errors.iter().copied().worst();
        }
        if *name == "17 parts" {
            many_parts = errors[..2].iter().copied().worst();
        }
        table.rows.push(row);
        if name.starts_with("modal") {
            modal_sag = larger(modal_sag, found.abs());
        } else {
            sags.push(found.abs());
        }
    }
    case.table(table);
    case.claim("own-weight sag, modal link with any number of modes", "closed form", modal_sag, Bound::AtMost(1e-6));
    case.claim("own-weight sag, two parts: what they do not give exactly", "closed form", sags[0], Bound::AtMost(0.17));
    case.claim("own-weight sag, 17 parts", "closed form", sags[4], Bound::AtMost(1e-3));
    case.claim("first two frequencies in both planes, modal, 12 modes", "closed form", many_modes, Bound::AtMost(3e-4));
    case.claim("first frequency in both planes, 17 parts", "closed form", many_parts, Bound::AtMost(3e-4));
    case.text(
        "Two parts carry the weight at two points instead of along the bar: one sixth of the own-weight sag is missing. The error falls with the square \
         of the length of a part. Modal links have it exactly with any number of modes, because the static shape of the end is among their coordinates \
         and weight acts on the full mass.",
    );
    Ok(())
}

/// Ring-down: error over the step.
fn steps(case: &mut Case, robot: &Robot, quick: bool) -> Result<(), Error> {
    case.heading("Step size");
    let duration = 0.5;
    // The same damping for all: stiffness-proportional, 3 % of the first mode.
    let mut robot = robot.clone();
    let first = nth(&Rig::new(&robot, &parts(2), None)?.bending_hz()[1], 0);
    let beta = 2.0 * 0.03 / (std::f64::consts::TAU * first);
    robot.flexible[0].damping = Damping::StiffnessProportional(beta);
    let rig = Rig::new(&robot, &parts(2), None)?;
    // A multiple of every step; the truth is looked at more often, so that its peak is one.
    let every: f64 = 10e-3;
    let fine = rig.path(StepperKind::Reference(ReferenceSettings::new(1e-10)), 5e-4, 5e-4, duration)?;
    let peak = fine.iter().map(|u| u.norm()).worst();
    let stride = (every / 5e-4).round() as usize;
    let truth: Vec<Vector3<f64>> = fine.iter().step_by(stride).copied().collect();
    let steps: &[f64] = if quick { &[1e-3, 0.5e-3] } else { &[5e-3, 2e-3, 1e-3, 0.5e-3, 0.2e-3, 0.1e-3] };
    let source = StepperKind::Spook(SpookSettings { form: ConstraintForm::Local, preset: SpookPreset::Source });
    let kinds = [
        ("spring-damper, generalised-alpha", ALPHA),
        ("spring-damper, RK4", StepperKind::Rk4),
        ("compliant constraints, local", spook(ConstraintForm::Local)),
        ("compliant constraints, global", spook(ConstraintForm::Global)),
        ("compliant constraints, preset `source`", source),
    ];
    let mut table = Table::new(
        format!(
            "Bar and ball let go undeformed, {duration} s of ringing up and down ({first:.2} Hz, damping 3 % of it, proportional to stiffness). Largest error of \
             the end every 10 ms, over the largest deflection ({:.4} mm). Truth: the same two-part model by the stepper with error control, tolerance 1e-10.",
            1e3 * peak
        ),
        &["stepper"],
    );
    table.columns.extend(steps.iter().map(|h| format!("h = {} ms", 1e3 * h)));
    let mut curves = Vec::new();
    for (name, kind) in kinds {
        let mut errors = Vec::new();
        for &h in steps {
            // The explicit stepper refuses steps beyond its limit.
            let found = rig
                .path(kind, h, every, duration)
                .map(|path| path.iter().zip(&truth).map(|(a, b)| (a - b).norm()).worst() / peak);
            match (found, kind) {
                (Ok(e), _) => errors.push(e),
                (Err(_), StepperKind::Rk4) => errors.push(f64::NAN),
                (Err(e), _) => return Err(e),
            }
        }
        let mut row = vec![word(name)];
        row.extend(errors.iter().map(|e| error(*e)));
        table.rows.push(row);
        if name.ends_with("alpha") || name.ends_with(", local") {
            let at = steps.iter().position(|h| *h == 1e-3).map_or(f64::NAN, |k| errors[k]);
            let bound = if name.ends_with("alpha") { 2e-3 } else { 0.05 };
            case.claim(format!("ring-down, {name}, 1 ms"), "stepper with error control", at, Bound::AtMost(bound));
        }
        let (x, y) = (steps.iter().map(|h| 1e3 * h).collect(), errors);
        // Local and global lie on each other here.
        let look = if name.ends_with("global") { CurveLook::Dashed } else { CurveLook::Marked };
        curves.push(PlotCurve { name: name.replace('`', ""), look, x, y });
    }
    case.table(table);
    case.text(
        "\"-\": beyond the stability limit of the explicit stepper, which is refused. The preset `source` ties the damping to the step (τ = 2h), so it \
         does not converge to this motion at all; the exact form does, with first order.",
    );
    case.figure(Figure {
        name: "one-beam-steps".into(),
        caption: "Ring-down of the bar: error over the step".into(),
        x_label: "step [ms]".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "error / peak".into(), logarithmic: true, legend: true, curves }],
    });
    Ok(())
}

/// A spin-up: modal links, whose velocity terms are integrals over shapes, against chains of rigid bodies, which have none of them.
fn fast_motion(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("In fast motion");
    const SPEED: f64 = 30.0;
    const TIME: f64 = 1.0;
    let turn = |t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
        let phase = std::f64::consts::TAU * t / TIME;
        let a = TIME / std::f64::consts::TAU;
        q[0] = SPEED / TIME * (0.5 * t * t + a * a * (phase.cos() - 1.0));
        qdot[0] = SPEED / TIME * (t - a * phase.sin());
        qddot[0] = SPEED / TIME * (1.0 - phase.cos());
    };
    let path = |modelling: Modelling, stiffening: bool| {
        tool_path(robot, &modelling, stiffening, Arc::new(MotionFn(turn)), Start::Equilibrium, (5e-4, 2000))
    };
    let (truth, rigid) =
        (path(parts(17), false)?, path(Modelling { links: LinkModel::Rigid, ..Modelling::default() }, false)?);
    // In all, along the undeformed bar, and across it.
    let apart = |path: &[Vector3<f64>]| -> [f64; 3] {
        let parted = path.iter().zip(&truth).zip(&rigid).map(|((a, b), r)| {
            let (d, along) = (a - b, r.normalize());
            [d.norm(), d.dot(&along).abs(), (d - along * d.dot(&along)).norm()]
        });
        let most = parted.reduce(|a, b| std::array::from_fn(|i| larger(a[i], b[i])));
        most.unwrap_or([f64::NAN; 3])
    };
    let [peak, ..] = apart(&rigid);
    let mut table = Table::new(
        format!(
            "The joint spins up to {SPEED} rad/s in {TIME} s (`q'' = (w/T)(1 - cos 2πt/T)`), bar and ball, damping proportional to stiffness (0.5 ms), generalised-alpha at 0.5 ms: largest distance of the end from that of 17 parts, over their \
             largest deflection of {:.3} mm; in all, along the undeformed bar, and across it.",
            1e3 * peak
        ),
        &["model", "Δ", "along", "across"],
    );
    let models = [
        ("2 parts", parts(2), false),
        ("5 parts", parts(5), false),
        ("9 parts", parts(9), false),
        ("modal, 6 modes", modal(6), false),
        ("modal, 6 modes, stiffness by load", modal(6), true),
    ];
    for (name, modelling, stiffening) in models {
        let found = apart(&path(modelling, stiffening)?).map(|d| d / peak);
        table.rows.push(std::iter::once(word(name)).chain(found.map(error)).collect());
        if stiffening {
            case.claim(
                format!("spin-up, {name}, across the bar"),
                "chain of 17 rigid parts",
                found[2],
                Bound::AtMost(1e-3),
            );
        }
    }
    case.table(table);
    case.text(format!(
        "A modal link turns in its frame with centrifugal integrals over its shapes; a chain is rigid bodies and springs, and knows nothing of them. That both move alike checks these terms (case 2 has Coriolis forces). Without stiffness by load a modal link \
         is too soft when it spins: centrifugal force pulls the bar straight. With it, what is left is along the bar: the end of a modal link moves straight across, and misses the shortening 3/5 w²/l of a bent bar, {} of the peak here. Rotating beams against a \
         geometrically exact beam: [theory.md](theory.md), section 11.",
        bare_error(0.6 * peak / bar().l)
    ));
    Ok(())
}

/// A frequency of a list by its number; a model with few coordinates may not have it.
fn nth(hz: &[f64], k: usize) -> f64 {
    hz.get(k).copied().unwrap_or(f64::NAN)
}

/// Takes the ball off.
fn without_ball(robot: &mut Robot) {
    for link in robot.rigid.links.iter_mut().filter(|link| link.name == "tip") {
        link.inertia = None::<LinkInertia>;
    }
}
