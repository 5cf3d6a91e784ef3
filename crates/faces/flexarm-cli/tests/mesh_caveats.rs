//! Meshes that used to pass without a warning: messages of `flexarm reduce` about them, with
//! truths.
//!
//! The meshes in `tests/data` are bars of 600 x 60 x 40 mm in cells of 50 x 30 x 20 mm.

use crate::common::{self, Place};
use serde_json::Value;

/// A test folder with a mesh of `tests/data`.
fn place(mesh: &str) -> Place {
    let place = Place::new();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    place.write("bar.msh.gz", std::fs::read(folder.join(format!("{mesh}.msh.gz"))).unwrap());
    place
}

/// Arguments of a reduction without files; `a`, `b`: the selectors.
fn arguments<'a>(a: &'a str, b: &'a str) -> Vec<&'a str> {
    let mut list =
        "--json reduce bar.msh.gz --units mm-t-s --material steel --at A=0,30,20 --at B=600,30,20 --no-files"
            .split(' ')
            .collect::<Vec<_>>();
    list.extend(["--interface", a, "--interface", b]);
    list
}

/// The figures of a reduction, and its warnings as one text.
fn reduced(place: &Place, arguments: &[&str]) -> (Value, String) {
    let output = place.command(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let figures: Value = serde_json::from_slice(&output.stdout).unwrap();
    let warnings = figures["warnings"].as_array().unwrap().iter();
    let warnings = warnings.map(|warning| warning.as_str().unwrap()).collect::<Vec<_>>().join("\n");
    (figures, warnings)
}

fn softness(figures: &Value, k: usize) -> f64 {
    figures["compliance"][k][k].as_f64().unwrap()
}

/// Truth: the same cells in ten-node tetrahedra, reduced separately.
#[test]
fn linear_tetrahedra_are_called_too_stiff_by_what_quadratic_ones_give() {
    let (linear, said) = reduced(&place("tet4"), &arguments("A=A", "B=B"));
    let (quadratic, _) = reduced(&place("tet10_same"), &arguments("A=A", "B=B"));
    assert!(said.contains("too stiff") && said.contains("TET10"), "{said}");
    for k in 0..6 {
        let ratio = linear["checks"]["order_ratios"][k].as_f64().unwrap();
        let truth = softness(&quadratic, k) / softness(&linear, k);
        assert!((ratio / truth - 1.0).abs() < 5e-3, "{k}: {ratio:.4} instead of {truth:.4}");
    }
    assert!(linear["checks"]["order_ratio"].as_f64().unwrap() > 2.5);
}

/// Truth: the faces selected by position, with all their nodes.
#[test]
fn sets_of_corner_nodes_are_completed_and_said() {
    let place = place("tet10_same");
    let (completed, said) = reduced(&place, &arguments("A=A", "B=B"));
    let (truth, quiet) = reduced(&place, &arguments("A=plane(0,0,0; 1,0,0)", "B=plane(600,0,0; 1,0,0)"));
    assert!(said.contains("mid-side nodes") && said.contains("were added"), "{said}");
    assert!(!quiet.contains("mid-side nodes"), "{quiet}");
    for k in 0..6 {
        let error = softness(&completed, k) / softness(&truth, k) - 1.0;
        assert!(error.abs() < 1e-10, "{k}: {error:.1e}");
    }
}

#[test]
fn a_crack_is_told_with_its_place_and_merging_closes_it() {
    let place = place("crack");
    let (cracked, said) = reduced(&place, &arguments("A=A", "B=B"));
    assert!(said.contains("lie in one place") && said.contains("merge"), "{said}");
    let (merged, quiet) = reduced(&place, &[&arguments("A=A", "B=B")[..], &["--merge", "0.001"]].concat());
    assert!(!quiet.contains("lie in one place") && quiet.contains("merge: 5 of"), "{quiet}");
    // The fault was found by a lateral compliance 15 to 22 % too large.
    let lateral = [1, 2].map(|k| softness(&cracked, k) / softness(&merged, k));
    assert!(lateral.iter().all(|ratio| *ratio > 1.10), "{lateral:?}");
}

#[test]
fn a_hinge_names_the_interface_and_the_nodes_that_it_turns_about() {
    let place = place("hinge");
    let output = place.command(&arguments("A=A", "B=B")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("interface \"B\" can move without force") && said.contains("on a line"), "{said}");
}

#[test]
fn nastran_bulk_data_are_told_how_to_become_a_mesh() {
    let place = Place::new();
    place.write("arm.bdf", "$ by hand\nSOL 103\nCEND\nBEGIN BULK\nGRID,1,,0.,0.,0.\nENDDATA\n");
    let output = place.command(&["reduce", "arm.bdf", "--list"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && said.contains("Nastran bulk data") && said.contains("-save"), "{said}");
}

/// A link that is heavy at one end cannot be represented by two bodies at the centres of the
/// halves.
///
/// Truth: the torque and the moment of inertia about the joint of a link of 1.728 kg at 0.1 m, with
/// 0.0923904 kg m² about its centre of mass, and of the ball of 0.5 kg at 0.8 m. The share s of the
/// beam, whose centre of mass is 0.3 m from that of the link, is the largest that leaves a body:
///
/// ```text
/// 0.09216 (1 - s) = 1.728 * 0.3² s/(1 - s)
/// ```
///
/// with the second moment of mass along the beam, 0.09216 kg m² for the link and for the uniform
/// beam. The rest has its centre of mass before the near end, so all of it is fixed there, and the
/// distal part is half of the beam.
#[test]
fn a_link_that_cannot_be_cut_keeps_its_body_with_most_mass_along_the_beam_and_the_rest_at_its_ends() {
    let place = Place::new();
    let off_centre = common::with(common::URDF, "xyz=\"0.4 0 0\"", "xyz=\"0.1 0 0\"");
    place.write("beam.urdf", common::with(&off_centre, "<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 1 0\"/>"));
    let inspected = |parts: &str| {
        place.write("robot.toml", common::with(common::ROBOT, "section = ", &format!("{parts}section = ")));
        let found = place.json(&["inspect", "robot.toml"]);
        let [torque, inertia] = [found["gravity_torque"][0].as_f64(), found["mass_matrix"][0][0].as_f64()];
        let masses = common::numbers(&found["flexible_links"][0]["parts_kg"]);
        let uniform_mass = found["caveats"].as_array().unwrap().iter().any(|c| c["code"] == "uniform-mass");
        (torque.unwrap(), inertia.unwrap(), masses, uniform_mass)
    };
    let torque = -9.81 * (1.728 * 0.1 + 0.5 * 0.8);
    let inertia = 0.0923904 + 1.728 * 0.1 * 0.1 + 0.000125 + 0.5 * 0.8 * 0.8;
    let ratio = 1.728 * 0.3 * 0.3 / 0.09216_f64;
    let share = 1.0 + 0.5 * ratio - (ratio + 0.25 * ratio * ratio).sqrt();
    for parts in ["", "parts = \"from-link\", "] {
        let (of_weight, about_joint, masses, is_warned) = inspected(parts);
        assert!((of_weight - torque).abs() < 1e-9, "{parts}: {of_weight} instead of {torque}");
        assert!((about_joint - inertia).abs() < 1e-9, "{parts}: {about_joint} instead of {inertia}");
        assert!((masses.iter().sum::<f64>() - 1.728).abs() < 1e-9 && !is_warned, "{parts}: {masses:?}");
        assert!((masses[1] - 0.5 * share * 1.728).abs() < 1e-9, "{parts}: {masses:?}, share {share}");
        let check = place.flexarm(&["check", "robot.toml"]);
        assert!(check.code == 0 && check.out.contains("0 errors, 0 warnings"), "{} {}", check.out, check.err);
    }
    // The uniform beam of the same mass is taken only if requested, and says what it changes.
    let (of_weight, _, masses, is_warned) = inspected("parts = \"uniform\", ");
    let uniform = -9.81 * (1.728 * 0.4 + 0.5 * 0.8);
    assert!((of_weight - uniform).abs() < 1e-9 && masses == [0.864, 0.864] && is_warned, "{of_weight} {masses:?}");
    let check = place.flexarm(&["check", "robot.toml"]);
    assert!(check.out.contains("move the centre of mass by 0.3000 m"), "{}", check.out);
}

/// Truth: the frequencies of the link that was exported.
#[test]
fn a_stiffness_finds_its_mass_and_two_coarse_parts_are_judged_as_in_a_reduction() {
    let place = place("tet10_same");
    let split = ["--split", "0.9"];
    let (link, said) = reduced(&place, &[&arguments("A=A", "B=B")[..], &split].concat());
    let coarse = "the first frequency with two rigid parts differs";
    assert!(said.contains(coarse), "{said}");

    let list: Vec<&str> =
        arguments("A=A", "B=B").into_iter().map(|word| if word == "--no-files" { "--force" } else { word }).collect();
    reduced(&place, &[&list[..], &["--flex", "bar.flex", "--name", "bar"]].concat());
    let export = ["export", "bar.flex", "--format", "matrix-market", "--units", "m-kg-s", "-o", "matrices"];
    assert!(place.command(&export).output().unwrap().status.success());
    std::fs::remove_file(place.path("matrices/bar.toml")).unwrap();

    // Nothing else identifies rows and positions; the matrix itself does.
    let bare = ["import", "matrices/bar_K.mtx", "--units", "m-kg-s", "--no-files"];
    let output = place.command(&bare).output().unwrap();
    let asked = String::from_utf8_lossy(&output.stderr);
    assert!(asked.contains("--map \"A=#1-6,B=#7-12,modal=#13-22\""), "{asked}");
    assert!(asked.contains("B at (0.600000, 0.000000, 0.000000)"), "{asked}");

    let map = ["--json", "--map", "A=#1-6,B=#7-12,modal=#13-22", "--at", "A=0,0.03,0.02", "--at", "B=0.6,0.03,0.02"];
    // The halves of the bar are as good as two parts can be (+1.96 %); pieces of nine and one
    // tenths are not.
    let (_, said) = reduced(&place, &[&bare[..], &map].concat());
    assert!(said.contains("bar_M.mtx, found beside") && !said.contains(coarse), "{said}");
    let a = "10.1736;0.27,0.03,0.02;0.00440856,0.24857496,0.25027056,0,0,0";
    let b = "1.1304;0.57,0.03,0.02;0.00048984,0.00048984,0.00067824,0,0,0";
    let (imported, said) = reduced(&place, &[&bare[..], &map, &split, &["--part-a", a, "--part-b", b]].concat());
    assert!(said.contains(coarse), "{said}");
    let [hz, truth] = [&imported, &link].map(|figures| figures["frequencies_hz"][0].as_f64().unwrap());
    assert!((hz / truth - 1.0).abs() < 1e-3, "{hz} instead of {truth}"); // ten modes instead of all
    let caveat = imported["caveats"].as_array().unwrap().iter().find(|caveat| caveat["code"] == "coarse-parts");
    assert!(caveat.unwrap()["value"].as_f64().unwrap().abs() > caveat.unwrap()["yardstick"].as_f64().unwrap());
}
