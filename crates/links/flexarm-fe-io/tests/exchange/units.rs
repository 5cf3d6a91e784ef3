//! Units are converted in one place; a file in millimetres and tonnes gives the same structure.

use flexarm_fe_io::exchange::{DofLabel, InterfaceMap, assemble_interfaces, write_matrix_market, write_user_element};
use flexarm_fem::UnitSystem;
use nalgebra::DMatrix;

use super::shared::{digits_error, parse, scaled_error, small_structure};

/// The same structure in mm, t, s: N/mm, N, N·mm; t, t·mm, t·mm²; modes normalised to one tonne.
///
/// Written out per block, independently of the rule under test.
fn in_mm_t_s(K: &DMatrix<f64>, M: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let kind = |i: usize| if i >= 12 { 2 } else { usize::from(i % 6 >= 3) };
    let sqrt_t = 1e3_f64.sqrt();
    let per_K = [[1e-3, 1.0, f64::NAN], [1.0, 1e3, f64::NAN], [f64::NAN, f64::NAN, 1.0]];
    let per_M = [[1e-3, 1.0, 1.0 / sqrt_t], [1.0, 1e3, 1e3 / sqrt_t], [1.0 / sqrt_t, 1e3 / sqrt_t, 1.0]];
    let scaled =
        |A: &DMatrix<f64>, by: [[f64; 3]; 3]| {
            DMatrix::from_fn(A.nrows(), A.nrows(), |i, j| {
                if A[(i, j)] == 0.0 { 0.0 } else { A[(i, j)] * by[kind(i)][kind(j)] }
            })
        };
    (scaled(K, per_K), scaled(M, per_M))
}

#[test]
fn a_copy_in_mm_t_s_gives_the_same_structure() {
    let map: InterfaceMap = "A=#1-6,B=#7-12".parse().unwrap();
    let units: UnitSystem = "mm-t-s".parse().unwrap();
    {
        let (K, M) = small_structure(4);
        let (K_mm, M_mm) = in_mm_t_s(&K, &M);
        let (K_text, M_text) = (write_matrix_market(&K_mm, &[]), write_matrix_market(&M_mm, &[]));
        let imported = parse(&[("a_K.mtx", &K_text), ("a_M.mtx", &M_text)]);
        let link = assemble_interfaces(&imported, Some(&map), Some(&units)).unwrap();
        assert!(digits_error(&link.K, &K) < 1e-12); // measured 2.3e-16
        assert!(digits_error(&link.M.unwrap(), &M) < 1e-12); // measured 2.5e-16
        assert_eq!(link.modes, K.nrows() - 12);
    }
}

/// B first in the file, rotations before translations: the map restores the order.
#[test]
fn the_map_reorders_rows_of_any_file() {
    let (K, M) = small_structure(2);
    let order: Vec<usize> = [9, 10, 11, 6, 7, 8, 12, 3, 4, 5, 0, 1, 2, 13].into();
    let label = |i: usize| match i {
        0..6 => DofLabel::new(30, i as u8 + 1),
        6..12 => DofLabel::new(20, i as u8 - 5),
        _ => DofLabel::new(100 + i as i64, 0),
    };
    let rows: Vec<_> = order.iter().map(|&i| label(i)).collect();
    let permuted = |A: &DMatrix<f64>| DMatrix::from_fn(14, 14, |i, j| A[(order[i], order[j])]);
    let text = write_user_element(&permuted(&K), Some(&permuted(&M)), &rows);
    let map: InterfaceMap = "A=30,B=20".parse().unwrap();
    let link = assemble_interfaces(&parse(&[("a.mtx", &text)]), Some(&map), Some(&UnitSystem::SI)).unwrap();
    assert!(scaled_error(&link.K, &K) < 1e-9); // the digits of the format
    assert!(scaled_error(&link.M.unwrap(), &M) < 1e-9);
    assert_eq!(link.names, ["A", "B"]);
}
