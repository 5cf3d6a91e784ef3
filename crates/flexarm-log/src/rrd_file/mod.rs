//! A run as a Rerun recording (.rrd): both robots with their meshes, plots, text and a window layout.
//!
//! Start at [`RrdRecorder`]. [`tracks`] holds rows until they are worth a chunk, [`layout`] says what the viewer
//! shows, [`stream`] writes the file. All knowledge of the `rerun` crate, which breaks about monthly, is in this
//! module.

mod layout;
mod stream;
mod tracks;

use std::path::{Path, PathBuf};

use nalgebra::{Rotation3, Vector3};
use rerun::components::MeshFaceRendering;
use rerun::external::re_log_types::StoreKind;
use rerun::log::Chunk;
use rerun::{
    AlbedoFactor, Color, EntityPath, Mesh3D, Rgba32, StoreId, TextDocument, TimePoint, Timeline, TransformAxes3D,
    ViewCoordinates,
};

use self::layout::{Eye, Part};
use self::stream::{Ids, RrdStream, StreamError};
use self::tracks::{PathTrack, PoseTrack, SIM_TIME, ScalarTrack, SkeletonTrack, Times};
use crate::create::FlushClock;
use crate::shape::Shape;
use crate::{CreateOptions, LinkMesh, LogError, Recorder, RunHeader, RunResult, Sample, TwinSample};

/// Rows of a chunk: enough for compression, few enough for quick reading.
const CHUNK_ROWS: usize = 512;

const RED: u32 = 0xE0_4F_4F_FF;
const GREEN: u32 = 0x5F_BF_5F_FF;
const BLUE: u32 = 0x5B_8D_EF_FF;
const LIGHT: u32 = 0xD8_D8_D8_FF;
const ORANGE: u32 = 0xF2_A1_3B_FF;
/// The rigid twin: bluish, mostly transparent.
const GHOST: u32 = 0x7F_B2_FF_60;

/// Writes a run as a Rerun recording.
///
/// | entity | contents |
/// | --- | --- |
/// | `/<robot>/flexible/<link>`, `/<robot>/rigid/<link>` | pose in the world; below it the link's meshes, those of the rigid twin as a ghost |
/// | `/<robot>/flexible/tcp`, `/<robot>/rigid/tcp` | pose of the tool centre point |
/// | `/<robot>/path/flexible`, `/<robot>/path/rigid` | way of the tool centre point |
/// | `/plots/tcp_error/{x,y,z,norm}`, `/plots/tcp_error_path/{tangential,normal,binormal}` | TCP error, in **mm** |
/// | `/plots/tcp_error_rotation/{x,y,z}` | its rotation vector, in **mrad** |
/// | `/plots/joints/position`, `/plots/joints/effort/{flexible,rigid}` | in rad (m), in N m (N) |
/// | `/plots/elastic/<element>` | deflection, in **mm** and **mrad** |
/// | `/plots/energy`, `/plots/solver` | in J; iterations and residual |
/// | `/summary`, `/urdf` | set-up with the result, and the robot's description, as text |
///
/// Errors and deflections are in millimetres and milliradians because people read them here; the other formats
/// are for programs and keep metres and radians. Poses are single precision, which is all the viewer has.
///
/// Timelines: `sim_time` (a duration) and `step`. Nothing in the file depends on the clock: the recording's
/// identifier is a hash of the header, rows are numbered in order.
pub struct RrdRecorder {
    path: PathBuf,
    options: CreateOptions,
    state: State,
}

enum State {
    New,
    Open(Box<Open>),
    Finished,
}

impl RrdRecorder {
    /// A recorder that will write `path`; the file is created by `begin`.
    pub fn create(path: impl Into<PathBuf>, options: CreateOptions) -> Self {
        Self { path: path.into(), options, state: State::New }
    }
}

impl Recorder for RrdRecorder {
    fn check(&self) -> Result<(), LogError> {
        self.options.check(&self.path)
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if !matches!(self.state, State::New) {
            return Err(LogError::begun_twice(&self.path));
        }
        let file = self.options.create(&self.path)?;
        let open = RrdStream::new(file).and_then(|stream| Open::begin(stream, header, self.options.flush_clock()));
        self.state = State::Open(Box::new(open.map_err(stream_error(&self.path, "write the description of the run"))?));
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "record")) };
        open.shape.check(&self.path, sample)?;
        let time_ns = (sample.time_s * 1e9).round();
        if !(0.0..i64::MAX as f64).contains(&time_ns) {
            let (path, time_s) = (self.path.clone(), sample.time_s);
            return Err(LogError::Time { path, time_s, limit_s: i64::MAX as f64 * 1e-9 });
        }
        open.sample(time_ns as i64, sample).map_err(stream_error(&self.path, "write a sample"))
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "finish")) };
        open.finish(result).map_err(stream_error(&self.path, "write the result and the index"))?;
        self.state = State::Finished;
        Ok(())
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

/// A layout that is still to be written.
struct Layout {
    blueprint: StoreId,
    window: Part,
    parents: Vec<Option<usize>>,
}

/// A file between `begin` and `finish`.
struct Open {
    stream: RrdStream,
    recording: StoreId,
    shape: Shape,
    flush: FlushClock,
    description: String,
    times: Times,
    flexible: TwinTracks,
    rigid: Option<TwinTracks>,
    /// In the order of [`push_scalars`].
    scalars: Vec<ScalarTrack>,
    /// Written with the first sample, which shows where the robot is.
    layout: Option<Layout>,
    closed: bool,
}

impl Open {
    /// Starts the recording with everything that does not change, and its layout.
    fn begin(stream: RrdStream, header: &RunHeader, flush: FlushClock) -> Result<Self, StreamError> {
        let id = format!("flexarm-{:016x}", content_hash(header));
        let layout = Layout {
            blueprint: StoreId::new(StoreKind::Blueprint, "flexarm", format!("{id}-layout")),
            window: window(header),
            parents: header.links.iter().map(|link| link.parent).collect(),
        };
        let mut open = Self {
            stream,
            recording: StoreId::new(StoreKind::Recording, "flexarm", id),
            shape: Shape::of(header),
            flush,
            description: header.description.clone(),
            times: Times::default(),
            flexible: TwinTracks::new(header, "flexible", ORANGE),
            rigid: header.has_rigid.then(|| TwinTracks::new(header, "rigid", BLUE)),
            scalars: scalar_tracks(header),
            layout: Some(layout),
            closed: false,
        };
        open.stream.open_store(&open.recording)?;
        open.constants(header)?;
        open.stream.set_tail(&open.recording, &[])?;
        Ok(open)
    }

    fn constants(&mut self, header: &RunHeader) -> Result<(), StreamError> {
        let name = match header.trajectory.is_empty() {
            true => header.robot.clone(),
            false => format!("{}: {}", header.robot, header.trajectory),
        };
        self.constant(&EntityPath::properties(), &rerun::RecordingInfo::new().with_name(name))?;
        self.constant(&EntityPath::root(), &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        self.summary(&[])?;
        if !header.urdf.is_empty() {
            self.constant(&path(["urdf"]), &TextDocument::new(header.urdf.as_str()))?;
        }

        // Robots: meshes below their links, axes at the tool.
        for mesh in &header.meshes {
            let [red, green, blue, alpha] = mesh.color.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
            let color = Rgba32::from_unmultiplied_rgba(red, green, blue, alpha);
            self.mesh(header, "flexible", mesh, surface(mesh, color))?;
            if header.has_rigid {
                // Its back faces only: they are hidden wherever the flexible robot is in the same place.
                let ghost = surface(mesh, Rgba32::from_u32(GHOST)).with_face_rendering(MeshFaceRendering::Back);
                self.mesh(header, "rigid", mesh, ghost)?;
            }
        }
        const AXIS_LENGTH_M: f32 = 0.1;
        self.constant(&path([&header.robot, "flexible", "tcp"]), &TransformAxes3D::new(AXIS_LENGTH_M))?;
        for skeleton in [self.flexible.skeleton.as_ref(), self.rigid.as_ref().and_then(|rigid| rigid.skeleton.as_ref())]
        {
            let Some(skeleton) = skeleton else { continue };
            let style = skeleton.style(self.stream.ids())?;
            self.stream.append(&self.recording, &style)?;
        }

        for track in &self.scalars {
            let style = track.style(self.stream.ids())?;
            self.stream.append(&self.recording, &style)?;
        }
        Ok(())
    }

    fn mesh(&mut self, header: &RunHeader, twin: &str, mesh: &LinkMesh, surface: Mesh3D) -> Result<(), StreamError> {
        let link = &header.links[mesh.link].name;
        self.constant(&path([&header.robot, twin, link, &mesh.name]), &surface)
    }

    /// The text panel: the set-up, and once it is known the result below.
    fn summary(&mut self, result: &[(String, String)]) -> Result<(), StreamError> {
        let mut text = self.description.clone();
        if !result.is_empty() {
            text.push_str("\n\n## Result\n\n| | |\n| --- | --- |\n");
            for (key, value) in result {
                let cell = |text: &str| text.replace('|', "\\|");
                text.push_str(&format!("| {} | {} |\n", cell(key), cell(value)));
            }
        }
        self.constant(&path(["summary"]), &TextDocument::from_markdown(text))
    }

    fn constant(&mut self, at: &EntityPath, what: &dyn rerun::AsComponents) -> Result<(), StreamError> {
        let chunk = self.stream.ids().single(at, &TimePoint::default(), what)?;
        self.stream.append(&self.recording, &chunk)
    }

    /// Writes the layout if that has not happened yet, with the robot of this sample in the picture.
    fn layout(&mut self, first: Option<&Sample>) -> Result<(), StreamError> {
        let Some(Layout { blueprint, window, parents }) = self.layout.take() else { return Ok(()) };
        let eye = first.and_then(|sample| eye(&parents, &sample.flexible));
        let when = TimePoint::default().with(Timeline::new_sequence("blueprint"), 0);
        self.stream.open_store(&blueprint)?;
        for (at, what) in layout::entities(&window, SIM_TIME, eye) {
            let chunk = self.stream.ids().single(&at, &when, what.as_ref())?;
            self.stream.append(&blueprint, &chunk)?;
        }
        self.stream.activate(&blueprint)
    }

    fn sample(&mut self, time_ns: i64, sample: &Sample) -> Result<(), StreamError> {
        self.layout(Some(sample))?;
        self.times.push(time_ns, i64::try_from(sample.step).unwrap_or(i64::MAX));
        self.flexible.push(&sample.flexible);
        if let Some(rigid) = &mut self.rigid {
            rigid.push(&sample.rigid);
        }
        push_scalars(&mut self.scalars, sample, self.shape.has_rigid);

        if self.times.rows() >= CHUNK_ROWS {
            self.commit_rows()?;
        }
        if self.flush.due() {
            // The rows that wait, and the paths so far, as a provisional end.
            let mut ids = *self.stream.ids();
            let mut chunks = self.rows(&mut ids)?;
            chunks.extend(self.paths(&mut ids)?);
            self.stream.set_tail(&self.recording, &chunks)?;
        }
        Ok(())
    }

    /// Chunks of the rows that wait.
    fn rows(&self, ids: &mut Ids) -> Result<Vec<Chunk>, StreamError> {
        if self.times.rows() == 0 {
            return Ok(Vec::new());
        }
        let times = self.times.columns();
        let mut chunks = self.flexible.rows(ids, &times)?;
        if let Some(rigid) = &self.rigid {
            chunks.extend(rigid.rows(ids, &times)?);
        }
        for track in &self.scalars {
            chunks.push(track.chunk(ids, &times)?);
        }
        Ok(chunks)
    }

    fn paths(&self, ids: &mut Ids) -> Result<Vec<Chunk>, StreamError> {
        let twins = std::iter::once(&self.flexible).chain(&self.rigid);
        twins.map(|twin| twin.path.chunk(ids)).collect()
    }

    fn commit_rows(&mut self) -> Result<(), StreamError> {
        let mut ids = *self.stream.ids();
        let chunks = self.rows(&mut ids)?;
        self.append_all(ids, &chunks)?;
        self.times.clear();
        for twin in std::iter::once(&mut self.flexible).chain(&mut self.rigid) {
            twin.clear();
        }
        self.scalars.iter_mut().for_each(ScalarTrack::clear);
        Ok(())
    }

    fn append_all(&mut self, ids: Ids, chunks: &[Chunk]) -> Result<(), StreamError> {
        *self.stream.ids() = ids;
        chunks.iter().try_for_each(|chunk| self.stream.append(&self.recording, chunk))
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), StreamError> {
        self.closed = true;
        self.layout(None)?;
        self.commit_rows()?;
        let mut ids = *self.stream.ids();
        let paths = self.paths(&mut ids)?;
        self.append_all(ids, &paths)?;
        if !result.figures.is_empty() {
            self.summary(&result.figures)?;
        }
        self.stream.finish()
    }
}

impl Drop for Open {
    /// A run that was given up still gets its last rows and its index; errors have nowhere to go.
    fn drop(&mut self) {
        if !self.closed {
            let _ = self.finish(&RunResult::default());
        }
    }
}

fn surface(mesh: &LinkMesh, color: Rgba32) -> Mesh3D {
    let surface = Mesh3D::new(mesh.positions.iter().copied())
        .with_triangle_indices(mesh.triangles.iter().copied())
        .with_albedo_factor(AlbedoFactor(color));
    match mesh.normals.len() == mesh.positions.len() {
        true => surface.with_vertex_normals(mesh.normals.iter().copied()),
        false => surface,
    }
}

/// Frames of one of the two robots.
struct TwinTracks {
    links: Vec<PoseTrack>,
    tcp: PoseTrack,
    path: PathTrack,
    /// Only for a robot without meshes, which would not be seen.
    skeleton: Option<SkeletonTrack>,
}

impl TwinTracks {
    fn new(header: &RunHeader, twin: &str, color: u32) -> Self {
        let at = |what: &str| path([&header.robot, twin, what]);
        let pairs = header.links.iter().enumerate();
        let pairs = pairs.filter_map(|(child, link)| Some((child, link.parent?))).collect();
        let color = Color::from_u32(color);
        Self {
            links: header.links.iter().map(|link| PoseTrack::new(at(&link.name))).collect(),
            tcp: PoseTrack::new(at("tcp")),
            path: PathTrack::new(path([&header.robot, "path", twin]), color),
            skeleton: header.meshes.is_empty().then(|| SkeletonTrack::new(at("skeleton"), color, pairs)),
        }
    }

    fn push(&mut self, twin: &TwinSample) {
        for (track, X_WL) in self.links.iter_mut().zip(&twin.X_WL) {
            track.push(X_WL);
        }
        self.tcp.push(&twin.X_WT);
        self.path.push(&twin.X_WT);
        if let Some(skeleton) = &mut self.skeleton {
            skeleton.push(&twin.X_WL);
        }
    }

    fn rows(&self, ids: &mut Ids, times: &[rerun::TimeColumn]) -> Result<Vec<Chunk>, StreamError> {
        let frames = self.links.iter().chain([&self.tcp]).map(|track| track.chunk(ids, times));
        let mut chunks = frames.collect::<Result<Vec<_>, _>>()?;
        if let Some(skeleton) = &self.skeleton {
            chunks.push(skeleton.chunk(ids, times)?);
        }
        Ok(chunks)
    }

    fn clear(&mut self) {
        self.links.iter_mut().for_each(PoseTrack::clear);
        self.tcp.clear();
        if let Some(skeleton) = &mut self.skeleton {
            skeleton.clear();
        }
    }
}

/// All curves, in the order of [`push_scalars`].
fn scalar_tracks(header: &RunHeader) -> Vec<ScalarTrack> {
    let curve = |group: &str, key: &str, name: &str, color: u32| {
        ScalarTrack::new(path(["plots", group, key]), [name]).with_colors([Color::from_u32(color)])
    };
    let mut tracks = Vec::new();
    if header.has_rigid {
        tracks.push(curve("tcp_error", "x", "x [mm]", RED));
        tracks.push(curve("tcp_error", "y", "y [mm]", GREEN));
        tracks.push(curve("tcp_error", "z", "z [mm]", BLUE));
        tracks.push(curve("tcp_error", "norm", "norm [mm]", LIGHT));
        tracks.push(curve("tcp_error_path", "tangential", "tangential [mm]", RED));
        tracks.push(curve("tcp_error_path", "normal", "normal [mm]", GREEN));
        tracks.push(curve("tcp_error_path", "binormal", "binormal [mm]", BLUE));
        tracks.push(curve("tcp_error_rotation", "x", "about x [mrad]", RED));
        tracks.push(curve("tcp_error_rotation", "y", "about y [mrad]", GREEN));
        tracks.push(curve("tcp_error_rotation", "z", "about z [mrad]", BLUE));
    }
    tracks.push(ScalarTrack::new(path(["plots", "joints", "position"]), header.joints.clone()));
    tracks.push(ScalarTrack::new(path(["plots", "joints", "effort", "flexible"]), header.joints.clone()));
    if header.has_rigid {
        let names = header.joints.iter().map(|joint| format!("{joint} (rigid)"));
        tracks.push(ScalarTrack::new(path(["plots", "joints", "effort", "rigid"]), names));
    }
    for element in &header.elements {
        let parts = ["x [mm]", "y [mm]", "z [mm]", "rx [mrad]", "ry [mrad]", "rz [mrad]"];
        let names = parts.map(|part| format!("{element} {part}"));
        tracks.push(ScalarTrack::new(path(["plots", "elastic", element]), names));
    }
    tracks.push(ScalarTrack::new(path(["plots", "energy"]), ["kinetic [J]", "potential [J]", "elastic [J]"]));
    tracks.push(ScalarTrack::new(path(["plots", "solver"]), ["iterations", "residual"]));
    tracks
}

/// One row for each curve of [`scalar_tracks`].
fn push_scalars(tracks: &mut [ScalarTrack], sample: &Sample, has_rigid: bool) {
    let mut tracks = tracks.iter_mut();
    let mut put = |values: &[f64]| tracks.next().expect("a track for every group of values").push(values);
    const MILLI: f64 = 1e3;
    if has_rigid {
        let error = sample.error_world.map(|part| part * MILLI);
        let norm = error[..3].iter().map(|part| part * part).sum::<f64>().sqrt();
        error[..3].iter().for_each(|part| put(&[*part]));
        put(&[norm]);
        sample.error_path[..3].iter().for_each(|part| put(&[part * MILLI]));
        error[3..].iter().for_each(|part| put(&[*part]));
    }
    put(&sample.flexible.q);
    put(&sample.flexible.effort);
    if has_rigid {
        put(&sample.rigid.effort);
    }
    for element in &sample.elastic {
        put(&element.deflection.map(|part| part * MILLI));
    }
    put(&[sample.energy.kinetic, sample.energy.potential, sample.energy.elastic]);
    put(&sample.solver);
}

/// The robots, beside them the error, its causes, and the text.
fn window(header: &RunHeader) -> Part {
    let plot = |title: &str, parts: &[&str]| Part::plot(title, path(["plots"].iter().chain(parts)));
    let causes = [
        (!header.elements.is_empty()).then(|| plot("Elastic deflections [mm, mrad]", &["elastic"])),
        Some(plot("Joint positions", &["joints", "position"])),
        Some(plot("Joint efforts", &["joints", "effort"])),
        Some(plot("Energy [J]", &["energy"])),
        header.has_rigid.then(|| plot("TCP error, rotation [mrad]", &["tcp_error_rotation"])),
        Some(plot("Solver", &["solver"])),
    ];
    let mut right = Vec::new();
    if header.has_rigid {
        right.push((3.0, plot("TCP error [mm], world axes", &["tcp_error"])));
        right.push((3.0, plot("TCP error [mm], path axes", &["tcp_error_path"])));
    }
    right.push((3.0, Part::Tabs(causes.into_iter().flatten().collect())));
    right.push((3.0, Part::text("Summary", path(["summary"]))));
    Part::Row(vec![(3.0, Part::space("Robot", path([&header.robot]))), (2.0, Part::Column(right))])
}

/// A place to see the whole robot from, aside of the plane it stands in at first, a little from above.
fn eye(parents: &[Option<usize>], twin: &TwinSample) -> Option<Eye> {
    const TURN_RAD: f64 = -1.1;
    const HEIGHT: f64 = 0.7;
    const DISTANCE: f64 = 1.05;

    // How far the stretched arm reaches from its base: the way along the links.
    let base = twin.X_WL.first()?.translation.vector;
    let mut lengths = vec![0.0; parents.len()];
    for (link, parent) in parents.iter().enumerate() {
        let Some(parent) = *parent else { continue };
        let step = twin.X_WL[link].translation.vector - twin.X_WL[parent].translation.vector;
        lengths[link] = lengths[parent] + step.norm();
    }
    let to_tool = twin.X_WT.translation.vector - base;
    let reach = lengths.into_iter().fold(to_tool.norm(), f64::max);
    if !(reach.is_finite() && reach > 0.0) {
        return None;
    }

    let flat = Vector3::new(to_tool.x, to_tool.y, 0.0);
    let ahead = flat.try_normalize(0.05 * reach).unwrap_or_else(Vector3::x);
    let aside = Rotation3::from_axis_angle(&Vector3::z_axis(), TURN_RAD) * ahead;
    let target = base + reach * (0.25 * ahead + 0.25 * Vector3::z());
    let position = target + reach * DISTANCE * (aside + HEIGHT * Vector3::z());
    let point = |p: Vector3<f64>| p.map(|part| part as f32).into();
    Some(Eye { position: point(position), target: point(target) })
}

/// An entity path of parts that may hold any character.
fn path<S: AsRef<str>>(parts: impl IntoIterator<Item = S>) -> EntityPath {
    EntityPath::from_iter(parts.into_iter().map(|part| part.as_ref().into()))
}

/// FNV-1a of the texts and names of a header: the same set-up gives the same recording.
fn content_hash(header: &RunHeader) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let names = header.joints.iter().chain(&header.elements).chain(header.links.iter().map(|link| &link.name));
    let groups = header
        .metadata
        .iter()
        .flat_map(|(name, pairs)| std::iter::once(name).chain(pairs.iter().flat_map(|(key, value)| [key, value])));
    let texts = [&header.robot, &header.trajectory, &header.urdf, &header.tcp, &header.description];
    let texts = texts.into_iter().chain(names).chain(groups);
    let bytes = texts.flat_map(|text| text.bytes().chain([0])).chain(header.log_rate_hz.to_le_bytes());
    bytes.fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

fn stream_error(path: &Path, action: &'static str) -> impl FnOnce(StreamError) -> LogError {
    move |error| match error {
        StreamError::Io(source) => LogError::io(path, action)(source),
        other => LogError::Format { path: path.to_owned(), action, cause: other.to_string() },
    }
}
