//! Steppers in summaries.

use flexarm_run::{StepperFigures, StepperSettings};
use flexarm_stepping::{AlphaSettings, ReferenceSettings, SpookSettings, StepperKind};

fn json(stepper: StepperKind) -> String {
    let figures = StepperFigures {
        name: stepper.name().to_owned(),
        h_s: 1e-3,
        settings: StepperSettings::of(&stepper),
        steps: 1,
        evaluations: 2,
        factorisations: 3,
    };
    serde_json::to_string(&figures).expect("plain values")
}

/// Truth: keys and order in summaries of version 0.1.
#[test]
fn summaries_keep_their_keys() {
    let with = |settings: &str, name: &str| {
        format!(r#"{{"name":"{name}","h_s":0.001,{settings}"steps":1,"evaluations":2,"factorisations":3}}"#)
    };
    let cases = [
        (
            StepperKind::GeneralizedAlpha(AlphaSettings::default()),
            r#""rho_inf":0.9,"dispersion_correction":true,"#,
            "generalized-alpha",
        ),
        (StepperKind::Spook(SpookSettings::default()), r#""form":"local","preset":"exact","#, "spook"),
        (StepperKind::Rk4, "", "rk4"),
        (StepperKind::Reference(ReferenceSettings::new(1e-7)), r#""rtol":1e-7,"method":"bdf","#, "reference"),
    ];
    for (stepper, settings, name) in cases {
        assert_eq!(json(stepper), with(settings, name));
    }
}

#[test]
fn settings_of_every_stepper_are_read_back_from_their_texts() {
    for entry in flexarm_stepping::STEPPERS {
        let own = StepperSettings::of(&(entry.with)(&Default::default()));
        let texts: Vec<(String, String)> = own.0.iter().map(|(key, value)| (key.clone(), value.to_string())).collect();
        let text = |key: &str| texts.iter().find(|(own, _)| own == key).map(|(_, text)| text.as_str());
        assert_eq!(StepperSettings::from_texts(text), own, "{}", entry.name);
    }
}

/// Summaries of every stepper are read back as written; additions of later versions are
/// ignored.
#[test]
fn summaries_of_every_stepper_are_read_back() {
    for entry in flexarm_stepping::STEPPERS {
        let text = json((entry.with)(&Default::default()));
        let read: StepperFigures = serde_json::from_str(&text).expect("reads");
        assert_eq!(serde_json::to_string(&read).expect("plain values"), text);
        let later = text.replace("{", r#"{"later":{"a":[1]},"#);
        assert_eq!(serde_json::from_str::<StepperFigures>(&later).expect("reads"), read);
    }
}
