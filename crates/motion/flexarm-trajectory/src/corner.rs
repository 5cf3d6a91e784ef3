//! Corners of sampled positions: velocity jumps between samples, as distinct from curvature.
//!
//! Between samples the position has slopes s, which change at a sample by `d_i = s_i - s_(i-1)`. In
//! smooth data neighbouring changes are similar; noise and rounding change sign from sample to
//! sample. A corner is isolated: at a sample it appears in one d, between two samples in two d of
//! the same sign, whose ratio gives its place.
//!
//! Start at [`corners`]. Not here: how a spline treats corners, and velocities given in a file.

/// Ratio of a corner's change of slope to the largest one around it, at least.
const STANDS_OUT: f64 = 10.0;
/// Number of changes of slope considered on either side, and minimum number required.
const AROUND: usize = 4;
const MIN_AROUND: usize = 2;
/// Smaller jumps are left to the spline; fraction of the top speed.
const SMALLEST: f64 = 1e-4;
/// Numbers of samples on either side of a corner, over which rounded data must differ from a smooth
/// curve by more than `BEYOND_ROUNDING` rounding steps. Rounding alone leaves half a step; a corner
/// of one step per sample leaves 3/32 of the window, 1.1 steps over the shorter one.
const WINDOWS: [usize; 2] = [16, 12];
const BEYOND_ROUNDING: f64 = 1.0;
/// A corner within this fraction of the interval from a sample is placed at the sample.
const AT_SAMPLE: f64 = 0.01;

/// Corner at sample `sample` or between it and the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Index of the sample.
    pub sample: usize,
    /// Fraction of the interval to the next sample, 0 to 1; 0 is at the sample.
    pub fraction: f64,
    /// Position at the corner.
    pub position: f64,
}

/// Returns the corners of positions q (rad or m) at times t (s), in ascending order.
pub fn corners(t: &[f64], q: &[f64]) -> Vec<Corner> {
    let samples = Samples::new(t, q);
    let mut corners = Vec::new();
    let mut i = 1;
    while i < samples.last {
        let corner = samples.corner_between(i).or_else(|| samples.corner_at(i));
        match corner.filter(|corner| !samples.is_rounding(corner.sample)) {
            Some(corner) => {
                corners.push(corner);
                i += 2;
            }
            None => i += 1,
        }
    }
    corners
}

/// Samples with the slopes between them.
struct Samples<'a> {
    t: &'a [f64],
    q: &'a [f64],
    /// Index of the last sample.
    last: usize,
    slope: Vec<f64>,
    top_speed: f64,
    /// Maximum absolute position.
    size: f64,
    resolution: f64,
}

impl<'a> Samples<'a> {
    fn new(t: &'a [f64], q: &'a [f64]) -> Self {
        let last = q.len() - 1;
        let slope: Vec<f64> = (0..last).map(|i| (q[i + 1] - q[i]) / (t[i + 1] - t[i])).collect();
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        Self { t, q, last, top_speed: largest(&slope), slope, size: largest(q), resolution: resolution(q) }
    }

    /// Acceleration at inner sample i: change(i) / span(i).
    fn span(&self, i: usize) -> f64 {
        0.5 * (self.t[i + 1] - self.t[i - 1])
    }

    fn change(&self, i: usize) -> f64 {
        self.slope[i] - self.slope[i - 1]
    }

    /// Maximum acceleration around the samples `i..=j`, and the means on the left and on the right;
    /// `None` with too few samples nearby.
    fn around(&self, i: usize, j: usize) -> Option<(f64, f64, f64)> {
        let (left, right) = (i.saturating_sub(AROUND).max(1)..i, j + 1..self.last.min(j + 1 + AROUND));
        if left.len() < MIN_AROUND || right.len() < MIN_AROUND {
            return None;
        }
        let acceleration = |k: usize| self.change(k) / self.span(k);
        let mean = |range: std::ops::Range<usize>| {
            let n = range.len() as f64;
            range.map(acceleration).sum::<f64>() / n
        };
        let most = left.clone().chain(right.clone()).map(|k| acceleration(k).abs()).fold(0.0, f64::max);
        Some((most, mean(left), mean(right)))
    }

    fn stands_out(&self, jump: f64, i: usize, most: f64) -> bool {
        // Positions are exact to a few units in the last place.
        let rounding = 1e-14 * self.size / (self.t[i + 1] - self.t[i]).min(self.t[i] - self.t[i - 1]);
        jump.abs() > STANDS_OUT * (most * self.span(i) + rounding) && jump.abs() > SMALLEST * self.top_speed
    }

    /// Whether the samples around i equal a cubic within rounding: then the apparent corner is a
    /// rounding step.
    fn is_rounding(&self, i: usize) -> bool {
        WINDOWS.iter().any(|window| {
            let range = i.saturating_sub(*window)..(i + window + 1).min(self.q.len());
            let (t, q) = (&self.t[range.clone()], &self.q[range]);
            // Numbers of a fixed count of significant digits have a step that depends on their size.
            let step = self.resolution.max(resolution(q));
            step > 0.0 && distance_from_cubic(t, q) < BEYOND_ROUNDING * step
        })
    }

    fn corner_at(&self, i: usize) -> Option<Corner> {
        let (most, ..) = self.around(i, i)?;
        self.stands_out(self.change(i), i, most).then_some(Corner { sample: i, fraction: 0.0, position: self.q[i] })
    }

    /// Corner between sample i and the next one.
    fn corner_between(&self, i: usize) -> Option<Corner> {
        if i + 1 >= self.last {
            return None;
        }
        let (t, q) = (self.t, self.q);
        let (most, left, right) = self.around(i, i + 1)?;
        // Subtracts the curvature on either side, which is not part of the corner.
        let shares = [self.change(i) - left * self.span(i), self.change(i + 1) - right * self.span(i + 1)];
        let jump = shares[0] + shares[1];
        let fraction = shares[1] / jump;
        let lies_between = (AT_SAMPLE..=1.0 - AT_SAMPLE).contains(&fraction);
        let tau = fraction * (t[i + 1] - t[i]);
        let position = q[i] + (self.slope[i - 1] + 0.5 * left * (t[i] - t[i - 1])) * tau + 0.5 * left * tau * tau;
        (lies_between && self.stands_out(jump, i, most)).then_some(Corner { sample: i, fraction, position })
    }
}

/// Resolution of positions that are multiples of a step plus an offset: decimals of a table, counts
/// of an encoder. 0 if there is no significant one.
pub(crate) fn resolution(q: &[f64]) -> f64 {
    let differences = || q.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let least = 1e-5 * differences().fold(0.0, f64::max);
    // Euclid's algorithm; remainders within `least` of zero or of a full multiple count as zero.
    let divisor = |mut a: f64, mut b: f64| {
        while b > least {
            let rest = a % b;
            (a, b) = (b, if b - rest < least { 0.0 } else { rest });
        }
        a
    };
    let mut step = 0.0_f64;
    for difference in differences() {
        step = divisor(step.max(difference), step.min(difference));
        if difference > 0.0 && step < 10.0 * least {
            return 0.0;
        }
    }
    step
}

/// Maximum distance of samples from their least-squares cubic.
fn distance_from_cubic(t: &[f64], q: &[f64]) -> f64 {
    let (first, last) = (t[0], t[t.len() - 1]);
    let x: Vec<f64> = t.iter().map(|t| 2.0 * (t - first) / (last - first) - 1.0).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut rest = q.to_vec();
    // 1, x, x² and x³, orthogonalised one after the other (Gram-Schmidt).
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for power in 0..4 {
        let mut column: Vec<f64> = x.iter().map(|x| x.powi(power)).collect();
        for before in &basis {
            let part = dot(&column, before) / dot(before, before);
            column.iter_mut().zip(before).for_each(|(x, b)| *x -= part * b);
        }
        let part = dot(&rest, &column) / dot(&column, &column);
        rest.iter_mut().zip(&column).for_each(|(q, c)| *q -= part * c);
        basis.push(column);
    }
    rest.iter().fold(0.0, |most: f64, q| most.max(q.abs()))
}
