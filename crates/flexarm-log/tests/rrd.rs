//! Rerun recordings, read back with the decoder of the `rerun` crate.
#![cfg(feature = "rerun")]
#![allow(non_snake_case, reason = "monogram notation: X_WT, pose of T in W")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod synthetic;

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use flexarm_log::{CreateOptions, Recorder, RrdRecorder, RunHeader};
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};

const NEVER: Duration = Duration::MAX;

fn begin(path: &Path, header: &RunHeader, flush_every: Duration) -> RrdRecorder {
    let mut recorder = RrdRecorder::create(path, CreateOptions { overwrite: true, flush_every });
    recorder.begin(header).unwrap();
    recorder
}

fn run(name: &str, header: &RunHeader, samples: u64, flush_every: Duration) -> Vec<u8> {
    let path = synthetic::scratch(name);
    let mut recorder = begin(&path, header, flush_every);
    (0..samples).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&synthetic::result()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    bytes
}

/// Chunks of the recording itself, without those of its layout.
fn chunks(file: &[u8]) -> Vec<Chunk> {
    let messages = DecoderApp::decode_lazy(file).map(|message| message.unwrap());
    let data = messages.filter_map(|message| match message {
        LogMsg::ArrowMsg(store, message) if store.is_recording() => Some(Chunk::from_arrow_msg(&message).unwrap()),
        _ => None,
    });
    data.collect()
}

/// Rows with a time, per entity.
fn rows(file: &[u8]) -> BTreeMap<String, usize> {
    let mut rows = BTreeMap::new();
    for chunk in chunks(file).iter().filter(|chunk| !chunk.is_static()) {
        let mut timelines: Vec<_> = chunk.timelines().keys().map(|name| name.to_string()).collect();
        timelines.sort();
        assert_eq!(timelines, ["sim_time", "step"], "no clock in {}", chunk.entity_path());
        *rows.entry(chunk.entity_path().to_string()).or_insert(0) += chunk.num_rows();
    }
    rows
}

#[test]
fn every_entity_has_a_row_for_every_sample() {
    let file = run("rows.rrd", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let rows = rows(&file);
    let links = ["base_link", "column", "upper_arm", "forearm", "tool0", "tcp"];
    let robots = ["flexible", "rigid"].iter().flat_map(|twin| links.map(|link| format!("/synthetic/{twin}/{link}")));
    let plots = [
        "tcp_error/x",
        "tcp_error/y",
        "tcp_error/z",
        "tcp_error/norm",
        "tcp_error_path/tangential",
        "tcp_error_path/normal",
        "tcp_error_path/binormal",
        "tcp_error_rotation/x",
        "tcp_error_rotation/y",
        "tcp_error_rotation/z",
        "joints/position",
        "joints/effort/flexible",
        "joints/effort/rigid",
        "elastic/upper_arm",
        "energy",
        "solver",
    ];
    let expected = robots.chain(plots.map(|plot| format!("/plots/{plot}")));
    let expected: BTreeMap<_, _> = expected.map(|entity| (entity, synthetic::SAMPLES as usize)).collect();
    assert_eq!(rows, expected);

    let fixed: Vec<_> = chunks(&file).iter().filter(|c| c.is_static()).map(|c| c.entity_path().to_string()).collect();
    for entity in
        ["/synthetic/flexible/forearm/box", "/synthetic/rigid/forearm/box", "/synthetic/path/flexible", "/urdf"]
    {
        assert!(fixed.iter().any(|path| path == entity), "{entity} in {fixed:?}");
    }
    // At the start, and once more with the result.
    assert_eq!(fixed.iter().filter(|path| *path == "/summary").count(), 2);
}

/// Truth: the samples; millimetres where the names say so.
#[test]
fn curves_hold_the_samples() {
    let file = run("curves.rrd", &synthetic::header(), 20, NEVER);
    let values = |entity: &str| -> Vec<f64> {
        let chunks = chunks(&file);
        let chunk = chunks.iter().find(|c| !c.is_static() && c.entity_path().to_string() == entity).unwrap();
        let scalars = rerun::Scalars::descriptor_scalars().component;
        chunk.iter_slices::<f64>(scalars).flatten().copied().collect()
    };
    let samples: Vec<_> = (0..20).map(synthetic::sample).collect();
    assert_eq!(values("/plots/tcp_error/z"), samples.iter().map(|s| 1e3 * s.error_world[2]).collect::<Vec<_>>());
    let deflections: Vec<_> = samples.iter().flat_map(|s| s.elastic[0].deflection).map(|d| 1e3 * d).collect();
    assert_eq!(values("/plots/elastic/upper_arm"), deflections);
    let positions: Vec<_> = samples.iter().flat_map(|s| s.flexible.q.clone()).collect();
    assert_eq!(values("/plots/joints/position"), positions);
}

/// The provisional end, written after every sample or never, leaves no trace in the finished file.
#[test]
fn a_file_does_not_depend_on_when_it_was_flushed() {
    let samples = 700; // a full chunk and a started one
    let unflushed = run("never.rrd", &synthetic::header(), samples, NEVER);
    assert!(unflushed == run("again.rrd", &synthetic::header(), samples, NEVER));
    assert!(unflushed == run("always.rrd", &synthetic::header(), samples, Duration::ZERO));
}

#[test]
fn the_index_lists_the_recording_and_its_layout() {
    let file = run("index.rrd", &synthetic::header(), 10, NEVER);
    let mut decoder = DecoderApp::decode_lazy(file.as_slice());
    assert!(decoder.by_ref().all(|message| message.is_ok()));
    let stores: Vec<_> = decoder.rrd_manifests().unwrap().into_iter().map(|m| m.store_id).collect();
    assert_eq!(stores.len(), 2);
    assert!(stores.iter().all(|store| store.application_id().as_str() == "flexarm"));
    assert_eq!(stores.iter().filter(|store| store.is_recording()).count(), 1);
}

/// What a kill leaves is what is in the file at that moment: every sample up to the last flush, and the path.
#[test]
fn a_killed_run_keeps_every_sample() {
    let path = synthetic::scratch("killed.rrd");
    let mut recorder = begin(&path, &synthetic::header(), Duration::ZERO);
    for step in 0..600_u64 {
        recorder.record(&synthetic::sample(step)).unwrap();
        if step % 97 == 0 {
            let file = std::fs::read(&path).unwrap();
            assert!(rows(&file).values().all(|rows| *rows as u64 == step + 1), "{:?}", rows(&file));
            assert!(chunks(&file).iter().any(|chunk| chunk.entity_path().to_string() == "/synthetic/path/rigid"));
        }
    }
    drop(recorder);
    let file = std::fs::read(&path).unwrap();
    assert!(rows(&file).values().all(|rows| *rows == 600), "dropped without finish");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_robot_without_meshes_is_drawn_as_lines_and_one_without_a_twin_alone() {
    let header = RunHeader { meshes: Vec::new(), has_rigid: false, ..synthetic::header() };
    let file = run("lines.rrd", &header, 10, NEVER);
    let rows = rows(&file);
    assert_eq!(rows["/synthetic/flexible/skeleton"], 10);
    assert!(!rows.keys().any(|entity| entity.contains("rigid") || entity.contains("tcp_error")));
}

/// Names with characters that mean something in an entity path stay one part of it.
#[test]
fn any_name_is_one_part_of_a_path() {
    let header = RunHeader {
        robot: "my/robot 1".into(),
        joints: vec!["a/b".into(), "c d".into(), "".into()],
        ..synthetic::header()
    };
    let file = run("names.rrd", &header, 2, NEVER);
    assert!(rows(&file).contains_key(r"/my\/robot\ 1/flexible/column"), "{:?}", rows(&file).keys());
}
