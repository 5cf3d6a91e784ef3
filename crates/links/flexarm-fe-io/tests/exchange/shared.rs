//! Location of the samples, and small structures for tests.

use std::path::{Path, PathBuf};

use flexarm_fe_io::exchange::{ImportedMatrices, InputFile, MatrixNames, parse_matrices, read_matrices};
use nalgebra::DMatrix;

/// The folder `shared/fe`, from `FLEXARM_SHARED` or above the crate. Tests that call it are ignored by default.
pub(crate) fn samples() -> PathBuf {
    let named = std::env::var_os("FLEXARM_SHARED").map(|shared| PathBuf::from(shared).join("fe"));
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("shared/fe"));
    let found = named.into_iter().chain(above).find(|folder| folder.is_dir());
    found.expect("the folder fe, below FLEXARM_SHARED or beside the project")
}

/// Reads samples with paths relative to `shared/fe`.
pub(crate) fn read(folder: &Path, files: &[&str]) -> ImportedMatrices {
    let paths: Vec<_> = files.iter().map(|file| folder.join(file)).collect();
    read_matrices(&paths, &MatrixNames::default()).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn parse(files: &[(&str, &str)]) -> ImportedMatrices {
    let files: Vec<_> = files.iter().map(|(origin, text)| InputFile::new(*origin, *text)).collect();
    parse_matrices(&files, &MatrixNames::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Truth for all samples of case A1: Matrix Market with 17 digits.
pub(crate) fn truth(folder: &Path) -> (DMatrix<f64>, DMatrix<f64>) {
    let files = ["formats/mm_coordinate_symmetric_K12.mtx", "formats/mm_coordinate_symmetric_M12.mtx"];
    let imported = read(folder, &files);
    (imported.stiffness.dense().unwrap().clone(), imported.mass.unwrap().dense().unwrap().clone())
}

/// Maximum `|a_ij - b_ij| / sqrt(b_ii b_jj)`.
pub(crate) fn scaled_error(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    assert_eq!(a.shape(), b.shape());
    let s = b.diagonal().map(f64::sqrt);
    let places = (0..b.nrows()).flat_map(|i| (0..b.nrows()).map(move |j| (i, j)));
    places.map(|(i, j)| (a[(i, j)] - b[(i, j)]).abs() / (s[i] * s[j])).fold(0.0, f64::max)
}

/// Maximum `|a_ij - b_ij| / |b_ij|`: the digits of the format.
pub(crate) fn digits_error(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    assert_eq!(a.shape(), b.shape());
    a.iter().zip(b).filter(|(a, b)| a != b).map(|(a, b)| (a - b).abs() / b.abs()).fold(0.0, f64::max)
}

/// Stiffness and mass of a rotated beam with offset and `modes` modal coordinates, SI; all
/// couplings are non-zero.
pub(crate) fn small_structure(modes: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let link = crate::common::turned_arm();
    let K12 = link.matrix12();
    let n = 12 + modes;
    let K = DMatrix::from_fn(n, n, |i, j| match (i, j) {
        (0..12, 0..12) => K12[(i, j)],
        _ if i == j => 1e6 * (i as f64 - 11.0).powi(2),
        _ => 0.0,
    });
    let mass = |i: usize, j: usize| ((i * j) as f64 + 0.3).sin() * 0.1 + f64::from(i == j) * (3.0 + i as f64);
    let M = DMatrix::from_fn(n, n, |i, j| if i >= 12 && j >= 12 { f64::from(i == j) } else { mass(i, j) });
    (K, M)
}
