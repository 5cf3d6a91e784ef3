//! MCAP recordings, read back with the `mcap` crate.
#![cfg(feature = "mcap")]
#![allow(non_snake_case, reason = "monogram notation: X_WT, pose of T in W")]
#![allow(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod synthetic;

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use flexarm_log::{CreateOptions, LinkInfo, LogError, McapRecorder, Recorder, RunHeader, RunResult};
use mcap::read::Options;
use mcap::{MessageStream, Summary};

const NEVER: Duration = Duration::MAX;

fn begin(path: &Path, header: &RunHeader, flush_every: Duration) -> McapRecorder {
    let mut recorder = McapRecorder::create(path, CreateOptions { overwrite: true, flush_every });
    recorder.begin(header).unwrap();
    recorder
}

/// A whole run of `samples` samples, as bytes.
fn run(name: &str, header: &RunHeader, samples: u64, flush_every: Duration) -> Vec<u8> {
    let path = synthetic::scratch(name);
    let mut recorder = begin(&path, header, flush_every);
    (0..samples).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&synthetic::result()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    bytes
}

/// Reads CDR as its rules say; the second implementation beside the writer's.
struct CdrReader<'m> {
    body: &'m [u8],
    at: usize,
}

impl<'m> CdrReader<'m> {
    fn new(message: &'m [u8]) -> Self {
        assert_eq!(message[..4], [0, 1, 0, 0], "CDR, little endian");
        Self { body: &message[4..], at: 0 }
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.at = self.at.div_ceil(N) * N;
        self.at += N;
        self.body[self.at - N..self.at].try_into().unwrap()
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    fn f64s(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.f64()).collect()
    }

    fn sequence(&mut self) -> Vec<f64> {
        let count = self.u32() as usize;
        self.f64s(count)
    }

    fn string(&mut self) -> String {
        let length = self.u32() as usize;
        let bytes = &self.body[self.at..self.at + length];
        self.at += length;
        assert_eq!(bytes[length - 1], 0, "strings end with a zero");
        String::from_utf8(bytes[..length - 1].to_vec()).unwrap()
    }

    /// Stamp in nanoseconds, and frame.
    fn header(&mut self) -> (u64, String) {
        let seconds = u64::from(self.u32());
        (seconds * 1_000_000_000 + u64::from(self.u32()), self.string())
    }

    fn end(self) {
        assert_eq!(self.at, self.body.len(), "bytes are left");
    }
}

/// Messages of a topic: log time and data.
fn messages(file: &[u8], topic: &str) -> Vec<(u64, Vec<u8>)> {
    let all = MessageStream::new(file).unwrap().map(Result::unwrap);
    all.filter(|message| message.channel.topic == topic)
        .map(|message| (message.log_time, message.data.to_vec()))
        .collect()
}

#[test]
fn every_topic_is_there_with_schema_quality_of_service_and_all_samples() {
    let file = run("topics.mcap", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let summary = Summary::read(&file).unwrap().unwrap();
    let counts = summary.stats.unwrap().channel_message_counts;
    let topics: BTreeMap<String, (String, u64)> = summary
        .channels
        .values()
        .map(|channel| {
            let schema = channel.schema.as_ref().unwrap();
            assert_eq!((schema.encoding.as_str(), channel.message_encoding.as_str()), ("ros2msg", "cdr"));
            assert!(!schema.data.is_empty());
            let profile = &channel.metadata["offered_qos_profiles"];
            let latched = ["/robot_description", "/tf_static"].contains(&channel.topic.as_str());
            assert_eq!(profile.contains("durability: transient_local"), latched, "{}", channel.topic);
            (channel.topic.clone(), (schema.name.clone(), counts[&channel.id]))
        })
        .collect();

    let n = synthetic::SAMPLES;
    let expected = [
        ("/diagnostics/solver", "std_msgs/msg/Float64MultiArray", n),
        ("/elastic/upper_arm", "geometry_msgs/msg/WrenchStamped", n),
        ("/elastic/upper_arm/deflection", "std_msgs/msg/Float64MultiArray", n),
        ("/energy", "std_msgs/msg/Float64MultiArray", n),
        ("/joint_states", "sensor_msgs/msg/JointState", n),
        ("/rigid/joint_states", "sensor_msgs/msg/JointState", n),
        ("/robot_description", "std_msgs/msg/String", 1),
        ("/tcp/error", "geometry_msgs/msg/TwistStamped", n),
        ("/tcp/error_path", "geometry_msgs/msg/TwistStamped", n),
        ("/tcp/error_path_plot", "std_msgs/msg/Float64MultiArray", n),
        ("/tcp/error_plot", "std_msgs/msg/Float64MultiArray", n),
        ("/tcp/flexible", "geometry_msgs/msg/PoseStamped", n),
        ("/tcp/rigid", "geometry_msgs/msg/PoseStamped", n),
        ("/tf", "tf2_msgs/msg/TFMessage", n),
        ("/tf_static", "tf2_msgs/msg/TFMessage", 1),
    ];
    let expected = expected.map(|(topic, schema, count)| (topic.to_owned(), (schema.to_owned(), count)));
    assert_eq!(topics, BTreeMap::from(expected));
}

/// Truth: the samples, decoded by hand.
#[test]
fn messages_hold_the_samples() {
    let header = synthetic::header();
    let file = run("messages.mcap", &header, 120, NEVER);

    for (step, (log_time, data)) in (0..).zip(messages(&file, "/joint_states")) {
        let sample = synthetic::sample(step);
        let mut cdr = CdrReader::new(&data);
        let (stamp, frame) = cdr.header();
        assert_eq!((stamp, frame.as_str()), (log_time, ""));
        assert_eq!(stamp, step * 2_000_000, "epoch 0, 500 samples a second");
        let names: Vec<String> = (0..cdr.u32()).map(|_| cdr.string()).collect();
        assert_eq!(names, header.joints);
        assert_eq!(cdr.sequence(), sample.flexible.q);
        assert_eq!(cdr.sequence(), sample.flexible.qdot);
        assert_eq!(cdr.sequence(), sample.flexible.effort);
        cdr.end();
    }

    let sample = synthetic::sample(100);
    let message = |topic: &str| messages(&file, topic)[100].1.clone();

    let data = message("/tcp/error");
    let mut cdr = CdrReader::new(&data);
    assert_eq!(cdr.header(), (200_000_000, "world".to_owned()));
    assert_eq!(cdr.f64s(6), sample.error_world);
    cdr.end();

    let data = message("/tcp/error_plot");
    let mut cdr = CdrReader::new(&data);
    assert_eq!((cdr.u32(), cdr.string()), (1, "x [m],y [m],z [m],norm [m]".to_owned()));
    assert_eq!((cdr.u32(), cdr.u32(), cdr.u32()), (4, 4, 0), "size, stride, offset");
    let values = cdr.sequence();
    assert_eq!(values[..3], sample.error_world[..3]);
    // measured 0
    assert!((values[3].powi(2) - values[..3].iter().map(|v| v * v).sum::<f64>()).abs() < 1e-18);
    cdr.end();

    let data = message("/elastic/upper_arm");
    let mut cdr = CdrReader::new(&data);
    assert_eq!(cdr.header().1, "upper_arm");
    assert_eq!(cdr.f64s(6), sample.elastic[0].load);
    cdr.end();
}

/// Truth: the links' world poses. Identity: the chain of transforms from `world` to a link is its pose.
#[test]
fn the_frames_of_both_robots_chain_up_to_their_links_poses() {
    let header = synthetic::header();
    let file = run("frames.mcap", &header, 60, NEVER);
    let mut tree: BTreeMap<String, (String, Vec<f64>)> = BTreeMap::new();
    for data in [messages(&file, "/tf_static")[0].1.clone(), messages(&file, "/tf")[50].1.clone()] {
        let mut cdr = CdrReader::new(&data);
        for _ in 0..cdr.u32() {
            let (_, parent) = cdr.header();
            let child = cdr.string();
            assert!(tree.insert(child, (parent, cdr.f64s(7))).is_none(), "a frame has one parent");
        }
        cdr.end();
    }
    assert_eq!(tree.len(), 2 * header.links.len());

    let sample = synthetic::sample(50);
    for (prefix, twin) in [("", &sample.flexible), ("rigid/", &sample.rigid)] {
        for (link, X_WL) in header.links.iter().zip(&twin.X_WL) {
            let mut frame = format!("{prefix}{}", link.name);
            let mut X = nalgebra::Isometry3::identity();
            while frame != "world" {
                let (parent, [x, y, z, qx, qy, qz, qw]) =
                    tree.get(&frame).map(|(parent, v)| (parent, <[f64; 7]>::try_from(v.as_slice()).unwrap())).unwrap();
                let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(qw, qx, qy, qz));
                X = nalgebra::Isometry3::from_parts([x, y, z].into(), rotation) * X;
                frame.clone_from(parent);
            }
            let error = (X.to_homogeneous() - X_WL.to_homogeneous()).norm();
            assert!(error < 1e-13, "{prefix}{}: {error:e}", link.name); // measured 8.5e-16
        }
    }
}

/// A base link with the name of the root must not become its own parent.
#[test]
fn a_base_link_called_world_is_the_root() {
    let mut header = synthetic::header();
    header.links[0] = LinkInfo { name: "world".into(), ..header.links[0].clone() };
    let file = run("world.mcap", &header, 2, NEVER);
    let data = messages(&file, "/tf_static")[0].1.clone();
    let mut cdr = CdrReader::new(&data);
    for _ in 0..cdr.u32() {
        let ((_, parent), child) = (cdr.header(), cdr.string());
        assert_ne!(parent, child);
        cdr.f64s(7);
    }
}

#[test]
fn a_run_without_a_twin_has_no_topics_of_one() {
    let header = RunHeader { has_rigid: false, elements: vec!["a b".into()], ..synthetic::header() };
    let file = run("alone.mcap", &header, 2, NEVER);
    let summary = Summary::read(&file).unwrap().unwrap();
    let topics: Vec<_> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();
    assert!(!topics.iter().any(|topic| topic.contains("rigid") || topic.contains("error")), "{topics:?}");
    assert!(topics.contains(&"/elastic/a_b"), "{topics:?}");
}

#[test]
fn attachments_and_metadata_come_along() {
    let mesh = synthetic::scratch("gripper.stl");
    std::fs::write(&mesh, "solid gripper").unwrap();
    let mut header = synthetic::header();
    header.meshes[0].file = Some(mesh.clone());
    header.meshes[1].file = Some(mesh.clone());
    let file = run("extras.mcap", &header, 2, NEVER);
    let summary = Summary::read(&file).unwrap().unwrap();

    let attachments = summary.attachment_indexes.iter().map(|index| mcap::read::attachment(&file, index).unwrap());
    let attachments: BTreeMap<_, _> =
        attachments.map(|file| (file.name, (file.media_type, file.data.to_vec()))).collect();
    assert_eq!(attachments.len(), 3);
    assert_eq!(attachments["robot.urdf"], ("application/xml".to_owned(), header.urdf.clone().into_bytes()));
    assert_eq!(attachments["run.json"].1, header.attachments[0].bytes);
    let mesh_name = format!("meshes/{}", mesh.file_name().unwrap().to_string_lossy());
    assert_eq!(attachments[&mesh_name], ("model/stl".to_owned(), b"solid gripper".to_vec()));

    let metadata = summary.metadata_indexes.iter().map(|index| mcap::read::metadata(&file, index).unwrap());
    let metadata: BTreeMap<_, _> = metadata.map(|record| (record.name, record.metadata)).collect();
    assert_eq!(metadata["flexarm.run"]["stepper"], "none");
    assert_eq!(metadata["flexarm.recording"]["trajectory"], "swing");
    assert_eq!(metadata["flexarm.units"]["angle"], "rad");
    assert_eq!(metadata["flexarm.result"]["tcp.peak_m"], "0.00211");
    std::fs::remove_file(mesh).unwrap();
}

/// The provisional end, written after every sample or never, leaves no trace in the finished file.
#[test]
fn a_file_does_not_depend_on_when_it_was_flushed() {
    let samples = synthetic::SAMPLES;
    let unflushed = run("never.mcap", &synthetic::header(), samples, NEVER);
    assert_eq!(unflushed, run("again.mcap", &synthetic::header(), samples, NEVER));
    assert!(unflushed == run("always.mcap", &synthetic::header(), samples, Duration::ZERO));
}

#[test]
fn chunks_keep_their_size_and_checksums() {
    let file = run("chunks.mcap", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let summary = Summary::read(&file).unwrap().unwrap();
    assert!(summary.chunk_indexes.len() > 2);
    for chunk in &summary.chunk_indexes {
        assert_eq!(chunk.compression, "zstd");
        assert!(chunk.uncompressed_size <= 1 << 20, "{}", chunk.uncompressed_size);
    }
    let checked = MessageStream::new_with_options(&file, Options::ValidateChunkCrcs.into()).unwrap();
    assert_eq!(checked.map(Result::unwrap).count() as u64, 13 * synthetic::SAMPLES + 2);
}

/// Number of samples in the undamaged part of a file.
fn samples_left(file: &[u8]) -> usize {
    let stream = MessageStream::new_with_options(file, Options::IgnoreEndMagic.into()).unwrap();
    stream.map_while(Result::ok).filter(|message| message.channel.topic == "/diagnostics/solver").count()
}

/// What a kill leaves is what is in the file at that moment: every sample up to the last flush.
#[test]
fn a_killed_run_keeps_every_sample() {
    let path = synthetic::scratch("killed.mcap");
    let mut recorder = begin(&path, &synthetic::header(), Duration::ZERO);
    for step in 0..600_u64 {
        recorder.record(&synthetic::sample(step)).unwrap();
        if step % 37 == 0 {
            let file = std::fs::read(&path).unwrap();
            assert_eq!(samples_left(&file) as u64, step + 1);
            // Not only the messages: the file is whole, but for its index.
            assert!(MessageStream::new(&file).unwrap().all(|message| message.is_ok()));
        }
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_file_cut_between_two_chunks_reads_up_to_there() {
    let file = run("cut.mcap", &synthetic::header(), synthetic::SAMPLES, NEVER);
    let summary = Summary::read(&file).unwrap().unwrap();
    let mut before = 0;
    for chunk in &summary.chunk_indexes[1..] {
        let end = (chunk.chunk_start_offset + chunk.chunk_length) as usize;
        let left = samples_left(&file[..end]);
        assert!(left > before, "{left} samples up to byte {end}");
        before = left;
    }
    assert_eq!(before as u64, synthetic::SAMPLES);
}

#[test]
fn a_dropped_recorder_closes_its_file() {
    let path = synthetic::scratch("dropped.mcap");
    let mut recorder = begin(&path, &synthetic::header(), NEVER);
    (0..10).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    drop(recorder);
    let file = std::fs::read(&path).unwrap();
    let summary = Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 10 * 13 + 2);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn the_epoch_moves_all_stamps_and_times_out_of_range_are_refused() {
    let path = synthetic::scratch("epoch.mcap");
    let epoch = 1_700_000_000_000_000_000;
    let mut recorder = McapRecorder::create(&path, CreateOptions::default()).with_epoch_ns(epoch);
    recorder.begin(&synthetic::header()).unwrap();
    recorder.record(&synthetic::sample(3)).unwrap();
    for time_s in [-1.0, f64::NAN, 1e9] {
        let sample = flexarm_log::Sample { time_s, ..synthetic::sample(4) };
        assert!(matches!(recorder.record(&sample), Err(LogError::Time { .. })), "{time_s}");
    }
    recorder.finish(&RunResult::default()).unwrap();
    let file = std::fs::read(&path).unwrap();
    let (log_time, data) = &messages(&file, "/joint_states")[0];
    assert_eq!((*log_time, CdrReader::new(data).header().0), (epoch + 6_000_000, epoch + 6_000_000));
    std::fs::remove_file(path).unwrap();
}
