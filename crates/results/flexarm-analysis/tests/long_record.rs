//! Records with bounded memory, compared with whole ones.

use flexarm_analysis::*;

/// A TCP that moves along x for half a second and then rings, repeatedly.
fn sample(k: u32, moves: &[(f64, f64)]) -> ErrorSample {
    let t = f64::from(k) * 1e-3;
    let since = moves.iter().rev().find(|(_, end)| *end <= t).map_or(1e9, |(_, end)| t - end);
    let ringing = 1e-3 * (1.0 + 0.1 * (0.7 * t).sin()) * (-6.0 * since).exp() * (60.0 * since).cos();
    let travel: f64 = moves.iter().map(|(start, end)| (t.clamp(*start, *end) - start) * 0.3).sum();
    ErrorSample {
        time_s: t,
        error: [ringing, 0.0, -2e-4, 0.0, 1e-4 * ringing, 0.0],
        path_error: [ringing, 2e-4, 1e-5 * t.sin()],
        rigid_position: [travel, 0.0, 0.5],
        static_m: [0.0, 0.0, -2e-4],
    }
}

/// Truth: the same samples evaluated as one record.
#[test]
fn stops_and_totals_of_a_condensed_record_are_those_of_the_whole() {
    let moves: Vec<(f64, f64)> = (0..12).map(|k| (f64::from(k) * 2.0, f64::from(k) * 2.0 + 0.5)).collect();
    let settings = MetricSettings::default();
    let mut whole = LongRecord::keeping(usize::MAX, moves.clone(), settings);
    let mut bounded = LongRecord::keeping(5000, moves.clone(), settings);
    let mut most = 0;
    for k in 0..24_000 {
        let sample = sample(k, &moves);
        whole.push(&sample);
        bounded.push(&sample);
        most = most.max(bounded.kept()[0]);
    }
    let [kept, past] = bounded.kept();
    assert!(kept < bounded.len() && most <= 5001 && past > 8, "{most} samples, {past} moves");
    assert_eq!((bounded.len(), bounded.last_time_s()), (whole.len(), whole.last_time_s()));
    // Equal to the last bit, except for the path axes of a stop, which are those of its own
    // move.
    assert_eq!(bounded.metrics().unwrap(), whole.metrics().unwrap());
    assert_eq!(bounded.parts().unwrap(), whole.parts().unwrap());
    let curves = [bounded.largest_errors(240), whole.largest_errors(240)];
    assert_eq!(curves[0].len(), 240);
    for (a, b) in curves[0].iter().zip(&curves[1]) {
        assert!((a - b).abs() < 0.2 * b, "{a} {b}");
    }
}

/// Truth: the closed form of a decaying exponential, t = ln(A/band)/rate; one stop is longer
/// than the kept samples.
#[test]
fn a_stop_longer_than_what_is_kept_still_settles_when_it_does() {
    let moves = vec![(0.0, 0.5)];
    // A number of kept samples for which the beginning of a stop, which determines its
    // frequency, stays complete.
    const KEPT: usize = 1 << 17;
    let settings = MetricSettings { settling_band_m: 1e-4, ..MetricSettings::default() };
    let mut record = LongRecord::keeping(KEPT, moves, settings);
    for k in 0..400_000_u32 {
        let t = f64::from(k) * 5e-4;
        let error = if t < 0.5 { 0.0 } else { 1e-2 * (-0.05 * (t - 0.5)).exp() };
        let rigid_position = [0.3 * t.min(0.5), 0.0, 0.0];
        let path_error = [error, 0.0, 0.0];
        record.push(&ErrorSample {
            time_s: t,
            error: [error, 0.0, 0.0, 0.0, 0.0, 0.0],
            path_error,
            rigid_position,
            static_m: [f64::NAN; 3],
        });
        assert!(record.kept()[0] <= KEPT + 1);
    }
    let metrics = record.metrics().unwrap();
    let truth = (1e-2_f64 / 1e-4).ln() / 0.05; // 92.1 s
    let settling = metrics.settling_s.unwrap();
    // The final value is an average over the last quarter, where samples are far apart.
    assert!((settling - truth).abs() < 1.0, "{settling} s, {truth} s");
    assert_eq!(metrics.peak_m, 1e-2);
    assert_eq!(metrics.holds.len(), 1);
    assert!(record.parts().is_err(), "a static part that is not known");
}

#[test]
fn a_fault_in_a_part_that_was_dropped_is_not_forgotten() {
    let moves: Vec<(f64, f64)> = (0..12).map(|k| (f64::from(k) * 2.0, f64::from(k) * 2.0 + 0.5)).collect();
    let mut record = LongRecord::keeping(5000, moves.clone(), MetricSettings::default());
    for k in 0..24_000 {
        let mut sample = sample(k, &moves);
        sample.error[1] = if k == 700 { f64::NAN } else { 0.0 };
        record.push(&sample);
    }
    assert!(matches!(record.metrics(), Err(RecordError::NotFinite { .. })));
}
