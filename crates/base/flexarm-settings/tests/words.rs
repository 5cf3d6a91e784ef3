//! Words of messages: quantities, settings, spelling, many sentences of one kind.

use flexarm_settings::{Quantity, Setting, closest, gathered, without_types};

#[test]
fn a_number_outside_of_its_range_is_told_with_unit_and_range() {
    assert_eq!(Quantity::MASS.check("mass", 80.0), Ok(80.0));
    assert_eq!(Quantity::LENGTH.check("com", 0.0), Ok(0.0));
    assert!(Quantity::LENGTH.check("com", -1e6).is_err());
    let message = |value| Quantity::MASS.check("payload.mass", value).unwrap_err().to_string();
    assert_eq!(message(1e15), "payload.mass is 1e15 kg: expected a size of at most 1e7 kg; is its unit right?");
    assert_eq!(message(f64::NAN), "payload.mass is NaN kg: expected a finite number");
}

#[test]
fn twelve_sentences_of_one_kind_are_one_with_the_count_and_others_stay() {
    let mass = |k: usize| format!("arm.urdf:{}: link \"link_{k}\" weighs {:.2e} kg", 10 * k, 1e-3 * k as f64);
    let mut texts: Vec<String> = (1..=12).map(mass).collect();
    texts.insert(5, "the payload is a point".into());
    texts.push(mass(3));
    let told = gathered(&texts);
    let expected = format!("{} (and 11 more of this kind: link_2, link_3, link_4, ...)", mass(1));
    assert_eq!(told, [expected, "the payload is a point".into()]);
    assert_eq!(gathered(&texts[..2]), texts[..2]);
    let bare: Vec<String> = ["a", "b", "c"].map(|name| format!("{name} is far")).into();
    assert_eq!(gathered(&bare), bare, "names that are not quoted are other words");
}

#[test]
fn every_setting_has_a_name_in_the_library_and_is_listed_once() {
    for (k, setting) in Setting::ALL.iter().copied().enumerate() {
        let key = setting.key();
        assert!(!key.is_empty() && key.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{setting:?}: {key}");
        assert_eq!(Setting::ALL.iter().position(|other| *other == setting), Some(k), "{setting:?}");
    }
}

#[test]
fn a_slip_is_recognised_and_another_word_is_not() {
    let links = ["base_link", "link_1", "tool0"];
    assert_eq!(closest("base_lnik", links).as_deref(), Some("base_link"));
    assert_eq!(closest("Link_1", links).as_deref(), Some("link_1"));
    assert_eq!(closest("gripper", links), None);
}

#[test]
fn what_is_expected_is_said_without_names_of_types() {
    for (found, told) in [
        (
            "invalid type: string \"tip\", expected struct TcpEntry",
            "invalid type: string \"tip\", expected a table, { key = value, ... }",
        ),
        (
            "invalid type: integer `3`, expected struct MoveToml; docs",
            "invalid type: integer `3`, expected a table, { key = value, ... }; docs",
        ),
        ("invalid type: map, expected a string\n", "invalid type: table, expected a string"),
        (
            "invalid type: integer `3`, expected a map",
            "invalid type: integer `3`, expected a table, { key = value, ... }",
        ),
        ("missing field `section`", "missing field `section`"),
        ("invalid type: string \"1\", expected f64", "invalid type: string \"1\", expected a number"),
        ("invalid type: string \"1\", expected usize", "invalid type: string \"1\", expected a whole number"),
        (
            "unknown field `payloadd`, expected one of `tcp`, `payload`",
            "unknown field `payloadd`, did you mean `payload`? expected one of `tcp`, `payload`",
        ),
        ("unknown field `x`, expected `mass` or `com`", "unknown field `x`, expected `mass` or `com`"),
    ] {
        assert_eq!(without_types(found), told);
    }
}
