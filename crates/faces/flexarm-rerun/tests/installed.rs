//! The format as `flexarm_log` sees it once it is installed: its row in the table of formats,
//! and a file made of a recording that is read back.

use crate::synthetic;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use flexarm_log::{
    CreateOptions, LogError, Recorder, RecorderSet, RecordingFormat, RunHeader, RunResult, STRESS_VIEW, Sample,
    Scenery, SceneryForm, open_recording,
};
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};

const SAMPLES: u64 = 60;

fn scratch(name: &str, format: RecordingFormat) -> PathBuf {
    synthetic::scratch(&format!("{name}.{}", format.extension()))
}

fn recorder(path: &Path, format: RecordingFormat) -> Box<dyn Recorder> {
    flexarm_rerun::install();
    format.recorder(path, CreateOptions::default().with_overwrite(true)).unwrap()
}

/// Header of a run with stress.
fn header() -> RunHeader {
    RunHeader { has_stress: true, ..synthetic::header() }
}

/// Its result, with a link coloured by stress and the label of a place.
fn result() -> RunResult {
    let places = vec![[0.0, 0.1, 0.2], [0.3, 0.1, 0.2], [0.3, 0.4, -1e-3]];
    let surface =
        SceneryForm::Surface { places: places.clone(), triangles: vec![[0, 1, 2]], colors: vec![[9, 8, 7, 255]; 3] };
    let labels = vec!["210.0 MPa".into()];
    let points = SceneryForm::Points { places: places[..1].to_vec(), colors: vec![[255; 4]], radius_m: 4e-3, labels };
    let scenery = |name: &str, form| Scenery { view: STRESS_VIEW.into(), name: name.into(), form };
    let scenery = vec![scenery("upper_arm", surface), scenery("upper_arm worst places", points)];
    RunResult { scenery, ..synthetic::result() }
}

/// Writes a recording of the synthetic run.
fn written(name: &str, format: RecordingFormat) -> PathBuf {
    let path = scratch(name, format);
    let mut recorder = recorder(&path, format);
    recorder.begin(&header()).unwrap();
    (0..SAMPLES).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&result()).unwrap();
    path
}

fn remove(paths: &[&PathBuf]) {
    paths.iter().for_each(|path| std::fs::remove_file(path).unwrap());
}

/// Number of rows of every entity.
fn rows(path: &Path) -> BTreeMap<String, usize> {
    let file = std::fs::read(path).unwrap();
    let mut rows = BTreeMap::new();
    for message in DecoderApp::decode_lazy(file.as_slice()) {
        if let LogMsg::ArrowMsg(store, message) = message.unwrap()
            && store.is_recording()
        {
            let chunk = Chunk::from_arrow_msg(&message).unwrap();
            *rows.entry(chunk.entity_path().to_string()).or_insert(0) += chunk.num_rows();
        }
    }
    rows
}

/// Truth: the bytes of the file, which must agree with the row in the table of formats.
#[test]
fn the_row_of_the_format_says_how_its_files_begin_and_what_a_killed_run_leaves() {
    let path = scratch("row", RecordingFormat::Rrd);
    let mut recorder = recorder(&path, RecordingFormat::Rrd);
    assert!(RecordingFormat::Rrd.is_built_in());
    recorder.begin(&header()).unwrap();
    (0..SAMPLES).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    assert!(path.exists() && RecordingFormat::Rrd.info().survives_a_kill);
    recorder.finish(&result()).unwrap();
    assert!(std::fs::read(&path).unwrap().starts_with(RecordingFormat::Rrd.info().magic));
    let error = open_recording(&path, RecordingFormat::Rrd).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("for viewing") && error.contains("run.mcap"), "{error}");
    remove(&[&path]);
}

/// Truth: the limit itself. A sample at the limit is accepted, one beyond it is refused.
#[test]
fn a_file_takes_samples_up_to_the_time_that_its_row_says() {
    let path = scratch("limit", RecordingFormat::Rrd);
    let mut recorder = recorder(&path, RecordingFormat::Rrd);
    recorder.begin(&header()).unwrap();
    let at = |time_s: f64| Sample { time_s, ..synthetic::sample(0) };
    let limit_s = RecordingFormat::Rrd.info().latest_s.unwrap();
    recorder.record(&at(limit_s * (1.0 - 1e-9))).unwrap();
    assert!(matches!(recorder.record(&at(limit_s * (1.0 + 1e-9))), Err(LogError::Time { .. })));
    drop(recorder);
    remove(&[&path]);
}

#[test]
fn a_recorder_on_a_thread_writes_the_same_rows() {
    let (one, mcap, plain) = (
        scratch("thread", RecordingFormat::Rrd),
        scratch("thread", RecordingFormat::Mcap),
        written("plain", RecordingFormat::Rrd),
    );
    let mut set = RecorderSet::new();
    set.push(recorder(&one, RecordingFormat::Rrd));
    set.push(recorder(&mcap, RecordingFormat::Mcap));
    set.begin(&header()).unwrap();
    set.on_threads();
    (0..SAMPLES).for_each(|step| set.record(&synthetic::sample(step)).unwrap());
    set.finish(&result()).unwrap();
    assert_eq!(rows(&one), rows(&plain));
    remove(&[&one, &mcap, &plain]);
}

/// The contents of a Rerun file do not depend on whether the run was converted.
#[test]
fn a_rerun_file_made_of_an_mcap_file_shows_the_same() {
    let direct = written("direct", RecordingFormat::Rrd);
    let mcap = written("way", RecordingFormat::Mcap);
    let over = scratch("over-mcap", RecordingFormat::Rrd);
    let mut source = open_recording(&mcap, RecordingFormat::Mcap).unwrap();
    let mut recorder = recorder(&over, RecordingFormat::Rrd);
    recorder.begin(source.header()).unwrap();
    assert!(source.header().has_stress);
    let read = source.replay(&mut |sample| recorder.record(sample)).unwrap();
    assert_eq!(read.scenery, result().scenery);
    recorder.finish(&read).unwrap();

    let (a, b) = (rows(&direct), rows(&over));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    assert_eq!(a, b, "as many rows");
    assert!(a.contains_key("/synthetic/flexible/forearm/box"), "meshes: {a:?}");
    assert!(a.keys().any(|name| name.starts_with("/scenery/Stress/upper_arm")), "stress: {a:?}");
    remove(&[&direct, &mcap, &over]);
}
