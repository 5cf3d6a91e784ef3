//! Identification of arm parameters from readings: estimates, uncertainties, combinations that are
//! not identifiable, and evidence against the model.

use nalgebra::{DMatrix, DVector};

use crate::estimation::identified::{HeldOut, Identified, IdentifyError, ParameterEstimate};
use crate::estimation::least_squares::{Residuals, Search, Solution, SolveError, solve};
use crate::estimation::measurement::MeasuredArm;
use crate::estimation::parameter::{Effect, Parameter, Plant};
use crate::estimation::placement::placed;
use crate::estimation::reading::{Instrument, Measurements, Reading, ReadingKind};

/// Magnitude of a normalised residual above which its reading is suspicious.
const SUSPICIOUS: f64 = 4.0;
/// One-sided normal quantile for a probability of one in a thousand, above which the scatter counts
/// as larger than declared.
const MISFIT_QUANTILE: f64 = 3.09;
/// Maximum number of rounds of the iteration for an unknown scatter.
const SCATTER_ROUNDS: usize = 6;
/// Maximum number of further starts of a search that may end in a local minimum.
const STARTS: usize = 12;
/// Ratio of scatter to declared deviation above which the fit is rejected and reports no
/// deviations.
const NO_FIT: f64 = 2.0;
/// Maximum share of an identifiable parameter in directions that are not identified.
const UNTOLD: f64 = 0.05;

/// Options of an identification.
#[derive(Clone, Copy, Debug)]
pub struct IdentifyOptions {
    /// Loss, maximum number of iterations, and tolerance.
    pub search: Search,
    /// Whether the deviations of the readings are known. If not, only their ratios count and the
    /// scatter about the fit sets their size.
    pub deviations_known: bool,
    /// Number of folds of the cross-validation; 0 for none.
    pub folds: usize,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self { search: Search::default(), deviations_known: true, folds: 10 }
    }
}

/// Identifies the parameters.
///
/// # Errors
/// [`IdentifyError`].
pub fn identify(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
) -> Result<Identified, IdentifyError> {
    let rows = measurements.rows();
    if rows == 0 || parameters.is_empty() {
        return Err(IdentifyError::Nothing { parameters: parameters.len(), rows });
    }
    let mut measurements = placed(plant, measurements)?;
    let (scatter, begin) = match options.deviations_known {
        true => (1.0, None),
        false => scatter(plant, parameters, &measurements, options).map(|(scatter, at)| (scatter, Some(at)))?,
    };
    measurements.readings.iter_mut().for_each(|reading| reading.scale_deviations(scatter));
    let before = initial_residuals(plant, &measurements, options)?;
    let solution = match begin {
        Some(begin) => fitted(plant, parameters, &measurements, options, Some(&begin))?,
        None => searched(plant, parameters, &measurements, options)?,
    };
    let (solution, shared) = with_kept(plant, parameters, &measurements, options, solution)?;
    let held_out = held_out(plant, parameters, &measurements, options, &solution, &before)?;
    let mut found = summarise(parameters, &shared, &measurements, options, solution, before, held_out);
    // Back to units of the given deviations.
    found.solution.residuals *= scatter;
    found.before.iter_mut().for_each(|r| *r *= scatter);
    if let Some(held) = &mut found.held_out {
        held.residuals.iter_mut().for_each(|r| *r *= scatter);
        (held.rms, held.rms_initial) = (held.rms * scatter, held.rms_initial * scatter);
    }
    let sound =
        |p: &ParameterEstimate| p.value.is_finite() && (p.std.is_nan() || p.interval.iter().all(|x| x.is_finite()));
    match found.parameters.iter().all(sound) {
        true => Ok(found),
        false => Err(IdentifyError::NotFinite),
    }
}

/// Prior deviation that keeps a parameter at its initial value, relative to its reference.
const PINNED: f64 = 1e-9;
/// Maximum ratio of the scatters with some parameters at their initial values and without.
const AS_WELL: f64 = 1.1;

/// Returns the ratio of the scatter about the fit to the given deviations, for the case in which
/// only the ratios of deviations are known, and the unknowns at the end of the search. The
/// iteration starts from the scatter about the arm with its initial values, so that the loss and
/// the test for identifiable directions are scaled from the start.
fn scatter(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
) -> Result<(f64, DVector<f64>), IdentifyError> {
    let rms = |values: &[f64]| (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt();
    let observed = MeasuredArm { plant, parameters: &[], measurements }.observed();
    let deviations = measurements.readings.iter().flat_map(Reading::deviations);
    let sizes: Vec<f64> = observed.iter().zip(deviations).map(|(x, std)| x / std).collect();
    let first = rms(&initial_residuals(plant, measurements, options)?).max(1e-9 * rms(&sizes));
    let first = if first > 0.0 { first } else { 1.0 };
    let mut scatter = first;
    let mut at: Option<DVector<f64>> = None;
    for _ in 0..SCATTER_ROUNDS {
        let mut scaled = measurements.clone();
        scaled.readings.iter_mut().for_each(|reading| reading.scale_deviations(scatter));
        let solution = match &at {
            Some(at) => fitted(plant, parameters, &scaled, options, Some(at))?,
            None => searched(plant, parameters, &scaled, options)?,
        };
        if solution.freedom == 0 {
            return Err(IdentifyError::NoScatter { rows: measurements.rows() });
        }
        let next = (scatter * solution.scale.sqrt()).max(1e-6 * first);
        let settled = (next / scatter).ln().abs() < 0.01;
        (scatter, at) = (next, Some(solution.unknowns));
        if settled {
            break;
        }
    }
    Ok((scatter, at.unwrap_or_else(|| DVector::zeros(parameters.len() + measurements.own_unknowns()))))
}

/// Keeps the parameters that the readings do not determine at their initial values and fits the
/// others again. Returns that solution, with the directions and deviations of the free one, if it
/// explains the readings about as well; otherwise the free solution. Also returns which parameters
/// have their found value although the readings only determine it together with others: joint
/// frames, and numbers of guides whose initial values contradict the readings.
fn with_kept(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    solution: Solution,
) -> Result<(Solution, Vec<bool>), IdentifyError> {
    let mut shared: Vec<bool> = parameters.iter().map(Parameter::is_shared).collect();
    let found = estimates(parameters, &shared, &solution, 1.0);
    let of_guide = |k: usize| matches!(parameters[k].effect, Effect::Guide { .. });
    for _ in 0..2 {
        let kept = |k: &usize| !found[*k].identifiable && !shared[*k] && solution.unknowns[*k] != 0.0;
        let kept: Vec<usize> = (0..parameters.len()).filter(kept).collect();
        if kept.is_empty() {
            break;
        }
        let (mut start, mut priors) = (solution.unknowns.clone(), priors(parameters));
        for &k in &kept {
            (start[k], priors[k]) = (0.0, PINNED * parameters[k].reference());
        }
        let again = fitted_within(plant, parameters, measurements, options, (&start, &priors)).ok();
        if let Some(again) = again.filter(|again| (again.scale / solution.scale).sqrt() <= AS_WELL) {
            let Solution { unknowns, residuals, weights, leverages, scale, cost, converged, .. } = again;
            let solution = Solution { unknowns, residuals, weights, leverages, scale, cost, converged, ..solution };
            return Ok((solution, shared));
        }
        kept.into_iter().filter(|k| of_guide(*k)).for_each(|k| shared[k] = true);
    }
    Ok((solution, shared))
}

/// Returns the prior deviations, each at most the parameter's reference: a weaker prior must not
/// make a parameter identifiable.
fn priors(parameters: &[Parameter]) -> Vec<f64> {
    parameters.iter().map(|parameter| parameter.prior.min(parameter.reference())).collect()
}

fn fitted(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    start: Option<&DVector<f64>>,
) -> Result<Solution, IdentifyError> {
    let zeros = DVector::zeros(parameters.len() + measurements.own_unknowns());
    let within = (start.unwrap_or(&zeros), &priors(parameters)[..]);
    fitted_within(plant, parameters, measurements, options, within)
}

/// Fits all readings from a start, with given prior deviations.
fn fitted_within(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    (start, priors): (&DVector<f64>, &[f64]),
) -> Result<Solution, IdentifyError> {
    let arm = MeasuredArm { plant, parameters, measurements };
    solve(&arm, start, priors, &options.search).map_err(|error| match error {
        SolveError::Model(error) => IdentifyError::Model(error),
        SolveError::Nuisance(number) => IdentifyError::Untold { what: own_name(measurements, number) },
        SolveError::NotFinite => IdentifyError::NotFinite,
    })
}

/// Fits all readings. The cost of frequency responses has local minima where resonances of the
/// model are close to other resonances of the arm. Such problems are first fitted in the logarithm
/// of the response, and from further starts as long as the scatter exceeds the declared one.
fn searched(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
) -> Result<Solution, IdentifyError> {
    let vibrates = |reading: &Reading| matches!(reading.kind, ReadingKind::Response(_));
    if !measurements.readings.iter().any(vibrates) {
        return fitted(plant, parameters, measurements, options, None);
    }
    let logarithmic = measurements.logarithmic();
    let from = |start: &DVector<f64>| -> Result<Solution, IdentifyError> {
        let begin = match &logarithmic {
            Some(smooth) => fitted(plant, parameters, smooth, options, Some(start))?.unknowns,
            None => start.clone(),
        };
        fitted(plant, parameters, measurements, options, Some(&begin))
    };
    let zeros = DVector::zeros(parameters.len() + measurements.own_unknowns());
    let mut best = from(&zeros);
    for number in 0..STARTS {
        if options.deviations_known && best.as_ref().is_ok_and(|best| !misfits(best)) {
            break;
        }
        let mut start = zeros.clone();
        for (k, parameter) in parameters.iter().enumerate() {
            start[k] = spread(number, k) * parameter.reference();
        }
        let other = from(&start);
        let better = match (&other, &best) {
            (Ok(other), Ok(best)) => other.cost < best.cost,
            (Ok(_), Err(_)) => true,
            _ => false,
        };
        if better {
            best = other;
        }
    }
    best
}

/// Returns a number between -1.5 and 1.5 for a start and a coordinate, from the additive recurrence
/// of square roots of primes.
fn spread(start: usize, coordinate: usize) -> f64 {
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let root = PRIMES[coordinate % PRIMES.len()].sqrt() * (1 + coordinate / PRIMES.len()) as f64;
    3.0 * (root * (start + 1) as f64).fract() - 1.5
}

/// Whether the residuals scatter more than chance explains.
fn misfits(solution: &Solution) -> bool {
    solution.freedom > 0 && solution.scale > chi_square_bound(solution.freedom)
}

/// Describes an unknown of the measurements by its number.
fn own_name(measurements: &Measurements, number: usize) -> String {
    let mut first = 0;
    for (k, instrument) in measurements.instruments.iter().enumerate() {
        first += instrument.unknowns();
        if number < first {
            return match instrument {
                Instrument::Axes(_) => format!("the orientation of instrument {k} in the world"),
                _ => format!("the pose of instrument {k} in the world"),
            };
        }
    }
    "the position of a target on the tool".to_owned()
}

/// Returns the standardised residuals of the arm with its initial values, with the unknowns of the
/// measurements fitted.
fn initial_residuals(
    plant: &Plant,
    measurements: &Measurements,
    options: &IdentifyOptions,
) -> Result<Vec<f64>, IdentifyError> {
    Ok(fitted(plant, &[], measurements, options, None)?.residuals.iter().copied().collect())
}

/// Predicts each fold of the readings from the other folds.
fn held_out(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    all: &Solution,
    before: &[f64],
) -> Result<Option<HeldOut>, IdentifyError> {
    let folds = options.folds.min(measurements.readings.len());
    if folds < 2 {
        return Ok(None);
    }
    let mut residuals = vec![f64::NAN; measurements.rows()];
    let mut first = Vec::with_capacity(measurements.readings.len());
    let mut row = 0;
    for reading in &measurements.readings {
        first.push(row);
        row += reading.rows();
    }
    for fold in 0..folds {
        let others = measurements.of_readings(|k| k % folds != fold);
        let own = measurements.of_readings(|k| k % folds == fold);
        // A fold is skipped if the others do not determine the unknowns of the measurement.
        let Ok(found) = fitted(plant, parameters, &others, options, Some(&all.unknowns)) else { continue };
        let arm = MeasuredArm { plant, parameters, measurements: &own };
        let unseen = arm.evaluate(&found.unknowns, None)?;
        let places = (0..measurements.readings.len())
            .filter(|k| k % folds == fold)
            .flat_map(|k| first[k]..first[k] + measurements.readings[k].rows());
        for (place, r) in places.zip(unseen.iter()) {
            residuals[place] = *r;
        }
    }
    let seen: Vec<usize> = (0..residuals.len()).filter(|k| residuals[*k].is_finite()).collect();
    if seen.is_empty() {
        return Ok(None);
    }
    let rms = |values: &[f64]| (seen.iter().map(|k| values[*k].powi(2)).sum::<f64>() / seen.len() as f64).sqrt();
    Ok(Some(HeldOut { folds, rms: rms(&residuals), rms_initial: rms(before), residuals }))
}

/// Returns the upper 0.1 % quantile of χ² over its degrees of freedom (Wilson and Hilferty).
pub fn chi_square_bound(freedom: usize) -> f64 {
    let nine = 2.0 / (9.0 * freedom as f64);
    (1.0 - nine + MISFIT_QUANTILE * nine.sqrt()).powi(3)
}

/// Returns the estimates of the parameters.
///
/// * `shared`: which parameters have their found value even if they are not identifiable.
/// * `scatter`: ratio of the deviations to those of the solution; NaN if the model does not fit.
fn estimates(parameters: &[Parameter], shared: &[bool], solution: &Solution, scatter: f64) -> Vec<ParameterEstimate> {
    let V = solution.directions.columns(0, solution.identified);
    let share = |k: usize| 1.0 - V.row(k).norm_squared();
    let estimate = |(k, parameter): (usize, &Parameter)| {
        let spread = solution.covariance[(k, k)].sqrt();
        // The search judges directions before the prior is dropped; at the solution the data may
        // determine them less well, hence the second condition.
        let identifiable = share(k) <= UNTOLD && spread <= parameter.reference();
        let (x, std) = (solution.unknowns[k], if identifiable { spread * scatter } else { f64::NAN });
        ParameterEstimate {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            initial: parameter.initial,
            value: if identifiable || shared[k] { parameter.value(x) } else { parameter.initial },
            std: parameter.deviation(x, std),
            interval: parameter.interval(x, std, 1.96),
            identifiable,
            shared: shared[k],
        }
    };
    parameters.iter().enumerate().map(estimate).collect()
}

/// Returns the directions that are not identified as parameters and weights, largest weight first.
fn untold(solution: &Solution) -> Vec<Vec<(usize, f64)>> {
    let combination = |j: usize| {
        let column = solution.directions.column(j);
        let mut parts: Vec<(usize, f64)> = column.iter().copied().enumerate().filter(|(_, w)| w.abs() > 0.2).collect();
        parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        parts
    };
    (solution.identified..solution.directions.ncols()).map(combination).collect()
}

fn summarise(
    parameters: &[Parameter],
    shared: &[bool],
    measurements: &Measurements,
    options: &IdentifyOptions,
    mut solution: Solution,
    before: Vec<f64>,
    held_out: Option<HeldOut>,
) -> Identified {
    let p = parameters.len();
    let misfit = (options.deviations_known && misfits(&solution)).then(|| solution.scale.sqrt());
    let scatter = match options.deviations_known {
        true => misfit.unwrap_or(1.0),
        false if solution.freedom > 0 => solution.scale.sqrt(),
        false => f64::INFINITY,
    };
    let fits = misfit.is_none_or(|factor| factor <= NO_FIT);
    solution.converged &= fits;
    let C = &solution.covariance;
    let correlation = DMatrix::from_fn(p, p, |i, j| C[(i, j)] / (C[(i, i)] * C[(j, j)]).sqrt());
    let over_own = |(r, h): (&f64, &f64)| r / (scatter * (1.0 - h).max(1e-6).sqrt());
    let normalised: Vec<f64> = solution.residuals.iter().zip(solution.leverages.iter()).map(over_own).collect();
    let mut suspicious: Vec<usize> = (0..normalised.len()).filter(|k| normalised[*k].abs() > SUSPICIOUS).collect();
    suspicious.sort_by(|a, b| normalised[*b].abs().total_cmp(&normalised[*a].abs()));
    let own = &solution.unknowns.as_slice()[p..];
    Identified {
        parameters: estimates(parameters, shared, &solution, if fits { scatter } else { f64::NAN }),
        correlation,
        untold: untold(&solution),
        before,
        normalised,
        suspicious,
        misfit,
        held_out,
        instruments: (0..measurements.instruments.len()).map(|k| measurements.instrument(k, own).0).collect(),
        targets: (0..measurements.targets.len()).map(|k| measurements.target(k, own).0).collect(),
        solution,
    }
}
