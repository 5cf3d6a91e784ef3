//! Detection of jumps in a load that is only known as a function of time, by bisection.

use flexarm_kinematics::Wrench;

/// Number of intervals that are checked; a jump and its reversal within one of them are not found.
const INTERVALS: u32 = 5000;
/// Relative size of a change below which it does not count as a jump.
const SMALLEST: f64 = 1e-9;
/// Minimum fraction of an interval's change that a jump keeps when the interval is halved.
const KEPT: f64 = 0.1;
/// Number of halvings before the first check; the change of a smooth curve has decayed by then.
const FIRST_CHECK: u32 = 8;

/// Returns the times of jumps between `start` and `end` (s), to machine precision, at most one per
/// interval.
pub(crate) fn jumps_of(wrench: &(dyn Fn(f64) -> Wrench + Send + Sync), start: f64, end: f64) -> Vec<f64> {
    if start >= end {
        return Vec::new();
    }
    // Clamped to the given range.
    let inner = |k: u32| (start + (end - start) * f64::from(k) / f64::from(INTERVALS)).clamp(start, end);
    let change = |a: f64, b: f64| (wrench(b).to_vector() - wrench(a).to_vector()).amax();
    let size = (0..=INTERVALS).map(|k| wrench(inner(k)).to_vector().amax()).fold(0.0, f64::max);
    let jump_in = |k: u32| {
        // Halve towards the larger change: a jump keeps its size, a smooth curve loses half of it.
        let (mut a, mut b) = (inner(k), inner(k + 1));
        let whole = change(a, b);
        if !(whole.is_finite() && whole > SMALLEST * size) {
            return None;
        }
        let mut halvings = 0;
        loop {
            let middle = 0.5 * (a + b);
            if middle <= a || middle >= b {
                break;
            }
            (a, b) = if change(a, middle) >= change(middle, b) { (a, middle) } else { (middle, b) };
            halvings += 1;
            if halvings == FIRST_CHECK && change(a, b) < KEPT * whole {
                return None;
            }
        }
        (change(a, b) > KEPT * whole).then_some(a)
    };
    (0..INTERVALS).filter_map(jump_in).collect()
}
