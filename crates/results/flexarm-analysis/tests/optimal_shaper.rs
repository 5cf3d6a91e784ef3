//! Shapers of least residual vibration.

use std::f64::consts::TAU;

use flexarm_analysis::*;

fn mode(hz: f64, ratio: f64) -> ShapedMode {
    ShapedMode { hz, ratio, vibration: 1.0 }
}

/// Factors on a frequency at which its band is evaluated.
fn within(band: f64) -> impl Iterator<Item = f64> {
    (0..21).map(move |k| 1.0 + band * (f64::from(k) / 10.0 - 1.0))
}

/// Truth: the two copies of Singer and Seering, the only ones with zero residual within half a
/// period.
#[test]
fn within_half_a_period_the_optimal_shaper_of_one_mode_is_zv() {
    for ratio in [0.0, 0.05, 0.2] {
        let zv = Shaper::new(ShaperKind::Zv, 7.0, ratio);
        let found = Shaper::optimal(&[mode(7.0, ratio)], zv.delay_s(), 0.0).unwrap();
        assert!(found.left < 1e-6, "{:e}", found.left); // 2e-8
        let [(t_0, a_0), .., (t_1, a_1)] = found.shaper.copies[..] else { panic!("{found:?}") };
        let worst = [t_0, a_0 - zv.copies[0].1, t_1 - zv.delay_s(), a_1 - zv.copies[1].1];
        assert!(worst.iter().all(|x| x.abs() < 1e-5), "{worst:?}");
    }
}

/// Truth: with less than half a period the optimum has one copy at each end, with residual
/// cos(ω Δ/2) for the undamped mode.
#[test]
fn within_less_than_half_a_period_what_is_left_is_the_cosine_of_half_the_angle() {
    let (hz, delay) = (5.0, 0.06);
    let found = Shaper::optimal(&[mode(hz, 0.0)], delay, 0.0).unwrap();
    let wanted = (0.5 * TAU * hz * delay).cos();
    assert!((found.left / wanted - 1.0).abs() < 1e-7, "{:e}", found.left / wanted - 1.0); // 1e-8
}

/// Truth: the maximum residual within the band of the closed-form shapers.
#[test]
fn with_the_delay_of_zv_or_zvd_it_leaves_no_more_than_they() {
    for (kind, band) in [(ShaperKind::Zv, 0.1), (ShaperKind::Zvd, 0.1), (ShaperKind::Zvd, 0.25)] {
        for ratio in [0.0, 0.03, 0.1] {
            let other = Shaper::new(kind, 7.0, ratio);
            let found = Shaper::optimal(&[mode(7.0, ratio)], other.delay_s(), band).unwrap();
            let theirs = within(band).map(|f| other.residual(7.0 * f, ratio)).fold(0.0, f64::max);
            assert!(found.left <= theirs * (1.0 + 1e-6), "{kind:?} {band} {ratio}: {} {theirs}", found.left);
            // With a full period and a band there is an improvement: zeros on both sides of the
            // frequency.
            if kind == ShaperKind::Zvd {
                assert!(found.left < 0.6 * theirs, "{band} {ratio}: {} {theirs}", found.left); // 0.50
            }
        }
    }
}

/// Truth: for undamped modes, any result for a delay is also possible with a longer one.
#[test]
fn more_delay_never_leaves_more_of_two_modes() {
    let modes = [
        mode(6.6, 0.0),
        ShapedMode { vibration: 0.6, ..mode(7.4, 0.0) },
        ShapedMode { vibration: 0.1, ..mode(19.0, 0.0) },
    ];
    let delays = [0.03, 0.05, 0.07, 0.08, 0.1, 0.13, 0.16, 0.2];
    let left: Vec<f64> = delays.iter().map(|d| Shaper::optimal(&modes, *d, 0.1).unwrap().left).collect();
    for pair in left.windows(2) {
        assert!(pair[1] <= pair[0] * (1.0 + 1e-5), "{left:?}");
    }
    assert!(left[7] < 0.05, "{left:?}");
    let both = Shaper::new(ShaperKind::Zv, 6.6, 0.0).and(&Shaper::new(ShaperKind::Zv, 7.4, 0.0));
    let found = Shaper::optimal(&modes[..2], both.delay_s(), 0.0).unwrap();
    assert!(found.left < 1e-6 && found.shaper.copies.iter().all(|(_, a)| *a > 0.0), "{found:?}");
}

/// Truth: optimality conditions (Karush, Kuhn, Tucker) by small changes: shifting a weight to
/// any other time does not lower the maximum.
#[test]
fn no_small_change_of_its_parts_leaves_less() {
    let modes = [mode(6.6, 0.02), ShapedMode { vibration: 0.5, ..mode(11.0, 0.03) }];
    let found = Shaper::optimal(&modes, 0.12, 0.1).unwrap();
    let largest = |shaper: &Shaper| {
        let of = |m: &ShapedMode, f: f64| m.vibration * shaper.residual_at(f * m.hz, m.ratio, 0.12);
        modes.iter().flat_map(|m| within(0.1).map(move |f| of(m, f))).fold(0.0, f64::max)
    };
    let least = largest(&found.shaper);
    for (k, _) in found.shaper.copies.iter().enumerate() {
        for i in 0..=60 {
            let mut copies = found.shaper.copies.clone();
            let part = 1e-3_f64.min(copies[k].1);
            copies[k].1 -= part;
            copies.push((0.12 * f64::from(i) / 60.0, part));
            let moved = largest(&Shaper { copies });
            assert!(moved >= least * (1.0 - 1e-4), "{k} {i}: {} of {found:?}", moved / least);
        }
    }
}

#[test]
fn numbers_that_make_no_shaper_are_named() {
    let message = |modes: &[ShapedMode], delay, band| Shaper::optimal(modes, delay, band).unwrap_err().to_string();
    assert!(message(&[], 0.1, 0.1).contains("at least one"));
    assert!(message(&[mode(7.0, 0.0)], -0.1, 0.1).contains("positive time"));
    assert!(message(&[mode(7.0, 0.0)], 0.1, 0.7).contains("from 0 to 0.5"));
    assert!(message(&[mode(7.0, 1.2)], 0.1, 0.1).contains("below 1"));
    assert!(message(&[mode(700.0, 0.1)], 1.0, 0.1).contains("at most 25"));
}
