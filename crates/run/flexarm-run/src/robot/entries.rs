//! Entries of a robot file that change the rigid robot: joints, payload, TCP and masses of beams.
//!
//! Each function checks one entry and changes the tree, or reports the entry's line. Inertias are
//! about centres of mass, in link axes. Not here: entries that stay beside the tree, such as drives
//! and flexible links (`*_entry.rs`), and the order of all (`load.rs`).

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_flexlink::Parts;
use flexarm_kinematics::{Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use flexarm_settings::known_names;
use flexarm_urdf::{UrdfRobot, default_tcp};
use nalgebra::Vector3;
use toml::Spanned;

use super::load::LoadOptions;
use super::{PAYLOAD_LINK, Robot};
use crate::body_change::BodyChange;
use crate::caveat::Finding;
use crate::error::Error;
use crate::robot::entry_checks::{check_finite, inertia, loop_of_joint, pose, unknown_link};
use crate::robot::link_entry::FlexibleLinkEntry;
use crate::robot::robot_file::{PayloadEntry, RobotFile};
use crate::robot::robot_link::RobotLink;

impl Robot {
    /// Sets the mass of a beam link to the value in its entry, keeping its centre of mass and radii
    /// of gyration.
    pub(super) fn reweigh(&mut self, entry: &FlexibleLinkEntry, source: &Source) -> Result<(), RobotFileError> {
        let (Some(mass), name) = (&entry.mass, entry.link.get_ref()) else { return Ok(()) };
        let fail = |message: String| source.error(mass.span(), format!("link {name:?}: {message}"));
        let wanted = *mass.get_ref();
        if !(wanted > 0.0 && wanted.is_finite()) {
            return Err(fail(format!("mass = {wanted}: expected a positive number of kg")));
        }
        if entry.beam.is_none() {
            return Err(fail("mass belongs to beams; the parts of a .flex file have their own masses".into()));
        }
        // Inertia about the centre of mass scales with the mass.
        let mut found = false;
        for mechanism in [&mut self.rigid, &mut self.urdf.mechanism] {
            let link = mechanism.links.iter_mut().find(|link| link.name == *name);
            if let Some(inertia) = link.and_then(|link| link.inertia.as_mut()).filter(|inertia| inertia.mass > 0.0) {
                inertia.inertia_com *= wanted / inertia.mass;
                inertia.mass = wanted;
                found = true;
            }
        }
        match found {
            true => Ok(()),
            false => Err(fail("the URDF gives it no mass that could be changed: leave mass out".into())),
        }
    }

    /// Gives the rigid robot the mass, centre of mass and inertia of those flexible links that do not
    /// take them from it.
    pub(super) fn weigh_flexible_links(&mut self) {
        for RobotLink { flexible, .. } in &self.flexible_links {
            let Some(link) = self.rigid.links.iter_mut().find(|link| link.name == flexible.link) else { continue };
            let body = flexible.reduced.rigid();
            if flexible.parts != Parts::Reduced
                || link.inertia.is_some_and(|own| BodyChange::of(&own, &body).is_rounding())
            {
                continue;
            }
            if let Some(own) = link.inertia.filter(|own| (body.mass / own.mass - 1.0).abs() > 1e-6) {
                self.warnings.push(format!(
                    "link {:?}: its parts weigh {:.4} kg, the URDF's link {:.4} kg; the parts count",
                    flexible.link, body.mass, own.mass
                ));
            }
            link.inertia = Some(LinkInertia { mass: body.mass, com: body.com, inertia_com: body.inertia });
        }
    }

    /// Attaches the payload to its link, or to the TCP link of the file; a TCP chosen by the user
    /// does not matter here.
    pub(super) fn add_payload(
        &mut self,
        entry: &Spanned<PayloadEntry>,
        tcp_link: &str,
        source: &Source,
    ) -> Result<(), Error> {
        let payload = entry.get_ref();
        let com = payload.com.unwrap_or_default();
        check_finite("payload com", &com, entry.span(), source)?;
        let inertia_com = inertia("payload", &payload.inertia, entry.span(), source)?;
        let link = payload.link.as_ref().map_or_else(|| tcp_link.to_owned(), |l| l.get_ref().clone());
        if self.rigid.link(&link).is_none() {
            let span = payload.link.as_ref().map_or(0..0, Spanned::span);
            return Err(source.error(span, unknown_link("payload", &link, &self.rigid)).into());
        }
        let mass = *payload.mass.get_ref();
        if !(mass.is_finite() && mass >= 0.0) {
            let message = format!("payload mass is {mass} kg, it must be 0 or positive");
            return Err(source.error(payload.mass.span(), message).into());
        }
        if mass == 0.0 {
            let help = "leave the payload out if there is none";
            let none = Finding::warning("no-payload", "the payload", "the payload has 0 kg: it is ignored", help);
            self.written.push(none.as_note());
            return Ok(());
        }
        if payload.com.is_none() {
            let message =
                "payload has no com: its centre of mass in axes of the link, such as com = [0.0, 0.0, 0.1], in m";
            return Err(source.error(entry.span(), message).into());
        }
        // The payload frame is at its centre of mass, so a cut through the link assigns the payload
        // to the correct side.
        let inertia = LinkInertia { mass, com: Vector3::zeros(), inertia_com };
        self.rigid.links.push(Link { name: PAYLOAD_LINK.into(), inertia: Some(inertia) });
        let joint = Joint::new("__payload_joint", JointKind::Fixed, link, PAYLOAD_LINK, pose(com, [0.0; 3]));
        self.rigid.joints.push(joint);
        Ok(())
    }
}

/// Turns a rotating joint into a helical one with `lead` metres per turn.
pub(super) fn make_helical(
    mechanism: &mut Mechanism,
    name: &str,
    lead: &Spanned<f64>,
    source: &Source,
) -> Result<(), RobotFileError> {
    let fail = |message: String| source.error(lead.span(), format!("lead of joint {name:?}: {message}"));
    let turning: Vec<String> = mechanism.joints.iter().filter(|j| j.kind.turns()).map(|j| j.name.clone()).collect();
    let joint = mechanism.joints.iter_mut().find(|j| j.name == name && j.kind.turns());
    let joint = joint.ok_or_else(|| {
        fail(format!("the robot has no such joint that turns; it has {}", known_names(name, &turning)))
    })?;
    let lead = *lead.get_ref();
    if !lead.is_finite() || lead == 0.0 {
        return Err(fail(format!("is {lead}, expected metres per turn: 0.02 for 20 mm")));
    }
    if let JointKind::Revolute(axis) | JointKind::Continuous(axis) = joint.kind {
        joint.kind = JointKind::Helical { axis, pitch: lead / std::f64::consts::TAU };
    }
    Ok(())
}

/// Replaces the effort limit of the URDF (N m or N).
pub(super) fn limit_effort(
    mechanism: &mut Mechanism,
    name: &str,
    limit: &Spanned<f64>,
    source: &Source,
) -> Result<(), RobotFileError> {
    let fail = |message: String| source.error(limit.span(), format!("effort_limit of joint {name:?}: {message}"));
    let is_free = |joint: &Joint| joint.kind.degrees_of_freedom() == 1;
    let known: Vec<String> = mechanism.joints.iter().filter(|j| is_free(j)).map(|j| j.name.clone()).collect();
    let joint = mechanism.joints.iter_mut().find(|j| j.name == name && is_free(j));
    let joint = joint
        .ok_or_else(|| fail(format!("the robot has no such joint that moves; it has {}", known_names(name, &known))))?;
    match *limit.get_ref() {
        effort if effort > 0.0 => joint.limits.effort = effort,
        effort => return Err(fail(format!("is {effort}, expected a positive torque in N m (or force in N), or inf"))),
    }
    Ok(())
}

/// Checks an entry of `[hold]`: the joint must be independent and the value within its limits.
pub(super) fn held_joint(
    name: &str,
    value: &Spanned<f64>,
    mechanism: &Mechanism,
    source: &Source,
) -> Result<(String, f64), RobotFileError> {
    let free = |joint: &&Joint| {
        joint.kind.degrees_of_freedom() == 1 && joint.mimic.is_none() && loop_of_joint(mechanism, &joint.name).is_none()
    };
    let at = *value.get_ref();
    if let Some(own) = loop_of_joint(mechanism, name) {
        let message = format!("hold: {name:?} follows from loop {own:?}: hold the joints that drive the loop");
        return Err(source.error(value.span(), message));
    }
    let Some(joint) = mechanism.joints.iter().filter(free).find(|joint| joint.name == name) else {
        let names: Vec<&str> = mechanism.joints.iter().filter(free).map(|joint| joint.name.as_str()).collect();
        let known = known_names(name, &names);
        let message = format!("hold: {name:?} is not an independent joint of the robot; its joints are {known}");
        return Err(source.error(value.span(), message));
    };
    let (lower, upper) = (joint.limits.lower, joint.limits.upper);
    if !(at.is_finite() && lower <= at && at <= upper) {
        let message = format!("hold: {name:?} is to stay at {at}, outside of its limits {lower} to {upper} (rad or m)");
        return Err(source.error(value.span(), message));
    }
    Ok((name.to_owned(), at))
}

pub(super) fn tcp_of(
    file: &RobotFile,
    source: &Source,
    urdf: &UrdfRobot,
    options: &LoadOptions,
) -> Result<(String, Pose), Error> {
    if let Some(link) = &options.tcp {
        return Ok((link.clone(), Pose::identity()));
    }
    if let Some(tcp) = &file.tcp {
        check_finite("tcp xyz", &tcp.get_ref().xyz, tcp.span(), source)?;
        check_finite("tcp rpy", &tcp.get_ref().rpy, tcp.span(), source)?;
    }
    match file.tcp.as_ref().map(Spanned::get_ref) {
        Some(tcp) if urdf.mechanism.link(tcp.link.get_ref()).is_none() => {
            Err(source.error(tcp.link.span(), unknown_link("TCP", tcp.link.get_ref(), &urdf.mechanism)).into())
        }
        Some(tcp) => Ok((tcp.link.get_ref().clone(), pose(tcp.xyz, tcp.rpy))),
        None => {
            let link = default_tcp(&urdf.mechanism).ok_or(Error::NoTcp { in_file: true })?;
            Ok((link.to_owned(), Pose::identity()))
        }
    }
}
