//! Width of what the program prints: tables, paragraphs, examples of help.

use flexarm_cli::internals::{columns, command, filled, table, whole_help};
use proptest::prelude::*;

use crate::common::Place;

/// All words of a text, without dots of plots.
fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().filter(|word| word.contains(|c: char| c.is_ascii_alphanumeric())).collect()
}

proptest! {
    /// Cells of random lengths, with blanks in names, texts and numbers.
    #[test]
    fn a_table_cuts_neither_a_number_nor_a_word(
        header in proptest::collection::vec("[a-z]{1,12}( [a-z]{1,9}){0,2}", 1..12),
        numbers in proptest::collection::vec(proptest::collection::vec(-1e7f64..1e7, 12), 1..5),
        text in "[a-z_.]{1,19}( [a-z]{1,9}){0,12}",
        width in 40_usize..120,
    ) {
        let mut written = table(&header);
        let mut cells = header.clone();
        for row in &numbers {
            let mut row: Vec<String> = row[..header.len()].iter().map(|x| format!("{x:.4}")).collect();
            row[0].clone_from(&text);
            if let Some(last) = row[1..].last_mut() {
                *last += " (12 %)";
            }
            cells.extend(row.clone());
            written.add_row(row);
        }
        let text = written.text(width);
        prop_assert!(text.lines().all(|line| columns(line) <= width), "{width} columns:\n{text}");
        let shown = words(&text);
        for word in cells.iter().flat_map(|cell| words(cell)) {
            prop_assert!(shown.contains(&word), "{word:?} is not in\n{text}");
        }
    }

    #[test]
    fn a_paragraph_keeps_its_words_in_their_order(
        text in "[a-z_.]{1,30}([,;]? [a-z0-9]{1,20}){0,40}",
        width in 40_usize..120,
    ) {
        let lines = filled(&text, width);
        prop_assert_eq!(words(&lines), words(&text));
        prop_assert!(lines.lines().all(|line| columns(line) <= width), "{}", lines);
    }
}

#[test]
fn columns_that_do_not_fit_follow_below_with_the_labels_again() {
    let mut wide = table(&["parameter", "value", "peak, um", "RMS, um"]);
    wide.add_row(["drive.joint_2.gearbox", "3376722 N m/rad", "-28.0814", "-20.3212"]);
    wide.add_row(["payload.mass", "150 kg", "+19.4720", "+16.3926"]);
    let expected = " \
parameter                        value
 drive.joint_2.gearbox  3376722 N m/rad
 payload.mass                    150 kg

 parameter              peak, um   RMS, um
 drive.joint_2.gearbox  -28.0814  -20.3212
 payload.mass           +19.4720  +16.3926
";
    assert_eq!(wide.text(45), expected);
}

#[test]
fn a_path_longer_than_the_terminal_stays_whole() {
    let path = "/a".repeat(60);
    assert_eq!(filled(&format!("motion   {path}"), 80), format!("motion   {path}\n"));
    let after = filled(&format!("{path} on kr210: waypoints"), 80);
    assert_eq!(after, format!("{path}\n  on kr210: waypoints\n"));
}

/// Commands without a table of their own.
const WITHOUT_TABLES: [&str; 8] = ["check", "export-fmu", "view", "serve", "format", "completions", "man", "help"];

/// A line for every command that prints figures, in this order: a later one reads what an earlier
/// one wrote.
const LINES: &[&str] = &[
    "compare robot.toml swing.toml -o first",
    "compare robot.toml swing.toml --with links=modal --with stepper=rk4,step=1e-4,name=explicit --no-files",
    "run robot.toml swing.toml --links modal --no-files",
    "report first/run.mcap -o report.html",
    "convert first/run.mcap run.csv",
    "inspect kr210",
    "inspect kr210 --velocity -1,20,300,-4000,5000,60000",
    "motion pick_and_place kr210",
    "motion pick_and_place",
    "statics kr210 --wrench 100,0,0",
    "modes kr210 --count 30",
    "modes kr210 --speeds 1,1,1,1,1,1",
    "response kr210 --no-files",
    "lobes lower_arm --tool endmill_20mm --rpm 8000,9000 --no-files",
    "map kr210 --box 1.2:2.4,-0.6:0.6,0.6:0.6 --grid 0.6 --wrench 500,0,0 --workpiece 0.1,0.1,0 --no-files",
    "sensitivity kr210 --at 0,-60deg,90deg,0,60deg,0",
    "sensitivity robot.toml swing.toml",
    "compensate robot.toml swing.toml --no-files",
    "identify kr210_identified --plan 6 --std 0.00003 --no-files",
    "sweep study.toml -o study",
    "sweep plan study.toml -n 3 -o plan",
    "new two.urdf -o made --no-run",
    "reduce beam.inp --list",
    "reduce job.toml -o reduced",
    "export reduced/beam.flex --format matrix-market --units mm-t-s -o exported",
    "import exported/beam_K.mtx -o imported",
];

/// Every line runs in 80 columns, and in a terminal so wide that nothing is wrapped. Truth: both
/// outputs have the same words, so that none is cut.
#[test]
fn tables_of_all_commands_fit_80_columns() {
    let place = Place::new();
    place.write("two.urdf", crate::new::ARM);
    place.write("beam.inp", crate::reduce::beam(1.0));
    place.write("job.toml", crate::reduce::JOB);
    place.write("study.toml", STUDY);
    let mut wrong = String::new();
    for line in LINES {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let printed = |width: &str, more: &[&str]| {
            let output = place.command(&[&arguments, more].concat()).env("COLUMNS", width).output().unwrap();
            assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
            String::from_utf8(output.stdout).unwrap()
        };
        let writes_files = line.contains(" -o ") || line.starts_with("convert");
        let (narrow, wide) = (printed("80", &[]), printed("4000", if writes_files { &["--force"] } else { &[] }));
        for row in narrow.lines() {
            let is_path = |word: &str| word.contains('/') && columns(word) > 60;
            let command = row.contains("flexarm ");
            if columns(row) > 80 && !command && !row.split(' ').any(is_path) {
                wrong += &format!("{line}: {} columns: {row}\n", columns(row));
            }
        }
        let shown = words(&narrow);
        // Times and memory differ between two runs.
        let is_timed = |row: &&str| {
            line.contains(" --with ")
                || row.contains("time")
                || row.contains(" MB")
                || row.ends_with(" s")
                || [" s,", " s;"].iter().any(|word| row.contains(word))
        };
        for word in wide.lines().filter(|row| !is_timed(row)).flat_map(words) {
            if !shown.contains(&word) {
                wrong += &format!("{line}: {word:?} is not in\n{narrow}\n");
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    for command in command().get_subcommands().map(clap::Command::get_name) {
        let known = LINES.iter().any(|line| line.split(' ').next() == Some(command));
        assert!(known || WITHOUT_TABLES.contains(&command), "no line of {command:?} is tried");
    }
}

/// Three runs; the metric has a long name.
const STUDY: &str = r#"format = 1
robot = "robot.toml"
motion = "swing.toml"
metrics = ["peak_error_of_the_tool_along_the_motion_mm = 1e3 * tcp.peak_m", "f1_hz = frequencies_hz.0"]

[options]
step = 0.002

[[parameter]]
path = "motion.speed"
from = 0.5
to = 1.0
count = 3
"#;

/// Words of a line as a shell splits it.
fn split(line: &str) -> Vec<String> {
    let (mut words, mut quote) = (vec![String::new()], None);
    for c in line.chars() {
        match quote {
            Some(mark) if c == mark => quote = None,
            None if c == '\'' || c == '"' => quote = Some(c),
            None if c == ' ' => words.push(String::new()),
            _ => words.last_mut().expect("a word").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// The examples of all commands, as the help shows them in 80 columns, are parsed by the program.
#[test]
fn examples_of_help_can_be_pasted() {
    let mut program = command();
    program.build();
    let mut tried = 0;
    for name in program.get_subcommands().map(|own| own.get_name().to_owned()) {
        let help = whole_help(&["flexarm".into(), name.clone().into(), "--help".into()]).to_string();
        assert!(help.lines().count() < 170, "{name} --help has {} lines", help.lines().count());
        let Some((_, examples)) = help.split_once("Examples:\n") else { continue };
        assert!(examples.lines().all(|line| columns(line) <= 80), "{name}: {examples}");
        for line in examples.replace("\\\n", "").lines().map(str::trim).filter(|line| line.starts_with("flexarm ")) {
            let parsed = command().try_get_matches_from(split(line));
            assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            tried += 1;
        }
    }
    assert!(tried > 40, "{tried}");
}
