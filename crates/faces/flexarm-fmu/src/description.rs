//! `modelDescription.xml` of FMI 2.0 and 3.0.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use crate::variables::{Causality, Kind, UNITS, Variable};

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
    let root = xml.create_element("fmiModelDescription").with_attributes([
        ("fmiVersion", if fmi == Fmi::V2 { "2.0" } else { "3.0" }),
        ("modelName", about.name),
        (token, about.token),
        ("description", "Robot arm with flexible links and elastic drives"),
        ("generationTool", concat!("flexarm ", env!("CARGO_PKG_VERSION"))),
        ("variableNamingConvention", "structured"),
    ]);
    root.write_inner_content(|xml| {
        co_simulation(xml, fmi)?;
        xml.create_element("UnitDefinitions").write_inner_content(units)?;
        let step = about.step_s.to_string();
        xml.create_element("DefaultExperiment")
            .with_attributes([("startTime", "0"), ("stopTime", "1"), ("stepSize", &step)])
            .write_empty()?;
        xml.create_element("ModelVariables").write_inner_content(|xml| {
            let mut write = |(reference, variable)| match fmi {
                Fmi::V2 => variable_2(xml, reference, variable),
                Fmi::V3 => variable_3(xml, reference, variable),
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

fn co_simulation(xml: &mut Xml, fmi: Fmi) -> io::Result<()> {
    let state = if fmi == Fmi::V2 { "canGetAndSetFMUstate" } else { "canGetAndSetFMUState" };
    xml.create_element("CoSimulation")
        .with_attributes([
            ("modelIdentifier", MODEL_IDENTIFIER),
            ("canHandleVariableCommunicationStepSize", "true"),
            (state, "true"),
        ])
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
    };
    [("causality", causality), ("variability", variability)]
}

/// Returns the start value as text.
fn start(variable: &Variable) -> Option<String> {
    variable.start.map(|value| match variable.kind {
        Kind::Real => value.to_string(),
        Kind::Boolean => (value != 0.0).to_string(),
    })
}

fn variable_3(xml: &mut Xml, reference: usize, variable: &Variable) -> io::Result<()> {
    let (reference, start) = (reference.to_string(), start(variable));
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
    if let Some(start) = &start {
        element = element.with_attribute(("start", &**start));
    }
    element.write_empty()?;
    Ok(())
}

fn variable_2(xml: &mut Xml, reference: usize, variable: &Variable) -> io::Result<()> {
    let (reference, start) = (reference.to_string(), start(variable));
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
            if let Some(start) = &start {
                element = element.with_attribute(("start", &**start));
            }
            element.write_empty()?;
            Ok(())
        })?;
    Ok(())
}

/// Writes the outputs, and that all of them are known after the initialisation.
fn structure(xml: &mut Xml, fmi: Fmi, variables: &[Variable]) -> io::Result<()> {
    let outputs = || variables.iter().enumerate().filter(|(_, variable)| variable.causality == Causality::Output);
    match fmi {
        Fmi::V3 => {
            for element in ["Output", "InitialUnknown"] {
                for (reference, _) in outputs() {
                    let reference = reference.to_string();
                    xml.create_element(element).with_attribute(("valueReference", &*reference)).write_empty()?;
                }
            }
        }
        // FMI 2.0 counts from one.
        Fmi::V2 => {
            for list in ["Outputs", "InitialUnknowns"] {
                xml.create_element(list).write_inner_content(|xml| {
                    for (place, _) in outputs() {
                        let place = (place + 1).to_string();
                        xml.create_element("Unknown").with_attribute(("index", &*place)).write_empty()?;
                    }
                    Ok(())
                })?;
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
