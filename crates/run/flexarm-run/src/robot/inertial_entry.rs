//! Entries `[[inertial]]` of a robot file: masses and centres of mass of rigid links.
//!
//! Start at [`weigh`]; link axes, kg, m. Not here: flexible links, whose mass is that of their file
//! (`link_entry.rs`).

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_kinematics::Mechanism;
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use super::entry_checks::{check_finite, unknown_link};

/// Mass and centre of mass of a rigid link, as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InertialEntry {
    /// Link of the URDF.
    pub link: Spanned<String>,
    /// Mass (kg); radii of gyration stay.
    pub mass: Option<Spanned<f64>>,
    /// Centre of mass, link axes (m).
    pub com: Option<Spanned<[f64; 3]>>,
}

/// Sets mass and centre of mass of a link in the mechanisms of a robot. `entries` are all of the
/// file.
pub(super) fn weigh(
    entry: &InertialEntry,
    entries: &[InertialEntry],
    is_flexible: bool,
    mechanisms: &mut [&mut Mechanism],
    source: &Source,
) -> Result<(), RobotFileError> {
    // The link: in the URDF, named once, and rigid.
    let name = entry.link.get_ref();
    let fail = |message: String| source.error(entry.link.span(), format!("inertial of link {name:?}: {message}"));
    if mechanisms.iter().all(|mechanism| mechanism.link(name).is_none()) {
        return Err(source.error(entry.link.span(), unknown_link("inertial", name, mechanisms[0])));
    }
    let mut same = entries.iter().filter(|other| other.link.get_ref() == name);
    if same.next().is_some_and(|first| first.link.span() != entry.link.span()) {
        return Err(fail("it has two [[inertial]] entries: keep one".into()));
    }
    if is_flexible {
        let message = "the link is flexible: give `mass` of its [[flexible_link]] (beams), or its parts (.flex)";
        return Err(fail(message.into()));
    }
    // The numbers.
    if let Some(com) = &entry.com {
        check_finite("inertial com", com.get_ref(), com.span(), source)?;
    }
    if let Some(mass) = entry.mass.as_ref().filter(|mass| !(*mass.get_ref() > 0.0 && mass.get_ref().is_finite())) {
        let message = format!("inertial mass = {}: expected a positive number of kg", mass.get_ref());
        return Err(source.error(mass.span(), message));
    }
    // A new mass scales the inertia, so that radii of gyration stay.
    let links = mechanisms.iter_mut().flat_map(|mechanism| &mut mechanism.links).filter(|link| link.name == *name);
    for link in links {
        let Some(inertia) = link.inertia.as_mut().filter(|inertia| inertia.mass > 0.0) else {
            return Err(fail("the URDF gives it no mass that could be changed: add <inertial> there".into()));
        };
        if let Some(com) = &entry.com {
            inertia.com = Vector3::from(*com.get_ref());
        }
        if let Some(mass) = &entry.mass {
            inertia.inertia_com *= mass.get_ref() / inertia.mass;
            inertia.mass = *mass.get_ref();
        }
    }
    Ok(())
}
