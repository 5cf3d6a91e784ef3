//! Shapers of one and of two modes.

use flexarm_analysis::*;

#[test]
fn a_shaper_leaves_nothing_at_its_frequency_and_its_slope_is_zero_with_three_copies() {
    for ratio in [0.0, 0.03, 0.2] {
        let [zv, zvd] = [ShaperKind::Zv, ShaperKind::Zvd].map(|kind| Shaper::new(kind, 7.0, ratio));
        assert!(zv.residual(7.0, ratio) < 1e-15 && zvd.residual(7.0, ratio) < 1e-15);
        let off = |shaper: &Shaper| shaper.residual(7.7, ratio);
        // Ten per cent error, undamped: sin(π/20) = 0.156, and its square.
        if ratio == 0.0 {
            assert!((off(&zv) - 0.156_434).abs() < 1e-5 && (off(&zvd) - 0.024_472).abs() < 1e-5);
        }
        assert!(off(&zvd) < 0.3 * off(&zv));
        let sum: f64 = zvd.copies.iter().map(|(_, a)| a).sum();
        assert!((sum - 1.0).abs() < 1e-15);
    }
}

#[test]
fn shapers_of_two_modes_together_leave_neither() {
    let both = Shaper::new(ShaperKind::Zv, 7.0, 0.02).and(&Shaper::new(ShaperKind::Zv, 11.0, 0.05));
    assert!(both.residual(7.0, 0.02) < 1e-15 && both.residual(11.0, 0.05) < 1e-15);
    assert_eq!(both.copies.len(), 4);
}
