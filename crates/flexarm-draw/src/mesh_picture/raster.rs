//! Which triangle is nearest to the viewer at each sample of a picture.

use std::ops::Range;

/// A sample belongs to a triangle if none of its weights is below minus this.
const EDGE: f64 = 1e-9;

/// A number that is linear on the picture: at the first sample, per column, per row.
#[derive(Clone, Copy, Debug, Default)]
struct Linear([f64; 3]);

impl Linear {
    fn at(&self, column: f64, row: f64) -> f64 {
        self.0[0] + self.0[1] * column + self.0[2] * row
    }
}

/// A triangle on a picture: the weights of its corners, 1 at its own corner and 0 on the side across.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Facet {
    /// Sample from which columns and rows are counted.
    first: [f64; 2],
    weights: [Linear; 3],
}

impl Facet {
    /// Of corners in samples, counted from a sample near them; none for a triangle without area.
    pub(super) fn new([a, b, c]: [[f64; 3]; 3], first: [usize; 2]) -> Option<Self> {
        let first = first.map(|n| n as f64);
        // What is counted from near by has no large numbers that cancel.
        let [a, b, c] = [a, b, c].map(|p| [p[0] - (first[0] + 0.5), p[1] - (first[1] + 0.5)]);
        let double = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if double == 0.0 {
            return None;
        }
        let scale = 1.0 / double;
        let weight = |p: [f64; 2], q: [f64; 2]| {
            Linear([p[0] * q[1] - p[1] * q[0], p[1] - q[1], q[0] - p[0]].map(|number| number * scale))
        };
        Some(Self { first, weights: [weight(b, c), weight(c, a), weight(a, b)] })
    }

    /// Weights of the corners at a sample.
    pub(super) fn at(&self, x: usize, y: usize) -> [f64; 3] {
        let (column, row) = (x as f64 - self.first[0], y as f64 - self.first[1]);
        let [a, b, c] = &self.weights;
        [a.at(column, row), b.at(column, row), c.at(column, row)]
    }

    /// Calls with each row that a triangle has samples in, of some rows of a picture so wide: the row, its columns, depth at
    /// the first of them and per column.
    pub(super) fn rows(
        corners: [[f64; 3]; 3],
        width: usize,
        rows: &Range<usize>,
        mut call: impl FnMut(usize, Range<usize>, [f64; 2]),
    ) {
        let [a, b, c] = corners;
        let columns = extent(corners, 0, &(0..width));
        let rows = extent(corners, 1, rows);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let Some(facet) = Self::new(corners, [columns.start, rows.start]) else { return };
        let depth = |k: usize| facet.weights.iter().zip([a, b, c]).map(|(weight, p)| weight.0[k] * p[2]).sum();
        let depth = Linear([depth(0), depth(1), depth(2)]);
        let inverse = facet.weights.map(|weight| 1.0 / weight.0[1]);
        for y in rows.clone() {
            let row = (y - rows.start) as f64;
            let (mut low, mut high) = (0.0, (columns.len() - 1) as f64);
            for (weight, inverse) in facet.weights.iter().zip(inverse) {
                let (at, slope) = (weight.at(0.0, row), weight.0[1]);
                let limit = (-EDGE - at) * inverse;
                if slope > 0.0 {
                    low = limit.max(low);
                } else if slope < 0.0 {
                    high = limit.min(high);
                } else if at < -EDGE {
                    high = -1.0;
                }
            }
            if low <= high {
                let (first, last) = (ceil(low), high as usize);
                let at = columns.start + first..columns.start + last + 1;
                call(y, at, [depth.at(first as f64, row), depth.0[1]]);
            }
        }
    }
}

/// Columns (0) or rows (1) among these between whose middles a triangle lies.
fn extent(corners: [[f64; 3]; 3], k: usize, within: &Range<usize>) -> Range<usize> {
    let [a, b, c] = corners.map(|corner| corner[k]);
    let [low, high] = [within.start as f64, within.end as f64];
    ceil((a.min(b).min(c) - 0.5).clamp(low, high))..(a.max(b).max(c) + 0.5).clamp(low, high) as usize
}

/// The next whole number that is not smaller than this one, which is not negative.
fn ceil(x: f64) -> usize {
    let whole = x as usize;
    whole + usize::from(whole as f64 != x)
}

/// Rows of a picture that are drawn together: what is known of their samples stays near the processor.
const BAND: usize = 48;
/// Rows above and below a band that are known with it, for [`Nearest::is_below_beside`].
const AROUND: usize = 2;

/// The nearest triangle at each sample of a band of rows.
pub(super) struct Nearest {
    width: usize,
    /// Rows of the picture, and those that are known.
    height: usize,
    known: Range<usize>,
    /// Depth in the upper half, so that more is nearer; number of the triangle below. Zero where there is nothing.
    keys: Vec<u64>,
    /// Columns of each row outside of which there is nothing.
    touched: Vec<Range<usize>>,
}

impl Nearest {
    /// Calls with each row of a picture of `width` and `height` samples in which there is something, from the top down, and
    /// with the band that knows it. Of two triangles that are equally near the first counts.
    pub(super) fn each_row(
        [width, height]: [usize; 2],
        triangles: usize,
        corners: impl Fn(usize) -> [[f64; 3]; 3],
        mut call: impl FnMut(&Self, usize),
    ) {
        let bands = height.div_ceil(BAND);
        let bands_of = |triangle: usize| {
            let rows = extent(corners(triangle), 1, &(0..height));
            match rows.is_empty() {
                true => 0..0,
                false => rows.start.saturating_sub(AROUND) / BAND..((rows.end + AROUND - 1) / BAND + 1).min(bands),
            }
        };
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); bands];
        for (triangle, number) in (0..triangles).zip(0_u32..) {
            members[bands_of(triangle)].iter_mut().for_each(|band| band.push(number));
        }
        let (keys, touched) = (vec![0; width * (BAND + 2 * AROUND)], vec![0..0; BAND + 2 * AROUND]);
        let mut band = Self { width, height, known: 0..0, keys, touched };
        for (k, members) in members.iter().enumerate().filter(|(_, members)| !members.is_empty()) {
            let rows = k * BAND..((k + 1) * BAND).min(height);
            band.begin(rows.start.saturating_sub(AROUND)..(rows.end + AROUND).min(height));
            members.iter().for_each(|number| band.add(*number, corners(*number as usize)));
            rows.filter(|y| !band.columns(*y).is_empty()).for_each(|y| call(&band, y));
        }
    }

    /// Nothing in these rows yet.
    fn begin(&mut self, known: Range<usize>) {
        for (row, touched) in self.keys.chunks_exact_mut(self.width).zip(&mut self.touched) {
            row[std::mem::take(touched)].fill(0);
        }
        self.known = known;
    }

    fn add(&mut self, number: u32, corners: [[f64; 3]; 3]) {
        let Self { width, known, keys, touched, .. } = self;
        Facet::rows(corners, *width, known, |y, columns, [first, slope]| {
            let y = y - known.start;
            let row: &mut Range<usize> = &mut touched[y];
            *row = match row.start < row.end {
                true => row.start.min(columns.start)..row.end.max(columns.end),
                false => columns.clone(),
            };
            let mut column = 0.0;
            for key in &mut keys[y * *width..][columns] {
                let depth = u64::from(ordered((first + slope * column) as f32));
                if depth > *key >> 32 {
                    *key = depth << 32 | u64::from(number);
                }
                column += 1.0;
            }
        });
    }

    /// Columns of a row outside of which there is nothing.
    pub(super) fn columns(&self, y: usize) -> Range<usize> {
        self.touched[y - self.known.start].clone()
    }

    fn key(&self, x: usize, y: usize) -> u64 {
        self.keys[(y - self.known.start) * self.width + x]
    }

    /// Depth and number of what is nearest.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<(f32, usize)> {
        match self.key(x, y) {
            0 => None,
            key => Some((depth(key), (key & u64::from(u32::MAX)) as usize)),
        }
    }

    /// Whether something beside a sample lies lower than this, or nothing is there: one or two samples on in any direction.
    pub(super) fn is_below_beside(&self, x: usize, y: usize, depth: f32) -> bool {
        let (limit, at) = (u64::from(ordered(depth)) << 32, (y - self.known.start) * self.width + x);
        let lower = |at: usize| self.keys[at] < limit;
        (1..=AROUND).any(|k| {
            x + k < self.width && lower(at + k)
                || x >= k && lower(at - k)
                || y + k < self.height && lower(at + k * self.width)
                || y >= k && lower(at - k * self.width)
        })
    }
}

/// A number of the same order: more than zero, and larger for a larger depth.
fn ordered(depth: f32) -> u32 {
    let bits = depth.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

fn depth(key: u64) -> f32 {
    let bits = (key >> 32) as u32;
    f32::from_bits(if bits >> 31 == 1 { bits & !(1 << 31) } else { !bits })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: every sample by itself against the three sides, and the plane through the corners.
    #[test]
    fn the_nearest_triangle_is_found_at_each_sample() {
        let mut seed = 5_u64;
        let mut random = |size: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1_u64 << 31) as f64 * size
        };
        // More rows than a band has.
        let (width, height) = (60, 70);
        let mut triangles: Vec<[[f64; 3]; 3]> = Vec::new();
        for k in 0..60 {
            // Beyond the picture on all sides, small ones, and one on whole samples.
            let size = if k % 3 == 0 { 4.0 } else { 60.0 };
            let at = [random(70.0) - 10.0, random(80.0) - 10.0];
            let mut corner = || [at[0] + random(size), at[1] + random(size), random(20.0) - 10.0];
            triangles.push([corner(), corner(), corner()]);
        }
        triangles.push([[10.5, 10.5, 30.0], [20.5, 10.5, 30.0], [10.5, 20.5, 30.0]]);
        triangles.push([[1.0, 1.0, 90.0], [2.0, 2.0, 90.0], [3.0, 3.0, 90.0]]);
        let mut found = vec![None; width * height];
        Nearest::each_row(
            [width, height],
            triangles.len(),
            |k| triangles[k],
            |nearest, y| {
                (0..width).for_each(|x| found[y * width + x] = nearest.at(x, y));
                assert!((0..width).filter(|x| nearest.at(*x, y).is_some()).all(|x| nearest.columns(y).contains(&x)));
            },
        );
        let mut covered = 0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let p = [x as f64 + 0.5, y as f64 + 0.5];
            let mut truth: Option<(f64, usize)> = None;
            for (number, [a, b, c]) in triangles.iter().enumerate() {
                let area = |q: &[f64; 3], r: &[f64; 3]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
                let areas = [area(b, c), area(c, a), area(a, b)];
                let double: f64 = areas.iter().sum();
                let inside = double != 0.0 && areas.iter().all(|area| area / double >= -EDGE);
                let depth = (areas[0] * a[2] + areas[1] * b[2] + areas[2] * c[2]) / double;
                if inside && truth.is_none_or(|(nearest, _)| depth > nearest) {
                    truth = Some((depth, number));
                }
            }
            let found = found[y * width + x];
            assert_eq!(found.map(|(_, number)| number), truth.map(|(_, number)| number), "at {x}, {y}");
            if let (Some((found, number)), Some((truth, _))) = (found, truth) {
                assert!((f64::from(found) - truth).abs() < 1e-5, "{found} {truth}"); // f32; measured 9.5e-7
                let weights = Facet::new(triangles[number], [x / 2, y + 3]).unwrap().at(x, y);
                let depth: f64 = weights.iter().zip(triangles[number]).map(|(w, p)| w * p[2]).sum();
                assert!((depth - truth).abs() < 1e-9 && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                covered += 1;
            }
        }
        assert!((1000..4200).contains(&covered), "{covered}");
        let on_a_side = found[15 * width + 15].map(|(_, number)| number);
        assert_eq!(on_a_side, Some(60), "a sample on a side belongs to it");
    }

    #[test]
    fn depths_keep_their_order_as_whole_numbers() {
        let depths = [f32::MIN, -3.5, -1e-30, -0.0, 0.0, 1e-30, 2.0, 1e4, f32::MAX];
        assert!(depths.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])) && ordered(depths[0]) > 0);
        assert!(depths.iter().all(|d| depth(u64::from(ordered(*d)) << 32 | 77).to_bits() == d.to_bits()));
    }
}
