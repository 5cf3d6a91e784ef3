//! Linear structure: motion of the tool's tip under a force on it, as a sum of poles.
//!
//! ```text
//! z_r' = λ_r z_r + l_rᵀ F        u = Σ 2 Re(o_r z_r)  (pairs)  + Σ o_r z_r  (real poles)
//! ```
//! Any linear structure without defective poles has this form: modes with damping ratios, or `M`,
//! `D`, `K` with any damping ([`Structure::from_matrices`]). Structures in series, such as a tool
//! on a flange, have the poles of both.
//!
//! Not here: the arm and its pose (`place.rs` of the crate).

use nalgebra::{Complex, Matrix3, Vector3};

use crate::milling::error::ChatterError;

/// Eigenvalue of the structure with its input and output vectors. A pole above the real axis
/// represents a conjugate pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// `λ` (1/s), with negative real part and non-negative imaginary part.
    pub value: Complex<f64>,
    /// `l`, per newton along x, y, z.
    pub input: Vector3<Complex<f64>>,
    /// `o` (m) along x, y, z; only the products `o lᵀ` are determined.
    pub output: Vector3<Complex<f64>>,
}

/// Real mode: `q'' + 2 ζ ω q' + ω² q = φᵀ F`, `u = φ q`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency `ω` (rad/s).
    pub angular_frequency: f64,
    /// Damping ratio `ζ`, above 0; modes with 1 or more do not oscillate.
    pub damping_ratio: f64,
    /// Mode shape `φ` at the tip along x, y, z, mass-normalised (kg^-1/2).
    pub shape: Vector3<f64>,
}

/// Linear structure at the cutter: poles, displacements in m, forces in N.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Structure {
    poles: Vec<Pole>,
}

/// Relative separation of two equal real poles, for which the form does not exist. The response
/// changes by the square of it.
const APART: f64 = 1e-6;

impl Structure {
    /// Returns a structure with given poles.
    ///
    /// # Errors
    /// [`ChatterError::Invalid`]; [`ChatterError::Undamped`] for a pole that does not decay,
    /// whose limit of depth is zero.
    pub fn from_poles(poles: Vec<Pole>) -> Result<Self, ChatterError> {
        for pole in &poles {
            let numbers = pole.input.iter().chain(pole.output.iter()).chain([&pole.value]);
            if numbers.into_iter().any(|x| !(x.re.is_finite() && x.im.is_finite())) {
                return Err(ChatterError::not_finite("a pole"));
            }
            if pole.value.re >= 0.0 {
                let damping_ratio = -pole.value.re / pole.value.norm().max(f64::MIN_POSITIVE);
                return Err(ChatterError::Undamped { rad_per_s: pole.value.norm(), damping_ratio });
            }
        }
        Ok(Self { poles })
    }

    /// Returns a structure with given real modes.
    ///
    /// # Errors
    /// As [`Structure::from_poles`].
    pub fn from_modes(modes: &[Mode]) -> Result<Self, ChatterError> {
        let mut poles = Vec::new();
        for mode in modes {
            let (omega, shape) = (mode.angular_frequency, mode.shape.map(|x| Complex::new(x, 0.0)));
            let zeta = if (mode.damping_ratio - 1.0).abs() < APART { 1.0 - APART } else { mode.damping_ratio };
            if omega <= 0.0 {
                return Err(ChatterError::Undamped { rad_per_s: omega, damping_ratio: zeta });
            }
            // Partial fractions of 1 / (s² + 2 ζ ω s + ω²).
            let root = Complex::new(zeta * zeta - 1.0, 0.0).sqrt() * omega;
            let pole = |value: Complex<f64>, other: Complex<f64>| Pole {
                value,
                input: shape,
                output: shape / (value - other),
            };
            let (upper, lower) = (root - zeta * omega, -root - zeta * omega);
            poles.push(pole(upper, lower));
            if upper.im == 0.0 {
                poles.push(pole(lower, upper));
            }
        }
        Self::from_poles(poles)
    }

    /// Returns both structures under the same force with their displacements added, such as a
    /// flexible tool on a flexible flange.
    #[must_use]
    pub fn in_series(mut self, other: &Self) -> Self {
        self.poles.extend_from_slice(&other.poles);
        self
    }

    /// Returns the structure in other axes, `u_new = R u`, `F_new = R F`. `R` has the old
    /// axes as columns, in the new ones.
    #[must_use]
    pub fn rotated(mut self, R: &Matrix3<f64>) -> Self {
        let R = R.map(|x| Complex::new(x, 0.0));
        for pole in &mut self.poles {
            pole.input = R * pole.input;
            pole.output = R * pole.output;
        }
        self
    }

    /// Returns all poles.
    pub fn poles(&self) -> &[Pole] {
        &self.poles
    }

    /// Returns the frequency response of the tip, `u = G(i ω) F` (m/N), 3×3 in the structure's axes:
    ///
    /// ```text
    /// G(s) = Σ o lᵀ / (s - λ) + conjugates of pairs
    /// ```
    /// * `omega`: angular frequency (rad/s).
    pub fn frequency_response(&self, omega: f64) -> Matrix3<Complex<f64>> {
        let s = Complex::new(0.0, omega);
        let mut G = Matrix3::zeros();
        for pole in &self.poles {
            G += pole.output * pole.input.transpose() / (s - pole.value);
            if pole.value.im > 0.0 {
                G += pole.output.conjugate() * pole.input.adjoint() / (s - pole.value.conj());
            }
        }
        G
    }

    /// Returns the number of real states: two per pair, one per real pole.
    pub(crate) fn n_states(&self) -> usize {
        self.poles.iter().map(Pole::n_states).sum()
    }

    /// Returns angular frequencies (rad/s) for evaluating the response: at equal ratios, and dense
    /// around each resonance.
    pub(crate) fn frequencies(&self) -> Vec<f64> {
        let sizes: Vec<f64> = self.poles().iter().map(|p| p.value.norm()).collect();
        let (Some(low), Some(high)) = (sizes.iter().copied().reduce(f64::min), sizes.iter().copied().reduce(f64::max))
        else {
            return Vec::new();
        };
        let (low, high) = (0.1 * low, 4.0 * high);
        let n = (40.0 * (high / low).log10()).ceil().max(2.0);
        let mut band: Vec<f64> = (0..=n as usize).map(|k| low * (high / low).powf(k as f64 / n)).collect();
        for pole in self.poles() {
            let (w, width) = (pole.value.im, pole.value.re.abs());
            for offset in [0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 8.0, 13.0] {
                band.extend([w - offset * width, w + offset * width]);
            }
        }
        band.retain(|w| *w >= low && *w <= high);
        band.sort_by(f64::total_cmp);
        band.dedup_by(|a, b| *a - *b < 1e-9 * *b);
        band
    }
}

impl Pole {
    pub(crate) fn n_states(&self) -> usize {
        if self.value.im > 0.0 { 2 } else { 1 }
    }

    /// Returns the displacement per unit of the pole's state; its real part counts.
    pub(crate) fn reading(&self) -> Vector3<Complex<f64>> {
        if self.value.im > 0.0 { self.output * Complex::new(2.0, 0.0) } else { self.output }
    }

    /// Returns the compliance at its resonance (m/N).
    pub(crate) fn peak(&self) -> f64 {
        self.output.norm() * self.input.norm() / self.value.re.abs()
    }
}
