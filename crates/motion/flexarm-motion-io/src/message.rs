//! Finds motions in the tree of a message by its keys: trajectories of points, joint states,
//! controller states.
//!
//! Start at [`motion_of`]. The type of the message does not matter, so that trajectories within
//! other messages, such as those of MoveIt, are found. Values are in rad, m and s as in ROS. Not
//! here: texts and bytes that make the tree (`yaml`, `cdr`).

use std::rc::Rc;

use crate::error::{NO_POSITIONS, PlacedProblem, SHORTENED_ARRAY};
use crate::value::{Node, Value};

/// Maximum depth of a motion in a message.
const DEEPEST: usize = 6;

/// Values of the joints named in one message.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    /// `header.stamp` (ns); 0 if not set.
    pub(crate) stamp_ns: i64,
    pub(crate) joints: Vec<Rc<str>>,
    /// Positions, one per joint, rad or m; empty if the message has none.
    pub(crate) position: Vec<f64>,
    /// Velocities, one per joint or none.
    pub(crate) velocity: Vec<f64>,
    /// Accelerations, one per joint or none.
    pub(crate) acceleration: Vec<f64>,
    /// Source field of the values: `position`, `reference`, ...
    pub(crate) of: &'static str,
    /// Line and column of the message in a text; zeros in a bag.
    pub(crate) place: [u32; 2],
}

/// A point of a trajectory, with values of the trajectory's joints.
#[derive(Clone, Debug, Default)]
pub(crate) struct Point {
    /// Time since the start of the trajectory (s).
    pub(crate) time_s: f64,
    pub(crate) position: Vec<f64>,
    /// Velocities, one per joint or none.
    pub(crate) velocity: Vec<f64>,
    /// Accelerations, one per joint or none.
    pub(crate) acceleration: Vec<f64>,
}

/// `trajectory_msgs/JointTrajectory`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Points {
    pub(crate) stamp_ns: i64,
    pub(crate) joints: Vec<Rc<str>>,
    pub(crate) points: Vec<Point>,
}

/// Motion in a message.
#[derive(Clone, Debug)]
pub(crate) enum Message {
    State(State),
    /// Consecutive trajectories, and the robot's state before the first, if given.
    Trajectories(Vec<Points>, Option<State>),
}

/// Set point and measured value of a controller, in order of preference.
const CONTROLLER: [&str; 4] = ["reference", "desired", "feedback", "actual"];

/// Returns the motion of a message, if any.
///
/// # Errors
/// [`PlacedProblem`] for an invalid motion.
pub(crate) fn motion_of(node: &Node) -> Result<Option<Message>, PlacedProblem> {
    if let (Some(names), Some(_)) = (node.get("name"), node.get("position")) {
        return state(node, names, node, "position").map(|state| Some(Message::State(state)));
    }
    if let Some(names) = node.get("joint_names")
        && node.get("points").is_none()
        && let Some(of) = set_point(node)
    {
        let point = node.get(of).unwrap_or(node);
        return state(node, names, point, of).map(|state| Some(Message::State(state)));
    }
    let mut found = Vec::new();
    trajectories(node, 0, &mut found)?;
    if found.is_empty() {
        return Ok(None);
    }
    let start = node.get("trajectory_start").and_then(|start| start.get("joint_state"));
    let start = start.and_then(|start| Some((start, start.get("name")?)));
    // A start without values is ignored: planners leave it empty.
    let start = start.map(|(start, names)| state(start, names, start, "trajectory_start")).transpose()?;
    Ok(Some(Message::Trajectories(found, start.filter(|start| !start.position.is_empty()))))
}

/// The first field of a controller that has positions.
fn set_point(node: &Node) -> Option<&'static str> {
    let filled = |of: &&&str| {
        let positions = node.get(of).and_then(|point| point.get("positions"));
        positions.is_some_and(|positions| matches!(&positions.value, Value::Numbers(n) if !n.is_empty()))
    };
    let first = || CONTROLLER.iter().find(|of| node.get(of).is_some());
    CONTROLLER.iter().find(filled).or_else(first).copied()
}

/// Searches for tables with `joint_names` and `points`.
fn trajectories(node: &Node, depth: usize, found: &mut Vec<Points>) -> Result<(), PlacedProblem> {
    if depth > DEEPEST {
        return Ok(());
    }
    match &node.value {
        Value::Map(pairs) => {
            if let (Some(names), Some(list)) = (node.get("joint_names"), node.get("points")) {
                // MoveIt leaves the trajectory empty if there is nothing to move.
                let trajectory = points(node, names, list)?;
                if !(trajectory.joints.is_empty() && trajectory.points.is_empty()) {
                    found.push(trajectory);
                }
                return Ok(());
            }
            let inside = pairs.iter().filter(|(key, _)| &**key != "trajectory_start");
            inside.into_iter().try_for_each(|(_, inner)| trajectories(inner, depth + 1, found))
        }
        Value::List(items) => items.iter().try_for_each(|inner| trajectories(inner, depth + 1, found)),
        _ => Ok(()),
    }
}

/// Reads the points of a `JointTrajectory`: times in s, values per joint.
fn points(node: &Node, names: &Node, list: &Node) -> Result<Points, PlacedProblem> {
    let joints = names_of(names, "joint_names")?;
    let items: &[Node] = match &list.value {
        Value::List(items) => items,
        Value::Numbers(none) if none.is_empty() => &[],
        Value::Null => &[],
        _ => return Err(wrong("points", list, "a list of points")),
    };
    let mut found: Vec<Point> = Vec::with_capacity(items.len());
    for (i, item) in items.iter().enumerate() {
        if let Value::Text(_) = item.value {
            return Err(wrong("points", item, "a list of points"));
        }
        // Values of the point.
        let of = || format!("point {}", i + 1);
        let missing =
            |key, expected| PlacedProblem::at(item.place, format!("{of} has no `{key}`; {expected}", of = of()));
        let positions = item.get("positions").or_else(|| item.get("position"));
        let positions = positions.ok_or_else(|| missing("positions", NO_POSITIONS))?;
        let time = item.get("time_from_start");
        let time = time.ok_or_else(|| missing("time_from_start", "expected sec and nanosec, or seconds"))?;
        let point = Point {
            time_s: duration_s(time)?,
            position: numbers(positions, "positions")?,
            velocity: rates(item, "velocities")?,
            acceleration: rates(item, "accelerations")?,
        };
        // One value for each joint, positions that are numbers, ascending times.
        let columns = [
            ("positions", &point.position, true),
            ("velocities", &point.velocity, false),
            ("accelerations", &point.acceleration, false),
        ];
        check_lengths(item, i + 1, joints.len(), &columns)?;
        if let Some(k) = point.position.iter().position(|value| !value.is_finite()) {
            let (joint, value) = (joints[k].to_string(), point.position[k]);
            let message = format!(
                "joint {joint:?}, point {point}: the position is {value}; expected a finite number",
                point = i + 1
            );
            return Err(PlacedProblem::at(item.place, message));
        }
        let previous = found.last().map_or(f64::NEG_INFINITY, |last| last.time_s);
        if !(point.time_s > previous && point.time_s.is_finite()) {
            let this = point.time_s;
            let message = format!(
                "point {point} is at {this} s, the one before it at {previous} s: `time_from_start` must increase \
                 from point to point",
                point = i + 1
            );
            return Err(PlacedProblem::at(item.place, message));
        }
        found.push(point);
    }
    Ok(Points { stamp_ns: stamp_ns(node)?, joints, points: found })
}

/// State of the joints named in `names`; `values` has position and velocity, or positions and
/// velocities.
fn state(node: &Node, names: &Node, values: &Node, of: &'static str) -> Result<State, PlacedProblem> {
    let plural = matches!(of, "reference" | "desired" | "feedback" | "actual");
    let (position, velocity, acceleration) =
        if plural { ("positions", "velocities", "accelerations") } else { ("position", "velocity", "acceleration") };
    let joints = names_of(names, if plural { "joint_names" } else { "name" })?;
    Ok(State {
        stamp_ns: stamp_ns(node)?,
        joints,
        position: rates(values, position)?,
        velocity: rates(values, velocity)?,
        acceleration: rates(values, acceleration)?,
        of,
        place: node.place,
    })
}

impl State {
    /// Checks that there is one position per joint or none. Drops velocities and accelerations of
    /// another number and returns whether there were any.
    ///
    /// # Errors
    /// A number of values that is not that of the joints.
    pub(crate) fn check(&mut self) -> Result<bool, PlacedProblem> {
        let (found, expected) = (self.position.len(), self.joints.len());
        if found != 0 && found != expected {
            let message = format!("`position` has {found} values for {expected} joints; expected one for each name");
            return Err(PlacedProblem::at(self.place, message));
        }
        let mut has_unmatched = false;
        for rates in [&mut self.velocity, &mut self.acceleration] {
            if !rates.is_empty() && rates.len() != expected {
                rates.clear();
                has_unmatched = true;
            }
        }
        Ok(has_unmatched)
    }
}

fn check_lengths(
    item: &Node,
    point: usize,
    joints: usize,
    columns: &[(&str, &Vec<f64>, bool)],
) -> Result<(), PlacedProblem> {
    for (key, values, needed) in columns {
        if values.len() != joints && (*needed || !values.is_empty()) {
            let hint = if values.is_empty() { ": a trajectory without positions is not read" } else { "" };
            let found = values.len();
            let message = format!(
                "`{key}` has {found} values for {joints} joints; expected one for each name{hint} (point {point})"
            );
            return Err(PlacedProblem::at(item.place, message));
        }
    }
    Ok(())
}

/// Reads a list of joint names.
fn names_of(node: &Node, key: &str) -> Result<Vec<Rc<str>>, PlacedProblem> {
    let wrong = |node: &Node| wrong(key, node, "a list of names of joints");
    let names: Vec<Rc<str>> = match &node.value {
        Value::List(items) => {
            let name = |item: &Node| match &item.value {
                Value::Text(text) if !text.ends_with("...") => Ok(text.clone()),
                Value::Whole(whole) => Ok(whole.to_string().into()),
                _ => Err(wrong(item)),
            };
            items.iter().map(name).collect::<Result<_, _>>()?
        }
        Value::Numbers(numbers) => numbers.iter().map(|number| number.to_string().into()).collect(),
        Value::Null => Vec::new(),
        _ => return Err(wrong(node)),
    };
    let mut sorted: Vec<&str> = names.iter().map(|name| &**name).collect();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(PlacedProblem::at(
            node.place,
            format!("joint {joint:?} is named twice in one message; each may be there once", joint = pair[0]),
        )),
        None => Ok(names),
    }
}

/// Reads a list of numbers.
fn numbers(node: &Node, key: &str) -> Result<Vec<f64>, PlacedProblem> {
    match &node.value {
        Value::Numbers(numbers) => Ok(numbers.clone()),
        Value::Null => Ok(Vec::new()),
        Value::List(items) => {
            let number = |item: &Node| match &item.value {
                // JSON has no literal for NaN.
                Value::Null => Ok(f64::NAN),
                _ => item.number().ok_or_else(|| wrong(key, item, "numbers alone")),
            };
            items.iter().map(number).collect()
        }
        // Python's output of an array of numbers.
        Value::Text(text) if text.starts_with("array(") => {
            let inside = text.split_once('[').and_then(|(_, rest)| rest.split_once(']')).map(|(inside, _)| inside);
            let parts = inside.into_iter().flat_map(|inside| inside.split(',')).map(str::trim);
            let parsed: Result<Vec<f64>, _> = parts.filter(|part| !part.is_empty()).map(str::parse).collect();
            parsed.map_err(|_| wrong(key, node, "a list of numbers"))
        }
        _ => Err(wrong(key, node, "a list of numbers")),
    }
}

/// Optional list of numbers.
fn rates(node: &Node, key: &str) -> Result<Vec<f64>, PlacedProblem> {
    node.get(key).map_or(Ok(Vec::new()), |values| numbers(values, key))
}

/// The problem of a value of the wrong kind, or of one that `ros2 topic echo` did not print whole.
fn wrong(key: &str, node: &Node, expected: &'static str) -> PlacedProblem {
    if let Value::Text(text) = &node.value
        && (text.contains("...") || text.starts_with("<sequence type:") || text.starts_with("<array type:"))
    {
        return PlacedProblem::at(node.place, SHORTENED_ARRAY);
    }
    PlacedProblem::at(node.place, format!("`{key}` is {found}; expected {expected}", found = node.in_words()))
}

/// `header.stamp` in ns since 1970; 0 if missing.
fn stamp_ns(node: &Node) -> Result<i64, PlacedProblem> {
    let Some(stamp) = node.get("header").and_then(|header| header.get("stamp")) else { return Ok(0) };
    match (whole_ns(stamp), &stamp.value) {
        (Some(ns), _) => Ok(ns),
        // A number of this size is in ns since 1970.
        (None, Value::Whole(whole)) if *whole > 100_000_000_000_000_000 => Ok(*whole),
        // A float is as precise as it was written.
        _ => match stamp.number() {
            Some(seconds) if seconds.abs() < 9e9 => Ok((seconds * 1e9).round() as i64),
            _ => Err(wrong("stamp", stamp, "sec and nanosec, or seconds")),
        },
    }
}

/// Duration in s, given as seconds and nanoseconds or as one number.
fn duration_s(node: &Node) -> Result<f64, PlacedProblem> {
    match (whole_ns(node), node.number()) {
        (Some(ns), _) => Ok(ns as f64 / 1e9),
        (None, Some(seconds)) => Ok(seconds),
        _ => Err(wrong("time_from_start", node, "sec and nanosec, secs and nsecs, or seconds")),
    }
}

fn whole_ns(node: &Node) -> Option<i64> {
    let whole = |names: [&str; 3]| {
        let found = names.iter().find_map(|name| node.get(name))?;
        match found.value {
            Value::Whole(whole) => Some(whole),
            // Some JSON writers print 1 as 1.0.
            Value::Number(number) if number.fract() == 0.0 && number.abs() < 9e15 => Some(number as i64),
            _ => None,
        }
    };
    let sec = whole(["sec", "secs", "seconds"])?;
    let rest = if matches!(&node.value, Value::Map(pairs) if pairs.len() == 1) {
        0
    } else {
        whole(["nanosec", "nsecs", "nanoseconds"]).or_else(|| whole(["nsec", "nsec", "nsec"]))?
    };
    sec.checked_mul(1_000_000_000)?.checked_add(rest)
}
