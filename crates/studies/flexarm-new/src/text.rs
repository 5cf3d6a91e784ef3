//! The files as text: `robot.toml`, `motion.toml`, `README.md`.
//!
//! [`robot_file`], [`motion_file`] and [`readme`] write what the draft contains. Every assumed
//! value has a comment with its origin. Not here: the values ([`super::draft`]), the assumptions
//! ([`super::settle`]).

use std::fmt::Write;

use flexarm_settings::written::{markdown, markdown_code, one_line as inline};

use super::beams::BeamSection;
use super::draft::{Draft, DraftLink};
use super::gears::three_digits;
use super::place::Placed;

/// Maximum plausible effort limit of a joint of an arm (N m).
const MAX_EFFORT: f64 = 1e6;

/// Quotes a text as a TOML string, also for keys.
fn quoted(text: &str) -> String {
    // JSON escapes are valid in TOML, except for DEL.
    serde_json::to_string(text).unwrap_or_default().replace('\u{7f}', "\\u007F")
}

/// Formats a float for TOML, rounded to the given number of decimals.
fn float(value: f64, digits: i32) -> String {
    let scale = 10f64.powi(digits);
    let value = (value * scale).round() / scale;
    format!("{:?}", if value == 0.0 { 0.0 } else { value })
}

/// Formats a vector for TOML.
fn vector(values: &[f64; 3], digits: i32) -> String {
    format!("[{}]", values.map(|x| float(x, digits)).join(", "))
}

/// Returns the sizes of a section as keys of the robot file (m).
fn beam_keys(s: &BeamSection, wall: Option<f64>) -> String {
    match (s.section, wall) {
        ("tube", Some(wall)) => format!("outer_diameter = {}, wall = {}", float(s.width, 5), float(wall, 5)),
        ("circle", _) => format!("diameter = {}", float(s.width, 5)),
        (_, Some(wall)) => {
            format!("width = {}, height = {}, wall = {}", float(s.width, 5), float(s.height, 5), float(wall, 5))
        }
        _ => format!("width = {}, height = {}", float(s.width, 5), float(s.height, 5)),
    }
}

/// Returns the robot file with these links flexible.
pub(crate) fn robot_file(draft: &Draft, placed: &Placed, beams: &[&DraftLink]) -> String {
    let mut t = String::new();
    // Writing to a String cannot fail.
    let _ = head(&mut t, draft, placed);
    let _ = efforts(&mut t, draft);
    let _ = masses(&mut t, draft);
    let _ = tool(&mut t, draft);
    let _ = fixed_joints(&mut t, draft);
    let _ = links(&mut t, draft, beams);
    let _ = drives(&mut t, draft);
    t
}

/// Writes name, description, motion and the waived inertias.
fn head(t: &mut String, draft: &Draft, placed: &Placed) -> std::fmt::Result {
    writeln!(
        t,
        "# {}: made by flexarm new. Values marked ASSUMED are not in the description: replace them by better ones.",
        inline(&draft.name)
    )?;
    writeln!(t, "# All keys: flexarm format robot. Motion: motion.toml. Findings and open questions: README.md.")?;
    writeln!(t, "format = 1\nname = {}", quoted(&draft.name))?;
    writeln!(t, "urdf = {}", quoted(&placed.reference))?;
    writeln!(t, "default_trajectory = \"motion.toml\"")?;
    let table = |pairs: &[(String, String)]| {
        let pairs: Vec<String> = pairs.iter().map(|(k, v)| format!("{} = {}", quoted(k), quoted(v))).collect();
        pairs.join(", ")
    };
    if !placed.packages.is_empty() {
        writeln!(t, "packages = {{ {} }}", table(&placed.packages))?;
    }
    if !placed.arguments.is_empty() {
        writeln!(t, "args = {{ {} }}", table(&placed.arguments))?;
    }
    if !draft.waived.is_empty() {
        let names: Vec<String> = draft.waived.iter().map(|n| quoted(n)).collect();
        writeln!(t, "\n# Physically impossible moments of inertia, used unchanged: correct them in the description.")?;
        writeln!(t, "waive_inertia = [{}]", names.join(", "))?;
    }
    Ok(())
}

/// Writes the masses that are ignored, and the estimate that replaces them.
fn masses(t: &mut String, draft: &Draft) -> std::fmt::Result {
    if !draft.discarded.is_empty() {
        let names: Vec<String> = draft.discarded.iter().map(|n| quoted(n)).collect();
        writeln!(t, "\n# The mass of these links is a placeholder, the same for all: it is ignored.")?;
        writeln!(t, "discard_inertia = [{}]", names.join(", "))?;
    }
    match draft.estimate {
        Some(flexarm_urdf::InertiaEstimate::TotalMass(mass)) => {
            writeln!(
                t,
                "\n# ASSUMED: total mass (kg) of the links without <inertial>, distributed by the volume of their \
                 meshes."
            )?;
            writeln!(t, "inertia_from_total_mass = {mass:?}")?;
        }
        Some(flexarm_urdf::InertiaEstimate::Density(density)) => {
            writeln!(t, "\n# ASSUMED: links without <inertial> are solid bodies of this density (kg/m³).")?;
            writeln!(t, "inertia_from_density = {density:?}")?;
        }
        None => {
            if draft.urdf.warnings.iter().any(|w| matches!(&*w.code, "missing-inertial" | "zero-mass")) {
                writeln!(t, "\n# Some moving links have no mass in the description. To give them one:")?;
                writeln!(t, "# inertia_from_total_mass =     # kg, total of these links")?;
            }
        }
    }
    Ok(())
}

/// Writes TCP and payload.
fn tool(t: &mut String, draft: &Draft) -> std::fmt::Result {
    writeln!(
        t,
        "\n# The TCP, in the frame of link {}. Move it to the working point of the tool with xyz (m) and rpy (rad).",
        inline(&draft.chain.tool)
    )?;
    writeln!(t, "tcp = {{ link = {}, xyz = [0.0, 0.0, 0.0], rpy = [0.0, 0.0, 0.0] }}", quoted(&draft.chain.tool))?;
    // The payload, or a comment with its format.
    let p = &draft.payload;
    if p.mass > 0.0 {
        let origin =
            if draft.payload_known { "mass as given, shape ASSUMED" } else { "ASSUMED: about 15 % of the moving mass" };
        writeln!(
            t,
            "\n# {origin}: an aluminium cube centred at the origin of the tool frame. com in m, inertia ixx iyy \
             izz ixy ixz iyz in kg m²."
        )?;
        let moment = format!("{:?}", three_digits(p.moment()));
        writeln!(
            t,
            "payload = {{ link = {}, mass = {:?}, com = [0.0, 0.0, 0.0], inertia = [{moment}, {moment}, {moment}, 0.0, 0.0, 0.0] }}",
            quoted(&draft.chain.tool),
            p.mass
        )?;
    } else {
        writeln!(
            t,
            "\n# No payload. Example: payload = {{ link = {}, mass = 5.0, com = [0.0, 0.0, 0.05] }}",
            inline(&quoted(&draft.chain.tool))
        )?;
    }
    Ok(())
}

/// Writes the joints that are held.
fn fixed_joints(t: &mut String, draft: &Draft) -> std::fmt::Result {
    if !draft.held.is_empty() {
        writeln!(t, "\n# Positions of the joints that are not part of the arm (rad, m).\n[hold]")?;
        for (joint, at, why) in &draft.held {
            writeln!(t, "{} = {at:?}   # {why}", quoted(joint))?;
        }
    }
    Ok(())
}

/// Writes infinite effort limits for those of the description that are implausible.
fn efforts(t: &mut String, draft: &Draft) -> std::fmt::Result {
    let of_arm = draft.joints.iter().filter(|j| j.effort_fault.is_some()).map(|j| &j.joint);
    let known = |effort: f64| of_arm.clone().any(|joint| joint.limits.effort == effort);
    let is_senseless = |effort: f64| effort <= 0.0 || effort > MAX_EFFORT || known(effort);
    let others = draft.chain.held.iter().map(|&(k, _)| &draft.urdf.mechanism.joints[k]);
    let others = others.filter(|joint| is_senseless(joint.limits.effort));
    let named: Vec<String> = of_arm
        .clone()
        .chain(others)
        .filter(|joint| joint.limits.effort.is_finite())
        .map(|joint| format!("{} = inf", quoted(&joint.name)))
        .collect();
    if named.is_empty() {
        return Ok(());
    }
    writeln!(t, "\n# The effort limits of these joints in the description are implausible and ignored (N m).")?;
    writeln!(t, "effort_limit = {{ {} }}", named.join(", "))
}

/// Writes the flexible links, and the reason why others are rigid.
fn links(t: &mut String, draft: &Draft, beams: &[&DraftLink]) -> std::fmt::Result {
    writeln!(
        t,
        "\n# Flexible links. Sections: the outline of the mesh across the line between the joints, hollow so that \
         the link has its"
    )?;
    writeln!(t, "# mass. ASSUMED: the material, and all of the mass in the wall: an upper estimate of the stiffness.")?;
    for link in beams {
        // A link without a usable section stays rigid; the notes say why.
        let Ok(s) = &link.section else { continue };
        section_notes(t, link, s)?;
        writeln!(t, "[[flexible_link]]\nlink = {}\ndistal = {}", quoted(&link.link), quoted(&link.distal))?;
        writeln!(t, "damping = {{ modal = 0.03 }}   # ASSUMED: 3 % of critical, typical of jointed structures")?;
        let mut beam = format!("section = {:?}, {}, material = {:?}", s.section, beam_keys(s, s.wall), s.material);
        let _ = write!(beam, ", y_axis = {}", vector(&s.y_axis, 6));
        if let Some(ends) = &s.ends {
            let [from, to] = ends.map(|end| vector(&end, 5));
            let _ = write!(beam, ", ends = [{from}, {to}]");
        }
        if s.offset != [0.0; 3] {
            let _ = write!(beam, ", offset = {}", vector(&s.offset, 5));
        }
        writeln!(t, "beam = {{ {beam}, parts = \"from-link\" }}")?;
    }
    let others: Vec<&DraftLink> = draft.links.iter().filter(|l| l.section.is_err()).collect();
    if !others.is_empty() {
        writeln!(t, "\n# Rigid, because no section could be proposed:")?;
        for link in others {
            let reason = link.section.as_ref().err().map(|r| inline(&r.to_string())).unwrap_or_default();
            writeln!(t, "#   {}: {reason}", inline(&link.link))?;
        }
    }
    Ok(())
}

/// Writes size and mass of a link, and how far its section can be trusted.
fn section_notes(t: &mut String, link: &DraftLink, s: &BeamSection) -> std::fmt::Result {
    writeln!(t, "\n# {:.0} mm long, {:.2} kg: a {}.", 1e3 * link.length, link.mass.unwrap_or(0.0), s.words())?;
    // Why the beam may differ from the link: its ends, its outline, its width, holes in the mesh.
    if s.ends.is_some() {
        writeln!(
            t,
            "# The frames of the description are not along it: ends are those of its geometry between the \
             joint axes."
        )?;
    }
    if link.of_collisions {
        writeln!(t, "# The outline is that of the collision geometry, which is often larger.")?;
    }
    if s.taper > 1.25 {
        writeln!(
            t,
            "# Its width varies by a factor of {:.1}: this is the uniform beam with the same tip deflection \
             under a force.",
            s.taper
        )?;
    }
    if s.open > 0.0 {
        writeln!(
            t,
            "# {:.0} % of the sections of the mesh are not closed: their convex hull is used.",
            100.0 * s.open
        )?;
    }
    // The other bound of the wall: the proposal has all of the mass in it.
    if let Some(half) = s.wall_of_half {
        writeln!(
            t,
            "# If only half of the mass is in the wall (the rest is motors and gears): wall = {}",
            float(half, 5)
        )?;
    }
    Ok(())
}

/// Writes the reducers with the origin of their stiffness.
fn drives(t: &mut String, draft: &Draft) -> std::fmt::Result {
    writeln!(
        t,
        "\n# Reducers. All values ASSUMED: stiffness (N m/rad at the joint) of the class of reducers with the \
         rated torque, with"
    )?;
    writeln!(t, "# the range of the class. Damping is omitted: 3 % of critical.")?;
    for joint in &draft.joints {
        let name = &joint.joint.name;
        // No class of reducers for the joint: it stays rigid.
        let Some(gear) = &joint.gear else {
            let why = if joint.joint.kind.slides() {
                "it slides: the classes of reducers have no stiffness for prismatic joints"
            } else {
                "it carries no load"
            };
            writeln!(t, "\n# {} follows the motion exactly; {why}.", inline(name))?;
            continue;
        };
        let of = match joint.effort_fault {
            None => format!("effort limit {:.4} N m divided by 2.5", joint.joint.limits.effort),
            Some(why) => format!(
                "its effort limit {why}, so from the required torque: {:.1} N m against gravity, {:.1} N m in motion",
                joint.weight, joint.needed
            ),
        };
        writeln!(t, "\n# Rated torque {:.1} N m: {of}.", joint.rated)?;
        writeln!(t, "# Source: {}.", gear.source)?;
        writeln!(t, "# Range: {:.2e} to {:.2e} N m/rad.", gear.low, gear.high)?;
        writeln!(t, "[[drive]]\njoint = {}\nkind = \"gearbox\"", quoted(name))?;
        writeln!(t, "gearbox = {{ stiffness = {:?} }}", three_digits(gear.stiffness))?;
    }
    Ok(())
}

/// Returns the sample motion file.
pub(crate) fn motion_file(draft: &Draft) -> String {
    let mut t = String::new();
    let _ = write_motion(&mut t, draft);
    t
}

/// Writes the sample motion: header, joints and start, assumed limits, moves.
fn write_motion(t: &mut String, draft: &Draft) -> std::fmt::Result {
    // Joints of the motion, with their values in degrees and metres.
    let names: Vec<String> = draft.joints.iter().map(|j| quoted(&j.joint.name)).collect();
    let sliding: Vec<String> =
        draft.joints.iter().filter(|j| j.joint.kind.slides()).map(|j| quoted(&j.joint.name)).collect();
    let values = |at: &[f64]| {
        let value = |(x, joint): (&f64, &super::draft::DraftJoint)| {
            if joint.joint.kind.slides() { float(*x, 4) } else { float(x.to_degrees(), 1) }
        };
        let list: Vec<String> = at.iter().zip(&draft.joints).map(value).collect();
        format!("[{}]", list.join(", "))
    };
    writeln!(
        t,
        "# A sample motion of {}, from rest to rest through its workspace, made by flexarm new.",
        inline(&draft.name)
    )?;
    writeln!(
        t,
        "# Within the position limits, at most 60 % of the speed limits, and within the effort limits that are \
         plausible."
    )?;
    writeln!(
        t,
        "# Collisions with the surroundings and between links are not checked: review the motion before using it \
         on a real arm."
    )?;
    writeln!(t, "# All keys: flexarm format motion. Check against the limits: flexarm motion motion.toml robot.toml")?;
    writeln!(t, "format = 1\nunit = \"deg\"")?;
    if !sliding.is_empty() {
        writeln!(t, "metres = [{}]", sliding.join(", "))?;
    }
    writeln!(t, "joints = [{}]", names.join(", "))?;
    let rests = &draft.motion.rests;
    writeln!(t, "start = {}", values(&rests[0].at))?;
    writeln!(t, "profile = \"quintic\"          # continuous speed and acceleration")?;
    let assumed: Vec<_> = draft.joints.iter().filter(|j| j.speed_assumed).collect();
    if !assumed.is_empty() {
        writeln!(t, "\n# ASSUMED: the description has no speed limits for these joints.\n[limits]")?;
        for joint in assumed {
            let value =
                if joint.joint.kind.slides() { float(joint.speed, 4) } else { float(joint.speed.to_degrees(), 1) };
            writeln!(t, "{} = {{ velocity = {value} }}", quoted(&joint.joint.name))?;
        }
    }
    // One move per rest, the last one back to the start.
    let last = rests.len() - 1;
    for (k, rest) in rests.iter().enumerate().skip(1) {
        let to = if k == last { "back to the start".to_owned() } else { format!("stop {k}") };
        writeln!(
            t,
            "\n[[move]]                      # {to}\nto = {}\nduration = {}",
            values(&rest.at),
            float(rest.duration, 1)
        )?;
        writeln!(t, "hold = {}", if k == last { "1.0                    # to show the settling" } else { "0.5" })?;
    }
    Ok(())
}

/// Returns the README: findings, assumptions and next measurements.
pub(crate) fn readme(draft: &Draft, placed: &Placed) -> String {
    let mut t = String::new();
    let _ = write_readme(&mut t, draft, placed);
    t
}

/// Writes what was found, what is assumed, and what to ask for.
fn write_readme(t: &mut String, draft: &Draft, placed: &Placed) -> std::fmt::Result {
    let joint = |k: &usize| &draft.urdf.mechanism.joints[*k];
    writeln!(t, "# {}\n\nMade by `flexarm new`; {}.\n", markdown(&draft.name), markdown(&placed.words))?;
    // Commands that work in the folder.
    writeln!(
        t,
        "```sh\nflexarm compare .            # the arm against its rigid twin on motion.toml\n\
         flexarm check .              # errors and doubtful values"
    )?;
    writeln!(t, "flexarm motion motion.toml . # the motion against the limits\n```\n\n## Found\n")?;
    // Contents of the description: chain, joints, links, mass, fixed joints.
    writeln!(
        t,
        "* The arm starts at {} and ends at the tool {}, at most {:.2} m from its first joint in the poses that \
         were examined.",
        markdown_code(&draft.chain.base),
        markdown_code(&draft.chain.tool),
        draft.reach
    )?;
    let names: Vec<String> = draft.joints.iter().map(|j| markdown_code(&j.joint.name)).collect();
    writeln!(t, "* Its joints: {}.", names.join(", "))?;
    let links: Vec<String> = draft.chain.path.iter().map(|k| markdown_code(&joint(k).child)).collect();
    writeln!(t, "* Its links after the base: {}.", links.join(", "))?;
    writeln!(t, "* Their total mass is {:.2} kg, without payload.", draft.moving_mass)?;
    for (joint, at, why) in &draft.held {
        writeln!(t, "* {} is held at {at}: {why}.", markdown_code(joint))?;
    }
    joint_table(t, draft)?;
    link_table(t, draft)?;
    writeln!(t, "\n## Assumed\n")?;
    for a in &draft.assumptions {
        writeln!(t, "* {}: {}. Better: {}.", markdown(&a.about), markdown(&a.text), markdown(&a.mend))?;
    }
    writeln!(t, "\n## To ask the manufacturer, or to measure\n")?;
    for question in &draft.questions {
        writeln!(t, "* {}.", markdown(question))?;
    }
    Ok(())
}

/// Writes the table of the joints.
fn joint_table(t: &mut String, draft: &Draft) -> std::fmt::Result {
    writeln!(
        t,
        "\n| joint | effort limit | gravity torque | torque in motion | reducer, N m/rad | range |\n\
         | --- | --- | --- | --- | --- | --- |"
    )?;
    for j in &draft.joints {
        let effort = j.joint.limits.effort;
        let effort = if effort.is_finite() { format!("{effort:.1}") } else { "none".into() };
        let effort =
            j.effort_fault.filter(|_| effort != "none").map_or(effort.clone(), |why| format!("{effort} ({why})"));
        let (k, range) = j.gear.as_ref().map_or(("none".into(), "".into()), |g| {
            (format!("{:.3e}", g.stiffness), format!("{:.1e} to {:.1e}", g.low, g.high))
        });
        let name = markdown_code(&j.joint.name);
        writeln!(t, "| {name} | {effort} | {:.1} | {:.1} | {k} | {range} |", j.weight, j.needed)?;
    }
    writeln!(t, "\nTorques in N m (forces in N), with payload, maxima over the workspace.")
}

/// Writes the table of the links.
fn link_table(t: &mut String, draft: &Draft) -> std::fmt::Result {
    writeln!(t, "\n| link | length, mm | mass, kg | section |\n| --- | --- | --- | --- |")?;
    for link in &draft.links {
        let section = match &link.section {
            Ok(section) => section.words(),
            Err(reason) => format!("none: {}", markdown(&reason.to_string())),
        };
        let mass = link.mass.map_or("not known".into(), |m| format!("{m:.2}"));
        writeln!(t, "| {} | {:.0} | {mass} | {section} |", markdown_code(&link.link), 1e3 * link.length)?;
    }
    Ok(())
}
