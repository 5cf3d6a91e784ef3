//! Choice of poses and loads to measure.
//!
//! Chooses the candidates whose readings together give the most information about the parameters:
//! maximum determinant of the information matrix (D-optimal), or minimum variance of given
//! quantities. Candidates are first added greedily, then exchanged as long as this improves the
//! plan (Fedorov). The information of the prior is included from the start.
//!
//! ```text
//! I = 1 + Σ J_kᵀ J_k,   maximise ln det I,   or minimise Σ tr(J_p I^-1 J_pᵀ)
//! ```
//! with the Jacobians J of chosen readings k and purposes p over their deviations, per prior deviation of
//! each parameter. Not here: which poses and loads are candidates ([`crate::plan_file`]).

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::estimation::least_squares::Residuals;
use crate::estimation::measurement::{MeasuredArm, NoAnswer};
use crate::estimation::parameter::{NominalArm, Parameter};
use crate::estimation::reading::{Measurements, Reading};

/// Options of a plan.
#[derive(Clone, Debug, Default)]
pub struct PlanOptions {
    /// Number of readings.
    pub count: usize,
    /// Readings whose predicted numbers should have minimum variance, each relative to its
    /// deviation; if empty, the determinant is maximised.
    pub purpose: Vec<Reading>,
}

/// Plan of measurements.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Indices of the chosen candidates, in order of choice.
    pub chosen: Vec<usize>,
    /// Expected standard deviation of each parameter's coordinate.
    pub deviations: Vec<f64>,
    /// Logarithm of the determinant of the information over that of the prior.
    pub gain: f64,
    /// Expected standard deviation of each number of the purpose, in its own unit.
    pub purpose: Vec<f64>,
}

/// Maximum number of rounds of exchange.
const ROUNDS: usize = 20;

/// Rows of the Jacobian of one reading, scaled by the prior deviations.
fn rows_of(nominal: &NominalArm, parameters: &[Parameter], reading: &Reading) -> Result<DMatrix<f64>, NoAnswer> {
    let one = Measurements { readings: vec![reading.clone()], ..Measurements::default() };
    let arm = MeasuredArm { nominal, parameters, measurements: &one };
    let mut J = DMatrix::zeros(0, 0);
    arm.evaluate(&DVector::zeros(parameters.len()), Some(&mut J))?;
    for (k, parameter) in parameters.iter().enumerate() {
        J.column_mut(k).scale_mut(prior(parameter));
    }
    for (mut row, std) in J.row_iter_mut().zip(reading.deviations()) {
        row /= std;
    }
    Ok(J)
}

/// Returns the standard deviation of a parameter's search coordinate before the measurement.
fn prior(parameter: &Parameter) -> f64 {
    parameter.prior.unwrap_or_else(|| parameter.reference())
}

/// Chooses readings among candidates.
///
/// * `candidates`: readings with their expected deviations; their values are ignored. Those for which
///   the arm has no solution are skipped.
///
/// # Errors
/// [`NoAnswer`] if the arm has no solution for a reading of the purpose.
pub fn plan(
    nominal: &NominalArm,
    parameters: &[Parameter],
    candidates: &[Reading],
    options: &PlanOptions,
) -> Result<Plan, NoAnswer> {
    // Scaled Jacobians; a candidate without an equilibrium is not one.
    let p = parameters.len();
    let rows: Vec<Option<DMatrix<f64>>> = candidates
        .iter()
        .map(|candidate| rows_of(nominal, parameters, candidate).ok().filter(|J| J.iter().all(|x| x.is_finite())))
        .collect();
    let purpose =
        options.purpose.iter().map(|reading| rows_of(nominal, parameters, reading)).collect::<Result<Vec<_>, _>>()?;
    let mut search = Choice { rows: &rows, purpose: &purpose, chosen: Vec::new() };
    let mut information = DMatrix::identity(p, p);
    // Greedy selection, then exchange.
    while search.chosen.len() < options.count {
        let Some(best) = search.best(&information) else { break };
        search.add(&mut information, best, 1.0);
        search.chosen.push(best);
    }
    search.exchange(&mut information);
    // Expected deviations from the information of the plan.
    let inverse = inverse_of(&information);
    let deviations = (0..p).map(|k| prior(&parameters[k]) * inverse[(k, k)].sqrt()).collect();
    let deviation_of = |J: &DMatrix<f64>, i: usize| (J.row(i) * &inverse * J.row(i).transpose())[(0, 0)].sqrt();
    let purpose = options.purpose.iter().zip(&purpose).flat_map(|(reading, J)| {
        let units = reading.deviations();
        (0..J.nrows()).map(|i| units[i] * deviation_of(J, i)).collect::<Vec<_>>()
    });
    Ok(Plan { deviations, gain: log_determinant(&information), purpose: purpose.collect(), chosen: search.chosen })
}

/// Returns the covariance of the scaled parameters.
fn inverse_of(information: &DMatrix<f64>) -> DMatrix<f64> {
    // Positive definite, because it includes the identity of the prior.
    Cholesky::new(information.clone())
        .map_or_else(|| DMatrix::identity(information.nrows(), information.nrows()), |f| f.inverse())
}

/// Returns the logarithm of the determinant, by Cholesky.
fn log_determinant(information: &DMatrix<f64>) -> f64 {
    Cholesky::new(information.clone()).map_or(f64::NEG_INFINITY, |f| 2.0 * f.l_dirty().diagonal().map(f64::ln).sum())
}

/// Search for the best candidates; rows are scaled Jacobians, `None` without a solution.
struct Choice<'a> {
    rows: &'a [Option<DMatrix<f64>>],
    purpose: &'a [DMatrix<f64>],
    chosen: Vec<usize>,
}

impl Choice<'_> {
    /// Adds the information `Jᵀ J` of a candidate, or removes it with `sign` -1.
    fn add(&self, information: &mut DMatrix<f64>, candidate: usize, sign: f64) {
        if let Some(J) = &self.rows[candidate] {
            *information += J.tr_mul(J) * sign;
        }
    }

    /// Evaluates the cost function of the plan.
    fn cost(&self, information: &DMatrix<f64>) -> f64 {
        if self.purpose.is_empty() {
            return -log_determinant(information);
        }
        let inverse = inverse_of(information);
        self.purpose.iter().map(|J| (J * &inverse).component_mul(J).sum()).sum()
    }

    /// Returns the candidate that reduces the cost most.
    fn best(&self, information: &DMatrix<f64>) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for number in 0..self.rows.len() {
            if self.rows[number].is_none() || self.chosen.contains(&number) {
                continue;
            }
            let mut with = information.clone();
            self.add(&mut with, number, 1.0);
            let cost = self.cost(&with);
            if best.is_none_or(|(_, least)| cost < least) {
                best = Some((number, cost));
            }
        }
        best.map(|(number, _)| number)
    }

    /// Exchanges each chosen candidate for a better one, as long as the cost decreases.
    fn exchange(&mut self, information: &mut DMatrix<f64>) {
        for _ in 0..ROUNDS {
            let mut paid = false;
            for place in 0..self.chosen.len() {
                let old = self.chosen[place];
                let now = self.cost(information);
                let mut without = information.clone();
                self.add(&mut without, old, -1.0);
                let Some(new) = self.best(&without) else { continue };
                let mut with = without.clone();
                self.add(&mut with, new, 1.0);
                if new != old && self.cost(&with) < now - 1e-9 * now.abs().max(1.0) {
                    self.chosen[place] = new;
                    *information = with;
                    paid = true;
                }
            }
            if !paid {
                return;
            }
        }
    }
}
