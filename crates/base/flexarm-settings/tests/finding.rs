//! Caveats as values.

use flexarm_settings::finding::{Finding, FindingKind, figure, once_each, warnings};

#[test]
fn a_caveat_says_where_what_and_against_what() {
    let kind = FindingKind::warning("far", "{where} is {value} m away, the arm reaches {yardstick} m", "m", "");
    let caveat = kind.found("the TCP", 350.0, 2.9).likely("about 1000 times: millimetres?");
    let message = "the TCP is 350 m away, the arm reaches 2.9 m (about 1000 times: millimetres?)";
    assert_eq!(caveat.message, message);
    assert_eq!((caveat.value, caveat.yardstick, caveat.warns()), (Some(350.0), Some(2.9), true));
    let json = serde_json::to_value(&caveat).unwrap();
    for key in ["severity", "code", "where", "message", "value", "yardstick", "unit", "likely"] {
        assert!(json.get(key).is_some(), "{key}: {json}");
    }
    assert_eq!(serde_json::from_value::<Finding>(json).unwrap(), caveat);
    assert_eq!(warnings(&[caveat.clone(), caveat.as_note()]), [message]);
}

#[test]
fn the_same_caveat_is_told_once_with_its_last_value() {
    let kind = FindingKind::warning("bend", "{where} {value} {yardstick}", "rad", "");
    let found = |link: &str, x: f64| kind.found(link, x, 0.05);
    let kept = once_each(vec![found("a", 0.1), found("b", 0.2), found("a", 0.3)]);
    assert_eq!(kept, [found("a", 0.3), found("b", 0.2)]);
    // Caveats without a value are distinct unless they are equal.
    let caveat = |text: &str| Finding::warning("file", "x", text, "");
    assert_eq!(once_each(vec![caveat("one"), caveat("two"), caveat("one")]), [caveat("one"), caveat("two")]);
}

#[test]
fn numbers_have_the_digits_that_count() {
    let found = [350.0, 0.05, 1.2345678, 20.0, 123_456.7, 7e9, 2e-4, 0.0, -9.81].map(figure);
    assert_eq!(found, ["350", "0.05", "1.235", "20", "123457", "7.00e9", "2.00e-4", "0", "-9.81"]);
}
