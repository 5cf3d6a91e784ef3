//! Main effects, fronts and spreads.

use flexarm_sweep::statistics::*;

use crate::random::uniform;

/// Truth: two-way analysis of variance by hand. With a = 0..n-1, b = 0, 1, 2 and y = 3 a + 2
/// b^2 + c (a - m)(b - 1), where m is the mean of a, the last term has zero mean over a and
/// over b, so that
///
/// ```text
/// V_a = 9 (n^2 - 1)/12     V_b = 4 Var(0, 1, 4) = 4 * 26/9     V_ab = c^2 (n^2 - 1)/12 * 2/3
/// ```
#[test]
fn shares_of_a_full_factorial_are_those_of_the_analysis_of_variance_for_any_number_of_levels() {
    for n in [3u32, 13, 40, 1000] {
        let (mut a, mut b, mut y) = (Vec::new(), Vec::new(), Vec::new());
        let (m, c) = (0.5 * f64::from(n - 1), 0.7);
        for i in 0..n {
            for j in 0..3 {
                let (x, z) = (f64::from(i), f64::from(j));
                a.push(x);
                b.push(z);
                y.push(3.0 * x + 2.0 * z * z + c * (x - m) * (z - 1.0));
            }
        }
        let square = (f64::from(n).powi(2) - 1.0) / 12.0;
        let (va, vb, vab) = (9.0 * square, 4.0 * 26.0 / 9.0, c * c * square * 2.0 / 3.0);
        let all = va + vb + vab;
        let effects = [&a, &b].map(|x| main_effect(x, &y, Grouping::Levels).unwrap());
        for (effect, expected) in effects.iter().zip([va / all, vb / all]) {
            // measured: 3e-14
            assert!((effect.share - expected).abs() < 1e-12, "{n} levels: {} for {expected}", effect.share);
        }
        let groups = &effects[0].groups;
        assert_eq!(groups.len(), n as usize);
        for (i, group) in groups.iter().enumerate() {
            let mean = 3.0 * i as f64 + 2.0 * 5.0 / 3.0;
            assert!(
                group.x == i as f64 && group.count == 3 && (group.mean - mean).abs() < 1e-12 * f64::from(n),
                "{group:?}"
            );
        }
    }
    assert_eq!(main_effect(&[1.0; 20], &[2.0; 20], Grouping::Levels), None);
}

/// Truth: 50 values with 1 to 7 runs each; all runs of a value are in one group.
#[test]
fn groups_of_a_drawn_parameter_never_cut_a_value_in_two() {
    let x: Vec<f64> = (0..50).flat_map(|k| vec![f64::from(k); 1 + (k as usize * 3) % 7]).collect();
    let y: Vec<f64> = (0..x.len()).map(|k| k as f64).collect();
    let effect = main_effect(&x, &y, Grouping::Bins).unwrap();
    assert!((6..=8).contains(&effect.groups.len()), "{effect:?}");
    assert_eq!(effect.groups.iter().map(|group| group.count).sum::<usize>(), x.len());
    let ends = effect.groups.iter().scan(0, |end, group| {
        *end += group.count;
        Some(*end)
    });
    for end in ends.filter(|end| *end < x.len()) {
        assert_ne!(x[end - 1], x[end]);
    }
}

/// Truth: the mean of y = x^2 over a bin, with x uniform.
#[test]
fn values_that_are_all_different_are_taken_in_groups_of_equal_size() {
    let x: Vec<f64> = (0..8000).map(|k| uniform(0, 0, k)).collect();
    let y: Vec<f64> = x.iter().map(|x| x * x).collect();
    let effect = main_effect(&x, &y, Grouping::Bins).unwrap();
    assert_eq!(effect.groups.len(), 8);
    for (k, group) in effect.groups.iter().enumerate() {
        let (a, b) = (k as f64 / 8.0, (k + 1) as f64 / 8.0);
        let expected = (b.powi(3) - a.powi(3)) / 3.0 / (b - a);
        assert!((group.mean - expected).abs() < 0.02, "{group:?} {expected}");
        assert_eq!(group.count, 1000);
    }
}

#[test]
fn the_front_has_the_points_that_no_other_beats() {
    let a = [1.0, 2.0, 3.0, 2.0, 4.0, f64::NAN, 1.0];
    let b = [5.0, 3.0, 3.0, 4.0, 1.0, 0.0, 6.0];
    assert_eq!(pareto_front(&a, &b), [0, 1, 4]);
    assert!(pareto_front(&[], &[]).is_empty());
}

#[test]
fn spread_of_the_first_whole_numbers_is_that_of_the_formulas() {
    let values: Vec<f64> = (0..=100).map(f64::from).chain([f64::NAN]).collect();
    let found = spread(&values).unwrap();
    assert_eq!((found.count, found.min, found.max, found.mean), (101, 0.0, 100.0, 50.0));
    assert_eq!(found.quantiles, [5.0, 50.0, 95.0]);
    assert!((found.std - (101.0f64 * 102.0 / 12.0).sqrt()).abs() < 1e-12);
    assert_eq!(spread(&[f64::NAN]), None);
}
