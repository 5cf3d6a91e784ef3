//! Natural frequencies measured at a pose.

use flexarm_run::Error;
use serde::Deserialize;
use toml::Spanned;

use super::common::{Joints, LoadEntry};
use super::reader::{Reader, Site, located};
use crate::estimation::{Reading, ReadingKind, Row};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrequencyEntry {
    joints: Spanned<Joints>,
    #[serde(default)]
    load: LoadEntry,
    hz: Spanned<Vec<f64>>,
    modes: Option<Spanned<Vec<usize>>>,
    std: Option<Spanned<f64>>,
    /// Relative standard deviation of each frequency.
    std_relative: Option<Spanned<f64>>,
}

impl Reader<'_> {
    /// Adds the frequencies of an entry.
    ///
    /// * `number`: of the entry, from 0, for its name.
    pub(super) fn frequency(&mut self, number: usize, entry: &Spanned<FrequencyEntry>) -> Result<(), Error> {
        let (e, site) = (entry.get_ref(), Site::from(entry));
        let hz = e.hz.get_ref();
        let modes: Vec<usize> = e.modes.as_ref().map_or_else(|| (1..=hz.len()).collect(), |m| m.get_ref().clone());
        if modes.len() != hz.len() || modes.contains(&0) {
            let at = e.modes.as_ref().map_or(site, Site::from);
            let message = format!(
                "modes = {modes:?} for {} frequencies: expected one mode number for each, 1 is the lowest",
                hz.len()
            );
            return Err(self.error(at, message));
        }
        if hz.is_empty() || hz.iter().any(|f| !(f.is_finite() && *f > 0.0)) {
            return Err(self.error(&e.hz, "hz: expected positive frequencies"));
        }
        if let (Some(_), Some(relative)) = (&e.std, &e.std_relative) {
            return Err(self.error(relative, "std (Hz) and std_relative (part of each frequency): keep one of them"));
        }
        let (std, relative) = (self.std(located(&e.std), 1.0)?, self.std(located(&e.std_relative), 1.0)?);
        let std_of = |f: f64| if e.std_relative.is_some() { relative * f } else { std };
        let rows = hz.iter().zip(modes).map(|(f, mode)| Row { of: mode - 1, value: *f, std: std_of(*f) }).collect();
        let kind = ReadingKind::Frequencies { load: self.load(&e.load, &site)?, rows };
        let q = self.joints(&e.joints)?;
        self.measurements.readings.push(Reading { name: format!("frequency {}", number + 1), q, kind });
        Ok(())
    }
}
