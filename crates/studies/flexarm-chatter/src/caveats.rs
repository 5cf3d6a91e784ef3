//! Caveats about cutting tools: plausible ranges of diameter, frequency, stiffness and damping.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use flexarm_run::Finding;
use flexarm_run::caveat::FindingKind;
use flexarm_run::caveat::slip::{self, Factor};

use crate::CuttingTool;

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
const MASS: RangeInclusive<f64> = 1e-3..=1e3;
const ENGAGEMENT: RangeInclusive<f64> = 0.06..=TAU + 1e-9;
const DEEPEST: RangeInclusive<f64> = 2e-3..=20.0;
const DIAMETER: RangeInclusive<f64> = 1e-4..=0.5;
const FREQUENCY: RangeInclusive<f64> = 20.0..=1e5;
const STIFFNESS: RangeInclusive<f64> = 1e4..=1e10;
const DAMPING: RangeInclusive<f64> = 1e-4..=0.3;

const TOO_FAST: &[Factor] = &[(1e-3, "kHz"), (TAU, "rad/s"), (60.0, "1/min")];
const TOO_SOFT: &[Factor] = &[(1e-6, "N/um"), (1e-3, "N/mm")];
const TOO_DAMPED: &[Factor] = &[(100.0, "per cent")];

/// Returns the caveats about properties of a tool outside the usual ranges.
pub fn tool_caveats(tool: &CuttingTool) -> Vec<Finding> {
    let name = format!("the tool {:?}", tool.name);
    let mut found = Vec::new();
    let mut check = |kind: &FindingKind, whose: &str, value: f64, usual: &RangeInclusive<f64>, factors: &[Factor]| {
        if !usual.contains(&value) {
            let yardstick = if value < *usual.start() { *usual.start() } else { *usual.end() };
            found.push(kind.found(whose, value, yardstick).likely(slip::slip(value, usual, factors, 1.0)));
        }
    };
    check(&TOOL_DIAMETER, &name, tool.cutter.diameter, &DIAMETER, slip::LENGTH);
    check(&TOOL_TEETH, &name, tool.cutter.teeth as f64, &TEETH, &[]);
    let arc = tool.cutter.engagement.exit - tool.cutter.engagement.entry;
    check(&TOOL_ENGAGEMENT, &name, arc, &ENGAGEMENT, &[]);
    check(&TOOL_DEEPEST, &name, tool.deepest / tool.cutter.diameter, &DEEPEST, slip::LENGTH);
    for (k, mode) in tool.modes.iter().enumerate() {
        let whose = format!("mode {} of {name}", k + 1);
        check(&TOOL_FREQUENCY, &whose, mode.omega / TAU, &FREQUENCY, TOO_FAST);
        check(&TOOL_STIFFNESS, &whose, mode.mass * mode.omega * mode.omega, &STIFFNESS, TOO_SOFT);
        check(&TOOL_MASS, &whose, mode.mass, &MASS, &[(1e3, "grams"), (1e-3, "tonnes")]);
        check(&TOOL_DAMPING, &whose, mode.damping_ratio, &DAMPING, TOO_DAMPED);
    }
    found
}
