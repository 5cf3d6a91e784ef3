//! HTML page of a study: figures, heat maps, main effects, sensitivities, Pareto front, scatter
//! matrix, the best run; a single file without scripts.

use std::fmt::Write as _;

use flexarm_draw::FieldPlot;
use flexarm_draw::charts::{BarPair, EffectPanel, ScatterPlot, bar_pairs, effects, scatter_matrix};

use super::Sweep;
use super::file::Role;
use super::ranking::Ranking;
use super::results::{Columns, SweepSummary};
use flexarm_run::html_page::{ENDING, opening, warnings};
use flexarm_settings::written::markup;

/// Maximum number of metrics with plots.
const MAX_METRICS: usize = 4;
/// Maximum number of columns in the scatter matrix.
const MAX_COLUMNS: usize = 8;
/// Maximum number of points of a scatter plot, and of each plot in the scatter matrix.
const MAX_POINTS: usize = 1500;
const MAX_IN_MATRIX: usize = 1000;
/// Maximum number of panels in a row of effects.
const MAX_PANELS: usize = 6;
/// Maximum number of parameter values with a heat map row or column each.
const MAX_CELLS: usize = 40;
/// Number of rows or columns for parameters with more values.
const BINS: usize = 10;

impl Sweep {
    /// Returns the HTML page.
    pub(super) fn page(&self, summary: &SweepSummary, columns: &Columns) -> String {
        let mut page = opening(&format!("Study {}", summary.study));
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
        page += &warnings("", &summary.warnings);
        page += &figures(summary);
        page += &self.best_run(summary);
        let rankings = self.rankings(columns);
        page += &self.who_matters(&rankings);
        page += &self.heat_maps(columns, &rankings);
        page += &self.main_effects(columns, &rankings);
        page += &sensitivities(summary);
        page += &self.pareto_plot(summary, columns);
        page += &self.matrix(columns, rankings.first());
        page + ENDING
    }

    /// Returns the label of a parameter, and the factor for displaying its values.
    fn shown(&self, parameter: usize) -> (String, f64) {
        let column = &self.design.columns[parameter];
        match column.role {
            Role::Value => (column.name.clone(), 1.0),
            Role::Factor => (format!("{} (% of the value in the file)", column.name), 100.0),
            Role::Offset => (format!("{} (added to the value in the file)", column.name), 1.0),
        }
    }

    /// Returns the values of a parameter in display units.
    fn shown_values(&self, parameter: usize, columns: &Columns) -> Option<Vec<f64>> {
        let factor = self.shown(parameter).1;
        Some(columns.parameters[parameter].as_ref()?.iter().map(|x| x * factor).collect())
    }

    /// Returns the rankings of the metrics with plots.
    fn rankings(&self, columns: &Columns) -> Vec<Ranking> {
        (0..self.metrics.len().min(MAX_METRICS)).map(|metric| self.ranking(columns, metric)).collect()
    }

    /// Lists the parameters that matter, and those whose effect cannot be distinguished from
    /// chance.
    fn who_matters(&self, rankings: &[Ranking]) -> String {
        let names = |list: &mut dyn Iterator<Item = usize>| {
            list.map(|p| markup(&self.design.columns[p].name)).collect::<Vec<_>>().join(", ")
        };
        let mut out = String::new();
        for (metric, ranking) in self.metrics.iter().zip(rankings) {
            let all = ranking.matter.len() + ranking.indistinct.len();
            if all == 0 {
                continue;
            }
            // Those with an effect, then those that chance may explain.
            let name = markup(&metric.name);
            let _ = match ranking.matter.is_empty() {
                true => write!(out, "<p>{name}: no parameter has a significant effect."),
                false => write!(out, "<p>{name}: {}.", names(&mut ranking.matter.iter().map(|(p, _)| *p))),
            };
            if let Some(chance) = ranking.chance.filter(|_| !ranking.indistinct.is_empty()) {
                let indistinct = names(&mut ranking.indistinct.iter().copied());
                let reach = match chance < 1.0 {
                    true => format!(
                        "chance may explain {:.0} % of the variance with this number of samples",
                        100.0 * chance
                    ),
                    false => "the number of samples is too small to detect any effect".to_owned(),
                };
                let _ = write!(
                    out,
                    " Not distinguishable from chance: {indistinct} ({reach}; more samples resolve smaller effects)."
                );
            }
            out += "</p>\n";
        }
        headed("Influential parameters, strongest first", out)
    }

    /// Draws a heat map per metric over its two strongest parameters; a cell is the mean of its runs.
    fn heat_maps(&self, columns: &Columns, rankings: &[Ranking]) -> String {
        let mut out = String::new();
        let mut axes = Axes::default();
        for (k, (metric, ranking)) in self.metrics.iter().zip(rankings).enumerate() {
            let Some((a, b)) = axes.pair(&ranking.matter) else { continue };
            let (Some(x), Some(y)) = (self.shown_values(a, columns), self.shown_values(b, columns)) else { continue };
            // Sum and number of the runs in each cell.
            let ((x_names, x_cells), (y_names, y_cells)) = (cells(&x), cells(&y));
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
            let map = FieldPlot {
                title: &title,
                labels: [&self.shown(a).0, &self.shown(b).0],
                names: Some([&x_names, &y_names]),
                values: &values,
                ..FieldPlot::default()
            };
            let _ = writeln!(out, "<div>{}</div>", map.svg());
        }
        headed("Heat maps of the influential parameters", out)
    }

    /// Draws the main effects of the strongest parameters, a row per metric.
    fn main_effects(&self, columns: &Columns, rankings: &[Ranking]) -> String {
        let labels: Vec<String> = (0..self.design.columns.len()).map(|p| self.shown(p).0).collect();
        let mut rows = Vec::new();
        for (k, (metric, ranking)) in self.metrics.iter().zip(rankings).enumerate() {
            let panel = |(p, _): &(usize, f64)| {
                let (effect, factor) = (self.effect(*p, k, columns)?, self.shown(*p).1);
                let points = effect.groups.iter().map(|g| [factor * g.x, g.mean, g.std_error]).collect();
                Some(EffectPanel { x_label: &labels[*p], y_label: &metric.name, points })
            };
            let panels: Vec<EffectPanel<'_>> = ranking.matter.iter().take(MAX_PANELS).filter_map(panel).collect();
            if !panels.is_empty() {
                rows.push(panels);
            }
        }
        let picture = if rows.is_empty() { String::new() } else { format!("<div>{}</div>\n", effects(&rows)) };
        headed("Main effects (means with standard errors, strongest first)", picture)
    }

    /// Draws the Pareto front with some of its runs.
    fn pareto_plot(&self, summary: &SweepSummary, columns: &Columns) -> String {
        let Some(pareto) = &summary.pareto else { return String::new() };
        let place = |name: &String| self.metrics.iter().position(|metric| metric.name == *name);
        let (Some(a), Some(b)) = (place(&pareto.metrics[0]), place(&pareto.metrics[1])) else { return String::new() };
        // All runs, thinned, with the front and the best run.
        let every = columns.runs.len().div_ceil(MAX_POINTS).max(1);
        let all = columns.metrics[a].iter().zip(&columns.metrics[b]).step_by(every);
        let points: Vec<[f64; 2]> = all.map(|(x, y)| [*x, *y]).collect();
        let front: Vec<[f64; 2]> = pareto.runs.iter().map(|run| run.values).collect();
        let best = summary.best.as_ref().and_then(|best| {
            let row = columns.runs.iter().position(|run| *run == best.run)?;
            Some([columns.metrics[a][row], columns.metrics[b][row]])
        });
        let label = |k: usize| format!("{} ({} is better)", pareto.metrics[k], pareto.better[k].word());
        let plot = ScatterPlot { x_label: &label(0), y_label: &label(1), points: &points, front: &front, best };
        let mut out = format!(
            "<div>{}</div>\n<table><tr><th>run</th><th>{}</th><th>{}</th></tr>\n",
            plot.svg(),
            markup(&pareto.metrics[0]),
            markup(&pareto.metrics[1])
        );
        // A dozen runs of the front, and what it assumes.
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
        let assumed = [a, b].into_iter().filter(|k| self.metrics[*k].better.is_none());
        for name in assumed.map(|k| &self.metrics[k].name) {
            let name = markup(name);
            let _ = writeln!(
                out,
                "<p>Lower values of {name} are assumed to be better; set better in the study to change this.</p>"
            );
        }
        headed("Pareto front: no other run is better in both", out)
    }

    /// Returns the values of the best run, and the command that repeats it.
    fn best_run(&self, summary: &SweepSummary) -> String {
        let Some(best) = &summary.best else { return String::new() };
        let mut out = format!(
            "<h2>Best run</h2>\n<p>Run {} has the {} {}: <b>{}</b>.</p>\n<table><tr><th>parameter</th><th>value</th></tr>\n",
            best.run,
            best.better.most(),
            markup(&best.metric),
            number(best.value)
        );
        for (p, column) in self.design.columns.iter().enumerate() {
            let Some(value) = best.parameters.get(&column.name) else { continue };
            let (name, factor) = self.shown(p);
            let value = value.number().map_or_else(|| markup(&value.to_string()), |x| number(factor * x));
            let _ = writeln!(out, "<tr><td>{}</td><td>{value}</td></tr>", markup(&name));
        }
        out += "</table>\n<table><tr><th>metric</th><th>value</th></tr>\n";
        for (name, value) in &best.metrics {
            let value = value.map_or_else(|| "-".into(), number);
            let _ = writeln!(out, "<tr><td>{}</td><td>{value}</td></tr>", markup(name));
        }
        out += "</table>\n";
        if let Some(command) = &best.command {
            let _ = writeln!(
                out,
                "<p>Command that repeats this run with recordings and report:</p>\n<pre>{}</pre>",
                markup(command)
            );
        }
        out
    }

    /// Draws the scatter matrix of strongest parameters and first metrics.
    fn matrix(&self, columns: &Columns, ranking: Option<&Ranking>) -> String {
        let every = columns.runs.len().div_ceil(MAX_IN_MATRIX).max(1);
        let thinned = |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(every).collect() };
        let metrics = self.metrics.len().min(MAX_METRICS);
        let ranked = ranking.map(|r| r.matter.iter().map(|(p, _)| *p).chain(r.indistinct.iter().copied()));
        let mut named: Vec<(String, Vec<f64>)> = Vec::new();
        for p in ranked.into_iter().flatten().take(MAX_COLUMNS - metrics) {
            if let Some(x) = self.shown_values(p, columns) {
                named.push((self.shown(p).0, thinned(&x)));
            }
        }
        for k in 0..metrics {
            named.push((self.metrics[k].name.clone(), thinned(&columns.metrics[k])));
        }
        if named.len() < 2 {
            return String::new();
        }
        let columns: Vec<(&str, &[f64])> = named.iter().map(|(name, values)| (&name[..], &values[..])).collect();
        let what = "Scatter matrix (rank correlations above the diagonal)";
        headed(what, format!("<div>{}</div>\n", scatter_matrix(&columns)))
    }
}

/// Axes of the parameters in the heat maps of a page; each parameter has the same axis in all of
/// them.
#[derive(Debug, Default)]
pub struct Axes {
    to_the_right: Vec<usize>,
    upwards: Vec<usize>,
}

impl Axes {
    /// Chooses the strongest parameter and the next one that can take the other axis; returns the
    /// horizontal and the vertical one.
    pub fn pair(&mut self, ranked: &[(usize, f64)]) -> Option<(usize, usize)> {
        let (first, rest) = ranked.split_first()?;
        let goes_up = self.upwards.contains(&first.0);
        let taken = if goes_up { &self.upwards } else { &self.to_the_right };
        let second = rest.iter().map(|(p, _)| *p).find(|p| !taken.contains(p))?;
        let (x, y) = if goes_up { (second, first.0) } else { (first.0, second) };
        self.to_the_right.push(x);
        self.upwards.push(y);
        Some((x, y))
    }
}

/// Returns a section with a heading; nothing if the section is empty.
fn headed(title: &str, inside: String) -> String {
    if inside.is_empty() { inside } else { format!("<h2>{title}</h2>\n{inside}") }
}

/// Returns the labels of the cells along a parameter, and the cell of each run.
fn cells(values: &[f64]) -> (Vec<String>, Vec<Option<usize>>) {
    let mut levels: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    if levels.len() <= MAX_CELLS {
        let place = |x: &f64| levels.iter().position(|level| level == x);
        return (levels.iter().map(|x| number(*x)).collect(), values.iter().map(place).collect());
    }
    let (low, high) = (levels[0], levels[levels.len() - 1]);
    let step = (high - low) / BINS as f64;
    let place = |x: &f64| x.is_finite().then(|| (((x - low) / step) as usize).min(BINS - 1));
    ((0..BINS).map(|k| rounded(low + step * (k as f64 + 0.5))).collect(), values.iter().map(place).collect())
}

/// Returns the table of the metrics.
fn figures(summary: &SweepSummary) -> String {
    let mut out = String::from(
        "<h2>Results</h2>\n<table><tr><th>metric</th><th>runs</th><th>minimum</th><th>5 %</th><th>median</th>\
         <th>95 %</th><th>maximum</th><th>mean</th><th>std</th></tr>\n",
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

/// Draws the Sobol indices of each metric.
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
        let title = format!("{}: shares of the variance", metric.name);
        let _ = writeln!(out, "<div>{}</div>", bar_pairs(&title, ["first-order index", "total index"], &pairs));
    }
    headed("Sobol indices with 95 % intervals", out)
}

/// Formats the centre of a cell with three significant digits.
fn rounded(x: f64) -> String {
    match x == 0.0 {
        true => "0".into(),
        false => {
            let unit = 10f64.powi(x.abs().log10().floor() as i32 - 2);
            number((x / unit).round() * unit)
        }
    }
}

/// Formats a number with about five significant digits.
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
