//! Jumps of loads that are given as expressions.

use std::path::Path;

use flexarm_run::loads_file::parse_loads;

/// Jumps within a run of 4 s of a force that acts for longer.
fn jumps(fx: &str) -> Vec<f64> {
    let text = format!("format = 1\n[[load]]\nkind = \"expression\"\nend = 10.0\nfx = \"{fx}\"\n");
    let (loads, _) = parse_loads(&text, Path::new("loads.toml"), 4.0).unwrap();
    let ends = [0.0, 10.0];
    assert!(ends.iter().all(|end| loads[0].wrench.jumps.contains(end)), "{:?}", loads[0].wrench.jumps);
    loads[0].wrench.jumps.iter().copied().filter(|t| !ends.contains(t)).collect()
}

#[test]
fn jumps_are_found_where_they_are_and_curves_have_none() {
    let near = |found: Vec<f64>, truth: &[f64]| {
        assert_eq!(found.len(), truth.len(), "{found:?}");
        assert!(found.iter().zip(truth).all(|(a, b)| (a - b).abs() < 1e-15 * 10.0), "{found:?}");
    };
    near(jumps("100.0 * signum(t - 1.23456) + 3.0 * t"), &[1.23456]);
    near(jumps("5.0 * floor(t)"), &[1.0, 2.0, 3.0, 4.0]);
    near(jumps("10.0 * sin(t) * (1.0 + signum(t - 0.5)) * (1.0 - signum(t - 0.7091))"), &[0.5, 0.7091]);
    assert!(jumps("10000.0 * sin(300.0 * t)").is_empty());
    assert!(jumps("100.0 * abs(t - 2.0)").is_empty());
    assert!(jumps("100.0 * tanh(200.0 * (t - 2.0))").is_empty());
    assert!(jumps("7.0").is_empty());
    assert!(jumps("1.0 / (t - 2.0)").is_empty());
}
