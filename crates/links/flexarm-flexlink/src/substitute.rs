//! Replacement of a link by rigid parts connected by elastic joints, or by a modal body.
//!
//! Start at [`substitute`]. The proximal part keeps name and frame of the link L; the frame of every
//! other part is at the elastic joint S inward of it, in S axes. A and B are the interfaces of the
//! reduced link, D is the part that carries B. Linear first, SI units.
//! Not here: masses cut from the link's own inertia ([`crate::cut_chain`]), modal bodies
//! (`modal.rs`), the stiffness itself (`flexarm-fem`).

use std::sync::Arc;

use flexarm_fem::chain::Chain;
use flexarm_fem::{ModalLink, ReducedLink, RigidPart, drop_coupling};
use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use nalgebra::{Matrix6, Vector3};

use crate::cut::{CutError, SharedInertia, cut_chain, cut_inertia, share_inertia};
use crate::interfaces::{BranchJoint, branch_joints};
use crate::modal::substitute_modal;

/// Link to be made flexible.
#[derive(Clone, Debug)]
pub struct FlexibleLink {
    /// Name of the link.
    pub link: String,
    /// Name of the joint at the distal interface; `None` to find it, if the link has a single child
    /// joint that qualifies.
    pub distal: Option<String>,
    /// Stiffness, frames and parts.
    pub reduced: ReducedLink,
    /// Source of the mass properties of the parts.
    pub parts: Parts,
    /// Rigid parts or modes.
    pub form: LinkForm,
    /// Parametrisation of the elastic rotation.
    pub angles: ElasticAngles,
    /// Whether the coupling terms of `K_S` are kept; `false` only to show the error without them.
    pub coupling: bool,
}

impl FlexibleLink {
    /// Creates a flexible link with the reduced link's own parts, rotation vector and full
    /// coupling.
    pub fn new(link: impl Into<String>, reduced: ReducedLink) -> Self {
        let (angles, parts) = (ElasticAngles::default(), Parts::Reduced);
        Self { link: link.into(), distal: None, reduced, parts, form: LinkForm::TwoParts, angles, coupling: true }
    }
}

/// Model of a flexible link.
#[derive(Clone, Debug, Default)]
pub enum LinkForm {
    /// Two rigid parts with one elastic joint, as in the reduced link.
    #[default]
    TwoParts,
    /// n rigid parts with n - 1 elastic joints.
    Chain(Chain),
    /// One modal body.
    Modal(Arc<ModalLink>),
}

impl LinkForm {
    /// Returns the name for messages and reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::TwoParts | Self::Chain(_) => "lumped",
            Self::Modal(_) => "modal",
        }
    }
}

/// Source of the mass properties of the parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parts {
    /// From the reduced link.
    Reduced,
    /// From the mechanism's own inertia of the link, divided at this fraction of the line A-B, or
    /// shared by the beam and its ends where it cannot be divided; together the parts have its mass,
    /// centre of mass and inertia.
    FromLink(f64),
}

/// Elastic joint of a lumped flexible link, between its proximal part P and its distal part Q.
///
/// ```text
/// [ f ]   [ K_tt   K_tr ] [ d ]       f (N), t (N m): wrench on Q at So that displaces it, P held
/// [ t ] = [ K_trᵀ  K_rr ] [ φ ]       d (m), φ (rad): displacement of So and rotation of Q
/// ```
/// All in S axes, which are those of P: about another point the blocks are others. `K_tr` is not
/// zero where the link bends under a force at So. Linear in d and φ: a link that turns by tenths of
/// a radian needs more parts.
///
/// [`substitute`] does not check `K_S`: [`flexarm_fem::stiffness_at_split`] refuses what is not
/// symmetric and positive definite, and so do the steppers.
#[derive(Clone, Debug)]
pub struct ElasticJoint {
    /// Name of the elastic joint.
    pub joint: String,
    /// Name of the distal part.
    pub distal_link: String,
    /// `K_S`, at So in S axes (N/m, N/rad; N m/m, N m/rad).
    pub K_S: Matrix6<f64>,
    /// Pose of S in the link.
    pub X_LS: Pose,
}

/// Flexible link on the tree, with the location of its ends.
#[derive(Clone, Debug)]
pub struct FlexibleSpan {
    /// Name of the link; its frame is still at its proximal end.
    pub link: String,
    /// Name of the link that now carries interface B.
    pub distal_link: String,
    /// Pose of A in the link.
    pub X_LA: Pose,
    /// Pose of B in the distal link.
    pub X_DB: Pose,
    /// Elastic joints of a lumped link, proximal first; none for a modal link and a mounting.
    pub joints: Vec<ElasticJoint>,
    /// Distance between the interfaces (m).
    pub length: f64,
    /// Masses of the parts, proximal first (kg); for a modal link, the modal body first.
    pub part_masses: Vec<f64>,
    /// Joints and parts of a lumped link; `None` for a modal link and a mounting.
    pub lumped: Option<Chain>,
    /// Share of a modal link's own mass in that of the link; the rest is fixed to its ends.
    pub share: f64,
}

/// Mechanism with its flexible links.
#[derive(Clone, Debug)]
pub struct Substituted {
    /// Tree with elastic joints.
    pub mechanism: Mechanism,
    /// One per flexible link, in the order given.
    pub spans: Vec<FlexibleSpan>,
}

impl Substituted {
    /// Returns the elastic joints of all lumped links, in the order given, proximal first.
    pub fn joints(&self) -> impl Iterator<Item = &ElasticJoint> {
        self.spans.iter().flat_map(|span| &span.joints)
    }
}

/// Reason why a link cannot be made flexible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubstitutionError {
    /// There is no link with this name.
    #[error("flexible link {link:?} is not a link of the robot; its links are {known:?}")]
    UnknownLink {
        /// Requested name.
        link: String,
        /// Names of the existing links.
        known: Vec<String>,
    },
    /// The distal joint is ambiguous.
    #[error("link {link:?} has {} joints that lead on ({children:?}): name the one at the far interface with distal = \"...\"", children.len())]
    DistalUnclear {
        /// The link.
        link: String,
        /// Its child joints.
        children: Vec<String>,
    },
    /// The joint named as distal starts at another link.
    #[error("distal joint {joint:?} does not start at link {link:?}; its joints are {children:?}")]
    NotAChild {
        /// The link.
        link: String,
        /// Joint named as distal.
        joint: String,
        /// Child joints of the link.
        children: Vec<String>,
    },
    /// Two entries are about the same link.
    #[error("flexible link {0:?} is listed twice")]
    Twice(String),
    /// Interface B of the reduced link is not at the distal joint.
    #[error(
        "link {link:?}: interface B of the reduced link lies {distance:.3e} m from joint {joint:?}: check units and \
         frames of the reduced link"
    )]
    NotAtJoint {
        /// The link.
        link: String,
        /// The distal joint.
        joint: String,
        /// Distance of B from the joint (m).
        distance: f64,
    },
    /// A joint of a lumped link is at an interface other than its two ends.
    #[error(
        "joint {joint:?} hangs on interface {interface:?} of link {link:?}, which is neither its near nor its far end: \
         rigid parts with springs carry load at the two ends alone, let the link bend in modes"
    )]
    ThirdInterface {
        /// The link.
        link: String,
        /// The joint.
        joint: String,
        /// Its interface.
        interface: String,
    },
    /// The link has no inertia that could be divided.
    #[error("link {0:?} has no inertia to cut: give the parts in a .flex file or use parts = \"uniform\"")]
    NoInertia(String),
    /// The inertia of the link cannot be divided among a beam and its ends.
    #[error("the mass of link {link:?} cannot be spread along it: {source}")]
    Cut {
        /// The link.
        link: String,
        /// Cause.
        source: CutError,
    },
    /// The modal body has no interface at B, or another mass than the link.
    #[error("link {link:?} cannot bend in modes: {what}")]
    NotModal {
        /// The link.
        link: String,
        /// Value found, and the one expected.
        what: String,
    },
}

/// Maximum distance of the reduced link's B from the joint, relative to the link's length.
const INTERFACE_TOLERANCE: f64 = 1e-6;

/// Finds the joint at the distal interface of a link: the one named, or else the only moving child,
/// or else the only child.
///
/// # Errors
/// [`SubstitutionError::UnknownLink`], [`SubstitutionError::DistalUnclear`], or
/// [`SubstitutionError::NotAChild`] for a named joint elsewhere.
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
    let moving: Vec<&Joint> = children.iter().copied().filter(|j| j.kind != JointKind::Fixed).collect();
    match named {
        Some(joint) => children.iter().find(|j| j.name == joint).copied().ok_or_else(|| SubstitutionError::NotAChild {
            link: link.to_owned(),
            joint: joint.to_owned(),
            children: names(),
        }),
        None => match (moving.as_slice(), children.as_slice()) {
            ([one], _) | ([], [one]) => Ok(one),
            _ => Err(SubstitutionError::DistalUnclear { link: link.to_owned(), children: names() }),
        },
    }
}

/// Replaces each named link by rigid parts with elastic joints `<link>__elastic`, or by a modal
/// body.
///
/// Joints of a lumped link beyond the plane through S normal to A-B, and always the distal joint,
/// move to the distal part `<link>__distal`. Joints of a modal link move to the nearest interface.
/// At zero elastic coordinates all frames are unchanged, and the actuated coordinates keep their
/// order. Stiffnesses are not checked, see [`ElasticJoint`].
///
/// # Errors
/// [`SubstitutionError`] with the name of the link.
pub fn substitute(mechanism: &Mechanism, links: &[FlexibleLink]) -> Result<Substituted, SubstitutionError> {
    let mut result = Substituted { mechanism: mechanism.clone(), spans: Vec::new() };
    result.mechanism.keep_coordinate_order();
    for (i, flexible) in links.iter().enumerate() {
        let name = &flexible.link;
        if links[..i].iter().any(|other| other.link == *name) {
            return Err(SubstitutionError::Twice(name.clone()));
        }
        let site = Site::new(&result.mechanism, flexible)?;
        result.spans.push(match &flexible.form {
            LinkForm::Modal(modal) => substitute_modal(&mut result.mechanism, flexible, &site, modal)?,
            LinkForm::TwoParts | LinkForm::Chain(_) => {
                if let Some(BranchJoint { joint, interface }) = branch_joints(mechanism, flexible).into_iter().next() {
                    return Err(SubstitutionError::ThirdInterface { link: name.clone(), joint, interface });
                }
                let chain = lumped_parts(flexible, &site)?;
                insert_chain(&mut result.mechanism, flexible, &site, chain)
            }
        });
    }
    Ok(result)
}

/// Link to be made flexible, with its data in the mechanism.
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
            return Err(SubstitutionError::NotAtJoint { link: name.clone(), joint: distal.name.clone(), distance });
        }
        let own = mechanism.link(name).and_then(|l| l.inertia);
        Ok(Self { distal_joint: distal.name.clone(), p_LA, p_LB, length, own })
    }

    /// Returns the mechanism's own inertia of the link.
    pub(crate) fn own(&self, link: &str) -> Result<LinkInertia, SubstitutionError> {
        self.own.ok_or_else(|| SubstitutionError::NoInertia(link.to_owned()))
    }
}

/// Divides the mechanism's own inertia of a link into its beam and bodies at its two ends.
pub(crate) fn shared(flexible: &FlexibleLink, site: &Site) -> Result<SharedInertia, SubstitutionError> {
    let link = &flexible.link;
    share_inertia(&site.own(link)?, [&flexible.reduced.proximal, &flexible.reduced.distal])
        .map_err(|source| SubstitutionError::Cut { link: link.clone(), source })
}

/// Returns the elastic joints and parts of a lumped link, proximal first: those of the reduced link,
/// with the masses of the mechanism's link if its parts are cut from that one.
fn lumped_parts(flexible: &FlexibleLink, site: &Site) -> Result<Chain, SubstitutionError> {
    let reduced = &flexible.reduced;
    let chain = match &flexible.form {
        LinkForm::Chain(chain) => chain.clone(),
        _ => {
            let parts = vec![reduced.proximal.clone(), reduced.distal.clone()];
            Chain { joints: vec![reduced.split.clone()], parts }
        }
    };
    let Parts::FromLink(split) = flexible.parts else { return Ok(chain) };
    // Cut the mechanism's own inertia along the line from A to B.
    let own = site.own(&flexible.link)?;
    let cut = match &flexible.form {
        LinkForm::Chain(_) => cut_chain(&own, &site.p_LA, &site.p_LB, &chain.parts),
        _ => cut_inertia(&own, &site.p_LA, &site.p_LB, split).map(Vec::from),
    };
    if let Some(parts) = cut {
        return Ok(Chain { parts, ..chain });
    }
    // It cannot be cut: scale the parts of the beam, and add the rest as bodies at the two ends.
    let SharedInertia { share, ends: [near, far] } = shared(flexible, site)?;
    let mut parts: Vec<RigidPart> = chain.parts.iter().map(|part| part.with_mass(share * part.mass)).collect();
    let last = parts.len() - 1;
    parts[0] = parts[0].merged(&near);
    parts[last] = parts[last].merged(&far);
    Ok(Chain { parts, ..chain })
}

/// Replaces a link by the parts of a chain; returns where its ends and elastic joints are.
fn insert_chain(mechanism: &mut Mechanism, flexible: &FlexibleLink, site: &Site, chain: Chain) -> FlexibleSpan {
    let (name, Chain { joints, parts }) = (&flexible.link, &chain);
    // The proximal part keeps the link's frame and name; the frames of the others are at the joints
    // inward of them.
    for link in mechanism.links.iter_mut().filter(|l| l.name == *name) {
        link.inertia = Some(inertia_of(&parts[0]));
    }

    // The distal joint and the children beyond the plane through the last S move to the last part.
    let last = joints.len() - 1;
    let part_name = |k: usize| {
        if k == last { format!("{name}__distal") } else { format!("{name}__part_{}", k + 2) }
    };
    let X_LD = joints[last].X_LS;
    move_children(mechanism, name, &part_name(last), &X_LD, |child, p| {
        child == site.distal_joint || (p - X_LD.translation.vector).dot(&(site.p_LB - site.p_LA)) > 0.0
    });

    // From part P to part Q over the elastic joint at S: X_PS = X_LP⁻¹ X_LS.
    let mut elastic = Vec::new();
    let (mut parent, mut X_LP) = (name.clone(), Pose::identity());
    for (k, joint) in joints.iter().enumerate() {
        let distal_link = part_name(k);
        let joint_name = if last == 0 { format!("{name}__elastic") } else { format!("{name}__elastic_{}", k + 1) };
        let part = parts[k + 1].transformed(&joint.X_LS.inverse());
        mechanism.links.push(Link { name: distal_link.clone(), inertia: Some(inertia_of(&part)) });
        let kind = JointKind::Elastic(flexible.angles);
        mechanism.joints.push(Joint::new(&joint_name, kind, &parent, &distal_link, X_LP.inverse() * joint.X_LS));
        let K_S = if flexible.coupling { joint.K_S } else { drop_coupling(&joint.K_S) };
        elastic.push(ElasticJoint { joint: joint_name, distal_link: distal_link.clone(), K_S, X_LS: joint.X_LS });
        (parent, X_LP) = (distal_link, joint.X_LS);
    }
    FlexibleSpan {
        link: name.clone(),
        distal_link: parent,
        X_LA: flexible.reduced.X_LA,
        X_DB: X_LD.inverse() * flexible.reduced.X_LB,
        joints: elastic,
        length: site.length,
        part_masses: parts.iter().map(|p| p.mass).collect(),
        lumped: Some(chain),
        share: 1.0,
    }
}

/// Moves those child joints of a link for which `moves(name, position)` holds to the link `to`,
/// whose pose in the link is `X_LD`.
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
