//! Ranking of parameters by their effect on a metric.
//!
//! Listed values are crossed with all others, so that the effect of such a parameter is exact.
//! Random values are a sample: a parameter without any effect correlates with the result by chance,
//! the more the smaller the sample is ([`beyond_chance`]). Every point of the grid has the same
//! samples, so each sample counts once, with its mean over the grid.

use crate::statistics::{Grouping, MainEffect, SampleMethod, beyond_chance, main_effect};

use super::Sweep;
use super::file::{TABLE, Values};
use super::results::Columns;

/// Share of the variance that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// Numeric parameters that vary, ranked by their effect on a metric.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranking {
    /// Significant parameters with their share of the variance, strongest first.
    pub(super) matter: Vec<(usize, f64)>,
    /// Random parameters whose effect cannot be distinguished from chance.
    pub(super) indistinct: Vec<usize>,
    /// Share of the variance due to random sampling that the strongest random parameter would
    /// explain by chance in 1 of 100 studies.
    pub(super) chance: Option<f64>,
}

/// Parameters that are sampled jointly, to be tested with [`beyond_chance`].
struct Source {
    columns: Vec<usize>,
    /// Number of runs from one sample to the next, and number of samples.
    stride: usize,
    draws: usize,
    /// Length of blocks of consecutive samples of which only the first two are independent.
    block: Option<usize>,
}

impl Sweep {
    /// Returns the grouping of runs by a parameter.
    fn grouping(&self, parameter: usize) -> Grouping {
        let column = &self.design.columns[parameter];
        let is_listed = matches!(column.values, Values::Levels(_)) && !column.is_linked_by(TABLE);
        if is_listed { Grouping::Levels } else { Grouping::Bins }
    }

    /// Returns the main effect of a numeric parameter on a metric.
    pub(super) fn effect(&self, parameter: usize, metric: usize, columns: &Columns) -> Option<MainEffect> {
        let x = columns.parameters[parameter].as_ref()?;
        main_effect(x, &columns.metrics[metric], self.grouping(parameter))
    }

    /// Ranks the parameters by their effect on a metric.
    pub(super) fn ranking(&self, columns: &Columns, metric: usize) -> Ranking {
        let sources = self.sources();
        let mut ranking = Ranking::default();
        let mut named = Vec::new();
        for source in &sources {
            let (x, y) = source.draws(columns, metric);
            let found = beyond_chance(&x, &y);
            named.extend(found.parameters.iter().map(|k| source.columns[*k]));
            ranking.chance = Some(found.chance.max(ranking.chance.unwrap_or(0.0)));
        }
        for (k, column) in self.design.columns.iter().enumerate() {
            // Derived parameters only repeat the effects of others.
            if matches!(column.values, Values::Derived(_)) {
                continue;
            }
            let Some(share) = self.effect(k, metric, columns).map(|effect| effect.share) else { continue };
            match sources.iter().any(|source| source.columns.contains(&k)) {
                true if !named.contains(&k) => ranking.indistinct.push(k),
                _ if share > ROUNDING => ranking.matter.push((k, share)),
                _ => {}
            }
        }
        ranking.matter.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        ranking
    }

    /// Returns the sources of random values: the sample, and the table of runs.
    fn sources(&self) -> Vec<Source> {
        let design = &self.design;
        let numeric = |list: &[usize]| list.iter().copied().filter(|k| design.columns[*k].is_numeric()).collect();
        let points = design.runs() / design.grid_points().max(1);
        let dimensions = design.drawn().len();
        let block = (self.file.method == SampleMethod::Saltelli).then_some(dimensions + 2);
        let sample = Source { columns: numeric(design.drawn()), stride: 1, draws: points, block };
        let mut found = vec![sample];
        let mut stride = points;
        for (direction, size) in design.directions().rev() {
            if design.columns[direction[0]].is_linked_by(TABLE) {
                found.push(Source { columns: numeric(direction), stride, draws: size, block: None });
            }
            stride *= size;
        }
        found.retain(|source| !source.columns.is_empty());
        found
    }
}

impl Source {
    /// Returns the values of the parameters in each sample, and the deviation of the metric from
    /// its mean over all samples, averaged over the grid.
    fn draws(&self, columns: &Columns, metric: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
        let draw = |run: usize| run / self.stride % self.draws;
        let rest = |run: usize| run - draw(run) * self.stride;
        let values = &columns.metrics[metric];
        let rows = || columns.runs.iter().zip(values).enumerate().filter(|(_, (_, y))| y.is_finite());
        let mut means = std::collections::HashMap::<usize, (f64, usize)>::new();
        for (_, (run, y)) in rows() {
            let mean = means.entry(rest(*run)).or_default();
            *mean = (mean.0 + y, mean.1 + 1);
        }
        let mut sums = vec![(0.0, 0usize); self.draws];
        let mut x = vec![vec![f64::NAN; self.draws]; self.columns.len()];
        for (row, (run, y)) in rows() {
            let (draw, (sum, count)) = (draw(*run), means[&rest(*run)]);
            sums[draw] = (sums[draw].0 + y - sum / count as f64, sums[draw].1 + 1);
            for (x, column) in x.iter_mut().zip(&self.columns) {
                x[draw] = columns.parameters[*column].as_ref().map_or(f64::NAN, |values| values[row]);
            }
        }
        let is_independent = |draw: usize| self.block.is_none_or(|block| draw % block < 2);
        let mean = |(draw, (sum, count)): (usize, &(f64, usize))| match is_independent(draw) && *count > 0 {
            true => sum / *count as f64,
            false => f64::NAN,
        };
        let y = sums.iter().enumerate().map(mean).collect();
        (x, y)
    }
}
