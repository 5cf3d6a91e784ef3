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

    /// From there on in the row, at one column after the other.
    pub(super) fn along(&self, column: f64, row: f64) -> impl Iterator<Item = f64> + use<> {
        let (first, slope) = (self.at(column, row), self.0[1]);
        let mut column = -1.0;
        std::iter::repeat_with(move || {
            column += 1.0;
            first + slope * column
        })
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
}

/// The samples of a triangle, row by row.
pub(super) struct Spans {
    /// Rows in which there may be some.
    pub(super) rows: Range<usize>,
    /// First column and row that the numbers below are counted from.
    first: [usize; 2],
    /// Columns between which the triangle lies in a row: one or two of its sides are on the left, one or two on the right.
    low: [[f64; 2]; 2],
    high: [[f64; 2]; 2],
    last: f64,
    depth: Linear,
}

/// Its sum with a small number is a whole one, which has that number, rounded, as its last bits.
const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
/// What is added to a number so that the nearest whole one is the next that is not smaller, but for an edge.
const UP: f64 = 0.5 - EDGE;

impl Spans {
    /// Among some rows of a picture so wide; none for a triangle that has no samples there, or no area.
    pub(super) fn new(corners: [[f64; 3]; 3], width: usize, rows: &Range<usize>) -> Option<Self> {
        let [columns, mut rows] = [extent(corners, 0, &(0..width)), extent(corners, 1, rows)];
        if columns.is_empty() || rows.is_empty() {
            return None;
        }
        let first = [columns.start, rows.start];
        let facet = Facet::new(corners, first)?;
        let last = (columns.len() - 1) as f64;
        let (mut low, mut high) = ([[0.0; 2]; 2], [[last, 0.0]; 2]);
        let (mut lows, mut highs) = (0, 0);
        for Linear([start, per_column, per_row]) in facet.weights {
            let limit = [(-EDGE - start) / per_column, -per_row / per_column];
            if per_column > 0.0 {
                low[lows.min(1)] = [limit[0] + UP, limit[1]];
                lows += 1;
            } else if per_column < 0.0 {
                high[highs.min(1)] = [limit[0] - UP, limit[1]];
                highs += 1;
            } else {
                let outside = |row: usize| start + per_row * ((row - first[1]) as f64) < -EDGE;
                while !rows.is_empty() && outside(rows.start) {
                    rows.start += 1;
                }
                while !rows.is_empty() && outside(rows.end - 1) {
                    rows.end -= 1;
                }
            }
        }
        Some(Self { rows, first, low, high, last, depth: facet.mean(corners.map(|corner| corner[2])) })
    }

    /// Columns of one of its rows, and depths there.
    pub(super) fn at(&self, row: usize) -> Option<(Range<usize>, impl Iterator<Item = f64> + use<>)> {
        let (greater, less) = (|a: f64, b: f64| if b > a { b } else { a }, |a: f64, b: f64| if b < a { b } else { a });
        let row = f64::from((row - self.first[1]) as u32);
        let value = |[start, slope]: [f64; 2]| start + slope * row;
        let [low, high] = [self.low.map(value), self.high.map(value)];
        // Not before the first column and not behind the last.
        let first = greater(greater(0.0, low[0]), low[1]) + WHOLE;
        let last = less(less(self.last, high[0]), high[1]) + WHOLE;
        let [start, end] = [first, last].map(|x| x.to_bits() as u32 as usize);
        let columns = self.first[0] + start..self.first[0] + end + 1;
        (first <= last).then(|| (columns, self.depth.along(first - WHOLE, row)))
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
/// Depth beside the picture.
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
    /// Columns of each row outside of which there is nothing; an empty row ends before it begins.
    touched: Vec<Range<usize>>,
}

impl Nearest {
    /// Depth where there is nothing.
    pub(super) const NOTHING: f32 = f32::NEG_INFINITY;

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
        let mut depths = vec![Self::NOTHING; stride * rows];
        for row in depths.chunks_exact_mut(stride) {
            row[..AROUND].fill(BESIDE);
            row[width + AROUND..].fill(BESIDE);
        }
        let mut band = Self {
            width,
            height,
            stride,
            first: 0,
            depths,
            numbers: vec![0; width * rows],
            touched: vec![width..0; rows],
        };
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
            let used = std::mem::replace(touched, *width..0);
            row.get_mut(used).unwrap_or_default().fill(Self::NOTHING);
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
        let Self { width, height, first, depths, stride, numbers, touched } = self;
        let known = first.saturating_sub(AROUND)..(*first + BAND + AROUND).min(*height);
        let Some(spans) = Spans::new(corners, *width, &known) else { return };
        let skipped = spans.rows.start + AROUND - *first;
        let rows = depths.chunks_exact_mut(*stride).zip(numbers.chunks_exact_mut(*width)).zip(touched).skip(skipped);
        for (y, ((depths, numbers), touched)) in spans.rows.clone().zip(rows) {
            let Some((columns, along)) = spans.at(y) else { continue };
            *touched = touched.start.min(columns.start)..touched.end.max(columns.end);
            let depths = &mut depths[AROUND + columns.start..AROUND + columns.end];
            for ((nearest, nearest_number), depth) in depths.iter_mut().zip(&mut numbers[columns]).zip(along) {
                if depth as f32 > *nearest {
                    (*nearest, *nearest_number) = (depth as f32, number);
                }
            }
        }
    }

    /// Columns of a row outside of which there is nothing.
    pub(super) fn columns(&self, y: usize) -> Range<usize> {
        self.touched[self.row(y)].clone()
    }

    /// Of some columns of a row: the depth of what is nearest, [`Nearest::NOTHING`] where there is nothing, and the number of
    /// the triangle.
    pub(super) fn at(&self, columns: Range<usize>, y: usize) -> (&[f32], &[u32]) {
        let row = self.row(y);
        (&self.depths[row * self.stride + AROUND..][columns.clone()], &self.numbers[row * self.width..][columns])
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
                let (depths, numbers) = nearest.at(0..width, y);
                for ((found, depth), number) in row.iter_mut().zip(depths).zip(numbers) {
                    *found = (*depth > Nearest::NOTHING).then_some((*depth, *number as usize));
                }
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
                (Some(x), Some(y)) => found[y * width + x].map_or(Nearest::NOTHING, |(depth, _)| depth),
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
