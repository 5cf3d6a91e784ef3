//! Assembles samples from the messages of their topics.

use std::collections::HashMap;

use mcap::records::Record;

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
    /// Load of one element; used by older files, which have it for every sample.
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

/// A message that does not have the form of its topic.
#[derive(Debug, thiserror::Error)]
#[error("a message {topic:?} that cannot be read, at {log_time_ns} ns")]
pub(super) struct UnreadableMessage {
    topic: Topic,
    log_time_ns: u64,
}

/// Assembles the messages of a sample.
pub(super) struct Assembly {
    channels: HashMap<u16, Topic>,
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
    seen: Vec<Topic>,
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
            channels: HashMap::new(),
            known,
            epoch_ns,
            step_s: header.step_s,
            joints: header.joints.len(),
            frames: Frames::of(header),
            sequence: None,
            log_time: 0,
            sample: Sample { elastic, ..Sample::default() },
            seen: Vec::new(),
            done: Sample::default(),
            done_topics: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Takes a record. Returns whether it starts a new sample; the previous one is then in
    /// [`Assembly::done`].
    pub(super) fn take(&mut self, record: &Record<'_>) -> Result<bool, UnreadableMessage> {
        match record {
            Record::Channel(channel) => {
                if let Some(topic) = self.known.get(&channel.topic) {
                    self.channels.insert(channel.id, *topic);
                }
                // With the topic of all elements present, the topics of single elements only serve
                // viewers.
                if self.channels.values().any(|topic| *topic == Topic::Elastic) {
                    self.channels.retain(|_, topic| !matches!(topic, Topic::Load(_) | Topic::Deflection(_)));
                }
                Ok(false)
            }
            Record::Message { header, data } => {
                let Some(&topic) = self.channels.get(&header.channel_id) else { return Ok(false) };
                let next = topic.is_of_a_sample() && self.sequence != Some(header.sequence);
                // Frames precede the rest of their sample and have their own sequence numbers.
                // Those of the last sample may follow it.
                let of_next = topic == Topic::Frames && self.log_time != header.log_time;
                let closed = (next || of_next) && self.close();
                if next {
                    (self.sequence, self.log_time) = (Some(header.sequence), header.log_time);
                    let time_ns = header.log_time.saturating_sub(self.epoch_ns);
                    (self.sample.time_s, self.sample.step) = exact_time(time_ns, self.step_s);
                }
                if self.message(topic, data).is_none() {
                    return Err(UnreadableMessage { topic, log_time_ns: header.log_time });
                }
                if topic.is_of_a_sample() {
                    self.seen.push(topic);
                }
                Ok(closed)
            }
            _ => Ok(false),
        }
    }

    /// Completes the current sample; returns whether there was one.
    pub(super) fn close(&mut self) -> bool {
        if self.seen.is_empty() {
            return false;
        }
        self.frames.poses(&mut self.sample);
        self.done.clone_from(&self.sample);
        self.seen.sort_unstable();
        self.done_topics.clone_from(&self.seen);
        self.seen.clear();
        true
    }

    /// Stores the numbers of a message; `None` if it does not have the form of its topic.
    fn message(&mut self, topic: Topic, data: &[u8]) -> Option<()> {
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
            Topic::Error => sample.error_world = six_vector(data)?,
            Topic::PathError => sample.error_path = six_vector(data)?,
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
            Topic::Load(k) => sample.elastic[k].load = six_vector(data)?,
            Topic::Deflection(k) => {
                // In older files, an array with names.
                let array = array(data).and_then(|values| values.try_into().ok());
                sample.elastic[k].deflection = array.or_else(|| six_vector(data))?;
            }
            Topic::StaticError => sample.static_m = array(data)?.try_into().ok()?,
            Topic::Contributions => {
                sample.contributions = array(data)?.chunks_exact(3).map(|part| [part[0], part[1], part[2]]).collect();
            }
            Topic::Gauges => sample.gauges = array(data)?,
            Topic::Energy => {
                let [kinetic, potential, elastic] = array(data)?.try_into().ok()?;
                sample.energy = crate::EnergySample { kinetic, potential, elastic };
            }
            Topic::Solver => sample.solver = array(data)?.try_into().ok()?,
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

fn six_vector(data: &[u8]) -> Option<[f64; 6]> {
    decode(data).map(|(_, values): (Header<'_>, _)| values)
}

fn array(data: &[u8]) -> Option<Vec<f64>> {
    decode(data).map(|(_, _, values): LabelledArray<'_>| values)
}
