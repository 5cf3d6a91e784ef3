//! Several runs side by side: `compare --with`.

use crate::common::{self, Place, Table};
use serde_json::Value;

const COMPARE: [&str; 5] = ["compare", "robot.toml", "swing.toml", "-o", "result"];

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// Truth: the same command without `--with`, with the option instead.
#[test]
fn every_run_of_a_study_is_the_run_that_stands_alone() {
    let place = Place::new();
    let study = place.json(&[&COMPARE[..], &["--with", "links=modal", "--with", "step=2e-3,name=coarse"]].concat());
    let labels: Vec<&str> =
        study["with"].as_array().unwrap().iter().map(|run| run["label"].as_str().unwrap()).collect();
    assert_eq!((study["label"].as_str(), labels), (Some("as given"), vec!["links=modal", "coarse"]));

    let alone = [
        place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]),
        place.json(&["compare", "robot.toml", "swing.toml", "--no-files", "--links", "modal"]),
        place.json(&["compare", "robot.toml", "swing.toml", "--no-files", "--step", "2e-3"]),
    ];
    for (run, alone) in std::iter::once(&study).chain(study["with"].as_array().unwrap()).zip(&alone) {
        assert_eq!(run["tcp"], alone["tcp"]);
        assert_eq!(run["frequencies_hz"], alone["frequencies_hz"]);
    }
}

/// Truth: the files changed by hand.
#[test]
fn a_run_with_changed_entries_is_the_run_of_files_changed_by_hand() {
    let place = Place::new();
    let changed = common::with(common::ROBOT, "height = 0.04", "height = 0.05");
    place.write("changed/robot.toml", changed.replace("beam.urdf", "../beam.urdf"));
    let slower = common::SWING.replace("duration = 0.5", "duration = 1.0").replace("hold = 0.5", "hold = 1.0");
    place.write("slower.toml", slower);
    let by_hand = place.json(&["compare", "changed", "slower.toml", "--no-files"]);
    let set = ["--set", "link.bar.beam.height=0.05", "--set", "motion.speed=0.5"];
    let by_flag = place.json(&[&["compare", ".", "swing.toml", "--no-files"][..], &set].concat());
    for (key, bound) in [("peak_m", 1e-9), ("rms_m", 1e-9)] {
        let [a, b] = [&by_hand, &by_flag].map(|run| number(&run["tcp"][key]));
        assert!((a / b - 1.0).abs() < bound, "{key}: {a} by hand, {b} by flag"); // measured 0
    }
    let factor = ["compare", "robot.toml", "swing.toml", "--no-files", "--set", "link.bar.beam.height *= 1.25"];
    assert_eq!(place.json(&factor)["frequencies_hz"], by_hand["frequencies_hz"]);
    let both = ["compare", "robot.toml", "slower.toml", "--no-files", "--with", "set=link.bar.beam.height=0.05"];
    assert_eq!(place.json(&both)["with"][0]["tcp"], by_hand["tcp"]);

    let refused = |change: &str, words: &[&str]| {
        place.refused(&["compare", "robot.toml", "swing.toml", "--no-files", "--set", change], words);
    };
    refused("link.bar.beam.heigth=1", &["robot.toml", "unknown field `heigth`", "`height`"]);
    refused("link.bor.beam.height=1", &["robot.toml", "matches no entry", "link.bar.beam.height"]);
    refused("gravity=down", &["with gravity=down: robot.toml:", "expected an array"]);
    refused("motion.speed=-1", &["--set", "expected a positive number"]);
    place.refused(
        &["compare", "beam.urdf", "swing.toml", "--set", "payload.mass=1"],
        &["beam.urdf", "not a robot file"],
    );
}

/// Truth: the columns of the two tables.
#[test]
fn the_difference_of_two_runs_is_that_of_their_tables() {
    let place = Place::new();
    let study = place.json(&[&COMPARE[..], &["--with", "links=modal,name=modal"]].concat());
    let [first, other] = ["result/run.csv", "result/modal/run.csv"].map(|file| Table::parse(&place.text(file)));
    let columns = ["flexible_x_m", "flexible_y_m", "flexible_z_m"].map(|name| (first.column(name), other.column(name)));
    let apart = (0..columns[0].0.len()).map(|k| {
        let square: f64 = columns.iter().map(|(a, b)| (a[k] - b[k]).powi(2)).sum();
        square.sqrt()
    });
    let truth = apart.fold(0.0, f64::max);
    let difference = &study["with"][0]["difference"];
    assert!(truth > 1e-7, "the models differ");
    assert!((number(&difference["peak_m"]) - truth).abs() < 1e-12, "{difference} beside {truth:e}");
    let share = truth / number(&study["tcp"]["peak_m"]);
    assert!((number(&difference["of_peak_error"]) - share).abs() < 1e-9);
}

#[test]
fn a_study_names_its_files_and_overwrites_nothing() {
    let place = Place::new();
    let with = ["--with", "links=modal,name=modal"];
    let study = place.json(&[&COMPARE[..], &with[..]].concat());
    for file in ["result/run.csv", "result/modal/run.csv", "result/summary.json"] {
        assert!(place.path(file).is_file(), "{file}");
    }
    assert_eq!(study["files"]["study"].is_string(), cfg!(feature = "rerun"));
    if cfg!(feature = "rerun") {
        assert!(place.path("result/study.rrd").is_file());
    }
    place.refused(&[&COMPARE[..], &with[..]].concat(), &["exists already", "--force"]);
    place.json(&[&COMPARE[..], &with[..], &["--force"]].concat());
    // The folders of the other runs are checked before the first run starts.
    std::fs::remove_dir_all(place.path("result")).unwrap();
    place.write("result/modal/run.csv", "mine");
    place.refused(&[&COMPARE[..], &with[..]].concat(), &["modal", "run.csv", "exists already"]);
}

#[test]
fn bad_runs_of_a_study_are_named_before_anything_runs() {
    let place = Place::new();
    let refused = |with: &str, words: &[&str]| {
        place.refused(&[&COMPARE[..], &["--with", with]].concat(), words);
    };
    refused("links", &["links"]);
    refused("lincs=modal", &["lincs=modal", "--lincs"]);
    refused("links=soft", &["links=soft", "soft"]);
    refused("output=there", &["output", "whole study"]);
    refused(" , ", &["key=value"]);
    refused("robot=nowhere.toml", &["nowhere.toml", "robot=nowhere.toml"]);
    refused("trajectory=nowhere.csv,name=lost", &["nowhere.csv", "lost"]);
    refused("step=-1", &["step=-1", "positive"]);
    refused("help", &["help", "not an option"]);
    refused("version", &["version", "not an option"]);
    for name in ["run.csv", "Summary.json", "figures", "study.rrd"] {
        refused(&format!("links=modal,name={name}"), &[name, "name="]);
    }
    refused(&format!("links=modal,name={}", "long".repeat(26)), &["104 letters", "100", "name="]);
    refused("stepper=rk4,step=1e-2", &["unstable", "stepper=rk4"]);
    refused("links=modal,name=links=as filed", &["links=as filed", "name="]);
    place
        .refused(&["run", "robot.toml", "swing.toml", "-o", "result", "--with", "links=modal"], &["--with", "compare"]);
}

/// Truth: the same options before the file names.
#[test]
fn options_of_other_runs_stand_before_two_dashes() {
    let place = Place::new();
    let with = ["compare", "--json", "--no-files", "--with", "links=modal"];
    let plain = place.flexarm(&[&with[..], &["robot.toml", "swing.toml"]].concat()).json();
    let dashes = place.flexarm(&[&with[..], &["--", "robot.toml", "swing.toml"]].concat()).json();
    assert_eq!((&plain["with"][0]["tcp"], &plain["label"]), (&dashes["with"][0]["tcp"], &dashes["label"]));
    assert_eq!(dashes["with"][0]["label"], "links=modal");
}

#[test]
fn force_leaves_no_recording_of_an_earlier_run_beside_the_new_ones() {
    let place = Place::new();
    place.json(&COMPARE);
    let figures = ["result/figures/torques_j9.svg", "result/figures/torques_j9.csv", "result/figures/arm_side.png"];
    for file in ["result/study.rrd", "result/run.parquet", "result/notes.txt", "result/figures/mine.svg"] {
        place.write(file, "old");
    }
    figures.iter().for_each(|file| place.write(file, "old"));
    place.json(&[&COMPARE[..], &["--force"]].concat());
    for gone in ["result/study.rrd", "result/run.parquet"].iter().chain(&figures) {
        assert!(!place.path(gone).exists(), "{gone}");
    }
    for kept in ["result/notes.txt", "result/figures/mine.svg"] {
        assert_eq!(place.text(kept), "old");
    }
    for new in ["result/run.csv", "result/report.html", "result/summary.json"] {
        assert!(place.read(new) != b"old");
    }
    // A recording of a study without other files is not overwritten either.
    let other = Place::new();
    other.write("result/study.rrd", "old");
    other.refused(&COMPARE, &["study.rrd", "exists already"]);
}

/// Truth: the first bytes of the file.
#[cfg(feature = "rerun")]
#[test]
fn a_compensation_has_a_recording_of_both_runs() {
    let place = Place::new();
    let found = place.json(&["compensate", "robot.toml", "swing.toml", "-o", "out"]);
    assert_eq!(found["recording"], "out/compensation.rrd");
    let file = place.read("out/compensation.rrd");
    assert!(file.starts_with(b"RRF2") && file.len() > 100_000, "{} bytes", file.len());
}
