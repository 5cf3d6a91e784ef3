//! Markers, which viewers draw without any further file: the links' surfaces, the TCP paths, and
//! the magnified TCP error.
//!
//! A viewer that jumps in time shows the last message of each topic, so data sent at different
//! rates has separate topics: surfaces once, paths every second, the error more often. Start at
//! [`surfaces`] and [`MovingMarkers`]. Not here: encoding of markers ([`super::messages`]).

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::beat::Beat;
use super::bent::BentLink;
use super::frames::{Tree, WORLD, bending_tree, is_magnified, slab_frame};
use super::messages::{Marker, MarkerKind};
use crate::trace::halve;
use crate::{LinkMesh, RunHeader, Sample, TwinSample};

/// Maximum number of triangles of a robot; larger meshes are coarsened.
const MAX_TRIANGLES: usize = 100_000;
/// Maximum number of points of a path; longer paths are thinned.
pub const MAX_POINTS: usize = 1000;
/// Rate of the error markers (per second of simulated time).
const ERROR_HZ: u32 = 20;

const GHOST: [f32; 4] = [0.85, 0.88, 0.92, 0.3];
const MAGNIFIED: [f32; 4] = [0.25, 0.55, 0.95, 0.6];
const RIGID_PATH: [f32; 4] = [0.75, 0.78, 0.82, 1.0];
const FLEXIBLE_PATH: [f32; 4] = [0.95, 0.55, 0.1, 1.0];
const ERROR: [f32; 4] = [0.9, 0.15, 0.15, 1.0];

/// Returns the surfaces of all robots, in the frames of their links.
pub(crate) fn surfaces<'a>(header: &RunHeader, frames: &'a SurfaceFrames) -> Vec<Marker<'a>> {
    // Each mesh has its share of the triangles.
    let total: usize = header.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let share = |mesh: &LinkMesh| (mesh.triangles.len() as f64 / total as f64 * MAX_TRIANGLES as f64) as usize;
    let meshes: Vec<Cow<'_, LinkMesh>> = header.meshes.iter().map(|mesh| thinned(mesh, share(mesh).max(16))).collect();
    // One marker per mesh and robot, or per slab of a bent link.
    let deviates = deviating(header);
    let mut markers = Vec::new();
    for (tree, frames) in &frames.trees {
        let mut id = 0;
        let mut add = |frame: &'a str, color, points: Vec<[f32; 3]>| {
            if !points.is_empty() {
                let (kind, scale) = (MarkerKind::TriangleList, [1.0; 3]);
                markers.push(Marker { points, id, ..marker(frame, tree.name(), kind, scale, color) });
                id += 1;
            }
        };
        for mesh in meshes.iter().filter(|mesh| *tree != Tree::Magnified || deviates[mesh.link]) {
            let color = match tree {
                Tree::Flexible => mesh.color,
                Tree::Rigid => GHOST,
                Tree::Magnified => MAGNIFIED,
            };
            let own = &frames[mesh.link];
            match &own.bent {
                Some((bent, names)) => {
                    let slabs = names.iter().zip(bent.slabs(mesh));
                    slabs.for_each(|(name, points)| add(name, color, points));
                }
                None => add(&own.name, color, corners(mesh)),
            }
        }
    }
    markers
}

/// Links whose pose can differ from that of the rigid twin; the others need no magnified copy,
/// which would coincide with them.
fn deviating(header: &RunHeader) -> Vec<bool> {
    let bends = |name: &String| header.bends.iter().any(|bend| header.links[bend.link].name == *name);
    let drives_give_way = !header.contributors.iter().all(bends);
    let mut deviates: Vec<bool> = Vec::with_capacity(header.links.len());
    for (index, link) in header.links.iter().enumerate() {
        // A base that is not fixed is on an elastic support.
        let stands_free = link.parent.is_none() && !link.fixed;
        let own = stands_free || header.bends.iter().any(|bend| bend.link == index);
        deviates.push(own || link.parent.is_some_and(|parent| deviates[parent] || drives_give_way));
    }
    deviates
}

/// Names of the frames in which surfaces are drawn.
pub(crate) struct SurfaceFrames {
    trees: Vec<(Tree, Vec<LinkFrames>)>,
}

struct LinkFrames {
    name: String,
    /// The link in slabs with their frame names, if it is drawn bent in this tree.
    bent: Option<(BentLink, Vec<String>)>,
}

impl SurfaceFrames {
    pub(crate) fn of(header: &RunHeader) -> Self {
        let mut trees = vec![Tree::Flexible];
        trees.extend(header.has_rigid.then_some(Tree::Rigid));
        trees.extend(is_magnified(header).then_some(Tree::Magnified));
        let links = |tree: Tree| {
            let names = header.links.iter().map(|link| tree.frame(&link.name));
            let mut frames: Vec<LinkFrames> = names.map(|name| LinkFrames { name, bent: None }).collect();
            if bending_tree(header) == Some(tree) {
                for bent in BentLink::all(header) {
                    let frame = &mut frames[bent.link];
                    let slabs = (0..bent.count()).map(|k| slab_frame(&frame.name, k)).collect();
                    frame.bent = Some((bent, slabs));
                }
            }
            frames
        };
        Self { trees: trees.into_iter().map(|tree| (tree, links(tree))).collect() }
    }
}

fn marker<'a>(frame: &'a str, namespace: &'a str, kind: MarkerKind, scale: [f64; 3], color: [f32; 4]) -> Marker<'a> {
    Marker { frame, namespace, id: 0, kind, place: [0.0; 3], scale, color, points: Vec::new(), text: String::new() }
}

fn corners(mesh: &LinkMesh) -> Vec<[f32; 3]> {
    mesh.triangles.iter().flatten().map(|k| mesh.positions[*k as usize]).collect()
}

/// Coarsens a mesh to at most about `most` triangles by merging close corners.
pub fn thinned(mesh: &LinkMesh, most: usize) -> Cow<'_, LinkMesh> {
    if mesh.triangles.len() <= most {
        return Cow::Borrowed(mesh);
    }
    // Corners in the same cell of a grid become one; the grid is made coarser until it suffices.
    let (low, high) = mesh.positions.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(low, high), p| {
        ([0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c])))
    });
    let size = [0, 1, 2].map(|c| high[c] - low[c]).into_iter().fold(0.0, f32::max);
    let mut triangles = mesh.triangles.clone();
    let mut cells = 512.0;
    while triangles.len() > most && cells > 2.0 {
        let mut firsts: BTreeMap<[i32; 3], u32> = BTreeMap::new();
        let keys = mesh.positions.iter().map(|p| [0, 1, 2].map(|c| ((p[c] - low[c]) / size * cells) as i32));
        let merged: Vec<u32> = keys.zip(0..).map(|(key, k)| *firsts.entry(key).or_insert(k)).collect();
        let mut names = BTreeSet::new();
        triangles = mesh.triangles.iter().map(|corners| corners.map(|k| merged[k as usize])).collect();
        triangles.retain(|[a, b, c]| {
            let mut sorted = [*a, *b, *c];
            sorted.sort_unstable();
            a != b && b != c && c != a && names.insert(sorted)
        });
        cells /= 1.25;
    }
    Cow::Owned(LinkMesh { triangles, ..mesh.clone() })
}

/// Path of the TCP so far.
#[derive(Debug)]
pub struct Path {
    points: Vec<[f32; 3]>,
    stride: u64,
    samples: u64,
    last: [f32; 3],
}

impl Default for Path {
    /// Empty path.
    fn default() -> Self {
        Self { points: Vec::new(), stride: 1, samples: 0, last: [0.0; 3] }
    }
}

impl Path {
    /// Adds the TCP of a sample.
    pub fn push(&mut self, twin: &TwinSample) {
        self.last = twin.X_WT.translation.vector.map(|x| x as f32).into();
        if self.samples.is_multiple_of(self.stride) {
            self.points.push(self.last);
        }
        self.samples += 1;
        // The limit includes the last point.
        if self.points.len() >= MAX_POINTS {
            halve(&mut self.points);
            self.stride *= 2;
        }
    }

    /// Points of the path (m), the last sample included.
    pub fn points(&self) -> Vec<[f32; 3]> {
        let mut points = self.points.clone();
        if points.last() != Some(&self.last) {
            points.push(self.last);
        }
        points
    }
}

/// Markers that change during the run.
pub(crate) struct MovingMarkers {
    has_rigid: bool,
    /// Magnification of the error, if any.
    factor: Option<f64>,
    flexible: Path,
    rigid: Path,
    magnified: Path,
    /// Distance from the base to the TCP in the first sample (m); line widths scale with it, so
    /// that they are visible on any robot.
    reach: f64,
    seconds: Beat,
    errors: Beat,
}

impl MovingMarkers {
    pub(crate) fn new(header: &RunHeader) -> Self {
        Self {
            has_rigid: header.has_rigid,
            factor: is_magnified(header).then_some(header.magnification),
            flexible: Path::default(),
            rigid: Path::default(),
            magnified: Path::default(),
            reach: 0.0,
            seconds: Beat::new(1),
            errors: Beat::new(ERROR_HZ),
        }
    }

    /// Adds a sample; returns whether paths and error are due.
    pub(crate) fn advance(
        &mut self,
        since_start_ns: u64,
        sample: &Sample,
        magnified: Option<&TwinSample>,
    ) -> (bool, bool) {
        if self.flexible.samples == 0 {
            let base = sample.flexible.X_WL.first().map_or_else(Default::default, |X| X.translation.vector);
            self.reach = (sample.flexible.X_WT.translation.vector - base).norm();
        }
        self.flexible.push(&sample.flexible);
        if self.has_rigid {
            self.rigid.push(&sample.rigid);
        }
        if let Some(magnified) = magnified {
            self.magnified.push(magnified);
        }
        (self.seconds.due(since_start_ns), self.errors.due(since_start_ns) && self.factor.is_some())
    }

    /// Returns the paths so far.
    pub(crate) fn paths(&self) -> Vec<Marker<'static>> {
        let width = 0.002 * self.reach;
        let line = |namespace, color, path: &Path| {
            let marker = marker(WORLD, namespace, MarkerKind::LineStrip, [width, 0.0, 0.0], color);
            Marker { points: path.points(), ..marker }
        };
        let mut lines = vec![line("path/flexible", FLEXIBLE_PATH, &self.flexible)];
        if self.has_rigid {
            lines.push(line("path/rigid", RIGID_PATH, &self.rigid));
        }
        if self.factor.is_some() {
            lines.push(line("path/magnified", MAGNIFIED, &self.magnified));
        }
        // A line needs two points.
        lines.retain(|line| line.points.len() > 1);
        lines
    }

    /// Returns the magnified error as an arrow from the rigid TCP, with its size as text.
    pub(crate) fn error(&self, sample: &Sample) -> Vec<Marker<'static>> {
        let factor = self.factor.unwrap_or(1.0);
        let from = sample.rigid.X_WT.translation.vector;
        let error = nalgebra::Vector3::from_column_slice(&sample.error_world[..3]);
        let to = from + error * factor;
        let arrow_size = [0.004, 0.01, 0.015].map(|part| part * self.reach);
        let arrow = marker(WORLD, "error", MarkerKind::Arrow, arrow_size, ERROR);
        let height = 0.025 * self.reach;
        let text = marker(WORLD, "error/text", MarkerKind::Text, [0.0, 0.0, height], ERROR);
        vec![
            Marker { points: [from, to].map(|p| p.map(|x| x as f32).into()).to_vec(), ..arrow },
            Marker {
                place: [to.x, to.y, to.z + 2.0 * height].map(|x| f64::from(x as f32)),
                text: format!("{:.3} mm, drawn {factor} times", 1e3 * error.norm()),
                ..text
            },
        ]
    }
}
