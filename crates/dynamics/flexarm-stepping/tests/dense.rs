//! Dense kernels, compared with nalgebra.

use flexarm_stepping::internals::{
    Factor, cholesky, congruence, dot, largest, largest_of_numbers, product, solve_transposed, transpose,
};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Truth: nalgebra, bitwise.
#[test]
fn every_operation_has_the_bits_of_the_library() {
    for n in [1, 3, 8, 13, 18] {
        let entry = |i: usize, j: usize| ((i * 7 + j * 11) as f64 * 0.731).sin();
        let B = DMatrix::from_fn(n, n, entry);
        let A = &B * B.transpose() + DMatrix::identity(n, n);
        let x = DVector::from_fn(n, |i, _| entry(i, 5));
        let mut y = vec![0.0; n];
        product(A.as_slice(), x.as_slice(), &mut y);
        let mut expected = DVector::zeros(n);
        expected.gemv(1.0, &A, &x, 0.0);
        assert_eq!(y, expected.as_slice());
        assert_eq!(dot(x.as_slice(), &y), x.dot(&expected));

        let mut L = A.as_slice().to_vec();
        assert_eq!(cholesky(&mut L, n), 1.0);
        let factor = Cholesky::new(A.clone()).unwrap();
        let lower = DMatrix::from_column_slice(n, n, &L).lower_triangle();
        assert_eq!(lower, factor.l());
        let (mut ours, mut theirs) = (B.clone(), B.clone());
        solve_transposed(&L, ours.as_mut_slice(), n);
        theirs.transpose_mut();
        factor.solve_mut(&mut theirs);
        transpose(ours.as_mut_slice(), n);
        assert!((&ours - &theirs).amax() <= 1e-13 * theirs.amax(), "{ours} {theirs}");

        let C = B.symmetric_part();
        let [mut room, mut turned, mut found] = [A.clone(), A.clone(), A.clone()];
        let rooms = [room.as_mut_slice(), turned.as_mut_slice()];
        congruence(0.3, B.as_slice(), C.as_slice(), n, rooms, found.as_mut_slice());
        let St = DMatrix::identity(n, n) + 0.3 * &B;
        let expected = St.transpose() * &C * St;
        assert!((&found - &expected).amax() <= 1e-14 * n as f64 * expected.amax(), "{found} {expected}");
    }
    assert_eq!(cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2), 0.0);
    assert_eq!(cholesky(&mut [f64::NAN], 1), 0.0);
}

/// Truth: nalgebra's factor, solution and products; measured 4e-14 relative to the largest
/// entry.
#[test]
fn a_factor_solves_and_reduces_to_standard_form() {
    for n in [1, 2, 7, 18] {
        let entry = |i: usize, j: usize| ((i * 7 + j * 11) as f64 * 0.731).sin();
        let B = DMatrix::from_fn(n, n, entry);
        let A = &B * B.transpose() + DMatrix::identity(n, n);
        let M = &B + B.transpose() + DMatrix::identity(n, n);
        let mut factor = Factor::new(n);
        assert_eq!(factor.compute(A.as_slice()), 1.0);
        let mut x = DVector::from_fn(n, |i, _| entry(i, 5));
        let truth = Cholesky::new(A.clone()).unwrap().solve(&x);
        factor.solve(x.as_mut_slice());
        assert!((&x - &truth).amax() < 1e-13 * truth.amax(), "{:e}", (&x - &truth).amax());
        let inverse = Cholesky::new(A).unwrap().l().try_inverse().unwrap();
        let truth = &inverse * &M * inverse.transpose();
        let mut found = M.clone();
        factor.reduce(found.as_mut_slice());
        let error = (found.lower_triangle() - truth.lower_triangle()).amax() / truth.amax();
        assert!(error < 1e-12, "{n}: {error:e}");
    }
}

#[test]
fn the_largest_of_numbers_with_what_is_no_number_is_infinite() {
    for n in 0..13 {
        let mut x: Vec<f64> = (0..n).map(|k| f64::from(k) - 5.5).collect();
        assert_eq!(largest_of_numbers(&x), x.iter().fold(0.0f64, |most, x| most.max(x.abs())));
        for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for k in 0..x.len() {
                let held = std::mem::replace(&mut x[k], broken);
                assert_eq!(largest_of_numbers(&x), f64::INFINITY, "{n} {k}");
                x[k] = held;
            }
        }
    }
}

#[test]
fn the_largest_value_tells_what_is_no_number() {
    assert_eq!(largest(&[1.0, -3.0, 2.0]), 3.0);
    assert_eq!(largest::<f64>(&[]), 0.0);
    assert!(largest(&[1.0, f64::NAN, 2.0]).is_nan() && largest(&[f64::NEG_INFINITY]).is_nan());
}
