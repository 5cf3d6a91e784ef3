//! Figures of a run on a terminal: a grouped table and a small plot of the error over time.
//!
//! Text is styled with ANSI codes; they are removed if the output is not a terminal
//! (`crate::answer`).

use anstyle::{AnsiColor, Style};
use flexarm::Summary;
use flexarm::recordings::{ContentLevel, RecordingFormat};
use flexarm::report::{Figure, Weight, figure_groups};
use flexarm::runs::{Files, STUDY_NOTE, study_rows};
use flexarm::settings::written::one_line;

use crate::layout::{MIN_WIDTH, columns, table, wrapped};

/// Maximum width of the plot (columns); a wider one is no clearer.
const WIDEST_PLOT: usize = 100;
/// Height of the plot (rows of text).
const PLOT_ROWS: usize = 4;
/// Dots of a braille character, horizontally and vertically.
const DOTS: (usize, usize) = (2, 4);

const HEADING: Style = Style::new().bold();
const FAINT: Style = Style::new().dimmed();
/// Style of the headline and its figure.
pub const HEADLINE: Style = AnsiColor::Cyan.on_default().bold();
/// Style of a run that stopped early.
pub const ALERT: Style = AnsiColor::Red.on_default().bold();

/// Formats the figures of a run at a given width.
pub fn summary(summary: &Summary, width: usize) -> String {
    let width = width.max(MIN_WIDTH);
    let (robot, trajectory, links) =
        (one_line(&summary.robot), one_line(&summary.trajectory), one_line(&summary.links_model));
    let mut out = String::new();
    for line in wrapped(&one_line(&summary.headline), width) {
        out += &format!("{HEADLINE}{line}{HEADLINE:#}\n");
    }
    out += &format!("{HEADING}{robot} on {trajectory}{HEADING:#}, {links} links\n");
    let mut groups = figure_groups(summary);
    for row in groups.iter_mut().flat_map(|group| &mut group.rows) {
        (row.name, row.value, row.note) = (one_line(&row.name), one_line(&row.value), one_line(&row.note));
    }
    let all = || groups.iter().flat_map(|group| &group.rows);
    let widest = |of: fn(&Figure) -> &str| all().map(|row| columns(of(row))).max().unwrap_or(0);
    let (names, values, units) = (widest(|row| &row.name), widest(|row| &row.value), widest(|row| row.unit));
    for group in &groups {
        out += &format!("\n{HEADING}{}{HEADING:#}\n", group.title);
        for row in &group.rows {
            let style = match row.weight {
                Weight::Plain => Style::new(),
                Weight::Headline => HEADLINE,
                Weight::Alert => ALERT,
            };
            // Pad by columns, not by bytes.
            let name = format!("  {}{}", row.name, " ".repeat(names - columns(&row.name)));
            let value = format!("{}{}", " ".repeat(values - columns(&row.value)), row.value);
            let unit = format!("{}{}", row.unit, " ".repeat(units - columns(row.unit)));
            let before = columns(&name) + 2 + columns(&value) + 1 + columns(&unit) + 2;
            let width_left = width.saturating_sub(before);
            // Notes get separate lines if their column would be too narrow.
            let (indent, width_left) = if width_left < 20 { (4, width - 4) } else { (before, width_left) };
            let mut notes = wrapped(&row.note, width_left).into_iter();
            let first = if indent == before { notes.next().unwrap_or_default() } else { String::new() };
            let text = format!("{name}  {value} {unit}");
            out += &match first.is_empty() {
                true => format!("{style}{}{style:#}\n", text.trim_end()),
                false => format!("{style}{text}{style:#}  {first}\n"),
            };
            for note in notes {
                out += &format!("{}{note}\n", " ".repeat(indent));
            }
        }
    }
    if summary.tcp.is_some() {
        out += &plot(summary, width.min(WIDEST_PLOT));
    }
    out += &study(summary, width);
    out + &files(&summary.files)
}

/// Lists the files, and how to view them.
fn files(f: &Files) -> String {
    let mut out = String::new();
    // Recordings for viewers come before those for programs.
    let mut recordings: Vec<(RecordingFormat, &str)> = f.recordings.iter().collect();
    recordings.sort_by_key(|(format, _)| format.info().content != ContentLevel::Pictures);
    let recordings = recordings.iter().map(|(format, path)| (format.info().name, Some(*path)));
    let pages = [("report", f.report.as_deref()), ("stress", f.stress.as_deref()), ("study", f.study.as_deref())];
    let files = pages.into_iter().chain(recordings).chain([("figures", f.figures.as_deref())]);
    let mut files = files.filter_map(|(what, path)| path.map(|path| (what, path))).peekable();
    if files.peek().is_some() {
        out += &format!("\n{HEADING}files{HEADING:#}\n");
    }
    for (what, path) in files {
        out += &format!("  {what:<7}  {}\n", one_line(path));
    }
    if let Some(path) = f.study.as_deref().or(f.recordings.get(RecordingFormat::Rrd)) {
        out += &format!("  look:    flexarm view {}\n", one_line(path));
    }
    out
}

/// Table of the runs of a study.
fn study(summary: &Summary, width: usize) -> String {
    let rows = study_rows(summary);
    let Some((header, runs)) = rows.split_first() else { return String::new() };
    let mut runs_table = table(header);
    runs.iter().for_each(|row| runs_table.add_row(row));
    let mut out = format!("\n{HEADING}runs{HEADING:#}\n{}", runs_table.text(width));
    for run in std::iter::once(summary).chain(&summary.with).filter(|run| !run.headline.is_empty()) {
        let text = format!("{}: {}", run.label.as_deref().unwrap_or_default(), run.headline);
        out += &wrapped(&one_line(&text), width).iter().map(|line| format!("{line}\n")).collect::<String>();
    }
    for line in wrapped(STUDY_NOTE, width) {
        out += &format!("{FAINT}{line}{FAINT:#}\n");
    }
    out
}

/// Plots the magnitude of the TCP error over time in braille dots, with the maximum, the time span
/// and the moving phases.
fn plot(summary: &Summary, width: usize) -> String {
    let curve = &summary.error_curve;
    let top = curve.iter().copied().filter(|e| e.is_finite()).fold(0.0, f64::max);
    if top <= 0.0 || curve.len() < 2 {
        return String::new();
    }
    let label = format!("{:.3}", 1e3 * top);
    let margin = columns(&label) + 2;
    let cells = width - margin - 3;
    let dots = DOTS.0 * cells;
    let height = DOTS.1 * PLOT_ROWS;
    // Maximum of each column of dots, and its height.
    let value = |x: usize| {
        let range = x * curve.len() / dots..((x + 1) * curve.len()).div_ceil(dots).min(curve.len());
        curve[range].iter().copied().filter(|e| e.is_finite()).fold(0.0, f64::max)
    };
    let place = |x: usize| ((value(x) / top * (height - 1) as f64).round() as usize).min(height - 1);
    let mut grid = vec![vec![0_u8; cells]; PLOT_ROWS];
    let mut last = place(0);
    for x in 0..dots {
        let now = place(x);
        for y in last.min(now)..=last.max(now) {
            let (row, bit) = (PLOT_ROWS - 1 - y / DOTS.1, dot(x % DOTS.0, y % DOTS.1));
            grid[row][x / DOTS.0] |= bit;
        }
        last = now;
    }
    let mut out = format!("\n{HEADING}TCP error over time{HEADING:#}, mm\n");
    for (row, line) in grid.iter().enumerate() {
        let (label, tick) = if row == 0 { (label.as_str(), '┤') } else { ("", '│') };
        let line: String = line.iter().map(|bits| char::from_u32(0x2800 + u32::from(*bits)).unwrap_or(' ')).collect();
        let width_left = margin - 2;
        out += &format!("  {label:>width_left$} {tick}{HEADLINE}{line}{HEADLINE:#}\n");
    }
    // The axis is thick while the robot moves.
    let span = summary.duration_s.max(1e-12);
    let moving = |cell: usize| {
        let t = span * (cell as f64 + 0.5) / cells as f64;
        summary.moves_s.iter().any(|[start, end]| (*start..=*end).contains(&t))
    };
    let axis: String = (0..cells).map(|cell| if moving(cell) { '━' } else { '─' }).collect();
    let left = margin - 2;
    out += &format!("  {:>left$} └{axis}\n", 0);
    let end = format!("{span:.2} s");
    let key = if summary.moves_s.is_empty() { "" } else { "━ moves" };
    let width_left = cells.saturating_sub(1 + columns(&end));
    out += &format!("{}0{FAINT}{key:^width_left$}{FAINT:#}{end}\n", " ".repeat(margin + 2));
    out
}

/// Bit of a dot in a braille character, counted from the left and from the bottom.
fn dot(x: usize, y: usize) -> u8 {
    const BITS: [[u8; 4]; 2] = [[0x40, 0x04, 0x02, 0x01], [0x80, 0x20, 0x10, 0x08]];
    BITS[x][y]
}
