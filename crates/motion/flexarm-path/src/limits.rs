//! Bounds at the stations of a route: joint limits, torques and tool limits, and which of them
//! slows a move.
//!
//! Start at `Limits::at_stations`. Bounds are on the square of the speed along the path parameter,
//! and on its derivatives. Not here: the speed itself (`schedule.rs`, and the time laws of
//! `flexarm-trajectory`).

use flexarm_kinematics::{Data, State, inverse_dynamics};
use flexarm_trajectory::jerk_law::{JerkBound, PathBounds};
use flexarm_trajectory::time_law::{Bound, Law, PathPoint};
use nalgebra::{DVector, Vector3, Vector6};

use crate::arm::{JointBounds, ProgramArm};
use crate::curve::ToolJet;
use crate::planned::SlowedBy;
use crate::route::{Piece, Route, Station};

/// Number of points along a route with few stations, and minimum and maximum number of parts per
/// station.
const POINTS: usize = 2000;
const MIN_PARTS: usize = 2;
const MAX_PARTS: usize = 8;
/// Fractions of the time between two knots of a law at which its limits are checked.
const CHECKED: [f64; 4] = [0.0, 0.25, 0.5, 0.75];
/// A limit is near above this fraction of it, in squared speeds.
const NEAR: f64 = 0.98;

/// Tightest limit of the robot at a station (not of the program), with the maximum squared speed.
#[derive(Debug, Clone)]
pub(crate) struct Cap {
    pub(crate) x: f64,
    pub(crate) by: SlowedBy,
}

/// Bounds of all stations, programmed speeds, and the tightest limits of the robot.
pub(crate) struct LimitedPath {
    pub(crate) points: Vec<PathPoint>,
    pub(crate) programmed: Vec<f64>,
    pub(crate) caps: Vec<Option<Cap>>,
}

/// Evaluates the limits at places of a route.
pub(crate) struct Limits<'a> {
    route: &'a Route,
    arm: &'a ProgramArm<'a>,
    torques: Option<Torques>,
    /// Rise time of the acceleration of joints without a given jerk limit (s); `None`: jerks are
    /// not evaluated.
    rise: Option<f64>,
}

/// Joints and tool at a place, with derivatives by the parameter.
struct PathState<'a> {
    q: &'a DVector<f64>,
    d: &'a DVector<f64>,
    dd: &'a DVector<f64>,
    /// Third derivative; `None` where jerks are not evaluated.
    ddd: Option<DVector<f64>>,
    tool: Option<[Vector6<f64>; 2]>,
    travel: Option<f64>,
}

impl<'a> Limits<'a> {
    pub(crate) fn new(route: &'a Route, arm: &'a ProgramArm<'a>, rise: Option<f64>) -> Self {
        let torques = arm.bounds.iter().any(|bound| bound.torque.is_some()).then(|| Torques::new(arm));
        Self { route, arm, torques, rise }
    }

    /// Bounds at all stations; a station between two pieces has the bounds of both.
    pub(crate) fn at_stations(&mut self) -> LimitedPath {
        let route = self.route;
        let n = route.stations.len();
        let mut points: Vec<PathPoint> = route
            .stations
            .iter()
            .map(|station| PathPoint { s: station.s, x_max: f64::INFINITY, bounds: Vec::new() })
            .collect();
        let mut programmed = vec![f64::INFINITY; n];
        let mut caps: Vec<Option<Cap>> = vec![None; n];
        let mut jerks = Vec::new();
        for piece in &route.pieces {
            let [first, last] = piece.stations;
            for k in first..=last {
                let Station { s, q, d, before, after } = &route.stations[k];
                // Second and third derivatives jump at a station: take those of the piece.
                let dd = if k == first { after } else { before };
                let ddd = self.rise.map(|_| route.joints(if k == first { k } else { k - 1 }, *s).1);
                let tool = piece.tool.get(k - first).map(|tool| [tool.V, tool.A]);
                let there = PathState { q, d, dd, ddd, tool, travel: piece.travel.get(k - first).copied() };
                let point = &mut points[k];
                let mut at = AtStation { point, programmed: &mut programmed[k], cap: &mut caps[k], jerks: &mut jerks };
                self.collect(piece, &there, &mut at);
            }
        }
        LimitedPath { points, programmed, caps }
    }

    /// Adds points between the stations, so that short routes have many.
    pub(crate) fn divided(&mut self, stations: &[PathPoint]) -> Vec<PathPoint> {
        let parts = (POINTS / stations.len()).clamp(MIN_PARTS, MAX_PARTS);
        let mut points = Vec::with_capacity(parts * stations.len());
        for (k, pair) in stations.windows(2).enumerate() {
            points.push(pair[0].clone());
            for i in 1..parts {
                let s = pair[0].s + (pair[1].s - pair[0].s) * i as f64 / parts as f64;
                let PathBounds { x_max, bounds, .. } = self.at(k, s);
                points.push(PathPoint { s, x_max, bounds });
            }
        }
        points.extend(stations.last().cloned());
        points
    }

    /// Returns the factor by which a law must be slower to keep all limits at its knots and between
    /// them; at least 1.
    ///
    /// * `points`: bounds along the route. Where adjacent ones are almost equal, or far from being
    ///   reached, the limits between them are not evaluated.
    pub(crate) fn slowing(&mut self, law: &Law, points: &[PathPoint]) -> f64 {
        let stations: Vec<f64> = self.route.stations.iter().map(|station| station.s).collect();
        let mut most: f64 = 1.0;
        for pair in law.knots().windows(2) {
            for part in CHECKED {
                let at = law.at(pair[0] + part * (pair[1] - pair[0]));
                let k = points.partition_point(|point| point.s <= at.s).clamp(1, points.len() - 1) - 1;
                let (here, next) = (&points[k], &points[k + 1]);
                let near = PathPoint::passed(here, next, (at.s - here.s) / (next.s - here.s), at.v * at.v, at.a);
                let is_even = here.x_max == next.x_max && near <= at.v * at.v / here.x_max;
                let slowing = if near < NEAR || is_even {
                    near.sqrt()
                } else {
                    let k = stations.partition_point(|s| *s <= at.s).clamp(1, stations.len() - 1) - 1;
                    self.at(k, at.s).slowing(&at)[0]
                };
                most = most.max(slowing);
            }
        }
        most
    }

    /// Bounds at a parameter of the interval between station `k` and the next.
    pub(crate) fn at(&mut self, k: usize, s: f64) -> PathBounds {
        let piece = &self.route.pieces[self.route.pieces.partition_point(|piece| piece.stations[1] <= k)];
        let (jet, ddd) = self.route.joints(k, s);
        let [a, b] = [k, k + 1].map(|k| self.route.stations[k].s);
        let first = piece.stations[0];
        let tool =
            (!piece.tool.is_empty()).then(|| cubic(&piece.tool[k - first], &piece.tool[k + 1 - first], b - a, s - a));
        let travel = piece.travel.get(k - first).zip(piece.travel.get(k + 1 - first));
        let travel = travel.map(|(from, to)| from + (to - from) * (s - a) / (b - a));
        let there = PathState { q: &jet.q, d: &jet.d, dd: &jet.dd, ddd: Some(ddd), tool, travel };
        let mut point = PathPoint { s, x_max: f64::INFINITY, bounds: Vec::new() };
        let (mut programmed, mut cap, mut jerks) = (f64::INFINITY, None, Vec::new());
        let mut at = AtStation { point: &mut point, programmed: &mut programmed, cap: &mut cap, jerks: &mut jerks };
        self.collect(piece, &there, &mut at);
        PathBounds { x_max: point.x_max, bounds: point.bounds, jerks }
    }

    /// Adds the bounds of joints, tool and torques at a station.
    fn collect(&mut self, piece: &Piece, there: &PathState<'_>, at: &mut AtStation<'_>) {
        for (joint, bounds) in self.arm.bounds.iter().enumerate() {
            let name = || self.arm.model.coordinates()[joint].joint.clone();
            at.joint(there.d[joint], there.dd[joint], bounds, piece, &name);
            if let (Some(ddd), Some(rise)) = (&there.ddd, self.rise) {
                at.jerk([there.d[joint], there.dd[joint], ddd[joint]], bounds, rise, &name);
            }
        }
        // Tool: speeds and accelerations, and the jerk along the path.
        if let Some([V, A]) = &there.tool {
            at.tool(V, A, piece);
            let most = self.rise.and_then(|rise| {
                piece.speed.linear_m_s3.or_else(|| piece.speed.linear_m_s2.map(|acceleration| acceleration / rise))
            });
            if let Some(most) = most {
                at.jerks.push(JerkBound { a: 1.0, b: 0.0, c: 0.0, most });
            }
        }
        if let (Some(travel), Some(most)) = (there.travel, piece.speed.linear_m_s) {
            at.program((most / travel.max(1e-12)).powi(2));
        }
        if let Some(torques) = &mut self.torques {
            torques.add(self.arm, there, at);
        }
    }
}

/// Bounds collected at one station.
struct AtStation<'a> {
    point: &'a mut PathPoint,
    programmed: &'a mut f64,
    cap: &'a mut Option<Cap>,
    jerks: &'a mut Vec<JerkBound>,
}

impl AtStation<'_> {
    /// The robot allows a squared speed of at most `x`.
    fn limit(&mut self, x: f64, by: impl FnOnce() -> SlowedBy) {
        if x.is_finite() && self.cap.as_ref().is_none_or(|cap| x < cap.x) {
            *self.cap = Some(Cap { x, by: by() });
        }
        self.point.x_max = self.point.x_max.min(x);
    }

    /// The program allows a squared speed of at most `x`.
    fn program(&mut self, x: f64) {
        *self.programmed = self.programmed.min(x);
        self.point.x_max = self.point.x_max.min(x);
    }

    /// Bounds of a joint with `q' = d`, `q'' = dd`: speed, and acceleration `d s̈ + dd ṡ²`.
    fn joint(&mut self, d: f64, dd: f64, bounds: &JointBounds, piece: &Piece, name: &dyn Fn() -> String) {
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

    /// Adds the jerk bound of a joint, from its derivatives by the parameter.
    fn jerk(&mut self, [d, dd, ddd]: [f64; 3], bounds: &JointBounds, rise: f64, name: &dyn Fn() -> String) {
        let most = bounds.jerk.unwrap_or(bounds.acceleration / rise);
        if (d == 0.0 && dd == 0.0 && ddd == 0.0) || !most.is_finite() {
            return;
        }
        self.jerks.push(JerkBound { a: d, b: 3.0 * dd, c: ddd, most });
        // Recorded as a cap at constant speed.
        let x = (most / ddd.abs()).powf(2.0 / 3.0);
        if bounds.jerk.is_some() && x.is_finite() && self.cap.as_ref().is_none_or(|cap| x < cap.x) {
            *self.cap = Some(Cap { x, by: SlowedBy::JointJerk(name()) });
        }
    }

    /// Bounds of the TCP: programmed speeds, and accelerations along the path.
    fn tool(&mut self, V: &Vector6<f64>, A: &Vector6<f64>, piece: &Piece) {
        let speed = &piece.speed;
        let three = |six: &Vector6<f64>, row: usize| Vector3::new(six[row], six[row + 1], six[row + 2]);
        let (v, w, dv, dw) = (three(V, 0), three(V, 3), three(A, 0), three(A, 3));
        // The list of bounds must have the same length at all stations of a piece.
        let along = |v: &Vector3<f64>, dv: &Vector3<f64>, most: f64| match v.norm() {
            norm if norm > 1e-9 => Bound { a: norm, b: v.dot(dv) / norm, low: -most, high: most },
            _ => Bound { a: 0.0, b: 0.0, low: -most, high: most },
        };
        self.point.bounds.extend(speed.linear_m_s2.map(|most| along(&v, &dv, most)));
        self.point.bounds.extend(speed.angular_rad_s2.map(|most| along(&w, &dw, most)));
        if v.norm() > 1e-9 {
            if let Some(most) = speed.linear_m_s {
                self.program((most / v.norm()).powi(2));
            }
            if let Some(most) = speed.linear_m_s2 {
                let across = (dv - v * (v.dot(&dv) / v.norm_squared())).norm();
                if across > 0.0 {
                    self.limit(most / across, || SlowedBy::PathAcceleration);
                }
            }
        }
        if let Some(most) = speed.angular_rad_s.filter(|_| w.norm() > 1e-9) {
            let x = (most / w.norm()).powi(2);
            // Where the tool also travels, its rotation slows the path; where it only turns, the
            // rotation speed is the programmed speed.
            if v.norm() > 1e-9 && speed.linear_m_s.is_some() {
                self.limit(x, || SlowedBy::Turning);
            } else {
                self.program(x);
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

    fn add(&mut self, arm: &ProgramArm<'_>, there: &PathState<'_>, at: &mut AtStation<'_>) {
        self.state.q.copy_from(there.q);
        self.state.qdot.fill(0.0);
        let weight = inverse_dynamics(arm.model, &mut self.data, &self.state, &self.zero).clone();
        let a = inverse_dynamics(arm.model, &mut self.data, &self.state, there.d) - &weight;
        self.state.qdot.copy_from(there.d);
        let b = inverse_dynamics(arm.model, &mut self.data, &self.state, there.dd) - &weight;
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

/// Derivatives of the tool pose at `s` of an interval of length `h`: the cubic through those at its
/// ends.
fn cubic(from: &ToolJet, to: &ToolJet, h: f64, s: f64) -> [Vector6<f64>; 2] {
    let (step, z) = ((to.V - from.V) / h, s / h);
    let c2 = step * 3.0 - from.A * 2.0 - to.A;
    let c3 = from.A + to.A - step * 2.0;
    [from.V + (from.A + (c2 + c3 * z) * z) * s, from.A + (c2 * 2.0 + c3 * (3.0 * z)) * z]
}
