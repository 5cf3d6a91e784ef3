//! A run in memory: what reports, overlays and conversions draw from.

use crate::{Event, LogError, RunHeader, RunResult, Sample};

/// A run as columns of scalars, with the sample of the largest error.
///
/// For pictures of a run, not for its numbers: [`crate::Columns`] hold every sample.
///
/// Filled like a recorder, by [`Trace::push`] and [`Trace::finish`]. **Long runs are thinned**: at [`Trace::LIMIT`] rows every
/// second one is dropped and only every second sample is taken from then on, so rows stay evenly spaced.
/// [`Trace::stride`] tells; the sample of the largest error ([`Trace::peak`]) is always kept.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// What stays the same.
    pub header: RunHeader,
    /// Rows, in order of time; one of every [`Trace::stride`] samples.
    pub rows: Vec<TraceRow>,
    /// The sample with the largest TCP error, for pictures.
    pub peak: Sample,
    /// What is known at the end.
    pub result: RunResult,
    stride: u64,
    seen: u64,
    without_curves: bool,
    peak_error: f64,
}

/// Scalars of one instant; the same numbers as in the [`Sample`].
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
    /// Place of the rigid TCP (m).
    pub rigid_m: [f64; 3],
    /// Place of the flexible TCP (m).
    pub flexible_m: [f64; 3],
    /// See [`Sample::contributions`].
    pub contributions: Vec<[f64; 3]>,
    /// Joint positions of the flexible robot (rad or m).
    pub q: Vec<f64>,
    /// Joint velocities of the flexible robot.
    pub qdot: Vec<f64>,
    /// Forces of the drives, flexible robot (N m or N).
    pub effort: Vec<f64>,
    /// Forces of the drives, rigid twin.
    pub rigid_effort: Vec<f64>,
    /// Deflection (m, rad) and load (N, N m) per elastic element.
    pub elastic: Vec<crate::ElasticSample>,
    /// Energies (J).
    pub energy: crate::EnergySample,
}

impl TraceRow {
    /// Size of the TCP error (m).
    #[must_use]
    pub fn error_m(&self) -> f64 {
        size(&self.error_world)
    }
}

fn size(error: &[f64; 6]) -> f64 {
    error[..3].iter().map(|part| part * part).sum::<f64>().sqrt()
}

impl Trace {
    /// Rows at which a run is thinned.
    pub const LIMIT: usize = 100_000;

    /// An empty trace of a run.
    #[must_use]
    pub fn new(header: RunHeader) -> Self {
        Self { header, stride: 1, peak_error: -1.0, ..Self::default() }
    }

    /// An empty trace that keeps no rows, only the sample of the largest error.
    #[must_use]
    pub fn without_curves(header: RunHeader) -> Self {
        Self { without_curves: true, ..Self::new(header) }
    }

    /// Adds one instant.
    pub fn push(&mut self, sample: &Sample) {
        let error = size(&sample.error_world);
        if error > self.peak_error {
            self.peak_error = error;
            self.peak.clone_from(sample);
        }
        if !self.without_curves && self.seen.is_multiple_of(self.stride.max(1)) {
            self.rows.push(TraceRow::from(sample));
        }
        self.seen += 1;
        if self.rows.len() >= Self::LIMIT {
            let mut keep = false;
            self.rows.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride = self.stride.max(1) * 2;
        }
    }

    /// Samples that were pushed, kept or not.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.seen
    }

    /// One of so many samples is kept: 1 for a run that is not thinned, otherwise a power of two.
    #[must_use]
    pub fn stride(&self) -> u64 {
        self.stride.max(1)
    }

    /// Adds what is known at the end.
    pub fn finish(&mut self, result: RunResult) {
        self.result = result;
    }

    /// What happened, in order of time.
    #[must_use]
    pub fn events(&self) -> &[Event] {
        &self.result.events
    }
}

impl From<&Sample> for TraceRow {
    fn from(sample: &Sample) -> Self {
        Self {
            time_s: sample.time_s,
            error_world: sample.error_world,
            error_path: sample.error_path,
            static_m: sample.static_m,
            rigid_m: sample.rigid.X_WT.translation.vector.into(),
            flexible_m: sample.flexible.X_WT.translation.vector.into(),
            contributions: sample.contributions.clone(),
            q: sample.flexible.q.clone(),
            qdot: sample.flexible.qdot.clone(),
            effort: sample.flexible.effort.clone(),
            rigid_effort: sample.rigid.effort.clone(),
            elastic: sample.elastic.clone(),
            energy: sample.energy,
        }
    }
}

/// A source of samples: what a run is, then its instants, then its result. Readers of recordings implement it.
pub trait RunSource {
    /// What stays the same.
    fn header(&self) -> &RunHeader;

    /// What the source cannot know of a run, as sentences.
    fn missing(&self) -> Vec<String> {
        Vec::new()
    }

    /// What a reader should be told, such as a broken end; complete after [`RunSource::replay`].
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// Calls `take` with every instant, in order of time; returns what is known at the end.
    ///
    /// # Errors
    /// [`LogError`] of the source, or the first one that `take` returns.
    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError>;
}
