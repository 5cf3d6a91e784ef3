//! An MCAP file of a run, record by record: memory does not grow with the length of the run, and a file without an end
//! is read up to its last whole chunk.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use flexarm_kinematics::Pose;
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::cdr::CdrReader;
use super::wall::caught;
use super::{broken_end, exact_time, not_a_recording, stem};
use crate::mcap_file::channels::topic_names;
use crate::run_json::{self, RESULT_JSON, RUN_JSON, meshes};
use crate::{Attachment, Event, EventKind, LogError, RunHeader, RunResult, RunSource, Sample, TwinSample};

/// Name of the robot's file in a recording.
const URDF: &str = "robot.urdf";
/// Groups of metadata that the recorder adds by itself.
const OWN_GROUPS: [&str; 3] = ["flexarm.recording", "flexarm.units", "flexarm.result"];

/// See the module.
pub(crate) struct McapRun {
    path: PathBuf,
    header: RunHeader,
    epoch_ns: u64,
    /// Topics that every sample has: those of the first.
    topics: Vec<Topic>,
    /// Number of attached files that belong to the header.
    files_of_header: usize,
    missing: Vec<String>,
    warnings: Vec<String>,
}

/// What a message of a topic holds; several topics make one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Topic {
    Frames,
    FixedFrames,
    Joints,
    RigidJoints,
    Tool,
    RigidTool,
    Error,
    PathError,
    Load(usize),
    Deflection(usize),
    StaticError,
    Contributions,
    Energy,
    Solver,
    Events,
}

impl Topic {
    /// Whether there is one such message per sample.
    fn is_of_a_sample(self) -> bool {
        !matches!(self, Self::FixedFrames | Self::Events)
    }
}

impl McapRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let mut found = Found::default();
        let broken = walk(path, &mut |record| {
            found.take(record);
            Ok(if found.samples > 1 { Flow::Stop } else { Flow::On })
        })?;
        let (mut header, files_of_header, mut missing) = found.header(path, broken.as_deref())?;

        // The first sample once more, now that names can be told apart: what it holds, all hold.
        let epoch_ns = found.recording("epoch_ns").and_then(|text| text.parse().ok()).unwrap_or(0);
        header.start_ns = Some(epoch_ns).filter(|start| *start != crate::START_NS);
        let mut assembly = Assembly::new(&header, epoch_ns);
        let mut topics = Vec::new();
        walk(path, &mut |record| {
            let done = assembly.take(&record).map_err(|what| not_a_recording(path, what, "messages of flexarm"))?;
            if done.is_some() {
                topics.clone_from(&assembly.done_topics);
            }
            Ok(if done.is_some() { Flow::Stop } else { Flow::On })
        })?;
        if topics.is_empty() {
            assembly.close();
            topics.clone_from(&assembly.done_topics); // the only sample, or none
        }
        if !header.contributors.is_empty() && !topics.is_empty() && !topics.contains(&Topic::Contributions) {
            header.contributors.clear();
            missing.push("the file has no shares of the tool error (/tcp/contributions)".into());
        }
        if header.has_static && !topics.is_empty() && !topics.contains(&Topic::StaticError) {
            header.has_static = false;
            missing.push("the file has no static part of the tool error (/tcp/static_error)".into());
        }
        if !header.bends.is_empty() && !topics.is_empty() && !assembly.frames.stations_seen {
            header.bends.clear();
            missing.push("the file has no frames of stations along bent links".into());
        }
        let path = path.to_owned();
        Ok(Self { path, header, epoch_ns, topics, files_of_header, missing, warnings: Vec::new() })
    }
}

impl RunSource for McapRun {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn missing(&self) -> Vec<String> {
        self.missing.clone()
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError> {
        self.warnings.clear();
        let path = &self.path;
        let mut assembly = Assembly::new(&self.header, self.epoch_ns);
        let mut found = Found::default();
        let (mut count, mut last_s) = (0_u64, 0.0);
        let topics = &self.topics;
        let mut give = |assembly: &Assembly| -> Result<(), LogError> {
            // One that the end of the file cut short is no sample.
            if assembly.done_topics == *topics && !topics.is_empty() {
                take(&assembly.done)?;
                (count, last_s) = (count + 1, assembly.done.time_s);
            }
            Ok(())
        };
        let broken = walk(path, &mut |record| {
            let done = assembly.take(&record).map_err(|what| not_a_recording(path, what, "messages of flexarm"))?;
            if done.is_some() {
                give(&assembly)?;
            }
            if !matches!(record, Record::Message { .. }) {
                found.take(record);
            }
            Ok(Flow::On)
        })?;
        if assembly.close() {
            give(&assembly)?;
        }
        let figures = found.metadata.iter().find(|(name, _)| name == "flexarm.result").map(|(_, pairs)| pairs);
        match (&broken, figures) {
            (Some(cause), _) => self.warnings.push(broken_end(path, cause, count, last_s)),
            (None, None) => self.warnings.push(format!(
                "{}: the run was not finished; {count} samples, up to t = {last_s} s, were read",
                path.display()
            )),
            _ if !found.whole => self.warnings.push(broken_end(path, "its index is missing", count, last_s)),
            _ => {}
        }
        // Topic and metadata are for other programs; the file of its own has kinds and order as well.
        let mut result = match &found.result {
            Some(text) => run_json::read_result(&String::from_utf8_lossy(text)),
            None => RunResult {
                figures: figures.map(|pairs| pairs.clone().into_iter().collect()).unwrap_or_default(),
                events: std::mem::take(&mut assembly.events),
                ..RunResult::default()
            },
        };
        result.attachments.extend(found.files.into_iter().skip(self.files_of_header));
        Ok(result)
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Flow {
    On,
    Stop,
}

/// Calls `take` with every record, those in chunks included. Returns why the file ends before its end, if it does.
fn walk(path: &Path, take: &mut dyn FnMut(Record<'_>) -> Result<Flow, LogError>) -> Result<Option<String>, LogError> {
    /// Sizes up to this are believed even in small files: what a chunk unpacks to.
    const LARGE: u64 = 32 << 20;
    const READ_BYTES: usize = 64 << 10;

    let mut file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
    let length = file.metadata().map_err(LogError::io(path, "read the recording"))?.len();
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true) // a damaged chunk gives nothing, rather than some numbers and then an error
        .with_record_length_limit(usize::try_from(length.max(LARGE)).unwrap_or(usize::MAX));
    let mut reader = LinearReader::new_with_options(options);
    loop {
        let from = &mut reader;
        let event = match caught(move || from.next_event()) {
            Ok(Some(event)) => event,
            Ok(None) => break,
            Err(cause) => return Ok(Some(cause)),
        };
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let size = usize::try_from(length.max(LARGE)).unwrap_or(usize::MAX).min(wanted).max(READ_BYTES);
                let read = file.read(reader.insert(size)).map_err(LogError::io(path, "read the recording"))?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { opcode, data }) => {
                match texts_fit(opcode, data) {
                    Some(true) => {}
                    Some(false) => return Ok(Some("damaged: a text is longer than its record".into())),
                    None => continue,
                }
                let record = match caught(move || mcap::parse_record(opcode, data)) {
                    Ok(Ok(record)) => record,
                    Ok(Err(error)) => return Ok(Some(in_words(&error))),
                    Err(cause) => return Ok(Some(cause)),
                };
                if take(record)? == Flow::Stop {
                    return Ok(None);
                }
            }
            Err(error) => return Ok(Some(in_words(&error))),
        }
    }
    Ok(None)
}

/// Whether the texts of a record are within it: the library takes memory for them before it looks. `None` for records that
/// say nothing about a run, such as the index.
fn texts_fit(kind: u8, record: &[u8]) -> Option<bool> {
    // Bytes before the first text; texts, or what has its length before it likewise; whether pairs of texts follow.
    let (before, texts, pairs) = match kind {
        op::HEADER => (0, 2, false),
        op::FOOTER | op::MESSAGE => return Some(true),
        op::SCHEMA => (2, 3, false),
        op::CHANNEL => (4, 2, true),
        op::ATTACHMENT => (16, 2, false),
        op::METADATA => (0, 1, true),
        _ => return None,
    };
    fn text<'r>(rest: &mut &'r [u8]) -> Option<&'r [u8]> {
        let (length, behind) = rest.split_first_chunk()?;
        let (text, behind) = behind.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
        *rest = behind;
        Some(text)
    }
    let walk = || {
        let mut rest = record.get(before..)?;
        for _ in 0..texts {
            text(&mut rest)?;
        }
        let mut list = if pairs { text(&mut rest)? } else { &[] };
        while !list.is_empty() {
            text(&mut list)?;
        }
        Some(())
    };
    Some(walk().is_some())
}

fn in_words(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof | McapError::UnexpectedEoc => "its end is missing".into(),
        McapError::BadChunkCrc { .. } => "a checksum does not fit".into(),
        other => format!("damaged: {other}"),
    }
}

/// What a file says besides its samples.
#[derive(Default)]
struct Found {
    library: String,
    topics: BTreeMap<u16, String>,
    metadata: Vec<(String, BTreeMap<String, String>)>,
    run: Option<Vec<u8>>,
    result: Option<Vec<u8>>,
    mesh_block: Option<Vec<u8>>,
    urdf: Option<Vec<u8>>,
    /// Attached files that have no part of their own.
    files: Vec<Attachment>,
    /// Whether the index is there, which is written last.
    whole: bool,
    /// Samples that began, up to two.
    samples: u32,
    sequence: Option<u32>,
}

impl Found {
    fn take(&mut self, record: Record<'_>) {
        match record {
            Record::Header(header) => self.library = header.library,
            Record::Channel(channel) => {
                self.topics.insert(channel.id, channel.topic);
            }
            Record::Footer(footer) => self.whole |= footer.summary_start > 0,
            Record::Metadata(group) => self.metadata.push((group.name, group.metadata)),
            Record::Attachment { header, data, .. } => {
                let bytes = data.into_owned();
                let own = match header.name.as_str() {
                    RUN_JSON => Some(&mut self.run),
                    RESULT_JSON => Some(&mut self.result),
                    meshes::FILE => Some(&mut self.mesh_block),
                    URDF => Some(&mut self.urdf),
                    _ => None,
                };
                match own {
                    Some(place) if place.is_none() => *place = Some(bytes),
                    _ => self.files.push(Attachment { name: header.name, media_type: header.media_type, bytes }),
                }
            }
            Record::Message { header, .. }
                if self.sequence != Some(header.sequence)
                    && self.topics.get(&header.channel_id).is_some_and(|topic| topic == "/tf") =>
            {
                (self.sequence, self.samples) = (Some(header.sequence), self.samples + 1);
            }
            _ => {}
        }
    }

    fn recording(&self, key: &str) -> Option<&str> {
        let group = self.metadata.iter().find(|(name, _)| name == OWN_GROUPS[0]);
        group.and_then(|(_, pairs)| pairs.get(key)).map(String::as_str)
    }

    /// The header, how many of the attached files belong to it, and what it lacks.
    fn header(&mut self, path: &Path, broken: Option<&str>) -> Result<(RunHeader, usize, Vec<String>), LogError> {
        let cut = |cause: Option<&str>| {
            let cause = cause.unwrap_or("its end is missing");
            let found = format!("an MCAP file that breaks off before it says which run it is ({cause})");
            not_a_recording(path, found, "one with the description of a run")
        };
        if self.recording("robot").is_none() {
            if broken.is_some() || self.library.is_empty() || self.library.starts_with("flexarm") {
                return Err(cut(broken));
            }
            let topics: Vec<&str> = self.topics.values().map(String::as_str).take(5).collect();
            let found = format!("an MCAP file of {:?} with the topics {}", self.library, topics.join(", "));
            return Err(not_a_recording(path, found, "one that flexarm wrote (metadata flexarm.recording)"));
        }
        let Some(run) = &self.run else {
            return if self.samples == 0 { Err(cut(broken)) } else { Ok(self.plain_header(path)) };
        };
        let damaged = |what: String| not_a_recording(path, what, "the description of a run");
        let (mut header, run) = run_json::read(run).map_err(damaged)?;
        let mut missing = Vec::new();
        header.urdf = String::from_utf8_lossy(self.urdf.as_deref().unwrap_or_default()).into_owned();
        match &self.mesh_block {
            Some(block) => {
                let what = |what| damaged(format!("{}: {what}", meshes::FILE));
                header.meshes = meshes::read(block, &run.meshes).map_err(what)?;
            }
            None if run.meshes.is_empty() => {}
            None => missing.push("the file breaks off before the surfaces of the links".to_owned()),
        }
        // Mesh files stay attached; their triangles are known without them.
        let mesh_file = |file: &Attachment| file.name.starts_with("meshes/") && !run.attachments.contains(&file.name);
        let mesh_files = self.files.iter().take_while(|file| mesh_file(file)).count();
        let count = (mesh_files + run.attachments.len()).min(self.files.len());
        header.attachments = self.files[..count].to_vec();
        Ok((header, count, missing))
    }

    /// Header from metadata alone: numbers can be read, pictures cannot.
    fn plain_header(&self, path: &Path) -> (RunHeader, usize, Vec<String>) {
        let text = |key: &str| self.recording(key).unwrap_or_default().to_owned();
        let list = |key: &str| text(key).split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect();
        let robot = if text("robot").is_empty() { stem(path) } else { text("robot") };
        let groups = self.metadata.iter().filter(|(name, _)| !OWN_GROUPS.contains(&name.as_str()));
        let header = RunHeader {
            robot,
            trajectory: text("trajectory"),
            tcp: text("tcp"),
            joints: list("joints"),
            elements: list("elements"),
            log_rate_hz: text("log_rate_hz").parse().unwrap_or(0.0),
            has_rigid: self.topics.values().any(|topic| topic == "/tcp/rigid"),
            has_static: self.topics.values().any(|topic| topic == "/tcp/static_error"),
            urdf: String::from_utf8_lossy(self.urdf.as_deref().unwrap_or_default()).into_owned(),
            metadata: groups.map(|(name, pairs)| (name.clone(), pairs.clone().into_iter().collect())).collect(),
            ..RunHeader::default()
        };
        (header, 0, vec![format!("the file has no {RUN_JSON}: it gives numbers, but no picture of the arm")])
    }
}

/// Puts the messages of a sample together.
struct Assembly {
    channels: HashMap<u16, Topic>,
    /// Topic names of this run.
    known: HashMap<String, Topic>,
    epoch_ns: u64,
    step_s: f64,
    joints: usize,
    frames: Frames,
    sequence: Option<u32>,
    sample: Sample,
    seen: Vec<Topic>,
    /// The last sample that [`Assembly::take`] or [`Assembly::close`] finished, and its topics in order.
    done: Sample,
    done_topics: Vec<Topic>,
    events: Vec<Event>,
}

impl Assembly {
    fn new(header: &RunHeader, epoch_ns: u64) -> Self {
        let mut known: HashMap<String, Topic> = [
            ("/tf", Topic::Frames),
            ("/tf_static", Topic::FixedFrames),
            ("/joint_states", Topic::Joints),
            ("/rigid/joint_states", Topic::RigidJoints),
            ("/tcp/flexible", Topic::Tool),
            ("/tcp/rigid", Topic::RigidTool),
            ("/tcp/error", Topic::Error),
            ("/tcp/error_path", Topic::PathError),
            ("/tcp/static_error", Topic::StaticError),
            ("/tcp/contributions", Topic::Contributions),
            ("/energy", Topic::Energy),
            ("/solver", Topic::Solver),
            ("/diagnostics/solver", Topic::Solver), // of older files
            ("/events", Topic::Events),
        ]
        .map(|(name, topic)| (name.to_owned(), topic))
        .into();
        for (k, name) in topic_names(&header.elements).into_iter().enumerate() {
            known.insert(format!("/elastic/{name}"), Topic::Load(k));
            known.insert(format!("/elastic/{name}/deflection"), Topic::Deflection(k));
        }
        let elastic = vec![crate::ElasticSample::default(); header.elements.len()];
        Self {
            channels: HashMap::new(),
            known,
            epoch_ns,
            step_s: header.step_s,
            joints: header.joints.len(),
            frames: Frames::of(header),
            sequence: None,
            sample: Sample { elastic, ..Sample::default() },
            seen: Vec::new(),
            done: Sample::default(),
            done_topics: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Takes a record. If it begins the next sample, the one before is [`Assembly::done`].
    ///
    /// # Errors
    /// In words, what is wrong with a message.
    fn take(&mut self, record: &Record<'_>) -> Result<Option<()>, String> {
        match record {
            Record::Channel(channel) => {
                if let Some(topic) = self.known.get(&channel.topic) {
                    self.channels.insert(channel.id, *topic);
                }
                Ok(None)
            }
            Record::Message { header, data } => {
                let Some(&topic) = self.channels.get(&header.channel_id) else { return Ok(None) };
                let next = topic.is_of_a_sample() && self.sequence != Some(header.sequence);
                let closed = next && self.close();
                if next {
                    self.sequence = Some(header.sequence);
                    let time_ns = header.log_time.saturating_sub(self.epoch_ns);
                    (self.sample.time_s, self.sample.step) = exact_time(time_ns, self.step_s);
                }
                if self.message(topic, data).is_none() {
                    return Err(format!("a message {topic:?} that cannot be read, at {} ns", header.log_time));
                }
                if topic.is_of_a_sample() {
                    self.seen.push(topic);
                }
                Ok(closed.then_some(()))
            }
            _ => Ok(None),
        }
    }

    /// Ends the sample at hand; whether there was one.
    fn close(&mut self) -> bool {
        if self.seen.is_empty() {
            return false;
        }
        self.frames.poses(&mut self.sample);
        self.done.clone_from(&self.sample);
        self.seen.sort_unstable();
        self.done_topics.clone_from(&self.seen);
        self.seen.clear();
        true
    }

    /// Puts a message's numbers into their places; `None` if it is not what its topic says.
    fn message(&mut self, topic: Topic, data: &[u8]) -> Option<()> {
        let mut cdr = CdrReader::new(data)?;
        let sample = &mut self.sample;
        match topic {
            Topic::Frames | Topic::FixedFrames => self.frames.take(&mut cdr)?,
            Topic::Joints => joint_state(&mut cdr, self.joints, &mut sample.flexible)?,
            Topic::RigidJoints => joint_state(&mut cdr, self.joints, &mut sample.rigid)?,
            Topic::Tool | Topic::RigidTool => {
                cdr.header()?;
                let twin = if topic == Topic::Tool { &mut sample.flexible } else { &mut sample.rigid };
                twin.X_WT = pose(cdr.f64s()?);
            }
            Topic::Error | Topic::PathError => {
                cdr.header()?;
                let error = if topic == Topic::Error { &mut sample.error_world } else { &mut sample.error_path };
                *error = cdr.f64s()?;
            }
            Topic::Load(k) => {
                cdr.header()?;
                sample.elastic[k].load = cdr.f64s()?;
            }
            Topic::Deflection(k) => {
                // Older files have an array with names.
                let array = cdr.labelled_array().and_then(|(_, values)| values.try_into().ok());
                let stamped = || {
                    let mut cdr = CdrReader::new(data)?;
                    cdr.header()?;
                    cdr.f64s()
                };
                sample.elastic[k].deflection = array.or_else(stamped)?;
            }
            Topic::StaticError => sample.static_m = cdr.labelled_array()?.1.try_into().ok()?,
            Topic::Contributions => {
                let (_, values) = cdr.labelled_array()?;
                sample.contributions = values.chunks_exact(3).map(|part| [part[0], part[1], part[2]]).collect();
            }
            Topic::Energy => {
                let (_, values) = cdr.labelled_array()?;
                let [kinetic, potential, elastic] = values.try_into().ok()?;
                sample.energy = crate::EnergySample { kinetic, potential, elastic };
            }
            Topic::Solver => sample.solver = cdr.labelled_array()?.1.try_into().ok()?,
            Topic::Events => {
                let time_s = cdr.time()?.saturating_sub(self.epoch_ns) as f64 / 1e9;
                cdr.u8()?;
                let kind = EventKind::from_word(cdr.string()?);
                let text = cdr.string()?.to_owned();
                self.events.extend(kind.map(|kind| Event { time_s, kind, text }));
            }
        }
        Some(())
    }
}

fn joint_state(cdr: &mut CdrReader<'_>, joints: usize, twin: &mut TwinSample) -> Option<()> {
    cdr.header()?;
    let names = cdr.u32()?;
    for _ in 0..names {
        cdr.string()?;
    }
    for values in [&mut twin.q, &mut twin.qdot, &mut twin.effort] {
        *values = cdr.f64_sequence()?;
        if values.len() != joints {
            return None;
        }
    }
    Some(())
}

/// Translation, then quaternion x, y, z, w.
fn pose([x, y, z, qx, qy, qz, qw]: [f64; 7]) -> Pose {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
    Pose::from_parts(Translation3::new(x, y, z), rotation.to_rotation_matrix())
}

/// Trees of frames, from transforms between neighbours to poses in the world.
struct Frames {
    /// Place of a frame by its name.
    places: HashMap<String, Place>,
    parents: Vec<Option<usize>>,
    /// Last transform of each link of the flexible robot and of the rigid twin, and of each station.
    X_PL: [Vec<Pose>; 2],
    X_LS: Vec<(usize, Pose)>,
    has_rigid: bool,
    stations_seen: bool,
}

#[derive(Clone, Copy)]
enum Place {
    Link { twin: usize, link: usize },
    Station(usize),
}

impl Frames {
    fn of(header: &RunHeader) -> Self {
        let mut places = HashMap::new();
        for (link, info) in header.links.iter().enumerate() {
            places.insert(info.name.clone(), Place::Link { twin: 0, link });
            if header.has_rigid {
                places.insert(format!("rigid/{}", info.name), Place::Link { twin: 1, link });
            }
        }
        let mut X_LS = Vec::new();
        for bend in &header.bends {
            let link = &header.links[bend.link].name;
            for k in 0..bend.X_LS.len() {
                places.insert(format!("{link}/station_{k}"), Place::Station(X_LS.len()));
                X_LS.push((bend.link, Pose::identity()));
            }
        }
        let identities = vec![Pose::identity(); header.links.len()];
        Self {
            places,
            parents: header.links.iter().map(|link| link.parent).collect(),
            X_PL: [identities.clone(), identities],
            X_LS,
            has_rigid: header.has_rigid,
            stations_seen: false,
        }
    }

    /// `tf2_msgs/TFMessage`.
    fn take(&mut self, cdr: &mut CdrReader<'_>) -> Option<()> {
        for _ in 0..cdr.u32()? {
            cdr.header()?;
            let child = cdr.string()?;
            let X = pose(cdr.f64s()?);
            match self.places.get(child) {
                Some(&Place::Link { twin, link }) => self.X_PL[twin][link] = X,
                Some(&Place::Station(k)) => {
                    self.X_LS[k].1 = X;
                    self.stations_seen = true;
                }
                None => {} // of another tree, made for pictures
            }
        }
        Some(())
    }

    /// Poses in the world from the last transforms.
    fn poses(&self, sample: &mut Sample) {
        let twins = [&mut sample.flexible, &mut sample.rigid];
        for (twin, X_PL) in twins.into_iter().zip(&self.X_PL).take(if self.has_rigid { 2 } else { 1 }) {
            twin.X_WL.clear();
            for (parent, X_PL) in self.parents.iter().zip(X_PL) {
                let X_WL = parent.map_or(*X_PL, |parent| twin.X_WL[parent] * X_PL);
                twin.X_WL.push(X_WL);
            }
        }
        let flexible = &mut sample.flexible;
        flexible.X_WS.clear();
        let stations = self.X_LS.iter().map(|(link, X_LS)| flexible.X_WL[*link] * X_LS);
        flexible.X_WS.extend(stations);
    }
}
