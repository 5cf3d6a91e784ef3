//! A robot program whose targets are corrected for what the arm gives way at rest: the same statements with other numbers.
//!
//! Each literal target is replaced by the one that the controller, which knows a rigid arm, must be told so that the flexible tool
//! is at the old one. What was written is read again and held against the equilibria.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_kinematics::{
    Data, Frame, IkOptions, Pose, Wrench, forward_kinematics, inverse_kinematics, rotation_vector,
};
use flexarm_path::program::{Item, Move, MoveKind, Target};
use flexarm_path::{PathOptions, ProgramArm, base_of, target_at, target_joints, tool_of};
use flexarm_programs::{NewTarget, ProgramText};
use flexarm_stepping::{FlexibleArm, Held, linearise, static_targets};
use nalgebra::{DVector, Translation3, Vector3, Vector6};
use rayon::prelude::*;
use serde::Serialize;

use super::CompensateRequest;
use crate::arm::Arm;
use crate::error::Error;
use crate::motion::Motion;
use crate::robot::Robot;
use crate::tool_path::{Cell, Overrides, program_text};

/// Folder of the corrected program in the output folder.
pub(super) const FOLDER: &str = "program";
/// Moves that are named one by one.
const NAMED: usize = 20;

/// What became of the targets of a robot program.
#[derive(Clone, Debug, Serialize)]
pub struct ProgramFigures {
    /// The corrected program, and data lists that changed with it.
    pub files: Vec<String>,
    /// Targets that moves end at; dwells and arcs of a told angle have none.
    pub targets: usize,
    /// How many of them were replaced.
    pub corrected: usize,
    /// Largest distance of the flexible tool from its target at rest, with the program as it was (m).
    pub before_m: f64,
    /// The same of the replaced ones, with the program as it was written and read again (m).
    pub residual_m: f64,
    /// Largest rotation there (rad).
    pub residual_rad: f64,
    /// Those that stay as they were, the first of them.
    pub left: Vec<LeftTarget>,
}

/// A target that stays as it was.
#[derive(Clone, Debug, Serialize)]
pub struct LeftTarget {
    /// Line of the move.
    pub line: usize,
    /// The move.
    pub statement: String,
    /// Why.
    pub why: String,
    /// Distance of the flexible tool from its target at rest (m).
    pub residual_m: f64,
}

/// A corrected program before it is written.
pub(super) struct Corrected {
    pub(super) figures: ProgramFigures,
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
}

/// Whether a motion was read from a program whose targets can be replaced.
pub(super) fn is_program(motion: &Motion) -> bool {
    ["KRL", "RAPID"]
        .iter()
        .any(|language| motion.format.starts_with("robot program") && motion.format.contains(language))
}

/// The program of a motion with corrected targets.
pub(super) fn corrected(
    robot: &Robot,
    arm: &Arm,
    path: &Path,
    request: &CompensateRequest,
    folder: &Path,
) -> Result<Corrected, Error> {
    let bytes = flexarm_trajectory::bytes_of_file(path)?;
    let model = robot.rigid_model()?;
    let cell = Cell { model: &model, tcp_link: Some(&robot.tcp.0), hold: &robot.hold, controller: &robot.controller };
    let (mut controller, _) = cell.arm(&Overrides::default());
    controller.controller = cell.controller_axes(&controller.axes);
    let old = program_text(path, &bytes, &controller, Vec::new())?;
    let joints = |text: &ProgramText| {
        target_joints(&text.program, &controller, &PathOptions::default()).map_err(|source| Error::Path {
            path: path.to_owned(),
            source: Box::new(source),
            notes: Vec::new(),
        })
    };
    let places = joints(&old)?;
    let flexible = arm.flexible();
    let held = flexible.arm(Arc::new(Held(vec![0.0; model.n_actuated()]))).map_err(|e| flexible.explained(e))?;
    let rest = AtRest { arm: &controller, held, tcp: flexible.tcp.clone(), components: request.components };

    let moves: Vec<(usize, &Move, &DVector<f64>)> = old
        .program
        .items
        .iter()
        .zip(&places)
        .enumerate()
        .filter_map(|(k, (item, q))| if let (Item::Move(of), Some(q)) = (item, q) { Some((k, of, q)) } else { None })
        .collect();
    let found: Vec<Result<Told, String>> = moves.par_iter().map(|(_, of, q)| rest.target(of, q)).collect();
    let mut left: Vec<(usize, String)> = Vec::new();
    let mut targets = Vec::new();
    for ((k, ..), found) in moves.iter().zip(found) {
        match found {
            Ok((target, via)) => targets.push((*k, target, via)),
            Err(why) => left.push((*k, why)),
        }
    }
    let comment = format!("targets corrected by flexarm for {}: the arm gives way at rest", plain(&robot.name));
    let rewritten = old.rewritten(&targets, &comment);
    left.extend(rewritten.left.iter().map(|(k, why)| (*k, (*why).to_owned())));

    // What was written, as the controller will understand it.
    let [(_, main), others @ ..] = &rewritten.files[..] else {
        return Err(Error::File { path: path.to_owned(), what: "the program has no text".into() });
    };
    let new = program_text(path, main, &controller, others.to_vec())?;
    let again = joints(&new)?;
    let off: Vec<Result<[Vector6<f64>; 2], String>> = moves
        .par_iter()
        .map(|(k, of, q)| {
            let now = again.get(*k).and_then(Option::as_ref).ok_or("the corrected program has other moves")?;
            Ok([rest.off(of, q, q)?, rest.off(of, q, now)?])
        })
        .collect();
    let mut figures = ProgramFigures {
        files: rewritten.files.iter().map(|(file, _)| in_folder(folder, file).display().to_string()).collect(),
        targets: moves.len(),
        corrected: rewritten.replaced.len(),
        before_m: 0.0,
        residual_m: 0.0,
        residual_rad: 0.0,
        left: Vec::new(),
    };
    let size = |v: &Vector6<f64>, first: usize| v.fixed_rows::<3>(first).norm();
    for ((k, of, _), off) in moves.iter().zip(off) {
        let [before, after] = off.map_err(|what| Error::File { path: path.to_owned(), what })?;
        figures.before_m = figures.before_m.max(size(&before, 0));
        match left.iter().find(|(left, _)| left == k) {
            None => {
                figures.residual_m = figures.residual_m.max(size(&after, 0));
                figures.residual_rad = figures.residual_rad.max(size(&after, 3));
            }
            Some((_, why)) if figures.left.len() < NAMED => figures.left.push(LeftTarget {
                line: of.line,
                statement: of.statement.clone(),
                why: why.clone(),
                residual_m: size(&after, 0),
            }),
            Some(_) => {}
        }
    }
    let files = rewritten.files.into_iter().map(|(file, bytes)| (in_folder(folder, &file), bytes)).collect();
    Ok(Corrected { figures, files })
}

/// Where a file of the program goes.
pub(super) fn in_folder(folder: &Path, file: &Path) -> PathBuf {
    folder.join(FOLDER).join(file.file_name().unwrap_or_default())
}

/// Letters that every controller takes.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' }).collect()
}

/// What a program must say in the place of a target, and of an auxiliary point.
type Told = (NewTarget, Option<Vector3<f64>>);

/// The arm at rest, as its controller and as the world sees it.
struct AtRest<'a> {
    arm: &'a ProgramArm<'a>,
    held: FlexibleArm,
    tcp: Frame,
    components: [bool; 6],
}

impl AtRest<'_> {
    /// The tool of a move on the flexible arm.
    fn tool(&self, of: &Move) -> Frame {
        let X_FT = of.X_FT.unwrap_or(self.arm.X_FT);
        Frame { X_BF: self.tcp.X_BF * self.arm.X_FT.inverse() * X_FT, ..self.tcp.clone() }
    }

    fn rigid(&self, of: &Move, q: &DVector<f64>) -> Pose {
        let mut data = Data::new(self.arm.model);
        forward_kinematics(self.arm.model, &mut data, q);
        data.X_WF(&tool_of(self.arm, of))
    }

    /// Joints with which the flexible tool is where the rigid one is.
    fn joints(&self, of: &Move, q: &DVector<f64>) -> Result<DVector<f64>, String> {
        let m = self.arm.model.n_actuated();
        let own = &q.as_slice()[..m];
        let found = static_targets(&self.held, &self.tool(of), own, &Wrench::zeros(), 0.0, &self.components);
        let mut new = q.clone();
        new.rows_mut(0, m).copy_from_slice(&found.map_err(|error| error.to_string())?.q);
        Ok(new)
    }

    /// What the program must say in the place of a target, and of an auxiliary point.
    fn target(&self, of: &Move, q: &DVector<f64>) -> Result<Told, String> {
        let target = match target_at(self.arm, of, &self.joints(of, q)?) {
            Target::Joints(values) => NewTarget::Joints(values),
            Target::Pose { X_BT, configuration } => NewTarget::Pose { X_BT, configuration },
        };
        let MoveKind::Arc { via, .. } = &of.kind else { return Ok((target, None)) };
        // The arm at the auxiliary point, turned as at the end: what it gives way hardly depends on that.
        let X_MB = base_of(self.arm, of);
        let at = X_MB * nalgebra::Point3::from(*via);
        let X = Pose::from_parts(Translation3::from(at.coords), self.rigid(of, q).rotation);
        let (model, frame) = (self.arm.model, tool_of(self.arm, of));
        let q_via = inverse_kinematics(model, &mut Data::new(model), &frame, &X, q, &IkOptions::default());
        let q_via = q_via.map_err(|error| format!("its auxiliary point is not reached: {error}"))?;
        let moved = self.rigid(of, &self.joints(of, &q_via)?).translation.vector;
        Ok((target, Some((X_MB.inverse() * nalgebra::Point3::from(moved)).coords)))
    }

    /// Displacement of the flexible tool at joints from where the rigid one is at the joints that were meant.
    fn off(&self, of: &Move, meant: &DVector<f64>, q: &DVector<f64>) -> Result<Vector6<f64>, String> {
        let m = self.arm.model.n_actuated();
        let held = self.held.along(Arc::new(Held(q.as_slice()[..m].to_vec())));
        let at = linearise(&held, &self.tool(of), &Wrench::zeros(), 0.0).map_err(|error| error.to_string())?;
        let wanted = self.rigid(of, meant);
        let p = at.X_WT.translation.vector - wanted.translation.vector;
        let r = rotation_vector((at.X_WT.rotation * wanted.rotation.inverse()).matrix());
        let all = Vector6::new(p.x, p.y, p.z, r.x, r.y, r.z);
        Ok(Vector6::from_fn(|k, _| if self.components[k] { all[k] } else { 0.0 }))
    }
}
