//! The 6×6 stiffness of a spring as written.

use flexarm_flexlink::{StiffnessError, spring_stiffness};
use nalgebra::{Matrix6, Vector6};

/// Euler-Bernoulli beam of 1 m clamped at A, at B: EA = 1e8 N, GJ = 1e5, EI = 2e5 N m²; linear
/// first (N/m, N; N, N m/rad).
fn beam() -> Matrix6<f64> {
    let EI = 2e5;
    let mut K = Matrix6::from_diagonal(&Vector6::new(1e8, 12.0 * EI, 12.0 * EI, 1e5, 4.0 * EI, 4.0 * EI));
    for (i, j, k) in [(1, 5, -6.0 * EI), (2, 4, 6.0 * EI)] {
        (K[(i, j)], K[(j, i)]) = (k, k);
    }
    K
}

/// Truth: the matrix itself, bit by bit; in mm and N the entries change by up to 1e6, the verdict
/// does not.
#[test]
fn a_stiffness_is_accepted_in_any_unit_of_length() {
    for unit in [1.0, 1e3, 1e-3] {
        let d = Vector6::new(unit, unit, unit, 1.0, 1.0, 1.0);
        let K = Matrix6::from_fn(|i, j| d[i] * beam()[(i, j)] * d[j]);
        assert_eq!(spring_stiffness(&K), Ok(K));
    }
}

/// Truth: the coupling of a clamped beam is √3/2 of the root of its diagonal entries; at 1 a
/// displacement is free, beyond it energy is negative.
#[test]
fn a_coupling_beyond_the_root_of_its_diagonal_entries_is_refused_with_its_place() {
    let scaled = |factor: f64| {
        let mut K = beam();
        (K[(1, 5)], K[(5, 1)]) = (factor * K[(1, 5)], factor * K[(5, 1)]);
        spring_stiffness(&K)
    };
    let limit = 2.0 / 3f64.sqrt();
    assert!(scaled(0.999_999 * limit).is_ok());
    let Err(StiffnessError::NotDefinite { row, column, relative, min_eigenvalue, .. }) = scaled(1.2 * limit) else {
        panic!("a negative energy is accepted");
    };
    assert_eq!((row, column), (1, 5));
    eprintln!("coupling {:.1e}, eigenvalue {:.1e}", relative - 1.2, min_eigenvalue + 0.2);
    // Measured 2.2e-16 and -1.1e-16.
    assert!((relative - 1.2).abs() < 1e-14 && (min_eigenvalue + 0.2).abs() < 1e-14, "{relative} {min_eigenvalue}");
}

#[test]
fn the_first_wrong_entry_is_named_with_what_was_found() {
    let changed = |i: usize, j: usize, k: f64| {
        let mut K = beam();
        K[(i, j)] = k;
        spring_stiffness(&K).unwrap_err()
    };
    assert_eq!(changed(3, 3, 0.0), StiffnessError::NotPositive { row: 3, found: 0.0 });
    assert!(matches!(changed(0, 2, f64::NAN), StiffnessError::NotFinite { row: 0, column: 2, .. }));
    let (row, column, upper, lower) = (1, 5, -1.2e6 * (1.0 + 1e-6), -1.2e6);
    assert_eq!(changed(1, 5, upper), StiffnessError::NotSymmetric { row, column, upper, lower });
}
