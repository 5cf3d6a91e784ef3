//! Settling of the TCP in words: the slowest stop counts, and stops without settling are reported
//! first.

use crate::run::summary::TcpFigures;

/// Settling at the stops of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Settling {
    /// There is no stop after a move.
    NoStop,
    /// The TCP settles at every stop.
    Settled {
        /// Maximum settling time (s).
        after_s: f64,
        /// Number of that stop, from 1; None for runs whose stops are not known.
        stop: Option<usize>,
        /// Number of stops.
        of: usize,
    },
    /// At some stops the TCP is still outside the band at the end.
    NotSettled {
        /// Numbers of these stops, from 1, and the duration of each (s).
        stops: Vec<(usize, f64)>,
        /// Number of stops.
        of: usize,
    },
}

impl TcpFigures {
    /// Returns the settling at the stops.
    pub fn settling_state(&self) -> Settling {
        let of = self.holds.len();
        let Some(worst) = self.holds.iter().map(|hold| hold.settling_s.unwrap_or(0.0)).reduce(f64::max) else {
            return self.settling_s.map_or(Settling::NoStop, |after_s| Settling::Settled { after_s, stop: None, of });
        };
        let unsettled = self.holds.iter().enumerate().filter(|(_, hold)| hold.settling_s.is_none());
        let stops: Vec<(usize, f64)> = unsettled.map(|(k, hold)| (k + 1, hold.end_s - hold.start_s)).collect();
        if !stops.is_empty() {
            return Settling::NotSettled { stops, of };
        }
        let stop = self.holds.iter().position(|hold| hold.settling_s == Some(worst)).map(|k| k + 1);
        Settling::Settled { after_s: worst, stop, of }
    }
}

impl Settling {
    /// Returns the settling time, if there is one (s).
    pub fn time_s(&self) -> Option<f64> {
        if let Self::Settled { after_s, .. } = self { Some(*after_s) } else { None }
    }

    /// Short text for a table cell without a number.
    pub fn short(&self) -> &'static str {
        match self {
            Self::NoStop => "no stop",
            Self::Settled { .. } => "settled",
            Self::NotSettled { .. } => "not settled",
        }
    }

    /// Returns a note to accompany or replace the time; `band` such as "within 0.1 mm", or empty.
    pub fn note(&self, band: &str) -> String {
        let band = if band.is_empty() { String::new() } else { format!(", {band}") };
        match self {
            Self::NoStop => "there is no stop after a move".into(),
            Self::Settled { stop: None, .. } => format!("after the last move{band}"),
            Self::Settled { of: 1, .. } => format!("after the move{band}"),
            Self::Settled { stop: Some(stop), of, .. } => format!("at stop {stop}, the longest of {of}{band}"),
            Self::NotSettled { stops, of } => {
                let each: Vec<String> =
                    stops.iter().map(|(stop, lasts)| format!("stop {stop}, which lasts {lasts:.3} s")).collect();
                let of = if *of == stops.len() { String::new() } else { format!(" ({} of {of} stops)", stops.len()) };
                format!("not settled at {}{of}{band}", each.join(", "))
            }
        }
    }

    /// Returns the complete result in words.
    pub(crate) fn words(&self, band: &str) -> String {
        match self.time_s() {
            Some(s) => format!("settled after {s:.3} s, {}", self.note(band)),
            None => self.note(band),
        }
    }
}

/// Describes a band, such as "within 0.1 mm".
pub(crate) fn within(band_m: f64) -> String {
    let mm: f64 = format!("{:.2e}", 1e3 * band_m).parse().unwrap_or(1e3 * band_m);
    format!("within {mm} mm")
}
