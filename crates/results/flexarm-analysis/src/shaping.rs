//! Input shapers: superposing a few delayed copies of a motion leaves no residual vibration at a
//! known frequency.
//!
//! ```text
//! q_s(t) = Σ a_i q(t - t_i),   Σ a_i = 1
//! ```
//! Zero vibration (ZV, two copies half a damped period apart), and zero vibration and derivative
//! (ZVD, three copies), which is robust against frequency errors (Singer and Seering 1990). Shapers
//! of several modes are convolved; the best one within a given delay is in `optimal_shaper`.

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
    /// * `hz`: undamped natural frequency; `ratio`: its damping ratio, below 1.
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

    /// Returns the shaper for the modes of both.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let both = self.copies.iter().flat_map(|(t, a)| other.copies.iter().map(move |(s, b)| (t + s, a * b)));
        Self { copies: both.collect() }
    }

    /// Returns the increase of the duration of a motion (s).
    pub fn delay_s(&self) -> f64 {
        self.copies.iter().map(|(t, _)| *t).fold(0.0, f64::max)
    }

    /// Returns the shaped value of a curve at time t.
    pub fn apply(&self, t: f64, mut curve: impl FnMut(f64) -> f64) -> f64 {
        self.copies.iter().map(|(delay, part)| part * curve(t - delay)).sum()
    }

    /// Returns the vibration of a mode after a step, relative to that without the shaper.
    pub fn residual(&self, hz: f64, ratio: f64) -> f64 {
        self.residual_at(hz, ratio, self.delay_s())
    }

    /// The same at a time after the step (s) that is not before the last copy.
    pub fn residual_at(&self, hz: f64, ratio: f64, end_s: f64) -> f64 {
        let (w, wd) = (TAU * hz, TAU * hz * (1.0 - ratio * ratio).sqrt());
        let end = end_s;
        let sum = |f: fn(f64) -> f64| -> f64 {
            self.copies.iter().map(|(t, a)| a * (ratio * w * (t - end)).exp() * f(wd * t)).sum()
        };
        sum(f64::cos).hypot(sum(f64::sin))
    }
}
