//! The input shaper that leaves least vibration of several modes within a given delay, their frequencies known to a part.
//!
//! ```text
//! min over a of  max over k of  w_k |r_k|,    r_k = Σ a_i exp(λ_k (Δ - t_i)),    a_i >= 0,  Σ a_i = 1,  0 <= t_i <= Δ
//! ```
//! with modes λ, each at some frequencies of its band. The problem is convex: cones on a grid of times t_i, solved by Newton's method
//! on a logarithmic barrier [Boyd & Vandenberghe 2004, section 11.3] with `-log(t² - w²|r|²)` for each mode and frequency and
//! `-log a_i` for each copy. The grid is then drawn closer about the copies that were found. Parts that are not negative keep the shaped
//! motion within the ranges and below the speeds of the motion itself.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use crate::shaping::Shaper;

/// A mode that a shaper is made against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapedMode {
    /// Natural frequency, undamped (Hz).
    pub hz: f64,
    /// Its damping ratio, below 1.
    pub ratio: f64,
    /// Vibration that it has without the shaper, in the unit of the answer.
    pub vibration: f64,
}

/// A shaper and what it leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct OptimalShaper {
    /// Its copies.
    pub shaper: Shaper,
    /// Largest vibration that it leaves of any mode within its band, in the unit of the modes' vibrations.
    pub left: f64,
}

/// Why there is no such shaper.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShaperError {
    /// A number that makes no sense.
    #[error("{what} is {found}, expected {expected}")]
    Value {
        /// Which.
        what: &'static str,
        /// Found.
        found: f64,
        /// Expected.
        expected: &'static str,
    },
    /// The longest delay in periods of the quickest mode.
    #[error(
        "a delay of {delay_s} s is {periods:.0} periods of the quickest mode, at most {most} are searched: ask for less delay, or for fewer modes"
    )]
    Long {
        /// Asked for (s).
        delay_s: f64,
        /// In periods.
        periods: f64,
        /// Most.
        most: f64,
    },
}

/// Times of the grid in a period of the quickest mode.
const PER_PERIOD: f64 = 24.0;
/// Most periods of the quickest mode in a delay.
const MOST_PERIODS: f64 = 25.0;
/// Frequencies at which the band of a mode is looked at.
const IN_BAND: usize = 21;
/// Widest band.
const WIDEST: f64 = 0.5;
/// Parts below this one are no copies.
const NO_COPY: f64 = 1e-6;
/// How often the grid is drawn closer, how many times each, and so many of the old steps to both sides.
const CLOSER: (usize, i32) = (3, 8);
/// Distance from the least value, over the vibration without a shaper, at which the search ends.
const GAP: f64 = 1e-8;

impl Shaper {
    /// The shaper that leaves least of several modes at a delay after the end of the motion.
    ///
    /// * `delay_s`: of the last copy, at most; `band`: part by which each frequency may be off to either side, such as 0.1.
    ///
    /// # Errors
    /// [`ShaperError`].
    pub fn optimal(modes: &[ShapedMode], delay_s: f64, band: f64) -> Result<OptimalShaper, ShaperError> {
        check(modes, delay_s, band)?;
        let quickest = modes.iter().map(|mode| mode.hz).fold(0.0, f64::max);
        // An even number of steps: halves of the delay are on the grid.
        let half = (0.5 * PER_PERIOD * delay_s * quickest).ceil().max(4.0) as usize;
        let mut step = 0.5 * delay_s / half as f64;
        let mut times: Vec<f64> = (0..=2 * half).map(|k| step * k as f64).collect();
        let size = modes.iter().map(|mode| mode.vibration).fold(0.0, f64::max);
        let mut best: Option<(f64, Shaper)> = None;
        for _ in 0..=CLOSER.0 {
            let (left, parts) = Cones::of(modes, band, delay_s, size, &times).least();
            // Many shapers leave nothing: the one in their middle, as it is.
            let many = left < 10.0 * GAP;
            let shaper = if many {
                Shaper { copies: times.into_iter().zip(parts).collect() }
            } else {
                gathered(&times, &parts, step)
            };
            let around: Vec<f64> = shaper.copies.iter().map(|(t, _)| *t).collect();
            if best.as_ref().is_none_or(|(least, _)| left < *least) {
                best = Some((left, shaper));
            }
            if many {
                break;
            }
            step /= f64::from(CLOSER.1);
            times = around.iter().flat_map(|t| (-CLOSER.1..=CLOSER.1).map(move |k| t + step * f64::from(k))).collect();
            times.retain(|t| *t >= 0.0 && *t <= delay_s);
            times.extend([0.0, delay_s]);
            times.sort_by(f64::total_cmp);
            times.dedup_by(|a, b| (*a - *b).abs() < 0.01 * step);
        }
        let shaper = best.map_or_else(|| Shaper { copies: vec![(0.0, 1.0)] }, |(_, shaper)| shaper.without_nothing());
        let left = |mode: &ShapedMode| {
            let at = |f: f64| mode.vibration * shaper.residual_at(f * mode.hz, mode.ratio, delay_s);
            within(band).into_iter().map(at).fold(0.0, f64::max)
        };
        let left = modes.iter().map(left).fold(0.0, f64::max);
        Ok(OptimalShaper { shaper, left })
    }
}

fn check(modes: &[ShapedMode], delay_s: f64, band: f64) -> Result<(), ShaperError> {
    let wrong = |what, found, expected| Err(ShaperError::Value { what, found, expected });
    if modes.is_empty() {
        return wrong("the number of modes", 0.0, "at least one");
    }
    if !(delay_s > 0.0 && delay_s.is_finite()) {
        return wrong("the delay of the shaper", delay_s, "a positive time (s)");
    }
    if !(0.0..=WIDEST).contains(&band) {
        return wrong("the band of the shaper", band, "a part of the frequency from 0 to 0.5");
    }
    for mode in modes {
        if !(mode.hz > 0.0 && mode.hz.is_finite()) {
            return wrong("a frequency", mode.hz, "a positive one (Hz)");
        }
        if !(0.0..1.0).contains(&mode.ratio) {
            return wrong("a damping ratio", mode.ratio, "from 0 to below 1");
        }
        if !(mode.vibration > 0.0 && mode.vibration.is_finite()) {
            return wrong("the vibration of a mode", mode.vibration, "a positive one");
        }
    }
    let periods = delay_s * modes.iter().map(|mode| mode.hz).fold(0.0, f64::max);
    if periods > MOST_PERIODS {
        return Err(ShaperError::Long { delay_s, periods, most: MOST_PERIODS });
    }
    Ok(())
}

/// Factors on a frequency at which its band is looked at.
pub(crate) fn within(band: f64) -> Vec<f64> {
    if band == 0.0 {
        return vec![1.0];
    }
    (0..IN_BAND).map(|k| 1.0 + band * (2.0 * k as f64 / (IN_BAND - 1) as f64 - 1.0)).collect()
}

/// One copy for each summit of the parts: neighbours on the grid are one that lies between them.
fn gathered(times: &[f64], parts: &[f64], step: f64) -> Shaper {
    let mut copies: Vec<(f64, f64)> = Vec::new();
    let mut falls = false;
    for k in 0..times.len() {
        let apart = k == 0 || times[k] - times[k - 1] > 1.5 * step;
        let rises = k > 0 && parts[k] > parts[k - 1];
        if apart || (falls && rises) {
            copies.push((times[k], parts[k]));
            falls = false;
            continue;
        }
        falls |= !rises;
        if let Some((t, part)) = copies.last_mut() {
            let sum = *part + parts[k];
            *t += (times[k] - *t) * parts[k] / sum;
            *part = sum;
        }
    }
    Shaper { copies }
}

impl Shaper {
    /// Copies without those that are nothing; the rest of the parts goes to the others in proportion.
    fn without_nothing(self) -> Self {
        let kept: Vec<(f64, f64)> = self.copies.into_iter().filter(|(_, part)| *part > NO_COPY).collect();
        let sum: f64 = kept.iter().map(|(_, part)| part).sum();
        Self { copies: kept.into_iter().map(|(t, part)| (t, part / sum)).collect() }
    }
}

/// The problem on a grid: rows of real and imaginary parts of each r_k, over the vibration without a shaper.
struct Cones {
    rows: DMatrix<f64>,
}

/// A point inside all cones, and what the barrier is there.
struct Inside {
    a: DVector<f64>,
    t: f64,
    /// Real and imaginary parts.
    r: DVector<f64>,
}

impl Inside {
    /// `t² - |r_k|²`; none if one is not positive.
    fn slacks(&self) -> Option<DVector<f64>> {
        let slack = |k: usize| self.t * self.t - self.r[2 * k].powi(2) - self.r[2 * k + 1].powi(2);
        let slacks = DVector::from_fn(self.r.len() / 2, |k, _| slack(k));
        (self.t > 0.0 && slacks.iter().chain(&self.a).all(|x| *x > 0.0)).then_some(slacks)
    }

    /// `weight t - Σ log`.
    fn barrier(&self, weight: f64) -> Option<f64> {
        let slacks = self.slacks()?;
        Some(weight * self.t - slacks.iter().chain(&self.a).map(|x| x.ln()).sum::<f64>())
    }
}

impl Cones {
    fn of(modes: &[ShapedMode], band: f64, delay_s: f64, size: f64, times: &[f64]) -> Self {
        let each = modes.iter().flat_map(|mode| within(band).into_iter().map(move |f| (mode, TAU * f * mode.hz)));
        let each: Vec<(&ShapedMode, f64)> = each.collect();
        let mut rows = DMatrix::zeros(2 * each.len(), times.len());
        for (k, (mode, omega)) in each.into_iter().enumerate() {
            let lambda = Complex::new(-mode.ratio * omega, omega * (1.0 - mode.ratio * mode.ratio).sqrt());
            for (i, t) in times.iter().enumerate() {
                let left = (lambda * (delay_s - t)).exp() * (mode.vibration / size);
                (rows[(2 * k, i)], rows[(2 * k + 1, i)]) = (left.re, left.im);
            }
        }
        Self { rows }
    }

    /// The least value and its parts.
    fn least(&self) -> (f64, Vec<f64>) {
        let (cones, n) = (self.rows.nrows() / 2, self.rows.ncols());
        let a = DVector::from_element(n, 1.0 / n as f64);
        let r = &self.rows * &a;
        let mut at = Inside { t: 2.0 * r.amax() + 1.0, a, r };
        let terms = (2 * cones + n) as f64;
        let mut weight = 1.0;
        loop {
            self.centre(&mut at, weight);
            if terms / weight < GAP {
                break;
            }
            weight *= 8.0;
        }
        let left = (0..cones).map(|k| at.r[2 * k].hypot(at.r[2 * k + 1])).fold(0.0, f64::max);
        (left, at.a.as_slice().to_vec())
    }

    /// Newton's method on the barrier at a weight of t, the sum of the parts kept.
    fn centre(&self, at: &mut Inside, weight: f64) {
        for _ in 0..40 {
            let (Some(slacks), Some(here)) = (at.slacks(), at.barrier(weight)) else { return };
            let Some((step, step_t, decrement)) = self.newton(at, &slacks, weight) else { return };
            if decrement < 1e-9 {
                return;
            }
            let moved = &self.rows * &step;
            // Close to the centre a whole step is right, and what it gains is less than rounding.
            let sure = decrement < 0.1;
            let mut part = 1.0;
            let next = loop {
                let trial = Inside { a: &at.a + &step * part, t: at.t + step_t * part, r: &at.r + &moved * part };
                if trial.barrier(weight).is_some_and(|there| sure || there <= here - 0.1 * part * decrement) {
                    break Some(trial);
                }
                part *= 0.5;
                if part < 1e-10 {
                    break None;
                }
            };
            let Some(next) = next else { return };
            let sum = next.a.sum();
            *at = Inside { a: next.a / sum, t: next.t, r: next.r / sum };
        }
    }

    /// Step of the parts and of t, and the square of Newton's decrement. Unknowns are scaled by the point, so that the matrix is
    /// one more than what the cones add.
    fn newton(&self, at: &Inside, slacks: &DVector<f64>, weight: f64) -> Option<(DVector<f64>, f64, f64)> {
        let (n, rows) = (at.a.len(), self.rows.nrows());
        let mut scaled = self.rows.clone();
        scaled.column_iter_mut().zip(&at.a).for_each(|(mut column, a)| column *= *a);
        // Of each cone: s = t² - r², -log s has the gradient 2 (r, -t)/s and the second derivative below.
        let mut by_rows = DMatrix::zeros(rows, n);
        let mut gradient = DVector::from_element(n + 1, -1.0);
        let mut H = DMatrix::identity(n + 1, n + 1);
        let (mut of_t, mut across) = (0.0, DVector::zeros(n));
        gradient[n] = weight * at.t;
        for k in 0..rows / 2 {
            let (s, u, v) = (slacks[k], at.r[2 * k], at.r[2 * k + 1]);
            let (U, V) = (scaled.row(2 * k), scaled.row(2 * k + 1));
            let along = U * u + V * v;
            by_rows.set_row(2 * k, &(U * (2.0 / s) + &along * (4.0 * u / (s * s))));
            by_rows.set_row(2 * k + 1, &(V * (2.0 / s) + &along * (4.0 * v / (s * s))));
            let along = along.transpose();
            gradient.rows_mut(0, n).axpy(2.0 / s, &along, 1.0);
            gradient[n] -= 2.0 * at.t * at.t / s;
            across.axpy(-4.0 * at.t * at.t / (s * s), &along, 1.0);
            of_t += at.t * at.t * (4.0 * at.t * at.t / (s * s) - 2.0 / s);
        }
        let mut block = H.view_mut((0, 0), (n, n));
        block += scaled.tr_mul(&by_rows);
        H.view_mut((0, n), (n, 1)).copy_from(&across);
        H.view_mut((n, 0), (1, n)).copy_from(&across.transpose());
        H[(n, n)] = of_t;
        let H: Cholesky<f64, Dyn> = Cholesky::new(H)?;
        // The sum of the parts stays: Σ a_i d_i = 0.
        let mut kept = DVector::zeros(n + 1);
        kept.rows_mut(0, n).copy_from(&at.a);
        let (free, by_sum) = (H.solve(&gradient), H.solve(&kept));
        let step = &by_sum * (kept.dot(&free) / kept.dot(&by_sum)) - free;
        let decrement = -gradient.dot(&step);
        Some((at.a.component_mul(&step.rows(0, n)), at.t * step[n], decrement))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaping::ShaperKind;

    fn mode(hz: f64, ratio: f64) -> ShapedMode {
        ShapedMode { hz, ratio, vibration: 1.0 }
    }

    /// Truth: Singer and Seering's two copies, the only ones that leave nothing within half a period.
    #[test]
    fn within_half_a_period_the_optimal_shaper_of_one_mode_is_zv() {
        for ratio in [0.0, 0.05, 0.2] {
            let zv = Shaper::new(ShaperKind::Zv, 7.0, ratio);
            let found = Shaper::optimal(&[mode(7.0, ratio)], zv.delay_s(), 0.0).unwrap();
            assert!(found.left < 1e-6, "{:e}", found.left); // 2e-8
            let [(t_0, a_0), .., (t_1, a_1)] = found.shaper.copies[..] else { panic!("{found:?}") };
            let worst = [t_0, a_0 - zv.copies[0].1, t_1 - zv.delay_s(), a_1 - zv.copies[1].1];
            assert!(worst.iter().all(|x| x.abs() < 1e-5), "{worst:?}");
        }
    }

    /// Truth: with less than half a period the least is at both ends, cos(ω Δ/2) of the undamped mode.
    #[test]
    fn within_less_than_half_a_period_what_is_left_is_the_cosine_of_half_the_angle() {
        let (hz, delay) = (5.0, 0.06);
        let found = Shaper::optimal(&[mode(hz, 0.0)], delay, 0.0).unwrap();
        let wanted = (0.5 * TAU * hz * delay).cos();
        assert!((found.left / wanted - 1.0).abs() < 1e-7, "{:e}", found.left / wanted - 1.0); // 1e-8
    }

    /// Truth: the same largest residual of the closed forms within the band.
    #[test]
    fn with_the_delay_of_zv_or_zvd_it_leaves_no_more_than_they() {
        for (kind, band) in [(ShaperKind::Zv, 0.1), (ShaperKind::Zvd, 0.1), (ShaperKind::Zvd, 0.25)] {
            for ratio in [0.0, 0.03, 0.1] {
                let other = Shaper::new(kind, 7.0, ratio);
                let found = Shaper::optimal(&[mode(7.0, ratio)], other.delay_s(), band).unwrap();
                let theirs = within(band).iter().map(|f| other.residual(7.0 * f, ratio)).fold(0.0, f64::max);
                assert!(found.left <= theirs * (1.0 + 1e-6), "{kind:?} {band} {ratio}: {} {theirs}", found.left);
                // With a period and a band there is something to win: zeros beside the frequency.
                if kind == ShaperKind::Zvd {
                    assert!(found.left < 0.6 * theirs, "{band} {ratio}: {} {theirs}", found.left); // 0.50
                }
            }
        }
    }

    /// Truth: what is possible with a delay is possible with a longer one, where undamped modes are concerned.
    #[test]
    fn more_delay_never_leaves_more_of_two_modes() {
        let modes = [
            mode(6.6, 0.0),
            ShapedMode { vibration: 0.6, ..mode(7.4, 0.0) },
            ShapedMode { vibration: 0.1, ..mode(19.0, 0.0) },
        ];
        let delays = [0.03, 0.05, 0.07, 0.08, 0.1, 0.13, 0.16, 0.2];
        let left: Vec<f64> = delays.iter().map(|d| Shaper::optimal(&modes, *d, 0.1).unwrap().left).collect();
        for pair in left.windows(2) {
            assert!(pair[1] <= pair[0] * (1.0 + 1e-5), "{left:?}");
        }
        assert!(left[7] < 0.05, "{left:?}");
        let both = Shaper::new(ShaperKind::Zv, 6.6, 0.0).and(&Shaper::new(ShaperKind::Zv, 7.4, 0.0));
        let found = Shaper::optimal(&modes[..2], both.delay_s(), 0.0).unwrap();
        assert!(found.left < 1e-6 && found.shaper.copies.iter().all(|(_, a)| *a > 0.0), "{found:?}");
    }

    /// Truth: conditions of an optimum (Karush, Kuhn, Tucker) by small moves: no shift of a part to any other time lowers the largest.
    #[test]
    fn no_small_change_of_its_parts_leaves_less() {
        let modes = [mode(6.6, 0.02), ShapedMode { vibration: 0.5, ..mode(11.0, 0.03) }];
        let found = Shaper::optimal(&modes, 0.12, 0.1).unwrap();
        let largest = |shaper: &Shaper| {
            let of = |m: &ShapedMode, f: f64| m.vibration * shaper.residual_at(f * m.hz, m.ratio, 0.12);
            modes.iter().flat_map(|m| within(0.1).into_iter().map(move |f| of(m, f))).fold(0.0, f64::max)
        };
        let least = largest(&found.shaper);
        for (k, _) in found.shaper.copies.iter().enumerate() {
            for i in 0..=60 {
                let mut copies = found.shaper.copies.clone();
                let part = 1e-3_f64.min(copies[k].1);
                copies[k].1 -= part;
                copies.push((0.12 * f64::from(i) / 60.0, part));
                let moved = largest(&Shaper { copies });
                assert!(moved >= least * (1.0 - 1e-4), "{k} {i}: {} of {found:?}", moved / least);
            }
        }
    }

    #[test]
    fn numbers_that_make_no_shaper_are_named() {
        let told = |modes: &[ShapedMode], delay, band| Shaper::optimal(modes, delay, band).unwrap_err().to_string();
        assert!(told(&[], 0.1, 0.1).contains("at least one"));
        assert!(told(&[mode(7.0, 0.0)], -0.1, 0.1).contains("positive time"));
        assert!(told(&[mode(7.0, 0.0)], 0.1, 0.7).contains("from 0 to 0.5"));
        assert!(told(&[mode(7.0, 1.2)], 0.1, 0.1).contains("below 1"));
        assert!(told(&[mode(700.0, 0.1)], 1.0, 0.1).contains("at most 25"));
    }
}
