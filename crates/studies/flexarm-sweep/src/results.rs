//! Results of a study: figures of its metrics, failures, the best run.
//!
//! The structures are the JSON of `--json`: their names are a contract. Start at `Sweep::summary`.
//! Not here: which parameters matter ([`super::ranking`]), the statistics ([`crate::statistics`]).

use std::collections::BTreeMap;

use crate::statistics::{SampleMethod, pareto_front, sobol_indices, spread};
use serde::Serialize;

use super::Sweep;
use super::direction::Better;
use super::evaluate::Answer;
use super::file::Role;
use super::replay::Replay;
use super::run_caveats::{self, CaveatFigures};
use super::store::Collected;
use super::value::ParameterValue;

/// Result of `flexarm sweep`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SweepSummary {
    /// Name of the study.
    pub study: String,
    /// Number of runs of the study.
    pub runs: usize,
    /// Number of successful runs.
    pub done: usize,
    /// Number of failed runs.
    pub failed: usize,
    /// Shard that was computed, as `number/of`; null for all runs.
    pub shard: Option<String>,
    /// Wall-clock time (s).
    pub wall_s: f64,
    /// Processor time, all threads (s).
    pub cpu_s: f64,
    /// Path of the table of all runs, or of the folder of a shard.
    pub file: String,
    /// Path of the page.
    pub page: Option<String>,
    /// Varied parameters.
    pub parameters: Vec<ParameterFigures>,
    /// Metrics.
    pub metrics: Vec<MetricFigures>,
    /// Reasons of failed runs, most frequent first.
    pub failures: Vec<FailureFigures>,
    /// Best run; null if no run succeeded.
    pub best: Option<BestRun>,
    /// Pareto-optimal runs of two metrics; null with one metric.
    pub pareto: Option<ParetoFigures>,
    /// Sentences of the caveats that are warnings, each once, with the number of affected runs.
    pub warnings: Vec<String>,
    /// Caveats as from `check` and `compare`, each once with its worst value, warnings first.
    pub caveats: Vec<CaveatFigures>,
    /// Number of runs that several shards contain with the same result; they count once.
    pub doubles: usize,
}

/// Figures of a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterFigures {
    /// Name.
    pub name: String,
    /// Minimum and maximum; null if not numeric.
    pub range: Option<[f64; 2]>,
    /// Effect of its values on those in the files: `value`, `factor` or `offset`.
    #[serde(rename = "as")]
    pub role: Role,
}

/// Figures of a metric over all successful runs.
#[derive(Clone, Debug, Serialize)]
pub struct MetricFigures {
    /// Name.
    pub name: String,
    /// Number of runs with a value.
    pub count: usize,
    /// Minimum.
    pub min: Option<f64>,
    /// Maximum.
    pub max: Option<f64>,
    /// Mean.
    pub mean: Option<f64>,
    /// Standard deviation.
    pub std: Option<f64>,
    /// Quantiles 0.05, 0.5 and 0.95.
    pub quantiles: Option<[f64; 3]>,
    /// Share of the variance that each parameter explains by itself (correlation ratio); null if
    /// the parameter is not numeric or nothing varies.
    pub shares: BTreeMap<String, Option<f64>>,
    /// Parameters that matter, strongest first: listed ones with an effect, and random ones whose
    /// effect chance does not explain.
    pub matters: Vec<String>,
    /// Share of the variance due to random sampling that the strongest random parameter would
    /// explain by chance in 1 of 100 studies; null if nothing is random.
    pub chance: Option<f64>,
    /// Preferred direction; null if neither study, expression nor name determines it.
    pub better: Option<Better>,
    /// Sobol indices of the parameters in a Saltelli design; empty otherwise.
    pub sobol: Vec<IndexFigures>,
}

/// Sobol indices of a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct IndexFigures {
    /// Name of the parameter.
    pub parameter: String,
    /// First-order index: share of the variance due to the parameter by itself.
    pub first: f64,
    /// 95 % confidence interval of `first`.
    pub first_interval: [f64; 2],
    /// Total index: share of the variance including interactions.
    pub total: f64,
    /// 95 % confidence interval of `total`.
    pub total_interval: [f64; 2],
}

/// Best run by a metric.
#[derive(Clone, Debug, Serialize)]
pub struct BestRun {
    /// Number of the run.
    pub run: usize,
    /// Name of the metric.
    pub metric: String,
    /// Direction of the optimum; lower if the preferred direction is unknown.
    pub better: Better,
    /// Value of the metric.
    pub value: f64,
    /// Values of the parameters.
    pub parameters: BTreeMap<String, ParameterValue>,
    /// Values of the metrics.
    pub metrics: BTreeMap<String, Option<f64>>,
    /// Files of the run, ready to use; null if none are written.
    pub files: Option<Replay>,
    /// Command that repeats the run.
    pub command: Option<String>,
}

/// Pareto-optimal runs of two metrics.
#[derive(Clone, Debug, Serialize)]
pub struct ParetoFigures {
    /// Names of the metrics.
    pub metrics: [String; 2],
    /// Preferred directions; lower if unknown.
    pub better: [Better; 2],
    /// Runs, sorted by the first metric.
    pub runs: Vec<ParetoRun>,
}

/// Pareto-optimal run.
#[derive(Clone, Debug, Serialize)]
pub struct ParetoRun {
    /// Number of the run.
    pub run: usize,
    /// Values of both metrics.
    pub values: [f64; 2],
}

/// Reason of failed runs.
#[derive(Clone, Debug, Serialize)]
pub struct FailureFigures {
    /// Reason.
    pub reason: String,
    /// Number of runs.
    pub runs: usize,
    /// Number of the first of these runs.
    pub first: usize,
}

/// Results as columns: one value per finished run, in the order of the runs.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    pub(super) runs: Vec<usize>,
    /// Values of the parameters; `None` if not numeric.
    pub(super) parameters: Vec<Option<Vec<f64>>>,
    pub(super) metrics: Vec<Vec<f64>>,
}

/// Maximum number of reported reasons.
const MAX_REASONS: usize = 10;

impl Sweep {
    /// Converts results to columns.
    fn columns(&self, answers: &[(&Answer, Vec<ParameterValue>)]) -> Columns {
        let number = |value: &ParameterValue| value.number().unwrap_or(f64::NAN);
        let parameter = |k: usize| {
            let numeric = self.design.columns[k].is_numeric();
            numeric.then(|| answers.iter().map(|(_, values)| number(&values[k])).collect())
        };
        let metric = |k: usize| {
            let value =
                |(answer, _): &(&Answer, Vec<ParameterValue>)| answer.result.as_ref().map_or(f64::NAN, |m| m[k]);
            answers.iter().map(value).collect()
        };
        Columns {
            runs: answers.iter().map(|(answer, _)| answer.run).collect(),
            parameters: (0..self.design.columns.len()).map(parameter).collect(),
            metrics: (0..self.metrics.len()).map(metric).collect(),
        }
    }

    /// Returns the figures of the collected runs, and the results as columns.
    pub(super) fn summary(&self, collected: &Collected) -> (SweepSummary, Columns) {
        let answers: Vec<(&Answer, Vec<ParameterValue>)> =
            collected.answers.values().map(|(answer, _)| (answer, self.design.values(answer.run))).collect();
        let columns = self.columns(&answers);
        let failed = answers.iter().filter(|(answer, _)| answer.result.is_err()).count();
        let caveats = run_caveats::figures(answers.iter().map(|(answer, _)| *answer));
        let summary = SweepSummary {
            study: self.file.name.clone(),
            runs: self.runs(),
            done: answers.len() - failed,
            failed,
            parameters: self.parameter_figures(&columns),
            metrics: self.metric_figures(&columns),
            failures: failures(&answers),
            warnings: run_caveats::warnings(&caveats, answers.len()),
            caveats,
            best: self.best(&answers, &columns),
            pareto: self.pareto(&columns),
            doubles: collected.doubles,
            ..SweepSummary::default()
        };
        (summary, columns)
    }

    /// Returns the index of the metric that defines the best run.
    fn goal(&self) -> usize {
        let named = self.file.best.as_ref().and_then(|best| self.metrics.iter().position(|m| m.name == best.text));
        named.unwrap_or(0)
    }

    /// Returns the run with the best value of the goal.
    fn best(&self, answers: &[(&Answer, Vec<ParameterValue>)], columns: &Columns) -> Option<BestRun> {
        let goal = self.goal();
        let values = columns.metrics.get(goal)?;
        let better = self.better(goal);
        let finite = values.iter().enumerate().filter(|(_, value)| value.is_finite());
        let finite = finite.map(|(row, value)| (row, better.as_cost(*value)));
        let (row, _) = finite.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))?;
        let (answer, parameters) = &answers[row];
        let results = answer.result.as_deref().unwrap_or_default();
        let parameters = self.design.columns.iter().zip(parameters);
        let metric = |(k, metric): (usize, &super::metric::Metric)| {
            (metric.name.clone(), results.get(k).copied().filter(|x| x.is_finite()))
        };
        Some(BestRun {
            run: answer.run,
            metric: self.metrics[goal].name.clone(),
            better,
            value: results.get(goal).copied().unwrap_or(f64::NAN),
            parameters: parameters.map(|(column, value)| (column.name.clone(), value.clone())).collect(),
            metrics: self.metrics.iter().enumerate().map(metric).collect(),
            files: None,
            command: None,
        })
    }

    /// Returns the preferred direction of a metric, by default lower.
    pub(super) fn better(&self, metric: usize) -> Better {
        self.metrics[metric].better.unwrap_or(Better::Lower)
    }

    /// Returns the Pareto front of the two metrics of the study, by default the first two.
    fn pareto(&self, columns: &Columns) -> Option<ParetoFigures> {
        let place = |name: &String| self.metrics.iter().position(|metric| metric.name == *name);
        let (a, b) = match &self.file.pareto {
            Some(([a, b], _)) => (place(a)?, place(b)?),
            None if self.metrics.len() >= 2 => (0, 1),
            None => return None,
        };
        let (x, y) = (&columns.metrics[a], &columns.metrics[b]);
        let run = |row: usize| ParetoRun { run: columns.runs[row], values: [x[row], y[row]] };
        let better = [a, b].map(|k| self.better(k));
        let costs = |values: &[f64], k: usize| values.iter().map(|x| better[k].as_cost(*x)).collect::<Vec<f64>>();
        let runs: Vec<ParetoRun> = pareto_front(&costs(x, 0), &costs(y, 1)).into_iter().map(run).collect();
        let metrics = [a, b].map(|k| self.metrics[k].name.clone());
        (!runs.is_empty()).then_some(ParetoFigures { metrics, better, runs })
    }

    /// Computes the Sobol indices of a metric. With a grid, those of the deviation from the mean at
    /// each grid point.
    fn indices(&self, values: &[f64], columns: &Columns) -> Vec<IndexFigures> {
        let drawn = self.design.drawn();
        if self.file.method != SampleMethod::Saltelli || drawn.is_empty() {
            return Vec::new();
        }
        // Missing and failed runs are NaN.
        let mut whole = vec![f64::NAN; self.runs()];
        columns.runs.iter().zip(values).for_each(|(run, value)| whole[*run] = *value);
        // The variance due to the grid is not part of the indices.
        let points = self.runs() / self.design.grid_points().max(1);
        for point in whole.chunks_mut(points.max(1)) {
            let mean = spread(point).map_or(0.0, |spread| spread.mean);
            point.iter_mut().for_each(|value| *value -= mean);
        }
        let found = sobol_indices(&whole, drawn.len(), self.file.seed).unwrap_or_default();
        let index = |(column, index): (&usize, crate::statistics::SobolIndex)| IndexFigures {
            parameter: self.design.columns[*column].name.clone(),
            first: index.first,
            first_interval: index.first_interval,
            total: index.total,
            total_interval: index.total_interval,
        };
        drawn.iter().zip(found).map(index).collect()
    }

    fn parameter_figures(&self, columns: &Columns) -> Vec<ParameterFigures> {
        let figures = |(k, values): (usize, &Option<Vec<f64>>)| ParameterFigures {
            name: self.design.columns[k].name.clone(),
            range: values.as_ref().and_then(|values| spread(values)).map(|spread| [spread.min, spread.max]),
            role: self.design.columns[k].role,
        };
        columns.parameters.iter().enumerate().map(figures).collect()
    }

    fn metric_figures(&self, columns: &Columns) -> Vec<MetricFigures> {
        let figures = |(k, values): (usize, &Vec<f64>)| {
            let spread = spread(values);
            let name = |p: usize| self.design.columns[p].name.clone();
            let share = |p: usize| (name(p), self.effect(p, k, columns).map(|effect| effect.share));
            let ranking = self.ranking(columns, k);
            MetricFigures {
                name: self.metrics[k].name.clone(),
                count: spread.map_or(0, |spread| spread.count),
                min: spread.map(|spread| spread.min),
                max: spread.map(|spread| spread.max),
                mean: spread.map(|spread| spread.mean),
                std: spread.map(|spread| spread.std),
                quantiles: spread.map(|spread| spread.quantiles),
                shares: (0..columns.parameters.len()).map(share).collect(),
                matters: ranking.matter.iter().map(|(p, _)| name(*p)).collect(),
                chance: ranking.chance,
                better: self.metrics[k].better,
                sobol: self.indices(values, columns),
            }
        };
        columns.metrics.iter().enumerate().map(figures).collect()
    }
}

/// Counts the failed runs by reason.
fn failures(answers: &[(&Answer, Vec<ParameterValue>)]) -> Vec<FailureFigures> {
    let mut found: Vec<FailureFigures> = Vec::new();
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for (answer, _) in answers {
        let Err(reason) = &answer.result else { continue };
        let place = *places.entry(reason).or_insert_with(|| {
            found.push(FailureFigures { reason: reason.clone(), runs: 0, first: answer.run });
            found.len() - 1
        });
        found[place].runs += 1;
    }
    found.sort_by(|a, b| b.runs.cmp(&a.runs).then(a.first.cmp(&b.first)));
    found.truncate(MAX_REASONS);
    found
}
