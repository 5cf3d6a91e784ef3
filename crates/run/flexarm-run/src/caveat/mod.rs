//! Caveats about robots and runs as values: probable errors in an input, and limits of a result's
//! validity.
//!
//! Every command that uses a robot reports the same caveats about it ([`of_use()`]); runs and statics
//! add their own. Each message is built in one place ([`CaveatKind::found`]). Start at `kinds`, the
//! catalogue; `docs/caveats.md` lists it with the source of each threshold.
//!
//! Not here: inputs that make a model impossible, which are an [`crate::Error`].

pub(crate) mod balancers;
pub(crate) mod chain;
pub(crate) mod drives;
pub(crate) mod kinds;
mod kinds_of_use;
pub(crate) mod links;
pub(crate) mod loads;
pub(crate) mod loops;
pub mod motion;
pub mod of_use;
pub(crate) mod parts;
pub(crate) mod pose;
pub mod size;
pub mod slip;
pub(crate) mod stiffness;
pub mod validity;

pub use flexarm_settings::caveat::{Caveat, Severity};
pub use flexarm_settings::caveat::{CaveatKind, once_each, warnings};
pub use of_use::{Use, of_use};

#[cfg(test)]
mod tests {
    use flexarm_settings::Setting;

    use super::kinds;

    #[test]
    fn a_caveat_carries_the_settings_that_mend_it_as_values_and_names_them() {
        let caveat = kinds::FEW_SAMPLES.found("run", 20.0, 12.5);
        assert_eq!(caveat.settings, [Setting::Step, Setting::LogRate]);
        let advice = format!("raise {} or lower {}", Setting::LogRate, Setting::Step);
        assert!(caveat.message.ends_with(&advice), "{}", caveat.message);
        assert!(!caveat.message.contains(['{', '}']), "{}", caveat.message);
        // The values are for programs in the process; files and texts contain the message.
        assert!(serde_json::to_value(&caveat).unwrap().get("settings").is_none());
        assert!(kinds::EFFORT.found("joint 1", 3.0, 2.0).settings.is_empty());
    }
}
