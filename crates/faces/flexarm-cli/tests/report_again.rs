//! `flexarm report`: recreates the page from recordings.

use crate::common::Place;

fn recorded(extra: &[&str]) -> Place {
    let place = Place::new();
    place.json(&[&["compare", "robot.toml", "swing.toml", "-o", "result"], extra].concat());
    place
}

/// The page without the paragraph with computation times and file names.
fn timeless(page: &str) -> String {
    let kept = page
        .lines()
        .filter(|line| !line.contains("wall") && !line.contains("real time") && !line.contains("files beside"));
    kept.collect::<Vec<_>>().join("\n")
}

/// Truth: the page written by the run itself.
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

/// A table contains no result: the TCP figures are computed from its curves, and are the same.
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

/// Truth: a table contains no moves, energies, stepper or end; figures of those would be invented.
#[test]
fn what_a_table_does_not_hold_is_not_a_figure_of_its_page() {
    let place = recorded(&[]);
    place.json(&["report", "result/run.csv", "-o", "table.html"]);
    let page = place.text("table.html");
    let (text, _) = page.split_once("<script type").unwrap();
    for absent in [
        "Path accuracy",
        "overshoot",
        "Settling time",
        "Dominant frequency",
        "work of the drives",
        "evaluations",
        "step 0 ms",
        "Stopped early",
        "unknown",
        "real time",
    ] {
        assert!(!text.contains(absent), "{absent}");
    }
    assert!(text.contains("End not known") && !text.contains("Inputs and versions"));
    assert_eq!(text.matches("no poses of links").count(), usize::from(!text.contains("data:image")));
}

/// Truth: recordings contain no computation times.
#[cfg(feature = "mcap")]
#[test]
fn the_page_of_a_recording_says_nothing_about_the_time_it_took() {
    let place = recorded(&[]);
    place.json(&["report", "result/run.mcap", "-o", "again.html"]);
    let page = place.text("again.html");
    assert!(!page.contains("real time") && !page.contains("End not known") && page.contains("within 0.1 mm"));
}

/// A recording with its end cut off has its stepper and links, and reports the damage.
#[cfg(feature = "mcap")]
#[test]
fn the_page_of_a_killed_run_names_its_stepper_and_what_is_missing() {
    let place = recorded(&[]);
    let bytes = place.read("result/run.mcap");
    place.write("killed.mcap", &bytes[..bytes.len() * 2 / 3]);
    let answer = place.json(&["report", "killed.mcap", "-o", "killed.html"]);
    assert!(answer["warnings"].as_array().unwrap().len() > 1, "the broken end is reported: {answer}");
    let page = place.text("killed.html");
    let (text, _) = page.split_once("<script type").unwrap();
    assert!(text.contains("End not known") && !text.contains("Stopped early"));
    assert!(text.contains("genalpha, step 1 ms") || text.contains("step 1 ms"), "the stepper of the metadata");
    assert!(!text.contains("work of the drives"));
}

#[test]
fn a_report_does_not_replace_what_it_is_made_of() {
    let place = recorded(&[]);
    for input in ["result/run.csv", "result/run.mcap"].into_iter().filter(|name| place.path(name).exists()) {
        place.refused(&["report", input, "-o", input, "--force"], &[input, "is input and output"]);
        place.refused(&["report", "result", "-o", "result/../result/../robot.toml"], &["robot.toml", "--force"]);
    }
    place.write("new/figures", "mine");
    place.refused(&["report", "result", "-o", "new/page.html", "--figures", "--force"], &["figures", "is a file"]);
    let typo = place.refused(&["report", "resutl"], &["resutl", "no such file or folder"]);
    assert!(!typo.err.contains("--from"), "{}", typo.err);
    let other = place.refused(&["report", "robot.toml"], &["robot.toml", ".mcap"]);
    assert!(!other.err.contains("--from"), "{}", other.err);
}

/// Truth: the page written by the study itself.
#[cfg(feature = "mcap")]
#[test]
fn the_page_of_a_study_folder_is_that_of_the_study() {
    let place = Place::new();
    let with = "name=coarse & long,step=2e-3";
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "study", "--with", with]);
    let answer = place.json(&["report", "study", "-o", "again.html"]);
    assert_eq!(answer["warnings"].as_array().unwrap().len(), 0, "{answer}");
    assert_eq!(answer["inputs"].as_array().unwrap().len(), 2);
    let (first, again) = (timeless(&place.text("study/report.html")), timeless(&place.text("again.html")));
    let different = first.lines().zip(again.lines()).filter(|(a, b)| a != b).map(|(a, _)| a.get(..200).unwrap_or(a));
    assert_eq!(different.collect::<Vec<_>>(), Vec::<&str>::new());
    assert!(again.contains("apart from the first run"));
    // A missing run is reported, not skipped silently.
    std::fs::remove_dir_all(place.path("study/coarse___long")).unwrap();
    let answer = place.json(&["report", "study", "-o", "less.html"]);
    assert!(answer["warnings"][0].as_str().unwrap().contains("coarse & long"), "{answer}");
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
