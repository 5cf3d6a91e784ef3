//! Conversion between program targets and joint values: [`target_joints`] and, back, [`target_at`].
//!
//! Both are for programs whose targets are changed, such as those of a compensation. Not here: the
//! joints between the targets ([`crate::plan`]).

use flexarm_kinematics::{AnalyticArm, Data, Selection, forward_kinematics, kuka_turn};
use flexarm_settings::Finding;
use nalgebra::DVector;

use crate::arm::{PathOptions, ProgramArm, base_of, tool_of};
use crate::legs::{Legs, Start, spline_group};
use crate::program::{Configuration, Item, Move, MoveKind, Program, Target};

/// Returns the joints at the target of each item, even if a blend passes it; `None` for dwells and
/// for arcs with a given angle, which do not end at their target.
///
/// # Errors
/// As [`crate::plan`].
pub fn target_joints(
    program: &Program,
    arm: &ProgramArm<'_>,
    options: &PathOptions,
) -> Result<Vec<Option<DVector<f64>>>, Box<Finding>> {
    let items = &program.items;
    let mut legs = Legs::new(arm, options, None);
    let mut start = Start::of(program, arm)?;
    let mut found = vec![None; items.len()];
    // Item by item, as a plan does; a spline has several items.
    let mut k = 0;
    while k < items.len() {
        let Item::Move(of) = &items[k] else {
            k += 1;
            continue;
        };
        let group = spline_group(items, k);
        if group.is_empty() {
            legs.leg(of, &mut start)?;
            let ends_there = !matches!(of.kind, MoveKind::Arc { angle: Some(_), .. });
            found[k] = ends_there.then(|| start.q.clone());
            k += 1;
            continue;
        }
        // A knot at the current position has no leg of its own.
        let mut at = start.q.clone();
        let mut pieces = legs.spline(&group, &mut start)?.into_iter().peekable();
        for of in &group {
            if pieces.peek().is_some_and(|leg| leg.of == **of) {
                at = pieces.next().map_or(at, |leg| leg.q1);
            }
            found[k] = Some(at.clone());
            k += 1;
        }
    }
    Ok(found)
}

/// Returns the target of a move that ends at the given joint values, in the form of the old one:
/// axis values, or a pose with its branch.
pub fn target_at(arm: &ProgramArm<'_>, of: &Move, q: &DVector<f64>) -> Target {
    if let Target::Joints(old) = &of.to {
        let mut values = arm.axis_values(q);
        values.truncate(old.len());
        return Target::Joints(values);
    }
    // Pose of the tool in the base of the move.
    let frame = tool_of(arm, of);
    let mut data = Data::new(arm.model);
    forward_kinematics(arm.model, &mut data, q);
    let X_BT = base_of(arm, of).inverse() * data.X_WF(&frame);
    // The branch in the words of the old target.
    let Target::Pose { configuration, .. } = &of.to else { return of.to.clone() };
    let configuration = match (configuration, AnalyticArm::new(arm.model, &frame)) {
        (Configuration::Selected(Selection::Kuka { status, turn }), Ok(analytic)) => {
            let (counted, six) = (arm.controller_axes(*analytic.joints()), analytic.joints().map(|k| q[k]));
            // Other bits of the old word do not concern the branch and are kept.
            let found = analytic.kuka_status(&six, &counted);
            let status = status.map(|old| found.map_or(old, |found| old & !7 | found));
            let turn = turn.map(|old| old & !63 | kuka_turn(&six, &counted));
            Configuration::Selected(Selection::Kuka { status, turn })
        }
        (Configuration::Selected(Selection::Abb { .. }), Ok(analytic)) => {
            let (counted, six) = (arm.controller_axes(*analytic.joints()), analytic.joints().map(|k| q[k]));
            let found = analytic.abb_configuration(&six, &counted);
            let selected = |(quadrants, cfx)| Configuration::Selected(Selection::Abb { quadrants, cfx });
            found.map_or(configuration.clone(), selected)
        }
        (Configuration::Near(_), _) => Configuration::Near(arm.axis_values(q)),
        (other, _) => other.clone(),
    };
    Target::Pose { X_BT, configuration }
}
