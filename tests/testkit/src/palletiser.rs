//! A palletising arm with closed loops: the upper arm is driven by a crank and a rod, all four bars
//! of different lengths.

use flexarm_kinematics::{ElasticAngles, Joint, JointKind, Link, LinkInertia, LoopClosure, Mechanism, Pose};
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};

/// The arm and the stiffness of its springs, in coordinate order.
pub struct PalletisingArm {
    /// Turn, lower arm and crank drive; elbow and rod follow from the loop.
    pub mechanism: Mechanism,
    /// Name and stiffness.
    pub springs: Vec<(String, DMatrix<f64>)>,
}

fn body(name: &str, mass: f64, com: [f64; 3], arms: [f64; 3]) -> Link {
    let [x, y, z] = arms.map(|arm| mass * arm * arm);
    let inertia_com = Matrix3::new(y + z, 0.1 * x, -0.05 * z, 0.1 * x, x + z, 0.04 * y, -0.05 * z, 0.04 * y, x + y);
    Link { name: name.into(), inertia: Some(LinkInertia { mass, com: com.into(), inertia_com }) }
}

/// `yields`: with gearboxes of the lower arm and the crank that give way about their axes, and with
/// a lower arm and a rod that give way in six directions within the loop.
pub fn palletising_arm(yields: bool) -> PalletisingArm {
    let mut tree = Mechanism::new("palletising arm");
    tree.links.push(Link { name: "base".into(), inertia: None });
    tree.links.extend([
        body("column", 300.0, [0.1, 0.02, 0.4], [0.2, 0.25, 0.3]),
        body("lower", 120.0, [0.05, 0.1, 0.5], [0.1, 0.08, 0.35]),
        body("upper", 90.0, [0.4, -0.05, 0.03], [0.4, 0.08, 0.1]),
        body("crank", 25.0, [-0.15, 0.04, 0.01], [0.12, 0.04, 0.05]),
        body("rod", 15.0, [0.01, 0.06, 0.5], [0.03, 0.03, 0.3]),
        body("load", 60.0, [0.05, 0.0, -0.2], [0.1, 0.1, 0.1]),
    ]);
    for frame in ["tool", "lug", "end"] {
        tree.links.push(Link { name: frame.into(), inertia: None });
    }
    let about_y = JointKind::Continuous(Vector3::y_axis());
    let at = |x: f64, z: f64| Pose::translation(x, 0.0, z);
    let mut joint = |name: &str, kind, parent: &str, child: &str, X| {
        tree.joints.push(Joint::new(name, kind, parent, child, X));
    };
    joint("turn", JointKind::Continuous(Vector3::z_axis()), "base", "column", Pose::identity());
    joint("lower", about_y, "column", "lower", at(0.3, 0.8));
    joint("elbow", about_y, "lower", "upper", at(0.0, 1.2));
    joint("carry", JointKind::Fixed, "upper", "load", at(1.4, 0.1));
    joint("tool", JointKind::Fixed, "load", "tool", at(0.0, -0.3));
    joint("crank", about_y, "column", "crank", at(0.2, 1.05));
    joint("rod", about_y, "crank", "rod", at(-0.35, 0.0));
    joint("end", JointKind::Fixed, "rod", "end", at(0.0, 1.05));
    joint("lug", JointKind::Fixed, "upper", "lug", at(-0.47, 0.0));
    tree.loops.push(LoopClosure {
        name: "drive of the upper arm".into(),
        pin: "lug".into(),
        axis: Vector3::y_axis(),
        eye: "end".into(),
        dependent: ["elbow".into(), "rod".into()],
        at: vec![],
    });
    let mut springs = Vec::new();
    if yields {
        for (name, k) in [("lower", 2.2e6), ("crank", 1.4e6)] {
            let motor = format!("{name}__motor");
            let joint = tree.joints.iter_mut().find(|j| j.name == name).expect("of this tree");
            let child = std::mem::replace(&mut joint.child, motor.clone());
            joint.armature = 40.0;
            tree.links.push(Link { name: motor.clone(), inertia: None });
            let spring = format!("{name}__spring");
            tree.joints.push(Joint::new(
                &spring,
                JointKind::ElasticRevolute(Vector3::y_axis()),
                motor,
                child,
                Pose::identity(),
            ));
            springs.push((spring, DMatrix::from_element(1, 1, k)));
        }
        for (name, length, k) in [("lower", 0.5, 8e7), ("rod", 0.4, 3e7)] {
            let far = format!("{name}__far");
            for joint in tree.joints.iter_mut().filter(|j| j.parent == name) {
                joint.parent.clone_from(&far);
                joint.X_PJ = at(0.0, length).inverse() * joint.X_PJ;
            }
            tree.links.push(body(&far, 20.0, [0.02, 0.03, 0.2], [0.05, 0.05, 0.1]));
            let elastic = JointKind::Elastic(ElasticAngles::RotationVector);
            let spring = format!("{name}__elastic");
            tree.joints.push(Joint::new(&spring, elastic, name, far, at(0.0, length)));
            let mut K = Matrix6::from_diagonal(&[k, k, 4.0 * k, 0.05 * k, 0.05 * k, 0.03 * k].into());
            (K[(0, 4)], K[(4, 0)], K[(1, 3)], K[(3, 1)]) = (0.05 * k, 0.05 * k, -0.05 * k, -0.05 * k);
            springs.push((spring, DMatrix::from_column_slice(6, 6, K.as_slice())));
        }
    }
    // Springs in the order of the tree's coordinates.
    let order = flexarm_kinematics::Model::new(&tree).expect("a loop that closes");
    let place = |name: &str| order.elastic().iter().position(|group| group.name == name);
    springs.sort_by_key(|(name, _)| place(name));
    PalletisingArm { mechanism: tree, springs }
}
