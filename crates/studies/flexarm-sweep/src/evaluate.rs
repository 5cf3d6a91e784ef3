//! Evaluation of the metrics of some runs of a study.
//!
//! If the metrics only need the tool deflection, its time, and the frequencies at the start, four
//! runs are computed together ([`flexarm_stepping::Batch`]); otherwise each run has its full
//! summary. The choice depends only on the metrics of the study.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use flexarm_stepping::{Batch, BatchRun, Start, ToolDeflection};

use super::Sweep;
use super::metric::{self, Facts, Quick, SummaryFacts};
use super::run_caveats::{CaveatText, stored_caveats};
use super::value::ParameterValue;
use super::workshop::PreparedRun;
use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::run::BeforeRun;
use flexarm_run::run::static_sag;
use flexarm_run::run::steps_per_sample;
use flexarm_run::{Keep, RunOptions, RunRequest};

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

/// Values of the metrics, and relative violation of each constraint.
pub(super) type MetricValues = (Vec<f64>, Vec<f64>);

/// Callback with the index of the point, the result of its run, and the caveats.
pub(super) type OnResult<'a> = dyn FnMut(usize, Result<MetricValues, Error>, CaveatText) + 'a;

/// Run without a full summary.
struct QuickRun {
    place: usize,
    stored: CaveatText,
    run: BatchRun,
    tool: flexarm_kinematics::Frame,
    start: Start,
    options: RunOptions,
    facts: QuickFacts,
    flexible: Arc<flexarm_run::FlexibleRobot>,
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
        let points: Vec<(usize, Vec<ParameterValue>)> =
            runs.iter().map(|run| (*run, self.design.values(*run))).collect();
        self.evaluate_points(&points, stop, &mut |place, result, stored| {
            let result = result.map(|(metrics, _)| metrics).map_err(|error| self.workshop.reason(&error));
            on_result(Answer { run: points[place].0, result, stored });
        });
    }

    /// Computes runs with given parameter values; calls `on_result` with their metrics and their
    /// violation of each constraint of the study.
    pub(super) fn evaluate_points(
        &self,
        points: &[(usize, Vec<ParameterValue>)],
        stop: &AtomicBool,
        on_result: &mut OnResult<'_>,
    ) {
        if self.quick {
            return self.evaluate_quickly(points, stop, on_result);
        }
        for (place, (_, values)) in points.iter().enumerate() {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let mut caveats = Vec::new();
            match self.whole(values, stop, &mut caveats) {
                Err(Error::Interrupted { .. }) => return,
                result => {
                    let result = result.map(|facts| self.metric_values(values, &facts));
                    on_result(place, result, self.stored_caveats(caveats));
                }
            }
        }
    }

    fn metric_values(&self, point: &[ParameterValue], facts: &dyn Facts) -> MetricValues {
        let values = metric::values(&self.metrics, point, facts);
        let passed = self.constraints.iter().map(|c| c.violation(point, &values, facts)).collect();
        (values, passed)
    }

    /// Computes runs without full summaries, those that go together side by side.
    fn evaluate_quickly(
        &self,
        points: &[(usize, Vec<ParameterValue>)],
        stop: &AtomicBool,
        on_result: &mut OnResult<'_>,
    ) {
        let mut going: Vec<QuickRun> = Vec::new();
        for (place, (_, values)) in points.iter().enumerate() {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let mut caveats = Vec::new();
            let run = self.quick_run(place, values, &mut caveats);
            let stored = self.stored_caveats(caveats);
            match run {
                Ok(run) => going.push(QuickRun { stored, ..run }),
                Err(error) => on_result(place, Err(error), stored),
            }
        }
        // Runs of similar duration are computed together.
        going.sort_by(|a, b| a.run.duration_s.total_cmp(&b.run.duration_s).then(a.place.cmp(&b.place)));
        for group in going.chunk_by(QuickRun::goes_with) {
            for few in group.chunks(Batch::most_side_by_side()) {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let Some(first) = few.first() else { continue };
                let batch = Batch {
                    step_s: first.options.step_s,
                    stepper: first.options.stepper,
                    start: first.start,
                    tool: first.tool.clone(),
                    keep_samples: true,
                };
                let runs: Vec<BatchRun> = few.iter().map(|run| run.run.clone()).collect();
                for (own, result) in few.iter().zip(batch.run(&runs)) {
                    let result = result.map_err(|error| own.flexible.explained(error));
                    let facts = result.map(|deflection| own.facts.clone().of(&deflection, &own.options));
                    let result = facts.map(|facts| self.metric_values(&points[own.place].1, &facts));
                    on_result(own.place, result, own.stored.clone());
                }
            }
        }
    }

    /// Returns the caveats of a run in their stored form.
    fn stored_caveats(&self, caveats: Vec<Caveat>) -> CaveatText {
        stored_caveats(caveats, &|text| self.workshop.plain(text))
    }

    /// Computes a run with its full summary. `caveats` receives its caveats, also if it fails.
    fn whole(
        &self,
        values: &[ParameterValue],
        stop: &AtomicBool,
        caveats: &mut Vec<Caveat>,
    ) -> Result<SummaryFacts, Error> {
        let PreparedRun { built, scenario, options } = self.workshop.ready(values)?;
        caveats.extend_from_slice(&built.arm.robot_caveats());
        let mut go_on =
            |_, _| if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let request = RunRequest { progress: Some(&mut go_on), ..RunRequest::keeping(Keep::Figures) };
        let summary = built.arm.simulate_with(&scenario, &options, request)?.summary;
        caveats.clone_from(&summary.caveats);
        let summary = serde_json::to_value(&summary).unwrap_or_default();
        Ok(SummaryFacts { summary, mass_kg: built.mass_kg })
    }

    /// Prepares a run to be computed together with others. `caveats` receives the caveats known
    /// before its first step, also if it fails.
    fn quick_run(&self, place: usize, values: &[ParameterValue], caveats: &mut Vec<Caveat>) -> Result<QuickRun, Error> {
        let PreparedRun { built, scenario, options } = self.workshop.ready(values)?;
        caveats.extend_from_slice(&built.arm.robot_caveats());
        let flexible = built.arm.flexible().clone();
        let (arm, of_loads) = built.arm.at_start(&scenario, &options)?;
        let facts = QuickFacts {
            sag_m: static_sag(&arm, &flexible.tcp),
            hz: arm.modes.frequencies_hz(),
            mass_kg: built.mass_kg,
            ..QuickFacts::default()
        };
        let before = BeforeRun {
            robot: built.arm.robot(),
            flexible: &flexible,
            arm: &arm,
            motion: &scenario.motion,
            options: &options,
        };
        caveats.extend(before.caveats_of_study(facts.sag_m));
        caveats.extend(of_loads);
        let run = BatchRun { arm, duration_s: scenario.duration_s() };
        let (tool, start) = (flexible.tcp.clone(), scenario.start);
        Ok(QuickRun { place, stored: None, run, tool, start, options, facts, flexible })
    }
}

impl QuickRun {
    /// Whether two runs have the same stepper, step size, start and tool.
    fn goes_with(&self, other: &Self) -> bool {
        self.options.stepper == other.options.stepper
            && self.options.step_s == other.options.step_s
            && self.start == other.start
            && self.tool.body == other.tool.body
            && self.tool.X_BF == other.tool.X_BF
    }
}
