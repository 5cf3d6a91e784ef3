//! Axes of the heat maps.

use flexarm_sweep::internals::Axes;

#[test]
fn a_parameter_keeps_its_axis_in_all_heat_maps() {
    let mut axes = Axes::default();
    let mut pair = |ranked: &[usize]| axes.pair(&ranked.iter().map(|p| (*p, 1.0)).collect::<Vec<_>>());
    assert_eq!(pair(&[0, 1, 2]), Some((0, 1)));
    assert_eq!(pair(&[1, 0, 2]), Some((0, 1)));
    assert_eq!(pair(&[1, 2]), Some((2, 1)));
    // Parameters 2 and 0 are both horizontal: the next one is vertical.
    assert_eq!(pair(&[2, 0, 1]), Some((2, 1)));
    assert_eq!(pair(&[0, 2]), None);
    assert_eq!(pair(&[3]), None);
}
