//! Bad matrices with their error messages, and good ones from another FE program.

use std::path::{Path, PathBuf};

use crate::common::{lower_arm, turned_arm};
use flexarm_fem::gate::{check_matrix6, check_matrix12};
use flexarm_fem::{FemError, GateLimits};
use flexarm_spatial::Matrix12;
use nalgebra::Vector3;

const L: f64 = 1.095;

fn good() -> (Matrix12, Vector3<f64>) {
    (lower_arm().reduce().unwrap().matrix12(), Vector3::new(0.0, 0.0, L))
}

fn gate(K: &Matrix12, p_AB: Vector3<f64>) -> Result<flexarm_fem::GateReport, FemError> {
    check_matrix12(K, &p_AB, &GateLimits::default()).map(|(_, report)| report)
}

#[test]
fn a_beam_passes_with_margins_at_rounding() {
    let (K, p_AB) = good();
    let report = gate(&K, p_AB).unwrap();
    assert_eq!(report.asymmetry, 0.0);
    assert!(report.rigid_body_residual.unwrap() < 1e-14); // measured 0
    assert!(report.block_identity.unwrap() < 1e-14);
    assert!(report.min_eigenvalue > 0.1 && report.condition < 20.0, "{report:?}");
    assert!(report.warnings(&GateLimits::default()).is_empty());
}

/// The measures are dimensionless: millimetres instead of metres change nothing.
#[test]
fn the_gate_does_not_depend_on_units() {
    let link = turned_arm();
    let (K, p_AB) = (link.matrix12(), link.p_AB());
    let s: [f64; 12] = std::array::from_fn(|i| if i % 6 < 3 { 1.0 } else { 1e3 });
    let K_mm = Matrix12::from_fn(|i, j| K[(i, j)] * s[i] * s[j] * 1e-3);
    let (m, mm) = (gate(&K, p_AB).unwrap(), gate(&K_mm, p_AB * 1e3).unwrap());
    assert!((m.min_eigenvalue / mm.min_eigenvalue - 1.0).abs() < 1e-9); // measured 4e-15
    assert!(mm.rigid_body_residual.unwrap() < 1e-14);
}

#[test]
fn a_matrix_that_is_not_symmetric_is_named_with_the_place() {
    let (mut K, p_AB) = good();
    K[(0, 4)] *= 1.0 + 1e-6;
    match gate(&K, p_AB).unwrap_err() {
        FemError::NotSymmetric { asymmetry, row: 0, column: 4, .. } => {
            assert!(asymmetry > 1e-7 && asymmetry < 1e-5, "{asymmetry}");
        }
        other => panic!("{other}"),
    }
    let loose = GateLimits { asymmetry: 1e-5, ..GateLimits::default() };
    assert!(check_matrix12(&K, &p_AB, &loose).is_ok());
}

/// A spring of one per cent of the bending stiffness remains between B and the ground.
#[test]
fn a_grounded_matrix_moves_under_rigid_motion() {
    let (mut K, p_AB) = good();
    K[(7, 7)] *= 1.01;
    let error = gate(&K, p_AB).unwrap_err();
    let FemError::MovesUnderRigidMotion { ref row, motion, .. } = error else { panic!("{error}") };
    assert_eq!((row.as_str(), motion), ("B uy", "translation along y"));
    assert!(error.to_string().contains("moves under rigid motion"));
}

/// Matrix in millimetres, frames in metres: the matrix implies the distance between A and B.
#[test]
fn wrong_units_show_in_the_distance_that_the_matrix_implies() {
    let (K, p_AB) = good();
    let error = gate(&K, p_AB * 1e-3).unwrap_err();
    let FemError::MovesUnderRigidMotion { implied_p_AB: Some(implied), .. } = error else { panic!("{error}") };
    assert!((implied - p_AB).norm() < 1e-9); // measured 2e-16
    assert!(error.to_string().contains("the matrix itself (0.000000, 0.000000, 1.095000) m"));
}

/// A distal interface on a hinge about x: no resistance to that rotation.
#[test]
fn a_mechanism_is_singular_in_its_direction() {
    let mut K = lower_arm().reduce().unwrap().K_BB;
    // Condense the rotation about x and put a frictionless hinge in its place.
    let column = K.column(3).into_owned();
    K -= column * column.transpose() / column[3];
    let hinge = check_matrix6("K_BB", &K, &GateLimits::default()).unwrap_err();
    assert!(hinge.to_string().contains("singular") && hinge.to_string().contains("rx 1.000"), "{hinge}");

    // The same mechanism away from the axes: the free direction mixes uy and rx.
    let X = flexarm_fem::Pose::translation(0.0, 0.0, 0.3);
    let Ad = flexarm_spatial::adjoint(&X);
    K[(3, 3)] = 1e-7;
    let moved = Ad.transpose() * K * Ad;
    let moved = (moved + moved.transpose()) * 0.5;
    let error = check_matrix6("K_BB", &moved, &GateLimits::default()).unwrap_err();
    let FemError::NotPositiveDefinite { min_eigenvalue, direction, .. } = error else { panic!("{error}") };
    assert!(min_eigenvalue.abs() < 1e-10, "{min_eigenvalue:e}");
    assert!((direction.0[3].abs() - 1.0).abs() < 1e-6, "{direction}");
    assert!((direction.0[1].abs() - 0.3).abs() < 1e-6, "{direction}");
}

#[test]
fn entries_that_are_no_numbers_are_named() {
    let (mut K, p_AB) = good();
    K[(2, 9)] = f64::NAN;
    let error = gate(&K, p_AB).unwrap_err();
    assert!(matches!(error, FemError::NotFinite { row: 2, column: 9, .. }), "{error}");
}

/// Extreme values must give an error, not an endless loop of the eigensolver.
#[test]
fn absurd_sizes_end_in_an_error() {
    for (i, j, value) in [(0, 1, 1e300), (0, 0, 1e-320), (5, 5, 1e308), (0, 5, f64::MAX)] {
        let (mut K, p_AB) = good();
        K[(i, j)] = value;
        K[(j, i)] = value;
        assert!(gate(&K, p_AB).is_err());
    }
    assert!(gate(&Matrix12::zeros(), Vector3::new(0.0, 0.0, 0.0)).is_err());
    assert!(gate(&Matrix12::identity(), Vector3::new(0.0, 0.0, 1.0)).is_err());
}

/// Other tool: matrices of CalculiX 2.20, condensed with scipy, printed with 17 digits.
#[test]
#[ignore = "needs the reference data beside the project"]
fn matrices_of_calculix_pass() {
    let folder = reference_folder();
    let cases = [
        ("A1_beam/beam_hex20_20x4x2_ccx_K12.mtx", Vector3::new(1.0, 0.0, 0.0)),
        ("A1_beam/beam_tet10_h50mm_ccx_K12.mtx", Vector3::new(1.0, 0.0, 0.0)),
        ("A2_lower_arm/arm_tet10_h30mm_ccx_K12.mtx", Vector3::new(0.04, 0.185, 1.1)),
    ];
    for (file, p_AB) in cases {
        let K = read_array(&folder.join(file));
        let report = gate(&K, p_AB).unwrap();
        assert!(report.rigid_body_residual.unwrap() < 1e-6, "{file}: {report:?}");
        assert!(report.block_identity.unwrap() < 1e-6, "{file}: {report:?}");
    }
}

/// The folder of reference data, below FLEXARM_SHARED or beside the project.
fn reference_folder() -> PathBuf {
    let named = std::env::var_os("FLEXARM_SHARED").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("shared"));
    let mut found = named.into_iter().chain(above).map(|shared| shared.join("fe"));
    found.find(|folder| folder.is_dir()).expect("the folder fe")
}

/// Reads a 12×12 in Matrix Market array format: comments, sizes, one entry per line, by columns.
fn read_array(path: &Path) -> Matrix12 {
    let text = std::fs::read_to_string(path).unwrap();
    let entries: Vec<f64> =
        text.lines().filter(|line| !line.starts_with('%')).skip(1).map(|line| line.trim().parse().unwrap()).collect();
    Matrix12::from_column_slice(&entries)
}
