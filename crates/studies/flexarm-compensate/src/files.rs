//! Files of a compensation: the new motion, the page, the recording of the arm before and after.
//!
//! [`Files::of`] checks all paths before anything is computed; [`Files::write`] writes all or none.

use std::path::PathBuf;
use std::sync::Arc;

use flexarm_files::{check_apart, check_free, write_all};
use flexarm_log::RecordingFormat;
use flexarm_settings::Place;

use super::program::{self, Corrected, ProgramFigures};
use super::{CompensateError, CompensateRequest, Compensation, MotionPair, SAMPLE_S, page};
use flexarm_run::motion_report::{check_motion_outputs, motion_texts};
use flexarm_run::{Arm, Error, Finding, Motion, Robot, Scenario};

/// Tolerance for the TCP position at corrected targets (m), for the rounding of written digits.
const WRITTEN_WITHIN_M: f64 = 1e-6;

/// Paths of all files.
pub(super) struct Files {
    /// New motion and page.
    folder: Option<[PathBuf; 2]>,
    recording: Option<PathBuf>,
    /// Program of the motion, and the output folder.
    program: Option<[PathBuf; 2]>,
}

impl Files {
    /// Checks the paths before anything is computed.
    pub(super) fn of(motion: &Motion, request: &CompensateRequest) -> Result<Self, Error> {
        check_motion_outputs(&request.motions)?;
        let in_folder = |name: &str| request.output.as_ref().map(|folder| folder.join(name));
        let folder = in_folder("compensated.csv").zip(in_folder("compensation.html")).map(|(csv, page)| [csv, page]);
        let recording =
            in_folder("compensation.rrd").filter(|_| RecordingFormat::Rrd.is_built_in() && request.recording);
        let program = request.output.as_ref().filter(|_| program::is_program(motion));
        let program = program.map(|folder| [motion.path.clone(), folder.clone()]);
        let own = program.iter().map(|[file, folder]| program::in_folder(folder, file));
        let mut all: Vec<PathBuf> =
            folder.iter().flatten().chain(&request.motions).chain(&recording).cloned().collect();
        all.extend(own);
        check_apart(&all, &[&motion.path])?;
        check_free(&all, request.overwrite)?;
        Ok(Self { folder, recording, program })
    }

    /// Corrects the program; a failure becomes a caveat.
    pub(super) fn program(
        &self,
        robot: &Robot,
        arm: &Arc<Arm>,
        scenario: &Scenario,
        request: &CompensateRequest,
        answer: &mut Compensation,
    ) -> Option<Corrected> {
        // A program that cannot be corrected leaves the motion as the result.
        let place = self.program.as_ref()?;
        let mut warn = |text: String, help: &str| {
            answer.caveats.push(Finding::warning("program", "compensation", text, help));
        };
        let (corrected, uncovered) = match program::corrected(robot, arm, scenario, request, place) {
            Ok(found) => found,
            Err(error) => {
                warn(format!("the program was not corrected: {error}"), "use the motion instead");
                return None;
            }
        };
        // Targets left as they are, a residual of the written text, effects between the targets.
        let ProgramFigures { targets, corrected: done, left, residual_m, .. } = &corrected.figures;
        if let (true, Some(first)) = (done < targets, left.first()) {
            let text = format!(
                "{} of {targets} targets of the program are unchanged, the first at {} ({}): {}",
                targets - done,
                Place::of_file(place[0].display()).line(first.line),
                first.statement,
                first.why
            );
            warn(text, "write targets as literals");
        }
        if *residual_m > WRITTEN_WITHIN_M {
            let text = format!("the corrected program misses a target by {:.4} mm", 1e3 * residual_m);
            warn(text, "a move depends on a target that was not corrected");
        }
        uncovered.into_iter().for_each(|text| warn(text, "use the motion instead if that matters"));
        Some(corrected)
    }

    /// Writes the files, and their names into the result.
    pub(super) fn write(
        &self,
        answer: &mut Compensation,
        arm: &Arc<Arm>,
        found: &MotionPair,
        program: Option<Corrected>,
        request: &CompensateRequest,
    ) -> Result<(), Error> {
        let shown = |path: &PathBuf| path.display().to_string();
        // Files of the corrected motion.
        let trajectory = answer.trajectory.clone();
        let mut files = motion_texts(&request.motions, &trajectory, 1.0 / SAMPLE_S)?;
        answer.files = request.motions.iter().map(shown).collect();
        answer.recording = self.recording.as_ref().map(shown);
        // Files of the corrected program.
        if let Some(Corrected { figures, files: texts }) = program {
            let names: Vec<PathBuf> = texts.iter().map(|(file, _)| file.clone()).collect();
            check_free(&names, request.overwrite)?;
            self.refuse_the_program_itself(&names)?;
            answer.program = Some(figures);
            files.extend(texts);
        }
        // Table and page in the folder of results.
        if let Some([csv, html]) = &self.folder {
            (answer.file, answer.page) = (Some(shown(csv)), Some(shown(html)));
            files.extend(motion_texts(std::slice::from_ref(csv), &trajectory, 1.0 / SAMPLE_S)?);
            files.push((html.clone(), page::html(answer).into_bytes()));
        }
        // Write all of them, then the recording, which needs runs.
        write_all(&files)?;
        if let Some(path) = &self.recording {
            super::recording::record(path, answer, arm, found, request)?;
        }
        Ok(())
    }

    /// Protects the original program, even if files may be overwritten.
    fn refuse_the_program_itself(&self, names: &[PathBuf]) -> Result<(), Error> {
        let Some([program, _]) = &self.program else { return Ok(()) };
        let home = program.parent().and_then(|folder| folder.canonicalize().ok());
        let lost = |name: &&PathBuf| home.is_some() && name.parent().and_then(|f| f.canonicalize().ok()) == home;
        match names.iter().find(lost) {
            Some(name) => {
                let what = "this is the program to be corrected: choose another output folder";
                Err(CompensateError::Input(format!("{}: {what}", name.display())).into())
            }
            None => Ok(()),
        }
    }
}
