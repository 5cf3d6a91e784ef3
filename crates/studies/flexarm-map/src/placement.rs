//! Placement of a workpiece: the box of places with the best worst value.
//!
//! Start at [`best_box`]. A cost is smaller for better places, whatever the quantity. Boxes are aligned
//! with the world axes. Not here: costs of poses (`table.rs`), the grid (`region.rs`).

use std::collections::VecDeque;

use serde::Serialize;

use super::region::Grid;
use super::table::MapTable;

/// Best placement of a box.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Placement {
    /// Lower corner of the places covered (m, world).
    pub lower_m: [f64; 3],
    /// Upper corner (m, world).
    pub upper_m: [f64; 3],
    /// Centre (m, world).
    pub centre_m: [f64; 3],
    /// Worst value in the box, of the quantity by which the map compares.
    pub worst: f64,
    /// Number of places of the map in the box, all of them reachable.
    pub points: usize,
}

/// Returns the best place of a workpiece on the grid, if it fits anywhere.
pub(super) fn best_placement(table: &MapTable, grid: &Grid, by: usize, edges: [f64; 3]) -> Option<Placement> {
    // The cost of a place is that of its best row, so that of the worst pose if only that is kept.
    let cost: Vec<f64> = table.best_by_place(by, by, grid).into_iter().map(|(cost, _)| cost).collect();
    let mut found = best_box(grid, &cost, edges)?;
    if table.columns[by].more_is_better {
        found.worst = -found.worst;
    }
    Some(found)
}

/// Finds the box of the given size with the smallest maximum cost; `None` if every box contains an
/// unreachable place.
///
/// * `cost`: per place of the grid; infinite for unreachable places.
/// * `size_m`: edges along x, y and z, rounded up to whole grid spacings.
///
/// Complexity: linear in the number of places, independent of the size (running maxima, axis by
/// axis).
///
/// # Panics
/// Panics without exactly one cost per place.
pub fn best_box(grid: &Grid, cost: &[f64], size_m: [f64; 3]) -> Option<Placement> {
    assert_eq!(cost.len(), grid.places(), "a placement needs a cost per place of its grid");
    // Number of places along each edge, both ends included.
    let window = size_m.map(|edge| (edge / grid.spacing_m - 1e-9).ceil().max(0.0) as usize + 1);
    if (0..3).any(|c| window[c] > grid.count[c]) {
        return None;
    }
    // Maximum over the box that starts at each place, then the start with the smallest one.
    let mut worst = cost.to_vec();
    for (axis, window) in window.iter().enumerate() {
        running_maximum(&mut worst, grid.count, axis, *window);
    }
    let starts = (0..worst.len()).filter(|&k| {
        let index = grid.index(k);
        (0..3).all(|c| index[c] + window[c] <= grid.count[c])
    });
    // An infinite maximum means an unreachable place in every box.
    let best = starts.min_by(|&a, &b| worst[a].total_cmp(&worst[b])).filter(|&k| worst[k].is_finite())?;
    let lower_m = grid.place(best);
    let upper_m = [0, 1, 2].map(|c| lower_m[c] + grid.spacing_m * (window[c] - 1) as f64);
    Some(Placement {
        lower_m,
        upper_m,
        centre_m: [0, 1, 2].map(|c| 0.5 * (lower_m[c] + upper_m[c])),
        worst: worst[best],
        points: window.iter().product(),
    })
}

/// Replaces each value by the maximum over the window that starts at it along an axis.
fn running_maximum(values: &mut [f64], count: [usize; 3], axis: usize, window: usize) {
    let stride = count[..axis].iter().product::<usize>();
    let n = count[axis];
    let mut line = vec![0.0; n];
    let mut falling: VecDeque<usize> = VecDeque::new();
    for start in (0..values.len()).filter(|k| k / stride % n == 0) {
        (0..n).for_each(|k| line[k] = values[start + k * stride]);
        falling.clear();
        // Going backwards, the front of the queue is the maximum within the window.
        for k in (0..n).rev() {
            while falling.back().is_some_and(|&j| line[j] <= line[k]) {
                falling.pop_back();
            }
            falling.push_back(k);
            if falling.front().is_some_and(|&j| j >= k + window) {
                falling.pop_front();
            }
            values[start + k * stride] = falling.front().map_or(f64::INFINITY, |&j| line[j]);
        }
    }
}
