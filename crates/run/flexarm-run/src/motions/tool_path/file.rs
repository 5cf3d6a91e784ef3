//! Path files: TCP moves in TOML, recognised by the table `[path]`.
//!
//! Start at [`read_path_file`]. Units become SI here. Frames: W controller's world, B base of the
//! path, T tool, F flange. Docs: `docs/motions.md`. Not here: tables as written (`tables`),
//! standard motions (`standard`), planning (`flexarm_path`).

use std::path::Path;

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_kinematics::{Data, NullSpaceRule, Pose, forward_kinematics};
use flexarm_path::program::{Blend, Configuration, Item, Move, MoveKind, Program, Speed, Target};
use flexarm_path::{ControllerAxis, PathOptions, ProgramArm, check_axes, check_rate};
use flexarm_programs::{GCodeOptions, ReadOptions, Rotary};
use flexarm_settings::{Place, exact};
use flexarm_trajectory::Trajectory;
use nalgebra::{DVector, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use toml::Spanned;

use super::program::plan_program;
use super::standard::Step;
use super::tables::{FrameTable, MoveTable, PathFile, PathTable, ProgramTable, Redundancy, StandardTable};
use super::{Cell, Overrides, ToolPath};
use crate::error::Error;

/// Maximum rise time of accelerations (s).
const LONGEST_RISE: f64 = 100.0;
/// G-code work frames that are placed in the base of the path.
const WORK_FRAMES: [&str; 6] = ["G54", "G55", "G56", "G57", "G58", "G59"];

/// Returns whether the text is a path file rather than a list of waypoints.
pub(crate) fn is_path_file(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("path"))
        || text.lines().any(|line| line.trim() == "[path]")
}

/// Factors from the units of a file to SI.
#[derive(Clone, Copy)]
struct Units {
    length: f64,
    angle: f64,
}

/// Converts the tables of a file to moves.
struct Reader<'a> {
    source: &'a Source,
    units: Units,
    common: &'a PathTable,
    X_WB: Pose,
    X_FT: Option<Pose>,
    arm: &'a ProgramArm<'a>,
    /// Axis convention of the controller for programs; the path file itself uses joint values.
    controller: Vec<ControllerAxis>,
}

/// Reads a path file and plans its motion.
///
/// # Errors
/// [`Error::RobotFile`] with line and column of an invalid entry; [`Error::Path`] if the arm cannot
/// follow the path.
pub(crate) fn read_path_file(
    path: &Path,
    text: &str,
    cell: &Cell<'_>,
) -> Result<(flexarm_trajectory::Trajectory, ToolPath), Error> {
    let source = Source::new(path, text, "path");
    let file: PathFile = toml::Deserializer::parse(text).and_then(exact).map_err(|error| {
        let message = format!("{}; docs/motions.md has all keys of path files", error.message());
        source.unread(error.span(), &message)
    })?;
    if *file.format.get_ref() != 1 {
        return Err(source.error(file.format.span(), "format must be 1").into());
    }
    // The arm with the limits of the file, and the frames of the path.
    let units = units(&file.path, &source)?;
    let overrides = overrides(&file, &source, cell, units)?;
    let (arm, mut assumed) = cell.arm(&overrides);
    if file.path.tool.is_none() && file.program.is_none() {
        assumed.flange = None;
    }
    let notes = assumed.warnings();
    let frame = |table: &Option<Spanned<FrameTable>>| {
        table.as_ref().map(|table| frame_of(table.get_ref(), units, &source, table.span())).transpose()
    };
    let reader = Reader {
        source: &source,
        units,
        common: &file.path,
        X_WB: frame(&file.path.base)?.unwrap_or_else(Pose::identity),
        X_FT: frame(&file.path.tool)?,
        arm: &arm,
        controller: cell.controller_axes(&arm.axes),
    };

    // A robot program, a standard motion, or moves.
    if let Some(table) = &file.program {
        if file.standard.is_some() || !file.moves.is_empty() {
            let message = "[program] is a motion of its own: leave out [standard] and the [[move]]s, or it";
            return Err(source.error(table.span(), message).into());
        }
        return reader.program(table, &options(&file, &arm, units, &source)?, notes);
    }
    let items = match &file.standard {
        None => reader.items(&file.moves)?,
        Some(standard) if file.moves.is_empty() => reader.standard(standard)?,
        Some(standard) => {
            let message = "[standard] is a motion of its own: leave out either it or the [[move]]s";
            return Err(source.error(standard.span(), message).into());
        }
    };
    let program = Program { name: path.display().to_string(), items, ..Program::default() };
    ToolPath::plan(path, &program, &arm, &options(&file, &arm, units, &source)?, notes)
}

/// Returns the options for resolving the path.
fn options(
    file: &PathFile,
    arm: &ProgramArm<'_>,
    units: Units,
    source: &Source,
) -> Result<PathOptions, RobotFileError> {
    let mut options = PathOptions::default();
    if let Some(rise) = &file.path.rise {
        if !(*rise.get_ref() > 0.0 && *rise.get_ref() <= LONGEST_RISE) {
            let message = format!("rise is {}, expected a time above 0 and up to {LONGEST_RISE} s", rise.get_ref());
            return Err(source.error(rise.span(), message));
        }
        options.rise_s = *rise.get_ref();
    }
    if let Some(given) = &file.path.redundancy {
        options.rule = match given.get_ref() {
            Redundancy::Word(word) if word == "hold" => None,
            Redundancy::Word(word) if word == "away-from-limits" => Some(NullSpaceRule::AwayFromLimits),
            // A posture in the units of the file, for the joints that move the tool.
            Redundancy::Posture(values) if values.len() == arm.axes.len() && check_axes(values).is_ok() => {
                let mut posture = arm.rest.clone();
                for (value, &k) in values.iter().zip(&arm.axes) {
                    let slides = arm.model.coordinates()[k].slides();
                    posture[k] = value * if slides { units.length } else { units.angle };
                }
                Some(NullSpaceRule::NearestTo(posture))
            }
            found => {
                let found = match found {
                    Redundancy::Word(word) => format!("{word:?}"),
                    Redundancy::Posture(values) => format!("{} joint values", values.len()),
                };
                let message = format!(
                    "redundancy is {found}: expected \"hold\", \"away-from-limits\" or {} joint values to stay near to",
                    arm.axes.len()
                );
                return Err(source.error(given.span(), message));
            }
        };
    }
    Ok(options)
}

/// Returns the units that the file declares.
fn units(path: &PathTable, source: &Source) -> Result<Units, RobotFileError> {
    let length = match path.lengths.get_ref().as_str() {
        "m" => 1.0,
        "mm" => 1e-3,
        other => return Err(source.error(path.lengths.span(), format!("lengths = {other:?}: give \"m\" or \"mm\""))),
    };
    let angle = match path.angles.get_ref().as_str() {
        "rad" => 1.0,
        "deg" => std::f64::consts::PI / 180.0,
        other => return Err(source.error(path.angles.span(), format!("angles = {other:?}: give \"deg\" or \"rad\""))),
    };
    Ok(Units { length, angle })
}

/// Returns the limits of `[limits]` per coordinate.
fn overrides(file: &PathFile, source: &Source, cell: &Cell<'_>, units: Units) -> Result<Overrides, RobotFileError> {
    let coordinates = cell.model.coordinates();
    let none = vec![None; cell.model.nv()];
    let mut overrides =
        Overrides { velocities: none.clone(), accelerations: none.clone(), jerks: none.clone(), torques: none };
    for (joint, limits) in &file.limits {
        let Some(k) = coordinates.iter().position(|c| c.joint == *joint.get_ref()) else {
            let names: Vec<&str> = coordinates.iter().map(|c| c.joint.as_str()).collect();
            let message = format!("the robot has no joint {:?}; its joints are {}", joint.get_ref(), names.join(", "));
            return Err(source.error(joint.span(), message));
        };
        let unit = if coordinates[k].slides() { units.length } else { units.angle };
        let value = |key: &str, value: &Option<Spanned<f64>>, factor: f64| match value {
            Some(value) if check_rate("", "", value.get_ref() * factor).is_err() => {
                let (joint, found) = (joint.get_ref(), value.get_ref());
                let message = format!(
                    "limits: {key} of joint {joint:?} is {found:?}, expected a positive number, neither tiny nor huge; leave it \
                     out to keep the robot's own"
                );
                Err(source.error(value.span(), message))
            }
            value => Ok(value.as_ref().map(|value| value.get_ref() * factor)),
        };
        overrides.velocities[k] = value("velocity", &limits.velocity, unit)?;
        overrides.accelerations[k] = value("acceleration", &limits.acceleration, unit)?;
        overrides.jerks[k] = value("jerk", &limits.jerk, unit)?;
        overrides.torques[k] = value("torque", &limits.torque, 1.0)?;
    }
    Ok(overrides)
}

/// Returns the pose of a frame.
fn frame_of(
    table: &FrameTable,
    units: Units,
    source: &Source,
    span: std::ops::Range<usize>,
) -> Result<Pose, RobotFileError> {
    let R = rotation(table.rpy, table.quaternion, units).map_err(|error| source.error(span, error.to_string()))?;
    let p = Vector3::from(table.xyz) * units.length;
    Ok(Pose::from_parts(Translation3::from(p), R.unwrap_or_else(Rotation3::identity)))
}

/// Converts roll, pitch, yaw about fixed axes x, y, z (as in URDF) or a quaternion w, x, y, z.
fn rotation(
    rpy: Option<[f64; 3]>,
    quaternion: Option<[f64; 4]>,
    units: Units,
) -> Result<Option<Rotation3<f64>>, String> {
    match (rpy, quaternion) {
        (Some(_), Some(_)) => Err("give rpy or quaternion, not both".into()),
        (Some([r, p, y]), None) => {
            Ok(Some(Rotation3::from_euler_angles(r * units.angle, p * units.angle, y * units.angle)))
        }
        (None, Some([w, x, y, z])) => {
            let q = Quaternion::new(w, x, y, z);
            if (q.norm() - 1.0).abs() > 1e-3 {
                return Err(format!(
                    "quaternion = [w, x, y, z] has the length {length:.6}: it must be 1",
                    length = q.norm()
                ));
            }
            Ok(Some(UnitQuaternion::from_quaternion(q).to_rotation_matrix()))
        }
        (None, None) => Ok(None),
    }
}

/// Kinds of `[[move]]`.
const KINDS: &str = "a move needs one of joints, joint_to, line, arc, spline, dwell";

impl Reader<'_> {
    /// Converts the `[[move]]`s.
    fn items(&self, moves: &[Spanned<MoveTable>]) -> Result<Vec<Item>, RobotFileError> {
        let mut items = Vec::new();
        // Orientation of the tool in the base at the end of the last move.
        let mut R: Option<Rotation3<f64>> = None;
        for table in moves {
            let entry = table.get_ref();
            self.only_one(table)?;
            if let Some(seconds) = &entry.dwell {
                items.push(Item::Dwell { place: self.place(table), seconds: *seconds.get_ref() });
            } else if let Some(points) = &entry.spline {
                self.spline(table, points, &mut R, &mut items)?;
            } else {
                items.push(Item::Move(self.one(table, &mut R)?));
            }
        }
        Ok(items)
    }

    /// Returns the place of a table in the file.
    fn place<T>(&self, at: &Spanned<T>) -> Place {
        self.source.error(at.span(), "").place()
    }

    /// Returns the orientation of the tool that a table gives, if it gives one.
    fn orientation<T>(
        &self,
        table: &Spanned<T>,
        rpy: Option<[f64; 3]>,
        quaternion: Option<[f64; 4]>,
    ) -> Result<Option<Rotation3<f64>>, RobotFileError> {
        rotation(rpy, quaternion, self.units).map_err(|error| self.source.error(table.span(), error.to_string()))
    }

    /// Checks that a move has exactly one kind.
    fn only_one(&self, table: &Spanned<MoveTable>) -> Result<(), RobotFileError> {
        let entry = table.get_ref();
        let given = [
            ("joints", entry.joints.is_some()),
            ("joint_to", entry.joint_to.is_some()),
            ("line", entry.line.is_some()),
            ("arc", entry.arc.is_some()),
            ("spline", entry.spline.is_some()),
            ("dwell", entry.dwell.is_some()),
        ];
        let given: Vec<&str> = given.iter().filter(|(_, is_given)| *is_given).map(|(name, _)| *name).collect();
        match given.as_slice() {
            [_] => Ok(()),
            [] => Err(self.source.error(table.span(), KINDS)),
            several => {
                let message = format!("a move is one of {}: give one [[move]] for each", several.join(" and "));
                Err(self.source.error(table.span(), message))
            }
        }
    }

    /// Converts a move to one target.
    ///
    /// * `R`: orientation of the tool in B at the end of the last move; becomes that of this one.
    fn one(&self, table: &Spanned<MoveTable>, R: &mut Option<Rotation3<f64>>) -> Result<Move, RobotFileError> {
        let entry = table.get_ref();
        // Joint values fix the pose; every other kind has a point and perhaps an orientation.
        let (word, kind, point) = if let Some(values) = &entry.joints {
            let q = self.joint_values(values.get_ref());
            *R = Some(self.orientation_at(&q, values)?);
            let statement = format!("joints = {:?}", values.get_ref());
            return Ok(self.of(table, &statement, MoveKind::Joint, Target::Joints(q)));
        } else if let Some(point) = &entry.joint_to {
            ("joint_to", MoveKind::Joint, point)
        } else if let Some(point) = &entry.line {
            ("line", MoveKind::Line, point)
        } else if let Some(point) = &entry.arc {
            let Some(via) = &entry.via else {
                return Err(self.source.error(point.span(), "an arc needs via = [x, y, z], a point on its way"));
            };
            let kind = MoveKind::Arc {
                via: Vector3::from(*via.get_ref()) * self.units.length,
                via_rotation: None,
                angle: entry.angle.map(|angle| angle * self.units.angle),
                turns_with_path: entry.turns_with_path.unwrap_or(false),
            };
            ("arc", kind, point)
        } else {
            return Err(self.source.error(table.span(), KINDS));
        };

        // The orientation stays until a move gives another one.
        let quaternion = entry.quaternion.as_ref().map(|q| *q.get_ref());
        let given = self.orientation(table, entry.rpy, quaternion)?;
        let turned = given.or(*R).ok_or_else(|| {
            let message =
                "the orientation of the tool is not known yet: give rpy or quaternion, or begin with a move joints";
            self.source.error(table.span(), message)
        })?;
        *R = Some(turned);
        let p = Vector3::from(*point.get_ref()) * self.units.length;
        let near = entry.near.as_ref();
        let configuration =
            near.map_or(Configuration::NEAREST, |values| Configuration::Near(self.joint_values(values)));
        let X_BT = Pose::from_parts(Translation3::from(p), turned);
        let statement = format!("{word} = {:?}", point.get_ref());
        Ok(self.of(table, &statement, kind, Target::Pose { X_BT, configuration }))
    }

    /// Adds a move to each point of a spline; only the last one may stop.
    fn spline(
        &self,
        table: &Spanned<MoveTable>,
        points: &Spanned<Vec<Vec<f64>>>,
        R: &mut Option<Rotation3<f64>>,
        items: &mut Vec<Item>,
    ) -> Result<(), RobotFileError> {
        let n = points.get_ref().len();
        for (k, point) in points.get_ref().iter().enumerate() {
            // Points of three values keep the orientation.
            let turned = match point.len() {
                3 => *R,
                6 => rotation(Some([point[3], point[4], point[5]]), None, self.units).unwrap_or_default(),
                found => {
                    let message =
                        format!("point {} has {found} values: give x, y, z or x, y, z, roll, pitch, yaw", k + 1);
                    return Err(self.source.error(points.span(), message));
                }
            };
            let turned = turned.ok_or_else(|| {
                self.source
                    .error(points.span(), "the orientation of the tool is not known yet: give points of six values")
            })?;
            *R = Some(turned);
            let p = Vector3::new(point[0], point[1], point[2]) * self.units.length;
            let X_BT = Pose::from_parts(Translation3::from(p), turned);
            let to = Target::Pose { X_BT, configuration: Configuration::NEAREST };
            let mut piece = self.of(table, &format!("spline through {point:?}"), MoveKind::Spline, to);
            if k + 1 < n {
                piece.blend = Blend::Pass;
            }
            items.push(Item::Move(piece));
        }
        Ok(())
    }

    /// Plans a robot program; speeds and frames in the program take precedence over those in this
    /// file.
    fn program(
        &self,
        table: &Spanned<ProgramTable>,
        resolution: &PathOptions,
        notes: Vec<String>,
    ) -> Result<(Trajectory, ToolPath), Error> {
        // The program is next to this file.
        let entry = table.get_ref();
        let file = self.source.path.parent().unwrap_or(Path::new("")).join(entry.file.get_ref());
        if !file.is_file() {
            let message = format!("there is no program {}", file.display());
            return Err(self.source.error(entry.file.span(), message).into());
        }

        // Values that the program leaves undefined.
        let R = self.orientation(table, entry.rpy, entry.quaternion)?;
        let mut gcode = GCodeOptions {
            offsets: WORK_FRAMES.iter().map(|code| ((*code).to_owned(), self.X_WB)).collect(),
            machine: self.X_WB,
            rotary: if entry.tilt { Rotary::Tilt } else { Rotary::Refused },
            rapid_m_s: entry.rapid.map(|speed| speed * self.units.length),
            tip_is_known: entry.tip_is_known,
            ..GCodeOptions::default()
        };
        gcode.R_BT = R.unwrap_or(gcode.R_BT);
        if let Some(speed) = gcode.rapid_m_s {
            let out = |error| self.source.error(table.span(), format!("rapid: {error}"));
            check_rate("the speed of rapids", "m/s", speed).map_err(out)?;
        }
        let options = ReadOptions {
            entry: entry.entry.clone(),
            start: entry.start.as_ref().map(|values| self.joint_values(values)),
            given: entry.given.clone().into_iter().collect(),
            waits_are_over: entry.waits_are_over,
            endless_passes: entry.endless_passes,
            gcode,
            ..ReadOptions::default()
        };
        let bytes = flexarm_trajectory::bytes_of_file(&file)?;

        // The arm with the axes of the controller, at the start of the program.
        let mut arm = self.arm.clone();
        arm.controller.clone_from(&self.controller);
        if let Some(start) = &options.start {
            if start.len() != arm.axes.len() {
                let message =
                    format!("start has {} values for the {} joints that move the tool", start.len(), arm.axes.len());
                return Err(self.source.error(table.span(), message).into());
            }
            check_axes(start).map_err(|error| self.source.error(table.span(), format!("start: {error}")))?;
            let mut rest = arm.rest.clone();
            arm.set_axes(start, &mut rest);
            arm.rest = rest;
            arm.starts_at_rest = true;
        }
        arm.X_FT = self.X_FT.unwrap_or(arm.X_FT);
        let given = |program: &mut Program| self.fill(program);
        plan_program(&file, &bytes, &arm, &options, resolution, notes, &given)
    }

    /// Fills in the speeds that the program leaves open.
    fn fill(&self, program: &mut Program) {
        let common = self.speed(None);
        for item in &mut program.items {
            let Item::Move(of) = item else { continue };
            let speed = &mut of.speed;
            speed.linear_m_s = speed.linear_m_s.or(common.linear_m_s);
            speed.linear_m_s2 = speed.linear_m_s2.or(common.linear_m_s2);
            speed.linear_m_s3 = speed.linear_m_s3.or(common.linear_m_s3);
            speed.angular_rad_s = speed.angular_rad_s.or(common.angular_rad_s);
            speed.angular_rad_s2 = speed.angular_rad_s2.or(common.angular_rad_s2);
            speed.joint_fraction = speed.joint_fraction.or(common.joint_fraction);
            let part = common.joint_acceleration_fraction;
            speed.joint_acceleration_fraction = speed.joint_acceleration_fraction.or(part);
        }
    }

    /// Converts a standard motion to moves and rests.
    fn standard(&self, table: &Spanned<StandardTable>) -> Result<Vec<Item>, RobotFileError> {
        let entry = table.get_ref();
        let place = self.place(table);
        let R = self.orientation(table, entry.rpy, entry.quaternion)?;
        let R = R.ok_or_else(|| self.source.error(table.span(), "give the tool's orientation: rpy or quaternion"))?;
        let side = *entry.side.get_ref() * self.units.length;
        if !(side > 0.0 && side.is_finite()) {
            let message = format!("side is {}, it must be a positive length", entry.side.get_ref());
            return Err(self.source.error(entry.side.span(), message));
        }
        let (centre, repeats) = (Vector3::from(entry.centre) * self.units.length, entry.repeats.unwrap_or(1));
        if !(1..=1000).contains(&repeats) {
            return Err(self.source.error(table.span(), "repeats must be 1 to 1000"));
        }
        let steps = entry.motion.steps(centre, side, R, repeats);
        let count = steps.len();
        let item = |(k, step): (usize, Step)| {
            let (kind, X_BT) = match step {
                Step::Rest(seconds) => return Item::Dwell { place: place.clone(), seconds },
                Step::To(kind, X_BT) => (kind, X_BT),
            };
            let configuration = match (&entry.near, &kind) {
                (Some(values), MoveKind::Joint) => Configuration::Near(self.joint_values(values)),
                _ => Configuration::NEAREST,
            };
            // The halves of a circle are joined without a stop.
            let passes = matches!(kind, MoveKind::Arc { .. }) && k + 1 < count;
            let blend = if passes { Blend::Pass } else { self.blend(None) };
            let statement = format!("step {k} of the standard motion");
            let (speed, to) = (self.speed(None), Target::Pose { X_BT, configuration });
            let place = place.clone();
            Item::Move(Move { place, statement, kind, to, X_WB: self.X_WB, X_FT: self.X_FT, speed, blend })
        };
        Ok(steps.into_iter().enumerate().map(item).collect())
    }

    /// Converts values of the controller's axes to SI units.
    fn joint_values(&self, values: &[f64]) -> Vec<f64> {
        let unit = |k: usize| {
            let coordinate = self.arm.axes.get(k).map(|&k| &self.arm.model.coordinates()[k]);
            if coordinate.is_some_and(|c| c.slides()) { self.units.length } else { self.units.angle }
        };
        values.iter().enumerate().map(|(k, value)| value * unit(k)).collect()
    }

    /// Returns the orientation of the tool in the base at joint values.
    fn orientation_at(&self, values: &[f64], at: &Spanned<Vec<f64>>) -> Result<Rotation3<f64>, RobotFileError> {
        let axes = self.arm.axes.len();
        if values.len() != axes {
            let message = format!("{} values for the {axes} joints that move the tool", values.len());
            return Err(self.source.error(at.span(), message));
        }
        let mut q: DVector<f64> = self.arm.rest.clone();
        for (value, &k) in values.iter().zip(&self.arm.axes) {
            q[k] = *value;
        }
        let mut data = Data::new(self.arm.model);
        forward_kinematics(self.arm.model, &mut data, &q);
        let X_FT = self.X_FT.unwrap_or(self.arm.X_FT);
        let X = data.X_WF(&self.arm.flange) * X_FT;
        Ok((self.arm.X_MW * self.X_WB).rotation.inverse() * X.rotation)
    }

    /// Builds a move; speed and blend are those of the table.
    fn of(&self, table: &Spanned<MoveTable>, statement: &str, kind: MoveKind, to: Target) -> Move {
        let entry = table.get_ref();
        let place = self.place(table);
        let (speed, blend) = (self.speed(Some(entry)), self.blend(entry.blend));
        Move { place, statement: statement.to_owned(), kind, to, X_WB: self.X_WB, X_FT: self.X_FT, speed, blend }
    }

    /// Returns the speed of a move, with defaults from `[path]`.
    fn speed(&self, entry: Option<&MoveTable>) -> Speed {
        let (common, Units { length, angle }) = (self.common, self.units);
        let given = |of: fn(&MoveTable) -> Option<f64>| entry.and_then(of);
        Speed {
            linear_m_s: given(|e| e.speed).or(common.speed).map(|v| v * length),
            linear_m_s2: given(|e| e.acceleration).or(common.acceleration).map(|v| v * length),
            linear_m_s3: given(|e| e.jerk).or(common.jerk).map(|v| v * length),
            angular_rad_s: given(|e| e.turning).or(common.turning).map(|v| v * angle),
            angular_rad_s2: given(|e| e.turning_acceleration).or(common.turning_acceleration).map(|v| v * angle),
            joint_fraction: given(|e| e.joint_speed).or(common.joint_speed),
            joint_acceleration_fraction: given(|e| e.joint_acceleration).or(common.joint_acceleration),
            joint_rad_s: None,
            joint_rad_s2: None,
            duration_s: given(|e| e.duration),
        }
    }

    /// Returns the blend at the end of a move, by default that of `[path]`.
    fn blend(&self, given: Option<f64>) -> Blend {
        match given.or(self.common.blend) {
            None | Some(0.0) => Blend::Stop,
            Some(distance) => Blend::Distance(distance * self.units.length),
        }
    }
}
