//! Tables of numbers, and places in texts.

use std::path::Path;

use flexarm_files::{FileError, NumberTable, Source};

/// The table in a file with this text.
fn table(name: &str, text: &str) -> Result<NumberTable, FileError> {
    let path = std::env::temp_dir().join(format!("flexarm-files-{}-{name}", std::process::id()));
    std::fs::write(&path, text).unwrap();
    let found = NumberTable::read(&path);
    std::fs::remove_file(&path).unwrap();
    found
}

#[test]
fn commas_semicolons_and_tabs_say_the_same_and_decimal_commas_are_numbers() {
    let comma = table("separators", "# tracker\na, b\n1.5,-2e3\n\n,4\n").unwrap();
    let semicolon = table("separators", "\u{feff}a;b\r\n1,5;-2e3\r\n;4\r\n").unwrap();
    let tab = table("separators", "\"a\"\t\"b\"\n1,5\t-2000\n\t4\n").unwrap();
    assert_eq!(comma.names, ["a", "b"]);
    assert_eq!((comma.rows[0].clone(), comma.rows[1][1]), (vec![1.5, -2000.0], 4.0));
    assert!(comma.rows[1][0].is_nan());
    assert_eq!((comma.lines.clone(), semicolon.lines), (vec![3, 5], vec![2, 3]));
    assert_eq!((&comma.rows[0], &comma.rows[0]), (&semicolon.rows[0], &tab.rows[0]));
}

#[test]
fn what_is_no_table_of_numbers_is_said_with_line_and_column() {
    let fails = |text: &str, part: &str| {
        let error = table("faults", text).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    fails("", "empty");
    fails("a,a\n1,2\n", "twice");
    fails("1,2\n3,4\n", "add a header");
    fails("a,b\n1\n", ":2:1: expected 2 cells");
    fails("a,b\n1,x\n", ":2:3: column \"b\": expected a number, found \"x\"");
    fails("a,b\n1,inf\n", "found \"inf\"");
    fails("a,b\n1,2,5\n", "expected 2 cells");
}

#[test]
fn columns_count_characters_also_behind_letters_outside_of_ascii() {
    let text = "a = 1\nname = \"größe µ\", x = 2\n";
    let source = Source::new(Path::new("f.toml"), text, "robot");
    let at = text.find('x').unwrap_or_default();
    let error = source.error(at..at + 1, "no");
    assert_eq!((error.line, error.column), (2, 19));
}
