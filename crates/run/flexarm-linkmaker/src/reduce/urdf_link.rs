//! Data of the link from a robot: frames of its joints and its mass, as numbers.
//!
//! Not here: reading the robot (`flexarm_run::reduce`), which this crate does not know.

use flexarm_fem::RigidPart;
use flexarm_fem::matrix_link::halves_of_bar;
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

impl UrdfLink {
    /// Returns the name of the joint at B.
    pub(super) fn distal_joint(&self) -> Option<&str> {
        let at_b = |joint: &&LinkJoint| joint.leads_on && joint.X_LJ == self.X_LB;
        self.joints.iter().find(at_b).map(|joint| joint.name.as_str())
    }

    /// Returns the difference between the mass of the link and that of its mesh, as two halves
    /// along the line from A to B, in link axes.
    #[doc(hidden)]
    pub fn rest(&self, mesh: &RigidPart, along: &Vector3<f64>) -> Result<[RigidPart; 2], String> {
        let Some(whole) = &self.inertia else {
            return Err(format!("link {:?} has no <inertial>, so `rest` is undefined", self.name));
        };
        let mass = whole.mass - mesh.mass;
        if mass.is_nan() || mass <= 0.0 {
            return Err(format!(
                "the mesh has {:.4} kg, link {:?} of the URDF {:.4} kg: no mass remains for attached bodies; omit \
                 `rest`, or correct the density",
                mesh.mass, self.name, whole.mass
            ));
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
            half.check("the difference between link and mesh").map_err(|error| {
                let mend = "omit `rest`, or correct one of them";
                format!("{error}: the mesh has more inertia than the link in the URDF; {mend}")
            })?;
        }
        Ok(halves)
    }

    /// Returns the child joints.
    #[doc(hidden)]
    pub fn leading_on(&self) -> impl Iterator<Item = &LinkJoint> {
        self.joints.iter().filter(|joint| joint.leads_on)
    }

    /// Returns the frame of a parent or child joint in the link.
    #[doc(hidden)]
    pub fn joint(&self, name: &str) -> Result<Pose, String> {
        // Child joints are searched before the parent joint.
        let found = self.leading_on().chain(&self.joints).find(|joint| joint.name == name);
        found.map(|joint| joint.X_LJ).ok_or_else(|| {
            let known: Vec<String> = self.joints.iter().map(|joint| joint.name.clone()).collect();
            let known = flexarm_settings::known_names(name, &known);
            format!("link {:?} has no joint {name:?}; its joints are {known}", self.name)
        })
    }
}
