//! Caveats about strengths, gauges, guides and calibrations of a robot file.
//!
//! Start at [`of_entries`]. SI units; places of gauges in link axes. Not here: entries with an error
//! (`robot/*_entry.rs`).

use std::ops::RangeInclusive;

use nalgebra::Vector3;

use super::size::Size;
use super::slip::{self, outside, slip};
use super::{Finding, kinds};
use crate::robot::Robot;
use crate::robot::calibration_entry::Calibration;
use crate::robot::gauge_entry::Gauge;
use crate::robot::robot_link::RobotLink;

/// Range of yield and tensile strength, from plastics to drawn wire (Pa).
const STRENGTH: RangeInclusive<f64> = 5e6..=4.5e9;
/// Range of the fatigue strength at a reversed stress over the tensile strength; metals have 0.3 to
/// 0.6.
const FATIGUE: RangeInclusive<f64> = 0.1..=0.7;
/// Minimum angle between the grids of a rosette (rad); rosettes have 45, 60 or 90 degrees.
const GRIDS: f64 = 5.0 / slip::DEGREES;
/// Maximum distance of a gauge from the axis of a beam over the size of its section; the corner of
/// a square has 0.71.
const ON_SECTION: f64 = 0.75;
/// Range of the tilt of a guide (rad) under the weight of the robot at its reach.
const TILT: RangeInclusive<f64> = 1e-7..=0.5;
/// Range of the transition of a guide's play, and limit of its centre, over the same moment.
const TRANSITION: RangeInclusive<f64> = 1e-4..=10.0;
/// Maximum calibration of a joint: shift (m) and angle (rad).
const CALIBRATION: [f64; 2] = [0.05, 0.05];
/// Maximum distance of the end of a guide's tube over the size of the robot.
const FAR: f64 = 1.5;

/// Returns all of these caveats.
pub(crate) fn of_entries(robot: &Robot) -> Vec<Finding> {
    let mut caveats: Vec<Finding> = robot.flexible_links.iter().flat_map(strength).collect();
    caveats.extend(robot.gauges.iter().flat_map(|gauge| of_gauge(gauge, &robot.flexible_links)));
    caveats.extend(of_guides(robot));
    caveats.extend(robot.calibration.iter().flat_map(calibration));
    caveats
}

/// Checks the strength of a link's material.
fn strength(link: &RobotLink) -> Vec<Finding> {
    let Some(strength) = &link.strength else { return Vec::new() };
    let name = |what: &str| format!("the {what} strength of link {:?}", link.flexible.link);
    let factors = &[(1e-6, "MPa"), (1e-9, "GPa"), (1e3, "GPa for MPa")];
    let mut caveats = Vec::new();
    caveats.extend(outside(&kinds::STRENGTH, name("yield"), strength.yield_pa, &STRENGTH, factors, 1.0));
    caveats.extend(outside(&kinds::STRENGTH, name("tensile"), strength.tensile_pa, &STRENGTH, factors, 1.0));
    if let Some(fatigue) = strength.fatigue_pa {
        let share = fatigue / strength.tensile_pa;
        let end = if share < *FATIGUE.start() { *FATIGUE.start() } else { *FATIGUE.end() };
        let likely = match (fatigue < 1.0, share < 1e-3) {
            (true, _) => "a ratio to the tensile strength?",
            (false, true) => "MPa?",
            _ => "",
        };
        let caveat = kinds::FATIGUE_STRENGTH.found(name("fatigue"), share, end).likely(likely);
        caveats.extend((!FATIGUE.contains(&share)).then_some(caveat));
    }
    caveats
}

/// Checks the angle of a grid and the place of a gauge on a beam.
fn of_gauge(gauge: &Gauge, links: &[RobotLink]) -> Vec<Finding> {
    let mut caveats = Vec::new();
    if let Some((_, angle)) = gauge.grid
        && angle != 0.0
        && angle.abs() < GRIDS
    {
        let caveat =
            kinds::GAUGE_ANGLE.found(format!("gauge {:?}", gauge.name), angle * slip::DEGREES, GRIDS * slip::DEGREES);
        caveats.push(caveat.likely("radians?"));
    }
    let Some(link) = links.iter().find(|link| link.flexible.link == gauge.link) else { return caveats };
    let Some(size) = link.beam.as_ref().and_then(|beam| beam.section.largest_size()) else { return caveats };
    let [from, to] = [link.flexible.reduced.X_LA, link.flexible.reduced.X_LB].map(|X| X.translation.vector);
    let axis = to - from;
    if axis.norm() > 0.0 {
        // Distance from the nearest point of the axis within the beam.
        let distance = |place: &Vector3<f64>| {
            let at = place - from;
            let along = (at.dot(&axis) / axis.norm_squared()).clamp(0.0, 1.0);
            (at - axis * along).norm()
        };
        let off = distance(&gauge.at);
        let range = 0.0..=ON_SECTION * size;
        let likely = match range.contains(&distance(&(gauge.at * 1e-3))) {
            true => "millimetres?".to_owned(),
            false => slip(off, &range, slip::LENGTH, 1.0),
        };
        let caveat = kinds::GAUGE_PLACE.found(format!("gauge {:?}", gauge.name), off, ON_SECTION * size).likely(likely);
        caveats.extend((off > ON_SECTION * size).then_some(caveat));
    }
    caveats
}

/// Checks the guides of telescopic joints against size and weight of the robot.
fn of_guides(robot: &Robot) -> Vec<Finding> {
    // The moment of the whole weight at full reach, for which the tilts are judged.
    let size = Size::of(&robot.rigid);
    let moment = 9.81 * size.mass * size.extent;
    let mut caveats = Vec::new();
    for drive in &robot.drives {
        let Some(tubes) = drive.guide() else { continue };
        let name = |what: &str| format!("{what} of the guide of joint {:?}", drive.joint);
        let far = FAR * size.extent.max(1.0);
        for (what, end) in [("outer_end", tubes.outer_end), ("inner_end", tubes.inner_end)] {
            caveats.extend(outside(&kinds::GUIDE_END, name(what), end, &(-far..=far), slip::LENGTH, 1.0));
        }
        let Some(joint) = robot.rigid.joint(&drive.joint) else { continue };
        let tilts = drive.gearbox.iter().flat_map(|(_, damping)| &damping.tilts);
        for tilt in tilts {
            // Tilt under that moment at the largest overlap of the tubes.
            let name = |what: &str| name(&format!("{}.{what}", tilt.axis));
            let ends = [joint.limits.lower, joint.limits.upper].into_iter().filter(|q| q.is_finite());
            let overlap = ends.map(|q| tubes.overlap(q)).fold(tubes.overlap(0.0).abs(), f64::max);
            let [c0, c1, c2] = tilt.compliance;
            let angle = moment * (c0 + c1 / overlap + c2 / (overlap * overlap));
            let factors =
                &[(1e-3, "compliance per kN m"), (1e3, "compliance per N mm or in mrad"), (slip::DEGREES, "degrees")];
            caveats.extend(outside(&kinds::GUIDE_TILT, name("compliance"), angle, &TILT, factors, 1.0));
            let Some(play) = tilt.play else { continue };
            let limits = TRANSITION.start() * moment..=TRANSITION.end() * moment;
            let units = &[(1e-3, "kN m"), (1e3, "N mm")];
            caveats.extend(outside(&kinds::GUIDE_PLAY, name("play.width"), play.width, &limits, units, 1.0));
            let centred = -TRANSITION.end() * moment..=TRANSITION.end() * moment;
            caveats.extend(outside(&kinds::GUIDE_PLAY, name("play.centre"), play.centre, &centred, units, 1.0));
        }
    }
    caveats
}

/// Checks the size of a calibration.
fn calibration(of: &Calibration) -> Vec<Finding> {
    let name = |what: &str| format!("{what} of the calibration of joint {:?}", of.joint);
    let [most_m, most_rad] = CALIBRATION;
    let values = [
        ("zero", of.zero.abs(), most_rad, slip::ANGLE),
        ("rpy", of.frame.rotation.angle(), most_rad, slip::ANGLE),
        ("xyz", of.frame.translation.vector.norm(), most_m, slip::LENGTH),
    ];
    let judge = |(what, value, most, factors): (&str, f64, f64, &[slip::Factor])| {
        outside(&kinds::CALIBRATION, name(what), value, &(0.0..=most), factors, 1.0)
    };
    values.into_iter().filter_map(judge).collect()
}
