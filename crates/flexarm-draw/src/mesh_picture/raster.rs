//! Which samples of a picture a triangle covers.

/// A sample belongs to a triangle if none of its weights is below minus this.
const EDGE: f64 = 1e-9;

/// Calls with each sample that a triangle covers: column, row and the weights of the corners. A
/// weight is 1 at its own corner and 0 on the side across. A triangle without area covers nothing.
///
/// * `corners`: column and row in samples, and a depth, which is not used. The middle of the first
///   sample is at (0.5, 0.5).
/// * `size`: columns and rows of the picture.
pub(super) fn cover([a, b, c]: [[f64; 3]; 3], size: [usize; 2], mut call: impl FnMut(usize, usize, [f64; 3])) {
    let range = |k: usize| {
        let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        low.max(0.0) as usize..(high.max(0.0).ceil() as usize).min(size[k])
    };
    let double_area = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
    let whole = double_area(b, c, a[0], a[1]);
    if whole == 0.0 {
        return;
    }
    for row in range(1) {
        for column in range(0) {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| double_area(p, q, x, y) / whole);
            if weights.iter().all(|weight| *weight >= -EDGE) {
                call(column, row, weights);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the weighted corners are the sample; by the theorem of Pick a triangle of area 6 with
    /// 8 samples on its sides has 3 inside.
    #[test]
    fn a_triangle_covers_the_samples_inside_and_on_its_sides_wherever_it_lies() {
        let size = [8, 6];
        let triangles = [
            ([[1.5, 1.5, 0.0], [5.5, 1.5, 0.0], [1.5, 4.5, 0.0]], 11),
            ([[1.5, 4.5, 0.0], [5.5, 1.5, 0.0], [1.5, 1.5, 0.0]], 11),
            ([[-20.0, -20.0, 0.0], [40.0, -20.0, 0.0], [-20.0, 40.0, 0.0]], 48),
            ([[9.0, 1.0, 0.0], [12.0, 1.0, 0.0], [9.0, 5.0, 0.0]], 0),
            ([[-9.0, -1.0, 0.0], [-2.0, -1.0, 0.0], [-9.0, -5.0, 0.0]], 0),
            ([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [3.0, 3.0, 0.0]], 0),
        ];
        for (corners, expected) in triangles {
            let mut count = 0;
            cover(corners, size, |column, row, weights| {
                let mean = [0, 1].map(|k| corners.iter().zip(weights).map(|(p, weight)| weight * p[k]).sum::<f64>());
                assert!(
                    (mean[0] - (column as f64 + 0.5)).abs() < 1e-12 && (mean[1] - (row as f64 + 0.5)).abs() < 1e-12
                );
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12 && column < size[0] && row < size[1]);
                count += 1;
            });
            assert_eq!(count, expected, "{corners:?}");
        }
    }
}
