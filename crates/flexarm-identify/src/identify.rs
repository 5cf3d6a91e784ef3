//! Parameters of an arm from readings: estimate, uncertainty, what is not told, what argues against the model.

use flexarm_kinematics::Pose;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Translation3, Vector3};

use crate::least_squares::{Residuals, Search, Solution, SolveError, solve};
use crate::measurement::{MeasuredArm, NoAnswer};
use crate::parameter::{Parameter, Plant};
use crate::reading::{Instrument, Measurements, ReadingKind, Target};

/// A residual over its own standard deviation beyond which a reading is named.
const SUSPICIOUS: f64 = 4.0;
/// One-sided normal quantile at which the scatter is said to be larger than declared: one in a thousand.
const MISFIT_QUANTILE: f64 = 3.09;
/// Part of a parameter that may lie in directions that are not identified.
const UNTOLD: f64 = 0.05;

/// How parameters are found.
#[derive(Clone, Copy, Debug)]
pub struct IdentifyOptions {
    /// Loss, iterations, tolerance.
    pub search: Search,
    /// Whether the deviations of the readings are known; if not, only their ratios count and the scatter tells their size.
    pub deviations_known: bool,
    /// Parts into which readings are divided to hold one out after another; 0 for none.
    pub folds: usize,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self { search: Search::default(), deviations_known: true, folds: 10 }
    }
}

/// A parameter as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Name, as in the robot file.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Before.
    pub initial: f64,
    /// Now; the initial value where the readings say nothing.
    pub value: f64,
    /// Standard deviation; the prior's where the readings say nothing.
    pub std: f64,
    /// Where it lies in 95 of 100 cases.
    pub interval: [f64; 2],
    /// Whether the readings tell it.
    pub identifiable: bool,
}

/// How readings are met that the fit has not seen.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Parts that were held out in turn.
    pub folds: usize,
    /// RMS of residuals over their deviations, with the fitted values of the other parts.
    pub rms: f64,
    /// The same with the initial values.
    pub rms_initial: f64,
    /// Of each number of each reading: residual over its deviation.
    pub residuals: Vec<f64>,
}

/// Parameters of an arm as readings tell them.
#[derive(Clone, Debug)]
pub struct Identified {
    /// One per parameter, in order.
    pub parameters: Vec<Found>,
    /// Correlation of the parameters' coordinates, p×p.
    pub correlation: DMatrix<f64>,
    /// Combinations that the readings do not tell: parameter and weight, the largest first.
    pub untold: Vec<Vec<(usize, f64)>>,
    /// The search's result.
    pub solution: Solution,
    /// Standard residuals with the initial values, unknowns of the measurement fitted.
    pub before: Vec<f64>,
    /// Residual of each number over what its own scatter would be: beyond four it argues against the rest.
    pub normalised: Vec<f64>,
    /// Numbers of [`Self::normalised`] beyond four, the largest first.
    pub suspicious: Vec<usize>,
    /// How many times larger than declared the scatter is, where chance does so less than once in a thousand cases.
    pub misfit: Option<f64>,
    /// Readings that the fit has not seen.
    pub held_out: Option<HeldOut>,
    /// Unknown instruments as found: the world in their axes.
    pub instruments: Vec<Pose>,
    /// Targets as found, tool axes (m).
    pub targets: Vec<Vector3<f64>>,
}

/// Why nothing was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Nothing to find or nothing to find it from.
    #[error("{parameters} parameters and {rows} measured numbers: at least one of each is needed")]
    Nothing {
        /// How many parameters.
        parameters: usize,
        /// How many numbers.
        rows: usize,
    },
    /// An instrument of which too few places are known.
    #[error(
        "instrument {instrument}: where it stands follows from at least three measured places that are not on one line, found {places}"
    )]
    Instrument {
        /// Its number.
        instrument: usize,
        /// Places.
        places: usize,
    },
    /// The arm has no answer.
    #[error(transparent)]
    Model(#[from] NoAnswer),
    /// Unknowns of the measurement that nothing tells.
    #[error("the readings do not tell {what}: move the arm into more different poses, above all turn the tool")]
    Untold {
        /// Which.
        what: String,
    },
    /// Deviations that nothing tells.
    #[error(
        "the {rows} numbers have no standard deviation and there are as many unknowns: nothing scatters; give a deviation or measure more"
    )]
    NoScatter {
        /// How many numbers.
        rows: usize,
    },
    /// Overflow.
    #[error(
        "a residual or a derivative is not a number: a value, a deviation or an uncertainty is out of all proportion"
    )]
    NotFinite,
}

/// Finds the parameters.
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
    let measurements = &placed(plant, measurements)?;
    let before = initial_residuals(plant, measurements, options)?;
    let solution = fitted(plant, parameters, measurements, options, None)?;
    let held_out = held_out(plant, parameters, measurements, options, &solution, &before)?;
    if !options.deviations_known && solution.freedom == 0 {
        return Err(IdentifyError::NoScatter { rows });
    }
    let found = told(parameters, measurements, options, solution, before, held_out);
    let numbers = |p: &Found| [p.value, p.std, p.interval[0], p.interval[1]];
    match found.parameters.iter().flat_map(numbers).all(f64::is_finite) {
        true => Ok(found),
        false => Err(IdentifyError::NotFinite),
    }
}

fn priors(parameters: &[Parameter]) -> Vec<f64> {
    parameters.iter().map(|parameter| parameter.prior).collect()
}

fn fitted(
    plant: &Plant,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    start: Option<&DVector<f64>>,
) -> Result<Solution, IdentifyError> {
    let arm = MeasuredArm { plant, parameters, measurements };
    let zeros = DVector::zeros(parameters.len() + measurements.own_unknowns());
    solve(&arm, start.unwrap_or(&zeros), &priors(parameters), &options.search).map_err(|error| match error {
        SolveError::Model(error) => IdentifyError::Model(error),
        SolveError::Nuisance(number) => IdentifyError::Untold { what: own_name(measurements, number) },
        SolveError::NotFinite => IdentifyError::NotFinite,
    })
}

/// What an unknown of the measurements is.
fn own_name(measurements: &Measurements, number: usize) -> String {
    let unknown = |i: &&(usize, &Instrument)| matches!(i.1, Instrument::Unknown(_));
    let instruments: Vec<usize> =
        measurements.instruments.iter().enumerate().filter(|i| unknown(&i)).map(|i| i.0).collect();
    match instruments.get(number / 6) {
        Some(k) => format!("where instrument {k} stands"),
        None => "where a target is on the tool".to_owned(),
    }
}

/// The measurements with unknown instruments where they fit best to the arm as it is known.
fn placed(plant: &Plant, measurements: &Measurements) -> Result<Measurements, IdentifyError> {
    let mut placed = measurements.clone();
    for number in 0..measurements.instruments.len() {
        if !matches!(measurements.instruments[number], Instrument::Unknown(_)) {
            continue;
        }
        // In world axes: the instrument as if it stood there.
        let mut seen = measurements.of_readings(
            |k| matches!(measurements.readings[k].kind, ReadingKind::Place { instrument, .. } if instrument == number),
        );
        seen.instruments.iter_mut().for_each(|i| *i = Instrument::Known(Pose::identity()));
        seen.targets.iter_mut().for_each(|t| {
            if let Target::Unknown(guess) = t {
                *t = Target::Known(*guess);
            }
        });
        let arm = MeasuredArm { plant, parameters: &[], measurements: &seen };
        let world = points(&arm.predicted(&DVector::zeros(0))?);
        let Some(X_IW) = rigid_fit(&world, &points(&arm.observed())) else {
            return Err(IdentifyError::Instrument { instrument: number, places: world.len() });
        };
        placed.instruments[number] = Instrument::Unknown(X_IW);
    }
    Ok(placed)
}

fn points(values: &[f64]) -> Vec<Vector3<f64>> {
    values.chunks_exact(3).map(Vector3::from_column_slice).collect()
}

/// Rotation and translation that bring points onto others with the least sum of squares (Arun, Huang and Blostein 1987).
fn rigid_fit(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Pose> {
    let n = from.len();
    if n < 3 {
        return None;
    }
    let middle = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / n as f64;
    let (a, b) = (middle(from), middle(to));
    let H: Matrix3<f64> = from.iter().zip(to).map(|(p, q)| (p - a) * (q - b).transpose()).sum();
    if !H.norm_squared().is_finite() {
        return None;
    }
    let svd = H.svd(true, true);
    let (U, Vt) = (svd.u?, svd.v_t?);
    let mut sizes: Vec<f64> = svd.singular_values.iter().copied().collect();
    sizes.sort_by(|x, y| y.total_cmp(x));
    // On one line any turn about it fits.
    if sizes[1] <= 1e-9 * sizes[0] {
        return None;
    }
    let mut turn = Matrix3::identity();
    let smallest = svd.singular_values.imin();
    turn[(smallest, smallest)] = (Vt.transpose() * U.transpose()).determinant().signum();
    let R = Rotation3::from_matrix_unchecked(Vt.transpose() * turn * U.transpose());
    Some(Pose::from_parts(Translation3::from(b - R * a), R))
}

/// Standard residuals of the arm as it is known, unknowns of the measurements fitted.
fn initial_residuals(
    plant: &Plant,
    measurements: &Measurements,
    options: &IdentifyOptions,
) -> Result<Vec<f64>, IdentifyError> {
    Ok(fitted(plant, &[], measurements, options, None)?.residuals.iter().copied().collect())
}

/// Each part of the readings predicted from the others.
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
        // What belongs to the measurement may not follow from the others alone: then this part has no say.
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

/// χ² over its degrees of freedom that chance exceeds once in a thousand cases (Wilson and Hilferty).
fn chi_square_bound(freedom: usize) -> f64 {
    let nine = 2.0 / (9.0 * freedom as f64);
    (1.0 - nine + MISFIT_QUANTILE * nine.sqrt()).powi(3)
}

fn told(
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    solution: Solution,
    before: Vec<f64>,
    held_out: Option<HeldOut>,
) -> Identified {
    let p = parameters.len();
    let misfit =
        (options.deviations_known && solution.freedom > 0 && solution.scale > chi_square_bound(solution.freedom))
            .then(|| solution.scale.sqrt());
    let scatter = match options.deviations_known {
        true => misfit.unwrap_or(1.0),
        false if solution.freedom > 0 => solution.scale.sqrt(),
        false => f64::INFINITY,
    };
    let V = solution.directions.columns(0, solution.identified);
    let share = |k: usize| 1.0 - V.row(k).norm_squared();
    let found = parameters.iter().enumerate().map(|(k, parameter)| {
        let identifiable = share(k) <= UNTOLD;
        let spread = solution.covariance[(k, k)].sqrt();
        let (x, std) = (solution.unknowns[k], if identifiable { spread * scatter } else { spread });
        Found {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            initial: parameter.initial,
            value: parameter.value(x),
            std: parameter.deviation(x, std),
            interval: parameter.interval(x, std, 1.96),
            identifiable,
        }
    });
    let found: Vec<Found> = found.collect();
    let C = &solution.covariance;
    let correlation = DMatrix::from_fn(p, p, |i, j| C[(i, j)] / (C[(i, i)] * C[(j, j)]).sqrt());
    let untold = (solution.identified..p).map(|j| {
        let column = solution.directions.column(j);
        let mut parts: Vec<(usize, f64)> = column.iter().copied().enumerate().filter(|(_, w)| w.abs() > 0.2).collect();
        parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        parts
    });
    let untold = untold.collect();
    let normalised: Vec<f64> = solution
        .residuals
        .iter()
        .zip(solution.leverages.iter())
        .map(|(r, h)| r / (scatter * (1.0 - h).max(1e-6).sqrt()))
        .collect();
    let mut suspicious: Vec<usize> = (0..normalised.len()).filter(|k| normalised[*k].abs() > SUSPICIOUS).collect();
    suspicious.sort_by(|a, b| normalised[*b].abs().total_cmp(&normalised[*a].abs()));
    let own = &solution.unknowns.as_slice()[p..];
    let instruments = (0..measurements.instruments.len()).map(|k| measurements.instrument(k, own).0).collect();
    let targets = (0..measurements.targets.len()).map(|k| measurements.target(k, own).0).collect();
    Identified {
        parameters: found,
        correlation,
        untold,
        before,
        normalised,
        suspicious,
        misfit,
        held_out,
        instruments,
        targets,
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
        // χ² exceeded with probability 0.001: 29.588 of 10, 149.449 of 100 degrees of freedom.
        for (freedom, table) in [(10, 29.588), (100, 149.449)] {
            let found = chi_square_bound(freedom) * freedom as f64;
            assert!((found / table - 1.0).abs() < 1e-2, "{found} for {table}"); // measured: 5.8e-3
        }
    }
}
