//! The page of the case, second half: the bar as a mesh.
//!
//! Not here: numbers (`mesh.rs`).

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::large_loads::{JUDGED_UP_TO_L_OVER, LargeLoads, WARNING_RAD};
use super::mesh::{BarMesh, ELEMENTS, MODES, MeshWeight};
use super::{MESH, MESHED};
use crate::bench::{LOADS, column_error, compliance_error};
use crate::compliance::{add_errors, claim_each};
use crate::page::{Bound, Case, Figure, Table, digits, error, fixed, percent, signed, word};

/// Bound of the error of linear theory at the warning limit.
const ERROR_AT_WARNING: f64 = 1e-3;

/// The bar as a mesh: flexarm's finite elements, CalculiX, beam theory, and the reduced link.
pub(super) fn mesh(case: &mut Case, found: &BarMesh) {
    case.heading("The bar as a mesh");
    let [along, across, up] = ELEMENTS;
    case.text(format!(
        "`{MESH}`: {along} x {across} x {up} HEX20, both ends tied rigidly (RBE2) to the joints. Own elements and reduction here; {}; `{MESHED}` is the robot \
         whose link is reduced from it.",
        found.provenance
    ));
    mesh_end_loads(case, found);
    mesh_sections(case, found);
    mesh_weight(case, &found.weight);
}

fn mesh_end_loads(case: &mut Case, found: &BarMesh) {
    let BarMesh { own, calculix, methods, .. } = found;
    // Own mesh against both beam theories, CalculiX and every method on the reduced link.
    let mut table = Table::new(
        "Six end loads: displacement of the end along the load per unit of it, own mesh; Euler-Bernoulli's and Timoshenko's beam against the mesh; CalculiX and each \
         method (robot of the reduced link) against the mesh, largest of six components over `sqrt(C_ii C_jj)`.",
        &["load", "mesh [µm, µrad]", "Euler-Bernoulli", "Timoshenko", "CalculiX"],
    );
    for (j, load) in LOADS.into_iter().enumerate() {
        let mut row = vec![word(load), digits(1e6 * own[(j, j)], 6)];
        row.extend([found.euler_errors[j], found.timoshenko_errors[j]].map(signed));
        row.push(error(column_error(calculix, own, j)));
        table.rows.push(row);
    }
    add_errors(&mut table, own, methods);
    case.table(table);
    // The same mesh in another program, then the robots made from it.
    case.claim(
        "end loads, own mesh against another program on the same mesh",
        "CalculiX",
        compliance_error(own, calculix),
        Bound::AtMost(1e-7),
    );
    claim_each(case, "end loads, bar from a mesh", ("CalculiX", calculix), methods, 1e-6);
    case.text(
        "Beam and mesh differ by what beam theory leaves out. Rigid ties keep the ends from contracting, \
         which makes the mesh stiffer by some tenths of a per cent in stretch and bending, and from warping \
         in torsion. The section has few elements for the warping of a rectangle; a finer mesh is in \
         `robots/test/one_beam/fe/README.md`.",
    );
    // Timoshenko's beam differs by the ties and by the coarse section.
    let claims = [
        ("Timoshenko's beam, stretch and bending", found.bending_error(), 0.01),
        ("Timoshenko's beam, torsion (coarse section)", found.torsion_error(), 0.05),
    ];
    for (text, measured, bound) in claims {
        case.claim(text, "own mesh", measured, Bound::AtMost(bound));
    }
}

fn mesh_sections(case: &mut Case, found: &BarMesh) {
    let mut table = Table::new(
        "Unit loads spread over the section at x = a (distributing tie, mean motion): deflection of the section, own mesh; CalculiX against it over all sections and \
         components; closed form with Timoshenko's shear for the force, without ends that hold the section.",
        &["load", "a [m]", "w(a) [µm]", "CalculiX", "closed form", "w(l) [µm]", "closed form"],
    );
    for load in &found.stations {
        table.rows.push(vec![
            word(load.name),
            fixed(load.x_m, 1),
            digits(1e6 * load.here, 6),
            error(load.calculix_error),
            signed(load.closed_errors[0]),
            digits(1e6 * load.end, 6),
            signed(load.closed_errors[1]),
        ]);
    }
    case.table(table);
    let worst = found.worst_at_sections();
    case.claim("loads at sections, motion of all sections, own mesh", "CalculiX", worst, Bound::AtMost(1e-7));
}

fn mesh_weight(case: &mut Case, found: &MeshWeight) {
    let mut table = Table::new(
        "Bar without the ball, link reduced from the mesh, against CalculiX on the mesh: sag of the end under weight along -z and -y, first frequencies with A held.",
        &["model", "sag z", "sag y"],
    );
    table.columns.extend((1..=MODES).map(|k| format!("f_{k}")));
    let mut row = vec![word("CalculiX [mm, Hz]")];
    row.extend(found.sag_m.map(|sag| fixed(1e3 * sag, 6)));
    row.extend(found.hz.iter().take(MODES).map(|f| digits(*f, 6)));
    table.rows.push(row);
    let mut row = vec![word("own mesh"), word(""), word("")];
    row.extend(found.own_hz_errors.map(signed));
    table.rows.push(row);
    for model in &found.models {
        let mut row = vec![word(&model.name)];
        row.extend(model.sag_errors.iter().chain(&model.hz_errors).map(|e| signed(*e)));
        table.rows.push(row);
    }
    case.table(table);
    let claims = [
        ("first four frequencies, bar from a mesh, modal, 10 modes", found.all_modes_hz_error(), 5e-4),
        ("own-weight sag, modal link from a mesh, any number of modes", found.modal_sag_error(), 1e-6),
    ];
    for (text, measured, bound) in claims {
        case.claim(text, "CalculiX", measured, Bound::AtMost(bound));
    }
}

/// Limit of linear elasticity.
pub(super) fn large_loads(case: &mut Case, found: &LargeLoads) {
    case.heading("Large loads: where the model ends");
    case.table(beams_table(found));
    case.table(solids_table(found));
    case.text(format!(
        "The parts of a lumped link rotate by finite angles, so a chain follows a beam that bends far, and \
         its error falls with the number of parts. A modal link is linear in its frame: as with linear FE, \
         its error grows with the square of the slope. The warning limit of {WARNING_RAD} rad is where linear \
         theory is wrong by {} %. \"-\": Newton's method finds no equilibrium, and the program reports it.",
        percent(ERROR_AT_WARNING, 1)
    ));
    let truth = "CalculiX, geometrically nonlinear";
    case.claim(
        format!("large load, two parts, last load below the warning limit of {WARNING_RAD} rad: height of the end"),
        truth,
        found.at_the_warning_limit(),
        Bound::AtMost(ERROR_AT_WARNING),
    );
    let text = format!("large loads up to a height of l/{JUDGED_UP_TO_L_OVER}, nine parts");
    case.claim(text, truth, found.worst_of_nine(), Bound::AtMost(2e-3));
    case.figure(large_figure(found));
}

/// The bar as beams, compared with the elastica.
fn beams_table(found: &LargeLoads) -> Table {
    let mut table = Table::new(
        "Force at the end that keeps its direction (upwards), the bar as beams; truth: the elastica, which bends as far as it likes and neither stretches nor shears. Error \
         of the height of the end. Purely elastic: the material would have yielded long before.",
        &["force [N]", "height/l", "shortening/l", "rotation, 2 parts [rad]", "linear theory"],
    );
    table.columns.extend(found.models.iter().cloned());
    for load in &found.loads {
        let mut cells = vec![
            digits(load.force_n, 4),
            fixed(load.height_over_l, 5),
            digits(load.shortening_over_l, 3),
            fixed(load.two_parts_rad, 4),
            signed(load.linear_error),
        ];
        cells.extend(load.errors.iter().map(|e| signed(*e)));
        table.rows.push(cells);
    }
    table
}

/// The bar as a mesh, compared with nonlinear finite elements.
fn solids_table(found: &LargeLoads) -> Table {
    let caption = format!(
        "The same force on the bar from the mesh; truth: geometrically nonlinear finite elements (NLGEOM) on the same mesh, {}. Error of the height of the end. \
         Engineering strain: change of the distance of the ends over it, as `compare` reports it.",
        found.provenance
    );
    let mut table = Table::new(caption, &["force [N]", "height [mm]", "engineering strain", "linear FE"]);
    table.columns.extend(found.models.iter().cloned());
    table.columns.push("engineering strain, 2 parts".into());
    for load in &found.loads {
        let mut cells = vec![
            digits(load.force_n, 4),
            fixed(1e3 * load.fe_height_m, 4),
            digits(load.fe_strain, 3),
            signed(load.fe_linear_error),
        ];
        cells.extend(load.fe_errors.iter().map(|e| signed(*e)));
        cells.push(digits(load.two_parts_strain, 3));
        table.rows.push(cells);
    }
    table
}

fn large_figure(found: &LargeLoads) -> Figure {
    let heights = || found.loads.iter().map(|load| load.fe_height_m / super::bar::LENGTH_M).collect();
    let errors = found.loads.iter().map(|load| load.fe_linear_error.abs()).collect();
    let mut curves = vec![PlotCurve { name: "linear".into(), look: CurveLook::Total, x: heights(), y: errors }];
    curves.extend(found.models.iter().enumerate().map(|(k, name)| PlotCurve {
        name: name.clone(),
        look: CurveLook::Marked,
        x: heights(),
        y: found.loads.iter().map(|load| load.fe_errors[k].abs()).collect(),
    }));
    Figure {
        name: "one-beam-large".into(),
        caption:
            "Bar from the mesh under a large force: error of the height of the end against geometrically nonlinear FE"
                .into(),
        x_label: "height of the end / l".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    }
}
