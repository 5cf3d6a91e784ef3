//! Eigenvalues of symmetric matrices, alone and in lanes.

use flexarm_kinematics::Real;
use flexarm_stepping::internals::symmetric_eigenvalues;
use nalgebra::DMatrix;
use proptest::prelude::*;

fn eigenvalues(A: &DMatrix<f64>) -> Vec<f64> {
    let n = A.nrows();
    let (mut d, mut e) = (vec![0.0; n], vec![0.0; n]);
    assert_eq!(symmetric_eigenvalues(A.clone().as_mut_slice(), &mut d, &mut e), 1.0);
    d.sort_by(f64::total_cmp);
    d
}

/// Truth: nalgebra's eigenvalues. Measured: 6e-15 relative to the largest.
#[test]
fn eigenvalues_are_those_of_nalgebra() {
    proptest!(|(n in 1_usize..24, seed in proptest::collection::vec(-1.0_f64..1.0, 600), rank in 1_usize..24)| {
        // Full and deficient rank, multiple eigenvalues.
        let B = DMatrix::from_fn(n, n, |i, j| if j < rank { seed[i * 24 + j] } else { 0.0 });
        let A = &B * B.transpose();
        let mut truth: Vec<f64> = A.clone().symmetric_eigenvalues().iter().copied().collect();
        truth.sort_by(f64::total_cmp);
        let largest = truth[n - 1].abs().max(f64::MIN_POSITIVE);
        for (found, truth) in eigenvalues(&A).iter().zip(&truth) {
            prop_assert!((found - truth).abs() < 1e-13 * largest, "{found:e} {truth:e}");
        }
    });
}

/// Truth: each matrix by itself. Lanes whose blocks split at different rows, split immediately,
/// or contain NaN.
#[cfg(target_arch = "x86_64")]
#[test]
fn every_lane_has_the_bits_of_its_matrix_alone() {
    use flexarm_kinematics::{OverLanes, with_lanes};

    struct Together<'a>(&'a [DMatrix<f64>]);
    impl OverLanes for Together<'_> {
        type Output = Vec<(f64, Vec<u64>)>;

        #[inline(always)]
        fn run<T: Real>(self) -> Self::Output {
            let n = self.0[0].nrows();
            let mut A = vec![T::zero(); n * n];
            for (lane, own) in self.0.iter().cycle().take(T::LANES).enumerate() {
                A.iter_mut().zip(own).for_each(|(to, x)| to.set_lane(lane, *x));
            }
            let (mut d, mut e) = (vec![T::zero(); n], vec![T::zero(); n]);
            let ended = symmetric_eigenvalues(&mut A, &mut d, &mut e);
            let own = |lane: usize| d.iter().map(|x| x.lane(lane).to_bits()).collect();
            (0..T::LANES).map(|lane| (ended.lane(lane), own(lane))).collect()
        }
    }
    for n in [1, 2, 5, 18] {
        let random = |seed: f64| {
            let B = DMatrix::from_fn(n, n, |i, j| ((7 * i + 11 * j) as f64 * seed).sin());
            &B + B.transpose()
        };
        let mut block = random(0.31);
        (0..n).filter(|k| *k != n / 2).for_each(|k| {
            (block[(k, n / 2)], block[(n / 2, k)]) = (0.0, 0.0);
        });
        let first = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i + j == 1)));
        for matrices in [
            [random(0.7), random(0.31) * 1e-9, random(1.3), random(2.1) * 1e200],
            [random(0.7), DMatrix::zeros(n, n), DMatrix::identity(n, n), block],
            [first, random(0.7), DMatrix::from_element(n, n, f64::NAN), random(1.3)],
        ]
        .into_iter()
        .flat_map(|matrices| [(4, matrices.clone()), (8, matrices)])
        {
            let (lanes, matrices) = matrices;
            let Some(together) = with_lanes(lanes, Together(&matrices)) else { return };
            for ((ended, lane), A) in together.iter().zip(matrices.iter().cycle()) {
                let (mut d, mut e) = (vec![0.0; n], vec![0.0; n]);
                assert_eq!(symmetric_eigenvalues(A.clone().as_mut_slice(), &mut d, &mut e), *ended);
                let alone: Vec<u64> = d.iter().map(|x| x.to_bits()).collect();
                assert!(*ended == 0.0 || *lane == alone, "{n}");
            }
        }
    }
}

#[test]
fn diagonal_and_empty_matrices_have_theirs() {
    assert_eq!(eigenvalues(&DMatrix::from_diagonal(&vec![3.0, -1.0, 2.0].into())), [-1.0, 2.0, 3.0]);
    assert_eq!(eigenvalues(&DMatrix::zeros(0, 0)), [0.0; 0]);
    let mut wrong = DMatrix::from_element(3, 3, f64::NAN);
    assert_eq!(symmetric_eigenvalues(wrong.as_mut_slice(), &mut [0.0; 3], &mut [0.0; 3]), 0.0);
}
