//! The table of a map: columns, extremes, spreads.

use flexarm_map::internals::cheapest;
use flexarm_map::{MapColumn, MapTable, Spread};

#[test]
fn a_pose_without_an_answer_is_neither_the_best_nor_the_worst() {
    let less = MapColumn { name: "sag_m".into(), meaning: String::new(), quantity: true, more_is_better: false };
    let more = MapColumn { more_is_better: true, ..less.clone() };
    let values = [f64::NAN, 3.0, -f64::NAN, 5.0, f64::INFINITY, 1.0, 5.0, f64::NEG_INFINITY, 1.0];
    for (column, best, worst) in [(less, 5, 3), (more, 3, 5)] {
        assert_eq!(cheapest(values.len(), |k| column.cost(values[k])), Some(best));
        assert_eq!(cheapest(values.len(), |k| -column.cost(values[k])), Some(worst));
        assert_eq!(cheapest(1, |k| column.cost(values[k])), None);
    }
}

/// Truth: quantiles of 0, 1, ..., 100 are their percentages.
#[test]
fn quantiles_of_equal_steps_are_their_percents() {
    let values: Vec<f64> = (0..=100).rev().map(f64::from).chain([f64::NAN]).collect();
    let spread = Spread::of(values);
    for (part, value) in &spread.quantiles {
        assert!((100.0 * part.parse::<f64>().unwrap() - value).abs() < 1e-12);
    }
    assert_eq!((spread.min, spread.max, spread.mean), (0.0, 100.0, 50.0));
    assert!(Spread::of(vec![f64::NAN]).max.is_nan());
}

#[test]
fn the_best_frequency_is_the_highest_and_the_best_sag_the_least() {
    let column = |name: &str, more_is_better| MapColumn {
        name: name.into(),
        meaning: String::new(),
        quantity: true,
        more_is_better,
    };
    let columns = vec![column("sag_m", false), column("frequency_1_hz", true)];
    let table = MapTable { columns, values: vec![2.0, 10.0, 1.0, 12.0, f64::NAN, f64::NAN, 3.0, 9.0] };
    assert_eq!(table.extremes(0), Some((1, 3)));
    assert_eq!(table.extremes(1), Some((1, 3)));
    assert_eq!(table.rows(), 4);
    assert_eq!(table.column("sag_m").unwrap()[3], 3.0);
}
