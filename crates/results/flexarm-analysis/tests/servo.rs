//! Leads of the commands over their motors.

use flexarm_analysis::*;
use nalgebra::{Complex, DMatrix, DVector};

fn two_axes() -> NodeServo {
    let mut mass = DMatrix::zeros(2, 3);
    (mass[(0, 0)], mass[(0, 2)]) = (30.0, 4.0);
    NodeServo {
        axes: vec![0, 2],
        stiffness: DVector::from_vec(vec![1.2e5, 4e4]),
        damping: DVector::from_vec(vec![3e3, 2e3]),
        integral: DVector::from_vec(vec![1.2e6, 0.0]),
        ahead: [DMatrix::zeros(2, 3), DMatrix::zeros(2, 3), mass],
    }
}

/// Truth: at rest, the axis with an integrator has zero lead, the other its torque over its
/// stiffness, from the first instant on.
#[test]
fn torques_that_last_are_met_at_rest() {
    let servo = two_axes();
    let torques = DMatrix::from_fn(2, 50, |i, _| [100.0, -70.0][i]);
    let found = NodeServo::leads(|_| servo.clone(), &torques, 1e-3);
    for column in found.column_iter() {
        assert!(column[0].abs() < 1e-16 && (column[1] + 70.0 / 4e4).abs() < 1e-16, "{column}");
    }
}

/// Truth: amplitude and phase of `1 / (C + F)` at a frequency, for two axes, one with full
/// feed-forward, the other without feed-forward and integrator.
#[test]
fn leads_are_those_of_the_frequency_response_once_the_start_has_died_away() {
    let (h, omega, N) = (1e-3, 12.0, 6000);
    let servo = two_axes();
    let size = [100.0, -70.0];
    let torques = DMatrix::from_fn(2, N, |i, k| size[i] * (1.0 + (omega * h * k as f64).sin()));
    let found = NodeServo::leads(|_| servo.clone(), &torques, h);
    let s = Complex::new(0.0, omega);
    let size = DVector::from_vec(size.map(|x| Complex::new(x, 0.0)).to_vec());
    let wave = servo.references(s).lu().solve(&size).unwrap();
    // Steady part: with an integrator the lead is zero.
    let steady = [0.0, -70.0 / 4e4];
    for k in N / 2..N {
        let turn = (s * h * k as f64).exp();
        for (i, steady) in steady.iter().enumerate() {
            let wanted = steady + (wave[i] * turn).im;
            let error = (found[(i, k)] - wanted).abs() / wave[i].norm();
            assert!(error < 2e-4, "{i} {k}: {error:e}"); // 5e-5
        }
    }
}
