//! How much deflections are magnified.

use flexarm_run::magnification::{Expected, round_up};

#[test]
fn factors_are_round_and_show_the_tool_where_it_can_be_seen() {
    let end_of_scale = |tool_m| Expected { tool_m, ..Expected::default() }.color_scale_m();
    let expected = |tool_m, turn_rad| Expected { tool_m, turn_rad, reach_m: 2.7, volume: None };
    assert_eq!(expected(1.4e-3, 1e-4).magnification(), 200.0); // 289 would show 0.15 of the reach
    assert_eq!(expected(1.4e-3, 1e-2).magnification(), 20.0); // 30 would turn a spring by 0.3 rad
    assert_eq!(expected(1.0, 0.1).magnification(), 1.0);
    assert_eq!(expected(0.0, 0.0).magnification(), 0.0);
    assert_eq!([1.4e-3, 2e-3, 0.6].map(round_up).map(|x| (x * 1e6).round()), [2e3, 2e3, 1e6]);
    assert_eq!([1.4e-3, 6.01e-3, 0.0].map(end_of_scale).map(|x| (x * 1e6).round()), [1.5e3, 8e3, 0.0]);
}
