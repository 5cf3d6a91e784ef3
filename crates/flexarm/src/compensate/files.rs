//! Files of a compensation: the new motion, the page, the recording of the arm before and after.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_analysis::{PathFrame, tcp_error};
use flexarm_files::{check_free, write_all};
use flexarm_log::{LogError, Recorder, RunHeader, RunResult, Sample, TwinSample};
use nalgebra::Vector3;

use super::program::{self, Corrected, ProgramFigures};
use super::{CompensateRequest, Compensation, Found, SAMPLE_S, page};
use crate::arm::Arm;
use crate::caveat::Caveat;
use crate::error::Error;
use crate::magnification::Expected;
use crate::motion::Motion;
use crate::motion_report::{check_motion_outputs, motion_texts};
use crate::options::RunOptions;
use crate::robot::Robot;
use crate::run::{Together, run_traced};
use crate::scenario::Scenario;

/// Samples of the recording per second.
const RECORDED_HZ: f64 = 200.0;
/// A corrected program meets its targets within the digits that are written (m).
const WRITTEN_WITHIN_M: f64 = 1e-6;

/// Where everything goes.
pub(super) struct Files {
    /// New motion and page.
    folder: Option<[PathBuf; 2]>,
    recording: Option<PathBuf>,
    /// The program of the motion, and the output folder.
    program: Option<[PathBuf; 2]>,
}

impl Files {
    /// Refuses names that cannot be written before anything is computed.
    pub(super) fn of(motion: &Motion, request: &CompensateRequest) -> Result<Self, Error> {
        check_motion_outputs(&request.motions)?;
        let in_folder = |name: &str| request.output.as_ref().map(|folder| folder.join(name));
        let folder = in_folder("compensated.csv").zip(in_folder("compensation.html")).map(|(csv, page)| [csv, page]);
        let recording = in_folder("compensation.rrd").filter(|_| cfg!(feature = "rerun") && request.recording);
        let program = request.output.as_ref().filter(|_| program::is_program(motion));
        let program = program.map(|folder| [motion.path.clone(), folder.clone()]);
        let own = program.iter().map(|[file, folder]| program::in_folder(folder, file));
        let mut all: Vec<PathBuf> =
            folder.iter().flatten().chain(&request.motions).chain(&recording).cloned().collect();
        all.extend(own);
        check_free(&all, request.overwrite)?;
        Ok(Self { folder, recording, program })
    }

    /// The corrected program; what keeps it from being made is a caveat.
    pub(super) fn program(
        &self,
        robot: &Robot,
        arm: &Arm,
        scenario: &Scenario,
        request: &CompensateRequest,
        answer: &mut Compensation,
    ) -> Option<Corrected> {
        let [path, folder] = self.program.as_ref()?;
        let mut said = |text: String, help: &str| {
            answer.caveats.push(Caveat::said("program", "compensation", text, help));
        };
        let corrected = match program::corrected(robot, arm, path, request, folder) {
            Ok(corrected) => corrected,
            Err(error) => {
                said(format!("the program was not corrected: {error}"), "use the motion instead");
                return None;
            }
        };
        let ProgramFigures { targets, corrected: done, left, residual_m, .. } = &corrected.figures;
        if let (true, Some(first)) = (done < targets, left.first()) {
            let text = format!(
                "{} of {targets} targets of the program stay as they were, the first in line {} ({}): {}",
                targets - done,
                first.line,
                first.statement,
                first.why
            );
            said(text, "write targets as literals");
        }
        if *residual_m > WRITTEN_WITHIN_M {
            let text = format!("the corrected program misses a target by {:.4} mm", 1e3 * residual_m);
            said(text, "a move depends on a target that was not corrected");
        }
        if !(scenario.loads.is_empty() && scenario.payloads.is_empty()) {
            said(
                "targets of the program are corrected for weight alone, without the loads".into(),
                "use the motion instead",
            );
        }
        Some(corrected)
    }

    /// Writes them, and their names into the answer.
    pub(super) fn write(
        &self,
        answer: &mut Compensation,
        arm: &Arm,
        found: &Found,
        program: Option<Corrected>,
        request: &CompensateRequest,
    ) -> Result<(), Error> {
        let shown = |path: &PathBuf| path.display().to_string();
        let trajectory = answer.trajectory.clone();
        let mut files = motion_texts(&request.motions, &trajectory, 1.0 / SAMPLE_S)?;
        answer.files = request.motions.iter().map(shown).collect();
        answer.recording = self.recording.as_ref().map(shown);
        if let Some(Corrected { figures, files: texts }) = program {
            let names: Vec<PathBuf> = texts.iter().map(|(file, _)| file.clone()).collect();
            check_free(&names, request.overwrite)?;
            self.refuse_the_program_itself(&names)?;
            answer.program = Some(figures);
            files.extend(texts);
        }
        if let Some([csv, html]) = &self.folder {
            (answer.file, answer.page) = (Some(shown(csv)), Some(shown(html)));
            files.extend(motion_texts(std::slice::from_ref(csv), &trajectory, 1.0 / SAMPLE_S)?);
            files.push((html.clone(), page::html(answer).into_bytes()));
        }
        write_all(&files)?;
        match &self.recording {
            Some(path) => record(path, answer, arm, found, request),
            None => Ok(()),
        }
    }

    /// Nobody loses the program that was corrected, whatever may be overwritten.
    fn refuse_the_program_itself(&self, names: &[PathBuf]) -> Result<(), Error> {
        let Some([program, _]) = &self.program else { return Ok(()) };
        let home = program.parent().and_then(|folder| folder.canonicalize().ok());
        let lost = |name: &&PathBuf| home.is_some() && name.parent().and_then(|f| f.canonicalize().ok()) == home;
        match names.iter().find(lost) {
            Some(name) => {
                let what = "this is the program that is corrected: choose another output folder".into();
                Err(Error::File { path: name.clone(), what })
            }
            None => Ok(()),
        }
    }
}

/// The arm before and after, over each other, beside the rigid arm on the motion that was asked for.
#[cfg(feature = "rerun")]
fn record(
    path: &Path,
    answer: &Compensation,
    arm: &Arm,
    found: &Found,
    request: &CompensateRequest,
) -> Result<(), Error> {
    let options = flexarm_log::CreateOptions::default().with_overwrite(request.overwrite);
    let study = flexarm_log::RrdStudy::create(path, options, vec!["before".into(), "after".into()]);
    let run = RunOptions {
        modelling: *arm.modelling(),
        log_rate_hz: RECORDED_HZ,
        ignore_limits: true,
        ..request.run.clone()
    };
    let wanted = Arc::new(Mutex::new(Vec::new()));
    let mut expected: Option<Expected> = None;
    for (number, motion) in [&found.scenario.motion, &found.motion].into_iter().enumerate() {
        let scenario = Scenario { motion: motion.clone(), ..found.scenario.clone() };
        let checked = crate::prepare::checked(arm.robot(), &scenario, &run, None)?;
        let expected = *expected.get_or_insert_with(|| checked.expected(&scenario));
        let recorder = Against::new(Box::new(study.seat(number)), wanted.clone(), number == 0);
        let together =
            Together { recorders: vec![Box::new(recorder)], expected: Some(expected), ..Together::default() };
        run_traced(arm.robot(), &scenario, &run, None, together, &mut |_, _| ControlFlow::Continue(()))?;
    }
    let mm = |x: f64| 1e3 * x;
    study.finish(&format!(
        "# {} on {}\n\nDistance of the tool from where the rigid arm has it on the motion that was asked for.\n\n\
         | | peak | RMS | at the end |\n| --- | --- | --- | --- |\n\
         | before | {:.4} mm | {:.4} mm | {:.4} mm |\n| after | {:.4} mm | {:.4} mm | {:.4} mm |\n",
        answer.motion,
        answer.robot,
        mm(answer.before.peak_m),
        mm(answer.before.rms_m),
        mm(answer.before.end_m),
        mm(answer.after.peak_m),
        mm(answer.after.rms_m),
        mm(answer.after.end_m)
    ))?;
    Ok(())
}

#[cfg(not(feature = "rerun"))]
fn record(_: &Path, _: &Compensation, _: &Arm, _: &Found, _: &CompensateRequest) -> Result<(), Error> {
    Ok(())
}

/// A recorder that shows the rigid arm of the first run in all runs, and errors from it: new commands move the rigid arm as
/// well, and that is not where the tool should be.
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

    /// The rigid arm as it should be, and the tool against it.
    fn changed(&mut self, sample: &Sample) -> Sample {
        let wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
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
        // Figures of the later runs are about where their own commands have the rigid arm.
        if self.first { self.inner.finish(result) } else { self.inner.finish(&RunResult::default()) }
    }

    fn path(&self) -> &Path {
        self.inner.path()
    }
}
