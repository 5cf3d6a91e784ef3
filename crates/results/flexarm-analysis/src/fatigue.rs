//! Fatigue: rainflow counting of a stress history, and damage by an S-N curve.

/// Cycle of a history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FatigueCycle {
    /// Maximum minus minimum.
    pub range: f64,
    /// Mean of maximum and minimum.
    pub mean: f64,
    /// 1, or 0.5 for a half cycle.
    pub count: f64,
}

/// Counts the cycles of a history by the rainflow method.
///
/// Cycles that contain the first point are half cycles, and so is what is left at the end.
///
/// # Source
/// ASTM E1049-85, section 5.4.4.
pub fn rainflow(history: &[f64]) -> Vec<FatigueCycle> {
    let mut cycles = Vec::new();
    let mut points: Vec<f64> = Vec::new();
    for point in reversals(history) {
        points.push(point);
        while let [.., a, b, c] = points[..] {
            if (c - b).abs() < (b - a).abs() {
                break;
            }
            let count = if points.len() == 3 { 0.5 } else { 1.0 };
            cycles.push(cycle(a, b, count));
            // A half cycle drops its first point, a whole one both of its points.
            let last = points.len() - 1;
            if count < 1.0 {
                points.remove(0);
            } else {
                points.drain(last - 2..last);
            }
        }
    }
    cycles.extend(points.windows(2).map(|pair| cycle(pair[0], pair[1], 0.5)));
    cycles
}

/// Counts the cycles of a history that repeats without end: the same from its maximum to the next
/// one, so that every cycle is whole.
///
/// # Source
/// ASTM E1049-85, section 5.4.5.
pub fn rainflow_repeating(history: &[f64]) -> Vec<FatigueCycle> {
    let top = (0..history.len()).max_by(|a, b| history[*a].total_cmp(&history[*b]));
    let Some(top) = top else { return Vec::new() };
    let around: Vec<f64> = history[top..].iter().chain(&history[..=top]).copied().collect();
    // From maximum to maximum the half cycles are the two halves of whole ones.
    rainflow(&around)
}

fn cycle(a: f64, b: f64, count: f64) -> FatigueCycle {
    FatigueCycle { range: (a - b).abs(), mean: 0.5 * (a + b), count }
}

/// First point, peaks and valleys, last point.
fn reversals(history: &[f64]) -> Vec<f64> {
    let mut points: Vec<f64> = Vec::new();
    for &next in history {
        match points[..] {
            [.., last] if next == last => {}
            [.., before, last] if (last - before) * (next - last) > 0.0 => {
                points.pop();
                points.push(next);
            }
            _ => points.push(next),
        }
    }
    points
}

/// S-N curve of a material for fully reversed stress, with its tensile strength for the influence of
/// the mean stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnCurve {
    /// Stress amplitude at the knee (Pa).
    pub amplitude_pa: f64,
    /// Number of cycles at the knee.
    pub cycles: f64,
    /// Slope k above the knee: `N = cycles (S/amplitude)^-k`.
    pub slope: f64,
    /// Tensile strength (Pa).
    pub tensile_pa: f64,
}

impl SnCurve {
    /// Returns the damage of cycles of stress (Pa) by the rule of Palmgren and Miner; failure is
    /// expected at 1.
    ///
    /// Tensile mean stress raises the amplitude by `1/(1 - mean/tensile)` (Goodman), compressive
    /// mean stress does not lower it. Below the knee the slope is `2k - 1` (Haibach), so small
    /// cycles count little, but they count.
    ///
    /// # Source
    /// Haibach (2006), *Betriebsfestigkeit*, section 3.2.
    pub fn damage(&self, cycles: &[FatigueCycle]) -> f64 {
        let of_one = |cycle: &FatigueCycle| {
            let room = 1.0 - cycle.mean.max(0.0) / self.tensile_pa;
            if room <= 0.0 {
                return f64::INFINITY;
            }
            let ratio = 0.5 * cycle.range / (room * self.amplitude_pa);
            let slope = if ratio >= 1.0 { self.slope } else { 2.0 * self.slope - 1.0 };
            cycle.count * ratio.powf(slope) / self.cycles
        };
        cycles.iter().map(of_one).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(cycles: &[FatigueCycle]) -> Vec<(f64, f64)> {
        let mut ranges: Vec<f64> = cycles.iter().map(|cycle| cycle.range).collect();
        ranges.sort_by(f64::total_cmp);
        ranges.dedup();
        let count = |range: f64| cycles.iter().filter(|cycle| cycle.range == range).map(|cycle| cycle.count).sum();
        ranges.into_iter().map(|range| (range, count(range))).collect()
    }

    /// Truth: the example of ASTM E1049-85, figure 6.
    #[test]
    fn the_example_of_the_standard_is_counted_as_in_the_standard() {
        let history = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0];
        assert_eq!(counted(&rainflow(&history)), [(3.0, 0.5), (4.0, 1.5), (6.0, 0.5), (8.0, 1.0), (9.0, 0.5)]);
        // Points on the way between reversals change nothing.
        let fine: Vec<f64> = history.windows(2).flat_map(|pair| [pair[0], 0.7 * pair[0] + 0.3 * pair[1]]).collect();
        let fine = [fine, vec![-2.0, -2.0]].concat();
        assert_eq!(counted(&rainflow(&fine)), counted(&rainflow(&history)));
    }

    /// Truth: the example of ASTM E1049-85, figure 7, a repeating history.
    #[test]
    fn a_repeating_history_has_whole_cycles_wherever_it_begins() {
        let history = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0];
        let truth = [(3.0, 1.0), (4.0, 1.0), (7.0, 1.0), (9.0, 1.0)];
        for begin in 0..history.len() {
            let mut history = history;
            history.rotate_left(begin);
            assert_eq!(counted(&rainflow_repeating(&history)), truth, "{begin}");
        }
    }

    /// Truth: closed forms for one amplitude.
    #[test]
    fn damage_of_one_amplitude_is_cycles_over_life() {
        let curve = SnCurve { amplitude_pa: 100e6, cycles: 1e6, slope: 5.0, tensile_pa: 400e6 };
        let one = |range: f64, mean: f64| curve.damage(&[FatigueCycle { range, mean, count: 1.0 }]);
        assert!((one(400e6, 0.0) * 1e6 / 32.0 - 1.0).abs() < 1e-14);
        assert!((one(100e6, 0.0) * 1e6 * 512.0 - 1.0).abs() < 1e-14); // slope 9 below the knee
        assert!((one(200e6, 200e6) * 1e6 / 32.0 - 1.0).abs() < 1e-14); // Goodman doubles the amplitude
        assert_eq!(one(200e6, -200e6), one(200e6, 0.0));
        assert_eq!(one(1.0, 400e6), f64::INFINITY);
        assert_eq!(curve.damage(&rainflow(&[1.0; 5])), 0.0);
    }
}
