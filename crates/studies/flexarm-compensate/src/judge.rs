//! Evaluation of commands on a plant: the model itself, another robot, or perturbed plants.
//!
//! The commands are found on the model and judged on plants that differ from it: [`Judge`],
//! [`sweep`].

use std::sync::Arc;

use flexarm_flexlink::GearStiffness;
use flexarm_trajectory::Extreme;
use rayon::prelude::*;

use super::job::{Job, RunResult, distances};
use super::{CompensateError, CompensateRequest, ErrorFigures, PlantFigures};
use flexarm_run::{Arm, DriveModel, Error, LinkModel, Modelling, Motion, Robot, RunOptions};

/// Result of commands on a plant.
pub(super) struct PlantResult {
    pub(super) figures: ErrorFigures,
    /// Distance between flexible and desired TCP at each sample (m).
    pub(super) distance: Vec<f64>,
    /// Maximum torque or force of each drive.
    pub(super) efforts: Vec<Extreme>,
}

/// A plant on which commands are evaluated.
pub(super) struct Judge {
    pub(super) arm: Arc<Arm>,
    pub(super) run: RunOptions,
}

impl Judge {
    /// Returns the plant of the request, which must have the same joints, or the arm itself.
    pub(super) fn of(request: &CompensateRequest, arm: &Arc<Arm>) -> Result<Self, Error> {
        let Some((_, plant)) = &request.plant else {
            return Ok(Self { arm: arm.clone(), run: request.run.clone() });
        };
        let judge = Self { arm: plant.model(&Modelling::default())?, run: request.run.clone() };
        let names = |arm: &Arc<Arm>| arm.joints().map(str::to_owned).collect::<Vec<_>>();
        let (found, expected) = (names(&judge.arm), names(arm));
        if found != expected {
            return Err(CompensateError::Input(format!(
                "the plant has the joints {found:?}, the robot {expected:?}: they must be the same"
            ))
            .into());
        }
        Ok(judge)
    }

    /// Runs a motion on the plant; errors are measured from the poses that the job desires.
    pub(super) fn figures(&self, job: &Job<'_>, motion: &Motion) -> Result<PlantResult, Error> {
        let RunResult { error, efforts } = job.simulated(&self.arm, &self.run, motion)?;
        let distance = distances(&error);
        let turns = error.column_iter().map(|e| e.rows(3, 3).norm()).fold(0.0, f64::max);
        let figures = ErrorFigures {
            peak_m: distance.iter().copied().fold(0.0, f64::max),
            rms_m: (distance.iter().map(|d| d * d).sum::<f64>() / distance.len() as f64).sqrt(),
            peak_rad: turns,
            end_m: distance.last().copied().unwrap_or(0.0),
        };
        Ok(PlantResult { figures, distance, efforts })
    }
}

/// Returns the robot with all stiffness and damping scaled by the given factors.
fn changed(robot: &Robot, stiffness: f64, damping: f64) -> Robot {
    let mut changed = robot.clone();
    for drive in &mut changed.drives {
        if let Some((gearbox, gear)) = &mut drive.gearbox {
            gearbox.stiffness = match &gearbox.stiffness {
                GearStiffness::Axis(k) => GearStiffness::Axis(stiffness * k),
                GearStiffness::Tilting(k) => GearStiffness::Tilting(k.map(|k| stiffness * k)),
                GearStiffness::Full(K) => GearStiffness::Full(K * stiffness),
                GearStiffness::Separate(k) => GearStiffness::Separate(k.map(|k| stiffness * k)),
                GearStiffness::Guide(tubes) => GearStiffness::Guide(tubes.clone()),
            };
            gear.tilts.iter_mut().for_each(|tilt| tilt.compliance = tilt.compliance.map(|c| c / stiffness));
            gear.curves.iter_mut().flatten().for_each(|curve| *curve = curve.scaled(stiffness));
            gear.dampers = gear.dampers.as_ref().map(|d| d.iter().map(|d| damping * d).collect());
        }
    }
    for link in &mut changed.flexible_links {
        link.stiffness_factor *= stiffness;
        link.damping = link.damping.scaled(damping);
    }
    changed
}

/// Evaluates the commands on perturbed plants.
pub(super) fn sweep(
    robot: &Robot,
    request: &CompensateRequest,
    job: &Job<'_>,
    arm: &Arc<Arm>,
    found: &Motion,
) -> Result<Vec<PlantFigures>, Error> {
    let modelling = request.modelling;
    let mut plants: Vec<(String, Robot, Modelling)> = vec![
        ("stiffness 30 % lower".into(), changed(robot, 0.7, 1.0), modelling),
        ("stiffness 30 % higher".into(), changed(robot, 1.3, 1.0), modelling),
        ("damping halved".into(), changed(robot, 1.0, 0.5), modelling),
    ];
    // Without one kind of springs, where there are both.
    let links = !arm.spans.is_empty();
    if links && arm.springs.len() > arm.spans.len() {
        plants.push(("only drives elastic".into(), robot.clone(), Modelling { links: LinkModel::Rigid, ..modelling }));
        plants.push((
            "only links flexible".into(),
            robot.clone(),
            Modelling { drives: DriveModel::Rigid, ..modelling },
        ));
    }
    let as_it_is = job.as_it_is()?;
    let judged = plants.into_par_iter().map(|(plant, robot, modelling)| {
        let judge = Judge { arm: robot.model(&modelling)?, run: request.run.clone() };
        let (before, after) = (judge.figures(job, &as_it_is)?.figures, judge.figures(job, found)?.figures);
        Ok(PlantFigures { plant, before, after })
    });
    judged.collect()
}
