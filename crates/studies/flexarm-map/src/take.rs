//! Evaluation of the places of a map on all cores.
//!
//! Start at [`take`]. A thread takes a chunk of places, collects the poses of whole places, and
//! evaluates them together; the rows are joined in the order of the places.
//!
//! Not here: the row of a pose (`evaluate.rs`), inverse kinematics of a place (`finder.rs`).

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use flexarm_kinematics::Pose;
use flexarm_settings::Setting;
use nalgebra::Rotation3;
use rayon::prelude::*;

use super::columns::{Layout, PLACE, cheapest};
use super::evaluate::{Evaluator, PoseLabel};
use super::finder::Finder;
use super::region::{Grid, pose_at};
use super::{KeptPoses, MAX_PLACES, MapError};

/// Number of places per task of a thread.
const CHUNK: usize = 64;
/// Number of waiting poses at which they are evaluated; the poses of one place are never split.
const MAX_WAITING: usize = 256;
/// Number of places whose rows are added up at once.
const BLOCK: usize = 8192;

/// Appends the joint positions of the pose with this number to an empty list.
pub(super) type PoseOf<'a> = dyn Fn(usize, &mut Vec<f64>) + Sync + 'a;

/// Places or poses to evaluate.
pub(super) enum Places<'a> {
    /// TCP positions, each with all directions.
    Grid {
        grid: Grid,
        rotations: &'a [Rotation3<f64>],
        finder: &'a Finder<'a>,
        /// Radius around the vertical line through the first joint within which places are left out
        /// (m).
        keep_out_m: f64,
    },
    /// Joint positions, by number of the pose.
    Joints { count: usize, values: &'a PoseOf<'a> },
}

impl Places<'_> {
    pub(super) fn count(&self) -> usize {
        match self {
            Self::Grid { grid, .. } => grid.places(),
            Self::Joints { count, .. } => *count,
        }
    }
}

/// Results of the evaluation.
#[derive(Default)]
pub(super) struct Evaluation {
    /// Rows in the order of the places.
    pub(super) rows: Vec<f64>,
    /// Number of places done, with or without rows.
    pub(super) done: usize,
    /// Number of places with at least one row.
    pub(super) reachable: usize,
    /// Number of poses tried.
    pub(super) poses: usize,
    /// Number of poses without a result.
    pub(super) failed: usize,
    /// Error of the first of them.
    pub(super) first_failure: Option<String>,
}

impl Evaluation {
    fn add(&mut self, other: Self) {
        self.rows.extend(other.rows);
        self.done += other.done;
        self.reachable += other.reachable;
        self.poses += other.poses;
        self.failed += other.failed;
        self.first_failure = self.first_failure.take().or(other.first_failure);
    }
}

/// Selection of the poses kept at a place.
pub(super) struct Choice<'a> {
    pub(super) layout: &'a Layout,
    pub(super) keep: KeptPoses,
    /// Column by which poses are compared.
    pub(super) by: usize,
}

/// Evaluates all places, or those finished before `go_on` breaks; the rows do not depend on the
/// number of threads.
///
/// # Errors
/// [`MapError::Input`] if the rows do not fit in memory.
pub(super) fn take(
    places: &Places<'_>,
    evaluator: &Evaluator<'_>,
    choice: &Choice<'_>,
    go_on: &mut (dyn FnMut(f64, f64) -> ControlFlow<()> + Send),
) -> Result<Evaluation, MapError> {
    let (all, mut taken) = (places.count(), Evaluation::default());
    let chunk = if evaluator.is_slow() { 1 } else { CHUNK };
    let (go_on, done, stopped) = (Mutex::new(go_on), AtomicUsize::new(0), AtomicBool::new(false));
    let wanted = || {
        // While one thread asks, the others work.
        if let Ok(mut go_on) = go_on.try_lock()
            && !stopped.load(Relaxed)
            && go_on(done.load(Relaxed) as f64, all as f64).is_break()
        {
            stopped.store(true, Relaxed);
        }
        !stopped.load(Relaxed)
    };
    // Blocks of places in order; the chunks of a block go to the threads.
    for first in (0..all).step_by(BLOCK) {
        let last = (first + BLOCK).min(all);
        let chunks: Vec<usize> = (first..last).step_by(chunk).collect();
        let worker = Worker::new(places, evaluator, choice);
        let parts: Vec<Option<Evaluation>> = chunks
            .into_par_iter()
            .map_with(worker, |worker, from| {
                let to = (from + chunk).min(last);
                let part = wanted().then(|| worker.chunk(from, to, &wanted));
                done.fetch_add(to - from, Relaxed);
                part.filter(|_| !stopped.load(Relaxed))
            })
            .collect();
        parts.into_iter().flatten().for_each(|part| taken.add(part));
        if stopped.load(Relaxed) {
            return Ok(taken);
        }
        if taken.rows.len() / choice.layout.width() > MAX_PLACES {
            let message = format!(
                "the map has more than {MAX_PLACES:.0e} poses, the maximum held in memory: keep only the best pose \
                 of each place, or increase {}",
                Setting::GridSpacing
            );
            return Err(MapError::Input(message));
        }
    }
    if let Ok(go_on) = go_on.into_inner() {
        let _ = go_on(all as f64, all as f64);
    }
    Ok(taken)
}

/// State of a thread.
#[derive(Clone)]
struct Worker<'a> {
    places: &'a Places<'a>,
    finder: Option<Finder<'a>>,
    evaluator: Evaluator<'a>,
    choice: &'a Choice<'a>,
    /// Joint positions of the branches of one direction.
    branches: Vec<f64>,
    /// Joint positions of the poses waiting for evaluation, always of whole places, and their
    /// indices.
    waiting: Vec<f64>,
    labels: Vec<PoseLabel>,
    /// Rows of the waiting poses; buffer reused.
    rows: Vec<f64>,
}

impl<'a> Worker<'a> {
    fn new(places: &'a Places<'a>, evaluator: &Evaluator<'a>, choice: &'a Choice<'a>) -> Self {
        let finder = match places {
            Places::Grid { finder, .. } => Some((*finder).clone()),
            Places::Joints { .. } => None,
        };
        let (evaluator, branches, waiting) = (evaluator.clone(), Vec::new(), Vec::new());
        Self { places, finder, evaluator, choice, branches, waiting, labels: Vec::new(), rows: Vec::new() }
    }

    /// Evaluates the places from `from` to before `to`.
    fn chunk(&mut self, from: usize, to: usize, go_on: &dyn Fn() -> bool) -> Evaluation {
        let mut taken = Evaluation { done: to - from, ..Evaluation::default() };
        for place in from..to {
            match self.places {
                Places::Grid { grid, rotations, finder, keep_out_m } => {
                    if finder.distance_from_foot(grid.place(place)) < *keep_out_m {
                        continue;
                    }
                    for (direction, rotation) in rotations.iter().enumerate() {
                        self.poses_at(&pose_at(grid.place(place), rotation), place, direction);
                    }
                }
                Places::Joints { values, .. } => {
                    self.branches.clear();
                    values(place, &mut self.branches);
                    self.waiting.extend(&self.branches);
                    self.labels.push(PoseLabel { place, direction: 0, branch: 0 });
                }
            }
            // Poses are answered in batches, so that memory stays bounded.
            if self.labels.len() >= MAX_WAITING {
                self.answer(&mut taken, go_on);
            }
        }
        self.answer(&mut taken, go_on);
        taken
    }

    /// Adds all branches at a TCP pose to the waiting poses.
    fn poses_at(&mut self, X_WT: &Pose, place: usize, direction: usize) {
        let Some(finder) = &mut self.finder else { return };
        finder.find(X_WT, &mut self.branches);
        let found = self.branches.len() / self.choice.layout.joints;
        self.waiting.extend(&self.branches);
        self.labels.extend((0..found).map(|branch| PoseLabel { place, direction, branch }));
    }

    /// Evaluates all waiting poses, and keeps the selected rows of each place.
    fn answer(&mut self, taken: &mut Evaluation, go_on: &dyn Fn() -> bool) {
        taken.poses += self.labels.len();
        let mut rows = std::mem::take(&mut self.rows);
        self.evaluator.push(&self.waiting, &self.labels, &mut rows, go_on, |error| {
            taken.failed += 1;
            taken.first_failure.get_or_insert_with(|| error.to_string());
        });
        let (width, mut left) = (self.choice.layout.width(), &rows[..]);
        while !left.is_empty() {
            let alike = left.chunks_exact(width).take_while(|row| row[PLACE] == left[PLACE]).count();
            let (place, others) = left.split_at(alike * width);
            taken.reachable += 1;
            self.keep(place, &mut taken.rows);
            left = others;
        }
        rows.clear();
        self.rows = rows;
        self.waiting.clear();
        self.labels.clear();
    }

    /// Appends the selected rows of one place; the first row if none has a finite cost.
    fn keep(&self, all: &[f64], rows: &mut Vec<f64>) {
        let Choice { layout, keep, by } = self.choice;
        let (column, width) = (&layout.columns[*by], layout.width());
        let count = all.len() / width;
        let cost = |row: usize| column.cost(all[row * width + by]);
        let kept = match keep {
            KeptPoses::All => return rows.extend(all),
            KeptPoses::Best => cheapest(count, cost),
            KeptPoses::Worst => cheapest(count, |row| -cost(row)),
        };
        rows.extend(&all[kept.unwrap_or_default() * width..][..width]);
    }
}
