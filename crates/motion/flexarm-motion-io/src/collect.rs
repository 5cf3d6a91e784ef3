//! Collects messages by topic and joint, and selects the topic.
//!
//! [`Collector::bytes`] and [`Collector::node`] take the messages of a file one after another, with
//! a bound on the memory that they need; [`Collector::choose`] selects the topic. Not here: the
//! file formats (`mcap`, `sqlite`, `text`), curves through the samples (`assemble`).

use std::collections::HashMap;
use std::rc::Rc;

use flexarm_settings::Setting;
use flexarm_trajectory::foreign_joints;

use crate::Request;
use crate::cdr::{Encoding, decode};
use crate::definition::{Definitions, plain_name};
use crate::error::PlacedProblem;
use crate::message::{Message, Points, State, motion_of};
use crate::value::Node;

/// Maximum number of positions of all topics together: about half a gigabyte with times, velocities
/// and accelerations.
const MAX_POSITIONS: usize = 12_000_000;
/// Maximum number of unrequested joint names kept for messages.
const MAX_FOREIGN: usize = 1000;

/// Samples of a joint on a topic, by message. Missing values are NaN.
#[derive(Debug, Default)]
pub(crate) struct Series {
    pub(crate) joint: String,
    /// `header.stamp`, ns; 0 if it is not set.
    pub(crate) stamp_ns: Vec<i64>,
    /// Time of reception, ns; 0 in texts.
    pub(crate) log_ns: Vec<i64>,
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

/// Trajectories of one message, with its time of reception (ns).
#[derive(Debug)]
pub(crate) struct Received {
    pub(crate) log_ns: i64,
    pub(crate) trajectories: Vec<Points>,
    pub(crate) start: Option<State>,
}

/// A topic, or a text.
#[derive(Debug, Default)]
pub(crate) struct Topic {
    pub(crate) name: String,
    /// Type of its messages, as given in the file.
    pub(crate) message: String,
    /// Encoding and definition of its messages; `None` if they hold no motion.
    pub(crate) reader: Option<(Encoding, Rc<Definitions>)>,
    /// Number of messages.
    pub(crate) count: usize,
    pub(crate) series: Vec<Series>,
    places: HashMap<Rc<str>, Option<usize>>,
    /// Joints that were not requested.
    pub(crate) foreign: Vec<String>,
    pub(crate) received: Vec<Received>,
    /// Field from which the positions of states come.
    pub(crate) of: &'static str,
    /// Number of states without a position for each requested joint.
    pub(crate) without_position: usize,
    /// Number of states whose velocities are not one per joint.
    pub(crate) unmatched_rates: usize,
    /// Problem with one of its messages.
    pub(crate) trouble: Option<PlacedProblem>,
}

/// All topics of a file.
#[derive(Debug)]
pub(crate) struct Collector<'a> {
    request: Request<'a>,
    pub(crate) topics: Vec<Topic>,
    positions: usize,
}

impl<'a> Collector<'a> {
    pub(crate) fn new(request: Request<'a>) -> Self {
        Self { request, topics: Vec::new(), positions: 0 }
    }

    /// Returns the index of a topic; adds it if there is none with this name and type.
    ///
    /// * `definition`: definition of its messages in the file.
    pub(crate) fn topic(&mut self, name: &str, message: &str, encoding: &str, definition: Option<&str>) -> usize {
        if let Some(known) = self.topics.iter().position(|topic| topic.name == name && topic.message == message) {
            return known;
        }
        let reader = reader(message, encoding, definition);
        let (name, message) = (name.to_owned(), message.to_owned());
        self.topics.push(Topic { name, message, reader, ..Topic::default() });
        self.topics.len() - 1
    }

    /// Whether a topic was requested.
    pub(crate) fn asked(&self) -> bool {
        self.request.topic.is_some()
    }

    /// Whether messages of a topic need to be decoded.
    pub(crate) fn wants(&self, topic: usize) -> bool {
        let Some(topic) = self.topics.get(topic) else { return false };
        let asked = self.request.topic.is_none_or(|asked| same_topic(asked, &topic.name));
        asked && topic.reader.is_some() && topic.trouble.is_none()
    }

    /// Counts a message and keeps its content. A problem is reported only if the topic is selected.
    ///
    /// # Errors
    /// More numbers than memory should hold.
    pub(crate) fn bytes(&mut self, index: usize, log_ns: i64, bytes: &[u8]) -> Result<(), PlacedProblem> {
        let Some(topic) = self.topics.get_mut(index) else { return Ok(()) };
        topic.count += 1;
        if !self.wants(index) {
            return Ok(());
        }
        let topic = &mut self.topics[index];
        let Some((encoding, definitions)) = topic.reader.clone() else { return Ok(()) };
        let taken = match decode(bytes, encoding, &definitions) {
            Ok(node) => self.node(index, log_ns, &node),
            Err(error) => {
                let message = topic.message.clone();
                Err(PlacedProblem::new(format!("a message of the type {message} cannot be read: {error}")))
            }
        };
        let topic = &mut self.topics[index];
        if let Err(trouble) = taken {
            topic.trouble = Some(trouble.in_message(&topic.name, topic.count));
        }
        if self.positions > MAX_POSITIONS {
            return Err(PlacedProblem::new(format!(
                "more than {MAX_POSITIONS} numbers, the limit; cut the recording, or leave out samples"
            )));
        }
        Ok(())
    }

    /// Keeps the content of a decoded message.
    ///
    /// # Errors
    /// A problem with its motion.
    pub(crate) fn node(&mut self, index: usize, log_ns: i64, node: &Node) -> Result<(), PlacedProblem> {
        let topic = &mut self.topics[index];
        match motion_of(node)? {
            None => {}
            Some(Message::State(state)) => self.positions += topic.state(log_ns, state, self.request.joints)?,
            Some(Message::Trajectories(trajectories, start)) => {
                for points in &trajectories {
                    self.positions += points.points.len() * points.joints.len();
                    for joint in &points.joints {
                        topic.place(joint, self.request.joints);
                    }
                }
                topic.received.push(Received { log_ns, trajectories, start });
            }
        }
        Ok(())
    }

    /// Checks that a requested topic holds messages that can be read.
    fn check_topic(&self, asked: &str) -> Result<(), PlacedProblem> {
        let asked_for = |topic: &&Topic| same_topic(asked, &topic.name);
        let others: Vec<String> =
            self.topics.iter().filter(|topic| topic.reader.is_some()).map(Topic::described).collect();
        let fail = |what: &str| {
            Err(PlacedProblem::new(format!(
                "the topic {asked:?} ({}) {what}; topics with motions are {readable}",
                Setting::Topic,
                readable = joined(&others)
            )))
        };
        match self.topics.iter().find(asked_for) {
            None => fail("is not in the file"),
            Some(topic) if topic.reader.is_none() => {
                fail(&format!("has messages of the type {}, which hold no motion", topic.message))
            }
            Some(topic) if topic.count == 0 => fail("has no messages"),
            Some(_) => Ok(()),
        }
    }

    /// Returns the selected topic and others that could be selected.
    ///
    /// # Errors
    /// No such topic, no topic with a motion, a problem with a message of the topic, or names that
    /// do not fit the robot.
    pub(crate) fn choose(mut self) -> Result<(Topic, Vec<String>), PlacedProblem> {
        let all: Vec<String> = self.topics.iter().map(Topic::described).collect();
        let readable = |topics: &[Topic]| -> Vec<String> {
            topics.iter().filter(|topic| topic.has_motion()).map(Topic::described).collect()
        };
        self.request.topic.map_or(Ok(()), |asked| self.check_topic(asked))?;
        // Preference: most moving joints, then measured before commanded motion, then most
        // messages.
        let rank = |topic: &Topic| {
            let filled = topic.series.iter().filter(|series| !series.position.is_empty()).count();
            let matched = if topic.received.is_empty() { filled } else { topic.series.len() };
            let kind = if topic.received.is_empty() { 1 + usize::from(topic.of == "position") } else { 0 };
            (matched, kind, topic.count)
        };
        let others = readable(&self.topics);
        let usable = |topic: &Topic| topic.has_motion() || topic.trouble.is_some();
        let best = (0..self.topics.len()).filter(|&i| usable(&self.topics[i])).max_by_key(|&i| {
            let topic = &self.topics[i];
            // The first one of equals.
            (topic.has_motion(), rank(topic), usize::MAX - i)
        });
        let Some(best) = best else {
            let none = PlacedProblem::new(format!(
                "no topic holds a motion: read are JointState, JointTrajectory and JointTrajectoryControllerState \
                 with at least one message; the topics are {found}",
                found = joined(&all)
            ));
            return Err(PlacedProblem { is_without_motion: true, ..none });
        };
        let mut topic = self.topics.swap_remove(best);
        if let Some(trouble) = topic.trouble.take() {
            return Err(trouble);
        }
        let mut names: Vec<String> = topic.series.iter().map(|series| series.joint.clone()).collect();
        names.extend(topic.foreign.iter().cloned());
        if topic.series.is_empty() {
            names.extend(self.topics.iter().flat_map(|topic| topic.foreign.iter().cloned()));
            names.sort();
            names.dedup();
        }
        if names.is_empty() {
            return Err(PlacedProblem::new("no position is a number; was the robot connected when this was recorded?"));
        }
        if let Some(joints) = self.request.joints {
            foreign_joints(&names, joints).map_err(PlacedProblem::new)?;
        }
        let own = topic.described();
        Ok((topic, others.into_iter().filter(|other| *other != own).collect()))
    }
}

impl Topic {
    /// Name, type and number of messages.
    pub(crate) fn described(&self) -> String {
        format!("{} ({}, {} messages)", self.name, self.message, self.count)
    }

    /// Whether the topic holds any motion, of any joints.
    pub(crate) fn has_something(&self) -> bool {
        self.has_motion() || self.without_position > 0
    }

    fn has_motion(&self) -> bool {
        !self.series.is_empty() || !self.foreign.is_empty() || !self.received.is_empty()
    }

    /// Index of a joint's series, if the joint is requested.
    fn place(&mut self, joint: &Rc<str>, wanted: Option<&[&str]>) -> Option<usize> {
        if let Some(place) = self.places.get(joint) {
            return *place;
        }
        let place = if wanted.is_none_or(|wanted| wanted.contains(&&**joint)) {
            self.series.push(Series { joint: joint.to_string(), ..Series::default() });
            Some(self.series.len() - 1)
        } else {
            if self.foreign.len() < MAX_FOREIGN {
                self.foreign.push(joint.to_string());
            }
            None
        };
        self.places.insert(joint.clone(), place);
        place
    }

    /// Keeps the values of the requested joints and returns their number.
    fn state(&mut self, log_ns: i64, mut state: State, wanted: Option<&[&str]>) -> Result<usize, PlacedProblem> {
        let places: Vec<Option<usize>> = state.joints.iter().map(|joint| self.place(joint, wanted)).collect();
        // Errors in the states of other devices, such as a gripper, are ignored.
        if places.iter().all(Option::is_none) {
            return Ok(0);
        }
        self.unmatched_rates += usize::from(state.check()?);
        if state.position.is_empty() {
            self.without_position += 1;
            return Ok(0);
        }
        self.of = state.of;
        let mut kept = 0;
        for (k, place) in places.into_iter().enumerate() {
            let Some(series) = place.and_then(|place| self.series.get_mut(place)) else { continue };
            series.stamp_ns.push(state.stamp_ns);
            series.log_ns.push(log_ns);
            series.position.push(state.position[k]);
            series.velocity.push(state.velocity.get(k).copied().unwrap_or(f64::NAN));
            series.acceleration.push(state.acceleration.get(k).copied().unwrap_or(f64::NAN));
            kept += 1;
        }
        Ok(kept)
    }
}

/// Encoding and definition of messages that may hold motion.
fn reader(message: &str, encoding: &str, definition: Option<&str>) -> Option<(Encoding, Rc<Definitions>)> {
    let encoding = match encoding {
        "cdr" => Encoding::Cdr,
        "ros1" => Encoding::Ros1,
        _ => return None,
    };
    let filed = definition.filter(|text| !text.trim().is_empty()).map(|text| Definitions::parse(message, text));
    let own = filed.filter(|filed| filed.fields(&plain_name(message)).is_some_and(|fields| !fields.is_empty()));
    let definitions = own.or_else(|| Definitions::known(message).filter(|_| encoding == Encoding::Cdr))?;
    let fields = definitions.fields(&definitions.root)?;
    let has = |name: &str| fields.iter().any(|field| &*field.name == name);
    let tells = (has("name") && has("position")) || definitions.has_field(&["joint_names"]);
    tells.then(|| (encoding, Rc::new(definitions)))
}

/// Whether two topic names are equal; `/joint_states` equals `joint_states`.
fn same_topic(asked: &str, name: &str) -> bool {
    asked.trim_start_matches('/') == name.trim_start_matches('/')
}

fn joined(topics: &[String]) -> String {
    const MAX: usize = 15;
    let mut text = topics.iter().take(MAX).cloned().collect::<Vec<_>>().join(", ");
    if topics.len() > MAX {
        text += &format!(", ... ({} in all)", topics.len());
    }
    if text.is_empty() { "none".to_owned() } else { text }
}
