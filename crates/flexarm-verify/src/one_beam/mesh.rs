//! The bar as a mesh: own finite elements, CalculiX, beam theory, the reduced link; and loads so large that geometry counts.

use flexarm::Robot;
use flexarm_draw::{CurveLook, Panel, PlotCurve};
use flexarm_fem::UnitSystem;
use flexarm_fem::reduction::Tie;
use flexarm_fem::sparse::ModesWanted;
use nalgebra::{Matrix6, Vector3, Vector6};

use super::{G, bar, bar_with_shear, nth, without_ball};
use crate::Error;
use crate::bench::{
    Bench, LOADS, LUMPED, Rig, Stored, Worst, column_error, compliance_error, damped, larger, modal, parts,
    small_loads, weightless,
};
use crate::meshed::Meshed;
use crate::page::{Bound, Case, Figure, Table, digits, error, fixed, signed, word};

const MESH: &str = "robots/one_beam/fe/one_beam.msh";
const STORED: &str = "one_beam_calculix.json";

/// The bar as a mesh: own finite elements, CalculiX, beam theory, and the reduced link.
pub(super) fn mesh(case: &mut Case, bench: &Bench, meshed: &Robot) -> Result<(), Error> {
    case.heading("The bar as a mesh");
    let stored = bench.stored(STORED)?;
    case.text(format!(
        "`{MESH}`: 40 x 2 x 2 HEX20, both ends tied rigidly (RBE2) to the joints. Own elements and reduction here; {}; `robots/one_beam/mesh.toml` is the robot \
         whose link is reduced from it.",
        stored.provenance()
    ));
    let fe = Meshed::read(bench, MESH, UnitSystem::SI)?;
    let stations = [0.2, 0.4, 0.6];
    let mut interfaces = vec![
        fe.interface("A", Vector3::zeros(), Tie::Rigid)?,
        fe.interface("B", Vector3::new(0.8, 0.0, 0.0), Tie::Rigid)?,
    ];
    interfaces.extend(stations.map(|x| fe.section(x)));
    let condensation = fe.condense(&interfaces)?;
    let K = condensation.stiffness();
    let held = K.view((6, 6), (24, 24)).into_owned();
    let C = held.try_inverse().ok_or(Error::Mechanism { mesh: MESH })?;
    let C_BB = Matrix6::from_fn(|i, j| C[(i, j)]);
    let calculix = stored.matrix6("C_BB")?;

    let loads = small_loads(&C_BB);
    let still = damped(weightless(meshed.clone()));
    let two = Rig::new(&still, &parts(2), None)?;
    let mut methods: Vec<(String, Matrix6<f64>)> = Vec::new();
    for (name, kind) in LUMPED {
        methods.push((format!("{name}, 2 parts"), two.compliance(&loads, |rig, w| rig.settled(w, kind, 2e-3))?));
    }
    for (name, modelling) in [("9 parts", parts(9)), ("modal, 10 modes", modal(10))] {
        methods.push((name.into(), Rig::new(&still, &modelling, None)?.compliance(&loads, Rig::statics)?));
    }
    let (euler, timoshenko) = (bar().tip_compliance(), bar_with_shear().tip_compliance());
    let mut table = Table::new(
        "Six end loads: displacement of the end along the load per unit of it, own mesh; Euler-Bernoulli's and Timoshenko's beam against the mesh; CalculiX and each \
         method (robot of the reduced link) against the mesh, largest of six components over `sqrt(C_ii C_jj)`.",
        &["load", "mesh [µm, µrad]", "Euler-Bernoulli", "Timoshenko", "CalculiX"],
    );
    table.columns.extend(methods.iter().map(|(name, _)| name.clone()));
    for j in 0..6 {
        let own = C_BB[(j, j)];
        let mut row = vec![word(LOADS[j]), digits(1e6 * own, 6)];
        row.extend([euler, timoshenko].map(|C| signed(C[(j, j)] / own - 1.0)));
        row.push(error(column_error(&calculix, &C_BB, j)));
        row.extend(methods.iter().map(|(_, C)| error(column_error(C, &C_BB, j))));
        table.rows.push(row);
    }
    case.table(table);
    case.claim(
        "end loads, own mesh against another program on the same mesh",
        "CalculiX",
        compliance_error(&C_BB, &calculix),
        Bound::AtMost(1e-7),
    );
    for (name, C) in &methods {
        case.claim(
            format!("end loads, bar from a mesh, {name}"),
            "CalculiX",
            compliance_error(C, &calculix),
            Bound::AtMost(1e-6),
        );
    }
    let shear = (0..6).map(|j| (timoshenko[(j, j)] / C_BB[(j, j)] - 1.0).abs());
    let (torsion, rest) =
        shear.enumerate().fold((0.0, 0.0f64), |(t, r), (j, e)| if j == 3 { (e, r) } else { (t, larger(r, e)) });
    case.text(
        "Beam and mesh differ by what beam theory leaves out: tied rigidly, the ends can neither get thinner (stretch, bending: the mesh is stiffer by a few tenths of a per cent) nor warp (torsion), and \
         2 x 2 elements of second order do not resolve the warping of a rectangle (2.2 of the 3.5 % go with elements half as large, `robots/one_beam/fe/README.md`). The same held end makes the \
         sections near the clamp stiffer in the next table. Whoever wants the beam's numbers takes the beam's closed form.",
    );
    case.claim("Timoshenko's beam, stretch and bending", "own mesh", rest, Bound::AtMost(0.01));
    case.claim("Timoshenko's beam, torsion (coarse section)", "own mesh", torsion, Bound::AtMost(0.05));

    // Loads at sections: columns of the same compliance, B first, then the stations.
    let mut table = Table::new(
        "Unit loads spread over the section at x = a (distributing tie, mean motion): deflection of the section, own mesh; CalculiX against it over all sections and \
         components; closed form with Timoshenko's shear for the force, without ends that hold the section.",
        &["load", "a [m]", "w(a) [µm]", "CalculiX", "closed form", "w(l) [µm]", "closed form"],
    );
    let shear = bar_with_shear();
    let mut worst = 0.0f64;
    for (k, x) in stations.iter().enumerate() {
        for (name, component) in [("Fz", 2), ("My", 4)] {
            let column = 6 * (k + 1) + component;
            let own = |place: usize| -> Vector6<f64> { C.fixed_view::<6, 1>(6 * place, column).into_owned() };
            let entry = find_load(&stored, *x, name)?;
            let mut apart = 0.0f64;
            for (place, at) in (1..=3).chain([0]).zip(0..) {
                let theirs = stored.vector6(&format!("{entry}/at/{at}/u"))?;
                let scale = |i: usize| (C[(6 * place + i, 6 * place + i)] * C[(column, column)]).sqrt();
                apart = larger(apart, (0..6).map(|i| (theirs[i] - own(place)[i]) / scale(i)).worst());
            }
            worst = larger(worst, apart);
            let (here, end) = (own(k + 1)[2], own(0)[2]);
            let closed = |at: f64| {
                if name == "Fz" {
                    shear.under_force(1.0, *x, at)[0] + x / shear.kGA[1]
                } else {
                    -shear.under_moment(1.0, *x, at)[0]
                }
            };
            table.rows.push(vec![
                word(name),
                fixed(*x, 1),
                digits(1e6 * here, 6),
                error(apart),
                signed(closed(*x) / here - 1.0),
                digits(1e6 * end, 6),
                signed(closed(0.8) / end - 1.0),
            ]);
        }
    }
    case.table(table);
    case.claim("loads at sections, motion of all sections, own mesh", "CalculiX", worst, Bound::AtMost(1e-7));

    // Own weight of the bar alone.
    let mut bare = meshed.clone();
    without_ball(&mut bare);
    let held = condensation
        .held_modes(ModesWanted::Count(4))
        .map_err(|source| Error::Modes { mesh: MESH, source })?
        .frequencies_hz();
    let mut table = Table::new(
        "Bar without the ball, link reduced from the mesh, against CalculiX on the mesh: sag of the end under weight along -z and -y, first frequencies with A held.",
        &["model", "sag z", "sag y", "f_1", "f_2", "f_3", "f_4"],
    );
    let sag = [stored.vector6("gravity/-z")?[2], stored.vector6("gravity/-y")?[1]];
    let truth = stored.numbers("frequencies_hz")?;
    table.rows.push(vec![
        word("CalculiX [mm, Hz]"),
        fixed(1e3 * sag[0], 6),
        fixed(1e3 * sag[1], 6),
        digits(truth[0], 6),
        digits(truth[1], 6),
        digits(truth[2], 6),
        digits(truth[3], 6),
    ]);
    let mut row = vec![word("own mesh"), word(""), word("")];
    row.extend((0..4).map(|k| signed(held[k] / truth[k] - 1.0)));
    table.rows.push(row);
    let (mut exact, mut ten_modes) = (0.0f64, f64::NAN);
    for (name, modelling) in [
        ("2 parts", parts(2)),
        ("3 parts", parts(3)),
        ("5 parts", parts(5)),
        ("9 parts", parts(9)),
        ("modal, no modes (Guyan)", modal(0)),
        ("modal, 10 modes", modal(10)),
    ] {
        let mut row = vec![word(name)];
        for (axis, truth) in [(2, sag[0]), (1, sag[1])] {
            let mut robot = bare.clone();
            robot.rigid.gravity = Vector3::from_fn(|i, _| if i == axis { -G } else { 0.0 });
            let found = Rig::new(&robot, &modelling, None)?.statics(&Vector6::zeros())?[axis] / truth - 1.0;
            if name.starts_with("modal") {
                exact = larger(exact, found.abs());
            }
            row.push(signed(found));
        }
        // The first four of the mesh bend it sideways and upwards by turns.
        let [side, up] = Rig::new(&weightless(bare.clone()), &modelling, None)?.bending_hz();
        let found = [nth(&side, 0), nth(&up, 0), nth(&side, 1), nth(&up, 1)];
        let errors: Vec<f64> = found.iter().zip(&truth).map(|(f, truth)| f / truth - 1.0).collect();
        if name == "modal, 10 modes" {
            ten_modes = errors.iter().copied().worst();
        }
        row.extend(errors.into_iter().map(signed));
        table.rows.push(row);
    }
    case.table(table);
    case.claim("first four frequencies, bar from a mesh, modal, 10 modes", "CalculiX", ten_modes, Bound::AtMost(5e-4));
    case.claim("own-weight sag, modal link from a mesh, any number of modes", "CalculiX", exact, Bound::AtMost(1e-6));
    Ok(())
}

/// Place of a load in the stored list.
fn find_load(stored: &Stored, x: f64, load: &str) -> Result<String, Error> {
    let count = stored.at("station_loads")?.as_array().map_or(0, Vec::len);
    for k in 0..count {
        let entry = format!("station_loads/{k}");
        let here = stored.number(&format!("{entry}/x"))?;
        if (here - x).abs() < 1e-9 && stored.at(&format!("{entry}/load"))?.as_str() == Some(load) {
            return Ok(entry);
        }
    }
    stored.at(&format!("station_loads/{load} at {x}")).map(|_| String::new())
}

/// Where linear elasticity ends.
pub(super) fn large_loads(case: &mut Case, bench: &Bench, robot: &Robot, meshed: &Robot) -> Result<(), Error> {
    case.heading("Large loads: where the model ends");
    let bar = bar();
    let stored = bench.stored(STORED)?;
    let (robot, meshed) = (weightless(robot.clone()), weightless(meshed.clone()));
    let models = [
        ("2 parts", parts(2)),
        ("3 parts", parts(3)),
        ("5 parts", parts(5)),
        ("9 parts", parts(9)),
        ("modal", modal(6)),
    ];
    let heads = |caption: String, columns: &[&str]| {
        let mut table = Table::new(caption, columns);
        table.columns.extend(models.iter().map(|(name, _)| (*name).to_owned()));
        table
    };
    let strain = |x: f64, z: f64| (bar.l + x).hypot(z) / bar.l - 1.0;
    let mut theory = heads(
        "Force at the end that keeps its direction (upwards), the bar as beams; truth: the elastica, which bends as far as it likes and neither stretches nor shears. Error \
         of the height of the end. Purely elastic: the material would have yielded long before."
            .into(),
        &["force [N]", "height/l", "shortening/l", "rotation, 2 parts [rad]", "linear theory"],
    );
    let mut solid = heads(
        format!(
            "The same force on the bar from the mesh; truth: geometrically nonlinear finite elements (NLGEOM) on the same mesh, {}. Error of the height of the end. \
             Engineering strain: change of the distance of the ends over it, as `compare` reports it.",
            stored.provenance()
        ),
        &["force [N]", "height [mm]", "engineering strain", "linear FE"],
    );
    solid.columns.push("engineering strain, 2 parts".into());
    let mut curves: Vec<PlotCurve> = ["linear", "2 parts", "3 parts", "5 parts", "9 parts", "modal"]
        .map(|name| PlotCurve { name: name.into(), look: CurveLook::Marked, ..PlotCurve::default() })
        .into();
    curves[0].look = CurveLook::Total;
    let (mut at_the_limit, mut nine) = (f64::NAN, 0.0f64);
    let count = stored.at("large_load")?.as_array().map_or(0, Vec::len);
    let C_zz = stored.matrix6("C_BB")?[(2, 2)];
    for k in 0..count {
        let force = stored.number(&format!("large_load/{k}/force_n"))?;
        let wrench = Vector6::new(0.0, 0.0, force, 0.0, 0.0, 0.0);
        let [height, shortening] = bar.elastica(force);
        let fe = stored.numbers(&format!("large_load/{k}/u_B"))?;
        let linear = force * bar.tip_compliance()[(2, 2)] / bar.l;
        let (mut row, mut fe_row) = (Vec::new(), Vec::new());
        let mut errors = vec![force * C_zz / fe[2] - 1.0];
        let (mut two, mut two_fe) = (Vector6::zeros(), Vector6::zeros());
        for (name, modelling) in &models {
            // Far beyond what the model is for, equilibrium may not be found.
            let found = Rig::new(&robot, modelling, None)?.statics(&wrench).unwrap_or(Vector6::repeat(f64::NAN));
            let found_fe = Rig::new(&meshed, modelling, None)?.statics(&wrench).unwrap_or(Vector6::repeat(f64::NAN));
            if *name == "2 parts" {
                (two, two_fe) = (found, found_fe);
            }
            row.push(signed(found[2] / bar.l / height - 1.0));
            let relative = found_fe[2] / fe[2] - 1.0;
            fe_row.push(signed(relative));
            errors.push(relative);
            if *name == "9 parts" && height < 0.25 {
                nine = larger(nine, relative.abs());
            }
        }
        let mut cells = vec![
            digits(force, 4),
            fixed(height, 5),
            digits(shortening, 3),
            fixed(-two[4], 4),
            signed(linear / height - 1.0),
        ];
        cells.append(&mut row);
        theory.rows.push(cells);
        let mut cells = vec![
            digits(force, 4),
            fixed(1e3 * fe[2], 4),
            digits(strain(fe[0], fe[2]), 3),
            signed(force * C_zz / fe[2] - 1.0),
        ];
        cells.append(&mut fe_row);
        cells.push(digits(strain(two_fe[0], two_fe[2]), 3));
        solid.rows.push(cells);
        // A rotation of 0.05 rad is where `compare` begins to warn.
        if -two[4] <= 0.05 {
            at_the_limit = (two_fe[2] / fe[2] - 1.0).abs();
        }
        for (curve, error) in curves.iter_mut().zip(errors) {
            curve.x.push(fe[2] / bar.l);
            curve.y.push(error.abs());
        }
    }
    case.table(theory);
    case.table(solid);
    case.text(
        "The parts of a lumped link turn by finite angles, so a chain of them follows a beam that bends far: its error falls with the number of parts. A modal link is linear \
         within its frame and overshoots as linear FE does, by the square of the slope. Linear models stretch the line between the ends where the bar bends without stretching; the engineering strain shows it. The warning \
         limit of 0.05 rad stands where linear theory is wrong by 0.1 %. \"-\": from the unloaded link Newton's method finds no equilibrium, far beyond what the model is for; the program says so.",
    );
    case.claim(
        "large load, two parts, last load below the warning limit of 0.05 rad: height of the end",
        "CalculiX, geometrically nonlinear",
        at_the_limit,
        Bound::AtMost(1e-3),
    );
    case.claim(
        "large loads up to a height of l/4, nine parts",
        "CalculiX, geometrically nonlinear",
        nine,
        Bound::AtMost(2e-3),
    );
    case.figure(Figure {
        name: "one-beam-large".into(),
        caption:
            "Bar from the mesh under a large force: error of the height of the end against geometrically nonlinear FE"
                .into(),
        x_label: "height of the end / l".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    });
    Ok(())
}
