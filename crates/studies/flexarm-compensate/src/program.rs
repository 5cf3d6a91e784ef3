//! Correction of the targets of a robot program for the static deflection of the arm: the same
//! statements with other numbers.
//!
//! The controller assumes a rigid arm. Each literal target is replaced by the one for which the
//! flexible TCP is at the original target, under the mean of the loads during the rest there. The
//! written program is read again and checked against the static equilibria.
//!
//! Not here: reading and writing of programs (`flexarm-programs`), dynamic errors (`job.rs`).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_kinematics::{
    Data, Frame, IkError, IkOptions, Pose, Wrench, forward_kinematics, inverse_kinematics, rotation_vector,
};
use flexarm_path::program::{Item, Move, MoveKind, Target};
use flexarm_path::{PathOptions, ProgramArm, base_of, target_at, target_joints, tool_of};
use flexarm_programs::{NewTarget, ProgramText};
use flexarm_settings::Place;
use flexarm_stepping::{Held, InertiaChange, Plant, StepError, TargetError, linearise, static_targets};
use nalgebra::{DVector, Translation3, Vector3, Vector6};
use rayon::prelude::*;
use serde::Serialize;

use super::job::averaged;
use super::{CompensateError, CompensateRequest};
use flexarm_run::tool_path::{Cell, Overrides, program_text};
use flexarm_run::{AppliedLoad, Arm, Error, Motion, Robot, Scenario};

/// Name of the program's folder within the output folder.
pub(super) const FOLDER: &str = "program";
/// Maximum number of uncorrected moves listed.
const NAMED: usize = 20;

/// Number of times per rest at which loads are sampled.
const SAMPLES: u32 = 200;
/// Deviation of a load from its mean during a rest, relative to its maximum, above which it is
/// reported.
const CHANGES: f64 = 0.1;

/// Figures of the correction of a robot program.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ProgramFigures {
    /// Paths of the corrected program and of the changed data lists.
    pub files: Vec<String>,
    /// Number of targets at the ends of moves; dwells and arcs given by an angle have none.
    pub targets: usize,
    /// Number of targets replaced.
    pub corrected: usize,
    /// Number of targets at which loads act or the payload differs from that at the start.
    pub loaded: usize,
    /// Maximum distance of the flexible TCP from its target at rest, with the original program (m).
    pub before_m: f64,
    /// Maximum distance at the replaced targets, with the written program read again (m).
    pub residual_m: f64,
    /// Maximum rotation there (rad).
    pub residual_rad: f64,
    /// Targets left unchanged; at most the first 20.
    pub left: Vec<LeftTarget>,
}

/// A target left unchanged.
#[derive(Clone, Debug, Serialize)]
pub struct LeftTarget {
    /// Line of the move.
    pub line: usize,
    /// Statement of the move.
    pub statement: String,
    /// Reason.
    pub why: String,
    /// Distance of the flexible TCP from its target at rest (m).
    pub residual_m: f64,
}

/// A corrected program before it is written.
pub(super) struct Corrected {
    pub(super) figures: ProgramFigures,
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
}

/// Reason why a target cannot be corrected or judged.
#[derive(Debug, thiserror::Error)]
enum NoCorrection {
    #[error(transparent)]
    Target(#[from] TargetError),
    #[error(transparent)]
    Step(#[from] StepError),
    #[error("its auxiliary point is not reached: {0}")]
    AuxiliaryPoint(IkError),
    #[error("the corrected program has different moves")]
    OtherMoves,
}

/// Whether a motion was read from a program with replaceable targets.
pub(super) fn is_program(motion: &Motion) -> bool {
    ["KRL", "RAPID"]
        .iter()
        .any(|language| motion.format.starts_with("robot program") && motion.format.contains(language))
}

/// A program as interpreted by its controller.
struct Understood {
    text: ProgramText,
    /// Joint positions at the target of each item.
    places: Vec<Option<DVector<f64>>>,
}

/// A move with a target, and the times at which the arm is there.
struct Stop<'a> {
    /// Index of its item.
    item: usize,
    of: &'a Move,
    q: &'a DVector<f64>,
    /// From arrival until the start of the next move (s); a single time if the TCP passes without
    /// stopping.
    rest_s: [f64; 2],
}

/// Returns the program of a motion with corrected targets, and sentences about what it does not
/// cover.
///
/// * `[path, folder]`: the program, and the output folder.
pub(super) fn corrected(
    robot: &Robot,
    arm: &Arc<Arm>,
    scenario: &Scenario,
    request: &CompensateRequest,
    [path, folder]: &[PathBuf; 2],
) -> Result<(Corrected, Vec<String>), Error> {
    // The program as its controller runs it: a rigid arm, the joints at each target, the rests there.
    let model = robot.rigid_model()?;
    let cell = Cell { model: &model, tcp_link: Some(&robot.tcp.0), hold: &robot.hold, controller: &robot.controller };
    let (mut controller, _) = cell.arm(&Overrides::default());
    controller.controller = cell.controller_axes(&controller.axes);
    let understood = |bytes: &[u8], others: Vec<(PathBuf, Vec<u8>)>| -> Result<Understood, Error> {
        let text = program_text(path, bytes, &controller, others)?;
        let places = target_joints(&text.program, &controller, &PathOptions::default());
        let failed = |finding| Error::Path { finding, notes: Vec::new() };
        Ok(Understood { places: places.map_err(failed)?, text })
    };
    let old = understood(&flexarm_trajectory::bytes_of_file(path)?, Vec::new())?;
    let stops = stops(&old, scenario);
    let rests = stops.iter().map(|stop| stop.rest_s).collect();
    let rest = AtRest::new(arm, &controller, scenario, request, rests)?;

    // New values of the targets, and the text with them.
    let found: Vec<Result<TargetValues, NoCorrection>> = stops.par_iter().map(|stop| rest.target(stop)).collect();
    let mut left: Vec<(usize, String)> = Vec::new();
    let mut targets = Vec::new();
    for (stop, found) in stops.iter().zip(found) {
        match found {
            Ok((target, via)) => targets.push((stop.item, target, via)),
            Err(why) => left.push((stop.item, why.to_string())),
        }
    }
    let loaded = if rest.is_loaded() { " under the loads at each target" } else { "" };
    let name = plain(&robot.name);
    let comment = format!("targets corrected by flexarm for {name}: static deflection{loaded}");
    let rewritten = old.text.rewritten(&targets, &comment);
    left.extend(rewritten.left.iter().map(|(k, why)| (*k, (*why).to_owned())));

    // Interpret the written text as the controller will.
    let [(_, main), others @ ..] = &rewritten.files[..] else {
        return Err(CompensateError::Input(format!("{}: the program has no text", path.display())).into());
    };
    let again = understood(main, others.to_vec())?;
    let judged = judged(&rest, &stops, &again.places, &left)
        .map_err(|error| CompensateError::Input(format!("{}: {error}", path.display())))?;
    let figures = ProgramFigures {
        files: rewritten.files.iter().map(|(file, _)| in_folder(folder, file).display().to_string()).collect(),
        corrected: rewritten.replaced.len(),
        ..judged
    };
    let uncovered = uncovered(&rest, &stops, scenario);
    let files = rewritten.files.into_iter().map(|(file, bytes)| (in_folder(folder, &file), bytes)).collect();
    Ok((Corrected { figures, files }, uncovered))
}

/// Returns the moves with targets and their times. Planned moves are in the same order; a move
/// without a planned leg finds the arm already there.
fn stops<'a>(program: &'a Understood, scenario: &Scenario) -> Vec<Stop<'a>> {
    let planned = scenario.motion.tool_path.as_ref().map_or(&[][..], |path| &path.moves[..]);
    let mut next = 0;
    let mut now = [0.0; 2];
    let mut stops = Vec::new();
    for (item, (what, q)) in program.text.program.items.iter().zip(&program.places).enumerate() {
        let (Item::Move(of), Some(q)) = (what, q) else { continue };
        let leg = planned.get(next).filter(|leg| leg.place == of.place && leg.statement == of.statement);
        if let Some(leg) = leg {
            next += 1;
            let end = planned.get(next).map_or_else(|| scenario.duration_s(), |leg| leg.span_s[0]);
            now = if leg.blend_m > 0.0 { [leg.span_s[1]; 2] } else { [leg.span_s[1], end.max(leg.span_s[1])] };
        }
        stops.push(Stop { item, of, q, rest_s: now });
    }
    stops
}

/// Computes the residuals at the targets, before and after.
fn judged(
    rest: &AtRest<'_>,
    stops: &[Stop<'_>],
    again: &[Option<DVector<f64>>],
    left: &[(usize, String)],
) -> Result<ProgramFigures, NoCorrection> {
    // Deviation of the TCP at each stop, of the original and of the corrected program.
    let off = |stop: &Stop<'_>| {
        let now = again.get(stop.item).and_then(Option::as_ref).ok_or(NoCorrection::OtherMoves)?;
        Ok([rest.off(stop, stop.q)?, rest.off(stop, now)?])
    };
    let off: Vec<[Vector6<f64>; 2]> = stops.par_iter().map(off).collect::<Result<_, NoCorrection>>()?;
    let loaded = stops.iter().filter(|stop| rest.acts(stop.rest_s)).count();
    let mut figures = ProgramFigures { targets: stops.len(), loaded, ..ProgramFigures::default() };
    let size = |v: &Vector6<f64>, first: usize| v.fixed_rows::<3>(first).norm();
    // Maxima: position in the first three components, orientation in the last. Targets that are left
    // uncorrected do not count in the residual; the first of them are named.
    for (stop, [before, after]) in stops.iter().zip(off) {
        figures.before_m = figures.before_m.max(size(&before, 0));
        match left.iter().find(|(left, _)| *left == stop.item) {
            None => {
                figures.residual_m = figures.residual_m.max(size(&after, 0));
                figures.residual_rad = figures.residual_rad.max(size(&after, 3));
            }
            Some((_, why)) if figures.left.len() < NAMED => figures.left.push(LeftTarget {
                line: stop.of.place.line.unwrap_or(0),
                statement: stop.of.statement.clone(),
                why: why.clone(),
                residual_m: size(&after, 0),
            }),
            Some(_) => {}
        }
    }
    Ok(figures)
}

/// Lists, as sentences, the effects of loads and servos that the targets do not cover.
fn uncovered(rest: &AtRest<'_>, stops: &[Stop<'_>], scenario: &Scenario) -> Vec<String> {
    // Without loads only the servos matter.
    let mut notes = Vec::new();
    if rest.sags {
        notes.push(
            "servos without integral action have a steady-state error: the targets of the program do not correct it"
                .to_owned(),
        );
    }
    if !rest.is_loaded() {
        return notes;
    }
    if scenario.motion.tool_path.is_none() {
        notes.push(
            "the times at which the motion reaches its targets are unknown: the loads at the start are used".to_owned(),
        );
    }
    notes.push(
        "the program does not correct for loads between the targets: each target is corrected for the loads that \
         act while the arm is there"
            .to_owned(),
    );
    // Targets at which the loads are not constant.
    let passed = stops.iter().filter(|stop| stop.rest_s[1] <= stop.rest_s[0] && rest.acts(stop.rest_s)).count();
    if passed > 0 {
        notes.push(format!(
            "targets passed without a stop: {passed}; they are corrected for the loads at the time of passing"
        ));
    }
    let changing = stops.iter().filter_map(|stop| Some((rest.change(stop.rest_s)?, &stop.of.place)));
    let changing: Vec<(f64, &Place)> = changing.filter(|(change, _)| *change > CHANGES).collect();
    if let Some((worst, place)) = changing.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        notes.push(format!(
            "at {} targets the loads change while the arm is there, most at {place} (up to {:.0} % of the \
             maximum from the mean): the correction uses the mean load",
            changing.len(),
            100.0 * worst
        ));
    }
    notes
}

/// Returns the path of a file of the program in the output folder.
pub(super) fn in_folder(folder: &Path, file: &Path) -> PathBuf {
    folder.join(FOLDER).join(file.file_name().unwrap_or_default())
}

/// Replaces characters that some controllers reject.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' }).collect()
}

/// New values for a target, and for an auxiliary point.
type TargetValues = (NewTarget, Option<Vector3<f64>>);

/// The arm at rest: the rigid arm of the controller and the flexible one.
struct AtRest<'a> {
    arm: &'a ProgramArm<'a>,
    /// Flexible arm with motors held; each load is replaced by its mean over the rest at that time.
    fixed: Plant,
    /// Payload changes, in order of time.
    changes: Vec<InertiaChange>,
    tcp: Frame,
    components: [bool; 6],
    /// Original loads.
    loads: Vec<AppliedLoad>,
    /// Whether a servo lacks an integral term and so sags under load.
    sags: bool,
}

impl<'a> AtRest<'a> {
    /// Prepares the arm with its motors held and the mean loads of the rests.
    ///
    /// * `rests`: of all stops, in order of time (s).
    fn new(
        arm: &Arc<Arm>,
        controller: &'a ProgramArm<'a>,
        scenario: &Scenario,
        request: &CompensateRequest,
        rests: Vec<[f64; 2]>,
    ) -> Result<Self, Error> {
        let fixed = Held(vec![0.0; controller.model.n_actuated()]);
        let fixed = arm.plant(Arc::new(fixed)).map_err(|error| arm.explained(error))?;
        let sags = fixed.servo.iter().flat_map(|servo| &servo.axes).any(|axis| axis.integral_gain <= 0.0);
        let rests: Arc<[[f64; 2]]> = rests.into();
        let mean = |load: &AppliedLoad| {
            let rests = rests.clone();
            averaged(load, scenario.duration_s(), move |t| {
                rests.get(rests.partition_point(|rest| rest[0] < t)).filter(|rest| rest[0] == t).copied()
            })
        };
        let loads = scenario.loads.iter().map(mean).collect();
        let acting = Scenario { loads, ..scenario.clone() }.acting_on(arm.robot(), &fixed.model)?;
        let fixed = fixed.with_motors_held();
        let fixed = fixed.with_timed_loads(acting.loads).map_err(|error| arm.explained(error))?;
        let (tcp, loads) = (arm.tcp.clone(), scenario.loads.clone());
        Ok(Self { arm: controller, fixed, changes: acting.changes, tcp, components: request.components, loads, sags })
    }

    fn is_loaded(&self) -> bool {
        !(self.loads.is_empty() && self.changes.is_empty())
    }

    /// Returns the wrenches of all loads at sampling times of a rest (or at its single time).
    fn samples(&self, [from, to]: [f64; 2]) -> impl Iterator<Item = Vec<Wrench>> {
        let at = move |k: u32| from + (to - from) * (f64::from(k) + 0.5) / f64::from(SAMPLES);
        (0..SAMPLES).map(move |k| self.loads.iter().map(|load| load.wrench.at(at(k))).collect())
    }

    /// Whether a load or a changed payload acts during a rest.
    fn acts(&self, rest_s: [f64; 2]) -> bool {
        let pulls = |load: &Wrench| load.force.norm() + load.torque.norm() > 0.0;
        self.changes.iter().any(|change| change.t <= rest_s[0])
            || self.samples(rest_s).any(|loads| loads.iter().any(pulls))
    }

    /// Returns the maximum deviation of loads from their mean during a rest, relative to their
    /// maximum; `None` if no load acts.
    fn change(&self, rest_s: [f64; 2]) -> Option<f64> {
        let all: Vec<Vec<Wrench>> = self.samples(rest_s).collect();
        let each = (0..self.loads.len()).filter_map(|k| {
            let mean = all.iter().fold(Wrench::zeros(), |sum, F| sum + F[k] * (1.0 / f64::from(SAMPLES)));
            let largest = all.iter().map(|F| F[k].force.norm()).fold(0.0, f64::max);
            let off = all.iter().map(|F| (F[k].force - mean.force).norm()).fold(0.0, f64::max);
            (largest > 0.0).then(|| off / largest)
        });
        each.reduce(f64::max)
    }

    /// Returns the arm with its payload at a time.
    fn carrying(&self, t: f64) -> Plant {
        let due = self.changes.iter().take_while(|change| change.t <= t);
        due.fold(self.fixed.clone(), |plant, change| plant.with_inertia(change.body, change.inertia))
    }

    /// Returns the tool frame of a move on the flexible arm.
    fn tool(&self, of: &Move) -> Frame {
        let X_FT = of.X_FT.unwrap_or(self.arm.X_FT);
        Frame { X_BF: self.tcp.X_BF * self.arm.X_FT.inverse() * X_FT, ..self.tcp.clone() }
    }

    /// Returns the pose of a move's tool on the rigid arm.
    fn rigid(&self, of: &Move, q: &DVector<f64>) -> Pose {
        let mut data = Data::new(self.arm.model);
        forward_kinematics(self.arm.model, &mut data, q);
        data.X_WF(&tool_of(self.arm, of))
    }

    /// Returns the joint positions at which the flexible TCP is at the pose of the rigid one at
    /// `q`.
    fn joints(&self, stop: &Stop<'_>, q: &DVector<f64>) -> Result<DVector<f64>, TargetError> {
        let m = self.arm.model.n_actuated();
        let (own, t) = (&q.as_slice()[..m], stop.rest_s[0]);
        let (arm, tool) = (self.carrying(t), self.tool(stop.of));
        let found = static_targets(&arm, &tool, own, &Wrench::zeros(), t, &self.components)?;
        let mut new = q.clone();
        new.rows_mut(0, m).copy_from_slice(&found.q);
        Ok(new)
    }

    /// Computes the new values of a target, and of an auxiliary point.
    fn target(&self, stop: &Stop<'_>) -> Result<TargetValues, NoCorrection> {
        let (of, q) = (stop.of, stop.q);
        let target = match target_at(self.arm, of, &self.joints(stop, q)?) {
            Target::Joints(values) => NewTarget::Joints(values),
            Target::Pose { X_BT, configuration } => NewTarget::Pose { X_BT, configuration },
        };
        let MoveKind::Arc { via, .. } = &of.kind else { return Ok((target, None)) };
        // The arm at the auxiliary point with the orientation of the end: the deflection hardly
        // depends on orientation.
        let X_MB = base_of(self.arm, of);
        let at = X_MB * nalgebra::Point3::from(*via);
        let X = Pose::from_parts(Translation3::from(at.coords), self.rigid(of, q).rotation);
        let (model, frame) = (self.arm.model, tool_of(self.arm, of));
        let q_via = inverse_kinematics(model, &mut Data::new(model), &frame, &X, q, &IkOptions::default());
        let q_via = q_via.map_err(NoCorrection::AuxiliaryPoint)?;
        let moved = self.rigid(of, &self.joints(stop, &q_via)?).translation.vector;
        Ok((target, Some((X_MB.inverse() * nalgebra::Point3::from(moved)).coords)))
    }

    /// Returns the displacement of the flexible TCP at the given joint positions from the rigid TCP
    /// at the intended ones.
    fn off(&self, stop: &Stop<'_>, q: &DVector<f64>) -> Result<Vector6<f64>, StepError> {
        let m = self.arm.model.n_actuated();
        let t = stop.rest_s[0];
        let fixed = self.carrying(t).along(Arc::new(Held(q.as_slice()[..m].to_vec())));
        let at = linearise(&fixed, &self.tool(stop.of), &Wrench::zeros(), t)?;
        let wanted = self.rigid(stop.of, stop.q);
        let p = at.X_WT.translation.vector - wanted.translation.vector;
        let r = rotation_vector((at.X_WT.rotation * wanted.rotation.inverse()).matrix());
        let all = Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z);
        Ok(Vector6::from_fn(|k, _| if self.components[k] { all[k] } else { 0.0 }))
    }
}
