//! How often poses and messages are written.

use flexarm_log::Sample;
use flexarm_log::internals::{Beat, PoseClock, PoseReasons};

#[test]
fn of_fast_samples_two_hundred_a_second_are_shown_and_those_with_a_larger_error_than_before() {
    let mut clock = PoseClock::default();
    let shown: Vec<PoseReasons> = (0..=20_u64)
        .map(|ms| {
            let error = if ms < 8 { 1e-3 * ms as f64 } else { 0.0 };
            let sample = Sample { error_world: [error, 0.0, 0.0, 1.0, 1.0, 1.0], ..Sample::default() };
            clock.take(1_000_000 * ms, &sample, true)
        })
        .collect();
    let which =
        |of: &dyn Fn(&PoseReasons) -> bool| -> Vec<usize> { (0..shown.len()).filter(|k| of(&shown[*k])).collect() };
    assert_eq!(which(&|shown| shown.due), [0, 5, 10, 15, 20]);
    assert_eq!(which(&|shown| shown.new_peak), [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn fast_samples_are_thinned_to_the_rate_and_slow_ones_all_pass() {
    let count = |every_ns: u64, samples: u64| {
        let mut beat = Beat::new(60);
        (0..=samples).filter(|k| beat.due(k * every_ns)).count()
    };
    assert_eq!(count(2_000_000, 500), 61); // one second at 500 Hz, both ends
    assert_eq!(count(20_000_000, 50), 51); // 50 Hz
}
