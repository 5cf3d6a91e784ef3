//! Several files at once, and files that are there already.
#![allow(non_snake_case, reason = "monogram notation: X_WT, pose of T in W")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod synthetic;

use std::error::Error;

use flexarm_log::{CreateOptions, CsvRecorder, LogError, RecorderSet, RunResult};

fn pair(first: &std::path::Path, second: &std::path::Path, options: CreateOptions) -> RecorderSet {
    let mut set = RecorderSet::new();
    set.push(Box::new(CsvRecorder::create(first, options)));
    set.push(Box::new(CsvRecorder::create(second, options)));
    set
}

#[test]
fn an_existing_file_stops_the_run_before_any_file_is_made() {
    let (new, old) = (synthetic::scratch("new.csv"), synthetic::scratch("old.csv"));
    std::fs::write(&old, "precious").unwrap();

    let error = pair(&new, &old, CreateOptions::default()).begin(&synthetic::header()).unwrap_err();
    let LogError::Exists { path } = &error else { panic!("{error}") };
    assert_eq!(path, &old);
    assert!(error.to_string().contains("--force"), "{error}");
    assert!(!new.exists());
    assert_eq!(std::fs::read_to_string(&old).unwrap(), "precious");

    let mut set = pair(&new, &old, CreateOptions::default().with_overwrite(true));
    set.begin(&synthetic::header()).unwrap();
    set.record(&synthetic::sample(0)).unwrap();
    set.finish(&RunResult::default()).unwrap();
    assert_eq!(std::fs::read(&new).unwrap(), std::fs::read(&old).unwrap());
    assert_eq!(set.paths().collect::<Vec<_>>(), [&new, &old]);
    [new, old].iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

#[test]
fn an_error_names_the_file_and_the_cause() {
    let path = synthetic::scratch("missing-folder").join("run.csv");
    let error = pair(&path, &path, CreateOptions::default()).begin(&synthetic::header()).unwrap_err();
    assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
    assert!(error.source().unwrap().to_string().contains("No such file"), "{error:?}");
}

#[test]
fn one_failing_recorder_does_not_cost_the_others_their_data() {
    let (good, bad) = (synthetic::scratch("good.csv"), synthetic::scratch("missing").join("bad.csv"));
    let mut set = pair(&bad, &good, CreateOptions::default());
    assert!(set.begin(&synthetic::header()).is_err());
    assert!(set.record(&synthetic::sample(0)).is_err());
    assert!(set.finish(&RunResult::default()).is_err());
    assert_eq!(std::fs::read_to_string(&good).unwrap().lines().count(), 2);
    std::fs::remove_file(good).unwrap();
}
