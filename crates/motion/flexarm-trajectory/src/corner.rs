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
const LEAST_AROUND: usize = 2;
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
pub(crate) struct Corner {
    pub(crate) sample: usize,
    /// Fraction of the interval to the next sample, 0 to 1; 0 is at the sample.
    pub(crate) fraction: f64,
    /// Position at the corner.
    pub(crate) position: f64,
}

/// Returns the corners of positions q at times t, in ascending order.
pub(crate) fn corners(t: &[f64], q: &[f64]) -> Vec<Corner> {
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
        if left.len() < LEAST_AROUND || right.len() < LEAST_AROUND {
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
        self.resolution > 0.0
            && WINDOWS.iter().any(|window| {
                let range = i.saturating_sub(*window)..(i + window + 1).min(self.q.len());
                distance_from_cubic(&self.t[range.clone()], &self.q[range]) < BEYOND_ROUNDING * self.resolution
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
fn resolution(q: &[f64]) -> f64 {
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

/// Largest distance of samples from their least-squares cubic.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn found(n: usize, h: f64, f: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let t: Vec<f64> = (0..=n).map(|k| h * k as f64).collect();
        let q: Vec<f64> = t.iter().map(|t| f(*t)).collect();
        corners(&t, &q).iter().map(|c| (h * (c.sample as f64 + c.fraction), c.position)).collect()
    }

    /// Truth: two parabolas that meet in a corner, at a sample or between two samples.
    #[test]
    fn a_corner_is_found_where_it_is() {
        for corner in [0.5, 0.5002, 0.5007, 0.50049] {
            let f = |t: f64| {
                let s = t - corner;
                if s < 0.0 { 2.0 * s + 3.0 * s * s } else { -s - 2.0 * s * s }
            };
            let found = found(1000, 1e-3, f);
            assert_eq!(found.len(), 1, "{corner}: {found:?}");
            // measured 1.3e-7 s, 2.5e-7
            assert!((found[0].0 - corner).abs() < 2e-6 && found[0].1.abs() < 2e-6, "{corner}: {found:?}");
        }
    }

    /// Truth: a path back and forth, in a table whose last digit is as large as the motion per
    /// sample.
    #[test]
    fn corners_of_rounded_data_are_found() {
        for step in [1e-3, 1e-4, 1e-6] {
            let f = |t: f64| ((0.3 - (t - 0.3).abs()) / step).round() * step;
            let found = found(600, 1e-3, f);
            assert!(found.len() == 1 && (found[0].0 - 0.3).abs() < 1e-3, "{step:e}: {found:?}");
            // From rest to one step per sample.
            let f = |t: f64| ((t - 0.3).max(0.0) / step).round() * step;
            let found = self::found(600, 1e-3, f);
            assert!(found.len() == 1 && (found[0].0 - 0.3).abs() < 1e-3, "{step:e}: {found:?}");
        }
    }

    /// No corner is found in jumps of the acceleration, fast curvature, coarse data, rounding to
    /// five digits or noise.
    #[test]
    fn smooth_and_rough_data_have_no_corners() {
        let trapezoid = |t: f64| if t < 0.3 { 5.0 * t * t } else { 0.45 + 3.0 * (t - 0.3) };
        let mut noise = 12345u64;
        let mut random = || {
            noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (noise >> 33) as f64 / 2f64.powi(31) - 0.5
        };
        let rough: Vec<f64> = (0..20_000).map(|_| 1e-4 * random()).collect();
        assert_eq!(found(1000, 1e-3, trapezoid), []);
        assert_eq!(found(1000, 1e-3, |t| (200.0 * t).sin()), []);
        assert_eq!(found(20, 0.05, |t| (20.0 * t).sin()), []);
        assert_eq!(found(1000, 1e-3, |t| (1e5 * (2.0 * t).sin()).round() * 1e-5), []);
        assert_eq!(found(1000, 1e-3, |t| (1e5 * 0.123 * t).round() * 1e-5), []);
        for step in [1e-3, 2e-4, 1e-5, 3e-6, 1e-7, 2.0 * std::f64::consts::PI / 2f64.powi(19)] {
            for speed in [0.1, 0.5, 2.0, 5.0] {
                let rounded = |t: f64| ((speed * t).sin() / step).round() * step;
                assert_eq!(found(3000, 1e-3, rounded), [], "{speed} rad/s in steps of {step:e} rad");
            }
        }
        assert_eq!(found(19_999, 1e-3, |t| t + rough[(t * 1e3).round() as usize]), []);
        assert_eq!(found(8, 1.0, |t| [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, 0.0][t as usize]), []);
        assert_eq!(found(500, 2e-3, |_| 1.7), []);
    }
}
