//! One link into two with an elastic joint between.

use flexarm_fem::{ReducedLink, RigidPart, drop_coupling};
use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use nalgebra::Matrix6;

use crate::cut::{CutError, cut_inertia};

/// A link that bends.
#[derive(Clone, Debug)]
pub struct FlexibleLink {
    /// Name of the link.
    pub link: String,
    /// Name of the joint at the distal interface; found by itself if the link has one joint that leads on.
    pub distal: Option<String>,
    /// Stiffness, frames and parts.
    pub reduced: ReducedLink,
    /// Whose mass properties the parts take.
    pub parts: Parts,
    /// Coordinates of the elastic rotation.
    pub angles: ElasticAngles,
    /// `false` drops the coupling terms of `K_S`: only to show what that costs.
    pub coupling: bool,
}

impl FlexibleLink {
    /// With the reduced link's own parts, rotation vector and full coupling.
    pub fn new(link: impl Into<String>, reduced: ReducedLink) -> Self {
        let (angles, parts) = (ElasticAngles::default(), Parts::Reduced);
        Self { link: link.into(), distal: None, reduced, parts, angles, coupling: true }
    }
}

/// Mass properties of the two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parts {
    /// As the reduced link says.
    Reduced,
    /// The mechanism's own inertia of the link, cut at this fraction of the line A-B: the rigid twin is unchanged.
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
    /// Distance of the interfaces (m).
    pub length: f64,
    /// Pose of S in the link.
    pub X_LS: Pose,
    /// Pose of B in the link.
    pub X_LB: Pose,
    /// Pose of A in the link.
    pub X_LA: Pose,
    /// Mass of the link in the mechanism (kg).
    pub own_mass: f64,
    /// Masses of the proximal and the distal part (kg).
    pub part_masses: [f64; 2],
}

/// A mechanism with its flexible links in place.
#[derive(Clone, Debug)]
pub struct Substituted {
    /// The tree with elastic joints.
    pub mechanism: Mechanism,
    /// One per flexible link, in the order given.
    pub springs: Vec<Spring>,
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
    /// The parts cannot be made.
    #[error("link {link:?} cannot be cut in two: {source}")]
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
/// [`SubstitutionError::UnknownLink`], [`SubstitutionError::DistalUnclear`] or [`SubstitutionError::NotAChild`].
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

/// Replaces each named link by two rigid parts and an elastic joint `<link>__elastic`.
///
/// Joints of the link beyond the plane through S across A-B, and always the distal joint, move to the distal part
/// `<link>__distal`, whose frame is S. At zero elastic coordinates every frame is where it was.
///
/// # Errors
/// [`SubstitutionError`], naming the link.
pub fn substitute(mechanism: &Mechanism, links: &[FlexibleLink]) -> Result<Substituted, SubstitutionError> {
    let mut result = Substituted { mechanism: mechanism.clone(), springs: Vec::new() };
    for (i, flexible) in links.iter().enumerate() {
        if links[..i].iter().any(|other| other.link == flexible.link) {
            return Err(SubstitutionError::Twice { link: flexible.link.clone() });
        }
        let spring = substitute_one(&mut result.mechanism, flexible)?;
        result.springs.push(spring);
    }
    Ok(result)
}

fn substitute_one(mechanism: &mut Mechanism, flexible: &FlexibleLink) -> Result<Spring, SubstitutionError> {
    let name = &flexible.link;
    let reduced = &flexible.reduced;
    let distal = distal_joint(mechanism, name, flexible.distal.as_deref())?;
    let (p_LA, p_LB) = (reduced.X_LA.translation.vector, reduced.X_LB.translation.vector);
    let length = (p_LB - p_LA).norm();
    let distance = (distal.X_PJ.translation.vector - p_LB).norm();
    if distance > INTERFACE_TOLERANCE * length {
        return Err(SubstitutionError::InterfaceElsewhere { link: name.clone(), joint: distal.name.clone(), distance });
    }
    let distal = distal.name.clone();

    let own = mechanism.link(name).and_then(|l| l.inertia);
    let parts = match flexible.parts {
        Parts::Reduced => [reduced.proximal.clone(), reduced.distal.clone()],
        Parts::FromLink(split) => {
            let own = own.ok_or_else(|| SubstitutionError::NoInertia { link: name.clone() })?;
            cut_inertia(&own, &p_LA, &p_LB, split)
                .map_err(|source| SubstitutionError::Cut { link: name.clone(), source })?
        }
    };
    let (own_mass, part_masses) = (own.map_or(0.0, |i| i.mass), [parts[0].mass, parts[1].mass]);

    // The proximal part keeps the link's frame and name, the distal part has its frame at S.
    let X_LS = reduced.split.X_LS;
    let distal_link = format!("{name}__distal");
    let joint = format!("{name}__elastic");
    for link in &mut mechanism.links {
        if link.name == *name {
            link.inertia = Some(inertia_of(&parts[0]));
        }
    }
    let far = parts[1].transformed(&X_LS.inverse());
    mechanism.links.push(Link { name: distal_link.clone(), inertia: Some(inertia_of(&far)) });
    let direction = (p_LB - p_LA) / length;
    for child in mechanism.joints.iter_mut().filter(|j| j.parent == *name) {
        let beyond = (child.X_PJ.translation.vector - X_LS.translation.vector).dot(&direction) > 0.0;
        if child.name == distal || beyond {
            child.parent.clone_from(&distal_link);
            child.X_PJ = X_LS.inverse() * child.X_PJ;
        }
    }
    let kind = JointKind::Elastic(flexible.angles);
    mechanism.joints.push(Joint::new(&joint, kind, name, &distal_link, X_LS));

    let K_S = if flexible.coupling { reduced.split.K_S } else { drop_coupling(&reduced.split.K_S) };
    let (X_LA, X_LB) = (reduced.X_LA, reduced.X_LB);
    Ok(Spring { link: name.clone(), joint, distal_link, K_S, length, X_LS, X_LB, X_LA, own_mass, part_masses })
}

fn inertia_of(part: &RigidPart) -> LinkInertia {
    LinkInertia { mass: part.mass, com: part.com, inertia_com: part.inertia }
}
