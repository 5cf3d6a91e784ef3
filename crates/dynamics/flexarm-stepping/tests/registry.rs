//! The table of steppers.

use flexarm_stepping::*;

/// The table and the kinds agree, and no name refers to two steppers.
#[test]
fn every_entry_makes_a_stepper_of_its_own_name() {
    let mut words: Vec<&str> = Vec::new();
    for entry in STEPPERS {
        let kind = (entry.with)(&StepperOptions::default());
        assert!(std::ptr::eq(kind.entry(), entry), "{}", entry.name);
        words.push(entry.name);
        words.extend(entry.aliases);
    }
    assert_eq!(StepperKind::default().name(), STEPPERS[0].name);
    let count = words.len();
    words.sort_unstable();
    words.dedup();
    assert_eq!(words.len(), count, "{words:?}");
}
