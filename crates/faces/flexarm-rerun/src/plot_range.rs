//! Plot axes with enough labels, and a legend corner in which it hides no curve.
//!
//! The Rerun viewer labels an axis at powers of ten and their multiples only, and draws the legend
//! over the curves. Range and corner can be set once the curves are known. Start at [`arrange`].

/// Maximum number of pieces of an [`Envelope`].
const PIECES: usize = 256;
/// Number of columns into which the plot is divided for the search of free space.
const COLUMNS: usize = 64;
/// Fraction of the height left empty above and below the curves.
const MARGIN: f64 = 0.05;
/// Width and height of a plot in a window of 1600 by 1000 (pixels), measured on a screenshot of the
/// viewer, version 0.36.
const PLOT: [f64; 2] = [610.0, 425.0];
/// Heights of a row of the legend and of its frame, widths of a letter and of the rest of a row
/// (pixels), measured likewise.
const LEGEND: [f64; 4] = [23.0, 10.0, 6.4, 36.0];
/// Minimum distance between labels (pixels), measured likewise.
const APART: f64 = 20.0;
/// Maximum relative growth of an axis for a third label.
const FOR_A_LABEL: f64 = 0.2;
/// Maximum relative growth of an axis for the legend.
const MAX_LEGEND_GROWTH: f64 = 0.8;

/// Minimum and maximum of curves over the run, in pieces of equal numbers of rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Envelope {
    pieces: Vec<[f64; 2]>,
    /// Number of rows of a piece, and of the last piece.
    rows: u64,
    in_last: u64,
}

impl Envelope {
    /// Adds the values of one sample; ignores non-finite ones.
    pub(crate) fn push(&mut self, values: impl IntoIterator<Item = f64>) {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let grown = |[low, high]: [f64; 2], x: f64| [low.min(x), high.max(x)];
        let row = values.into_iter().filter(|x| x.is_finite()).fold(none, grown);
        self.rows = self.rows.max(1);
        match self.pieces.last_mut() {
            Some(last) if self.in_last < self.rows => *last = [last[0].min(row[0]), last[1].max(row[1])],
            _ => {
                if self.pieces.len() == PIECES {
                    let pairs = self.pieces.chunks(2).map(|pair| {
                        pair.iter().fold(none, |[low, high], piece| [low.min(piece[0]), high.max(piece[1])])
                    });
                    self.pieces = pairs.collect();
                    self.rows *= 2;
                }
                self.pieces.push(row);
                self.in_last = 0;
            }
        }
        self.in_last += 1;
    }

    /// Returns minimum and maximum in one of the [`COLUMNS`].
    fn column(&self, column: usize) -> [f64; 2] {
        let count = self.pieces.len();
        let (from, to) = (column * count / COLUMNS, ((column + 1) * count).div_ceil(COLUMNS));
        let pieces = self.pieces.get(from..to).unwrap_or_default();
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        pieces.iter().fold(none, |[low, high], piece| [low.min(piece[0]), high.max(piece[1])])
    }
}

/// A corner of a plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Corner {
    pub(crate) left: bool,
    pub(crate) top: bool,
}

/// Corner of the legend, and range of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrangement {
    pub(crate) corner: Corner,
    pub(crate) range: [f64; 2],
}

/// Chooses range and legend corner for the curves; `names` are the numbers of letters of their
/// names. `None` if there is no finite value.
pub(crate) fn arrange(curves: &[&Envelope], names: &[usize]) -> Option<Arrangement> {
    let columns: Vec<[f64; 2]> = (0..COLUMNS)
        .map(|k| curves.iter().map(|curve| curve.column(k)).fold([f64::INFINITY, f64::NEG_INFINITY], wider))
        .collect();
    let [low, high] = columns.iter().copied().fold([f64::INFINITY, f64::NEG_INFINITY], wider);
    if low > high {
        return None;
    }
    // A constant curve still gets an axis.
    let margin = match MARGIN * (high - low) {
        margin if margin > 0.0 => margin,
        _ => 0.5 * high.abs().max(1e-6),
    };
    let base = labelled([low - margin, high + margin]);
    let [row, frame, letter, beside] = LEGEND;
    let width = (names.iter().max().copied().unwrap_or(0) as f64 * letter + beside) / PLOT[0];
    let height = (names.len() as f64 * row + frame) / PLOT[1];
    // One more column, since pieces need not end at column boundaries.
    let across = ((width * COLUMNS as f64).ceil() as usize + 1).clamp(1, COLUMNS);
    let free = |corner: Corner, [low, high]: [f64; 2]| {
        let under = if corner.left { &columns[..across] } else { &columns[COLUMNS - across..] };
        let [below, above] = under.iter().copied().fold([f64::INFINITY, f64::NEG_INFINITY], wider);
        match (corner.top, height < 1.0 && below <= above) {
            (_, false) => [low, high],
            (true, true) => [low, high.max((above - height * low) / (1.0 - height))],
            (false, true) => [low.min((below - height * high) / (1.0 - height)), high],
        }
    };
    // Fixed-point iteration: the space for the legend changes the labels, and these change the
    // space.
    let grown = |corner: Corner| (0..6).fold(base, |range, _| labelled(free(corner, range)));
    let corners = [(true, true), (false, true), (true, false), (false, false)];
    let found = corners.map(|(left, top)| Corner { left, top }).map(|corner| (corner, grown(corner)));
    let length = |[low, high]: [f64; 2]| high - low;
    let least = found.into_iter().min_by(|(_, a), (_, b)| length(*a).total_cmp(&length(*b)));
    let (corner, range) = least.unwrap_or(found[0]);
    let fits = length(range) <= (1.0 + MAX_LEGEND_GROWTH) * length(base);
    Some(Arrangement { corner, range: if fits { range } else { base } })
}

fn wider(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Widens the range, if the cost is small, until it has three labels in a large window, and in any
/// case until it has two in a plot 200 pixels high. The viewer labels those multiples of a power of
/// ten that fit, which is often only 0.
fn labelled(range: [f64; 2]) -> [f64; 2] {
    let length = |[low, high]: [f64; 2]| high - low;
    let shown = 10f64.powf((APART * length(range) / PLOT[1]).log10().ceil());
    let three = with_multiples(range, shown, 3);
    let range = if length(three) <= (1.0 + FOR_A_LABEL) * length(range) { three } else { range };
    with_multiples(range, 10f64.powf(length(range).log10().floor()), 2)
}

/// Widens the range, on the cheaper side each time, until it has `count` multiples of `unit`.
fn with_multiples([mut low, mut high]: [f64; 2], unit: f64, count: i32) -> [f64; 2] {
    if !unit.is_normal() {
        return [low, high];
    }
    let (mut first, mut last) = ((low / unit).ceil(), (high / unit).floor());
    while last - first + 1.0 < f64::from(count) {
        if low - (first - 1.0) * unit < (last + 1.0) * unit - high {
            first -= 1.0;
            low = first * unit;
        } else {
            last += 1.0;
            high = last * unit;
        }
    }
    [low, high]
}

/// Number of labels in a range, for a viewer that labels multiples of powers of ten at least
/// `apart` pixels apart.
#[cfg(test)]
pub(crate) fn labels([low, high]: [f64; 2], height: f64, apart: f64) -> usize {
    let least = apart * (high - low) / height;
    let unit = 10f64.powf(least.log10().ceil());
    ((high / unit).floor() - (low / unit).ceil() + 1.0).max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn envelope(values: impl Iterator<Item = f64>) -> Envelope {
        let mut envelope = Envelope::default();
        values.for_each(|x| envelope.push([x]));
        envelope
    }

    /// Parts of the plot covered by the legend: from left to right and from bottom to top.
    fn covered(a: &Arrangement, names: &[usize]) -> [[f64; 2]; 2] {
        let width = (*names.iter().max().unwrap() as f64 * LEGEND[2] + LEGEND[3]) / PLOT[0];
        let height = (names.len() as f64 * LEGEND[0] + LEGEND[1]) / PLOT[1];
        let side = |first: bool, size: f64| if first { [0.0, size] } else { [1.0 - size, 1.0] };
        [side(a.corner.left, width), side(!a.corner.top, height)]
    }

    /// Truth: the curve's own points. Many of the sizes give an unadjusted axis the single label 0.
    #[test]
    fn no_curve_is_under_its_legend_and_the_axis_has_labels() {
        for scale in [-6.0, -2.7, -0.25, 0.0, 0.35, 0.78, 0.95, 3.6] {
            for shift in [-1.5, -0.4, 0.0, 0.9] {
                for (waves, spike) in [(0.3, 0.0), (1.1, 0.02), (1.1, 0.5), (3.3, 0.97), (9.0, 0.3)] {
                    for names in [&[4][..], &[6, 6, 6, 9, 24], &[19, 12]] {
                        check(scale, shift, waves, spike, names);
                    }
                }
            }
        }
    }

    fn check(scale: f64, shift: f64, waves: f64, spike: f64, names: &[usize]) {
        let (size, n) = (10f64.powf(scale), 2000);
        let value = |k: usize| {
            let x = k as f64 / n as f64;
            let spike = if (x - spike).abs() < 1e-3 { 3.0 } else { 0.0 };
            size * (shift + (waves * std::f64::consts::TAU * x).sin() + spike)
        };
        let a = arrange(&[&envelope((0..n).map(value))], names).unwrap();
        let [across, up] = covered(&a, names);
        let [low, high] = a.range;
        for k in 0..n {
            let (x, y) = ((k as f64 + 0.5) / n as f64, (value(k) - low) / (high - low));
            assert!((0.0..=1.0).contains(&y));
            let hidden = x > across[0] && x < across[1] && y > up[0] && y < up[1];
            assert!(!hidden, "{x} {y} {a:?}");
        }
        // In a window of 1600 by 1000, and in a small one.
        assert!(labels(a.range, PLOT[1], APART) >= 2, "{a:?}");
        assert!(labels(a.range, 200.0, APART) >= 2, "{a:?}");
    }

    #[test]
    fn an_error_of_some_millimetres_has_more_labels_than_zero() {
        // Truth: the fault as reported, plus and minus 6 mm in a plot 160 pixels high.
        assert_eq!(labels([-6.0, 6.0], 160.0, 20.0), 1);
        let wave = envelope((0..500).map(|k| 6.0 * (f64::from(k) * 0.05).sin()));
        let a = arrange(&[&wave], &[6, 6, 6, 9]).unwrap();
        assert!(labels(a.range, PLOT[1], APART) >= 3, "{a:?}");
        // Observed in the viewer: -8.9 to 13.1 has the labels 0 and 10.
        assert_eq!(labels([-8.9, 13.1], PLOT[1], APART), 2);
        assert_eq!(labelled([-8.9, 13.1]), [-10.0, 13.1]);
        assert_eq!(labelled([-0.9, 0.8]), [-1.0, 0.8]);
        assert_eq!(labelled([-1.5, 1.5]), [-1.5, 1.5]);
    }

    #[test]
    fn long_runs_keep_their_extremes() {
        let mut many = Envelope::default();
        for k in 0..100_000_u32 {
            many.push([if k == 77_777 { 9.0 } else { 0.0 }, -1.0, f64::NAN]);
        }
        assert!(many.pieces.len() <= PIECES);
        let columns: Vec<_> = (0..COLUMNS).map(|k| many.column(k)).collect();
        assert_eq!(columns.iter().filter(|[_, high]| *high == 9.0).count(), 1);
        assert!(columns.iter().all(|[low, _]| *low == -1.0));
        assert!(arrange(&[&Envelope::default()], &[3]).is_none());
        assert_eq!(arrange(&[&envelope([2.0; 9].into_iter())], &[3]).unwrap().range, [1.0, 3.0]);
    }
}
