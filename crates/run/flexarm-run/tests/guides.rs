//! The guide of a sliding joint, from the robot file to its laws.

use flexarm_flexlink::{GearStiffness, GuideTubes};
use flexarm_run::{Error, GuideTilt, Robot};

use crate::small_robots::{lift, refusal};

fn guided(guide: &str) -> Result<Robot, Error> {
    lift(&format!("[[drive]]\njoint = \"lift\"\nkind = \"gearbox\"\ngearbox = {{ guide = {{ {guide} }} }}\n"))
}

fn guide_of(robot: &Robot) -> (GuideTubes, Vec<GuideTilt>) {
    let (gearbox, laws) = robot.drives[0].gearbox.as_ref().unwrap();
    let GearStiffness::Guide(tubes) = &gearbox.stiffness else { panic!("{gearbox:?}") };
    (tubes.clone(), laws.tilts.clone())
}

#[test]
fn a_guide_is_stiff_and_overlaps_within_the_limits_of_its_joint() {
    let (tubes, tilts) =
        guide_of(&guided("outer_end = 1.4, y = { compliance = [1e-6, 0, 2e-7], play = { gap = 4e-4 } }").unwrap());
    assert_eq!((tubes.tilts, tubes.overlap(1.2)), ([false, true, false], 1.4 - 1.2));
    assert_eq!(tilts[0].play.unwrap().width, 10.0);
    let refused = |text: &str, part: &str| {
        let message = refusal(guided(text));
        assert!(message.contains(part), "{message}");
    };
    refused(
        "outer_end = 1.1, x = { compliance = [1e-6, 0, 2e-7] }",
        "at joint position 1.2 m the tubes overlap by -0.1000 m",
    );
    refused(
        "outer_end = 1.4, x = { compliance = [-1e-6, 0, 2e-7] }",
        "guide.x.compliance: -8.817e-7 rad per N m at an overlap of 1.3",
    );
    // Positive at both limits, negative between them.
    refused("outer_end = 1.4, x = { compliance = [1e-6, -9.5e-7, 2e-7] }", "at an overlap of 0.4211 m");
    refused("outer_end = 1.4, x = { compliance = [1e-6, 0, 0], play = { gap = 1e-4, width = 0 } }", "width = 0 N m");
    refused("outer_end = 1.4", "needs x, y or z");
}
