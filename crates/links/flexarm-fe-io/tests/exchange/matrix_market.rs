//! Matrix Market files.

use flexarm_fe_io::exchange::{LabelledMatrix, write_matrix_market};
use flexarm_fe_io::internals::{Text, parse_matrix_market as parse};
use flexarm_fe_io::{FeFileError, FilePosition};
use nalgebra::DMatrix;

fn parse_text(text: &str) -> Result<LabelledMatrix, FeFileError> {
    parse(Text::new(text, "test.mtx"))
}

const TRUTH: [f64; 4] = [4.0, -1.5, -1.5, 3.0];

#[test]
fn every_layout_gives_the_same_matrix() {
    for text in [
        "%%MatrixMarket matrix coordinate real symmetric\n% note\n2 2 3\n1 1 4\n2 1 -1.5\n2 2 3\n",
        "%%MatrixMarket matrix coordinate real symmetric\r\n2 2 3\r\n2 2 3\r\n1 2 -1.5D0\r\n1 1 4\r\n",
        "%%matrixmarket MATRIX coordinate real general\n2 2 4\n1 1 4\n2 1 -1.5\n1 2 -1.5\n2 2 3\n",
        "%%MatrixMarket matrix array real symmetric\n2 2\n4\n-1.5\n3\n",
        "%%MatrixMarket matrix array real general\n2 2\n4\n-1.5\n-1.5\n\n3\n",
    ] {
        assert_eq!(parse_text(text).unwrap().dense().unwrap().as_slice(), TRUTH, "{text}");
    }
}

#[test]
fn what_cannot_be_a_stiffness_is_refused_with_the_reason() {
    for (text, words) in [
        ("%%MatrixMarket matrix coordinate pattern symmetric\n1 1 1\n1 1\n", "pattern"),
        ("%%MatrixMarket matrix coordinate real skew-symmetric\n1 1 1\n1 1\n", "skew"),
        ("%%MatrixMarket matrix array complex general\n1 1\n1 1\n", "complex"),
        ("%%MatrixMarket matrix array real general\n1 2\n1\n1\n", "square"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 4\n2 1 1\n", "cut off"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n3 1 4\n", "row 3"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n1 1 nan\n", "nan"),
        ("%%MatrixMarket matrix coordinate real symmetric\n4000000000 4000000000 1\n1 1 1\n", "rows"),
    ] {
        let error = parse_text(text).unwrap_err();
        assert!(error.to_string().contains(words) && error.origin.as_ref() == "test.mtx", "{error}");
    }
}

#[test]
fn unequal_doubles_are_refused_with_both_values_and_the_line() {
    let twice = "%%MatrixMarket matrix coordinate real general\n2 2 5\n1 1 4\n2 1 -1\n1 2 -2\n2 2 3\n1 1 4\n";
    let error = parse_text(twice).unwrap_err();
    assert_eq!(error.place, FilePosition::Line(5));
    assert!(error.found.contains("-1e0") && error.found.contains("-2e0"), "{error}");
    let rounding = twice.replace("-2", "-1.00000000001");
    assert!(parse_text(&rounding).unwrap().asymmetry > 1e-12);
    let same_place = twice.replace("1 2 -2", "2 1 -1.00000000001");
    assert!(parse_text(&same_place).unwrap_err().found.contains("the entry twice"));
}

#[test]
fn a_written_matrix_reads_back_to_the_last_bit() {
    let x = [1.0 / 3.0, -1e-300, 2.5e20, f64::MIN_POSITIVE, 0.1, 7e7];
    let matrix = DMatrix::from_row_slice(3, 3, &[x[0], x[1], x[2], x[1], x[3], x[4], x[2], x[4], x[5]]);
    let text = write_matrix_market(&matrix, &["two\nlines"]);
    assert_eq!(parse_text(&text).unwrap().dense(), Some(&matrix));
}
