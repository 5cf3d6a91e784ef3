//! A route over time: its time law, the knots of the joint curves, and the results of its moves.
//!
//! Start at [`Schedule::new`], then [`Schedule::write_within`]. With `q(s)` of the route and `s(t)`
//! of the law, the joints over time are quintics through knots with
//!
//! ```text
//! q̇ = q' ṡ,    q̈ = q'' ṡ² + q' s̈,    q⃛ = q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛
//! ```
//! so close that they follow the path. Times are in s from the start of the route. Not here: the
//! bounds (`limits`), the search for the law (`averaged`, `jerk_bounded`).

use flexarm_kinematics::Model;
use flexarm_settings::Finding;
use flexarm_trajectory::time_law::{Law, LawError, Progress};
use flexarm_trajectory::{JointKnots, JointPeak, LONGEST, Trajectory, TrajectoryError};
use nalgebra::DVector;

use crate::arm::{JointBounds, PathOptions, ProgramArm};
use crate::averaged::{SLACK, kept};
use crate::error::at_move;
use crate::follow::{JointJet, between};
use crate::jerk_bounded::JerkBounded;
use crate::limits::{Cap, LimitedPath, Limits};
use crate::planned::{PlannedMove, Slowed, SlowedBy};
use crate::route::{Route, Station};

/// Relative tolerance of joint limits, tighter than that of the checks.
const ROUNDING: f64 = 1e-10;
/// Shorter averaging windows are lost in rounding (s).
const SHORTEST_RISE: f64 = 1e-5;
/// Maximum number of attempts to slow a route until its curves keep the joint limits.
const ROUNDS: usize = 4;
/// A limit slows a place where the speed is within this fraction of the limit.
const AT_LIMIT: f64 = 0.02;
/// A jerk slows a place where it exceeds this fraction of its bound.
const AT_JERK: f64 = 0.9;
/// Knots nearer than this coincide (s).
const SAME_TIME: f64 = 1e-6;
/// Maximum deviation of the joint curves over time from the path (rad or m).
const KEPT: f64 = 1e-10;
/// Maximum number of intervals of the law between two knots.
const MAX_INTERVALS: usize = 64;
/// Maximum number of halvings between two knots.
const HALVINGS: usize = 10;
/// Maximum deviation of joint jerks over time from those along the path, relative to their bounds.
const JERK_KEPT: f64 = 2e-4;
/// Fractions of an interval at which the jerks are compared.
const JERKS_AT: [f64; 9] = [1e-3, 0.07, 0.19, 0.31, 0.43, 0.57, 0.69, 0.81, 0.999];

/// Joint state at one time.
#[derive(Debug, Clone)]
pub(crate) struct Knot {
    pub(crate) t: f64,
    pub(crate) q: DVector<f64>,
    pub(crate) v: DVector<f64>,
    /// Accelerations just before and just after.
    pub(crate) before: DVector<f64>,
    pub(crate) after: DVector<f64>,
}

impl Knot {
    /// Knot at rest.
    pub(crate) fn rest(t: f64, q: &DVector<f64>) -> Self {
        let zero = DVector::zeros(q.len());
        Self { t, q: q.clone(), v: zero.clone(), before: zero.clone(), after: zero }
    }

    /// The quintic over time from this knot to a later one at `t` seconds after it, with the jerks.
    fn towards(&self, next: &Self, t: f64) -> (JointJet, DVector<f64>) {
        let from = JointJet { q: self.q.clone(), d: self.v.clone(), dd: self.after.clone() };
        let to = JointJet { q: next.q.clone(), d: next.v.clone(), dd: next.before.clone() };
        between(&from, &to, next.t - self.t, t)
    }
}

/// The quintics through knots.
pub(crate) fn through(model: &Model, knots: &[Knot]) -> Result<Trajectory, TrajectoryError> {
    let times: Vec<f64> = knots.iter().map(|knot| knot.t).collect();
    let joint = |k: usize| JointKnots {
        name: model.coordinates()[k].joint.clone(),
        position: knots.iter().map(|knot| knot.q[k]).collect(),
        velocity: knots.iter().map(|knot| knot.v[k]).collect(),
        acceleration: knots.iter().map(|knot| [knot.before[k], knot.after[k]]).collect(),
    };
    let joints: Vec<JointKnots> = (0..model.n_actuated()).map(joint).collect();
    Trajectory::through_knots(&times, &joints)
}

/// Time law of a route.
enum Timing {
    /// With averaged speed.
    Averaged(Law),
    /// With bounded joint jerks.
    Bounded(JerkBounded),
}

impl Timing {
    fn at(&self, t: f64) -> Progress {
        match self {
            Self::Averaged(law) => law.at(t),
            Self::Bounded(bounded) => bounded.law.at(t),
        }
    }

    fn duration(&self) -> f64 {
        match self {
            Self::Averaged(law) => law.duration(),
            Self::Bounded(bounded) => bounded.law.duration(),
        }
    }

    fn knots(&self) -> Vec<f64> {
        match self {
            Self::Averaged(law) => law.knots(),
            Self::Bounded(bounded) => bounded.law.t.clone(),
        }
    }
}

/// A route with its time law.
pub(crate) struct Schedule<'r> {
    route: &'r Route,
    law: Timing,
    /// Factor of all times.
    stretch: f64,
    /// Programmed squared speeds and tightest limits of the robot, by station.
    programmed: Vec<f64>,
    caps: Vec<Option<Cap>>,
}

impl<'r> Schedule<'r> {
    pub(crate) fn new(route: &'r Route, arm: &ProgramArm<'_>, options: &PathOptions) -> Result<Self, Box<Finding>> {
        let fail = |why: String| at_move(&route.legs[0].of, "time-law", why);
        if !(SHORTEST_RISE..=LONGEST).contains(&options.rise_s) {
            return Err(fail(format!(
                "accelerations rise in {} s: give a time of {SHORTEST_RISE} s or more",
                options.rise_s
            )));
        }
        // Bounds at the stations, and the law that is fastest within them: of averaged speed, or
        // with bounded jerks of the joints.
        let rise = arm.has_jerk_limits().then_some(options.rise_s);
        let mut limits = Limits::new(route, arm, rise);
        let LimitedPath { points, programmed, caps } = limits.at_stations();
        let points = if rise.is_none() { limits.divided(&points) } else { points };
        let law = match rise {
            None => kept(&points, route, options.rise_s).map(|(law, stretch)| {
                let slowing = limits.slowing(&law, &points).max(stretch);
                (Timing::Averaged(law), slowing)
            }),
            Some(rise) => JerkBounded::new(&points, route, arm, rise).map(|law| (Timing::Bounded(law), 1.0)),
        };
        let law = law.map_err(|error| match error {
            LawError::Infeasible(k) => {
                let s = points[k].s;
                fail(format!(
                    "no speed keeps all limits {s:.4} m behind the last stop: does a joint's torque suffice there?"
                ))
            }
            error @ LawError::Points(_) => fail(error.to_string()),
        })?;
        // Durations that the program gives slow the law as a whole.
        let mut schedule = Self { route, law: law.0, stretch: law.1, programmed, caps };
        schedule.stretch *= schedule.given_duration(&fail)?;
        Ok(schedule)
    }

    /// Factor by which the motion must be slower for the durations that the program gives.
    fn given_duration(&self, fail: &dyn Fn(String) -> Box<Finding>) -> Result<f64, Box<Finding>> {
        let given: Vec<f64> = self.route.legs.iter().filter_map(|leg| leg.of.speed.duration_s).collect();
        if given.is_empty() {
            return Ok(1.0);
        }
        if given.len() < self.route.legs.len() {
            return Err(fail(
                "some moves between two stops have a duration and some have not: give all or none".to_owned(),
            ));
        }
        let (wanted, least) = (given.iter().sum::<f64>(), self.duration());
        if wanted < least * (1.0 - SLACK) {
            let why = format!(
                "a duration of {wanted} s is given, but the limits of the robot and the rise of its accelerations require at least {least:.4} s"
            );
            return Err(fail(why));
        }
        Ok((wanted / least).max(1.0))
    }

    pub(crate) fn duration(&self) -> f64 {
        self.law.duration() * self.stretch
    }

    /// [`Self::write`], slowed so that the curves through the knots keep the velocity and
    /// acceleration limits of the joints.
    pub(crate) fn write_within(
        &mut self,
        arm: &ProgramArm<'_>,
        now: f64,
        knots: &mut Vec<Knot>,
        moves: &mut Vec<PlannedMove>,
    ) -> Result<(), TrajectoryError> {
        let before = (knots.len(), moves.len());
        for _ in 0..ROUNDS {
            self.write(now, knots, moves);
            let slowing = slowing(&knots[before.0..], arm)?;
            if slowing <= 1.0 + ROUNDING {
                break;
            }
            self.stretch *= slowing * (1.0 + f64::EPSILON);
            knots.truncate(before.0);
            moves.truncate(before.1);
        }
        if knots.len() == before.0 {
            self.write(now, knots, moves);
        }
        Ok(())
    }

    /// Parameter and its derivatives at a time of this route.
    fn progress(&self, t: f64) -> [f64; 4] {
        let (at, stretch) = (self.law.at(t / self.stretch), self.stretch);
        [at.s, at.v / stretch, at.a / (stretch * stretch), at.j / stretch.powi(3)]
    }

    /// Time at which the route reaches `s`.
    fn time_of(&self, s: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.duration());
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if self.progress(middle)[0] < s { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Appends the knots of this route, which begins at `now`, and the results of its moves.
    pub(crate) fn write(&self, now: f64, knots: &mut Vec<Knot>, moves: &mut Vec<PlannedMove>) {
        let stations = &self.route.stations;
        let pieces = &self.route.pieces;
        // Stations where the second derivative may jump, with their times.
        let seams: Vec<(f64, usize)> = pieces[..pieces.len() - 1]
            .iter()
            .map(|piece| (self.time_of(stations[piece.stations[1]].s), piece.stations[1]))
            .collect();
        // Times of the knots of the law and of the seams; a knot at a seam has two accelerations.
        let end = self.duration();
        let mut times = self.knot_times(&seams, end);
        times.push((end, None));

        let knot = |&(t, seam): &(f64, Option<usize>)| match seam {
            Some(station) => self.knot_at(t, station),
            None if t == end => Knot::rest(end, &stations[stations.len() - 1].q),
            None => self.knot(t),
        };
        let mut last = Knot::rest(0.0, &stations[0].q);
        push(knots, now, last.clone());
        // Each quintic spans as many intervals of the law as it can represent, but never a seam.
        let (mut k, mut stride) = (0, 1);
        while k < times.len() {
            let seam = times[k..].iter().position(|(_, seam)| seam.is_some()).unwrap_or(times.len() - 1 - k);
            let skip = (stride - 1).min(seam).min(times.len() - 1 - k);
            let next = knot(&times[k + skip]);
            if skip > 0 && !self.fits(&last, &next) {
                stride = skip.div_ceil(2);
                continue;
            }
            if skip == 0 {
                self.refine(&last, &next, HALVINGS, now, knots);
            }
            push(knots, now, next.clone());
            last = next;
            k += skip + 1;
            stride = (2 * stride).min(MAX_INTERVALS);
        }
        let by_leg = self.pieces_by_leg();
        moves.extend((0..self.route.legs.len()).map(|leg| self.planned(leg, &by_leg, now)));
    }

    /// Times of the law's knots between start and end, and of seams with their stations; ascending.
    fn knot_times(&self, seams: &[(f64, usize)], end: f64) -> Vec<(f64, Option<usize>)> {
        let mut times: Vec<(f64, Option<usize>)> = self.law.knots().iter().map(|t| (t * self.stretch, None)).collect();
        times.extend(seams.iter().map(|(t, station)| (*t, Some(*station))));
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        times.retain(|(t, _)| *t > SAME_TIME && *t < end - SAME_TIME);
        // Of two coincident times the seam is kept.
        times.dedup_by(|b, a| {
            let same = b.0 - a.0 < SAME_TIME && (a.1.is_none() || b.1.is_none());
            if same && b.1.is_some() {
                *a = *b;
            }
            same
        });
        times
    }

    /// Whether one quintic over time follows the path between two knots.
    fn fits(&self, a: &Knot, b: &Knot) -> bool {
        let h = b.t - a.t;
        let at = |part: &f64| a.towards(b, part * h);
        let near = |part: &f64| (&at(part).0.q - &self.knot(a.t + part * h).q).amax() <= KEPT;
        [0.5, 0.25, 0.75, 0.1, 0.9].iter().all(near)
            && (!self.bounds_jerks() || JERKS_AT.iter().all(|part| self.keeps_jerk(a.t + part * h, &at(part).1)))
    }

    /// First piece of each leg that is not a blend, and the blend at its end.
    fn pieces_by_leg(&self) -> Vec<[Option<usize>; 2]> {
        let mut found = vec![[None, None]; self.route.legs.len()];
        for (k, piece) in self.route.pieces.iter().enumerate() {
            found[piece.leg][usize::from(piece.is_blend)] = Some(k);
        }
        found
    }

    /// Inserts knots between two others until the quintics over time follow the path.
    fn refine(&self, a: &Knot, b: &Knot, depth: usize, now: f64, knots: &mut Vec<Knot>) {
        let middle = 0.5 * (a.t + b.t);
        if depth == 0 || b.t - a.t < 4.0 * SAME_TIME {
            return;
        }
        let (guess, truth) = (a.towards(b, middle - a.t).0, self.knot(middle));
        if (&guess.q - &truth.q).amax() <= KEPT && (!self.bounds_jerks() || self.fits(a, b)) {
            return;
        }
        self.refine(a, &truth, depth - 1, now, knots);
        push(knots, now, truth.clone());
        self.refine(&truth, b, depth - 1, now, knots);
    }

    fn knot(&self, t: f64) -> Knot {
        let [s, v, a, _] = self.progress(t);
        let (jet, _) = self.joints(s);
        let acceleration = &jet.dd * (v * v) + &jet.d * a;
        Knot { t, q: jet.q, v: jet.d * v, before: acceleration.clone(), after: acceleration }
    }

    /// The knot at a station between two pieces.
    fn knot_at(&self, t: f64, station: usize) -> Knot {
        let [_, v, a, _] = self.progress(t);
        let Station { q, d, before, after, .. } = &self.route.stations[station];
        let acceleration = |dd: &DVector<f64>| dd * (v * v) + d * a;
        Knot { t, q: q.clone(), v: d * v, before: acceleration(before), after: acceleration(after) }
    }

    /// Joints at a parameter, with their third derivative.
    fn joints(&self, s: f64) -> (JointJet, DVector<f64>) {
        let stations = &self.route.stations;
        let last = stations.len() - 1;
        let k = stations.partition_point(|station| station.s <= s).clamp(1, last) - 1;
        self.route.joints(k, s)
    }

    /// Joint jerks at a given time.
    fn jerks(&self, t: f64) -> DVector<f64> {
        let [s, v, a, j] = self.progress(t);
        let (jet, ddd) = self.joints(s);
        ddd * v.powi(3) + jet.dd * (3.0 * v * a) + jet.d * j
    }

    fn bounds_jerks(&self) -> bool {
        matches!(self.law, Timing::Bounded(_))
    }

    /// Whether the jerks of a quintic over time agree with those along the path at a given time, if
    /// they are bounded.
    fn keeps_jerk(&self, t: f64, jerk: &DVector<f64>) -> bool {
        let Timing::Bounded(bounded) = &self.law else { return true };
        let truth = self.jerks(t);
        let near = |k: usize| (truth[k] - jerk[k]).abs() <= JERK_KEPT * bounded.jerks[k];
        (0..truth.len()).all(near)
    }

    /// Result of a leg.
    fn planned(&self, leg: usize, by_leg: &[[Option<usize>; 2]], now: f64) -> PlannedMove {
        let route = self.route;
        let span = self.span(leg, by_leg);
        let leg_move = &route.legs[leg].of;
        // The piece of the leg, or its blend if the blends leave nothing of it.
        let own = by_leg[leg][0].or(by_leg[leg][1]).map(|k| &route.pieces[k]);
        let (mut top, mut slowed): (Option<f64>, Option<Slowed>) = (None, None);
        let least_sigma = own.and_then(|piece| piece.least_sigma);
        if self.bounds_jerks() {
            slowed = self.slowest(leg, by_leg).map(|slow| Slowed { time_s: now + slow.time_s, ..slow });
        }
        // Top speed of the tool, and the station that a limit slows most.
        for (tool, k) in own.iter().flat_map(|piece| piece.tool.iter().zip(piece.stations[0]..)) {
            let t = self.time_of_station(k);
            let speed = tool.V.fixed_rows::<3>(0).norm() * self.progress(t)[1];
            top = Some(top.map_or(speed, |top: f64| top.max(speed)));
            if let Some((part, by)) = self.part(k, t)
                && slowed.as_ref().is_none_or(|slowed| part < slowed.part)
            {
                slowed = Some(Slowed { time_s: now + t, part, by });
            }
        }
        PlannedMove {
            place: leg_move.place.clone(),
            statement: leg_move.statement.clone(),
            span_s: span.map(|t| now + t),
            top_m_s: top,
            programmed_m_s: leg_move.speed.linear_m_s,
            slowed,
            least_sigma: least_sigma.map(|(sigma, s)| (sigma, now + self.time_of(s))),
            blend_m: route.blends[leg],
        }
    }

    /// Slowest place of a leg, or of the blend after it, relative to the programmed speed, with
    /// bounded jerks.
    fn slowest(&self, leg: usize, by_leg: &[[Option<usize>; 2]]) -> Option<Slowed> {
        let pieces = by_leg[leg].iter().flatten().map(|k| &self.route.pieces[*k]);
        let along =
            pieces.filter(|piece| !piece.tool.is_empty()).flat_map(|piece| piece.stations[0]..=piece.stations[1]);
        let inner = along.filter(|k| *k > 0 && k + 1 < self.route.stations.len());
        let slowed = inner.filter_map(|k| {
            let time_s = self.time_of_station(k);
            let by = self.part(k, time_s).map(|(_, by)| by).or_else(|| self.least_by_jerk(k))?;
            let part = self.progress(time_s)[1] / self.programmed[k].sqrt();
            (part < 1.0 - AT_LIMIT).then_some(Slowed { time_s, part, by })
        });
        slowed.min_by(|a, b| a.part.total_cmp(&b.part))
    }

    /// Joint whose jerk makes a station slower than its neighbours.
    fn least_by_jerk(&self, k: usize) -> Option<SlowedBy> {
        let Timing::Bounded(bounded) = &self.law else { return None };
        // The speed has a minimum here, and a jerk near its bound acts around it.
        let [before, t, after] = [k - 1, k, k + 1].map(|k| self.time_of_station(k));
        let [left, v, right] = [before, t, after].map(|t| self.progress(t)[1]);
        if v > left.min(right) {
            return None;
        }
        let (mut most, mut by) = (AT_JERK, None);
        for i in 0..=8 {
            let jerks = self.jerks(before + (after - before) * f64::from(i) / 8.0);
            for (joint, jerk) in jerks.iter().enumerate() {
                let ratio = (jerk / bounded.jerks[joint]).abs();
                if ratio > most {
                    (most, by) = (ratio, bounded.given[joint].as_ref());
                }
            }
        }
        by.map(|name| SlowedBy::JointJerk(name.clone()))
    }

    /// Start and end time of a leg, including half of the blends.
    fn span(&self, leg: usize, by_leg: &[[Option<usize>; 2]]) -> [f64; 2] {
        let ends = |k: usize| self.route.pieces[k].stations.map(|k| self.route.stations[k].s);
        let middle = |k: usize| {
            let [a, b] = ends(k);
            self.time_of(0.5 * (a + b))
        };
        let own = by_leg[leg][0].map(|k| ends(k).map(|s| self.time_of(s)));
        let start = leg.checked_sub(1).and_then(|before| by_leg[before][1]).map(middle);
        let end = by_leg[leg][1].map(middle);
        let own = own.unwrap_or([start.unwrap_or(0.0), end.unwrap_or(0.0)]);
        [start.unwrap_or(own[0]), end.unwrap_or(own[1])]
    }

    fn time_of_station(&self, k: usize) -> f64 {
        self.time_of(self.route.stations[k].s)
    }

    /// Fraction of the programmed speed that a limit of the robot allows at a station, if the speed
    /// is at that limit.
    fn part(&self, k: usize, t: f64) -> Option<(f64, SlowedBy)> {
        let cap = self.caps[k].as_ref()?;
        let programmed = self.programmed[k];
        if cap.x >= programmed * (1.0 - AT_LIMIT) || programmed == f64::INFINITY {
            return None;
        }
        let v = self.progress(t)[1];
        (v * v > cap.x * (1.0 - 4.0 * AT_LIMIT)).then(|| ((cap.x / programmed).sqrt(), cap.by.clone()))
    }
}

/// Factor by which the quintics through the knots must be slower to keep the velocity and
/// acceleration limits of the joints; 1 if they do.
fn slowing(knots: &[Knot], arm: &ProgramArm<'_>) -> Result<f64, TrajectoryError> {
    let peaks = through(arm.model, knots)?.peak();
    let ratio = |(peak, bounds): (&JointPeak, &JointBounds)| {
        let speed = peak.velocity.value.abs() / bounds.velocity;
        speed.max((peak.acceleration.value.abs() / bounds.acceleration).sqrt())
    };
    Ok(peaks.iter().zip(&arm.bounds).map(ratio).fold(1.0, f64::max))
}

fn push(knots: &mut Vec<Knot>, now: f64, knot: Knot) {
    knots.push(Knot { t: now + knot.t, ..knot });
}
