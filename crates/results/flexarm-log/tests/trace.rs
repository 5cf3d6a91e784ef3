//! Samples kept by a run in memory.

use flexarm_log::{CurveQuantity, ElasticSample, EnergySample, RunHeader, Sample, Trace, TwinSample};

/// Truth: counting. Two and a half times the maximum number of rows are halved twice: every fourth
/// sample is kept, evenly, and the maximum error is kept although its sample is not.
#[test]
fn a_long_run_is_thinned_evenly_and_says_so() {
    const PEAK: u64 = Trace::LIMIT as u64 + 1;
    let mut trace = Trace::new(RunHeader::default());
    let all = 5 * Trace::LIMIT as u64 / 2;
    let mut sample = Sample::default();
    for k in 0..all {
        sample.time_s = k as f64;
        sample.error_world[0] = if k == PEAK { 2.0 } else { 1.0 };
        trace.push(&sample);
    }
    assert_eq!((trace.samples(), trace.stride()), (all, 4));
    assert_eq!(trace.rows.len() as u64, all / 4);
    assert!(trace.rows.iter().enumerate().all(|(row, kept)| kept.time_s == 4.0 * row as f64));
    assert_eq!(trace.peak.time_s, PEAK as f64);
}

#[test]
fn a_short_run_has_every_sample() {
    let mut trace = Trace::new(RunHeader::default());
    (0..1000).for_each(|_| trace.push(&Sample::default()));
    assert_eq!((trace.rows.len(), trace.samples(), trace.stride()), (1000, 1000, 1));
}

/// A wave with a spike of one sample, in all quantities with curves.
fn wave(k: u64) -> Sample {
    let value = (0.01 * k as f64).sin() + if k == 123_457 { 50.0 } else { 0.0 };
    let mut sample = Sample { time_s: k as f64 * 1e-3, ..Sample::default() };
    sample.error_world[1] = value;
    sample.static_m[0] = 0.5;
    sample.contributions = vec![[0.0, 3.0 * value, 4.0 * value]];
    sample.elastic = vec![ElasticSample { deflection: [value; 6], load: [-value; 6] }];
    sample.flexible.q = vec![value, f64::NAN];
    sample.rigid.X_WT.translation.vector.x = 0.1 * (k % 100) as f64;
    sample
}

/// A quantity, and its value in a sample.
type Truth = (CurveQuantity, fn(&Sample) -> f64);

/// Truth: the samples themselves. Every range of a block contains its samples, and the extremes are
/// those of the run.
#[test]
fn curves_of_a_long_run_lose_no_peak() {
    const ALL: u64 = 300_000;
    let mut trace = Trace::new(RunHeader::default());
    (0..ALL).for_each(|k| trace.push(&wave(k)));
    let size = trace.samples_per_block();
    assert!(size >= ALL / 4096 && size.is_power_of_two(), "{size}");
    let quantities: [Truth; 6] = [
        (CurveQuantity::ErrorSize, |s| s.error_world[1].abs()),
        (CurveQuantity::MovingSize, |s| s.error_world[1].hypot(s.static_m[0])),
        (CurveQuantity::ContributionSize(0), |s| 5.0 * s.error_world[1].abs()),
        (CurveQuantity::Load(0, 4), |s| -s.error_world[1]),
        (CurveQuantity::DeflectionSize(0, 1), |s| 3f64.sqrt() * s.error_world[1].abs()),
        (CurveQuantity::Joint(0), |s| s.flexible.q[0]),
    ];
    let times = trace.curve_times();
    for (quantity, truth) in quantities {
        let curve = trace.curve(quantity);
        assert_eq!(curve.len(), times.len());
        for (block, range) in curve.chunks_exact(2).enumerate() {
            let samples = block as u64 * size..((block as u64 + 1) * size).min(ALL);
            let values = samples.clone().map(|k| truth(&wave(k)));
            let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
            // measured 2e-16
            assert!((range[0] - low).abs() < 1e-14 * (1.0 + low.abs()), "{quantity:?} {block}");
            assert!((range[1] - high).abs() < 1e-14 * (1.0 + high.abs()), "{quantity:?} {block}");
            let ends = [samples.start, samples.end - 1].map(|k| k as f64 * 1e-3);
            assert_eq!(times[2 * block..2 * block + 2], ends);
        }
    }
    assert!(
        trace.curve(CurveQuantity::Joint(1)).iter().chain(&trace.curve(CurveQuantity::Effort(0))).all(|x| x.is_nan())
    );
    // Path forth and back: 9.9 m forth in a hundred samples, then 9.9 m back.
    let ways = trace.curve_ways();
    let way = (1..ALL).map(|k| if k % 100 == 0 { 9.9 } else { 0.1 }).sum::<f64>();
    assert!((ways[ways.len() - 1] - way).abs() < 1e-9 * way && ways.is_sorted());
    let beginning = trace.beginning();
    assert_eq!((beginning.len(), beginning[7].0), (Trace::BEGINNING, 7e-3));
}

#[test]
fn curves_of_a_short_run_are_its_samples() {
    let mut trace = Trace::new(RunHeader::default());
    (0..1000).for_each(|k| trace.push(&wave(k)));
    let truth: Vec<f64> = (0..1000).map(|k| wave(k).flexible.q[0]).collect();
    assert_eq!((trace.curve(CurveQuantity::Joint(0)), trace.samples_per_block()), (truth, 1));
    assert_eq!(trace.beginning().len(), 1000);
}

/// Truth: each quantity in a row. Samples that are all equal leave a range of no width.
#[test]
fn every_curve_of_a_long_run_is_that_of_its_quantity() {
    use CurveQuantity::*;
    let number = std::cell::Cell::new(0.0);
    let next = || {
        number.set(number.get() + 1.0);
        f64::sin(number.get())
    };
    let list = |length: usize| (0..length).map(|_| next()).collect::<Vec<f64>>();
    let element =
        |_| ElasticSample { deflection: std::array::from_fn(|_| next()), load: std::array::from_fn(|_| next()) };
    let sample = Sample {
        error_world: std::array::from_fn(|_| next()),
        error_path: std::array::from_fn(|_| next()),
        static_m: std::array::from_fn(|_| next()),
        contributions: (0..3).map(|_| std::array::from_fn(|_| next())).collect(),
        gauges: list(2),
        flexible: TwinSample { q: list(2), qdot: list(2), effort: list(2), ..TwinSample::default() },
        rigid: TwinSample { effort: list(2), ..TwinSample::default() },
        elastic: (0..2).map(element).collect(),
        energy: EnergySample { kinetic: next(), potential: next(), elastic: next() },
        ..Sample::default()
    };
    let mut trace = Trace::new(RunHeader::default());
    trace.push(&sample);
    let row = trace.rows[0].clone();
    while trace.samples_per_block() == 1 {
        trace.push(&sample);
    }
    let mut all = vec![ErrorSize, TurnSize, AcrossPath, StaticSize, MovingSize];
    all.extend((0..6).map(Error));
    all.extend((0..3).flat_map(|c| [AlongPath(c), Energy(c)]));
    all.extend((0..3).flat_map(|k| (0..3).map(move |c| Contribution(k, c)).chain([ContributionSize(k)])));
    all.extend((0..2).flat_map(|k| [Gauge(k), Joint(k), JointRate(k), Effort(k), RigidEffort(k)]));
    for k in 0..2 {
        all.extend((0..6).flat_map(|c| [Deflection(k, c), Load(k, c)]));
        all.extend((0..2).flat_map(|half| [DeflectionSize(k, half), LoadSize(k, half)]));
    }
    for quantity in all {
        let expected = quantity.of(&row);
        let curve = trace.curve(quantity);
        assert!(!curve.is_empty() && curve.iter().all(|value| *value == expected), "{quantity:?}");
    }
}
