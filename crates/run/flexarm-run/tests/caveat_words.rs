//! Words of caveats: the likely slip of a number outside its range, efforts, sampling.

use flexarm_run::caveat::slip::{ANGLE, DENSITY, INERTIA, LENGTH, MODULUS, slip};
use flexarm_run::internals::{EFFORT, FEW_SAMPLES};
use flexarm_settings::Setting;

#[test]
fn a_slip_is_what_brings_a_number_back_into_its_range() {
    assert_eq!(slip(350.0, &(0.0..=6.0), LENGTH, 1.0), "about 1000 times: millimetres?");
    assert_eq!(slip(35.0, &(0.0..=0.1), LENGTH, 1.0), "about 1000 times: millimetres?");
    assert_eq!(slip(0.5, &(0.0..=0.02), ANGLE, 1.0), "about 57 times: degrees?");
    assert_eq!(slip(70e3, &(1e8..=1.3e12), MODULUS, 1.0), "about 1e6 times too small: MPa?");
    assert_eq!(slip(2.7e-9, &(50.0..=23e3), DENSITY, 1.0), "about 1e12 times too small: t/mm3?");
    // A radius of gyration scales with the square root of the inertia.
    assert_eq!(slip(300.0, &(0.01..=0.5), INERTIA, 0.5), "about 1e6 times: kg mm2?");
    assert_eq!(slip(17.0, &(0.0..=1e-3), LENGTH, 1.0), "");
}

#[test]
fn a_caveat_carries_the_settings_that_mend_it_as_values_and_names_them() {
    let caveat = FEW_SAMPLES.found("run", 20.0, 12.5);
    assert_eq!(caveat.settings, [Setting::Step, Setting::LogRate]);
    let advice = format!("raise {} or lower {}", Setting::LogRate, Setting::Step);
    assert!(caveat.message.ends_with(&advice), "{}", caveat.message);
    assert!(!caveat.message.contains(['{', '}']), "{}", caveat.message);
    // The values are for programs in the process; files and texts contain the message.
    assert!(serde_json::to_value(&caveat).unwrap().get("settings").is_none());
    assert!(EFFORT.found("joint 1", 3.0, 2.0).settings.is_empty());
}
