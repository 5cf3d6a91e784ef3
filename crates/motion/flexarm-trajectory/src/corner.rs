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
    let last = q.len() - 1;
    let slope: Vec<f64> = (0..last).map(|i| (q[i + 1] - q[i]) / (t[i + 1] - t[i])).collect();
    let top = slope.iter().fold(0.0, |top: f64, s| top.max(s.abs()));
    // Positions are exact to a few units in the last place.
    let size = q.iter().fold(0.0, |size: f64, q| size.max(q.abs()));
    let rounding = |i: usize| 1e-14 * size / (t[i + 1] - t[i]).min(t[i] - t[i - 1]);
    // Acceleration at inner sample i: change(i) / span(i).
    let span = |i: usize| 0.5 * (t[i + 1] - t[i - 1]);
    let change = |i: usize| slope[i] - slope[i - 1];
    // Largest acceleration around the samples `i..=j`, and the means on the left and on the right;
    // `None` with too few samples nearby.
    let around = |i: usize, j: usize| {
        let (left, right) = (i.saturating_sub(AROUND).max(1)..i, j + 1..last.min(j + 1 + AROUND));
        let enough = left.len() >= LEAST_AROUND && right.len() >= LEAST_AROUND;
        let mean = |range: std::ops::Range<usize>| {
            let n = range.len() as f64;
            range.map(|k| change(k) / span(k)).sum::<f64>() / n
        };
        let most = left.clone().chain(right.clone()).map(|k| change(k).abs() / span(k)).fold(0.0, f64::max);
        enough.then(|| (most, mean(left), mean(right)))
    };
    let stands_out = |jump: f64, i: usize, most: f64| {
        jump.abs() > STANDS_OUT * (most * span(i) + rounding(i)) && jump.abs() > SMALLEST * top
    };

    let resolution = resolution(q);
    // Whether the samples equal a cubic within rounding: then the apparent corner is a rounding
    // step.
    let is_rounding = |i: usize| {
        resolution > 0.0
            && WINDOWS.iter().any(|window| {
                let range = i.saturating_sub(*window)..(i + window + 1).min(q.len());
                distance_from_cubic(&t[range.clone()], &q[range]) < BEYOND_ROUNDING * resolution
            })
    };

    let mut corners = Vec::new();
    let mut i = 1;
    while i < last {
        let between = (i + 1 < last).then(|| around(i, i + 1)).flatten().and_then(|(most, left, right)| {
            let h = t[i + 1] - t[i];
            // Subtracts the curvature on either side, which is not part of the corner.
            let shares = [change(i) - left * span(i), change(i + 1) - right * span(i + 1)];
            let jump = shares[0] + shares[1];
            let fraction = shares[1] / jump;
            let lies_between = (AT_SAMPLE..=1.0 - AT_SAMPLE).contains(&fraction);
            let tau = fraction * h;
            let position = q[i] + (slope[i - 1] + 0.5 * left * (t[i] - t[i - 1])) * tau + 0.5 * left * tau * tau;
            (lies_between && stands_out(jump, i, most)).then_some(Corner { sample: i, fraction, position })
        });
        let at = || {
            let (most, ..) = around(i, i)?;
            stands_out(change(i), i, most).then_some(Corner { sample: i, fraction: 0.0, position: q[i] })
        };
        match between.or_else(at).filter(|corner| !is_rounding(corner.sample)) {
            Some(corner) => {
                corners.push(corner);
                i += 2;
            }
            None => i += 1,
        }
    }
    corners
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
