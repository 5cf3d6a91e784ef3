//! Choice of the parameters to fit, from the file of measurements or the request.
//!
//! Start at [`chosen`]. The request replaces the patterns of the file; `keep`, `tie` and
//! uncertainties of the file always apply. Not here: which parameters exist
//! ([`super::parameters`]).

use flexarm_run::{Arm, Error, Robot, TCP_FRAME};

use super::error::{at_place, refused};
use super::file::MeasurementInput;
use super::parameters::{self, Candidate, ParameterLocation};
use crate::estimation::{Probe, Reading, ReadingKind};

/// Returns the parameters that the file or the request selects, in the robot's order.
pub(super) fn chosen(arm: &Arm, input: &MeasurementInput, fit: &[String]) -> Result<Vec<Candidate>, Error> {
    let all = parameters::candidates(arm.robot(), arm);
    check_patterns(&all, input, fit)?;
    let wanted = |name: &str| match (fit.is_empty(), input.fit.is_empty()) {
        (false, _) => fit.iter().any(|p| parameters::asks_for(p, name)),
        (true, false) => input.fit.iter().any(|(p, _)| parameters::asks_for(p, name)),
        // Masses, dampings and single directions of links are fitted only if named.
        (true, true) => name != "payload.mass" && !parameters::is_damping(name) && parameters::asks_for("*", name),
    };
    let kept = |name: &str| input.keep.iter().any(|(p, _)| parameters::fits(p, name));
    let mut chosen: Vec<_> = all.clone();
    chosen.retain(|c| wanted(&c.parameter.name) && !kept(&c.parameter.name));
    if chosen.is_empty() && arm.springs.is_empty() {
        return Err(refused(
            "the robot has no flexible link and no elastic drive: there is no stiffness to identify; add \
             [[flexible_link]] or [[drive]] entries with initial values, or fit its frames by fit = [\"joint.*\"]",
        ));
    }
    if chosen.is_empty() {
        return Err(refused(format!("there is no parameter to fit: all of {:?} are kept", listed(&all))));
    }
    if let Some((entry, factor)) = redundant(&chosen) {
        return Err(refused(format!(
            "{entry} and {factor} describe the same stiffness: fit one of them and keep the other"
        )));
    }
    for (pattern, place) in &input.tie {
        tie(&mut chosen, pattern).map_err(|error| at_place(place, format!("tie {pattern:?}: {error}")))?;
    }
    set_priors(&mut chosen, input, &all)?;
    Ok(chosen)
}

/// Gives all parameters that match a pattern one value, under the name of the pattern.
fn tie(chosen: &mut Vec<Candidate>, pattern: &str) -> Result<(), String> {
    let (matching, others): (Vec<_>, Vec<_>) =
        std::mem::take(chosen).into_iter().partition(|c| parameters::fits(pattern, &c.parameter.name));
    *chosen = others;
    let mut matching = matching.into_iter();
    let mut first = matching.next().ok_or("no parameter that is fitted matches it")?;
    matching.try_for_each(|other| first.tie(&other))?;
    pattern.clone_into(&mut first.parameter.name);
    chosen.push(first);
    Ok(())
}

/// Returns the names of parameters for messages; of each matrix only the first entry is listed.
fn listed(all: &[Candidate]) -> Vec<String> {
    let all = all.iter().map(|c| c.parameter.name.clone());
    all.filter(|name| !parameters::is_entry(name) || name.ends_with("[0][0]")).collect()
}

/// Checks that each pattern of the file and of the request matches a parameter.
fn check_patterns(all: &[Candidate], input: &MeasurementInput, fit: &[String]) -> Result<(), Error> {
    let matches = |pattern: &str| all.iter().any(|c| parameters::fits(pattern, &c.parameter.name));
    let unknown =
        |pattern: &str| format!("no parameter of this robot matches {pattern:?}; its parameters are {:?}", listed(all));
    if let Some((pattern, place)) = input.fit.iter().chain(&input.keep).find(|(pattern, _)| !matches(pattern)) {
        return Err(at_place(place, unknown(pattern)));
    }
    match fit.iter().find(|pattern| !matches(pattern)) {
        Some(pattern) => Err(refused(unknown(pattern))),
        None => Ok(()),
    }
}

/// Sets the prior deviations of the parameters to the uncertainties of the file.
fn set_priors(chosen: &mut [Candidate], input: &MeasurementInput, all: &[Candidate]) -> Result<(), Error> {
    // One uncertainty for all factors.
    for candidate in chosen.iter_mut() {
        let logarithmic = candidate.parameter.is_logarithmic();
        if let Some(factor) = input.uncertainty.filter(|_| logarithmic) {
            candidate.parameter.prior = Some(factor.ln());
        }
    }
    // Uncertainties by name take precedence.
    for (pattern, uncertainty, place) in &input.known {
        let mut matching = chosen.iter_mut().filter(|c| parameters::fits(pattern, &c.parameter.name)).peekable();
        if matching.peek().is_none() {
            let text = format!("{pattern:?} is not fitted; the parameters of this robot are {:?}", listed(all));
            return Err(at_place(place, text));
        }
        for candidate in matching {
            let logarithmic = candidate.parameter.is_logarithmic();
            if logarithmic && *uncertainty <= 1.0 {
                let text = "the uncertainty of a stiffness or damping is a factor above 1: 1.5 means up to 1.5 times \
                            larger or smaller";
                return Err(at_place(place, text));
            }
            let unit = match candidate.parameter.unit.as_str() {
                "m" => input.length_m,
                "rad" => input.angle_rad,
                _ => 1.0,
            };
            candidate.parameter.prior = Some(if logarithmic { uncertainty.ln() } else { *uncertainty * unit });
        }
    }
    Ok(())
}

/// Finds a fitted entry of a link's matrix together with a fitted factor on the same matrix.
fn redundant(chosen: &[Candidate]) -> Option<(String, String)> {
    let factor_of = |own: &str| {
        let factors = chosen.iter().filter(|c| match &c.written {
            ParameterLocation::Link { link } | ParameterLocation::LinkDirection { link, .. } => link == own,
            _ => false,
        });
        factors.map(|c| c.parameter.name.clone()).next()
    };
    chosen.iter().find_map(|c| match &c.written {
        ParameterLocation::LinkEntry { link, .. } => Some((c.parameter.name.clone(), factor_of(link)?)),
        _ => None,
    })
}

/// Checks that the pose of the tool can be identified from these readings and written to the robot
/// file.
pub(super) fn check_tool(robot: &Robot, chosen: &[Candidate], input: &MeasurementInput) -> Result<(), Error> {
    let Some(tool) = chosen.iter().find(|c| matches!(c.written, ParameterLocation::Tool { .. })) else { return Ok(()) };
    if let Some(link) = &robot.tcp_override {
        return Err(refused(format!(
            "{} describes the tool of the robot file, but link {link:?} was chosen as the TCP at loading: do not choose \
             it",
            tool.parameter.name
        )));
    }
    let on_tool = |probe: &Probe| probe.frame.name == TCP_FRAME;
    let mut readings = input.measurements.readings.iter();
    let at_tool = readings.find(|reading| match &reading.kind {
        ReadingKind::Response(response) => on_tool(&response.watched) || on_tool(&response.hit),
        ReadingKind::Shape(shape) => shape.probes.iter().any(on_tool),
        _ => false,
    });
    match at_tool {
        Some(Reading { name: reading, .. }) => Err(refused(format!(
            "{reading} is measured or excited at a node on the tool, which {} would move: define the node on the link \
             that carries the sensor, with its position there",
            tool.parameter.name
        ))),
        None => Ok(()),
    }
}
