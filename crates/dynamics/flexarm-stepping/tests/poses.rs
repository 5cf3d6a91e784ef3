//! Many poses in parallel lanes against the same poses one by one.

use std::sync::Arc;

use flexarm_kinematics::{Model, Wrench};
use flexarm_stepping::*;
use flexarm_testkit::reference_arm;
use nalgebra::Vector3;

const ALL: PoseOutputs = PoseOutputs { jacobian: true, compliance: true, frequencies: true };

/// Returns the reference arm with its springs scaled by `stiffness`.
fn point(stiffness: f64) -> OperatingPoint {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let damping = Damping::StiffnessProportional(1e-4);
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K * stiffness, damping)).to_vec();
    let held = Arc::new(Held(vec![0.0; model.n_actuated()]));
    let tool = model.frame("tcp").unwrap().clone();
    OperatingPoint::new(Plant::new(model, springs, held).unwrap(), tool)
}

/// Returns 31 poses, the last group of four not full; one contains an infinite value.
fn poses(joints: usize) -> Vec<f64> {
    let mut all: Vec<f64> = (0..31 * joints).map(|k| 3.0 * ((k as f64 * 0.618_034).fract() - 0.5)).collect();
    all[9 * joints + 1] = f64::INFINITY;
    all
}

fn bits<'a>(values: impl IntoIterator<Item = &'a f64>) -> Vec<u64> {
    values.into_iter().map(|x| x.to_bits()).collect()
}

fn of_pose(X: &flexarm_kinematics::Pose) -> Vec<u64> {
    bits(X.translation.vector.iter().chain(X.rotation.matrix()))
}

/// Returns the number of poses with a result, all bitwise those of [`OperatingPoint::solve`].
fn assert_equal_alone(stiffness: f64, F: &Wrench) -> usize {
    let (mut together, mut alone) = (point(stiffness), point(stiffness));
    let joints = together.plant().model.n_actuated();
    let (poses, mut next, mut answered) = (poses(joints), 0, 0);
    together.solve_each(&poses, F, ALL, |k, answer| {
        assert_eq!(k, next, "in order");
        next += 1;
        match (answer, alone.solve(&poses[k * joints..][..joints], F)) {
            (Err(one), Err(other)) => assert_eq!(one.to_string(), other.to_string(), "{k}"),
            (Ok(found), Ok(())) => {
                answered += 1;
                assert_eq!(of_pose(&found.tcp_pose), of_pose(&alone.tcp_pose()), "{stiffness} {k}");
                assert_eq!(of_pose(&found.rigid_tcp_pose), of_pose(&alone.rigid_tcp_pose()), "{k}");
                assert_eq!(bits(&found.deflections), bits(alone.deflections()), "{k}");
                let J = alone.jacobian().columns(joints, found.deflections.len()).into_owned();
                assert_eq!(bits(&found.jacobian), bits(&J), "{k}");
                assert_eq!(bits(&found.compliance), bits(&alone.compliance()), "{k}");
                assert_eq!(bits(&found.frequencies_hz), bits(alone.frequencies_hz()), "{k}");
            }
            (one, other) => panic!("{k}: {one:?} {other:?}"),
        }
    });
    assert_eq!(next, 31);
    answered
}

/// Truth: each pose individually. Under the last load the softest arm deflects by metres, far from
/// the standard path of the lanes.
#[test]
fn every_pose_among_many_has_the_bits_of_the_pose_alone() {
    let (force, moment) = (Vector3::new(20.0, -35.0, 60.0), Vector3::new(3.0, 8.0, -5.0));
    let wrenches = [
        Wrench::zeros(),
        Wrench::new(force, Vector3::zeros()),
        Wrench::new(force, moment),
        Wrench::new(force * 30.0, moment * 10.0),
    ];
    for stiffness in [1.0, 0.1, 0.02, 5e-3] {
        let answered = wrenches.each_ref().map(|F| assert_equal_alone(stiffness, F));
        assert!(stiffness < 0.1 || answered[..3] == [30; 3], "{stiffness}: {answered:?}");
    }
}

/// An incomplete pose and a load that is not finite are reported as errors.
#[test]
fn half_a_pose_and_a_broken_load_have_their_errors() {
    let mut at = point(1.0);
    let joints = at.plant().model.n_actuated();
    let mut told = Vec::new();
    at.solve_each(&vec![0.1; 5 * joints + 1], &Wrench::zeros(), PoseOutputs::default(), |_, answer| {
        told.push(answer.map(|_| ()).map_err(|error| error.to_string()));
    });
    assert!(told.len() == 6 && told[..5].iter().all(Result::is_ok), "{told:?}");
    assert!(told[5].as_ref().unwrap_err().contains("1 joint values are given"), "{told:?}");
    let broken = Wrench::new(Vector3::new(f64::NAN, 0.0, 0.0), Vector3::zeros());
    at.solve_each(&vec![0.1; 5 * joints], &broken, ALL, |_, answer| {
        assert!(answer.unwrap_err().to_string().contains("finite"));
    });
    at.solve_each(&[], &Wrench::zeros(), ALL, |_, _| panic!("there is none"));
}
