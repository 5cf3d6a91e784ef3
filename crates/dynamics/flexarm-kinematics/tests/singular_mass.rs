//! Forward dynamics with a mass matrix that is not positive definite.

use flexarm_kinematics::{
    Data, Joint, JointKind, Link, LinkInertia, Mechanism, Model, ModelError, Pose, Roles, RotorCoupling, State,
    forward_dynamics,
};
use nalgebra::{DVector, Matrix3, Vector3};

/// Two links about vertical axes, 1 kg m² each about their own joint.
fn two_links(coupled: f64, mass: f64) -> Result<Model, ModelError> {
    let link = |name: &str| Link {
        name: name.into(),
        inertia: Some(LinkInertia { mass, com: Vector3::zeros(), inertia_com: Matrix3::identity() }),
    };
    let turn = JointKind::Continuous(Vector3::z_axis());
    Model::new(&Mechanism {
        name: "two".into(),
        links: vec![Link { name: "base".into(), inertia: None }, link("a"), link("b")],
        joints: vec![
            Joint::new("j1", turn, "base", "a", Pose::identity()),
            Joint::new("j2", turn, "a", "b", Pose::identity()),
        ],
        modal: vec![],
        balancers: vec![],
        rotor_couplings: vec![RotorCoupling { joints: ["j1".into(), "j2".into()], inertia: coupled }],
        loops: vec![],
        gravity: Vector3::zeros(),
        coordinate_order: vec![],
    })
}

/// The mass matrix is [[2, 1 + c], [1 + c, 1]]: its inverse is the truth for c = 0.2; it is
/// indefinite for c = 100.
#[test]
fn a_mass_matrix_that_is_not_positive_definite_gives_no_number_and_no_panic() {
    let accelerations = |coupled: f64| {
        let model = two_links(coupled, 1.0).unwrap();
        let (mut data, state) = (Data::new(&model), State::zeros(&model));
        forward_dynamics(&model, &mut data, &state, &Roles::all_free(&model), &DVector::from_vec(vec![1.0, 0.0]))
            .clone()
    };
    let found = accelerations(0.2);
    let determinant = 2.0 - 1.2 * 1.2;
    assert!((found[0] - 1.0 / determinant).abs() < 1e-12 && (found[1] + 1.2 / determinant).abs() < 1e-12, "{found}");
    assert!(accelerations(100.0).iter().all(|a| a.is_nan()));
}

#[test]
fn a_link_of_a_mass_that_no_robot_has_is_refused_with_its_name() {
    let told = two_links(0.0, 1e15).unwrap_err().to_string();
    assert!(told.contains("link \"a\"") && told.contains("1e15 kg") && told.contains("at most"), "{told}");
}
