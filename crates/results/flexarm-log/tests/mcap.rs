//! MCAP recordings, read back with the `mcap` crate.

use crate::synthetic;
use std::collections::BTreeMap;
use std::path::Path;

use flexarm_draw::Magnifier;
use flexarm_log::internals::{decode, encode, topic_names};
use flexarm_log::{
    CreateOptions, LinkInfo, LogError, McapRecorder, Recorder, RunHeader, RunResult, START_NS, foxglove_layout,
    plotjuggler_layout, rosbag2_metadata,
};
use mcap::read::Options;
use mcap::{MessageStream, Summary};

fn begin(path: &Path, header: &RunHeader) -> McapRecorder {
    let mut recorder = McapRecorder::create(path, CreateOptions::default().with_overwrite(true));
    recorder.begin(header).unwrap();
    recorder
}

/// Records `samples` samples and returns the bytes of the file.
fn run(name: &str, header: &RunHeader, samples: u64) -> Vec<u8> {
    let path = synthetic::scratch(name);
    let mut recorder = begin(&path, header);
    (0..samples).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&synthetic::result()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    bytes
}

/// CDR decoder written from the specification, as an independent check of the encoder.
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
    let file = run("topics.mcap", &synthetic::header(), synthetic::SAMPLES);
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
            let latched =
                ["/robot_description", "/tf_static", "/markers", "/markers/path"].contains(&channel.topic.as_str());
            assert_eq!(profile.contains("durability: 1\n"), latched, "{}", channel.topic);
            (channel.topic.clone(), (schema.name.clone(), counts[&channel.id]))
        })
        .collect();

    let n = synthetic::SAMPLES;
    let expected = [
        ("/elastic/joint_states", "sensor_msgs/msg/JointState", n),
        ("/elastic/upper_arm", "geometry_msgs/msg/WrenchStamped", 120), // 60 Hz, among the samples with poses
        ("/energy", "sensor_msgs/msg/JointState", n),
        ("/events", "rcl_interfaces/msg/Log", 3),
        ("/gauges", "sensor_msgs/msg/JointState", n),
        ("/joint_states", "sensor_msgs/msg/JointState", n),
        ("/markers", "visualization_msgs/msg/MarkerArray", 1),
        ("/markers/error", "visualization_msgs/msg/MarkerArray", 41), // 20 Hz, both ends
        ("/markers/path", "visualization_msgs/msg/MarkerArray", 2),   // at 1 s and 2 s; a single point makes no line
        ("/rigid/joint_states", "sensor_msgs/msg/JointState", n),
        ("/robot_description", "std_msgs/msg/String", 1),
        ("/solver", "sensor_msgs/msg/JointState", n),
        ("/tcp/contributions", "sensor_msgs/msg/JointState", n),
        ("/tcp/error", "sensor_msgs/msg/JointState", n),
        ("/tcp/error_path", "sensor_msgs/msg/JointState", n),
        ("/tcp/flexible", "geometry_msgs/msg/PoseStamped", n),
        ("/tcp/rigid", "geometry_msgs/msg/PoseStamped", n),
        ("/tcp/static_error", "sensor_msgs/msg/JointState", n),
        ("/tf", "tf2_msgs/msg/TFMessage", synthetic::samples_with_poses(n).len() as u64),
        ("/tf_static", "tf2_msgs/msg/TFMessage", 1),
    ];
    let expected = expected.map(|(topic, schema, count)| (topic.to_owned(), (schema.to_owned(), count)));
    assert_eq!(topics, BTreeMap::from(expected));
}

/// Truth: derived by hand from the alignment rule.
#[test]
fn values_start_at_multiples_of_their_size() {
    let expected: Vec<u8> = [
        vec![0, 1, 0, 0],                   // encapsulation, not counted
        vec![7, 0, 0, 0],                   // at 0
        vec![3, 0, 0, 0, b'a', b'b', 0],    // at 4: length including the terminating zero
        vec![0],                            // padding to 12
        vec![1, 0, 0, 0],                   // at 12: count
        vec![0, 0, 0, 0, 0, 0, 0xf0, 0x3f], // at 16: 1.0
    ]
    .concat();
    let mut bytes = Vec::new();
    encode((7_u32, "ab", &[1.0_f64][..]), &mut bytes).unwrap();
    assert_eq!(bytes, expected);
    assert_eq!(decode(&bytes), Some((7_u32, "ab", vec![1.0_f64])));

    // An empty sequence ends after its count, without padding for absent elements.
    encode(Vec::<f64>::new(), &mut bytes).unwrap();
    assert_eq!(bytes, [0, 1, 0, 0, 0, 0, 0, 0]);
}

/// Checks that each type named by a field is defined in the schema's own text.
#[test]
fn every_schema_carries_all_types_it_names() {
    const PRIMITIVES: [&str; 8] = ["string", "float64", "float32", "int32", "uint32", "uint8", "byte", "bool"];
    const SEPARATOR: &str = "================================================================================";
    let file = run("schemas.mcap", &synthetic::header(), synthetic::SAMPLES);
    for schema in Summary::read(&file).unwrap().unwrap().schemas.values() {
        let (name, text) = (&schema.name, std::str::from_utf8(&schema.data).unwrap());
        let mut package = name.split_once('/').unwrap().0;
        for line in text.lines().filter(|line| !line.is_empty() && *line != SEPARATOR) {
            if let Some(part) = line.strip_prefix("MSG: ") {
                package = part.split_once('/').unwrap().0;
                continue;
            }
            let kind = line.split_whitespace().next().unwrap().trim_end_matches("[]");
            let full = if kind.contains('/') { kind.to_owned() } else { format!("{package}/{kind}") };
            assert!(PRIMITIVES.contains(&kind) || text.contains(&format!("MSG: {full}\n")), "{name} lacks {full}");
        }
    }
}

#[test]
fn element_names_become_valid_and_distinct_topics() {
    let names = ["lower_arm", "lower arm", "lower.arm", "3rd", ""].map(str::to_owned);
    assert_eq!(topic_names(&names), ["lower_arm", "lower_arm_2", "lower_arm_3", "_3rd", "_"]);
}

/// Truth: the samples, decoded by hand.
#[test]
fn messages_hold_the_samples() {
    let header = synthetic::header();
    let file = run("messages.mcap", &header, 120);

    for (step, (log_time, data)) in (0..).zip(messages(&file, "/joint_states")) {
        let sample = synthetic::sample(step);
        let mut cdr = CdrReader::new(&data);
        let (stamp, frame) = cdr.header();
        assert_eq!((stamp, frame.as_str()), (log_time, ""));
        assert_eq!(stamp, START_NS + step * 2_000_000, "from the first of January 2000 on, 500 samples a second");
        let names: Vec<String> = (0..cdr.u32()).map(|_| cdr.string()).collect();
        assert_eq!(names, header.joints);
        assert_eq!(cdr.sequence(), sample.flexible.q);
        assert_eq!(cdr.sequence(), sample.flexible.qdot);
        assert_eq!(cdr.sequence(), sample.flexible.effort);
        cdr.end();
    }

    let sample = synthetic::sample(100);
    let message = |topic: &str| messages(&file, topic)[100].1.clone();

    let [x, y, z, rx, ry, rz] = sample.error_world;
    let norm = (x * x + y * y + z * z).sqrt();
    let path = ["tangential", "normal", "binormal", "r_tangential", "r_normal", "r_binormal"];
    let energy = [sample.energy.kinetic, sample.energy.potential, sample.energy.elastic];
    let named: [(&str, &[&str], &[f64]); 7] = [
        ("/tcp/error", &["x", "y", "z", "rx", "ry", "rz", "norm"], &[x, y, z, rx, ry, rz, norm]),
        ("/tcp/error_path", &path, &sample.error_path),
        ("/tcp/static_error", &["x", "y", "z"], &sample.static_m),
        ("/tcp/contributions", &["upper_arm/x", "upper_arm/y", "upper_arm/z"], sample.contributions.as_flattened()),
        ("/gauges", &header.gauges.iter().map(String::as_str).collect::<Vec<_>>(), &sample.gauges),
        ("/energy", &["kinetic", "potential", "elastic"], &energy),
        ("/solver", &["iterations", "residual"], &sample.solver),
    ];
    for (topic, names, values) in named {
        let data = message(topic);
        let mut cdr = CdrReader::new(&data);
        assert_eq!(cdr.header().0, START_NS + 200_000_000);
        assert_eq!((0..cdr.u32()).map(|_| cdr.string()).collect::<Vec<_>>(), names, "{topic}");
        assert_eq!(cdr.sequence(), values, "{topic}");
        assert!(cdr.sequence().is_empty() && cdr.sequence().is_empty(), "{topic}: neither velocity nor effort");
        cdr.end();
    }

    let data = message("/elastic/joint_states");
    let mut cdr = CdrReader::new(&data);
    assert_eq!(cdr.header().0, START_NS + 200_000_000);
    let names: Vec<String> = (0..cdr.u32()).map(|_| cdr.string()).collect();
    assert_eq!(names, ["x", "y", "z", "rx", "ry", "rz"].map(|part| format!("upper_arm/{part}")));
    assert_eq!(cdr.sequence(), sample.elastic[0].deflection);
    assert!(cdr.sequence().is_empty(), "velocities are not known");
    assert_eq!(cdr.sequence(), sample.elastic[0].load);
    cdr.end();

    // First sample with poses at or after 12 / 60 s.
    let sample = synthetic::sample(102);
    let picture = |topic: &str| messages(&file, topic)[12].1.clone();
    let data = picture("/elastic/upper_arm");
    let mut cdr = CdrReader::new(&data);
    assert_eq!(cdr.header().1, "upper_arm");
    assert_eq!(cdr.f64s(6), sample.elastic[0].load);
    cdr.end();
}

/// Frames of a file up to a sample: child, its parent, translation and quaternion.
type Frames = BTreeMap<String, (String, [f64; 7])>;

fn frames(file: &[u8], step: u64) -> Frames {
    let moving = messages(file, "/tf");
    let moving = moving.iter().filter(|(time, _)| *time <= START_NS + step * 2_000_000);
    let mut tree = Frames::new();
    for (_, data) in messages(file, "/tf_static").iter().chain(moving) {
        let mut cdr = CdrReader::new(data);
        for _ in 0..cdr.u32() {
            let ((_, parent), child) = (cdr.header(), cdr.string());
            let old = tree.insert(child, (parent.clone(), cdr.f64s(7).try_into().unwrap()));
            assert!(old.is_none_or(|(before, _)| before == parent), "a frame has one parent");
        }
        cdr.end();
    }
    tree
}

/// Pose of a frame in the world, by the chain of transforms.
fn in_world(tree: &Frames, frame: &str) -> nalgebra::Isometry3<f64> {
    let mut X = nalgebra::Isometry3::identity();
    let mut frame = frame;
    while frame != "world" {
        let (parent, [x, y, z, qx, qy, qz, qw]) = tree.get(frame).unwrap_or_else(|| panic!("no frame {frame}"));
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(*qw, *qx, *qy, *qz));
        X = nalgebra::Isometry3::from_parts([*x, *y, *z].into(), rotation) * X;
        frame = parent;
    }
    X
}

/// Truth: the poses of links and stations, those of the magnified arm from [`Magnifier`]. Identity:
/// the chain of transforms from `world` to a frame gives its pose.
#[test]
fn the_frames_of_all_robots_chain_up_to_their_poses() {
    let header = synthetic::header();
    let file = run("frames.mcap", &header, 60);
    // First sample with poses after 6 / 60 s: 51 / 500 s.
    let tree = frames(&file, 51);
    assert_eq!(tree.len(), 3 * (header.links.len() + 1) + 2 + 10, "three trees with tools, two stations, ten slabs");

    let sample = synthetic::sample(51);
    let magnified = Magnifier::new(&header).magnified(&sample);
    let robots = [("", &sample.flexible, 1e-13), ("rigid/", &sample.rigid, 1e-13), ("magnified/", &magnified, 1e-6)];
    for (prefix, twin, allowed) in robots {
        for (link, X_WL) in header.links.iter().zip(&twin.X_WL) {
            let X = in_world(&tree, &format!("{prefix}{}", link.name));
            let error = (X.to_homogeneous() - X_WL.to_homogeneous()).norm();
            assert!(error < allowed, "{prefix}{}: {error:e}", link.name); // measured 8.5e-16, magnified 1.1e-7
        }
    }
    for (frame, twin) in [("tool0/tcp", &sample.flexible), ("rigid/tool0/tcp", &sample.rigid)] {
        let error = (in_world(&tree, frame).to_homogeneous() - twin.X_WT.to_homogeneous()).norm();
        assert!(error < 1e-13, "{frame}: {error:e}");
    }
    for (k, X_WS) in sample.flexible.X_WS.iter().enumerate() {
        let X = in_world(&tree, &format!("upper_arm/station_{k}"));
        assert!((X.to_homogeneous() - X_WS.to_homogeneous()).norm() < 1e-13, "station {k}");
    }
    // Beyond the distal end of the flexible link its surface moves with the last station.
    let X = in_world(&tree, "magnified/upper_arm/bend_9") * header.bends[0].X_LS[1].translation;
    let error = (X.to_homogeneous() - magnified.X_WS[1].to_homogeneous()).norm();
    assert!(error < 1e-6, "{error:e}");
}

/// Truth: the rates of poses and animation frames, at most 200 and 60 per second, with 500 samples
/// per second.
#[test]
fn frames_are_sent_less_often_than_samples_and_the_magnified_arm_less_often_than_the_robots() {
    let file = run("rates.mcap", &synthetic::header(), 501);
    let times: Vec<u64> = messages(&file, "/tf").iter().map(|(time, _)| (time - START_NS) / 2_000_000).collect();
    let expected = synthetic::samples_with_poses(501);
    assert_eq!(times, expected);
    assert!(expected.contains(&500) && expected.len() < 501 && expected.iter().any(|step| !step.is_multiple_of(3)));
    let with = |frame: &str| {
        let has = |data: &[u8]| data.windows(frame.len()).any(|part| part == frame.as_bytes());
        messages(&file, "/tf").iter().filter(|(_, data)| has(data)).count()
    };
    let counts = (with("rigid/forearm"), with("magnified/forearm"), with("magnified/upper_arm/bend_3"));
    assert_eq!(counts, (expected.len(), 60, 60));
}

/// The fields of a marker under test: frame, namespace, number, kind, colour, points.
type Drawn = (String, String, u32, u32, Vec<f32>, Vec<[f64; 3]>);

fn markers(data: &[u8]) -> Vec<Drawn> {
    let mut cdr = CdrReader::new(data);
    let markers = (0..cdr.u32())
        .map(|_| {
            let (_, frame) = cdr.header();
            let (namespace, id, kind, action) = (cdr.string(), cdr.u32(), cdr.u32(), cdr.u32());
            assert_eq!(action, 0, "add");
            cdr.f64s(3 + 4 + 3); // position, orientation, scale
            let color = (0..4).map(|_| f32::from_le_bytes(cdr.take())).collect();
            assert_eq!((cdr.u32(), cdr.u32(), cdr.take::<1>()), (0, 0, [1]), "for ever, locked to its frame");
            let points = (0..cdr.u32()).map(|_| cdr.f64s(3).try_into().unwrap()).collect();
            assert_eq!((cdr.u32(), cdr.string()), (0, String::new()), "colours, texture");
            assert_eq!((cdr.header(), cdr.string(), cdr.u32()), ((0, String::new()), String::new(), 0), "image");
            assert_eq!(cdr.u32(), 0, "places on the texture");
            cdr.string();
            let mesh = (cdr.string(), cdr.string(), cdr.u32(), cdr.take::<1>());
            assert_eq!(mesh, (String::new(), String::new(), 0, [0]), "no mesh file");
            (frame, namespace, id, kind, color, points)
        })
        .collect();
    cdr.end();
    markers
}

/// Truth: the meshes of the header; links that deviate are drawn three times, the others twice.
#[test]
fn surfaces_are_in_the_file_in_the_frames_of_all_robots() {
    let header = synthetic::header();
    let file = run("surfaces.mcap", &header, 60);
    let drawn = markers(&messages(&file, "/markers")[0].1);
    let tree = frames(&file, 50);
    for (frame, namespace, _, kind, ..) in &drawn {
        assert_eq!(*kind, 11, "triangles");
        in_world(&tree, frame);
        assert!(["flexible", "rigid", "magnified"].contains(&namespace.as_str()), "{namespace}");
    }
    let names: std::collections::BTreeSet<_> = drawn.iter().map(|marker| (&marker.1, marker.2)).collect();
    assert_eq!(names.len(), drawn.len(), "namespace and number name a marker");

    let of = |namespace: &str| drawn.iter().filter(move |marker| marker.1 == namespace).collect::<Vec<_>>();
    assert_eq!((of("flexible").len(), of("rigid").len()), (5, 5));
    for (mesh, marker) in header.meshes.iter().zip(of("flexible")) {
        assert_eq!((&marker.0, &marker.4[..]), (&header.links[mesh.link].name, &mesh.color[..]));
        let corners = mesh.triangles.iter().flatten().map(|k| mesh.positions[*k as usize].map(f64::from));
        assert!(corners.eq(marker.5.iter().copied()));
    }
    assert!(of("rigid").iter().all(|marker| marker.4[3] < 0.5), "a ghost");
    let magnified: Vec<&str> = of("magnified").iter().map(|marker| marker.0.as_str()).collect();
    assert!(magnified.contains(&"magnified/forearm") && magnified.contains(&"magnified/tool0"), "{magnified:?}");
    assert!(magnified.contains(&"magnified/upper_arm/bend_4"), "{magnified:?}");
    assert!(!magnified.contains(&"magnified/upper_arm"), "the link that bends is drawn in slabs: {magnified:?}");
    assert!(!magnified.contains(&"magnified/column"), "what does not deviate is not drawn again: {magnified:?}");
}

/// Truth: rigid TCP and error of the sample, magnification of the header.
#[test]
fn the_error_arrow_is_the_error_magnified_and_paths_follow_the_tools() {
    let header = synthetic::header();
    let file = run("arrows.mcap", &header, 1001);
    let (_, data) = &messages(&file, "/markers/error")[20];
    let arrow = &markers(data)[0];
    let sample = synthetic::sample(500);
    assert_eq!((arrow.1.as_str(), arrow.3), ("error", 0));
    for c in 0..3 {
        let from = sample.rigid.X_WT.translation.vector[c];
        assert!((arrow.5[0][c] - from).abs() < 1e-7);
        assert!((arrow.5[1][c] - from - header.magnification * sample.error_world[c]).abs() < 2e-7);
    }
    let paths = markers(&messages(&file, "/markers/path")[1].1);
    let names: Vec<&str> = paths.iter().map(|marker| marker.1.as_str()).collect();
    assert_eq!(names, ["path/flexible", "path/rigid", "path/magnified"]);
    let last = synthetic::sample(1000);
    for (path, twin) in paths.iter().zip([&last.flexible, &last.rigid]) {
        assert!((2..=1000).contains(&path.5.len()));
        let end = path.5[path.5.len() - 1];
        assert!((0..3).all(|c| (end[c] - twin.X_WT.translation.vector[c]).abs() < 1e-7));
    }
}

/// Times and topics of all messages in order of time, as given by readers with an index.
fn by_index(file: &[u8]) -> Vec<(u64, String)> {
    let summary = Summary::read(file).unwrap().unwrap();
    let mut reader = mcap::sans_io::IndexedReader::new(&summary).unwrap();
    let mut seen = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            mcap::sans_io::IndexedReadEvent::ReadChunkRequest { offset, length } => {
                let chunk = &file[offset as usize..offset as usize + length];
                reader.insert_chunk_record_data(offset, chunk).unwrap();
            }
            mcap::sans_io::IndexedReadEvent::Message { header, .. } => {
                seen.push((header.log_time, summary.channels[&header.channel_id].topic.clone()));
            }
        }
    }
    seen
}

/// Truth: the events of the result. They are written last; readers in order of time find them among
/// the samples.
#[test]
fn events_stand_at_their_own_times() {
    let file = run("events.mcap", &synthetic::header(), 1001);
    let events = messages(&file, "/events");
    for (event, (log_time, data)) in synthetic::result().events.iter().zip(&events) {
        let mut cdr = CdrReader::new(data);
        let stamp = u64::from(cdr.u32()) * 1_000_000_000 + u64::from(cdr.u32());
        assert_eq!((stamp, *log_time), (START_NS + (event.time_s * 1e9) as u64, stamp));
        assert_eq!(cdr.take::<1>(), [20], "information");
        assert_eq!((cdr.string().as_str(), cdr.string()), (event.kind.word(), event.text.clone()));
        assert_eq!((cdr.string(), cdr.string(), cdr.u32()), (String::new(), String::new(), 0));
        cdr.end();
    }
    assert_eq!(events.len(), 3);

    let (times, topics): (Vec<u64>, Vec<String>) = by_index(&file).into_iter().unzip();
    assert!(times.is_sorted());
    let peak = times.iter().zip(&topics).position(|(_, topic)| topic == "/events").unwrap();
    assert_eq!(times[peak], START_NS, "the first event is at the start");
    assert_eq!(topics.iter().filter(|topic| *topic == "/events").count(), 3);
    assert_ne!(topics.last().unwrap(), "/events", "the last event is before the last sample");
}

/// Without magnification the deflections are drawn as they are: those of modes, for example, are
/// large enough to be visible.
#[test]
fn without_a_magnification_the_flexible_robot_itself_is_drawn_bent() {
    let header = RunHeader { magnification: 0.0, ..synthetic::header() };
    let file = run("modes.mcap", &header, 60);
    let summary = Summary::read(&file).unwrap().unwrap();
    assert!(!summary.channels.values().any(|channel| channel.topic == "/markers/error"));
    let tree = frames(&file, 50);
    assert!(!tree.keys().any(|frame| frame.starts_with("magnified")));
    let drawn = markers(&messages(&file, "/markers")[0].1);
    let flexible: Vec<&str> =
        drawn.iter().filter(|marker| marker.1 == "flexible").map(|marker| marker.0.as_str()).collect();
    assert!(flexible.contains(&"upper_arm/bend_4") && !flexible.contains(&"upper_arm"), "{flexible:?}");
    assert!(flexible.iter().all(|frame| in_world(&tree, frame).translation.vector.norm() < 10.0));
}

/// A base link with the name of the root must not become its own parent.
#[test]
fn a_base_link_called_world_is_the_root() {
    let mut header = synthetic::header();
    header.links[0] = LinkInfo { name: "world".into(), ..header.links[0].clone() };
    let file = run("world.mcap", &header, 2);
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
    let file = run("alone.mcap", &header, 2);
    let summary = Summary::read(&file).unwrap().unwrap();
    let topics: Vec<_> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();
    assert!(!topics.iter().any(|topic| topic.contains("rigid") || topic.contains("error")), "{topics:?}");
    let drawn = markers(&messages(&file, "/markers")[0].1);
    assert!(drawn.iter().all(|marker| marker.1 == "flexible"));
    assert!(topics.contains(&"/elastic/a_b"), "{topics:?}");
}

#[test]
fn attachments_and_metadata_come_along() {
    let mesh = synthetic::scratch("gripper.stl");
    std::fs::write(&mesh, "solid gripper").unwrap();
    let mut header = synthetic::header();
    header.meshes[0].file = Some(mesh.clone());
    header.meshes[1].file = Some(mesh.clone());
    let file = run("extras.mcap", &header, 2);
    let summary = Summary::read(&file).unwrap().unwrap();

    let attachments = summary.attachment_indexes.iter().map(|index| mcap::read::attachment(&file, index).unwrap());
    let attachments: BTreeMap<_, _> =
        attachments.map(|file| (file.name, (file.media_type, file.data.to_vec()))).collect();
    assert_eq!(attachments.len(), 7, "with run.json, meshes.bin.zst and result.json");
    assert_eq!(attachments["summary.json"].1, synthetic::result().attachments[0].bytes);
    assert_eq!(attachments["robot.urdf"], ("application/xml".to_owned(), header.urdf.clone().into_bytes()));
    assert_eq!(attachments["notes.json"].1, header.attachments[0].bytes);
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

#[test]
fn equal_runs_give_equal_files() {
    let [once, twice] = ["once.mcap", "twice.mcap"].map(|name| run(name, &synthetic::header(), synthetic::SAMPLES));
    assert!(once == twice);
}

#[test]
fn chunks_keep_their_size_and_checksums() {
    let file = run("chunks.mcap", &synthetic::header(), synthetic::SAMPLES);
    let summary = Summary::read(&file).unwrap().unwrap();
    assert!(summary.chunk_indexes.len() > 2);
    for chunk in &summary.chunk_indexes {
        assert_eq!(chunk.compression, "zstd");
        // The last sample may exceed the limit, and message headers are not counted.
        assert!(chunk.uncompressed_size < (1 << 20) * 3 / 2, "{}", chunk.uncompressed_size);
    }
    // The last chunk has the events.
    let (_, samples) = summary.chunk_indexes.split_last().unwrap();
    assert!(samples.iter().all(|chunk| chunk.message_end_time - chunk.message_start_time <= 500_000_000));
    let poses = synthetic::samples_with_poses(synthetic::SAMPLES).len() as u64;
    let messages = 12 * synthetic::SAMPLES + poses + 120 + 3 + 3 + 41 + 2;
    let checked = MessageStream::new_with_options(&file, Options::ValidateChunkCrcs.into()).unwrap();
    assert_eq!(checked.map(Result::unwrap).count() as u64, messages);
}

/// Number of samples in the undamaged part of a file.
fn samples_left(file: &[u8]) -> usize {
    let stream = MessageStream::new_with_options(file, Options::IgnoreEndMagic.into()).unwrap();
    stream.map_while(Result::ok).filter(|message| message.channel.topic == "/solver").count()
}

/// After a kill the file has its closed chunks: all samples except those of the last half
/// second.
#[test]
fn a_killed_run_keeps_every_sample_up_to_its_last_chunk() {
    let path = synthetic::scratch("killed.mcap");
    let mut recorder = begin(&path, &synthetic::header());
    let mut chunks = std::collections::BTreeSet::new();
    for step in 0..synthetic::SAMPLES {
        recorder.record(&synthetic::sample(step)).unwrap();
        if step % 37 == 0 {
            let file = std::fs::read(&path).unwrap();
            // Readers without an index, including those of other programs, find no broken record
            // and only whole samples.
            let stream = MessageStream::new_with_options(&file, Options::IgnoreEndMagic.into()).unwrap();
            let all: Vec<_> = stream.map(Result::unwrap).collect();
            let count = |topic: &str| all.iter().filter(|message| message.channel.topic == topic).count() as u64;
            let left = count("/solver");
            assert!((step + 1).saturating_sub(250) <= left && left <= step + 1, "{left} of {step}");
            assert!(["/energy", "/joint_states", "/tcp/error"].into_iter().all(|topic| count(topic) == left));
            assert!(count("/robot_description") == 1 && count("/markers") == 1, "from the beginning on");
            chunks.insert(left);
        }
    }
    assert!(chunks.len() >= 4, "{chunks:?}");
    drop(recorder);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_file_cut_between_two_chunks_reads_up_to_there() {
    let file = run("cut.mcap", &synthetic::header(), synthetic::SAMPLES);
    let summary = Summary::read(&file).unwrap().unwrap();
    let mut before = 0;
    // The first chunk holds messages sent once, the last one the events.
    for chunk in &summary.chunk_indexes[1..summary.chunk_indexes.len() - 1] {
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
    let mut recorder = begin(&path, &synthetic::header());
    (0..10).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    drop(recorder);
    let file = std::fs::read(&path).unwrap();
    let summary = Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 10 * 13 + 2 + 3 + 1); // two animation frames, latched messages, the error
    std::fs::remove_file(path).unwrap();
}

#[test]
fn the_start_time_moves_all_stamps_and_times_out_of_range_are_refused() {
    let path = synthetic::scratch("epoch.mcap");
    let epoch = 1_700_000_000_000_000_000;
    let mut recorder = McapRecorder::create(&path, CreateOptions::default());
    recorder.begin(&RunHeader { start_ns: Some(epoch), ..synthetic::header() }).unwrap();
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

/// ROS reads 0 as "no time" (tf2: the latest). Truth: the date of the constant according to
/// Python's `datetime.fromtimestamp(946684800, timezone.utc)`: 2000-01-01 00:00.
#[test]
fn no_stamp_is_zero_and_a_recording_read_back_keeps_its_start() {
    assert_eq!(START_NS, 946_684_800 * 1_000_000_000);
    for start_ns in [None, Some(0), Some(1_700_000_000_000_000_000)] {
        let header = RunHeader { start_ns, ..synthetic::header() };
        let path = synthetic::scratch(&format!("start-{start_ns:?}.mcap"));
        std::fs::write(&path, run("start.mcap", &header, 30)).unwrap();
        let stamps = messages(&std::fs::read(&path).unwrap(), "/tf");
        assert_eq!(stamps[0].0, start_ns.unwrap_or(START_NS));

        let mut source = flexarm_log::open_recording(&path, flexarm_log::RecordingFormat::Mcap).unwrap();
        assert_eq!(source.header().start_ns, start_ns);
        let mut times = Vec::new();
        source
            .replay(&mut |sample| {
                times.push(sample.time_s);
                Ok(())
            })
            .unwrap();
        assert_eq!(times, (0..30).map(|step| synthetic::sample(step).time_s).collect::<Vec<_>>(), "since the start");
        std::fs::remove_file(path).unwrap();
    }
}

/// Truth: the summary that the `mcap` crate wrote.
#[test]
fn a_folder_with_the_recording_is_a_bag_of_ros_2() {
    let path = synthetic::scratch("bag.mcap");
    let mut recorder = begin(&path, &synthetic::header());
    (0..50).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    assert!(rosbag2_metadata(&path).unwrap().is_none(), "the recording is not finished");
    recorder.finish(&RunResult::default()).unwrap();
    let bag: serde_json::Value = serde_json::from_str(&rosbag2_metadata(&path).unwrap().unwrap()).unwrap();
    let bag = &bag["rosbag2_bagfile_information"];
    let summary = Summary::read(&std::fs::read(&path).unwrap()).unwrap().unwrap();
    let (stats, channels) = (summary.stats.unwrap(), summary.channels);
    assert_eq!(bag["relative_file_paths"][0].as_str(), path.file_name().unwrap().to_str());
    assert_eq!(bag["message_count"], stats.message_count);
    assert_eq!(bag["starting_time"]["nanoseconds_since_epoch"], stats.message_start_time);
    assert_eq!(bag["duration"]["nanoseconds"], stats.message_end_time - stats.message_start_time);
    let topics = bag["topics_with_message_count"].as_array().unwrap();
    assert_eq!(topics.len(), channels.len());
    for topic in topics {
        let about = &topic["topic_metadata"];
        let channel = channels.values().find(|channel| about["name"] == channel.topic.as_str()).unwrap();
        assert_eq!(about["type"], channel.schema.as_ref().unwrap().name.as_str());
        assert_eq!(about["offered_qos_profiles"], channel.metadata["offered_qos_profiles"].as_str());
        assert_eq!(topic["message_count"], *stats.channel_message_counts.get(&channel.id).unwrap_or(&0));
    }
    std::fs::remove_file(path).unwrap();
}

/// Truth: the topics of a recording of the same run, and the contents of the files according to a
/// JSON and an XML reader.
#[test]
fn layouts_refer_to_what_is_in_the_recording() {
    let mut header = synthetic::header();
    header.joints[0] = "a <b> & \"c\"".into();
    let summary = Summary::read(&run("layouts.mcap", &header, 5)).unwrap().unwrap();
    let topics: Vec<&str> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();

    let foxglove: serde_json::Value = serde_json::from_str(&foxglove_layout(&header)).unwrap();
    let panels = foxglove["configById"].as_object().unwrap();
    let paths: Vec<&str> = panels
        .values()
        .filter_map(|panel| panel["paths"].as_array())
        .flatten()
        .map(|path| path["value"].as_str().unwrap())
        .collect();
    assert!(paths.len() >= 4 + 3 + 6 + 3 + 3, "{paths:?}");
    assert!(paths.iter().all(|path| topics.contains(&path.split_once('.').unwrap().0)), "{paths:?}");
    for topic in panels["3D!arm"]["topics"].as_object().unwrap().keys() {
        assert!(topics.contains(&topic.as_str()), "{topic}");
    }
    // Every panel has a place in the layout.
    fn places(node: &serde_json::Value, found: &mut Vec<String>) {
        match node.as_str() {
            Some(name) => found.push(name.to_owned()),
            None => ["first", "second"].iter().for_each(|side| places(&node[side], found)),
        }
    }
    let mut found = Vec::new();
    places(&foxglove["layout"], &mut found);
    found.sort();
    let mut names: Vec<String> = panels.keys().cloned().collect();
    names.sort();
    assert_eq!(found, names);

    let plotjuggler = plotjuggler_layout(&header);
    let curves: Vec<&str> =
        plotjuggler.split("<curve name=\"").skip(1).map(|rest| rest.split_once('"').unwrap().0).collect();
    assert_eq!(curves.len(), paths.len());
    assert!(
        curves.iter().all(|curve| topics.iter().any(|topic| curve.starts_with(&format!("{topic}/")))),
        "{curves:?}"
    );
    assert!(curves.contains(&"/joint_states/a &lt;b&gt; &amp; &quot;c&quot;/effort"), "{curves:?}");
    for tag in ["root", "tabbed_widget", "Tab", "Container", "DockSplitter", "DockArea", "plot"] {
        let (open, close) = (format!("<{tag}"), format!("</{tag}>"));
        let opened =
            plotjuggler.match_indices(&open).filter(|(at, _)| plotjuggler[at + open.len()..].starts_with([' ', '>']));
        assert_eq!(opened.count(), plotjuggler.matches(&close).count(), "{tag}");
    }
}
