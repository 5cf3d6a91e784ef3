//! A mesh as a part of a robot's link.

use flexarm_linkmaker::import::RigidPart;
use flexarm_linkmaker::reduce::{LinkJoint, UrdfLink};
use flexarm_spatial::Pose;
use nalgebra::{Matrix3, Vector3};

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
    assert!(link.rest(&mesh.with_mass(31.0), &Vector3::x()).unwrap_err().to_string().contains("correct the density"));
}

#[test]
fn a_joint_is_found_at_either_end_and_the_one_that_carries_the_link_is_at_its_origin() {
    let joint =
        |name: &str, x: f64, leads_on| LinkJoint { name: name.into(), X_LJ: Pose::translation(x, 0.0, 0.0), leads_on };
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
