//! A run as an MCAP file of ROS 2 messages, for Foxglove, PlotJuggler, Rerun and ROS itself.
//!
//! Profile `ros2`: CDR messages, their definitions embedded, `offered_qos_profiles` on every channel. Chunks of
//! at most 1 MiB, compressed with zstd, are closed where the data says so; between two chunks the open one is
//! in the file as a provisional chunk with a provisional end ([`crate::tail_file`]), so that what a killed run
//! leaves is a whole MCAP file; only its index is missing.
//!
//! Start at [`McapRecorder`]; topics are in [`channels`], messages in [`messages`] and [`cdr`].

mod cdr;
mod channels;
mod definitions;
mod messages;

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use flexarm_kinematics::Pose;
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, McapResult, WriteOptions, Writer};

use self::cdr::Cdr;
use self::channels::Channels;
use self::messages::{Stamp, Transform};
use crate::create::FlushClock;
use crate::shape::Shape;
use crate::tail_file::SharedTail;
use crate::{CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample, TwinSample};

/// Uncompressed size at which a chunk is closed.
const CHUNK_BYTES: usize = 1 << 20;

/// Root of both trees of frames.
const WORLD: &str = "world";

/// Writes a run as an MCAP file.
///
/// | topic | message | |
/// | --- | --- | --- |
/// | `/robot_description` | `std_msgs/String` | the URDF, once, latched |
/// | `/tf`, `/tf_static` | `tf2_msgs/TFMessage` | two trees under `world`: links, and `rigid/` links |
/// | `/joint_states`, `/rigid/joint_states` | `sensor_msgs/JointState` | effort: what the drives must supply |
/// | `/tcp/flexible`, `/tcp/rigid` | `geometry_msgs/PoseStamped` | in `world` |
/// | `/tcp/error`, `/tcp/error_path` | `geometry_msgs/TwistStamped` | an error: translation and rotation vector; world axes, path axes |
/// | `/tcp/error_plot`, `/tcp/error_path_plot` | `std_msgs/Float64MultiArray` | its translation, which viewers plot unasked |
/// | `/elastic/<element>` | `geometry_msgs/WrenchStamped` | load |
/// | `/elastic/<element>/deflection` | `std_msgs/Float64MultiArray` | deflection |
/// | `/diagnostics/solver`, `/energy` | `std_msgs/Float64MultiArray` | |
///
/// The names of an array's entries are in the label of its one dimension, separated by commas. SI units.
///
/// `header.stamp`, log time and publish time of a message are epoch + simulated time; the epoch is 0 unless
/// [`McapRecorder::with_epoch_ns`] says otherwise, and viewers then show a time since the start.
///
/// The file also holds `robot.urdf`, the mesh files and `RunHeader::attachments` as attachments, and the groups
/// of `RunHeader::metadata`, `flexarm.recording`, `flexarm.units` and, at the end, `flexarm.result` as metadata.
pub struct McapRecorder {
    path: PathBuf,
    options: CreateOptions,
    epoch_ns: u64,
    state: State,
}

enum State {
    New,
    Open(Box<Open>),
    Finished,
}

impl McapRecorder {
    /// A recorder that will write `path`; the file is created by `begin`.
    pub fn create(path: impl Into<PathBuf>, options: CreateOptions) -> Self {
        Self { path: path.into(), options, epoch_ns: 0, state: State::New }
    }

    /// Sets the time of simulated time zero (ns since 1970), default 0. Files with the present time as epoch
    /// are no longer the same on another day.
    #[must_use]
    pub fn with_epoch_ns(self, epoch_ns: u64) -> Self {
        Self { epoch_ns, ..self }
    }

    /// Stamp of a simulated time.
    fn stamp(&self, time_s: f64) -> Result<Stamp, LogError> {
        let room_ns = Stamp::MAX.saturating_sub(self.epoch_ns);
        let time_ns = (time_s * 1e9).round();
        if !(0.0..=room_ns as f64).contains(&time_ns) || self.epoch_ns > Stamp::MAX {
            return Err(LogError::Time { path: self.path.clone(), time_s, limit_s: room_ns as f64 * 1e-9 });
        }
        Ok(Stamp(self.epoch_ns + time_ns as u64))
    }
}

impl Recorder for McapRecorder {
    fn check(&self) -> Result<(), LogError> {
        self.options.check(&self.path)
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if !matches!(self.state, State::New) {
            return Err(LogError::begun_twice(&self.path));
        }
        let start = self.stamp(0.0)?;
        let meshes = mesh_files(header)?;
        let file = SharedTail::new(self.options.create(&self.path)?);
        let error = mcap_error(&self.path, "write the description of the run");
        let mut open = Open::new(file, header, self.options.flush_clock()).map_err(error)?;
        let error = mcap_error(&self.path, "write the description of the run");
        open.describe(header, start, &meshes).map_err(error)?;
        self.state = State::Open(Box::new(open));
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let stamp = self.stamp(sample.time_s)?;
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "record")) };
        open.shape.check(&self.path, sample)?;
        open.sample(stamp, sample).map_err(mcap_error(&self.path, "write a sample"))?;
        if open.flush.due() {
            open.flush().map_err(LogError::io(&self.path, "write samples"))?;
        }
        Ok(())
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "finish")) };
        open.finish(result).map_err(mcap_error(&self.path, "write the result and the index"))?;
        self.state = State::Finished;
        Ok(())
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

/// A file between `begin` and `finish`.
struct Open {
    /// Keeps the open chunk in memory and writes it whole, into `file`.
    writer: Writer<SharedTail>,
    file: SharedTail,
    channels: Channels,
    shape: Shape,
    frames: Frames,
    joints: Vec<String>,
    elements: Vec<String>,
    flush: FlushClock,
    /// Message records of the open chunk, as they are in it.
    chunk: Vec<u8>,
    /// First and last time in the open chunk.
    chunk_times: (u64, u64),
    samples: u32,
    cdr: Cdr,
}

impl Open {
    fn new(file: SharedTail, header: &RunHeader, flush: FlushClock) -> McapResult<Self> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("flexarm ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None) // closed by `message`, which knows what is in it
            .disable_seeking(true)
            .compression_threads(0); // same bytes on every machine
        let mut writer = options.create(file.clone())?;
        let channels = Channels::add(&mut writer, header)?;
        Ok(Self {
            writer,
            file,
            channels,
            shape: Shape::of(header),
            frames: Frames::of(header),
            joints: header.joints.clone(),
            elements: header.elements.clone(),
            flush,
            chunk: Vec::new(),
            chunk_times: (u64::MAX, 0),
            samples: 0,
            cdr: Cdr::default(),
        })
    }

    /// Everything that is known before the first sample.
    fn describe(&mut self, header: &RunHeader, start: Stamp, meshes: &[crate::Attachment]) -> McapResult<()> {
        if let Some(channel) = self.channels.robot_description {
            messages::string(&mut self.cdr, &header.urdf);
            self.message(channel, start)?;
        }
        self.close_chunk()?;

        let recording = [
            ("robot", header.robot.clone()),
            ("trajectory", header.trajectory.clone()),
            ("tcp", header.tcp.clone()),
            ("joints", header.joints.join(",")),
            ("elements", header.elements.join(",")),
            ("log_rate_hz", format!("{:?}", header.log_rate_hz)),
            ("epoch_ns", start.0.to_string()),
        ];
        let units = [("length", "m"), ("angle", "rad"), ("time", "s"), ("mass", "kg"), ("force", "N")];
        self.metadata("flexarm.recording", recording.map(|(key, value)| (key.to_owned(), value)))?;
        self.metadata("flexarm.units", units.map(|(key, value)| (key.to_owned(), value.to_owned())))?;
        for (name, pairs) in &header.metadata {
            self.metadata(name, pairs.iter().cloned())?;
        }

        if !header.urdf.is_empty() {
            self.attach(start, "robot.urdf", "application/xml", header.urdf.as_bytes())?;
        }
        for file in meshes.iter().chain(&header.attachments) {
            self.attach(start, &file.name, &file.media_type, &file.bytes)?;
        }
        Ok(self.flush()?)
    }

    fn sample(&mut self, stamp: Stamp, sample: &Sample) -> McapResult<()> {
        let rigid = self.channels.rigid.map(|channels| (channels, &sample.rigid));

        // Frames. What does not move is known only with the first sample.
        if self.samples == 0 {
            self.frames.write(&mut self.cdr, stamp, sample, Moving::No);
            self.message(self.channels.tf_static, stamp)?;
        }
        self.frames.write(&mut self.cdr, stamp, sample, Moving::Yes);
        self.message(self.channels.tf, stamp)?;

        // Joints and tool centre point of either robot.
        messages::joint_state(&mut self.cdr, stamp, &self.joints, &sample.flexible);
        self.message(self.channels.joint_states, stamp)?;
        messages::pose_stamped(&mut self.cdr, stamp, WORLD, &sample.flexible.X_WT);
        self.message(self.channels.tcp_flexible, stamp)?;
        if let Some((channels, rigid)) = rigid {
            messages::joint_state(&mut self.cdr, stamp, &self.joints, rigid);
            self.message(channels.joint_states, stamp)?;
            messages::pose_stamped(&mut self.cdr, stamp, WORLD, &rigid.X_WT);
            self.message(channels.tcp, stamp)?;
            self.error(stamp, channels.error, channels.error_plot, "x [m],y [m],z [m]", &sample.error_world)?;
            let axes = "tangential [m],normal [m],binormal [m]";
            self.error(stamp, channels.error_path, channels.error_path_plot, axes, &sample.error_path)?;
        }

        // Elastic elements.
        for (index, element) in sample.elastic.iter().enumerate() {
            let channels = self.channels.elastic[index];
            messages::six_vector_stamped(&mut self.cdr, stamp, &self.elements[index], &element.load);
            self.message(channels.load, stamp)?;
            let labels = "x [m],y [m],z [m],rx [rad],ry [rad],rz [rad]";
            messages::labelled_array(&mut self.cdr, labels, &element.deflection);
            self.message(channels.deflection, stamp)?;
        }

        // The run itself.
        let energy = &sample.energy;
        let energies = [energy.kinetic, energy.potential, energy.elastic];
        messages::labelled_array(&mut self.cdr, "kinetic [J],potential [J],elastic [J]", &energies);
        self.message(self.channels.energy, stamp)?;
        messages::labelled_array(&mut self.cdr, "iterations,residual", &sample.solver);
        self.message(self.channels.solver, stamp)?;

        self.samples = self.samples.wrapping_add(1);
        Ok(())
    }

    /// An error as a six-vector, and its translation with the norm as plain numbers.
    fn error(&mut self, stamp: Stamp, vector: u16, plot: u16, axes: &str, error: &[f64; 6]) -> McapResult<()> {
        messages::six_vector_stamped(&mut self.cdr, stamp, WORLD, error);
        self.message(vector, stamp)?;
        let [x, y, z, ..] = *error;
        let norm = (x * x + y * y + z * z).sqrt();
        messages::labelled_array(&mut self.cdr, &format!("{axes},norm [m]"), &[x, y, z, norm]);
        self.message(plot, stamp)
    }

    /// Adds the message in `cdr` to the open chunk, or to a new one if it would grow too large.
    fn message(&mut self, channel_id: u16, stamp: Stamp) -> McapResult<()> {
        let header = MessageHeader { channel_id, sequence: self.samples, log_time: stamp.0, publish_time: stamp.0 };
        let size = MESSAGE_OVERHEAD + self.cdr.bytes().len();
        if !self.chunk.is_empty() && self.chunk.len() + size > CHUNK_BYTES {
            self.close_chunk()?;
        }
        push_message_record(&mut self.chunk, &header, self.cdr.bytes());
        self.chunk_times = (self.chunk_times.0.min(stamp.0), self.chunk_times.1.max(stamp.0));
        self.writer.write_to_known_channel(&header, self.cdr.bytes())
    }

    fn close_chunk(&mut self) -> McapResult<()> {
        self.chunk.clear();
        self.chunk_times = (u64::MAX, 0);
        self.writer.flush()
    }

    /// Brings everything so far into the file: closed chunks for good, the open one and an end provisionally.
    fn flush(&mut self) -> std::io::Result<()> {
        let mut tail = Vec::with_capacity(self.chunk.len() + 128);
        if !self.chunk.is_empty() {
            push_chunk_record(&mut tail, &self.chunk, self.chunk_times);
        }
        push_end(&mut tail);
        self.file.set_tail(&tail)
    }

    fn metadata(&mut self, name: &str, pairs: impl IntoIterator<Item = (String, String)>) -> McapResult<()> {
        let metadata = BTreeMap::from_iter(pairs);
        self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata })
    }

    fn attach(&mut self, start: Stamp, name: &str, media_type: &str, bytes: &[u8]) -> McapResult<()> {
        self.writer.attach(&mcap::Attachment {
            log_time: start.0,
            create_time: 0, // unknown, and a run's file must not depend on the day
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: bytes.into(),
        })
    }

    fn finish(&mut self, result: &RunResult) -> McapResult<()> {
        self.metadata("flexarm.result", result.figures.iter().cloned())?;
        self.writer.finish()?;
        Ok(self.file.flush()?)
    }
}

impl Drop for Open {
    /// A run that was given up still gets its index; errors have nowhere to go.
    fn drop(&mut self) {
        let _ = self.writer.finish();
        let _ = self.file.flush();
    }
}

/// Adds a chunk without compression and checksum, made by hand: the provisional end of a file.
fn push_chunk_record(file: &mut Vec<u8>, messages: &[u8], (start, end): (u64, u64)) {
    const OPCODE: u8 = 0x06;
    const FIXED_BYTES: u64 = 8 + 8 + 8 + 4 + 4 + 8;
    let size = messages.len() as u64;
    file.push(OPCODE);
    file.extend((FIXED_BYTES + size).to_le_bytes());
    file.extend(start.to_le_bytes());
    file.extend(end.to_le_bytes());
    file.extend(size.to_le_bytes()); // uncompressed
    file.extend(0_u32.to_le_bytes()); // no checksum
    file.extend(0_u32.to_le_bytes()); // no compression: an empty name
    file.extend(size.to_le_bytes());
    file.extend_from_slice(messages);
}

/// Adds an end of file without an index: data end, footer, magic. Readers then go through the data.
fn push_end(file: &mut Vec<u8>) {
    const DATA_END: u8 = 0x0f;
    const FOOTER: u8 = 0x02;
    file.push(DATA_END);
    file.extend(4_u64.to_le_bytes());
    file.extend([0; 4]); // no checksum
    file.push(FOOTER);
    file.extend(20_u64.to_le_bytes());
    file.extend([0; 20]); // no summary, no offsets, no checksum
    file.extend(mcap::MAGIC);
}

/// Bytes of a message record besides its data.
const MESSAGE_OVERHEAD: usize = 1 + 8 + (2 + 4 + 8 + 8);

/// Adds a message as it is inside a chunk.
fn push_message_record(chunk: &mut Vec<u8>, header: &MessageHeader, data: &[u8]) {
    const OPCODE: u8 = 0x05;
    const HEADER_BYTES: u64 = 2 + 4 + 8 + 8;
    chunk.push(OPCODE);
    chunk.extend((HEADER_BYTES + data.len() as u64).to_le_bytes());
    chunk.extend(header.channel_id.to_le_bytes());
    chunk.extend(header.sequence.to_le_bytes());
    chunk.extend(header.log_time.to_le_bytes());
    chunk.extend(header.publish_time.to_le_bytes());
    chunk.extend_from_slice(data);
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Moving {
    Yes,
    No,
}

/// Names of the frames of both trees.
struct Frames {
    links: Vec<LinkFrame>,
    has_rigid: bool,
}

struct LinkFrame {
    parent: Option<usize>,
    moving: Moving,
    flexible: String,
    rigid: String,
}

impl Frames {
    fn of(header: &RunHeader) -> Self {
        let frame = |link: &crate::LinkInfo| LinkFrame {
            parent: link.parent,
            moving: if link.fixed || link.parent.is_none() { Moving::No } else { Moving::Yes },
            flexible: link.name.clone(),
            rigid: format!("rigid/{}", link.name),
        };
        Self { links: header.links.iter().map(frame).collect(), has_rigid: header.has_rigid }
    }

    /// Writes the transforms of the links that move, or of those that do not.
    fn write(&self, cdr: &mut Cdr, stamp: Stamp, sample: &Sample, moving: Moving) {
        let mut transforms = Vec::with_capacity(2 * self.links.len());
        self.tree(&mut transforms, &sample.flexible, moving, |link| link.flexible.as_str());
        if self.has_rigid {
            self.tree(&mut transforms, &sample.rigid, moving, |link| link.rigid.as_str());
        }
        messages::transforms(cdr, stamp, &transforms);
    }

    fn tree<'a>(
        &'a self,
        transforms: &mut Vec<Transform<'a>>,
        twin: &TwinSample,
        moving: Moving,
        name: impl Fn(&'a LinkFrame) -> &'a str,
    ) {
        for (index, link) in self.links.iter().enumerate() {
            let (parent, X_WP) = match link.parent {
                Some(parent) => (name(&self.links[parent]), twin.X_WL[parent]),
                None => (WORLD, Pose::identity()),
            };
            let child = name(link);
            // A base link that is called `world` is the root itself.
            if link.moving == moving && child != parent {
                transforms.push(Transform { parent, child, X_PC: X_WP.inv_mul(&twin.X_WL[index]) });
            }
        }
    }
}

/// The files that the meshes came from, each once, as attachments `meshes/<file name>`.
fn mesh_files(header: &RunHeader) -> Result<Vec<crate::Attachment>, LogError> {
    let (mut seen, mut names, mut files) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for path in header.meshes.iter().filter_map(|mesh| mesh.file.as_deref()) {
        if !seen.insert(path) {
            continue;
        }
        let bytes = std::fs::read(path).map_err(LogError::io(path, "read the mesh to attach it"))?;
        let file_name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        let mut name = format!("meshes/{file_name}");
        if !names.insert(name.clone()) {
            name = format!("meshes/{}/{file_name}", seen.len()); // another folder's file of that name
            names.insert(name.clone());
        }
        files.push(crate::Attachment { name, media_type: media_type(path).to_owned(), bytes });
    }
    Ok(files)
}

fn media_type(path: &Path) -> &'static str {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "stl" => "model/stl",
        "obj" => "model/obj",
        "dae" => "model/vnd.collada+xml",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        _ => "application/octet-stream",
    }
}

fn mcap_error(path: &Path, action: &'static str) -> impl FnOnce(McapError) -> LogError {
    move |error| match error {
        McapError::Io(source) => LogError::io(path, action)(source),
        other => LogError::Format { path: path.to_owned(), action, cause: other.to_string() },
    }
}
