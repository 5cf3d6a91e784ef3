//! Data of the link from a robot file.

use flexarm_fem::matrix_link::halves_of_bar;
use flexarm_fem::{FemError, RigidPart};
use flexarm_spatial::Pose;
use nalgebra::Vector3;

/// Data from a robot for the link to be reduced: frames of its joints, and its mass. The caller,
/// which reads the robot file ([`UrdfEntry::file`](super::UrdfEntry::file)), fills it in. SI, link
/// axes.
#[derive(Clone, Debug)]
pub struct UrdfLink {
    /// Name of the link in the robot.
    pub name: String,
    /// Frame of the distal interface: that of the joint at B.
    pub X_LB: Pose,
    /// Joints at the link, in the order of the robot.
    pub joints: Vec<LinkJoint>,
    /// Mass, centre of mass and inertia about it (kg, m, kg m²), if the robot has them.
    pub inertia: Option<RigidPart>,
}

/// A joint at a link.
#[derive(Clone, Debug)]
pub struct LinkJoint {
    /// Name of the joint.
    pub name: String,
    /// Frame of the joint in the link; for the parent joint, the link's own frame.
    pub X_LJ: Pose,
    /// Whether it is a child joint; otherwise it is the parent joint.
    pub leads_on: bool,
}

/// Reason why a link of a robot lacks what a job takes from it.
#[derive(Debug, thiserror::Error)]
pub(super) enum UrdfLinkError {
    #[error("link {link:?} has no <inertial>, so `rest` is undefined")]
    NoInertia { link: String },
    #[error(
        "the mesh has {mesh:.4} kg, link {link:?} of the URDF {whole:.4} kg: no mass remains for attached bodies; omit \
         `rest`, or correct the density"
    )]
    NoRest { link: String, mesh: f64, whole: f64 },
    #[error("{0}: the mesh has more inertia than the link in the URDF; omit `rest`, or correct one of them")]
    Inertia(FemError),
    #[error("link {link:?} has no joint {joint:?}; its joints are {known:?}")]
    UnknownJoint { link: String, joint: String, known: Vec<String> },
}

impl UrdfLink {
    /// Returns the name of the joint at B.
    pub(super) fn distal_joint(&self) -> Option<&str> {
        let at_b = |joint: &&LinkJoint| joint.leads_on && joint.X_LJ == self.X_LB;
        self.joints.iter().find(at_b).map(|joint| joint.name.as_str())
    }

    /// Returns the difference between the mass of the link and that of its mesh, as two halves
    /// along the line from A to B, in link axes.
    pub(super) fn rest(&self, mesh: &RigidPart, along: &Vector3<f64>) -> Result<[RigidPart; 2], UrdfLinkError> {
        let Some(whole) = &self.inertia else {
            return Err(UrdfLinkError::NoInertia { link: self.name.clone() });
        };
        let mass = whole.mass - mesh.mass;
        if mass.is_nan() || mass <= 0.0 {
            return Err(UrdfLinkError::NoRest { link: self.name.clone(), mesh: mesh.mass, whole: whole.mass });
        }
        let com = (whole.com * whole.mass - mesh.com * mesh.mass) / mass;
        // Second moments about the centre of mass of the difference.
        let about = |part: f64, com_part: Vector3<f64>| {
            let c = (com_part - com).cross_matrix();
            -c * c * part
        };
        let inertia = whole.inertia + about(whole.mass, whole.com) - mesh.inertia - about(mesh.mass, mesh.com);
        let halves = halves_of_bar(&RigidPart { mass, com, inertia }, along);
        for half in &halves {
            half.check("the difference between link and mesh").map_err(UrdfLinkError::Inertia)?;
        }
        Ok(halves)
    }

    /// Returns the child joints.
    pub(super) fn leading_on(&self) -> impl Iterator<Item = &LinkJoint> {
        self.joints.iter().filter(|joint| joint.leads_on)
    }

    /// Returns the frame of a parent or child joint in the link.
    pub(super) fn joint(&self, name: &str) -> Result<Pose, UrdfLinkError> {
        // Child joints are searched before the parent joint.
        let found = self.leading_on().chain(&self.joints).find(|joint| joint.name == name);
        found.map(|joint| joint.X_LJ).ok_or_else(|| UrdfLinkError::UnknownJoint {
            link: self.name.clone(),
            joint: name.to_owned(),
            known: self.joints.iter().map(|joint| joint.name.clone()).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    /// Truth: mass, first moment and moment of inertia of joined bodies add up (Steiner).
    #[test]
    fn mesh_and_what_rides_on_it_have_the_mass_and_the_inertia_of_the_robots_link() {
        let body = |mass, com, moments| RigidPart { mass, com, inertia: Matrix3::from_diagonal(&moments) };
        let whole = body(30.0, Vector3::new(0.40, 0.01, -0.02), Vector3::new(0.9, 3.0, 3.2));
        let mesh = body(18.0, Vector3::new(0.45, 0.0, 0.0), Vector3::new(0.2, 1.4, 1.5));
        let link = UrdfLink {
            name: "upper arm".into(),
            X_LB: Pose::translation(0.8, 0.0, 0.0),
            joints: Vec::new(),
            inertia: Some(whole.clone()),
        };
        let [near, far] = link.rest(&mesh, &Vector3::x()).unwrap();
        let joined = mesh.merged(&near).merged(&far);
        assert!((joined.mass - whole.mass).abs() < 1e-12 * whole.mass);
        assert!((joined.com - whole.com).norm() < 1e-12);
        assert!((joined.inertia - whole.inertia).amax() < 1e-12 * whole.inertia.amax());
        assert!(near.com.x < far.com.x, "proximal first");
        // A mesh heavier than the link leaves no mass to attach.
        assert!(
            link.rest(&mesh.with_mass(31.0), &Vector3::x()).unwrap_err().to_string().contains("correct the density")
        );
    }

    #[test]
    fn a_joint_is_found_at_either_end_and_the_one_that_carries_the_link_is_at_its_origin() {
        let joint = |name: &str, x: f64, leads_on| LinkJoint {
            name: name.into(),
            X_LJ: Pose::translation(x, 0.0, 0.0),
            leads_on,
        };
        let link = UrdfLink {
            name: "upper arm".into(),
            X_LB: Pose::translation(0.8, 0.0, 0.0),
            joints: vec![joint("shoulder", 0.0, false), joint("elbow", 0.8, true)],
            inertia: None,
        };
        assert_eq!(link.joint("elbow").unwrap().translation.vector.x, 0.8);
        assert_eq!(link.joint("shoulder").unwrap(), Pose::identity());
        assert!(link.joint("wrist").unwrap_err().to_string().contains(r#"["shoulder", "elbow"]"#));
        assert_eq!(link.leading_on().count(), 1);
    }
}
