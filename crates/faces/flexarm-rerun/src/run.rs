//! One run in a recording: its robots, TCP paths, curves and events.
//!
//! Start at [`RunTracks`]: made from a header, fed with samples, closed with a result. Poses are
//! those of links and TCP in the world (m). Not here: rows and chunks (`tracks.rs`), meshes
//! (`robot.rs`), the layout of the window (`window.rs`).

use rerun::{
    Color, EntityPath, LineStrip3D, LineStrips3D, Points3D, Radius, Scalars, SeriesPoints, TextDocument, TextLog,
    TimeColumn, TimePoint, Timeline,
};

use super::colors::{self, ColorScale};
use super::curves::Curves;
use super::entity::path;
use super::eye::{Eye, eye};
use super::plot_range::Envelope;
use super::robot::{Paint, RobotAppearance, RobotTracks};
use super::size;
use super::stream::{Result, RrdStream};
use super::tracks::{ArrowTrack, CurveExtent, Instant, PathTrack, SIM_TIME, Times, Track, point};
use flexarm_draw::Magnifier;
use flexarm_log::{Event, EventKind, PoseClock, PoseReasons, RunHeader, RunResult, Sample, TwinSample};

/// Role of a run in its recording.
#[derive(Clone, Debug)]
pub(crate) enum RunRole {
    /// The only run.
    Alone,
    /// A run of a study, with its number from 0 and its label.
    InStudy(usize, String),
}

impl RunRole {
    /// Parent entity of the robots of the run.
    pub(crate) fn root(&self, header: &RunHeader) -> EntityPath {
        match self {
            Self::Alone => path([&header.robot]),
            Self::InStudy(_, label) => path([label]),
        }
    }

    /// Whether the run is the only one or the first of a study.
    fn is_first(&self) -> bool {
        matches!(self, Self::Alone | Self::InStudy(0, _))
    }

    pub(crate) fn color(&self) -> Option<Color> {
        match self {
            Self::Alone => None,
            Self::InStudy(k, _) => Some(colors::series(*k)),
        }
    }
}

/// A robot with its TCP path.
struct Drawn {
    robot: Option<RobotTracks>,
    way: PathTrack,
    way_color: Option<Color>,
}

/// All time-dependent data of a run.
pub(crate) struct RunTracks {
    root: EntityPath,
    /// Times of all samples, and of those at which the robots are drawn.
    times: Times,
    pose_times: Times,
    flexible: Drawn,
    rigid: Option<Drawn>,
    magnified: Option<Drawn>,
    magnifier: Magnifier,
    enlarged: TwinSample,
    arrow: Option<ArrowTrack>,
    scale: ColorScale,
    /// Present for a single run or the first run of a study.
    curves: Option<Curves>,
    study_curves: Option<Curves>,
    /// Whether the shapes shown have an arbitrary scale (modes), so that no errors are shown.
    shapes: bool,
    /// Selects the samples with poses; curves have all samples.
    clock: PoseClock,
    /// Time of the last sample if it has not been drawn.
    now: Option<Instant>,
    /// The same once the sample is kept.
    undrawn: Option<Instant>,
    last: Sample,
    /// Maximum error so far (m), its time, and the drawn position of the TCP.
    peak: Option<(f64, Instant, [f32; 3])>,
}

/// Tolerances of the drawing, as lengths in the scene (m).
struct Fineness {
    pixel_m: f64,
    /// Displacement of a vertex of an arm at true scale that is not noticed.
    true_tolerance_m: f64,
    /// Rounding of the vertices of magnified arms.
    quantum_m: f32,
}

impl Fineness {
    fn of(header: &RunHeader) -> Self {
        const PIXELS: f64 = 800.0;
        let extent = header.volume.map_or(3.0, |[low, high]| size(&[0, 1, 2].map(|c| high[c] - low[c])));
        let pixel_m = extent / PIXELS;
        // Proportional to the scale for arms with deflections of centimetres, at most one pixel for
        // arms of a few centimetres.
        let true_tolerance_m = (0.02 * header.color_scale_m).max(1e-4).min(pixel_m);
        // A power of two, so that rounded numbers compress well.
        let quantum_m = (0.5 * pixel_m).log2().floor().exp2() as f32;
        Self { pixel_m, true_tolerance_m, quantum_m }
    }
}

/// The first run of a study is opaque, the others are transparent.
fn magnified_paint(role: &RunRole, scale: ColorScale) -> Paint {
    match (role, role.color()) {
        (RunRole::InStudy(0, _), Some(color)) => Paint::Plain(color),
        (RunRole::InStudy(..), Some(color)) => {
            let [red, green, blue, _] = color.0.to_array();
            Paint::Plain(Color::from_unmultiplied_rgba(red, green, blue, 0x90))
        }
        _ => Paint::Deviation(scale),
    }
}

/// Robots of a run, each with its TCP path.
struct DrawnRobots {
    flexible: Drawn,
    rigid: Option<Drawn>,
    magnified: Option<Drawn>,
}

impl DrawnRobots {
    fn new(header: &RunHeader, role: &RunRole, scale: ColorScale, stream: &RrdStream) -> Result<Self> {
        let root = role.root(header);
        let alone = matches!(role, RunRole::Alone);
        let Fineness { pixel_m, true_tolerance_m, quantum_m } = Fineness::of(header);
        let way = |who: &str| PathTrack::new(root.join(&path(["path", who])));
        let robot = |name: &str, paint: Paint, bends: bool, tolerance_m: f64, quantum_m: f32| {
            let prefix = match name {
                "rigid" => "rigid/",
                "magnified" => "magnified/",
                _ => "",
            };
            // At true scale bending is hardly visible; a surface for every frame would be wasteful.
            let every_ns = if quantum_m > 0.0 { 10_000_000 } else { 100_000_000 };
            let root = root.join(&path([name]));
            // One frame of each name in a recording.
            let frames = role.is_first().then_some(prefix);
            let appearance = RobotAppearance { root, frames, paint, bends, tolerance_m, every_ns, quantum_m };
            RobotTracks::new(header, appearance, stream)
        };
        let with_magnified = has_magnified(header);
        let flexible = match alone || !with_magnified {
            // Unmagnified deflections with a colour scale are large: modes.
            true if header.has_rigid && !with_magnified && header.color_scale_m > 0.0 => {
                Some(robot("flexible", Paint::Deviation(scale), true, pixel_m, quantum_m)?)
            }
            true => Some(robot("flexible", Paint::Own, true, true_tolerance_m, 0.0)?),
            false => None,
        };
        let rigid = match header.has_rigid && role.is_first() {
            true => Some(robot("rigid", Paint::Ghost, false, 0.0, 0.0)?),
            false => None,
        };
        let magnified = match with_magnified {
            true => Some(robot("magnified", magnified_paint(role, scale), true, pixel_m, quantum_m)?),
            false => None,
        };
        Ok(Self {
            flexible: Drawn { robot: flexible, way: way("flexible"), way_color: None },
            rigid: header.has_rigid.then(|| Drawn {
                robot: rigid,
                way: way("rigid"),
                way_color: Some(colors::rigid()),
            }),
            magnified: with_magnified.then(|| Drawn {
                robot: magnified,
                way: way("magnified"),
                way_color: role.color(),
            }),
        })
    }
}

fn has_magnified(header: &RunHeader) -> bool {
    header.has_rigid && header.magnification > 0.0
}

impl RunTracks {
    /// Creates the tracks of a run; writes its constant data.
    pub(crate) fn new(header: &RunHeader, role: &RunRole, stream: &RrdStream) -> Result<Self> {
        let root = role.root(header);
        let scale = ColorScale { full_m: header.color_scale_m };
        let DrawnRobots { flexible, rigid, magnified } = DrawnRobots::new(header, role, scale, stream)?;
        // The arrow of the error, and the curves: all for the first run, the error for others.
        let arrow = has_magnified(header).then(|| ArrowTrack::new(root.join(&path(["magnified", "error"]))));
        if let Some(arrow) = &arrow {
            arrow.style(stream, role.color().unwrap_or_else(colors::total))?;
        }
        let plots = path(["plots"]);
        let shapes = !header.captions.is_empty();
        let curves = (role.is_first() && !shapes).then(|| Curves::new(header, &plots));
        let study_curves = match role {
            RunRole::InStudy(_, label) if header.has_rigid => {
                Some(Curves::of_study(label, &plots, role.color().unwrap_or_else(|| colors::series(0))))
            }
            _ => None,
        };
        for curves in curves.iter().chain(&study_curves) {
            curves.styles(stream)?;
        }
        Ok(Self {
            root,
            times: Times::default(),
            pose_times: Times::default(),
            flexible,
            rigid,
            magnified,
            magnifier: Magnifier::new(header),
            enlarged: TwinSample::default(),
            arrow,
            scale,
            curves,
            study_curves,
            shapes,
            clock: PoseClock::default(),
            now: None,
            undrawn: None,
            last: Sample::default(),
            peak: None,
        })
    }

    /// Writes the data of the robots that need the first sample: captions, tools, and the position
    /// of the colour scale.
    pub(crate) fn tools(&self, header: &RunHeader, first: &Sample, stream: &RrdStream) -> Result<()> {
        self.captions(header, first, stream)?;
        self.tool_lines(header, first, stream)?;
        let colored = std::iter::once(&self.flexible).chain(&self.magnified).filter_map(|drawn| drawn.robot.as_ref());
        // Mode shapes have an arbitrary scale: their colours are not millimetres.
        let mut colored = colored.filter(|robot| robot.is_colored() && header.captions.is_empty());
        if let (Some(robot), Some(eye)) = (colored.next_back(), eye(header, Some(first))) {
            color_bar(robot.root(), self.scale, &eye, stream)?;
        }
        Ok(())
    }

    fn tool_lines(&self, header: &RunHeader, first: &Sample, stream: &RrdStream) -> Result<()> {
        let Some(link) = header.links.iter().position(|link| link.name == header.tcp) else { return Ok(()) };
        let X_TL = first.flexible.X_WT.inv_mul(&first.flexible.X_WL[link]);
        let drawn = std::iter::once(&self.flexible).chain(&self.rigid).chain(&self.magnified);
        drawn.filter_map(|drawn| drawn.robot.as_ref()).try_for_each(|robot| robot.tool(&X_TL, stream))
    }

    /// Writes the captions, next to the TCP and as a text entity.
    fn captions(&self, header: &RunHeader, first: &Sample, stream: &RrdStream) -> Result<()> {
        for caption in &header.captions {
            let step = (caption.from_s * header.log_rate_hz).round() as i64;
            let when = instant(((caption.from_s * 1e9).round() as i64, step));
            let label = Points3D::new([point(&first.rigid.X_WT)])
                .with_radii([Radius::new_ui_points(2.0)])
                .with_colors([colors::total()])
                .with_labels([caption.text.as_str()])
                .with_show_labels(true);
            // In a map, where poses change with the captions, the scenery labels the places.
            if header.scenery.is_empty() {
                stream.single(&self.root.join(&path(["caption"])), &when, &label)?;
            }
            let text = TextDocument::from_markdown(format!("# {}", caption.text));
            stream.single(&path(["caption"]), &when, &text)?;
        }
        Ok(())
    }

    /// Adds a sample.
    pub(crate) fn push(&mut self, when: Instant, sample: &Sample) {
        self.times.push(when);
        if let Some(curves) = &mut self.curves {
            curves.push_error(sample);
        }
        if let Some(curves) = &mut self.study_curves {
            curves.push_study(sample);
        }
        let error = size(&sample.error_world[..3]);
        let has_error = !self.shapes && self.rigid.is_some();
        let PoseReasons { due, new_peak } = self.clock.take(when.0.unsigned_abs(), sample, has_error);
        if self.magnified.is_some() && (due || new_peak) {
            self.magnifier.magnify(sample, &mut self.enlarged);
        }
        if new_peak {
            let shown = if self.magnified.is_some() { &self.enlarged } else { &sample.flexible };
            self.peak = Some((error, when, point(&shown.X_WT)));
        }
        if due {
            self.pose(when, sample, error);
        }
        self.now = (!due).then_some(when);
        self.undrawn = None;
    }

    /// Keeps the last sample, unless it has been drawn.
    pub(crate) fn keep(&mut self, sample: &Sample) {
        self.undrawn = self.now;
        if self.undrawn.is_some() {
            self.last.clone_from(sample);
        }
    }

    /// Draws the last sample, unless it has been drawn.
    pub(crate) fn close(&mut self) {
        if let Some(when) = self.undrawn.take() {
            let last = std::mem::take(&mut self.last);
            if self.magnified.is_some() {
                self.magnifier.magnify(&last, &mut self.enlarged);
            }
            self.pose(when, &last, size(&last.error_world[..3]));
        }
    }

    fn pose(&mut self, when: Instant, sample: &Sample, error: f64) {
        self.pose_times.push(when);
        if let Some(curves) = &mut self.curves {
            curves.push_causes(sample);
        }
        let put = |drawn: &mut Drawn, twin: &TwinSample| {
            if let Some(robot) = &mut drawn.robot {
                robot.push(when, twin, sample);
            }
            drawn.way.push(&twin.X_WT, error);
        };
        put(&mut self.flexible, &sample.flexible);
        if let Some(rigid) = &mut self.rigid {
            put(rigid, &sample.rigid);
        }
        if let Some(magnified) = &mut self.magnified {
            put(magnified, &self.enlarged);
        }
        if let Some(arrow) = &mut self.arrow {
            let label = if self.curves.is_some() { format!("{:.2} mm", 1e3 * error) } else { String::new() };
            arrow.push(when, &sample.rigid.X_WT, &self.enlarged.X_WT, label);
        }
    }

    /// Returns path, envelope and names of each group of curves.
    pub(crate) fn extents(&self) -> Vec<CurveExtent> {
        let mut extents: Vec<CurveExtent> =
            self.curves.iter().chain(&self.study_curves).flat_map(Curves::extents).collect();
        if let (Some((error, when, _)), Some(_)) = (&self.peak, &self.curves) {
            let names = vec![peak_label(*error, *when).chars().count()];
            extents.push(CurveExtent {
                path: path(["plots", "tcp_error", "peak"]),
                envelope: Envelope::default(),
                names,
            });
        }
        extents
    }

    /// Number of samples whose rows are waiting.
    pub(crate) fn waiting(&self) -> usize {
        self.times.rows()
    }

    /// Writes the waiting rows and clears them.
    pub(crate) fn send(&mut self, stream: &RrdStream) -> Result<()> {
        self.drawn_mut().try_for_each(|track| track.send(stream))?;
        let (times, pose_times) = (self.times.columns(), self.pose_times.columns());
        let mut curves = self.curves.iter_mut().chain(&mut self.study_curves);
        curves.try_for_each(|curves| curves.send(stream, &times, &pose_times))?;
        self.times.clear();
        self.pose_times.clear();
        Ok(())
    }

    /// Writes the rows of tracks that take much memory.
    pub(crate) fn send_large(&mut self, stream: &RrdStream) -> Result<()> {
        self.drawn_mut().filter(|track| track.is_large()).try_for_each(|track| track.send(stream))
    }

    /// Tracks of the robots and of the arrow.
    fn drawn_mut(&mut self) -> impl Iterator<Item = &mut dyn Track> {
        let drawn = std::iter::once(&mut self.flexible).chain(&mut self.rigid).chain(&mut self.magnified);
        let robots = drawn.filter_map(|drawn| drawn.robot.as_mut()).flat_map(RobotTracks::tracks_mut);
        robots.chain(self.arrow.as_mut().map(|arrow| arrow as &mut dyn Track))
    }

    /// Writes the paths of the TCP.
    pub(crate) fn ways(&self, stream: &RrdStream) -> Result<()> {
        if self.shapes {
            return Ok(());
        }
        let mut drawn = std::iter::once(&self.flexible).chain(&self.rigid).chain(&self.magnified);
        drawn.try_for_each(|drawn| match drawn.way_color {
            Some(color) => drawn.way.line(stream, color),
            None => drawn.way.colored(stream, |error| self.scale.color(error)),
        })
    }

    /// Writes the maximum error as a mark on the path and in the plot, and the events.
    pub(crate) fn marks(&self, stream: &RrdStream, result: &RunResult) -> Result<()> {
        if let Some((error, when, place)) = &self.peak {
            let label = peak_label(*error, *when);
            let mark = Points3D::new([*place])
                .with_radii([Radius::new_ui_points(5.0)])
                .with_colors([Color::from_rgb(255, 255, 255)])
                .with_labels([label.as_str()])
                .with_show_labels(false);
            stream.constant(&self.root.join(&path(["path", "peak"])), &mark)?;
            if self.curves.is_some() {
                let at = path(["plots", "tcp_error", "peak"]);
                let style = SeriesPoints::new()
                    .with_names([label.as_str()])
                    .with_colors([Color::from_rgb(255, 255, 255)])
                    .with_marker_sizes([5.0_f32]);
                stream.constant(&at, &style)?;
                stream.single(&at, &instant(*when), &Scalars::single(1e3 * error))?;
            }
        }
        if self.curves.is_some() {
            events(&result.events, stream)?;
        }
        Ok(())
    }
}

/// Writes the events with their times.
fn events(events: &[Event], stream: &RrdStream) -> Result<()> {
    if events.is_empty() {
        return Ok(());
    }
    let level = |event: &Event| match event.kind {
        EventKind::Stopped => "ERROR",
        EventKind::Limit => "WARN",
        EventKind::MoveStart | EventKind::MoveEnd | EventKind::Load | EventKind::Peak | EventKind::Settled => "INFO",
    };
    let times = events.iter().map(|event| (event.time_s * 1e9).round() as i64);
    let texts = TextLog::update_fields()
        .with_many_text(events.iter().map(|event| event.text.as_str()))
        .with_many_level(events.iter().map(level));
    let times = [TimeColumn::new_duration_nanos(SIM_TIME, times)];
    stream.columns(&path(["events"]), times, texts.columns_of_unit_batches()?)
}

fn peak_label(error_m: f64, (nanoseconds, _): Instant) -> String {
    format!("peak {:.3} mm at {:.3} s", 1e3 * error_m, nanoseconds as f64 * 1e-9)
}

/// Writes the colour scale with its numbers, as a vertical bar beside the robot in the initial
/// view.
fn color_bar(root: &EntityPath, scale: ColorScale, eye: &Eye, stream: &RrdStream) -> Result<()> {
    let [foot, head] = eye.beside();
    let at = |share: f64| [0, 1, 2].map(|c| (foot[c] + (head[c] - foot[c]) * share) as f32);
    let steps = ColorScale::STEPS;
    let piece =
        |k: u32| LineStrip3D::from_iter([at(f64::from(k) / f64::from(steps)), at(f64::from(k + 1) / f64::from(steps))]);
    let color = |k: u32| scale.color(scale.full_m * (f64::from(k) + 0.5) / f64::from(steps));
    let bar = LineStrips3D::new((0..steps).map(piece))
        .with_colors((0..steps).map(color))
        .with_radii([Radius::new_ui_points(5.0)]);
    // Round to 1e-4 mm, to hide rounding errors.
    let mm = |share: f64| (1e7 * scale.full_m * share).round() / 1e4;
    let labels = [format!("{}", mm(0.0)), format!("{} mm", mm(0.5)), format!("{} mm off the rigid arm", mm(1.0))];
    let numbers = Points3D::new([0.0, 0.5, 1.0].map(at))
        .with_radii([Radius::new_ui_points(1.0)])
        .with_colors([colors::total()])
        .with_labels(labels.iter().map(String::as_str))
        .with_show_labels(true);
    let place = |what: &str| root.join(&path(["color_scale", what]));
    stream.constant(&place("bar"), &bar)?;
    stream.constant(&place("numbers"), &numbers)
}

fn instant((nanoseconds, step): Instant) -> TimePoint {
    TimePoint::default().with(Timeline::new_duration(SIM_TIME), nanoseconds).with(Timeline::new_sequence("step"), step)
}
