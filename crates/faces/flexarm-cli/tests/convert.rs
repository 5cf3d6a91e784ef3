//! `flexarm convert` and `--parquet` from the user's point of view.

use crate::common::{Answer, Place, Table};
use serde_json::Value;

/// A folder with the recordings of a run in `result`.
fn recorded() -> Place {
    recorded_at("200")
}

/// The same with a given number of samples per second.
fn recorded_at(log_rate: &str) -> Place {
    let place = Place::new();
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "result", "--log-rate", log_rate]);
    place
}

fn convert(place: &Place, from: &str, to: &str) -> Value {
    place.json(&["convert", from, to])
}

#[test]
fn a_table_is_the_same_bytes_through_every_format() {
    let place = recorded();
    let truth = place.read("result/run.csv");
    if cfg!(feature = "mcap") {
        let summary = convert(&place, "result/run.mcap", "a.csv");
        assert!(place.read("a.csv") == truth);
        let rows = Table::parse(&place.text("a.csv")).rows.len();
        assert_eq!(summary["samples"], rows);
        assert_eq!(summary["duration_s"], 1.0);
        assert_eq!((&summary["from"], &summary["to"]), (&Value::from("mcap"), &Value::from("csv")));
        assert_eq!((&summary["input"], &summary["output"]), (&Value::from("result/run.mcap"), &Value::from("a.csv")));
        assert!(!summary["lost"].as_array().unwrap().is_empty());
        assert_eq!(summary["warnings"].as_array().unwrap().len(), 0);
    }
    if cfg!(feature = "parquet") {
        convert(&place, "result/run.csv", "b.parquet");
        convert(&place, "b.parquet", "b.csv");
        assert!(place.read("b.csv") == truth);
    }
    if cfg!(all(feature = "mcap", feature = "parquet")) {
        convert(&place, "result/run.mcap", "c.parquet");
        convert(&place, "c.parquet", "c.mcap");
        convert(&place, "c.mcap", "c.csv");
        assert!(place.read("c.csv") == truth);
        // Formats can be given explicitly instead of by extension.
        place.json(&["convert", "c.parquet", "c.bin", "--to", "csv"]);
        assert!(place.read("c.bin") == truth);
        place.json(&["convert", "c.bin", "d.csv", "--from", "csv"]);
        assert!(place.read("d.csv") == truth);
    }
}

#[test]
fn names_beside_the_output_belong_to_others() {
    let place = recorded();
    let table = place.read("result/run.csv");
    place.write("x.csv.new", &table);
    place.json(&["convert", "x.csv.new", "x.csv", "--from", "csv"]);
    assert!(place.read("x.csv.new") == table && place.read("x.csv") == table);
    place.write("y.csv.new", "mine");
    convert(&place, "x.csv", "y.csv");
    assert_eq!(place.text("y.csv.new"), "mine");
    // Nothing remains, whether it succeeded or not.
    place.write("broken.csv", "time\n");
    assert_ne!(place.flexarm(&["convert", "broken.csv", "z.csv"]).code, 0);
    let hidden = |path: &std::path::PathBuf| path.to_string_lossy().starts_with('.');
    assert_eq!(place.snapshot().keys().filter(|path| hidden(path)).count(), 0);
    assert!(!place.path("z.csv").exists());
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_is_written_by_a_run_that_is_asked_for_it() {
    let place = Place::new();
    let run = ["compare", "robot.toml", "swing.toml", "-o", "result"];
    let summary = place.json(&run);
    assert!(summary["files"]["parquet"].is_null() && !place.path("result/run.parquet").exists());
    let summary = place.json(&[&run[..], &["--parquet", "--force"]].concat());
    assert_eq!(summary["files"]["parquet"], "result/run.parquet");
    convert(&place, "result/run.parquet", "a.csv");
    assert!(place.read("a.csv") == place.read("result/run.csv"));
    assert!(place.snapshot().keys().all(|path| !path.to_string_lossy().contains("partial")));
}

#[cfg(feature = "mcap")]
#[test]
fn a_recording_without_its_end_is_read_with_a_warning() {
    let place = recorded_at("1000"); // several chunks
    let file = place.read("result/run.mcap");
    place.write("cut.mcap", &file[..file.len() * 3 / 4]);
    let answer = place.flexarm(&["convert", "cut.mcap", "cut.csv"]);
    assert_eq!(answer.code, 0, "{}", answer.err);
    answer.says(&["warning: cut.mcap", "samples, up to t ="]);
    let table = Table::parse(&place.text("cut.csv"));
    let whole = Table::parse(&place.text("result/run.csv"));
    assert!(!table.rows.is_empty() && table.rows.len() < whole.rows.len());
    assert_eq!(table.rows, whole.rows[..table.rows.len()]);
}

#[test]
fn what_cannot_be_converted_is_refused_and_nothing_is_touched() {
    let place = recorded();
    place.write("other.csv", "city,price\nHamburg,3\n");
    place.write("empty.csv", "");
    place.refused(&["convert", "result/run.csv", "result/run.csv"], &["input and output"]);
    place.refused(&["convert", "result/run.csv", "result/../result/run.csv", "--force"], &["input and output"]);
    place.refused(&["convert", "nothing.csv", "a.csv"], &["nothing.csv", "no such file"]);
    place.refused(&["convert", "result", "a.csv"], &["result", "folder", "run.mcap"]);
    if cfg!(not(feature = "rerun")) {
        let words = ["a.rrd", "built without Rerun", "cargo run --release --features rerun -- ..."];
        place.refused(&["convert", "result/run.csv", "a.rrd"], &words);
    }
    place.refused(&["convert", "result/run.csv", "a.xlsx"], &[".xlsx", ".parquet", "--to"]);
    place.refused(&["convert", "result/run.csv", "a.csv", "--from", "xml"], &["xml", "parquet"]);
    place.refused(&["convert", "other.csv", "a.csv"], &["other.csv", "city, price", "flexible_x_m"]);
    place.refused(&["convert", "empty.csv", "a.csv"], &["empty.csv", "an empty file"]);
    place.write("taken.csv", "mine");
    place.refused(&["convert", "result/run.csv", "taken.csv"], &["taken.csv", "--force"]);
    if cfg!(feature = "mcap") {
        place.write("text.mcap", "hello\n");
        place.write("table.mcap", place.read("result/run.csv"));
        place.refused(&["convert", "text.mcap", "a.csv"], &["text.mcap", "hello", "MCAP"]);
        place.refused(&["convert", "table.mcap", "a.csv"], &["table.mcap", "--from csv"]);
        place.refused(&["convert", "result/run.mcap", "a.csv", "--from", "csv"], &["MCAP", "--from mcap"]);
    }
    let answer = place.flexarm(&["convert", "result/run.csv", "taken.csv", "--force"]);
    assert_eq!(answer.code, 0, "{}", answer.err);
    assert!(place.read("taken.csv") == place.read("result/run.csv"));
}

/// An unwritable location is a failure of the run, and leaves nothing behind.
#[cfg(unix)]
#[test]
fn an_output_that_cannot_be_written_ends_with_1_and_leaves_nothing() {
    let place = recorded();
    let before = place.snapshot();
    for output in ["missing/a.csv", "missing/a.mcap", "missing/a.parquet"] {
        let built = output.ends_with(".csv")
            || output.ends_with(".mcap") && cfg!(feature = "mcap")
            || output.ends_with(".parquet") && cfg!(feature = "parquet");
        if built {
            let answer: Answer = place.flexarm(&["convert", "result/run.csv", output]);
            assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{}", answer.err);
            answer.says(&["missing/a."]);
        }
    }
    assert!(place.snapshot() == before);
}
