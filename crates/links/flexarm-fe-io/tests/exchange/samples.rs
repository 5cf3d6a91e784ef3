//! Every sample file against the common truth, up to the digits of its format.

use flexarm_fe_io::exchange::{
    DofLabel, Entries, InterfaceMap, MatrixFormat, MatrixNames, assemble_interfaces, propose_map, read_matrices,
};
use flexarm_fem::gate::check_matrix12;
use flexarm_fem::{GateLimits, Matrix12, UnitSystem};
use nalgebra::{DMatrix, Vector3};

use super::shared::{digits_error, read, samples, truth};

/// Stiffness and mass of the interfaces with the proposed map, SI.
fn assembled(folder: &std::path::Path, files: &[&str]) -> (DMatrix<f64>, Option<DMatrix<f64>>, usize) {
    let imported = read(folder, files);
    let map = propose_map(&imported.stiffness.rows).unwrap();
    let link = assemble_interfaces(&imported, Some(&map), Some(&UnitSystem::SI)).unwrap();
    (link.K, link.M, link.modes)
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn every_reduced_sample_holds_the_same_stiffness_and_mass() {
    let folder = samples();
    let (K, M) = truth(&folder);
    // Files, bound, and measured error of K and M against 17 digits.
    for (files, bound) in [
        (&["formats/mm_array_K12.mtx"][..], 0.0), // 0
        (&["formats/abaqus_matrix_input_STIF1.mtx", "formats/abaqus_matrix_input_MASS1.mtx"], 1e-14), // 4.5e-15, 3.4e-15
        (&["formats/abaqus_coordinate_MASS1.mtx", "formats/abaqus_coordinate_STIF1.mtx"], 1e-14), // 4.5e-15, 3.4e-15
        (&["formats/abaqus_user_element_K12_M12.mtx"], 5.1e-14),                                  // 4.3e-14, 4.5e-14
        (&["formats/calculix_layout_condensed_K12.mtx"], 5.1e-14),                                // 4.3e-14
        (&["formats/nastran_dmig_punch.pch"], 5.1e-10),                                           // 4.6e-10, 3.6e-10
        (&["formats/nastran_op4_text.op4"], 0.0),                                                 // 0, 0
        (&["formats/nastran_op4_binary_le.op4"], 0.0),                                            // 0, 0
        (&["formats/ansys_hbmat_K12.matrix", "formats/ansys_hbmat_K12.mapping"], 0.0),            // 0
        (&["formats/simscape_K.csv", "formats/simscape_M.csv", "formats/simscape_frames.csv"], 0.0), // 0, 0
    ] {
        let (K_read, M_read, modes) = assembled(&folder, files);
        let has_modes = files[0].contains("nastran") || files[0].contains("simscape");
        assert_eq!(modes, if has_modes { 10 } else { 0 }, "{files:?}");
        let error = digits_error(&K_read.view((0, 0), (12, 12)).into(), &K);
        assert!(error <= bound, "{files:?}: K {error:.1e}");
        if let Some(M_read) = M_read {
            let error = digits_error(&M_read.view((0, 0), (12, 12)).into(), &M);
            assert!(error <= bound, "{files:?}: M {error:.1e}");
        }
    }
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn each_sample_is_recognised_by_its_content() {
    let folder = samples();
    for (name, format) in [
        ("mm_array_K12.mtx", MatrixFormat::MatrixMarket),
        ("abaqus_user_element_K12_M12.mtx", MatrixFormat::UserElement),
        ("calculix_layout_condensed_K12.mtx", MatrixFormat::UserElement),
        ("abaqus_matrix_input_STIF1.mtx", MatrixFormat::LabelledText),
        ("abaqus_coordinate_STIF1.mtx", MatrixFormat::CoordinateText),
        ("nastran_dmig_punch.pch", MatrixFormat::Dmig),
        ("nastran_op4_text.op4", MatrixFormat::Op4Text),
        ("nastran_op4_binary_le.op4", MatrixFormat::Op4Binary),
        ("ansys_hbmat_K12.matrix", MatrixFormat::HarwellBoeing),
        ("ansys_hbmat_K12.mapping", MatrixFormat::EquationMapping),
        ("simscape_K.csv", MatrixFormat::Csv),
        ("simscape_frames.csv", MatrixFormat::CsvFrames),
        ("beam_synthetic.SID_FEM", MatrixFormat::Sid),
    ] {
        let bytes = std::fs::read(folder.join("formats").join(name)).unwrap();
        assert_eq!(flexarm_fe_io::exchange::recognise(&bytes), Some(format), "{name}");
    }
    let beam = folder.join("A1_beam");
    for (name, format) in [
        ("beam_tet10_h50mm_ccx220_REAL.sti.gz", MatrixFormat::CoordinateText),
        ("beam_tet10_h50mm_ccx220_REAL.dof.gz", MatrixFormat::DofList),
    ] {
        let bytes = std::fs::read(beam.join(name)).unwrap();
        assert_eq!(flexarm_fe_io::exchange::recognise(&bytes), Some(format), "{name}");
    }
    for name in ["mbdyn_modal.fem", "exudyn_femInterface_beam.npz.gz", "FORMATS.md"] {
        let error = read_matrices(&[folder.join("formats").join(name)], &MatrixNames::default()).unwrap_err();
        assert!(error.to_string().contains("an unknown format"), "{name}: {error}");
    }
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn the_full_matrices_of_calculix_are_read_with_their_rows() {
    let folder = samples();
    // `.mas` and `.dof` are found next to the `.sti`.
    let imported = read(&folder, &["A1_beam/beam_tet10_h50mm_ccx220_REAL.sti.gz"]);
    let (K, M) = (&imported.stiffness, imported.mass.as_ref().unwrap());
    let Entries::Sparse(sparse) = &K.entries else { panic!("a full model is sparse") };
    assert_eq!(sparse.n, K.rows.len());
    assert_eq!(K.rows[0], DofLabel::new(25, 1));
    assert_eq!(K.rows.last(), Some(&DofLabel::new(950, 3)));
    assert_eq!(sparse.triplets().next(), Some((0, 0, 4.497_626_620_268_5e9)));

    // The six rows of both interfaces exist, and the mass in a translation along x is that of the
    // beam.
    let map: InterfaceMap = "A=947:1-3+948:1-3,B=949:1-3+950:1-3".parse().unwrap();
    let along_x = |i: usize| f64::from(K.rows[i].dof == 1 && !matches!(K.rows[i].node, Some(948 | 950)));
    let moved: f64 =
        M.to_sparse().triplets().map(|(i, j, m)| if i == j { 1.0 } else { 2.0 } * m * along_x(i) * along_x(j)).sum();
    assert!((moved / 39.25 - 1.0).abs() < 1e-9, "{moved}"); // measured 9e-15
    let error = assemble_interfaces(&imported, Some(&map), Some(&UnitSystem::SI)).unwrap_err();
    assert!(error.to_string().contains("a full model must first be reduced"), "{error}");
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn craig_bampton_matrices_keep_their_modes_and_pass_the_gate() {
    let folder = samples();
    let meta: [(&str, Vector3<f64>); 2] =
        [("A1_beam/beam_tet10_h50mm_ccx", Vector3::x()), ("A1_beam/beam_hex20_20x4x2_ccx", Vector3::x())];
    for (stem, p_AB) in meta {
        let (K, M, modes) = assembled(&folder, &[&format!("{stem}_CB22_K.mtx"), &format!("{stem}_CB22_M.mtx")]);
        let M = M.unwrap();
        assert_eq!((modes, K.nrows(), M.nrows()), (10, 22, 22));
        assert!(digits_error(&M.view((12, 12), (10, 10)).map(f64::round), &DMatrix::identity(10, 10)) == 0.0);
        let K12 = Matrix12::from_fn(|i, j| K[(i, j)]);
        let (_, report) = check_matrix12(&K12, &p_AB, &GateLimits::default()).unwrap();
        assert!(report.rigid_body_residual.unwrap() < 1e-6, "{report:?}"); // measured 3.5e-10, 2.2e-8
    }
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn a_dmig_file_gives_positions_and_modes() {
    let folder = samples();
    let imported = read(&folder, &["formats/nastran_dmig_punch.pch"]);
    assert_eq!(imported.positions[&1002], Vector3::x());
    assert_eq!(imported.stiffness.name, "KAAX");
    assert_eq!(imported.stiffness.rows[12], DofLabel::new(2001, 0));
    assert_eq!(imported.stiffness.rows, imported.mass.unwrap().rows);
}
