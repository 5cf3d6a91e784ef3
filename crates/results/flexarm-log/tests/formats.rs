//! The table of formats: properties of every row.

use crate::synthetic;
use std::collections::BTreeSet;
use std::path::Path;

use flexarm_log::{CreateOptions, FormatInfo, LogError, RecordingFormat, RunHeader, open_recording};

fn rows() -> impl Iterator<Item = &'static FormatInfo> + Clone {
    RecordingFormat::ALL.into_iter().map(RecordingFormat::info)
}

/// Truth: consistency of the table. Two formats with one name, extension or file would hide each
/// other.
#[test]
fn every_format_has_its_row_under_its_own_names() {
    for (row, format) in RecordingFormat::ALL.into_iter().enumerate() {
        let info = format.info();
        assert_eq!((info.format, format as usize), (format, row), "{format}");
        assert_eq!(info.file_name, format!("run.{}", info.extension));
        assert_eq!(RecordingFormat::from_path(Path::new(info.file_name)), Some(format));
        assert_eq!(RecordingFormat::from_word(&info.extension.to_uppercase()), Some(format));
    }
    assert_eq!(rows().map(|row| row.extension).collect::<BTreeSet<_>>().len(), rows().count());
    assert_eq!(rows().map(|row| row.name).collect::<BTreeSet<_>>().len(), rows().count());
    for (a, b) in rows().flat_map(|a| rows().map(move |b| (a, b))) {
        assert!(a.format == b.format || b.magic.is_empty() || !a.magic.starts_with(b.magic), "{a:?}, {b:?}");
    }
}

/// Truth: the bytes of files, which must agree with the row.
#[test]
fn a_row_says_how_files_of_its_format_begin_and_what_a_killed_run_leaves() {
    for row in rows().filter(|row| row.format.is_built_in()) {
        let path = synthetic::scratch(&format!("row.{}", row.extension));
        let mut recorder = row.format.recorder(&path, CreateOptions::default().with_overwrite(true)).unwrap();
        recorder.begin(&synthetic::header()).unwrap();
        (0..50).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
        assert_eq!(path.exists(), row.survives_a_kill, "{}", row.name);
        recorder.finish(&synthetic::result()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(bytes.starts_with(row.magic), "{}", row.name);

        // Under the name of another format, the error names its own format.
        for other in RecordingFormat::ALL.into_iter().filter(|other| *other != row.format && !row.magic.is_empty()) {
            let error = open_recording(&path, other).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(&format!("found a file in the format {}", row.name)), "{error}");
        }
        std::fs::remove_file(path).unwrap();
    }
}

/// Truth: the limit itself. A sample at the limit is accepted, one beyond it is refused.
#[test]
fn a_file_takes_samples_up_to_the_time_that_its_row_says() {
    let header = || RunHeader { start_ns: None, ..synthetic::header() };
    for row in rows().filter(|row| row.format.is_built_in()) {
        let path = synthetic::scratch(&format!("limit.{}", row.extension));
        let mut recorder = row.format.recorder(&path, CreateOptions::default().with_overwrite(true)).unwrap();
        recorder.begin(&header()).unwrap();
        let at = |time_s: f64| flexarm_log::Sample { time_s, ..synthetic::sample(0) };
        match row.latest_s {
            Some(limit_s) => {
                recorder.record(&at(limit_s * (1.0 - 1e-9))).unwrap();
                let beyond = recorder.record(&at(limit_s * (1.0 + 1e-9)));
                assert!(matches!(beyond, Err(LogError::Time { .. })), "{}", row.name);
            }
            None => recorder.record(&at(1e12)).unwrap(),
        }
        drop(recorder);
        let _ = std::fs::remove_file(path); // some only exist once finished
    }
}

#[test]
fn mcap_holds_most_and_pictures_are_not_read_back() {
    let words = RecordingFormat::read_back().iter().map(|f| f.extension()).collect::<Vec<_>>();
    assert_eq!((words[0], words.len()), ("mcap", RecordingFormat::ALL.len() - 1));
    assert!(!words.contains(&"rrd"), "{words:?}");
}

/// Truth: the features of this build.
#[test]
fn a_format_is_built_in_if_its_feature_is() {
    assert!(rows().filter(|row| row.feature.is_none()).all(|row| row.format.is_built_in()));
    assert_eq!(RecordingFormat::Mcap.is_built_in(), cfg!(feature = "mcap"));
    assert!(!RecordingFormat::Rrd.is_built_in(), "a crate above installs it");
    assert_eq!(RecordingFormat::Parquet.is_built_in(), cfg!(feature = "parquet"));
}
