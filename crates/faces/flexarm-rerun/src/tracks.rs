//! Rows waiting to be written as columns: one track per time-dependent entity.
//!
//! Start at [`Track`]. A track keeps rows until they are worth a chunk, and leaves out rows that
//! repeat the one before. Times in ns of simulated time; poses in the world, single precision (m).
//!
//! Not here: what the rows show (`robot`, `curves`).

use flexarm_kinematics::Pose;
use nalgebra::UnitQuaternion;
use rerun::components::{ImageBuffer, ImageFormat};
use rerun::{
    Arrows3D, Color, EntityPath, LineStrip3D, LineStrips3D, Mesh3D, Quaternion, Radius, Scalars, SeriesLines,
    TimeColumn, Transform3D,
};

use super::plot_range::Envelope;
use super::stream::{Result, RrdStream};

/// Name of the timeline of simulated time.
pub(crate) const SIM_TIME: &str = "sim_time";

/// Time of a sample: simulated time (ns), step.
pub(crate) type Instant = (i64, i64);

/// Times of waiting rows.
#[derive(Debug, Default)]
pub(crate) struct Times {
    nanoseconds: Vec<i64>,
    steps: Vec<i64>,
}

impl Times {
    pub(crate) fn push(&mut self, (nanoseconds, step): Instant) {
        self.nanoseconds.push(nanoseconds);
        self.steps.push(step);
    }

    pub(crate) fn rows(&self) -> usize {
        self.nanoseconds.len()
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    pub(crate) fn columns(&self) -> [TimeColumn; 2] {
        [
            TimeColumn::new_duration_nanos(SIM_TIME, self.nanoseconds.iter().copied()),
            TimeColumn::new_sequence("step", self.steps.iter().copied()),
        ]
    }
}

/// A track with its own times: rows only where something changes.
pub(crate) trait Track {
    /// Whether the waiting rows are large enough for a chunk.
    fn is_large(&self) -> bool {
        false
    }

    /// Writes the waiting rows, if any, and clears them.
    fn send(&mut self, stream: &RrdStream) -> Result<()>;
}

/// A moving frame. Samples at which it has not moved are left out.
#[derive(Debug)]
pub(crate) struct PoseTrack {
    path: EntityPath,
    times: Times,
    translations: Vec<[f32; 3]>,
    quaternions: Vec<Quaternion>,
    last: Option<([f32; 3], [f32; 4])>,
}

impl PoseTrack {
    pub(crate) fn new(path: EntityPath) -> Self {
        let times = Times::default();
        Self { path, times, translations: Vec::new(), quaternions: Vec::new(), last: None }
    }

    pub(crate) fn push(&mut self, when: Instant, X_W: &Pose) {
        let rotation = UnitQuaternion::from_rotation_matrix(&X_W.rotation);
        let row = (point(X_W), rotation.coords.map(|value| value as f32).into());
        if self.last.as_ref() != Some(&row) {
            self.times.push(when);
            self.translations.push(row.0);
            self.quaternions.push(Quaternion::from_xyzw(row.1));
            self.last = Some(row);
        }
    }
}

impl Track for PoseTrack {
    fn send(&mut self, stream: &RrdStream) -> Result<()> {
        if self.times.rows() == 0 {
            return Ok(());
        }
        let transform = Transform3D::update_fields()
            .with_many_translation(self.translations.iter().copied())
            .with_many_quaternion(self.quaternions.iter().copied());
        stream.columns(&self.path, self.times.columns(), transform.columns_of_unit_batches()?)?;
        self.times.clear();
        self.translations = Vec::new();
        self.quaternions = Vec::new();
        Ok(())
    }
}

/// Colours of a surface, as a strip from its proximal to its distal end; rows only where they
/// change.
#[derive(Debug)]
pub(crate) struct TintTrack {
    path: EntityPath,
    times: Times,
    /// Concatenated strips of equal length.
    strips: Vec<u8>,
    last: Vec<u8>,
    next: Vec<u8>,
}

impl TintTrack {
    pub(crate) fn new(path: EntityPath) -> Self {
        Self { path, times: Times::default(), strips: Vec::new(), last: Vec::new(), next: Vec::new() }
    }

    pub(crate) fn push(&mut self, when: Instant, colors: impl IntoIterator<Item = [u8; 3]>) {
        self.next.clear();
        self.next.extend(colors.into_iter().flatten());
        if self.last != self.next {
            self.times.push(when);
            self.strips.extend_from_slice(&self.next);
            std::mem::swap(&mut self.last, &mut self.next);
        }
    }

    /// Image format of a strip of `width` pixels.
    pub(crate) fn format(width: usize) -> ImageFormat {
        ImageFormat::rgb8([width as u32, 1])
    }
}

impl Track for TintTrack {
    fn send(&mut self, stream: &RrdStream) -> Result<()> {
        if self.times.rows() == 0 {
            return Ok(());
        }
        let strips = self.strips.chunks_exact(self.last.len()).map(|strip| ImageBuffer(strip.to_vec().into()));
        let mesh = Mesh3D::update_fields().with_many_albedo_texture_buffer(strips);
        stream.columns(&self.path, self.times.columns(), mesh.columns_of_unit_batches()?)?;
        self.times.clear();
        self.strips = Vec::new();
        Ok(())
    }
}

/// Vertices of a surface that changes its shape.
#[derive(Debug)]
pub(crate) struct ShapeTrack {
    path: EntityPath,
    times: Times,
    corners: usize,
    positions: Vec<[f32; 3]>,
}

impl ShapeTrack {
    pub(crate) fn new(path: EntityPath, corners: usize) -> Self {
        Self { path, times: Times::default(), corners, positions: Vec::new() }
    }

    pub(crate) fn push(&mut self, when: Instant, positions: impl Iterator<Item = [f32; 3]>) {
        self.times.push(when);
        self.positions.extend(positions);
    }
}

impl Track for ShapeTrack {
    fn is_large(&self) -> bool {
        const LARGE: usize = 1 << 20;
        size_of_val(self.positions.as_slice()) > LARGE
    }

    fn send(&mut self, stream: &RrdStream) -> Result<()> {
        let rows = self.times.rows();
        if rows == 0 {
            return Ok(());
        }
        let lengths = std::iter::repeat_n(self.corners, rows);
        let mesh = Mesh3D::update_fields().with_vertex_positions(self.positions.iter().copied());
        stream.columns(&self.path, self.times.columns(), mesh.columns(lengths)?)?;
        self.times.clear();
        self.positions = Vec::new();
        Ok(())
    }
}

/// An arrow with a label.
#[derive(Debug)]
pub(crate) struct ArrowTrack {
    path: EntityPath,
    times: Times,
    arrows: Vec<([f32; 3], [f32; 3])>,
    labels: Vec<String>,
}

impl ArrowTrack {
    pub(crate) fn new(path: EntityPath) -> Self {
        Self { path, times: Times::default(), arrows: Vec::new(), labels: Vec::new() }
    }

    pub(crate) fn push(&mut self, when: Instant, from: &Pose, to: &Pose, label: String) {
        let (from, to) = (point(from), point(to));
        let arrow = (from, [0, 1, 2].map(|c| to[c] - from[c]));
        self.times.push(when);
        self.arrows.push(arrow);
        self.labels.push(label);
    }

    /// Writes colour and width.
    pub(crate) fn style(&self, stream: &RrdStream, color: Color) -> Result<()> {
        let style = Arrows3D::update_fields()
            .with_colors([color])
            .with_radii([Radius::new_ui_points(3.0)])
            .with_show_labels(true);
        stream.constant(&self.path, &style)
    }
}

impl Track for ArrowTrack {
    fn send(&mut self, stream: &RrdStream) -> Result<()> {
        if self.times.rows() == 0 {
            return Ok(());
        }
        let arrows = Arrows3D::update_fields()
            .with_origins(self.arrows.iter().map(|(origin, _)| *origin))
            .with_vectors(self.arrows.iter().map(|(_, vector)| *vector))
            .with_labels(self.labels.iter().map(String::as_str));
        stream.columns(&self.path, self.times.columns(), arrows.columns_of_unit_batches()?)?;
        self.times.clear();
        self.arrows = Vec::new();
        self.labels = Vec::new();
        Ok(())
    }
}

/// Lines from each link to its parent, for robots without meshes.
#[derive(Debug)]
pub(crate) struct SkeletonTrack {
    path: EntityPath,
    times: Times,
    color: Color,
    /// Child and parent of each line.
    pairs: Vec<(usize, usize)>,
    lines: Vec<LineStrip3D>,
}

impl SkeletonTrack {
    /// Line radius (screen points).
    const RADIUS: f32 = 3.0;

    pub(crate) fn new(path: EntityPath, color: Color, pairs: Vec<(usize, usize)>) -> Self {
        Self { path, times: Times::default(), color, pairs, lines: Vec::new() }
    }

    pub(crate) fn push(&mut self, when: Instant, X_WL: &[Pose]) {
        let line =
            |&(child, parent): &(usize, usize)| LineStrip3D::from_iter([point(&X_WL[parent]), point(&X_WL[child])]);
        self.times.push(when);
        self.lines.extend(self.pairs.iter().map(line));
    }

    /// Writes colour and width of the lines.
    pub(crate) fn style(&self, stream: &RrdStream) -> Result<()> {
        let style =
            LineStrips3D::update_fields().with_colors([self.color]).with_radii([Radius::new_ui_points(Self::RADIUS)]);
        stream.constant(&self.path, &style)
    }
}

impl Track for SkeletonTrack {
    fn send(&mut self, stream: &RrdStream) -> Result<()> {
        if self.times.rows() == 0 || self.pairs.is_empty() {
            return Ok(());
        }
        let lengths = std::iter::repeat_n(self.pairs.len(), self.times.rows());
        let lines = LineStrips3D::update_fields().with_strips(self.lines.iter().cloned());
        stream.columns(&self.path, self.times.columns(), lines.columns(lengths)?)?;
        self.times.clear();
        self.lines = Vec::new();
        Ok(())
    }
}

/// Data about curves needed to choose range and legend of a plot.
#[derive(Clone, Debug)]
pub(crate) struct CurveExtent {
    pub(crate) path: EntityPath,
    pub(crate) envelope: Envelope,
    /// Number of letters of each name.
    pub(crate) names: Vec<usize>,
}

/// Curves of one plot, drawn from one entity; all curves share the times of the samples.
#[derive(Debug)]
pub(crate) struct ScalarTrack {
    path: EntityPath,
    names: Vec<String>,
    colors: Vec<Color>,
    values: Vec<f64>,
    envelope: Envelope,
}

impl ScalarTrack {
    pub(crate) fn new(path: EntityPath, names: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let names = names.into_iter().map(Into::into).collect();
        Self { path, names, colors: Vec::new(), values: Vec::new(), envelope: Envelope::default() }
    }

    pub(crate) fn with_colors(self, colors: impl IntoIterator<Item = Color>) -> Self {
        Self { colors: colors.into_iter().collect(), ..self }
    }

    /// Adds a row: one value per name.
    pub(crate) fn push(&mut self, values: impl IntoIterator<Item = f64>) {
        let first = self.values.len();
        self.values.extend(values);
        self.envelope.push(self.values[first..].iter().copied());
        debug_assert!(self.values.len().is_multiple_of(self.names.len().max(1)), "{}: a value per curve", self.path);
    }

    pub(crate) fn extent(&self) -> CurveExtent {
        let names = self.names.iter().map(|name| name.chars().count()).collect();
        CurveExtent { path: self.path.clone(), envelope: self.envelope.clone(), names }
    }

    /// Writes names and colours of the curves.
    pub(crate) fn style(&self, stream: &RrdStream) -> Result<()> {
        let mut lines = SeriesLines::new().with_names(self.names.iter().map(String::as_str));
        if !self.colors.is_empty() {
            lines = lines.with_colors(self.colors.iter().copied());
        }
        stream.constant(&self.path, &lines)
    }

    /// Writes the waiting rows, at these times, and clears them.
    pub(crate) fn send(&mut self, stream: &RrdStream, times: &[TimeColumn]) -> Result<()> {
        if self.values.is_empty() {
            return Ok(());
        }
        let width = self.names.len();
        let lengths = std::iter::repeat_n(width, self.values.len() / width.max(1));
        let values = Scalars::new(std::mem::take(&mut self.values));
        stream.columns(&self.path, times.iter().cloned(), values.columns(lengths)?)
    }
}

/// Path of a point through the whole run, drawn as one line, or in pieces coloured by a value.
#[derive(Debug)]
pub(crate) struct PathTrack {
    path: EntityPath,
    points: Vec<([f32; 3], f64)>,
    /// Number of samples per point.
    stride: u64,
    seen: u64,
}

impl PathTrack {
    /// Number of points at which every second one is removed: finer than a screen shows.
    const LIMIT: usize = 6_000;
    /// Maximum number of pieces with their own colour.
    const PIECES: usize = 300;
    /// Line radius (screen points), independent of the distance.
    const RADIUS: f32 = 1.5;

    pub(crate) fn new(path: EntityPath) -> Self {
        Self { path, points: Vec::new(), stride: 1, seen: 0 }
    }

    pub(crate) fn push(&mut self, X_W: &Pose, value: f64) {
        if self.seen.is_multiple_of(self.stride) {
            self.points.push((point(X_W), value));
        }
        self.seen += 1;
        if self.points.len() >= Self::LIMIT {
            let mut keep = false;
            self.points.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
    }

    /// Writes the whole line in one colour.
    pub(crate) fn line(&self, stream: &RrdStream, color: Color) -> Result<()> {
        let line = LineStrip3D::from_iter(self.points.iter().map(|(point, _)| *point));
        self.strips(stream, [line], [color])
    }

    /// Writes the line in pieces, each coloured by its maximum value.
    pub(crate) fn colored(&self, stream: &RrdStream, color: impl Fn(f64) -> Color) -> Result<()> {
        let size = self.points.len().div_ceil(Self::PIECES).max(1);
        // Adjacent pieces share a point.
        let piece = |k: usize| &self.points[k * size..((k + 1) * size + 1).min(self.points.len())];
        let pieces = (0..self.points.len().div_ceil(size)).map(piece);
        let (lines, colors): (Vec<_>, Vec<_>) = pieces
            .map(|piece| {
                let largest = piece.iter().fold(0.0, |largest: f64, (_, value)| largest.max(*value));
                (LineStrip3D::from_iter(piece.iter().map(|(point, _)| *point)), color(largest))
            })
            .unzip();
        self.strips(stream, lines, colors)
    }

    fn strips(
        &self,
        stream: &RrdStream,
        lines: impl IntoIterator<Item = LineStrip3D>,
        colors: impl IntoIterator<Item = Color>,
    ) -> Result<()> {
        let strips = LineStrips3D::new(lines).with_colors(colors).with_radii([Radius::new_ui_points(Self::RADIUS)]);
        stream.constant(&self.path, &strips)
    }
}

pub(crate) fn point(X_W: &Pose) -> [f32; 3] {
    X_W.translation.vector.map(|value| value as f32).into()
}
