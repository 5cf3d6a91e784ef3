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

use crate::gearbox::{ASYMMETRY, GearSpring, GearStiffness, insert_springs, spring_joints};
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

/// Reason why a mounting is invalid, with its name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("mounting {0:?}: {1}")]
pub struct MountingError(String, String);

fn invalid(mounting: &str, what: impl Into<String>) -> MountingError {
    MountingError(mounting.to_owned(), what.into())
}

/// Returns the link without parent joint.
///
/// # Errors
/// [`MountingError`] if there is not exactly one.
pub fn base_link<'m>(mechanism: &'m Mechanism, mounting: &str) -> Result<&'m Link, MountingError> {
    let carried = |link: &Link| mechanism.joints.iter().any(|joint| joint.child == link.name);
    let roots: Vec<&Link> = mechanism.links.iter().filter(|link| !carried(link)).collect();
    match roots[..] {
        [one] => Ok(one),
        _ => {
            let roots: Vec<&String> = roots.iter().map(|link| &link.name).collect();
            let what = format!("the robot has no single base link to stand on it, found {roots:?}");
            Err(invalid(mounting, what))
        }
    }
}

fn check_stiffness(name: &str, K: &Matrix6<f64>) -> Result<(), MountingError> {
    let not_positive = |found: f64| {
        let must = "its stiffness must be finite and positive definite";
        Err(invalid(name, format!("{must}, found {found:e} as its smallest value")))
    };
    if let Some(hole) = K.iter().find(|k| !k.is_finite()) {
        return not_positive(*hole);
    }
    let asymmetry = (K - K.transpose()).amax() / K.amax();
    if asymmetry > ASYMMETRY {
        let must = "its 6x6 stiffness must be symmetric";
        return Err(invalid(name, format!("{must}, found a relative asymmetry of {asymmetry:.1e}")));
    }
    // Forces and moments have different units, so the matrix is scaled to a unit diagonal.
    let diagonal = K.diagonal();
    if diagonal.min() <= 0.0 {
        return not_positive(diagonal.min());
    }
    let scaled = Matrix6::from_fn(|i, j| K[(i, j)] / (diagonal[i] * diagonal[j]).sqrt());
    match scaled.symmetric_eigenvalues().min() {
        least if least > 1e-12 => Ok(()),
        least => not_positive(least),
    }
}

/// Inserts the springs between a new ground link and the base. Returns them, from the ground
/// upward, and the location of their ends.
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
        let mend = "call the mounting otherwise with name = \"...\"";
        return Err(invalid(taken, format!("the robot has a link of that name; {mend}")));
    }
    let base = base_link(mechanism, name)?.name.clone();
    check_stiffness(name, K_S)?;
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
        length: 0.0,
        part_masses: vec![mass],
        share: 1.0,
        lumped: None,
    };
    Ok((springs, span))
}
