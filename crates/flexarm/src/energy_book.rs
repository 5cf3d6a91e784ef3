//! The energy balance of a run: what drives and loads put in, what dampers took, what is stored.

use crate::summary::EnergyFigures;

/// Work that goes in and out between samples, by the trapezoidal rule.
#[derive(Default)]
pub(crate) struct EnergyBook {
    first: Option<f64>,
    last: f64,
    before: Option<(f64, [f64; 3])>,
    /// Drives, loads, dissipation (J).
    work: [f64; 3],
    /// Largest gap between what is stored and what was supplied, and largest change of what is stored (J).
    gap: f64,
    swing: f64,
    struck: f64,
    /// Energy that came or went with a payload (J).
    pub(crate) exchanged: f64,
}

impl EnergyBook {
    /// `impulse_work`: work of the drives so far that is in no power, where velocities jumped (J).
    pub(crate) fn add(&mut self, t: f64, energy: [f64; 3], power: [f64; 3], impulse_work: f64) {
        if let Some((t_before, p)) = self.before {
            for c in 0..3 {
                self.work[c] += 0.5 * (t - t_before) * (p[c] + power[c]);
            }
        }
        // A blow at the start is in the energy of the first sample.
        self.work[0] += if self.first.is_some() { impulse_work - self.struck } else { 0.0 };
        self.struck = impulse_work;
        self.last = energy.iter().sum();
        self.before = Some((t, power));
        let first = *self.first.get_or_insert(self.last);
        let supplied = self.work[0] + self.work[1] - self.work[2] + self.exchanged;
        self.gap = self.gap.max((self.last - first - supplied).abs());
        self.swing = self.swing.max((self.last - first).abs()).max(self.work[0].abs());
    }

    pub(crate) fn figures(&self) -> EnergyFigures {
        EnergyFigures {
            drives_j: self.work[0],
            loads_j: self.work[1],
            dissipated_j: self.work[2],
            payload_j: self.exchanged,
            stored_j: self.last - self.first.unwrap_or(self.last),
            imbalance: if self.swing > 0.0 { self.gap / self.swing } else { 0.0 },
        }
    }
}
