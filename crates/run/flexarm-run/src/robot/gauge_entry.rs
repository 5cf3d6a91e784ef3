//! `[[strain_gauge]]` and `[[stress_point]]` of a robot file: places on links whose stress is
//! recorded.

use std::collections::BTreeSet;

use flexarm_files::{Source, TextFileError};
use flexarm_urdf::closest;
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use crate::robot::entry_checks::check_finite;

/// Maximum number of grids of a rosette.
const MAX_GRIDS: usize = 8;

/// Strain gauge as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StrainGaugeEntry {
    /// Name of the channel.
    pub name: Spanned<String>,
    /// Flexible link with stress fields.
    pub link: Spanned<String>,
    /// Place on the surface, link axes (m).
    pub at: Spanned<[f64; 3]>,
    /// Measuring direction, link axes.
    pub direction: Spanned<[f64; 3]>,
    /// Angles of the grids of a rosette from the direction (deg), counter-clockwise seen from
    /// outside.
    pub angles_deg: Option<Spanned<Vec<f64>>>,
}

/// Stress point as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StressPointEntry {
    /// Name of the channels.
    pub name: Spanned<String>,
    /// Flexible link with stress fields.
    pub link: Spanned<String>,
    /// Place on the surface, link axes (m).
    pub at: Spanned<[f64; 3]>,
}

/// A place on the surface of a link whose strain or stress is recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Name.
    pub name: String,
    /// Flexible link.
    pub link: String,
    /// Place on the surface, link axes (m).
    pub at: Vector3<f64>,
    /// Measuring direction (link axes) and angle from it (rad) of a strain gauge; `None` for a
    /// stress point.
    pub grid: Option<(Vector3<f64>, f64)>,
}

/// Names of the flexible links of a robot, and whether their stress fields are stored.
pub(crate) type StressLinks<'a> = &'a [(&'a str, bool)];

/// Reads all entries; a rosette becomes one gauge per grid. Also returns the errors found.
pub(crate) fn gauges(
    strain: &[StrainGaugeEntry],
    stress: &[StressPointEntry],
    links: StressLinks<'_>,
    source: &Source,
) -> (Vec<Gauge>, Vec<TextFileError>) {
    let strain = strain.iter().map(|entry| (&entry.name, rosette(entry, links, source)));
    let point = |entry: &StressPointEntry| Ok(vec![place(&entry.name, &entry.link, &entry.at, links, source)?]);
    let stress = stress.iter().map(|entry| (&entry.name, point(entry)));
    let (mut names, mut found, mut faults) = (BTreeSet::new(), Vec::new(), Vec::new());
    for (name, gauges) in strain.chain(stress) {
        match gauges {
            Err(fault) => faults.push(fault),
            Ok(gauges) => {
                // A grid of a rosette may have the name of another gauge.
                if let Some(twice) = gauges.iter().find(|gauge| !names.insert(gauge.name.clone())) {
                    let message = format!("two gauges or stress points are called {:?}: rename one", twice.name);
                    faults.push(source.error(name.span(), message));
                }
                found.extend(gauges);
            }
        }
    }
    (found, faults)
}

/// Returns the gauges of a rosette, or the only one.
fn rosette(entry: &StrainGaugeEntry, links: StressLinks<'_>, source: &Source) -> Result<Vec<Gauge>, TextFileError> {
    let gauge = place(&entry.name, &entry.link, &entry.at, links, source)?;
    let direction = Vector3::from(*entry.direction.get_ref());
    check_finite("direction", direction.as_slice(), entry.direction.span(), source)?;
    if direction.norm() == 0.0 {
        return Err(source.error(entry.direction.span(), "direction has no length: give a vector along the surface"));
    }
    let Some(angles) = &entry.angles_deg else { return Ok(vec![Gauge { grid: Some((direction, 0.0)), ..gauge }]) };
    check_finite("angles_deg", angles.get_ref(), angles.span(), source)?;
    if angles.get_ref().is_empty() || angles.get_ref().len() > MAX_GRIDS {
        let message = format!(
            "angles_deg has {} entries: give one to {MAX_GRIDS} angles, such as [0, 45, 90]",
            angles.get_ref().len()
        );
        return Err(source.error(angles.span(), message));
    }
    // One grid per angle, with a name of its own.
    let grid = |(k, angle): (usize, &f64)| {
        let repeated = angles.get_ref()[..k].contains(angle);
        let name = format!("{}_{angle}", gauge.name);
        let grid = Gauge { name, grid: Some((direction, angle.to_radians())), ..gauge.clone() };
        if repeated { Err(source.error(angles.span(), format!("angles_deg has {angle} twice"))) } else { Ok(grid) }
    };
    angles.get_ref().iter().enumerate().map(grid).collect()
}

/// Returns the place of an entry as a stress point.
fn place(
    name: &Spanned<String>,
    link: &Spanned<String>,
    at: &Spanned<[f64; 3]>,
    links: StressLinks<'_>,
    source: &Source,
) -> Result<Gauge, TextFileError> {
    let text = name.get_ref();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-' || c == '.';
    if text.is_empty() || !text.chars().all(is_plain) {
        let message = format!("name = {text:?}: use letters, digits, '_', '-' and '.', since columns have this name");
        return Err(source.error(name.span(), message));
    }
    let fail = |message: String| source.error(link.span(), format!("{text:?}: {message}"));
    // The link must be flexible and have a stress model.
    let Some((_, has_stress)) = links.iter().find(|(known, _)| known == link.get_ref()) else {
        let known = links.iter().map(|(link, _)| *link);
        let meant =
            closest(link.get_ref(), known).map_or_else(String::new, |meant| format!("; did you mean {meant:?}?"));
        return Err(fail(format!("{:?} is none of the flexible links of this file{meant}", link.get_ref())));
    };
    if !has_stress {
        return Err(fail(format!(
            "link {:?} has no stress: of a mesh, reduce it again, with its stress, and keep the .stress file beside the .flex file; of a beam, \
             set stress = true",
            link.get_ref()
        )));
    }
    check_finite("at", at.get_ref(), at.span(), source)?;
    let (name, link) = (text.clone(), link.get_ref().clone());
    Ok(Gauge { name, link, at: Vector3::from(*at.get_ref()), grid: None })
}
