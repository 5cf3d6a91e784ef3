//! Rows of a map and their statistics: ranges, quantiles, best and worst.
//!
//! Not here: how rows are made ([`super::evaluate`]), how they are shown ([`super::page`]).

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::columns::{HEAD, MapColumn, PLACE, cheapest};
use super::region::Grid;

/// Quantiles reported.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Every pose of a map as a row of numbers.
#[derive(Clone, Debug, Default)]
pub struct MapTable {
    /// Columns: names and meanings.
    pub columns: Vec<MapColumn>,
    /// Values, row after row, each with one value per column.
    pub values: Vec<f64>,
}

impl MapTable {
    /// Number of poses.
    pub fn rows(&self) -> usize {
        self.values.len() / self.columns.len().max(1)
    }

    /// Returns the values of a pose.
    pub fn row(&self, k: usize) -> &[f64] {
        let width = self.columns.len();
        &self.values[k * width..][..width]
    }

    /// Returns the values of a column, pose after pose; `None` if there is no column of that name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let k = self.columns.iter().position(|column| column.name == name)?;
        Some(self.at(k))
    }

    /// Returns the values of the column with that index.
    pub(super) fn at(&self, column: usize) -> Vec<f64> {
        self.values.iter().skip(column).step_by(self.columns.len()).copied().collect()
    }

    /// Returns the cost to minimise; infinite for non-finite values.
    pub(super) fn cost(&self, column: usize, value: f64) -> f64 {
        self.columns[column].cost(value)
    }

    /// Returns the rows with the best and the worst value of a column.
    #[doc(hidden)]
    pub fn extremes(&self, column: usize) -> Option<(usize, usize)> {
        let cost = |row: usize| self.cost(column, self.row(row)[column]);
        Some((cheapest(self.rows(), cost)?, cheapest(self.rows(), |row| -cost(row))?))
    }

    /// Returns, per place of a grid, the cost of the best row by the column `by` and the value of another
    /// column in it; infinite and NaN for places without a row.
    pub(super) fn best_by_place(&self, by: usize, column: usize, grid: &Grid) -> Vec<(f64, f64)> {
        let mut best = vec![(f64::INFINITY, f64::NAN); grid.places()];
        for row in (0..self.rows()).map(|k| self.row(k)) {
            let (slot, cost) = (&mut best[row[PLACE] as usize], self.cost(by, row[by]));
            if cost < slot.0 {
                *slot = (cost, row[column]);
            }
        }
        best
    }

    /// Returns the distributions of all quantities, in the order of the columns.
    pub(super) fn spreads(&self) -> Vec<(String, Spread)> {
        let quantities: Vec<usize> = (0..self.columns.len()).filter(|&k| self.columns[k].quantity).collect();
        quantities.par_iter().map(|&k| (self.columns[k].name.clone(), Spread::of(self.at(k)))).collect()
    }
}

/// Distribution of a quantity over the poses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// 5, 25, 50, 75 and 95 % quantiles, under the keys `0.05` to `0.95`.
    pub quantiles: BTreeMap<String, f64>,
}

impl Spread {
    /// Computes the distribution of values in any order; non-finite ones are left out.
    #[doc(hidden)]
    pub fn of(mut values: Vec<f64>) -> Self {
        values.retain(|x| x.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        let n = values.len();
        let at = |part: f64| match n {
            0 => f64::NAN,
            _ => {
                // Linear interpolation between neighbours, as in most programs.
                let place = part * (n - 1) as f64;
                let (k, rest) = (place.floor() as usize, place.fract());
                let next = values[(k + 1).min(n - 1)];
                values[k] + rest * (next - values[k])
            }
        };
        Self {
            min: at(0.0),
            max: at(1.0),
            mean: if n == 0 { f64::NAN } else { values.iter().sum::<f64>() / n as f64 },
            quantiles: QUANTILES.iter().map(|&part| (part.to_string(), at(part))).collect(),
        }
    }
}

/// A pose of a map with all its quantities.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MapPose {
    /// Index of its row.
    pub row: usize,
    /// Joints, in coordinate order (rad or m).
    pub q: Vec<f64>,
    /// Position of the rigid arm's TCP (m, world).
    pub place_m: [f64; 3],
    /// Value of the quantity by which the map compares.
    pub value: f64,
    /// Values of all quantities.
    pub quantities: BTreeMap<String, f64>,
}

impl MapPose {
    pub(super) fn of(table: &MapTable, row: usize, joints: usize, by: usize) -> Self {
        let values = table.row(row);
        let quantities = table.columns.iter().zip(values).filter(|(column, _)| column.quantity);
        Self {
            row,
            q: values[HEAD.len()..][..joints].to_vec(),
            place_m: [values[0], values[1], values[2]],
            value: values[by],
            quantities: quantities.map(|(column, value)| (column.name.clone(), *value)).collect(),
        }
    }
}
