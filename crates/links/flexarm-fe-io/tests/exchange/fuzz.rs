//! Arbitrary bytes: errors, but no panic, no hang, and no allocation of a size declared in a
//! header.

use std::io::Read;
use std::time::{Duration, Instant};

use flexarm_fe_io::FeFileError;
use flexarm_fe_io::exchange::{
    ImportedMatrices, InputFile, MatrixNames, parse_matrices, write_matrix_market, write_user_element,
};
use proptest::prelude::*;

use super::shared::samples;
use crate::common::fixed_cases;

fn parse(bytes: &[u8]) -> Result<ImportedMatrices, FeFileError> {
    parse_matrices(&[InputFile::new("fuzz", bytes)], &MatrixNames::default())
}

/// One small complete file of every format.
fn seeds() -> Vec<Vec<u8>> {
    let K = nalgebra::DMatrix::from_row_slice(2, 2, &[4.0, -1.5, -1.5, 3.0]);
    let rows = [flexarm_fe_io::exchange::DofLabel::new(7, 1), flexarm_fe_io::exchange::DofLabel::new(8, 0)];
    let texts = [
        write_matrix_market(&K, &["note"]),
        "%%MatrixMarket matrix array real symmetric\n2 2\n4\n-1.5\n3\n".into(),
        write_user_element(&K, Some(&K), &rows),
        "DMIG    KAAX           0       6       2       0\n\
         DMIG*   KAAX                           7               1\n\
         *                      7               1 4.000000000D+00\n\
         *                      8               0-1.500000000D+00\n"
            .into(),
        "DMIG,KAAX,0,6,2\nDMIG,KAAX,1,1,,1,1,4.,,1,2,1.\n".into(),
        "1,1, 1,1, 4.0\n1,2, 1,1, -1.5\n".into(),
        "1 1 4.0\n1 2 -1.5\n".into(),
        "7.1\n7.2\n".into(),
        "Matrix Eqn   Node   DOF\n 1 7 UX\n".into(),
    ];
    texts.into_iter().map(String::into_bytes).collect()
}

/// Text made of tokens of the formats, which gets further than random bytes.
fn soup() -> impl Strategy<Value = String> {
    let words = [
        "%%MatrixMarket matrix ",
        "coordinate ",
        "array ",
        "real ",
        "symmetric\n",
        "general\n",
        "*USER ELEMENT,NODES=",
        "*MATRIX,TYPE=STIFFNESS\n",
        "** ELEMENT NODES\n",
        "**",
        "DMIG ",
        "DMIG*",
        "KAAX ",
        "GRID ",
        "part\n",
        "\n",
        "\n",
        " ",
        ",",
        "1",
        "2",
        "12",
        "4294967295",
        "99999999999999999999",
        "-1",
        "0",
        "1.5",
        "1e308",
        "1.0D+05",
        "nan",
        "2.",
        "RSA ",
        "(3E25.16)",
        "       1",
        "       2",
        "KAAX    1P,3E23.16\n",
        "m0( 1, 1) = ",
        "new modal\n",
        "end ",
        "order = ",
        "nrow = 9",
        "\u{e9}",
    ];
    prop::collection::vec(prop::sample::select(words.to_vec()), 0..40).prop_map(|words| words.concat())
}

/// Runs a function and checks that it takes less than 5 s.
fn in_time<T>(run: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = run();
    assert!(start.elapsed() < Duration::from_secs(5), "took {:?}", start.elapsed());
    result
}

proptest! {
    #![proptest_config(fixed_cases())]

    #[test]
    fn random_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = in_time(|| parse(&bytes));
    }

    #[test]
    fn words_of_the_formats_in_any_order_do_not_panic(text in soup()) {
        let _ = in_time(|| parse(text.as_bytes()));
    }

    #[test]
    fn small_files_that_are_cut_or_changed_do_not_panic(
        which in any::<prop::sample::Index>(),
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
    ) {
        let seeds = seeds();
        let mut bytes = seeds[which.index(seeds.len())].clone();
        let _ = in_time(|| parse(&bytes[..cut.index(bytes.len() + 1)]));
        for (place, byte) in changes {
            let i = place.index(bytes.len());
            bytes[i] = byte;
        }
        let _ = in_time(|| parse(&bytes));
    }
}

/// The samples, truncated at many places and with single bytes changed; compressed ones are
/// unpacked first.
#[test]
#[ignore = "needs the reference data beside the project"]
fn samples_that_are_cut_or_changed_do_not_panic() {
    let folder = samples();
    let files = std::fs::read_dir(folder.join("formats")).unwrap();
    let mut names: Vec<_> = files.map(|entry| entry.unwrap().path()).collect();
    names.sort();
    for path in names {
        let packed = std::fs::read(&path).unwrap();
        let mut bytes = Vec::new();
        match flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut bytes) {
            Ok(_) => drop(in_time(|| parse(&packed[..packed.len() / 2]))),
            Err(_) => bytes = packed,
        }
        let cases = if bytes.len() > 100_000 { 20 } else { 60 };
        for i in 0..cases {
            let _ = in_time(|| parse(&bytes[..bytes.len() * i / cases]));
            let mut changed = bytes.clone();
            let place = (i * 7919 + bytes.len() / 3) % bytes.len();
            changed[place] = changed[place].wrapping_add(1 + i as u8);
            let _ = in_time(|| parse(&changed));
        }
    }
}
