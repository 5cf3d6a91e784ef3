//! `modelDescription.xml` of FMI 2.0 and 3.0, and the page about the variables.
//!
//! Start at [`description`]. The position of a variable in the list is its reference; FMI 2.0 counts
//! positions from one where it asks for an index. Not here: the zip file (`archive.rs`).

use std::collections::BTreeSet;
use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::variables::{Causality, Kind, StateReferences, UNITS, Variable};

/// Version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fmi {
    /// FMI 2.0.
    V2,
    /// FMI 3.0.
    V3,
}

/// Name of the library in an FMU, and identifier of the model.
pub const MODEL_IDENTIFIER: &str = "flexarm";

/// Data of the whole model in a description.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// Name of the robot.
    pub name: &'a str,
    /// Token that ties description and resources together.
    pub token: &'a str,
    /// Step size of the solver (s).
    pub step_s: f64,
}

type Xml = Writer<Vec<u8>>;

/// Returns the description of a plant.
///
/// # Errors
/// Those of the XML writer.
pub fn description(fmi: Fmi, about: &About<'_>, variables: &[Variable]) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let token = if fmi == Fmi::V2 { "guid" } else { "instantiationToken" };
    // Attributes of the whole model.
    let root = xml.create_element("fmiModelDescription").with_attributes([
        ("fmiVersion", if fmi == Fmi::V2 { "2.0" } else { "3.0" }),
        ("modelName", about.name),
        (token, about.token),
        ("description", "Robot arm with flexible links and elastic drives"),
        ("generationTool", concat!("flexarm ", env!("CARGO_PKG_VERSION"))),
        ("variableNamingConvention", "structured"),
    ]);
    // Its parts, in the order of the standard's schema.
    root.write_inner_content(|xml| {
        interfaces(xml, fmi, variables)?;
        xml.create_element("UnitDefinitions").write_inner_content(units)?;
        let step = about.step_s.to_string();
        xml.create_element("DefaultExperiment")
            .with_attributes([("startTime", "0"), ("stopTime", "1"), ("stepSize", &step)])
            .write_empty()?;
        xml.create_element("ModelVariables").write_inner_content(|xml| {
            let states = StateReferences::of(variables).states;
            let mut write = |(reference, variable)| match fmi {
                Fmi::V2 => variable_2(xml, reference, variable, states.contains(&reference)),
                Fmi::V3 => variable_3(xml, reference, variable, states.contains(&reference)),
            };
            variables.iter().enumerate().try_for_each(&mut write)
        })?;
        xml.create_element("ModelStructure").write_inner_content(|xml| structure(xml, fmi, variables))?;
        Ok(())
    })?;
    let mut text = xml.into_inner();
    text.push(b'\n');
    Ok(text)
}

/// Writes what the FMU is for; model exchange only with states.
fn interfaces(xml: &mut Xml, fmi: Fmi, variables: &[Variable]) -> io::Result<()> {
    let [state, derivative] = match fmi {
        Fmi::V2 => ["canGetAndSetFMUstate", "providesDirectionalDerivative"],
        Fmi::V3 => ["canGetAndSetFMUState", "providesDirectionalDerivatives"],
    };
    let own = [("modelIdentifier", MODEL_IDENTIFIER), (state, "true")];
    if variables.iter().any(|variable| variable.derivative_of.is_some()) {
        let mut element = xml.create_element("ModelExchange").with_attributes(own).with_attribute((derivative, "true"));
        // The default of FMI 3.0.
        if fmi == Fmi::V2 {
            element = element.with_attribute(("completedIntegratorStepNotNeeded", "true"));
        }
        element.write_empty()?;
    }
    xml.create_element("CoSimulation")
        .with_attributes(own)
        .with_attribute(("canHandleVariableCommunicationStepSize", "true"))
        .write_empty()?;
    Ok(())
}

fn units(xml: &mut Xml) -> io::Result<()> {
    for (name, exponents) in UNITS {
        xml.create_element("Unit").with_attribute(("name", name)).write_inner_content(|xml| {
            let texts = exponents.map(|exponent| exponent.to_string());
            let powers = ["kg", "m", "s", "rad"].into_iter().zip(texts.iter().map(String::as_str));
            let used = powers.filter(|(_, text)| *text != "0");
            xml.create_element("BaseUnit").with_attributes(used).write_empty()?;
            Ok(())
        })?;
    }
    Ok(())
}

/// Returns causality and variability.
fn roles(variable: &Variable) -> [(&'static str, &'static str); 2] {
    let (causality, variability) = match (variable.causality, variable.kind) {
        (Causality::Independent, _) => ("independent", "continuous"),
        (Causality::Parameter, _) => ("parameter", "fixed"),
        (Causality::Input, Kind::Real) => ("input", "continuous"),
        (Causality::Input, Kind::Boolean) => ("input", "discrete"),
        (Causality::Output, Kind::Real) => ("output", "continuous"),
        (Causality::Output, Kind::Boolean) => ("output", "discrete"),
        (Causality::Local, _) => ("local", "continuous"),
    };
    [("causality", causality), ("variability", variability)]
}

/// Returns start value, nominal value of a state, and whose derivative a variable is, as attributes.
///
/// * `first`: number of the first variable.
fn numbers(variable: &Variable, is_state: bool, first: usize) -> Vec<(&'static str, String)> {
    let start = variable.start.map(|value| match variable.kind {
        Kind::Real => value.to_string(),
        Kind::Boolean => (value != 0.0).to_string(),
    });
    let nominal = is_state.then(|| variable.nominal().to_string());
    let derivative = variable.derivative_of.map(|reference| (reference + first).to_string());
    let all = [("start", start), ("nominal", nominal), ("derivative", derivative)];
    all.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
}

/// Writes a variable of FMI 3.0.
fn variable_3(xml: &mut Xml, reference: usize, variable: &Variable, is_state: bool) -> io::Result<()> {
    let reference = reference.to_string();
    let kind = if variable.kind == Kind::Real { "Float64" } else { "Boolean" };
    let mut element = xml
        .create_element(kind)
        .with_attributes([
            ("name", &*variable.name),
            ("valueReference", &reference),
            ("description", &variable.description),
        ])
        .with_attributes(roles(variable));
    if variable.kind == Kind::Real {
        element = element.with_attribute(("unit", variable.unit));
    }
    for (name, value) in numbers(variable, is_state, 0) {
        element = element.with_attribute((name, &*value));
    }
    element.write_empty()?;
    Ok(())
}

/// Writes a variable of FMI 2.0.
fn variable_2(xml: &mut Xml, reference: usize, variable: &Variable, is_state: bool) -> io::Result<()> {
    let reference = reference.to_string();
    let kind = if variable.kind == Kind::Real { "Real" } else { "Boolean" };
    xml.create_element("ScalarVariable")
        .with_attributes([
            ("name", &*variable.name),
            ("valueReference", &reference),
            ("description", &variable.description),
        ])
        .with_attributes(roles(variable))
        .write_inner_content(|xml| {
            let mut element = xml.create_element(kind);
            if variable.kind == Kind::Real {
                element = element.with_attribute(("unit", variable.unit));
            }
            for (name, value) in numbers(variable, is_state, 1) {
                element = element.with_attribute((name, &*value));
            }
            element.write_empty()?;
            Ok(())
        })?;
    Ok(())
}

/// Writes outputs and derivatives of states, and that they and the states are known after the
/// initialisation.
fn structure(xml: &mut Xml, fmi: Fmi, variables: &[Variable]) -> io::Result<()> {
    let all = variables.iter().enumerate();
    let outputs: Vec<usize> = all.filter(|(_, own)| own.causality == Causality::Output).map(|(k, _)| k).collect();
    let StateReferences { states, derivatives } = StateReferences::of(variables);
    let initial: BTreeSet<usize> = outputs.iter().chain(&states).chain(&derivatives).copied().collect();
    let lists = [
        (["Outputs", "Output"], outputs),
        (["Derivatives", "ContinuousStateDerivative"], derivatives),
        (["InitialUnknowns", "InitialUnknown"], initial.into_iter().collect()),
    ];
    for ([list, element], references) in lists.into_iter().filter(|(_, references)| !references.is_empty()) {
        let write = |xml: &mut Xml, element: &str, attribute: &str, number: usize| {
            xml.create_element(element).with_attribute((attribute, &*number.to_string())).write_empty().map(drop)
        };
        match fmi {
            Fmi::V3 => references.into_iter().try_for_each(|own| write(xml, element, "valueReference", own))?,
            // FMI 2.0 counts from one.
            Fmi::V2 => {
                let unknowns = |xml: &mut Xml| {
                    references.iter().try_for_each(|reference| write(xml, "Unknown", "index", reference + 1))
                };
                xml.create_element(list).write_inner_content(unknowns)?;
            }
        }
    }
    Ok(())
}

/// Returns a page about the variables, for the documentation folder of an FMU.
///
/// # Errors
/// Those of the XML writer.
pub(crate) fn page(about: &About<'_>, variables: &[Variable]) -> io::Result<Vec<u8>> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::DocType(BytesText::new("html")))?;
    let text = |xml: &mut Xml, element: &str, text: &str| {
        xml.create_element(element).write_text_content(BytesText::new(text)).map(drop)
    };
    // Title, a paragraph on step and inputs, a row for each variable.
    xml.create_element("html").with_attribute(("lang", "en")).write_inner_content(|xml| {
        xml.create_element("head").write_inner_content(|xml| {
            xml.create_element("meta").with_attribute(("charset", "utf-8")).write_empty()?;
            text(xml, "title", about.name)
        })?;
        xml.create_element("body").write_inner_content(|xml| {
            text(xml, "h1", about.name)?;
            let step = format!(
                "Solver step {} s, or less if communication steps are no multiples of it. The arm starts at rest at \
                 the target positions, in static equilibrium. Inputs hold from one communication point to the next; \
                 targets are those at its end.",
                about.step_s
            );
            text(xml, "p", &step)?;
            xml.create_element("table").write_inner_content(|xml| {
                for variable in variables {
                    xml.create_element("tr").write_inner_content(|xml| {
                        let [(_, causality), _] = roles(variable);
                        for cell in [&*variable.name, causality, variable.unit, &variable.description] {
                            text(xml, "td", cell)?;
                        }
                        Ok(())
                    })?;
                }
                Ok(())
            })?;
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(xml.into_inner())
}
