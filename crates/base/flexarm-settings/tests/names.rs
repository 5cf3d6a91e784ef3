//! One process has one set of names: a test of its own, because it speaks for all tests that share
//! its process.

use flexarm_settings::{Caller, Names, Setting, name_settings};

fn german(setting: Setting) -> &'static str {
    match setting {
        Setting::Step => "Schrittweite",
        other => other.key(),
    }
}

#[test]
fn a_face_names_the_settings_once_for_all_messages() {
    assert_eq!(format!("{} of {Caller}", Setting::Step), "step_s of the call");
    assert!(name_settings(Names { setting: german, caller: "the form" }));
    assert_eq!(format!("{} of {Caller}", Setting::Step), "Schrittweite of the form");
    // The first words count: a library that is used by a face does not talk over it.
    assert!(!name_settings(Names { setting: Setting::key, caller: "the other" }));
    assert_eq!(format!("{} of {Caller}", Setting::Step), "Schrittweite of the form");
}
