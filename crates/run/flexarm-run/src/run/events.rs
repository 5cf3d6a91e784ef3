//! Events of a run, for recordings and reports.
//!
//! Start at `RunLoop::events`; times in s. Not here: caveats about the result (`figures`).

use flexarm_analysis::TcpMetrics;
use flexarm_log::{Event, EventKind};
use flexarm_stepping::StepError;

use super::RunLoop;
use crate::caveat::{Finding, kinds};
use crate::error::Error;

impl RunLoop<'_> {
    /// Returns the events up to the end of the run, ordered by time.
    pub(super) fn events(&self, metrics: Option<&TcpMetrics>) -> Vec<Event> {
        let mut events = Vec::new();
        let mut add = |time_s: f64, kind: EventKind, text: String| events.push(Event { time_s, kind, text });
        for (k, m) in self.motion.trajectory.moves().iter().enumerate() {
            add(m.start, EventKind::MoveStart, format!("move {} begins", k + 1));
            add(m.end, EventKind::MoveEnd, format!("move {} ends", k + 1));
        }
        if let Some(metrics) = metrics {
            add(metrics.t_peak_s, EventKind::Peak, format!("peak TCP error: {:.3} mm", 1e3 * metrics.peak_m));
            for hold in &metrics.holds {
                if let Some(settling) = hold.settling_s {
                    let band = 1e3 * self.options.settling_band_m;
                    let text = format!("settled to within {band} mm, {settling:.3} s after the move");
                    add(hold.start_s + settling, EventKind::Settled, text);
                }
            }
        }
        for v in &self.motion.violations {
            add(v.since_s, EventKind::Limit, v.warning().message);
        }
        for (c, load) in self.arm.model.coordinates().iter().zip(self.monitors.drive_loads.result()) {
            if let Some(since) = load.over_since_s {
                let (limit, unit) = (c.limits.effort, c.effort_unit());
                let text = format!("joint {:?} needs more than its limit of {limit:.0} {unit}", c.joint);
                add(since, EventKind::Limit, text);
            }
        }
        let mut jumps: Vec<f64> = self.plant.load_jumps().collect();
        jumps.sort_by(f64::total_cmp);
        jumps.dedup();
        // Tables and milling loads have a kink at every row; a list of those is of no use.
        const MAX_JUMPS: usize = 20;
        for t in jumps.iter().take(if jumps.len() <= MAX_JUMPS { MAX_JUMPS } else { 1 }) {
            add(*t, EventKind::Load, "an external load changes".into());
        }
        for change in &self.plant.inertia_changes {
            add(change.t, EventKind::Load, "the payload changes".into());
        }
        let reached = self.monitors.tool.result().last_time_s().unwrap_or(0.0);
        events.retain(|event| event.time_s <= reached + 1e-9);
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s).then(a.kind.cmp(&b.kind)));
        events
    }
}

/// Blames the model of a link instead of the step for an iteration that failed while the link was
/// deflected beyond its model.
pub(super) fn beyond_model(error: Error, caveats: &[Finding]) -> Error {
    let of_shape =
        |caveat: &&Finding| [kinds::LARGE_DEFORMATION.code, kinds::LARGE_STRAIN.code].contains(&&*caveat.code);
    match (error, caveats.iter().find(of_shape)) {
        (Error::Step { source: StepError::NotConverged { t, .. }, partial }, Some(caveat)) => {
            Error::Step { source: StepError::BeyondModel { t, finding: caveat.message.clone() }, partial }
        }
        (error, _) => error,
    }
}
