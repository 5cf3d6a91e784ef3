//! One link into two or more rigid parts with elastic joints between, or into one that bends in
//! modes.

use std::sync::Arc;

use flexarm_fem::chain::Chain;
use flexarm_fem::{ElasticSplit, ModalLink, ReducedLink, RigidPart, drop_coupling};
use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use nalgebra::{Matrix6, Vector3};

use crate::cut::{CutError, cut_chain, cut_inertia};
use crate::interfaces::{BranchJoint, branch_joints};
use crate::modal::substitute_modal;

/// A link that bends.
#[derive(Clone, Debug)]
pub struct FlexibleLink {
    /// Name of the link.
    pub link: String,
    /// Name of the joint at the distal interface; found by itself if the link has one joint that
    /// leads on.
    pub distal: Option<String>,
    /// Stiffness, frames and parts.
    pub reduced: ReducedLink,
    /// Whose mass properties the parts take.
    pub parts: Parts,
    /// Rigid parts or modes.
    pub form: LinkForm,
    /// Coordinates of the elastic rotation.
    pub angles: ElasticAngles,
    /// `false` drops the coupling terms of `K_S`: only to show what that costs.
    pub coupling: bool,
}

impl FlexibleLink {
    /// With the reduced link's own parts, rotation vector and full coupling.
    pub fn new(link: impl Into<String>, reduced: ReducedLink) -> Self {
        let (angles, parts) = (ElasticAngles::default(), Parts::Reduced);
        Self { link: link.into(), distal: None, reduced, parts, form: LinkForm::TwoParts, angles, coupling: true }
    }
}

/// What a flexible link becomes.
#[derive(Clone, Debug, Default)]
pub enum LinkForm {
    /// Two rigid parts with one elastic joint, those of the reduced link.
    #[default]
    TwoParts,
    /// n rigid parts with n - 1 elastic joints.
    Chain(Chain),
    /// One body that bends in modes.
    Modal(Arc<ModalLink>),
}

impl LinkForm {
    /// A word for people.
    pub fn name(&self) -> &'static str {
        match self {
            Self::TwoParts | Self::Chain(_) => "lumped",
            Self::Modal(_) => "modal",
        }
    }
}

/// Mass properties of the two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parts {
    /// As the reduced link says.
    Reduced,
    /// The mechanism's own inertia of the link, cut at this fraction of the line A-B: the rigid
    /// twin is unchanged.
    FromLink(f64),
}

/// The elastic joint that took a link's place.
#[derive(Clone, Debug)]
pub struct Spring {
    /// Name of the flexible link.
    pub link: String,
    /// Name of the elastic joint.
    pub joint: String,
    /// Name of the distal part.
    pub distal_link: String,
    /// `K_S`, at So in S axes (N/m, N/rad; N m/m, N m/rad).
    pub K_S: Matrix6<f64>,
    /// Pose of S in the link.
    pub X_LS: Pose,
}

/// A flexible link in its place: where to look for its ends.
#[derive(Clone, Debug)]
pub struct FlexibleSpan {
    /// Name of the link; its frame still is at its proximal end.
    pub link: String,
    /// Name of the link that carries interface B now.
    pub distal_link: String,
    /// Pose of A in the link.
    pub X_LA: Pose,
    /// Pose of B in the distal link.
    pub X_DB: Pose,
    /// Distance of the interfaces (m).
    pub length: f64,
    /// Mass of the link in the mechanism before (kg).
    pub own_mass: f64,
    /// Masses of the parts, proximal first; of a link that bends in modes one (kg).
    pub part_masses: Vec<f64>,
}

/// A mechanism with its flexible links in place.
#[derive(Clone, Debug)]
pub struct Substituted {
    /// The tree with elastic joints.
    pub mechanism: Mechanism,
    /// Elastic joints of lumped links, in the order given, proximal first.
    pub springs: Vec<Spring>,
    /// One per flexible link, in the order given.
    pub spans: Vec<FlexibleSpan>,
}

/// Why a link cannot be made flexible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubstitutionError {
    /// No link of that name.
    #[error("flexible link {link:?} is not a link of the robot; its links are {known:?}")]
    UnknownLink {
        /// The name asked for.
        link: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// Named twice.
    #[error("flexible link {link:?} is listed twice")]
    Twice {
        /// The link.
        link: String,
    },
    /// The distal joint is not clear.
    #[error("link {link:?} has {} joints that lead on ({children:?}): name the one at the far interface with distal = \"...\"", children.len())]
    DistalUnclear {
        /// The link.
        link: String,
        /// Its child joints.
        children: Vec<String>,
    },
    /// The named joint does not start at the link.
    #[error("distal joint {joint:?} does not start at link {link:?}; its joints are {children:?}")]
    NotAChild {
        /// The link.
        link: String,
        /// The joint asked for.
        joint: String,
        /// Its child joints.
        children: Vec<String>,
    },
    /// The reduced link's interface B is not where the joint is.
    #[error(
        "link {link:?}: interface B of the reduced link lies {distance:.3e} m from joint {joint:?}: check units and frames of the reduced link"
    )]
    InterfaceElsewhere {
        /// The link.
        link: String,
        /// The distal joint.
        joint: String,
        /// Distance (m).
        distance: f64,
    },
    /// A link without mass cannot be cut.
    #[error("link {link:?} has no inertia to cut: give the parts in a .flex file or use parts = \"uniform\"")]
    NoInertia {
        /// The link.
        link: String,
    },
    /// Modes and another frame.
    #[error("link {link:?} cannot bend in modes: {what}")]
    Modal {
        /// The link.
        link: String,
        /// Why.
        what: String,
    },
    /// A load where springs between rigid parts know nothing.
    #[error(
        "joint {joint:?} hangs on interface {interface:?} of link {link:?}, which is neither its near nor its far end: rigid parts with \
         springs carry load at the two ends alone, let the link bend in modes"
    )]
    Branched {
        /// The link.
        link: String,
        /// The joint.
        joint: String,
        /// The interface.
        interface: String,
    },
    /// The parts cannot be made.
    #[error("the mass of link {link:?} cannot be spread along it: {source}")]
    Cut {
        /// The link.
        link: String,
        /// Why.
        #[source]
        source: CutError,
    },
}

/// How far the reduced link's B may lie from the joint, as a fraction of the link's length.
const INTERFACE_TOLERANCE: f64 = 1e-6;

/// The joint at the distal interface of a link.
///
/// # Errors
/// [`SubstitutionError::UnknownLink`], [`SubstitutionError::DistalUnclear`] or
/// [`SubstitutionError::NotAChild`].
pub fn distal_joint<'m>(
    mechanism: &'m Mechanism,
    link: &'m str,
    named: Option<&str>,
) -> Result<&'m Joint, SubstitutionError> {
    if mechanism.link(link).is_none() {
        let known = mechanism.links.iter().map(|l| l.name.clone()).collect();
        return Err(SubstitutionError::UnknownLink { link: link.to_owned(), known });
    }
    let children: Vec<&Joint> = mechanism.child_joints(link).collect();
    let names = || children.iter().map(|j| j.name.clone()).collect::<Vec<_>>();
    let moving: Vec<&&Joint> = children.iter().filter(|j| j.kind != JointKind::Fixed).collect();
    match named {
        Some(joint) => children.iter().find(|j| j.name == joint).copied().ok_or_else(|| SubstitutionError::NotAChild {
            link: link.to_owned(),
            joint: joint.to_owned(),
            children: names(),
        }),
        None => match (moving.as_slice(), children.as_slice()) {
            ([one], _) => Ok(one),
            ([], [one]) => Ok(one),
            _ => Err(SubstitutionError::DistalUnclear { link: link.to_owned(), children: names() }),
        },
    }
}

/// Replaces each named link by rigid parts with elastic joints `<link>__elastic`, or by a body that
/// bends in modes.
///
/// Joints of a lumped link beyond the plane through S across A-B, and always the distal joint, move
/// to the distal part `<link>__distal`. Joints of a link that bends in modes move to the nearest of
/// its interfaces. At zero elastic coordinates every frame is where it was, and the actuated
/// coordinates keep their order.
///
/// # Errors
/// [`SubstitutionError`], naming the link.
pub fn substitute(mechanism: &Mechanism, links: &[FlexibleLink]) -> Result<Substituted, SubstitutionError> {
    let mut result = Substituted { mechanism: mechanism.clone(), springs: Vec::new(), spans: Vec::new() };
    result.mechanism.keep_coordinate_order();
    for (i, flexible) in links.iter().enumerate() {
        if links[..i].iter().any(|other| other.link == flexible.link) {
            return Err(SubstitutionError::Twice { link: flexible.link.clone() });
        }
        let site = Site::new(&result.mechanism, flexible)?;
        let span = match &flexible.form {
            LinkForm::Modal(modal) => substitute_modal(&mut result.mechanism, flexible, &site, modal)?,
            LinkForm::TwoParts | LinkForm::Chain(_) => {
                if let Some(BranchJoint { joint, interface }) = branch_joints(mechanism, flexible).into_iter().next() {
                    return Err(SubstitutionError::Branched { link: flexible.link.clone(), joint, interface });
                }
                let (joints, parts) = lumped_parts(flexible, &site)?;
                let (span, springs) = insert_chain(&mut result.mechanism, flexible, &site, &joints, &parts);
                result.springs.extend(springs);
                span
            }
        };
        result.spans.push(span);
    }
    Ok(result)
}

/// A link that is to bend, in the mechanism.
pub(crate) struct Site {
    pub(crate) distal_joint: String,
    pub(crate) p_LA: Vector3<f64>,
    pub(crate) p_LB: Vector3<f64>,
    pub(crate) length: f64,
    pub(crate) own: Option<LinkInertia>,
}

impl Site {
    fn new(mechanism: &Mechanism, flexible: &FlexibleLink) -> Result<Self, SubstitutionError> {
        let name = &flexible.link;
        let distal = distal_joint(mechanism, name, flexible.distal.as_deref())?;
        let (p_LA, p_LB) = (flexible.reduced.X_LA.translation.vector, flexible.reduced.X_LB.translation.vector);
        let length = (p_LB - p_LA).norm();
        let distance = (distal.X_PJ.translation.vector - p_LB).norm();
        if distance > INTERFACE_TOLERANCE * length {
            let (link, joint) = (name.clone(), distal.name.clone());
            return Err(SubstitutionError::InterfaceElsewhere { link, joint, distance });
        }
        let own = mechanism.link(name).and_then(|l| l.inertia);
        Ok(Self { distal_joint: distal.name.clone(), p_LA, p_LB, length, own })
    }
}

/// Elastic joints and parts of a lumped link, proximal first.
fn lumped_parts(
    flexible: &FlexibleLink,
    site: &Site,
) -> Result<(Vec<ElasticSplit>, Vec<RigidPart>), SubstitutionError> {
    let (name, reduced) = (&flexible.link, &flexible.reduced);
    let cut = |source| SubstitutionError::Cut { link: name.clone(), source };
    let own = || site.own.ok_or_else(|| SubstitutionError::NoInertia { link: name.clone() });
    Ok(match (&flexible.form, flexible.parts) {
        (LinkForm::Chain(chain), Parts::Reduced) => (chain.joints.clone(), chain.parts.clone()),
        (LinkForm::Chain(chain), Parts::FromLink(_)) => {
            let parts = cut_chain(&own()?, &site.p_LA, &site.p_LB, &chain.parts).map_err(cut)?;
            (chain.joints.clone(), parts)
        }
        (_, Parts::Reduced) => (vec![reduced.split.clone()], vec![reduced.proximal.clone(), reduced.distal.clone()]),
        (_, Parts::FromLink(split)) => {
            let parts = cut_inertia(&own()?, &site.p_LA, &site.p_LB, split).map_err(cut)?;
            (vec![reduced.split.clone()], parts.to_vec())
        }
    })
}

fn insert_chain(
    mechanism: &mut Mechanism,
    flexible: &FlexibleLink,
    site: &Site,
    joints: &[ElasticSplit],
    parts: &[RigidPart],
) -> (FlexibleSpan, Vec<Spring>) {
    let name = &flexible.link;
    // The proximal part keeps the link's frame and name, the others have their frames at the joints
    // before them.
    for link in mechanism.links.iter_mut().filter(|l| l.name == *name) {
        link.inertia = Some(inertia_of(&parts[0]));
    }
    let last = joints.len() - 1;
    let part_name = |k: usize| {
        if k == last { format!("{name}__distal") } else { format!("{name}__part_{}", k + 2) }
    };
    let X_LD = joints[last].X_LS;
    move_children(mechanism, name, &part_name(last), &X_LD, |child, p| {
        child == site.distal_joint || (p - X_LD.translation.vector).dot(&(site.p_LB - site.p_LA)) > 0.0
    });
    let mut springs = Vec::new();
    let (mut parent, mut X_LP) = (name.clone(), Pose::identity());
    for (k, joint) in joints.iter().enumerate() {
        let distal_link = part_name(k);
        let joint_name = if last == 0 { format!("{name}__elastic") } else { format!("{name}__elastic_{}", k + 1) };
        let part = parts[k + 1].transformed(&joint.X_LS.inverse());
        mechanism.links.push(Link { name: distal_link.clone(), inertia: Some(inertia_of(&part)) });
        let kind = JointKind::Elastic(flexible.angles);
        mechanism.joints.push(Joint::new(&joint_name, kind, &parent, &distal_link, X_LP.inverse() * joint.X_LS));
        let K_S = if flexible.coupling { joint.K_S } else { drop_coupling(&joint.K_S) };
        springs.push(Spring {
            link: name.clone(),
            joint: joint_name,
            distal_link: distal_link.clone(),
            K_S,
            X_LS: joint.X_LS,
        });
        (parent, X_LP) = (distal_link, joint.X_LS);
    }
    let span = FlexibleSpan {
        link: name.clone(),
        distal_link: parent,
        X_LA: flexible.reduced.X_LA,
        X_DB: X_LD.inverse() * flexible.reduced.X_LB,
        length: site.length,
        own_mass: site.own.map_or(0.0, |i| i.mass),
        part_masses: parts.iter().map(|p| p.mass).collect(),
    };
    (span, springs)
}

/// Hangs the children of a link for which `moves(name, place)` holds on another one, whose pose in
/// the link is `X_LD`.
pub(crate) fn move_children(
    mechanism: &mut Mechanism,
    link: &str,
    to: &str,
    X_LD: &Pose,
    moves: impl Fn(&str, &Vector3<f64>) -> bool,
) {
    for child in mechanism.joints.iter_mut().filter(|j| j.parent == *link) {
        if moves(&child.name, &child.X_PJ.translation.vector) {
            child.parent = to.to_owned();
            child.X_PJ = X_LD.inverse() * child.X_PJ;
        }
    }
}

pub(crate) fn inertia_of(part: &RigidPart) -> LinkInertia {
    LinkInertia { mass: part.mass, com: part.com, inertia_com: part.inertia }
}
