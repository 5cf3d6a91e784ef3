//! Rasterisation of triangles.

/// Tolerance of the weights: a sample belongs to a triangle if none of its weights is below minus
/// this.
const EDGE: f64 = 1e-9;

/// Calls with each sample that a triangle covers: column, row and the barycentric weights of the
/// corners. A weight is 1 at its own corner and 0 on the opposite side. A triangle without area
/// covers nothing.
///
/// * `corners`: column and row in samples, and a depth, which is not used. The centre of the first
///   sample is at (0.5, 0.5).
/// * `size`: columns and rows of the picture.
pub fn cover([a, b, c]: [[f64; 3]; 3], size: [usize; 2], mut call: impl FnMut(usize, usize, [f64; 3])) {
    let (ab, ac) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let whole = ab[0] * ac[1] - ab[1] * ac[0];
    if whole == 0.0 {
        return;
    }
    // Change of the weights per column and per row.
    let (b_slope, c_slope) = ([ac[1] / whole, -ac[0] / whole], [-ab[1] / whole, ab[0] / whole]);
    let per_column = [-b_slope[0] - c_slope[0], b_slope[0], c_slope[0]];
    let weights_at = |x: f64, y: f64| {
        let (x, y) = (x - a[0], y - a[1]);
        let (b, c) = (b_slope[0] * x + b_slope[1] * y, c_slope[0] * x + c_slope[1] * y);
        [1.0 - b - c, b, c]
    };
    let middles = |low: f64, high: f64, count: usize| {
        (low - 0.5).ceil().max(0.0) as usize..((high + 0.5).floor().max(0.0) as usize).min(count)
    };
    for row in middles(a[1].min(b[1]).min(c[1]), a[1].max(b[1]).max(c[1]), size[1]) {
        let y = row as f64 + 0.5;
        // Each side bounds the columns of the row on the left or on the right.
        let (mut low, mut high) = (0.0_f64, size[0] as f64);
        for (weight, slope) in weights_at(0.0, y).into_iter().zip(per_column) {
            let bound = (-EDGE - weight) / slope;
            if slope > 0.0 {
                low = low.max(bound);
            } else if slope < 0.0 {
                high = high.min(bound);
            } else if weight < -EDGE {
                high = -1.0;
            }
        }
        for column in middles(low, high, size[0]) {
            call(column, row, weights_at(column as f64 + 0.5, y));
        }
    }
}
