//! Closed loop entries of a robot file: from the text to a checked tree.
//!
//! Points are in link axes (m). Not here: the loops of a robot ([`crate::robot::loops`]).

use std::collections::BTreeMap;
use std::ops::Range;

use flexarm_files::Source;
use serde::Deserialize;
use toml::Spanned;

use crate::error::Error;
use crate::robot::Robot;
use crate::robot::balancer_entry::EndEntry;
use crate::robot::loops::RobotLoop;

/// A pin that closes a chain of links.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoopEntry {
    /// Name for messages; numbered by default.
    pub name: Option<Spanned<String>>,
    /// Link and position of the pin.
    pub pin: Spanned<EndEntry>,
    /// Axis of the pin in the axes of that link; by default that of the first revolute dependent
    /// joint.
    pub axis: Option<Spanned<[f64; 3]>>,
    /// Link and position of the eye through which the pin passes.
    pub eye: Spanned<EndEntry>,
    /// Joints that depend on the loop.
    pub dependent: Spanned<Vec<String>>,
    /// Joint values near which the loop is assembled (rad or m).
    #[serde(default)]
    pub at: BTreeMap<String, Spanned<f64>>,
}

/// Adds the loops of a file to a robot; collects the errors so that all are found.
pub(crate) fn add_loops(robot: &mut Robot, entries: &[Spanned<LoopEntry>], source: &Source, faults: &mut Vec<Error>) {
    let before = faults.len();
    let mut places: Vec<(String, Range<usize>)> = Vec::new();
    for (number, entry) in entries.iter().enumerate() {
        // Each entry on its own.
        let LoopEntry { name, pin, axis, eye, dependent, at } = entry.get_ref();
        let place = name.as_ref().map_or(dependent.span(), Spanned::span);
        let name = name.as_ref().map_or_else(|| format!("loop_{}", number + 1), |name| name.get_ref().clone());
        let Ok(joints) = <[String; 2]>::try_from(dependent.get_ref().clone()) else {
            let message = format!(
                "loop {name:?}: dependent names {} joints, expected two: pin and eye are two equations in their plane, so two joints of \
                 the loop follow from the others",
                dependent.get_ref().len()
            );
            faults.push(source.error(dependent.span(), message).into());
            continue;
        };
        let end = |end: &Spanned<EndEntry>| (end.get_ref().link.get_ref().clone(), end.get_ref().xyz);
        let own = RobotLoop {
            name: name.clone(),
            pin: end(pin),
            axis: axis.as_ref().map(|axis| *axis.get_ref()),
            eye: end(eye),
            dependent: joints,
            at: at.iter().map(|(joint, value)| (joint.clone(), *value.get_ref())).collect(),
        };
        match robot.add_loop(own) {
            Err(fault) => faults.push(source.error(place, fault.to_string()).into()),
            Ok(()) => places.push((name, place)),
        }
    }
    // Loops may depend on each other, so they are checked together.
    if faults.len() == before
        && let Err(fault) = robot.check_loops()
    {
        let is_it = |name: &String| matches!(&fault, Error::Loop { name: own, .. } if own == name);
        let place = places.iter().find(|(name, _)| is_it(name)).map_or(0..0, |(_, place)| place.clone());
        faults.push(source.error(place, fault.to_string()).into());
    }
}
