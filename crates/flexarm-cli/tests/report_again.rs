//! `flexarm report`: the page again from recordings.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod common;

use common::Place;

fn recorded(extra: &[&str]) -> Place {
    let place = Place::new();
    place.json(&[&["compare", "robot.toml", "swing.toml", "-o", "result"], extra].concat());
    place
}

/// The page without the one paragraph that holds times of the machine and the names of files.
fn timeless(page: &str) -> String {
    let kept = page
        .lines()
        .filter(|line| !line.contains("wall") && !line.contains("real time") && !line.contains("files beside"));
    kept.collect::<Vec<_>>().join("\n")
}

/// Truth: the page that the run itself wrote.
#[cfg(feature = "mcap")]
#[test]
fn the_page_of_a_recording_is_that_of_the_run() {
    let place = recorded(&[]);
    let answer = place.json(&["report", "result/run.mcap", "-o", "again.html"]);
    assert_eq!(answer["report"], "again.html");
    assert!(answer["warnings"].as_array().unwrap().is_empty(), "{answer}");
    let (first, again) = (timeless(&place.text("result/report.html")), timeless(&place.text("again.html")));
    let different = first.lines().zip(again.lines()).filter(|(a, b)| a != b).map(|(a, _)| a.get(..200).unwrap_or(a));
    assert_eq!(different.collect::<Vec<_>>(), Vec::<&str>::new());
    assert_eq!(first.lines().count(), again.lines().count());
}

/// A table has no result: the figures of the tool come from its curves, and are the same.
#[test]
fn a_table_gives_a_page_with_the_same_peak() {
    let place = recorded(&[]);
    let answer = place.json(&["report", "result/run.csv", "-o", "table.html"]);
    assert!(answer["warnings"][0].as_str().unwrap().contains("computed"), "{answer}");
    let page = place.text("table.html");
    assert!(!page.contains("NaN"), "a number that is none");
    let summary: serde_json::Value = serde_json::from_slice(&place.read("result/summary.json")).unwrap();
    let peak = format!("{:.4}", 1e3 * summary["tcp"]["peak_m"].as_f64().unwrap());
    assert!(page.contains(&peak), "{peak} mm");
}

#[test]
fn several_runs_share_a_page_and_nothing_is_overwritten() {
    let place = recorded(&["--figures"]);
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "other", "--step", "2e-3"]);
    place.json(&["report", "result", "other", "-o", "both.html"]);
    assert!(place.text("both.html").contains("other/run."));
    place.refused(&["report", "result", "other", "-o", "both.html"], &["both.html", "--force"]);
    place.refused(&["report", "result"], &["report.html", "--force"]);
    place.refused(&["report", "result", "-o", "result/new.html", "--figures"], &["figures", "--force"]);
    place.refused(&["report", "nowhere.mcap"], &["nowhere.mcap", "no such file"]);
    place.refused(&["report", "robot.toml"], &["robot.toml", ".mcap"]);
    std::fs::create_dir(place.path("empty")).unwrap();
    place.refused(&["report", "empty"], &["empty", "no recording"]);
    place.refused(&["report"], &["RECORDING"]);
}
