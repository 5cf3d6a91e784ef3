//! A run as an MCAP file of ROS 2 messages, for Foxglove, PlotJuggler, Rerun and ROS itself.
//!
//! Profile `ros2`: CDR messages, their definitions embedded, `offered_qos_profiles` on every
//! channel. Chunks of whole samples, about 1 MiB or half a simulated second, compressed with zstd,
//! are written to the file once they are closed; readers that need no index can read a killed run
//! up to its last closed chunk. The `mcap` crate writes the records ([`output`]).
//!
//! Start at [`McapRecorder`]; topics are in [`channels`], messages in [`messages`], coordinate
//! frames in [`frames`], markers for viewers in [`markers`].

pub(crate) mod bag;
pub(crate) mod beat;
pub(crate) mod bent;
pub(crate) mod channels;
mod definitions;
mod frames;
pub(crate) mod layouts;
pub(crate) mod markers;
mod mesh_files;
pub(crate) mod messages;
pub(crate) mod output;

use std::fs::File;
use std::io;
use std::path::Path;

use self::channels::{Channels, Named, RigidChannels};
use self::frames::{Frames, Moving, WORLD};
use self::markers::{MovingMarkers, SurfaceFrames};
use self::mesh_files::mesh_files;
use self::messages::{Level, Stamp};
use self::output::Output;
use crate::file_recorder::{FileRecorder, OpenFile};
use crate::shape::Shape;
use crate::{CreateOptions, EventKind, LogError, RunHeader, RunResult, START_NS, Sample, TwinSample};

/// Writes a run as an MCAP file.
///
/// | topic | message | |
/// | --- | --- | --- |
/// | `/robot_description` | `std_msgs/String` | the URDF, once, latched |
/// | `/tf`, `/tf_static` | `tf2_msgs/TFMessage` | three trees under `world`: links, `rigid/` links and `magnified/` links; stations of a flexible link as its children `<link>/station_<k>`, the TCP as `<link>/tcp`; at most 200 times a second |
/// | `/joint_states`, `/rigid/joint_states` | `sensor_msgs/JointState` | effort: required drive torque or force |
/// | `/tcp/flexible`, `/tcp/rigid` | `geometry_msgs/PoseStamped` | in `world` |
/// | `/tcp/error` | `sensor_msgs/JointState` | world axes: translation `x`, `y`, `z` (m), rotation vector `rx`, `ry`, `rz` (rad), `norm` of the translation (m) |
/// | `/tcp/error_path` | `sensor_msgs/JointState` | the same along the path: `tangential`, `normal`, `binormal` (m), `r_tangential`, `r_normal`, `r_binormal` (rad) |
/// | `/tcp/static_error` | `sensor_msgs/JointState` | static share of the error, world axes: `x`, `y`, `z` (m) |
/// | `/tcp/contributions` | `sensor_msgs/JointState` | contribution of each of [`RunHeader::contributors`] to the TCP displacement, world axes: `<contributor>/x` and so on (m) |
/// | `/elastic/joint_states` | `sensor_msgs/JointState` | `<element>/x` to `<element>/rz`: deflection as position, load as effort |
/// | `/elastic/<element>` | `geometry_msgs/WrenchStamped` | the same load, for arrows; at most 60 times a second |
/// | `/gauges` | `sensor_msgs/JointState` | strain (m/m) and stress (Pa) of [`RunHeader::gauges`] |
/// | `/energy` | `sensor_msgs/JointState` | `kinetic`, `potential`, `elastic` (J) |
/// | `/solver` | `sensor_msgs/JointState` | `iterations`, `residual` |
/// | `/events` | `rcl_interfaces/Log` | events, each at its own time; the name is the kind |
/// | `/markers` | `visualization_msgs/MarkerArray` | surfaces, once, latched; namespaces `flexible`, `rigid`, `magnified` |
/// | `/markers/path` | `visualization_msgs/MarkerArray` | TCP paths so far, every second; namespaces `path/flexible`, `path/rigid`, `path/magnified` |
/// | `/markers/error` | `visualization_msgs/MarkerArray` | the TCP error, magnified, 20 times a second |
///
/// All other topics have a message for every sample. `/tf` is also written at each sample whose
/// error exceeds all previous ones, so that the maximum has its poses, and at the last sample; an
/// `.rrd` file converted from the recording equals that of the run.
///
/// Topics with `rigid` and `error` need a rigid twin, the magnified arm also
/// [`RunHeader::magnification`]. The magnified arm is sent at most 60 times per second of simulated
/// time, in single precision. A link of [`RunHeader::bends`] is drawn bent in slabs with the frames
/// `magnified/<link>/bend_<k>`; in a recording without magnification, such as one of modes, the
/// flexible robot itself is drawn this way.
///
/// Numbers without the form of a message of ROS are the positions of a `JointState`, by which
/// viewers name their curves. SI units.
///
/// The `header.stamp`, log time and publish time of a message are [`RunHeader::start_ns`] (default
/// [`START_NS`]) plus the simulated time.
///
/// The file also holds, as attachments, `robot.urdf`, the mesh files, `RunHeader::attachments`, for
/// readers of flexarm `run.json` and `meshes.bin.zst` (header and surfaces) and, at the end,
/// `result.json` and `RunResult::attachments`; as metadata, the groups of `RunHeader::metadata`,
/// `flexarm.recording`, `flexarm.units` and, at the end, `flexarm.result` and `rosbag2`.
pub type McapRecorder = FileRecorder<McapFile>;

/// Returns the stamp of a simulated time in a file whose time zero is `start_ns`.
fn stamp(path: &Path, start_ns: u64, time_s: f64) -> Result<Stamp, LogError> {
    let limit_ns = Stamp::MAX.saturating_sub(start_ns);
    let time_ns = (time_s * 1e9).round();
    if !(0.0..=limit_ns as f64).contains(&time_ns) || start_ns > Stamp::MAX {
        return Err(LogError::Time { path: path.to_owned(), time_s, limit_s: limit_ns as f64 * 1e-9 });
    }
    Ok(Stamp(start_ns + time_ns as u64))
}

impl OpenFile for McapFile {
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> Result<Self, LogError> {
        let start = stamp(path, header.start_ns.unwrap_or(START_NS), 0.0)?;
        let meshes = mesh_files(header)?;
        let file = options.create(path)?;
        let error = LogError::io(path, "write the description of the run");
        let mut open = Self::new(file, header, start).map_err(error)?;
        let error = LogError::io(path, "write the description of the run");
        open.describe(header, &meshes).map_err(error)?;
        Ok(open)
    }

    fn record(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError> {
        let stamp = stamp(path, self.start.0, sample.time_s)?;
        self.shape.check(path, sample)?;
        self.sample(stamp, sample).map_err(LogError::io(path, "write a sample"))?;
        if self.output.is_full(stamp) {
            self.output.flush().map_err(LogError::io(path, "write samples"))?;
        }
        Ok(())
    }

    fn keep(&mut self, sample: &Sample) {
        self.frames.keep(sample);
    }

    fn finish(&mut self, path: &Path, result: &RunResult) -> Result<(), LogError> {
        let times = result.events.iter().map(|event| stamp(path, self.start.0, event.time_s));
        let times = times.collect::<Result<Vec<_>, _>>()?;
        self.end(result, &times).map_err(LogError::io(path, "write the result and the index"))
    }
}

/// An MCAP file that is being written.
pub struct McapFile {
    output: Output,
    channels: Channels,
    shape: Shape,
    frames: Frames,
    markers: MovingMarkers,
    joints: Vec<String>,
    elements: Vec<String>,
    start: Stamp,
    last: Stamp,
    samples: u32,
    /// Message counts of topics without a message for every sample.
    poses: u32,
    paths: u32,
    errors: u32,
    pictures: u32,
    /// Deflections and loads of a sample; buffer reused for every sample.
    values: Vec<f64>,
    /// Time of the last message on the paths topic.
    paths_at: Option<Stamp>,
}

impl McapFile {
    fn new(file: File, header: &RunHeader, start: Stamp) -> io::Result<Self> {
        let mut output = Output::new(file)?;
        let channels = Channels::add(&mut output, header)?;
        Ok(Self {
            output,
            channels,
            shape: Shape::of(header),
            frames: Frames::of(header),
            markers: MovingMarkers::new(header),
            joints: header.joints.clone(),
            elements: header.elements.clone(),
            start,
            last: start,
            samples: 0,
            poses: 0,
            paths: 0,
            errors: 0,
            pictures: 0,
            values: Vec::new(),
            paths_at: None,
        })
    }

    /// Writes everything known before the first sample.
    fn describe(&mut self, header: &RunHeader, meshes: &[crate::Attachment]) -> io::Result<()> {
        let (start, output) = (self.start, &mut self.output);
        if let Some(channel) = self.channels.robot_description {
            output.send(channel, 0, start, &header.urdf)?;
        }
        if let Some(channel) = self.channels.surfaces {
            let frames = SurfaceFrames::of(header);
            let surfaces = markers::surfaces(header, &frames);
            output.send(channel, 0, start, messages::markers(start, &surfaces))?;
        }

        // Names and units, for readers of other programs.
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
        output.metadata("flexarm.recording", recording.map(|(key, value)| (key.to_owned(), value)))?;
        output.metadata("flexarm.units", units.map(|(key, value)| (key.to_owned(), value.to_owned())))?;
        for (name, pairs) in &header.metadata {
            output.metadata(name, pairs.iter().cloned())?;
        }

        // Files: the robot, its meshes, the set-up, and the header for readers of flexarm.
        let urdf = (!header.urdf.is_empty()).then(|| crate::Attachment {
            name: "robot.urdf".into(),
            media_type: "application/xml".into(),
            bytes: header.urdf.clone().into_bytes(),
        });
        for file in urdf.iter().chain(meshes).chain(&header.attachments).chain(&crate::run_json::files(header)?) {
            output.attach(start, file)?;
        }
        output.flush()
    }

    /// Writes the messages of a sample. Their order is part of the format: frames come first.
    fn sample(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        self.transforms(stamp, sample)?;
        self.robot(self.channels.joint_states, self.channels.tcp_flexible, stamp, &sample.flexible)?;
        if let Some(RigidChannels { joint_states, tcp, .. }) = self.channels.rigid {
            self.robot(joint_states, tcp, stamp, &sample.rigid)?;
        }
        // Signals that are rows of numbers, each in its own channel.
        let [x, y, z, rx, ry, rz] = sample.error_world;
        let error = [x, y, z, rx, ry, rz, (x * x + y * y + z * z).sqrt()];
        let energy = [sample.energy.kinetic, sample.energy.potential, sample.energy.elastic];
        let channels = &self.channels;
        let rigid = channels.rigid.as_ref();
        let numbers = [
            (rigid.map(|rigid| &rigid.error), error.as_slice()),
            (rigid.map(|rigid| &rigid.error_path), &sample.error_path),
            (channels.static_error.as_ref(), &sample.static_m),
            (channels.contributions.as_ref(), sample.contributions.as_flattened()),
            (channels.gauges.as_ref(), &sample.gauges),
            (Some(&channels.energy), &energy),
            (Some(&channels.solver), &sample.solver),
        ];
        for (topic, values) in numbers {
            let Some(Named { channel, names }) = topic else { continue };
            self.output.send(*channel, self.samples, stamp, messages::joint_state(stamp, names, [values, &[], &[]]))?;
        }
        self.elastic(stamp, sample)?;
        self.moving_markers(stamp, sample)?;
        self.samples = self.samples.wrapping_add(1);
        Ok(())
    }

    /// Sends the transforms; the fixed ones are known only with the first sample.
    fn transforms(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        let shown = self.frames.advance(stamp.0 - self.start.0, sample);
        if self.samples == 0 {
            let fixed = messages::transforms(stamp, &self.frames.transforms(sample, Moving::No));
            self.output.send(self.channels.tf_static, 0, stamp, fixed)?;
        }
        if shown {
            let moving = messages::transforms(stamp, &self.frames.transforms(sample, Moving::Yes));
            self.output.send(self.channels.tf, self.poses, stamp, moving)?;
            self.poses = self.poses.wrapping_add(1);
        }
        Ok(())
    }

    /// Sends the joints and the TCP of a robot.
    fn robot(&mut self, joint_states: u16, tcp: u16, stamp: Stamp, twin: &TwinSample) -> io::Result<()> {
        let values = [&twin.q, &twin.qdot, &twin.effort].map(Vec::as_slice);
        let joints = messages::joint_state(stamp, &self.joints, values);
        self.output.send(joint_states, self.samples, stamp, joints)?;
        self.output.send(tcp, self.samples, stamp, messages::pose_stamped(stamp, WORLD, &twin.X_WT))
    }

    /// Sends the markers that are due.
    fn moving_markers(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        let since_start = stamp.0 - self.start.0;
        let (paths, error) = self.markers.advance(since_start, sample, self.frames.magnified());
        self.last = stamp;
        if paths {
            self.paths()?;
        }
        if let Some(channel) = self.channels.error_markers.filter(|_| error) {
            let arrow = self.markers.error(sample);
            self.output.send(channel, self.errors, stamp, messages::markers(stamp, &arrow))?;
            self.errors = self.errors.wrapping_add(1);
        }
        Ok(())
    }

    /// Sends deflections and loads: all elements by name with every sample, and the load of each on
    /// a topic of its own for viewers that draw arrows.
    fn elastic(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        if let Some(topic) = &self.channels.elastic_joint_states {
            self.values.clear();
            self.values.extend(sample.elastic.iter().flat_map(|element| element.deflection));
            self.values.extend(sample.elastic.iter().flat_map(|element| element.load));
            let (deflections, loads) = self.values.split_at(self.values.len() / 2);
            let values = [deflections, &[], loads];
            let message = messages::joint_state(stamp, &topic.names, values);
            self.output.send(topic.channel, self.samples, stamp, message)?;
        }
        if self.frames.is_pictured() {
            for (index, element) in sample.elastic.iter().enumerate() {
                let load = messages::wrench_stamped(stamp, &self.elements[index], &element.load);
                self.output.send(self.channels.elastic[index], self.pictures, stamp, load)?;
            }
            self.pictures = self.pictures.wrapping_add(1);
        }
        Ok(())
    }

    /// Writes the paths up to the last sample, unless they are already in the file.
    fn paths(&mut self) -> io::Result<()> {
        let stamp = self.last;
        let paths = self.markers.paths();
        if self.paths_at == Some(stamp) || paths.is_empty() {
            return Ok(());
        }
        let channel = self.channels.paths;
        self.output.send(channel, self.paths, stamp, messages::markers(stamp, &paths))?;
        self.paths = self.paths.wrapping_add(1);
        self.paths_at = Some(stamp);
        Ok(())
    }

    /// Writes the frames of the last sample, unless they are already in the file.
    fn last_frames(&mut self) -> io::Result<()> {
        let Some(transforms) = self.frames.close() else { return Ok(()) };
        let message = messages::transforms(self.last, &transforms);
        self.output.send(self.channels.tf, self.poses, self.last, message)
    }

    /// Writes the last frames and paths, the events, the result and the index.
    fn end(&mut self, result: &RunResult, event_times: &[Stamp]) -> io::Result<()> {
        self.last_frames()?;
        self.paths()?;
        // Events get a chunk of their own: their times span the run, which would widen the time
        // range of the open chunk.
        self.output.flush()?;
        for ((event, stamp), sequence) in result.events.iter().zip(event_times).zip(0..) {
            let level = match event.kind {
                EventKind::Stopped => Level::Error,
                EventKind::Limit => Level::Warn,
                _ => Level::Info,
            };
            let message = messages::log(*stamp, level, event.kind.word(), &event.text);
            self.output.send(self.channels.events, sequence, *stamp, message)?;
        }
        self.output.metadata("flexarm.result", result.figures.iter().cloned())?;
        for file in [crate::run_json::result_file(result)].iter().chain(&result.attachments) {
            self.output.attach(self.last, file)?;
        }
        self.output.describe_bag()?;
        self.output.finish()
    }
}

impl Drop for McapFile {
    /// Writes the index of an abandoned run; errors cannot be reported here.
    fn drop(&mut self) {
        let _ = self.last_frames().and_then(|()| self.output.finish());
    }
}
