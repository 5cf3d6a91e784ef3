//! Least squares with priors and robust losses.

use flexarm_identify::internals::{bounded_minimum, scale};
use flexarm_identify::{Loss, Noise, Residuals, Search, Solution, SolveError, Unknown, solve};
use flexarm_testkit::Draw;
use nalgebra::{DMatrix, DVector};

/// `y = a exp(-b t) + offset`, with the offset an unknown of the measurement.
struct Decay {
    t: Vec<f64>,
    y: Vec<f64>,
}

impl Residuals for Decay {
    type Error = ();
    fn evaluate(&self, x: &DVector<f64>, J: Option<&mut DMatrix<f64>>) -> Result<DVector<f64>, ()> {
        let (a, b, c) = (x[0].exp(), x[1].exp(), x[3]);
        if let Some(J) = J {
            *J = DMatrix::from_fn(self.t.len(), 4, |i, j| {
                let e = a * (-b * self.t[i]).exp();
                [e, -b * self.t[i] * e, 0.0, 1.0][j]
            });
        }
        Ok(DVector::from_fn(self.t.len(), |i, _| a * (-b * self.t[i]).exp() + c - self.y[i]))
    }
}

const CLOSE: f64 = 0.1;

fn noise(problem: &Decay) -> Vec<Noise> {
    vec![Noise { std: CLOSE, kind: Some(0), size: 1.0, along: 0 }; problem.t.len()]
}

/// Three parameters with priors about zero, and the offset.
fn unknowns(start: [f64; 4]) -> Vec<Unknown> {
    let of = |(start, std): (f64, f64)| Unknown { start, prior: Some((0.0, std)), lower: f64::NEG_INFINITY };
    let mut all: Vec<Unknown> = start[..3].iter().copied().zip([20.0, 20.0, 0.7]).map(of).collect();
    all.push(Unknown { start: start[3], ..Unknown::free() });
    all
}

fn solved(problem: &Decay, start: [f64; 4], loss: Loss) -> Solution {
    let search = Search { loss, ..Search::default() };
    solve(problem, &noise(problem), &unknowns(start), &search, &|_| true).unwrap()
}

fn decay() -> Decay {
    let t: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    let y = t.iter().map(|t| 30.0 * (-1.7 * t).exp() + 4.0).collect();
    Decay { t, y }
}

/// Truth: the minimum over the faces of the box that satisfies the conditions of optimality, by
/// trying all of them.
#[test]
fn the_minimum_above_bounds_is_the_best_of_all_faces() {
    let mut draw = Draw(3);
    for _ in 0..50 {
        let A = DMatrix::from_fn(6, 6, |_, _| draw.signed());
        let H = &A * A.transpose() + DMatrix::identity(6, 6) * 1e-3;
        let (g, lower) =
            (DVector::from_fn(6, |_, _| draw.signed()), DVector::from_fn(6, |_, _| -0.3 * draw.between(0.0, 1.0)));
        let found = bounded_minimum(&H, &g, &lower).unwrap();
        let value = |d: &DVector<f64>| 0.5 * d.dot(&(&H * d)) + g.dot(d);
        let face = |held: u32| {
            let free: Vec<usize> = (0..6).filter(|k| held >> k & 1 == 0).collect();
            let mut d = DVector::from_fn(6, |k, _| if held >> k & 1 == 1 { lower[k] } else { 0.0 });
            if free.is_empty() {
                return d;
            }
            let right = -(&H * &d + &g).select_rows(&free);
            let part = H.select_rows(&free).select_columns(&free).lu().solve(&right).unwrap();
            free.iter().zip(part.iter()).for_each(|(k, x)| d[*k] = *x);
            d
        };
        let allowed = (0..64).map(face).filter(|d| (0..6).all(|k| d[k] >= lower[k] - 1e-12));
        let best = allowed.map(|d| value(&d)).fold(f64::INFINITY, f64::min);
        assert!((value(&found) - best).abs() < 1e-10 * (1.0 + best.abs()), "{} {best}", value(&found));
        assert!((0..6).all(|k| found[k] >= lower[k] - 1e-9));
    }
}

/// The square of the prior deviation overflows.
#[test]
fn a_prior_out_of_all_proportion_is_refused() {
    let problem = decay();
    let mut unknowns = unknowns([0.0; 4]);
    unknowns[2].prior = Some((0.0, 1e308));
    let refused = solve(&problem, &noise(&problem), &unknowns, &Search::default(), &|_| true);
    assert!(matches!(refused, Err(SolveError::NotFinite)));
}

#[test]
fn a_decay_is_found_again_and_a_parameter_that_nothing_tells_stays_at_its_prior() {
    let found = solved(&decay(), [0.0; 4], Loss::Huber(2.5));
    let error = (found.unknowns[0] - 30f64.ln()).abs().max((found.unknowns[1] - 1.7f64.ln()).abs());
    assert!(error < 1e-5 && found.converged, "{error:e}"); // measured: 1e-6, the pull of the priors
    assert!((found.unknowns[3] - 4.0).abs() < 1e-4, "{}", found.unknowns[3]);
    assert!((found.covariance[(2, 2)].sqrt() - 0.7).abs() < 1e-12, "its deviation is the prior's");
    assert_eq!((found.unknowns[2], found.model_errors[0]), (0.0, 0.0));
}

/// Truth: a bound above the free minimum of the rate.
#[test]
fn an_unknown_whose_best_value_is_below_its_bound_stays_there_and_the_others_fit_around_it() {
    let problem = decay();
    let mut unknowns = unknowns([3.0, 1.0, 0.0, 3.0]);
    unknowns[1].lower = 0.8;
    let found = solve(&problem, &noise(&problem), &unknowns, &Search::default(), &|_| true).unwrap();
    assert!(found.converged && found.unknowns[1] == 0.8, "{}", found.unknowns);
    // The errors of the wrong rate are errors of the model.
    assert!(found.model_errors[0] > 2.0 * CLOSE, "{:?}", found.model_errors);
}

/// Truth: fits of the other rows.
#[test]
fn rows_left_out_of_a_fit_are_predicted_as_another_fit_without_them_does() {
    let mut draw = Draw(5);
    let mut problem = decay();
    problem.y.iter_mut().for_each(|y| *y += 0.1 * draw.signed());
    let start = [3.0, 0.5, 0.0, 4.0];
    let found = solved(&problem, start, Loss::Square);
    let out: Vec<usize> = (0..40).step_by(10).collect();
    let predicted = found.without(&out).unwrap();
    let kept: Vec<usize> = (0..40).filter(|k| !out.contains(k)).collect();
    let of = |x: &[f64]| kept.iter().map(|k| x[*k]).collect();
    let others = Decay { t: of(&problem.t), y: of(&problem.y) };
    let again = solved(&others, start, Loss::Square);
    let truth = problem.evaluate(&again.unknowns, None).unwrap();
    for (k, r) in out.iter().zip(predicted.iter()) {
        let (error, change) = ((r - truth[*k]).abs(), (truth[*k] - found.residuals[*k]).abs());
        eprintln!("row {k}: {r:.5} of {:.5}, fitted {:.5}", truth[*k], found.residuals[*k]);
        assert!(error < 0.05 * change + 1e-4, "row {k}: {error:e} of {change:e}"); // first order
    }
}

/// Truth: quantiles of the standard normal distribution, scale 1; two of the 402 numbers are
/// ±100.
#[test]
fn two_wild_residuals_leave_the_scale_where_it_was() {
    let mut residuals: Vec<f64> = Vec::new();
    for k in 0..400 {
        // Box-Muller transform of a regular grid.
        let (u, v) = ((f64::from(k % 20) + 0.5) / 20.0, (f64::from(k / 20) + 0.5) / 20.0);
        residuals.push((-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos());
    }
    let clean = scale(&residuals, 400.0, Loss::Huber(2.5));
    residuals.extend([100.0, -100.0]);
    let [robust, plain] = [Loss::Huber(2.5), Loss::Square].map(|loss| scale(&residuals, 402.0, loss));
    assert!((clean - 1.0).abs() < 0.05, "{clean}"); // measured: 0.02
    assert!((robust - clean).abs() < 0.05 && plain > 7.0, "{robust} {plain}"); // measured: 0.03
}

#[test]
fn one_wild_residual_in_forty_does_not_carry_huber_and_cauchy_away() {
    let mut problem = decay();
    problem.y[7] += 500.0;
    let error = |loss| (solved(&problem, [3.0, 0.3, 0.0, 3.0], loss).unknowns[0] - 30f64.ln()).abs();
    let (square, huber, cauchy) = (error(Loss::Square), error(Loss::Huber(2.5)), error(Loss::Cauchy(2.0)));
    assert!(square > 0.5 && huber < 0.1 * square && cauchy < 1e-3, "{square} {huber} {cauchy:e}");
}

/// `r = (x, c + a x² / 2)`: at its minimum 0 the cost has the curvature `1 + a c`, of which steps
/// without damping see 1: they pass the minimum and keep the fraction `a c` of the distance.
struct Curved;

impl Residuals for Curved {
    type Error = ();
    fn evaluate(&self, x: &DVector<f64>, J: Option<&mut DMatrix<f64>>) -> Result<DVector<f64>, ()> {
        if let Some(J) = J {
            *J = DMatrix::from_column_slice(2, 1, &[1.0, 0.97 * x[0]]);
        }
        Ok(DVector::from_column_slice(&[x[0], 1.0 + 0.97 * x[0] * x[0] / 2.0]))
    }
}

#[test]
fn a_fit_whose_residuals_curve_settles_instead_of_passing_the_minimum_again_and_again() {
    let noise = [Noise { std: 1.0, kind: None, size: 1.0, along: 0 }; 2];
    let start = [Unknown { start: 0.1, ..Unknown::free() }];
    let found = solve(&Curved, &noise, &start, &Search { loss: Loss::Square, ..Search::default() }, &|_| true).unwrap();
    let error = found.unknowns[0].abs();
    assert!(found.converged && found.iterations < 30 && error < 1e-4, "{error:e} after {}", found.iterations);
}
