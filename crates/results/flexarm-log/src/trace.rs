//! A run in memory: the data for reports, overlays and conversions.
//!
//! Start at [`Trace::push`]; a reader of a recording is a [`RunSource`]. SI units, positions and
//! errors of the TCP in world axes.
//! Not here: minimum and maximum of blocks ([`crate::trace_blocks`]), every number of a run
//! ([`crate::Columns`]).

use crate::trace_blocks::{Blocks, CurveQuantity, norm};
use crate::{Event, LogError, RunHeader, RunResult, Sample};

/// A run as columns of scalars, with the sample of the maximum error.
///
/// For plots of a run, not for its exact numbers: [`crate::Columns`] hold every sample.
///
/// Filled like a recorder, by [`Trace::push`] and [`Trace::finish`]. Memory is bounded, independent
/// of the length of the run:
///
/// * **Curves** ([`Trace::curve`]) of more than [`Trace::WHOLE`] samples consist of the minimum and
///   the maximum of each block of [`Trace::samples_per_block`] samples. No peak is lost.
/// * **Rows** of such a run only have the TCP figures and energies (their lists are empty). At
///   [`Trace::LIMIT`] rows every second one is dropped and only every second sample is taken from
///   then on, so that they stay evenly spaced ([`Trace::stride`]). A trace of [`Trace::for_page`]
///   does so at [`Trace::WHOLE`] rows.
/// * The sample of the maximum error ([`Trace::peak`]), and the error of the first
///   [`Trace::BEGINNING`] samples ([`Trace::beginning`]), are always kept.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Data that are constant over the run.
    pub header: RunHeader,
    /// Rows, in order of time; one per [`Trace::stride`] samples.
    pub rows: Vec<TraceRow>,
    /// Sample with the maximum TCP error.
    pub peak: Sample,
    /// Data known at the end.
    pub result: RunResult,
    stride: u64,
    samples: u64,
    without_curves: bool,
    for_page: bool,
    peak_error: f64,
    /// Curves of a long run, and the row buffer that fills them.
    blocks: Blocks,
    row: TraceRow,
    /// Errors of the first samples of a long run.
    beginning: Vec<(f64, [f64; 3])>,
}

/// Scalars of one sample; the same numbers as in [`Sample`].
///
/// The lists of a run of more than [`Trace::WHOLE`] samples are empty.
#[derive(Clone, Debug, Default)]
pub struct TraceRow {
    /// Time (s).
    pub time_s: f64,
    /// See [`Sample::error_world`].
    pub error_world: [f64; 6],
    /// See [`Sample::error_path`].
    pub error_path: [f64; 6],
    /// See [`Sample::static_m`].
    pub static_m: [f64; 3],
    /// Position of the rigid TCP (m).
    pub rigid_m: [f64; 3],
    /// Position of the flexible TCP (m).
    pub flexible_m: [f64; 3],
    /// See [`Sample::contributions`].
    pub contributions: Vec<[f64; 3]>,
    /// See [`Sample::gauges`].
    pub gauges: Vec<f64>,
    /// Joint positions of the flexible robot (rad or m).
    pub q: Vec<f64>,
    /// Joint velocities of the flexible robot (rad/s or m/s).
    pub qdot: Vec<f64>,
    /// Drive efforts of the flexible robot (N m or N).
    pub effort: Vec<f64>,
    /// Drive efforts of the rigid twin (N m or N).
    pub rigid_effort: Vec<f64>,
    /// Deflection (m, rad) and load (N, N m) per elastic element.
    pub elastic: Vec<crate::ElasticSample>,
    /// Energies (J).
    pub energy: crate::EnergySample,
}

impl TraceRow {
    /// Norm of the TCP error (m).
    pub fn error_m(&self) -> f64 {
        norm(&self.error_world[..3])
    }

    /// Copies the numbers of a sample, reusing the memory of the lists.
    fn fill(&mut self, sample: &Sample) {
        self.time_s = sample.time_s;
        self.error_world = sample.error_world;
        self.error_path = sample.error_path;
        self.static_m = sample.static_m;
        self.rigid_m = sample.rigid.X_WT.translation.vector.into();
        self.flexible_m = sample.flexible.X_WT.translation.vector.into();
        self.contributions.clone_from(&sample.contributions);
        self.gauges.clone_from(&sample.gauges);
        self.q.clone_from(&sample.flexible.q);
        self.qdot.clone_from(&sample.flexible.qdot);
        self.effort.clone_from(&sample.flexible.effort);
        self.rigid_effort.clone_from(&sample.rigid.effort);
        self.elastic.clone_from(&sample.elastic);
        self.energy = sample.energy;
    }

    fn without_lists(&self) -> Self {
        let Self { time_s, error_world, error_path, static_m, rigid_m, flexible_m, energy, .. } = *self;
        Self { time_s, error_world, error_path, static_m, rigid_m, flexible_m, energy, ..Self::default() }
    }
}

/// Time and translational error of a row.
fn translation(row: &TraceRow) -> (f64, [f64; 3]) {
    (row.time_s, [0, 1, 2].map(|c| row.error_world[c]))
}

/// Keeps the first of every two entries.
pub(crate) fn halve<T>(list: &mut Vec<T>) {
    let mut keep = false;
    list.retain(|_| {
        keep = !keep;
        keep
    });
}

impl Trace {
    /// Maximum number of samples of a run whose rows and curves are kept in full.
    pub const WHOLE: usize = 1 << 13;
    /// Number of rows at which a run is thinned: ten times the number of points of a plot.
    pub const LIMIT: usize = 1 << 15;
    /// Number of samples of a long run, from its start, whose errors are kept for its spectrum.
    pub const BEGINNING: usize = 100_000;

    /// Creates an empty trace of a run.
    pub fn new(header: RunHeader) -> Self {
        Self { header, stride: 1, peak_error: -1.0, ..Self::default() }
    }

    /// Creates an empty trace that keeps no rows, only the sample of the maximum error.
    pub fn without_curves(header: RunHeader) -> Self {
        Self { without_curves: true, ..Self::new(header) }
    }

    /// Creates an empty trace that keeps few rows of a long run, for a page that shows its curves.
    pub fn for_page(header: RunHeader) -> Self {
        Self { for_page: true, ..Self::new(header) }
    }

    /// Number of rows at which a long run is thinned.
    fn limit(&self) -> usize {
        if self.for_page { Self::WHOLE } else { Self::LIMIT }
    }

    /// Adds a sample.
    pub fn push(&mut self, sample: &Sample) {
        // Sample of the maximum error.
        let error = norm(&sample.error_world[..3]);
        if error > self.peak_error {
            self.peak_error = error;
            self.peak.clone_from(sample);
        }
        self.samples += 1;
        if self.without_curves {
            return;
        }
        // A short run keeps every row.
        if self.blocks.is_empty() && self.rows.len() < Self::WHOLE {
            self.rows.push(TraceRow::from(sample));
            return;
        }
        if self.blocks.is_empty() {
            self.shorten();
        }
        // A long run has blocks for its curves, its first errors, and evenly spaced rows.
        self.row.fill(sample);
        self.blocks.push(&self.row);
        if self.beginning.len() < Self::BEGINNING {
            self.beginning.push(translation(&self.row));
        }
        if (self.samples - 1).is_multiple_of(self.stride.max(1)) {
            self.rows.push(self.row.without_lists());
        }
        if self.rows.len() >= self.limit() {
            halve(&mut self.rows);
            self.stride = self.stride.max(1) * 2;
        }
    }

    /// Switches to the storage of a long run.
    fn shorten(&mut self) {
        let mut rows = Vec::with_capacity(self.limit());
        self.beginning.reserve_exact(Self::BEGINNING);
        // Row by row, so that the blocks reuse the memory freed by the lists.
        for row in std::mem::take(&mut self.rows) {
            self.blocks.push(&row);
            self.beginning.push(translation(&row));
            rows.push(row.without_lists());
        }
        self.rows = rows;
    }

    /// Returns a curve: a value for each row or, in a long run, minimum and maximum of each block.
    /// NaN for quantities that the run lacks.
    pub fn curve(&self, quantity: CurveQuantity) -> Vec<f64> {
        match self.blocks.is_empty() {
            true => self.rows.iter().map(|row| quantity.of(row)).collect(),
            false => self.blocks.values(quantity),
        }
    }

    /// Returns the times of [`Trace::curve`] (s).
    pub fn curve_times(&self) -> Vec<f64> {
        match self.blocks.is_empty() {
            true => self.rows.iter().map(|row| row.time_s).collect(),
            false => self.blocks.times(),
        }
    }

    /// Returns the path length of the rigid TCP at the times of [`Trace::curve`] (m).
    pub fn curve_ways(&self) -> Vec<f64> {
        if !self.blocks.is_empty() {
            return self.blocks.ways();
        }
        let mut length = 0.0;
        let mut last = self.rows.first().map_or([0.0; 3], |row| row.rigid_m);
        let step = |row: &TraceRow| {
            let way: [f64; 3] = std::array::from_fn(|k| row.rigid_m[k] - last[k]);
            last = row.rigid_m;
            length += norm(&way);
            length
        };
        self.rows.iter().map(step).collect()
    }

    /// Number of samples per minimum and maximum of a curve; 1 for a curve with all samples.
    pub fn samples_per_block(&self) -> u64 {
        self.blocks.size().max(1)
    }

    /// Returns time (s) and translational error (m, world axes) of every sample, in a long run of
    /// the first [`Trace::BEGINNING`] samples.
    pub fn beginning(&self) -> Vec<(f64, [f64; 3])> {
        match self.blocks.is_empty() {
            true => self.rows.iter().map(translation).collect(),
            false => self.beginning.clone(),
        }
    }

    /// Number of samples pushed, kept or not.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Number of samples per row: 1 for a run that is not thinned, otherwise a power of two.
    pub fn stride(&self) -> u64 {
        self.stride.max(1)
    }

    /// Adds the data known at the end.
    pub fn finish(&mut self, result: RunResult) {
        self.result = result;
    }

    /// Returns the events, in order of time.
    pub fn events(&self) -> &[Event] {
        &self.result.events
    }
}

impl From<&Sample> for TraceRow {
    fn from(sample: &Sample) -> Self {
        let mut row = Self::default();
        row.fill(sample);
        row
    }
}

/// A source of samples: first the header, then the samples, then the result. Readers of recordings
/// implement it.
pub trait RunSource {
    /// Returns the data that are constant over the run.
    fn header(&self) -> &RunHeader;

    /// Lists, as sentences, the data that the source lacks.
    fn missing(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns warnings, such as a truncated file; complete after [`RunSource::replay`].
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// Calls `take` with every sample, in order of time; returns the data known at the end.
    ///
    /// # Errors
    /// [`LogError`] of the source, or the first one that `take` returns.
    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError>;
}
