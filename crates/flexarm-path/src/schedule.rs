//! A route over time: bounds at its stations, the time law, smoothing, and the knots of the joints' curves.

use flexarm_kinematics::{Data, State, inverse_dynamics};
use nalgebra::{DVector, Vector6};

use crate::follow::JointJet;
use crate::plan::{JointBounds, PathError, PathOptions, PlannedMove, ProgramArm, Slowed, SlowedBy};
use crate::route::{Piece, Route, Station, between};
use crate::time_law::{Bound, Law, LawError, PathPoint, least_time};

/// Limits count as kept up to this part.
const SLACK: f64 = 1e-3;
/// Attempts to bring an averaged law below its limits by local slowing, before all of it is slowed.
const ATTEMPTS: usize = 12;
/// A place is slowed by a limit where its speed is within this part of it.
const AT_LIMIT: f64 = 0.02;
/// Knots nearer than this are one, s.
const SAME_TIME: f64 = 1e-6;
/// Joints over time keep to those along the path within this, rad or m.
const KEPT: f64 = 1e-10;
/// Most intervals of the law between two knots.
const MOST_INTERVALS: usize = 64;
/// Most halvings between two knots.
const HALVINGS: usize = 10;
/// Widest jerk window that is tried, as a multiple of the one asked for.
const WIDEST: f64 = 200.0;

/// Joints at a moment.
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
    /// At rest.
    pub(crate) fn rest(t: f64, q: &DVector<f64>) -> Self {
        let zero = DVector::zeros(q.len());
        Self { t, q: q.clone(), v: zero.clone(), before: zero.clone(), after: zero }
    }
}

/// What limits the speed at a station beyond the program, with the greatest squared speed.
#[derive(Debug, Clone)]
struct Cap {
    x: f64,
    by: SlowedBy,
}

/// A route with its time law.
pub(crate) struct Schedule<'r> {
    route: &'r Route,
    law: Law,
    /// All times are multiplied by this.
    stretch: f64,
    /// Programmed squared speed and the tightest limit of the robot, by station.
    programmed: Vec<f64>,
    caps: Vec<Option<Cap>>,
}

impl<'r> Schedule<'r> {
    pub(crate) fn new(route: &'r Route, arm: &ProgramArm<'_>, options: &PathOptions) -> Result<Self, PathError> {
        let fail = |why: String| {
            let of = &route.legs[0].of;
            PathError::Law { line: of.line, statement: of.statement.clone(), why }
        };
        if !(options.rise_s > 0.0 && options.rise_s.is_finite()) {
            return Err(fail(format!("accelerations rise in {} s: give a positive time", options.rise_s)));
        }
        let Limited { points, programmed, caps } = limited(route, arm);
        let law = kept(&points, route, options.rise_s).map_err(|error| match error {
            LawError::Infeasible(k) => {
                let s = points[k].s;
                fail(format!(
                    "no speed keeps all limits {s:.4} m behind the last stop: does a joint's torque suffice there?"
                ))
            }
            error @ LawError::Points(_) => fail(error.to_string()),
        })?;
        let mut schedule = Self { route, law: law.0, stretch: law.1, programmed, caps };
        schedule.stretch *= schedule.told_duration(&fail)?;
        Ok(schedule)
    }

    /// By how much the run must be slower for the durations that the program tells.
    fn told_duration(&self, fail: &dyn Fn(String) -> PathError) -> Result<f64, PathError> {
        let told: Vec<f64> = self.route.legs.iter().filter_map(|leg| leg.of.speed.duration_s).collect();
        if told.is_empty() {
            return Ok(1.0);
        }
        if told.len() < self.route.legs.len() {
            return Err(fail(
                "some moves between two stops have a duration and some have not: give all or none".to_owned(),
            ));
        }
        let (wanted, least) = (told.iter().sum::<f64>(), self.duration());
        if wanted < least * (1.0 - SLACK) {
            let why = format!(
                "a duration of {wanted} s is told, the limits of the robot and the rise of its accelerations ask for {least:.4} s or more"
            );
            return Err(fail(why));
        }
        Ok((wanted / least).max(1.0))
    }

    pub(crate) fn duration(&self) -> f64 {
        self.law.duration() * self.stretch
    }

    /// Parameter with derivatives at a time of this route.
    fn progress(&self, t: f64) -> [f64; 3] {
        let at = self.law.at(t / self.stretch);
        [at.s, at.v / self.stretch, at.a / (self.stretch * self.stretch)]
    }

    /// Time at which the run is at `s`.
    fn time_of(&self, s: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.duration());
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if self.progress(middle)[0] < s { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Appends the knots of this route, which begins at `now`, and what became of its moves.
    pub(crate) fn write(&self, now: f64, knots: &mut Vec<Knot>, moves: &mut Vec<PlannedMove>) {
        let stations = &self.route.stations;
        let pieces = &self.route.pieces;
        // Places where the second derivative may jump, with their times.
        let seams: Vec<(f64, usize)> = pieces[..pieces.len() - 1]
            .iter()
            .map(|piece| (self.time_of(stations[piece.stations[1]].s), piece.stations[1]))
            .collect();
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
        // As many intervals of the law as one quintic can hold; never across a seam.
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
            stride = (2 * stride).min(MOST_INTERVALS);
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
        // Of two that are one, the seam stays.
        times.dedup_by(|b, a| {
            let same = b.0 - a.0 < SAME_TIME && (a.1.is_none() || b.1.is_none());
            if same && b.1.is_some() {
                *a = *b;
            }
            same
        });
        times
    }

    /// Does one quintic over time keep to the path between two knots?
    fn fits(&self, a: &Knot, b: &Knot) -> bool {
        let from = JointJet { q: a.q.clone(), d: a.v.clone(), dd: a.after.clone() };
        let to = JointJet { q: b.q.clone(), d: b.v.clone(), dd: b.before.clone() };
        let h = b.t - a.t;
        [0.5, 0.25, 0.75, 0.1, 0.9].iter().all(|part| {
            let guess = between(&from, &to, h, part * h).0;
            (&guess.q - &self.knot(a.t + part * h).q).amax() <= KEPT
        })
    }

    /// The first piece of each leg that is no blend, and the blend at its end.
    fn pieces_by_leg(&self) -> Vec<[Option<usize>; 2]> {
        let mut found = vec![[None, None]; self.route.legs.len()];
        for (k, piece) in self.route.pieces.iter().enumerate() {
            found[piece.leg][usize::from(piece.is_blend)] = Some(k);
        }
        found
    }

    /// Knots between two until the quintics over time keep to the path.
    fn refine(&self, a: &Knot, b: &Knot, depth: usize, now: f64, knots: &mut Vec<Knot>) {
        let middle = 0.5 * (a.t + b.t);
        if depth == 0 || b.t - a.t < 4.0 * SAME_TIME {
            return;
        }
        let from = JointJet { q: a.q.clone(), d: a.v.clone(), dd: a.after.clone() };
        let to = JointJet { q: b.q.clone(), d: b.v.clone(), dd: b.before.clone() };
        let guess = between(&from, &to, b.t - a.t, middle - a.t).0;
        let truth = self.knot(middle);
        if (&guess.q - &truth.q).amax() <= KEPT {
            return;
        }
        self.refine(a, &truth, depth - 1, now, knots);
        push(knots, now, truth.clone());
        self.refine(&truth, b, depth - 1, now, knots);
    }

    fn knot(&self, t: f64) -> Knot {
        let [s, v, a] = self.progress(t);
        let (jet, _) = self.joints(s);
        let acceleration = &jet.dd * (v * v) + &jet.d * a;
        Knot { t, q: jet.q, v: jet.d * v, before: acceleration.clone(), after: acceleration }
    }

    /// The knot at a station between two pieces.
    fn knot_at(&self, t: f64, station: usize) -> Knot {
        let [_, v, a] = self.progress(t);
        let Station { q, d, before, after, .. } = &self.route.stations[station];
        let acceleration = |dd: &DVector<f64>| dd * (v * v) + d * a;
        Knot { t, q: q.clone(), v: d * v, before: acceleration(before), after: acceleration(after) }
    }

    /// Joints at a parameter, with their third derivative.
    fn joints(&self, s: f64) -> (JointJet, DVector<f64>) {
        let stations = &self.route.stations;
        let last = stations.len() - 1;
        let k = stations.partition_point(|station| station.s <= s).clamp(1, last) - 1;
        let (a, b) = (&stations[k], &stations[k + 1]);
        let from = JointJet { q: a.q.clone(), d: a.d.clone(), dd: a.after.clone() };
        let to = JointJet { q: b.q.clone(), d: b.d.clone(), dd: b.before.clone() };
        let h = b.s - a.s;
        between(&from, &to, h, (s - a.s).clamp(0.0, h))
    }

    /// What became of a leg.
    fn planned(&self, leg: usize, by_leg: &[[Option<usize>; 2]], now: f64) -> PlannedMove {
        let route = self.route;
        let span = self.span(leg, by_leg);
        let of = &route.legs[leg].of;
        // Of a leg that its blends leave nothing of, the blend.
        let own = by_leg[leg][0].or(by_leg[leg][1]).map(|k| &route.pieces[k]);
        let (mut top, mut slowed): (Option<f64>, Option<Slowed>) = (None, None);
        let least_sigma = own.and_then(|piece| piece.least_sigma);
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
            line: of.line,
            statement: of.statement.clone(),
            span_s: span.map(|t| now + t),
            top_m_s: top,
            programmed_m_s: of.speed.linear_m_s,
            slowed,
            least_sigma: least_sigma.map(|(sigma, s)| (sigma, now + self.time_of(s))),
            blend_m: route.blends[leg],
        }
    }

    /// First and last moment of a leg, with half of the blends.
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

    /// Part of the programmed speed that a limit of the robot leaves at a station, where it is at that limit.
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

fn push(knots: &mut Vec<Knot>, now: f64, knot: Knot) {
    knots.push(Knot { t: now + knot.t, ..knot });
}

/// Bounds of all stations, what the program asks, and the tightest limit of the robot.
struct Limited {
    points: Vec<PathPoint>,
    programmed: Vec<f64>,
    caps: Vec<Option<Cap>>,
}

fn limited(route: &Route, arm: &ProgramArm<'_>) -> Limited {
    let n = route.stations.len();
    let mut points: Vec<PathPoint> = route
        .stations
        .iter()
        .map(|station| PathPoint { s: station.s, x_max: f64::INFINITY, bounds: Vec::new() })
        .collect();
    let mut programmed = vec![f64::INFINITY; n];
    let mut caps: Vec<Option<Cap>> = vec![None; n];
    let mut torques = arm.bounds.iter().any(|bound| bound.torque.is_some()).then(|| Torques::new(arm));
    for piece in &route.pieces {
        let [first, last] = piece.stations;
        for k in first..=last {
            let station = &route.stations[k];
            // A station between two pieces has the bounds of both.
            let dd = if k == first { &station.after } else { &station.before };
            let mut at = AtStation { point: &mut points[k], programmed: &mut programmed[k], cap: &mut caps[k] };
            for (joint, bounds) in arm.bounds.iter().enumerate() {
                let name = || arm.model.coordinates()[joint].joint.clone();
                at.joint(station.d[joint], dd[joint], bounds, piece, &name);
            }
            if let Some(tool) = piece.tool.get(k - first) {
                at.tool(&tool.V, &tool.A, piece);
            }
            if let (Some(travel), Some(most)) = (piece.travel.get(k - first), piece.speed.linear_m_s) {
                at.program((most / travel.max(1e-12)).powi(2));
            }
            if let Some(torques) = &mut torques {
                torques.add(arm, station, dd, &mut at);
            }
        }
    }
    Limited { points, programmed, caps }
}

/// What is collected at one station.
struct AtStation<'a> {
    point: &'a mut PathPoint,
    programmed: &'a mut f64,
    cap: &'a mut Option<Cap>,
}

impl AtStation<'_> {
    /// The robot allows `x` at most.
    fn limit(&mut self, x: f64, by: impl FnOnce() -> SlowedBy) {
        if x.is_finite() && self.cap.as_ref().is_none_or(|cap| x < cap.x) {
            *self.cap = Some(Cap { x, by: by() });
        }
        self.point.x_max = self.point.x_max.min(x);
    }

    /// The program allows `x` at most.
    fn program(&mut self, x: f64) {
        *self.programmed = self.programmed.min(x);
        self.point.x_max = self.point.x_max.min(x);
    }

    fn joint(&mut self, d: f64, dd: f64, bounds: &JointBounds, piece: &Piece, name: &dyn Fn() -> String) {
        if d == 0.0 && dd == 0.0 {
            return;
        }
        let speed = &piece.speed;
        let is_joint_move = piece.tool.is_empty();
        let part = |fraction: Option<f64>| if is_joint_move { fraction.unwrap_or(1.0).min(1.0) } else { 1.0 };
        let mut velocity = bounds.velocity * part(speed.joint_fraction);
        let mut acceleration = bounds.acceleration * speed.joint_acceleration_fraction.unwrap_or(1.0).min(1.0);
        if is_joint_move {
            velocity = velocity.min(speed.joint_rad_s.unwrap_or(f64::INFINITY));
            acceleration = acceleration.min(speed.joint_rad_s2.unwrap_or(f64::INFINITY));
        }
        self.limit((velocity / d).powi(2), || SlowedBy::JointSpeed(name()));
        if acceleration.is_finite() {
            self.point.bounds.push(Bound { a: d, b: dd, low: -acceleration, high: acceleration });
            if dd != 0.0 {
                // Recorded as a cap at constant speed; the law itself keeps the bound.
                let x = acceleration / dd.abs();
                if self.cap.as_ref().is_none_or(|cap| x < cap.x) {
                    *self.cap = Some(Cap { x, by: SlowedBy::JointAcceleration(name()) });
                }
            }
        }
    }

    fn tool(&mut self, V: &Vector6<f64>, A: &Vector6<f64>, piece: &Piece) {
        let speed = &piece.speed;
        let (v, w) = (V.fixed_rows::<3>(0), V.fixed_rows::<3>(3));
        let (dv, dw) = (A.fixed_rows::<3>(0), A.fixed_rows::<3>(3));
        if v.norm() > 1e-9 {
            if let Some(most) = speed.linear_m_s {
                self.program((most / v.norm()).powi(2));
            }
            if let Some(most) = speed.linear_m_s2 {
                let along = v.dot(&dv) / v.norm();
                self.point.bounds.push(Bound { a: v.norm(), b: along, low: -most, high: most });
                let across = (dv - v * (v.dot(&dv) / v.norm_squared())).norm();
                if across > 0.0 {
                    self.limit(most / across, || SlowedBy::PathAcceleration);
                }
            }
        }
        if w.norm() > 1e-9 {
            if let Some(most) = speed.angular_rad_s {
                let x = (most / w.norm()).powi(2);
                // Where the tool travels as well, turning slows the path; where it only turns, it is what was programmed.
                if v.norm() > 1e-9 && speed.linear_m_s.is_some() {
                    self.limit(x, || SlowedBy::Turning);
                } else {
                    self.program(x);
                }
            }
            if let Some(most) = speed.angular_rad_s2 {
                let along = w.dot(&dw) / w.norm();
                self.point.bounds.push(Bound { a: w.norm(), b: along, low: -most, high: most });
            }
        }
    }
}

/// Torques of the rigid arm as bounds: `M q' u + (M q'' + C q') x + g`.
struct Torques {
    data: Data,
    state: State,
    zero: DVector<f64>,
}

impl Torques {
    fn new(arm: &ProgramArm<'_>) -> Self {
        let model = arm.model;
        Self { data: Data::new(model), state: State::zeros(model), zero: DVector::zeros(model.nv()) }
    }

    fn add(&mut self, arm: &ProgramArm<'_>, station: &Station, dd: &DVector<f64>, at: &mut AtStation<'_>) {
        self.state.q.copy_from(&station.q);
        self.state.qdot.fill(0.0);
        let weight = inverse_dynamics(arm.model, &mut self.data, &self.state, &self.zero).clone();
        let a = inverse_dynamics(arm.model, &mut self.data, &self.state, &station.d) - &weight;
        self.state.qdot.copy_from(&station.d);
        let b = inverse_dynamics(arm.model, &mut self.data, &self.state, dd) - &weight;
        for (joint, bounds) in arm.bounds.iter().enumerate() {
            let Some(most) = bounds.torque else { continue };
            let bound = Bound { a: a[joint], b: b[joint], low: -most - weight[joint], high: most - weight[joint] };
            at.point.bounds.push(bound);
            let x = if bound.b > 0.0 { bound.high / bound.b } else { bound.low / bound.b };
            if bound.b != 0.0 && x >= 0.0 && at.cap.as_ref().is_none_or(|cap| x < cap.x) {
                let name = arm.model.coordinates()[joint].joint.clone();
                *at.cap = Some(Cap { x, by: SlowedBy::JointTorque(name) });
            }
        }
    }
}

/// A smoothed law that keeps all bounds, and by how much it must be slowed as a whole.
fn kept(points: &[PathPoint], route: &Route, rise: f64) -> Result<(Law, f64), LawError> {
    let mut points = points.to_vec();
    let limits: Vec<PathPoint> = points.clone();
    let s: Vec<f64> = points.iter().map(|point| point.s).collect();
    let mut window = rise;
    for _ in 0..ATTEMPTS {
        let x = least_time(&points)?;
        let law = Law::new(&s, &x).smoothed(window);
        let worst_jerk = path_jerk(&law, route);
        let excess = excesses(&law, &limits);
        let most = excess.iter().fold(1.0, |most: f64, (_, ratio)| most.max(*ratio));
        if worst_jerk <= 1.0 + SLACK && most <= 1.0 + SLACK {
            return Ok((law, 1.0));
        }
        if worst_jerk > 1.0 + SLACK && window < WIDEST * rise {
            window *= worst_jerk.min(4.0);
        }
        // Slower where the average took in faster neighbours.
        let times = Law::new(&s, &x);
        let mut slower = x.clone();
        for (t, ratio) in excess {
            let [from, to] = [t - window, t].map(|t| times.at(t).s);
            let first = s.partition_point(|s| *s < from).saturating_sub(1);
            let last = s.partition_point(|s| *s <= to).min(s.len() - 1);
            for k in first..=last {
                slower[k] = f64::min(slower[k], x[k] / (ratio * (1.0 + 0.2 * SLACK)));
            }
        }
        for (point, (slower, x)) in points.iter_mut().zip(slower.iter().zip(&x)) {
            if slower < x {
                point.x_max = point.x_max.min(*slower);
            }
        }
    }
    let x = least_time(&points)?;
    let law = Law::new(&s, &x).smoothed(window);
    let most = excesses(&law, &limits).iter().fold(path_jerk(&law, route).powf(2.0 / 3.0), |most, (_, r)| most.max(*r));
    Ok((law, most.max(1.0).sqrt()))
}

/// Moments at which an averaged law passes a limit, with the ratio by which squared speeds are too large.
fn excesses(law: &Law, limits: &[PathPoint]) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    let knots = law.knots();
    let middles = knots.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    for t in knots.iter().copied().chain(middles) {
        let at = law.at(t);
        let (x, u) = (at.v * at.v, at.a);
        let last = limits.len() - 1;
        let k = limits.partition_point(|point| point.s <= at.s).clamp(1, last) - 1;
        let ratio = |point: &PathPoint| {
            let by_bounds = point.bounds.iter().map(|bound| {
                let value = bound.a * u + bound.b * x;
                if value > 0.0 {
                    value / bound.high
                } else if value < 0.0 {
                    value / bound.low
                } else {
                    0.0
                }
            });
            by_bounds.fold(x / point.x_max, f64::max)
        };
        // Between two points the wider of the two bounds: at a step of the program both are right.
        let least = ratio(&limits[k]).min(ratio(&limits[k + 1]));
        if least > 1.0 + SLACK {
            found.push((t, least));
        }
    }
    found
}

/// Greatest jerk along the path of the tool over the programmed one; 0 where none is programmed.
fn path_jerk(law: &Law, route: &Route) -> f64 {
    let bounded: Vec<(f64, f64, f64)> = route
        .pieces
        .iter()
        .filter(|piece| !piece.tool.is_empty())
        .filter_map(|piece| {
            let [a, b] = piece.stations.map(|k| route.stations[k].s);
            Some((a, b, piece.speed.linear_m_s3?))
        })
        .collect();
    if bounded.is_empty() {
        return 0.0;
    }
    let ratio = |t: f64| {
        let at = law.at(t);
        let k = bounded.partition_point(|(_, b, _)| *b < at.s);
        bounded.get(k).filter(|(a, _, _)| at.s >= *a).map_or(0.0, |(_, _, most)| at.j.abs() / most)
    };
    law.knots().into_iter().map(ratio).fold(0.0, f64::max)
}
