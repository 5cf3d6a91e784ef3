//! Newton's matrices between two renewals: followed along the line through their last two values.
//!
//! While the joints move, masses change steadily, and a matrix that is kept gets old in proportion
//! to the time; one that goes on along the line gets old with the square of it. Beyond the end of
//! the line, as many steps as there are between its two values, it is kept.
//!
//! ```text
//! A_n+1 = A_n + (A_taken - A_before) / m        for the m steps after A was taken, m steps after A_before        (9)
//! ```
//! On the reference arm at 1 ms 80 matrices are taken in 4000 steps instead of 185.

/// `h ω` of the first mode up to which matrices are followed: of longer steps too few lie between
/// two renewals, and the matrices of a turning point would be far off (10 ms on the reference arm:
/// error 8e-3 instead of 4e-3).
pub(super) const SHORT: f64 = 0.3;

/// Largest ρ of a matrix that is followed: half of what others may have, because `M^-1 K`, which
/// belongs to the scheme, is then as near to the truth as there (errors of the accuracy table
/// within 4 %; with 3 % they were 8 % larger).
pub(crate) const FOLLOWED_TO: f64 = 0.015;

/// What is known of the inverse of Newton's matrix and of `M^-1 K`; each n × n.
#[derive(Clone, Debug, Default)]
pub(crate) struct Course {
    /// As they were taken last; empty: never, or in another course.
    before: [Vec<f64>; 2],
    /// What each step adds.
    change: [Vec<f64>; 2],
    /// Steps since, and how many more are on the line.
    steps: u32,
    left: u32,
}

impl Course {
    /// What the next step adds to the matrices, and whether that is something else than in the step
    /// before.
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

    /// The matrices were taken anew: what the steps to come add.
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
        // One more, in which the change ends.
        self.left = if known { self.steps.saturating_add(1) } else { 0 };
        self.steps = 0;
        &self.change
    }

    /// What comes is not continued from here: other steps, other masses.
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

    /// Truth: matrices on a straight line are met in every step up to the end of the line, and kept
    /// after it.
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
