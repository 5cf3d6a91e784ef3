//! Fatigue over the surface of a link. Not here: counting of cycles (`flexarm_analysis`).

use flexarm_analysis::{FatigueCycle, rainflow_repeating};
use nalgebra::DMatrix;

use super::{LinkStress, POLYLINE};
use crate::robot::strength::Strength;

impl LinkStress {
    /// Returns the strength at a site, if it is known.
    pub(super) fn strength_at(&self, site: usize) -> Option<Strength> {
        self.strength.or_else(|| Strength::of(&self.fields.materials[self.fields.sites[site].material]))
    }

    /// Returns the damage of a history of stress (Pa) at a site; `None` without an S-N curve.
    pub(super) fn damage(&self, site: usize, history: &[f64]) -> Option<f64> {
        Some(self.strength_at(site)?.curve()?.damage(&rainflow_repeating(history)).min(1.0))
    }

    /// Returns the site of the largest damage; `None` without an S-N curve.
    ///
    /// Sites are tried in the order of a bound of their damage, until the bound is below the damage
    /// found. The bound: n samples have n/2 cycles at most, and with the largest stress P of
    /// positive and Q of negative sign no cycle has a larger amplitude than (P + Q)/2, nor, at this
    /// amplitude, a larger mean than (P - Q)/2; a smaller amplitude with a larger mean is less
    /// harmful.
    pub(super) fn most_damaged(&self, amplitudes: &DMatrix<f32>) -> Option<usize> {
        let sides = self.sides();
        let largest = self.judged().into_iter().map(|k| self.peak(k)).fold(0.0, f32::max);
        let samples = amplitudes.ncols();
        let bound = |k: usize| {
            let [positive, negative] = sides[k].map(|side| f64::from(side + POLYLINE * largest));
            let (range, mean) = (positive + negative, 0.5 * (positive - negative));
            let worst = FatigueCycle { range, mean, count: 0.5 * samples as f64 };
            Some((k, self.strength_at(k)?.curve()?.damage(&[worst])))
        };
        // Exact damage in the order of the bounds.
        let mut bounds: Vec<(usize, f64)> = self.judged().into_iter().filter_map(bound).collect();
        bounds.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut most: Option<(usize, f64)> = None;
        for (k, bound) in bounds {
            if most.is_some_and(|(_, found)| bound <= found) {
                break;
            }
            let damage = self.damage(k, &self.signed_history(k, amplitudes)).unwrap_or(0.0);
            if most.is_none_or(|(_, found)| damage > found) {
                most = Some((k, damage));
            }
        }
        most.map(|(k, _)| k)
    }
}
