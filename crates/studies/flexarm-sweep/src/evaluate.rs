//! Evaluation of the metrics of some runs of a study.
//!
//! If the metrics only need the tool deflection, its time, and the frequencies at the start, nothing
//! else is computed ([`flexarm_stepping::ToolRun`]); otherwise each run has its full summary. The
//! choice depends only on the metrics of the study.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use flexarm_stepping::{ToolDeflection, ToolRun};

use super::Sweep;
use super::metric::{self, Facts, Quick, SummaryFacts};
use super::run_caveats::{CaveatText, stored_caveats};
use super::value::ParameterValue;
use super::workshop::PreparedRun;
use flexarm_run::run::{BeforeRun, static_sag, steps_per_sample};
use flexarm_run::{Error, Finding, Keep, RunOptions, RunRequest};

/// Result of a run.
#[derive(Clone, Debug, PartialEq)]
#[doc(hidden)]
pub struct Answer {
    pub run: usize,
    /// Values of the metrics, or the reason of the failure.
    pub result: Result<Vec<f64>, String>,
    /// Caveats.
    pub stored: CaveatText,
}

/// Numbers of a run without a full summary.
#[derive(Clone, Debug, Default)]
struct QuickFacts {
    peak_m: f64,
    t_peak_s: f64,
    rms_m: f64,
    end_m: f64,
    sag_m: f64,
    duration_s: f64,
    hz: Vec<f64>,
    mass_kg: f64,
}

impl Facts for QuickFacts {
    fn number(&self, _: &[String], quick: Option<Quick>) -> f64 {
        match quick {
            Some(Quick::Peak) => self.peak_m,
            Some(Quick::PeakTime) => self.t_peak_s,
            Some(Quick::Rms) => self.rms_m,
            Some(Quick::End) => self.end_m,
            Some(Quick::Sag) => self.sag_m,
            Some(Quick::Duration) => self.duration_s,
            Some(Quick::Frequency(number)) => self.hz.get(number).copied().unwrap_or(f64::NAN),
            Some(Quick::Mass) => self.mass_kg,
            None => f64::NAN,
        }
    }
}

impl QuickFacts {
    /// Adds the figures of the samples that a run would log, with the same sums as its summary.
    fn of(self, deflection: &ToolDeflection, options: &RunOptions) -> Self {
        let every = steps_per_sample(options);
        let mut facts = Self { duration_s: deflection.steps as f64 * options.step_s, ..self };
        let (mut area, mut before) = (0.0, None::<(f64, f64)>);
        for (step, error) in deflection.samples_m.iter().enumerate() {
            if !(step as u64).is_multiple_of(every) && step as u64 != deflection.steps {
                continue;
            }
            let (t, square) = (step as f64 * options.step_s, error.iter().map(|x| x * x).sum::<f64>());
            let size = square.sqrt();
            if before.is_none() || size > facts.peak_m {
                (facts.peak_m, facts.t_peak_s) = (size, t);
            }
            if let Some((last, other)) = before {
                area += 0.5 * (other + square) * (t - last);
            }
            (before, facts.end_m) = (Some((t, square)), size);
        }
        facts.rms_m = if facts.duration_s > 0.0 { (area / facts.duration_s).sqrt() } else { facts.end_m };
        facts
    }
}

impl Sweep {
    /// Computes some runs, one group after the other; calls `on_result` with each result.
    pub(super) fn evaluate(&self, runs: &[usize], stop: &AtomicBool, on_result: &mut dyn FnMut(Answer)) {
        for &run in runs {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let (values, mut caveats) = (self.design.values(run), Vec::new());
            let result = if self.quick {
                self.quickly(&values, &mut caveats).map(|facts| metric::values(&self.metrics, &values, &facts))
            } else {
                self.whole(&values, stop, &mut caveats).map(|facts| metric::values(&self.metrics, &values, &facts))
            };
            if matches!(result, Err(Error::Interrupted { .. })) {
                return;
            }
            let result = result.map_err(|error| self.workshop.reason(&error));
            on_result(Answer { run, result, stored: stored_caveats(caveats, &|text| self.workshop.plain(text)) });
        }
    }

    /// Computes a run with its full summary. `caveats` receives its caveats, also if it fails.
    fn whole(
        &self,
        values: &[ParameterValue],
        stop: &AtomicBool,
        caveats: &mut Vec<Finding>,
    ) -> Result<SummaryFacts, Error> {
        let PreparedRun { built, scenario, options } = self.workshop.ready(values)?;
        caveats.extend_from_slice(built.arm.robot_caveats());
        let mut go_on =
            |_, _| if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let request = RunRequest { progress: Some(&mut go_on), ..RunRequest::keeping(Keep::Figures) };
        let summary = built.arm.simulate_with(&scenario, &options, request)?.summary;
        caveats.clone_from(&summary.caveats);
        let summary = serde_json::to_value(&summary).unwrap_or_default();
        Ok(SummaryFacts { summary, mass_kg: built.mass_kg })
    }

    /// Computes a run without a full summary. `caveats` receives the caveats known before its first
    /// step, also if it fails.
    fn quickly(&self, values: &[ParameterValue], caveats: &mut Vec<Finding>) -> Result<QuickFacts, Error> {
        let PreparedRun { built, scenario, options } = self.workshop.ready(values)?;
        caveats.extend_from_slice(built.arm.robot_caveats());
        let arm = &*built.arm;
        let (plant, of_loads) = arm.at_start(&scenario, &options)?;
        let facts = QuickFacts {
            sag_m: static_sag(&plant, &arm.tcp),
            hz: plant.modes.frequencies_hz(),
            mass_kg: built.mass_kg,
            ..QuickFacts::default()
        };
        // Caveats about the start, then the run itself.
        let before = BeforeRun { arm, plant: &plant, motion: &scenario.motion, options: &options };
        caveats.extend(before.caveats_of_study(facts.sag_m));
        caveats.extend(of_loads);
        let run = ToolRun {
            step_s: options.step_s,
            duration_s: scenario.duration_s(),
            stepper: options.stepper,
            start: scenario.start,
            tool: arm.tcp.clone(),
            keep_samples: true,
        };
        let deflection = run.deflection(&Arc::new(plant)).map_err(|error| arm.explained(error))?;
        Ok(facts.of(&deflection, &options))
    }
}
