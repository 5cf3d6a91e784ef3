//! Metrics of signals with closed-form figures.

use std::f64::consts::{PI, TAU};

use flexarm_analysis::{ErrorRecord, MetricSettings, RecordError, TcpMetrics, tcp_metrics, tcp_metrics_on_path};
use proptest::prelude::*;

/// A move from 0 to 1 s along x by 0.3 m, then a hold of 4 s with a damped oscillation around a
/// static error.
#[derive(Debug, Clone, Copy)]
struct Ringing {
    amplitude: f64,
    hz: f64,
    damping_ratio: f64,
    sag: f64,
}

const MOVE_END: f64 = 1.0;

impl Ringing {
    fn decay(&self) -> f64 {
        TAU * self.hz * self.damping_ratio / (1.0 - self.damping_ratio.powi(2)).sqrt()
    }

    /// Deviation from the final value at `tau` after the end of the move.
    fn excursion(&self, tau: f64) -> f64 {
        self.amplitude * (-self.decay() * tau).exp() * (TAU * self.hz * tau).sin()
    }

    /// First maximum of the deviation, at tan(ω t) = ω / decay.
    fn first_swing(&self) -> f64 {
        let omega = TAU * self.hz;
        self.excursion((omega / self.decay()).atan() / omega)
    }

    /// Last time at which the deviation leaves the band: the last extremum outside it, then
    /// bisection.
    fn settling(&self, band: f64) -> f64 {
        let omega = TAU * self.hz;
        let extremum = |k: u32| ((omega / self.decay()).atan() + PI * f64::from(k)) / omega;
        let Some(last) = (0..10_000).rev().find(|&k| self.excursion(extremum(k)).abs() > band) else {
            return 0.0;
        };
        let (mut outside, mut inside) = (extremum(last), PI * f64::from(last + 1) / omega);
        for _ in 0..100 {
            let middle = 0.5 * (outside + inside);
            if self.excursion(middle).abs() > band { outside = middle } else { inside = middle }
        }
        inside
    }

    fn metrics(&self, times: &[f64], quasi_static: bool) -> TcpMetrics {
        let errors: Vec<[f64; 6]> = times
            .iter()
            .map(|&t| {
                let x = if t < MOVE_END { 0.0 } else { self.excursion(t - MOVE_END) };
                [x, 0.0, -self.sag, 0.0, 2e-4, 0.0]
            })
            .collect();
        let rigid: Vec<[f64; 3]> = times
            .iter()
            .map(|&t| {
                let u = (t / MOVE_END).min(1.0);
                [0.3 * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u), 0.0, 1.0]
            })
            .collect();
        let sag = vec![[0.0, 0.0, -self.sag]; times.len()];
        let record = ErrorRecord {
            times,
            errors: &errors,
            rigid_positions: &rigid,
            quasi_static: quasi_static.then_some(&sag[..]),
            moves: &[(0.0, MOVE_END)],
        };
        tcp_metrics(&record, &MetricSettings::default()).unwrap()
    }
}

fn even(rate: f64) -> Vec<f64> {
    (0..=(5.0 * rate) as u32).map(|k| f64::from(k) / rate).collect()
}

#[test]
fn a_damped_oscillation_gives_its_frequency_settling_time_and_overshoot() {
    let ringing = Ringing { amplitude: 2e-3, hz: 11.3, damping_ratio: 0.03, sag: 5e-4 };
    for quasi_static in [true, false] {
        let metrics = ringing.metrics(&even(1000.0), quasi_static);
        assert!((metrics.dominant_hz.unwrap() / 11.3 - 1.0).abs() < 1e-2); // measured 6.0e-4
        assert!((metrics.settling_s.unwrap() - ringing.settling(1e-4)).abs() < 1e-3); // measured 3.8e-5
        assert!((metrics.overshoot_m / ringing.first_swing() - 1.0).abs() < 1e-2); // measured 2.2e-4: the peak is between two samples
        let swing = ringing.first_swing();
        assert!((metrics.peak_m / swing.hypot(5e-4) - 1.0).abs() < 1e-2);
        assert!((metrics.static_sag_m - 5e-4).abs() < 1e-15 && (metrics.end_m - 5e-4).abs() < 1e-6);
        assert!((metrics.peak_rad - 2e-4).abs() < 1e-15 && (metrics.rms_rad - 2e-4).abs() < 1e-15);
        assert!((metrics.tangential_peak_m - metrics.overshoot_m).abs() < 1e-7);
        assert!((metrics.lateral_peak_m - 5e-4).abs() < 1e-12);
    }
}

#[test]
fn uneven_samples_give_the_same_figures() {
    let ringing = Ringing { amplitude: 1e-3, hz: 7.0, damping_ratio: 0.05, sag: 2e-4 };
    let mut times = even(2000.0);
    times.iter_mut().for_each(|t| *t += 2e-4 * (300.0 * *t).sin());
    let (even, uneven) = (ringing.metrics(&even(2000.0), false), ringing.metrics(&times, false));
    assert!((even.rms_m / uneven.rms_m - 1.0).abs() < 1e-4); // measured 7.2e-6
    assert!((even.settling_s.unwrap() - uneven.settling_s.unwrap()).abs() < 1e-3);
    assert!((even.dominant_hz.unwrap() - uneven.dominant_hz.unwrap()).abs() < 0.02);
}

/// Truth: the mean square of a sine over whole periods is half its squared amplitude.
#[test]
fn rms_of_a_sine_is_its_amplitude_over_root_two() {
    let times = even(1000.0);
    let errors: Vec<[f64; 6]> = times.iter().map(|t| [3e-4 * (TAU * 4.0 * t).sin(), 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
    let rigid = vec![[0.0; 3]; times.len()];
    let record =
        ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &[] };
    let metrics = tcp_metrics(&record, &MetricSettings::default()).unwrap();
    assert!((metrics.rms_m / 3e-4 - 0.5_f64.sqrt()).abs() < 1e-9); // measured 1.4e-15
    // No move, no hold: the frequency comes from the whole record.
    assert!((metrics.dominant_hz.unwrap() - 4.0).abs() < 1e-2); // measured 2.4e-6
    assert_eq!((metrics.settling_s, metrics.overshoot_m, metrics.holds.len()), (None, 0.0, 0));
}

#[test]
fn an_oscillation_that_does_not_die_away_never_settles() {
    let ringing = Ringing { amplitude: 1e-3, hz: 9.0, damping_ratio: 1e-9, sag: 0.0 };
    assert_eq!(ringing.metrics(&even(1000.0), false).settling_s, None);
    // Nor does one whose last oscillation ends within the last period of the record.
    let decay = (10.0_f64).ln() / 3.95;
    let damping_ratio = decay / (TAU * 9.0);
    let ringing = Ringing { damping_ratio, ..ringing };
    assert_eq!(ringing.metrics(&even(1000.0), true).settling_s, None);
}

#[test]
fn an_error_within_the_band_has_settled_at_once_and_does_not_overshoot() {
    let ringing = Ringing { amplitude: 5e-5, hz: 9.0, damping_ratio: 0.02, sag: 1e-3 };
    let metrics = ringing.metrics(&even(1000.0), false);
    assert_eq!((metrics.settling_s, metrics.overshoot_m), (Some(0.0), 0.0));
}

#[test]
fn a_record_that_ends_with_its_move_has_no_settling_time() {
    let times: Vec<f64> = even(1000.0).into_iter().filter(|t| *t <= MOVE_END).collect();
    let ringing = Ringing { amplitude: 1e-3, hz: 9.0, damping_ratio: 0.02, sag: 1e-3 };
    let metrics = ringing.metrics(&times, false);
    assert_eq!((metrics.settling_s, metrics.holds.len()), (None, 0));
}

#[test]
fn each_move_has_a_hold_of_its_own() {
    let times = even(1000.0);
    // Rings at 8 Hz after the first move (along +x), at 16 Hz with half the amplitude after the
    // second one (along -x).
    let ring = |tau: f64, hz: f64| (-6.0 * tau).exp() * (TAU * hz * tau).sin();
    let error = |t: f64| match t {
        t if (1.0..2.5).contains(&t) => 1e-3 * ring(t - 1.0, 8.0),
        t if t >= 3.0 => -5e-4 * ring(t - 3.0, 16.0),
        _ => 0.0,
    };
    let place = |t: f64| if t < 2.0 { 0.2 * t.min(1.0) } else { 0.2 - 0.4 * (t - 2.5).clamp(0.0, 0.5) };
    let errors: Vec<[f64; 6]> = times.iter().map(|&t| [error(t), 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
    let rigid: Vec<[f64; 3]> = times.iter().map(|&t| [place(t), 0.0, 0.0]).collect();
    let moves = [(0.0, 1.0), (2.5, 3.0)];
    let record =
        ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &moves };
    let metrics = tcp_metrics(&record, &MetricSettings::default()).unwrap();
    assert_eq!(metrics.holds.len(), 2);
    let hz: Vec<f64> = metrics.holds.iter().map(|hold| hold.line.unwrap().hz).collect();
    assert!((hz[0] - 8.0).abs() < 0.1 && (hz[1] - 16.0).abs() < 0.1, "{hz:?}");
    assert_eq!(metrics.dominant_hz, Some(hz[0]));
    assert!(metrics.holds[0].overshoot_m > 8e-4 && metrics.holds[1].overshoot_m > 4e-4); // both past the goal
    // The first takes longer and determines the result.
    assert_eq!(metrics.settling_s, metrics.holds[0].settling_s);
    assert!(metrics.holds[1].settling_s < metrics.holds[0].settling_s);
}

#[test]
fn a_damaged_record_is_refused_with_the_place() {
    let (times, errors, rigid) = ([0.0, 1.0], [[0.0; 6]; 2], [[0.0; 3]; 2]);
    let good = ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &[] };
    let settings = MetricSettings::default();
    assert!(tcp_metrics(&good, &settings).is_ok());
    let fault = |record: ErrorRecord<'_>| tcp_metrics(&record, &settings).unwrap_err();

    assert_eq!(fault(ErrorRecord { times: &[], ..good }), RecordError::Empty);
    let error = fault(ErrorRecord { errors: &errors[..1], ..good });
    assert_eq!(error, RecordError::Length { what: "errors", found: 1, expected: 2 });
    let error = fault(ErrorRecord { errors: &[[0.0; 6], [0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0]], ..good });
    assert_eq!(error, RecordError::NotFinite { what: "errors", index: 1 });
    assert!(matches!(
        fault(ErrorRecord { times: &[1.0, 1.0], ..good }),
        RecordError::TimeNotIncreasing { index: 1, .. }
    ));
    let error = fault(ErrorRecord { moves: &[(0.0, 1.0), (0.5, 2.0)], ..good });
    assert!(matches!(error, RecordError::BadMove { index: 1, .. }));
    let bad_band = tcp_metrics(&good, &MetricSettings { settling_band_m: 0.0, ..MetricSettings::default() });
    assert_eq!(bad_band, Err(RecordError::BadBand { found: 0.0 }));
}

proptest! {
    #[test]
    fn settling_and_frequency_hold_for_any_ringing(
        amplitude in 2e-4..5e-3_f64,
        hz in 4.0..60.0_f64,
        damping_ratio in 0.02..0.08_f64,
        sag in 0.0..1e-3_f64,
    ) {
        let ringing = Ringing { amplitude, hz, damping_ratio, sag };
        let metrics = ringing.metrics(&even(1000.0), false);
        prop_assert!((metrics.dominant_hz.unwrap() / hz - 1.0).abs() < 0.02); // measured 3.7e-3
        // A half oscillation that just leaves the band changes the settling time by half a period,
        // and with 17 samples per period its peak may be 1.7 % above the nearest sample.
        let (early, late) = (ringing.settling(1.03e-4), ringing.settling(0.99e-4));
        match metrics.settling_s {
            Some(found) => prop_assert!(found >= early - 1e-3 && found <= late + 1e-3, "{early} <= {found} <= {late}"),
            None => prop_assert!(late + 1.0 / hz > 3.99, "not settled within 4 s, expected {late}"),
        }
    }

    /// The figures are finite and ordered for any record.
    #[test]
    fn peaks_bound_the_other_figures(
        rows in prop::collection::vec((1e-4..0.1_f64, prop::array::uniform6(-1.0..1.0_f64)), 1..80),
        move_end in 0.0..2.0_f64,
    ) {
        let mut t = 0.0;
        let times: Vec<f64> = rows.iter().map(|(step, _)| { t += step; t }).collect();
        let errors: Vec<[f64; 6]> = rows.iter().map(|(_, error)| *error).collect();
        let rigid: Vec<[f64; 3]> = errors.iter().map(|e| [e[3], e[4], e[5]]).collect();
        let moves = [(0.0, move_end)];
        let record = ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &moves };
        let m = tcp_metrics(&record, &MetricSettings::default())?;
        let limit = m.peak_m * (1.0 + 1e-12);
        for value in [m.rms_m, m.end_m, m.static_sag_m, m.tangential_peak_m, m.normal_peak_m, m.binormal_peak_m, m.lateral_peak_m] {
            prop_assert!(value >= 0.0 && value <= limit);
        }
        prop_assert!(m.rms_rad <= m.peak_rad * (1.0 + 1e-12) && m.overshoot_m <= 2.0 * limit);
        prop_assert!(m.dominant_hz.is_none_or(|hz| hz > 0.0 && hz.is_finite()));
    }
}

/// Truth: the record has a distance of 0.3 mm from the path in motion and 0.9 mm at rest, and an
/// arbitrary lag along the path.
#[test]
fn path_accuracy_is_the_distance_from_the_path_in_motion() {
    let times = even(1000.0);
    let rigid: Vec<[f64; 3]> = times.iter().map(|t| [0.4 * t.min(2.0), 0.0, 0.8]).collect();
    let beside = |t: f64| if t <= 2.0 { 3e-4 } else { 9e-4 };
    let errors: Vec<[f64; 6]> =
        times.iter().map(|t| [5e-3, 0.6 * beside(*t), -0.8 * beside(*t), 0.0, 0.0, 0.0]).collect();
    let moves = [(0.0, 2.0)];
    let record =
        ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &moves };
    let metrics = tcp_metrics(&record, &MetricSettings::default()).unwrap();
    assert!((metrics.path_accuracy_m - 3e-4).abs() < 1e-15 && (metrics.path_rms_m - 3e-4).abs() < 1e-15);
    assert!((metrics.lateral_peak_m - 9e-4).abs() < 1e-15);
    let still = tcp_metrics(&ErrorRecord { moves: &[], ..record }, &MetricSettings::default()).unwrap();
    assert_eq!((still.path_accuracy_m, still.path_rms_m), (0.0, 0.0));
}

/// A circle in the horizontal plane, from rest to rest, with constant sag.
fn circle_with_sag(seconds: f64) -> (Vec<f64>, Vec<[f64; 6]>, Vec<[f64; 3]>) {
    let times: Vec<f64> = (0..=1000).map(|k| seconds * f64::from(k) / 1000.0).collect();
    let place = |t: &f64| {
        let u = t / seconds;
        let angle = 1.5 * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
        [0.8 * angle.cos(), 0.8 * angle.sin(), 0.3]
    };
    let (errors, rigid) = (vec![[0.0, 0.0, -2e-4, 0.0, 0.0, 0.0]; times.len()], times.iter().map(place).collect());
    (times, errors, rigid)
}

/// Truth: the sag is along the axis of the circle, also at its slow beginning.
#[test]
fn a_sag_out_of_the_plane_of_a_circle_is_not_normal_to_it() {
    for seconds in [1.0, 60.0] {
        let (times, errors, rigid) = circle_with_sag(seconds);
        let record =
            ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &[] };
        let metrics = tcp_metrics(&record, &MetricSettings::default()).unwrap();
        assert!(metrics.normal_peak_m < 1e-12 && metrics.tangential_peak_m < 1e-12, "{metrics:?}");
        assert!((metrics.binormal_peak_m - 2e-4).abs() < 1e-12);
    }
}

#[test]
fn given_parts_along_the_path_take_the_place_of_computed_ones() {
    let (times, errors, rigid) = circle_with_sag(1.0);
    let moves = [(0.0, 1.0)];
    let record =
        ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &moves };
    let mut parts = vec![[1e-4, 0.0, 0.0]; times.len()];
    parts[500] = [-2e-4, 3e-4, -4e-4];
    let settings = MetricSettings::default();
    let metrics = tcp_metrics_on_path(&record, Some(&parts), &settings).unwrap();
    let peaks = [metrics.tangential_peak_m, metrics.normal_peak_m, metrics.binormal_peak_m];
    assert_eq!(peaks, [2e-4, 3e-4, 4e-4]);
    assert!((metrics.path_accuracy_m - 5e-4).abs() < 1e-15 && (metrics.lateral_peak_m - 5e-4).abs() < 1e-15);
    let fault = tcp_metrics_on_path(&record, Some(&parts[1..]), &settings).unwrap_err();
    assert_eq!(fault, RecordError::Length { what: "path_errors", found: 1000, expected: 1001 });
    parts[3][1] = f64::NAN;
    let fault = tcp_metrics_on_path(&record, Some(&parts), &settings).unwrap_err();
    assert_eq!(fault, RecordError::NotFinite { what: "path_errors", index: 3 });
}

/// Truth: the frequency in the signal. The stop is shorter than a period, and the error due to the
/// motion itself is ten times the ringing.
#[test]
fn ringing_within_a_move_is_found_where_the_stop_is_too_short_to_show_it() {
    let times: Vec<f64> = (0..=425).map(|k| 2e-3 * f64::from(k)).collect();
    let motion = |t: f64| 2e-3 * (TAU * 2.5 * t.min(0.8)).sin();
    let errors: Vec<[f64; 6]> =
        times.iter().map(|&t| [motion(t) + 2e-4 * (TAU * 13.0 * t).sin(), 0.0, 0.0, 0.0, 0.0, 0.0]).collect();
    let rigid: Vec<[f64; 3]> = times.iter().map(|&t| [t.min(0.8), 0.0, 0.0]).collect();
    let moves = [(0.0, 0.8)];
    let record =
        ErrorRecord { times: &times, errors: &errors, rigid_positions: &rigid, quasi_static: None, moves: &moves };
    let with = |lowest_hz: f64| {
        tcp_metrics(&record, &MetricSettings { lowest_hz, ..MetricSettings::default() }).unwrap().dominant_hz
    };
    let found = with(6.0).expect("a line");
    assert!((found / 13.0 - 1.0).abs() < 0.05, "{found}");
    assert!(with(0.0).is_some_and(|hz| hz < 4.0), "the motion is louder");
}
