//! Written files read back bit for bit, or up to the digits of the format.

use flexarm_fe_io::exchange::{
    DofLabel, Interface, Sidecar, SidecarInterface, assemble_interfaces, write_matrix_market, write_sidecar,
    write_simscape, write_user_element,
};
use flexarm_fem::UnitSystem;

use super::shared::{digits_error, parse, small_structure};
use crate::common::turned_arm;

fn labels(modes: usize) -> Vec<DofLabel> {
    let boundary = (0..12).map(|i| DofLabel::new(1001 + i / 6, i as u8 % 6 + 1));
    boundary.chain((0..modes).map(|i| DofLabel::new(2001 + i as i64, 0))).collect()
}

#[test]
fn matrix_market_with_its_sidecar_needs_no_further_answers() {
    let (K, M) = small_structure(3);
    let link = turned_arm();
    let interface =
        |name: &str, rows: &str, frame| SidecarInterface { interface: Interface::parse(name, rows).unwrap(), frame };
    let sidecar = Sidecar {
        stiffness: "arm \"1\"_K.mtx".into(),
        mass: Some("arm_M.mtx".into()),
        units: UnitSystem::SI,
        interfaces: vec![interface("A", "#1-6", link.X_LA), interface("B", "#7-12", link.X_LB)],
    };
    let imported = parse(&[
        ("arm.toml", &write_sidecar(&sidecar)),
        ("arm_K.mtx", &write_matrix_market(&K, &["K"])),
        ("arm_M.mtx", &write_matrix_market(&M, &["M"])),
    ]);
    assert_eq!(imported.sidecar, Some(sidecar));
    let read = assemble_interfaces(&imported, None, None).unwrap();
    assert_eq!((&read.K, read.M.as_ref(), read.modes), (&K, Some(&M), 3)); // bit for bit
}

#[test]
fn a_sidecar_is_found_beside_its_matrices_and_finds_them() {
    let folder = std::env::temp_dir().join(format!("flexarm_exchange_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (K, M) = small_structure(0);
    let sidecar = Sidecar {
        stiffness: "arm_K.mtx".into(),
        mass: Some("arm_M.mtx".into()),
        units: "mm-t-s".parse().unwrap(),
        interfaces: Vec::new(),
    };
    std::fs::write(folder.join("arm.toml"), write_sidecar(&sidecar)).unwrap();
    std::fs::write(folder.join("arm_K.mtx"), write_matrix_market(&K, &[])).unwrap();
    std::fs::write(folder.join("arm_M.mtx"), write_matrix_market(&M, &[])).unwrap();
    let read = |name: &str| flexarm_fe_io::exchange::read_matrices(&[folder.join(name)], &Default::default()).unwrap();
    let (by_sidecar, by_matrix) = (read("arm.toml"), read("arm_K.mtx"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(by_sidecar.sidecar.as_ref(), Some(&sidecar));
    assert_eq!(by_sidecar.mass.unwrap().dense(), Some(&M));
    assert_eq!(by_matrix.sidecar, Some(sidecar));
    assert_eq!(by_matrix.mass.unwrap().dense(), Some(&M));
}

/// The role in the sidecar applies whatever the file name is; other files are not mixed in.
#[test]
fn a_stiffness_finds_its_mass_through_the_sidecar() {
    let folder = std::env::temp_dir().join(format!("flexarm_exchange_mass_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (K, M) = small_structure(0);
    let sidecar = |stiffness: &str, mass: &str| Sidecar {
        stiffness: stiffness.into(),
        mass: Some(mass.into()),
        units: UnitSystem::SI,
        interfaces: Vec::new(),
    };
    let write = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
    write("arm.toml", write_sidecar(&sidecar("arm_K.mtx", "inertia.mtx")));
    write("stiff.toml", write_sidecar(&sidecar("stiff.mtx", "inertia.mtx")));
    write("arm_K.mtx", write_matrix_market(&K, &[]));
    write("stiff.mtx", write_matrix_market(&K, &[]));
    write("arm_Kb.mtx", write_matrix_market(&(&K * 3.0), &[]));
    write("inertia.mtx", write_matrix_market(&M, &[]));
    write("heavy_M.mtx", write_matrix_market(&(&M * 2.0), &[]));
    let read = |names: &[&str]| {
        let paths: Vec<_> = names.iter().map(|name| folder.join(name)).collect();
        flexarm_fe_io::exchange::read_matrices(&paths, &Default::default()).unwrap_or_else(|error| panic!("{error}"))
    };
    let found = [&["arm_K.mtx"][..], &["stiff.mtx"], &["arm_K.mtx", "heavy_M.mtx"], &["arm_Kb.mtx"]].map(read);
    std::fs::remove_dir_all(&folder).unwrap();
    let masses = found.each_ref().map(|found| found.mass.as_ref().map(|mass| mass.dense().unwrap().clone()));
    assert_eq!(masses, [Some(M.clone()), Some(M.clone()), Some(&M * 2.0), None]);
    assert_eq!(found[1].stiffness.dense(), Some(&K));
    assert_eq!(found[3].stiffness.dense(), Some(&(&K * 3.0)));
}

/// Fourteen digits: half of the last digit is 5e-14 of a number that starts with 1.
#[test]
fn a_user_element_reads_back_to_its_fourteen_digits() {
    let (K, M) = small_structure(2);
    let imported = parse(&[("x.mtx", &write_user_element(&K, Some(&M), &labels(2)))]);
    assert_eq!(imported.stiffness.rows, labels(2));
    assert!(digits_error(imported.stiffness.dense().unwrap(), &K) < 5.1e-14); // measured 4.1e-14
    assert!(digits_error(imported.mass.unwrap().dense().unwrap(), &M) < 5.1e-14); // measured 3.8e-14
}

#[test]
fn simscape_files_read_back_to_the_last_bit_and_frames_to_rounding() {
    let (K, M) = small_structure(2);
    let link = turned_arm();
    let frames = [link.X_LA, link.X_LB];
    let files = write_simscape("arm", &K, &M, &frames);
    let imported =
        parse(&[("arm_K.csv", &files.stiffness), ("arm_M.csv", &files.mass), ("arm_frames.csv", &files.frames)]);
    assert_eq!(imported.stiffness.dense(), Some(&K));
    assert_eq!(imported.mass.unwrap().dense(), Some(&M));
    for (read, written) in imported.frames.iter().zip(&frames) {
        assert_eq!(read.translation, written.translation);
        assert!((read.rotation.matrix() - written.rotation.matrix()).amax() < 1e-14); // measured 2.2e-16
    }
    assert!(files.script.contains("readmatrix('arm_K.csv')"));
}
