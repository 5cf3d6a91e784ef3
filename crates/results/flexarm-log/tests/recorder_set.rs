//! Several files at once, and existing files.

use crate::synthetic;
use std::error::Error;
use std::path::{Path, PathBuf};

use flexarm_log::{CreateOptions, CsvRecorder, LogError, Recorder, RecorderSet, RunHeader, RunResult, Sample};

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
    assert!(error.to_string().ends_with("overwrite it with overwrite"), "{error}");
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

/// A recorder with a full disk from the first sample on.
struct Full(PathBuf);

impl Recorder for Full {
    fn begin(&mut self, _: &RunHeader) -> Result<(), LogError> {
        std::fs::write(&self.0, "begun").map_err(|source| self.error(source))
    }

    fn record(&mut self, _: &Sample) -> Result<(), LogError> {
        Err(self.error(std::io::ErrorKind::StorageFull.into()))
    }

    fn finish(&mut self, _: &RunResult) -> Result<(), LogError> {
        self.record(&Sample::default())
    }

    fn path(&self) -> &Path {
        &self.0
    }
}

impl Full {
    fn error(&self, source: std::io::Error) -> LogError {
        LogError::Io { path: self.0.clone(), action: "write", source }
    }
}

#[test]
fn one_failing_recorder_does_not_cost_the_others_their_data() {
    let (good, bad) = (synthetic::scratch("good.csv"), synthetic::scratch("full.csv"));
    let mut set = RecorderSet::new();
    set.push(Box::new(Full(bad.clone())));
    set.push(Box::new(CsvRecorder::create(&good, CreateOptions::default())));
    set.begin(&synthetic::header()).unwrap();
    assert!(set.record(&synthetic::sample(0)).is_err());
    assert!(set.finish(&RunResult::default()).is_err());
    assert_eq!(std::fs::read_to_string(&good).unwrap().lines().count(), 2);
    [good, bad].iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

/// Truth: files written by a single thread, sample after sample.
#[test]
fn files_that_are_written_on_threads_have_the_same_bytes() {
    let paths = |folder: &str| {
        let folder = synthetic::scratch(folder);
        std::fs::create_dir(&folder).unwrap();
        let formats = flexarm_log::RecordingFormat::ALL.into_iter().filter(|format| format.is_built_in());
        formats.map(|format| (format, folder.join(format.info().file_name))).collect::<Vec<_>>()
    };
    let write = |paths: &[(flexarm_log::RecordingFormat, PathBuf)], on_threads: bool| {
        let mut set = RecorderSet::new();
        set.extend(paths.iter().map(|(format, path)| format.recorder(path, CreateOptions::default()).unwrap()));
        set.begin(&synthetic::header()).unwrap();
        if on_threads {
            set.on_threads();
        }
        for k in 0..synthetic::SAMPLES {
            set.record(&synthetic::sample(k)).unwrap();
        }
        set.finish(&synthetic::result()).unwrap();
    };
    let (here, there) = (paths("here"), paths("on-threads"));
    write(&here, false);
    write(&there, true);
    for ((format, one), (_, other)) in here.iter().zip(&there) {
        assert!(std::fs::read(one).unwrap() == std::fs::read(other).unwrap(), "{format} differs");
    }
    [here, there].iter().for_each(|paths| std::fs::remove_dir_all(paths[0].1.parent().unwrap()).unwrap());
}

/// The error is returned some samples late; the other files are complete. Abandoned recorders close
/// their files.
#[test]
fn a_recorder_that_fails_on_its_thread_is_told_and_the_others_have_all_samples() {
    for finished in [true, false] {
        let (good, bad) = (synthetic::scratch("good-thread.csv"), synthetic::scratch("full-thread.csv"));
        let mut set = RecorderSet::new();
        set.push(Box::new(Full(bad.clone())));
        set.push(Box::new(CsvRecorder::create(&good, CreateOptions::default())));
        set.begin(&synthetic::header()).unwrap();
        set.on_threads();
        let mut samples = 0;
        let told = loop {
            samples += 1;
            if let Err(error) = set.record(&synthetic::sample(samples % synthetic::SAMPLES)) {
                break error;
            }
            assert!(samples < 1_000_000, "nothing is reported");
        };
        assert!(matches!(told, LogError::Io { .. }), "{told}");
        if finished {
            assert!(set.finish(&RunResult::default()).is_err());
        } else {
            drop(set);
        }
        assert_eq!(std::fs::read_to_string(&good).unwrap().lines().count() as u64, samples + 1);
        [good, bad].iter().for_each(|path| std::fs::remove_file(path).unwrap());
    }
}

/// If a recorder cannot begin, the new files of the others are removed, and existing ones are
/// unchanged.
#[test]
fn one_that_cannot_begin_leaves_no_file_of_the_others() {
    let (new, bad) = (synthetic::scratch("new-too.csv"), synthetic::scratch("missing").join("bad.csv"));
    let mut set = pair(&new, &bad, CreateOptions::default());
    assert!(set.begin(&synthetic::header()).is_err());
    assert!(!new.exists());

    // A folder has the name of the second file: the first file is not replaced.
    let (old, folder) = (synthetic::scratch("precious.csv"), synthetic::scratch("folder.csv"));
    std::fs::write(&old, "precious").unwrap();
    std::fs::create_dir(&folder).unwrap();
    let mut set = pair(&old, &folder, CreateOptions::default().with_overwrite(true));
    let error = set.begin(&synthetic::header()).unwrap_err().to_string();
    assert!(error.contains("folder.csv"), "{error}");
    assert_eq!(std::fs::read_to_string(&old).unwrap(), "precious");
    std::fs::remove_file(old).unwrap();
    std::fs::remove_dir(folder).unwrap();
}

#[test]
#[cfg(unix)]
fn files_that_are_gone_at_the_end_are_all_named() {
    let paths = ["a.csv", "b.csv", "c.csv"].map(synthetic::scratch);
    let mut set = RecorderSet::new();
    paths.iter().for_each(|path| set.push(Box::new(CsvRecorder::create(path, CreateOptions::default()))));
    set.begin(&synthetic::header()).unwrap();
    set.record(&synthetic::sample(0)).unwrap();
    std::fs::remove_file(&paths[0]).unwrap();
    std::fs::remove_file(&paths[2]).unwrap();
    std::fs::write(&paths[2], "another file of that name").unwrap();
    let Err(LogError::Gone { paths: gone }) = set.finish(&RunResult::default()) else { panic!("nothing is missed") };
    assert_eq!(gone, [paths[0].clone(), paths[2].clone()]);
    paths[1..].iter().for_each(|path| std::fs::remove_file(path).unwrap());
}
