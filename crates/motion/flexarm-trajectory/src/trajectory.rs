//! Trajectories as named piecewise polynomials: sampling, reordering, time scaling, division into
//! moves.
//!
//! Start at [`Trajectory::sample`]. Trajectories are built by [`crate::Plan`] and
//! [`crate::Samples`] and do not change afterwards.
//!
//! Not here: planning (`plan`), splines through samples (`spline`), limits (`limits`), files.

use flexarm_settings::{Finding, Place};

use crate::curve::{Curve, LONGEST, QUIET_SPEED};
use crate::error::{SampleError, TrajectoryError};
use crate::findings::{SHORT_DURATION, at, fault, of_curve};
use crate::gap::Gap;
use crate::polynomial::Piece;
use crate::table::request::KnownJoint;

/// A joint that moves less than this within a piece (rad or m) is at rest there.
const REST: f64 = 1e-9;

/// Joint positions, velocities and accelerations as functions of time, from `t = 0` to
/// [`Trajectory::duration`].
///
/// Position, velocity and acceleration are continuous everywhere, with three exceptions, each
/// reported by [`Trajectory::warnings`]: the acceleration of an unrounded trapezoid jumps; sampled
/// data may start or end in motion or have corners, where the velocity jumps
/// ([`Trajectory::velocity_jumps`]); so may data that include velocities or accelerations.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    joints: Vec<String>,
    curves: Vec<Curve>,
    duration: f64,
    gaps: Vec<Gap>,
    /// Findings of the reader or planner; see [`Trajectory::warnings`].
    notes: Vec<Finding>,
    /// Columns of the table that are not part of the motion.
    dropped_columns: Vec<String>,
    /// Units that the file states for its joints.
    stated: Vec<StatedUnit>,
}

/// Unit that a file states for a joint: degrees, or metres.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StatedUnit {
    pub(crate) joint: String,
    pub(crate) is_length: bool,
    /// Line of the statement, from 1.
    pub(crate) line: usize,
}

/// Corner: a velocity jump of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocityJump {
    /// Joint name.
    pub joint: String,
    /// Time, s.
    pub time_s: f64,
    /// Velocity after minus velocity before, rad/s or m/s.
    pub jump: f64,
}

/// Time span in which at least one joint moves; between two of them all joints are at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Time at which the first joint starts, s.
    pub start: f64,
    /// Time at which the last joint stops, s.
    pub end: f64,
}

impl Trajectory {
    /// Assembles a trajectory from curves and checks them.
    ///
    /// All curves must cover `0..duration`.
    ///
    /// # Errors
    /// [`TrajectoryError::OutOfRange`] if a coefficient or a time is not finite or beyond any real
    /// motion, or a piece is shorter than the rounding of its time.
    pub(crate) fn from_curves(
        joints: Vec<String>,
        curves: Vec<Curve>,
        duration: f64,
        notes: Vec<Finding>,
    ) -> Result<Self, TrajectoryError> {
        assert_eq!(joints.len(), curves.len(), "one curve per joint");
        for (joint, curve) in joints.iter().zip(&curves) {
            assert_eq!(curve.knots.len(), curve.pieces.len() + 1, "a piece between every two knots");
            // Far from zero, short pieces are lost in the rounding of the knots.
            let spans = curve.knots.windows(2).zip(&curve.pieces);
            let mut sound = spans
                .map(|(knot, piece)| piece.is_sound() && (knot[1] - knot[0] - piece.width).abs() <= 1e-6 * piece.width);
            if curve.pieces.is_empty() || duration.is_nan() || duration > LONGEST {
                return Err(TrajectoryError::OutOfRange { joint: joint.clone(), time_s: duration.min(LONGEST) });
            }
            if let Some(i) = sound.position(|is_sound| !is_sound) {
                return Err(TrajectoryError::OutOfRange { joint: joint.clone(), time_s: curve.knots[i] });
            }
        }
        let (gaps, dropped_columns, stated) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { joints, curves, duration, gaps, notes, dropped_columns, stated })
    }

    /// Returns the stored curve of a joint, for programs that save motions: the knots (s), one more
    /// than there are pieces, and for each piece its length (s) and the coefficients of 1, τ, ...
    /// τ⁵, where τ is the time since the start of the piece.
    pub fn pieces(&self, joint: usize) -> Option<(&[f64], Vec<[f64; 7]>)> {
        let row = |piece: &Piece| std::array::from_fn(|k| if k == 0 { piece.width } else { piece.c[k - 1] });
        let curve = self.curves.get(joint)?;
        Some((&curve.knots, curve.pieces.iter().map(row).collect()))
    }

    /// Rebuilds a trajectory bit for bit from the name, knots and pieces of each joint.
    ///
    /// # Errors
    /// [`TrajectoryError::OutOfRange`] if the numbers do not form a curve from 0 to `duration` (s).
    pub fn of_pieces(joints: Vec<(String, Vec<f64>, Vec<[f64; 7]>)>, duration: f64) -> Result<Self, TrajectoryError> {
        let piece = |row: &[f64; 7]| Piece { width: row[0], c: std::array::from_fn(|k| row[k + 1]) };
        let (mut names, mut curves) = (Vec::new(), Vec::new());
        for (joint, knots, pieces) in joints {
            let begins = knots.first().is_some_and(|t| *t <= 0.0);
            let ends = knots.last().is_some_and(|t| (t - duration).abs() <= 1e-9 * duration.abs());
            if knots.len() != pieces.len() + 1 || !begins || !ends {
                return Err(TrajectoryError::OutOfRange { joint, time_s: duration });
            }
            names.push(joint);
            curves.push(Curve { knots, pieces: pieces.iter().map(piece).collect() });
        }
        Self::from_curves(names, curves, duration, Vec::new())
    }

    /// Joint names; all slices follow this order.
    pub fn joints(&self) -> &[String] {
        &self.joints
    }

    /// Time of the last knot in s; the first one is at 0.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Position, velocity and acceleration of every joint at time `t`, in the order of
    /// [`Trajectory::joints`].
    ///
    /// Before 0 and after the end the joints are held: constant position, zero velocity and
    /// acceleration. At a knot where the acceleration jumps, the value is the one just after it
    /// (just before it at the end). Nothing is allocated; the cost is one binary search per joint.
    ///
    /// * `t`: s, not NaN.
    /// * `q`, `qdot`, `qddot`: rad, rad/s, rad/s² (m, m/s, m/s² for a prismatic joint), one entry
    ///   per joint.
    ///
    /// # Panics
    /// If a slice does not have one entry per joint.
    pub fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let n = self.joints.len();
        assert!(
            q.len() == n && qdot.len() == n && qddot.len() == n,
            "q, qdot and qddot have {}, {} and {} entries, the trajectory has {n} joints",
            q.len(),
            qdot.len(),
            qddot.len()
        );
        let outside = t < 0.0 || t > self.duration;
        for (i, curve) in self.curves.iter().enumerate() {
            let [position, velocity, acceleration, _] = curve.at(t);
            q[i] = position;
            qdot[i] = if outside { 0.0 } else { velocity };
            qddot[i] = if outside { 0.0 } else { acceleration };
        }
    }

    /// Returns the times of the rows of a file (s): every `1 / rate_hz` from 0, and the end, which
    /// replaces the last regular time where they coincide.
    ///
    /// * `max_rows`: maximum number of rows; more means a wrong rate.
    ///
    /// # Errors
    /// [`TrajectoryError::Value`] unless the rate is positive and gives at most `max_rows`.
    pub fn row_times(
        &self,
        rate_hz: f64,
        max_rows: u32,
    ) -> Result<impl ExactSizeIterator<Item = f64> + use<>, TrajectoryError> {
        let duration_s = self.duration;
        let intervals = duration_s * rate_hz;
        if !(rate_hz > 0.0 && rate_hz.is_finite() && intervals <= f64::from(max_rows)) {
            return Err(TrajectoryError::Value(format!(
                "sampling rate {rate_hz} Hz is not possible for {duration_s} s of motion; give a positive rate that \
                 makes at most {max_rows} rows"
            )));
        }
        let regular = (intervals - 1e-6).ceil().max(1.0) as u32;
        let time = move |k| if k == regular { duration_s } else { f64::from(k) / rate_hz };
        Ok((0..regular + 1).map(time))
    }

    /// Returns the same motion with the joints in the order of `names`.
    ///
    /// # Errors
    /// [`TrajectoryError::JointOrder`] unless `names` holds each joint of the trajectory exactly
    /// once; it lists all missing and unknown joints.
    pub fn with_joint_order(&self, names: &[&str]) -> Result<Self, TrajectoryError> {
        let place = |name: &str| self.joints.iter().position(|joint| joint == name);
        let mut repeated = names.to_vec();
        repeated.sort_unstable();
        let is_repeated = repeated.windows(2).any(|pair| pair[0] == pair[1]);

        let missing: Vec<String> =
            names.iter().filter(|name| place(name).is_none()).map(|name| (*name).to_owned()).collect();
        let unknown: Vec<String> =
            self.joints.iter().filter(|joint| !names.contains(&joint.as_str())).cloned().collect();
        if !missing.is_empty() || !unknown.is_empty() || is_repeated {
            return Err(TrajectoryError::JointOrder {
                missing,
                unknown,
                have: self.joints.clone(),
                want: names.iter().map(|name| (*name).to_owned()).collect(),
            });
        }

        let order: Vec<usize> = names.iter().filter_map(|name| place(name)).collect();
        Ok(Self {
            joints: order.iter().map(|&i| self.joints[i].clone()).collect(),
            curves: order.iter().map(|&i| self.curves[i].clone()).collect(),
            gaps: self.gaps.clone(),
            notes: self.notes.clone(),
            dropped_columns: Vec::new(),
            stated: Vec::new(),
            ..*self
        })
    }

    /// Returns the same motion without the named joints; other names have no effect.
    #[must_use]
    pub fn without_joints(&self, names: &[String]) -> Self {
        let mut rest = self.clone();
        rest.joints.retain(|joint| !names.contains(joint));
        let kept = self.joints.iter().zip(&self.curves).filter(|(joint, _)| !names.contains(joint));
        rest.curves = kept.map(|(_, curve)| curve.clone()).collect();
        rest
    }

    /// Returns the same motion with additional joints, each held at the given position (rad or m)
    /// from start to end.
    ///
    /// # Errors
    /// [`TrajectoryError::OutOfRange`] for a value that is not finite.
    ///
    /// # Panics
    /// If a joint is already part of the trajectory.
    pub fn with_held_joints(&self, held: &[(&str, f64)]) -> Result<Self, TrajectoryError> {
        let (mut joints, mut curves) = (self.joints.clone(), self.curves.clone());
        for (joint, value) in held {
            assert!(!joints.iter().any(|j| j == joint), "joint {joint:?} moves already");
            joints.push((*joint).to_owned());
            let pieces = vec![Piece::constant(self.duration, *value)];
            curves.push(Curve { knots: vec![0.0, self.duration], pieces });
        }
        self.with_curves(joints, curves)
    }

    /// Returns other curves over the same time, with the gaps and notes of this motion.
    ///
    /// # Errors
    /// As [`Trajectory::from_curves`].
    pub(crate) fn with_curves(&self, joints: Vec<String>, curves: Vec<Curve>) -> Result<Self, TrajectoryError> {
        let made = Self::from_curves(joints, curves, self.duration, self.notes.clone())?;
        Ok(made.with_gaps(self.gaps.clone()))
    }

    /// Combines motions of different joints into one; each part begins at its own time, and its
    /// joints are held before its start and after its end. The notes of the parts apply to the
    /// whole.
    ///
    /// * `parts`: start time (s, not negative) and motion of each part.
    ///
    /// # Errors
    /// [`TrajectoryError::Samples`] if there is no part or a joint occurs in two parts;
    /// [`TrajectoryError::OutOfRange`] if a start time is not finite or negative, or so large that
    /// a part is lost in its rounding.
    pub fn side_by_side(parts: &[(f64, Self)]) -> Result<Self, TrajectoryError> {
        let duration = parts.iter().map(|(start, part)| start + part.duration).fold(0.0, f64::max);
        let (mut joints, mut curves, mut gaps, mut notes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (start, part) in parts {
            for (joint, curve) in part.joints.iter().zip(&part.curves) {
                if joints.contains(joint) {
                    return Err(SampleError::repeated_joint(joint).into());
                }
                if !(*start >= 0.0 && start.is_finite()) {
                    return Err(TrajectoryError::OutOfRange { joint: joint.clone(), time_s: *start });
                }
                joints.push(joint.clone());
                curves.push(curve.within(*start, duration));
            }
            notes.extend(part.notes.iter().cloned());
            for gap in &part.gaps {
                add_gap(&mut gaps, gap.at_times(*start, 1.0));
            }
        }
        if joints.is_empty() {
            return Err(SampleError::no_joint().into());
        }
        Ok(Self::from_curves(joints, curves, duration, notes)?.with_gaps(gaps))
    }

    /// Returns the same path with the time multiplied by `factor`: 2 halves every velocity.
    ///
    /// # Errors
    /// [`TrajectoryError::Value`] unless `factor` is positive and finite;
    /// [`TrajectoryError::OutOfRange`] if it is too extreme for f64.
    pub fn scaled(&self, factor: f64) -> Result<Self, TrajectoryError> {
        if !(factor > 0.0 && factor.is_finite()) {
            let example = "2 makes the motion take twice the time";
            return Err(TrajectoryError::Value(format!("time scale {factor} is not a positive number; {example}")));
        }
        let stretch = |curve: &Curve| Curve {
            knots: curve.knots.iter().map(|knot| knot * factor).collect(),
            pieces: curve.pieces.iter().map(|piece| piece.mapped(0.0, 1.0, factor)).collect(),
        };
        let curves = self.curves.iter().map(stretch).collect();
        // The planner's note on times and limits applies only to the unscaled motion.
        let notes = self.notes.iter().filter(|note| note.code != SHORT_DURATION).cloned().collect();
        let gaps = self.gaps.iter().map(|gap| gap.at_times(0.0, factor)).collect();
        Ok(Self::from_curves(self.joints.clone(), curves, self.duration * factor, notes)?.with_gaps(gaps))
    }

    /// Returns the velocity jumps by time: corners of sampled data, and both ends if the motion
    /// does not start or end at rest (the joints are held before and after it).
    pub fn velocity_jumps(&self) -> Vec<VelocityJump> {
        let of_curve = |(joint, curve): (&String, &Curve)| -> Vec<VelocityJump> {
            let jumps = curve.jumps().filter(|jump| jump.exceeds(1, QUIET_SPEED));
            jumps.map(|j| VelocityJump { joint: joint.clone(), time_s: j.time_s, jump: j.size[1] }).collect()
        };
        let mut jumps: Vec<VelocityJump> = self.joints.iter().zip(&self.curves).flat_map(of_curve).collect();
        jumps.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        jumps
    }

    /// Returns the times at which the velocity, acceleration or jerk of some joint jumps,
    /// ascending: knots at which integrator steps should end. Includes 0 and the end if the motion
    /// does not start or end smoothly.
    pub fn kinks(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.curves.iter().flat_map(Curve::kinks).collect();
        times.sort_unstable_by(f64::total_cmp);
        times.dedup_by(|b, a| *b - *a <= 1e-12 * self.duration);
        times
    }

    /// Returns the time spans in which at least one joint moves, ascending and disjoint.
    ///
    /// A joint is at rest in a piece in which it moves less than 1e-9 rad (or m). Two moves without
    /// a hold between them count as one, because nothing can settle between them.
    pub fn moves(&self) -> Vec<Move> {
        let moving = |curve: &Curve| -> Vec<Move> {
            let spans = curve.knots.windows(2).map(|pair| Move { start: pair[0], end: pair[1] });
            let pieces = curve.pieces.iter().map(|piece| piece.excursion_bound() > REST);
            spans.zip(pieces).filter_map(|(span, moves)| moves.then_some(span)).collect()
        };
        let mut spans: Vec<Move> = self.curves.iter().flat_map(moving).collect();
        spans.sort_by(|a, b| a.start.total_cmp(&b.start));

        let mut moves: Vec<Move> = Vec::new();
        for span in spans {
            match moves.last_mut() {
                Some(last) if span.start <= last.end + 1e-12 * self.duration => last.end = last.end.max(span.end),
                _ => moves.push(span),
            }
        }
        moves
    }

    /// Returns the time until which all velocities are exactly zero from `t` on (s): `t` itself
    /// where a joint moves, infinity after the last motion. Stricter than the gaps between
    /// [`Trajectory::moves`].
    ///
    /// * `t`: s, not NaN.
    #[must_use]
    pub fn still_until(&self, t: f64) -> f64 {
        if t > self.duration {
            return f64::INFINITY;
        }
        self.curves.iter().map(|curve| curve.still_until(t)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the largest speed of all joints at `t = 0` (rad/s or m/s), that is, the velocity
    /// jump at the start.
    pub fn initial_speed(&self) -> f64 {
        self.curves.iter().map(|curve| curve.start()[1].abs()).fold(0.0, f64::max)
    }

    /// Returns all warnings a user should know before trusting a result: gaps in the samples, the
    /// findings of the file reader or planner, velocity jumps at the ends and in between, and
    /// acceleration jumps.
    ///
    /// The location of a warning is its place in the file, the name of its joint, or empty for the
    /// motion as a whole.
    pub fn warnings(&self) -> Vec<Finding> {
        let of_curves = self.joints.iter().zip(&self.curves).flat_map(|(joint, curve)| of_curve(joint, curve));
        self.gaps.iter().map(Gap::warning).chain(self.notes.iter().cloned()).chain(of_curves).collect()
    }

    /// Places where samples are missing in evenly sampled data.
    pub fn gaps(&self) -> &[Gap] {
        &self.gaps
    }

    /// Returns the columns of a table that are not part of the motion.
    pub fn dropped_columns(&self) -> &[String] {
        &self.dropped_columns
    }

    pub(crate) fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// Checks the units stated in the file against a robot with prismatic or revolute joints.
    /// Trajectories derived from another one no longer have stated units.
    ///
    /// * `origin`: file name for messages.
    ///
    /// # Errors
    /// [`TrajectoryError::File`] for a prismatic joint whose values were read as degrees, and for a
    /// revolute one whose values were read as metres.
    pub fn check_units(&self, origin: &str, joints: &[KnownJoint<'_>]) -> Result<(), TrajectoryError> {
        let contradicts = |stated: &StatedUnit| {
            joints.iter().any(|joint| joint.name == stated.joint && joint.is_prismatic != stated.is_length)
        };
        let Some(StatedUnit { joint, is_length, line }) = self.stated.iter().find(|stated| contradicts(stated)) else {
            return Ok(());
        };
        let message = match is_length {
            true => format!(
                "joint {joint:?} turns, and `metres` names it as one that slides; take it out of `metres`, and give \
                 its numbers in `unit`"
            ),
            false => format!(
                "joint {joint:?} slides, and its numbers are read as degrees; add {joint:?} to `metres` and give them in m"
            ),
        };
        Err(at(&Place::of_file(origin).line(*line), fault("unit-of-joint", message)).into())
    }

    pub(crate) fn with_stated_units(self, stated: Vec<StatedUnit>) -> Self {
        Self { stated, ..self }
    }

    pub(crate) fn with_gaps(self, gaps: Vec<Gap>) -> Self {
        Self { gaps, ..self }
    }

    pub(crate) fn with_dropped_columns(self, dropped_columns: Vec<String>) -> Self {
        Self { dropped_columns, ..self }
    }

    /// Adds a finding of a reader about its file.
    pub(crate) fn with_note(mut self, note: Finding) -> Self {
        self.notes.push(note);
        self
    }
}

/// Adds a gap; one that is known takes the joints of the new one.
fn add_gap(gaps: &mut Vec<Gap>, gap: Gap) {
    let same = |other: &&mut Gap| [other.from_s, other.to_s] == [gap.from_s, gap.to_s] && other.sample == gap.sample;
    match gaps.iter_mut().find(same) {
        Some(known) => known.joints.extend(gap.joints),
        None => gaps.push(gap),
    }
}
