//! Which triangle is nearest to the viewer at each sample of a picture.

use std::ops::Range;

/// A sample belongs to a triangle if none of its weights is below minus this.
const EDGE: f64 = 1e-9;

/// A number that is linear on the picture: at the first sample, per column, per row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Linear([f64; 3]);

impl Linear {
    /// At so many columns and rows from the first sample.
    pub(super) fn at(&self, column: f64, row: f64) -> f64 {
        self.0[0] + self.0[1] * column + self.0[2] * row
    }
}

/// A triangle on a picture: the weights of its corners, 1 at its own corner and 0 on the side across.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Facet {
    weights: [Linear; 3],
}

impl Facet {
    /// Of corners in samples; columns and rows are counted from a sample near them. None for a triangle without area.
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
        Some(Self { weights: [weight(b, c), weight(c, a), weight(a, b)] })
    }

    /// What is linear on the triangle and has these values at its corners.
    pub(super) fn mean(&self, values: [f64; 3]) -> Linear {
        let part = |k: usize| self.weights.iter().zip(values).map(|(weight, value)| weight.0[k] * value).sum();
        Linear([part(0), part(1), part(2)])
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
        let depth = facet.mean([a[2], b[2], c[2]]);
        let limits = Limits::new(&facet, columns.len());
        for y in rows.clone() {
            let row = (y - rows.start) as f64;
            let [low, high] = limits.at(row);
            if low <= high {
                let (first, last) = (ceil(low), high as u32 as usize);
                let at = columns.start + first..columns.start + last + 1;
                call(y, at, [depth.at(first as f64, row), depth.0[1]]);
            }
        }
    }
}

/// Columns between which a triangle lies in a row: each side is a first or a last one, linear in the row.
struct Limits {
    low: [[f64; 2]; 3],
    high: [[f64; 2]; 3],
    /// Weights of sides along rows, which tell whether the row is in it at all.
    along: [[f64; 2]; 3],
    last: f64,
}

impl Limits {
    /// Among so many columns.
    fn new(facet: &Facet, columns: usize) -> Self {
        let last = (columns - 1) as f64;
        let (mut low, mut high, mut along) = ([[0.0; 2]; 3], [[last, 0.0]; 3], [[0.0; 2]; 3]);
        for (k, Linear([start, per_column, per_row])) in facet.weights.into_iter().enumerate() {
            let limit = [(-EDGE - start) / per_column, -per_row / per_column];
            if per_column > 0.0 {
                low[k] = limit;
            } else if per_column < 0.0 {
                high[k] = limit;
            } else {
                along[k] = [start, per_row];
            }
        }
        Self { low, high, along, last }
    }

    /// Of a row. The first one is not before the first column, the last one not behind the last.
    fn at(&self, row: f64) -> [f64; 2] {
        let (greater, less) = (|a: f64, b: f64| if b > a { b } else { a }, |a: f64, b: f64| if b < a { b } else { a });
        let value = |[start, slope]: [f64; 2]| start + slope * row;
        let (low, high) = (self.low.map(value), self.high.map(value));
        match self.along.iter().any(|side| value(*side) < -EDGE) {
            true => [0.0, -1.0],
            false => [low.into_iter().fold(0.0, greater), high.into_iter().fold(self.last, less)],
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
/// Samples around each row and column that are known with it, for [`Nearest::lowest_beside`].
const AROUND: usize = 2;
/// Depth where there is nothing, and beside the picture.
const NOTHING: f32 = f32::NEG_INFINITY;
const BESIDE: f32 = f32::INFINITY;

/// The nearest triangle at each sample of a band of rows.
pub(super) struct Nearest {
    width: usize,
    /// Rows of the picture, and the first of the band.
    height: usize,
    first: usize,
    /// Depth of what is nearest, row by row, with [`AROUND`] rows and columns more on each side, and the length of such a row.
    depths: Vec<f32>,
    stride: usize,
    /// Number of the triangle.
    numbers: Vec<u32>,
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
        let (rows, stride) = (BAND + 2 * AROUND, width + 2 * AROUND);
        let mut depths = vec![NOTHING; stride * rows];
        for row in depths.chunks_exact_mut(stride) {
            row[..AROUND].fill(BESIDE);
            row[width + AROUND..].fill(BESIDE);
        }
        let mut band =
            Self { width, height, stride, first: 0, depths, numbers: vec![0; width * rows], touched: vec![0..0; rows] };
        for (k, members) in members.iter().enumerate().filter(|(_, members)| !members.is_empty()) {
            let rows = k * BAND..((k + 1) * BAND).min(height);
            band.begin(rows.start);
            members.iter().for_each(|number| band.add(*number, corners(*number as usize)));
            rows.filter(|y| !band.columns(*y).is_empty()).for_each(|y| call(&band, y));
        }
    }

    /// The band that begins at a row, with nothing in it yet.
    fn begin(&mut self, first: usize) {
        self.first = first;
        let Self { width, height, depths, stride, touched, .. } = self;
        for (k, (row, touched)) in depths.chunks_exact_mut(*stride).zip(touched).enumerate() {
            let row = &mut row[AROUND..][..*width];
            row[std::mem::take(touched)].fill(NOTHING);
            if first + k < AROUND || first + k >= *height + AROUND {
                row.fill(BESIDE);
                *touched = 0..*width;
            }
        }
    }

    /// Row of the band where this one of the picture is.
    fn row(&self, y: usize) -> usize {
        y + AROUND - self.first
    }

    fn add(&mut self, number: u32, corners: [[f64; 3]; 3]) {
        let Self { width, height, first: top, depths, stride, numbers, touched } = self;
        let known = top.saturating_sub(AROUND)..(*top + BAND + AROUND).min(*height);
        Facet::rows(corners, *width, &known, |y, columns, [first, slope]| {
            let y = y + AROUND - *top;
            let row: &mut Range<usize> = &mut touched[y];
            *row = match row.start < row.end {
                true => row.start.min(columns.start)..row.end.max(columns.end),
                false => columns.clone(),
            };
            let depths = &mut depths[y * *stride + AROUND..][columns.clone()];
            let numbers = &mut numbers[y * *width..][columns];
            let mut column = 0.0;
            for (nearest, nearest_number) in depths.iter_mut().zip(numbers) {
                let depth = (first + slope * column) as f32;
                if depth > *nearest {
                    (*nearest, *nearest_number) = (depth, number);
                }
                column += 1.0;
            }
        });
    }

    /// Columns of a row outside of which there is nothing.
    pub(super) fn columns(&self, y: usize) -> Range<usize> {
        self.touched[self.row(y)].clone()
    }

    /// Of some columns of a row: the depth of what is nearest, and the number of the triangle.
    pub(super) fn at(&self, columns: Range<usize>, y: usize) -> impl Iterator<Item = Option<(f32, usize)>> {
        let row = self.row(y);
        let depths = &self.depths[row * self.stride + AROUND..][columns.clone()];
        let numbers = &self.numbers[row * self.width..][columns];
        depths.iter().zip(numbers).map(|(depth, number)| (*depth > NOTHING).then_some((*depth, *number as usize)))
    }

    /// Of some columns of a row: the smallest depth beside each sample, one or two samples on in any direction.
    pub(super) fn lowest_beside(&self, columns: Range<usize>, y: usize, lowest: &mut Vec<f32>) {
        let (stride, count) = (self.stride, columns.len());
        let at = self.row(y) * stride + AROUND + columns.start;
        let from = |start: usize| &self.depths[start..][..count];
        let lower = |a: f32, b: f32| if b < a { b } else { a };
        lowest.clear();
        lowest.extend_from_slice(from(at - 1));
        let others = [at + 1, at - 2, at + 2, at - stride, at + stride, at - 2 * stride, at + 2 * stride];
        for other in others.map(from) {
            lowest.iter_mut().zip(other).for_each(|(lowest, other)| *lowest = lower(*lowest, *other));
        }
    }
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
        let (mut lowest, mut buffer) = (vec![BESIDE; width * height], Vec::new());
        Nearest::each_row(
            [width, height],
            triangles.len(),
            |k| triangles[k],
            |nearest, y| {
                let row = &mut found[y * width..][..width];
                row.iter_mut().zip(nearest.at(0..width, y)).for_each(|(found, at)| *found = at);
                assert!((0..width).filter(|x| row[*x].is_some()).all(|x| nearest.columns(y).contains(&x)));
                nearest.lowest_beside(0..width, y, &mut buffer);
                lowest[y * width..][..width].copy_from_slice(&buffer);
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
                let facet = Facet::new(triangles[number], [x / 2, y + 3]).unwrap();
                let at = |corners: [f64; 3]| facet.mean(corners).at((x - x / 2) as f64, -3.0);
                let depth = at(triangles[number].map(|p| p[2]));
                assert!((depth - truth).abs() < 1e-9 && (at([1.0; 3]) - 1.0).abs() < 1e-9);
                covered += 1;
            }
        }
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let depth = |x: Option<usize>, y: Option<usize>| match (x.filter(|x| *x < width), y.filter(|y| *y < height))
            {
                (Some(x), Some(y)) => found[y * width + x].map_or(NOTHING, |(depth, _)| depth),
                _ => BESIDE,
            };
            let beside = [1, 2].into_iter().flat_map(|k| {
                let (before, after) = ((x.checked_sub(k), y.checked_sub(k)), (Some(x + k), Some(y + k)));
                [(before.0, Some(y)), (after.0, Some(y)), (Some(x), before.1), (Some(x), after.1)]
            });
            let truth = beside.map(|(x, y)| depth(x, y)).fold(BESIDE, f32::min);
            // Rows without anything are not shown.
            let is_shown = (0..width).any(|x| found[y * width + x].is_some());
            assert!(!is_shown || lowest[y * width + x] == truth, "beside {x}, {y}: {} {truth}", lowest[y * width + x]);
        }
        assert!((1000..4200).contains(&covered), "{covered}");
        let on_a_side = found[15 * width + 15].map(|(_, number)| number);
        assert_eq!(on_a_side, Some(60), "a sample on a side belongs to it");
    }
}
