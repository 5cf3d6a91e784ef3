//! Messages as text: one document, or several as printed by `ros2 topic echo`.
//!
//! Start at [`read_text`]; [`is_message_text`] recognises such a text. JSON is YAML here. Not here:
//! the keys of the messages (`message`).

use flexarm_settings::{Finding, Setting};

use crate::assemble::assemble;
use crate::collect::Collector;
use crate::error::{MotionError, PlacedProblem};
use crate::value::{Node, Value};
use crate::{MessageMotion, Request, yaml};

/// Maximum length of a text (bytes); its tree takes about ten times as much memory.
const LONGEST: usize = 200 << 20;
/// Number of lines examined to recognise the kind of text.
const LOOKED_AT: usize = 400;
/// Keys of messages that hold motion or contain such messages.
const KEYS: [&str; 12] = [
    "joint_names",
    "points",
    "header",
    "name",
    "position",
    "trajectory",
    "joint_trajectory",
    "trajectory_start",
    "goal",
    "positions",
    "model_id",
    "feedback",
];

/// Whether a text looks like messages: JSON, or lines with keys of messages that hold motion.
pub fn is_message_text(text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.starts_with('{') || text.strip_prefix('[').is_some_and(|rest| rest.trim_start().starts_with('{')) {
        return true;
    }
    let has_key = |line: &str| {
        let line = line.trim_start().trim_start_matches("- ").trim_start();
        let key = line.split_once(':').map(|(key, _)| key.trim().trim_matches(['"', '\'']));
        key.is_some_and(|key| KEYS.contains(&key))
    };
    text.lines().take(LOOKED_AT).any(has_key)
}

/// Reads messages in YAML or JSON.
///
/// * `origin`: file name for messages.
///
/// # Errors
/// [`MotionError::Content`] with the line of the problem.
pub fn read_text(text: &str, origin: &str, request: &Request<'_>) -> Result<MessageMotion, MotionError> {
    read(text.trim_start_matches('\u{feff}'), origin, request).map_err(|trouble| trouble.of(origin))
}

/// Reads messages printed as YAML or JSON, one document each.
fn read(text: &str, origin: &str, request: &Request<'_>) -> Result<MessageMotion, PlacedProblem> {
    if let Some(asked) = request.topic {
        return Err(PlacedProblem::new(format!(
            "a topic was requested ({} {asked:?}), but a text of messages has none; leave it out",
            Setting::Topic
        )));
    }
    if text.len() > LONGEST {
        let message = format!("more than {LONGEST} bytes, the limit for such a file; record a bag instead, or cut it");
        return Err(PlacedProblem::new(message));
    }
    let mut collector = Collector::new(*request);
    let topic = collector.topic("text", "", "", None);
    let (mut documents, mut keys, mut pending) = (0_usize, String::new(), None);
    yaml::documents(text, &mut |node| {
        if let Some(trouble) = pending.take() {
            return Err(trouble);
        }
        if matches!(node.value, Value::Null) {
            return Ok(());
        }
        documents += 1;
        collector.topics[topic].count += 1;
        if keys.is_empty() {
            keys = top(&node);
        }
        pending = collector.node(topic, 0, &node).err();
        Ok(())
    })?;
    let mut caveats = Vec::new();
    if let Some(trouble) = pending {
        // The output of an interrupted program may end anywhere; a text of less than three
        // documents must be complete.
        if documents < 3 {
            return Err(trouble);
        }
        let message =
            format!("{origin}: the last of {documents} documents is not whole and is left out ({})", trouble.message);
        caveats.push(Finding::warning("motion-cut", origin, message, ""));
    }
    if !collector.topics[topic].has_something() {
        let message = format!(
            "there is no motion in the text: expected a JointTrajectory (`joint_names` and `points`), a JointState \
             (`name` and `position`) or the state of a controller (`joint_names` and `reference` or `desired`), at \
             any depth; its keys are {keys}"
        );
        return Err(PlacedProblem::new(message));
    }
    let (topic, _) = collector.choose()?;
    let dropped = topic.foreign.clone();
    let message = match (topic.received.is_empty(), topic.of) {
        (false, _) => "trajectory_msgs/JointTrajectory",
        (true, "position") => "sensor_msgs/JointState",
        _ => "control_msgs/JointTrajectoryControllerState",
    };
    let made = assemble(topic, origin, false)?;
    caveats.extend(made.caveats);
    let format = if text.trim_start().starts_with(['{', '[']) { "JSON message" } else { "YAML message" };
    let (trajectory, samples) = (made.trajectory, made.samples);
    Ok(MessageMotion { trajectory, format, topic: None, message: message.to_owned(), samples, dropped, caveats })
}

/// Keys of a document, for messages.
fn top(node: &Node) -> String {
    node.in_words()
}
