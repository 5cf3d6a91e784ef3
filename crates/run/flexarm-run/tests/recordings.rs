//! What recordings say about their inputs and contents.

use std::path::Path;

use flexarm_analysis::damped_modes;
use flexarm_log::RunHeader;
use flexarm_run::internals::describe_modes;
use flexarm_run::record::straight;
use nalgebra::dmatrix;

#[test]
fn paths_are_shown_without_ways_back() {
    for (path, shown) in [
        ("/x/crates/cli/../../robots/arm", "/x/robots/arm"),
        ("../robots/arm", "../robots/arm"),
        ("../../a/../b", "../../b"),
        ("a/./b.toml", "a/b.toml"),
    ] {
        assert_eq!(straight(Path::new(path)), shown);
    }
}

/// Truth: closed form, `ω = √(k/m)`, `ζ = d/(2 √(k m))`.
#[test]
fn modes_are_listed_by_frequency_and_damping_without_a_size() {
    let modes = |k: f64| damped_modes(&dmatrix![4.0], &dmatrix![8.0], &dmatrix![k]).unwrap().remove(0);
    let mut header = RunHeader { robot: "arm".into(), ..RunHeader::default() };
    describe_modes(&mut header, &[modes(6400.0), modes(25_600.0)], 3.0);
    assert_eq!(header.captions[0].text, "mode 1: 6.37 Hz");
    let text = &header.description;
    assert!(text.contains("| 1 | 6.366 Hz | 2.50 % | 0 s |"), "{text}");
    assert!(text.contains("| 2 | 12.732 Hz | 1.25 % | 3 s |"), "{text}");
    assert!(!text.contains("mm") && !text.contains("magnified"), "{text}");
}
