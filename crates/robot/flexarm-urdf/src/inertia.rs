//! Masses and inertias: transformed to link axes, checked for physical validity, and on request
//! estimated from meshes.
//!
//! Frames: L link, I the axes of `<inertial>`, R the root link of a moving body (links fixed to
//! each other).
//!
//! Start at [`link_inertias`]. Checks refer to the centre of mass and are relative to the largest
//! principal moment. Not here: volumes of meshes ([`crate::mesh`]), bodies ([`crate::tree`]).

use flexarm_kinematics::{LinkInertia, SpatialInertia, moment_floor};
use flexarm_settings::{Finding, Setting, closest};
use nalgebra::{Matrix3, Vector3};

use crate::raw::{RawInertial, RawLink, RawRobot};
use crate::read::{InertiaEstimate, ReadOptions};
use crate::report::{Report, did_you_mean, quoted};
use crate::shapes::LinkShape;
use crate::tree::Body;

/// Relative tolerance of the checks, that of single-precision files.
const TOLERANCE: f64 = 1e-6;
/// Range of the mass of an arm over the volume of its outer shape (kg/m³): castings with drives in
/// them have 800 to 3000.
const SOLID: std::ops::RangeInclusive<f64> = 150.0..=9000.0;

/// Returns the inertia of each link; `None` for massless frames. Faults go to the report.
///
/// `bodies` is empty if the tree is broken: then missing masses are not reported.
pub(crate) fn link_inertias(
    robot: &RawRobot,
    bodies: &[Body],
    shapes: &[LinkShape],
    options: &ReadOptions,
    report: &mut Report,
) -> Vec<Option<LinkInertia>> {
    let mut inertias: Vec<Option<LinkInertia>> =
        robot.links.iter().map(|l| l.inertial.as_ref().map(in_link_axes)).collect();
    let (waived, discarded) = ("the inertia check is waived for", "the inertia is discarded of");
    check_names(robot, &options.waive, waived, "waived-unknown-link", report);
    check_names(robot, &options.discard, discarded, "discarded-unknown-link", report);
    let failures = match options.inertia_from_mesh {
        Some(estimate) => fill_from_shapes(robot, bodies, shapes, estimate, &mut inertias, report),
        None => vec![None; robot.links.len()],
    };

    // Each link. Links on the base do not affect the motion, so warnings suffice.
    let mut moves = vec![true; robot.links.len()];
    for body in bodies.iter().filter(|b| b.moved_by.is_none()) {
        body.members.iter().for_each(|&(link, _)| moves[link] = false);
    }
    let mut without_extent = vec![false; robot.links.len()];
    for (i, link) in robot.links.iter().enumerate() {
        let (Some(raw), Some(inertia)) = (&link.inertial, &inertias[i]) else { continue };
        if raw.faulty {
            continue;
        }
        if raw.mass < 0.0 {
            let message = format!("link {:?} has the mass {} kg, expected a positive one", link.name, raw.mass);
            let help = "correct the sign; a counterweight has positive mass too";
            report.error(&raw.place, "negative-mass", message, help);
            continue;
        }
        if raw.mass == 0.0 && !link.visuals.is_empty() {
            let message = format!("link {:?} has a shape and no mass", link.name);
            report.warning(&raw.place, "massless-shape", message, "give the link its mass");
        }
        without_extent[i] = check_moments(&link.name, raw, inertia, moves[i], options, report);
        if raw.mass > 0.0 && !options.waive.contains(&link.name) {
            plausible(&link.name, raw, inertia, &shapes[i], report);
        }
    }

    // Each moving body.
    let mut massless = Vec::new();
    for body in bodies.iter().filter(|b| b.moved_by.is_some()) {
        massless.extend(check_body(robot, body, &inertias, &without_extent, &failures, options, report));
    }
    warn_massless(robot, massless, report);
    // An <inertial> of zeros denotes a massless frame.
    for inertia in &mut inertias {
        if inertia.is_some_and(|i| i.mass == 0.0 && i.inertia_com == Matrix3::zeros()) {
            *inertia = None;
        }
    }
    inertias
}

/// Returns the inertia about the centre of mass in L: `I_com_L = R_LI I_com_I R_LIᵀ`.
fn in_link_axes(raw: &RawInertial) -> LinkInertia {
    let R_LI = raw.X_LI.rotation.matrix();
    let I_com_L = R_LI * raw.inertia_I * R_LI.transpose();
    LinkInertia {
        mass: raw.mass,
        com: raw.X_LI.translation.vector,
        // Rounding makes the product slightly unsymmetric.
        inertia_com: (I_com_L + I_com_L.transpose()) * 0.5,
    }
}

/// Warns about names without a link.
fn check_names(robot: &RawRobot, names: &[String], what: &str, code: &'static str, report: &mut Report) {
    for name in names.iter().filter(|name| robot.links.iter().all(|l| l.name != **name)) {
        let message = format!("{what} link {name:?}, which does not exist");
        let meant = closest(name, robot.links.iter().map(|l| l.name.as_str()));
        report.warning(&robot.place, code, message, did_you_mean(meant, ""));
    }
}

/// Principal moments in ascending order (kg m²); NaN if the matrix is not finite.
fn principal_moments(inertia: &Matrix3<f64>) -> [f64; 3] {
    // Scaled to one: squares of huge entries would overflow, and the iteration would not end.
    let scale = inertia.amax();
    if !scale.is_finite() || inertia.iter().any(|x| x.is_nan()) {
        return [f64::NAN; 3];
    }
    if scale == 0.0 {
        return [0.0; 3];
    }
    let mut moments: [f64; 3] = (inertia / scale).symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments.map(|m| m * scale)
}

/// Checks positive definiteness and the triangle inequality. Returns whether the matrix is rank
/// deficient (no extent in some direction).
fn check_moments(
    name: &str,
    raw: &RawInertial,
    inertia: &LinkInertia,
    moves: bool,
    options: &ReadOptions,
    report: &mut Report,
) -> bool {
    let moments @ [low, middle, high] = principal_moments(&inertia.inertia_com);
    let scale = low.abs().max(high.abs());
    let waived = options.waive.iter().any(|n| n == name);
    let excess = high - (low + middle);
    let floor = moment_floor(raw.mass, scale);
    let found = moments.map(|m| format!("{m:.6e}")).join(", ");
    let (code, message, help) = if low.is_nan() || low < -floor {
        // No waiver for moving links: a negative moment would add energy.
        (
            "inertia-not-positive-definite",
            format!("the inertia of link {name:?} is not positive definite: principal moments {found} kg m^2"),
            "check signs, units (kg m^2) and that the values are about the centre of mass".into(),
        )
    } else if excess > floor && !waived {
        (
            "triangle-inequality",
            format!(
                "the inertia of link {name:?} breaks the triangle inequality: principal moments {found} kg m^2, the \
                 largest is above the sum of the two others by {excess:.2e}"
            ),
            format!(
                "check the order ixx ixy ixz iyy iyz izz and that the values are about the centre of mass; if the \
                 model means it, waive the check by {} LINK, or waive_inertia = [\"link\"] in the robot file",
                Setting::WaiveInertia
            ),
        )
    } else {
        return low <= TOLERANCE * scale || high <= floor;
    };
    // Without motion the inertia has no effect.
    if moves {
        report.error(&raw.place, code, message, help);
        if code == "triangle-inequality" {
            report.waivable.push(name.to_owned());
        }
    } else if !waived {
        report.warning(&raw.place, code, message, help);
    }
    false
}

/// Warns about joints that move no mass, whose inertia is missing in the results. Many such joints
/// give one warning.
fn warn_massless(robot: &RawRobot, massless: Vec<(&str, Finding)>, report: &mut Report) {
    const MAX: usize = 3;
    if massless.len() <= MAX {
        report.take(massless.into_iter().map(|(_, warning)| warning));
        return;
    }
    let shown = quoted(massless.iter().take(6).map(|(link, _)| *link));
    let rest = if massless.len() > 6 { format!(" and {} more", massless.len() - 6) } else { String::new() };
    let message = format!("{} moving links have no mass: {shown}{rest}", massless.len());
    report.warning(&robot.place, "missing-inertial", message, &massless[0].1.help);
}

/// Remedy for a moving link without `<inertial>`.
fn estimate_help() -> String {
    format!(
        "add <inertial> with mass and inertia, or have it estimated from the meshes ({} or {}, or such keys in \
         the robot file): without them the link needs no force to move, and nothing bends under it",
        Setting::InertiaFromDensity,
        Setting::InertiaFromTotalMass
    )
}

/// Checks mass and inertia of a moving body; returns its link and a warning if they are missing
/// entirely.
fn check_body<'r>(
    robot: &'r RawRobot,
    body: &Body,
    inertias: &[Option<LinkInertia>],
    without_extent: &[bool],
    failures: &[Option<String>],
    options: &ReadOptions,
    report: &mut Report,
) -> Option<(&'r str, Finding)> {
    let joint = &robot.joints[body.moved_by?].urdf.name;
    let root = &robot.links[body.root];
    let link = &root.name;
    let lumped = match &body.members[1..] {
        [] => String::new(),
        fixed => {
            format!(", nor have the links fixed to it ({})", quoted(fixed.iter().map(|m| &*robot.links[m.0].name)))
        }
    };
    let with_inertia: Vec<usize> = body.members.iter().map(|m| m.0).filter(|&i| inertias[i].is_some()).collect();
    if with_inertia.is_empty() {
        let code = "missing-inertial";
        let message = format!("link {link:?} is moved by joint {joint:?} and has no <inertial>{lumped}");
        if let Some(why) = body.members.iter().find_map(|&(i, _)| failures[i].as_ref()) {
            let help = format!("add <inertial> with mass and inertia; it could not be estimated: {why}");
            report.error(&root.place, code, message, help);
            return None;
        }
        return Some((link, Finding::warning(code, root.place.to_string(), message, estimate_help())));
    }
    // Unreadable or negative masses were reported already; consequences are not.
    let unsound = |&i: &usize| robot.links[i].inertial.as_ref().is_some_and(|raw| raw.faulty || raw.mass < 0.0);
    if with_inertia.iter().any(unsound) {
        return None;
    }
    // Spatial inertia of the body about Ro, in R.
    let mut M_R = SpatialInertia::zeros();
    for (i, X_RL) in &body.members {
        if let Some(inertia) = &inertias[*i] {
            M_R += inertia.spatial().at_parent(X_RL);
        }
    }
    let place = |i: usize| robot.links[i].inertial.as_ref().map_or(&robot.links[i].place, |raw| &raw.place);
    if M_R.mass == 0.0 {
        let message = format!("link {link:?} is moved by joint {joint:?} and has no mass{lumped}");
        let help =
            "give the link its mass and inertia: without them it needs no force to move, and nothing bends under it";
        return Some((link, Finding::warning("zero-mass", place(with_inertia[0]).to_string(), message, help)));
    }

    // A point mass is valid if other links of the same body have inertia.
    let thin = with_inertia.iter().copied().filter(|&i| without_extent[i]);
    let thin = thin.into_iter().find(|&i| !options.waive.contains(&robot.links[i].name))?;
    let name = &robot.links[thin].name;
    if robot.links[thin].inertial.as_ref().is_some_and(|raw| raw.mass > 0.0) {
        let message =
            format!("link {name:?} has mass and no inertia about some axis: it is treated as a point or a rod");
        report.warning(place(thin), "point-mass", message, "give the inertia about the centre of mass");
    }
    None
}

/// Compares the radius of gyration and the centre of mass with the box around the shapes of the
/// link.
fn plausible(name: &str, raw: &RawInertial, inertia: &LinkInertia, shape: &LinkShape, report: &mut Report) {
    let Some((low, high)) = shape.bounds else { return };
    let diagonal = (high - low).norm();
    let radius = (principal_moments(&inertia.inertia_com)[2].max(0.0) / inertia.mass).sqrt();
    let help = "check units (kg, m, kg m^2) of inertia and geometry";
    if radius > 0.5 * diagonal {
        // All mass in the corners of the box would give half the diagonal.
        let message = format!(
            "link {name:?}: the radius of gyration {radius:.3} m does not fit into its geometry, whose diagonal is \
             {diagonal:.3} m"
        );
        report.warning(&raw.place, "inertia-too-large", message, help);
    } else if radius < 0.02 * diagonal {
        // A homogeneous rod, the most slender body, has 0.29 of its length.
        let message = format!(
            "link {name:?}: the radius of gyration {radius:.2e} m is tiny against its geometry, whose diagonal is \
             {diagonal:.3} m"
        );
        report.warning(&raw.place, "inertia-too-small", message, help);
    }
    let margin = Vector3::repeat(0.1 * diagonal);
    let (low, high) = (low - margin, high + margin);
    if (0..3).any(|i| inertia.com[i] < low[i] || inertia.com[i] > high[i]) {
        let com = inertia.com;
        let message = format!(
            "link {name:?}: the centre of mass ({:.3}, {:.3}, {:.3}) m lies outside its geometry",
            com.x, com.y, com.z
        );
        report.warning(&raw.place, "com-outside", message, "check the <origin> of <inertial> and of <visual>");
    }
}

/// Estimates the inertia of links in bodies without any `<inertial>` from their shapes; returns for
/// each link the reason if this failed.
fn fill_from_shapes(
    robot: &RawRobot,
    bodies: &[Body],
    shapes: &[LinkShape],
    estimate: InertiaEstimate,
    inertias: &mut [Option<LinkInertia>],
    report: &mut Report,
) -> Vec<Option<String>> {
    let mut failures = vec![None; robot.links.len()];
    if !is_positive(estimate, robot, report) {
        return failures;
    }
    // Volumes of the links of bodies without any `<inertial>`. The base is included, so that the
    // total mass may be that of the data sheet.
    let without = bodies.iter().filter(|b| b.members.iter().all(|&(i, _)| robot.links[i].inertial.is_none()));
    let empty: Vec<usize> = without.flat_map(|b| b.members.iter().map(|m| m.0)).collect();
    let mut filled: Vec<(usize, SpatialInertia)> = Vec::new();
    for &i in &empty {
        match of_shapes(&robot.links[i], &shapes[i], report) {
            Ok(M_L) => filled.extend(M_L.map(|M_L| (i, M_L))),
            Err(reason) => failures[i] = Some(reason),
        }
    }

    // Without any shape, the lengths of the links distribute a total mass.
    let by_length = filled.is_empty() && matches!(estimate, InertiaEstimate::TotalMass(_));
    if by_length {
        filled = empty.iter().filter_map(|&i| Some((i, rod(robot, i)?))).collect();
        filled.iter().for_each(|(i, _)| failures[*i] = None);
    }
    if filled.is_empty() {
        let has_no_shape = |i: &usize| shapes[*i].solids.as_ref().is_ok_and(Vec::is_empty);
        empty.into_iter().filter(has_no_shape).for_each(|i| failures[i] = Some("there is no shape".to_owned()));
    }
    // Density that gives the total mass; for rods the "volume" is the length.
    let volume: f64 = filled.iter().map(|(_, M)| M.mass).sum();
    let density = match estimate {
        InertiaEstimate::Density(density) => density,
        InertiaEstimate::TotalMass(mass) => mass / volume,
    };
    if let (false, InertiaEstimate::TotalMass(_), Some((first, _))) = (by_length, estimate, filled.first()) {
        check_density(&robot.links[*first], volume, density, report);
    }
    for (i, M_L) in filled {
        let inertia =
            LinkInertia { mass: M_L.mass * density, com: M_L.com(), inertia_com: M_L.inertia_com() * density };
        let link = &robot.links[i];
        let from = match by_length {
            true => "its length, as a rod".to_owned(),
            false => format!("its geometry at {density:.0} kg/m^3"),
        };
        let message =
            format!("link {:?}: mass {:.4} kg and inertia are estimated from {from}", link.name, inertia.mass);
        report.warning(&link.place, "estimated-inertia", message, "replace by measured or CAD values where known");
        inertias[i] = Some(inertia);
    }
    failures
}

/// Whether the requested density or mass is positive; reports others.
fn is_positive(estimate: InertiaEstimate, robot: &RawRobot, report: &mut Report) -> bool {
    let (what, value) = match estimate {
        InertiaEstimate::Density(density) => ("the density", density),
        InertiaEstimate::TotalMass(mass) => ("the total mass", mass),
    };
    let positive = value > 0.0 && value.is_finite();
    if !positive {
        let message = format!("inertia from meshes was requested with {what} {value}, expected a positive number");
        let help = "give a density in kg/m^3 (steel 7850, aluminium 2700) or a mass in kg";
        report.error(&robot.place, "bad-estimate", message, help);
    }
    positive
}

/// Warns of a density of all shapes that no arm has; `first`: the first link with a shape.
fn check_density(first: &RawLink, volume: f64, density: f64, report: &mut Report) {
    if SOLID.contains(&density) {
        return;
    }
    let message = format!(
        "the shapes of the links have {volume:.3e} m3 in all, {density:.3} kg/m3; arms have {} to {} by their outer shape",
        SOLID.start(),
        SOLID.end()
    );
    let help = "check the scale of the meshes and the mass: a robot four times too large has a 64th of its density";
    report.warning(&first.place, "estimated-density", message, help);
}

/// Returns the inertia `M_L` of the shapes of a link at unit density, about Lo, in L; warns if a
/// mesh is not closed. `None` without shapes: such a frame may remain massless if other links have
/// shapes.
fn of_shapes(link: &RawLink, shape: &LinkShape, report: &mut Report) -> Result<Option<SpatialInertia>, String> {
    let solids = shape.solids.as_ref().map_err(String::clone)?;
    if solids.is_empty() {
        return Ok(None);
    }
    let open: usize = solids.iter().map(|(_, p)| p.open_edges).sum();
    if open > 0 {
        let message =
            format!("link {:?}: inertia is estimated from a mesh that is not closed ({open} open edges)", link.name);
        report.warning(&link.place, "open-mesh", message, "close the mesh or give <inertial>");
    }
    let mut M_L = SpatialInertia::zeros();
    for (X_LV, solid) in solids {
        M_L += SpatialInertia::from_com(solid.volume, &solid.centroid, &solid.inertia).at_parent(X_LV);
    }
    if M_L.mass > 0.0 { Ok(Some(M_L)) } else { Err("its mesh encloses no volume".to_owned()) }
}

/// Ratio of diameter to length of a rod.
const ROD: f64 = 0.2;

/// Approximates a link by a rod of 1 kg/m from its frame to its farthest joint: `M_L` about Lo, in
/// L. `None` for a link without length.
///
/// ```text
/// l³/12 (1 + 3/4 r²) across, l³ r²/8 about its axis, with the ratio r of diameter to length
/// ```
fn rod(robot: &RawRobot, link: usize) -> Option<SpatialInertia> {
    let ends =
        robot.joints.iter().filter(|j| j.urdf.parent.link == robot.links[link].name).map(|j| j.X_PJ.translation.vector);
    let end = ends.max_by(|a, b| a.norm().total_cmp(&b.norm())).filter(|end| end.norm() > 1e-3)?;
    let (length, along) = (end.norm(), end.normalize());
    let (across, about) = (length.powi(3) / 12.0 * (1.0 + 0.75 * ROD * ROD), length.powi(3) * ROD * ROD / 8.0);
    let axis = along * along.transpose();
    let inertia = (Matrix3::identity() - axis) * across + axis * about;
    Some(SpatialInertia::from_com(length, &(end * 0.5), &inertia))
}
