//! Charts of studies as SVG: heat maps, main effects, bars with intervals, scatter plots alone and as a matrix.
//!
//! Plain numbers and names in, the text of a picture out; pixels of the browser. Nothing depends on fonts, files or the clock.
//! Not here: curves over time ([`crate::LinePlot`]).

use std::fmt::Write as _;

use crate::palette::{self, Ground};
use flexarm_settings::written::markup;

/// Letters.
const FONT: &str = "font-family=\"system-ui, sans-serif\"";
/// Frames and ticks.
const LINE: &str = "#8c929c";

/// A value for each pair of two parameters.
#[derive(Clone, Debug, Default)]
pub struct HeatMap<'a> {
    /// What the colours are.
    pub title: &'a str,
    /// What goes to the right.
    pub x_label: &'a str,
    /// What goes up.
    pub y_label: &'a str,
    /// Names of the columns.
    pub x: &'a [String],
    /// Names of the rows, from below.
    pub y: &'a [String],
    /// Row after row from below; NaN where there is none.
    pub values: &'a [f64],
}

/// Means of a result over groups of a parameter.
#[derive(Clone, Debug, Default)]
pub struct EffectPanel<'a> {
    /// The parameter.
    pub x_label: &'a str,
    /// The result.
    pub y_label: &'a str,
    /// Parameter, mean, standard error.
    pub points: Vec<[f64; 3]>,
}

/// A pair of numbers with intervals, side by side.
#[derive(Clone, Debug)]
pub struct BarPair<'a> {
    /// What they belong to.
    pub name: &'a str,
    /// Value, lower and upper end of its interval, of both.
    pub values: [[f64; 3]; 2],
}

/// Points of two results.
#[derive(Clone, Debug, Default)]
pub struct ScatterPlot<'a> {
    /// What goes to the right.
    pub x_label: &'a str,
    /// What goes up.
    pub y_label: &'a str,
    /// All points.
    pub points: &'a [[f64; 2]],
    /// Points that are joined and marked.
    pub front: &'a [[f64; 2]],
    /// A point that is marked more.
    pub best: Option<[f64; 2]>,
}

/// A frame with its scales.
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: (f64, f64),
    y: (f64, f64),
}

impl Frame {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let part = |v: f64, (low, high): (f64, f64)| if high > low { (v - low) / (high - low) } else { 0.5 };
        (self.left + self.width * part(x, self.x), self.top + self.height * (1.0 - part(y, self.y)))
    }

    /// The box, ticks and their numbers.
    fn draw(&self, out: &mut String, font: u32) {
        let Self { left, top, width, height, .. } = self;
        let _ = writeln!(
            out,
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"{LINE}\"/>"
        );
        for tick in ticks(self.x, ((width / 60.0) as usize).max(3)) {
            let (x, bottom) = (self.at(tick, self.y.0).0, top + height);
            let y = bottom + 4.0;
            let _ = writeln!(out, "<path d=\"M{x:.1} {bottom:.1}V{y:.1}\" stroke=\"{LINE}\"/>");
            text(out, (x, bottom + 5.0 + f64::from(font)), font, "middle", &shown(tick, self.x));
        }
        for tick in ticks(self.y, ((height / 40.0) as usize).max(3)) {
            let (y, x) = (self.at(self.x.0, tick).1, left - 4.0);
            let _ = writeln!(out, "<path d=\"M{left:.1} {y:.1}H{x:.1}\" stroke=\"{LINE}\"/>");
            text(out, (left - 6.0, y + 0.35 * f64::from(font)), font, "end", &shown(tick, self.y));
        }
    }
}

/// Round numbers within a range, about so many.
fn ticks((low, high): (f64, f64), most: usize) -> Vec<f64> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return vec![low];
    }
    let rough = span / most.clamp(2, 10) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|s| s * power).find(|s| *s >= rough).unwrap_or(10.0 * power);
    let first = (low / step).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|t| *t <= high + 1e-9 * span).take(20).collect()
}

/// A tick with the digits that its range needs.
fn shown(tick: f64, (low, high): (f64, f64)) -> String {
    let most = low.abs().max(high.abs());
    if tick == 0.0 || tick.abs() < 1e-12 * most {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&most) {
        return format!("{tick:.1e}");
    }
    let digits = (2 - (high - low).max(1e-9 * most).log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{tick:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn text(out: &mut String, (x, y): (f64, f64), font: u32, anchor: &str, words: &str) {
    let words = markup(words);
    let _ = writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{font}\" text-anchor=\"{anchor}\" {FONT} fill=\"#1c2530\">{words}</text>"
    );
}

/// Words that go up.
fn upright(out: &mut String, (x, y): (f64, f64), font: u32, words: &str) {
    let words = markup(words);
    let _ = writeln!(
        out,
        "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" font-size=\"{font}\" text-anchor=\"middle\" {FONT} fill=\"#1c2530\">{words}</text>"
    );
}

/// Distance of two lines of a label.
const LEADING: f64 = 14.0;
/// Height of a panel of effects.
const PANEL: f64 = 134.0;

/// A label in lines of at most `most` letters, broken behind points, underscores and blanks where that is possible. No letter is left
/// out: names that differ in one letter must not look the same.
fn wrapped(label: &str, most: usize) -> Vec<String> {
    let most = most.max(8);
    let mut lines: Vec<Vec<char>> = vec![Vec::new()];
    for piece in label.split_inclusive(['.', '_', ' ', '-', '[']) {
        let piece: Vec<char> = piece.chars().collect();
        let last = lines.len() - 1;
        match lines[last].len() + piece.len() <= most {
            true => lines[last].extend(piece),
            false => lines.extend(piece.chunks(most).map(<[char]>::to_vec)),
        }
    }
    lines.into_iter().filter(|line| !line.is_empty()).map(String::from_iter).collect()
}

/// Lines below each other, the first at the place.
fn text_lines(out: &mut String, (x, y): (f64, f64), font: u32, lines: &[String]) {
    for (k, line) in lines.iter().enumerate() {
        text(out, (x, y + LEADING * k as f64), font, "middle", line);
    }
}

/// Lines that go up, the first at the place and the others to its right.
fn upright_lines(out: &mut String, (x, y): (f64, f64), font: u32, lines: &[String]) {
    for (k, line) in lines.iter().enumerate() {
        upright(out, (x + LEADING * k as f64, y), font, line);
    }
}

fn polyline(out: &mut String, ink: &str, points: impl Iterator<Item = (f64, f64)>) {
    let line: Vec<String> = points.map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let _ =
        writeln!(out, "<polyline points=\"{}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.5\"/>", line.join(" "));
}

fn picture(width: f64, height: f64, inside: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{inside}</svg>\n"
    )
}

/// Least and largest of the finite numbers, with some room.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return (0.0, 1.0);
    }
    let room = match high > low {
        true => 0.05 * (high - low),
        false => 0.5 * low.abs().max(1e-12),
    };
    (low - room, high + room)
}

impl HeatMap<'_> {
    /// The picture, with a number in each cell if there is room.
    pub fn svg(&self) -> String {
        let (columns, rows) = (self.x.len().max(1), self.y.len().max(1));
        let cell = ((560.0 / columns as f64).clamp(14.0, 96.0), (360.0 / rows as f64).clamp(12.0, 120.0));
        let (width, height) = (cell.0 * columns as f64, cell.1 * rows as f64);
        let y_label = wrapped(self.y_label, (height / 7.5) as usize);
        let (left, top) = (92.0 + LEADING * y_label.len() as f64, 34.0);
        let finite = || self.values.iter().copied().filter(|x| x.is_finite());
        let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        let mut out = String::new();
        text(&mut out, (left, 20.0), 15, "start", self.title);
        for (k, value) in self.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let (column, row) = (k % columns, k / columns);
            let (x, y) = (left + cell.0 * column as f64, top + height - cell.1 * (row + 1) as f64);
            let part = if high > low { (value - low) / (high - low) } else { 0.5 };
            let fill = palette::hex(palette::magnitude(part));
            let number = shown(*value, (low, high));
            let _ = writeln!(
                out,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"><title>{}</title></rect>",
                cell.0 + 0.3,
                cell.1 + 0.3,
                markup(&format!("{}, {}: {value}", self.x[column], self.y[row]))
            );
            if cell.0 >= 44.0 && cell.1 >= 16.0 {
                let ink = if part < 0.5 { "#fff" } else { "#1c2530" };
                let (x, y) = (x + 0.5 * cell.0, y + 0.5 * cell.1 + 4.0);
                let _ = writeln!(
                    out,
                    "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"11\" text-anchor=\"middle\" {FONT} fill=\"{ink}\">{number}</text>"
                );
            }
        }
        // Not more names than have room.
        let every = (44.0 / cell.0).ceil().max(1.0) as usize;
        for (k, name) in self.x.iter().enumerate().step_by(every) {
            text(&mut out, (left + cell.0 * (k as f64 + 0.5), top + height + 16.0), 12, "middle", name);
        }
        let every = (14.0 / cell.1).ceil().max(1.0) as usize;
        for (k, name) in self.y.iter().enumerate().step_by(every) {
            text(&mut out, (left - 6.0, top + height - cell.1 * (k as f64 + 0.5) + 4.0), 12, "end", name);
        }
        let x_label = wrapped(self.x_label, ((width + 120.0) / 7.5) as usize);
        text_lines(&mut out, (left + 0.5 * width, top + height + 36.0), 13, &x_label);
        upright_lines(&mut out, (18.0, top + 0.5 * height), 13, &y_label);
        legend(&mut out, (left + width + 24.0, top), height, (low, high));
        let wide = (left + width + 130.0).max(left + 8.5 * self.title.chars().count() as f64);
        picture(wide, top + height + 33.0 + LEADING * x_label.len() as f64, &out)
    }
}

/// The scale with its ends.
fn legend(out: &mut String, (x, y): (f64, f64), height: f64, (low, high): (f64, f64)) {
    const STEPS: usize = 48;
    for k in 0..STEPS {
        let part = k as f64 / (STEPS - 1) as f64;
        let fill = palette::hex(palette::magnitude(part));
        let (top, step) = (y + height * (1.0 - (k + 1) as f64 / STEPS as f64), height / STEPS as f64 + 0.5);
        let _ = writeln!(out, "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"14\" height=\"{step:.1}\" fill=\"{fill}\"/>");
    }
    for tick in ticks((low, high), (height / 40.0) as usize) {
        let part = if high > low { (tick - low) / (high - low) } else { 0.5 };
        text(out, (x + 20.0, y + height * (1.0 - part) + 4.0), 12, "start", &shown(tick, (low, high)));
    }
}

/// Main effects in rows of panels, one row per result; panels of a row share their vertical scale.
pub fn effects(rows: &[Vec<EffectPanel<'_>>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0).max(1);
    let width = (900.0 / columns as f64).clamp(150.0, 320.0);
    let panels = || rows.iter().flatten();
    let below = |panel: &EffectPanel<'_>| wrapped(panel.x_label, (width / 6.5) as usize);
    let beside = |panel: &EffectPanel<'_>| wrapped(panel.y_label, (PANEL / 6.5) as usize);
    let most_below = panels().map(|panel| below(panel).len()).max().unwrap_or(1);
    let most_beside = panels().map(|panel| beside(panel).len()).max().unwrap_or(1);
    let (left, height) = (48.0 + LEADING * most_beside as f64, PANEL + 42.0 + LEADING * most_below as f64);
    let ink = palette::hex(palette::series(0, Ground::Paper));
    let mut out = String::new();
    for (row, panels) in rows.iter().enumerate() {
        let all = panels.iter().flat_map(|panel| panel.points.iter().flat_map(|p| [p[1] - p[2], p[1] + p[2]]));
        let y = range(all);
        for (column, panel) in panels.iter().enumerate() {
            let frame = Frame {
                left: left + width * column as f64,
                top: 12.0 + height * row as f64,
                width: width - 66.0,
                height: PANEL,
                x: range(panel.points.iter().map(|p| p[0])),
                y,
            };
            frame.draw(&mut out, 10);
            polyline(&mut out, &ink, panel.points.iter().map(|p| frame.at(p[0], p[1])));
            for [x, mean, error] in &panel.points {
                let ((x, y), low, high) =
                    (frame.at(*x, *mean), frame.at(*x, mean - error).1, frame.at(*x, mean + error).1);
                let _ = writeln!(
                    out,
                    "<path d=\"M{x:.1} {low:.1}V{high:.1}\" stroke=\"{ink}\"/><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{ink}\"/>"
                );
            }
            let middle = frame.left + 0.5 * frame.width;
            text_lines(&mut out, (middle, frame.top + frame.height + 32.0), 11, &below(panel));
            if column == 0 {
                upright_lines(&mut out, (12.0, frame.top + 0.5 * frame.height), 11, &beside(panel));
            }
        }
    }
    picture(left + width * columns as f64 - 28.0, height * rows.len().max(1) as f64 + 8.0, &out)
}

/// Pairs of bars with intervals.
///
/// * `names`: of both.
pub fn bar_pairs(title: &str, names: [&str; 2], pairs: &[BarPair<'_>]) -> String {
    let longest = pairs.iter().map(|pair| pair.name.chars().count()).max().unwrap_or(0);
    let (left, step) = ((7.0 * longest as f64 + 20.0).max(230.0), 40.0);
    let (width, top) = (480.0, 52.0);
    let high = pairs.iter().flat_map(|pair| pair.values.iter().map(|v| v[2])).fold(1.0, f64::max);
    let low = pairs.iter().flat_map(|pair| pair.values.iter().map(|v| v[1])).fold(0.0, f64::min);
    let height = step * pairs.len() as f64;
    let frame = Frame { left, top, width, height, x: (low, high), y: (0.0, 1.0) };
    let inks = [0, 1].map(|k| palette::hex(palette::series(k, Ground::Paper)));
    let mut out = String::new();
    text(&mut out, (12.0, 20.0), 15, "start", title);
    for (k, name) in names.iter().enumerate() {
        let x = left + 150.0 * k as f64;
        let _ = writeln!(out, "<rect x=\"{x:.1}\" y=\"30\" width=\"14\" height=\"12\" fill=\"{}\"/>", inks[k]);
        text(&mut out, (x + 20.0, 41.0), 12, "start", name);
    }
    for (row, pair) in pairs.iter().enumerate() {
        let y = top + step * row as f64;
        text(&mut out, (left - 8.0, y + 0.5 * step + 4.0), 12, "end", pair.name);
        for (k, [value, from, to]) in pair.values.iter().enumerate() {
            let y = y + 5.0 + 15.0 * k as f64;
            let (zero, end) = (frame.at(0.0, 0.0).0, frame.at(*value, 0.0).0);
            let (x, wide) = (zero.min(end), (end - zero).abs());
            let (from, to, middle) = (frame.at(*from, 0.0).0, frame.at(*to, 0.0).0, y + 6.5);
            let _ = writeln!(
                out,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{wide:.1}\" height=\"13\" fill=\"{}\" fill-opacity=\"0.75\"/>\
                 <path d=\"M{from:.1} {middle:.1}H{to:.1}M{from:.1} {:.1}v6M{to:.1} {:.1}v6\" stroke=\"#1c2530\"/>",
                inks[k],
                middle - 3.0,
                middle - 3.0
            );
        }
    }
    for tick in ticks((low, high), 6) {
        let x = frame.at(tick, 0.0).0;
        let _ = writeln!(
            out,
            "<path d=\"M{x:.1} {top:.1}V{:.1}\" stroke=\"{LINE}\" stroke-opacity=\"0.4\"/>",
            top + height
        );
        text(&mut out, (x, top + height + 16.0), 11, "middle", &shown(tick, (low, high)));
    }
    picture(left + width + 30.0, top + height + 28.0, &out)
}

impl ScatterPlot<'_> {
    /// The picture.
    pub fn svg(&self) -> String {
        let all = || self.points.iter().chain(self.front);
        let frame = Frame {
            left: 84.0,
            top: 14.0,
            width: 620.0,
            height: 360.0,
            x: range(all().map(|p| p[0])),
            y: range(all().map(|p| p[1])),
        };
        let [grey, ink] = [palette::rigid(Ground::Paper), palette::series(1, Ground::Paper)].map(palette::hex);
        let mut out = String::new();
        frame.draw(&mut out, 11);
        dots(&mut out, &frame, self.points, 2.2, &grey, 0.5);
        polyline(&mut out, &ink, self.front.iter().map(|p| frame.at(p[0], p[1])));
        dots(&mut out, &frame, self.front, 3.5, &ink, 1.0);
        if let Some(best) = self.best {
            let (x, y) = frame.at(best[0], best[1]);
            let _ = writeln!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"none\" stroke=\"#1c2530\" stroke-width=\"2\"/>"
            );
        }
        text(&mut out, (frame.left + 0.5 * frame.width, frame.top + frame.height + 36.0), 13, "middle", self.x_label);
        upright(&mut out, (18.0, frame.top + 0.5 * frame.height), 13, self.y_label);
        picture(730.0, 424.0, &out)
    }
}

fn dots(out: &mut String, frame: &Frame, points: &[[f64; 2]], radius: f64, ink: &str, opacity: f64) {
    let _ = writeln!(out, "<g fill=\"{ink}\" fill-opacity=\"{opacity}\">");
    for [x, y] in points.iter().filter(|p| p.iter().all(|x| x.is_finite())) {
        let (x, y) = frame.at(*x, *y);
        let _ = writeln!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>");
    }
    out.push_str("</g>\n");
}

/// Every column over every other one: points below the diagonal, the correlation of the ranks above it, counts on it.
///
/// * `columns`: name and values, equally many.
pub fn scatter_matrix(columns: &[(&str, &[f64])]) -> String {
    let n = columns.len().max(1);
    let cell = (900.0 / n as f64).clamp(70.0, 170.0);
    let (left, top) = (16.0, 8.0);
    let ranges: Vec<(f64, f64)> = columns.iter().map(|(_, values)| range(values.iter().copied())).collect();
    let ink = palette::hex(palette::series(0, Ground::Paper));
    let mut out = String::new();
    for (row, (_, y)) in columns.iter().enumerate() {
        for (column, (name, x)) in columns.iter().enumerate() {
            let frame = Frame {
                left: left + cell * column as f64,
                top: top + cell * row as f64,
                width: cell - 4.0,
                height: cell - 4.0,
                x: ranges[column],
                y: ranges[row],
            };
            let Frame { left, top, width, height, .. } = frame;
            let _ = writeln!(
                out,
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" stroke=\"#d8dee6\"/>"
            );
            let middle = (left + 0.5 * width, top + 0.5 * height);
            match column.cmp(&row) {
                std::cmp::Ordering::Less => {
                    let points: Vec<[f64; 2]> = x.iter().zip(*y).map(|(x, y)| [*x, *y]).collect();
                    dots(&mut out, &frame, &points, 1.3, &ink, 0.45);
                }
                std::cmp::Ordering::Equal => {
                    histogram(&mut out, &frame, x);
                    text_lines(&mut out, (middle.0, top + 14.0), 11, &wrapped(name, (cell / 6.5) as usize));
                }
                std::cmp::Ordering::Greater => {
                    let rank = rank_correlation(x, y);
                    if rank.is_finite() {
                        let size = 10 + (10.0 * rank.abs()) as u32;
                        let place = (middle.0, middle.1 + 0.35 * f64::from(size));
                        text(&mut out, place, size, "middle", &format!("{rank:.2}"));
                    }
                }
            }
        }
    }
    picture(left + cell * n as f64 + 8.0, top + cell * n as f64 + 8.0, &out)
}

fn histogram(out: &mut String, frame: &Frame, values: &[f64]) {
    const BINS: usize = 14;
    let mut counts = [0usize; BINS];
    let (low, high) = frame.x;
    for x in values.iter().filter(|x| x.is_finite()) {
        counts[(((x - low) / (high - low).max(f64::MIN_POSITIVE) * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    for (k, count) in counts.iter().enumerate() {
        let (wide, high) = (frame.width / BINS as f64, 0.75 * frame.height * *count as f64 / most);
        let (x, y) = (frame.left + wide * k as f64, frame.top + frame.height - high);
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\" fill=\"#c9d6e4\"/>"
        );
    }
}

/// Correlation of the ranks (Spearman); NaN where one of both does not vary.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let pairs: Vec<(f64, f64)> =
        x.iter().copied().zip(y.iter().copied()).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
    let (a, b) = (ranks(&a), ranks(&b));
    let mean = (a.len() as f64 - 1.0) / 2.0;
    let sum = |f: &dyn Fn(usize) -> f64| (0..a.len()).map(f).sum::<f64>();
    let (xy, xx, yy) =
        (sum(&|k| (a[k] - mean) * (b[k] - mean)), sum(&|k| (a[k] - mean).powi(2)), sum(&|k| (b[k] - mean).powi(2)));
    xy / (xx * yy).sqrt()
}

/// Places in ascending order; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|i, j| values[*i].total_cmp(&values[*j]));
    let mut ranks = vec![0.0; values.len()];
    let mut place = 0.0;
    for equal in order.chunk_by(|i, j| values[*i] == values[*j]) {
        let mean = place + 0.5 * (equal.len() as f64 - 1.0);
        equal.iter().for_each(|k| ranks[*k] = mean);
        place += equal.len() as f64;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: Spearman's coefficient of a rising curve is 1, of a falling one -1; 1, 2, 3, 4 against 2, 1, 4, 3 by the formula
    /// 1 - 6 sum d^2 / (n (n^2 - 1)) = 0.6.
    #[test]
    fn rank_correlations_are_those_of_the_formula() {
        let x = [1.0, 2.0, 3.0, 4.0];
        assert!((rank_correlation(&x, &x.map(|x: f64| x.exp())) - 1.0).abs() < 1e-15);
        assert!((rank_correlation(&x, &x.map(|x| -x * x * x)) + 1.0).abs() < 1e-15);
        assert!((rank_correlation(&x, &[2.0, 1.0, 4.0, 3.0]) - 0.6).abs() < 1e-15);
        assert!(rank_correlation(&x, &[1.0; 4]).is_nan());
    }

    #[test]
    fn ticks_are_round_numbers_within_the_range() {
        assert_eq!(ticks((0.0, 1.0), 5), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(ticks((30.0, 210.0), 4), [50.0, 100.0, 150.0, 200.0]);
        assert_eq!(ticks((2.0, 2.0), 4), [2.0]);
        assert_eq!((shown(0.6000000000000001, (0.0, 1.0)), shown(50.0, (30.0, 210.0))), ("0.6".into(), "50".into()));
    }

    /// The letters of all texts of a picture, one after the other.
    fn texts(svg: &str) -> String {
        svg.split("</text>").filter_map(|part| part.rsplit_once('>')).map(|(_, words)| words).collect()
    }

    #[test]
    fn names_that_end_alike_stay_apart_in_every_chart() {
        let names: Vec<String> =
            (1..=6).map(|k| format!("drive.joint_{k}.gearbox.stiffness (% of the file)")).collect();
        let points = vec![[1.0, 2.0, 0.1], [2.0, 3.0, 0.1]];
        let y_label = "links.link_2.peak_contribution_m / links.link_3.peak_contribution_m";
        let panel = |name| EffectPanel { x_label: name, y_label, points: points.clone() };
        let panels = names.iter().map(|name| panel(name)).collect();
        let values = [1.0, 2.0];
        let columns: Vec<(&str, &[f64])> = names.iter().map(|name| (name.as_str(), &values[..])).collect();
        let bar = |name| BarPair { name, values: [[0.5, 0.4, 0.6]; 2] };
        let bars: Vec<BarPair<'_>> = names.iter().map(|name| bar(name)).collect();
        let charts = [effects(&[panels]), scatter_matrix(&columns), bar_pairs("t", ["a", "b"], &bars)];
        for (svg, name) in charts.iter().flat_map(|svg| names.iter().map(move |name| (svg, name))) {
            assert!(texts(svg).contains(name.as_str()), "{name} is not whole in {}", texts(svg));
        }
        assert!(texts(&charts[0]).contains(y_label));
        let cells = ["1", "2"].map(str::to_owned);
        let map = HeatMap { title: "t", x_label: &names[0], y_label, x: &cells, y: &cells, values: &[1.0; 4] }.svg();
        assert!(texts(&map).contains(y_label) && texts(&map).contains(names[0].as_str()));
        assert_eq!(wrapped("drive.joint_2.gearbox", 10), ["drive.", "joint_2.", "gearbox"]);
        assert_eq!(wrapped("abcdefghijklmnop", 8), ["abcdefgh", "ijklmnop"]);
    }

    #[test]
    fn charts_of_nothing_and_of_what_does_not_vary_are_pictures_without_nan() {
        let names = ["a <b>".to_owned(), "c".to_owned()];
        let map =
            HeatMap { title: "t", x_label: "x", y_label: "y", x: &names, y: &names[..1], values: &[1.0, f64::NAN] };
        let panel = EffectPanel { x_label: "x", y_label: "y", points: vec![[1.0, 2.0, 0.0]] };
        let pair = BarPair { name: "p", values: [[0.5, 0.4, 0.6], [0.7, 0.6, 0.9]] };
        let plot = ScatterPlot {
            points: &[[1.0, f64::NAN], [1.0, 1.0]],
            front: &[[1.0, 1.0]],
            best: Some([1.0, 1.0]),
            ..ScatterPlot::default()
        };
        let matrix = scatter_matrix(&[("a", &[1.0, 1.0]), ("b", &[f64::NAN, 2.0])]);
        for svg in [
            map.svg(),
            effects(&[vec![panel]]),
            bar_pairs("t", ["first", "total"], &[pair]),
            plot.svg(),
            matrix,
            effects(&[]),
            scatter_matrix(&[]),
        ] {
            assert!(
                svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"),
                "{svg}"
            );
            assert!(!svg.contains("<b>"));
        }
    }
}
