//! Elastic mounting: a six-DoF spring between the ground and the base of a robot.
//!
//! ```text
//! ground --springs at S--> <name>__top (attached mass) --fixed--> base
//! ```
//! Springs with play act one after another, as those of an elastic connection.
//! The ground becomes the root of the tree. At zero deflection the base is at its original pose, so
//! that the world axes remain those of the base. Not here: a base on a beam or a mesh, which is a
//! flexible link ([`crate::substitute`]).

use flexarm_kinematics::{Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use nalgebra::Matrix6;

use crate::gearbox::{GearSpring, GearStiffness, insert_springs, spring_joints};
use crate::stiffness::{StiffnessError, spring_stiffness};
use crate::substitute::FlexibleSpan;

/// Springs below the base.
#[derive(Clone, Debug, PartialEq)]
pub struct Mounting {
    /// Name in messages, and name of the ground link.
    pub name: String,
    /// Pose of the spring frame S in the base link.
    pub X_BS: Pose,
    /// Stiffness at So in S axes, forces before moments (N/m, N/rad; N m/m, N m/rad), as in
    /// [`crate::ElasticJoint`]; [`insert_mounting`] checks that it is symmetric and positive
    /// definite.
    pub K_S: Matrix6<f64>,
    /// Whether the six springs of a diagonal stiffness act one after another, each with its own
    /// law.
    pub separate: bool,
    /// Additional mass on the springs, in S axes.
    pub inertia: Option<LinkInertia>,
}

/// Reason why a mounting is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MountingError {
    /// The tree has no root, or several.
    #[error("mounting {mounting:?}: the robot has no single base link to stand on it, found {roots:?}")]
    NoSingleBase {
        /// Name of the mounting.
        mounting: String,
        /// Links without parent joint.
        roots: Vec<String>,
    },
    /// The robot has a link of this name.
    #[error("mounting {0:?}: the robot has a link of that name; call the mounting otherwise with name = \"...\"")]
    NameTaken(String),
    /// The stiffness is that of no spring.
    #[error("mounting {mounting:?}: stiffness: {source}")]
    Stiffness {
        /// Name of the mounting.
        mounting: String,
        /// Cause.
        source: StiffnessError,
    },
}

/// Returns the link without parent joint; `mounting` is the name in messages.
///
/// # Errors
/// [`MountingError::NoSingleBase`].
pub fn base_link<'m>(mechanism: &'m Mechanism, mounting: &str) -> Result<&'m Link, MountingError> {
    let carried = |link: &Link| mechanism.joints.iter().any(|joint| joint.child == link.name);
    let roots: Vec<&Link> = mechanism.links.iter().filter(|link| !carried(link)).collect();
    match roots[..] {
        [one] => Ok(one),
        _ => {
            let roots = roots.iter().map(|link| link.name.clone()).collect();
            Err(MountingError::NoSingleBase { mounting: mounting.to_owned(), roots })
        }
    }
}

/// Inserts the springs between a new ground link and the base. Returns them, from the ground
/// upward, and the location of their ends.
///
/// ```text
/// X_GB = X_GS X_ST X_TB,    X_GS = X_BS and X_TB = X_BS⁻¹, so that X_GB = 1 without deflection
/// ```
/// G is the ground, T the top of the springs, B the base.
///
/// # Errors
/// [`MountingError`]; the mechanism is then unchanged.
pub fn insert_mounting(
    mechanism: &mut Mechanism,
    mounting: &Mounting,
) -> Result<(Vec<GearSpring>, FlexibleSpan), MountingError> {
    let Mounting { name, X_BS, K_S, separate, inertia } = mounting;
    let top = format!("{name}__top");
    if let Some(taken) = [name, &top].into_iter().find(|name| mechanism.link(name).is_some()) {
        return Err(MountingError::NameTaken(taken.clone()));
    }
    // Ground and top of the springs, then the springs between them, then the base on the top.
    let base = base_link(mechanism, name)?.name.clone();
    spring_stiffness(K_S).map_err(|source| MountingError::Stiffness { mounting: name.clone(), source })?;
    mechanism.links.push(Link { name: name.clone(), inertia: None });
    mechanism.links.push(Link { name: top.clone(), inertia: *inertia });
    let stiffness = match separate {
        true => GearStiffness::Separate(K_S.diagonal().into()),
        false => GearStiffness::Full(*K_S),
    };
    let ends = (name.clone(), top.clone());
    let springs = insert_springs(mechanism, name, spring_joints(&stiffness, None), ends, *X_BS);
    mechanism.joints.push(Joint::new(format!("{name}__base"), JointKind::Fixed, &top, base, X_BS.inverse()));
    let mass = inertia.map_or(0.0, |inertia| inertia.mass);
    let span = FlexibleSpan {
        link: name.clone(),
        distal_link: top,
        X_LA: *X_BS,
        X_DB: Pose::identity(),
        joints: Vec::new(),
        length: 0.0,
        part_masses: vec![mass],
        share: 1.0,
        lumped: None,
    };
    Ok((springs, span))
}
