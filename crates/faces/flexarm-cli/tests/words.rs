//! Words and numbers in the text that the program reads and prints.

use flexarm_cli::internals::{is_version, plain_zeros, quoted, requested};

#[test]
fn versions_are_told_from_other_words() {
    let text = "rerun-cli 0.36.3 [rustc 1.95.0 (abc), LLVM 21.1] x86_64 release-0.36.3 49bb15f";
    assert_eq!(text.split_whitespace().find(|word| is_version(word)), Some("0.36.3"));
    assert!(is_version("0.37.0-alpha.1") && !is_version("release-0.36.3") && !is_version("1.95"));
}

#[test]
fn words_with_blanks_and_quotes_stay_one_word_of_the_shell() {
    assert_eq!(quoted("/a/b-c.toml"), "/a/b-c.toml");
    assert_eq!(quoted("a b"), "'a b'");
    assert_eq!(quoted("it's $x"), "'it'\\''s $x'");
}

#[test]
fn addresses_name_files_below_the_folder_alone() {
    assert_eq!(requested("/"), Some("index.html".into()));
    assert_eq!(requested("/assets/main.js?v=1"), Some("assets/main.js".into()));
    for outside in ["/../Cargo.toml", "/a/../../b", "//etc/passwd", "/./..", "http://other/", ""] {
        assert_eq!(requested(outside), None, "{outside}");
    }
}

#[test]
fn a_number_that_is_rounded_to_zero_has_no_sign() {
    for (text, expected) in [
        ("  -0.000  -0.001", "   0.000  -0.001"),
        ("joint_6 -0.00", "joint_6 0.00"),
        ("[-0.0000, 0.1]", "[0.0000, 0.1]"),
        ("-0.0", "0.0"),
        ("x-0.0 run-0.00 1e-0.0", "x-0.0 run-0.00 1e-0.0"),
        ("-0.0e3 -0.05 -0 --out", "-0.0e3 -0.05 -0 --out"),
    ] {
        assert_eq!(plain_zeros(text), expected);
    }
}
