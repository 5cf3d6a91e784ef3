//! Comparison of finished runs: their distances from the first one, and the table of their figures.
//!
//! Positions in the world, m, s. Not here: running them (`study`), the page (`report::html`).

use flexarm_log::{Trace, TraceRow};
use flexarm_settings::written::{markdown, markdown_row};

use crate::run::summary::{DifferenceFigures, Summary, TcpFigures};

/// Whether two runs are of one robot: the same name and joints, or rigid TCPs at the same
/// positions. Differences between other runs are meaningless.
pub(crate) fn of_one_robot(first: &Trace, other: &Trace) -> bool {
    let (a, b) = (&first.header, &other.header);
    let one_name = a.robot == b.robot || a.robot.is_empty() || b.robot.is_empty();
    (one_name && a.joints == b.joints) || on_one_motion(first, other)
}

/// Distance of a run's TCP from that of the first run, at the first run's times; `None` for motions
/// of different duration and for other robots.
///
/// On the same motion the rigid TCPs coincide, so the errors are compared: they are small, and so
/// is the interpolation error between samples. Otherwise the positions are compared.
pub(crate) fn difference(first: &Trace, other: &Trace) -> Option<DifferenceFigures> {
    if !of_one_robot(first, other) {
        return None;
    }
    let (end, other_end) = (first.rows.last()?.time_s, other.rows.last()?.time_s);
    // The last step may pass the end of the motion.
    let slack = first.header.step_s.max(other.header.step_s).max(1e-6 * end.max(1.0));
    if (end - other_end).abs() > slack {
        return None;
    }
    let error = |row: &TraceRow| -> [f64; 3] { std::array::from_fn(|c| row.error_world[c]) };
    let place = |row: &TraceRow| row.flexible_m;
    let of_row: &dyn Fn(&TraceRow) -> [f64; 3] = if on_one_motion(first, other) { &error } else { &place };
    let values: Vec<[f64; 3]> = other.rows.iter().map(of_row).collect();
    let (mut peak_m, mut t_peak_s, mut sum, mut count, mut k) = (0.0f64, 0.0, 0.0, 0, 0);
    for row in first.rows.iter().filter(|row| row.time_s <= other_end + SAME_TIME) {
        while k + 2 < other.rows.len() && other.rows[k + 1].time_s < row.time_s {
            k += 1;
        }
        let value = between(&other.rows, &values, k, row.time_s);
        let own = of_row(row);
        let square: f64 = (0..3).map(|c| (value[c] - own[c]).powi(2)).sum();
        sum += square;
        count += 1;
        if square.sqrt() > peak_m {
            (peak_m, t_peak_s) = (square.sqrt(), row.time_s);
        }
    }
    let largest = first.rows.iter().map(|row| row.error_m()).fold(0.0, f64::max);
    Some(DifferenceFigures {
        peak_m,
        t_peak_s,
        rms_m: (sum / f64::from(count.max(1))).sqrt(),
        of_peak_error: (largest > 0.0).then(|| peak_m / largest),
    })
}

/// Whether the rigid TCPs are at the same positions at the common times of both runs.
fn on_one_motion(first: &Trace, other: &Trace) -> bool {
    if !(first.header.has_rigid && other.header.has_rigid) {
        return false;
    }
    let (mut k, mut common) = (0, 0);
    for row in &first.rows {
        while k < other.rows.len() && other.rows[k].time_s < row.time_s - SAME_TIME {
            k += 1;
        }
        let Some(there) = other.rows.get(k).filter(|there| (there.time_s - row.time_s).abs() <= SAME_TIME) else {
            continue;
        };
        if (0..3).any(|c| (there.rigid_m[c] - row.rigid_m[c]).abs() > SAME_PLACE) {
            return false;
        }
        common += 1;
    }
    // Many motions have the start in common.
    common > 1 || first.header.trajectory == other.header.trajectory
}

/// Tolerance for equal times (s).
const SAME_TIME: f64 = 1e-10;

/// Tolerance for equal positions (m): rigid TCPs that differ by round-off, including that of the
/// sample times.
const SAME_PLACE: f64 = 1e-9;

/// Interpolates at `t` between the samples k and k + 1: a cubic whose slopes are those of the
/// chords between the neighbours.
fn between(rows: &[TraceRow], values: &[[f64; 3]], k: usize, t: f64) -> [f64; 3] {
    let last = rows.len() - 1;
    let next = (k + 1).min(last);
    let span = rows[next].time_s - rows[k].time_s;
    if span <= 0.0 {
        return values[k];
    }
    let x = ((t - rows[k].time_s) / span).clamp(0.0, 1.0);
    let slope = |i: usize, c: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        (values[b][c] - values[a][c]) / (rows[b].time_s - rows[a].time_s)
    };
    std::array::from_fn(|c| {
        let (p, q) = (values[k][c], values[next][c]);
        let (m, n) = (span * slope(k, c), span * slope(next, c));
        // This form reproduces the samples exactly.
        let bend = (m - (q - p)) * (1.0 - x) - (n - (q - p)) * x;
        p + x * (q - p) + x * (1.0 - x) * bend
    })
}

/// Returns the table of the runs of a study: a header with units, then one row per run. Empty for a
/// single run.
pub fn study_rows(summary: &Summary) -> Vec<Vec<String>> {
    if summary.with.is_empty() {
        return Vec::new();
    }
    let header = [
        "run",
        "peak [mm]",
        "at [s]",
        "static [mm]",
        "dynamic [mm]",
        "RMS [mm]",
        "sag [mm]",
        "end [mm]",
        "settling [s]",
        "f1 [Hz]",
        "apart [mm]",
        "of peak [%]",
        "CPU [ms/s]",
    ];
    // A dash where a run does not have the figure.
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for run in std::iter::once(summary).chain(&summary.with) {
        let tcp = run.tcp.as_ref();
        let mm = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{:.4}", 1e3 * x));
        let plain = |x: Option<f64>, digits: usize| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
        let apart = run.difference.as_ref();
        rows.push(vec![
            run.label.clone().unwrap_or_default(),
            mm(tcp.map(|t| t.peak_m)),
            plain(tcp.map(|t| t.t_peak_s), 3),
            mm(tcp.and_then(|t| t.static_at_peak_m)),
            mm(tcp.and_then(|t| t.dynamic_peak_m)),
            mm(tcp.map(|t| t.rms_m)),
            mm(tcp.map(|t| t.static_sag_m)),
            mm(tcp.map(|t| t.end_m)),
            tcp.map(TcpFigures::settling_state).map_or_else(
                || "-".to_owned(),
                |settling| settling.time_s().map_or_else(|| settling.short().to_owned(), |s| format!("{s:.3}")),
            ),
            plain(run.frequencies_hz.first().copied(), 2),
            mm(apart.map(|d| d.peak_m)),
            plain(apart.and_then(|d| d.of_peak_error).map(|x| 100.0 * x), 3),
            format!("{:.1}", 1e3 * run.cpu_s_per_simulated_s),
        ]);
    }
    rows
}

/// Explanation of the columns of [`study_rows`] that need one.
pub const STUDY_NOTE: &str = "static: static deflection at the pose of the peak; dynamic: maximum of the rest; settling: at the stop that takes \
     longest; apart: maximum distance of the flexible TCP from that of the first run at the same time, also over the \
     first run's peak TCP error; not given between different robots";

/// Table of the runs in Markdown.
pub(crate) fn table(summary: &Summary) -> String {
    let mut page = String::new();
    let runs = study_rows(summary);
    // A row per figure: a recording's window is narrow. It contains no timings of this machine.
    for k in 0..runs.first().map_or(0, |head| head.len() - 1) {
        page += &markdown_row(&runs.iter().map(|run| run[k].clone()).collect::<Vec<_>>());
        if k == 0 {
            page += &format!("|{}\n", " --- |".repeat(runs.len()));
        }
    }
    page += &format!("\n{STUDY_NOTE}.\n");
    for run in std::iter::once(summary).chain(&summary.with).filter(|run| !run.headline.is_empty()) {
        let label = run.label.as_deref().unwrap_or_default();
        page += &format!("\n* {}: {}", markdown(label), markdown(&run.headline));
    }
    page + "\n"
}
