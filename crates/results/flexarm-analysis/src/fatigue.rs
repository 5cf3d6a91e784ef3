//! Fatigue: rainflow counting of a stress history, and damage by an S-N curve.
//!
//! Start at [`rainflow_repeating`] and [`SnCurve::damage`]. Not here: the stress history and the
//! strengths of materials (`flexarm-run`).

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
/// * `history`: successive values, any unit, finite.
///
/// Returns the cycles in the order in which they close. Cycles that contain the first point are
/// half cycles, and so is what is left at the end.
///
/// # Source
/// [ASTM E1049], section 5.4.4.
pub fn rainflow(history: &[f64]) -> Vec<FatigueCycle> {
    let mut cycles = Vec::new();
    let mut points: Vec<f64> = Vec::new();
    for point in reversals(history) {
        points.push(point);
        // The range Y = |b - a| is a cycle once the range X = |c - b| after it is not smaller.
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
/// one, so that every cycle is whole. Amplitude and mean have the unit of the history.
///
/// # Source
/// [ASTM E1049], section 5.4.5.
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

/// S-N curve of a material for fully reversed stress, with its tensile strength for the influence
/// of the mean stress.
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
    /// [Haibach 2006], section 3.2.
    pub fn damage(&self, cycles: &[FatigueCycle]) -> f64 {
        let of_one = |cycle: &FatigueCycle| {
            let reserve = 1.0 - cycle.mean.max(0.0) / self.tensile_pa;
            if reserve <= 0.0 {
                return f64::INFINITY;
            }
            let ratio = 0.5 * cycle.range / (reserve * self.amplitude_pa);
            let slope = if ratio >= 1.0 { self.slope } else { 2.0 * self.slope - 1.0 };
            cycle.count * ratio.powf(slope) / self.cycles
        };
        cycles.iter().map(of_one).sum()
    }
}
