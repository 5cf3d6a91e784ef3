//! Leading eigenvalue (of maximum magnitude) of the map over a period.
//!
//! Small maps are converted to matrices. Large ones are treated with the Arnoldi method: most of
//! their eigenvalues are almost zero, because the motion one period ago acts only through a few
//! shapes, so that a subspace slightly larger than the number of states contains all relevant ones.
//!
//! Start at [`leading`]. Not here: the map (`period.rs`), the search for the depth at which the
//! magnitude is 1 (`limit.rs`).

use nalgebra::{Complex, DMatrix, DVector};

use crate::milling::period::PeriodMap;

/// Size up to which the matrix is faster.
pub const SMALL: usize = 60;
/// Maximum relative residual of the eigenvalue.
const EXACT: f64 = 1e-10;
/// Initial number of directions beyond the number of states.
const MORE: usize = 30;

/// Returns the eigenvalue of maximum magnitude: the cut is stable if it is below 1. Infinite for a map
/// that overflows.
///
/// Cost: for `n` directions of the subspace, `n` applications of the map and the eigenvalues of an
/// n×n matrix; never more than those of the whole map.
pub fn leading(map: &PeriodMap) -> Complex<f64> {
    if map.size() <= SMALL {
        return largest(&map.matrix());
    }
    let mut krylov = Krylov::new(map);
    // The subspace grows by half until the residual of the eigenvalue is small.
    let mut wanted = map.n_states() + MORE;
    loop {
        if 3 * wanted > 2 * map.size() {
            return largest(&map.matrix());
        }
        let whole = krylov.extend(wanted);
        let n = krylov.directions();
        let H = krylov.H.view((0, 0), (n, n)).into_owned();
        let value = largest(&H);
        if whole || !value.norm().is_finite() || krylov.residual(&H, value) <= EXACT * value.norm() {
            return value;
        }
        wanted += wanted / 2;
    }
}

/// Returns the eigenvalue of maximum magnitude of a square matrix; zero for an empty one, infinite for
/// one that is not finite.
pub fn largest(matrix: &DMatrix<f64>) -> Complex<f64> {
    let larger = |a: &Complex<f64>, b: &Complex<f64>| a.norm_sqr().total_cmp(&b.norm_sqr());
    // The eigenvalue iteration would not terminate.
    if !matrix.iter().all(|x| x.is_finite()) {
        return Complex::new(f64::INFINITY, 0.0);
    }
    matrix.complex_eigenvalues().iter().copied().max_by(larger).unwrap_or_default()
}

/// Orthonormal directions `V` with `A V_n = V_{n+1} H`.
struct Krylov<'a> {
    map: &'a PeriodMap,
    V: Vec<DMatrix<f64>>,
    H: DMatrix<f64>,
}

impl<'a> Krylov<'a> {
    fn new(map: &'a PeriodMap) -> Self {
        // Pseudo-random numbers, the same on every machine.
        let mut seed = 1_u64;
        let start = DMatrix::from_fn(map.size(), 1, |_, _| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        });
        let size = start.norm();
        Self { map, V: vec![start / size], H: DMatrix::zeros(0, 0) }
    }

    fn directions(&self) -> usize {
        self.V.len() - 1
    }

    /// Extends the subspace to a number of directions; returns whether it is invariant.
    fn extend(&mut self, wanted: usize) -> bool {
        let known = self.directions();
        self.H = std::mem::take(&mut self.H).resize(wanted + 1, wanted, 0.0);
        let mut image = DMatrix::zeros(self.map.size(), 1);
        for k in known..wanted {
            self.map.apply(&self.V[k], &mut image);
            let before = image.norm();
            // Two passes, because one leaves rounding errors.
            for _ in 0..2 {
                for (i, direction) in self.V.iter().enumerate() {
                    let part = direction.dot(&image);
                    self.H[(i, k)] += part;
                    image.zip_apply(direction, |x, v| *x -= part * v);
                }
            }
            let rest = image.norm();
            if rest <= 1e-14 * before || rest == 0.0 {
                self.V.push(DMatrix::zeros(self.map.size(), 1));
                return true;
            }
            self.H[(k + 1, k)] = rest;
            self.V.push(&image / rest);
        }
        false
    }

    /// Returns the residual `|A v - λ v|` of the unit Ritz vector of an eigenvalue of `H`, that is,
    /// its part outside the subspace.
    fn residual(&self, H: &DMatrix<f64>, value: Complex<f64>) -> f64 {
        let n = H.nrows();
        let shift = value * (1.0 + 1e-12) + Complex::new(1e-300, 0.0);
        // Inverse iteration for the eigenvector y of H; V y is the Ritz vector of A.
        let lu = (H.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(n, n) * shift).lu();
        let mut y = DVector::from_element(n, Complex::new(1.0, 0.5));
        for _ in 0..2 {
            match lu.solve(&y) {
                Some(solved) if solved.norm().is_finite() && solved.norm() > 0.0 => {
                    let size = Complex::new(solved.norm(), 0.0);
                    y = solved / size;
                }
                _ => return f64::INFINITY,
            }
        }
        self.H[(n, n - 1)].abs() * y[n - 1].norm()
    }
}
