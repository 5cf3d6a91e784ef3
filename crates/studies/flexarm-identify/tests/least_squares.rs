//! Least squares with priors and robust losses.

use flexarm_identify::internals::{orthonormal, scale};
use flexarm_identify::{Loss, Residuals, Search, SolveError, solve};
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

/// Truth: the third column is the sum of the first two.
#[test]
fn the_first_column_that_depends_on_those_before_it_is_named() {
    let A = DMatrix::from_row_slice(4, 4, &[1., 2., 3., 0., 0., 1., 1., 5., 2., 0., 2., 1., 1., 1., 2., 0.]);
    assert_eq!(orthonormal(&A), Err(2));
    let known = A.remove_column(2);
    let Q = orthonormal(&known).unwrap();
    assert!((Q.tr_mul(&Q) - DMatrix::identity(3, 3)).norm() < 1e-14);
    assert!((&Q * Q.tr_mul(&known) - &known).norm() < 1e-13);
    assert_eq!(orthonormal(&known.remove_rows(0, 2)), Err(2), "more columns than rows");
    assert_eq!(orthonormal(&DMatrix::zeros(3, 1)), Err(0));
}

/// The square of the prior deviation overflows.
#[test]
fn a_prior_out_of_all_proportion_is_refused() {
    let t: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    let y = t.iter().map(|t| 30.0 * (-1.7 * t).exp() + 4.0).collect();
    let refused = solve(&Decay { t, y }, &DVector::zeros(4), &[2.0, 1e308, 0.7], &Search::default());
    assert!(matches!(refused, Err(SolveError::NotFinite)));
}

#[test]
fn a_decay_is_found_again_and_a_parameter_that_nothing_tells_stays_at_its_prior() {
    let t: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    let y = t.iter().map(|t| 30.0 * (-1.7 * t).exp() + 4.0).collect();
    let problem = Decay { t, y };
    let found = solve(&problem, &DVector::zeros(4), &[2.0, 2.0, 0.7], &Search::default()).unwrap();
    let error = (found.unknowns[0] - 30f64.ln()).abs().max((found.unknowns[1] - 1.7f64.ln()).abs());
    assert!(error < 1e-9 && found.converged, "{error:e}"); // measured: below 1e-12
    assert!((found.unknowns[3] - 4.0).abs() < 1e-8, "{}", found.unknowns[3]);
    assert_eq!((found.identified, found.unknowns[2]), (2, 0.0));
    assert!((found.covariance[(2, 2)].sqrt() - 0.7).abs() < 1e-12, "its deviation is the prior's");
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
    let clean = scale(&residuals, 400, Loss::Huber(2.5));
    residuals.extend([100.0, -100.0]);
    let [robust, plain] = [Loss::Huber(2.5), Loss::Square].map(|loss| scale(&residuals, 402, loss));
    assert!((clean - 1.0).abs() < 0.05, "{clean}"); // measured: 0.02
    assert!((robust - clean).abs() < 0.05 && plain > 40.0, "{robust} {plain}"); // measured: 0.03
}

#[test]
fn one_wild_residual_in_forty_does_not_carry_huber_and_cauchy_away() {
    let t: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    let mut y: Vec<f64> = t.iter().map(|t| 30.0 * (-1.7 * t).exp() + 4.0).collect();
    y[7] += 500.0;
    let problem = Decay { t, y };
    let start = DVector::from_vec(vec![3.0, 0.3, 0.0, 3.0]);
    let error = |loss| {
        let found = solve(&problem, &start, &[2.0, 2.0, 0.7], &Search { loss, ..Search::default() }).unwrap();
        (found.unknowns[0] - 30f64.ln()).abs()
    };
    let (square, huber, cauchy) = (error(Loss::Square), error(Loss::Huber(2.5)), error(Loss::Cauchy(2.0)));
    assert!(square > 0.5 && huber < 0.1 * square && cauchy < 1e-3, "{square} {huber} {cauchy:e}");
}
