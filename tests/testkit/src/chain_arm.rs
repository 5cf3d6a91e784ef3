//! An arm of three links that are chains: a slider, a chain on it, a hinge, a second chain, and a
//! third one on a hinge in the middle of the first.

use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, Mechanism, Pose};
use nalgebra::{Matrix3, Matrix6, Rotation3, Translation3, Vector3, Vector6};

/// The arm with its springs.
#[derive(Clone, Debug)]
pub struct ChainArm {
    /// Links and joints; three that are moved, `slide`, `elbow` and `side`.
    pub mechanism: Mechanism,
    /// Stiffness of the elastic joints, in the order of the model's.
    pub K: Vec<Matrix6<f64>>,
}

/// Chains of so many elastic joints in each of the two links, `branch` of them in the branch (none:
/// no branch).
pub fn chain_arm(joints: usize, branch: usize, angles: ElasticAngles) -> ChainArm {
    let mut arm = ChainArm { mechanism: Mechanism::new("chains"), K: Vec::new() };
    arm.mechanism.links.push(Link { name: "base".into(), inertia: None });
    let x = Vector3::x_axis();
    let slide = arm.joint("slide", JointKind::Prismatic(Vector3::y_axis()), "base", 0.1, 8.0);
    let inner = arm.chain("inner", &slide, joints, angles, 1.2);
    let elbow = arm.joint("elbow", JointKind::Continuous(Vector3::y_axis()), &inner, 0.2, 4.0);
    let outer = arm.chain("outer", &elbow, joints, angles, 0.9);
    arm.mechanism.links.push(Link { name: "tool".into(), inertia: Some(inertia(3.0, 0.1)) });
    arm.mechanism.joints.push(Joint::new("flange", JointKind::Fixed, outer, "tool", along_x(0.1)));
    if branch > 0 {
        // On the middle of the first chain.
        let middle = format!("inner {}", joints.div_ceil(2));
        let side = arm.joint("side", JointKind::Continuous(x), &middle, 0.05, 1.5);
        arm.chain("third", &side, branch, angles, 0.4);
    }
    arm
}

/// A slender part of that mass and length, not quite symmetric.
fn inertia(mass: f64, length: f64) -> LinkInertia {
    let (thick, long) = (2e-3 * mass, mass * (length * length / 12.0 + 1e-3));
    let J = Matrix3::new(thick, 1e-5, 0.0, 1e-5, long, -2e-5, 0.0, -2e-5, 1.1 * long);
    LinkInertia { mass, com: Vector3::new(0.5 * length, 0.01, -0.02), inertia_com: J }
}

fn along_x(x: f64) -> Pose {
    Pose::from_parts(Translation3::new(x, 0.0, 0.0), Rotation3::identity())
}

impl ChainArm {
    fn joint(&mut self, name: &str, kind: JointKind, parent: &str, at: f64, mass: f64) -> String {
        let child = format!("{name} link");
        self.mechanism.joints.push(Joint::new(name, kind, parent, child.clone(), along_x(at)));
        self.mechanism.links.push(Link { name: child.clone(), inertia: Some(inertia(mass, 0.2)) });
        child
    }

    /// A steel tube as so many springs with parts between; the last part.
    fn chain(&mut self, name: &str, on: &str, joints: usize, angles: ElasticAngles, length: f64) -> String {
        let piece = length / joints as f64;
        let (EA, GA, GJ, EI) = (4e8, 8e7, 4e5, 5e5);
        let mut parent = on.to_owned();
        for k in 1..=joints {
            let child = format!("{name} {k}");
            let joint = format!("{name} spring {k}");
            let at = if k == 1 { 0.5 * piece } else { piece };
            let kind = JointKind::Elastic(angles);
            self.mechanism.joints.push(Joint::new(joint, kind, parent, child.clone(), along_x(at)));
            let part = inertia(20.0 * piece, piece);
            self.mechanism.links.push(Link { name: child.clone(), inertia: Some(part) });
            self.K.push(Matrix6::from_diagonal(&(Vector6::new(EA, GA, GA, GJ, EI, 1.2 * EI) / piece)));
            parent = child;
        }
        parent
    }
}
