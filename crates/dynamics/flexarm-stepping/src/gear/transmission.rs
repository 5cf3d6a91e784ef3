//! Transmission error of a gear as a sum of harmonics.

use std::f64::consts::FRAC_PI_2;

/// One harmonic of a transmission error: `amplitude sin(cycles q + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Amplitude on the joint side (rad or m).
    pub amplitude: f64,
    /// Cycles per turn of the joint, which is radians of phase per radian; for a prismatic joint
    /// radians per metre.
    pub cycles: f64,
    /// Phase at joint position zero (rad).
    pub phase: f64,
}

/// Transmission error as a function of the motor's coordinate, equation (1) of the module.
#[derive(Clone, Debug, PartialEq)]
pub struct TransmissionError {
    /// Element index of the gearbox spring (single coordinate).
    pub element: usize,
    /// Actuated coordinate of the joint, on the motor side.
    pub motor: usize,
    /// Harmonics.
    pub harmonics: Vec<Harmonic>,
}

impl TransmissionError {
    /// Returns ε (rad or m) at motor coordinate `q`, on the joint side.
    pub fn at(&self, q: f64) -> f64 {
        self.harmonics.iter().map(|h| h.amplitude * (h.cycles * q + h.phase).sin()).sum()
    }

    /// Returns the derivative dε/dq.
    pub fn slope(&self, q: f64) -> f64 {
        let cosine = |h: &Harmonic| h.amplitude * h.cycles * (h.cycles * q + h.phase + FRAC_PI_2).sin();
        self.harmonics.iter().map(cosine).sum()
    }
}
