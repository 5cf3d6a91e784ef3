//! Discrete events of a run: payload changes, samples of the controller, jumps of loads and of
//! prescribed velocities.
//!
//! Between two events everything is smooth. A step ends at each event, wherever it is, and a
//! quantity evaluated at that time belongs to the side from which it is evaluated
//! ([`EventQueue::side`]). The [`EventQueue`] is the only part of a run's state that knows which
//! events are pending and which are over.
//!
//! Not here: the effect of an event on the state (`reduced::events`), the integrators; [`Change`]
//! states what they have to update.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::load::Load;
use crate::plant::{InertiaChange, Plant};

/// Times that differ by less than this are equal (s).
pub(crate) const SAME_TIME: f64 = 1e-9;

/// Effect of an event on the integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Change {
    /// No event.
    Nothing,
    /// Accelerations, and possibly velocities, have jumped.
    Motion,
    /// Masses or damping have jumped as well: matrices are out of date.
    Matrices,
}

/// Pending and past events of a run. Times that differ by less than `SAME_TIME` are equal.
#[derive(Clone)]
pub struct EventQueue {
    /// Times of jumps of loads and prescribed velocities and of other stops of loads, ascending,
    /// and the number of them that are over.
    jumps: Vec<f64>,
    jumps_over: usize,
    /// Changes of inertia in order of time, and the number of them that have been applied.
    changes: Vec<InertiaChange>,
    changes_over: usize,
    /// Sample times of the controller.
    clock: Option<SampleClock>,
}

impl EventQueue {
    /// Creates the queue for the start of a run.
    pub fn of(plant: &Plant) -> Self {
        // Times (s) at which a load or a velocity jumps.
        let load_times = plant.loads.iter().flat_map(|load| {
            let discontinuities = load.wrench.jumps.iter().copied().filter(|t| jumps_at(load, *t));
            discontinuities.chain(load.wrench.stops.iter().copied())
        });
        let mut jumps: Vec<f64> = load_times.chain(plant.motion.velocity_jumps()).collect();
        jumps.sort_by(f64::total_cmp);
        let clock = plant.servo.as_ref().map(|servo| SampleClock { sample_s: servo.sample_s, next: 0 });
        Self { jumps, jumps_over: 0, changes: plant.inertia_changes.clone(), changes_over: 0, clock }
    }

    /// Creates a queue with the changes of inertia only, for statics.
    pub(crate) fn of_changes(plant: &Plant) -> Self {
        Self { jumps: Vec::new(), jumps_over: 0, changes: plant.inertia_changes.clone(), changes_over: 0, clock: None }
    }

    /// Returns the time of the next event after `t` (s), if any; exactly `end` if it is the same
    /// time.
    pub fn next(&self, t: f64, end: f64) -> Option<f64> {
        let change = self.changes.get(self.changes_over).map(|change| change.t);
        let sample = self.clock.as_ref().map(|clock| clock.after(t));
        let next = [change, sample, self.next_jump()].into_iter().flatten().reduce(f64::min);
        next.map(|event| if (event - end).abs() <= SAME_TIME { end } else { event })
    }

    fn next_jump(&self) -> Option<f64> {
        self.jumps.get(self.jumps_over).copied()
    }

    /// Returns the time nearest to `t` (s) strictly between the last jump and the next one.
    pub fn side(&self, t: f64) -> f64 {
        let after = self.jumps_over.checked_sub(1).map_or(t, |k| t.max(self.jumps[k].next_up()));
        self.next_jump().map_or(after, |next| after.min(next.next_down()))
    }

    /// Marks the jumps at `t` (s) as over; returns the times just before the first and just after
    /// the last of them.
    pub fn pass_jumps(&mut self, t: f64) -> Option<(f64, f64)> {
        let first = self.next_jump().filter(|first| *first <= t + SAME_TIME)?;
        self.jumps_over = self.jumps.partition_point(|time| *time <= t + SAME_TIME);
        Some((first.next_down(), self.jumps[self.jumps_over - 1].next_up()))
    }

    /// Returns the next change of inertia due at `t` with its number, and marks it as over.
    pub fn due_change(&mut self, t: f64) -> Option<(usize, &InertiaChange)> {
        self.changes_before(t + SAME_TIME)
    }

    /// Works as [`EventQueue::due_change`] for `t` approached from below: changes at `t` itself are
    /// still pending.
    pub fn change_before(&mut self, t: f64) -> Option<(usize, &InertiaChange)> {
        self.changes_before((t - SAME_TIME).next_down())
    }

    fn changes_before(&mut self, latest: f64) -> Option<(usize, &InertiaChange)> {
        let number = self.changes_over;
        let change = self.changes.get(number).filter(|change| change.t <= latest)?;
        self.changes_over += 1;
        Some((number, change))
    }

    /// Returns whether the controller takes a sample at `t`, and marks it as over.
    pub fn sample_due(&mut self, t: f64) -> bool {
        self.clock.as_mut().is_some_and(|clock| clock.is_due(t))
    }
}

/// Evenly spaced samples, starting at 0.
#[derive(Clone)]
struct SampleClock {
    sample_s: f64,
    /// Number of the next sample.
    next: u64,
}

impl SampleClock {
    /// Returns the time of the first sample after `t`.
    fn after(&self, t: f64) -> f64 {
        let s = self.sample_s;
        ((t + SAME_TIME) / s).floor() * s + s
    }

    fn is_due(&mut self, t: f64) -> bool {
        if t + SAME_TIME < self.next as f64 * self.sample_s {
            return false;
        }
        self.next = (t / self.sample_s + SAME_TIME).floor() as u64 + 1;
        true
    }
}

impl Plant {
    /// Returns the times at which a load begins, ends, jumps or has a kink (s), load by load.
    pub fn load_jumps(&self) -> impl Iterator<Item = f64> {
        self.loads.iter().flat_map(|load| load.wrench.jumps.iter().copied())
    }
}

/// Returns whether the load is discontinuous at `t`; otherwise it begins, ends or has a kink there.
fn jumps_at(load: &Load, t: f64) -> bool {
    let (before, after) = (load.wrench.at(t.next_down()).to_vector(), load.wrench.at(t.next_up()).to_vector());
    (after - before).amax() > 1e-9 * before.amax().max(after.amax())
}

/// Damping of an arm: matrix `D`, factors `tau`, and whether `D` is proportional to the stiffness.
pub(crate) type ArmDamping = (DMatrix<f64>, Vec<f64>, bool);

/// Returns the damping of the arm after each change of inertia: modal damping is recomputed with
/// the modes of the changed arm. If the arm has no static equilibrium with its new payload, the
/// previous damping is kept.
pub(crate) fn damping_after_changes(plant: &Plant) -> Vec<ArmDamping> {
    let mut changed = plant.clone();
    let damping = |change: &InertiaChange| {
        changed.model = Arc::new(changed.model.with_inertia(change.body, change.inertia));
        let mut renewed = changed.clone();
        if renewed.update_modes_and_damping().is_ok() {
            changed = renewed;
        }
        (changed.D.clone(), changed.tau.clone(), changed.proportional)
    };
    plant.inertia_changes.iter().map(damping).collect()
}
