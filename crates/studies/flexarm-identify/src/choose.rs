//! Choice of the parameters to fit, from the file of measurements or the request.

use crate::estimation::{Probe, Reading, ReadingKind};

use super::error::IdentifyFileError;
use super::file::MeasurementInput;
use super::parameters::{self, ParameterLocation};
use flexarm_run::Arm;
use flexarm_run::Error;
use flexarm_run::Robot;
use flexarm_run::RobotFileError;
use flexarm_run::TCP_FRAME;

/// Returns the parameters that the file or the request selects, in the robot's order.
pub(super) fn chosen(arm: &Arm, input: &MeasurementInput, fit: &[String]) -> Result<Vec<parameters::Candidate>, Error> {
    let all = parameters::candidates(arm.robot(), arm.flexible());
    // Only the first entry of each matrix is listed.
    let names = || {
        let all = all.iter().map(|c| c.parameter.name.clone());
        all.filter(|name| !parameters::is_entry(name) || name.ends_with("[0][0]")).collect::<Vec<_>>()
    };
    if all.is_empty() {
        return Err(IdentifyFileError::NothingGives.into());
    }
    let unknown =
        |pattern: &str| format!("no parameter of this robot matches {pattern:?}; its parameters are {:?}", names());
    let placed = |place: &RobotFileError, text: String| Error::from(RobotFileError { message: text, ..place.clone() });
    for (pattern, place) in input.fit.iter().chain(&input.keep) {
        if !all.iter().any(|c| parameters::fits(pattern, &c.parameter.name)) {
            return Err(placed(place, unknown(pattern)));
        }
    }
    if let Some(pattern) = fit.iter().find(|p| !all.iter().any(|c| parameters::fits(p, &c.parameter.name))) {
        return Err(IdentifyFileError::UnknownParameter { text: unknown(pattern) }.into());
    }
    let wanted = |name: &str| match (fit.is_empty(), input.fit.is_empty()) {
        (false, _) => fit.iter().any(|p| parameters::asks_for(p, name)),
        (true, false) => input.fit.iter().any(|(p, _)| parameters::asks_for(p, name)),
        // Masses, dampings and single directions of links are fitted only if named.
        (true, true) => name != "payload.mass" && !parameters::is_damping(name) && parameters::asks_for("*", name),
    };
    let kept = |name: &str| input.keep.iter().any(|(p, _)| parameters::fits(p, name));
    let mut chosen: Vec<_> = all.clone();
    chosen.retain(|c| wanted(&c.parameter.name) && !kept(&c.parameter.name));
    if chosen.is_empty() {
        return Err(IdentifyFileError::NothingFitted { known: names() }.into());
    }
    if let Some((entry, factor)) = said_twice(&chosen) {
        return Err(IdentifyFileError::Twice { entry, factor }.into());
    }
    for candidate in &mut chosen {
        let logarithmic = candidate.parameter.is_logarithmic();
        if let Some(factor) = input.uncertainty.filter(|_| logarithmic) {
            candidate.parameter.prior = factor.ln();
        }
    }
    for (name, uncertainty, place) in &input.known {
        let Some(candidate) = chosen.iter_mut().find(|c| c.parameter.name == *name) else {
            return Err(placed(
                place,
                format!("{name:?} is not fitted; the parameters of this robot are {:?}", names()),
            ));
        };
        let logarithmic = candidate.parameter.is_logarithmic();
        if logarithmic && *uncertainty <= 1.0 {
            let text = "the uncertainty of a stiffness or damping is a factor above 1: 1.5 means up to 1.5 times \
                        larger or smaller";
            return Err(placed(place, text.into()));
        }
        let unit = match candidate.parameter.unit.as_str() {
            "m" => input.length_m,
            "rad" => input.angle_rad,
            _ => 1.0,
        };
        candidate.parameter.prior = if logarithmic { uncertainty.ln() } else { *uncertainty * unit };
    }
    Ok(chosen)
}

/// Finds a fitted entry of a link's matrix together with a fitted factor on the same matrix.
fn said_twice(chosen: &[parameters::Candidate]) -> Option<(String, String)> {
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
pub(super) fn check_tool(
    robot: &Robot,
    chosen: &[parameters::Candidate],
    input: &MeasurementInput,
) -> Result<(), Error> {
    let Some(tool) = chosen.iter().find(|c| matches!(c.written, ParameterLocation::Tool { .. })) else { return Ok(()) };
    if let Some(link) = &robot.tcp_override {
        return Err(IdentifyFileError::OtherTool { name: tool.parameter.name.clone(), link: link.clone() }.into());
    }
    let on_tool = |probe: &Probe| probe.frame.name == TCP_FRAME;
    let mut readings = input.measurements.readings.iter();
    let seen = readings.find(|reading| match &reading.kind {
        ReadingKind::Response(response) => on_tool(&response.watched) || on_tool(&response.hit),
        ReadingKind::Shape(shape) => shape.probes.iter().any(on_tool),
        _ => false,
    });
    match seen {
        Some(Reading { name: reading, .. }) => {
            let name = tool.parameter.name.clone();
            Err(IdentifyFileError::ToolNode { name, reading: reading.clone() }.into())
        }
        None => Ok(()),
    }
}
