//! Three beams with right-angle corners: every load bends and twists some of them.

use std::sync::Arc;

use flexarm::{LinkModel, Modelling, Robot, Start, StepperKind};
use flexarm_draw::{CurveLook, Panel, PlotCurve};
use flexarm_fem::element::Quadrature;
use flexarm_fem::reduction::Tie;
use flexarm_fem::{Material, UnitSystem};
use flexarm_stepping::{Damping, MotionFn, ReferenceSettings};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::Error;
use crate::Pace;
use crate::bench::{
    ALPHA, Bench, LOADS, LUMPED, Rig, Worst, column_error, compliance_error, damped, larger, modal, parts, place,
    small_loads, tool_path, weight_response, weightless,
};
use crate::meshed::{self, Meshed};
use crate::page::{Bound, Case, Figure, Table, bare_error, digits, error, fixed, signed, word};
use crate::textbook::{Stiffness, at_lever, hollow_rectangle_torsion, rectangle_torsion, turned};

const ROBOT: &str = "robots/three_beams/robot.toml";
const MESH: &str = "robots/three_beams/mesh.toml";
const G: f64 = 9.81;
const E: f64 = 70e9;
const NU: f64 = 0.33;
const RHO: f64 = 2700.0;

/// A beam of the arm at q = 0, world axes.
struct Member {
    name: &'static str,
    section: Stiffness,
    /// Axes of the beam (along it, y, z of the section) as columns.
    R: Matrix3<f64>,
    /// Its far end.
    end: Vector3<f64>,
}

/// The beams of `robots/three_beams/README.md`.
fn members() -> [Member; 3] {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let tip = Vector3::new(0.6, 0.4, 0.8);
    [
        Member { name: "tube", section: tube(0.8), R: Matrix3::from_columns(&[z, x, y]), end: 0.8 * z },
        Member { name: "box", section: hollow_box(0.6), R: Matrix3::identity(), end: 0.6 * x + 0.8 * z },
        Member { name: "rectangle", section: rectangle(0.4), R: Matrix3::from_columns(&[y, -x, z]), end: tip },
    ]
}

fn section(l: f64, area: f64, I: [f64; 2], J: f64, kA: [f64; 2]) -> Stiffness {
    let shear = E / (2.0 * (1.0 + NU));
    let kGA = kA.map(|kA| shear * kA);
    Stiffness { l, EA: E * area, EI_y: E * I[0], EI_z: E * I[1], GJ: shear * J, kGA, mu: RHO * area }
}

/// 60 mm outside, wall 3 mm. Cowper's factor of the hollow circle.
fn tube(l: f64) -> Stiffness {
    use std::f64::consts::PI;
    let (outer, inner) = (0.03f64, 0.027f64);
    let area = PI * (outer.powi(2) - inner.powi(2));
    let I = PI * (outer.powi(4) - inner.powi(4)) / 4.0;
    let m2 = (inner / outer).powi(2);
    let s = (1.0 + m2).powi(2);
    let k = 6.0 * (1.0 + NU) * s / ((7.0 + 6.0 * NU) * s + (20.0 + 12.0 * NU) * m2);
    section(l, area, [I; 2], 2.0 * I, [k * area; 2])
}

/// 30 mm wide (y), 50 mm high (z), wall 3 mm. Bredt's torsion on the midline, Cowper's factor of the thin-walled box.
fn hollow_box(l: f64) -> Stiffness {
    let (b, h, t) = (0.03f64, 0.05f64, 0.003f64);
    let (bi, hi) = (b - 2.0 * t, h - 2.0 * t);
    let I = [(b * h.powi(3) - bi * hi.powi(3)) / 12.0, (h * b.powi(3) - hi * bi.powi(3)) / 12.0];
    let (bm, hm) = (b - t, h - t);
    let J = 2.0 * t * (bm * hm).powi(2) / (bm + hm);
    section(l, b * h - bi * hi, I, J, [shear_area(bm, hm, t), shear_area(hm, bm, t)])
}

/// 30 mm wide (y), 20 mm high (z). Cowper's factor of the rectangle.
fn rectangle(l: f64) -> Stiffness {
    let (b, h) = (0.03f64, 0.02f64);
    let kA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * b * h;
    section(l, b * h, [b * h.powi(3) / 12.0, h * b.powi(3) / 12.0], rectangle_torsion(b, h), [kA; 2])
}

/// Compliance of the tip: each beam as a cantilever in world axes, its end carried to the tip by a lever.
fn tip_compliance() -> Matrix6<f64> {
    let members = members();
    let tip = members[2].end;
    members.iter().map(|m| at_lever(&turned(&m.section.tip_compliance(), &m.R), &(tip - m.end))).sum()
}

/// The case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    let mut case = Case::new("three-beams", "2. Three beams");
    case.text(
        "`robots/three_beams`: three aluminium beams joined at right angles, a tube of 0.8 m upwards, a box of 0.6 m forwards (x), a rectangle of 0.4 m sideways (y), \
         a ball of 1 kg at the tip (0.6, 0.4, 0.8) m; the joint at the base is held at 0. Every load at the tip bends and twists some of them, and no entry of a beam \
         reaches the tip without a turn and a lever. World axes, z upwards; Timoshenko's theory. By hand: `flexarm statics three_beams --wrench 0,0,10`, `flexarm compare three_beams`.",
    );
    let robot = bench.robot(ROBOT)?;
    let meshed = bench.robot(MESH)?;
    tip_loads(&mut case, &robot)?;
    meshes(&mut case, bench, &meshed)?;
    if !bench.quick {
        sections(&mut case, bench, &meshed)?;
    }
    ring_down(&mut case, &robot, bench.quick)?;
    whirl(&mut case, &robot)?;
    Ok(case)
}

/// Compliance of the tip by every method: lumped links in time, chains and modal links by Newton's method.
fn by_every_method(
    robot: &Robot,
    truth: &Matrix6<f64>,
    others: &[(&str, Modelling)],
) -> Result<Vec<(String, Matrix6<f64>)>, Error> {
    let (robot, loads) = (damped(weightless(robot.clone())), small_loads(truth));
    let two = Rig::new(&robot, &parts(2), None)?;
    let mut methods = Vec::new();
    for (name, kind) in LUMPED {
        let C = two.compliance(&loads, |rig, wrench| rig.settled(wrench, kind, 2e-3))?;
        methods.push((format!("{name}, 2 parts"), C));
    }
    for (name, modelling) in others {
        let rig = Rig::new(&robot, modelling, None)?;
        methods.push(((*name).to_owned(), rig.compliance(&loads, Rig::statics)?));
    }
    Ok(methods)
}

/// A table of the error of each method under each load, and a claim for each.
fn compliance_table(case: &mut Case, mut table: Table, truth: &Matrix6<f64>, methods: &[(String, Matrix6<f64>)]) {
    table.columns.extend(methods.iter().map(|(name, _)| name.clone()));
    for (row, j) in table.rows.iter_mut().zip(0..6) {
        row.extend(methods.iter().map(|(_, C)| error(column_error(C, truth, j))));
    }
    case.table(table);
}

/// Six loads at the tip, each method against the closed form.
fn tip_loads(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("Six loads at the tip");
    let truth = tip_compliance();
    let methods = by_every_method(robot, &truth, &[("5 parts", parts(5)), ("modal, 6 modes", modal(6))])?;
    let mut table = Table::new(
        "Motion of the tip along each load, per unit of it, by the sum over the beams `Ad_k R_k C_k R_kᵀ Ad_kᵀ` of textbook cantilevers C_k (Timoshenko; factors of shear by \
         Cowper, torsion of the box by Bredt), and what each beam has in it; then the error of each method: the largest of the six components of the tip's motion, over \
         `sqrt(C_ii C_jj)`. Compliant constraints and spring-damper run in time from the undeformed arm until they rest, loads that move the tip by 10 µm or 10 µrad, up and down.",
        &["load", "closed form [µm, µrad per N, N m]", "tube", "box", "rectangle"],
    );
    let members = members();
    for j in 0..6 {
        let mut row = vec![word(LOADS[j]), digits(1e6 * truth[(j, j)], 6)];
        for m in &members {
            let C = at_lever(&turned(&m.section.tip_compliance(), &m.R), &(members[2].end - m.end));
            row.push(word(format!("{:.1} %", 100.0 * C[(j, j)] / truth[(j, j)])));
        }
        table.rows.push(row);
    }
    compliance_table(case, table, &truth, &methods);
    for (name, C) in &methods {
        let worst = compliance_error(C, &truth);
        case.claim(format!("loads at the tip, {name}"), "closed form", worst, Bound::AtMost(1e-7));
    }
    Ok(())
}

/// The same arm from meshes, against the mesh of the whole arm in two other programs.
fn meshes(case: &mut Case, bench: &Bench, robot: &Robot) -> Result<(), Error> {
    case.heading("The same arm from meshes, against two other programs");
    let calculix = bench.stored("three_beams_calculix.json")?;
    let ngsolve = bench.stored("three_beams_ngsolve.json")?;
    case.text(format!(
        "`robots/three_beams/mesh.toml`: each beam is meshed with HEX20 and reduced on its own, ends tied rigidly, ten modes. The other programs solve the whole arm as one mesh of \
         the same elements with the same ties. Truth: {}, which integrates to rounding, as flexarm does; {} takes 3 x 3 x 3 points, which are not exact in the curved elements of the tube.",
        ngsolve.provenance(),
        calculix.provenance()
    ));
    let truth = ngsolve.matrix6("C_tip")?;
    let theirs = calculix.matrix6("C_tip")?;
    let others = [("5 parts", parts(5)), ("modal, 0 modes", modal(0)), ("modal, 10 modes", modal(10))];
    let methods = by_every_method(robot, &truth, &others)?;
    let mut table = Table::new(
        "Motion of the tip along each load, per unit of it, and the error of each method, all as above; truth: NGSolve.",
        &["load", "NGSolve [µm, µrad per N, N m]", "CalculiX"],
    );
    for j in 0..6 {
        let row = vec![word(LOADS[j]), digits(1e6 * truth[(j, j)], 6), error(column_error(&theirs, &truth, j))];
        table.rows.push(row);
    }
    compliance_table(case, table, &truth, &methods);
    let by_rule = |quadrature: Quadrature| -> Result<Matrix6<f64>, Error> {
        let tube = Meshed::read_with(
            bench,
            "robots/three_beams/fe/beam_1.msh.gz",
            UnitSystem::SI,
            Material::ALUMINIUM,
            quadrature,
        )?;
        tube.condensed([Tie::Rigid; 2], Vector3::zeros(), robot.flexible[0].flexible.reduced.X_LB.translation.vector)?
            .compliance()
    };
    // Two more meshes to assemble.
    if !bench.quick {
        let rule = compliance_error(&by_rule(Quadrature::Calculix)?, &by_rule(Quadrature::Exact)?);
        case.text(format!(
            "What is left is rounding and a rule. The stiffness of thin walls in double precision holds eight to nine digits of such a compliance (the stored files say so of their own; the tube's matrix has a condition number of 2e7). \
             With CalculiX's rule the tube alone changes by {} here.",
            bare_error(rule)
        ));
    }
    for (name, C) in &methods {
        let worst = compliance_error(C, &truth);
        case.claim(format!("meshed arm, loads at the tip, {name}"), "NGSolve, whole mesh", worst, Bound::AtMost(1e-7));
    }
    case.claim(
        "meshed arm, loads at the tip: CalculiX against NGSolve",
        "NGSolve, whole mesh",
        compliance_error(&theirs, &truth),
        Bound::AtMost(1e-7),
    );

    let sag = ngsolve.vector6("sag")?;
    let hz = ngsolve.numbers("frequencies_hz")?;
    let mut table = Table::new(
        format!(
            "Sag of the tip under the weight of beams and ball, linear (a hundredth of the weight, up and down): error of the shift and of the rotation as vectors over their sizes, {:.5} mm \
             and {:.5} mrad; frequencies with the ball, without the stiffness of weight: {} Hz. Truth: NGSolve.",
            1e3 * sag.fixed_rows::<3>(0).norm(),
            1e3 * sag.fixed_rows::<3>(3).norm(),
            hz.iter().map(|f| format!("{f:.4}")).collect::<Vec<_>>().join(", ")
        ),
        &["model", "elastic coordinates", "sag, shift", "sag, rotation"],
    );
    table.columns.extend((1..=hz.len()).map(|k| format!("f_{k}")));
    let parted = |u: &Vector6<f64>| {
        let error = |from: usize| {
            let truth = sag.fixed_rows::<3>(from);
            (u.fixed_rows::<3>(from) - truth).norm() / truth.norm()
        };
        [error(0), error(3)]
    };
    let mut row = vec![word("CalculiX"), word("")];
    row.extend(parted(&calculix.vector6("sag")?).map(error));
    row.extend(calculix.numbers("frequencies_hz")?.iter().zip(&hz).map(|(f, truth)| signed(f / truth - 1.0)));
    table.rows.push(row);
    let models = [
        ("2 parts", parts(2)),
        ("3 parts", parts(3)),
        ("5 parts", parts(5)),
        ("modal, 0 modes", modal(0)),
        ("modal, 5 modes", modal(5)),
        ("modal, 10 modes", modal(10)),
    ];
    let (mut modal_sag, mut sags, mut firsts, mut ten) = (0.0f64, Vec::new(), Vec::new(), 0.0f64);
    let mut shares = [Vec::new(), Vec::new()];
    let mut curves = Vec::new();
    for (name, modelling) in &models {
        let u = weight_response(robot, modelling, None, &Vector3::new(0.0, 0.0, -G))?;
        let rig = Rig::new(&weightless(robot.clone()), modelling, None)?;
        let f = rig.arm.modes.frequencies_hz();
        let errors: Vec<f64> = f.iter().zip(&hz).map(|(f, truth)| f / truth - 1.0).collect();
        let shift = parted(&u);
        let mut row = vec![word(*name), fixed(rig.arm.model.n_elastic() as f64, 0)];
        row.extend(shift.map(error));
        row.extend(errors.iter().map(|e| signed(*e)));
        table.rows.push(row);
        if name.starts_with("modal") {
            modal_sag = larger(modal_sag, shift.iter().copied().worst());
        } else {
            sags.push(shift[0]);
            firsts.push(errors[..4].iter().copied().worst());
        }
        if name.ends_with("10 modes") {
            ten = errors.iter().copied().worst();
        }
        if name.ends_with("10 modes") {
            shares = [ball_shares(&rig, hz.len()), inner_shares(&rig, hz.len())];
        }
        let (x, y) = (1..=errors.len()).map(|k| k as f64).zip(errors.iter().map(|e| e.abs())).unzip();
        curves.push(PlotCurve { name: (*name).into(), look: CurveLook::Marked, x, y });
    }
    for (name, shares) in
        ["ball's share of the kinetic energy", "share of the strain energy between held ends"].iter().zip(&shares)
    {
        let mut row = vec![word(*name), word(""), word(""), word("")];
        row.extend(shares.iter().map(|share| word(format!("{:.0} %", 100.0 * share))));
        table.rows.push(row);
    }
    case.table(table);
    case.text(
        "Sag: two parts carry the weight of a beam at two points; the ball, which is most of the load, is carried exactly, so less is missing than in a bare bar, and the rest falls with the square of the length of a part. \
         Frequencies: the last rows say, by modal links with ten modes, how much the ball moves in a mode, and how much of the strain energy is in shapes whose ends are held. In f_1 to f_3 the ball moves, and any model has them. \
         In f_7 and f_8 the beams bend between their ends: two parts have one joint in each beam for that and come 30 % too low, a modal link without modes has static shapes alone and comes too high, from above as in \
         any Ritz method. Modal links have the sag exactly with any number of modes.",
    );
    case.claim("meshed arm, sag, modal links with any number of modes", "NGSolve", modal_sag, Bound::AtMost(1e-7));
    case.claim("meshed arm, sag, two parts", "NGSolve", sags[0], Bound::AtMost(0.015));
    case.claim("meshed arm, sag, five parts", "NGSolve", sags[2], Bound::AtMost(1e-3));
    case.claim("meshed arm, first four frequencies, two parts", "NGSolve", firsts[0], Bound::AtMost(0.014));
    case.claim("meshed arm, eight frequencies, modal, 10 modes", "NGSolve", ten, Bound::AtMost(1.1e-4));
    case.figure(Figure {
        name: "three-beams-frequencies".into(),
        caption: "Three beams from meshes: error of each frequency, by model".into(),
        x_label: "frequency number".into(),
        logarithmic_x: false,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    });
    Ok(())
}

/// How much of the kinetic energy of each mode the ball (1 kg) has, its rotation left out.
fn ball_shares(rig: &Rig, count: usize) -> Vec<f64> {
    const SMALL: f64 = 1e-6;
    let shift = |k: usize| {
        let e = rig.arm.modes.shapes.column(k) * SMALL;
        (place(&rig.arm, &rig.frame, &e).translation.vector - rig.X_WF.translation.vector) / SMALL
    };
    // Shapes have unit modal mass.
    (0..count).map(|k| shift(k).norm_squared()).collect()
}

/// How much of the strain energy of each mode is in coordinates after the six of the end of each modal link.
fn inner_shares(rig: &Rig, count: usize) -> Vec<f64> {
    let K = rig.arm.stiffness();
    let share = |k: usize| {
        let e = rig.arm.modes.shapes.column(k).into_owned();
        let mut inner = e.clone();
        for element in &rig.arm.elements {
            inner.rows_mut(rig.arm.offset(element), 6).fill(0.0);
        }
        inner.dot(&(&K * &inner)) / e.dot(&(&K * &e))
    };
    (0..count).map(share).collect()
}

/// How far the sections of beam theory are from the meshes, beam by beam.
fn sections(case: &mut Case, bench: &Bench, robot: &Robot) -> Result<(), Error> {
    case.heading("Beam theory against the meshes");
    // As many as there are elements along each beam.
    const SLICES: usize = 20;
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
    let mut middles = Table::new(
        "The same meshes, stiffness of the section in the middle tenth of the length (strain energy of two layers of elements under end loads), over that of beam theory, less one.",
        &["beam", "EA", "EI_y", "EI_z", "GJ", "kGA_y", "kGA_z", "mass"],
    );
    let (mut middle, mut box_torsion, mut tube_torsion) = (0.0f64, f64::NAN, f64::NAN);
    let mut filed = 0.0f64;
    for (k, (member, link)) in members().iter().zip(&robot.flexible).enumerate() {
        let theory = member.section.tip_compliance();
        let reduced = &link.flexible.reduced;
        let mesh = Meshed::read(bench, &format!("robots/three_beams/fe/beam_{}.msh.gz", k + 1), UnitSystem::SI)?;
        // The first beam stands along z of its link, the others lie along x.
        let R = if k == 0 { member.R.transpose() } else { Matrix3::identity() };
        let p_B = reduced.X_LB.translation.vector;
        for tie in [Tie::Rigid, Tie::Distributing] {
            let condensed = mesh.condensed([tie; 2], Vector3::zeros(), p_B)?;
            let C = condensed.compliance()?;
            let errors: Vec<f64> = {
                let C = turned(&C, &R);
                (0..6).map(|i| C[(i, i)] / theory[(i, i)] - 1.0).collect()
            };
            let mut row = vec![word(member.name), word(tie.name())];
            row.extend(errors.iter().map(|e| signed(*e)));
            ends.rows.push(row);
            if tie == Tie::Distributing {
                if member.name == "box" {
                    box_torsion = errors[3];
                }
                continue;
            }
            if member.name == "tube" {
                tube_torsion = errors[3].abs();
            }
            let known = meshed::inverse(&reduced.K_BB).map_or(f64::NAN, |known| compliance_error(&known, &C));
            filed = larger(filed, known);
            let slices = condensed.slices(&mesh, SLICES);
            let short: Matrix6<f64> = slices[SLICES / 2 - 1..=SLICES / 2].iter().sum();
            let c = turned(&at_lever(&short, &(-0.5 * p_B)), &R).diagonal();
            let d = 2.0 * member.section.l / SLICES as f64;
            let Stiffness { EA, EI_y, EI_z, GJ, kGA, mu, l } = member.section;
            // Two layers as a beam about their middle: l³/(12 EI) of bending besides shear.
            let shear = |yields: f64, turns: f64, kGA: f64| d / (yields - d * d / 12.0 * turns) / kGA - 1.0;
            let found = [
                d / c[0] / EA - 1.0,
                d / c[4] / EI_y - 1.0,
                d / c[5] / EI_z - 1.0,
                d / c[3] / GJ - 1.0,
                shear(c[1], c[5], kGA[0]),
                shear(c[2], c[4], kGA[1]),
                mesh.mass() / (mu * l) - 1.0,
            ];
            middle = larger(middle, found[..3].iter().copied().worst());
            let mut row = vec![word(member.name)];
            row.extend(found.iter().map(|e| signed(*e)));
            middles.rows.push(row);
        }
    }
    case.table(ends);
    case.table(middles);
    let (b, h, t): (f64, f64, f64) = (0.03, 0.05, 0.003);
    let bredt = 2.0 * t * ((b - t) * (h - t)).powi(2) / (b + h - 2.0 * t);
    let saint_venant = hollow_rectangle_torsion(b, h, t, 12) / bredt - 1.0;
    let along = [2.0 * t * b / shear_area(b - t, h - t, t) - 1.0, 2.0 * t * h / shear_area(h - t, b - t, t) - 1.0];
    case.text(format!(
        "Away from the ends the meshes are the beams of the textbook in stretch and bending (the tube's 9e-6 are its 24 curved elements, which do not contain the quadratic shape of Poisson's \
         contraction), and what differs has four causes. *Torsion of the box*: Bredt's formula leaves out the thickness of the wall and its corners; St. Venant's problem of this section, by finite \
         differences, is {:+.1} % above it. The rest, and the 0.7 % of the rectangle, is the mesh: one element through the wall, three by two in the bar. *Shear*: Cowper's factors compare mean displacements, \
         energy compares work (thin tube 0.53 against 0.50, bar 0.85 against 0.83); for the box his factor is that of thin walls, those across the force included (the walls along the force alone, as tables often have it, \
         would be {:+.0} and {:+.0} % stiffer, y and z). Shear is little of these compliances. *Rigid ties*: they keep the ends from contracting sideways and from warping, so the last half width at each end is stiffer; that is most of the 0.6 % in stretch and bending, \
         which falls with the length of a beam. *Ties by the mean*: all nodes of an end carry the same force, corner nodes too, and nothing keeps the end in shape. A torque so spread is not the shear flow of a box: \
         its section is pushed out of square, and that dies out only after a quarter of the length.",
        100.0 * saint_venant,
        100.0 * along[0],
        100.0 * along[1]
    ));
    case.claim("meshed beams, EA and EI in the middle", "beam theory", middle, Bound::AtMost(2e-5));
    case.claim("meshed tube in torsion, ends tied rigidly", "beam theory", tube_torsion, Bound::AtMost(1e-7));
    case.claim(
        "meshed box in torsion over beam theory, ends tied by the mean: an effect of the tie",
        "beam theory",
        box_torsion,
        Bound::AtLeast(0.1),
    );
    case.claim("files of the reduced beams: compliance", "the same meshes reduced here", filed, Bound::AtMost(1e-7));
    Ok(())
}

/// Area in shear of a thin-walled box after Cowper: walls of length `along` and `across` the force.
fn shear_area(along: f64, across: f64, wall: f64) -> f64 {
    let m = across / along;
    let still = 12.0 + m * (72.0 + m * (150.0 + 90.0 * m)) + 30.0 * m.powi(3) * (1.0 + m);
    let poisson = 11.0 + m * (66.0 + m * (135.0 + 90.0 * m)) + 10.0 * m.powi(3);
    20.0 * wall * (along + across) * (1.0 + NU) * (1.0 + 3.0 * m).powi(2) / (still + NU * poisson)
}

/// Largest distance of two paths.
fn apart(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).worst()
}

/// The arm as a sum of modes: angular frequency, damping ratio and part in the sag of each of the lowest ones, and the rest of the sag.
struct Ringing {
    modes: Vec<(f64, f64, Vector3<f64>)>,
    rest: Vector3<f64>,
}

impl Ringing {
    fn new(rig: &Rig, beta: f64, count: usize) -> Self {
        let modes = &rig.arm.modes;
        let e = &modes.equilibrium;
        let at = |e: &nalgebra::DVector<f64>| place(&rig.arm, &rig.frame, e).translation.vector;
        // The equilibrium in coordinates of the modes.
        let eta = modes.shapes.clone().lu().solve(e).unwrap_or_else(|| e * f64::NAN);
        let part = |k: usize| at(e) - at(&(e - modes.shapes.column(k) * eta[k]));
        let kept: Vec<_> = (0..count).map(|k| (modes.omega[k], 0.5 * beta * modes.omega[k], part(k))).collect();
        let sum: Vector3<f64> = kept.iter().map(|(_, _, u)| u).sum();
        Self { rest: at(e) - rig.X_WF.translation.vector - sum, modes: kept }
    }

    /// What compliant constraints make of it with steps of `h`, to second order: `ω (1 - ζ h ω/2 - (h ω)²/12)` from the recurrence of the
    /// theory page, section 4, on an oscillator; the decay stays.
    fn stepped(&self, h: f64) -> Self {
        let slower = |(w, zeta, u): &(f64, f64, Vector3<f64>)| {
            let factor = 1.0 - 0.5 * zeta * h * w - (h * w).powi(2) / 12.0;
            (w * factor, zeta / factor, *u)
        };
        Self { modes: self.modes.iter().map(slower).collect(), rest: self.rest }
    }

    /// Let go undeformed: with its frequencies and the parts in the sag of another.
    fn path(&self, shapes: &Self, every: f64, duration: f64) -> Vec<Vector3<f64>> {
        self.path_ahead(shapes, every, duration, 0.0)
    }

    /// The same, ahead by some time.
    fn path_ahead(&self, shapes: &Self, every: f64, duration: f64, ahead: f64) -> Vec<Vector3<f64>> {
        let at = |t: f64| -> Vector3<f64> {
            let swing = self.modes.iter().zip(&shapes.modes).map(|((w, zeta, _), (_, _, u))| {
                let root = (1.0 - zeta * zeta).sqrt();
                let (sin, cos) = (w * root * t).sin_cos();
                u * (1.0 - (-zeta * w * t).exp() * (cos + zeta / root * sin))
            });
            shapes.rest + swing.sum::<Vector3<f64>>()
        };
        (0..=(duration / every).round() as usize).map(|k| at(k as f64 * every + ahead)).collect()
    }
}

/// Let go under gravity: what the stepper costs, and what the model.
fn ring_down(case: &mut Case, robot: &Robot, quick: bool) -> Result<(), Error> {
    case.heading("Ring-down");
    let (duration, every) = (if quick { 0.2 } else { 1.0 }, 1e-3);
    let stiffened = |mut robot: Robot| {
        for link in &mut robot.flexible {
            link.choices.geometric = true;
        }
        robot
    };
    // The same damping of the material for all: proportional to stiffness, 3 % of the first mode.
    let first = Rig::new(robot, &modal(12), None)?.arm.modes.frequencies_hz()[0];
    let beta = 2.0 * 0.03 / (std::f64::consts::TAU * first);
    let mut robot = robot.clone();
    for link in &mut robot.flexible {
        link.damping = Damping::StiffnessProportional(beta);
    }
    let models = [
        ("modal, 12 modes, stiffness by load", Rig::new(&stiffened(robot.clone()), &modal(12), None)?),
        ("modal, 12 modes", Rig::new(&robot, &modal(12), None)?),
        ("2 parts", Rig::new(&robot, &parts(2), None)?),
        ("5 parts", Rig::new(&robot, &parts(5), None)?),
    ];
    let precise = StepperKind::Reference(ReferenceSettings::new(1e-9));
    let truths =
        models.iter().map(|(_, rig)| rig.path(precise, every, every, duration)).collect::<Result<Vec<_>, Error>>()?;
    let truth = &truths[0];
    let peak = truth.iter().map(|u| u.norm()).worst();
    let spook = |k: usize| LUMPED[k].1;
    let mut runs = vec![
        (2, "compliant constraints, local", spook(0), 1e-3),
        (2, "compliant constraints, global", spook(1), 1e-3),
        (2, "spring-damper", ALPHA, 1e-3),
        (3, "spring-damper", ALPHA, 1e-3),
        (1, "generalised-alpha", ALPHA, 1e-3),
    ];
    if !quick {
        runs.extend([
            (2, "compliant constraints, local", spook(0), 1e-4),
            (2, "compliant constraints, global", spook(1), 1e-4),
            (2, "spring-damper", ALPHA, 1e-4),
        ]);
    }
    let mut table = Table::new(
        format!(
            "The arm of beam theory let go undeformed under its weight, {duration} s, damping proportional to stiffness (3 % of the first mode, {first:.2} Hz, the same constant for all models). \
             Largest distance of the tip from where it should be, every ms, over the largest deflection ({:.4} mm). Truth of the method: modal links with 12 modes each and stiffness by load. Truth of the stepper: \
             its own model. Both by the stepper with error control, tolerance 1e-9. The last column is the distance of these two truths; x, y, z are the parts of the method's error.",
            1e3 * peak
        ),
        &["model", "stepper", "h [ms]", "method", "x", "y", "z", "stepper alone", "model alone"],
    );
    // Ten curves per panel would hide each other, and a point every 2 ms draws 100 Hz.
    let thin = 2;
    let times: Vec<f64> = (0..truth.len()).step_by(thin).map(|k| k as f64 * every).collect();
    let curve = |name: &str, look, y: &dyn Fn(usize) -> f64| PlotCurve {
        name: name.into(),
        look,
        x: times.clone(),
        y: (0..truth.len()).step_by(thin).map(y).collect(),
    };
    let mut panels: Vec<Panel> = ["x [mm]", "y [mm]", "z [mm]", "difference [% of peak]"]
        .iter()
        .map(|label| Panel { label: (*label).into(), logarithmic: false, legend: true, curves: Vec::new() })
        .collect();
    for (i, panel) in panels[..3].iter_mut().enumerate() {
        panel.curves.push(curve("modal, stepper with error control", CurveLook::Total, &|k| 1e3 * truth[k][i]));
    }
    let mut compliant = Vec::new();
    for (model, name, kind, h) in runs {
        let found = models[model].1.path(kind, h, every, duration)?;
        let axis = |i: usize| found.iter().zip(truth).map(|(a, b)| a[i] - b[i]).worst() / peak;
        let stepper = apart(&found, &truths[model]) / peak;
        let of_model = apart(&truths[model], truth) / peak;
        let mut row = vec![word(models[model].0), word(name), digits(1e3 * h, 1), error(apart(&found, truth) / peak)];
        row.extend([axis(0), axis(1), axis(2), stepper, of_model].map(error));
        table.rows.push(row);
        if h < 1e-3 {
            continue;
        }
        compliant.push(found.clone());
        let full = format!("{name}, {}", models[model].0);
        let bound = if model == 2 && name.starts_with("compliant") { 0.045 } else { 3e-4 };
        case.claim(
            format!("three beams, ring-down, {full}, 1 ms: stepper alone"),
            "stepper with error control",
            stepper,
            Bound::AtMost(bound),
        );
        if model != 1 {
            for (i, panel) in panels[..3].iter_mut().enumerate() {
                panel.curves.push(curve(&full, CurveLook::Plain, &|k| 1e3 * found[k][i]));
            }
            panels[3].curves.push(curve(&full, CurveLook::Plain, &|k| 100.0 * (found[k] - truth[k]).norm() / peak));
        }
    }
    case.table(table);
    case.claim(
        "three beams, ring-down, two parts: model alone",
        "modal links, 12 modes",
        apart(&truths[2], truth) / peak,
        Bound::AtMost(0.05),
    );
    case.claim(
        "three beams, ring-down, five parts: model alone",
        "modal links, 12 modes",
        apart(&truths[3], truth) / peak,
        Bound::AtMost(3e-3),
    );
    let [local, global] = [&compliant[0], &compliant[1]];
    causes(case, &models, &truths, [local, global], beta, every, peak);
    case.figure(Figure {
        name: "three-beams-ring-down".into(),
        caption: "Tip of the three beams, let go under gravity, and the distance of each method from modal links; steps of 1 ms".into(),
        x_label: "t [s]".into(),
        logarithmic_x: false,
        panels,
    });
    Ok(())
}

/// Why the models of a ring-down differ: frequencies and shares in the sag, each alone; and why compliant constraints do.
///
/// * `models`, `truths`: the model that is the truth first, and how each moves.
/// * `local`, `global`: two parts with compliant constraints and steps of `every`.
fn causes(
    case: &mut Case,
    models: &[(&str, Rig)],
    truths: &[Vec<Vector3<f64>>],
    [local, global]: [&[Vector3<f64>]; 2],
    beta: f64,
    every: f64,
    peak: f64,
) {
    const MODES: usize = 6;
    let duration = every * (truths[0].len() - 1) as f64;
    let base = Ringing::new(&models[0].1, beta, MODES);
    let linear = base.path(&base, every, duration);
    let mut table = Table::new(
        format!(
            "Why: the arm as a sum of its {MODES} lowest modes about the sag, each swinging in closed form `a_k (1 - exp(-ζωt) (cos ω_d t + ζω/ω_d sin ω_d t))`. For modal links with stiffness by load this sum is within {} \
             of the peak of the stepped motion. Frequencies of the other models over its frequencies; then the sum with their frequencies and its shares a_k of the sag, with their shares and its frequencies, and with both, \
             against its own, over the peak; last the distance of the stepped motions.",
            bare_error(apart(&linear, &truths[0]) / peak)
        ),
        &["model", "f_1", "f_2", "f_3", "f_4", "frequencies alone", "shares alone", "both", "stepped"],
    );
    for ((name, rig), truth) in models.iter().zip(truths).skip(1) {
        let other = Ringing::new(rig, beta, MODES);
        let both = other.path(&other, every, duration);
        let mut row = vec![word(*name)];
        row.extend(base.modes.iter().zip(&other.modes).take(4).map(|(a, b)| signed(b.0 / a.0 - 1.0)));
        let sums = [other.path(&base, every, duration), base.path(&other, every, duration)];
        row.extend(sums.iter().map(|sum| error(apart(sum, &linear) / peak)));
        row.push(error(apart(&both, &linear) / peak));
        row.push(error(apart(truth, &truths[0]) / peak));
        table.rows.push(row);
        if *name == "2 parts" {
            // What the sums do not explain of the difference of the motions.
            let left = (0..both.len()).map(|k| ((truth[k] - truths[0][k]) - (both[k] - linear[k])).norm());
            let left = left.worst() / peak;
            case.claim(
                "three beams, ring-down, two parts: what frequencies and shares of six modes do not explain",
                "stepped motions",
                left,
                Bound::AtMost(5e-4),
            );
        }
    }
    case.table(table);
    let two = Ringing::new(&models[2].1, beta, MODES);
    let alone = two.path(&two, every, duration);
    let late = two.path_ahead(&two, every, duration, 0.5 * every);
    let slow = two.stepped(every).path(&two, every, duration);
    let both = two.stepped(every).path_ahead(&two, every, duration, 0.5 * every);
    let left = (0..local.len()).map(|k| ((local[k] - truths[2][k]) - (both[k] - alone[k])).norm());
    let left = left.worst() / peak;
    case.text(format!(
        "*Model.* Two parts put a third of a per cent on the first two frequencies; the phase that this adds is most of the difference, which is largest after a third of a second, when damping begins to win. The rest is the sag, which two \
         parts miss by a little. Stiffness by load (weight turns with what bends) is in chains of parts by themselves and an option of modal links: without it their frequencies are 1e-4 higher. \
         *Stepper.* Compliant constraints at {} ms are off by {} of the peak, in two ways. Positions are half a step ahead (`x⁺ = x + h v⁺` from rest): {} in such a sum of modes. And damping taken at the \
         end of the step makes the frequency lower by ζhω/2, beside the second-order (hω)²/12 of the trapezoidal rule: {}; both together {}, and {} of the stepped motion is left. Local and global form differ by {} here, little, as they do with the size of the deflection.",
        1e3 * every,
        bare_error(apart(local, &truths[2]) / peak),
        bare_error(apart(&late, &alone) / peak),
        bare_error(apart(&slow, &alone) / peak),
        bare_error(apart(&both, &alone) / peak),
        bare_error(left),
        bare_error(apart(local, global) / peak)
    ));
    case.claim(
        "three beams, ring-down, compliant constraints, local, 1 ms: what half a step and the frequency do not explain",
        "stepped motions",
        left,
        Bound::AtMost(2.6e-3),
    );
}

/// Ringing while it turns: modal links, whose velocity terms are integrals over shapes, against chains of rigid bodies.
fn whirl(case: &mut Case, robot: &Robot) -> Result<(), Error> {
    case.heading("Ringing while it turns");
    const SPEEDS: [f64; 2] = [7.5, 15.0];
    let mut table = Table::new(
        "The joint turns steadily, and the arm is let go undeformed under its weight and the centrifugal force, 0.5 s, damping proportional to stiffness (0.5 ms), generalised-alpha at 1 ms: largest distance of the tip from that of 9 parts per \
         beam, over their largest deflection.",
        &["model"],
    );
    let models = [
        ("2 parts", parts(2), false),
        ("3 parts", parts(3), false),
        ("5 parts", parts(5), false),
        ("modal, 6 modes", modal(6), false),
        ("modal, 6 modes, stiffness by load", modal(6), true),
    ];
    table.rows = models.iter().map(|(name, ..)| vec![word(*name)]).collect();
    for (speed, bound) in SPEEDS.into_iter().zip([1.7e-3, 6e-3]) {
        let turn = move |t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
            (q[0], qdot[0], qddot[0]) = (speed * t, speed, 0.0);
        };
        let path = |modelling: Modelling, stiffening: bool| {
            tool_path(robot, &modelling, stiffening, Arc::new(MotionFn(turn)), Start::Undeformed, (1e-3, 500))
        };
        let (truth, rigid) =
            (path(parts(9), false)?, path(Modelling { links: LinkModel::Rigid, ..Modelling::default() }, false)?);
        let peak = apart(&rigid, &truth);
        table.columns.push(format!("{speed} rad/s, peak {:.2} mm", 1e3 * peak));
        for (row, (name, modelling, stiffening)) in table.rows.iter_mut().zip(models) {
            let found = apart(&path(modelling, stiffening)?, &truth) / peak;
            row.push(error(found));
            if stiffening {
                let text = format!("three beams, ringing at {speed} rad/s, {name}");
                case.claim(text, "chains of 9 rigid parts", found, Bound::AtMost(bound));
            }
        }
    }
    case.table(table);
    case.text(
        "Here beams carry beams, and all bend in space while the base turns: Coriolis and centrifugal terms of the modal links against rigid bodies that have none of them. What is left with stiffness by load goes with the deflection, so it is of second \
         order: the end of a modal link moves along its shapes, straight (case 1).",
    );
    Ok(())
}
