//! Flexible link entries of a robot file: from the text to reduced links with their options.
//!
//! A link comes from a `.flex` file or from a beam between the link's frame and its distal joint.
//! Start at [`flexible_link`]; every fault is reported at its key. L is the link's frame, B that of
//! the distal joint; a 6×6 is in link axes at the split, linear first. Not here: the forms of a link
//! ([`RobotLink::form`]), sections and materials (`beam_entry`), strengths (`strength`).

use std::path::{Path, PathBuf};

use flexarm_fem::{BeamLink, ReducedLink};
use flexarm_files::{Source, TextFileError as RobotFileError, named_file};
use flexarm_flexlink::{FlexibleLink, LinkForm, Parts, SubstitutionError, distal_joint, spring_stiffness};
use flexarm_kinematics::{ElasticAngles, Joint, Mechanism, Pose};
use flexarm_linkmaker::reduce::STRESS_FILE;
use flexarm_settings::{Words, known_names};
use flexarm_stepping::Damping;
use nalgebra::{Matrix6, Vector3};
use serde::Deserialize;
use toml::Spanned;

use crate::arm::options::{LinkModel, Modelling};
use crate::error::Error;
use crate::robot::beam_entry::{BeamEntry, GIVEN, beam_section};
use crate::robot::entry_checks::keep;
use crate::robot::file_cache::FileCache;
use crate::robot::robot_link::{LinkChoices, RequestedKey, RobotLink, StressSource};
use crate::robot::strength::{Strength, StrengthEntry};

/// Folder in which the files of links are searched, and the cache that reads them.
pub(crate) struct LinkHome<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) files: &'a FileCache,
}

/// Flexible link.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlexibleLinkEntry {
    /// Link of the URDF.
    pub link: Spanned<String>,
    /// Joint at the far interface.
    pub distal: Option<Spanned<String>>,
    /// `.flex` file, relative to the robot file.
    pub reduced: Option<Spanned<PathBuf>>,
    /// Beam, instead of a `.flex` file.
    pub beam: Option<Spanned<BeamEntry>>,
    /// `lumped` or `modal`.
    pub model: Option<Spanned<String>>,
    /// Number of rigid parts of a lumped link; 2 by default.
    pub segments: Option<Spanned<i64>>,
    /// Number of fixed-interface modes of a modal link, in addition to those of its interfaces; by
    /// default all in the `.flex` file, or 6 for a beam.
    pub modes: Option<Spanned<i64>>,
    /// Modal: use this number of eigenmodes with A held instead of interface displacements.
    pub eigenmodes: Option<Spanned<i64>>,
    /// Modal: whether loads change the stiffness (geometric stiffening); false by default.
    pub geometric_stiffening: Option<Spanned<bool>>,
    /// Mass of a beam link (kg), replaces the URDF's; its inertia is scaled in proportion.
    pub mass: Option<Spanned<f64>>,
    /// Factor on its stiffness, for instance from measurements; 1 by default.
    pub stiffness_factor: Option<Spanned<f64>>,
    /// Lumped: stiffness of the spring between the two parts, replaces that of its source; 6x6,
    /// N/m, N, N m/rad.
    pub stiffness: Option<Spanned<Vec<Vec<f64>>>>,
    /// Lumped: additional factors on the six directions of its springs; 1 by default.
    pub stiffness_factors: Option<Spanned<Vec<f64>>>,
    /// Whether its stress is computed: false by default for a beam, true for a reduced link with a
    /// stress file.
    pub stress: Option<Spanned<bool>>,
    /// Strength of its material; that of the preset material by default.
    pub strength: Option<Spanned<StrengthEntry>>,
    /// Damping; 3 % modal damping by default.
    pub damping: Option<Spanned<DampingEntry>>,
    /// `rotation-vector` or `euler-zyx`.
    pub angles: Option<Spanned<String>>,
    /// `false` drops the coupling terms, only to show their effect.
    #[serde(default = "yes")]
    pub coupling: bool,
}

fn yes() -> bool {
    true
}

/// Damping, in one of these forms.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DampingEntry {
    /// Damping ratio of each mode.
    pub modal: Option<f64>,
    /// `D = beta K` (s).
    pub stiffness_beta: Option<f64>,
    /// `D = a M + b K` (1/s, s).
    pub rayleigh: Option<[f64; 2]>,
}

/// Returns the joint at the far end of the link: the one of the entry, or the only one.
fn far_joint<'m>(
    entry: &'m FlexibleLinkEntry,
    mechanism: &'m Mechanism,
    source: &Source,
) -> Result<&'m Joint, RobotFileError> {
    let named = entry.distal.as_ref().map(|d| d.get_ref().as_str());
    distal_joint(mechanism, entry.link.get_ref(), named).map_err(|e| {
        if let SubstitutionError::UnknownLink { link, known } = &e {
            let known = known_names(link, known);
            let message = format!("flexible link {link:?} is not a link of the robot; its links are {known}");
            return source.error(entry.link.span(), message);
        }
        source.error(entry.distal.as_ref().map_or(entry.link.span(), Spanned::span), e.to_string())
    })
}

/// Builds the flexible link of an entry.
pub(crate) fn flexible_link(
    entry: &FlexibleLinkEntry,
    mechanism: &Mechanism,
    source: &Source,
    home: &LinkHome<'_>,
    warnings: &mut Vec<String>,
    faults: &mut Vec<Error>,
) -> Result<RobotLink, Error> {
    // Choices of the entry, and the joint at the far end.
    let name = entry.link.get_ref();
    let model = model_of(entry, source)?;
    let segments = count(&entry.segments, "segments", 2, source)?.unwrap_or(2);
    let modes = count(&entry.modes, "modes", 0, source)?;
    let eigenmodes = count(&entry.eigenmodes, "eigenmodes", 1, source)?;
    let angles = angles_of(entry, source)?;
    let damping = damping_of(entry.damping.as_ref(), source);
    let damping = keep(damping.map_err(Error::from), faults).unwrap_or(Damping::Modal(0.0));
    let distal = far_joint(entry, mechanism, source)?;

    // Stiffness and parts, from a file or a beam.
    let (reduced, parts, beam) = match (&entry.reduced, &entry.beam) {
        (Some(file), None) => (stored_link(name, file, source, home, warnings)?, Parts::Reduced, None),
        (None, Some(beam)) => beam_link(name, beam, distal.X_PJ, mechanism, source, warnings)?,
        _ => {
            let message = format!("flexible link {name:?} needs either reduced = \"file.flex\" or beam = {{ ... }}");
            return Err(source.error(entry.link.span(), message).into());
        }
    };
    let distal = Some(distal.name.clone());
    let (form, coupling) = (LinkForm::TwoParts, entry.coupling);
    let flexible = FlexibleLink { link: name.clone(), distal, reduced, parts, form, angles, coupling };

    // Factors, stress and strength apply to all forms of the link.
    let geometric = entry.geometric_stiffening.as_ref().is_some_and(|asked| *asked.get_ref());
    let choices = LinkChoices { model, segments, modes, eigenmodes, geometric };
    let (stiffness_factor, stiffness_factors) = factors(entry, source)?;
    let stiffness = entry.stiffness.as_ref().map(|given| matrix6(given, entry, source)).transpose()?;
    let stress = stress_source(entry, source, home)?;
    let strength = entry.strength.as_ref().map(|entry| Strength::read(entry, name, source)).transpose()?;
    let link = RobotLink {
        flexible,
        damping,
        stiffness,
        stiffness_factor,
        stiffness_factors,
        beam,
        choices,
        stress,
        strength,
    };
    check_form(&link, entry, source)?;
    Ok(link)
}

/// Reads the requested model.
fn model_of(entry: &FlexibleLinkEntry, source: &Source) -> Result<LinkModel, RobotFileError> {
    let Some(word) = &entry.model else { return Ok(LinkModel::Lumped) };
    match LinkModel::from_word(word.get_ref()) {
        Some(model @ (LinkModel::Lumped | LinkModel::Modal)) => Ok(model),
        _ => {
            let message = format!("model {:?} is not known; use \"lumped\" or \"modal\"", word.get_ref());
            Err(source.error(word.span(), message))
        }
    }
}

/// Reads a whole number of at least `lowest`.
fn count(
    value: &Option<Spanned<i64>>,
    what: &str,
    lowest: i64,
    source: &Source,
) -> Result<Option<usize>, RobotFileError> {
    match value {
        None => Ok(None),
        Some(n) if (lowest..=10_000).contains(n.get_ref()) => Ok(Some(*n.get_ref() as usize)),
        Some(n) => {
            let message = format!("{what} = {}: expected a whole number of at least {lowest}", n.get_ref());
            Err(source.error(n.span(), message))
        }
    }
}

/// Reads the angles of the elastic joints.
fn angles_of(entry: &FlexibleLinkEntry, source: &Source) -> Result<ElasticAngles, RobotFileError> {
    match entry.angles.as_ref().map(|a| a.get_ref().as_str()) {
        None | Some("rotation-vector") => Ok(ElasticAngles::RotationVector),
        Some("euler-zyx") => Ok(ElasticAngles::EulerZyx),
        Some(other) => {
            let message = format!("angles {other:?} are not known; use \"rotation-vector\" or \"euler-zyx\"");
            Err(source.error(entry.angles.as_ref().map_or(0..0, Spanned::span), message))
        }
    }
}

/// Reads a `.flex` file, with warnings about its content.
fn stored_link(
    name: &str,
    file: &Spanned<PathBuf>,
    source: &Source,
    home: &LinkHome<'_>,
    warnings: &mut Vec<String>,
) -> Result<ReducedLink, Error> {
    let located = |message: String| source.error(file.span(), message);
    let path = named_file("reduced", file.get_ref(), home.folder).map_err(located)?;
    let reduced = home.files.flex(&path)?;
    if reduced.name != *name {
        warnings.push(format!("link {name:?} takes the reduced link of {:?} ({})", reduced.name, path.display()));
    }
    warnings.extend(reduced.warnings(&Default::default()).into_iter().map(|w| format!("link {name:?}: {w}")));
    let order = reduced.details.as_ref().and_then(|details| details.gate.as_ref()?.order);
    let stiff = order.and_then(|order| order.warning()).map(|warning| format!("link {name:?}: its mesh: {warning}"));
    warnings.extend(stiff);
    Ok(reduced)
}

/// Reads the factor on the stiffness and those of the six directions.
fn factors(entry: &FlexibleLinkEntry, source: &Source) -> Result<(f64, [f64; 6]), RobotFileError> {
    let factor = match &entry.stiffness_factor {
        None => 1.0,
        Some(factor) if factor.get_ref().is_finite() && *factor.get_ref() > 0.0 => *factor.get_ref(),
        Some(factor) => {
            let message = format!("stiffness_factor = {}: expected a positive number", factor.get_ref());
            return Err(source.error(factor.span(), message));
        }
    };
    let Some(given) = &entry.stiffness_factors else { return Ok((factor, [1.0; 6])) };
    match <[f64; 6]>::try_from(given.get_ref().as_slice()) {
        Ok(all) if all.iter().all(|factor| factor.is_finite() && *factor > 0.0) => Ok((factor, all)),
        _ => {
            let message = format!("stiffness_factors = {:?}: expected six positive numbers", given.get_ref());
            Err(source.error(given.span(), message))
        }
    }
}

/// Checks that the requested model exists; overrides are checked when they are used.
fn check_form(link: &RobotLink, entry: &FlexibleLinkEntry, source: &Source) -> Result<(), RobotFileError> {
    let Err((asked, error)) = link.form_or_key(&Modelling::default()) else { return Ok(()) };
    let key = match asked {
        RequestedKey::Model => None,
        RequestedKey::Segments => entry.segments.as_ref().map(Spanned::span),
        RequestedKey::Modes => entry.modes.as_ref().map(Spanned::span),
        RequestedKey::Eigenmodes => entry.eigenmodes.as_ref().map(Spanned::span),
        RequestedKey::Geometric => entry.geometric_stiffening.as_ref().map(Spanned::span),
        RequestedKey::Stiffness => entry.stiffness.as_ref().map(Spanned::span),
        RequestedKey::Directions => entry.stiffness_factors.as_ref().map(Spanned::span),
    };
    let span = key.or(entry.model.as_ref().map(Spanned::span)).unwrap_or(entry.link.span());
    Err(source.error(span, error.to_string()))
}

/// Returns the source of the stress of a link, if its stress is to be computed.
fn stress_source(
    entry: &FlexibleLinkEntry,
    source: &Source,
    home: &LinkHome<'_>,
) -> Result<Option<StressSource>, RobotFileError> {
    let name = entry.link.get_ref();
    let asked = entry.stress.as_ref();
    let fail = |message: String| source.error(asked.map_or(entry.link.span(), Spanned::span), message);
    if asked.is_some_and(|asked| !asked.get_ref()) {
        return Ok(None);
    }
    // A beam only has stress if the entry asks for it.
    let Some(reduced) = &entry.reduced else {
        let Some(beam) = entry.beam.as_ref().filter(|_| asked.is_some()) else { return Ok(None) };
        if beam.get_ref().section == GIVEN {
            return Err(fail(format!(
                "stress of link {name:?}: its section is given by its stiffness, which has no outline: give the shape of the \
                 section, or leave stress out"
            )));
        }
        return Ok(Some(StressSource::Beam));
    };
    // A reduced link has stress if its file is there.
    let file = home.folder.join(reduced.get_ref()).with_extension(STRESS_FILE);
    if file.is_file() {
        let fields = home.files.stress(&file).map_err(|error| fail(format!("stress of link {name:?}: {error}")))?;
        return Ok(Some(StressSource::File { path: file, fields }));
    }
    match asked {
        None => Ok(None),
        Some(_) => Err(fail(format!(
            "stress of link {name:?}: there is no file {}: reduce its mesh again, with its stress, or leave stress out",
            file.display()
        ))),
    }
}

/// Reads the 6×6 stiffness of the spring between the two parts of a link.
fn matrix6(
    given: &Spanned<Vec<Vec<f64>>>,
    entry: &FlexibleLinkEntry,
    source: &Source,
) -> Result<Matrix6<f64>, RobotFileError> {
    let name = entry.link.get_ref();
    let fail = |message: String| Err(source.error(given.span(), format!("stiffness of link {name:?}: {message}")));
    let rows = given.get_ref();
    let expected = "expected 6 rows of 6 numbers (N/m, N, N m/rad)";
    if rows.len() != 6 {
        return fail(format!("{expected}, found {} rows", rows.len()));
    }
    if let Some((k, row)) = rows.iter().enumerate().find(|(_, row)| row.len() != 6) {
        return fail(format!("{expected}, found {} in row [{k}]", row.len()));
    }
    if !entry.coupling {
        return fail(
            "coupling = false belongs to the stiffness of a .flex file or beam: write zeros here instead".into(),
        );
    }
    spring_stiffness(&Matrix6::from_fn(|i, j| rows[i][j])).or_else(|error| fail(error.to_string()))
}

/// Reads the damping of a link or a mounting; 3 % modal damping by default.
pub(crate) fn damping_of(entry: Option<&Spanned<DampingEntry>>, source: &Source) -> Result<Damping, RobotFileError> {
    let Some(entry) = entry else { return Ok(Damping::Modal(0.03)) };
    // Exactly one kind; NaN in one Rayleigh number must reach the check below.
    let (value, damping) = match entry.get_ref() {
        DampingEntry { modal: Some(zeta), stiffness_beta: None, rayleigh: None } => (*zeta, Damping::Modal(*zeta)),
        DampingEntry { modal: None, stiffness_beta: Some(beta), rayleigh: None } => {
            (*beta, Damping::StiffnessProportional(*beta))
        }
        DampingEntry { modal: None, stiffness_beta: None, rayleigh: Some([a, b]) } => {
            (a.min(*b) + 0.0 * (a + b), Damping::Rayleigh(*a, *b))
        }
        _ => {
            let message = "damping takes exactly one of modal = ratio, stiffness_beta = seconds or rayleigh = [1/s, s]";
            return Err(source.error(entry.span(), message));
        }
    };
    if !(value.is_finite() && value >= 0.0) {
        return Err(source.error(entry.span(), format!("damping is {value}, it must be zero or positive")));
    }
    if matches!(damping, Damping::Modal(zeta) if zeta >= 1.0) {
        let message = format!("modal damping is {value}, a ratio below 1 is expected (3 per cent is 0.03)");
        return Err(source.error(entry.span(), message));
    }
    Ok(damping)
}

/// Builds the link of a beam, with the source of the masses of its parts and the beam itself.
///
/// * `X_LB`: pose of the distal joint in the link, link axes (m).
fn beam_link(
    name: &str,
    entry: &Spanned<BeamEntry>,
    X_LB: Pose,
    mechanism: &Mechanism,
    source: &Source,
    warnings: &mut Vec<String>,
) -> Result<(ReducedLink, Parts, Option<BeamLink>), Error> {
    let beam = entry.get_ref();
    let fail = |message: String| Error::from(source.error(entry.span(), format!("link {name:?}: {message}")));
    let (section, material) = beam_section(beam).map_err(fail)?;
    let theory = beam.theory().map_err(fail)?;
    // The line of the beam, from A to B or between ends of its own.
    let [from, to] = beam.ends.map_or([Vector3::zeros(), X_LB.translation.vector], |ends| ends.map(Vector3::from));
    let axis = to - from;
    let length = axis.norm();
    if !(length.is_finite() && length >= 1e-6) {
        let text = match beam.ends {
            Some(_) => "its ends coincide: a beam needs a length",
            None => {
                "its distal joint lies at the link's origin: a beam needs a length, or ends = [[x, y, z], [x, y, z]]"
            }
        };
        return Err(fail(text.into()));
    }
    // By default any direction across the beam is suitable; uses the coordinate axis most
    // perpendicular to the beam.
    let y_axis = beam.y_axis.map(Vector3::from).unwrap_or_else(|| {
        let k = axis.abs().imin();
        Vector3::from_fn(|i, _| if i == k { 1.0 } else { 0.0 })
    });
    let own = mechanism.link(name).and_then(|link| link.inertia);
    let parts = match beam.parts.as_deref() {
        None if own.is_none() => {
            let text = format!("link {name:?} has no inertia: it gets the mass of its section, spread along the beam");
            warnings.push(text);
            Parts::Reduced
        }
        None | Some("from-link") => Parts::FromLink(beam.split),
        Some("uniform") => Parts::Reduced,
        Some(other) => return Err(fail(format!("parts {other:?} are not known; use \"from-link\" or \"uniform\""))),
    };
    let mut link = BeamLink::new(name, section, material, length)
        .along(axis, y_axis, beam.roll, from + Vector3::from(beam.offset))
        .map_err(|e| fail(e.to_string()))?;
    link.X_LB = X_LB;
    link.theory = theory;
    link.split_fraction = beam.split;
    // The link's own mass spread along the beam, or that of the section if the URDF gives none.
    link.mass = own.map(|own| own.mass);
    let reduced = link.reduce().map_err(|e| fail(e.to_string()))?;
    Ok((reduced, parts, Some(link)))
}
