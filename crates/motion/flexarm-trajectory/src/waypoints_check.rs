//! Converts a waypoint file to a [`Plan`]: units, defaults, limits, and all checks that report a
//! place in the file.
//!
//! Start at [`check`]. The plan makes the remaining checks (missing limits, repeated points) and
//! reports the number of the move.

use std::fmt::Display;
use std::ops::Range;

use flexarm_settings::Finding;
use toml::Spanned;

use crate::curve::LONGEST;
use crate::findings::{self, fault, unknown_format, unknown_unit};
use crate::limits::JointLimits;
use crate::plan::{MotionLimits, Plan, PlannedMove, Profile};
use crate::polynomial::FARTHEST;
use crate::trajectory::StatedUnit;
use crate::waypoints_toml::{FileToml, LawToml, MoveToml, ProfileToml, Values};

/// Default rounding of trapezoids.
const DEFAULT_ROUNDING: f64 = 0.1;

/// An error and its byte offset in the file.
pub(crate) struct Located {
    pub(crate) offset: Option<usize>,
    pub(crate) fault: Box<Finding>,
}

/// The plan, a limit that does not suit the others, and the offset of each move in the text.
pub(crate) struct Checked {
    pub(crate) plan: Plan,
    pub(crate) unusual_limit: Option<Finding>,
    pub(crate) move_offsets: Vec<usize>,
}

fn located(span: Range<usize>, fault: Box<Finding>) -> Located {
    Located { offset: Some(span.start), fault }
}

pub(crate) fn bad_value(span: Range<usize>, key: &str, found: impl Display, expected: &'static str) -> Located {
    located(span, findings::bad_value(key, found, expected))
}

/// Converts and checks the file.
pub(crate) fn check(file: &FileToml, known: &[(&str, JointLimits)]) -> Result<Checked, Located> {
    let format = *file.format.get_ref();
    if format != 1 {
        return Err(located(file.format.span(), unknown_format(format)));
    }
    let joints = joint_names(&file.joints)?;
    let context = Context { file, scales: scales(&file.unit, &file.metres, &joints)?, joints };
    let robot_limits = context.limits(known)?;

    let start = context.full(&file.start, "start")?;
    let mut here = start.clone();
    let mut moves = Vec::with_capacity(file.moves.len());
    for entry in &file.moves {
        let planned = context.planned_move(entry.get_ref(), &here, &robot_limits)?;
        here.clone_from(&planned.to);
        moves.push(planned);
    }
    let move_offsets = file.moves.iter().map(|entry| entry.span().start).collect();
    // Without the fraction of the speed at which a move is made.
    let of_joint = |(limits, (full, joint)): (&MotionLimits, (&MotionLimits, &String))| {
        let own = known.iter().find(|(name, _)| name == joint).map_or(f64::INFINITY, |(_, robot)| robot.velocity);
        MotionLimits { velocity: full.velocity, ..*limits }.unusual(joint, own)
    };
    let unusual_limit = moves.iter().find_map(|planned: &PlannedMove| {
        planned.limits.iter().zip(robot_limits.iter().zip(&context.joints)).find_map(of_joint)
    });
    Ok(Checked { plan: Plan { joints: context.joints, start, moves }, unusual_limit, move_offsets })
}

pub(crate) fn joint_names(joints: &Spanned<Vec<Spanned<String>>>) -> Result<Vec<String>, Located> {
    let entries = joints.get_ref();
    if entries.is_empty() {
        return Err(bad_value(joints.span(), "joints", "empty", "at least one joint name"));
    }
    let mut names: Vec<String> = Vec::with_capacity(entries.len());
    for entry in entries {
        let name = entry.get_ref();
        if name.is_empty() || names.contains(name) {
            let found = format!("{name:?}, empty or there already");
            return Err(bad_value(entry.span(), "joints", found, "different joint names"));
        }
        names.push(name.clone());
    }
    Ok(names)
}

/// Factor from the unit of the file to SI, per joint.
pub(crate) fn scales(
    unit: &Spanned<String>,
    metres: &[Spanned<String>],
    joints: &[String],
) -> Result<Vec<f64>, Located> {
    let angle = match unit.get_ref().as_str() {
        "rad" => 1.0,
        "deg" => std::f64::consts::PI / 180.0,
        found => {
            return Err(located(unit.span(), unknown_unit("unit", found, "\"rad\", \"deg\"")));
        }
    };
    for entry in metres {
        if !joints.contains(entry.get_ref()) {
            return Err(unknown_joint(entry, "metres", joints));
        }
    }
    let is_prismatic = |joint: &String| metres.iter().any(|entry| entry.get_ref() == joint);
    Ok(joints.iter().map(|joint| if is_prismatic(joint) { 1.0 } else { angle }).collect())
}

/// Units that a file states for its joints, with the lines of the statements.
pub(crate) fn stated_units(
    unit: &Spanned<String>,
    metres: &[Spanned<String>],
    joints: &Spanned<Vec<Spanned<String>>>,
    line: impl Fn(usize) -> usize,
) -> Vec<StatedUnit> {
    let stated = |name: &Spanned<String>| {
        let joint = name.get_ref().clone();
        match metres.iter().find(|entry| *entry.get_ref() == joint) {
            Some(entry) => Some(StatedUnit { joint, is_length: true, line: line(entry.span().start) }),
            None if unit.get_ref() == "deg" => {
                Some(StatedUnit { joint, is_length: false, line: line(unit.span().start) })
            }
            None => None,
        }
    };
    joints.get_ref().iter().filter_map(stated).collect()
}

fn unknown_joint(entry: &Spanned<String>, key: &'static str, joints: &[String]) -> Located {
    located(entry.span(), findings::unknown_joint(key, entry.get_ref(), joints))
}

/// Data shared by all moves.
struct Context<'a> {
    file: &'a FileToml,
    joints: Vec<String>,
    scales: Vec<f64>,
}

impl Context<'_> {
    /// A value for every joint, in SI.
    fn full(&self, values: &Spanned<Values>, key: &'static str) -> Result<Vec<f64>, Located> {
        match values.get_ref() {
            Values::List(list) => {
                let positions = self.list(list, values.span(), key)?;
                match positions.iter().position(|position| position.abs() > FARTHEST) {
                    Some(joint) => Err(self.out_of_range(values.span(), joint)),
                    None => Ok(positions),
                }
            }
            _ => Err(bad_value(values.span(), key, "not a list", "a list with one number per joint")),
        }
    }

    fn out_of_range(&self, span: Range<usize>, joint: usize) -> Located {
        let joint = &self.joints[joint];
        let message = format!("joint {joint:?} goes beyond {FARTHEST:e} rad or m; check the units of the file");
        located(span, fault("out-of-range", message))
    }

    fn list(&self, list: &[f64], span: Range<usize>, key: &'static str) -> Result<Vec<f64>, Located> {
        if list.len() != self.joints.len() {
            let (found, expected) = (list.len(), self.joints.len());
            let message = format!("`{key}` has {found} entries; expected {expected}, one for each of `joints`");
            return Err(located(span, fault("list-length", message)));
        }
        match list.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(bad_value(span, key, value, "finite numbers")),
            None => Ok(list.iter().zip(&self.scales).map(|(value, scale)| value * scale).collect()),
        }
    }

    /// Goal of a move; joints missing in a table stay in place.
    fn goal(&self, to: &Spanned<Values>, here: &[f64]) -> Result<Vec<f64>, Located> {
        let Values::Table(table) = to.get_ref() else {
            return self.full(to, "to");
        };
        let mut goal = here.to_vec();
        for (name, &value) in table {
            let Some(i) = self.joints.iter().position(|joint| joint == name.get_ref()) else {
                return Err(unknown_joint(name, "to", &self.joints));
            };
            if !value.is_finite() {
                return Err(bad_value(name.span(), "to", value, "finite numbers"));
            }
            goal[i] = value * self.scales[i];
            if goal[i].abs() > FARTHEST {
                return Err(self.out_of_range(name.span(), i));
            }
        }
        Ok(goal)
    }

    /// An acceleration or jerk limit for every joint, in SI.
    fn rates(&self, values: &Spanned<Values>, key: &'static str) -> Result<Vec<f64>, Located> {
        const EXPECTED: &str = "positive; one number, or one per joint";
        let span = values.span();
        let rates = match values.get_ref() {
            Values::List(list) => self.list(list, span.clone(), key)?,
            Values::One(_) if self.scales.iter().any(|scale| *scale != self.scales[0]) => {
                let expected = "a list with one number per joint, because `metres` gives the joints different units";
                return Err(bad_value(span, key, "one number", expected));
            }
            Values::One(value) => self.scales.iter().map(|scale| value * scale).collect(),
            Values::Table(_) => return Err(bad_value(span, key, "a table", EXPECTED)),
        };
        match rates.iter().all(|rate| *rate > 0.0 && rate.is_finite()) {
            true => Ok(rates),
            false => Err(bad_value(span, key, "not positive or not finite", EXPECTED)),
        }
    }

    /// Known limits of each joint regardless of the move: `[limits]` takes precedence over the
    /// caller's.
    fn limits(&self, known: &[(&str, JointLimits)]) -> Result<Vec<MotionLimits>, Located> {
        for name in self.file.limits.keys() {
            if !self.joints.contains(name.get_ref()) {
                return Err(unknown_joint(name, "limits", &self.joints));
            }
        }
        let usable = |value: f64| if value > 0.0 { value } else { f64::INFINITY };
        let mut limits = vec![MotionLimits::UNLIMITED; self.joints.len()];
        for ((limit, joint), scale) in limits.iter_mut().zip(&self.joints).zip(&self.scales) {
            // Limits of the robot; those of the file replace them.
            if let Some((_, robot)) = known.iter().find(|(name, _)| name == joint) {
                limit.velocity = usable(robot.velocity);
                limit.acceleration = usable(robot.acceleration);
                limit.jerk = usable(robot.jerk);
            }
            let Some((_, written)) = self.file.limits.iter().find(|(name, _)| name.get_ref() == joint) else {
                continue;
            };
            let overwrite = |limit: &mut f64, value: &Option<Spanned<f64>>, key: &str| {
                if let Some(value) = positive(value, key)? {
                    *limit = value * scale;
                }
                Ok(())
            };
            overwrite(&mut limit.velocity, &written.velocity, "velocity")?;
            overwrite(&mut limit.acceleration, &written.acceleration, "acceleration")?;
            overwrite(&mut limit.jerk, &written.jerk, "jerk")?;
        }
        Ok(limits)
    }

    fn planned_move(
        &self,
        entry: &MoveToml,
        here: &[f64],
        robot_limits: &[MotionLimits],
    ) -> Result<PlannedMove, Located> {
        let file = self.file;
        let to = self.goal(&entry.to, here)?;
        let via = entry.via.iter().map(|point| self.full(point, "via")).collect::<Result<_, _>>()?;
        let duration = positive(&entry.duration, "duration")?;
        if let Some(value) = entry.duration.as_ref().filter(|value| *value.get_ref() > LONGEST) {
            return Err(bad_value(value.span(), "duration", value.get_ref(), "1e7 s at most"));
        }
        let hold = match &entry.hold {
            Some(hold) if !(0.0..=LONGEST).contains(hold.get_ref()) => {
                return Err(bad_value(hold.span(), "hold", hold.get_ref(), "zero or positive, in s, 1e7 at most"));
            }
            hold => hold.as_ref().map_or(0.0, |hold| *hold.get_ref()),
        };

        // A value in the move takes precedence over one at the top of the file.
        let rounding = entry.rounding.as_ref().or(file.rounding.as_ref());
        let rounding = match rounding {
            Some(value) if !(0.0..=1.0).contains(value.get_ref()) => {
                return Err(bad_value(value.span(), "rounding", value.get_ref(), "from 0 (jumps) to 1"));
            }
            value => value.map_or(DEFAULT_ROUNDING, |value| *value.get_ref()),
        };
        let law = entry.law.or(file.law.filter(|_| entry.profile.is_none()));
        let profile = match entry.profile.or(file.profile) {
            _ if matches!(law, Some(LawToml::Optimal)) => Profile::Optimal,
            None | Some(ProfileToml::Quintic) => Profile::Quintic,
            Some(ProfileToml::Trapezoid) => Profile::Trapezoid { rounding },
            Some(ProfileToml::SCurve) => Profile::SCurve,
        };
        let synchronised = entry.synchronised.or(file.synchronised).unwrap_or(true);
        let limits = self.limits_of_move(entry, robot_limits)?;
        Ok(PlannedMove { to, via, duration, hold, profile, synchronised, limits })
    }

    fn limits_of_move(&self, entry: &MoveToml, robot_limits: &[MotionLimits]) -> Result<Vec<MotionLimits>, Located> {
        let speed = entry.speed.as_ref().or(self.file.speed.as_ref());
        let fraction = match speed {
            Some(value) if !(*value.get_ref() > 0.0 && *value.get_ref() <= 1.0) => {
                let expected = "a fraction of the velocity limits, above 0 and up to 1: 0.5 is half speed";
                return Err(bad_value(value.span(), "speed", value.get_ref(), expected));
            }
            value => value.map_or(1.0, |value| *value.get_ref()),
        };
        let mut limits = robot_limits.to_vec();
        for limit in &mut limits {
            limit.velocity *= fraction;
        }
        if let Some(values) = entry.acceleration.as_ref().or(self.file.acceleration.as_ref()) {
            let rates = self.rates(values, "acceleration")?;
            limits.iter_mut().zip(rates).for_each(|(limit, rate)| limit.acceleration = rate);
        }
        if let Some(values) = entry.jerk.as_ref().or(self.file.jerk.as_ref()) {
            let rates = self.rates(values, "jerk")?;
            limits.iter_mut().zip(rates).for_each(|(limit, rate)| limit.jerk = rate);
        }
        Ok(limits)
    }
}

/// A number that must be positive and finite if it is given.
fn positive(value: &Option<Spanned<f64>>, key: &str) -> Result<Option<f64>, Located> {
    match value {
        Some(value) if !(*value.get_ref() > 0.0 && value.get_ref().is_finite()) => {
            Err(bad_value(value.span(), key, value.get_ref(), "a positive number"))
        }
        value => Ok(value.as_ref().map(|value| *value.get_ref())),
    }
}
