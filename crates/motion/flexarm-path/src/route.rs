//! Routes from one stop to the next: legs joined by blends, with the joints at points along them.
//!
//! Start at [`Route::all`]. Legs are trimmed where a blend begins ([`blend_reach`]); each section
//! between seams is a [`Piece`], with [`Station`]s so close that quintics between them follow the
//! path. The parameter `s` runs from the start of the route, in m; derivatives of the joints are by
//! `s`. Not here: paths of single moves (`legs`), times along the route (`schedule`).

use flexarm_settings::{Finding, Place};
use flexarm_spatial::{Pose, rotation_vector};
use nalgebra::{DVector, Vector3};

use crate::arm::{PathOptions, tool_of};
use crate::curve::{TURN_LENGTH, ToolCurve, ToolJet};
use crate::follow::{Blocked, Follower, FrameCurve, GuidedJoint, JointJet, between};
use crate::legs::{Leg, LegPath, Legs, blocked_error};
use crate::program::{Blend, Speed};

/// Two legs join without a corner if their derivatives agree to this (m/m, rad/m).
const ALIGNED: f64 = 1e-6;
/// And without a curvature jump if their second derivatives agree to this (1/m, rad/m²).
const CURVED: f64 = 1e-6;
/// A corner reverses the path if the cosine between its tangents is below this (within 10 degrees).
const TURNED_BACK: f64 = -0.985;
/// Reason for a stop on a path without a corner.
const CURVATURE: &str = "the curvature of the path jumps, and joints with a bound of their jerk pass that only at rest";
/// Minimum length of a blend (m).
const SHORTEST_BLEND: f64 = 1e-7;
/// Deceleration assumed for a blend by speed if the program gives none (m/s²).
const BRAKING: f64 = 2.0;
/// Minimum number of intervals of a piece.
const MIN_INTERVALS: usize = 24;
/// Minimum number of intervals of a piece shorter than the spacing, of which milling programs have
/// many.
const MIN_OF_SHORT: usize = 6;
/// Maximum number of intervals before the path is refined.
const MAX_INTERVALS: usize = 4000;
/// Maximum number of halvings of an interval.
const HALVINGS: usize = 12;

/// A point of the route.
#[derive(Debug, Clone)]
pub(crate) struct Station {
    /// Parameter from the start of the route, m.
    pub(crate) s: f64,
    pub(crate) q: DVector<f64>,
    pub(crate) d: DVector<f64>,
    /// Second derivatives of the piece that ends here and of the one that begins here.
    pub(crate) before: DVector<f64>,
    pub(crate) after: DVector<f64>,
}

/// Section with one path and one set of speeds.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    /// Leg that it belongs to; a blend belongs to the leg before it.
    pub(crate) leg: usize,
    pub(crate) is_blend: bool,
    /// First and last station.
    pub(crate) stations: [usize; 2],
    /// Tool poses and derivatives at the stations; empty for joint moves.
    pub(crate) tool: Vec<ToolJet>,
    /// Tool travel per unit of the parameter (m/m) at the stations of a joint move with a
    /// programmed tool speed.
    pub(crate) travel: Vec<f64>,
    /// Minimum singular value and its parameter from the start of the route.
    pub(crate) least_sigma: Option<(f64, f64)>,
    pub(crate) speed: Speed,
}

/// Legs from one stop to the next.
pub(crate) struct Route {
    pub(crate) legs: Vec<Leg>,
    /// Distance from the end of each leg at which the blend begins.
    pub(crate) blends: Vec<f64>,
    pub(crate) pieces: Vec<Piece>,
    pub(crate) stations: Vec<Station>,
}

/// Transition between two legs.
enum Corner {
    Stop(&'static str),
    Smooth,
    Blend,
}

/// A piece before it has stations.
struct Stretch {
    leg: usize,
    is_blend: bool,
    way: LegPath,
    range: [f64; 2],
    speed: Speed,
}

impl Route {
    /// Builds routes from legs between which the program does not stop; a corner that cannot be
    /// passed becomes a stop.
    pub(crate) fn all(
        owner: &mut Legs<'_>,
        legs: Vec<Leg>,
        stops: &mut Vec<(Place, String)>,
    ) -> Result<Vec<Self>, Box<Finding>> {
        let (mut routes, mut here) = (Vec::new(), Vec::new());
        for leg in legs {
            if let Some(last) = here.last()
                && let Corner::Stop(why) = corner(last, &leg, owner.arm.has_jerk_limits())
            {
                if last.of.blend != Blend::Pass || why == CURVATURE {
                    stops.push((last.of.place.clone(), why.to_owned()));
                }
                routes.push(Self::new(owner, std::mem::take(&mut here))?);
            }
            here.push(leg);
        }
        if !here.is_empty() {
            routes.push(Self::new(owner, here)?);
        }
        Ok(routes)
    }

    fn new(owner: &mut Legs<'_>, legs: Vec<Leg>) -> Result<Self, Box<Finding>> {
        let n = legs.len();
        // Length of each leg that its two blends take.
        let mut taken = vec![[0.0, 0.0]; n];
        for k in 0..n - 1 {
            if matches!(corner(&legs[k], &legs[k + 1], owner.arm.has_jerk_limits()), Corner::Blend) {
                let reach = blend_reach(owner, &legs[k], &legs[k + 1]);
                taken[k][1] = reach[0];
                taken[k + 1][0] = reach[1];
            }
        }
        let stretches = stretches(owner, &legs, &taken)?;
        let blends = taken.iter().map(|taken| taken[1]).collect();
        let mut route = Self { legs, blends, pieces: Vec::new(), stations: Vec::new() };
        for stretch in stretches {
            route.add(owner, stretch)?;
        }
        Ok(route)
    }

    /// Joints at a parameter of the interval between station `k` and the next, with their third
    /// derivative.
    pub(crate) fn joints(&self, k: usize, s: f64) -> (JointJet, DVector<f64>) {
        let (a, b) = (&self.stations[k], &self.stations[k + 1]);
        let from = JointJet { q: a.q.clone(), d: a.d.clone(), dd: a.after.clone() };
        let to = JointJet { q: b.q.clone(), d: b.d.clone(), dd: b.before.clone() };
        let h = b.s - a.s;
        between(&from, &to, h, (s - a.s).clamp(0.0, h))
    }

    /// Appends stations along a stretch.
    fn add(&mut self, owner: &mut Legs<'_>, stretch: Stretch) -> Result<(), Box<Finding>> {
        // Joints at points along the stretch, and the tool there if it follows a curve.
        let options = owner.options.clone();
        let (points, tool, sigma) = match &stretch.way {
            LegPath::Tool(way) => {
                let near =
                    self.stations.last().map_or_else(|| self.legs[stretch.leg].q0.clone(), |last| last.q.clone());
                let follower = owner.follower(&way.frame, &near);
                let leg_move = &self.legs[stretch.leg].of;
                let walked = walk(follower, way, stretch.range, &near, &options);
                let (points, sigma) = walked.map_err(|blocked| blocked_error(leg_move, &way.curve, blocked))?;
                let tool = points.iter().map(|(s, _)| way.curve.at(*s)).collect();
                (points, tool, Some(sigma))
            }
            _ => (straight(&stretch.way, stretch.range, &options), Vec::new(), None),
        };
        let travel = match (&stretch.way, stretch.speed.linear_m_s) {
            (LegPath::Tool(_), _) | (_, None) => Vec::new(),
            (_, Some(_)) => travel(owner, &self.legs[stretch.leg], &points),
        };
        // The first point is the last station of the piece before, whose second derivative may
        // jump.
        let origin = self.stations.last().map_or(0.0, |last| last.s) - stretch.range[0];
        let first = self.stations.len().saturating_sub(1);
        for (k, (s, jet)) in points.into_iter().enumerate() {
            match self.stations.last_mut() {
                Some(last) if k == 0 => last.after = jet.dd,
                _ => {
                    let (before, after) = (jet.dd.clone(), jet.dd);
                    self.stations.push(Station { s: origin + s, q: jet.q, d: jet.d, before, after });
                }
            }
        }
        let stations = [first, self.stations.len() - 1];
        let least_sigma = sigma.map(|(value, s)| (value, origin + s));
        let Stretch { leg, is_blend, speed, .. } = stretch;
        self.pieces.push(Piece { leg, is_blend, stations, tool, travel, least_sigma, speed });
        Ok(())
    }
}

/// Speed of the tool centre point per unit of the parameter in a joint move.
fn travel(owner: &mut Legs<'_>, leg: &Leg, points: &[(f64, JointJet)]) -> Vec<f64> {
    let frame = tool_of(&owner.arm, &leg.of);
    let near = &leg.q0;
    let follower = owner.follower(&frame, near);
    points.iter().map(|(_, jet)| follower.speed(jet)).collect()
}

/// Classifies the transition between two consecutive legs.
///
/// * `jerks`: whether joint jerks are bounded, so that a curvature jump can be passed only at rest.
fn corner(a: &Leg, b: &Leg, jerks: bool) -> Corner {
    if a.smooth {
        return Corner::Smooth;
    }
    if a.of.blend == Blend::Stop {
        return Corner::Stop("the program stops here");
    }
    if let (LegPath::Tool(way), LegPath::Tool(next)) = (&a.way, &b.way)
        && way.frame.X_BF == next.frame.X_BF
    {
        // Unit tangents and curvatures where the two paths meet.
        let (end, start) = (way.curve.at(a.length), next.curve.at(0.0));
        if (end.V - start.V).norm() <= ALIGNED {
            return match (jerks && (end.A - start.A).norm() > CURVED, a.of.blend) {
                (false, _) => Corner::Smooth,
                (true, Blend::Pass) => Corner::Stop(CURVATURE),
                (true, _) => Corner::Blend,
            };
        }
        let (end, start) = (end.V, start.V);
        let (u, v): (Vector3<f64>, Vector3<f64>) = (end.fixed_rows::<3>(0).into(), start.fixed_rows::<3>(0).into());
        if u.dot(&v) < TURNED_BACK * u.norm() * v.norm() && u.norm() > 0.5 {
            return Corner::Stop("the path turns back, so the tool stops");
        }
    }
    match a.of.blend {
        Blend::Pass => Corner::Stop("the path has a corner"),
        _ => Corner::Blend,
    }
}

/// Lengths of a blend before and after the common target of two legs.
fn blend_reach(owner: &mut Legs<'_>, a: &Leg, b: &Leg) -> [f64; 2] {
    // Each leg keeps half of its length for the blend at its other end.
    let most = [0.5 * a.length, 0.5 * b.length];
    let both = |reach: f64| [reach.min(most[0]), reach.min(most[1])];
    match a.of.blend {
        Blend::Fraction(part) => both(part.min(0.5) * a.length.min(b.length)),
        Blend::Distance(distance) => {
            [leave(owner, a, distance, true).min(most[0]), leave(owner, b, distance, false).min(most[1])]
        }
        Blend::Orientation(angle) => {
            [turned(owner, a, angle, true).min(most[0]), turned(owner, b, angle, false).min(most[1])]
        }
        Blend::Velocity(part) => {
            let speed = a.of.speed.linear_m_s.unwrap_or(1.0);
            let braking = a.of.speed.linear_m_s2.unwrap_or(BRAKING);
            both(speed * speed * (1.0 - part.min(1.0).powi(2)) / (2.0 * braking))
        }
        Blend::Stop | Blend::Pass => [0.0, 0.0],
    }
}

/// Distance in the parameter from the end (or the start) of a leg at which the tool is `distance`
/// from the corner.
fn leave(owner: &mut Legs<'_>, leg: &Leg, distance: f64, at_end: bool) -> f64 {
    // Where the tool only turns, its angle from the corner counts as a length.
    let travels = match &leg.way {
        LegPath::Tool(way) => way.curve.at(0.0).V.fixed_rows::<3>(0).norm() > 0.0,
        _ => true,
    };
    from_corner(owner, leg, distance, at_end, |X, corner| match travels {
        true => (X.translation.vector - corner.translation.vector).norm(),
        false => angle_between(X, corner) * TURN_LENGTH,
    })
}

/// The same for the rotation angle of the tool from the corner.
fn turned(owner: &mut Legs<'_>, leg: &Leg, angle: f64, at_end: bool) -> f64 {
    from_corner(owner, leg, angle, at_end, angle_between)
}

/// Angle of the rotation between two poses (rad).
fn angle_between(a: &Pose, b: &Pose) -> f64 {
    rotation_vector((a.rotation * b.rotation.inverse()).matrix()).norm()
}

/// Distance in the parameter from the corner at which `away` reaches `most`.
fn from_corner(owner: &mut Legs<'_>, leg: &Leg, most: f64, at_end: bool, away: impl Fn(&Pose, &Pose) -> f64) -> f64 {
    let place = |s: f64| if at_end { leg.length - s } else { s };
    let frame = tool_of(&owner.arm, &leg.of);
    let mut pose = |s: f64| match &leg.way {
        LegPath::Tool(way) => way.curve.at(place(s)).X,
        way => owner.pose(&frame, &joint_jet(way, leg.length, place(s)).q),
    };
    let corner = pose(0.0);
    first_beyond(leg.length, most, |s| away(&pose(s), &corner))
}

/// The first parameter at which `away` reaches `distance`, or `length` if it never does: a coarse
/// search, then bisection.
fn first_beyond(length: f64, distance: f64, mut away: impl FnMut(f64) -> f64) -> f64 {
    const COARSE: usize = 64;
    let Some(k) = (1..=COARSE).find(|&k| away(length * k as f64 / COARSE as f64) >= distance) else { return length };
    let (mut low, mut high) = (length * (k - 1) as f64 / COARSE as f64, length * k as f64 / COARSE as f64);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if away(middle) < distance { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Trimmed legs with the blends between them.
fn stretches(owner: &mut Legs<'_>, legs: &[Leg], taken: &[[f64; 2]]) -> Result<Vec<Stretch>, Box<Finding>> {
    let mut stretches = Vec::new();
    for (k, leg) in legs.iter().enumerate() {
        let range = [taken[k][0], leg.length - taken[k][1]];
        if range[1] - range[0] > SHORTEST_BLEND {
            stretches.push(Stretch { leg: k, is_blend: false, way: leg.way.clone(), range, speed: leg.of.speed });
        }
        let Some(next) = legs.get(k + 1) else { continue };
        let (out, into) = (taken[k][1], taken[k + 1][0]);
        if out + into <= SHORTEST_BLEND {
            continue;
        }
        // A blend of the tool keeps its pose and two derivatives at both ends; where the tool
        // changes, or a leg is in joint space, the blend is in joint space.
        let length = out + into;
        let way = match (&leg.way, &next.way) {
            (LegPath::Tool(way), LegPath::Tool(other)) if way.frame.X_BF == other.frame.X_BF => {
                let (a, b) = (way.curve.at(leg.length - out), other.curve.at(into));
                let curve = ToolCurve::between(&a, &b, length);
                let guided = guided_between((way, leg.length - out), (other, into), &leg.q1);
                LegPath::Tool(FrameCurve { guided, ..FrameCurve::new(curve, way.frame.clone()) })
            }
            _ => {
                let from = joints_at(owner, leg, leg.length - out, true)?;
                let to = joints_at(owner, next, into, false)?;
                LegPath::Bridge { from, to }
            }
        };
        let speed = slower(&leg.of.speed, &next.of.speed);
        stretches.push(Stretch { leg: k, is_blend: true, way, range: [0.0, length], speed });
    }
    Ok(stretches)
}

/// Guided joints on a blend, interpolated between their states at both ends; `corner`: joint values
/// where both paths meet.
fn guided_between(a: (&FrameCurve, f64), b: (&FrameCurve, f64), corner: &DVector<f64>) -> Vec<GuidedJoint> {
    let at = |(way, s): (&FrameCurve, f64), k: usize| {
        let found = way.guided.iter().find(|joint| joint.k == k);
        found.map_or([corner[k], 0.0, 0.0], |joint| joint.at(way.curve.length(), s))
    };
    let mut joints: Vec<usize> = a.0.guided.iter().chain(&b.0.guided).map(|joint| joint.k).collect();
    joints.sort_unstable();
    joints.dedup();
    joints.into_iter().map(|k| GuidedJoint { k, from: at(a, k), to: at(b, k) }).collect()
}

/// Joints on a leg at a parameter, by continuation from its end or its start.
fn joints_at(owner: &mut Legs<'_>, leg: &Leg, s: f64, from_end: bool) -> Result<JointJet, Box<Finding>> {
    match &leg.way {
        LegPath::Tool(way) => {
            let (origin, q) = if from_end { (leg.length, &leg.q1) } else { (0.0, &leg.q0) };
            let follower = owner.follower(&way.frame, q);
            let found = follower.start(way, origin, q).and_then(|jet| follower.advance(way, origin, &jet, s));
            found.map_err(|blocked| blocked_error(&leg.of, &way.curve, blocked))
        }
        way => Ok(joint_jet(way, leg.length, s)),
    }
}

fn joint_jet(way: &LegPath, length: f64, s: f64) -> JointJet {
    match way {
        LegPath::Bridge { from, to } => between(from, to, length, s).0,
        LegPath::Joints { q0, d } => JointJet { q: q0 + d * s, d: d.clone(), dd: DVector::zeros(d.len()) },
        LegPath::Tool(_) => unreachable!("a path of a frame has no joints"),
    }
}

/// The slower of two speeds for each quantity.
fn slower(a: &Speed, b: &Speed) -> Speed {
    let least = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
    Speed {
        linear_m_s: least(a.linear_m_s, b.linear_m_s),
        linear_m_s2: least(a.linear_m_s2, b.linear_m_s2),
        linear_m_s3: least(a.linear_m_s3, b.linear_m_s3),
        angular_rad_s: least(a.angular_rad_s, b.angular_rad_s),
        angular_rad_s2: least(a.angular_rad_s2, b.angular_rad_s2),
        joint_fraction: least(a.joint_fraction, b.joint_fraction),
        joint_acceleration_fraction: least(a.joint_acceleration_fraction, b.joint_acceleration_fraction),
        joint_rad_s: least(a.joint_rad_s, b.joint_rad_s),
        joint_rad_s2: least(a.joint_rad_s2, b.joint_rad_s2),
        duration_s: None,
    }
}

fn intervals(length: f64, options: &PathOptions) -> usize {
    let least = if length < options.spacing_m { MIN_OF_SHORT } else { MIN_INTERVALS };
    ((length / options.spacing_m).ceil() as usize).clamp(least, MAX_INTERVALS)
}

/// Points of a path in joint space.
fn straight(way: &LegPath, [from, to]: [f64; 2], options: &PathOptions) -> Vec<(f64, JointJet)> {
    let n = intervals(to - from, options);
    let at = |k: usize| from + (to - from) * k as f64 / n as f64;
    (0..=n).map(|k| (at(k), joint_jet(way, to, at(k)))).collect()
}

type Walked = (Vec<(f64, JointJet)>, (f64, f64));

/// Joints along a tool curve at points so close that the quintics between them follow the curve,
/// and the minimum singular value with its parameter.
fn walk(
    follower: &mut Follower<'_>,
    way: &FrameCurve,
    [from, to]: [f64; 2],
    near: &DVector<f64>,
    options: &PathOptions,
) -> Result<Walked, Blocked> {
    let n = intervals(to - from, options);
    let mut last = (from, follower.start(way, from, near)?);
    let mut least = (follower.sigma(), from);
    let mut points = vec![last.clone()];
    for k in 1..=n {
        let s = if k == n { to } else { from + (to - from) * k as f64 / n as f64 };
        let jet = follower.advance(way, last.0, &last.1, s)?;
        let sigma = follower.sigma();
        if sigma < least.0 {
            least = (sigma, s);
        }
        let next = (s, jet);
        refine(follower, way, &last, &next, options.chord_m, HALVINGS, &mut points)?;
        points.push(next.clone());
        last = next;
    }
    Ok((points, least))
}

/// Inserts points between two others until the quintics follow the curve at the midpoints.
fn refine(
    follower: &mut Follower<'_>,
    way: &FrameCurve,
    a: &(f64, JointJet),
    b: &(f64, JointJet),
    chord: f64,
    depth: usize,
    points: &mut Vec<(f64, JointJet)>,
) -> Result<(), Blocked> {
    let middle = 0.5 * (a.0 + b.0);
    let (guess, _) = between(&a.1, &b.1, b.0 - a.0, middle - a.0);
    if depth == 0 || follower.distance(&way.curve, middle, &guess.q) <= chord {
        return Ok(());
    }
    let found = (middle, follower.advance(way, a.0, &a.1, middle)?);
    refine(follower, way, a, &found, chord, depth - 1, points)?;
    points.push(found.clone());
    refine(follower, way, &found, b, chord, depth - 1, points)
}
