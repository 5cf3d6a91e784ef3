//! Recording of an arm before and after its compensation.
//!
//! Start at [`record`]. Both runs are drawn against the rigid arm of the requested motion
//! ([`Against`]).

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_analysis::{PathFrame, tcp_error};
use flexarm_log::{LogError, Recorder, RunHeader, RunResult, Sample, TwinSample};
use nalgebra::Vector3;

use super::{CompensateRequest, Compensation, MotionPair};
use flexarm_run::{Arm, Error, Keep, RunOptions, RunRequest, Scenario};
use flexarm_settings::written::markdown;

/// Sampling rate of the recording (Hz).
const RECORDED_HZ: f64 = 200.0;

/// Records the arm before and after, drawn over each other, and the rigid arm on the requested
/// motion. Without a writer of recordings does nothing.
pub(super) fn record(
    path: &Path,
    answer: &Compensation,
    arm: &Arc<Arm>,
    found: &MotionPair,
    request: &CompensateRequest,
) -> Result<(), Error> {
    // One recorder per run; the first stores the rigid arm for both.
    let options = flexarm_log::CreateOptions::default().with_overwrite(request.overwrite);
    let labels = vec!["before".into(), "after".into()];
    let Some(study) = flexarm_log::study_recorder(path, options, labels) else { return Ok(()) };
    let run = RunOptions { log_rate_hz: RECORDED_HZ, ignore_limits: true, ..request.run.clone() };
    let wanted = Arc::new(Mutex::new(Vec::new()));
    let expected = arm.expected(&found.scenario, &run)?;
    for (number, motion) in [&found.scenario.motion, &found.motion].into_iter().enumerate() {
        let scenario = Scenario { motion: motion.clone(), ..found.scenario.clone() };
        let recorder = Against::new(study.recorder(number), wanted.clone(), number == 0);
        let request = RunRequest {
            recorders: vec![Box::new(recorder)],
            expected: Some(expected),
            ..RunRequest::keeping(Keep::Figures)
        };
        arm.simulate_with(&scenario, &run, request)?;
    }
    let mm = |x: f64| 1e3 * x;
    study.finish(&format!(
        "# {} on {}\n\nDistance of the TCP from that of the rigid arm on the requested motion.\n\n\
         | | peak | RMS | at the end |\n| --- | --- | --- | --- |\n\
         | before | {:.4} mm | {:.4} mm | {:.4} mm |\n| after | {:.4} mm | {:.4} mm | {:.4} mm |\n",
        markdown(&answer.motion),
        markdown(&answer.robot),
        mm(answer.before.peak_m),
        mm(answer.before.rms_m),
        mm(answer.before.end_m),
        mm(answer.after.peak_m),
        mm(answer.after.rms_m),
        mm(answer.after.end_m)
    ))?;
    Ok(())
}

/// A recorder that replaces the rigid arm of each run by that of the first, and the errors
/// accordingly: new commands also move the rigid arm, which is then not at the desired pose.
struct Against {
    inner: Box<dyn Recorder>,
    wanted: Arc<Mutex<Vec<TwinSample>>>,
    first: bool,
    at: usize,
    frame: Option<PathFrame>,
    interval_s: f64,
}

impl Against {
    fn new(inner: Box<dyn Recorder>, wanted: Arc<Mutex<Vec<TwinSample>>>, first: bool) -> Self {
        Self { inner, wanted, first, at: 0, frame: None, interval_s: 1.0 / RECORDED_HZ }
    }

    /// Returns the sample with the desired rigid arm, and with the error of the flexible TCP from
    /// it.
    fn changed(&mut self, sample: &Sample) -> Sample {
        let wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        // Desired positions and their central differences; the first frame looks ahead to the first
        // bend.
        let place = |k: usize| wanted[k.min(wanted.len() - 1)].X_WT.translation.vector;
        let speed = |k: usize| (place(k + 1) - place(k.saturating_sub(1))) / (2.0 * self.interval_s);
        let frame = self.frame.unwrap_or_else(|| {
            PathFrame::before((0..wanted.len()).map(|k| {
                let bend = place(k + 1) - 2.0 * place(k) + place(k.saturating_sub(1));
                [speed(k), bend / (self.interval_s * self.interval_s)]
            }))
        });
        let frame = frame.next(&speed(self.at));
        self.frame = Some(frame);
        // Error in the world, and along tangent, normal and binormal.
        let rigid = wanted[self.at.min(wanted.len() - 1)].clone();
        let [x, y, z, rx, ry, rz] = tcp_error(&rigid.X_WT, &sample.flexible.X_WT);
        let [along, normal, binormal] = frame.components(&Vector3::new(x, y, z));
        let [r_along, r_normal, r_binormal] = frame.components(&Vector3::new(rx, ry, rz));
        Sample {
            error_world: [x, y, z, rx, ry, rz],
            error_path: [along, normal, binormal, r_along, r_normal, r_binormal],
            static_m: [f64::NAN; 3],
            rigid,
            ..sample.clone()
        }
    }
}

impl Recorder for Against {
    fn check(&self) -> Result<(), LogError> {
        self.inner.check()
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        self.interval_s = 1.0 / header.log_rate_hz;
        self.inner.begin(header)
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        if self.first {
            self.wanted.lock().unwrap_or_else(PoisonError::into_inner).push(sample.rigid.clone());
            return self.inner.record(sample);
        }
        let changed = self.changed(sample);
        self.at += 1;
        self.inner.record(&changed)
    }

    fn finish(&mut self, result: &RunResult) -> Result<(), LogError> {
        // The figures of later runs refer to the rigid arm under their own commands, so they are
        // left out.
        if self.first { self.inner.finish(result) } else { self.inner.finish(&RunResult::default()) }
    }

    fn path(&self) -> &Path {
        self.inner.path()
    }
}
