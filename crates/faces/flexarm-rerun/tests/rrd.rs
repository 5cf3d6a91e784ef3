//! Rerun recordings, read back with the decoder of the `rerun` crate.

use crate::synthetic;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use flexarm_draw::palette::{self, Ground};
use flexarm_kinematics::Pose;
use flexarm_log::{Caption, CreateOptions, Recorder, RunHeader, StudyRecorder, study_recorder};
use flexarm_rerun::RrdRecorder;
use rerun::ComponentIdentifier;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};

const NEVER: Duration = Duration::MAX;

fn begin(path: &Path, header: &RunHeader, flush_every: Duration) -> RrdRecorder {
    let mut recorder = RrdRecorder::create(path, CreateOptions { overwrite: true, flush_every });
    recorder.begin(header).unwrap();
    recorder
}

fn study(path: &Path, labels: Vec<String>) -> Box<dyn StudyRecorder> {
    flexarm_rerun::install();
    study_recorder(path, CreateOptions { overwrite: true, flush_every: NEVER }, labels).unwrap()
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

/// Number of rows with a time, per entity.
fn rows(file: &[u8]) -> BTreeMap<String, usize> {
    let mut rows = BTreeMap::new();
    for chunk in chunks(file).iter().filter(|chunk| !chunk.is_static()) {
        let mut timelines: Vec<_> = chunk.timelines().keys().map(|name| name.to_string()).collect();
        timelines.sort();
        let expected =
            if chunk.entity_path().to_string() == "/events" { &["sim_time"][..] } else { &["sim_time", "step"] };
        assert_eq!(timelines, expected, "no clock in {}", chunk.entity_path());
        *rows.entry(chunk.entity_path().to_string()).or_insert(0) += chunk.num_rows();
    }
    rows
}

/// Number of samples drawn: at most every 5 ms, so with 500 samples per second every third one, and
/// the last one.
const DRAWN: usize = 335;

#[test]
fn the_error_has_a_row_for_every_sample_and_the_robots_for_every_picture() {
    let file = run("rows.rrd", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let rows = rows(&file);
    let error = ["tcp_error/x", "tcp_error/y", "tcp_error/z", "tcp_error/norm"];
    let path_error = ["tcp_error_path/tangential", "tcp_error_path/normal", "tcp_error_path/binormal"];
    for plot in error.iter().chain(&path_error) {
        assert_eq!(rows[&format!("/plots/{plot}")], synthetic::SAMPLES as usize, "{plot}");
    }
    let causes = [
        "tcp_error_rotation/x",
        "tcp_error_rotation/y",
        "tcp_error_rotation/z",
        "contributions",
        "strain",
        "stress",
        "joints/position",
        "joints/velocity",
        "joints/effort/flexible",
        "joints/effort/rigid",
        "elastic/upper_arm",
        "elastic_load/upper_arm",
        "energy",
        "solver",
    ];
    for plot in causes {
        assert_eq!(rows[&format!("/plots/{plot}")], DRAWN, "{plot}");
    }
    // A fixed link has one row; a link that comes to rest has none afterwards; the ringing decays
    // slowly.
    for twin in ["flexible", "rigid", "magnified"] {
        let of = |link: &str| rows[&format!("/synthetic/{twin}/{link}")];
        assert_eq!(of("base_link"), 1);
        assert!((180..=DRAWN).contains(&of("forearm")), "{}", of("forearm"));
    }
    assert_eq!(rows["/synthetic/magnified/tcp"], DRAWN);
    assert_eq!(rows["/synthetic/magnified/error"], DRAWN);
    assert_eq!((rows["/events"], rows["/plots/tcp_error/peak"]), (3, 1));

    let fixed: Vec<_> = chunks(&file).iter().filter(|c| c.is_static()).map(|c| c.entity_path().to_string()).collect();
    for entity in [
        "/synthetic/flexible/forearm/box",
        "/synthetic/rigid/forearm/box",
        "/synthetic/magnified/upper_arm/box/bending",
        "/synthetic/path/flexible",
        "/synthetic/path/magnified",
        "/synthetic/path/peak",
        "/urdf",
    ] {
        assert!(fixed.iter().any(|path| path == entity), "{entity} in {fixed:?}");
    }
    // At the start, and once more with the result.
    assert_eq!(fixed.iter().filter(|path| *path == "/summary").count(), 2);
}

/// Rows of a column with a fixed number of values per row, with their times (ns).
fn column(file: &[u8], entity: &str, component: &'static str, width: usize) -> Vec<(i64, Vec<f32>)> {
    let mut found = Vec::new();
    for chunk in chunks(file).iter().filter(|c| !c.is_static() && c.entity_path().to_string() == entity) {
        let times =
            chunk.timelines().iter().find(|(name, _)| name.as_str() == "sim_time").unwrap().1.times_raw().to_vec();
        let id = ComponentIdentifier::from(component);
        let rows: Vec<Vec<f32>> = match width {
            3 => chunk.iter_slices::<[f32; 3]>(id).map(|row| row.iter().flatten().copied().collect()).collect(),
            _ => chunk.iter_slices::<[f32; 4]>(id).map(|row| row.iter().flatten().copied().collect()).collect(),
        };
        if rows.is_empty() {
            continue; // other components of the entity have their own times
        }
        assert_eq!(times.len(), rows.len());
        found.extend(times.into_iter().zip(rows));
    }
    found.sort_by_key(|(time, _)| *time);
    found
}

/// Poses of an entity (times in ns), as the viewer applies them.
fn poses(file: &[u8], entity: &str) -> Vec<(i64, Pose)> {
    let places = column(file, entity, "Transform3D:translation", 3);
    let turns = column(file, entity, "Transform3D:quaternion", 4);
    let pose = |((time, p), (_, q)): ((i64, Vec<f32>), (i64, Vec<f32>))| {
        let turn = nalgebra::Quaternion::new(q[3], q[0], q[1], q[2]).cast::<f64>();
        let turn = nalgebra::UnitQuaternion::from_quaternion(turn).to_rotation_matrix();
        let place = nalgebra::Vector3::new(p[0], p[1], p[2]).cast::<f64>();
        (time, Pose::from_parts(place.into(), turn))
    };
    places.into_iter().zip(turns).map(pose).collect()
}

/// Pose of an entity at a time: that of the last row at or before it.
fn latest(rows: &[(i64, Pose)], time_ns: i64) -> Pose {
    rows.iter().rev().find(|(time, _)| *time <= time_ns).unwrap().1
}

/// Truth: the TCP position in the sample, and so in every other recording. It is compared with the
/// surfaces: the forearm's mesh ends at the TCP, the upper arm's bent mesh ends where the forearm
/// begins.
#[test]
fn the_moving_surfaces_agree_with_the_tool_centre_point_to_a_micrometre() {
    let file = run("surfaces.rrd", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let mut worst: [f64; 3] = [0.0; 3];
    for twin in ["flexible", "rigid"] {
        let at = |entity: &str| poses(&file, &format!("/synthetic/{twin}/{entity}"));
        let (forearm, tcp, upper_arm) = (at("forearm"), at("tcp"), at("upper_arm"));
        let far = if twin == "flexible" { at("upper_arm/box/far") } else { Vec::new() };
        for step in (0..synthetic::SAMPLES).step_by(3) {
            let sample = synthetic::sample(step);
            let time_ns = (sample.time_s * 1e9).round() as i64;
            let truth = if twin == "flexible" { &sample.flexible } else { &sample.rigid };
            let T = truth.X_WT.translation.vector;
            // End of the forearm's box in its own axes.
            let tip = latest(&forearm, time_ns) * nalgebra::Point3::new(0.6, 0.0, 0.0);
            worst[0] = worst[0].max((tip.coords - T).norm());
            worst[1] = worst[1].max((latest(&tcp, time_ns).translation.vector - T).norm());
            if twin == "flexible" {
                // Part rigid with the distal interface of the flexible link, at that interface.
                let end = latest(&upper_arm, time_ns) * latest(&far, time_ns) * nalgebra::Point3::new(0.8, 0.0, 0.0);
                worst[2] = worst[2].max((end.coords - truth.X_WL[3].translation.vector).norm());
            }
        }
    }
    // Measured 6.6e-8, 6.6e-8 and 4.5e-8 m: single precision.
    assert!(worst.iter().all(|error| *error < 1e-6), "{worst:?}");
}

/// Truth: the line through the stations of the sample at the same time. The bent surface ends at
/// the distal interface.
#[test]
fn the_bent_surface_ends_where_the_far_interface_is() {
    let file = run("bent.rrd", &synthetic::header(), synthetic::SAMPLES, NEVER);
    for (twin, bound) in [("flexible", 1e-6), ("magnified", 0.5 * 3f64.sqrt() / 512.0 + 1e-6)] {
        let entity = format!("/synthetic/{twin}/upper_arm/box/bending");
        let shapes = column(&file, &entity, "Mesh3D:vertex_positions", 3);
        assert!(shapes.len() > 3, "{} shapes", shapes.len());
        let undeformed: Vec<f32> = chunks(&file)
            .iter()
            .find(|c| c.is_static() && c.entity_path().to_string() == entity)
            .map(|chunk| {
                let id = ComponentIdentifier::from("Mesh3D:vertex_positions");
                chunk.iter_slices::<[f32; 3]>(id).flatten().flatten().copied().collect()
            })
            .unwrap();
        let magnifier = flexarm_draw::Magnifier::new(&synthetic::header());
        let mut worst: f64 = 0.0;
        for (time_ns, shape) in &shapes {
            let sample = synthetic::sample((*time_ns as f64 * 1e-9 * synthetic::RATE_HZ).round() as u64);
            let robot = if twin == "flexible" { sample.flexible } else { magnifier.magnified(&sample) };
            let X_LS = robot.X_WL[2].inv_mul(&robot.X_WS[1]);
            for (was, is) in undeformed.chunks(3).zip(shape.chunks(3)).filter(|(was, _)| was[0] == 0.8) {
                let on_station = nalgebra::Point3::new(0.0, f64::from(was[1]), f64::from(was[2]));
                let is = nalgebra::Point3::new(is[0], is[1], is[2]).cast::<f64>();
                worst = worst.max((X_LS * on_station - is).norm());
            }
        }
        assert!(worst > 0.0 && worst < bound, "{twin}: {worst:e}");
    }
}

/// Truth: the samples, in millimetres where the names say so.
#[test]
fn curves_hold_the_samples() {
    let file = run("curves.rrd", &synthetic::header(), 21, NEVER);
    let values = |entity: &str| -> Vec<f64> {
        let chunks = chunks(&file);
        let chunk = chunks.iter().find(|c| !c.is_static() && c.entity_path().to_string() == entity).unwrap();
        let scalars = rerun::Scalars::descriptor_scalars().component;
        chunk.iter_slices::<f64>(scalars).flatten().copied().collect()
    };
    let samples: Vec<_> = (0..21).map(synthetic::sample).collect();
    assert_eq!(values("/plots/tcp_error/z"), samples.iter().map(|s| 1e3 * s.error_world[2]).collect::<Vec<_>>());
    let drawn = || samples.iter().step_by(3).chain(samples.last());
    let deflections: Vec<_> = drawn().flat_map(|s| s.elastic[0].deflection).map(|d| 1e3 * d).collect();
    assert_eq!(values("/plots/elastic/upper_arm"), deflections);
    assert_eq!(values("/plots/joints/position"), drawn().flat_map(|s| s.flexible.q.clone()).collect::<Vec<_>>());
}

/// Values of all components of all entities of recording and layout, in order of time.
fn content(file: &[u8]) -> BTreeMap<String, Vec<(i64, String)>> {
    let mut content: BTreeMap<String, Vec<(i64, String)>> = BTreeMap::new();
    for chunk in chunks(file).iter().chain(&layout(file)) {
        let simulated = |name: &str| ["sim_time", "blueprint"].contains(&name);
        let times = chunk.timelines().values().find(|times| simulated(times.timeline().name().as_str()));
        for component in chunk.components().values() {
            let rows = content.entry(format!("{} {}", chunk.entity_path(), component.descriptor)).or_default();
            for row in 0..chunk.num_rows() {
                let time = times.map_or(0, |times| times.times_raw()[row]);
                rows.push((time, format!("{:?}", component.list_array.value(row))));
            }
        }
    }
    content.values_mut().for_each(|rows| rows.sort());
    content
}

#[test]
fn equal_runs_give_equal_content_whenever_they_were_flushed() {
    let samples = 1200; // a full chunk and a partial one
    let mut contents = [("never", NEVER), ("again", NEVER), ("always", Duration::ZERO)]
        .map(|(name, flush_every)| content(&run(&format!("{name}.rrd"), &synthetic::header(), samples, flush_every)));
    assert!(contents[0].len() > 100, "{} columns", contents[0].len());
    for other in 1..3 {
        for (column, rows) in std::mem::take(&mut contents[other]) {
            assert_eq!(contents[0][&column], rows, "{column}");
        }
    }
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

/// After a kill the file has all rows except the last ones, which were too few to be
/// written.
#[test]
fn a_killed_run_keeps_all_but_the_last_samples() {
    let path = synthetic::scratch("killed.rrd");
    let mut recorder = begin(&path, &synthetic::header(), Duration::ZERO);
    for step in 0..600_u64 {
        recorder.record(&synthetic::sample(step)).unwrap();
        if step % 97 == 0 {
            let file = std::fs::read(&path).unwrap();
            let rows = rows(&file);
            let left = rows.get("/plots/tcp_error/norm").map_or(0, |rows| *rows as u64);
            assert_eq!(left, (step + 1) / 128 * 128, "after {} samples", step + 1);
        }
    }
    drop(recorder);
    let file = std::fs::read(&path).unwrap();
    assert_eq!(rows(&file)["/plots/tcp_error/norm"], 600, "dropped without finish");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_robot_without_meshes_is_drawn_as_lines_and_one_without_a_twin_alone() {
    let header = RunHeader { meshes: Vec::new(), has_rigid: false, ..synthetic::header() };
    let file = run("lines.rrd", &header, 10, NEVER);
    let rows = rows(&file);
    assert_eq!(rows["/synthetic/flexible/skeleton"], 4);
    let twin = ["rigid", "tcp_error", "magnified"];
    assert!(!rows.keys().any(|entity| twin.iter().any(|word| entity.contains(word))), "{:?}", rows.keys());
}

/// Mode shapes have an arbitrary scale: the current mode is named, and no curve, mark or path gives
/// millimetres.
#[test]
fn a_recording_of_shapes_names_what_it_shows_and_has_no_curves() {
    let caption = |from_s: f64, text: &str| Caption { from_s, text: text.into() };
    let captions = vec![caption(0.0, "mode 1: 6.83 Hz"), caption(0.1, "mode 2: 7.76 Hz")];
    let header = RunHeader { captions, magnification: 0.0, ..synthetic::header() };
    let file = run("shapes.rrd", &header, 100, NEVER);
    let rows = rows(&file);
    assert_eq!((rows["/caption"], rows["/synthetic/caption"]), (2, 2));
    assert!(!rows.keys().any(|entity| entity.starts_with("/plots")), "{:?}", rows.keys());
    let fixed: Vec<_> = chunks(&file).iter().map(|chunk| chunk.entity_path().to_string()).collect();
    assert!(!fixed.iter().any(|entity| entity.starts_with("/synthetic/path")), "{fixed:?}");
    assert!(rows.contains_key("/synthetic/flexible/tcp"));
}

/// Names with special characters of entity paths remain a single part.
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

#[test]
fn a_study_holds_all_its_runs_in_one_readable_file() {
    let path = synthetic::scratch("study.rrd");
    let write = || {
        let study = study(&path, vec!["one".into(), "two/2".into()]);
        for number in 0..2 {
            let mut run = study.recorder(number);
            run.check().unwrap();
            run.begin(&synthetic::header()).unwrap();
            (0..100).for_each(|step| run.record(&synthetic::sample(step)).unwrap());
            run.finish(&synthetic::result()).unwrap();
        }
        study.finish("# Two runs").unwrap();
        std::fs::read(&path).unwrap()
    };
    let file = write();
    assert_eq!(content(&file), content(&write()), "the same runs give the same content");
    std::fs::remove_file(&path).unwrap();
    let rows = rows(&file);
    assert_eq!((rows["/plots/study/error/one"], rows[r"/plots/study/error/two\/2"]), (100, 100));
    assert_eq!((rows["/one/magnified/tcp"], rows[r"/two\/2/magnified/tcp"]), (34, 34));
    assert_eq!(rows["/plots/tcp_error/norm"], 100, "curves of the first run only");
    assert!(rows.contains_key("/one/rigid/tcp") && !rows.contains_key(r"/two\/2/rigid/tcp"));
    let mut decoder = DecoderApp::decode_lazy(file.as_slice());
    assert!(decoder.by_ref().all(|message| message.is_ok()));
}

/// Identity of the recording in a file.
fn identity(file: &[u8]) -> String {
    let mut messages = DecoderApp::decode_lazy(file).map(|message| message.unwrap());
    messages
        .find_map(|message| match message {
            LogMsg::SetStoreInfo(store) => Some(store.info.store_id.recording_id().as_str().to_owned()),
            _ => None,
        })
        .unwrap()
}

/// Viewers merge recordings with the same identity: two set-ups, or a run and a study of it, must
/// not share one.
#[test]
fn recordings_of_different_set_ups_have_different_identities() {
    let header = synthetic::header();
    let mut other = header.clone();
    other.attachments[0].bytes = b"damping = 0.005".to_vec();
    let identities = [&header, &header, &other].map(|header| identity(&run("identity.rrd", header, 2, NEVER)));
    assert_eq!(identities[0], identities[1]);
    assert_ne!(identities[0], identities[2]);
    let path = synthetic::scratch("identity-study.rrd");
    let study = study(&path, vec!["one".into()]);
    let mut run = study.recorder(0);
    run.begin(&header).unwrap();
    run.finish(&synthetic::result()).unwrap();
    study.finish("").unwrap();
    assert_ne!(identity(&std::fs::read(&path).unwrap()), identities[0]);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_study_that_is_given_up_keeps_the_runs_it_has() {
    let path = synthetic::scratch("given-up.rrd");
    let study = study(&path, vec!["one".into(), "two".into()]);
    let mut first = study.recorder(0);
    first.begin(&synthetic::header()).unwrap();
    (0..100).for_each(|step| first.record(&synthetic::sample(step)).unwrap());
    first.finish(&synthetic::result()).unwrap();
    // If killed here, the first run would be in the file.
    assert_eq!(rows(&std::fs::read(&path).unwrap())["/plots/study/error/one"], 100);
    let mut second = study.recorder(1);
    second.begin(&synthetic::header()).unwrap();
    (0..10).for_each(|step| second.record(&synthetic::sample(step)).unwrap());
    drop((second, study));
    let file = std::fs::read(&path).unwrap();
    assert_eq!(rows(&file)["/plots/study/error/two"], 10);
    let mut decoder = DecoderApp::decode_lazy(file.as_slice());
    assert!(decoder.by_ref().all(|message| message.is_ok()));
    assert_eq!(decoder.rrd_manifests().unwrap().len(), 2, "with its index");
    std::fs::remove_file(path).unwrap();
}

/// REP-199 names the tool frame `tcp`: the link keeps its pose, and the TCP entity has its
/// own.
#[test]
fn a_link_called_tcp_and_the_tool_centre_point_are_two_entities() {
    let mut header = synthetic::header();
    header.links[4].name = "tcp".into();
    let file = run("tcp.rrd", &header, 30, NEVER);
    let rows = rows(&file);
    assert_eq!((rows["/synthetic/flexible/tcp"], rows["/synthetic/flexible/link_tcp"]), (11, 11));
}

/// Chunks of the layout.
fn layout(file: &[u8]) -> Vec<Chunk> {
    let messages = DecoderApp::decode_lazy(file).map(|message| message.unwrap());
    let data = messages.filter_map(|message| match message {
        LogMsg::ArrowMsg(store, message) if !store.is_recording() => Some(Chunk::from_arrow_msg(&message).unwrap()),
        _ => None,
    });
    data.collect()
}

fn component(name: &'static str) -> ComponentIdentifier {
    ComponentIdentifier::from(name)
}

fn texts(chunks: &[Chunk], name: &'static str) -> Vec<String> {
    let of = |chunk: &Chunk| -> Vec<String> {
        chunk.iter_slices::<String>(component(name)).flatten().map(|text| text.as_str().to_owned()).collect()
    };
    chunks.iter().flat_map(of).collect()
}

/// Truth: the names of frames in MCAP files, and the viewer's name for the frame of an entity.
#[test]
fn frames_have_the_names_of_the_links_each_once() {
    let chunks = chunks(&run("frames.rrd", &synthetic::header(), 10, NEVER));
    let mut names = texts(&chunks, "Transform3D:child_frame");
    let parents = texts(&chunks, "Transform3D:parent_frame");
    let at = |name: &str| parents[names.iter().position(|own| own == name).unwrap()].as_str();
    assert_eq!(at("forearm"), "tf#/synthetic/flexible/forearm");
    assert_eq!(at("rigid/forearm"), "tf#/synthetic/rigid/forearm");
    assert_eq!(at("magnified/forearm"), "tf#/synthetic/magnified/forearm");
    let tool = format!("rigid/{}/tcp", synthetic::header().tcp);
    assert_eq!(at(&tool), "tf#/synthetic/rigid/tcp");
    names.sort();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
}

/// Ten seconds at 500 Hz: a chunk for each entity and a few more.
#[test]
fn a_short_run_has_few_chunks() {
    let chunks = chunks(&run("chunks.rrd", &synthetic::header(), 5_000, Duration::from_millis(500)));
    let mut entities: Vec<String> = chunks.iter().map(|chunk| chunk.entity_path().to_string()).collect();
    entities.sort();
    entities.dedup();
    // measured: see the assertion
    assert!(chunks.len() <= 2 * entities.len(), "{} chunks of {} entities", chunks.len(), entities.len());
}

#[test]
fn what_happened_is_information_and_not_for_debugging() {
    let file = run("levels.rrd", &synthetic::header(), 100, NEVER);
    let levels = texts(&chunks(&file), "TextLog:level");
    assert_eq!(levels.len(), 3);
    assert!(levels.iter().all(|level| level == "INFO"), "{levels:?}");
}

/// Truth: the rule of the viewer, which labels multiples of powers of ten at least 20 pixels apart.
#[test]
fn every_plot_has_an_axis_with_labels_at_the_end() {
    let file = run("axes.rrd", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let mut axes = 0;
    for chunk in layout(&file).iter().filter(|chunk| chunk.entity_path().to_string().ends_with("/ScalarAxis")) {
        for range in chunk.iter_slices::<[f64; 2]>(component("ScalarAxis:range")).flatten() {
            let [low, high] = *range;
            let unit = 10f64.powf((20.0 * (high - low) / 425.0).log10().ceil());
            let labels = (high / unit).floor() - (low / unit).ceil() + 1.0;
            assert!(labels >= 2.0, "{low}..{high}: {labels}");
            axes += 1;
        }
    }
    assert!(axes >= 9, "{axes} axes");
}

/// Colours of the curves of an entity.
fn colors(chunks: &[Chunk], entity: &str) -> Vec<u32> {
    let own = chunks.iter().filter(|chunk| chunk.entity_path().to_string() == entity);
    own.flat_map(|chunk| {
        chunk.iter_slices::<u32>(component("SeriesLines:colors")).flatten().copied().collect::<Vec<_>>()
    })
    .collect()
}

fn number([red, green, blue]: palette::Rgb) -> u32 {
    u32::from_be_bytes([red, green, blue, 0xff])
}

/// Truth: the table of colours used by the report.
#[test]
fn colours_are_those_of_the_report_and_no_two_shares_have_the_same() {
    let count = 14;
    let contributors: Vec<String> = (0..count).map(|k| format!("part {k}")).collect();
    let header = RunHeader { contributors, ..synthetic::header() };
    let path = synthetic::scratch("colors.rrd");
    let mut recorder = begin(&path, &header, NEVER);
    let mut sample = synthetic::sample(0);
    sample.contributions = vec![[0.0; 3]; count];
    recorder.record(&sample).unwrap();
    recorder.finish(&synthetic::result()).unwrap();
    let chunks = chunks(&std::fs::read(&path).unwrap());
    std::fs::remove_file(path).unwrap();
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        for plot in ["tcp_error", "tcp_error_rotation"] {
            assert_eq!(colors(&chunks, &format!("/plots/{plot}/{axis}")), [number(palette::axis(k, Ground::Dark))]);
        }
    }
    let shares = colors(&chunks, "/plots/contributions");
    assert_eq!(shares, (0..count).map(|k| number(palette::series(k, Ground::Dark))).collect::<Vec<_>>());
    let distinct: std::collections::BTreeSet<u32> = shares.iter().copied().collect();
    assert_eq!(distinct.len(), count);
}

#[test]
fn a_study_has_its_runs_in_the_order_of_colours_and_says_whose_events_and_shares_it_shows() {
    let path = synthetic::scratch("study_colors.rrd");
    let labels = ["as given", "modal"];
    let study = study(&path, labels.map(str::to_owned).to_vec());
    for number in 0..2 {
        let mut run = study.recorder(number);
        run.begin(&synthetic::header()).unwrap();
        (0..50).for_each(|step| run.record(&synthetic::sample(step)).unwrap());
        run.finish(&synthetic::result()).unwrap();
    }
    study.finish("# Two runs").unwrap();
    let file = std::fs::read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    let recording = chunks(&file);
    for (k, label) in [r"/plots/study/error/as\ given", "/plots/study/error/modal"].iter().enumerate() {
        assert_eq!(colors(&recording, label), [number(palette::series(k, Ground::Dark))], "{label}");
    }
    let titles = texts(&layout(&file), "ViewBlueprint:display_name");
    for title in ["as given: events", "as given: shares of the error [mm]"] {
        assert!(titles.iter().any(|known| known == title), "{titles:?}");
    }
}

#[test]
fn arms_from_a_tenth_of_a_millimetre_to_a_kilometre_are_recorded() {
    for extent in [1e-4, 0.02, 0.07, 3.0, 1e3] {
        let volume = Some([[0.0, 0.0, 0.0], [extent, extent, 0.5 * extent]]);
        for color_scale_m in [0.0, 1e-6, 1e-3, 0.1] {
            let header = synthetic::header();
            let header = RunHeader { volume, color_scale_m, ..header };
            let file = run("sizes.rrd", &header, 20, Duration::from_secs(3600));
            assert_eq!(rows(&file)["/plots/tcp_error/norm"], 20, "{extent} m, scale {color_scale_m} m");
        }
    }
}
