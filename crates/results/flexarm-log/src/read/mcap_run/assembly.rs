//! Assembles samples from the messages of their topics.
//!
//! Start at [`Assembly::take`]. Messages of one sample have the same sequence number, except those
//! of frames, which have the same log time. Files of older versions are read too. Not here: records
//! ([`super::walk`]), poses in the world ([`super::frames`]).

use std::collections::HashMap;

use mcap::records::{MessageHeader, Record};

use super::frames::{Frames, pose};
use crate::mcap_file::channels::topic_names;
use crate::mcap_file::messages::{Header, JointState, LabelledArray, Time, decode};
use crate::read::exact_time;
use crate::{Event, EventKind, RunHeader, Sample, TwinSample};

/// Topic of the deflections and loads of all elements.
const ELASTIC: &str = "/elastic/joint_states";

/// Kind of a message, given by its topic; several topics make up one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Topic {
    Frames,
    FixedFrames,
    Joints,
    RigidJoints,
    Tool,
    RigidTool,
    Error,
    PathError,
    Elastic,
    /// Load and deflection of one element, in older files, which have them for every sample.
    Load(usize),
    Deflection(usize),
    StaticError,
    Contributions,
    Gauges,
    Energy,
    Solver,
    Events,
}

impl Topic {
    /// Whether every sample has such a message. Frames have fewer, except in older files.
    fn is_of_a_sample(self) -> bool {
        !matches!(self, Self::Frames | Self::FixedFrames | Self::Events)
    }
}

/// Form of a message with numbers, given by its type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// `sensor_msgs/JointState`.
    Named,
    /// `std_msgs/Float64MultiArray`, in older files.
    Array,
    /// `geometry_msgs/TwistStamped`, in older files, or `WrenchStamped`.
    Six,
    Other,
}

impl Form {
    fn of(schema: &str) -> Self {
        match schema {
            "sensor_msgs/msg/JointState" => Self::Named,
            "std_msgs/msg/Float64MultiArray" => Self::Array,
            "geometry_msgs/msg/TwistStamped" | "geometry_msgs/msg/WrenchStamped" => Self::Six,
            _ => Self::Other,
        }
    }

    /// Returns the numbers of a message; `None` if it does not have this form.
    fn numbers(self, data: &[u8]) -> Option<Vec<f64>> {
        match self {
            Self::Named => decode(data).map(|(_, _, values, ..): JointState<'_>| values),
            Self::Array => decode(data).map(|(_, _, values): LabelledArray<'_>| values),
            Self::Six => decode(data).map(|(_, values): (Header<'_>, [f64; 6])| values.to_vec()),
            Self::Other => None,
        }
    }
}

/// A message that does not have the form of its topic.
#[derive(Debug, thiserror::Error)]
#[error("a message {topic:?} that cannot be read, at {log_time_ns} ns")]
pub(super) struct UnreadableMessage {
    topic: Topic,
    log_time_ns: u64,
}

/// Assembles the messages of a sample.
pub(super) struct Assembly {
    schemas: HashMap<u16, Form>,
    channels: HashMap<u16, (Topic, Form)>,
    /// Known topic names of this run.
    known: HashMap<String, Topic>,
    epoch_ns: u64,
    step_s: f64,
    joints: usize,
    pub(super) frames: Frames,
    sequence: Option<u32>,
    /// Log time of the current sample (ns).
    log_time: u64,
    sample: Sample,
    /// Topics of the current sample so far.
    topics: Vec<Topic>,
    /// The last sample completed by [`Assembly::take`] or [`Assembly::close`], and its topics in
    /// order.
    pub(super) done: Sample,
    pub(super) done_topics: Vec<Topic>,
    pub(super) events: Vec<Event>,
}

impl Assembly {
    pub(super) fn new(header: &RunHeader, epoch_ns: u64) -> Self {
        let mut known: HashMap<String, Topic> = [
            ("/tf", Topic::Frames),
            ("/tf_static", Topic::FixedFrames),
            ("/joint_states", Topic::Joints),
            ("/rigid/joint_states", Topic::RigidJoints),
            ("/tcp/flexible", Topic::Tool),
            ("/tcp/rigid", Topic::RigidTool),
            ("/tcp/error", Topic::Error),
            ("/tcp/error_path", Topic::PathError),
            (ELASTIC, Topic::Elastic),
            ("/tcp/static_error", Topic::StaticError),
            ("/tcp/contributions", Topic::Contributions),
            ("/gauges", Topic::Gauges),
            ("/energy", Topic::Energy),
            ("/solver", Topic::Solver),
            ("/diagnostics/solver", Topic::Solver), // older files
            ("/events", Topic::Events),
        ]
        .map(|(name, topic)| (name.to_owned(), topic))
        .into();
        for (k, name) in topic_names(&header.elements).into_iter().enumerate() {
            known.insert(format!("/elastic/{name}"), Topic::Load(k));
            known.insert(format!("/elastic/{name}/deflection"), Topic::Deflection(k));
        }
        let elastic = vec![crate::ElasticSample::default(); header.elements.len()];
        Self {
            schemas: HashMap::new(),
            channels: HashMap::new(),
            known,
            epoch_ns,
            step_s: header.step_s,
            joints: header.joints.len(),
            frames: Frames::of(header),
            sequence: None,
            log_time: 0,
            sample: Sample { elastic, ..Sample::default() },
            topics: Vec::new(),
            done: Sample::default(),
            done_topics: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Takes a record. Returns whether it starts a new sample; the previous one is then in
    /// [`Assembly::done`].
    pub(super) fn take(&mut self, record: &Record<'_>) -> Result<bool, UnreadableMessage> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, Form::of(&header.name));
                Ok(false)
            }
            Record::Channel(channel) => {
                if let Some(topic) = self.known.get(&channel.topic) {
                    let form = self.schemas.get(&channel.schema_id).copied().unwrap_or(Form::Other);
                    self.channels.insert(channel.id, (*topic, form));
                }
                // With the topic of all elements present, the topics of single elements only serve
                // viewers.
                if self.channels.values().any(|(topic, _)| *topic == Topic::Elastic) {
                    self.channels.retain(|_, (topic, _)| !matches!(topic, Topic::Load(_) | Topic::Deflection(_)));
                }
                Ok(false)
            }
            Record::Message { header, data } => self.take_message(header, data),
            _ => Ok(false),
        }
    }

    /// Takes a message. Returns as [`Assembly::take`].
    fn take_message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<bool, UnreadableMessage> {
        let Some(&(topic, form)) = self.channels.get(&header.channel_id) else { return Ok(false) };
        // Frames precede the rest of their sample and have their own sequence numbers. Those of the
        // last sample may follow it.
        let is_next = topic.is_of_a_sample() && self.sequence != Some(header.sequence);
        let is_frame_of_next = topic == Topic::Frames && self.log_time != header.log_time;
        let closed = (is_next || is_frame_of_next) && self.close();
        if is_next {
            (self.sequence, self.log_time) = (Some(header.sequence), header.log_time);
            let time_ns = header.log_time.saturating_sub(self.epoch_ns);
            (self.sample.time_s, self.sample.step) = exact_time(time_ns, self.step_s);
        }
        // The values of the message.
        if self.message(topic, form, data).is_none() {
            return Err(UnreadableMessage { topic, log_time_ns: header.log_time });
        }
        if topic.is_of_a_sample() {
            self.topics.push(topic);
        }
        Ok(closed)
    }

    /// Completes the current sample; returns whether there was one.
    pub(super) fn close(&mut self) -> bool {
        if self.topics.is_empty() {
            return false;
        }
        self.frames.poses(&mut self.sample);
        self.done.clone_from(&self.sample);
        self.topics.sort_unstable();
        self.done_topics.clone_from(&self.topics);
        self.topics.clear();
        true
    }

    /// Stores the numbers of a message; `None` if it does not have the form of its topic.
    fn message(&mut self, topic: Topic, form: Form, data: &[u8]) -> Option<()> {
        let sample = &mut self.sample;
        match topic {
            Topic::Frames | Topic::FixedFrames => self.frames.take(decode(data)?),
            Topic::Joints => joint_state(data, self.joints, &mut sample.flexible)?,
            Topic::RigidJoints => joint_state(data, self.joints, &mut sample.rigid)?,
            Topic::Tool | Topic::RigidTool => {
                let twin = if topic == Topic::Tool { &mut sample.flexible } else { &mut sample.rigid };
                let (_, X_WT): (Header<'_>, _) = decode(data)?;
                twin.X_WT = pose(X_WT);
            }
            Topic::Error => sample.error_world = *form.numbers(data)?.first_chunk()?, // without the norm
            Topic::PathError => sample.error_path = form.numbers(data)?.try_into().ok()?,
            Topic::Elastic => {
                let (_, _, deflections, velocities, loads): JointState<'_> = decode(data)?;
                let whole = |values: &[f64]| values.len() == 6 * sample.elastic.len();
                if !(whole(&deflections) && velocities.is_empty() && whole(&loads)) {
                    return None;
                }
                let parts = deflections.as_chunks().0.iter().zip(loads.as_chunks().0);
                for (element, (deflection, load)) in sample.elastic.iter_mut().zip(parts) {
                    (element.deflection, element.load) = (*deflection, *load);
                }
            }
            Topic::Load(k) => sample.elastic[k].load = form.numbers(data)?.try_into().ok()?,
            Topic::Deflection(k) => sample.elastic[k].deflection = form.numbers(data)?.try_into().ok()?,
            Topic::StaticError => sample.static_m = form.numbers(data)?.try_into().ok()?,
            Topic::Contributions => {
                sample.contributions =
                    form.numbers(data)?.chunks_exact(3).map(|part| [part[0], part[1], part[2]]).collect();
            }
            Topic::Gauges => sample.gauges = form.numbers(data)?,
            Topic::Energy => {
                let [kinetic, potential, elastic] = form.numbers(data)?.try_into().ok()?;
                sample.energy = crate::EnergySample { kinetic, potential, elastic };
            }
            Topic::Solver => sample.solver = form.numbers(data)?.try_into().ok()?,
            Topic::Events => {
                let ((seconds, nanoseconds), _, kind, text): (Time, u8, &str, String) = decode(data)?;
                let time_ns = u64::from(seconds) * 1_000_000_000 + u64::from(nanoseconds);
                let time_s = time_ns.saturating_sub(self.epoch_ns) as f64 / 1e9;
                self.events.extend(EventKind::from_word(kind).map(|kind| Event { time_s, kind, text }));
            }
        }
        Some(())
    }
}

fn joint_state(data: &[u8], joints: usize, twin: &mut TwinSample) -> Option<()> {
    (_, _, twin.q, twin.qdot, twin.effort) = decode::<JointState<'_>>(data)?;
    [&twin.q, &twin.qdot, &twin.effort].iter().all(|values| values.len() == joints).then_some(())
}
