//! Settles the beams of a draft, and lists its assumptions and the questions that they raise.
//!
//! [`settle`] drops beams that the reader of robot files refuses, then lists what remains assumed.

use flexarm_run::{Description, Error, LoadOptions, RobotSource};
use flexarm_settings::Setting;

use super::draft::{Draft, DraftJoint, DraftLink, placeholders};
use super::place::Placed;
use super::report::Assumption;
use super::text;

/// Tries each beam in the robot file to be written: one that cannot be used is left out, with the
/// reason.
pub(crate) fn settle(draft: &mut Draft, placed: &Placed) -> Result<(), Error> {
    let loads = |draft: &Draft, beams: &[&DraftLink]| {
        let text = text::robot_file(draft, placed, beams);
        let description = Some(Description::Read(&draft.urdf));
        let options = &LoadOptions::default();
        RobotSource { text: Some(&text), description, ..RobotSource::new(&placed.robot_path, options) }.load()
    };
    loads(draft, &[])?;
    for k in 0..draft.links.len() {
        if draft.links[k].section.is_err() {
            continue;
        }
        if let Err(error) = loads(draft, &[&draft.links[k]]) {
            draft.links[k].section = Err(format!("the beam cannot be used: {error}").into());
        }
    }
    draft.assumptions = assumptions(draft);
    draft.questions = questions(draft);
    Ok(())
}

fn assumption(about: &str, text: String, mend: &str) -> Assumption {
    Assumption { about: about.to_owned(), text, mend: mend.to_owned() }
}

/// Lists the assumptions, those about the whole arm first.
fn assumptions(draft: &Draft) -> Vec<Assumption> {
    // Choice of the arm, inertias, masses, payload.
    let mut list = Vec::new();
    for choice in &draft.chain.choices {
        list.push(assumption("the arm", choice.clone(), &format!("choose another one with {} LINK", Setting::Tool)));
    }
    for link in &draft.waived {
        let text = "its moments of inertia are physically impossible (the maximum is above the sum of the others); \
                    used unchanged";
        list.push(assumption(&format!("link {link:?}"), text.into(), "correct them in the description"));
    }
    masses(draft, &mut list);
    if !draft.payload_known && draft.payload.mass == 0.0 {
        let text = "none: the effort limits do not allow one".to_owned();
        list.push(assumption("payload", text, &format!("{} KG, or payload in robot.toml", Setting::Payload)));
    }
    if !draft.payload_known && draft.payload.mass > 0.0 {
        let text = format!(
            "{} kg, at most 15 % of the moving mass ({:.1} kg) and within the effort limits, an aluminium cube at \
             the tool",
            draft.payload.mass, draft.moving_mass
        );
        list.push(assumption("payload", text, &format!("{} KG, or payload in robot.toml", Setting::Payload)));
    }
    // Joints, links, motion.
    draft.joints.iter().for_each(|joint| of_joint(joint, &mut list));
    for link in &draft.links {
        if let Ok(section) = &link.section {
            let text = format!(
                "it is modelled as a {}, assuming that all of its {:.2} kg is structural, of {}",
                section.words(),
                link.mass.unwrap_or(0.0),
                section.material
            );
            list.push(assumption(&format!("link {:?}", link.link), text, "flexarm reduce with a mesh of the casting"));
        }
    }
    for note in &draft.motion.notes {
        list.push(assumption("the sample motion", note.clone(), "check the effort limits of the description"));
    }
    list
}

/// Adds the assumptions about speed limit and reducer of a joint.
fn of_joint(joint: &DraftJoint, list: &mut Vec<Assumption>) {
    let name = format!("joint {:?}", joint.joint.name);
    if joint.speed_assumed {
        let unit = if joint.joint.kind.slides() { "m/s" } else { "rad/s" };
        let text = format!("its speed limit is unknown; the sample motion uses {} {unit}", joint.speed);
        list.push(assumption(&name, text, "add it to the description, or to [limits] of motion.toml"));
    }
    if let Some(gear) = &joint.gear {
        let of = match joint.effort_fault {
            None => format!("its effort limit {:.4} N m", joint.joint.limits.effort),
            Some(why) => format!(
                "the required torque, {:.0} N m against gravity and {:.0} N m in motion, because its effort \
                 limit {why}",
                joint.weight, joint.needed
            ),
        };
        let text = format!(
            "its reducer has {:.3e} N m/rad ({:.1e} to {:.1e}), typical of a rated torque of {:.0} N m, from {of}",
            gear.stiffness, gear.low, gear.high, joint.rated
        );
        list.push(assumption(&name, text, "ask the manufacturer for its torsional stiffness, or measure it"));
    }
}

/// Adds the assumptions about masses that are implausible for this arm.
fn masses(draft: &Draft, list: &mut Vec<Assumption>) {
    // Estimated masses.
    let own: f64 = draft.urdf.mechanism.links.iter().filter_map(|l| l.inertia).map(|i| i.mass).sum();
    let which = match draft.discarded.is_empty() {
        true => "links without <inertial>",
        false => "links without <inertial> or with a placeholder mass",
    };
    match draft.estimate {
        Some(flexarm_urdf::InertiaEstimate::TotalMass(mass)) => {
            let text = format!(
                "{which} have {mass} kg in total, distributed by the volumes of their meshes or by their lengths; \
                 all links have {own:.1} kg in total"
            );
            list.push(assumption("masses", text, "use the masses of the manufacturer"));
        }
        Some(flexarm_urdf::InertiaEstimate::Density(density)) => {
            let text = format!("{which} are solid bodies with {density} kg/m³");
            list.push(assumption("masses", text, "use the masses of the manufacturer"));
        }
        None => {}
    }
    if draft.idle_estimate {
        let text = format!(
            "no link lacks a mass, so none was estimated: the masses of the description are used, {own:.1} kg in total"
        );
        list.push(assumption("masses", text, "remove <inertial> from the description if its masses are unreliable"));
    }
    // Masses of the description that are doubtful or missing.
    let alike = placeholders(&draft.urdf.mechanism);
    let mass = alike.first().and_then(|name| draft.urdf.mechanism.link(name)?.inertia).map_or(0.0, |i| i.mass);
    if !alike.is_empty() && draft.discarded.is_empty() {
        let text = format!("{} links have {mass} kg each, which is a placeholder", alike.len());
        let mend = format!(
            "distribute the mass of the arm over these links with {} KG, by the volumes of their meshes or by \
             their lengths; ideally use the masses of the manufacturer",
            Setting::InertiaFromTotalMass
        );
        list.push(assumption("masses", text, &mend));
    }
    let missing = draft.urdf.warnings.iter().filter(|w| matches!(&*w.code, "missing-inertial" | "zero-mass"));
    for finding in missing {
        list.push(assumption(
            "masses",
            finding.message.clone(),
            &format!(
                "estimate them with {} KG or {} KG_PER_M3",
                Setting::InertiaFromTotalMass,
                Setting::InertiaFromDensity
            ),
        ));
    }
}

/// Lists the questions for the manufacturer, or quantities to measure.
fn questions(draft: &Draft) -> Vec<String> {
    // Quantities that decide the stiffness, then loads and limits.
    let mut list = Vec::new();
    let turning: Vec<&str> = draft.joints.iter().filter(|j| j.gear.is_some()).map(|j| j.joint.name.as_str()).collect();
    if !turning.is_empty() {
        list.push(format!(
            "torsional stiffness of the reducers of {}, in N m/rad at the output (or N m per arc minute, times \
             3438); at least the type of reducer, whose catalogue gives the value",
            turning.join(", ")
        ));
    }
    if !draft.payload_known {
        list.push("mass, centre of mass and inertia of the payload".into());
    }
    for link in draft.beams_with_sections() {
        list.push(format!(
            "link {:?}: wall thickness and material of the casting, and the share of the casting in its mass \
             (motors and gears add no stiffness); ideally a CAD model for meshing",
            link.link
        ));
    }
    let unsure: Vec<&str> =
        draft.joints.iter().filter(|j| j.effort_fault.is_some()).map(|j| j.joint.name.as_str()).collect();
    if !unsure.is_empty() {
        list.push(format!("maximum torque of {}", unsure.join(", ")));
    }
    let slow: Vec<&str> = draft.joints.iter().filter(|j| j.speed_assumed).map(|j| j.joint.name.as_str()).collect();
    if !slow.is_empty() {
        list.push(format!("maximum speed of {}", slow.join(", ")));
    }
    if draft.estimate.is_some() || draft.assumptions.iter().any(|a| a.about == "masses") {
        list.push("mass, centre of mass and inertia of each link".into());
    }
    list.push(
        "static deflection of the TCP under a known weight, in one or two poses, to validate the numbers above".into(),
    );
    list
}
