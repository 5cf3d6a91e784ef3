//! Files of one run of a study.

use flexarm_sweep::internals::faster_waypoints;

#[test]
fn waypoints_become_faster_with_their_rests_and_their_comments_stay() {
    let text =
        "start = [0.0] # s\n[[move]]\nto = [1.0]\nduration = 2.0 # d\nhold = 1\n[[move]]\nto = [0.0]\nduration = 1.0\n";
    let expected = text
        .replace("2.0 #", "4.0 #")
        .replace("hold = 1\n", "hold = 2.0\n")
        .replace("duration = 1.0", "duration = 2.0");
    assert_eq!(faster_waypoints(text, 0.5).unwrap(), expected);
    assert_eq!(faster_waypoints("profile = \"trapezoid\"\n[[move]]\nduration = 1.0\n", 0.5), None);
    assert_eq!(faster_waypoints("[[move]]\nto = [1.0]\n", 0.5), None);
    assert_eq!(faster_waypoints("[path]\n", 0.5), None);
}
