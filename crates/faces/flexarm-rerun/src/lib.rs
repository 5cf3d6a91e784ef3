//! Runs as recordings for the Rerun viewer (.rrd): robots with their meshes, plots, text and a
//! window layout.
//!
//! [`install`] makes the format known to `flexarm_log`: from then on runs, studies, maps and
//! conversions write it. [`RrdRecorder`] records one run, `study` several in one view. `run` holds
//! the contents of a run, made of `robot`s and `curves`; `tracks` buffers rows until they are worth
//! a chunk; `window` defines the layout of the viewer, `layout` encodes it, `plot_range` finds axis
//! ranges and legend corners; `stream` writes the file. Only this crate uses the `rerun` crate,
//! whose interface changes about monthly.
//!
//! ```
//! use flexarm_log::{CreateOptions, RecordingFormat};
//!
//! assert!(RecordingFormat::Rrd.recorder("run.rrd", CreateOptions::default()).is_none());
//! flexarm_rerun::install();
//! assert!(RecordingFormat::Rrd.recorder("run.rrd", CreateOptions::default()).is_some());
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod colors;
mod curves;
mod entity;
mod eye;
mod layout;
mod plot_range;
mod robot;
mod run;
mod scenery;
mod stream;
mod study;
mod tracks;
mod window;

use std::path::Path;

use flexarm_log::{
    CreateOptions, FileRecorder, FlushClock, LogError, OpenFile, RrdWriter, RunHeader, RunResult, Sample, Shape,
};
use rerun::{EntityPath, TextDocument, ViewCoordinates};

use self::entity::path;
use self::layout::{Part, PlotPlace};
use self::run::{RunRole, RunTracks};
use self::stream::{Result, RrdStream, StreamError};
use self::study::RrdStudy;
use self::tracks::{CurveExtent, SIM_TIME};

/// Makes runs, studies, maps and conversions of this process write `.rrd` files.
pub fn install() {
    flexarm_log::install_rrd_writer(RrdWriter {
        recorder: |path, options| Box::new(RrdRecorder::create(path, options)),
        study: |path, options, labels| Box::new(RrdStudy::create(path, options, labels)),
    });
}

/// Number of waiting samples at which rows are written: viewers read few large chunks fastest.
const FULL_ROWS: usize = 8 * 1024;
/// The smaller number at which rows are written every [`DUE_FLUSHES`] flushes, first and, in a run
/// with more than [`SHORT_WRITINGS`] writes, later: the SDK keeps a list of all chunks in memory.
const WORTH_ROWS: [usize; 2] = [128, 1024];
const SHORT_WRITINGS: usize = 16;
/// Ten seconds of wall time at the usual interval.
const DUE_FLUSHES: u32 = 20;

/// Writes a run as a Rerun recording.
///
/// | entity | contents |
/// | --- | --- |
/// | `/<robot>/magnified/<link>` | the flexible arm with its deflections multiplied by [`RunHeader::magnification`], coloured by the real distance from the rigid twin |
/// | `/<robot>/magnified/color_scale` | the colour scale with its distances |
/// | `/<robot>/magnified/error` | arrow from the rigid TCP to the magnified one, with the real error as text |
/// | `/<robot>/flexible/<link>`, `/<robot>/rigid/<link>` | pose in the world at true scale; below it the link's meshes, those of the rigid twin transparent |
/// | `/<robot>/<robot of the three>/<link>/<mesh>/bending`, `.../far` | surface of a flexible link: the part between its interfaces, vertex by vertex, and the part rigid with the distal one |
/// | `/<robot>/<robot of the three>/tcp` | pose of the TCP |
/// | `.../<link>/frame`, `.../tcp/frame` | name of the frame, as in MCAP files: `<link>`, `rigid/<link>`, `magnified/<link>`, `<link>/tcp`; own entities attach to it by `CoordinateFrame` or `parent_frame` |
/// | `/<robot>/path/{magnified,flexible,rigid,peak}` | TCP paths, coloured by the error, and the place of its maximum |
/// | `/plots/tcp_error/{x,y,z,norm}`, `/plots/tcp_error_path/{tangential,normal,binormal}` | TCP error, in **mm** |
/// | `/plots/tcp_error_rotation/{x,y,z}` | its rotation vector, in **mrad** |
/// | `/plots/contributions` | norm of the contribution of each flexible link and drive to the error, in **mm** |
/// | `/plots/joints/{position,velocity}`, `/plots/joints/effort/{flexible,rigid}` | in rad (m), rad/s (m/s), in N m (N) |
/// | `/plots/elastic/<element>`, `/plots/elastic_load/<element>` | deflection, in **mm** and **mrad**; load, in N and N m |
/// | `/plots/strain`, `/plots/stress` | strain gauges in **µm/m**, stress points in **MPa** |
/// | `/plots/energy`, `/plots/solver` | in J; iterations and residual |
/// | `/caption`, `/<robot>/caption` | in a recording of modes: name and frequency of the current mode; such a recording has no curves |
/// | `/scenery/<view>/<name>` | fixed objects around the robot, such as the points of a map, or the links coloured by stress |
/// | `/events` | moves, maximum error, settling, limits |
/// | `/summary`, `/urdf` | result and set-up, and the robot's description, as text |
///
/// Errors and deflections are in millimetres and milliradians, for human readers; the other formats
/// are for programs and keep metres and radians. Curves have every sample; poses at most 200 per
/// second, in the single precision of the viewer: 1e-6 m on an arm of a few metres. A bent surface
/// is written whenever a vertex has moved by 0.1 mm (by a 1500th of the scene on the magnified
/// arm); the parts rigid with its ends at every pose.
///
/// Timelines: `sim_time` (a duration) and `step`. The identifier of the recording is a hash of the
/// header. Equal runs give equal entities, times and values; the grouping of rows into chunks and
/// the chunk identifiers differ.
pub type RrdRecorder = FileRecorder<RrdFile>;

impl OpenFile for RrdFile {
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> std::result::Result<Self, LogError> {
        options.create(path)?;
        let open = || -> Result<Self> {
            let mut store = Store::new(path, content_hash(header, &[]), options)?;
            store.describe(header, &RunRole::Alone)?;
            let run = RunWriter::begin(&mut store, header, RunRole::Alone, &[])?;
            Ok(Self { store, run, closed: false })
        };
        open().map_err(stream_error(path, "write the description of the run"))
    }

    fn record(&mut self, path: &Path, sample: &Sample) -> std::result::Result<(), LogError> {
        self.run.record(&mut self.store, path, sample)
    }

    fn keep(&mut self, sample: &Sample) {
        self.run.tracks.keep(sample);
    }

    fn finish(&mut self, path: &Path, result: &RunResult) -> std::result::Result<(), LogError> {
        self.end(result).map_err(stream_error(path, "write the result and the index"))
    }
}

/// An `.rrd` file that is being written.
pub struct RrdFile {
    store: Store,
    run: RunWriter,
    closed: bool,
}

impl RrdFile {
    /// Writes the last rows, the result, the layout and the index.
    fn end(&mut self, result: &RunResult) -> Result<()> {
        self.closed = true;
        self.run.finish(&mut self.store, result)?;
        result.scenery.iter().try_for_each(|scenery| scenery::write(&self.store.stream, scenery))?;
        if !result.figures.is_empty() {
            let text = summary(&self.run.header.description, result);
            self.store.stream.constant(&path(["summary"]), &TextDocument::from_markdown(text))?;
        }
        self.store.finish()
    }
}

impl Drop for RrdFile {
    /// Writes the last rows and the index of an abandoned run; errors cannot be reported here.
    fn drop(&mut self) {
        if !self.closed {
            let _ = self.end(&RunResult::default());
        }
    }
}

/// A recording with its output file.
pub(crate) struct Store {
    stream: RrdStream,
    flush: FlushClock,
    /// Plots of the layout, once it is written, and the curves of all finished runs.
    plots: Vec<PlotPlace>,
    extents: Vec<CurveExtent>,
}

impl Store {
    fn new(path: &Path, hash: u64, options: CreateOptions) -> Result<Self> {
        let stream = RrdStream::create(path, &format!("flexarm-{hash:016x}"))?;
        Ok(Self { stream, flush: options.flush_clock(path), plots: Vec::new(), extents: Vec::new() })
    }

    /// Writes the data stored once in a recording.
    fn describe(&self, header: &RunHeader, role: &RunRole) -> Result<()> {
        let stream = &self.stream;
        stream.name(&match (role, header.trajectory.is_empty()) {
            (RunRole::InStudy(..), _) => format!("study of {}", header.robot),
            (RunRole::Alone, true) => header.robot.clone(),
            (RunRole::Alone, false) => format!("{}: {}", header.robot, header.trajectory),
        })?;
        stream.constant(&EntityPath::root(), &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        let text = summary(&header.description, &RunResult::default());
        stream.constant(&path(["summary"]), &TextDocument::from_markdown(text))?;
        if header.urdf.is_empty() {
            return Ok(());
        }
        let urdf = TextDocument::new(header.urdf.as_str()).with_media_type("application/xml");
        stream.constant(&path(["urdf"]), &urdf)
    }

    /// Sets axis ranges and legend corners, now that all curves are known, and ends the file.
    fn finish(&mut self) -> Result<()> {
        let ranges = layout::plot_ranges(&self.plots, &self.extents);
        if !ranges.is_empty() {
            self.stream.show(&ranges, 1)?;
        }
        self.stream.finish()
    }
}

/// Writes the rows of one run into a recording.
pub(crate) struct RunWriter {
    header: RunHeader,
    shape: Shape,
    tracks: RunTracks,
    writings: usize,
    /// Flushes since the last write.
    flushes: u32,
    /// The layout until it is written with the first sample, whose pose sets the viewpoint.
    layout: Option<Part>,
    tools_due: bool,
}

impl RunWriter {
    fn begin(store: &mut Store, header: &RunHeader, role: RunRole, labels: &[String]) -> Result<Self> {
        let tracks = RunTracks::new(header, &role, &store.stream)?;
        header.scenery.iter().try_for_each(|scenery| scenery::write(&store.stream, scenery))?;
        store.stream.flush()?;
        let has_layout = matches!(role, RunRole::Alone | RunRole::InStudy(0, _));
        let layout = has_layout.then(|| window::window(header, &role, labels));
        // Surfaces and files are in the recording now; free their memory.
        let header = RunHeader { meshes: Vec::new(), attachments: Vec::new(), urdf: String::new(), ..header.clone() };
        Ok(Self { shape: Shape::of(&header), header, tracks, writings: 0, flushes: 0, layout, tools_due: true })
    }

    fn record(&mut self, store: &mut Store, file: &Path, sample: &Sample) -> std::result::Result<(), LogError> {
        self.shape.check(file, sample)?;
        let time_ns = (sample.time_s * 1e9).round();
        if !(0.0..i64::MAX as f64).contains(&time_ns) {
            let (path, time_s) = (file.to_owned(), sample.time_s);
            return Err(LogError::Time { path, time_s, limit_s: i64::MAX as f64 * 1e-9 });
        }
        self.sample(store, time_ns as i64, sample).map_err(stream_error(file, "write a sample"))
    }

    fn sample(&mut self, store: &mut Store, time_ns: i64, sample: &Sample) -> Result<()> {
        self.layout(store, Some(sample))?;
        if std::mem::take(&mut self.tools_due) {
            self.tracks.tools(&self.header, sample, &store.stream)?;
        }
        self.tracks.push((time_ns, i64::try_from(sample.step).unwrap_or(i64::MAX)), sample);
        let worth = WORTH_ROWS[usize::from(self.writings >= SHORT_WRITINGS)];
        let (waiting, due) = (self.tracks.waiting(), store.flush.due());
        self.flushes += u32::from(due);
        if waiting >= FULL_ROWS || self.flushes >= DUE_FLUSHES && waiting >= worth {
            (self.writings, self.flushes) = (self.writings + 1, 0);
            self.tracks.send(&store.stream)?;
        } else {
            self.tracks.send_large(&store.stream)?;
        }
        if due {
            store.stream.flush()?;
            store.flush.done();
        }
        Ok(())
    }

    /// Writes the layout, unless it is written already, with a viewpoint that fits the pose of this
    /// sample.
    fn layout(&mut self, store: &mut Store, first: Option<&Sample>) -> Result<()> {
        let Some(window) = self.layout.take() else { return Ok(()) };
        let (entities, plots) = layout::entities(&window, SIM_TIME, eye::eye(&self.header, first));
        store.plots = plots;
        store.stream.show(&entities, 0)
    }

    /// Writes the waiting rows, the paths and the marks.
    fn finish(&mut self, store: &mut Store, result: &RunResult) -> Result<()> {
        self.layout(store, None)?;
        self.tracks.close();
        self.tracks.send(&store.stream)?;
        store.extents.extend(self.tracks.extents());
        self.tracks.ways(&store.stream)?;
        self.tracks.marks(&store.stream, result)
    }
}

/// Returns the text panel: the result once it is known, then the set-up. A list, because lists wrap
/// at the edge of the panel.
fn summary(description: &str, result: &RunResult) -> String {
    if result.readable.is_empty() {
        return description.to_owned();
    }
    let plain = |text: &str| text.replace('*', "\\*").replace('_', "\\_");
    let line = |(name, value): &(String, String)| format!("- **{}** {}\n", plain(name), plain(value));
    result.readable.iter().map(line).collect::<String>() + "\n" + description
}

/// FNV-1a hash of texts, names, numbers and attached files of the header, and of the labels of a
/// study: the same set-up gives the same recording identifier, and a viewer keeps recordings of
/// different set-ups apart.
fn content_hash(header: &RunHeader, labels: &[String]) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let names = header.joints.iter().chain(&header.elements).chain(header.links.iter().map(|link| &link.name));
    let groups = header
        .metadata
        .iter()
        .flat_map(|(name, pairs)| std::iter::once(name).chain(pairs.iter().flat_map(|(key, value)| [key, value])));
    let texts = [&header.robot, &header.trajectory, &header.urdf, &header.tcp, &header.description];
    let texts = texts.into_iter().chain(names).chain(groups).chain(labels);
    let numbers = [header.log_rate_hz, header.magnification, header.color_scale_m, header.step_s, labels.len() as f64];
    let corners = header.volume.into_iter().flatten().flatten();
    let numbers = numbers.into_iter().chain(corners).flat_map(f64::to_le_bytes);
    let files = header.attachments.iter().flat_map(|file| file.bytes.iter().copied());
    let bytes = texts.flat_map(|text| text.bytes().chain([0])).chain(numbers).chain(files);
    bytes.fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

/// Returns the length of a vector.
fn size(parts: &[f64]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}

fn stream_error(path: &Path, action: &'static str) -> impl FnOnce(StreamError) -> LogError {
    move |error| match error {
        StreamError::Io(source) => LogError::io(path, action)(source),
        other => LogError::Format { path: path.to_owned(), action, cause: other.to_string() },
    }
}
