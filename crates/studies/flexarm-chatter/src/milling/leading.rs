//! Leading eigenvalue (of maximum magnitude) of the map over a period.
//!
//! Small maps are converted to matrices. Large ones are treated with the Arnoldi method: most of
//! their eigenvalues are almost zero, because the motion one period ago acts only through a few
//! shapes, so that a subspace slightly larger than the number of states contains all relevant ones.

use nalgebra::{Complex, DMatrix, DVector};

use crate::milling::period::PeriodMap;

/// Size up to which the matrix is faster.
const SMALL: usize = 60;
/// Maximum relative residual of the eigenvalue.
const EXACT: f64 = 1e-10;
/// Initial number of directions beyond the number of states.
const MORE: usize = 30;

/// Returns the leading eigenvalue; infinite for a map that overflows.
pub(crate) fn leading(map: &PeriodMap) -> Complex<f64> {
    if map.size() <= SMALL {
        return largest(&map.matrix());
    }
    let mut krylov = Krylov::new(map);
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

fn largest(matrix: &DMatrix<f64>) -> Complex<f64> {
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

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Vector3;

    use super::*;
    use crate::milling::cutter::{Coefficients, Cutter, Engagement};
    use crate::milling::period::Period;
    use crate::milling::structure::{Mode, Structure};

    /// Truth: all eigenvalues of the matrix, for slow modes of an arm that hardly decay within a
    /// period, and fast modes of a tool.
    #[test]
    fn few_directions_hold_the_largest_multiplier() {
        let mode = |k: u32| Mode {
            angular_frequency: TAU * 12.0 * 1.5_f64.powi(k as i32),
            damping_ratio: 0.02,
            shape: Vector3::new(f64::from(k).cos(), f64::from(2 * k).sin(), 0.3)
                / (200.0_f64 / f64::from(1 + k * k)).sqrt(),
        };
        let structure = Structure::from_modes(&(0..13).map(mode).collect::<Vec<_>>()).unwrap();
        let coefficients = Coefficients { tangential: 8e8, radial: 3e8, axial: 1e8 };
        let straight = Cutter::straight(3, coefficients, Engagement::down(0.3));
        let mut worst: f64 = 0.0;
        for cutter in [straight, Cutter { diameter: 0.02, helix: 0.5, ..straight }] {
            for (rpm, depth) in [(800.0, 1e-4), (800.0, 2e-3), (1500.0, 5e-4), (1500.0, 8e-3)] {
                let map = Period::new(&structure, &cutter, rpm * TAU / 60.0, 4e-4).at(depth);
                assert!(map.size() > 2 * SMALL, "{}", map.size());
                let (few, all) = (leading(&map), largest(&map.matrix()));
                worst = worst.max((few.norm() / all.norm() - 1.0).abs());
            }
        }
        println!("worst {worst:.1e}");
        // measured: 1e-12
        assert!(worst < 1e-9, "{worst:.1e}");
    }
}
