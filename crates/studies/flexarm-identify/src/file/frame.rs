//! Instruments and targets: pose or position, uncertainty, and the components that are unknown.
//!
//! [`Reader::frames`] reads what the file gives; after the readings, [`Reader::choose_unknown_frames`] decides
//! what is fitted. Frames: W world, I instrument; `X_WI` is in the file, the fit has its inverse.

use std::collections::BTreeMap;

use flexarm_kinematics::Pose;
use flexarm_run::Error;
use nalgebra::{Rotation3, Translation3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::reader::{Reader, located};
use crate::estimation::{Instrument, Reading, ReadingKind, Target};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InstrumentEntry {
    xyz: Option<[f64; 3]>,
    rpy: Option<[f64; 3]>,
    /// Standard deviation of each component of `xyz`.
    std: Option<Spanned<f64>>,
    /// Standard deviation of the rotation about each axis.
    std_rotation: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TargetEntry {
    xyz: [f64; 3],
    #[serde(default)]
    unknown: bool,
    /// Link in whose axes `xyz` is; the tool if absent.
    link: Option<Spanned<String>>,
    /// Standard deviation of each component.
    std: Option<Spanned<f64>>,
}

impl Reader<'_> {
    /// Reads the names of instruments and targets, and their given poses and positions.
    pub(super) fn frames(
        &mut self,
        instruments: &BTreeMap<String, Spanned<InstrumentEntry>>,
        targets: &BTreeMap<String, Spanned<TargetEntry>>,
    ) -> Result<(), Error> {
        // Instruments: X_WI as written, kept as X_IW, which takes points to the axes of the instrument.
        for (name, entry) in instruments {
            let InstrumentEntry { xyz, rpy, std, std_rotation } = entry.get_ref();
            let all = xyz.iter().chain(rpy).flatten();
            if let Some(bad) = all.copied().find(|x| !x.is_finite()) {
                return Err(self.error(entry, format!("found {bad}, expected finite numbers")));
            }
            let deviation = std.as_ref().or(std_rotation.as_ref());
            if let (Some(std), None, None) = (deviation, xyz, rpy) {
                let text = format!(
                    "instrument {name:?} has a standard deviation but no pose: give xyz and rpy, or remove the \
                     standard deviation"
                );
                return Err(self.error(std, text));
            }
            let [r, p, y] = rpy.unwrap_or_default().map(|angle| angle * self.units.angle);
            let at = Vector3::from(xyz.unwrap_or_default()) * self.units.length;
            let X_WI = Pose::from_parts(Translation3::from(at), Rotation3::from_euler_angles(r, p, y));
            self.measurements.instrument_names.push(name.clone());
            self.measurements.instruments.push(Instrument::Known(X_WI.inverse()));
        }
        // Targets: points in the frame of their link; without a link, of the tool.
        for (name, entry) in targets {
            let TargetEntry { link, xyz, unknown, std } = entry.get_ref();
            let frame = link.as_ref().map(|link| self.moving_link(link)).transpose()?;
            self.measurements.links.push(frame);
            if let Some(bad) = xyz.iter().find(|x| !x.is_finite()) {
                return Err(self.error(entry, format!("found {bad}, expected finite numbers")));
            }
            if let (true, Some(std)) = (*unknown, std) {
                let text = format!("target {name:?} is unknown and has a standard deviation: remove one of them");
                return Err(self.error(std, text));
            }
            self.targets.push(name.clone());
            self.measurements.targets.push(Target::Known(Vector3::from(*xyz) * self.units.length));
        }
        Ok(())
    }

    /// Decides which instruments and targets are fitted, given the readings that refer to them, and adds
    /// what is known of them as readings.
    pub(super) fn choose_unknown_frames(
        &mut self,
        instruments: &BTreeMap<String, Spanned<InstrumentEntry>>,
        targets: &BTreeMap<String, Spanned<TargetEntry>>,
    ) -> Result<(), Error> {
        // Instruments that measure positions, instruments whose axes displacements refer to, and
        // targets that are measured.
        let n = (instruments.len(), targets.len());
        let (mut placed, mut oriented, mut used) = (vec![false; n.0], vec![false; n.0], vec![false; n.1]);
        for reading in &self.measurements.readings {
            match &reading.kind {
                ReadingKind::Place { instrument, target, .. } => (placed[*instrument], used[*target]) = (true, true),
                ReadingKind::Displacement { rows, .. } => {
                    rows.iter().filter_map(|row| row.of.instrument).for_each(|k| oriented[k] = true);
                }
                _ => {}
            }
        }
        for (k, (name, entry)) in instruments.iter().enumerate().filter(|(k, _)| placed[*k] || oriented[*k]) {
            self.choose_unknown_instrument(k, name, entry, placed[k])?;
        }
        for (k, (name, entry)) in targets.iter().enumerate().filter(|(k, _)| used[*k]) {
            let TargetEntry { unknown, std, .. } = entry.get_ref();
            let Target::Known(value) = self.measurements.targets[k] else { continue };
            if *unknown || std.is_some() {
                self.measurements.targets[k] = Target::Unknown(value);
            }
            if std.is_some() {
                let std = self.std(located(std), self.units.length)?;
                self.add_known("target", name, ReadingKind::TargetAt { target: k, value, std });
            }
        }
        Ok(())
    }

    /// Decides whether the pose of an instrument is given, given with deviations, or unknown.
    ///
    /// * `placed`: whether it measures positions; otherwise only its axes matter.
    fn choose_unknown_instrument(
        &mut self,
        k: usize,
        name: &str,
        entry: &Spanned<InstrumentEntry>,
        placed: bool,
    ) -> Result<(), Error> {
        let InstrumentEntry { xyz, rpy, std, std_rotation } = entry.get_ref();
        let Instrument::Known(given) = self.measurements.instruments[k] else { return Ok(()) };
        // Places require the position too; displacements only the orientation.
        let known = xyz.is_some() || (!placed && rpy.is_some());
        let deviation =
            |std: &Option<Spanned<f64>>, unit: f64| located(std).map(|std| self.std(Some(std), unit)).transpose();
        let std_place = deviation(std, self.units.length)?;
        let std_turn = deviation(std_rotation, self.units.angle)?;
        // A known pose without deviations is exact; with all of its deviations, it is estimated and
        // the given pose counts as a reading.
        let deviations = match (known, std_place, std_turn) {
            (false, None, None) => None,
            (true, None, None) => return Ok(()),
            (true, Some(_), None) if !placed => return Ok(()),
            (true, place, Some(turn)) if place.is_some() || !placed => Some((place.filter(|_| placed), turn)),
            _ => {
                let text = format!("instrument {name:?}: xyz, std and std_rotation are needed together");
                return Err(self.error(entry, text));
            }
        };
        self.measurements.instruments[k] =
            if placed { Instrument::Unknown(given) } else { Instrument::Axes(given.rotation) };
        if let Some((std, std_rotation)) = deviations {
            let kind = ReadingKind::InstrumentAt { instrument: k, value: given, std, std_rotation };
            self.add_known("instrument", name, kind);
        }
        Ok(())
    }

    /// Adds prior knowledge of a frame as a reading.
    fn add_known(&mut self, what: &'static str, name: &str, kind: ReadingKind) {
        self.measurements.readings.push(Reading { name: format!("{what} {name}"), q: Vec::new(), kind });
    }
}
