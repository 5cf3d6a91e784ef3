//! The same arm and motion in other programs: stored results, and the curve of this build compared
//! with the stored truth.
//!
//! `today` and `stored` compute findings, `page` writes them up.

mod page;
mod stored;
mod today;

use crate::bench::{Bench, Stored};
use crate::page::Case;
use crate::{Error, Pace};

use stored::StoredRuns;
use today::Today;

const STORED: &str = "other_programs.json";

/// Findings of the case.
struct Findings {
    about: About,
    today: Today,
    /// `None` if the stored file does not have two motions.
    stored: Option<StoredRuns>,
}

/// Origin of the stored results.
struct About {
    /// Names and versions of the programs.
    programs: Vec<String>,
    date: String,
    machine: String,
    /// Ratio of damping to stiffness (s).
    damping_s: f64,
}

impl About {
    fn new(stored: &Stored) -> Result<Self, Error> {
        let versions = stored.at("versions")?.as_object().into_iter().flatten();
        let named = versions.filter(|(name, _)| ["exudyn", "mujoco", "pinocchio"].contains(&name.as_str()));
        let text = |key: &str| Ok::<_, Error>(stored.at(key)?.as_str().unwrap_or("?").to_owned());
        Ok(Self {
            programs: named.map(|(name, version)| format!("{name} {}", version.as_str().unwrap_or("?"))).collect(),
            date: text("date")?,
            machine: text("machine")?,
            damping_s: stored.number("model/damping_beta_s")?,
        })
    }
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    let stored = bench.stored(STORED)?;
    let about = About::new(&stored)?;
    let today = Today::new(bench, about.damping_s)?;
    let stored = StoredRuns::new(&stored)?;
    Ok(page::page(&Findings { about, today, stored }))
}
