//! Allocation-free code paths.

use flexarm_kinematics::Wrench;
use flexarm_run::{LinkModel, Modelling, Robot};
use flexarm_testkit::allocations::count_allocations;

#[test]
fn poses_after_the_first_do_not_allocate() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let robot = Robot::load(root.join("robots/kr210")).unwrap();
    for links in [LinkModel::Lumped, LinkModel::Modal] {
        let arm = robot.model(&Modelling { links, ..Modelling::default() }).unwrap();
        let mut at = arm.operating_point().unwrap();
        let mut sum = 0.0;
        let mut visit = |k: u32| {
            let a = 0.1 * f64::from(k);
            let load = Wrench::new([0.0, 10.0 * a, -50.0].into(), [a, 0.0, 0.0].into());
            at.solve(&[a, -1.0 - 0.1 * a, 1.0 + 0.1 * a, 0.0, 0.5, a], &load).unwrap();
            sum +=
                at.compliance()[(2, 2)] + at.frequencies_hz()[0] + at.jacobian()[(0, 0)] + at.tcp_pose().translation.x;
        };
        visit(0);
        let allocations = count_allocations(|| (1..10).for_each(&mut visit));
        assert_eq!(allocations, 0, "{links:?}");
        assert!(sum.is_finite());
    }
}
