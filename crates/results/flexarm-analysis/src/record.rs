//! Input of the metrics, as a whole or sample by sample, and its consistency check.
//!
//! World axes, SI units. Not here: what is computed from it (`metrics`, `long_record`).

/// A record of the TCP error: one entry per sample, with uniform or varying steps.
#[derive(Debug, Clone, Copy)]
pub struct ErrorRecord<'a> {
    /// Times in s, strictly increasing.
    pub times: &'a [f64],
    /// TCP errors from [`crate::tcp_error`]: translation in m, rotation vector in rad, in world
    /// axes.
    pub errors: &'a [[f64; 6]],
    /// Positions of the rigid TCP in the world, m; they define the path axes.
    pub rigid_positions: &'a [[f64; 3]],
    /// Static TCP translation at the pose of each sample, m, if known: the final value of every
    /// hold, and the trend that is removed before the dominant frequency is determined.
    pub quasi_static: Option<&'a [[f64; 3]]>,
    /// Start and end of each move, s, ascending; between them the joints hold.
    pub moves: &'a [(f64, f64)],
}

/// One sample: see the fields of [`ErrorRecord`].
#[derive(Debug, Clone, Copy)]
pub struct ErrorSample {
    /// Time, s.
    pub time_s: f64,
    /// Translation (m) and rotation vector (rad), world axes.
    pub error: [f64; 6],
    /// Translation along the path axes, m.
    pub path_error: [f64; 3],
    /// Position of the rigid TCP, m.
    pub rigid_position: [f64; 3],
    /// Static part of the translation, m; NaN if unknown.
    pub static_m: [f64; 3],
}

/// Reason why a record has no metrics.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// No samples.
    #[error("the record has no samples; log at least one")]
    Empty,
    /// A slice whose length differs from that of `times`.
    #[error("`{what}` has {found} entries; expected {expected}, one for each of `times`")]
    Length {
        /// Field of [`ErrorRecord`].
        what: &'static str,
        /// Its length.
        found: usize,
        /// Length of `times`.
        expected: usize,
    },
    /// A NaN or infinite value: the run has diverged or the record is damaged.
    #[error("`{what}` has a NaN or infinite value at sample {index}: did the run diverge?")]
    NotFinite {
        /// Field of [`ErrorRecord`].
        what: &'static str,
        /// Index of the sample.
        index: usize,
    },
    /// Times that do not increase.
    #[error("sample {index}: time {this} s does not follow {previous} s; times must increase")]
    TimeNotIncreasing {
        /// Index of the offending sample.
        index: usize,
        /// Time of the previous sample, s.
        previous: f64,
        /// Its time, s.
        this: f64,
    },
    /// A move that ends before it starts, or starts before the previous one ends.
    #[error("move {index} from {start} s to {end} s; moves must be finite, ascending and disjoint")]
    BadMove {
        /// Index of the move.
        index: usize,
        /// Its start, s.
        start: f64,
        /// Its end, s.
        end: f64,
    },
    /// A settling band that is not a positive number.
    #[error("the settling band is {found} m; expected a positive number")]
    BadBand {
        /// Given band, m.
        found: f64,
    },
}

impl ErrorRecord<'_> {
    /// Checks lengths, order and numbers.
    ///
    /// # Errors
    /// The first error found, as [`RecordError`].
    pub fn check(&self) -> Result<(), RecordError> {
        let n = self.times.len();
        if n == 0 {
            return Err(RecordError::Empty);
        }
        let lengths = [
            ("errors", self.errors.len()),
            ("rigid_positions", self.rigid_positions.len()),
            ("quasi_static", self.quasi_static.map_or(n, <[_]>::len)),
        ];
        if let Some(&(what, found)) = lengths.iter().find(|(_, found)| *found != n) {
            return Err(RecordError::Length { what, found, expected: n });
        }

        finite("times", self.times.iter().map(std::slice::from_ref))?;
        finite("errors", self.errors.iter().map(<[f64; 6]>::as_slice))?;
        finite("rigid_positions", self.rigid_positions.iter().map(<[f64; 3]>::as_slice))?;
        finite("quasi_static", self.quasi_static.unwrap_or_default().iter().map(<[f64; 3]>::as_slice))?;
        if let Some(index) = (1..n).find(|&i| self.times[i] <= self.times[i - 1]) {
            let (previous, this) = (self.times[index - 1], self.times[index]);
            return Err(RecordError::TimeNotIncreasing { index, previous, this });
        }
        // Moves follow each other without overlap.
        let mut last_end = f64::NEG_INFINITY;
        for (index, &(start, end)) in self.moves.iter().enumerate() {
            if !(start.is_finite() && end.is_finite() && last_end <= start && start <= end) {
                return Err(RecordError::BadMove { index, start, end });
            }
            last_end = end;
        }
        Ok(())
    }
}

fn finite<'a>(what: &'static str, mut rows: impl Iterator<Item = &'a [f64]>) -> Result<(), RecordError> {
    match rows.position(|row| row.iter().any(|value| !value.is_finite())) {
        Some(index) => Err(RecordError::NotFinite { what, index }),
        None => Ok(()),
    }
}
