//! Arbitrary texts: the language is recognised, and no text makes a reader panic or run endlessly.

use std::path::Path;

use crate::common::{fixture, read_text};
use flexarm_programs::{Language, ProgramError, ReadOptions, read_program, recognise};
use proptest::prelude::*;

const FIXTURES: [(&str, Language); 5] = [
    ("pendant.src", Language::Krl),
    ("shapes.src", Language::Krl),
    ("cell.mod", Language::Rapid),
    ("pick.script", Language::UrScript),
    ("plate.ngc", Language::GCode),
];

#[test]
fn programs_are_recognised_by_what_is_in_them_not_by_their_ending() {
    for (name, language) in FIXTURES {
        let (_, bytes) = fixture(name);
        for other in [name, "program", "program.txt", "program.src", "program.nc"] {
            assert_eq!(recognise(&bytes, other), Some(language), "{name} as {other}");
        }
    }
    for text in ["", "hello world\n", "time,a1,a2\n0,1,2\n", "{\"a\": [1, 2]}\n", "[robot]\nname = \"x\"\n"] {
        assert_eq!(recognise(text.as_bytes(), "x.txt"), None, "{text:?}");
    }
    let error = read_program(Path::new("x.txt"), b"hello", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ProgramError::Unknown { .. }));
    let error = read_program(Path::new("x.src"), b"DEF x()\nEND\n", &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ProgramError::NoMoves { .. }), "{error}");
}

#[test]
fn programs_that_grow_without_bound_end_with_a_clear_error() {
    let options =
        ReadOptions { most_moves: 100, most_steps: 10_000, endless_passes: Some(1_000_000), ..ReadOptions::default() };
    let cases = [
        ("a.src", "DEF a()\nLOOP\nPTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\nENDLOOP\nEND\n", "more than 100 moves"),
        ("a.src", "DEF a()\nINT i\ni=0\nWHILE i>=0\ni=i+1\nENDWHILE\nEND\n", "10000 statements were run"),
        ("a.src", "DEF a()\na()\nEND\n", "does a routine call itself?"),
        ("a.script", "def a():\nl = [1]\nwhile True:\nl = [l, l]\nend\nend\n", "would hold more than 200000 values"),
        (
            "a.script",
            "def a():\ns = \"x\"\nwhile True:\ns = s + s\nmovej([0,0,0,0,0,0])\nend\nend\n",
            "more than 100 moves",
        ),
        (
            "a.mod",
            "MODULE a\nVAR num x{100000,100000};\nPROC main()\nx{1,1} := 1;\nMoveJ x, v5, fine, tool0;\nENDPROC\nENDMODULE\n",
            "the array would hold more than 200000 values",
        ),
        ("a.nc", "G21 F10\nG0 X0 Y0 Z0\nG2 X0 Y0 Z-1 I5 P1000\n", "more than 100 moves"),
    ];
    for (name, text, message) in cases {
        let error = read_text(name, text, &options).unwrap_err();
        assert!(error.contains(message), "{text}\n  gives {error}");
    }
    for (name, open, close) in [("a.src", "(", ")"), ("a.mod", "(", ")"), ("a.script", "[", "]"), ("a.nc", "[", "]")] {
        let deep = format!("{}1{}", open.repeat(5000), close.repeat(5000));
        let text = match name {
            "a.src" => format!("DEF a()\nPTP {{A1 {deep}}}\nEND\n"),
            "a.mod" => format!("MODULE a\nPROC main()\nMoveJ {deep}, v5, fine, tool0;\nENDPROC\nENDMODULE\n"),
            "a.script" => format!("def a():\nmovej({deep})\nend\n"),
            _ => format!("G21 G0 X{deep}\nG1 X5 Y7\n"),
        };
        let error = read_text(name, &text, &options).unwrap_err();
        assert!(error.contains("are inside of each other"), "{error}");
    }
    let chain = "1+".repeat(20_000) + "1";
    let error = read_text("a.src", &format!("DEF a()\nPTP {{A1 {chain}}}\nEND\n"), &options).unwrap_err();
    assert!(error.contains("operators follow each other"), "{error}");
}

/// A number beyond the range of a robot is rejected with its place, before further work.
#[test]
fn numbers_beyond_what_a_robot_can_do_are_refused_with_their_place() {
    let huge = format!("1{}", "0".repeat(308));
    let zero = "[9E9,9E9,9E9,9E9,9E9,9E9]";
    let krl = |line: &str| format!("DEF a()\nPTP {{A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}}\n{line}\nEND\n");
    let rapid = |line: &str| format!("MODULE a\nPROC main()\n{line}\nENDPROC\nENDMODULE\n");
    let script = |line: &str| format!("def a():\nmovej([0,0,0,0,0,0])\n{line}\nend\n");
    let gcode = |line: &str| format!("G21 F100\nG0 X0 Y0 Z0\n{line}\n");
    let pose = |x: &str, conf: &str| format!("[[{x},0,500],[1,0,0,0],{conf},{zero}]");
    let cases = [
        (
            "a.src",
            krl("PTP {X 1e308,Y 0,Z 0,A 0,B 0,C 0}"),
            "a.src:3:1: `PTP {X 1e308",
            "a coordinate of the target is 1e305",
        ),
        ("a.src", krl("PTP {A1 -1e308}"), "a.src:3:1", "an axis value is -1.745329251994329"),
        ("a.src", krl("LIN {X 1e308*1e308,Y 0,Z 0,A 0,B 0,C 0}"), "a.src:3", "expected -10000 to 10000"),
        ("a.src", krl("$VEL.CP=1e-300\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 0}"), "a.src:4", "the speed of the path is 1e-300"),
        (
            "a.src",
            krl("$BASE={X 1e300,Y 0,Z 0,A 0,B 0,C 0}\nPTP {X 0,Y 0,Z 0,A 0,B 0,C 0}"),
            "a.src:4",
            "of the base is 1e297",
        ),
        ("a.src", krl("PTP {X 0,Y 0,Z 0,A 1e400,B 0,C 0}"), "a.src:3", "expected"),
        ("a.src", krl("WAIT SEC 1e308"), "a.src:3", "the time to wait is 1e308, expected 0 to 1e7 (s)"),
        ("a.mod", rapid(&format!("MoveAbsJ [[1e308,0,0,0,0,0],{zero}],v5,fine,tool0;")), "a.mod:3:1", "9E9"),
        (
            "a.mod",
            rapid(&format!("MoveAbsJ [[1e8,0,0,0,0,0],{zero}],v5,fine,tool0;")),
            "a.mod:3:1",
            "an axis value is 1.745329251994329",
        ),
        (
            "a.mod",
            rapid(&format!("MoveJ {},v5,fine,tool0;", pose("1e308", "[0,0,0,0]"))),
            "a.mod:3:1",
            "a coordinate of the target",
        ),
        (
            "a.mod",
            rapid(&format!("MoveJ {},v5,fine,tool0;", pose("500", "[4294967296,0,0,0]"))),
            "a.mod:3:",
            "a whole number is expected, found 4294967296",
        ),
        ("a.script", script("movej([1e308,0,0,0,0,0])"), "a.script:3:1", "an axis value is 1e308"),
        ("a.script", script("movel(p[1e308,0,0,0,0,0])"), "a.script:3:1", "a coordinate of the target is 1e308"),
        ("a.script", script("movel(p[0,0,0,1e308,0,0])"), "a.script:3:1", "expected"),
        ("a.script", script("movej([0,0,0,0,0,1], t=1e308)"), "a.script:3:1", "the duration is 1e308"),
        ("a.nc", gcode(&format!("G0 X{huge}")), "a.nc:3:4: `X1", "X is 1e308, expected -1e9 to 1e9"),
        ("a.nc", gcode(&format!("G2 X1 I{huge}")), "a.nc:3:", "I is 1e308"),
        (
            "a.nc",
            gcode("G1 X99999999"),
            "a.nc:3:1",
            "a coordinate of the target is 99999.999, expected -10000 to 10000 (m)",
        ),
        ("a.nc", gcode(&format!("G4 P{huge}")), "a.nc:3:", "expected"),
    ];
    for (name, text, place, message) in cases {
        let error = read_text(name, &text, &ReadOptions::default()).unwrap_err();
        assert!(error.contains(place) && error.contains(message), "{text}\n  gives {error}\n  not   {place} {message}");
    }
}

#[test]
fn files_of_western_europe_and_of_windows_are_read() {
    let text = b"DEF a()\r\n; f\xfcr den Gru\xdf\r\nPTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\r\nEND\r\n";
    assert_eq!(read_program(Path::new("/nowhere/a.src"), text, &ReadOptions::default()).unwrap().items.len(), 1);
    let marked = "\u{feff}DEF a()\r\n; für\r\nPTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\r\nEND\r\n";
    assert_eq!(read_text("a.src", marked, &ReadOptions::default()).unwrap().items.len(), 1);
}

/// A mutation of a text.
#[derive(Debug, Clone)]
enum Change {
    Cut(usize, usize),
    Double(usize, usize),
    Byte(usize, u8),
    Insert(usize, &'static str),
}

fn change() -> impl Strategy<Value = Change> {
    const WORDS: [&str; 24] = [
        "(", ")", "[", "]", "{", "}", "\"", "'", "#", ":", ",", ";", "\\", "\n", "-", "9E9", "1/0", "=", "END",
        "ENDIF", "end", "while ", "MOVEL ", "\u{fc}",
    ];
    prop_oneof![
        (any::<usize>(), 0..60usize).prop_map(|(at, length)| Change::Cut(at, length)),
        (any::<usize>(), 0..200usize).prop_map(|(at, length)| Change::Double(at, length)),
        (any::<usize>(), any::<u8>()).prop_map(|(at, byte)| Change::Byte(at, byte)),
        (any::<usize>(), 0..WORDS.len()).prop_map(|(at, word)| Change::Insert(at, WORDS[word])),
    ]
}

fn changed(mut bytes: Vec<u8>, changes: &[Change]) -> Vec<u8> {
    for change in changes {
        let size = bytes.len().max(1);
        match change {
            Change::Cut(at, length) => {
                let at = at % size;
                let end = (at + length).min(bytes.len());
                bytes.drain(at.min(end)..end);
            }
            Change::Double(at, length) => {
                let at = (at % size).min(bytes.len());
                let end = (at + length).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            Change::Byte(at, byte) => {
                let at = at % size;
                if let Some(old) = bytes.get_mut(at) {
                    *old = *byte;
                }
            }
            Change::Insert(at, word) => {
                let at = (at % size).min(bytes.len());
                bytes.splice(at..at, word.bytes());
            }
        }
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_change_of_a_program_makes_a_reader_panic(
        which in 0..FIXTURES.len(),
        changes in prop::collection::vec(change(), 1..6),
        passes in prop::option::of(0..3usize),
    ) {
        let (name, language) = FIXTURES[which];
        let bytes = changed(fixture(name).1, &changes);
        let options = ReadOptions {
            language: Some(language),
            most_moves: 500,
            most_steps: 5_000,
            endless_passes: passes,
            waits_are_over: true,
            ..ReadOptions::default()
        };
        if let Ok(program) = read_program(&Path::new("/nowhere").join(name), &bytes, &options) {
            prop_assert!(!program.items.is_empty() && program.items.len() <= 500);
        }
        recognise(&bytes, name);
    }
}
