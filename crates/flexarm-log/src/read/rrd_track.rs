//! Rows of numbers over time, as close together as they can be: an hour of a run has millions of them.

/// Rows of one width with their times.
#[derive(Debug)]
pub(super) struct Track {
    width: usize,
    /// Nanoseconds; ascending after [`Track::sort`].
    times: Vec<i64>,
    /// Row after row.
    values: Vec<f64>,
}

impl Track {
    pub(super) fn new(width: usize) -> Self {
        Self { width, times: Vec::new(), values: Vec::new() }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn times(&self) -> &[i64] {
        &self.times
    }

    /// Adds a row; one of another width, which only a damaged file has, is left out.
    pub(super) fn push(&mut self, time_ns: i64, row: &[f64]) {
        if row.len() == self.width {
            self.times.push(time_ns);
            self.values.extend_from_slice(row);
        }
    }

    /// Brings the rows in order; of several with one time the last one stays.
    pub(super) fn sort(&mut self) {
        if self.times.is_sorted_by(|a, b| a < b) {
            return;
        }
        let mut order: Vec<usize> = (0..self.times.len()).collect();
        order.sort_by_key(|k| self.times[*k]); // stable
        let of_next = |k: usize| order.get(k + 1).map(|next| self.times[*next]);
        let kept = || (0..order.len()).filter(|k| of_next(*k) != Some(self.times[order[*k]])).map(|k| order[k]);
        let times = kept().map(|k| self.times[k]).collect();
        let values = kept().flat_map(|k| self.row(k)).copied().collect();
        (self.times, self.values) = (times, values);
    }

    pub(super) fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.width..(k + 1) * self.width]
    }

    /// The last row at or before a time.
    pub(super) fn last_until(&self, time_ns: i64) -> Option<usize> {
        self.times.partition_point(|time| *time <= time_ns).checked_sub(1)
    }

    /// The last row at or before a time, and the first one at or after it.
    pub(super) fn around(&self, time_ns: i64) -> (Option<usize>, Option<usize>) {
        let after = self.times.partition_point(|time| *time < time_ns);
        (self.last_until(time_ns), (after < self.times.len()).then_some(after))
    }

    /// The row at a time, or what lies between the two around it; before the first and beyond the last one that.
    pub(super) fn between(&self, time_ns: i64) -> Vec<f64> {
        match self.around(time_ns) {
            (Some(before), Some(after)) if before < after => {
                let (start, end) = (self.times[before], self.times[after]);
                let share = time_ns.saturating_sub(start) as f64 / end.saturating_sub(start) as f64;
                self.row(before).iter().zip(self.row(after)).map(|(a, b)| a + (b - a) * share).collect()
            }
            (before, after) => before.or(after).map_or_else(|| vec![f64::NAN; self.width], |k| self.row(k).to_vec()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_order_and_the_last_of_one_time_counts() {
        let mut track = Track::new(2);
        for (time, row) in [(30, [3.0, 30.0]), (10, [0.0, 0.0]), (20, [2.0, 20.0]), (10, [1.0, 10.0])] {
            track.push(time, &row);
        }
        track.push(40, &[4.0]);
        track.sort();
        assert_eq!(track.times(), [10, 20, 30]);
        assert_eq!(track.between(10), [1.0, 10.0]);
        assert_eq!(track.between(25), [2.5, 25.0]);
        assert_eq!((track.between(0), track.around(0)), (vec![1.0, 10.0], (None, Some(0))));
        assert_eq!((track.between(99), track.last_until(99)), (vec![3.0, 30.0], Some(2)));
    }
}
