//! Pseudo-random numbers and matrices from a seed, for tests of kernels.

use nalgebra::Matrix6;

/// Generator of pseudo-random numbers in [-1, 1).
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Returns a random symmetric matrix with no eigenvalue below `least`.
    pub(crate) fn definite(&mut self, least: f64) -> Matrix6<f64> {
        let A = Matrix6::from_fn(|_, _| self.next());
        A * A.transpose() + Matrix6::identity() * least
    }
}
