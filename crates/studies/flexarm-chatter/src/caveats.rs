//! Caveats about cutting tools: plausible ranges of diameter, frequency, stiffness and damping.
//!
//! Start at [`tool_caveats`] and [`feed_caveat`]. Not here: values that are refused
//! ([`super::tool_file`]).

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use flexarm_run::caveat::slip::{self, DEGREES, Factor, outside};
use flexarm_run::caveat::{FindingKind, UNUSUAL};
use flexarm_run::{Error, Finding, Motion, Robot};

use crate::CuttingTool;
use crate::place::{STANDS, tip_motion};

/// Diameter of a cutter outside the usual range.
const TOOL_DIAMETER: FindingKind = FindingKind::warning(
    "tool-diameter",
    "the cutter of {where} has a diameter of {value} m, the usual range ends at {yardstick} m",
    "m",
    "check diameter and lengths in the tool file",
);
/// Natural frequency of a tool's mode outside the usual range.
const TOOL_FREQUENCY: FindingKind = FindingKind::warning(
    "tool-frequency",
    "{where} has a natural frequency of {value} Hz, the usual range of tools and spindles ends at {yardstick} Hz",
    "Hz",
    "frequencies of modes are in Hz",
);
/// Stiffness of a tool's mode outside the usual range.
const TOOL_STIFFNESS: FindingKind = FindingKind::warning(
    "tool-stiffness",
    "{where} has a stiffness of {value} N/m, the usual range of tools and spindles ends at {yardstick} N/m",
    "N/m",
    "the stiffness of a mode is in N/m, its mass in kg",
);
/// Damping ratio of a tool's mode outside the usual range.
const TOOL_DAMPING: FindingKind = FindingKind::warning(
    "tool-damping",
    "{where} has a damping ratio of {value}, the usual range of tools and spindles ends at {yardstick}",
    "",
    "damping is a ratio: 3 per cent is 0.03",
);

/// Number of teeth that no milling cutter has.
const TOOL_TEETH: FindingKind = FindingKind::warning(
    "tool-teeth",
    "the cutter of {where} has {value} teeth, milling cutters end at {yardstick}",
    "",
    "teeth is the number of teeth on the circumference",
);
/// Modal mass of a tool outside the usual range.
const TOOL_MASS: FindingKind = FindingKind::warning(
    "tool-mass",
    "{where} has a modal mass of {value} kg, the usual range of tools and spindles ends at {yardstick} kg",
    "kg",
    "mass and stiffness of a mode belong together: k = m (2 pi f)^2",
);
/// Arc of engagement so small that hardly anything is cut.
const TOOL_ENGAGEMENT: FindingKind = FindingKind::warning(
    "tool-engagement",
    "a tooth of {where} cuts over {value} rad of a turn, the usual range ends at {yardstick} rad",
    "rad",
    "ae is in the lengths of the file, immersion is a ratio to the diameter",
);
/// Maximum depth of the search far below the diameter.
const TOOL_DEEPEST: FindingKind = FindingKind::warning(
    "tool-deepest",
    "limits of {where} are sought up to {value} times its diameter only, less than {yardstick}",
    "",
    "deepest is in the lengths of the file",
);

const TEETH: RangeInclusive<f64> = 1.0..=100.0;
/// Density of steel times the cube of the diameter, the scale of the mass of a cutter: a slender one
/// has a modal mass of 0.3 of it, spindles have up to 1000 kg.
const STEEL: f64 = 7850.0;
const MIN_MASS: f64 = 0.15;
const MAX_MASS: f64 = 1e3;
const ENGAGEMENT: RangeInclusive<f64> = 0.06..=TAU + 1e-9;
const DEEPEST: RangeInclusive<f64> = 2e-3..=20.0;
const DIAMETER: RangeInclusive<f64> = 1e-4..=0.5;
const FREQUENCY: RangeInclusive<f64> = 20.0..=1e5;
const STIFFNESS: RangeInclusive<f64> = 1e4..=1e10;
const DAMPING: RangeInclusive<f64> = 1e-3..=0.3;
/// Radial and axial cutting coefficient over the tangential one.
const COEFFICIENT: RangeInclusive<f64> = 0.0..=3.0;
/// Helix and lead angles other than 0 (degrees); cutters for high feed have leads of 10.
const CUTTING_ANGLE: RangeInclusive<f64> = 4.0..=90.5;
/// Distance of the tip from the TCP (m).
const TIP: RangeInclusive<f64> = 0.0..=5.0;
/// Maximum feed per tooth over the diameter; high feeds have 0.05.
const FEED: f64 = 0.1;

const TOO_FAST: &[Factor] = &[(1e-3, "kHz"), (TAU, "rad/s"), (60.0, "1/min")];
const TOO_SOFT: &[Factor] = &[(1e-6, "N/um"), (1e-3, "N/mm")];
const TOO_LIGHT: &[Factor] = &[(1e3, "grams"), (1.0 / (TAU * TAU), "frequency in rad/s"), (1e-3, "tonnes")];
const TOO_SHALLOW: &[Factor] = &[(1e-3, "metres, where the file has millimetres"), (1e3, "millimetres")];
const TOO_DAMPED: &[Factor] = &[(100.0, "per cent")];

/// Returns the caveats about properties of a tool outside the usual ranges.
///
/// * `deepest_m`: maximum depth of the search (m).
pub fn tool_caveats(tool: &CuttingTool, deepest_m: f64) -> Vec<Finding> {
    // The cutter: sizes, engagement, coefficients, angles.
    let name = format!("the tool {:?}", tool.name);
    let named = |what: &str| format!("{what} of {name}");
    let cutter = &tool.cutter;
    let arc = cutter.engagement.exit - cutter.engagement.entry;
    let k = &cutter.coefficients;
    let (share, angle) = (UNUSUAL, UNUSUAL.with_unit("degrees"));
    let radians: &[Factor] = &[(1.0 / DEGREES, "radians")];
    let mut found: Vec<Finding> = [
        outside(&TOOL_DIAMETER, &*name, cutter.diameter, &DIAMETER, slip::LENGTH, 1.0),
        outside(&TOOL_TEETH, &*name, cutter.teeth as f64, &TEETH, &[], 1.0),
        outside(&TOOL_ENGAGEMENT, &*name, arc, &ENGAGEMENT, &[], 1.0),
        outside(&TOOL_DEEPEST, &*name, deepest_m / cutter.diameter, &DEEPEST, TOO_SHALLOW, 1.0),
        outside(
            &share,
            named("the radial over the tangential coefficient"),
            k.radial / k.tangential,
            &COEFFICIENT,
            &[],
            1.0,
        ),
        outside(
            &share,
            named("the axial over the tangential coefficient"),
            k.axial.abs() / k.tangential,
            &COEFFICIENT,
            &[],
            1.0,
        ),
        outside(&angle, named("the lead"), cutter.lead.to_degrees(), &CUTTING_ANGLE, radians, 1.0),
        outside(&UNUSUAL.with_unit("m"), named("the tip"), tool.tip.norm(), &TIP, slip::LENGTH, 1.0),
    ]
    .into_iter()
    .flatten()
    .collect();
    if cutter.helix != 0.0 {
        found.extend(outside(&angle, named("the helix"), cutter.helix.to_degrees(), &CUTTING_ANGLE, radians, 1.0));
    }
    // Each mode.
    let masses = MIN_MASS * STEEL * cutter.diameter.powi(3)..=MAX_MASS;
    for (k, mode) in tool.modes.iter().enumerate() {
        let whose = format!("mode {} of {name}", k + 1);
        let stiffness = mode.mass * mode.omega * mode.omega;
        found.extend(outside(&TOOL_FREQUENCY, &*whose, mode.omega / TAU, &FREQUENCY, TOO_FAST, 1.0));
        found.extend(outside(&TOOL_STIFFNESS, &*whose, stiffness, &STIFFNESS, TOO_SOFT, 1.0));
        found.extend(outside(&TOOL_MASS, &*whose, mode.mass, &masses, TOO_LIGHT, 1.0));
        found.extend(outside(&TOOL_DAMPING, &*whose, mode.damping_ratio, &DAMPING, TOO_DAMPED, 1.0));
    }
    found
}

/// Number of instants of a motion at which the feed is sampled.
const INSTANTS: usize = 101;

/// Returns a caveat if a tool advances too far from one tooth to the next, at its highest spindle
/// speed and its median speed along a motion.
///
/// # Errors
/// [`Error`] if the motion is not one of the robot.
pub fn feed_caveat(robot: &Robot, tool: &CuttingTool, motion: &Motion) -> Result<Option<Finding>, Error> {
    // Median speed while the tool moves, over the teeth per second at the highest spindle speed.
    let speeds = tip_motion(robot, tool, motion, INSTANTS)?.into_iter().map(|at| at.velocity.norm());
    let mut speeds: Vec<f64> = speeds.filter(|speed| *speed > STANDS).collect();
    speeds.sort_by(f64::total_cmp);
    let (Some(speed), Some(rpm)) = (speeds.get(speeds.len() / 2), tool.rpm.last()) else { return Ok(None) };
    let feed = speed / (rpm / 60.0 * tool.cutter.teeth as f64);
    let range = 0.0..=FEED * tool.cutter.diameter;
    let name = format!("the feed per tooth of the tool {:?} along the motion", tool.name);
    let factors = &[(60.0, "mm/min for mm/s, or spindle speed in 1/s")];
    Ok(outside(&UNUSUAL.with_unit("m"), name, feed, &range, factors, 1.0))
}
