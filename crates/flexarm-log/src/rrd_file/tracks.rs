//! Rows of samples that wait to be written as columns.

use flexarm_kinematics::Pose;
use nalgebra::UnitQuaternion;
use rerun::log::{Chunk, TimeColumn};
use rerun::{Color, EntityPath, LineStrip3D, LineStrips3D, Quaternion, Scalars, SeriesLines, TimePoint, Transform3D};

use super::stream::{Ids, StreamError};

/// Name of the timeline of simulated time.
pub(crate) const SIM_TIME: &str = "sim_time";

/// Times of the waiting rows.
#[derive(Debug, Default)]
pub(crate) struct Times {
    nanoseconds: Vec<i64>,
    steps: Vec<i64>,
}

impl Times {
    pub(crate) fn push(&mut self, nanoseconds: i64, step: i64) {
        self.nanoseconds.push(nanoseconds);
        self.steps.push(step);
    }

    pub(crate) fn rows(&self) -> usize {
        self.nanoseconds.len()
    }

    pub(crate) fn clear(&mut self) {
        self.nanoseconds.clear();
        self.steps.clear();
    }

    pub(crate) fn columns(&self) -> [TimeColumn; 2] {
        [
            TimeColumn::new_duration_nanos(SIM_TIME, self.nanoseconds.iter().copied()),
            TimeColumn::new_sequence("step", self.steps.iter().copied()),
        ]
    }
}

/// A moving frame.
#[derive(Debug)]
pub(crate) struct PoseTrack {
    path: EntityPath,
    translations: Vec<[f32; 3]>,
    quaternions: Vec<Quaternion>,
}

impl PoseTrack {
    pub(crate) fn new(path: EntityPath) -> Self {
        Self { path, translations: Vec::new(), quaternions: Vec::new() }
    }

    pub(crate) fn push(&mut self, X_W: &Pose) {
        let rotation = UnitQuaternion::from_rotation_matrix(&X_W.rotation);
        self.translations.push(point(X_W));
        self.quaternions.push(Quaternion::from_xyzw(rotation.coords.map(|value| value as f32).into()));
    }

    pub(crate) fn clear(&mut self) {
        self.translations.clear();
        self.quaternions.clear();
    }

    pub(crate) fn chunk(&self, ids: &mut Ids, times: &[TimeColumn]) -> Result<Chunk, StreamError> {
        let transform = Transform3D::update_fields()
            .with_many_translation(self.translations.iter().copied())
            .with_many_quaternion(self.quaternions.iter().copied());
        ids.columns(&self.path, times, transform.columns_of_unit_batches()?)
    }
}

/// Curves of one plot, drawn from one entity.
#[derive(Debug)]
pub(crate) struct ScalarTrack {
    path: EntityPath,
    names: Vec<String>,
    colors: Vec<Color>,
    values: Vec<f64>,
}

impl ScalarTrack {
    pub(crate) fn new(path: EntityPath, names: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let names = names.into_iter().map(Into::into).collect();
        Self { path, names, colors: Vec::new(), values: Vec::new() }
    }

    pub(crate) fn with_colors(self, colors: impl IntoIterator<Item = Color>) -> Self {
        Self { colors: colors.into_iter().collect(), ..self }
    }

    /// Adds a row: one value per name.
    pub(crate) fn push(&mut self, values: &[f64]) {
        debug_assert_eq!(values.len(), self.names.len(), "{}: a value per curve", self.path);
        self.values.extend_from_slice(values);
    }

    pub(crate) fn clear(&mut self) {
        self.values.clear();
    }

    /// Names and colours of the curves.
    pub(crate) fn style(&self, ids: &mut Ids) -> Result<Chunk, StreamError> {
        let mut lines = SeriesLines::new().with_names(self.names.iter().map(String::as_str));
        if !self.colors.is_empty() {
            lines = lines.with_colors(self.colors.iter().copied());
        }
        ids.single(&self.path, &TimePoint::default(), &lines)
    }

    pub(crate) fn chunk(&self, ids: &mut Ids, times: &[TimeColumn]) -> Result<Chunk, StreamError> {
        let width = self.names.len();
        let lengths = std::iter::repeat_n(width, self.values.len() / width.max(1));
        ids.columns(&self.path, times, Scalars::new(self.values.iter().copied()).columns(lengths)?)
    }
}

/// The way of a point through the whole run, drawn as one line.
#[derive(Debug)]
pub(crate) struct PathTrack {
    path: EntityPath,
    color: Color,
    points: Vec<[f32; 3]>,
    /// Only every so many samples become a point.
    stride: u64,
    seen: u64,
}

impl PathTrack {
    /// Points at which the line is thinned out to half of them: finer than a screen shows.
    const LIMIT: usize = 20_000;
    /// Line width in points of the screen, whatever the distance.
    const RADIUS: f32 = 1.5;

    pub(crate) fn new(path: EntityPath, color: Color) -> Self {
        Self { path, color, points: Vec::new(), stride: 1, seen: 0 }
    }

    pub(crate) fn push(&mut self, X_W: &Pose) {
        if self.seen.is_multiple_of(self.stride) {
            self.points.push(point(X_W));
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

    pub(crate) fn chunk(&self, ids: &mut Ids) -> Result<Chunk, StreamError> {
        let line = LineStrips3D::new([LineStrip3D::from_iter(self.points.iter().copied())])
            .with_colors([self.color])
            .with_radii([rerun::Radius::new_ui_points(Self::RADIUS)]);
        ids.single(&self.path, &TimePoint::default(), &line)
    }
}

/// Lines from each link to its parent, for robots without meshes.
#[derive(Debug)]
pub(crate) struct SkeletonTrack {
    path: EntityPath,
    color: Color,
    /// Child and parent of each line.
    pairs: Vec<(usize, usize)>,
    lines: Vec<LineStrip3D>,
}

impl SkeletonTrack {
    /// Line width in points of the screen.
    const RADIUS: f32 = 3.0;

    pub(crate) fn new(path: EntityPath, color: Color, pairs: Vec<(usize, usize)>) -> Self {
        Self { path, color, pairs, lines: Vec::new() }
    }

    pub(crate) fn push(&mut self, X_WL: &[Pose]) {
        let line =
            |&(child, parent): &(usize, usize)| LineStrip3D::from_iter([point(&X_WL[parent]), point(&X_WL[child])]);
        self.lines.extend(self.pairs.iter().map(line));
    }

    pub(crate) fn clear(&mut self) {
        self.lines.clear();
    }

    /// Colour and width of the lines.
    pub(crate) fn style(&self, ids: &mut Ids) -> Result<Chunk, StreamError> {
        let style = LineStrips3D::update_fields()
            .with_colors([self.color])
            .with_radii([rerun::Radius::new_ui_points(Self::RADIUS)]);
        ids.single(&self.path, &TimePoint::default(), &style)
    }

    pub(crate) fn chunk(&self, ids: &mut Ids, times: &[TimeColumn]) -> Result<Chunk, StreamError> {
        let lengths = std::iter::repeat_n(self.pairs.len(), self.lines.len() / self.pairs.len().max(1));
        let lines = LineStrips3D::update_fields().with_strips(self.lines.iter().cloned());
        ids.columns(&self.path, times, lines.columns(lengths)?)
    }
}

fn point(X_W: &Pose) -> [f32; 3] {
    X_W.translation.vector.map(|value| value as f32).into()
}
