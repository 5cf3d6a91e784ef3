//! The curve of one joint as a piecewise polynomial: values, jumps and kinks.
//!
//! A [`Curve`] has n pieces between n + 1 knots, times in s from the start of the motion; positions
//! are in rad or m. Before the first knot and after the last one the joint is at rest, so that a
//! motion that starts at speed has a jump there. Not here: polynomials (`polynomial`), building of
//! curves (`spline`, `plan`).

use crate::polynomial::Piece;

/// Speeds below this (rad/s or m/s) give no warning.
pub(crate) const QUIET_SPEED: f64 = 1e-6;

/// Maximum duration of a motion (s): about four months.
pub const LONGEST: f64 = 1e7;

/// Curve of one joint: `knots[i] <= t < knots[i + 1]` belongs to `pieces[i]`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curve {
    pub(crate) knots: Vec<f64>,
    pub(crate) pieces: Vec<Piece>,
}

impl Curve {
    /// Position, velocity, acceleration and jerk at `t`, clamped to the range of the knots.
    pub(crate) fn at(&self, t: f64) -> [f64; 4] {
        let last = self.pieces.len() - 1;
        let i = self.knots[1..=last].partition_point(|&knot| knot <= t);
        let piece = &self.pieces[i];
        piece.at((t - self.knots[i]).clamp(0.0, piece.width))
    }

    /// The curve started at `start`, held before it and after its end until `duration`.
    pub(crate) fn within(&self, start: f64, duration: f64) -> Self {
        let mut knots: Vec<f64> = self.knots.iter().map(|knot| start + knot).collect();
        let mut pieces = self.pieces.clone();
        if start > 0.0 {
            knots.insert(0, 0.0);
            pieces.insert(0, Piece::constant(start, self.start()[0]));
        }
        let end = knots[knots.len() - 1];
        // Ends that differ only by rounding are the same.
        if duration - end > 1e-9 * duration {
            knots.push(duration);
            pieces.push(Piece::constant(duration - end, self.end()[0]));
        } else if let (Some(last), Some(piece)) = (knots.last_mut(), pieces.last())
            && (duration - *last).abs() <= 1e-9 * piece.width
        {
            *last = duration;
        }
        Self { knots, pieces }
    }

    /// [`crate::Trajectory::still_until`] for one joint.
    pub(crate) fn still_until(&self, t: f64) -> f64 {
        let last = self.pieces.len() - 1;
        let first = self.knots[1..=last].partition_point(|&knot| knot <= t);
        match self.pieces[first..].iter().position(|piece| !piece.is_still()) {
            Some(0) => t,
            Some(still) => self.knots[first + still],
            None => f64::INFINITY,
        }
    }

    pub(crate) fn start(&self) -> [f64; 4] {
        self.pieces[0].at(0.0)
    }

    pub(crate) fn end(&self) -> [f64; 4] {
        let piece = &self.pieces[self.pieces.len() - 1];
        piece.at(piece.width)
    }

    /// Jumps at every knot, including those to the holds before and after.
    pub(crate) fn jumps(&self) -> impl Iterator<Item = Jump> + '_ {
        let at_rest = |[q, ..]: [f64; 4]| [q, 0.0, 0.0, 0.0];
        let last = self.pieces.len();
        (0..=last).map(move |i| {
            let left = i.checked_sub(1).map(|i| &self.pieces[i]);
            let right = self.pieces.get(i);
            let before = left.map_or_else(|| at_rest(self.start()), |piece| piece.at(piece.width));
            let after = right.map_or_else(|| at_rest(self.end()), |piece| piece.at(0.0));
            // Positions are exact to a few units in the last place; each derivative divides this
            // error by the width.
            let width = left.into_iter().chain(right).map(|piece| piece.width).fold(f64::INFINITY, f64::min);
            let rounding = |order: i32| 1e-13 * after[0].abs() / width.powi(order);
            Jump {
                time_s: self.knots[i],
                size: std::array::from_fn(|k| after[k] - before[k]),
                rounding: [0, 1, 2, 3].map(rounding),
            }
        })
    }

    /// Knots at which the velocity, acceleration or jerk jumps by more than rounding and, for the
    /// latter two, a millionth of its peak.
    pub(crate) fn kinks(&self) -> Vec<f64> {
        let levels = [0.0, QUIET_SPEED, 1e-6 * self.largest(2), 1e-6 * self.largest(3)];
        let kinks = self.jumps().filter(|jump| (1..4).any(|order| jump.exceeds(order, levels[order])));
        kinks.map(|jump| jump.time_s).collect()
    }

    /// Maximum magnitude of derivative `order`.
    pub(crate) fn largest(&self, order: usize) -> f64 {
        let [least, greatest] = self.range(order);
        greatest.value.max(-least.value)
    }
}

/// Jumps of position, velocity, acceleration and jerk at a knot.
pub(crate) struct Jump {
    pub(crate) time_s: f64,
    pub(crate) size: [f64; 4],
    /// Jumps below this are rounding errors.
    rounding: [f64; 4],
}

impl Jump {
    /// Whether the jump of derivative `order` exceeds `level` and the rounding error.
    pub(crate) fn exceeds(&self, order: usize, level: f64) -> bool {
        self.size[order].abs() > level.max(self.rounding[order])
    }
}
