//! A run as an MCAP file of ROS 2 messages, for Foxglove, PlotJuggler, Rerun and ROS itself.
//!
//! Profile `ros2`: CDR messages, their definitions embedded, `offered_qos_profiles` on every
//! channel. Chunks of whole samples, about 1 MiB or half a simulated second, compressed with zstd,
//! are written to the file once they are closed; readers that need no index can read a killed run
//! up to its last closed chunk. The `mcap` crate writes the records ([`output`]).
//!
//! Start at [`McapRecorder`]; topics are in [`channels`], messages in [`messages`], coordinate
//! frames in [`frames`], markers for viewers in [`markers`].

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

use serde::Serialize;

use self::channels::Channels;
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
/// | `/tcp/error`, `/tcp/error_path` | `geometry_msgs/TwistStamped` | an error: translation and rotation vector; world axes, path axes |
/// | `/deviation/tcp`, `/deviation/tcp_path` | `std_msgs/Float64MultiArray` | translation of the error, which viewers plot by default and first |
/// | `/tcp/static_error` | `std_msgs/Float64MultiArray` | static share of the error: x, y, z, world axes |
/// | `/tcp/contributions` | `std_msgs/Float64MultiArray` | contribution of each of [`RunHeader::contributors`] to the TCP displacement: x, y, z of each, world axes |
/// | `/elastic/joint_states` | `sensor_msgs/JointState` | all elements as joints `<element>/x` to `<element>/rz`, so that curves have names: deflection, load |
/// | `/elastic/<element>` | `geometry_msgs/WrenchStamped` | the same load, for arrows; at most 60 times a second |
/// | `/elastic/<element>/deflection` | `geometry_msgs/TwistStamped` | not a velocity: the same deflection, translation and rotation; at most 60 times a second |
/// | `/gauges` | `std_msgs/Float64MultiArray` | strain (m/m) and stress (Pa) of [`RunHeader::gauges`] |
/// | `/energy`, `/solver` | `std_msgs/Float64MultiArray` | |
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
/// The names of an array's entries are in the label of its only dimension, separated by commas. SI
/// units.
///
/// The `header.stamp`, log time and publish time of a message are [`RunHeader::start_ns`] (default
/// [`START_NS`]) plus the simulated time.
///
/// The file also holds, as attachments, `robot.urdf`, the mesh files, `RunHeader::attachments`, for
/// readers of flexarm `run.json` and `meshes.bin.zst` (header and surfaces) and, at the end,
/// `result.json` and `RunResult::attachments`; as metadata, the groups of `RunHeader::metadata`,
/// `flexarm.recording`, `flexarm.units` and, at the end, `flexarm.result`.
pub type McapRecorder = FileRecorder<McapFile>;

/// Returns the stamp of a simulated time in a file whose time zero is `start_ns`.
fn stamp(path: &Path, start_ns: u64, time_s: f64) -> Result<Stamp, LogError> {
    let room_ns = Stamp::MAX.saturating_sub(start_ns);
    let time_ns = (time_s * 1e9).round();
    if !(0.0..=room_ns as f64).contains(&time_ns) || start_ns > Stamp::MAX {
        return Err(LogError::Time { path: path.to_owned(), time_s, limit_s: room_ns as f64 * 1e-9 });
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
    /// `<element>/x` and so on.
    deflections: Vec<String>,
    /// Label of the contributions.
    contributions: String,
    /// Label of the gauges.
    gauges: String,
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
        let parts = |names: &[String], parts: &[&str], joint: &str| -> Vec<String> {
            names.iter().flat_map(|name| parts.iter().map(move |part| format!("{name}{joint}{part}"))).collect()
        };
        Ok(Self {
            output,
            channels,
            shape: Shape::of(header),
            frames: Frames::of(header),
            markers: MovingMarkers::new(header),
            joints: header.joints.clone(),
            elements: header.elements.clone(),
            deflections: parts(&header.elements, &["x", "y", "z", "rx", "ry", "rz"], "/"),
            contributions: parts(&header.contributors, &["x [m]", "y [m]", "z [m]"], " ").join(","),
            gauges: header.gauges.join(","),
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
        if let Some(channel) = self.channels.markers.surfaces {
            let frames = SurfaceFrames::of(header);
            let surfaces = markers::surfaces(header, &frames);
            output.send(channel, 0, start, messages::markers(start, &surfaces))?;
        }

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

    fn sample(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        self.transforms(stamp, sample)?;
        self.robots(stamp, sample)?;
        if let Some(channel) = self.channels.static_error {
            self.send(channel, stamp, messages::labelled_array("x [m],y [m],z [m]", &sample.static_m))?;
        }
        if let Some(channel) = self.channels.contributions {
            let shares = sample.contributions.as_flattened();
            let message = messages::labelled_array(&self.contributions, shares);
            self.output.send(channel, self.samples, stamp, message)?;
        }
        if let Some(channel) = self.channels.gauges {
            let message = messages::labelled_array(&self.gauges, &sample.gauges);
            self.output.send(channel, self.samples, stamp, message)?;
        }
        self.elastic(stamp, sample)?;
        let energy = &sample.energy;
        let energies = [energy.kinetic, energy.potential, energy.elastic];
        let labels = "kinetic [J],potential [J],elastic [J]";
        self.send(self.channels.energy, stamp, messages::labelled_array(labels, &energies))?;
        let labels = "iterations,residual";
        self.send(self.channels.solver, stamp, messages::labelled_array(labels, &sample.solver))?;
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

    /// Sends the joints and the TCP of both robots.
    fn robots(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        self.joint_states(self.channels.joint_states, stamp, &sample.flexible)?;
        let tool = &sample.flexible.X_WT;
        self.send(self.channels.tcp_flexible, stamp, messages::pose_stamped(stamp, WORLD, tool))?;
        if let Some(channels) = self.channels.rigid {
            self.joint_states(channels.joint_states, stamp, &sample.rigid)?;
            self.send(channels.tcp, stamp, messages::pose_stamped(stamp, WORLD, &sample.rigid.X_WT))?;
            self.error(stamp, channels.error, channels.error_plot, "x [m],y [m],z [m],norm [m]", &sample.error_world)?;
            let axes = "tangential [m],normal [m],binormal [m],norm [m]";
            self.error(stamp, channels.error_path, channels.error_path_plot, axes, &sample.error_path)?;
        }
        Ok(())
    }

    /// Sends the markers that are due.
    fn moving_markers(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        let since_start = stamp.0 - self.start.0;
        let (paths, error) = self.markers.advance(since_start, sample, self.frames.magnified());
        self.last = stamp;
        if paths {
            self.paths()?;
        }
        if let Some(channel) = self.channels.markers.error.filter(|_| error) {
            let arrow = self.markers.error(sample);
            self.output.send(channel, self.errors, stamp, messages::markers(stamp, &arrow))?;
            self.errors = self.errors.wrapping_add(1);
        }
        Ok(())
    }

    /// Sends a message on a topic that has one for every sample.
    fn send(&mut self, channel: u16, stamp: Stamp, message: impl Serialize) -> io::Result<()> {
        self.output.send(channel, self.samples, stamp, message)
    }

    fn joint_states(&mut self, channel: u16, stamp: Stamp, twin: &TwinSample) -> io::Result<()> {
        let values = [&twin.q, &twin.qdot, &twin.effort].map(Vec::as_slice);
        self.output.send(channel, self.samples, stamp, messages::joint_state(stamp, &self.joints, values))
    }

    /// Sends deflections and loads: all elements by name with every sample, and one pair of topics
    /// per element for viewers that draw them.
    fn elastic(&mut self, stamp: Stamp, sample: &Sample) -> io::Result<()> {
        if let Some(channel) = self.channels.elastic_joint_states {
            self.values.clear();
            self.values.extend(sample.elastic.iter().flat_map(|element| element.deflection));
            self.values.extend(sample.elastic.iter().flat_map(|element| element.load));
            let (deflections, loads) = self.values.split_at(self.values.len() / 2);
            let values = [deflections, &[], loads];
            let message = messages::joint_state(stamp, &self.deflections, values);
            self.output.send(channel, self.samples, stamp, message)?;
        }
        if self.frames.is_pictured() {
            for (index, element) in sample.elastic.iter().enumerate() {
                let (channels, name) = (self.channels.elastic[index], &self.elements[index]);
                let load = messages::six_vector_stamped(stamp, name, &element.load);
                self.output.send(channels.load, self.pictures, stamp, load)?;
                let deflection = messages::six_vector_stamped(stamp, name, &element.deflection);
                self.output.send(channels.deflection, self.pictures, stamp, deflection)?;
            }
            self.pictures = self.pictures.wrapping_add(1);
        }
        Ok(())
    }

    /// Sends an error as a six-vector, and its translation with the norm as plain numbers.
    fn error(&mut self, stamp: Stamp, vector: u16, plot: u16, axes: &str, error: &[f64; 6]) -> io::Result<()> {
        self.send(vector, stamp, messages::six_vector_stamped(stamp, WORLD, error))?;
        let [x, y, z, ..] = *error;
        let norm = (x * x + y * y + z * z).sqrt();
        self.send(plot, stamp, messages::labelled_array(axes, &[x, y, z, norm]))
    }

    /// Writes the paths up to the last sample, unless they are already in the file.
    fn paths(&mut self) -> io::Result<()> {
        let stamp = self.last;
        let paths = self.markers.paths();
        if self.paths_at == Some(stamp) || paths.is_empty() {
            return Ok(());
        }
        let channel = self.channels.markers.paths;
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
        self.output.finish()
    }
}

impl Drop for McapFile {
    /// Writes the index of an abandoned run; errors cannot be reported here.
    fn drop(&mut self) {
        let _ = self.last_frames().and_then(|()| self.output.finish());
    }
}
