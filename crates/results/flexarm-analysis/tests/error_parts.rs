//! Static and dynamic parts of the TCP error.

use flexarm_analysis::*;

/// Truth: closed form. A sag of 3 mm along z and a ringing of 4 mm along x whose first crest is
/// the peak: 5 mm, of which 3·3/5 static and 4·4/5 dynamic; the RMS of a sinusoid is its
/// amplitude over √2.
#[test]
fn sag_and_ringing_across_it_add_up_along_the_peak() {
    let times: Vec<f64> = (0..=4000).map(|k| 0.25e-3 * f64::from(k)).collect();
    let ringing = |t: f64| 4e-3 * (std::f64::consts::TAU * 5.0 * t).sin();
    let errors: Vec<[f64; 6]> = times.iter().map(|&t| [ringing(t), 0.0, -3e-3, 0.0, 0.0, 0.0]).collect();
    let parts = error_parts(&times, &errors, &vec![[0.0, 0.0, -3e-3]; 4001]).unwrap();
    assert!((parts.static_at_peak_m - 9e-3 / 5.0).abs() < 1e-15); // measured 0
    assert!((parts.dynamic_at_peak_m - 16e-3 / 5.0).abs() < 1e-15); // measured 0
    assert!((parts.dynamic_peak_m - 4e-3).abs() < 1e-15 && (parts.static_peak_m - 3e-3).abs() < 1e-15);
    assert!((parts.t_dynamic_peak_s - 0.05).abs() < 1e-12);
    assert!((parts.dynamic_rms_m - 4e-3 / 2f64.sqrt()).abs() < 1e-12); // measured 4e-18
}

#[test]
fn a_static_part_that_is_not_known_is_said() {
    let statics = [[0.0; 3], [f64::NAN, 0.0, 0.0]];
    let found = error_parts(&[0.0, 1.0], &[[0.0; 6]; 2], &statics);
    assert_eq!(found, Err(RecordError::NotFinite { what: "statics", index: 1 }));
    assert_eq!(error_parts(&[], &[], &[]), Err(RecordError::Empty));
}
