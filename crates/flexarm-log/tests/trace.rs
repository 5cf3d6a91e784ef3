//! What a run in memory keeps of its samples.

use flexarm_log::{RunHeader, Sample, Trace};

/// Truth: counting. A quarter of a million samples are halved twice: one of four is kept, evenly, and the largest error
/// is kept although its sample is not.
#[test]
fn a_long_run_is_thinned_evenly_and_says_so() {
    let mut trace = Trace::new(RunHeader::default());
    let all = 5 * Trace::LIMIT as u64 / 2;
    let mut sample = Sample::default();
    for k in 0..all {
        sample.time_s = k as f64;
        sample.error_world[0] = if k == 150_001 { 2.0 } else { 1.0 };
        trace.push(&sample);
    }
    assert_eq!((trace.samples(), trace.stride()), (all, 4));
    assert_eq!(trace.rows.len() as u64, all / 4);
    assert!(trace.rows.iter().enumerate().all(|(row, kept)| kept.time_s == 4.0 * row as f64));
    assert_eq!(trace.peak.time_s, 150_001.0);
}

#[test]
fn a_short_run_has_every_sample() {
    let mut trace = Trace::new(RunHeader::default());
    (0..1000).for_each(|_| trace.push(&Sample::default()));
    assert_eq!((trace.rows.len(), trace.samples(), trace.stride()), (1000, 1000, 1));
}
