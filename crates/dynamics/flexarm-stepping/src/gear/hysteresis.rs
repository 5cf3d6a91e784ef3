//! Rate-independent hysteresis of a gear: law, and state of its sliders.
//!
//! (2) and (3) of the module; δ is the deflection of the gear (rad or m), s that of a slider's spring.

use crate::drive::TorqueCurve;

/// A spring in series with dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slider {
    /// Stiffness of the spring (N m/rad or N/m).
    pub stiffness: f64,
    /// Deflection of the spring at which the friction element slips (rad or m).
    pub reach: f64,
}

/// Rate-independent hysteresis of a gearbox: its torque depends on the history of its deflection,
/// equations (2) and (3) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Hysteresis {
    /// Elastic torque, without friction.
    pub elastic: TorqueCurve,
    /// Sliders in parallel with the elastic spring.
    pub sliders: Vec<Slider>,
}

impl Hysteresis {
    /// Creates sliders that slip one after the other at evenly spaced deflections up to `reach`,
    /// with the total torque `friction` (N m over rad, or N over m).
    ///
    /// The first loading curve is a polygon with its corners on the parabola `friction (2 x - x²)`,
    /// `x = δ / reach`, of Rayleigh's law. All arguments are positive.
    pub fn even_sliders(friction: f64, reach: f64, count: usize) -> Vec<Slider> {
        let n = count as f64;
        // The slopes of the polygon decrease from corner to corner by 2 friction / (reach n).
        let slip = |i: usize| reach * (i as f64 + 1.0) / n;
        let each = 2.0 * friction / (reach * n);
        let slope = |i: usize| if i < count { each * (n - i as f64 - 0.5) } else { 0.0 };
        (0..count).map(|i| Slider { stiffness: slope(i) - slope(i + 1), reach: slip(i) }).collect()
    }

    /// Returns the law with its torques multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let sliders = self.sliders.iter().map(|s| Slider { stiffness: factor * s.stiffness, ..*s }).collect();
        Self { elastic: self.elastic.scaled(factor), sliders }
    }

    /// Returns the curve of first loading from rest.
    pub fn first_loading(&self) -> TorqueCurve {
        self.sliders
            .iter()
            .fold(self.elastic.clone(), |curve, slider| curve.with_slider(slider.stiffness, slider.reach))
    }

    /// Returns the slope for small motions about the deflection `delta`, at which no slider slips.
    pub(crate) fn stuck_slope(&self, delta: f64) -> f64 {
        self.elastic.slope(delta) + self.sliders.iter().map(|slider| slider.stiffness).sum::<f64>()
    }

    /// Returns the loss of a closed cycle between `-amplitude` and `amplitude` (J):
    /// `4 Σ k r (amplitude - r)` over the sliders that slip.
    pub fn loss(&self, amplitude: f64) -> f64 {
        self.sliders.iter().map(|s| 4.0 * s.stiffness * s.reach * (amplitude - s.reach).max(0.0)).sum()
    }
}

/// Slider state of one gear at the end of the last step.
#[derive(Clone, Debug)]
pub struct SliderState {
    delta: f64,
    s: Vec<f64>,
}

impl SliderState {
    /// Returns the state without deflections.
    pub fn at_rest(law: &Hysteresis) -> Self {
        Self { delta: 0.0, s: vec![0.0; law.sliders.len()] }
    }

    /// Returns the deflections of the sliders with the gear at deflection `delta`.
    pub(super) fn at<'a>(&'a self, law: &'a Hysteresis, delta: f64) -> impl Iterator<Item = (f64, &'a Slider)> + 'a {
        let way = delta - self.delta;
        self.s.iter().zip(&law.sliders).map(move |(s, slider)| ((s + way).clamp(-slider.reach, slider.reach), slider))
    }

    /// Returns the torque of the sliders (N m or N).
    pub(super) fn torque(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| slider.stiffness * s).sum()
    }

    /// Returns its slope: sliders that slip have none.
    pub(super) fn slope(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| if s.abs() < slider.reach { slider.stiffness } else { 0.0 }).sum()
    }

    /// Returns the energy in the springs of the sliders (J).
    pub(super) fn energy(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| 0.5 * slider.stiffness * s * s).sum()
    }

    /// Advances the sliders to the deflection `delta`; returns the energy dissipated (J).
    pub fn advance(&mut self, law: &Hysteresis, delta: f64) -> f64 {
        let way = delta - self.delta;
        let mut lost = 0.0;
        for (s, slider) in self.s.iter_mut().zip(&law.sliders) {
            let trial = *s + way;
            let limited = trial.clamp(-slider.reach, slider.reach);
            lost += slider.stiffness * slider.reach * (trial - limited).abs();
            *s = limited;
        }
        self.delta = delta;
        lost
    }
}
