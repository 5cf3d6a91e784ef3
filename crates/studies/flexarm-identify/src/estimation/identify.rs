//! Identification of arm parameters from readings: estimates, uncertainties, combinations that are
//! not identifiable, and evidence against the model.

use flexarm_kinematics::Pose;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Translation3, Vector3};

use crate::estimation::least_squares::{Residuals, Search, Solution, SolveError, solve};
use crate::estimation::measurement::{MeasuredArm, NoAnswer};
use crate::estimation::parameter::{Effect, Parameter, Plant};
use crate::estimation::reading::{Component, Instrument, Measurements, Reading, ReadingKind, Target};

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

/// Estimate of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterEstimate {
    /// Name, as in the robot file.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Initial value.
    pub initial: f64,
    /// Estimated value; the initial value if the parameter is not identifiable.
    pub value: f64,
    /// Standard deviation; NaN if the parameter is not identifiable or the model does not fit the
    /// readings.
    pub std: f64,
    /// 95 % confidence interval; NaN where `std` is NaN.
    pub interval: [f64; 2],
    /// Whether the readings determine the parameter.
    pub identifiable: bool,
    /// Whether it has its found value even if the readings only determine it together with others.
    pub shared: bool,
}

/// Cross-validation: residuals of readings that the fit did not use.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Number of folds.
    pub folds: usize,
    /// RMS of the standardised residuals, each predicted from the other folds.
    pub rms: f64,
    /// RMS of the standardised residuals with the initial values.
    pub rms_initial: f64,
    /// Standardised residual of each number of each reading; NaN where no prediction is possible.
    pub residuals: Vec<f64>,
}

/// Result of an identification.
#[derive(Clone, Debug)]
pub struct Identified {
    /// Estimates, one per parameter, in order.
    pub parameters: Vec<ParameterEstimate>,
    /// Correlation matrix of the parameters' coordinates, p×p.
    pub correlation: DMatrix<f64>,
    /// Combinations that the readings do not determine: parameter and weight, largest weight first.
    pub untold: Vec<Vec<(usize, f64)>>,
    /// Solution of the least-squares problem.
    pub solution: Solution,
    /// Standardised residuals with the initial values, with the unknowns of the measurement fitted.
    pub before: Vec<f64>,
    /// Residuals over their own standard deviation after the fit; a magnitude above four
    /// contradicts the other readings.
    pub normalised: Vec<f64>,
    /// Indices into [`Self::normalised`] with a magnitude above four, largest first.
    pub suspicious: Vec<usize>,
    /// Ratio of the scatter to the declared one, if chance exceeds it less than once in a thousand
    /// cases.
    pub misfit: Option<f64>,
    /// Cross-validation.
    pub held_out: Option<HeldOut>,
    /// Estimated poses of unknown instruments: the world in the instrument's axes.
    pub instruments: Vec<Pose>,
    /// Estimated positions of the targets in tool axes (m).
    pub targets: Vec<Vector3<f64>>,
}

/// Reason why an identification fails.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// No parameter or no reading.
    #[error("{parameters} parameters and {rows} measured numbers: at least one of each is needed")]
    Nothing {
        /// Number of parameters.
        parameters: usize,
        /// Number of measured numbers.
        rows: usize,
    },
    /// Too few measured places for an instrument.
    #[error(
        "instrument {instrument}: its pose requires at least three measured places that are not on one line, found \
         {places}"
    )]
    Instrument {
        /// Number of the instrument.
        instrument: usize,
        /// Number of its places.
        places: usize,
    },
    /// Too few displacements to find the axes of an instrument.
    #[error(
        "instrument {instrument}: its axes require displacements with all three components along at least two \
         directions, found {displacements}; add such readings, or give its orientation"
    )]
    Axes {
        /// Number of the instrument.
        instrument: usize,
        /// Number of its displacements.
        displacements: usize,
    },
    /// The arm model has no solution for a reading.
    #[error(transparent)]
    Model(#[from] NoAnswer),
    /// The readings do not determine an unknown of the measurement.
    #[error(
        "the readings do not determine {what}: measure at more different poses, in particular with different \
         orientations of the tool"
    )]
    Untold {
        /// Description of the unknown.
        what: String,
    },
    /// The scatter cannot be estimated, because there are as many unknowns as numbers.
    #[error(
        "the {rows} numbers have no standard deviation and there are as many unknowns: the scatter cannot be \
         estimated; give a standard deviation or measure more"
    )]
    NoScatter {
        /// Number of measured numbers.
        rows: usize,
    },
    /// A value is not finite.
    #[error(
        "a residual or a derivative is not finite: a value, a standard deviation or an uncertainty is too large or \
         too small"
    )]
    NotFinite,
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

/// Returns the measurements with each unknown instrument at its best fit to the arm with its
/// initial values.
fn placed(plant: &Plant, measurements: &Measurements) -> Result<Measurements, IdentifyError> {
    let mut placed = measurements.clone();
    for number in 0..measurements.instruments.len() {
        let of_it = |kind: &ReadingKind| match kind {
            ReadingKind::InstrumentAt { instrument, .. } => *instrument == number,
            _ => false,
        };
        let said = measurements.readings.iter().any(|reading| of_it(&reading.kind));
        match measurements.instruments[number] {
            Instrument::Unknown(_) if !said => {
                let seen =
                    |kind: &ReadingKind| matches!(kind, ReadingKind::Place { instrument, .. } if *instrument == number);
                let [world, own] = both_points(plant, measurements, seen)?;
                let too_few = || IdentifyError::Instrument { instrument: number, places: world.len() };
                placed.instruments[number] = Instrument::Unknown(rigid_fit(&world, &own).ok_or_else(too_few)?);
            }
            Instrument::Axes(_) if !said => {
                let seen = |kind: &ReadingKind| seen_in_axes(kind, number);
                let [world, own] = both_points(plant, measurements, seen)?;
                let too_few = || IdentifyError::Axes { instrument: number, displacements: world.len() };
                placed.instruments[number] = Instrument::Axes(rotation_fit(&world, &own).ok_or_else(too_few)?);
            }
            _ => {}
        }
    }
    Ok(placed)
}

/// Whether a reading consists of exactly the three components of a displacement in the axes of an
/// instrument.
fn seen_in_axes(kind: &ReadingKind, instrument: usize) -> bool {
    let ReadingKind::Displacement { rows, .. } = kind else { return false };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    rows.len() == 3 && rows.iter().zip(axes).all(|(row, axis)| row.of == Component::AlongSeen(instrument, axis))
}

/// Returns the vectors of some readings, predicted in world axes by the arm with its initial
/// values, and as observed.
fn both_points(
    plant: &Plant,
    measurements: &Measurements,
    some: impl Fn(&ReadingKind) -> bool,
) -> Result<[Vec<Vector3<f64>>; 2], IdentifyError> {
    // With instruments at the identity, predictions are in world axes.
    let mut seen = measurements.of_readings(|k| some(&measurements.readings[k].kind));
    seen.instruments.iter_mut().for_each(|i| *i = Instrument::Known(Pose::identity()));
    seen.targets.iter_mut().for_each(|t| {
        if let Target::Unknown(guess) = t {
            *t = Target::Known(*guess);
        }
    });
    let arm = MeasuredArm { plant, parameters: &[], measurements: &seen };
    Ok([points(&arm.predicted(&DVector::zeros(0))?), points(&arm.observed())])
}

pub(crate) fn points(values: &[f64]) -> Vec<Vector3<f64>> {
    values.chunks_exact(3).map(Vector3::from_column_slice).collect()
}

/// Returns the rotation and translation that map points onto others with the least sum of squares
/// (Arun, Huang and Blostein 1987).
pub(crate) fn rigid_fit(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Pose> {
    let n = from.len();
    if n < 3 {
        return None;
    }
    let middle = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / n as f64;
    let (a, b) = (middle(from), middle(to));
    let less = |points: &[Vector3<f64>], middle| points.iter().map(|p| p - middle).collect::<Vec<_>>();
    let R = rotation_fit(&less(from, a), &less(to, b))?;
    Some(Pose::from_parts(Translation3::from(b - R * a), R))
}

/// Returns the rotation that maps vectors onto others with the least sum of squares; `None` if all
/// are collinear.
pub(crate) fn rotation_fit(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Rotation3<f64>> {
    let H: Matrix3<f64> = from.iter().zip(to).map(|(p, q)| p * q.transpose()).sum();
    if !H.norm_squared().is_finite() {
        return None;
    }
    let svd = H.svd(true, true);
    let (U, Vt) = (svd.u?, svd.v_t?);
    let mut sizes: Vec<f64> = svd.singular_values.iter().copied().collect();
    sizes.sort_by(|x, y| y.total_cmp(x));
    // Collinear vectors leave the rotation about their line undetermined.
    if sizes[1] <= 1e-9 * sizes[0] {
        return None;
    }
    let mut turn = Matrix3::identity();
    let smallest = svd.singular_values.imin();
    turn[(smallest, smallest)] = (Vt.transpose() * U.transpose()).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(Vt.transpose() * turn * U.transpose()))
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
fn chi_square_bound(freedom: usize) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_fit_finds_a_placement_again_and_refuses_points_on_a_line() {
        let X = Pose::from_parts(Translation3::new(3.0, -1.0, 0.4), Rotation3::from_euler_angles(0.3, -1.1, 2.0));
        let from: Vec<Vector3<f64>> =
            (0..6).map(|k| Vector3::new(f64::from(k).sin(), f64::from(k * k).cos(), 0.3 * f64::from(k))).collect();
        let to: Vec<Vector3<f64>> = from.iter().map(|p| X.rotation * p + X.translation.vector).collect();
        let found = rigid_fit(&from, &to).unwrap();
        let error = (found.rotation.matrix() - X.rotation.matrix()).amax();
        assert!(error < 1e-14, "{error:e}");
        let line: Vec<Vector3<f64>> = (0..6).map(|k| Vector3::new(f64::from(k), 2.0 * f64::from(k), 1.0)).collect();
        assert!(rigid_fit(&line, &line).is_none());
    }

    #[test]
    fn the_bound_on_the_scatter_is_that_of_the_tables() {
        // Truth: upper 0.1 % quantiles of χ², 29.588 and 149.449 for 10 and 100 degrees of freedom.
        for (freedom, table) in [(10, 29.588), (100, 149.449)] {
            let found = chi_square_bound(freedom) * freedom as f64;
            assert!((found / table - 1.0).abs() < 1e-2, "{found} for {table}"); // measured: 5.8e-3
        }
    }
}
