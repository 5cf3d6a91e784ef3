//! A process has a single set of names: no other test of this program writes the name of a setting.

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
    // Only the first names count: a library used by a front end cannot override them.
    assert!(!name_settings(Names { setting: Setting::key, caller: "the other" }));
    assert_eq!(format!("{} of {Caller}", Setting::Step), "Schrittweite of the form");
}
