//! Rounding of corners: a velocity jump becomes a change of velocity within a given time.
//!
//! Around each corner one quintic replaces a section of the curve, with the curve's position,
//! velocity and acceleration at both ends. Not here: finding corners (`corner`), recordings that
//! start or end at speed.

use crate::curve::{Curve, QUIET_SPEED};
use crate::error::TrajectoryError;
use crate::polynomial::Piece;
use crate::trajectory::Trajectory;

impl Trajectory {
    /// Returns the same motion with every interior corner replaced by a quintic blend of duration
    /// `seconds`, or less where two corners, or a corner and an end, are nearer than that. A joint
    /// deviates from its curve by slightly more than `|Δv| seconds / 8` at most. A motion that
    /// starts or ends at speed still does.
    ///
    /// # Errors
    /// [`TrajectoryError::Value`] unless `seconds` is positive and finite;
    /// [`TrajectoryError::OutOfRange`] if it is so short that numbers are too extreme for f64.
    pub fn with_rounded_corners(&self, seconds: f64) -> Result<Self, TrajectoryError> {
        if !(seconds > 0.0 && seconds.is_finite()) {
            let mend = "give a positive time, such as 0.02 s";
            return Err(TrajectoryError::Value(format!("corners cannot be rounded within {seconds} s; {mend}")));
        }
        let curves = self.curves().iter().map(|curve| curve.rounded(seconds)).collect();
        self.with_curves(self.joints().to_vec(), curves)
    }
}

impl Curve {
    fn rounded(&self, seconds: f64) -> Self {
        let (begin, end) = (self.knots[0], self.knots[self.knots.len() - 1]);
        let jumps = self.jumps().filter(|jump| jump.exceeds(1, QUIET_SPEED)).map(|jump| jump.time_s);
        let corners: Vec<f64> = jumps.filter(|t| *t > begin && *t < end).collect();
        let mut rounded = Self { knots: vec![begin], pieces: Vec::new() };
        for (k, &t) in corners.iter().enumerate() {
            let left = if k == 0 { t - begin } else { 0.5 * (t - corners[k - 1]) };
            let right = corners.get(k + 1).map_or(end - t, |next| 0.5 * (next - t));
            let half = (0.5 * seconds).min(left).min(right);
            let (from, to) = (t - half, t + half);
            rounded.append_part(self, from);
            let state = |at: [f64; 4]| [at[0], at[1], at[2]];
            rounded.pieces.push(Piece::hermite(to - from, state(self.at(from)), state(self.at(to))));
            rounded.knots.push(to);
        }
        rounded.append_part(self, end);
        rounded
    }

    /// Appends `other` from the last knot until `until`.
    fn append_part(&mut self, other: &Self, until: f64) {
        for (piece, knots) in other.pieces.iter().zip(other.knots.windows(2)) {
            let (from, to) = (self.knots[self.knots.len() - 1].max(knots[0]), until.min(knots[1]));
            // A remainder from rounding of the times is not a piece.
            if to - from > 1e-9 * piece.width {
                self.pieces.push(piece.part(from - knots[0], to - knots[0]));
                self.knots.push(to);
            }
        }
        let last = self.knots.len() - 1;
        self.knots[last] = until;
    }
}

impl Piece {
    /// The part between two of its times.
    fn part(&self, from: f64, to: f64) -> Self {
        let mut c = self.c;
        // Taylor shift by repeated Horner steps.
        for first in 0..5 {
            for k in (first..5).rev() {
                c[k] += from * c[k + 1];
            }
        }
        Self { width: to - from, c }
    }
}
