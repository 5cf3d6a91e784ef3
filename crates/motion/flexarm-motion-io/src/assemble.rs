//! Builds curves from the messages of a topic: choice of the clock, removal of unusable samples,
//! choice of velocities.
//!
//! Start at [`assemble`]. Messages are either states, one sample of some joints each (`states`), or
//! plans of several points (`plans`); both end as a [`Line`] of samples per joint. Each choice is a
//! caveat. Times are in ns in the messages and in s from the first sample in a line; positions are
//! in rad or m. Not here: reading of messages (`message`), topics (`collect`), curves through the
//! samples (`flexarm-trajectory`).

use flexarm_settings::Finding;
use flexarm_trajectory::{JointSamples, SampleError, Samples, Trajectory, TrajectoryError, velocity_mismatch};

use crate::collect::{Received, Series, Topic};
use crate::error::{PlacedProblem, list};
use crate::message::Point;

/// Stamps that go back by at most this are sorted (s).
const DISORDER_S: f64 = 1.0;
/// Repeated stamps with different positions are tolerated below this fraction.
const FEW: f64 = 0.01;
/// Maximum position difference between consecutive trajectories of one message (rad or m).
const MEET: f64 = 1e-3;
/// Trajectory points closer than this are simultaneous (s); shorter than a period of any
/// controller.
const SAME_TIME_S: f64 = 1e-6;
/// A joint whose record starts later or ends earlier by at most this number of its steps is
/// extrapolated at its speed.
const REACH: f64 = 2.0;
/// Velocities match positions if the slopes differ from them by less than this fraction of the
/// slopes, and this (rad/s).
const BELONGS: [f64; 2] = [0.1, 0.02];

/// Samples of a joint, times in s relative to a common origin. Missing rates are NaN.
#[derive(Debug, Default)]
struct Line {
    joint: String,
    t: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
}

/// A trajectory with its caveats.
pub(crate) struct Assembled {
    pub(crate) trajectory: Trajectory,
    pub(crate) samples: usize,
    pub(crate) caveats: Vec<Finding>,
}

/// Builds the curves of a topic.
///
/// * `file`: file name for caveats.
/// * `has_clock`: whether the times of reception are known.
pub(crate) fn assemble(topic: Topic, file: &str, has_clock: bool) -> Result<Assembled, PlacedProblem> {
    let mut caveats = FileCaveats { file, caveats: Vec::new() };
    let mut lines = if topic.received.is_empty() {
        states(topic, has_clock, &mut caveats)?
    } else {
        plans(topic, has_clock, &mut caveats)?
    };
    let samples = lines.iter().map(|line| line.t.len()).max().unwrap_or(0);
    let first = lines.iter().filter_map(|line| line.t.first()).fold(f64::INFINITY, |first, t| first.min(*t));
    let last = lines.iter().filter_map(|line| line.t.last()).fold(f64::NEG_INFINITY, |last, t| last.max(*t));
    if last <= first || lines.is_empty() {
        let found = samples.min(1);
        return Err(PlacedProblem::from(TrajectoryError::Samples(SampleError::too_few(found))));
    }
    lines.iter_mut().for_each(|line| line.reach(first, last));
    tell_ends(&lines, first, last, &mut caveats);
    let parts = lines.iter().map(|line| line.curve(first, last)).collect::<Result<Vec<_>, _>>()?;
    let trajectory = Trajectory::side_by_side(&parts)?;
    Ok(Assembled { trajectory, samples, caveats: caveats.caveats })
}

/// Collects caveats about one file.
struct FileCaveats<'a> {
    file: &'a str,
    caveats: Vec<Finding>,
}

impl FileCaveats<'_> {
    fn warn(&mut self, code: &str, message: &str, help: &str) {
        self.caveats.push(Finding::warning(code, self.file, format!("{}: {message}", self.file), help));
    }

    fn note(&mut self, code: &str, message: &str) {
        self.caveats.push(Finding::warning(code, self.file, format!("{}: {message}", self.file), "").as_note());
    }
}

impl Line {
    /// Returns its start time and curve. A joint with a single sample is held there.
    fn curve(&self, first: f64, last: f64) -> Result<(f64, Trajectory), TrajectoryError> {
        let known = |rates: &Vec<f64>| rates.iter().all(|rate| rate.is_finite()).then(|| rates.clone());
        let velocity = known(&self.v);
        let acceleration = velocity.is_some().then(|| known(&self.a)).flatten();
        let name = self.joint.clone();
        if let ([_], [q]) = (&self.t[..], &self.q[..]) {
            let joint = JointSamples { name, position: vec![*q; 2], ..JointSamples::default() };
            return Ok((0.0, Samples { times: vec![first, last], joints: vec![joint] }.interpolate()?));
        }
        let joint = JointSamples { name, position: self.q.clone(), velocity, acceleration };
        let start = self.t[0] - first;
        Ok((start, Samples { times: self.t.clone(), joints: vec![joint] }.interpolate()?))
    }

    fn push(&mut self, t: f64, q: f64, v: f64, a: f64) {
        self.t.push(t);
        self.q.push(q);
        self.v.push(v);
        self.a.push(a);
    }

    fn truncate(&mut self, length: usize) {
        self.t.truncate(length);
        self.q.truncate(length);
        self.v.truncate(length);
        self.a.truncate(length);
    }
}

impl Line {
    /// Mean sampling interval (s); requires at least two samples.
    fn step(&self) -> f64 {
        (self.t[self.t.len() - 1] - self.t[0]) / (self.t.len() - 1) as f64
    }

    /// Extrapolates the joint at constant speed to the ends of the other joints if these are within
    /// two of its steps: publishers of other joints on the same topic send at other times, which
    /// must not cause abrupt starts and stops.
    fn reach(&mut self, first: f64, last: f64) {
        if self.t.len() < 2 {
            return;
        }
        let (step, n) = (self.step(), self.t.len());
        let speed = |i: usize, j: usize| match self.v[i].is_finite() {
            true => self.v[i],
            false => (self.q[j] - self.q[i]) / (self.t[j] - self.t[i]),
        };
        let (begin, end) = (speed(0, 1), speed(n - 1, n - 2));
        let (early, late) = (self.t[0] - first, last - self.t[n - 1]);
        if late > SAME_TIME_S && late <= REACH * step {
            self.push(last, self.q[n - 1] + end * late, self.v[n - 1], self.a[n - 1]);
        }
        if early > SAME_TIME_S && early <= REACH * step {
            let rate = (self.v[0], self.a[0]);
            self.t.insert(0, first);
            self.q.insert(0, self.q[0] - begin * early);
            self.v.insert(0, rate.0);
            self.a.insert(0, rate.1);
        }
    }
}

/// Warns about joints that start later or end earlier than others by more than two of their own
/// steps.
fn tell_ends(lines: &[Line], first: f64, last: f64, caveats: &mut FileCaveats<'_>) {
    let mut late = Vec::new();
    for line in lines.iter().filter(|line| line.t.len() > 1) {
        let (begin, end) = (line.t[0], line.t[line.t.len() - 1]);
        let far = REACH * line.step();
        if begin - first > far || last - end > far {
            late.push(format!("{:?} from {:.3} to {:.3} s", line.joint, begin - first, end - first));
        }
    }
    if !late.is_empty() {
        let what = format!("joints that are not recorded all the time are held before and after: {}", late.join(", "));
        caveats.warn("motion-ends", &what, "cut the recording to the time that all joints share");
    }
    let once: Vec<String> = lines.iter().filter(|line| line.t.len() == 1).map(|line| line.joint.clone()).collect();
    if !once.is_empty() {
        caveats.note("motion-ends", &format!("recorded only once, and held there: {}", list(&once)));
    }
}

// ------------------------------------------------------------------------------------------------------------------
// states

/// Lines of joints from their states.
fn states(mut topic: Topic, has_clock: bool, caveats: &mut FileCaveats<'_>) -> Result<Vec<Line>, PlacedProblem> {
    // Messages and samples that cannot be used.
    let count: usize = topic.series.iter().map(|series| series.position.len()).sum();
    if topic.without_position > 0 {
        let what = format!("{} of {} messages have no positions and are left out", topic.without_position, topic.count);
        caveats.warn("motion-positions", &what, "");
    }
    if topic.unmatched_rates > 0 {
        let count = topic.unmatched_rates;
        let what = format!("the velocities of {count} messages are not one for each joint and are left out");
        caveats.warn("motion-velocities", &what, "");
    }
    let mut not_finite = 0;
    for series in &mut topic.series {
        not_finite += series.drop_what_is_not_finite();
    }
    topic.series.retain(|series| !series.position.is_empty());
    if topic.series.is_empty() {
        return Err(PlacedProblem::new("no position is a number; was the robot connected when this was recorded?"));
    }
    if not_finite > 0 {
        let what = format!("{not_finite} of {count} positions are not numbers and are skipped; the curves bridge them");
        caveats.warn("motion-positions", &what, "look at the recording: a robot that is not connected says so");
    }
    // One clock and one origin for all joints; the samples of each joint in the order of their
    // times.
    let use_log = clock(&topic.series, has_clock, caveats)?;
    let origin = |series: &Series| series.times(use_log).iter().copied().min().unwrap_or(i64::MAX);
    let origin = topic.series.iter().map(origin).min().unwrap_or(0);

    let (mut sorted, mut repeated, mut differ) = (0, 0, 0.0f64);
    let mut lines = Vec::new();
    for series in topic.series {
        let (line, counts) = series.line(use_log, origin);
        sorted += counts.sorted;
        repeated += counts.repeated;
        differ = differ.max(counts.differ);
        lines.push(line);
    }
    // Caveats about changes to the messages.
    if sorted > 0 {
        caveats.note(
            "motion-stamps",
            &format!("{sorted} samples came out of order and were put in order by their stamps"),
        );
    }
    if repeated > 0 {
        let what = format!(
            "{repeated} samples have the time of the one before and are left out (their positions differ by up to \
             {differ:.3e} rad or m)"
        );
        if differ > 0.0 {
            caveats.warn("motion-stamps", &what, "")
        } else {
            caveats.note("motion-stamps", &what)
        };
    }
    judge_velocities(&mut lines, caveats);
    Ok(lines)
}

/// Changes to the samples of a joint.
struct Counts {
    sorted: usize,
    repeated: usize,
    /// Maximum difference of positions with the same time.
    differ: f64,
}

impl Series {
    fn times(&self, use_log: bool) -> &[i64] {
        if use_log { &self.log_ns } else { &self.stamp_ns }
    }

    fn drop_what_is_not_finite(&mut self) -> usize {
        let sound: Vec<bool> = self.position.iter().map(|q| q.is_finite()).collect();
        let dropped = sound.iter().filter(|sound| !**sound).count();
        if dropped == 0 {
            return 0;
        }
        fn keep<T: Copy>(values: &mut Vec<T>, sound: &[bool]) {
            *values = values.iter().zip(sound).filter(|(_, sound)| **sound).map(|(value, _)| *value).collect();
        }
        keep(&mut self.stamp_ns, &sound);
        keep(&mut self.log_ns, &sound);
        keep(&mut self.position, &sound);
        keep(&mut self.velocity, &sound);
        keep(&mut self.acceleration, &sound);
        dropped
    }

    /// Returns the samples in the order of their times, each time once.
    fn line(&self, use_log: bool, origin: i64) -> (Line, Counts) {
        let times = self.times(use_log);
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by_key(|&i| times[i]);
        let sorted = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let mut line = Line { joint: self.joint.clone(), ..Line::default() };
        let (mut repeated, mut differ, mut last) = (0, 0.0f64, None);
        for i in order {
            if last == Some(times[i]) {
                repeated += 1;
                differ = differ.max(line.q.last().map_or(0.0, |q| (q - self.position[i]).abs()));
                continue;
            }
            last = Some(times[i]);
            let t = times[i].saturating_sub(origin) as f64 / 1e9;
            line.push(t, self.position[i], self.velocity[i], self.acceleration[i]);
        }
        (line, Counts { sorted, repeated, differ })
    }
}

/// Whether the times of reception are used instead of the stamps; a caveat gives the choice.
fn clock(series: &[Series], has_clock: bool, caveats: &mut FileCaveats<'_>) -> Result<bool, PlacedProblem> {
    let total: usize = series.iter().map(|series| series.stamp_ns.len()).sum();
    let unset: usize = series.iter().map(|series| series.stamp_ns.iter().filter(|stamp| **stamp == 0).count()).sum();
    // Stamps that jump back, and stamps that repeat although the position changes.
    let mut back: Option<(f64, usize, &str)> = None;
    let mut changed = 0;
    for series in series {
        let mut latest = i64::MIN;
        for (i, &stamp) in series.stamp_ns.iter().enumerate() {
            let seconds = latest.saturating_sub(stamp) as f64 / 1e9;
            if i > 0 && seconds > DISORDER_S && back.is_none_or(|(most, ..)| seconds > most) {
                back = Some((seconds, i + 1, &series.joint));
            }
            let repeats = i > 0 && stamp == series.stamp_ns[i - 1];
            changed += usize::from(repeats && series.position[i] != series.position[i - 1]);
            latest = latest.max(stamp);
        }
    }
    // Reason against the header stamps.
    let why = if unset == total {
        Some("the header stamps are not set".to_owned())
    } else if unset > 0 {
        Some(format!("{unset} of {total} header stamps are not set"))
    } else if let Some((seconds, ..)) = back {
        Some(format!("the header stamps jump back by {seconds:.3} s"))
    } else if changed as f64 > FEW * total as f64 {
        Some(format!("{changed} of {total} header stamps repeat the one before while the joint moves"))
    } else {
        None
    };
    // In a bag the times of reception replace them; in a text there are no others.
    match (why, has_clock, back) {
        (None, ..) => {
            if has_clock {
                caveats.note("motion-clock", "times are those of the header stamps, not those of reception");
            }
            Ok(false)
        }
        (Some(why), true, _) => {
            caveats.warn("motion-clock", &format!("times are those of reception: {why}"), "");
            Ok(true)
        }
        (_, false, _) if unset == total && total > series.len() => Err(PlacedProblem::new(
            "the messages have no time stamps (`header`, `stamp`), so nothing says when they were; record with \
             stamps, or record a bag, which has the times of reception",
        )),
        (_, false, Some((seconds, number, joint))) => Err(PlacedProblem::new(format!(
            "the time stamps jump back by {seconds} s at sample {number} of joint {joint:?}: the text holds two \
             recordings, or a clock was set; keep one of them"
        ))),
        (Some(why), false, None) => {
            caveats.warn("motion-clock", &format!("{why}; there is no other time to go by"), "");
            Ok(false)
        }
    }
}

/// Discards velocities that do not match the slopes of the positions, since drivers without
/// velocities send zeros.
fn judge_velocities(lines: &mut [Line], caveats: &mut FileCaveats<'_>) {
    let (mut foreign, mut partial) = (Vec::new(), Vec::new());
    for line in lines.iter_mut().filter(|line| line.t.len() > 1) {
        let known = line.v.iter().filter(|v| v.is_finite()).count();
        if known == 0 {
            continue;
        }
        if known < line.v.len() {
            partial.push(format!("{:?} ({known} of {})", line.joint, line.v.len()));
            line.v.fill(f64::NAN);
            continue;
        }
        let [miss, slope] = velocity_mismatch(&line.t, &line.q, &line.v);
        if miss > BELONGS[0] * slope + BELONGS[1] {
            foreign.push(format!("{:?} ({miss:.3} of {slope:.3} rad/s)", line.joint));
            line.v.fill(f64::NAN);
        }
    }
    if !foreign.is_empty() {
        let what = format!(
            "velocities that are not those of the positions are not used (mean difference and mean slope): {}",
            foreign.join(", ")
        );
        caveats.warn("motion-velocities", &what, "");
    }
    tell_partial(&partial, caveats);
}

fn tell_partial(partial: &[String], caveats: &mut FileCaveats<'_>) {
    if !partial.is_empty() {
        let what = format!("rates that are not numbers at every sample are not used: {}", partial.join(", "));
        caveats.warn("motion-velocities", &what, "");
    }
}

// -------------------------------------------------------------------------------------------------------------------
// plans

/// Lines of joints from the points of trajectories. Each message begins at its stamp, otherwise at
/// its reception, otherwise after the previous one, and replaces the remainder of the previous one.
fn plans(topic: Topic, has_clock: bool, caveats: &mut FileCaveats<'_>) -> Result<Vec<Line>, PlacedProblem> {
    // Messages with points, and the clock by which they begin.
    let mut lines: Vec<Line> =
        topic.series.iter().map(|series| Line { joint: series.joint.clone(), ..Line::default() }).collect();
    let messages: Vec<&Received> =
        topic.received.iter().filter(|message| message.trajectories.iter().any(|t| !t.points.is_empty())).collect();
    let stamp = |message: &Received| message.trajectories.first().map_or(0, |t| t.stamp_ns);
    let by_stamp = messages.iter().all(|message| stamp(message) != 0);
    let by_time = by_stamp || has_clock;
    let time_ns = |message: &Received| if by_stamp { stamp(message) } else { message.log_ns };
    let origin = messages.first().map_or(0, |message| time_ns(message));

    let (mut end, mut segments) = (0.0f64, 0);
    for (k, message) in messages.iter().enumerate() {
        let begin = if by_time { time_ns(message).saturating_sub(origin) as f64 / 1e9 } else { end };
        if begin < 0.0 {
            let joint = message.trajectories.first().and_then(|points| points.joints.first());
            let (seconds, joint) = (-begin, joint.map_or_else(String::new, |joint| joint.to_string()));
            let message = format!(
                "the time stamps jump back by {seconds} s at sample {number} of joint {joint:?}: the text holds two \
                 recordings, or a clock was set; keep one of them",
                number = k + 1
            );
            return Err(PlacedProblem::new(message));
        }
        if k == 0 {
            put_start(message, &mut lines, caveats);
        }
        // The trajectories of a message run one after another, the first one from its beginning.
        let mut from = begin;
        for (i, points) in message.trajectories.iter().enumerate() {
            segments += 1;
            for line in &mut lines {
                let Some(column) = points.joints.iter().position(|joint| **joint == *line.joint) else { continue };
                if k > 0 && i == 0 {
                    line.cut(from, points.points.first(), column);
                }
                line.append(from, &points.points, column, segments)?;
            }
            from += points.points.last().map_or(0.0, |point| point.time_s);
        }
        end = from;
    }
    tell_plan(&messages, by_stamp, has_clock, segments, caveats);
    lines.retain(|line| !line.t.is_empty());
    judge_plan(&mut lines, caveats);
    Ok(lines)
}

/// Adds the position of the robot before the first point, if it is given and the first point is
/// later.
fn put_start(message: &Received, lines: &mut [Line], caveats: &mut FileCaveats<'_>) {
    let Some(points) = message.trajectories.iter().find(|points| !points.points.is_empty()) else { return };
    let first = points.points.first().map_or(0.0, |point| point.time_s);
    if first <= 0.0 {
        return;
    }
    let start = message.start.as_ref().filter(|start| start.position.len() == start.joints.len());
    let place = |line: &Line| {
        let start = start?;
        let k = start.joints.iter().position(|joint| **joint == *line.joint)?;
        start.position.get(k).copied().filter(|q| q.is_finite())
    };
    // All joints or none.
    let places: Option<Vec<f64>> = lines.iter().map(place).collect();
    match places {
        Some(places) => {
            for (line, q) in lines.iter_mut().zip(places) {
                line.push(0.0, q, 0.0, 0.0);
            }
            caveats
                .note("motion-start", &format!("the robot goes from trajectory_start to the first point in {first} s"));
        }
        None => {
            let what = format!(
                "the first point is at {first} s, and where the robot is before is not in the file: the motion begins with \
                 that point"
            );
            caveats.note("motion-start", &what);
        }
    }
}

impl Line {
    /// Removes the samples after `from`, where a message begins. Up to the first point of the
    /// message the joint keeps its earlier motion: it is at the end if that was reached, otherwise
    /// interpolated between the points before and after `from`.
    fn cut(&mut self, from: f64, first: Option<&Point>, column: usize) {
        let keep = self.t.partition_point(|t| *t <= from + SAME_TIME_S);
        let next = self.t.get(keep).map(|&t| (t, self.q[keep], self.v[keep], self.a[keep]));
        self.truncate(keep);
        let (Some(&t), Some(&q), Some(first)) = (self.t.last(), self.q.last(), first) else { return };
        let gap = from - t;
        if gap <= SAME_TIME_S {
            return;
        }
        if let Some((later, q_later, v_later, a_later)) = next {
            if first.time_s > 0.0 {
                let part = gap / (later - t);
                let between = |x: f64, y: f64| x + part * (y - x);
                let (v, a) = (self.v[keep - 1], self.a[keep - 1]);
                self.push(from, between(q, q_later), between(v, v_later), between(a, a_later));
            }
            return;
        }
        // Points of a stream may be slightly late, in which case the motion continues.
        let step = keep.checked_sub(2).map_or(first.time_s, |before| t - self.t[before]);
        if first.time_s > 0.0 && gap < 0.5 * step {
            return;
        }
        let joins = first.position.get(column).is_some_and(|next| (next - q).abs() <= MEET);
        // A hold is two steps without motion; if the message begins elsewhere at once, the joint
        // moves there within the gap.
        if first.time_s > 0.0 || joins {
            self.push(t + 0.5 * gap, q, 0.0, 0.0);
        }
        if first.time_s > 0.0 {
            self.push(from, q, 0.0, 0.0);
        }
    }

    /// Appends a column of points at their times after `from` (s); a point at the end of the
    /// trajectory before it must agree with it.
    fn append(&mut self, from: f64, points: &[Point], column: usize, number: usize) -> Result<(), PlacedProblem> {
        for point in points {
            let t = from + point.time_s;
            let (q, last) = (point.position[column], self.t.last().copied());
            if last.is_some_and(|last| t <= last + SAME_TIME_S) {
                // The point at which two trajectories meet is in both.
                let previous = self.q[self.q.len() - 1];
                if (previous - q).abs() > MEET {
                    let (joint, this) = (self.joint.clone(), q);
                    return Err(PlacedProblem::new(format!(
                        "trajectory {number} has joint {joint:?} at {this} where the one before ends with it at \
                         {previous}: trajectories of one message run one after another; split the file"
                    )));
                }
                continue;
            }
            let rate = |rates: &[f64]| rates.get(column).copied().unwrap_or(f64::NAN);
            self.push(t, q, rate(&point.velocity), rate(&point.acceleration));
        }
        Ok(())
    }
}

fn tell_plan(messages: &[&Received], by_stamp: bool, has_clock: bool, segments: usize, caveats: &mut FileCaveats<'_>) {
    if messages.len() > 1 {
        let begin = match (by_stamp, has_clock) {
            (true, _) => "its header stamp",
            (false, true) => "its reception (its header stamp is not set)",
            (false, false) => "the end of the one before (nothing says when they were sent)",
        };
        let what = format!(
            "{} trajectories: each begins at {begin} and replaces the rest of the previous one",
            messages.len()
        );
        caveats.warn("motion-messages", &what, "");
    } else if segments > 1 {
        caveats.note("motion-messages", &format!("{segments} trajectories of one message run one after another"));
    }
}

/// Chooses the rates of the points that are used.
fn judge_plan(lines: &mut [Line], caveats: &mut FileCaveats<'_>) {
    let mut partial = Vec::new();
    let mut without = true;
    for line in lines {
        for (what, rates) in [("velocities", &mut line.v), ("accelerations", &mut line.a)] {
            let known = rates.iter().filter(|rate| rate.is_finite()).count();
            without &= known == 0;
            if known > 0 && known < rates.len() {
                partial.push(format!("{what} of {:?} ({known} of {})", line.joint, rates.len()));
                rates.fill(f64::NAN);
            }
        }
    }
    tell_partial(&partial, caveats);
    if without {
        let what = "the points have no velocities: the joints follow a smooth spline through them, where a controller of ROS goes \
             straight from point to point";
        caveats.note("motion-velocities", what);
    }
}
