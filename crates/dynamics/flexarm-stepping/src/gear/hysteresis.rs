//! Rate-independent hysteresis of a gear: law, and state of its sliders.

use crate::drive::TorqueCurve;

/// A spring in series with dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slider {
    /// Stiffness of the spring (N m/rad or N/m).
    pub stiffness: f64,
    /// Deflection of the spring at which the friction element slips (rad or m).
    pub reach: f64,
}

/// A gearbox with rate-independent hysteresis: its torque depends on the history of its deflection,
/// equations (2) and (3) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Hysteresis {
    /// Element index of the gearbox spring (single coordinate).
    pub element: usize,
    /// Elastic torque, without friction.
    pub elastic: TorqueCurve,
    /// Sliders in parallel with the elastic spring.
    pub sliders: Vec<Slider>,
}

impl Hysteresis {
    /// Creates sliders that slip one after the other at evenly spaced deflections up to `reach`,
    /// with the total torque `friction`.
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

    /// Returns the curve of first loading from rest.
    pub fn first_loading(&self) -> TorqueCurve {
        self.sliders
            .iter()
            .fold(self.elastic.clone(), |curve, slider| curve.with_slider(slider.stiffness, slider.reach))
    }

    /// Returns the slope for small motions about the deflection `delta`, at which no slider slips.
    pub fn stuck_slope(&self, delta: f64) -> f64 {
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
pub(super) struct SliderState {
    delta: f64,
    s: Vec<f64>,
}

impl SliderState {
    /// Returns the state without deflections.
    pub(super) fn at_rest(law: &Hysteresis) -> Self {
        Self { delta: 0.0, s: vec![0.0; law.sliders.len()] }
    }

    /// Returns the deflections of the sliders with the gear at deflection `delta`.
    pub(super) fn at<'a>(&'a self, law: &'a Hysteresis, delta: f64) -> impl Iterator<Item = (f64, &'a Slider)> + 'a {
        let way = delta - self.delta;
        self.s.iter().zip(&law.sliders).map(move |(s, slider)| ((s + way).clamp(-slider.reach, slider.reach), slider))
    }

    pub(super) fn torque(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| slider.stiffness * s).sum()
    }

    pub(super) fn slope(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| if s.abs() < slider.reach { slider.stiffness } else { 0.0 }).sum()
    }

    pub(super) fn energy(&self, law: &Hysteresis, delta: f64) -> f64 {
        self.at(law, delta).map(|(s, slider)| 0.5 * slider.stiffness * s * s).sum()
    }

    /// Advances the sliders to the deflection `delta`; returns the energy dissipated (J).
    pub(super) fn advance(&mut self, law: &Hysteresis, delta: f64) -> f64 {
        let way = delta - self.delta;
        let mut lost = 0.0;
        for (s, slider) in self.s.iter_mut().zip(&law.sliders) {
            let stuck = *s + way;
            let held = stuck.clamp(-slider.reach, slider.reach);
            lost += slider.stiffness * slider.reach * (stuck - held).abs();
            *s = held;
        }
        self.delta = delta;
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: Rayleigh's parabola at the corners, and the area of Masing's loop `8 ∫ f - 4 A f(A)`
    /// for the first loading curve f, in closed form for piecewise linear curves.
    #[test]
    fn sliders_follow_rayleighs_law_and_lose_the_area_of_masings_loop() {
        let (friction, reach) = (30.0, 2e-4);
        let law = |count: usize| Hysteresis {
            element: 0,
            elastic: TorqueCurve::straight(4e5),
            sliders: Hysteresis::even_sliders(friction, reach, count),
        };
        let eight = law(8);
        let curve = eight.first_loading();
        for k in 0..=8 {
            let x = f64::from(k) / 8.0;
            let truth = 4e5 * x * reach + friction * (2.0 * x - x * x);
            assert!((curve.torque(x * reach) - truth).abs() < 1e-11, "{k} {} {truth}", curve.torque(x * reach));
            assert!((curve.torque(-x * reach) + truth).abs() < 1e-11);
        }
        assert!((curve.stiffest() - (4e5 + 8.0 * 2.0 * friction / (reach * 8.0) * (7.5 / 8.0))).abs() < 1e-6);
        for amplitude in [0.3 * reach, 0.77 * reach, 2.5 * reach] {
            let masing = 8.0 * curve.energy(amplitude) - 4.0 * amplitude * curve.torque(amplitude);
            assert!((eight.loss(amplitude) - masing).abs() < 1e-12, "{amplitude} {masing}");
            // The slider state that follows a closed cycle loses the same energy, after a first
            // loading.
            let mut slipped = SliderState::at_rest(&eight);
            slipped.advance(&eight, amplitude);
            let lost: f64 = [-amplitude, amplitude].iter().map(|d| slipped.advance(&eight, *d)).sum();
            assert!((lost - masing).abs() < 1e-12, "{lost} {masing}");
        }
        // Many sliders: 2/3 κ A³ / reach with κ = 2 friction / reach, Rayleigh's loss for
        // amplitudes below the reach.
        let (many, A) = (law(2000), 0.5 * reach);
        let rayleigh = 2.0 / 3.0 * (2.0 * friction / reach) * A.powi(3) / reach;
        assert!((many.loss(A) / rayleigh - 1.0).abs() < 1e-5, "{}", many.loss(A) / rayleigh);
    }
}
