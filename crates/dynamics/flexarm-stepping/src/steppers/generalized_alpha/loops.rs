//! Loops over the coordinates in a step of a single run, with the vector instructions that the
//! processor has; notation of the parent module. `batch/lane_alpha.rs` does the same over lanes,
//! with bitwise the same results.

use super::Coefficients;
use crate::dense::{Loops, largest_of_numbers};
use crate::implicit::Sizes;

/// Computes x⁺ and v⁺ from x, v, a, x̃ and x̃⁺.
pub(super) struct UpdatePositions<'a> {
    pub(super) coefficients: Coefficients,
    pub(super) h: f64,
    /// x, v, a, x̃.
    pub(super) now: [&'a [f64]; 4],
    pub(super) x_tilde_new: &'a [f64],
    /// x⁺, v⁺.
    pub(super) to: [&'a mut [f64]; 2],
}

impl Loops for UpdatePositions<'_> {
    #[inline]
    fn run(self) {
        let Self { coefficients, h, now, x_tilde_new, to: [x_new, v_new] } = self;
        let n = x_new.len();
        let [x, v, a, x_tilde] = [&now[0][..n], &now[1][..n], &now[2][..n], &now[3][..n]];
        let (x_tilde_new, v_new) = (&x_tilde_new[..n], &mut v_new[..n]);
        for k in 0..n {
            (x_new[k], v_new[k]) = coefficients.advance(h, x[k], v[k], a[k], x_tilde[k], x_tilde_new[k]);
        }
    }
}

/// Computes `to = a + c h² shift`.
pub(super) struct Shifted<'a> {
    pub(super) a: &'a [f64],
    pub(super) c_h2: f64,
    pub(super) shift: &'a [f64],
    pub(super) to: &'a mut [f64],
}

impl Loops for Shifted<'_> {
    #[inline]
    fn run(self) {
        for ((to, a), shift) in self.to.iter_mut().zip(self.a).zip(self.shift) {
            *to = self.c_h2 * shift + a;
        }
    }
}

/// Subtracts a correction d of ẍ⁺ from all trial values.
pub(super) struct Correct<'a> {
    pub(super) d: &'a [f64],
    /// Additional correction of x̃⁺ due to d: a factor and a vector.
    pub(super) shift: Option<(f64, &'a [f64])>,
    /// Derivatives of v⁺ and x⁺ with respect to x̃⁺.
    pub(super) derivatives: (f64, f64),
    /// ẍ⁺, x̃⁺, x⁺, v⁺.
    pub(super) trial: [&'a mut [f64]; 4],
    pub(super) sizes: &'a mut Sizes,
}

impl Loops for Correct<'_> {
    #[inline]
    fn run(self) {
        let Self { d, shift, derivatives: (c_D, c_K), trial: [trial, x_tilde, x, v], sizes } = self;
        let n = d.len();
        let (trial, x_tilde, x, v) = (&mut trial[..n], &mut x_tilde[..n], &mut x[..n], &mut v[..n]);
        if let Some((factor, shift)) = shift {
            let shift = &shift[..n];
            for k in 0..n {
                let d_tilde = d[k] + factor * shift[k];
                x_tilde[k] -= d_tilde;
                x[k] -= c_K * d_tilde;
                v[k] -= c_D * d_tilde;
            }
        } else {
            for k in 0..n {
                x_tilde[k] -= d[k];
                x[k] -= c_K * d[k];
                v[k] -= c_D * d[k];
            }
        }
        for (trial, d) in trial.iter_mut().zip(d) {
            *trial -= d;
        }
        let [d, acceleration, place] = [largest_of_numbers(d), largest_of_numbers(trial), largest_of_numbers(x)];
        sizes.include(d, acceleration, place);
    }
}

/// Computes `A ← A + B`.
pub(super) struct Add<'a>(pub(super) &'a mut [f64], pub(super) &'a [f64]);

impl Loops for Add<'_> {
    #[inline]
    fn run(self) {
        crate::dense::add(self.0, self.1);
    }
}

/// Computes `to = 2 a - b`.
pub(super) struct Extrapolate<'a> {
    pub(super) a: &'a [f64],
    pub(super) b: &'a [f64],
    pub(super) to: &'a mut [f64],
}

impl Loops for Extrapolate<'_> {
    #[inline]
    fn run(self) {
        for ((to, a), b) in self.to.iter_mut().zip(self.a).zip(self.b) {
            *to = 2.0 * a - b;
        }
    }
}

/// Replaces a by a⁺.
pub(super) struct UpdateAccelerations<'a> {
    pub(super) coefficients: Coefficients,
    pub(super) a: &'a mut [f64],
    pub(super) x_tilde: &'a [f64],
    pub(super) x_tilde_new: &'a [f64],
}

impl Loops for UpdateAccelerations<'_> {
    #[inline]
    fn run(self) {
        for ((a, x_tilde), new) in self.a.iter_mut().zip(self.x_tilde).zip(self.x_tilde_new) {
            *a = self.coefficients.remembered(*a, *x_tilde, *new);
        }
    }
}
