//! Models of a robot: the form of each flexible link, and all springs, gears and drives.
//!
//! Start at [`Robot::model`]. Overrides and factors of the robot file on the stiffness of a link are
//! applied here, when its springs are made. Springs are in the order of the elastic coordinates of
//! the tree; each carries its owner from here on. Not here: substitution in the tree
//! (`flexarm-flexlink`), the choice of a link's model ([`RobotLink::form`]), stepping.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use flexarm_flexlink::{
    BranchJoint, FlexibleLink, FlexibleSpan, GearSpring, Gearbox, LinkForm, Substituted, branch_joints,
    insert_gearboxes, insert_mounting, substitute,
};
use flexarm_kinematics::{Coordinate, ElasticAngles, ElasticGroup, Model};
use flexarm_linkmaker::import::SECOND_ORDER_UNKNOWN;
use flexarm_settings::Setting;
use flexarm_stepping::{Friction, GearCoupling, GeometricStiffness, Spring, SpringCurve};
use nalgebra::DMatrix;

use crate::arm::bends::bends;
use crate::arm::options::{DriveModel, LinkModel, Modelling};
use crate::arm::{Arm, Owner};
use crate::caveat::Finding;
use crate::caveat::kinds;
use crate::caveat::lumping;
use crate::caveat::size::Size;
use crate::error::Error;
use crate::robot::drive_entry::{DriveKind, ServoEntry};
use crate::robot::gear_entry::{GearLaws, RobotCoupling};
use crate::robot::gearbox_entry::curves_with_play;
use crate::robot::guide_entry::guide_law;
use crate::robot::mounting::RobotMounting;
use crate::robot::robot_link::{RobotLink, StressSource};
use crate::robot::{Robot, tcp_frame};

/// Springs along Euler angles are not symmetric between the two ends: an error of third order in
/// the deflection remains, which a chain of n parts only divides by n.
const EULER_CHAIN: &str = "its chain has angles = \"euler-zyx\": where it bends about two axes or twists, its deflection \
                           converges with the number of parts, not with the square of it as with rotation vectors";

impl Robot {
    /// Returns the robot with its links and drives modelled.
    ///
    /// Cost: a few milliseconds for reading modes and substitution.
    ///
    /// # Errors
    /// [`Error::Modelling`] if a link or drive has no such model, [`Error::Model`] if the result is
    /// not a valid tree.
    pub fn model(&self, modelling: &Modelling) -> Result<Arc<Arm>, Error> {
        Arc::new(self.clone()).modelled(modelling).map(Arc::new)
    }

    /// As [`Robot::model`], without a copy of the robot.
    pub(crate) fn modelled(self: Arc<Self>, modelling: &Modelling) -> Result<Arm, Error> {
        // The tree: links, then gearboxes, then the springs under the base.
        let ChosenLinks { links, findings, modal_instead } = self.chosen_links(modelling)?;
        let mut substituted = substitute(&self.rigid, &links).map_err(refused)?;
        let bends = bends(&substituted);
        let gearboxes: Vec<Gearbox> =
            self.drives.iter().filter_map(|drive| drive.gearbox_as(modelling.drives)).collect();
        let gears = insert_gearboxes(&mut substituted.mechanism, &gearboxes).map_err(refused)?;
        let mounted = self.insert_mounting(&mut substituted, modelling)?;
        let model = Model::new(&substituted.mechanism)
            .map_err(|source| Error::Model { path: self.urdf_path.clone(), source: Box::new(source) })?;

        // Its springs with their owners, in the order of the elastic coordinates.
        let mut owned = self.link_springs(&links, &substituted.spans);
        owned.extend(self.gear_springs(&gears, &model));
        let mounting = mounted.as_ref().map(|_| substituted.spans.len() - 1);
        owned.extend(mounted.into_iter().flatten());
        let (springs, owners) = in_coordinate_order(&model, owned)?;
        // Friction, torques and gear laws of the joints.
        let (friction, torque) = self.actuation(&model, modelling.drives);
        let gears = self.gear_laws(&model, &owners);
        Ok(Arm {
            tcp: tcp_frame(&model),
            model: Arc::new(model),
            springs,
            owners,
            spans: substituted.spans,
            bends,
            rigid: self.rigid_model()?,
            friction,
            gears,
            torque,
            findings,
            mounting,
            extent: Size::of(&self.urdf.mechanism).extent.max(self.tcp.1.translation.vector.norm()),
            modal_instead,
            modelling: *modelling,
            robot_caveats: OnceLock::new(),
            robot: self,
        })
    }

    /// Chooses the model of each flexible link.
    fn chosen_links(&self, modelling: &Modelling) -> Result<ChosenLinks, Error> {
        let mut chosen = ChosenLinks::default();
        let wanted = if modelling.links == LinkModel::Rigid { &[][..] } else { &self.flexible_links[..] };
        for link in wanted {
            let (form, instead) = self.form_of(link, modelling)?;
            chosen.modal_instead.extend(instead);
            chosen.findings.extend(findings_of(link, &form));
            chosen.findings.extend(lumping::of_parts(link, &form));
            chosen.links.push(FlexibleLink { form, ..link.flexible.clone() });
        }
        // An option that applies to no link is an error.
        let modal = chosen.links.iter().filter(|link| matches!(link.form, LinkForm::Modal(_))).count();
        if let (Some(n), true) = (modelling.segments, modal == chosen.links.len()) {
            let remedy = match chosen.modal_instead.is_empty() {
                true => format!("add {} lumped", Setting::Links),
                false => chosen.modal_instead.join("; "),
            };
            return Err(Error::Modelling(format!(
                "{n} segments are requested, but no link of the robot is lumped: {remedy}"
            )));
        }
        if let (Some(n), 0) = (modelling.modes, modal) {
            return Err(Error::Modelling(format!(
                "{n} modes are requested, but no link of the robot is modal: add {} modal",
                Setting::Links
            )));
        }
        Ok(chosen)
    }

    /// Inserts the mounting springs under the base; with rigid links the ground is rigid too.
    fn insert_mounting(
        &self,
        substituted: &mut Substituted,
        modelling: &Modelling,
    ) -> Result<Option<Vec<OwnedSpring>>, Error> {
        let Some(RobotMounting::Springs { springs, damping, play }) = &self.mounting else { return Ok(None) };
        if modelling.links == LinkModel::Rigid {
            return Ok(None);
        }
        let (inserted, span) = insert_mounting(&mut substituted.mechanism, springs).map_err(refused)?;
        let owner = Owner::Link(substituted.spans.len());
        substituted.spans.push(span);
        let curves = curves_with_play(springs.K_S.diagonal().as_slice(), play);
        let owned = inserted.into_iter().map(|GearSpring { name, joint, component, K, .. }| {
            let curve = curves.get(component).cloned().flatten().map(SpringCurve::from);
            OwnedSpring { group: joint, spring: Spring { curve, ..Spring::linear(name, K, *damping) }, owner }
        });
        Ok(Some(owned.collect()))
    }

    /// Returns the springs of the flexible links, one per elastic joint of a lumped link and one per
    /// modal link. `links` and `spans` are in the order of the robot's flexible links.
    fn link_springs(&self, links: &[FlexibleLink], spans: &[FlexibleSpan]) -> Vec<OwnedSpring> {
        let mut owned = Vec::new();
        for (k, ((source, link), span)) in self.flexible_links.iter().zip(links).zip(spans).enumerate() {
            let (name, owner) = (&link.link, Owner::Link(k));
            if let LinkForm::Modal(modal) = &link.form {
                let geometric = modal.geometric.as_ref().filter(|_| source.choices.geometric);
                let geometric = geometric.map(|g| Arc::new(stiffening(g, span.share)));
                let K = &modal.K * source.stiffness_factor;
                let spring = Spring { geometric, ..Spring::linear(name, K, source.damping) };
                owned.push(OwnedSpring { group: name.clone(), spring, owner });
            }
            for (number, joint) in span.joints.iter().enumerate() {
                let several = span.joints.len() > 1;
                let name = if several { format!("{name}.{}", number + 1) } else { name.clone() };
                let spring = Spring::from((name, source.scaled(&joint.K_S), source.damping));
                owned.push(OwnedSpring { group: joint.joint.clone(), spring, owner });
            }
        }
        owned
    }

    /// Returns the springs of the gearboxes.
    fn gear_springs(&self, gears: &[GearSpring], model: &Model) -> Vec<OwnedSpring> {
        let mut owned = Vec::new();
        for gear in gears {
            let found = self.drives.iter().enumerate().find(|(_, drive)| drive.joint == gear.gearbox);
            let Some((number, Some((_, damping)))) = found.map(|(n, drive)| (n, &drive.gearbox)) else { continue };
            let mut spring = Spring {
                name: gear.name.clone(),
                K: gear.K.clone(),
                damping: damping.of(gear.component, gear.K.nrows()),
                curve: damping.curves.get(gear.component).cloned().flatten().map(SpringCurve::from),
                hysteresis: damping.hysteresis.as_ref().map(|found| found.law.clone()),
                geometric: None,
            };
            // A guide replaces the linear spring by its law.
            if let (Some(tubes), Some(tilt)) = (self.drives[number].guide(), damping.tilts.get(gear.component)) {
                let body = model.bodies().iter().find(|body| body.joint == gear.gearbox);
                let joint = self.rigid.joint(&gear.gearbox);
                let (Some(body), Some(joint)) = (body, joint) else { continue };
                let (law, stiffness) = guide_law(tubes, tilt, body, &joint.limits);
                (spring.curve, spring.K) = (Some(law), DMatrix::from_element(1, 1, stiffness));
            }
            owned.push(OwnedSpring { group: gear.joint.clone(), spring, owner: Owner::Drive(number) });
        }
        owned
    }

    /// Returns the gear effects other than elasticity, for springs with these owners.
    fn gear_laws(&self, model: &Model, owners: &[Owner]) -> GearLaws {
        let mut laws = GearLaws::default();
        let place = |joint: &str| model.coordinates()[..model.n_actuated()].iter().position(|c| c.joint == joint);
        let spring = |number: usize| {
            // The springs of a seat come first.
            let seated = self.drives[number].gearbox.as_ref().is_some_and(|(gearbox, _)| gearbox.seat.is_some());
            let mut own = (0..owners.len()).filter(|k| owners[*k] == Owner::Drive(number));
            let element = own.nth(if seated { 2 } else { 0 })?;
            (model.elastic()[element].size == 1).then_some(element)
        };
        for (number, drive) in self.drives.iter().enumerate() {
            if let Some(coordinate) = place(&drive.joint) {
                laws.add(drive, coordinate, spring(number));
            }
        }
        if let Some(RobotCoupling { joints, C, C_inverse }) = &self.coupling {
            let number = |joint: &String| self.drives.iter().position(|drive| drive.joint == *joint);
            laws.coupling = Some(GearCoupling {
                elements: joints.iter().filter_map(|joint| spring(number(joint)?)).collect(),
                coordinates: joints.iter().filter_map(|joint| place(joint)).collect(),
                C: C.clone(),
                C_inverse: C_inverse.clone(),
            });
        }
        laws
    }

    /// Returns the friction of each actuated coordinate, and the torque-driven joints as
    /// coordinate, servo and torque limit.
    fn actuation(&self, model: &Model, drives: DriveModel) -> (Vec<Friction>, Vec<(usize, ServoEntry, f64)>) {
        let actuated = &model.coordinates()[..model.n_actuated()];
        let drive_of = |joint: &str| self.drives.iter().find(|d| d.joint == joint);
        let friction = actuated.iter().map(|c| drive_of(&c.joint).map_or(Friction::NONE, |d| d.friction)).collect();
        let servo = |(k, coordinate): (usize, &Coordinate)| match drive_of(&coordinate.joint) {
            Some(d) => (d.kind_as(drives) == DriveKind::Torque).then_some((k, d.servo, d.torque_limit)),
            None => (drives == DriveModel::Servo).then(|| (k, ServoEntry::default(), coordinate.limits.effort)),
        };
        (friction, actuated.iter().enumerate().filter_map(servo).collect())
    }

    /// Returns the model of a link on this robot, and a message if it differs from the requested
    /// one: a link loaded at a third interface becomes modal, because rigid parts with springs have
    /// only two interfaces.
    pub(crate) fn form_of(&self, link: &RobotLink, modelling: &Modelling) -> Result<(LinkForm, Option<String>), Error> {
        let form = link.form(modelling)?;
        let branches =
            if matches!(form, LinkForm::Modal(_)) { Vec::new() } else { branch_joints(&self.rigid, &link.flexible) };
        let Some(BranchJoint { joint, interface }) = branches.first() else { return Ok((form, None)) };
        let name = &link.flexible.link;
        let why =
            format!("joint {joint:?} is on its interface {interface:?}, and a lumped link has only two interfaces");
        let modelling = Modelling { links: LinkModel::Modal, ..*modelling };
        let modal =
            link.form(&modelling).map_err(|instead| Error::Modelling(format!("link {name:?}: {why}; {instead}")))?;
        Ok((modal, Some(format!("link {name:?} is modal (model = \"modal\"): {why}"))))
    }
}

/// Error about a link, gearbox or mounting that does not fit the tree.
fn refused(error: impl std::fmt::Display) -> Error {
    Error::Modelling(error.to_string())
}

/// Flexible links with the model chosen for each.
#[derive(Default)]
struct ChosenLinks {
    links: Vec<FlexibleLink>,
    findings: Vec<Finding>,
    modal_instead: Vec<String>,
}

/// Returns the caveats about a link in this form.
fn findings_of(link: &RobotLink, form: &LinkForm) -> Vec<Finding> {
    let mut findings = Vec::new();
    let is_modal = matches!(form, LinkForm::Modal(_));
    if is_modal && link.stress == Some(StressSource::Beam) {
        findings.push(kinds::NO_STRESS_OF_MODES.found(format!("link {:?}", link.flexible.link), 0.0, 0.0));
    }
    let link = &link.flexible;
    if matches!(form, LinkForm::Modal(modal) if !modal.has_second_order()) {
        let text = format!("link {:?}: {SECOND_ORDER_UNKNOWN}", link.link);
        let help = "reduce the mesh itself (flexarm reduce) to have them";
        findings.push(Finding::warning("second-order-unknown", "links", text, help));
    }
    if matches!(form, LinkForm::Chain(_)) && link.angles == ElasticAngles::EulerZyx {
        let text = format!("link {:?}: {EULER_CHAIN}", link.link);
        findings.push(Finding::warning("euler-chain", "links", text, "leave angles away: rotation vectors"));
    }
    findings
}

/// Spring with the group of elastic coordinates it acts on
/// ([`flexarm_kinematics::ElasticGroup::name`]).
struct OwnedSpring {
    group: String,
    spring: Spring,
    owner: Owner,
}

/// Sorts springs and their owners into the order of the model's elastic coordinates.
///
/// # Errors
/// [`Error::Modelling`] for a group without a spring.
fn in_coordinate_order(model: &Model, owned: Vec<OwnedSpring>) -> Result<(Vec<Spring>, Vec<Owner>), Error> {
    let mut by_group: HashMap<String, (Spring, Owner)> =
        owned.into_iter().map(|owned| (owned.group, (owned.spring, owned.owner))).collect();
    let of_group = |group: &ElasticGroup| {
        by_group
            .remove(&group.name)
            .ok_or_else(|| Error::Modelling(format!("elastic joint {joint:?} has no stiffness", joint = group.name)))
    };
    model.elastic().iter().map(of_group).collect::<Result<Vec<_>, _>>().map(|found| found.into_iter().unzip())
}

/// Returns the geometric stiffness of a modal link with a share of its mass.
fn stiffening(of_link: &GeometricStiffness, share: f64) -> GeometricStiffness {
    GeometricStiffness { interface: of_link.interface.clone(), ..of_link.mapped(&|G| G * share) }
}
