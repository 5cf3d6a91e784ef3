//! DMIG entries of Nastran.

use flexarm_fe_io::exchange::DofLabel;
use flexarm_fe_io::internals::{Text, parse_dmig as parse};
use nalgebra::Vector3;

const LARGE: &str = "\
$ note
GRID          11             0.0     0.5    1.-3
DMIG    KAAX           0       6       2       0
DMIG*   KAAX                          11               1
*                     11               1 4.000000000D+00
*                     12               0-1.500000000D+00
DMIG*   KAAX                          12               0
*                     12               0 3.000000000D+00
";
const SMALL: &str = "\
DMIG    KAAX    0       1       1       0
DMIG    KAAX    11      1               11      1       4.0
        12      0       -1.5
DMIG    KAAX    12      0               12      0       3.0+0
+       11      1       -15.-1
";
const FREE: &str = "\
DMIG,KAAX,0,6,2
DMIG,KAAX,11,1,,11,1,4.
,12,,-1.5,,
DMIG*,KAAX,12,0,
*,12,0,3.D0
";

#[test]
fn large_small_and_free_field_read_alike() {
    for text in [LARGE.to_owned(), SMALL.to_owned(), FREE.to_owned(), LARGE.replace('\n', "\r\n")] {
        let dmig = parse(Text::new(&text, "t.pch")).unwrap();
        let K = &dmig.matrices[0];
        assert_eq!(K.dense().unwrap().as_slice(), [4.0, -1.5, -1.5, 3.0], "{text}");
        assert_eq!(K.rows, [DofLabel::new(11, 1), DofLabel::new(12, 0)]);
    }
    let dmig = parse(Text::new(LARGE, "t.pch")).unwrap();
    assert_eq!(dmig.positions[&11], Vector3::new(0.0, 0.5, 1e-3));
}

#[test]
fn complex_matrices_are_refused_and_rectangular_ones_left_out() {
    let complex = LARGE.replace("       2       0\n", "       4       0\n");
    let error = parse(Text::new(&complex, "t.pch")).unwrap_err();
    assert!(error.to_string().contains("t.pch:3: DMIG KAAX, TIN: found \"4\""), "{error}");
    let loads = "DMIG,PAX,0,9,2,0,,,2\nDMIG,PAX,1,0,,11,1,5.\nDMIG,PAX,2,0,,11,2,6.\n";
    let dmig = parse(Text::new(loads, "t.pch")).unwrap();
    assert!(dmig.matrices.is_empty() && dmig.warnings[0].contains("PAX is rectangular"));
    // Scalar points 1 and 2 loaded by columns 1 and 2: the same labels, but not a symmetric
    // matrix.
    for form in [2, 9] {
        let scalar = format!("DMIG,KPAX,0,{form},2,0,,,2\nDMIG,KPAX,1,0,,1,0,5.,\n,2,0,7.\nDMIG,KPAX,2,0,,2,0,6.\n");
        let dmig = parse(Text::new(&scalar, "t.pch")).unwrap();
        assert!(dmig.matrices.is_empty() && dmig.warnings[0].contains("KPAX is rectangular"), "{form}: {dmig:?}");
    }
}

#[test]
fn a_column_without_header_and_a_bad_value_are_named_with_line() {
    let error = parse(Text::new("DMIG*   KAAX                          11               1\n", "t")).unwrap_err();
    assert!(error.to_string().contains("its header first"), "{error}");
    let bad = LARGE.replace("-1.500000000D+00", "-1.5O0000000D+00");
    let error = parse(Text::new(&bad, "t")).unwrap_err();
    assert_eq!(error.place, flexarm_fe_io::FilePosition::Line(6));
    assert!(error.element.contains("row 12:0, column 11:1"), "{error}");
}
