//! Energy balance of a run: work of drives and loads, dissipation, stored energy.

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, State, kinetic_energy, potential_energy};
use flexarm_stepping::Observation;

use crate::summary::EnergyFigures;

/// Monitors the energy.
pub(crate) struct Energy {
    /// Model at the previous sample, with its payload.
    model: Arc<Model>,
    book: EnergyBook,
}

impl Energy {
    /// `model`: that of the arm at the start.
    pub(crate) fn new(model: &Arc<Model>) -> Self {
        Self { model: model.clone(), book: EnergyBook::default() }
    }

    pub(crate) fn update(&mut self, seen: &Observation) {
        if !Arc::ptr_eq(&self.model, &seen.model) {
            // A payload present at the start is not exchanged.
            if self.book.first.is_some() {
                self.book.exchanged += mechanical_energy(&seen.model, seen) - mechanical_energy(&self.model, seen);
            }
            self.model.clone_from(&seen.model);
        }
        let drives = seen.drive.iter().zip(seen.qdot.iter()).map(|(force, rate)| force * rate);
        self.book.lose(seen.hysteresis_work);
        self.book.add(seen.t, seen.energy, seen.power, seen.impulse_work, drives);
    }

    pub(crate) fn result(&self) -> EnergyFigures {
        self.book.figures()
    }
}

/// Kinetic and gravitational energy (J) of a state, including the model's payload.
fn mechanical_energy(model: &Model, seen: &Observation) -> f64 {
    let mut data = Data::new(model);
    let state = State { q: seen.q.clone(), qdot: seen.qdot.clone() };
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
    struck: f64,
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
        let struck = if self.first.is_some() { impulse_work - self.struck } else { 0.0 };
        self.work[0] += struck;
        self.gross[0] += struck.max(0.0);
        self.gross[1] += (-struck).max(0.0);
        self.struck = impulse_work;
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

#[cfg(test)]
#[allow(clippy::print_stderr, reason = "what was measured stands beside the bound")]
mod tests {
    use super::*;
    use flexarm_kinematics::{LinkInertia, forward_kinematics};
    use flexarm_stepping::{FlexibleArm, Spring};

    /// Truth: a mass m picked up at p with velocity v adds `m v²/2 - m g·p`, and removes it when
    /// put down; v from differences of p.
    #[test]
    fn a_payload_brings_its_energy_and_takes_it_along() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let model = crate::Robot::load(root.join("robots/one_beam")).unwrap().rigid_model().unwrap();
        let still = Arc::new(flexarm_stepping::Held(vec![0.3]));
        let arm = FlexibleArm::new(model.clone(), Vec::<Spring>::new(), still).unwrap();
        let mut seen = Observation::new(&arm);
        (seen.q[0], seen.qdot[0]) = (0.3, 0.5);
        let frame = model.frame(crate::TCP_FRAME).unwrap().clone();
        let (mass, com) = (2.0, nalgebra::Vector3::new(0.1, -0.2, 0.3));
        let mut data = Data::new(&model);
        let mut place = |q: f64| {
            forward_kinematics(&model, &mut data, &nalgebra::DVector::from_element(1, q));
            (data.X_WF(&frame) * nalgebra::Point3::from(com)).coords
        };
        let (p, v) = (place(0.3), (place(0.3 + 1e-5) - place(0.3 - 1e-5)) * (0.5 / 2e-5));
        let truth = 0.5 * mass * v.norm_squared() - mass * model.gravity.dot(&p);

        let added = LinkInertia { mass, com, inertia_com: nalgebra::Matrix3::zeros() }.spatial().at_parent(&frame.X_BF);
        let mut inertia = model.bodies()[frame.body].inertia;
        inertia += added;
        let carrying = Arc::new(model.with_inertia(frame.body, inertia));
        let mut energy = Energy::new(&model);
        let mut payload = Vec::new();
        for model in [&model, &model, &carrying, &carrying, &model] {
            seen.model.clone_from(model);
            energy.update(&seen);
            payload.push(energy.result().payload_j);
        }
        assert!(payload[1] == 0.0 && payload[2] == payload[3] && payload[4].abs() < 1e-12);
        assert!((payload[2] / truth - 1.0).abs() < 1e-9, "{} {truth}", payload[2]);
        // A payload carried from the start adds nothing.
        let mut energy = Energy::new(&model);
        seen.model.clone_from(&carrying);
        energy.update(&seen);
        assert_eq!(energy.result().payload_j, 0.0);
    }

    /// Truth: the integral of `A sin t` over a turn is 2 A - 2 A, for each drive. Identity:
    /// positive minus negative work is the net work.
    #[test]
    fn drives_that_give_back_what_they_took_have_no_net_work_and_much_gross_work() {
        let mut book = EnergyBook::default();
        let n = 1000;
        for k in 0..=n {
            let t = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
            // The second drive brakes while the first drives: their sum is zero at all times.
            let drives = [3.0 * t.sin(), -3.0 * t.sin()];
            book.add(t, [0.0; 3], [drives.iter().sum(), 0.0, 0.0], 0.0, drives.into_iter());
        }
        let figures = book.figures();
        assert!(figures.drives_j.abs() < 1e-12, "{}", figures.drives_j);
        // Measured 3.9e-5 too little: error of the trapezoidal rule with a thousand samples.
        assert!((figures.drives_positive_j - 12.0).abs() < 1e-4, "{}", figures.drives_positive_j);
        assert!((figures.drives_negative_j - 12.0).abs() < 1e-4, "{}", figures.drives_negative_j);
        assert_eq!(parts(2.0, -1.0, 3.0), [2.25, 0.25]);
        assert_eq!(parts(2.0, -1.0, 0.0), [0.0, 1.0]);
    }
}
