//! Springs of a modelled robot: their order, their owners, their stiffness.

use std::sync::Arc;

use flexarm_run::{Arm, Modelling, Owner};

use crate::small_robots::two_joints;

/// Gearbox, link of `link` and mounting, in this order of the file.
fn arm(link: &str) -> Arc<Arm> {
    let text = format!(
        "[[drive]]\njoint = \"b\"\nkind = \"gearbox\"\ngearbox = {{ stiffness = 1.5e4 }}\n\
         [[flexible_link]]\nlink = \"upper\"\n{link}\n\
         beam = {{ section = \"tube\", outer_diameter = 0.08, wall = 0.004, material = \"steel\" }}\n\
         [mounting]\nstiffness = [1e7, 2e7, 3e7, 4e5, 5e5, 6e5]\nmass = 0.0\n"
    );
    two_joints(&text).unwrap().model(&Modelling::default()).unwrap()
}

/// Truth: the tree, whose groups of coordinates have the names of the joints of the springs.
#[test]
fn springs_have_their_owner_in_the_order_of_the_coordinates_not_of_the_file() {
    for (link, springs) in [("", 3), ("segments = 4", 5), ("model = \"modal\"", 3)] {
        let arm = arm(link);
        let groups = arm.model.elastic();
        assert_eq!([arm.springs.len(), arm.owners.len(), groups.len()], [springs; 3], "{link}");
        for ((group, spring), owner) in groups.iter().zip(&arm.springs).zip(&arm.owners) {
            let (expected, stiffness) = match group.name.split("__").next() {
                Some("mounting") => (Owner::Link(1), Some(1e7)),
                Some("upper") => (Owner::Link(0), None),
                _ => (Owner::Drive(0), Some(1.5e4)),
            };
            assert_eq!((*owner, spring.K.nrows()), (expected, group.size), "{}", group.name);
            assert!(stiffness.is_none_or(|k| spring.K[(0, 0)] == k), "{}: {}", group.name, spring.K[(0, 0)]);
        }
        assert_eq!([&arm.spans[0].link, &arm.spans[1].link], ["upper", "mounting"]);
    }
}

/// Truth: `f S K S` with the roots of the six factors on the diagonal of S, by entry.
#[test]
fn factors_on_directions_of_a_link_scale_its_couplings_by_their_roots() {
    let stiffness = |link: &str| {
        let arm = arm(link);
        let own = arm.owners.iter().position(|owner| *owner == Owner::Link(0)).unwrap();
        arm.springs[own].K.clone()
    };
    let (plain, factors) = (stiffness(""), [4.0_f64, 9.0, 1.0, 1.0, 16.0, 25.0]);
    let scaled = stiffness(&format!("stiffness_factor = 2.0\nstiffness_factors = {factors:?}"));
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
        let truth = 2.0 * factors[i].sqrt() * plain[(i, j)] * factors[j].sqrt();
        let size = (plain[(i, i)] * plain[(j, j)]).sqrt();
        assert!((scaled[(i, j)] - truth).abs() < 1e-12 * size, "[{i}][{j}]: {} {truth}", scaled[(i, j)]); // measured 0
    }
    // The split is in the middle of the beam, where its spring couples nothing.
    assert!(plain[(1, 5)].abs() < 1e-9 * (plain[(1, 1)] * plain[(5, 5)]).sqrt());
}
