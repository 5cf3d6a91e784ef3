//! Input shapers: superposing a few delayed copies of a motion leaves no residual vibration at a
//! known frequency.
//!
//! ```text
//! q_s(t) = Σ a_i q(t - t_i),   Σ a_i = 1
//! ```
//! Zero vibration (ZV, two copies half a damped period apart), and zero vibration and derivative
//! (ZVD, three copies), which is robust against frequency errors [Singer & Seering 1990]. Shapers
//! of several modes are convolved. Not here: the best shaper within a given delay
//! (`optimal_shaper`).

use std::f64::consts::{PI, TAU};

/// Type of input shaper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ShaperKind {
    /// Two copies: the shortest with positive weights.
    #[default]
    Zv,
    /// Three copies: twice as long; a frequency error of 10 % leaves a fortieth of the vibration.
    Zvd,
}

/// Delayed copies of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaper {
    /// Delay (s) and weight of each copy.
    pub copies: Vec<(f64, f64)>,
}

impl Shaper {
    /// Creates a shaper for one mode.
    ///
    /// ```text
    /// K = exp(-ζ π / sqrt(1 - ζ²)),   ZV: weights 1, K,   ZVD: 1, 2K, K²,   each over their sum
    /// ```
    ///
    /// * `hz`: undamped natural frequency (Hz), positive. `ratio`: its damping ratio ζ, below 1.
    ///
    /// # Source
    /// [Singer & Seering 1990].
    pub fn new(kind: ShaperKind, hz: f64, ratio: f64) -> Self {
        let damped = hz * (1.0 - ratio * ratio).sqrt();
        let half = 0.5 / damped;
        let K = (-ratio * PI / (1.0 - ratio * ratio).sqrt()).exp();
        let parts: Vec<f64> = match kind {
            ShaperKind::Zv => vec![1.0, K],
            ShaperKind::Zvd => vec![1.0, 2.0 * K, K * K],
        };
        let sum: f64 = parts.iter().sum();
        Self { copies: parts.iter().enumerate().map(|(k, part)| (half * k as f64, part / sum)).collect() }
    }

    /// Returns the convolution of two shapers, which suppresses the modes of both.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let both = self.copies.iter().flat_map(|(t, a)| other.copies.iter().map(move |(s, b)| (t + s, a * b)));
        Self { copies: both.collect() }
    }

    /// Returns the increase of the duration of a motion (s).
    pub fn delay_s(&self) -> f64 {
        self.copies.iter().map(|(t, _)| *t).fold(0.0, f64::max)
    }

    /// Returns the shaped value `Σ a_i q(t - t_i)` of a curve `q` at time `t` (s).
    pub fn apply(&self, t: f64, mut curve: impl FnMut(f64) -> f64) -> f64 {
        self.copies.iter().map(|(delay, part)| part * curve(t - delay)).sum()
    }

    /// Returns the vibration of a mode after a step, relative to that without the shaper, at the
    /// time of the last copy; arguments as in [`Shaper::new`].
    pub fn residual(&self, hz: f64, ratio: f64) -> f64 {
        self.residual_at(hz, ratio, self.delay_s())
    }

    /// As [`Shaper::residual`], at `end_s` after the step (s), not before the last copy.
    ///
    /// ```text
    /// |Σ a_i exp(λ (end - t_i))|,   λ = -ζ ω + i ω sqrt(1 - ζ²)
    /// ```
    pub fn residual_at(&self, hz: f64, ratio: f64, end_s: f64) -> f64 {
        let (w, wd) = (TAU * hz, TAU * hz * (1.0 - ratio * ratio).sqrt());
        let sum = |f: fn(f64) -> f64| -> f64 {
            self.copies.iter().map(|(t, a)| a * (ratio * w * (t - end_s)).exp() * f(wd * t)).sum()
        };
        sum(f64::cos).hypot(sum(f64::sin))
    }
}
