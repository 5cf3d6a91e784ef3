//! Linear extrapolation of Newton's matrices between two renewals, through their last two values.
//!
//! While the joints move, masses change steadily: the error of a constant matrix grows in
//! proportion to time, that of an extrapolated one with its square. The extrapolation extends over
//! as many steps as there are between the two values; beyond, the matrix is kept constant.
//!
//! ```text
//! A_n+1 = A_n + (A_new - A_old) / m                                                            (9)
//! ```
//! for the m steps after the renewal A_new, which was m steps after A_old.
//! On the reference arm at 1 ms, 4000 steps need 80 renewals instead of 185.

/// Maximum `h ω` of the first mode for extrapolation: with larger steps there are too few of them
/// between two renewals, and matrices near a turning point would be far off (10 ms on the reference
/// arm: error 8e-3 instead of 4e-3).
pub(super) const SHORT: f64 = 0.3;

/// Maximum ρ of an extrapolated matrix: half of the usual value, because `M^-1 K`, which is part of
/// the scheme, is then as accurate as with constant matrices (errors of the accuracy table within 4
/// %; with 3 % they were 8 % larger).
pub(crate) const FOLLOWED_TO: f64 = 0.015;

/// Extrapolation of the inverse of Newton's matrix and of `M^-1 K`; each n × n.
#[derive(Clone, Debug, Default)]
pub(crate) struct Course {
    /// Values at the last renewal; empty if there is none in this course.
    before: [Vec<f64>; 2],
    /// Change per step.
    change: [Vec<f64>; 2],
    /// Steps since the last renewal, and remaining steps of the extrapolation.
    steps: u32,
    left: u32,
}

impl Course {
    /// Returns the change of the matrices in the next step, and whether it differs from that of the
    /// previous step.
    #[inline]
    pub(crate) fn step(&mut self) -> (&[Vec<f64>; 2], bool) {
        self.steps = self.steps.saturating_add(1);
        let ends = self.left == 1;
        self.left = self.left.saturating_sub(1);
        if ends {
            self.stop();
        }
        (&self.change, ends)
    }

    /// Records renewed matrices; returns the change per step from here on.
    pub(crate) fn taken(&mut self, matrices: [&[f64]; 2]) -> &[Vec<f64>; 2] {
        let known = self.steps > 0 && !self.before[0].is_empty();
        let part = 1.0 / f64::from(self.steps.max(1));
        for ((change, before), matrix) in self.change.iter_mut().zip(&mut self.before).zip(matrices) {
            change.resize(matrix.len(), 0.0);
            match known {
                true => change
                    .iter_mut()
                    .zip(matrix)
                    .zip(&*before)
                    .for_each(|((change, now), before)| *change = part * (now - before)),
                false => change.fill(0.0),
            }
            before.clear();
            before.extend_from_slice(matrix);
        }
        // One more step, in which the change becomes zero.
        self.left = if known { self.steps.saturating_add(1) } else { 0 };
        self.steps = 0;
        &self.change
    }

    /// Discards the course after a change of step size or masses.
    pub(crate) fn forget(&mut self) {
        self.before.iter_mut().for_each(Vec::clear);
        self.left = 0;
        self.stop();
    }

    fn stop(&mut self) {
        self.change.iter_mut().for_each(|change| change.fill(0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: matrices that change linearly are reproduced in every step up to the end of the
    /// extrapolation, and kept constant after it.
    #[test]
    fn a_matrix_that_changes_steadily_is_met_in_every_step_of_the_line() {
        let at = |t: f64| [vec![1.0 + 0.5 * t, -2.0 * t], vec![3.0, 0.25 * t]];
        let mut course = Course::default();
        let both = |now: &[Vec<f64>; 2]| [now[0].clone(), now[1].clone()];
        let mut now = at(0.0);
        course.taken([&now[0], &now[1]]);
        let follow = |course: &mut Course, now: &mut [Vec<f64>; 2]| {
            let (change, _) = course.step();
            let change = both(change);
            now.iter_mut().zip(change).for_each(|(now, change)| now.iter_mut().zip(change).for_each(|(a, b)| *a += b));
        };
        (0..4).for_each(|_| follow(&mut course, &mut now));
        assert_eq!(now, at(0.0), "after one value there is no line");
        now = at(4.0);
        course.taken([&now[0], &now[1]]);
        for t in 5..=8 {
            follow(&mut course, &mut now);
            assert_eq!(now, at(f64::from(t)));
        }
        (0..3).for_each(|_| follow(&mut course, &mut now));
        assert_eq!(now, at(8.0), "the line has an end");

        course.forget();
        now = at(20.0);
        course.taken([&now[0], &now[1]]);
        follow(&mut course, &mut now);
        assert_eq!(now, at(20.0), "other masses begin another line");
    }
}
