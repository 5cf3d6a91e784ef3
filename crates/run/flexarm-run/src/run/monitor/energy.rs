//! Energy balance of a run: work of drives and loads, dissipation, stored energy.
//!
//! J, W, s. Not here: energies and powers at an instant (`flexarm_stepping::Observation`).

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, State, kinetic_energy, potential_energy};
use flexarm_stepping::Observation;

use crate::run::summary::EnergyFigures;

/// Monitors the energy.
pub struct Energy {
    /// Model at the previous sample, with its payload.
    model: Arc<Model>,
    book: EnergyBook,
}

impl Energy {
    /// Creates the monitor.
    ///
    /// * `model`: tree of the arm at the start.
    pub fn new(model: &Arc<Model>) -> Self {
        Self { model: model.clone(), book: EnergyBook::default() }
    }

    /// Adds a sample.
    pub fn update(&mut self, observed: &Observation) {
        if !Arc::ptr_eq(&self.model, &observed.model) {
            // A payload present at the start is not exchanged.
            if self.book.first.is_some() {
                self.book.exchanged +=
                    mechanical_energy(&observed.model, observed) - mechanical_energy(&self.model, observed);
            }
            self.model.clone_from(&observed.model);
        }
        // Power of each drive, force times velocity; hysteresis is known only as work.
        let drives = observed.drive.iter().zip(observed.qdot.iter()).map(|(force, rate)| force * rate);
        self.book.lose(observed.hysteresis_work);
        self.book.add(observed.t, observed.energy, observed.power, observed.impulse_work, drives);
    }

    /// Returns the balance so far.
    pub fn result(&self) -> EnergyFigures {
        self.book.figures()
    }
}

/// Kinetic and gravitational energy (J) of a state, including the model's payload.
fn mechanical_energy(model: &Model, observed: &Observation) -> f64 {
    let mut data = Data::new(model);
    let state = State { q: observed.q.clone(), qdot: observed.qdot.clone() };
    kinetic_energy(model, &mut data, &state) + potential_energy(model, &mut data, &state.q)
}

/// Relative energy change below which the change counts as round-off.
const REST: f64 = 1e-9;

/// Work between samples by the trapezoidal rule.
#[derive(Default)]
struct EnergyBook {
    first: Option<f64>,
    last: f64,
    before: Option<(f64, [f64; 3])>,
    /// Work of drives, work of loads, dissipation (J).
    work: [f64; 3],
    /// Positive and negative work of the drives, summed over each drive (J).
    gross: [f64; 2],
    /// Power of each drive at the previous sample (W).
    drives: Vec<f64>,
    /// Maximum gap between stored and supplied energy, and maximum change of the stored energy (J).
    gap: f64,
    swing: f64,
    /// Maximum sum of the magnitudes of the parts of the energy (J).
    size: f64,
    impulse_work: f64,
    /// Dissipation by gear hysteresis up to the last sample, and before the first one (J).
    hysteresis: [f64; 2],
    /// Energy exchanged with payloads (J).
    exchanged: f64,
}

impl EnergyBook {
    /// Adds the total dissipation by gear hysteresis so far (J); call before adding the sample.
    fn lose(&mut self, work: f64) {
        let [last, before] = &mut self.hysteresis;
        match self.first {
            None => *before = work,
            Some(_) => self.work[2] += work - *last,
        }
        *last = work;
    }

    /// Adds a sample. `power`: of drives, loads, dissipation (W); `impulse_work`: cumulative work
    /// of the drives at velocity jumps, which is in no power (J); `drives`: power of each drive
    /// (W).
    fn add(&mut self, t: f64, energy: [f64; 3], power: [f64; 3], impulse_work: f64, drives: impl Iterator<Item = f64>) {
        // Work since the last sample by the trapezoidal rule.
        if let Some((t_before, p)) = self.before {
            for c in 0..3 {
                self.work[c] += 0.5 * (t - t_before) * (p[c] + power[c]);
            }
            for (before, now) in self.drives.iter_mut().zip(drives) {
                let [put_in, taken_out] = parts(t - t_before, *before, now);
                self.gross[0] += put_in;
                self.gross[1] += taken_out;
                *before = now;
            }
        } else {
            self.drives.extend(drives);
        }
        // An impulse at the start is contained in the energy of the first sample.
        let impulse = if self.first.is_some() { impulse_work - self.impulse_work } else { 0.0 };
        self.work[0] += impulse;
        self.gross[0] += impulse.max(0.0);
        self.gross[1] += (-impulse).max(0.0);
        self.impulse_work = impulse_work;

        // Balance: stored minus supplied energy.
        self.last = energy.iter().sum();
        self.size = self.size.max(energy.iter().map(|part| part.abs()).sum());
        self.before = Some((t, power));
        let first = *self.first.get_or_insert(self.last);
        let supplied = self.work[0] + self.work[1] - self.work[2] + self.exchanged;
        self.gap = self.gap.max((self.last - first - supplied).abs());
        self.swing = self.swing.max((self.last - first).abs()).max(self.work[0].abs());
    }

    fn figures(&self) -> EnergyFigures {
        EnergyFigures {
            drives_j: self.work[0],
            drives_positive_j: self.gross[0],
            drives_negative_j: self.gross[1],
            loads_j: self.work[1],
            dissipated_j: self.work[2],
            hysteresis_j: self.hysteresis[0] - self.hysteresis[1],
            payload_j: self.exchanged,
            stored_j: self.last - self.first.unwrap_or(self.last),
            imbalance: if self.gap > 0.0 { self.gap / self.swing.max(REST * self.size) } else { 0.0 },
        }
    }
}

/// Positive and negative work, both as positive numbers, of a power that varies linearly between
/// two values.
fn parts(time: f64, from: f64, to: f64) -> [f64; 2] {
    let whole = 0.5 * time * (from + to);
    if from * to >= 0.0 {
        return [whole.max(0.0), (-whole).max(0.0)];
    }
    let [low, high] = [from.min(to), from.max(to)];
    [0.5 * time * high * high / (high - low), 0.5 * time * low * low / (high - low)]
}
