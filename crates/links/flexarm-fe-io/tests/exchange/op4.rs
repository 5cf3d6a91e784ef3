//! Nastran OUTPUT4 and Harwell-Boeing in the variants that are not among the samples.

use flexarm_fe_io::FilePosition;
use flexarm_fe_io::exchange::{InputFile, MatrixFormat, MatrixNames, parse_matrices, recognise};
use nalgebra::DMatrix;
use proptest::prelude::*;

use crate::common::fixed_cases;

/// Matrix with a gap in a column, which requires sparse strings: rows 1-2 and 4 of column 1.
fn matrix() -> DMatrix<f64> {
    DMatrix::from_row_slice(4, 4, &[4.0, -1.5, 0.0, 0.25, -1.5, 3.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.25, 0.0, 0.0, 5.0])
}

/// Variant of the file format.
#[derive(Debug, Clone, Copy)]
struct Variant {
    big_endian: bool,
    double: bool,
    sparse: bool,
    big_matrix: bool,
}

fn variants() -> impl Iterator<Item = Variant> {
    (0..16).map(|bits| Variant {
        big_endian: bits & 1 != 0,
        double: bits & 2 != 0,
        sparse: bits & 4 != 0,
        big_matrix: bits & 8 != 0,
    })
}

/// Runs of non-zero entries of a column: first row (from 1) and values.
fn strings(column: &[f64]) -> Vec<(usize, Vec<f64>)> {
    let mut strings: Vec<(usize, Vec<f64>)> = Vec::new();
    for (i, value) in column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
        match strings.last_mut() {
            Some((first, values)) if *first + values.len() == i + 1 => values.push(*value),
            _ => strings.push((i + 1, vec![*value])),
        }
    }
    strings
}

/// The matrix as a binary OP4 file, written according to the description of the format.
fn binary(A: &DMatrix<f64>, v: Variant) -> Vec<u8> {
    let int = |n: i64| if v.big_endian { (n as i32).to_be_bytes() } else { (n as i32).to_le_bytes() };
    let real = |x: f64| match (v.double, v.big_endian) {
        (true, true) => x.to_be_bytes().to_vec(),
        (true, false) => x.to_le_bytes().to_vec(),
        (false, true) => (x as f32).to_be_bytes().to_vec(),
        (false, false) => (x as f32).to_le_bytes().to_vec(),
    };
    let record = |payload: Vec<u8>| {
        [int(payload.len() as i64).to_vec(), payload.clone(), int(payload.len() as i64).to_vec()].concat()
    };
    let n = A.nrows() as i64;
    let words = if v.double { 2 } else { 1 };
    let head = [n, if v.big_matrix { -n } else { n }, 6, if v.double { 2 } else { 1 }];
    let mut file = record([head.map(int).concat(), b"KAAX    ".to_vec()].concat());
    for (j, column) in A.column_iter().enumerate() {
        let values: Vec<f64> = column.iter().copied().collect();
        let mut data = Vec::new();
        if v.sparse {
            for (row, values) in strings(&values) {
                let length = (values.len() * words) as i64;
                let lead =
                    if v.big_matrix { vec![length + 1, row as i64] } else { vec![row as i64 + 65536 * (length + 1)] };
                data.extend(lead.into_iter().flat_map(int));
                data.extend(values.into_iter().flat_map(real));
            }
        } else {
            data.extend(values.into_iter().flat_map(real));
        }
        let ints = [j as i64 + 1, i64::from(!v.sparse), data.len() as i64 / 4];
        file.extend(record([ints.map(int).concat(), data].concat()));
    }
    file.extend(record([[n + 1, 1, words as i64].map(int).concat(), real(1.0)].concat()));
    file
}

/// The same as text; a double counts as two words in strings, as one in dense columns.
fn text(A: &DMatrix<f64>, v: Variant) -> String {
    let n = A.nrows() as i64;
    let rows = if v.big_matrix { -n } else { n };
    let mut text = format!("{n:8}{rows:8}{:8}{:8}KAAX    1P,3E23.16\n", 6, 2);
    let values = |values: &[f64]| -> String {
        let printed: Vec<_> =
            values.iter().map(|x| format!("{:>23}", format!("{x:.16E}").replace("E-", "E-0"))).collect();
        printed.chunks(3).map(|line| line.concat() + "\n").collect()
    };
    for (j, column) in A.column_iter().enumerate() {
        let entries: Vec<f64> = column.iter().copied().collect();
        if !v.sparse {
            text += &format!("{:8}{:8}{n:8}\n{}", j + 1, 1, values(&entries));
            continue;
        }
        text += &format!("{:8}{:8}{:8}\n", j + 1, 0, 99);
        for (row, entries) in strings(&entries) {
            let length = 2 * entries.len() + 1;
            text +=
                &if v.big_matrix { format!("{length:8}{row:8}\n") } else { format!("{:8}\n", row + 65536 * length) };
            text += &values(&entries);
        }
    }
    text + &format!("{:8}{:8}{:8}\n{}", n + 1, 1, 1, values(&[1.0]))
}

fn read(bytes: impl Into<Vec<u8>>) -> DMatrix<f64> {
    let files = [InputFile::new("x.op4", bytes)];
    let imported = parse_matrices(&files, &MatrixNames::default()).unwrap_or_else(|error| panic!("{error}"));
    imported.stiffness.dense().unwrap().clone()
}

#[test]
fn every_variant_of_op4_gives_the_same_matrix() {
    for variant in variants() {
        let bytes = binary(&matrix(), variant);
        assert_eq!(recognise(&bytes), Some(MatrixFormat::Op4Binary));
        assert_eq!(read(bytes), matrix(), "{variant:?}"); // exact also in single precision
        let text = text(&matrix(), variant);
        assert_eq!(recognise(text.as_bytes()), Some(MatrixFormat::Op4Text), "{text}");
        assert_eq!(read(text.as_bytes()), matrix(), "{variant:?}\n{text}");
    }
}

#[test]
fn op4_files_that_are_cut_off_are_refused() {
    for variant in variants() {
        let (bytes, text) = (binary(&matrix(), variant), text(&matrix(), variant));
        for bytes in [&bytes[..bytes.len() - 9], &text.as_bytes()[..text.len() - 60]] {
            let error = parse_matrices(&[InputFile::new("x", bytes)], &MatrixNames::default()).unwrap_err();
            assert!(error.help.contains("cut off"), "{variant:?}: {error}");
        }
    }
}

#[test]
fn unsymmetric_harwell_boeing_is_read_and_complex_is_refused() {
    let head = "title                                                                   key     \n\
                \x20            5             1             1             2             0\n";
    let body = "RUA                        2             2             4             0\n\
                (3I4)           (4I4)           (2E12.4)            \n\
                \x20  1   3   5\n   1   2   1   2\n  4.0000E+00 -1.5000E+00\n -1.5000D+00  3.0000E+00\n";
    assert_eq!(read(format!("{head}{body}")).as_slice(), [4.0, -1.5, -1.5, 3.0]);
    let refuse = |from: &str, to: &str| {
        let changed = format!("{head}{}", body.replacen(from, to, 1));
        parse_matrices(&[InputFile::new("x", changed)], &MatrixNames::default()).unwrap_err()
    };
    assert_eq!(&*refuse("RUA", "CUA").element, "type");
    assert_eq!(&*refuse("   5\n", "   9\n").element, "column pointer");
    assert_eq!(refuse("   1   2   1   2\n", "   1   2   1   3\n").place, FilePosition::Line(6));
    assert_eq!(&*refuse("             4  ", "       4000000  ").element, "matrix");
}

proptest! {
    #![proptest_config(fixed_cases())]

    #[test]
    fn op4_files_with_changed_bytes_do_not_panic(
        bits in 0..16_usize,
        is_text in any::<bool>(),
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
    ) {
        let variant = variants().nth(bits).unwrap();
        let mut bytes = if is_text { text(&matrix(), variant).into_bytes() } else { binary(&matrix(), variant) };
        for (place, byte) in changes {
            let i = place.index(bytes.len());
            bytes[i] = byte;
        }
        bytes.truncate(cut.index(2 * bytes.len()));
        let _ = parse_matrices(&[InputFile::new("fuzz", bytes)], &MatrixNames::default());
    }
}
