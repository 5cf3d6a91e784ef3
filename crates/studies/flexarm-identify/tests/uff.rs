//! Universal files of modal tests.

use std::path::Path;

use flexarm_files::TextFileError;
use flexarm_identify::internals::UffFunction;
use nalgebra::Complex;

fn read_functions(bytes: &[u8]) -> Result<Vec<UffFunction>, TextFileError> {
    flexarm_identify::internals::read_functions(Path::new("hammer.uff"), bytes)
}

/// Writes a function with three values at equal spacing; `values` follows the header.
fn dataset(kind: &str, form: i64, spacing: i64, values: &[u8]) -> Vec<u8> {
    let mut text = format!("    -1\n    {kind}\nfirst\nNONE\nNONE\nNONE\nNONE\n").into_bytes();
    let places =
        format!("{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}\n", 4, 0, 0, 0, "NONE", 12, -3, "NONE", 7, 1);
    text.extend(places.bytes());
    text.extend(format!("{form:10}{:10}{spacing:10}{:13.5E}{:13.5E}{:13.5E}\n", 3, 10.0, 0.5, 0.0).bytes());
    text.extend(format!("{:10}{:5}{:5}{:5} {:20} {:20}\n", 18, 0, 0, 0, "Frequency", "Hz").bytes());
    text.extend(format!("{:10}{:5}{:5}{:5} {:20} {:20}\n", 12, 0, 0, 0, "Acceleration", "m/s^2").bytes());
    text.extend(format!("{:10}{:5}{:5}{:5} {:20} {:20}\n", 13, 0, 0, 0, "Force", "N").bytes());
    text.extend(b"         0    0    0    0 NONE                 NONE\n");
    text.extend(values);
    text.extend(b"\n    -1\n");
    text
}

/// Truth: the numbers that were written.
#[test]
fn a_function_is_the_same_as_text_and_in_both_orders_of_bytes() {
    let H = [(1.5, -2.0), (0.25, 3.0), (-1e-3, 4e-7)];
    let text = "  1.50000E+00 -2.00000E+00  2.50000E-01  3.00000E+00 -1.00000E-03  4.00000E-07";
    let flat: Vec<f64> = H.iter().flat_map(|(a, b)| [*a, *b]).collect();
    let expected: Vec<(f64, Complex<f64>)> =
        H.iter().enumerate().map(|(k, (a, b))| (10.0 + 0.5 * k as f64, Complex::new(*a, *b))).collect();
    let head = |order: usize, bytes: usize| {
        format!("58b     {order}     2          11  {bytes:12}     0     0           0           0")
    };
    let little: Vec<u8> = flat.iter().flat_map(|x| x.to_le_bytes()).collect();
    let big: Vec<u8> = flat.iter().flat_map(|x| x.to_be_bytes()).collect();
    let single: Vec<u8> = flat.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect();
    let uneven = "  1.00000E+01  1.50000000000E+00 -2.00000000000E+00\n  1.05000E+01  2.50000000000E-01  3.00000000000E+00\n\
                  1.10000E+01-1.00000000000E-03 4.00000000000E-07";
    for (kind, form, spacing, values, within) in [
        ("58".to_owned(), 5, 1, text.as_bytes(), 1e-15),
        ("58".to_owned(), 6, 0, uneven.as_bytes(), 1e-15),
        (head(1, 48), 6, 1, &little[..], 0.0),
        (head(2, 48), 6, 1, &big[..], 0.0),
        (head(1, 24), 5, 1, &single[..], 1e-7),
    ] {
        let found = read_functions(&dataset(&kind, form, spacing, values)).unwrap();
        let [one] = &found[..] else { panic!("{found:?}") };
        assert_eq!((one.response, one.reference, one.ordinate), ((12, -3), (7, 1), 12));
        assert_eq!((one.unit.as_str(), one.values.len()), ("m/s^2", 3));
        for ((hz, H), (f, truth)) in one.values.iter().zip(&expected) {
            assert!((hz - f).abs() < 1e-12 && (H - truth).norm() <= within * 5.0, "{kind}: {hz} {H}");
        }
    }
}

/// An error names the line of the form, of the word, or of the end of the file.
#[test]
fn a_broken_file_is_refused_with_its_line() {
    let head = "58b     1     2          11            96     0     0           0           0";
    let cases: [(Vec<u8>, &str); 6] = [
        (dataset(head, 6, 1, &[0; 48]), "hammer.uff:9:1: 6 numbers of 8 bytes are announced"),
        (dataset("58", 5, 1, b"  1.5 2.5"), "hammer.uff:15:1: found 2 of the 6 values announced in line 9"),
        (dataset("58", 5, 1, b"  1.5 2.5\n 1.0 x"), "hammer.uff:15:1: expected a number, found \"x\""),
        (dataset("58b 3 2 11 24", 5, 1, b""), "hammer.uff:2:1: expected `58b`"),
        (b"solid x".to_vec(), "hammer.uff:1:1: this is not a universal file"),
        (b"    -1\n    151\nx\n    -1\n".to_vec(), "hammer.uff:1:1: the file has no frequency response"),
    ];
    for (bytes, expected) in cases {
        let error = read_functions(&bytes).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn units_before_a_function_belong_to_it() {
    let mut text = b"    -1\n   164\n         9mm, mN                       2\n 1.00000000000000D+03 1.00000000000000D+03 1.0\n-2.7E+02\n    -1\n".to_vec();
    text.extend(dataset("58", 5, 1, b" 1 2 3 4 5 6"));
    assert_eq!(read_functions(&text).unwrap()[0].per_si, Some([1e3, 1e3]));
}
