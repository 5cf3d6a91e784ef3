//! The page of a study: figures, heat maps, main effects, sensitivities, Pareto front, scatter matrix, the best run; one file without
//! scripts.

use std::fmt::Write as _;

use flexarm_draw::charts::{BarPair, EffectPanel, HeatMap, ScatterPlot, bar_pairs, effects, scatter_matrix};
use flexarm_draw::{CurveLook, LinePlot, Panel, PlotCurve};
use flexarm_study::main_effect;

use super::Sweep;
use super::file::Values;
use super::results::{Columns, SweepSummary};
use crate::html_page::opening;
use flexarm_settings::written::markup;

/// Results that have pictures of their own.
const MOST_METRICS: usize = 4;
/// Columns of the scatter matrix.
const MOST_COLUMNS: usize = 8;
/// Points of a scatter plot.
const MOST_POINTS: usize = 1500;
/// Panels in a row of effects.
const MOST_PANELS: usize = 6;
/// Values of a parameter that each have a row or column of a heat map.
const MOST_CELLS: usize = 24;
/// Rows or columns of others.
const BINS: usize = 10;

impl Sweep {
    /// The page of what is there.
    pub(super) fn page(&self, summary: &SweepSummary, columns: &Columns) -> String {
        let mut page = opening(&format!("Study {}", summary.study), "");
        let _ = writeln!(
            page,
            "<p>{} of {} runs done, {} failed. Robot {}, varied: {}.</p>",
            summary.done,
            summary.runs,
            summary.failed,
            markup(&self.file.robot.text),
            markup(&self.parameters().join(", "))
        );
        for failure in &summary.failures {
            let (runs, first, reason) = (failure.runs, failure.first, markup(&failure.reason));
            let _ = writeln!(page, "<p class=\"no\">{runs} runs failed, first run {first}: {reason}</p>");
        }
        page += &search(summary);
        page += &figures(summary);
        page += &best(summary);
        page += &self.heat_maps(columns);
        page += &self.main_effects(columns);
        page += &sensitivities(summary);
        page += &self.pareto_plot(summary, columns);
        page += &self.matrix(columns);
        page + "</body></html>\n"
    }

    /// Numeric parameters that vary, those that make most of the first result's variance first.
    fn strongest(&self, columns: &Columns, metric: usize) -> Vec<(usize, f64)> {
        let share = |(k, x): (usize, &Option<Vec<f64>>)| {
            // What follows from others shows what they show.
            let follows = matches!(self.design.columns[k].values, Values::Derived(_));
            let effect = main_effect(x.as_ref().filter(|_| !follows)?, &columns.metrics[metric])?;
            Some((k, effect.share))
        };
        let mut found: Vec<(usize, f64)> = columns.parameters.iter().enumerate().filter_map(share).collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        found
    }

    fn heat_maps(&self, columns: &Columns) -> String {
        let mut out = String::new();
        for (k, metric) in self.metrics.iter().enumerate().take(MOST_METRICS) {
            let strongest = self.strongest(columns, k);
            let [(a, _), (b, _), ..] = strongest[..] else { continue };
            let (Some(x), Some(y)) = (&columns.parameters[a], &columns.parameters[b]) else { continue };
            let ((x_names, x_cells), (y_names, y_cells)) = (cells(x), cells(y));
            let mut sums = vec![(0.0, 0usize); x_names.len() * y_names.len()];
            for (row, value) in columns.metrics[k].iter().enumerate().filter(|(_, value)| value.is_finite()) {
                let (Some(x), Some(y)) = (x_cells[row], y_cells[row]) else { continue };
                let cell = &mut sums[y * x_names.len() + x];
                *cell = (cell.0 + value, cell.1 + 1);
            }
            let values: Vec<f64> =
                sums.iter().map(|(sum, n)| if *n > 0 { sum / *n as f64 } else { f64::NAN }).collect();
            let most = sums.iter().map(|(_, n)| *n).max().unwrap_or(0);
            let title = if most > 1 {
                format!("{} (mean over the other parameters)", metric.name)
            } else {
                metric.name.clone()
            };
            let map = HeatMap {
                title: &title,
                x_label: &self.design.columns[a].name,
                y_label: &self.design.columns[b].name,
                x: &x_names,
                y: &y_names,
                values: &values,
            };
            let _ = writeln!(out, "<div>{}</div>", map.svg());
        }
        headed("Heat maps of the two parameters that matter most", out)
    }

    fn main_effects(&self, columns: &Columns) -> String {
        let mut rows = Vec::new();
        for (k, metric) in self.metrics.iter().enumerate().take(MOST_METRICS) {
            let mut panels = Vec::new();
            for (p, _) in self.strongest(columns, k).into_iter().take(MOST_PANELS) {
                let Some(effect) = columns.parameters[p].as_ref().and_then(|x| main_effect(x, &columns.metrics[k]))
                else {
                    continue;
                };
                panels.push(EffectPanel {
                    x_label: &self.design.columns[p].name,
                    y_label: &metric.name,
                    points: effect.groups.iter().map(|g| [g.x, g.mean, g.std_error]).collect(),
                });
            }
            if !panels.is_empty() {
                rows.push(panels);
            }
        }
        let picture = if rows.is_empty() { String::new() } else { format!("<div>{}</div>\n", effects(&rows)) };
        headed("Main effects (means with their standard errors, the strongest first)", picture)
    }

    fn pareto_plot(&self, summary: &SweepSummary, columns: &Columns) -> String {
        let Some(pareto) = &summary.pareto else { return String::new() };
        let place = |name: &String| self.metrics.iter().position(|metric| metric.name == *name);
        let (Some(a), Some(b)) = (place(&pareto.metrics[0]), place(&pareto.metrics[1])) else { return String::new() };
        let every = columns.runs.len().div_ceil(MOST_POINTS).max(1);
        let all = columns.metrics[a].iter().zip(&columns.metrics[b]).step_by(every);
        let points: Vec<[f64; 2]> = all.map(|(x, y)| [*x, *y]).collect();
        let front: Vec<[f64; 2]> = pareto.runs.iter().map(|run| run.values).collect();
        let best = summary.best.as_ref().and_then(|best| {
            let row = columns.runs.iter().position(|run| *run == best.run)?;
            Some([columns.metrics[a][row], columns.metrics[b][row]])
        });
        let plot = ScatterPlot {
            x_label: &pareto.metrics[0],
            y_label: &pareto.metrics[1],
            points: &points,
            front: &front,
            best,
        };
        let mut out = format!(
            "<div>{}</div>\n<table><tr><th>run</th><th>{}</th><th>{}</th></tr>\n",
            plot.svg(),
            markup(&pareto.metrics[0]),
            markup(&pareto.metrics[1])
        );
        let every = pareto.runs.len().div_ceil(12).max(1);
        for run in pareto.runs.iter().step_by(every) {
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{}</td></tr>",
                run.run,
                number(run.values[0]),
                number(run.values[1])
            );
        }
        out += "</table>\n";
        headed("Pareto front: no other run is lower in both", out)
    }

    fn matrix(&self, columns: &Columns) -> String {
        let every = columns.runs.len().div_ceil(MOST_POINTS).max(1);
        let thinned = |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(every).collect() };
        let metrics = self.metrics.len().min(MOST_METRICS);
        let strongest = if metrics > 0 { self.strongest(columns, 0) } else { Vec::new() };
        let mut named: Vec<(&str, Vec<f64>)> = Vec::new();
        for (p, _) in strongest.into_iter().take(MOST_COLUMNS - metrics) {
            if let Some(x) = &columns.parameters[p] {
                named.push((&self.design.columns[p].name, thinned(x)));
            }
        }
        for k in 0..metrics {
            named.push((&self.metrics[k].name, thinned(&columns.metrics[k])));
        }
        if named.len() < 2 {
            return String::new();
        }
        let columns: Vec<(&str, &[f64])> = named.iter().map(|(name, values)| (*name, &values[..])).collect();
        let what = "Scatter matrix (above the diagonal the correlation of the ranks)";
        headed(what, format!("<div>{}</div>\n", scatter_matrix(&columns)))
    }
}

/// A heading, if there is something below it.
fn headed(title: &str, inside: String) -> String {
    if inside.is_empty() { inside } else { format!("<h2>{title}</h2>\n{inside}") }
}

/// Names of the cells along a parameter, and the cell of each run.
fn cells(values: &[f64]) -> (Vec<String>, Vec<Option<usize>>) {
    let mut levels: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    if levels.len() <= MOST_CELLS {
        let place = |x: &f64| levels.iter().position(|level| level == x);
        return (levels.iter().map(|x| number(*x)).collect(), values.iter().map(place).collect());
    }
    let (low, high) = (levels[0], levels[levels.len() - 1]);
    let step = (high - low) / BINS as f64;
    let place = |x: &f64| x.is_finite().then(|| (((x - low) / step) as usize).min(BINS - 1));
    ((0..BINS).map(|k| rounded(low + step * (k as f64 + 0.5))).collect(), values.iter().map(place).collect())
}

fn figures(summary: &SweepSummary) -> String {
    let mut out = String::from(
        "<h2>Results</h2>\n<table><tr><th>metric</th><th>runs</th><th>least</th><th>5 %</th><th>median</th><th>95 %</th><th>largest</th><th>mean</th><th>std</th></tr>\n",
    );
    for metric in &summary.metrics {
        let cell = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), number);
        let quantile = |k: usize| cell(metric.quantiles.map(|q| q[k]));
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            markup(&metric.name),
            metric.count,
            cell(metric.min),
            quantile(0),
            quantile(1),
            quantile(2),
            cell(metric.max),
            cell(metric.mean),
            cell(metric.std)
        );
    }
    out + "</table>\n"
}

fn best(summary: &SweepSummary) -> String {
    let Some(best) = &summary.best else { return String::new() };
    let mut out = format!(
        "<h2>Best run</h2>\n<p>Run {} has the least {}: <b>{}</b>.</p>\n<table><tr><th>parameter</th><th>value</th></tr>\n",
        best.run,
        markup(&best.metric),
        number(best.value)
    );
    for (name, value) in &best.parameters {
        let value = value.number().map_or_else(|| markup(&value.to_string()), number);
        let _ = writeln!(out, "<tr><td>{}</td><td>{value}</td></tr>", markup(name));
    }
    out += "</table>\n<table><tr><th>metric</th><th>value</th></tr>\n";
    for (name, value) in &best.metrics {
        let _ =
            writeln!(out, "<tr><td>{}</td><td>{}</td></tr>", markup(name), value.map_or_else(|| "-".into(), number));
    }
    out += "</table>\n";
    if let Some(command) = &best.command {
        let _ = writeln!(out, "<p>Again, with recordings and report:</p>\n<pre>{}</pre>", markup(command));
    }
    out
}

/// How a search went.
fn search(summary: &SweepSummary) -> String {
    let Some(found) = &summary.minimise else { return String::new() };
    let kept = if found.start_kept { "keeps" } else { "does not keep" };
    let start = found.start.map_or_else(String::new, |start| {
        format!(" The files as they are give {} and the run {kept} what must hold.", number(start))
    });
    let constraints = match found.constraints.is_empty() {
        true => String::new(),
        false => format!(" under {}", markup(&found.constraints.join(", "))),
    };
    let end = match (found.kept, found.settled) {
        (false, _) => "no run kept what must hold",
        (true, true) => "the search ended by itself",
        (true, false) => "the search ended with its runs: more might find less",
    };
    let mut out = format!(
        "<h2>Least {}{constraints}</h2>\n<p>{} generations, {end}.{start}</p>\n",
        markup(&found.metric),
        found.generations
    );
    let known = found.progress.iter().enumerate().filter_map(|(k, value)| Some(((k + 1) as f64, (*value)?)));
    let (x, y): (Vec<f64>, Vec<f64>) = known.unzip();
    let curves = vec![PlotCurve { name: found.metric.clone(), look: CurveLook::Marked, x, y }];
    let panels = [Panel { label: found.metric.clone(), logarithmic: false, legend: false, curves }];
    let title = "Least value so far that keeps what must hold";
    let plot = LinePlot { title, x_label: "generation", panels: &panels, ..LinePlot::default() };
    out += &plot.svg().map(|svg| format!("<div>{svg}</div>\n")).unwrap_or_default();
    out
}

fn sensitivities(summary: &SweepSummary) -> String {
    let mut out = String::new();
    for metric in summary.metrics.iter().filter(|metric| !metric.sobol.is_empty()) {
        let pairs: Vec<BarPair<'_>> = metric
            .sobol
            .iter()
            .map(|index| BarPair {
                name: &index.parameter,
                values: [
                    [index.first, index.first_interval[0], index.first_interval[1]],
                    [index.total, index.total_interval[0], index.total_interval[1]],
                ],
            })
            .collect();
        let title = format!("{}: parts of its variance", metric.name);
        let _ = writeln!(out, "<div>{}</div>", bar_pairs(&title, ["by itself (first)", "with others (total)"], &pairs));
    }
    headed("Sobol indices with 95 % intervals", out)
}

/// The middle of a cell, with three digits.
fn rounded(x: f64) -> String {
    match x == 0.0 {
        true => "0".into(),
        false => {
            let unit = 10f64.powi(x.abs().log10().floor() as i32 - 2);
            number((x / unit).round() * unit)
        }
    }
}

/// A number with the digits that a person reads.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if (1e-3..1e5).contains(&a) => {
            let digits = (4 - a.log10().floor() as i32).clamp(0, 7) as usize;
            let text = format!("{x:.digits$}");
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        _ => format!("{x:.4e}"),
    }
}
