//! `flexarm import` and `flexarm export` from the user's point of view.

use std::path::{Path, PathBuf};

use crate::common::{self, Place, flex, matrix, numbers};

/// Maximum difference of two matrices over the geometric mean of the diagonal of the first.
fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..a.len() {
        for j in 0..a.len() {
            worst = worst.max((a[i][j] - b[i][j]).abs() / (a[i][i] * a[j][j]).sqrt());
        }
    }
    worst
}

/// External samples, if they are available.
fn sample(name: &str) -> PathBuf {
    common::reference(name)
}

const MASS: [&str; 6] = ["--mass", "1.728", "--com", "0.4,0,0", "--inertia", "0.0003,0.0924,0.0922,0,0,0"];
const AT: [&str; 4] = ["--at", "A=0,0,0", "--at", "B=0.8,0,0"];

/// `node,dof,node,dof,value` of the beam of the tests; `order` gives the component in each row.
fn labelled(order: [usize; 6]) -> String {
    let k = flex::stiffness_12();
    let mut text = String::new();
    for i in 0..12 {
        for j in 0..=i {
            let value = k[6 * (i / 6) + order[i % 6]][6 * (j / 6) + order[j % 6]];
            if value != 0.0 {
                text += &format!("{},{},{},{},{value:.15e}\n", 1001 + i / 6, i % 6 + 1, 1001 + j / 6, j % 6 + 1);
            }
        }
    }
    text
}

/// Overwriting is for results of an earlier command, not for what this one reads.
#[test]
fn no_verb_replaces_what_it_reads() {
    let place = Place::new();
    let said = &["is input and output", "another name or folder"];
    place.write("job.toml", "mesh = \"beam.inp\"\n");
    place.write("bar.mtx", "");
    place.write("again/robot.toml", "");
    #[cfg(unix)]
    std::os::unix::fs::symlink("swing.toml", place.path("link.toml")).unwrap();
    for command in [
        &["reduce", "job.toml", "--flex", "job.toml"][..],
        &["reduce", "job.toml", "--flex", "./beam.inp"],
        &["import", "bar.mtx", "--flex", "bar.mtx"],
        &["motion", "swing.toml", "robot.toml", "-o", "swing.toml"],
        &["motion", "swing.toml", "robot.toml", "-o", "a.csv", "-o", "robot.toml"],
        #[cfg(unix)]
        &["motion", "swing.toml", "-o", "link.toml"],
        &["sensitivity", "robot.toml", "swing.toml", "--table", "robot.toml"],
        &["export-fmu", "robot.toml", "-o", "robot.toml"],
        &["export-fmu", "robot.toml", "-o", "again/../beam.urdf"],
    ] {
        place.write("beam.inp", "");
        place.refused(&[command, &["--force"]].concat(), said);
    }
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "out"]);
    place.refused(&["compare", "robot.toml", "out/run.csv", "-o", "out", "--force"], said);
}

/// An FMU contains the library of this program, not one that lies in the current folder, and nothing
/// stays in the folder of temporary files.
#[cfg(target_os = "linux")]
#[test]
fn the_library_of_an_fmu_is_not_taken_from_the_current_folder() {
    let place = Place::new();
    place.write("here/lib/libflexarm_fmu.so", "planted");
    place.write("tmp/kept", "");
    place.write("bin/README", "");
    std::fs::copy(env!("CARGO_BIN_EXE_flexarm"), place.path("bin/flexarm")).unwrap();
    let export = |library: &[&str]| {
        let mut command = std::process::Command::new(place.path("bin/flexarm"));
        command.args([&["export-fmu", "../robot.toml", "-o", "a.fmu"], library].concat());
        command.current_dir(place.path("here")).env("TMPDIR", place.path("tmp"));
        command
    };
    place.refused_by(&mut export(&[]), &["libflexarm_fmu.so", "not beside the program", "--library"]);
    let asked = export(&["--library", "lib/libflexarm_fmu.so"]).output().unwrap();
    assert!(asked.status.success(), "{asked:?}");
    assert_eq!(std::fs::read_dir(place.path("tmp")).unwrap().count(), 1);
}

/// Truth: the stiffness of the link before it was written.
#[test]
fn every_format_brings_the_link_back() {
    let place = Place::new();
    place.write("bar.flex", flex::text(&flex::stiffness_12()));
    for (format, file, map, bound) in [
        ("matrix-market", "bar_K.mtx", "", 1e-13),
        ("user-element", "bar.mtx", "A=7,B=9", 1e-12),
        ("simscape", "bar_K.csv", "A=#1-6,B=#7-12", 1e-13),
    ] {
        for units in ["m-kg-s", "mm-t-s"] {
            let folder = format!("{format}-{units}");
            let export =
                ["export", "bar.flex", "--format", format, "--units", units, "--nodes", "7,9", "-o", folder.as_str()];
            let said = place.json(&export);
            assert!(said["checks"]["stiffness_error"].as_f64().unwrap() < bound, "{format}: {said}");
            assert!(said["warnings"][0].as_str().unwrap().contains("without mass"));
            place.refused(&export, &["exists already", "--force"]);

            let file = format!("{folder}/{file}");
            let mut import = vec!["import", file.as_str()];
            let b = if units == "mm-t-s" { "B=800,0,0" } else { "B=0.8,0,0" };
            if format != "matrix-market" {
                import.extend(["--units", units, "--map", map, "--at", "A=0,0,0", "--at", b]);
            }
            import.extend(MASS);
            let into = format!("{folder}/back");
            import.extend(["-o", &into]);
            let back = place.json(&import);
            let error = difference(&flex::stiffness_6(), &matrix(&back["stiffness"]));
            assert!(error < bound, "{format} {units}: {error:.1e}");
            assert!((numbers(&back["interfaces"][1]["position_m"])[0] - 0.8).abs() < 1e-9);
            assert!(place.text(&format!("{into}/report.md")).contains("force under rigid-body motion"));
        }
    }
}

#[test]
fn what_is_missing_is_asked_for_with_the_text_to_type() {
    let place = Place::new();
    place.write("job_STIF1.mtx", labelled([0, 1, 2, 3, 4, 5]));
    place.refused(
        &["import", "job_STIF1.mtx"],
        &["--units mm-t-s", "--map \"A=1001,B=1002\"", "--at A=0,0,0 --at B=0.8"],
    );
    let said = ["import", "job_STIF1.mtx", "--units", "m-kg-s", "--map", "A=1001,B=1002"];
    place.refused(&said, &["--at A=0,0,0 --at B=0.8"]);
    place.refused(&[&said[..], &AT].concat(), &["mass is missing", "mass, centre of mass and inertia"]);
    place.refused(&["import", "nowhere.mtx"], &["nowhere.mtx"]);
    place.refused(&[&said[..], &AT, &MASS, &["--format", "dmig"]].concat(), &["--format"]);
    let summary = place.json(&[&said[..], &AT, &MASS, &["--no-files"]].concat());
    assert!(difference(&flex::stiffness_6(), &matrix(&summary["stiffness"])) < 1e-12);
    assert!(summary["warnings"].to_string().contains("halves of a uniform bar"));
}

#[test]
fn rotations_before_translations_fail_the_gate() {
    let place = Place::new();
    place.write("job_STIF1.mtx", labelled([3, 4, 5, 0, 1, 2]));
    let said = ["import", "job_STIF1.mtx", "--units", "m-kg-s", "--map", "A=1001,B=1002"];
    place.refused(&[&said[..], &AT, &MASS].concat(), &["job_STIF1.mtx"]);
}

/// Debian's CalculiX 2.20 writes substructures without condensing them.
#[test]
#[ignore = "needs the reference data beside the project"]
fn the_defective_substructures_are_refused_with_the_reason() {
    for name in [
        "A1_beam/beam_tet10_h50mm_ccx220_substructure_REAL_UNCONDENSED.mtx",
        "A2_lower_arm/arm_tet10_h30mm_ccx220_substructure_REAL_UNCONDENSED.mtx",
    ] {
        let path = sample(name);
        let place = Place::new();
        let path = path.to_str().unwrap();
        let asked = place.flexarm(&["import", path]).err;
        let map = asked.split("--map \"").nth(1).unwrap().split('"').next().unwrap();
        let said = ["import", path, "--units", "m-kg-s", "--map", map, "--at", "A=0,0,0", "--at", "B=1,0,0"];
        place.refused(&[&said[..], &MASS].concat(), &["CalculiX 2.20", "without condensing"]);
    }
}

/// Truth: the matrices condensed by another program from the same mesh.
#[test]
#[ignore = "needs the reference data beside the project"]
fn a_full_calculix_model_gives_the_condensed_stiffness() {
    let full = sample("A1_beam/beam_tet10_h50mm_ccx220_REAL.sti.gz");
    let condensed = sample("A1_beam/beam_tet10_h50mm_ccx_K12.mtx");
    let place = Place::new();
    let at = ["--units", "m-kg-s", "--at", "A=0,0,0", "--at", "B=1,0,0", "--no-files"];
    let full = ["import", full.to_str().unwrap(), "--map", "A=947:1-3+948:1-3,B=949:1-3+950:1-3", "--modes", "4"];
    let found = place.json(&[&full[..], &at].concat());
    let reduced = ["import", condensed.to_str().unwrap(), "--map", "A=#1-6,B=#7-12"];
    let truth = place.json(&[&reduced[..], &at, &MASS].concat());
    let error = difference(&matrix(&truth["stiffness"]), &matrix(&found["stiffness"]));
    assert!(error < 1e-8, "{error:.1e}");
    assert_eq!(numbers(&found["fixed_interface_hz"]).len(), 4);
    assert!(found["checks"]["mass_error"].as_f64().unwrap() < 1e-6, "{found}");
}

/// Second algorithm: all samples are of one beam.
#[test]
#[ignore = "needs the reference data beside the project"]
fn all_samples_are_the_same_beam() {
    let place = Place::new();
    let base = ["--units", "m-kg-s", "--at", "A=0,0,0", "--at", "B=1,0,0", "--no-files"];
    let mut first: Option<(String, Vec<Vec<f64>>)> = None;
    for (name, map, bound) in [
        ("mm_coordinate_symmetric_K12.mtx", "A=#1-6,B=#7-12", 1e-12),
        ("mm_array_K12.mtx", "A=#1-6,B=#7-12", 1e-8),
        ("abaqus_user_element_K12_M12.mtx", "A=1001,B=1002", 1e-8),
        ("abaqus_matrix_input_STIF1.mtx", "A=1001,B=1002", 1e-8),
        ("abaqus_coordinate_STIF1.mtx", "A=#1-6,B=#7-12", 1e-8),
        ("ansys_hbmat_K12.matrix", "A=1001,B=1002", 1e-8),
        ("calculix_layout_condensed_K12.mtx", "", 1e-8),
        ("simscape_K.csv", "A=#1-6,B=#7-12", 1e-6),
        ("nastran_dmig_punch.pch", "A=1001,B=1002", 1e-6),
        ("nastran_op4_text.op4", "A=#1-6,B=#7-12", 1e-6),
        ("nastran_op4_binary_le.op4", "A=#1-6,B=#7-12", 1e-6),
    ] {
        let path = sample(&format!("formats/{name}"));
        let path = path.to_str().unwrap();
        let proposed = place.flexarm(&["import", path]).err;
        let proposed = proposed.split("--map \"").nth(1).and_then(|text| text.split('"').next()).unwrap_or_default();
        let map = if map.is_empty() { proposed } else { map };
        let said = ["import", path, "--map", map];
        let summary = place.json(&[&said[..], &base, &MASS].concat());
        let found = matrix(&summary["stiffness"]);
        match &first {
            None => first = Some((name.into(), found)),
            Some((other, truth)) => {
                let error = difference(truth, &found);
                assert!(error < bound, "{name} against {other}: {error:.1e}");
            }
        }
    }
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn a_sid_is_a_beam_too() {
    let place = Place::new();
    let path = sample("formats/beam_synthetic.SID_FEM");
    let path = path.to_str().unwrap();
    let answer = place.flexarm(&["import", path]);
    assert_eq!(answer.code, 2);
    answer.says(&["--units", "--map"]);
    let map = answer.err.split("--map \"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    let found = place.json(&["import", path, "--units", "m-kg-s", "--map", &map, "--no-files"]);
    let truth = sample("formats/mm_coordinate_symmetric_K12.mtx");
    let truth = ["import", truth.to_str().unwrap(), "--units", "m-kg-s", "--map", "A=#1-6,B=#7-12", "--no-files"];
    let truth = place.json(&[&truth[..], &["--at", "A=0,0,0", "--at", "B=1,0,0"], &MASS].concat());
    let error = difference(&matrix(&truth["stiffness"]), &matrix(&found["stiffness"]));
    assert!(error < 1e-6, "SID: {error:.1e}");
    assert!((found["mass_kg"].as_f64().unwrap() / 39.25 - 1.0).abs() < 1e-6);
}

/// DMIG with GRID entries of a frame of rods between three planes of four nodes, EA in newtons.
fn frame(rod: f64, middle: f64) -> String {
    let side = |bit: usize, size: f64| if bit == 0 { -size } else { size };
    let nodes: Vec<[f64; 3]> = (0..12).map(|i| [0.4 * (i / 4) as f64, side(i & 1, 0.02), side(i & 2, 0.01)]).collect();
    let mut k = vec![vec![0.0; 36]; 36];
    for a in 0..12 {
        for b in a + 1..12 {
            let axis: Vec<f64> = (0..3).map(|x| nodes[b][x] - nodes[a][x]).collect();
            let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
            let ea = match (a / 4, b / 4) {
                (0, 2) => continue,
                (1, 1) => middle,
                _ => rod,
            };
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let value = ea * axis[i] * axis[j] / length.powi(3);
                for (p, q, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                    k[3 * p + i][3 * q + j] += sign * value;
                }
            }
        }
    }
    let mut text = String::new();
    for (i, p) in nodes.iter().enumerate() {
        text += &format!("GRID,{},,{:.6},{:.6},{:.6}\n", i + 1, p[0], p[1], p[2]);
    }
    text += "DMIG,KAAX,0,6,2\nDMIG,MAAX,0,6,2\n";
    for j in 0..36 {
        text += &format!("DMIG,MAAX,{},{},,{0},{1},0.144\n", j / 3 + 1, j % 3 + 1);
        text += &format!("DMIG,KAAX,{},{}", j / 3 + 1, j % 3 + 1);
        for (i, row) in k.iter().enumerate().skip(j) {
            text += &format!(",{}{},{},{:.15e}\n", if i == j { "," } else { "" }, i / 3 + 1, i % 3 + 1, row[j]);
        }
    }
    text
}

/// Truth: the rods between two planes, in series; those of the middle plane keep it from narrowing.
#[test]
fn a_full_model_with_positions_is_held_at_planes() {
    let place = Place::new();
    place.write("frame.pch", frame(1e6, 1e9));
    place.refused(&["import", "frame.pch", "--units", "m-kg-s"], &["plane("]);
    let map = "A=plane(0,0,0;1,0,0),B=plane(0.8,0,0;1,0,0)";
    let found = place.json(&["import", "frame.pch", "--units", "m-kg-s", "--map", map, "--no-files"]);
    assert!((found["mass_kg"].as_f64().unwrap() / (12.0 * 0.144) - 1.0).abs() < 1e-9);
    let lengths = [0.0_f64, 0.04].map(|y| [0.0_f64, 0.02].map(|z| (0.16 + y * y + z * z).sqrt()));
    let half: f64 = lengths.iter().flatten().map(|l| 4.0 * 1e6 * 0.16 / l.powi(3)).sum();
    let axial = matrix(&found["stiffness"])[0][0];
    assert!((axial / (half / 2.0) - 1.0).abs() < 1e-6, "{axial:e}");
    let off = map.replace("0.8", "0.7");
    place
        .refused(&["import", "frame.pch", "--units", "m-kg-s", "--map", &off], &["no node is on plane(0.7,0,0;1,0,0)"]);
}

#[test]
fn hdf5_is_refused_with_a_way_out() {
    let place = Place::new();
    place.write("arm.h5", b"\x89HDF\r\n\x1a\n\0\0\0\0");
    place
        .refused(&["import", "arm.h5", "--units", "m-kg-s"], &["HDF5 is not read", "Matrix Market", "mmwrite", "DMIG"]);
    place.refused(&["reduce", "arm.h5", "--list"], &["HDF5", "Gmsh"]);
}

/// The bar of `tests/data/README.md`, written in three formats.
fn stored(place: &Place, name: &str) -> String {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    place.write(name, std::fs::read_to_string(from).unwrap());
    name.to_owned()
}

/// Truth: the bar in closed form, 70 GPa, 40 mm by 20 mm, 0.8 m, 1.728 kg; and one format against
/// the others.
#[test]
fn one_bar_in_three_formats_is_one_link() {
    let place = Place::new();
    let mut first: Option<(Vec<f64>, Vec<Vec<f64>>)> = None;
    for (name, words) in [
        ("bar.SID_FEM", &["--map", "A=1,B=2"][..]),
        ("bar.op4", &["--map", "A=#1-6,B=#7-12,modal=#13", "--at", "A=0,0,0", "--at", "B=800,0,0"]),
        ("bar.pch", &["--map", "A=1001,B=1002"]),
    ] {
        let file = stored(&place, name);
        let import = ["import", &file, "--units", "mm-t-s", "--no-files"];
        let said = place.json(&[&import[..], words].concat());
        let hz = numbers(&said["frequencies_hz"]);
        // Beam theory: 25.77 Hz and 51.55 Hz; measured +2.1 % and +1.7 %, since the ends are stiff.
        assert!((hz[0] / 25.77 - 1.0).abs() < 0.03 && (hz[1] / 51.55 - 1.0).abs() < 0.03, "{name}: {hz:?}");
        assert!((said["mass_kg"].as_f64().unwrap() / 1.728 - 1.0).abs() < 1e-9, "{name}");
        let stiffness = matrix(&said["stiffness"]);
        let Some((first_hz, first_K)) = &first else {
            assert_eq!((&said["modal"]["coordinates"], &said["modal"]["second_order"]), (&7.into(), &true.into()));
            first = Some((hz, stiffness));
            continue;
        };
        // DMIG has ten digits.
        let off = hz.iter().zip(first_hz).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 1e-8, "{name}: {off:e}");
        assert!(difference(first_K, &stiffness) < 1e-8, "{name}");
    }
}

#[test]
fn a_sid_needs_nodes() {
    let place = Place::new();
    let file = stored(&place, "bar.SID_FEM");
    let import = ["import", &file, "--units", "mm-t-s", "--no-files", "--map"];
    for (map, words) in [
        ("A=1,B=3", &["no node 3", "[1, 2]"][..]),
        ("A=1,B=1", &["node 1 twice"]),
        ("A=1", &["at least two nodes"]),
        ("A=#1-6,B=#7-12", &["A=1,B=2"]),
    ] {
        place.refused(&[&import[..], &[map]].concat(), words);
    }
    // In other axes it is the same link: the same frequencies, B at its rotated position.
    let turned = [&import[..], &["A=1,B=2", "--axes-rpy", "0,0,1.5707963267948966"]].concat();
    let [turned, own] = [turned, [&import[..], &["A=1,B=2"]].concat()].map(|words| place.json(&words));
    let hz = |said: &serde_json::Value| numbers(&said["modal"]["frequencies_hz"])[0];
    assert!((hz(&turned) / hz(&own) - 1.0).abs() < 1e-12);
    assert!((numbers(&turned["interfaces"][1]["position_m"])[1] - 0.8).abs() < 1e-12);
}

/// Truth: a cantilever with the figures of the sample and its own weight; see `shared/fe` for its
/// origin.
#[test]
#[ignore = "needs the reference data beside the project"]
fn a_sample_sid_runs_as_a_modal_link() {
    let path = sample("formats/beam_synthetic.SID_FEM");
    let place = Place::new();
    let import = ["import", path.to_str().unwrap(), "--units", "m-kg-s", "--map", "A=1001,B=1002", "--name", "bar"];
    let said = place.json(&[&import[..], &["--flex", "bar.flex"]].concat());
    assert_eq!(said["modal"]["coordinates"], 10);
    let urdf = common::URDF.replace("0.8 0 0", "1 0 0").replace("1.728", "39.25");
    place.write("beam.urdf", urdf);
    let robot = flex::robot();
    place.write("robot.toml", common::with(&robot, "damping", "model = \"modal\"\ndamping"));
    let modal = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
    assert_eq!(modal["links_model"], "modal");
    // 210 GPa, 100 mm x 50 mm lying flat; measured -1.1e-2, since its tied ends are stiff.
    let sag = modal["tcp"]["static_sag_m"].as_f64().unwrap();
    let truth = 9.81 / (210e9 * 0.1 * 0.05f64.powi(3) / 12.0) * (39.25 / 8.0 + 0.5 / 3.0);
    assert!((sag / truth - 1.0).abs() < 0.02, "{sag:.4e} instead of {truth:.4e}");
}

/// Truth: the link before it was written, with its mass and modes.
#[test]
#[ignore = "needs the reference data beside the project"]
fn mass_and_modes_survive_the_way_out_and_back() {
    let full = sample("A1_beam/beam_tet10_h50mm_ccx220_REAL.sti.gz");
    let place = Place::new();
    let map = "A=947:1-3+948:1-3,B=949:1-3+950:1-3";
    let full = ["import", full.to_str().unwrap(), "--map", map, "--modes", "4", "--name", "arm", "-o", "first"];
    let first = place.json(&[&full[..], &["--units", "m-kg-s", "--at", "A=0,0,0", "--at", "B=1,0,0"]].concat());
    let unknown = |said: &serde_json::Value| {
        said["warnings"].as_array().unwrap().iter().any(|w| w.as_str().unwrap().contains("second-order terms"))
    };
    assert!(unknown(&first) && first["modal"]["second_order"] == false, "{}", first["warnings"]);
    for (format, file, map) in [("matrix-market", "arm_K.mtx", ""), ("user-element", "arm.mtx", "A=1001,B=1002")] {
        let said = place.json(&["export", "first/arm.flex", "--format", format, "--units", "mm-t-s", "-o", format]);
        assert_eq!(said["modes"], 4);
        assert!(said["checks"]["mass_error"].as_f64().unwrap() < 1e-9, "{said}");
        let file = format!("{format}/{file}");
        let mut import = vec!["import", file.as_str(), "--no-files"];
        if !map.is_empty() {
            import.extend(["--units", "mm-t-s", "--map", map, "--at", "A=0,0,0", "--at", "B=1000,0,0"]);
        }
        let back = place.json(&import);
        let hz = |value: &serde_json::Value| numbers(&value["frequencies_hz"]);
        assert_eq!(hz(&back).len(), hz(&first).len());
        for (a, b) in hz(&back).iter().zip(hz(&first)) {
            assert!((a / b - 1.0).abs() < 1e-6, "{format}: {a} and {b}");
        }
    }
}
