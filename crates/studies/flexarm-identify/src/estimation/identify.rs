//! Identification of arm parameters from readings: estimates, uncertainties, combinations that are
//! not identifiable, and evidence against the model.
//!
//! One fit gives everything: its solution is what is reported and written. Springs are sought as
//! compliances with a prior around zero that are not negative, so that a spring which the readings
//! do not determine is rigid.
//!
//! Not here: derivatives (`sensitivity`, `response`), the least-squares solver (`least_squares`),
//! files.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::estimation::identified::{FittedParameter, HeldOut, Identified, IdentifyError, ModelError};
use crate::estimation::least_squares::{
    Noise, Progress, Residuals, Search, Solution, SolveError, Unknown, misfit, solve,
};
use crate::estimation::measurement::{MeasuredArm, NoAnswer};
use crate::estimation::parameter::{NominalArm, Parameter};
use crate::estimation::placement::placed;
use crate::estimation::reading::{Instrument, KINDS, Measurements, ReadingKind};

/// Magnitude of a normalised residual above which its reading is suspicious.
const SUSPICIOUS: f64 = 4.0;
/// Maximum number of further starts of a search that may end in a local minimum.
const STARTS: usize = 12;
/// Maximum ratio of posterior to prior deviation of a parameter that the readings determine.
const LEARNT: f64 = 0.5;
/// Minimum entry of the projection on the undetermined directions that connects two parameters.
const CONNECTED: f64 = 0.15;
/// Normal quantile of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// Message about a number that is not finite.
const NOT_FINITE: &str = "a residual or a derivative is not finite: a value, a standard deviation or an uncertainty is \
                          too large or too small";

/// Options of an identification.
#[derive(Clone, Copy, Debug)]
pub struct IdentifyOptions {
    /// Loss, maximum number of iterations, and tolerance.
    pub search: Search,
    /// Number of folds of the cross-validation; 0 for none.
    pub folds: usize,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self { search: Search::default(), folds: 10 }
    }
}

/// Identifies the parameters.
///
/// * `watch`: called after each iteration; the search ends with the best values so far where it
///   returns false.
///
/// # Errors
/// [`IdentifyError`].
pub fn identify(
    nominal: &NominalArm,
    parameters: &[Parameter],
    measurements: &Measurements,
    options: &IdentifyOptions,
    watch: &dyn Fn(&Progress) -> bool,
) -> Result<Identified, IdentifyError> {
    let rows = measurements.rows();
    if rows == 0 || parameters.is_empty() {
        let text =
            format!("{} parameters and {rows} measured numbers: at least one of each is needed", parameters.len());
        return Err(IdentifyError::Readings(text));
    }
    // Instruments start at their best fit to the arm at the start of the search.
    let mut unknowns = unknowns(parameters, measurements);
    let start: Vec<f64> = parameters.iter().zip(&unknowns).map(|(p, u)| p.search(u.start).0).collect();
    let measurements = placed(&nominal.with(parameters, &start), measurements)?;
    unknowns.extend((0..measurements.own_unknowns()).map(|_| Unknown::free()));
    let fit = Fit { nominal, parameters, measurements: &measurements, search: &options.search, watch };
    // Residuals of the robot file as it is, with instruments and targets fitted.
    let before = Fit { parameters: &[], watch: &|_| true, ..fit }.solved(&unknowns[parameters.len()..]);
    let before = match before {
        Ok(found) => found.residuals.as_slice().to_vec(),
        // The arm with its initial values has no equilibrium.
        Err(IdentifyError::Model(_)) => vec![f64::NAN; rows],
        Err(error) => return Err(error),
    };
    let solution = fit.searched(&unknowns)?;
    let found = fit.summary(&unknowns, solution, before, options.folds);
    let sound = |p: &FittedParameter| p.value.is_finite() && (p.std.is_finite() || !p.identifiable);
    match found.parameters.iter().all(sound) {
        true => Ok(found),
        false => Err(IdentifyError::Readings(NOT_FINITE.into())),
    }
}

/// Returns the unknowns of the parameters. Readings at rest determine compliances from a rigid arm,
/// whose displacements are linear in them; vibrations have no derivatives there.
fn unknowns(parameters: &[Parameter], measurements: &Measurements) -> Vec<Unknown> {
    let kind = |vibrates: &dyn Fn(&ReadingKind) -> bool| measurements.readings.iter().any(|r| vibrates(&r.kind));
    let rigid = !kind(&|kind| kind.vibrates());
    let alone = !kind(&|kind| !matches!(kind, ReadingKind::Known { .. }));
    let known = |name: &str| kind(&|kind| matches!(kind, ReadingKind::Known { parameter, .. } if parameter == name));
    let unknown_of = |parameter: &Parameter| {
        let mut unknown = parameter.unknown(rigid);
        if alone {
            unknown.start = parameter.coordinate(0.0);
            // No reading concerns the others: they keep their initial values.
            if let (Some((mean, _)), false) = (&mut unknown.prior, known(&parameter.name)) {
                *mean = unknown.start;
            }
        }
        unknown
    };
    parameters.iter().map(unknown_of).collect()
}

/// A measured arm as a problem in the unknowns of the fit.
struct InUnknowns<'a>(MeasuredArm<'a>);

impl Residuals for InUnknowns<'_> {
    type Error = NoAnswer;

    fn evaluate(&self, unknowns: &DVector<f64>, J: Option<&mut DMatrix<f64>>) -> Result<DVector<f64>, NoAnswer> {
        let mut x = unknowns.clone();
        let rates = to_search(self.0.parameters, &mut x);
        let Some(J) = J else { return self.0.evaluate(&x, None) };
        let r = self.0.evaluate(&x, Some(&mut *J))?;
        rates.iter().enumerate().for_each(|(k, rate)| J.column_mut(k).scale_mut(*rate));
        Ok(r)
    }
}

/// Converts the parameters in `x` to search coordinates; returns the derivatives.
fn to_search(parameters: &[Parameter], x: &mut DVector<f64>) -> Vec<f64> {
    let search_rate = |(parameter, x): (&Parameter, &mut f64)| {
        let (search, rate) = parameter.search(*x);
        *x = search;
        rate
    };
    parameters.iter().zip(x.iter_mut()).map(search_rate).collect()
}

/// Parameters, readings, and how they are fitted.
#[derive(Clone, Copy)]
struct Fit<'a> {
    nominal: &'a NominalArm,
    parameters: &'a [Parameter],
    measurements: &'a Measurements,
    search: &'a Search,
    watch: &'a dyn Fn(&Progress) -> bool,
}

impl Fit<'_> {
    /// Fits all readings.
    fn solved(&self, unknowns: &[Unknown]) -> Result<Solution, IdentifyError> {
        let Self { nominal, parameters, measurements, search, watch } = *self;
        let problem = InUnknowns(MeasuredArm { nominal, parameters, measurements });
        solve(&problem, &measurements.noise(), unknowns, search, watch).map_err(|error| match error {
            SolveError::Model(error) => IdentifyError::Model(error),
            SolveError::Nuisance(k) => IdentifyError::Readings(format!(
                "the readings do not determine {}: measure at more different poses, in particular with different \
                 orientations of the tool",
                own_name(measurements, k - parameters.len())
            )),
            SolveError::NoScatter => IdentifyError::Readings(format!(
                "the {} numbers have no standard deviation and there are as many unknowns: the scatter cannot be \
                 estimated; give a standard deviation or measure more",
                measurements.rows()
            )),
            SolveError::NotFinite => IdentifyError::Readings(NOT_FINITE.into()),
        })
    }

    /// Fits all readings. The cost of frequency responses has local minima where resonances of the
    /// model are close to other resonances of the arm. Such problems are first fitted in the
    /// logarithm of the response, and from further starts as long as the scatter exceeds the
    /// declared one.
    fn searched(&self, unknowns: &[Unknown]) -> Result<Solution, IdentifyError> {
        let responds = |kind: &ReadingKind| matches!(kind, ReadingKind::Response(_));
        if !self.measurements.readings.iter().any(|reading| responds(&reading.kind)) {
            return self.solved(unknowns);
        }
        // A start in search coordinates: the logarithm first, then the form that is asked for.
        let logarithmic = self.measurements.logarithmic();
        let from = |starts: &dyn Fn(usize, &Parameter) -> f64| {
            let mut begun = unknowns.to_vec();
            for (k, parameter) in self.parameters.iter().enumerate() {
                begun[k].start = parameter.coordinate(starts(k, parameter));
            }
            if let Some(smooth) = &logarithmic {
                let found = Fit { measurements: smooth, ..*self }.solved(&begun)?;
                begun.iter_mut().zip(found.unknowns.iter()).for_each(|(unknown, x)| unknown.start = *x);
            }
            self.solved(&begun)
        };
        let mut best = from(&|_, _| 0.0);
        // Further starts, and the best of them.
        for number in 0..STARTS {
            if best.as_ref().is_ok_and(|best| self.misfit(best).is_none_or(|factor| factor < 1.0) && self.is_known()) {
                break;
            }
            let other = from(&|k, parameter| spread(number, k) * parameter.reference());
            let noise = self.measurements.noise();
            let size = |k: usize| if noise[k].std > 0.0 { noise[k].std } else { noise[k].size };
            let error =
                |found: &Solution| (0..noise.len()).map(|k| (found.residuals[k] / size(k)).powi(2)).sum::<f64>();
            let better = match (&other, &best) {
                (Ok(other), Ok(best)) => error(other) < error(best),
                (Ok(_), Err(_)) => true,
                _ => false,
            };
            if better {
                best = other;
            }
        }
        best
    }

    /// Whether all readings have known deviations.
    fn is_known(&self) -> bool {
        self.measurements.noise().iter().all(|noise| noise.std > 0.0)
    }

    /// Returns the ratio of the scatter to the given deviations if it is larger or smaller than
    /// chance explains in some kind of readings; the largest.
    fn misfit(&self, found: &Solution) -> Option<f64> {
        let noise = self.measurements.noise();
        let misfit_of = |kind: usize| {
            let own = || (0..noise.len()).filter(|k| noise[*k].kind == Some(kind));
            let rows: Vec<(f64, Noise)> = own().map(|k| (found.residuals[k], noise[k])).collect();
            misfit(&rows, own().map(|k| 1.0 - found.leverages[k]).sum(), self.search.loss)
        };
        (0..KINDS.len()).filter_map(misfit_of).reduce(f64::max)
    }

    /// Predicts the readings of each fold from the other folds; readings at one pose are in one
    /// fold.
    fn held_out(&self, solution: &Solution, before: &[f64], folds: usize) -> Option<HeldOut> {
        // Number of the pose of each row; a row of prior knowledge is a pose of its own.
        let mut poses: Vec<&[f64]> = Vec::new();
        let mut pose_of_row = Vec::new();
        for reading in &self.measurements.readings {
            let known = poses.iter().rposition(|q| !q.is_empty() && *q == reading.q);
            let pose = known.unwrap_or(poses.len());
            if known.is_none() {
                poses.push(&reading.q);
            }
            pose_of_row.extend(std::iter::repeat_n(pose, reading.rows()));
        }
        let folds = folds.min(poses.len());
        if folds < 2 {
            return None;
        }
        // Residuals of each fold, predicted from the rest of the solution.
        let noise = self.measurements.noise();
        let (mut residuals, mut skipped) = (vec![f64::NAN; noise.len()], 0);
        for fold in 0..folds {
            let own: Vec<usize> = (0..noise.len()).filter(|k| pose_of_row[*k] % folds == fold).collect();
            match solution.without(&own) {
                Some(found) => own.iter().zip(found.iter()).for_each(|(k, r)| residuals[*k] = *r),
                None => skipped += 1,
            }
        }
        let predicted: Vec<usize> = (0..residuals.len()).filter(|k| residuals[*k].is_finite()).collect();
        let square =
            |values: &[f64]| predicted.iter().map(|k| (values[*k] / solution.deviations[*k]).powi(2)).sum::<f64>();
        let rms = |values: &[f64]| (square(values) / predicted.len() as f64).sqrt();
        (!predicted.is_empty()).then(|| HeldOut {
            folds,
            skipped,
            rms: rms(&residuals),
            rms_initial: rms(before),
            residuals,
        })
    }

    /// Returns the result: estimates, outliers, undetermined combinations, cross-validation.
    ///
    /// * `before`: residuals with the initial values.
    fn summary(&self, unknowns: &[Unknown], solution: Solution, before: Vec<f64>, folds: usize) -> Identified {
        let Self { parameters, measurements, .. } = *self;
        let mut x = solution.unknowns.clone();
        let rates = to_search(parameters, &mut x);
        // Correlations in search coordinates: a falling one, such as that of a compliance, changes the sign.
        let C = &solution.covariance;
        let p = parameters.len();
        let sign = |i: usize, j: usize| (rates[i] * rates[j]).signum();
        let correlation = DMatrix::from_fn(p, p, |i, j| sign(i, j) * C[(i, j)] / (C[(i, i)] * C[(j, j)]).sqrt());
        // Outliers: residuals over their own deviation after the fit, `r / √(1 - h)` with the leverage h.
        let r = solution.residuals.component_div(&solution.deviations);
        let over_own = |(r, h): (&f64, &f64)| r / (1.0 - h).max(1e-6).sqrt();
        let normalised: Vec<f64> = r.iter().zip(solution.leverages.iter()).map(over_own).collect();
        let mut suspicious: Vec<usize> = (0..normalised.len()).filter(|k| normalised[*k].abs() > SUSPICIOUS).collect();
        suspicious.sort_by(|a, b| normalised[*b].abs().total_cmp(&normalised[*a].abs()));
        let own = &x.as_slice()[p..];
        let estimate = |(k, parameter): (usize, &Parameter)| {
            estimate(parameter, &unknowns[k], solution.unknowns[k], C[(k, k)].sqrt())
        };
        let (undetermined, together) = undetermined(unknowns, C, p);
        let errors = solution.model_errors.iter().enumerate().filter(|(_, error)| **error > 0.0);
        Identified {
            parameters: parameters.iter().enumerate().map(estimate).collect(),
            correlation,
            undetermined,
            together,
            normalised,
            suspicious,
            misfit: self.misfit(&solution),
            model_errors: errors.map(|(kind, error)| ModelError { kind: KINDS[kind], error: *error }).collect(),
            held_out: self.held_out(&solution, &before, folds),
            before,
            instruments: (0..measurements.instruments.len()).map(|k| measurements.instrument(k, own).0).collect(),
            targets: (0..measurements.targets.len()).map(|k| measurements.target(k, own).0).collect(),
            unknowns: x,
            solution,
        }
    }
}

/// Returns a number between -1.5 and 1.5 for a start and a coordinate, from the additive recurrence
/// of square roots of primes.
fn spread(start: usize, coordinate: usize) -> f64 {
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let root = PRIMES[coordinate % PRIMES.len()].sqrt() * (1 + coordinate / PRIMES.len()) as f64;
    3.0 * (root * (start + 1) as f64).fract() - 1.5
}

/// Describes an unknown of the measurements by its number.
fn own_name(measurements: &Measurements, number: usize) -> String {
    let mut first = 0;
    for (k, instrument) in measurements.instruments.iter().enumerate() {
        first += instrument.unknowns();
        if number < first {
            return match instrument {
                Instrument::Axes(_) => {
                    format!("the orientation of instrument {} in the world", measurements.instrument_name(k))
                }
                _ => format!("the pose of instrument {} in the world", measurements.instrument_name(k)),
            };
        }
    }
    "the position of a target on the tool".to_owned()
}

/// Returns the estimate of a parameter.
///
/// * `z`: unknown of the fit; `std`: its posterior standard deviation.
fn estimate(parameter: &Parameter, unknown: &Unknown, z: f64, std: f64) -> FittedParameter {
    let learnt = unknown.prior.is_none_or(|(_, prior)| std <= LEARNT * prior);
    let above_zero = z - INTERVAL * std > 0.0;
    let identifiable = learnt
        && match parameter.is_yielding() {
            true => above_zero,
            false => !parameter.is_logarithmic() || std <= parameter.reference(),
        };
    let rigid = learnt && parameter.is_yielding() && !above_zero;
    let (x, rate) = parameter.search(z);
    let interval = match identifiable || rigid {
        true => parameter.interval(z - INTERVAL * std, z + INTERVAL * std),
        false => [f64::NAN; 2],
    };
    FittedParameter {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        initial: parameter.initial,
        value: parameter.value(x),
        std: if identifiable { parameter.deviation(x, std * rate.abs()) } else { f64::NAN },
        interval,
        identifiable,
        rigid,
    }
}

/// Parameters and their weights.
type Combination = Vec<(usize, f64)>;

/// Returns the directions of the parameters, over their prior deviations, of which the readings
/// know no more than the prior, as parameters and weights, largest weight first, and the groups of
/// parameters that these directions connect.
fn undetermined(unknowns: &[Unknown], C: &DMatrix<f64>, p: usize) -> (Vec<Combination>, Vec<Vec<usize>>) {
    let std: Vec<f64> = unknowns[..p].iter().map(|unknown| unknown.prior.map_or(1.0, |(_, std)| std)).collect();
    let over = DMatrix::from_fn(p, p, |i, j| C[(i, j)] / (std[i] * std[j]));
    let eigen = SymmetricEigen::new(over);
    let combination = |k: usize| {
        let column = eigen.eigenvectors.column(k);
        let mut parts: Vec<(usize, f64)> = column.iter().copied().enumerate().filter(|(_, w)| w.abs() > 0.2).collect();
        parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        parts
    };
    // At half the variance of the prior, readings and prior know the same.
    let mut none: Vec<usize> = (0..p).filter(|k| eigen.eigenvalues[*k] > 0.5).collect();
    none.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let V = eigen.eigenvectors.select_columns(&none);
    (none.into_iter().map(combination).collect(), connected(&(&V * V.transpose())))
}

/// Returns the groups of parameters that a projection on the undetermined directions connects.
fn connected(P: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..P.nrows()).filter(|k| P[(*k, *k)] > CONNECTED).collect();
    let mut groups = Vec::new();
    while !left.is_empty() {
        let mut group = vec![left.remove(0)];
        let mut next = 0;
        while let Some(&own) = group.get(next) {
            let (more, rest): (Vec<_>, Vec<_>) = left.into_iter().partition(|k| P[(own, *k)].abs() > CONNECTED);
            group.extend(more);
            (left, next) = (rest, next + 1);
        }
        if group.len() > 1 || P[(group[0], group[0])] > 0.5 {
            group.sort_unstable();
            groups.push(group);
        }
    }
    groups
}
