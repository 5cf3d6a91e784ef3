//! Fatigue over the surface of a link.

use flexarm_analysis::{FatigueCycle, rainflow_repeating};
use nalgebra::DMatrix;

use super::{LinkStress, POLYLINE};
use crate::strength::Strength;

impl LinkStress {
    /// Returns the strength at a seat, if it is known.
    pub(super) fn strength_at(&self, seat: usize) -> Option<Strength> {
        self.strength.or_else(|| Strength::of(&self.fields.materials[self.fields.seats[seat].material]))
    }

    /// Returns the damage of a history of stress (Pa) at a seat; `None` without an S-N curve.
    pub(super) fn damage(&self, seat: usize, history: &[f64]) -> Option<f64> {
        Some(self.strength_at(seat)?.curve()?.damage(&rainflow_repeating(history)).min(1.0))
    }

    /// Returns the seat of the largest damage; `None` without an S-N curve.
    ///
    /// A seat is left out if a bound of its damage is below the damage of another one. The bound: n
    /// samples have n/2 cycles at most, and no cycle is worse than a reversed one whose amplitude is
    /// the peak stress P. A cycle of amplitude a and mean m has `a + m <= P`, so Goodman's
    /// `a/(1 - m/R) <= P` for P below the tensile strength R.
    pub(super) fn most_damaged(&self, amplitudes: &DMatrix<f32>) -> Option<usize> {
        let peaks = self.peaks();
        let largest = self.judged().into_iter().map(|k| peaks[k]).fold(0.0, f32::max);
        let samples = amplitudes.ncols();
        let mut order = self.judged();
        order.sort_by(|a, b| peaks[*b].total_cmp(&peaks[*a]));
        let mut most: Option<(usize, f64)> = None;
        for k in order {
            let Some(curve) = self.strength_at(k).and_then(|strength| strength.curve()) else { continue };
            let peak = f64::from(peaks[k] + POLYLINE * largest);
            let worst = FatigueCycle { range: 2.0 * peak, mean: 0.0, count: 0.5 * samples as f64 };
            let found = most.map_or(0.0, |(_, damage)| damage);
            if most.is_some() && peak < curve.tensile_pa && curve.damage(&[worst]) <= found {
                continue;
            }
            let damage = self.damage(k, &self.signed_history(k, amplitudes)).unwrap_or(0.0);
            if most.is_none() || damage > found {
                most = Some((k, damage));
            }
        }
        most.map(|(k, _)| k)
    }
}
